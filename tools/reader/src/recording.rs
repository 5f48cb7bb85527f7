//! Opening a file and reading its records in order, with limits and checksums.
//!
//! [`Scan`] walks over the records of a file and decompresses its chunks; the parsing and decompression is that of the `mcap`
//! crate. Every checksum is verified, chunks before any message of theirs comes out. A damaged part is skipped and
//! reported: reading continues with the next sound record, and [`Scan::damages`] lists what was lost. With the
//! [`Index`] at the end of a file, chunks that hold nothing of interest are not even read. Damage is no error: all that reads
//! fails where the system does.

mod file;
mod index;
mod parse;
mod scan;

use file::unreadable;
pub use file::{is_part, open_file, without_part};
pub use index::Index;
pub(crate) use scan::Opened;
pub use scan::{FileRecord, LeftOut, Scan, Source};

/// True if checksums are compared: always, but in a build for fuzzing with `--cfg percuss_unchecked` (see `tools/fuzz`), where
/// they would keep changed bytes from all code behind them. `cargo fuzz` alone sets `fuzzing`.
const CHECKSUMS_COUNT: bool = cfg!(not(all(fuzzing, percuss_unchecked)));

/// Memory that reading may take, whatever a file claims.
///
/// | Share | For |
/// |---|---|
/// | 1/2 | a chunk, compressed and uncompressed: 1/4 each, [`Limits::record`] |
/// | 1/8 | schemas, channels, metadata, the index: [`Limits::directory`] |
/// | 1/8 | a decoded message, and room for its lists to grow: [`Limits::values`] is half of that |
/// | 1/4 | what is kept of messages: rows that wait for others, points of curves, messages at chosen times |
///
/// What is to be kept is charged before it is allocated, with what it takes in memory, not in the file; what is beyond the
/// limit is refused and reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// All of it \[bytes\].
    pub memory: u64,
}

/// Room for definitions, and for messages that wait, that is there even with little memory \[bytes\].
const LEAST_DIRECTORY: usize = 1 << 20;
const LEAST_WAITING: usize = 1 << 17;

impl Default for Limits {
    fn default() -> Self {
        Self { memory: 1 << 30 }
    }
}

impl Limits {
    fn share(self, part: u64) -> usize {
        usize::try_from(self.memory / part).unwrap_or(usize::MAX)
    }

    /// For each of two files that are read at the same time.
    pub fn of_two(self) -> Self {
        Self { memory: self.memory / 2 }
    }

    /// Largest record or chunk, compressed or uncompressed \[bytes\].
    pub fn record(self) -> usize {
        self.share(4)
    }

    /// Memory of all schemas, channels, metadata records and lists of attachments, or of an index \[bytes\].
    pub fn directory(self) -> usize {
        self.share(8).max(LEAST_DIRECTORY)
    }

    /// Memory of one decoded message \[bytes\].
    pub fn values(self) -> usize {
        self.share(16)
    }

    /// Memory of what is kept of messages: rows, points, messages at chosen times \[bytes\].
    pub fn kept(self) -> usize {
        self.share(8)
    }

    /// Memory of messages of one file that wait for their counterparts in another \[bytes\].
    pub fn waiting(self) -> usize {
        self.share(16).max(LEAST_WAITING)
    }
}

/// Memory of an entry of a map of texts, besides its bytes: its place in a tree, a key and a value of their own \[bytes\].
pub(crate) const ENTRY: usize = 160;

/// Memory that is left for something and spent before it is allocated \[bytes\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Budget {
    left: usize,
}

impl Budget {
    pub(crate) fn new(bytes: usize) -> Self {
        Self { left: bytes }
    }

    /// Spends so many bytes; `false`, and none are spent, if there are not so many.
    #[must_use]
    pub(crate) fn spend(&mut self, bytes: usize) -> bool {
        let left = self.left.checked_sub(bytes);
        self.left = left.unwrap_or(self.left);
        left.is_some()
    }

    /// Gets bytes back that were spent.
    pub(crate) fn give_back(&mut self, bytes: usize) {
        self.left += bytes;
    }

    /// What is left \[bytes\].
    pub(crate) fn left(&self) -> usize {
        self.left
    }
}

/// A part of a file that could not be read, or is not what its checksum says.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Damage {
    /// Where it begins \[bytes from the start of the file\].
    pub offset: u64,
    /// How much was skipped \[bytes\]; 0 if nothing was lost.
    pub bytes: u64,
    /// What is wrong there.
    pub reason: String,
}

impl Damage {
    /// What was left out, of no place in the file.
    pub(crate) fn refusal(reason: String) -> Self {
        Self { offset: 0, bytes: 0, reason }
    }
}
