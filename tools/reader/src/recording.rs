//! Opening a file and reading its records in order, with limits and checksums.
//!
//! [`Scan`] walks over the records of a file and unpacks its chunks; the parsing and unpacking is that of the `mcap`
//! crate. Every checksum is verified, chunks before any message of theirs comes out. A damaged part is noted and
//! stepped over: reading goes on with the next sound record, and [`Scan::damages`] tells what was lost. With the
//! [`Index`] at the end of a file, chunks that hold nothing of interest are not even read.

mod index;
mod parse;
mod scan;

use std::{
    io,
    path::{Path, PathBuf},
};

pub use index::Index;
pub(crate) use index::PREFIX;
pub(crate) use parse::parse;
pub use scan::{Found, Next, Scan, Source};

/// Memory that reading may take, whatever a file claims.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// All of it \[bytes\]. Two files are open at most at a time, each with a record and an unpacked chunk.
    pub memory: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { memory: 1 << 30 }
    }
}

impl Limits {
    /// Largest record or chunk, packed or unpacked \[bytes\].
    pub fn record(self) -> usize {
        usize::try_from(self.memory / 4).unwrap_or(usize::MAX)
    }

    /// Largest sum of all schemas and channels \[bytes\].
    pub fn directory(self) -> usize {
        usize::try_from(self.memory / 64).unwrap_or(usize::MAX)
    }

    /// Largest sum of messages of one file that wait for their counterparts in another \[bytes\].
    pub fn waiting(self) -> usize {
        usize::try_from(self.memory / 16).unwrap_or(usize::MAX)
    }
}

/// Why a file cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The system refuses.
    #[error("cannot read `{}`: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The file does not begin like an MCAP file.
    #[error("`{}` is not an MCAP file: it does not begin with the MCAP magic bytes", .0.display())]
    NotMcap(PathBuf),
}

impl OpenError {
    fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |error| Self::Io { path, error }
    }
}

/// A part of a file that could not be read, or is not what its checksum says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins \[bytes from the start of the file\].
    pub offset: u64,
    /// How much was stepped over \[bytes\]; 0 if nothing was lost.
    pub bytes: u64,
    /// What is wrong there.
    pub reason: String,
}
