//! Why a comparison failed.

use crate::{prefix::UnitError, recording::OpenError, tabular::TableError};

/// Why a comparison failed.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A table cannot be read, or is not like the recording.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A time with a unit that is not recorded.
    #[error(transparent)]
    Unit(#[from] UnitError),
    /// A topic or field that was asked for is in neither recording: to call them equal would be no answer.
    #[error("neither recording has a {what} `{pattern}`")]
    Unknown {
        /// Topic or field.
        what: &'static str,
        /// As it was asked for.
        pattern: String,
    },
    /// More fields than there is memory to measure.
    #[error(
        "the recordings have {fields} fields, too many to compare at once; choose some (--topic), or raise --max-memory"
    )]
    Fields {
        /// Fields that both have.
        fields: usize,
    },
    /// A message that is too large to hand on to the comparison.
    #[error("a message of {bytes} bytes is too large to be compared; raise --max-memory")]
    TooLarge {
        /// Its length.
        bytes: usize,
    },
    /// Messages of the recordings are in orders so different that there is no memory to wait for counterparts.
    #[error(
        "messages of `{topic}` are too far from their counterparts in the other recording to be kept until those come; \
         compare only that topic (--topic), or raise --max-memory"
    )]
    Waiting {
        /// Topic.
        topic: String,
    },
    /// Messages of a channel are not in the order of their log times: they have to be sorted.
    #[error("messages of `{topic}` are not in the order of their log times")]
    Order {
        /// Topic.
        topic: String,
    },
    /// There is nothing to find a time offset by.
    #[error(
        "--time-offset fit needs plain numbers that both recordings have and that vary; give a number instead"
    )]
    NoFit,
    /// There is no memory to sort them.
    #[error(
        "messages are so far from the order of their log times that more than {bytes} bytes wait for their turn; raise \
         --max-memory, or compare them in the order of the file (--file-order)"
    )]
    Sorting {
        /// Memory for those that wait.
        bytes: usize,
    },
    /// One recording is in SI, the other dimensionless, and their messages are wanted as they are.
    #[error(
        "--write-diff needs recordings in the same units: one of these is in SI, the other dimensionless"
    )]
    Units,
    /// The watcher could not go on.
    #[error("{0}")]
    Watch(String),
}
