//! From the wire to [`Values`].

use prost_reflect::{Kind, prost::Message};

use super::{
    cursor::{Wire, spend},
    dynamic::dynamic,
    json,
    layout::{Content, Layout, Node, Scalar, Slot},
    leaf::{DecodeError, Type},
    list::{Key, List, Values},
    seen::{BLOCK, Seen, complete, size},
};
use crate::recording::Budget;

enum Stop {
    Error(DecodeError),
    /// A part that may be there once is there twice: the parts have to be merged first.
    Twice,
}

impl From<DecodeError> for Stop {
    fn from(error: DecodeError) -> Self {
        Self::Error(error)
    }
}

impl Layout {
    /// Decodes a message.
    ///
    /// # Errors
    ///
    /// The bytes do not fit the type, or take more memory than the layout is for.
    pub fn decode(&self, bytes: &[u8], values: &mut Values) -> Result<(), DecodeError> {
        if let Some(names) = &self.names {
            values.lists.iter_mut().for_each(List::clear);
            return json::decode(&self.root, names, bytes, &mut values.lists, &mut Budget::new(self.room));
        }
        match self.attempt(bytes, values) {
            Ok(()) => Ok(()),
            Err(Stop::Error(error)) => Err(error),
            Err(Stop::Twice) => {
                // rare: the general decoder merges
                let merged = dynamic(&self.descriptor, bytes, self.room)?.encode_to_vec();
                self.attempt(&merged, values).map_err(|stop| match stop {
                    Stop::Error(error) => error,
                    Stop::Twice => DecodeError::SchemaMismatch,
                })
            }
        }
    }

    /// The plain number at the top of a message with a field number, without decoding the rest. The default if the
    /// message does not hold it, `None` if the message does not fit or is JSON.
    pub fn peek(&self, leaf: usize, bytes: &[u8]) -> Option<f64> {
        let leaf = self.leaves.get(leaf).filter(|_| !self.is_json())?;
        let &[wanted] = leaf.numbers.as_slice() else { return None };
        let slot = &self.root.slots[self.root.find(wanted)?];
        let Content::Scalar(scalar) = &slot.content else { return None };
        let mut wire = Wire { bytes };
        let mut list = List::new(&leaf.kind);
        while !wire.bytes.is_empty() {
            let (number, wire_type) = wire.key().ok()?;
            if number == wanted {
                list.clear();
                value(scalar, slot, wire_type, &mut wire, &mut list, &mut Budget::new(self.room)).ok()?;
            } else {
                wire.skip(number, wire_type, 0).ok()?;
            }
        }
        list.number(0).or(Some(0.0))
    }

    fn attempt(&self, bytes: &[u8], values: &mut Values) -> Result<(), Stop> {
        values.lists.iter_mut().for_each(List::clear);
        message(&self.root, bytes, &mut values.lists, &mut Budget::new(self.room))
    }
}

