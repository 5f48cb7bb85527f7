//! Parts of recordings that are damaged, cut off, longer, or of another run, and the checkpoint that counts their messages.

use std::fs;

use percuss_output::part_of;
use tempfile::TempDir;

use super::*;
use crate::{
    case::Case,
    recording::{Compression, Destination},
    session::{Observer, Recorded, Recording, Source, Status, Steps},
    simulation::Simulation,
};

/// What an interrupted run has left.
struct Left {
    _folder: TempDir,
    case: Case,
    destination: Destination,
    part: Vec<u8>,
    /// What its checkpoint, in the middle of it, says.
    recorded: Recorded,
}

/// A recorded message: channel, number, time, bytes.
type Message = (u16, u32, u64, Vec<u8>);

fn messages(part: &[u8]) -> Vec<Message> {
    let messages = mcap::MessageStream::new(part).expect("a sound file");
    let messages = messages.map(|message| message.expect("a sound message"));
    messages.map(|m| (m.channel.id, m.sequence, m.log_time, m.data.into_owned())).collect()
}

impl Left {
    fn new(compression: Compression, settings: &[&str]) -> Self {
        let name = serde_json::to_value(compression).expect("a name");
        let settings: Vec<String> = ["mesh.cells=12", "run.end_time=4", "record.views=[]", "record.frames=4"]
            .iter()
            .chain(settings)
            .map(|&setting| setting.to_owned())
            .chain([format!("record.compression={name}")])
            .collect();
        let case = Case::load("fig5", &settings).expect("a case");
        let folder = tempfile::tempdir().expect("a folder");
        let destination =
            Destination { reproducible: true, ..Destination::new(folder.path().join("a.mcap")) };
        let mut recording = Recording::create(&destination, &case, Source::Simulation).expect("room");
        let (mut simulation, mut recorded) = (Simulation::new(&case), None);
        while let Some(view) = simulation.step().expect("a sound case") {
            recording.observe(&view).expect("room");
            if view.step % 4 == 3 && view.step < case.sizes.steps - 4 {
                recorded = Some(recording.seal().expect("room"));
            }
        }
        recording.end(&Status::Interrupted("here".into()), &simulation.validity()).expect("room");
        let part = fs::read(part_of(&destination.path)).expect("a part");
        Self { _folder: folder, case, destination, part, recorded: recorded.expect("a checkpoint") }
    }

    /// Continues from a part that is a changed one: its messages, or why it is refused and stays as it is.
    fn resume(&self, part: &[u8]) -> Result<Vec<Message>, String> {
        let path = part_of(&self.destination.path);
        fs::write(&path, part).expect("room");
        match Recording::resume(&self.destination, &self.case, &self.recorded) {
            Ok(mut recording) => {
                let validity = Simulation::new(&self.case).validity();
                recording.end(&Status::Interrupted("again".into()), &validity).expect("room");
                let mut messages = messages(&fs::read(&path).expect("a part"));
                // the log says how it has ended
                messages.pop();
                Ok(messages)
            }
            Err(error) => {
                assert!(fs::read(&path).expect("a part") == part, "{error}");
                assert_eq!(
                    fs::read_dir(path.parent().expect("a folder")).expect("a folder").count(),
                    1,
                    "{error}"
                );
                Err(error.to_string())
            }
        }
    }

    fn expected(&self) -> Vec<Message> {
        let count: u64 = self.recorded.written.messages.iter().sum();
        let mut messages = messages(&self.part);
        messages.truncate(count as usize);
        messages
    }
}

/// Memory of this process that was ever in use \[bytes\].
fn peak_memory() -> u64 {
    let status = fs::read_to_string("/proc/self/status").expect("a Linux kernel");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a peak");
    line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number") * 1024
}

#[test]
fn a_damaged_part_is_refused_or_gives_the_same_messages() {
    for compression in [Compression::None, Compression::Lz4, Compression::Zstd] {
        let left = Left::new(compression, &[]);
        let expected = left.expected();
        assert_eq!(left.resume(&left.part).map(|found| found == expected), Ok(true), "{compression:?}");
        assert!(expected.len() > 30, "{}", expected.len());
        let mut refused = 0;
        // every byte of the heads of chunks, and a sample of the rest
        let sample = 1 + left.part.len() / 200;
        for place in (0..left.part.len()).filter(|place| place % sample == 0 || left.is_head(*place)) {
            let mut part = left.part.clone();
            part[place] ^= 1 << (place % 8);
            match left.resume(&part) {
                Ok(messages) => assert!(messages == expected, "{compression:?}, byte {place}"),
                Err(text) => {
                    assert!(text.contains("cannot continue") && text.contains("--force"), "{text}");
                    refused += 1;
                }
            }
        }
        assert!(refused > 100, "{compression:?}: {refused}");
    }
    assert!(peak_memory() < 2 << 30, "{}", peak_memory());
}

impl Left {
    /// True for bytes of the prefix and the head of a chunk.
    fn is_head(&self, place: usize) -> bool {
        let mut start = mcap::MAGIC.len();
        while let Some(length) = self.part.get(start + 1..start + 9) {
            if self.part[start] == op::CHUNK && (start..start + 60).contains(&place) {
                return true;
            }
            start += 9 + u64::from_le_bytes(length.try_into().expect("eight bytes")) as usize;
        }
        false
    }
}

#[test]
fn a_part_is_cut_to_what_its_checkpoint_counts() {
    let left = Left::new(Compression::Zstd, &[]);
    let expected = left.expected();
    let (mut whole, mut cut) = (0, 0);
    for length in (0..left.part.len()).step_by(left.part.len() / 150) {
        match left.resume(&left.part[..length]) {
            // what is missing is behind
            Ok(messages) => {
                assert!(messages == expected, "{length} of {}", left.part.len());
                whole += 1;
            }
            Err(text) => {
                assert!(text.contains("cannot continue"), "{text}");
                cut += 1;
            }
        }
    }
    assert!(whole > 10 && cut > 10, "{whole} {cut}");
    let longer = [&left.part[..], &[0x55; 1000]].concat();
    assert_eq!(left.resume(&longer), Ok(expected));
}

#[test]
fn a_part_of_another_run_is_refused() {
    let left = Left::new(Compression::Zstd, &[]);
    // the same channels with as many messages, of other numbers
    let other = Left::new(Compression::Zstd, &["impact.velocity=0.9"]);
    assert_eq!(left.recorded.written.messages, other.recorded.written.messages);
    let text = left.resume(&other.part).expect_err("another run");
    assert!(text.contains("its messages are not those that its checkpoint belongs to"), "{text}");
}

#[test]
fn forged_lengths_take_no_memory() {
    let left = Left::new(Compression::None, &[]);
    // a record that claims to be as long as anything, in a chunk with the right checksum
    let mut part = left.part.clone();
    let start = (0..part.len()).find(|place| left.is_head(*place)).expect("a chunk");
    let records = start + 9 + 28 + 4 + 8;
    let size = u64::from_le_bytes(part[records - 8..records].try_into().expect("eight bytes")) as usize;
    for claim in [1 << 40, u64::MAX, size as u64] {
        part[records + 1..records + 9].copy_from_slice(&claim.to_le_bytes());
        let checksum = crc32fast::hash(&part[records..records + size]);
        part[start + 9 + 24..start + 9 + 28].copy_from_slice(&checksum.to_le_bytes());
        let text = left.resume(&part).expect_err("a forged length");
        assert!(text.contains("beyond its chunk"), "{text}");
    }
    assert!(peak_memory() < 2 << 30, "{}", peak_memory());
}
