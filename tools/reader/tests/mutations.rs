//! No damage passes silently: sound recordings with flipped bits, cut off, with zeroed, swapped and doubled blocks.
//!
//! What is changed is detected (`verify` finds it not sound) or harmless (every schema, channel, message, metadata record and
//! attachment is that of the original). The recordings are the seeds of the fuzzer: without compression, lz4 and zstd, with and
//! without an index, and one of JSON without chunks. `PERCUSS_MUTATIONS=100000 cargo test -p percuss-reader mutations` flips so many bits, and
//! does each of the others a tenth as often; the numbers are the same in every run. `PERCUSS_FULL=1` flips every bit of the smallest ones,
//! and cuts all of them off at every byte.

use std::{
    collections::{BTreeMap, hash_map::DefaultHasher},
    env, fs,
    hash::{Hash, Hasher},
    io::Cursor,
    path::{Path, PathBuf},
    thread,
    time::Instant,
};

use mcap::{Compression, WriteOptions, records::Record};
use percuss_reader::{
    command::{recover::recover, verify::verify_scan},
    messages::Recording,
    recording::{Limits, Scan},
};

use crate::{
    forge::{Dice, forge},
    is_full,
};

const LIMITS: Limits = Limits { memory: 64 << 20 };
/// Flipped bits unless the environment says otherwise.
const FLIPS: usize = 5000;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Damage {
    Flipped,
    CutOff,
    Zeroed,
    Swapped,
    Doubled,
}

use Damage::{CutOff, Doubled, Flipped, Swapped, Zeroed};

impl Damage {
    fn apply(self, bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        let largest = 1 << dice.below(11);
        let size = 1 + dice.below(largest).min(bytes.len() / 2 - 1);
        let at = dice.below(bytes.len() - size + 1);
        match self {
            Flipped => {
                let byte = dice.below(bytes.len());
                bytes[byte] ^= 1 << dice.below(8);
            }
            CutOff => bytes.truncate(dice.below(bytes.len())),
            Zeroed => bytes[at..at + size].fill(0),
            Swapped => {
                let other = dice.below(bytes.len() - 2 * size + 1);
                let other = if other + size > at { other + size } else { other };
                let (low, high) = (at.min(other), at.max(other));
                if high + size <= bytes.len() && low + size <= high {
                    let (first, second) = bytes.split_at_mut(high);
                    first[low..low + size].swap_with_slice(&mut second[..size]);
                }
            }
            Doubled => {
                let block = bytes[at..at + size].to_vec();
                bytes.splice(at..at, block);
            }
        }
        bytes
    }
}

fn seeds() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds/recording");
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder).expect("the seeds").map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let read = |path: PathBuf| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name, fs::read(path).expect("a recording"))
    };
    paths.into_iter().map(read).collect()
}

fn scan(bytes: &[u8]) -> Option<Scan> {
    Scan::of(Box::new(Cursor::new(bytes.to_vec())), Path::new("a.mcap"), LIMITS).ok()
}

fn is_sound(bytes: &[u8]) -> bool {
    let report = scan(bytes).map(|scan| verify_scan(scan, LIMITS).expect("no error of the system"));
    report.is_some_and(|report| report.is_sound())
}

/// A hash of everything that a file holds.
fn content(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    let mut scan = scan(bytes).expect("a recording");
    let each = scan.for_each(|found| match found.record {
        Record::Schema { .. }
        | Record::Channel(_)
        | Record::Message { .. }
        | Record::Metadata(_)
        | Record::Attachment { .. } => format!("{:?}", found.record).hash(&mut hasher),
        _ => {}
    });
    each.expect("no error of the system");
    hasher.finish()
}

/// Messages of all channels as verbs read them, by the index where it is sound; and whether damage was reported.
fn messages(path: &Path) -> (Vec<(String, u64, Vec<u8>)>, bool) {
    let Ok(recording) = Recording::open(path, LIMITS) else { return (Vec::new(), true) };
    let Ok(mut messages) = recording.messages(recording.channels.keys().copied(), None) else {
        return (Vec::new(), true);
    };
    let mut all = Vec::new();
    let each = messages.for_each(|next| {
        all.push((next.channel.topic.clone(), next.message.log_time, next.message.data.to_vec()));
        Ok(())
    });
    let is_damaged = each.is_err() || !messages.seen().damages.is_empty() || !recording.damages.is_empty();
    (all, is_damaged)
}

