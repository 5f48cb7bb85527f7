//! What a message says of its shape.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};

use super::{Fields, MAX_DEPTH, Shape, field};
use crate::recording::Budget;

/// Up to here all whole numbers are double-precision numbers.
const EXACT: u64 = 1 << f64::MANTISSA_DIGITS;

impl Shape {
    /// Takes in what a message says; what is no JSON says nothing from there on.
    pub(crate) fn observe(&mut self, bytes: &[u8], budget: &mut Budget) {
        let mut json = serde_json::Deserializer::from_slice(bytes);
        let message = &mut Message { budget, rounded: Rounded::of(bytes) };
        let observer = Observer { shape: self, depth: 0, in_list: false, nested: &mut false, message };
        // a message that breaks off is reported where it is decoded
        let _ = observer.deserialize(&mut json);
    }
}

/// A message that is looked at.
struct Message<'m> {
    budget: &'m mut Budget,
    rounded: Rounded<'m>,
}

struct Observer<'a, 'm> {
    shape: &'a mut Shape,
    depth: usize,
    /// True for an element of an array: arrays in it go on with the same elements.
    in_list: bool,
    /// Set where an array is in an array.
    nested: &'a mut bool,
    message: &'a mut Message<'m>,
}

impl<'de> DeserializeSeed<'de> for Observer<'_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        match self.shape {
            Shape::Text => deserializer.deserialize_ignored_any(IgnoredAny).map(drop),
            _ => deserializer.deserialize_any(self),
        }
    }
}

impl<'de> Visitor<'de> for Observer<'_, '_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a value")
    }

    fn visit_bool<E>(self, _: bool) -> Result<(), E> {
        self.shape.meet(Shape::Bool);
        Ok(())
    }

    fn visit_i64<E>(self, value: i64) -> Result<(), E> {
        self.shape.meet_whole(value.unsigned_abs(), true);
        Ok(())
    }

    fn visit_u64<E>(self, value: u64) -> Result<(), E> {
        self.shape.meet_whole(value, i64::try_from(value).is_ok());
        Ok(())
    }

    fn visit_f64<E>(self, value: f64) -> Result<(), E> {
        // 3.0 is a whole number too
        if *self.shape == Shape::Integer {
            if value.fract() != 0.0 || value.abs() > EXACT as f64 {
                // double precision would not hold the whole numbers there have been
                *self.shape = Shape::Text;
            }
        } else {
            let is_rounded = self.message.rounded.holds(value, self.message.budget);
            self.shape.meet(if is_rounded { Shape::Text } else { Shape::Number });
        }
        Ok(())
    }

    fn visit_str<E>(self, value: &str) -> Result<(), E> {
        if *self.shape != Shape::Number || special(value).is_none() {
            self.shape.meet(Shape::Text);
        }
        Ok(())
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        match self.shape {
            // an element keeps its place, as NaN where numbers are
            Shape::Integer | Shape::Bool if self.in_list => *self.shape = Shape::Text,
            _ => {}
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<(), A::Error> {
        let Self { shape, depth, in_list, nested, message } = self;
        if in_list {
            *nested = true;
        } else if matches!(shape, Shape::Unknown) {
            *shape = Shape::List(Box::default());
        } else if !matches!(shape, Shape::List(_) | Shape::Nested(_)) {
            shape.meet(Shape::Text);
        }
        let mut has_nested = false;
        loop {
            let shape = match &mut *shape {
                Shape::List(element) | Shape::Nested(element) if !in_list => element.as_mut(),
                shape => shape,
            };
            let nested = &mut has_nested;
            let next = Observer { shape, depth, in_list: true, nested, message: &mut *message };
            if sequence.next_element_seed(next)?.is_none() {
                break;
            }
        }
        if let Shape::List(element) = shape
            && !in_list
            && has_nested
        {
            *shape = Shape::Nested(std::mem::take(element));
        }
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let Self { shape, depth, message, .. } = self;
        if matches!(shape, Shape::Unknown) && depth < MAX_DEPTH {
            *shape = Shape::Object(Fields::default());
        }
        while let Some(name) = map.next_key::<String>()? {
            let inner = match &mut *shape {
                Shape::Object(fields) => field(fields, &name, message.budget),
                _ => None,
            };
            match inner {
                Some(shape) => {
                    let (depth, nested) = (depth + 1, &mut false);
                    let message = &mut *message;
                    map.next_value_seed(Observer { shape, depth, in_list: false, nested, message })?;
                }
                None => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        if !matches!(shape, Shape::Object(_)) {
            shape.meet(Shape::Text);
        }
        Ok(())
    }
}

impl Shape {
    /// Takes in a whole number: one that is no double-precision number makes the field one of whole numbers, or of texts if
    /// it has fractions.
    ///
    /// * `fits`: it is between the ends of 64-bit signed numbers
    fn meet_whole(&mut self, magnitude: u64, fits: bool) {
        match self {
            Self::Integer if fits => {}
            Self::Unknown if fits && magnitude > EXACT => *self = Self::Integer,
            Self::Integer => *self = Self::Text,
            _ if is_double(magnitude) => self.meet(Self::Number),
            _ => self.meet(Self::Text),
        }
    }
}

/// True if a whole number is the shortest text of a double-precision number: one that a program wrote which has no others.
pub(super) fn is_double(magnitude: u64) -> bool {
    magnitude <= EXACT || (magnitude as f64).to_string() == magnitude.to_string()
}

/// The whole numbers of a message beyond 64 bits that are no double-precision numbers, as which they arrive. They are looked for
/// where a number of that size does.
pub(super) struct Rounded<'a> {
    message: &'a [u8],
    /// Bits of the nearest double-precision numbers, in order.
    known: Option<Vec<u64>>,
}

impl<'a> Rounded<'a> {
    pub(super) fn of(message: &'a [u8]) -> Self {
        Self { message, known: None }
    }

    /// True if a number may have been another one in the text; also if there is no room to know.
    pub(super) fn holds(&mut self, value: f64, budget: &mut Budget) -> bool {
        /// Up to here whole numbers arrive as they are.
        const WHOLE: f64 = (1_u64 << 63) as f64;
        if value.abs() < WHOLE {
            return false;
        }
        let room = self.message.len();
        if !budget.spend(room) {
            return true;
        }
        let known = self.known.get_or_insert_with(|| rounded(self.message));
        budget.give_back(room);
        known.binary_search(&value.to_bits()).is_ok()
    }
}

/// Bits of the double-precision numbers nearest to whole numbers that are none, in order.
fn rounded(message: &[u8]) -> Vec<u64> {
    /// Digits of the first beyond 64 bits.
    const DIGITS: usize = 19;
    let is_part = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-.".contains(byte);
    let words = message.split(|byte| !is_part(byte)).filter(|word| word.len() >= DIGITS);
    let bits = |word: &[u8]| {
        let text = str::from_utf8(word).ok()?;
        let is_whole = text.strip_prefix('-').unwrap_or(text).bytes().all(|byte| byte.is_ascii_digit());
        let value: f64 = text.parse().ok().filter(|_| is_whole)?;
        (value.to_string() != text).then_some(value.to_bits())
    };
    let mut all: Vec<u64> = words.filter_map(bits).collect();
    all.sort_unstable();
    all
}

/// The numbers that JSON has no form for, as the JSON mapping of protobuf writes them.
pub(crate) fn special(text: &str) -> Option<f64> {
    match text {
        "NaN" => Some(f64::NAN),
        "Infinity" => Some(f64::INFINITY),
        "-Infinity" => Some(f64::NEG_INFINITY),
        _ => None,
    }
}
