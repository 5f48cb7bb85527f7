//! JSON messages as the same leaves that protobuf messages have.
//!
//! JSON says of no field what it is. Its [`Shape`] is taken from the JSON schema of the channel as far as that says types,
//! and from the first messages of the channel. A shape becomes a [`Layout`] by way of a descriptor made for it, in which
//! every field is optional: all that reads leaves reads JSON too.
//!
//! | In a message | Leaf |
//! |---|---|
//! | `true`, `false` | truth value |
//! | number | double precision; a whole number where the schema says `integer`, or where it is beyond 2⁵³; the text where some messages have whole numbers that are no double-precision numbers, others fractions, or where they are beyond 2⁶³ |
//! | `"NaN"`, `"Infinity"`, `"-Infinity"` where numbers are | these numbers |
//! | text, also in base64; what is of different types in different messages, or nested too deep | text, that of JSON where it is none |
//! | object | one leaf for each of its fields, `pose.position.x` |
//! | array | list, `ranges[0]`, `joints[1].angle`; arrays inside arrays one after the other, and in `ranges[#]` the first element and the length of each |
//! | `null` | nothing there; in an array of numbers NaN |
//! | anything but an object, as a whole message | the field `value` |
//! | field that neither schema nor first messages have | kept as bytes, with the fields that the schema does not know |
//!
//! In the names of fields `.`, `[`, `]`, `@`, `,` and `;` are written `_`.

mod decode;
mod descriptor;
mod observe;
mod schema;

pub(super) use decode::decode;
pub(crate) use observe::special;
pub(crate) use schema::shape;

use indexmap::IndexMap;

use super::layout::Layout;
use crate::recording::Budget;

/// Deepest nesting that becomes fields; what lies deeper is text.
const MAX_DEPTH: usize = 30;

/// Memory of a field in a shape and in the descriptor made of it, besides its name \[bytes\].
const FIELD: usize = 2048;

/// What is known of a JSON value.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) enum Shape {
    #[default]
    Unknown,
    Bool,
    Integer,
    Number,
    /// A text, or different things in different messages.
    Text,
    List(Box<Shape>),
    /// Arrays inside an array, of which all elements are in one list.
    Nested(Box<Shape>),
    Object(Fields),
}

/// The fields of an object, in the order in which they come up.
pub(crate) type Fields = IndexMap<String, Shape>;

/// The shape of a field, added if it is new; `None` if there is no room for it.
fn field<'a>(fields: &'a mut Fields, name: &str, budget: &mut Budget) -> Option<&'a mut Shape> {
    let has_room = fields.contains_key(name) || budget.spend(FIELD + 8 * name.len());
    has_room.then(|| fields.entry(name.to_owned()).or_default())
}

impl Shape {
    /// True if messages have nothing to add: every type is known.
    pub(crate) fn is_whole(&self) -> bool {
        match self {
            Self::Unknown => false,
            Self::Bool | Self::Integer | Self::Number | Self::Text => true,
            Self::List(element) | Self::Nested(element) => element.is_whole(),
            Self::Object(fields) => !fields.is_empty() && fields.values().all(Self::is_whole),
        }
    }

    pub(crate) fn weight(&self) -> usize {
        match self {
            Self::List(element) | Self::Nested(element) => 64 + element.weight(),
            Self::Object(fields) => {
                fields.iter().map(|(name, shape)| FIELD + 8 * name.len() + shape.weight()).sum()
            }
            _ => 0,
        }
    }

    /// Takes in that a value may also be a scalar of another shape.
    fn meet(&mut self, other: Self) {
        *self = match (std::mem::take(self), other) {
            (Self::Unknown, other) => other,
            (known, other) if known == other => known,
            (Self::Integer, Self::Number) | (Self::Number, Self::Integer) => Self::Number,
            _ => Self::Text,
        };
    }
}

impl Layout {
    /// The layout of JSON messages; `None` if nothing is known of them.
    ///
    /// * `name`: of the schema
    pub(crate) fn of_json(shape: &Shape, name: &str) -> Option<Self> {
        let (message, names) = descriptor::message(shape, name)?;
        let mut layout = Self::of(&message);
        layout.names = Some(names);
        Some(layout)
    }
}
