//! Why something could not be done, and the exit status that says so.

use std::{
    io,
    path::{Path, PathBuf},
};

use mcap::McapError;
use percuss_output::{OutputError, cause};
use percuss_serve::ServeError;

/// Why a verb has failed.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// What is asked for is not there, or does not go together: status 2.
    #[error("{0}")]
    Usage(String),
    /// It could not be done: status 1.
    #[error("{0}")]
    Failed(String),
    /// The system refuses to read a file.
    #[error("cannot read `{}`: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Output cannot be written; [`Failure::at`] says where.
    #[error("cannot write the output: {0}")]
    Output(io::Error),
    /// Messages of a topic are not in the order of their log times: they have to be sorted.
    #[error("messages of `{0}` are not in the order of their log times")]
    Unsorted(String),
}

impl Failure {
    /// Something of a file has no room.
    ///
    /// * `what`: what takes the memory, in the plural
    pub(crate) fn memory(path: &Path, what: &str) -> Self {
        let path = path.display();
        Self::Failed(format!(
            "`{path}`: {what} take more memory than --max-memory allows; raise it, or choose less"
        ))
    }

    /// A recording is none of a run.
    ///
    /// * `instead`: the verb that shows its fields, and how
    pub(crate) fn not_percuss(path: &Path, instead: &str) -> Self {
        Self::Usage(format!(
            "`{}` is not a percuss recording: it has no metadata record percuss.run; `{instead} its fields",
            path.display()
        ))
    }

    /// A picture cannot be drawn.
    pub(crate) fn drawing(why: impl std::fmt::Display) -> Self {
        Self::Failed(format!("cannot draw: {why}"))
    }

    /// There is nothing to draw.
    pub(crate) fn nothing(why: impl std::fmt::Display) -> Self {
        Self::Usage(format!("nothing to draw: {why}"))
    }

    /// Names the output that cannot be written: a file, or standard output.
    #[must_use]
    pub(crate) fn at(self, path: Option<&Path>) -> Self {
        match self {
            // a reader of standard output that has had enough
            Self::Output(error) if path.is_none() && error.kind() == io::ErrorKind::BrokenPipe => {
                Self::Output(error)
            }
            Self::Output(error) => OutputError::new(path.unwrap_or("standard output".as_ref()), error).into(),
            other => other,
        }
    }

    /// The same where status 1 is an answer: as one that there is none, status 2.
    #[must_use]
    pub(crate) fn into_usage(self) -> Self {
        match self {
            Self::Usage(_) | Self::Output(_) => self,
            other => Self::Usage(other.to_string()),
        }
    }

    /// True if a reader of standard output has had enough.
    pub(crate) fn is_unread(&self) -> bool {
        matches!(self, Self::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }

    /// Exit status: 2 for what was asked for wrongly, else 1; 0 where a reader of standard output has had enough.
    pub fn status(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            _ if self.is_unread() => 0,
            _ => 1,
        }
    }
}

impl From<io::Error> for Failure {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::OutOfMemory => Self::Failed(error.to_string()),
            _ => Self::Output(error),
        }
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        Self::Failed(error.to_string())
    }
}

impl From<McapError> for Failure {
    fn from(error: McapError) -> Self {
        match error {
            McapError::Io(error) => error.into(),
            error => Self::Failed(format!("cannot write the recording: {}", cause(&error))),
        }
    }
}

impl From<ServeError> for Failure {
    fn from(error: ServeError) -> Self {
        Self::Failed(error.to_string())
    }
}
