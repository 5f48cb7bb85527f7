//! What the leaves of a message type are.

use prost_reflect::{EnumDescriptor, Kind};

/// Path of the leaf that keeps the fields which the schema does not know.
pub const UNKNOWN: &str = "(unknown fields)";

/// Ends the path of a leaf that counts the elements of a list of messages, or of a list inside one, or says
/// whether a message is there.
pub const COUNT: &str = "[#]";

/// Largest number of fields that a type is unfolded into; what lies beyond stays bytes.
pub(super) const MAX_LEAVES: usize = 10_000;

/// Type of a leaf.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Type {
    /// Double precision.
    Double,
    /// Single precision.
    Float,
    /// Signed whole number.
    Int,
    /// Unsigned whole number.
    UInt,
    /// Truth value.
    Bool,
    /// Number with a name.
    Enum(EnumDescriptor),
    /// Text.
    Text,
    /// Bytes, or a message that is kept as bytes.
    Bytes,
}

impl Type {
    /// The type of the values of a field; messages that are not unfolded are bytes.
    pub(super) fn of(kind: Kind) -> Self {
        match kind {
            Kind::Double => Self::Double,
            Kind::Float => Self::Float,
            Kind::Int32 | Kind::Int64 | Kind::Sint32 | Kind::Sint64 => Self::Int,
            Kind::Sfixed32 | Kind::Sfixed64 => Self::Int,
            Kind::Uint32 | Kind::Uint64 | Kind::Fixed32 | Kind::Fixed64 => Self::UInt,
            Kind::Bool => Self::Bool,
            Kind::Enum(kind) => Self::Enum(kind),
            Kind::String => Self::Text,
            Kind::Bytes | Kind::Message(_) => Self::Bytes,
        }
    }

    /// Name in reports.
    pub fn name(&self) -> &str {
        match self {
            Self::Double => "double",
            Self::Float => "float",
            Self::Int => "signed integer",
            Self::UInt => "unsigned integer",
            Self::Bool => "bool",
            Self::Enum(kind) => kind.full_name(),
            Self::Text => "text",
            Self::Bytes => "bytes",
        }
    }

    /// True for numbers that can be measured: not for truth values and names.
    pub fn is_number(&self) -> bool {
        matches!(self, Self::Double | Self::Float | Self::Int | Self::UInt)
    }
}

/// A leaf of a message type.
#[derive(Clone, Debug)]
pub struct Leaf {
    /// Names of the fields that lead to it, joined by dots.
    pub path: String,
    /// Numbers of the fields that lead to it.
    pub numbers: Vec<u32>,
    /// Type.
    pub kind: Type,
    /// Number of lists on the way, itself included.
    pub lists: usize,
    /// True if it is a list itself, not only inside one.
    pub ends_in_list: bool,
    /// Number of the part of the path that is the first list; the number of parts if none is.
    pub first_list: usize,
    /// True if it always holds exactly one value.
    pub is_single: bool,
    /// True for the keys of a map and for counts: they say which values belong together.
    pub is_key: bool,
    /// Type as the schema declares it, if it does.
    pub declared: Option<Kind>,
}

impl Leaf {
    /// False for counts, and for the fields that the schema does not know.
    pub fn is_data(&self) -> bool {
        self.path != UNKNOWN && !self.path.ends_with(COUNT)
    }

    /// The leaf that is a whole message, kept as bytes.
    pub fn whole(path: &str) -> Self {
        Self {
            path: path.into(),
            numbers: Vec::new(),
            kind: Type::Bytes,
            lists: 0,
            ends_in_list: false,
            first_list: 0,
            is_single: true,
            is_key: false,
            declared: None,
        }
    }

    /// Name of value `index`: `stress[3]`, `joints[3].angle`; with several lists on the way their elements are numbered
    /// through.
    pub fn element(&self, index: usize) -> String {
        if self.lists == 0 {
            return self.path.clone();
        }
        if self.lists > 1 {
            return format!("{}[{index}]", self.path);
        }
        let parts = self.path.split('.').enumerate().map(|(i, part)| match i == self.first_list {
            true => format!("{part}[{index}]"),
            false => part.to_owned(),
        });
        parts.collect::<Vec<_>>().join(".")
    }
}

/// A message that cannot be decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    /// It does not fit its type.
    #[error("the message does not fit its schema")]
    SchemaMismatch,
    /// It would take more memory than there is for it.
    #[error("the message unpacks to more than --max-memory allows")]
    Memory,
}