/// Damages a recording so many times; the number of damages that were detected.
fn damage(name: &str, bytes: &[u8], damage: Damage, count: usize) -> usize {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    fs::write(&path, bytes).expect("a file");
    let (whole, original) = (content(bytes), messages(&path));
    let mut dice = Dice(0x6a09_e667_f3bc_c908 ^ bytes.len() as u64 ^ ((damage as u64) << 40));
    let mut detected = 0;
    for round in 0..count {
        let spoiled = damage.apply(bytes, &mut dice);
        if !is_sound(&spoiled) {
            detected += 1;
        } else if content(&spoiled) != whole {
            panic!("{name}: {damage:?}, round {round}: not detected");
        }
        fs::write(&path, &spoiled).expect("a file");
        let (read, is_damaged) = messages(&path);
        assert!(is_damaged || read == original.0, "{name}: {damage:?}, round {round}: read without a word");
        let copy = fs::File::create(folder.path().join("copy")).expect("a file");
        drop(recover(&path, copy, LIMITS));
    }
    detected
}

#[test]
fn no_damage_passes_silently() {
    let flips = env::var("PERCUSS_MUTATIONS").map_or(FLIPS, |count| count.parse().expect("a number"));
    let seeds = seeds();
    assert_eq!(seeds.len(), 7);
    let start = Instant::now();
    let mut detected = BTreeMap::<Damage, (usize, usize)>::new();
    for (kind, all) in [
        (Flipped, flips),
        (CutOff, flips / 10),
        (Zeroed, flips / 10),
        (Swapped, flips / 10),
        (Doubled, flips / 10),
    ] {
        let count = all.div_ceil(seeds.len());
        thread::scope(|scope| {
            let runs: Vec<_> = seeds
                .iter()
                .map(|(name, bytes)| scope.spawn(move || damage(name, bytes, kind, count)))
                .collect();
            for run in runs {
                let (found, tried) = detected.entry(kind).or_default();
                *found += run.join().expect("no panic");
                *tried += count;
            }
        });
    }
    for (kind, (found, tried)) in &detected {
        println!("{kind:?}: {tried}, of which {found} detected, {} harmless", tried - found);
        assert!(*found > 0, "{kind:?}");
    }
    println!("{:.1} s", start.elapsed().as_secs_f64());
}

#[test]
fn every_bit_of_the_smallest_recordings() {
    for (name, bytes) in
        seeds().into_iter().filter(|(name, _)| name.starts_with("json") || name.starts_with("zstd-"))
    {
        let whole = content(&bytes);
        let stride = if name.starts_with("json") || is_full() { 1 } else { 7 };
        for bit in (0..8 * bytes.len()).step_by(stride) {
            let mut spoiled = bytes.clone();
            spoiled[bit / 8] ^= 1 << (bit % 8);
            if is_sound(&spoiled) {
                assert_eq!(content(&spoiled), whole, "{name}: bit {} of byte {}", bit % 8, bit / 8);
            }
        }
    }
}

#[test]
fn every_place_to_cut_a_recording_off() {
    for (name, bytes) in seeds() {
        let stride = if name.starts_with("json") || is_full() { 1 } else { 13 };
        for length in (0..bytes.len()).step_by(stride) {
            assert!(!is_sound(&bytes[..length]), "{name}: cut off at {length} of {}", bytes.len());
        }
    }
}

#[test]
fn what_is_sound_is_recovered_and_what_is_lost_is_reported() {
    let mut dice = Dice(11);
    let folder = tempfile::tempdir().expect("a folder");
    let [path, target, whole] = ["a.mcap", "b.mcap", "whole.mcap"].map(|name| folder.path().join(name));
    for (seed, compression) in [(1, Some(Compression::Zstd)), (2, Some(Compression::Lz4)), (3, None)] {
        let options = WriteOptions::new().compression(compression).chunk_size(Some(6 << 10));
        let file = forge(250, seed).write(options);
        fs::write(&whole, &file).expect("a file");
        let (original, _) = messages(&whole);
        for round in 0..20 {
            let mut spoiled = file.clone();
            let place = 100 + dice.below(file.len() - 100);
            if round % 2 == 0 {
                spoiled.truncate(place);
            } else {
                spoiled[place] ^= 1 << dice.below(8);
            }
            fs::write(&path, &spoiled).expect("a file");
            let output = fs::File::create(&target).expect("a file");
            let recovered = recover(&path, output, LIMITS).expect("a recovered file");
            assert!(!recovered.lost.is_empty(), "round {round}: the loss is reported");
            let bytes = fs::read(&target).expect("the recovered file");
            assert!(is_sound(&bytes), "round {round}: the recovered file is sound");
            // everything in it was in the original; chunks are lost as wholes
            let (kept, _) = messages(&target);
            assert_eq!(kept.len() as u64, recovered.messages);
            let mut rest = original.iter();
            assert!(kept.iter().all(|message| rest.any(|other| other == message)), "round {round}");
            if round % 2 == 1 {
                assert!(kept.len() * 2 > original.len(), "round {round}: one bit costs one chunk at most");
            }
        }
    }
}
