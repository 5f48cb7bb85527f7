//! The journal of a sweep: a line for every case that is done. Lines are only appended, one process to a file.
//!
//! A line ends with the CRC-32 of what stands before that, so a torn or changed one is found and not counted.

use std::{
    collections::BTreeMap,
    fs::{File, OpenOptions, TryLockError},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use percuss_output::{has_name, synchronise, synchronise_folder};
use serde::{Deserialize, Serialize};

use super::{SweepError, measure::Measures, plan::Digest};

/// How a case has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// All steps are done.
    Completed,
    /// The stop condition of the case held.
    Stopped,
    /// The computation failed.
    Failed,
}

impl State {
    /// Name in the journal and the summary.
    pub fn name(self) -> &'static str {
        match self {
            Self::Completed => "completed",
            Self::Stopped => "stopped",
            Self::Failed => "failed",
        }
    }
}

/// A line of a journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Number of the case in the sweep as it was then.
    pub case: usize,
    /// Digest of the case.
    pub digest: Digest,
    /// How it has ended.
    pub state: State,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
    /// Its recording, from the folder of the sweep, for people and reports; none if it is not kept. A sweep itself derives the name.
    pub file: Option<String>,
    /// Time it took \[s\].
    pub seconds: f64,
    /// Machine.
    pub host: String,
    /// What was measured, in the units of the case; nothing of a case that failed.
    pub measures: Measures,
    /// Subjects of its warnings, see [`crate::advice::Finding`].
    pub warnings: Vec<String>,
}

/// A journal that is appended to.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    synchronised: Instant,
}

/// Longest time that lines wait to be synchronised with the disk.
const SYNCHRONISE_AFTER: Duration = Duration::from_secs(1);

impl Journal {
    /// Opens the journal `path`, or begins it. A last line that a crash has torn is cut off.
    ///
    /// # Errors
    ///
    /// Another process has it, or it cannot be read and written.
    pub fn open(path: &Path) -> Result<Self, SweepError> {
        let open = || {
            let mut file = OpenOptions::new().read(true).append(true).create(true).open(path)?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => return Ok(None),
                // some shared folders have no locks: there it is up to the scheduler that a shard runs once
                Err(TryLockError::Error(_)) | Ok(()) => {}
            }
            let whole = whole_lines(&mut file)?;
            if whole < file.metadata()?.len() {
                file.set_len(whole)?;
            }
            synchronise_folder(path)?;
            Ok(Some(file))
        };
        let system = SweepError::system(path);
        loop {
            let Some(file) = open().map_err(&system)? else { return Err(SweepError::Busy(path.into())) };
            // between opening and locking it the file may have been removed: what is written then is lost
            if has_name(&file, path).map_err(&system)? {
                return Ok(Self { path: path.into(), file, synchronised: Instant::now() });
            }
        }
    }

    /// Appends a line. It is on the disk after [`Journal::synchronise`], or some lines later.
    ///
    /// # Errors
    ///
    /// The disk is full, or fails.
    pub fn append(&mut self, entry: &Entry) -> Result<(), SweepError> {
        self.file.write_all(line(entry).as_bytes()).map_err(SweepError::system(&self.path))?;
        if self.synchronised.elapsed() < SYNCHRONISE_AFTER { Ok(()) } else { self.synchronise() }
    }

    /// Waits until all lines are on the disk.
    ///
    /// # Errors
    ///
    /// The disk fails.
    pub fn synchronise(&mut self) -> Result<(), SweepError> {
        self.synchronised = Instant::now();
        synchronise(&self.file).map_err(SweepError::system(&self.path))
    }

    /// Appends what other journals say and this one does not.
    ///
    /// # Errors
    ///
    /// It cannot be read or written.
    pub fn merge(&mut self, all: &Done) -> Result<(), SweepError> {
        let mut own = Done::default();
        own.read(&self.path)?;
        let new = all.entries.values().filter(|entry| own.entries.get(&entry.digest) != Some(entry));
        new.into_iter().try_for_each(|entry| self.append(entry))?;
        self.synchronise()
    }
}

/// Length of the part of a file that ends with the end of a line.
fn whole_lines(file: &mut File) -> io::Result<u64> {
    const BLOCK: u64 = 1 << 12;
    let mut end = file.metadata()?.len();
    let mut block = Vec::new();
    while end > 0 {
        let start = end.saturating_sub(BLOCK);
        file.seek(SeekFrom::Start(start))?;
        block.clear();
        Read::by_ref(file).take(end - start).read_to_end(&mut block)?;
        if let Some(place) = block.iter().rposition(|byte| *byte == b'\n') {
            return Ok(start + place as u64 + 1);
        }
        end = start;
    }
    Ok(0)
}

/// An entry as a line of a journal.
pub fn line(entry: &Entry) -> String {
    let text = serde_json::to_string(entry).expect("an entry is plain text and numbers");
    let start = text.strip_suffix('}').expect("an entry is an object");
    format!("{start}{}\n", end_of(start.as_bytes()))
}

/// The end of a line, which holds the checksum of its start.
fn end_of(start: &[u8]) -> String {
    format!(",\"crc32\":\"{:08x}\"}}", crc32fast::hash(start))
}

