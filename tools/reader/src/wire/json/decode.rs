//! From JSON text to the lists of the leaves, without a tree in between: what a message takes is spent as it is read.

use std::{borrow::Cow, fmt};

use serde::{
    Deserialize,
    de::{DeserializeSeed, Deserializer, Error, MapAccess, SeqAccess, Visitor},
};
use serde_json::value::RawValue;

use super::observe::{Rounded, is_double, special};
use crate::{
    recording::Budget,
    wire::{
        cursor::spend,
        layout::{Content, Names, Node, Slot},
        leaf::DecodeError,
        list::List,
        seen::{BLOCK, Seen, complete, size},
    },
};

pub(in crate::wire) fn decode(
    node: &Node,
    names: &Names,
    bytes: &[u8],
    lists: &mut [List],
    budget: &mut Budget,
) -> Result<(), DecodeError> {
    let mut walk = Walk { lists, budget, rounded: Rounded::of(bytes), is_memory: false };
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let result = match (names.is_value, node.slots.first()) {
        (true, Some(slot)) => {
            let mut seen = Seen::of(node);
            Value::of(&mut walk, node, names, slot).deserialize(&mut json).and_then(|count| {
                seen.add(0, count, true);
                walk.end(node, &seen)
            })
        }
        _ => Object { walk: &mut walk, node, names }.deserialize(&mut json),
    };
    match result.and_then(|()| json.end()) {
        Ok(()) => Ok(()),
        Err(_) if walk.is_memory => Err(DecodeError::Memory),
        Err(_) => Err(DecodeError::SchemaMismatch),
    }
}

/// What is filled on the way through a message.
struct Walk<'a> {
    lists: &'a mut [List],
    budget: &'a mut Budget,
    rounded: Rounded<'a>,
    /// True if there was no room for the message.
    is_memory: bool,
}

impl Walk<'_> {
    fn spend<E: Error>(&mut self, bytes: usize) -> Result<(), E> {
        spend(self.budget, bytes).map_err(|error| {
            self.is_memory = true;
            E::custom(error)
        })
    }

    fn end<E: Error>(&mut self, node: &Node, seen: &Seen) -> Result<(), E> {
        complete(node, seen, self.lists, self.budget).map_err(|error| {
            self.is_memory |= error == DecodeError::Memory;
            E::custom(error)
        })
    }

    /// Keeps a field that has no leaf.
    fn keep<E: Error>(&mut self, name: &str, value: &RawValue) -> Result<(), E> {
        let name = serde_json::to_string(name).map_err(E::custom)?;
        let field = format!("{name}:{}", value.get());
        self.spend(BLOCK + field.len())?;
        if let Some(List::Bytes(unknown)) = self.lists.last_mut() {
            unknown.push(field.into_bytes());
        }
        Ok(())
    }
}

/// An object whose fields are known.
struct Object<'w, 'a> {
    walk: &'w mut Walk<'a>,
    node: &'w Node,
    names: &'w Names,
}

impl<'de> DeserializeSeed<'de> for Object<'_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        deserializer.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Object<'_, '_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let Self { walk, node, names } = self;
        // charge empty messages as well, to bound time
        walk.spend(node.slots.len())?;
        let mut seen = Seen::of(node);
        while let Some(Name(name)) = map.next_key()? {
            let Some(&number) = names.numbers.get(&*name) else {
                walk.keep(&name, map.next_value()?)?;
                continue;
            };
            let Some(index) = node.find(number).filter(|index| seen.count(*index) == 0) else {
                return Err(A::Error::custom("a field is there twice"));
            };
            let slot = &node.slots[index];
            let count = map.next_value_seed(Value::of(walk, node, names, slot))?;
            if count > 0 {
                seen.add(index, count, slot.is_list);
            }
        }
        walk.end(node, &seen)
    }
}

/// The name of a field, which is copied only where characters of it are escaped.
#[derive(Deserialize)]
struct Name<'a>(#[serde(borrow)] Cow<'a, str>);

/// The value of a field, or an element of an array; how many values it is.
struct Value<'w, 'a> {
    walk: &'w mut Walk<'a>,
    slot: &'w Slot,
    names: Option<&'w Names>,
    /// Leaf of the places and lengths of arrays inside arrays.
    lengths: Option<usize>,
    in_list: bool,
    /// Number of the element among all of the array.
    first: u64,
}

impl<'de> DeserializeSeed<'de> for Value<'_, '_> {
    type Value = u64;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<u64, D::Error> {
        let is_text = match &self.slot.content {
            Content::Scalar(scalar) => matches!(self.walk.lists[scalar.leaf], List::Text(_)),
            Content::Message { .. } => false,
        };
        if is_text && (self.in_list || !self.slot.is_list) {
            let value = <&RawValue>::deserialize(deserializer)?;
            return self.text(value.get());
        }
        deserializer.deserialize_any(self)
    }
}

