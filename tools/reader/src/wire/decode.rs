//! From the wire to [`Values`].

use prost_reflect::prost::Message;

use super::{Content, Layout, List, Misfit, Node, Scalar, Slot, Values, dynamic};
use crate::recording::Budget;

/// Why decoding stops.
enum Stop {
    Misfit(Misfit),
    /// A part that may be there once is there twice: the parts have to be merged first.
    Twice,
}

impl From<Misfit> for Stop {
    fn from(misfit: Misfit) -> Self {
        Self::Misfit(misfit)
    }
}

impl Layout {
    /// Takes a message apart.
    ///
    /// # Errors
    ///
    /// The bytes do not fit the type, or take more memory than the layout is for.
    pub fn decode(&self, bytes: &[u8], values: &mut Values) -> Result<(), Misfit> {
        match self.attempt(bytes, values) {
            Ok(()) => Ok(()),
            Err(Stop::Misfit(misfit)) => Err(misfit),
            Err(Stop::Twice) => {
                // rare: the general decoder merges
                let merged = dynamic(&self.descriptor, bytes, self.room)?.encode_to_vec();
                self.attempt(&merged, values).map_err(|stop| match stop {
                    Stop::Misfit(misfit) => misfit,
                    Stop::Twice => Misfit::Schema,
                })
            }
        }
    }

    /// The plain number at the top of a message with a field number, without taking the rest apart. The default if the
    /// message does not hold it, `None` if the message does not fit.
    pub fn peek(&self, leaf: usize, bytes: &[u8]) -> Option<f64> {
        let leaf = &self.leaves[leaf];
        let &[wanted] = leaf.numbers.as_slice() else { return None };
        let slot = self.root.slots.iter().find(|slot| slot.number == wanted)?;
        let Content::Scalar { scalar, .. } = slot.content else { return None };
        let mut wire = Wire { bytes };
        let mut list = List::new(&leaf.kind);
        while !wire.bytes.is_empty() {
            let (number, kind) = wire.key().ok()?;
            if number == wanted {
                list.clear();
                value(scalar, slot, kind, number, &mut wire, &mut list, &mut Budget::new(self.room)).ok()?;
            } else {
                wire.skip(number, kind, 0).ok()?;
            }
        }
        list.number(0).or(Some(0.0))
    }

    fn attempt(&self, bytes: &[u8], values: &mut Values) -> Result<(), Stop> {
        values.lists.iter_mut().for_each(List::clear);
        message(&self.root, bytes, &mut values.lists, &mut Budget::new(self.room))
    }
}

/// Spends memory of the message that is taken apart.
fn spend(budget: &mut Budget, bytes: usize) -> Result<(), Misfit> {
    if budget.spend(bytes) { Ok(()) } else { Err(Misfit::Memory) }
}

/// Memory of a text or byte string, besides its bytes: its place in a list and its block \[bytes\].
const BLOCK: usize = 24 + 16;

fn message(node: &Node, bytes: &[u8], lists: &mut [List], budget: &mut Budget) -> Result<(), Stop> {
    // also what takes no memory takes time
    spend(budget, node.slots.len())?;
    let mut wire = Wire { bytes };
    let mut seen = Seen::default();
    let mut maps: Vec<(usize, Vec<&[u8]>)> = Vec::new();
    while !wire.bytes.is_empty() {
        let start = wire.bytes;
        let (number, kind) = wire.key()?;
        let near = node.near.get(number as usize).copied().flatten().map(usize::from);
        let Some(index) = near.or_else(|| node.far.get(&number).copied()) else {
            wire.skip(number, kind, 0)?;
            if let Some(List::Bytes(unknown)) = lists.last_mut() {
                spend(budget, BLOCK + start.len() - wire.bytes.len())?;
                unknown.push(start[..start.len() - wire.bytes.len()].to_vec());
            }
            continue;
        };
        let slot = &node.slots[index];
        let again = seen.count(index);
        if again == 0 && slot.group.is_some() && others_seen(node, slot, index, &seen) {
            return Err(Stop::Twice);
        }
        match &slot.content {
            Content::Scalar { leaf, scalar } => {
                let list = &mut lists[*leaf];
                if again > 0 && !slot.is_list {
                    list.pop();
                }
                let before = list.len();
                value(*scalar, slot, kind, number, &mut wire, list, budget)?;
                seen.add(index, (list.len() - before) as u64, slot.is_list);
            }
            Content::Message { node: inner, is_map } => {
                if kind != 2 {
                    return Err(Misfit::Schema.into());
                }
                let content = wire.block()?;
                if *is_map {
                    spend(budget, size_of::<&[u8]>())?;
                    match maps.iter_mut().find(|(map, _)| *map == index) {
                        Some((_, entries)) => entries.push(content),
                        None => maps.push((index, vec![content])),
                    }
                } else if again > 0 && !slot.is_list {
                    return Err(Stop::Twice);
                } else {
                    message(inner, content, lists, budget)?;
                }
                seen.add(index, 1, slot.is_list);
            }
        }
    }
    // the order of a map's entries means nothing: in the order of their keys two equal maps are equal lists
    for (index, mut entries) in maps {
        entries.sort_unstable();
        if let Content::Message { node: inner, .. } = &node.slots[index].content {
            for entry in entries {
                message(inner, entry, lists, budget)?;
            }
        }
    }
    for (index, slot) in node.slots.iter().enumerate() {
        let number = seen.count(index);
        if let Some(List::UInt(list)) = slot.count.map(|leaf| &mut lists[leaf]) {
            spend(budget, 8)?;
            list.push(number);
        }
        if let Content::Scalar { leaf, .. } = slot.content
            && number == 0
            && !slot.is_list
            && !slot.has_presence
        {
            spend(budget, lists[leaf].size())?;
            lists[leaf].push_default();
        }
    }
    Ok(())
}

