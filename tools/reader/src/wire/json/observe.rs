//! What a message says of its shape.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, SeqAccess, Visitor};

use super::{Fields, MAX_DEPTH, Shape};
use crate::recording::Budget;

/// Up to here all whole numbers are double-precision numbers.
const EXACT: u64 = 1 << f64::MANTISSA_DIGITS;

impl Shape {
    /// Takes in what a message says; what is no JSON says nothing from there on.
    pub(crate) fn observe(&mut self, bytes: &[u8], budget: &mut Budget) {
        let mut json = serde_json::Deserializer::from_slice(bytes);
        let observer = Observer { shape: self, depth: 0, in_list: false, budget };
        // a message that breaks off is reported where it is decoded
        let _ = observer.deserialize(&mut json);
    }
}

/// Looks at one value.
struct Observer<'a> {
    shape: &'a mut Shape,
    depth: usize,
    /// True for an element of an array: arrays in it go on with the same elements.
    in_list: bool,
    budget: &'a mut Budget,
}

impl<'de> DeserializeSeed<'de> for Observer<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<(), D::Error> {
        match self.shape {
            Shape::Text => deserializer.deserialize_ignored_any(IgnoredAny).map(drop),
            _ => deserializer.deserialize_any(self),
        }
    }
}

impl<'de> Visitor<'de> for Observer<'_> {
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
        if *self.shape != Shape::Integer || value.fract() != 0.0 || value.abs() > EXACT as f64 {
            self.shape.meet(Shape::Number);
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
            Shape::Integer if self.in_list => *self.shape = Shape::Number,
            Shape::Bool if self.in_list => *self.shape = Shape::Text,
            _ => {}
        }
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<(), A::Error> {
        let Self { shape, depth, in_list, budget } = self;
        if matches!(shape, Shape::Unknown) && !in_list {
            *shape = Shape::List(Box::default());
        }
        let element = match shape {
            Shape::List(element) => element.as_mut(),
            shape if in_list => shape,
            shape => {
                shape.meet(Shape::Text);
                shape
            }
        };
        loop {
            let next = Observer { shape: &mut *element, depth, in_list: true, budget: &mut *budget };
            if sequence.next_element_seed(next)?.is_none() {
                return Ok(());
            }
        }
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let Self { shape, depth, budget, .. } = self;
        if matches!(shape, Shape::Unknown) && depth < MAX_DEPTH {
            *shape = Shape::Object(Fields::default());
        }
        while let Some(name) = map.next_key::<String>()? {
            let field = match &mut *shape {
                Shape::Object(fields) => fields.entry(&name, budget),
                _ => None,
            };
            match field {
                Some(shape) => {
                    let depth = depth + 1;
                    map.next_value_seed(Observer { shape, depth, in_list: false, budget: &mut *budget })?;
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
    /// Takes in a whole number: one that is no double-precision number makes the field one of whole numbers.
    ///
    /// * `fits`: it is between the ends of 64-bit signed numbers
    fn meet_whole(&mut self, magnitude: u64, fits: bool) {
        match self {
            Self::Integer if fits => {}
            Self::Unknown if fits && magnitude > EXACT => *self = Self::Integer,
            _ => self.meet(Self::Number),
        }
    }
}

/// The numbers that JSON has no form for, as the JSON mapping of protobuf writes them.
pub(super) fn special(text: &str) -> Option<f64> {
    match text {
        "NaN" => Some(f64::NAN),
        "Infinity" => Some(f64::INFINITY),
        "-Infinity" => Some(f64::NEG_INFINITY),
        _ => None,
    }
}