fn message(node: &Node, bytes: &[u8], lists: &mut [List], budget: &mut Budget) -> Result<(), Stop> {
    // charge empty messages as well, to bound time
    spend(budget, node.slots.len())?;
    let (mut wire, mut seen, mut entries) = (Wire { bytes }, Seen::of(node), Vec::<Entry<'_>>::new());
    while !wire.bytes.is_empty() {
        let start = wire.bytes;
        let (number, wire_type) = wire.key()?;
        let Some(index) = node.find(number) else {
            wire.skip(number, wire_type, 0)?;
            keep(&start[..start.len() - wire.bytes.len()], lists, budget)?;
            continue;
        };
        let slot = &node.slots[index];
        if seen.count(index) == 0 && slot.group.is_some() && others_seen(node, slot, index, &seen) {
            return Err(Stop::Twice);
        }
        let again = seen.count(index) > 0 && !slot.is_list;
        let values = match &slot.content {
            Content::Scalar(scalar) => {
                let list = &mut lists[scalar.leaf];
                if again {
                    list.pop();
                }
                let before = list.len();
                value(scalar, slot, wire_type, &mut wire, list, budget)?;
                list.len() - before
            }
            Content::Message { .. } if wire_type != 2 => return Err(DecodeError::SchemaMismatch.into()),
            Content::Message { .. } if again => return Err(Stop::Twice),
            Content::Message { node: inner, is_map: true } => {
                spend(budget, size_of::<Entry<'_>>())?;
                let bytes = wire.block()?;
                entries.push(Entry { index, key: key(inner, bytes, budget)?, bytes });
                // what is counted are the keys that differ
                continue;
            }
            Content::Message { node: inner, .. } => {
                message(inner, wire.block()?, lists, budget)?;
                1
            }
        };
        seen.add(index, values as u64, slot.is_list);
    }
    // the order of a map's entries means nothing: in the order of their keys two equal maps are equal lists; of several
    // with one key the last counts, as in protobuf
    entries.sort_by(|x, y| (x.index, &x.key).cmp(&(y.index, &y.key)));
    for (i, Entry { index, key, bytes }) in entries.iter().enumerate() {
        if entries.get(i + 1).is_some_and(|next| (next.index, &next.key) == (*index, key)) {
            continue;
        }
        if let Content::Message { node: inner, .. } = &node.slots[*index].content {
            message(inner, bytes, lists, budget)?;
        }
        seen.add(*index, 1, true);
    }
    Ok(complete(node, &seen, lists, budget)?)
}

/// An entry of a map.
struct Entry<'a> {
    index: usize,
    key: Option<Key>,
    bytes: &'a [u8],
}

/// The key of an entry: field 1, by default 0 or empty.
fn key(entry: &Node, bytes: &[u8], budget: &mut Budget) -> Result<Option<Key>, DecodeError> {
    let slot = entry.find(1).map(|index| &entry.slots[index]);
    let Some(Slot { content: Content::Scalar(scalar), .. }) = slot else { return Ok(None) };
    let (mut list, mut wire) = (List::new(&Type::of(scalar.kind.clone())), Wire { bytes });
    list.push_default();
    while !wire.bytes.is_empty() {
        let (number, wire_type) = wire.key()?;
        if number == 1 && wire_type == scalar.wire_type {
            list.clear();
            single(scalar, number, &mut wire, &mut list, budget)?;
        } else {
            wire.skip(number, wire_type, 0)?;
        }
    }
    Ok(list.key(0))
}

/// Keeps a field that the schema does not know.
fn keep(field: &[u8], lists: &mut [List], budget: &mut Budget) -> Result<(), DecodeError> {
    if let Some(List::Bytes(unknown)) = lists.last_mut() {
        spend(budget, BLOCK + field.len())?;
        unknown.push(field.to_vec());
    }
    Ok(())
}

/// True if another member of the slot's oneof has been there.
fn others_seen(node: &Node, slot: &Slot, index: usize, seen: &Seen) -> bool {
    let of_group = |(i, other): (usize, &Slot)| i != index && other.group == slot.group && seen.count(i) > 0;
    node.slots.iter().enumerate().any(of_group)
}

/// Reads one value, or a packed list of them.
fn value(
    scalar: &Scalar,
    slot: &Slot,
    wire_type: u8,
    wire: &mut Wire<'_>,
    list: &mut List,
    budget: &mut Budget,
) -> Result<(), DecodeError> {
    if wire_type == scalar.wire_type {
        return single(scalar, slot.number, wire, list, budget);
    }
    if wire_type != 2 || matches!(scalar.wire_type, 2 | 3) || !slot.is_list {
        return Err(DecodeError::SchemaMismatch);
    }
    let mut packed = Wire { bytes: wire.block()? };
    let rest = match (&scalar.kind, &mut *list) {
        (Kind::Double, List::Double(list)) => {
            spend(budget, packed.bytes.len())?;
            let (numbers, rest) = packed.bytes.as_chunks::<8>();
            list.extend(numbers.iter().map(|&bytes| f64::from_le_bytes(bytes)));
            rest
        }
        (Kind::Float, List::Float(list)) => {
            spend(budget, packed.bytes.len())?;
            let (numbers, rest) = packed.bytes.as_chunks::<4>();
            list.extend(numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)));
            rest
        }
        _ => {
            while !packed.bytes.is_empty() {
                single(scalar, slot.number, &mut packed, list, budget)?;
            }
            packed.bytes
        }
    };
    if rest.is_empty() { Ok(()) } else { Err(DecodeError::SchemaMismatch) }
}

fn single(
    scalar: &Scalar,
    number: u32,
    wire: &mut Wire<'_>,
    list: &mut List,
    budget: &mut Budget,
) -> Result<(), DecodeError> {
    spend(budget, size(list))?;
    match (&scalar.kind, list) {
        (Kind::Double, List::Double(list)) => list.push(f64::from_le_bytes(wire.fixed()?)),
        (Kind::Float, List::Float(list)) => list.push(f32::from_le_bytes(wire.fixed()?)),
        // an integer of 32 bits is what the lowest of a longer varint are
        (Kind::Int32, List::Int(list)) => list.push(i64::from(wire.varint()? as i32)),
        (Kind::Int64, List::Int(list)) => list.push(wire.varint()? as i64),
        (Kind::Uint32, List::UInt(list)) => list.push(u64::from(wire.varint()? as u32)),
        (Kind::Uint64, List::UInt(list)) => list.push(wire.varint()?),
        (Kind::Sint32, List::Int(list)) => list.push(zigzag(u64::from(wire.varint()? as u32))),
        (Kind::Sint64, List::Int(list)) => list.push(zigzag(wire.varint()?)),
        (Kind::Fixed32, List::UInt(list)) => list.push(u64::from(u32::from_le_bytes(wire.fixed()?))),
        (Kind::Fixed64, List::UInt(list)) => list.push(u64::from_le_bytes(wire.fixed()?)),
        (Kind::Sfixed32, List::Int(list)) => list.push(i64::from(i32::from_le_bytes(wire.fixed()?))),
        (Kind::Sfixed64, List::Int(list)) => list.push(i64::from_le_bytes(wire.fixed()?)),
        (Kind::Bool, List::Bool(list)) => list.push(wire.varint()? != 0),
        (Kind::Enum(_), List::Enum(list)) => list.push(wire.varint()? as i32),
        (_, List::Text(list)) => {
            let text = std::str::from_utf8(wire.block()?).map_err(|_| DecodeError::SchemaMismatch)?;
            spend(budget, text.len())?;
            list.push(text.to_owned());
        }
        (_, List::Bytes(list)) => {
            let start = wire.bytes;
            let bytes = if scalar.wire_type == 3 {
                wire.skip(number, 3, 0)?;
                &start[..start.len() - wire.bytes.len()]
            } else {
                wire.block()?
            };
            spend(budget, bytes.len())?;
            list.push(bytes.to_vec());
        }
        _ => unreachable!("a leaf's list is made for its type"),
    }
    Ok(())
}

/// The signed integer of a zigzag one.
fn zigzag(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}
