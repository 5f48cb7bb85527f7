//! Why a descriptor set is not used.

use crate::wire::leaf::DecodeError;

/// Why a descriptor set is not used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum SchemaError {
    /// It would take more memory than there is for it.
    #[error("it unpacks to more than the {room} bytes that are left for definitions (--max-memory)")]
    TooLarge {
        /// Memory that is left \[bytes\].
        room: usize,
    },
    /// It is not what it should be.
    #[error("{0}")]
    Unsound(String),
}

impl SchemaError {
    pub(super) fn unsound(text: impl Into<String>) -> Self {
        Self::Unsound(text.into())
    }
}

impl From<DecodeError> for SchemaError {
    fn from(_: DecodeError) -> Self {
        Self::unsound("it is no descriptor set")
    }
}
