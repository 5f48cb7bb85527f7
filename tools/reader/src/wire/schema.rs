//! Descriptor sets, filtered on the wire before they are handed to `prost-reflect`.
//!
//! What a set takes in memory has little to do with its length: two bytes are an empty message of a few hundred, and every
//! name is kept with all names it stands in. So the names, messages and comments of a set are counted first, and only a
//! copy with what the reader uses is parsed: without services, without options but the three that say how values stand
//! on the wire, without comments that belong to nothing. Sets that `prost-reflect` cannot be given (it panics, or does
//! not come back) are refused here: another syntax than proto2 and proto3, files that import each other publicly in
//! circles, maps that are none.

mod filter;
mod imports;

use prost_reflect::{
    DescriptorPool, Kind, MessageDescriptor, prost::Message, prost_types::FileDescriptorSet,
};

use filter::Filter;
use imports::refuse_circles;

use super::leaf::DecodeError;

/// Most comments, times the elements that they are looked up for.
const MAX_LOOKUPS: usize = 1 << 30;

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
    fn unsound(text: impl Into<String>) -> Self {
        Self::Unsound(text.into())
    }
}

impl From<DecodeError> for SchemaError {
    fn from(_: DecodeError) -> Self {
        Self::unsound("it is no descriptor set")
    }
}

/// The types of a descriptor set, and the memory they take \[bytes\].
///
/// * `room`: memory that they may take \[bytes\]
pub(crate) fn pool(bytes: &[u8], room: usize) -> Result<(DescriptorPool, usize), SchemaError> {
    let mut filter = Filter::new(room);
    let clean = filter.set(bytes)?;
    if filter.comments.saturating_mul(filter.elements) > MAX_LOOKUPS {
        let (comments, elements) = (filter.comments, filter.elements);
        return Err(SchemaError::unsound(format!("{comments} comments on {elements} elements are too many")));
    }
    check_files(&clean)?;
    let pool =
        DescriptorPool::decode(clean.as_slice()).map_err(|error| SchemaError::unsound(error.to_string()))?;
    let wrong = pool.all_messages().find(|message| message.is_map_entry() && !is_entry(message));
    match wrong {
        Some(message) => Err(SchemaError::unsound(format!("`{}` is no entry of a map", message.full_name()))),
        None => Ok((pool, filter.spent())),
    }
}

/// Refuses the syntaxes and imports that `prost-reflect` cannot be given.
///
/// * `clean`: a set that is filtered
fn check_files(clean: &[u8]) -> Result<(), SchemaError> {
    let files =
        FileDescriptorSet::decode(clean).map_err(|error| SchemaError::unsound(error.to_string()))?.file;
    let mut syntaxes = files.iter().filter_map(|file| file.syntax.as_deref());
    match syntaxes.find(|syntax| !matches!(*syntax, "proto2" | "proto3")) {
        Some(other) => {
            let text = format!("its syntax is `{other}`; only proto2 and proto3 are known");
            Err(SchemaError::unsound(text))
        }
        None => refuse_circles(&files),
    }
}

/// True if a message can be an entry of a map.
fn is_entry(message: &MessageDescriptor) -> bool {
    let (Some(key), Some(value)) = (message.get_field(1), message.get_field(2)) else { return false };
    let is_key =
        !matches!(key.kind(), Kind::Double | Kind::Float | Kind::Bytes | Kind::Enum(_) | Kind::Message(_));
    is_key && !key.is_list() && !key.is_map() && !value.is_list() && !value.is_map()
}

#[cfg(test)]
pub(crate) mod tests;