/// True if another member of the slot's oneof has been there.
fn others_seen(node: &Node, slot: &Slot, index: usize, seen: &Seen) -> bool {
    let of_group = |(i, other): (usize, &Slot)| i != index && other.group == slot.group && seen.count(i) > 0;
    node.slots.iter().enumerate().any(of_group)
}

/// How many values each slot of a message has had.
#[derive(Default)]
struct Seen {
    near: [u32; 16],
    far: Vec<u64>,
}

impl Seen {
    fn count(&self, index: usize) -> u64 {
        match self.near.get(index) {
            Some(&count) => u64::from(count),
            None => self.far.get(index - self.near.len()).copied().unwrap_or(0),
        }
    }

    fn add(&mut self, index: usize, more: u64, is_list: bool) {
        let count = if is_list { self.count(index).saturating_add(more) } else { 1 };
        match self.near.get_mut(index) {
            Some(near) => *near = u32::try_from(count).unwrap_or(u32::MAX),
            None => {
                let far = index - self.near.len();
                if self.far.len() <= far {
                    self.far.resize(far + 1, 0);
                }
                self.far[far] = count;
            }
        }
    }
}

/// Reads one value, or a packed list of them.
fn value(
    scalar: Scalar,
    slot: &Slot,
    kind: u8,
    number: u32,
    wire: &mut Wire<'_>,
    list: &mut List,
    budget: &mut Budget,
) -> Result<(), Misfit> {
    let native = native_kind(scalar);
    if kind == native {
        return single(scalar, number, wire, list, budget);
    }
    if kind != 2 || native == 2 || native == 3 || !slot.is_list {
        return Err(Misfit::Schema);
    }
    let mut packed = Wire { bytes: wire.block()? };
    match (scalar, &mut *list) {
        (Scalar::Double, List::Double(list)) => {
            spend(budget, packed.bytes.len())?;
            let (numbers, rest) = packed.bytes.as_chunks::<8>();
            list.extend(numbers.iter().map(|&bytes| f64::from_le_bytes(bytes)));
            rest.is_empty().then_some(()).ok_or(Misfit::Schema)
        }
        (Scalar::Float, List::Float(list)) => {
            spend(budget, packed.bytes.len())?;
            let (numbers, rest) = packed.bytes.as_chunks::<4>();
            list.extend(numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)));
            rest.is_empty().then_some(()).ok_or(Misfit::Schema)
        }
        _ => {
            while !packed.bytes.is_empty() {
                single(scalar, number, &mut packed, list, budget)?;
            }
            Ok(())
        }
    }
}

/// Wire type of a value that stands alone.
fn native_kind(scalar: Scalar) -> u8 {
    match scalar {
        Scalar::Double | Scalar::Fixed64 | Scalar::SFixed64 => 1,
        Scalar::Float | Scalar::Fixed32 | Scalar::SFixed32 => 5,
        Scalar::Text | Scalar::Bytes => 2,
        Scalar::Group => 3,
        _ => 0,
    }
}

