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
