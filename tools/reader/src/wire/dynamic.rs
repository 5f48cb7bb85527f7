//! Messages as the general decoder of `prost-reflect` returns them, as far as memory allows.

use prost_reflect::{DynamicMessage, FieldDescriptor, Kind, MessageDescriptor, Value};

use super::{
    cursor::{Wire, spend},
    leaf::DecodeError,
};
use crate::recording::Budget;

/// Memory of a value: in a list that grows, or in a tree with its number \[bytes\].
const VALUE: usize = 2 * size_of::<Value>() + 32;

/// Deepest nesting; the decoder's own limit.
const MAX_DEPTH: usize = 100;

/// Decodes a message whole. That takes many times its length, which is counted first.
///
/// * `room`: memory that it may take \[bytes\]
pub(crate) fn dynamic(
    descriptor: &MessageDescriptor,
    bytes: &[u8],
    room: usize,
) -> Result<DynamicMessage, DecodeError> {
    count(descriptor, bytes, 0, &mut Budget::new(room))?;
    DynamicMessage::decode(descriptor.clone(), bytes).map_err(|_| DecodeError::SchemaMismatch)
}

fn count(
    descriptor: &MessageDescriptor,
    bytes: &[u8],
    depth: usize,
    budget: &mut Budget,
) -> Result<(), DecodeError> {
    if depth > MAX_DEPTH {
        return Err(DecodeError::SchemaMismatch);
    }
    let mut wire = Wire { bytes };
    while !wire.bytes.is_empty() {
        let before = wire.bytes.len();
        let (number, wire_type) = wire.key()?;
        if wire_type == 2 {
            let block = wire.block()?;
            spend(budget, VALUE)?;
            match descriptor.get_field(number) {
                Some(field) => count_block(&field, block, depth, budget)?,
                None => spend(budget, block.len())?,
            }
        } else {
            wire.skip(number, wire_type, 0)?;
            // of a group, every byte but those around it could be a value
            let values = if wire_type == 3 { before - wire.bytes.len() } else { 1 };
            spend(budget, VALUE.saturating_mul(values))?;
        }
    }
    Ok(())
}

/// Spends what a field takes that has a length.
fn count_block(
    field: &FieldDescriptor,
    block: &[u8],
    depth: usize,
    budget: &mut Budget,
) -> Result<(), DecodeError> {
    match field.kind() {
        Kind::String | Kind::Bytes => spend(budget, block.len()),
        Kind::Message(inner) => {
            // an entry of a map has a key besides
            spend(budget, VALUE)?;
            count(&inner, block, depth + 1, budget)
        }
        Kind::Double | Kind::Fixed64 | Kind::Sfixed64 => spend(budget, VALUE * (block.len() / 8)),
        Kind::Float | Kind::Fixed32 | Kind::Sfixed32 => spend(budget, VALUE * (block.len() / 4)),
        // numbers of different lengths end with a byte below 0x80
        _ => spend(budget, VALUE * block.iter().filter(|byte| **byte < 0x80).count()),
    }
}
