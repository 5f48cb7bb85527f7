//! Opening a file and reading its records in order, with limits and checksums.
//!
//! [`Scan`] walks over the records of a file and unpacks its chunks; the parsing and unpacking is that of the `mcap`
//! crate. Every checksum is verified, chunks before any message of theirs comes out. A damaged part is skipped and
//! reported: reading goes on with the next sound record, and [`Scan::damages`] lists what was lost. With the
//! [`Index`] at the end of a file, chunks that hold nothing of interest are not even read.

mod budget;
mod checksum;
mod file;
mod index;
mod parse;
mod scan;

use std::{
    io,
    path::{Path, PathBuf},
};

use crate::select::Window;

pub(crate) use budget::Budget;
pub use file::{is_part, open_file, without_part};
pub use index::Index;
pub use scan::{FileRecord, Scan, Source};

/// Memory that reading may take, whatever a file claims.
///
/// | Share | For |
/// |---|---|
/// | 1/2 | a chunk, packed and unpacked: 1/4 each, [`Limits::record`] |
/// | 1/8 | schemas, channels, metadata, the index: [`Limits::directory`] |
/// | 1/8 | a decoded message, and room for its lists to grow: [`Limits::values`] is half of that |
/// | 1/4 | what is kept of messages: rows that wait for others, points of curves, messages at chosen times |
///
/// What is to be kept is charged before it is allocated, with what it takes in memory, not in the file; what has no room
/// is refused and reported.
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

    /// Largest record or chunk, packed or unpacked \[bytes\].
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

/// A log time in seconds: the number next to it, so that its shortest text is that of the decimal fraction.
///
/// * `log_time`: \[ns\]
pub fn seconds(log_time: u64) -> f64 {
    const SECOND: u64 = 1_000_000_000;
    // one rounding: up to here numerator and denominator are exact; beyond, the whole seconds are, and the rounding of
    // the rest is far below a unit in the last place of the sum
    if log_time <= 1 << f64::MANTISSA_DIGITS {
        log_time as f64 / SECOND as f64
    } else {
        (log_time / SECOND) as f64 + (log_time % SECOND) as f64 / SECOND as f64
    }
}

/// The time from an origin to a log time in seconds; exact before it is rounded.
///
/// * `log_time`, `origin`: \[ns\]
pub fn seconds_since(log_time: u64, origin: u64) -> f64 {
    match log_time.checked_sub(origin) {
        Some(since) => seconds(since),
        None => -seconds(origin - log_time),
    }
}

/// Log times of a window of seconds from an origin on \[ns\].
///
/// * `origin`: \[ns\]
pub(crate) fn log_times_since(origin: u64, window: &Window) -> (u64, u64) {
    let at = |time: i128| {
        let sum = time.saturating_add(origin.into()).clamp(0, u64::MAX.into());
        u64::try_from(sum).unwrap_or(u64::MAX)
    };
    let low = window.from.map_or(0, |from| at(from.nanoseconds().1));
    let high = window.to.map_or(u64::MAX, |to| at(to.nanoseconds().0));
    (low, high)
}

/// Log times of a window of times, with a nanosecond of room for rounding \[ns\].
///
/// * `rate`: log time that passes in a unit of these times \[s\]
pub fn log_times(from: Option<f64>, to: Option<f64>, rate: f64) -> (u64, u64) {
    let low = from.map_or(0, |from| (from * rate * 1e9).floor().max(1.0) as u64 - 1);
    let high = to.map_or(u64::MAX, |to| ((to * rate * 1e9).ceil().max(0.0) as u64).saturating_add(1));
    (low, high)
}

/// Why a file cannot be read at all, or not what is asked for.
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
    /// It is no file that can be read from any place on.
    #[error("cannot read `{}`: it is {what}; a recording is a regular file", path.display())]
    NoFile {
        /// Its name.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// There is no such recording, but one of that name that is not complete.
    #[error(
        "`{}` does not exist; there is `{}`, a recording that is not complete; read that, or continue the run with \
         `percuss run --resume`",
        path.display(), part.display()
    )]
    NotComplete {
        /// The recording asked for.
        path: PathBuf,
        /// What there is.
        part: PathBuf,
    },
    /// The file does not begin like an MCAP file.
    #[error("`{}` is not an MCAP file: it does not begin with the MCAP magic bytes", .0.display())]
    NotMcap(PathBuf),
    /// There is no such topic.
    #[error("`{}` has no topic `{topic}`; it has {known}", path.display())]
    UnknownTopic {
        /// The file.
        path: PathBuf,
        /// Topic or pattern asked for.
        topic: String,
        /// Topics that exist.
        known: String,
    },
    /// No topic has messages that are decoded.
    #[error("`{}` has no topic whose messages can be decoded; it has {known}", path.display())]
    NothingDecoded {
        /// The file.
        path: PathBuf,
        /// Topics that exist.
        known: String,
    },
    /// What has to be kept of the file has no room.
    #[error("`{}`: {what} take more memory than --max-memory allows; raise it, or choose less", path.display())]
    Memory {
        /// The file.
        path: PathBuf,
        /// What takes the memory, in the plural.
        what: &'static str,
    },
}

impl OpenError {
    fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |error| match file::part_of(&path, &error) {
            Some(part) => Self::NotComplete { path, part },
            None => Self::Io { path, error },
        }
    }
}

/// A part of a file that could not be read, or is not what its checksum says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins \[bytes from the start of the file\].
    pub offset: u64,
    /// How much was skipped \[bytes\]; 0 if nothing was lost.
    pub bytes: u64,
    /// What is wrong there.
    pub reason: String,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_times_are_the_seconds_next_to_them() {
        let known = [60_000_000, 8_999_640_000, 1_700_000_000_150_000_000, 1 << 53, (1 << 53) + 1, 0];
        // and some that look random
        let many = (0..20_000u64).map(|k| k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (k % 60));
        for log_time in known.into_iter().chain(many) {
            let text = format!("{}.{:09}", log_time / 1_000_000_000, log_time % 1_000_000_000);
            assert_eq!(Ok(seconds(log_time)), text.parse(), "{log_time} ns");
        }
        assert_eq!(seconds(1_700_000_000_150_000_000).to_string(), "1700000000.15");
        assert_eq!(seconds(60_000_000).to_string(), "0.06");
    }
}