/// The entry of a line; none of one that is damaged.
fn entry_of(line: &[u8]) -> Option<Entry> {
    let (start, end) = line.split_at_checked(line.len().checked_sub(end_of(&[]).len())?)?;
    (end == end_of(start).as_bytes()).then(|| serde_json::from_slice(line).ok()).flatten()
}

/// What journals say, by digest.
#[derive(Debug, Default)]
pub struct Done {
    /// The last line of every case; of several journals one that did not fail.
    pub entries: BTreeMap<Digest, Entry>,
    /// Damaged lines, in the middle of a journal.
    pub unread: Vec<(PathBuf, usize)>,
}

impl Done {
    /// Reads a journal; one that is not there is empty, and a last line without an end is not counted, as it may be being written.
    ///
    /// # Errors
    ///
    /// It cannot be read.
    pub fn read(&mut self, path: &Path) -> Result<(), SweepError> {
        let bytes = match std::fs::read(path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            read => read.map_err(SweepError::system(path))?,
        };
        let end = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |place| place + 1);
        let mut unread = 0;
        let mut here = BTreeMap::new();
        for line in bytes[..end].split(|byte| *byte == b'\n').filter(|line| !line.is_empty()) {
            match entry_of(line) {
                Some(entry) => drop(here.insert(entry.digest, entry)),
                None => unread += 1,
            }
        }
        for (digest, entry) in here {
            let is_better = |known: &Entry| known.state == State::Failed || entry.state != State::Failed;
            if self.entries.get(&digest).is_none_or(is_better) {
                self.entries.insert(digest, entry);
            }
        }
        if unread > 0 {
            self.unread.push((path.into(), unread));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(case: usize, state: State) -> Entry {
        Entry {
            case,
            digest: format!("{case:032x}").try_into().expect("a digest"),
            state,
            message: None,
            file: None,
            seconds: 0.5,
            host: "here".into(),
            measures: BTreeMap::from([("peak_force".to_owned(), 0.1 + 0.2)]).into(),
            warnings: vec!["rigid".into()],
        }
    }

    #[test]
    fn a_torn_last_line_is_cut_off_and_others_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("manifest.jsonl");
        let write = |entries: &[Entry]| {
            let mut journal = Journal::open(&path).expect("a journal");
            entries.iter().for_each(|entry| journal.append(entry).expect("a line"));
        };
        let read = || {
            let mut done = Done::default();
            done.read(&path).expect("a journal");
            done
        };
        assert!(read().entries.is_empty());
        write(&[entry(1, State::Completed), entry(2, State::Failed)]);
        let whole = std::fs::read(&path).expect("a file");
        for torn in [1, 50, whole.len() / 2 - 1] {
            std::fs::write(&path, [&whole[..], &whole[..torn]].concat()).expect("a file");
            assert_eq!(read().entries.len(), 2, "{torn}");
            write(&[entry(3, State::Completed)]);
            let done = read();
            assert_eq!((done.entries.len(), done.unread.len()), (3, 0), "{torn}");
        }
        // a line that is torn or changed in the middle of a journal is reported, and the others count
        let changed = line(&entry(4, State::Completed)).replace("0.5", "0.6");
        for bad in ["{\"case\":7,\n", &changed, &changed[20..]] {
            std::fs::write(&path, [bad.as_bytes(), &whole].concat()).expect("a file");
            let done = read();
            assert_eq!((done.entries.len(), &done.unread), (2, &vec![(path.clone(), 1)]), "{bad}");
        }
        let done = read();
        assert_eq!(done.entries[&entry(1, State::Completed).digest], entry(1, State::Completed));
        // a second attempt counts, in whatever journal it stands
        write(&[entry(2, State::Stopped)]);
        let other = folder.path().join("other.jsonl");
        std::fs::write(&other, line(&entry(2, State::Failed))).expect("a file");
        let mut done = read();
        done.read(&other).expect("a journal");
        assert_eq!(done.entries[&entry(2, State::Failed).digest].state, State::Stopped);
    }

    #[test]
    fn a_merge_adds_what_is_new_and_nothing_twice() {
        let folder = tempfile::tempdir().expect("a folder");
        let [path, shard] = ["manifest.jsonl", "shard.jsonl"].map(|name| folder.path().join(name));
        let done = || {
            let mut done = Done::default();
            [&shard, &path].iter().for_each(|path| done.read(path).expect("a journal"));
            done
        };
        let mut journal = Journal::open(&path).expect("a journal");
        journal.append(&entry(1, State::Completed)).expect("a line");
        let mut other = Journal::open(&shard).expect("a journal");
        [1, 2].iter().for_each(|case| other.append(&entry(*case, State::Failed)).expect("a line"));
        for _ in 0..2 {
            journal.merge(&done()).expect("a journal");
            assert_eq!(std::fs::read_to_string(&path).expect("a text").lines().count(), 2);
        }
        assert_eq!(done().entries[&entry(1, State::Completed).digest].state, State::Completed);
    }

    #[test]
    fn a_journal_belongs_to_one_process_at_a_time() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("manifest.jsonl");
        let journal = Journal::open(&path).expect("a journal");
        assert!(matches!(Journal::open(&path), Err(SweepError::Busy(_))));
        drop(journal);
        Journal::open(&path).expect("a journal");
    }
}