impl<'w, 'a> Value<'w, 'a> {
    /// That of a field of a message.
    fn of(walk: &'w mut Walk<'a>, node: &Node, names: &'w Names, slot: &'w Slot) -> Self {
        let lengths = names.lengths.get(&slot.number).and_then(|number| node.find(*number));
        let lengths = lengths.and_then(|index| match &node.slots[index].content {
            Content::Scalar(scalar) => Some(scalar.leaf),
            Content::Message { .. } => None,
        });
        Self { walk, slot, names: names.inner.get(&slot.number), lengths, in_list: false, first: 0 }
    }

    /// A text as it is, anything else in the form of JSON.
    fn text<E: Error>(self, value: &str) -> Result<u64, E> {
        if value == "null" && !self.in_list {
            return Ok(0);
        }
        self.walk.spend(BLOCK + value.len())?;
        let text = if value.starts_with('"') {
            serde_json::from_str::<String>(value).map_err(E::custom)?
        } else {
            value.to_owned()
        };
        self.push(|list| {
            let List::Text(list) = list else { return None };
            list.push(text);
            Some(())
        })
    }

    /// One more value of a leaf.
    fn push<E: Error>(self, push: impl FnOnce(&mut List) -> Option<()>) -> Result<u64, E> {
        let Content::Scalar(scalar) = &self.slot.content else {
            return Err(E::custom("not an object"));
        };
        let memory = size(&self.walk.lists[scalar.leaf]);
        self.walk.spend(memory)?;
        push(&mut self.walk.lists[scalar.leaf]).ok_or_else(|| E::custom("another type"))?;
        Ok(1)
    }

    fn number<E: Error>(self, value: f64, whole: Option<i64>) -> Result<u64, E> {
        let is_double = whole.is_none_or(|whole| is_double(whole.unsigned_abs()));
        self.push(|list| {
            match list {
                // what is no double-precision number is not made one
                List::Double(list) if is_double => list.push(value),
                List::Int(list) => list.push(whole?),
                List::Text(list) => {
                    list.push(whole.map_or_else(|| value.to_string(), |whole| whole.to_string()));
                }
                _ => return None,
            }
            Some(())
        })
    }
}

impl<'de> Visitor<'de> for Value<'_, '_> {
    type Value = u64;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a value of the type of its field")
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<u64, E> {
        self.push(|list| {
            let List::Bool(list) = list else { return None };
            list.push(value);
            Some(())
        })
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<u64, E> {
        self.number(value as f64, Some(value))
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<u64, E> {
        match i64::try_from(value) {
            Ok(whole) => self.number(value as f64, Some(whole)),
            Err(_) if is_double(value) => self.number(value as f64, None),
            Err(_) => Err(E::custom("beyond the whole numbers of 64 bits")),
        }
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<u64, E> {
        /// Beyond, the nearest double-precision number may be another whole number.
        const EXACT: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;
        if self.walk.rounded.holds(value, self.walk.budget) {
            return Err(E::custom("no double-precision number"));
        }
        let is_whole = value.fract() == 0.0 && value.abs() <= EXACT;
        self.number(value, is_whole.then_some(value as i64))
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<u64, E> {
        self.walk.spend(value.len())?;
        self.push(|list| {
            match list {
                List::Text(list) => list.push(value.to_owned()),
                List::Double(list) => list.push(special(value)?),
                _ => return None,
            }
            Some(())
        })
    }

    fn visit_unit<E: Error>(self) -> Result<u64, E> {
        match &self.slot.content {
            _ if !self.in_list => Ok(0),
            Content::Message { node, .. } => self.walk.end(node, &Seen::of(node)).map(|()| 1),
            Content::Scalar(_) => self.number(f64::NAN, None),
        }
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<u64, A::Error> {
        let Self { walk, slot, names, lengths, in_list, first } = self;
        if !slot.is_list || (in_list && lengths.is_none()) {
            return Err(A::Error::custom("an array"));
        }
        let (mut total, mut length) = (0, 0);
        loop {
            let next = Value { walk: &mut *walk, slot, names, lengths, in_list: true, first: first + total };
            match sequence.next_element_seed(next)? {
                Some(count) => (total, length) = (total + count, length + 1),
                None => break,
            }
        }
        if in_list {
            walk.spend(16)?;
            if let Some(List::UInt(list)) = lengths.map(|leaf| &mut walk.lists[leaf]) {
                list.extend([first, length]);
            }
        }
        Ok(total)
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<u64, A::Error> {
        match (&self.slot.content, self.names) {
            (Content::Message { node, .. }, Some(names)) => {
                Object { walk: self.walk, node, names }.visit_map(map).map(|()| 1)
            }
            _ => Err(A::Error::custom("an object")),
        }
    }
}