fn single(
    scalar: Scalar,
    number: u32,
    wire: &mut Wire<'_>,
    list: &mut List,
    budget: &mut Budget,
) -> Result<(), Misfit> {
    spend(budget, list.size())?;
    match (scalar, list) {
        (Scalar::Double, List::Double(list)) => list.push(f64::from_le_bytes(wire.fixed()?)),
        (Scalar::Float, List::Float(list)) => list.push(f32::from_le_bytes(wire.fixed()?)),
        (Scalar::Int32 | Scalar::Int64, List::Int(list)) => list.push(wire.varint()? as i64),
        (Scalar::UInt32 | Scalar::UInt64, List::UInt(list)) => list.push(wire.varint()?),
        (Scalar::SInt32 | Scalar::SInt64, List::Int(list)) => {
            let zigzag = wire.varint()?;
            list.push((zigzag >> 1) as i64 ^ -((zigzag & 1) as i64));
        }
        (Scalar::Fixed32, List::UInt(list)) => list.push(u64::from(u32::from_le_bytes(wire.fixed()?))),
        (Scalar::Fixed64, List::UInt(list)) => list.push(u64::from_le_bytes(wire.fixed()?)),
        (Scalar::SFixed32, List::Int(list)) => list.push(i64::from(i32::from_le_bytes(wire.fixed()?))),
        (Scalar::SFixed64, List::Int(list)) => list.push(i64::from_le_bytes(wire.fixed()?)),
        (Scalar::Bool, List::Bool(list)) => list.push(wire.varint()? != 0),
        (Scalar::Enum, List::Enum(list)) => list.push(wire.varint()? as i32),
        (Scalar::Text, List::Text(list)) => {
            let text = std::str::from_utf8(wire.block()?).map_err(|_| Misfit::Schema)?;
            spend(budget, text.len())?;
            list.push(text.to_owned());
        }
        (Scalar::Bytes, List::Bytes(list)) => {
            let bytes = wire.block()?;
            spend(budget, bytes.len())?;
            list.push(bytes.to_vec());
        }
        (Scalar::Group, List::Bytes(list)) => {
            let start = wire.bytes;
            wire.skip(number, 3, 0)?;
            spend(budget, start.len() - wire.bytes.len())?;
            list.push(start[..start.len() - wire.bytes.len()].to_vec());
        }
        _ => unreachable!("a leaf's list is made for its type"),
    }
    Ok(())
}

impl List {
    /// Memory of a value \[bytes\]; of a text or byte string, what it takes besides its bytes.
    fn size(&self) -> usize {
        match self {
            Self::Double(_) | Self::Int(_) | Self::UInt(_) => 8,
            Self::Float(_) | Self::Enum(_) => 4,
            Self::Bool(_) => 1,
            Self::Text(_) | Self::Bytes(_) => BLOCK,
        }
    }
}

/// Bytes of a message that are still to be read.
pub(super) struct Wire<'a> {
    pub(super) bytes: &'a [u8],
}

impl<'a> Wire<'a> {
    /// Number and wire type of the next field.
    pub(super) fn key(&mut self) -> Result<(u32, u8), Misfit> {
        let key = self.varint()?;
        Ok((u32::try_from(key >> 3).map_err(|_| Misfit::Schema)?, (key & 7) as u8))
    }

    pub(super) fn varint(&mut self) -> Result<u64, Misfit> {
        let mut value = 0;
        for (i, &byte) in self.bytes.iter().enumerate().take(10) {
            value |= u64::from(byte & 0x7f) << (7 * i);
            if byte < 0x80 {
                // the tenth byte has room for one bit
                if i == 9 && byte > 1 {
                    return Err(Misfit::Schema);
                }
                self.bytes = &self.bytes[i + 1..];
                return Ok(value);
            }
        }
        Err(Misfit::Schema)
    }

    fn fixed<const N: usize>(&mut self) -> Result<[u8; N], Misfit> {
        let (head, rest) = self.bytes.split_first_chunk::<N>().ok_or(Misfit::Schema)?;
        self.bytes = rest;
        Ok(*head)
    }

    pub(super) fn block(&mut self) -> Result<&'a [u8], Misfit> {
        let length = usize::try_from(self.varint()?).map_err(|_| Misfit::Schema)?;
        let (block, rest) = self.bytes.split_at_checked(length).ok_or(Misfit::Schema)?;
        self.bytes = rest;
        Ok(block)
    }

    /// Steps over a value whose key has been read.
    pub(super) fn skip(&mut self, number: u32, kind: u8, depth: usize) -> Result<(), Misfit> {
        const MAX_GROUPS: usize = 100;
        match kind {
            0 => self.varint().map(drop),
            1 => self.fixed::<8>().map(drop),
            2 => self.block().map(drop),
            3 if depth < MAX_GROUPS => loop {
                match self.key()? {
                    (inner, 4) if inner == number => return Ok(()),
                    (inner, kind) => self.skip(inner, kind, depth + 1)?,
                }
            },
            5 => self.fixed::<4>().map(drop),
            _ => Err(Misfit::Schema),
        }
    }
}
