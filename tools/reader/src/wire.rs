//! Messages taken apart into leaves: every number, text or byte string a message type can hold, by its path.
//!
//! A message type becomes a [`Layout`] once; a message then becomes [`Values`], one typed list per leaf. Arrays of
//! numbers are copied straight from the wire, which is what makes reading whole recordings cheap: the general dynamic
//! messages of `prost-reflect` take some fifty bytes and an allocation's worth of work per number.
//!
//! ```text
//! message M { double time = 1; repeated double p = 2; Vec v = 3; repeated Item items = 4; }
//! leaves: time, p, v.x, v.y, items.[#] (how many), items.name, …
//! ```
//!
//! A leaf that always holds exactly one value gets the default of its type where the wire has none, as proto3 asks.
//! A type inside itself is not unfolded again but kept as bytes, so the number of leaves is finite; fields that the
//! schema does not know are kept as bytes in the leaf [`UNKNOWN`]. Nothing a message says is lost, whatever it is.

mod decode;
mod dynamic;
pub(crate) mod schema;

use std::collections::{BTreeMap, HashMap};

use prost_reflect::{EnumDescriptor, FieldDescriptor, Kind, MessageDescriptor};

pub(crate) use dynamic::dynamic;

use crate::recording::Limits;

/// Path of the leaf that keeps the fields which the schema does not know.
pub const UNKNOWN: &str = "(unknown fields)";

/// Ends the path of a leaf that says how many there are of a list of messages, or in a list inside one.
pub const COUNT: &str = "[#]";

/// Largest number of fields that a type is unfolded into; what lies beyond stays bytes.
pub const MAX_LEAVES: usize = 10_000;

/// Longest that the paths of these fields may be together \[bytes\]; what lies beyond stays bytes.
const MAX_PATHS: usize = 4 << 20;

/// Deepest nesting that is unfolded; what lies beyond stays bytes.
const MAX_DEPTH: usize = 32;

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
}

impl Leaf {
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

/// A message type as a list of leaves, and how to find them on the wire.
#[derive(Clone, Debug)]
pub struct Layout {
    /// The leaves, in the order of the type's declaration; the last is [`UNKNOWN`].
    pub leaves: Vec<Leaf>,
    descriptor: MessageDescriptor,
    root: Node,
    /// Leaves in the order of their paths.
    by_path: Vec<u32>,
    /// Memory that a message may take \[bytes\].
    room: usize,
    /// Memory that the layout takes \[bytes\].
    weight: usize,
}

#[derive(Clone, Debug, Default)]
struct Node {
    slots: Vec<Slot>,
    /// Slot of field numbers below 64, the usual ones.
    near: Vec<Option<u8>>,
    far: BTreeMap<u32, usize>,
}

#[derive(Clone, Debug)]
struct Slot {
    number: u32,
    /// Oneof it belongs to: the last of its members wins.
    group: Option<usize>,
    is_list: bool,
    has_presence: bool,
    count: Option<usize>,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    Scalar { leaf: usize, scalar: Scalar },
    Message { node: Node, is_map: bool },
}

/// How a value stands on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scalar {
    Double,
    Float,
    Int32,
    Int64,
    UInt32,
    UInt64,
    SInt32,
    SInt64,
    Fixed32,
    Fixed64,
    SFixed32,
    SFixed64,
    Bool,
    Enum,
    Text,
    Bytes,
    Group,
}

/// The values of a leaf in one message.
#[derive(Clone, Debug, PartialEq)]
pub enum List {
    /// Double precision.
    Double(Vec<f64>),
    /// Single precision.
    Float(Vec<f32>),
    /// Signed whole numbers.
    Int(Vec<i64>),
    /// Unsigned whole numbers.
    UInt(Vec<u64>),
    /// Truth values.
    Bool(Vec<bool>),
    /// Numbers of names.
    Enum(Vec<i32>),
    /// Texts.
    Text(Vec<String>),
    /// Byte strings.
    Bytes(Vec<Vec<u8>>),
}

impl List {
    fn new(kind: &Type) -> Self {
        match kind {
            Type::Double => Self::Double(Vec::new()),
            Type::Float => Self::Float(Vec::new()),
            Type::Int => Self::Int(Vec::new()),
            Type::UInt => Self::UInt(Vec::new()),
            Type::Bool => Self::Bool(Vec::new()),
            Type::Enum(_) => Self::Enum(Vec::new()),
            Type::Text => Self::Text(Vec::new()),
            Type::Bytes => Self::Bytes(Vec::new()),
        }
    }

    /// Memory that is kept for values, used or not \[bytes\]; that of texts and byte strings themselves aside.
    fn capacity(&self) -> usize {
        match self {
            Self::Double(list) => 8 * list.capacity(),
            Self::Float(list) => 4 * list.capacity(),
            Self::Int(list) => 8 * list.capacity(),
            Self::UInt(list) => 8 * list.capacity(),
            Self::Bool(list) => list.capacity(),
            Self::Enum(list) => 4 * list.capacity(),
            Self::Text(list) => 24 * list.capacity(),
            Self::Bytes(list) => 24 * list.capacity(),
        }
    }

    /// An empty list of the same type, without memory.
    fn renew(&mut self) {
        *self = match self {
            Self::Double(_) => Self::Double(Vec::new()),
            Self::Float(_) => Self::Float(Vec::new()),
            Self::Int(_) => Self::Int(Vec::new()),
            Self::UInt(_) => Self::UInt(Vec::new()),
            Self::Bool(_) => Self::Bool(Vec::new()),
            Self::Enum(_) => Self::Enum(Vec::new()),
            Self::Text(_) => Self::Text(Vec::new()),
            Self::Bytes(_) => Self::Bytes(Vec::new()),
        };
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Double(list) => list.len(),
            Self::Float(list) => list.len(),
            Self::Int(list) => list.len(),
            Self::UInt(list) => list.len(),
            Self::Bool(list) => list.len(),
            Self::Enum(list) => list.len(),
            Self::Text(list) => list.len(),
            Self::Bytes(list) => list.len(),
        }
    }

    /// True if there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn clear(&mut self) {
        match self {
            Self::Double(list) => list.clear(),
            Self::Float(list) => list.clear(),
            Self::Int(list) => list.clear(),
            Self::UInt(list) => list.clear(),
            Self::Bool(list) => list.clear(),
            Self::Enum(list) => list.clear(),
            Self::Text(list) => list.clear(),
            Self::Bytes(list) => list.clear(),
        }
    }

    fn pop(&mut self) {
        match self {
            Self::Double(list) => drop(list.pop()),
            Self::Float(list) => drop(list.pop()),
            Self::Int(list) => drop(list.pop()),
            Self::UInt(list) => drop(list.pop()),
            Self::Bool(list) => drop(list.pop()),
            Self::Enum(list) => drop(list.pop()),
            Self::Text(list) => drop(list.pop()),
            Self::Bytes(list) => drop(list.pop()),
        }
    }

    fn push_default(&mut self) {
        match self {
            Self::Double(list) => list.push(0.0),
            Self::Float(list) => list.push(0.0),
            Self::Int(list) => list.push(0),
            Self::UInt(list) => list.push(0),
            Self::Bool(list) => list.push(false),
            Self::Enum(list) => list.push(0),
            Self::Text(list) => list.push(String::new()),
            Self::Bytes(list) => list.push(Vec::new()),
        }
    }

    /// Value `index` as a number, where it is one.
    pub fn number(&self, index: usize) -> Option<f64> {
        match self {
            Self::Double(list) => list.get(index).copied(),
            Self::Float(list) => list.get(index).map(|&value| f64::from(value)),
            Self::Int(list) => list.get(index).map(|&value| value as f64),
            Self::UInt(list) => list.get(index).map(|&value| value as f64),
            Self::Bool(_) | Self::Enum(_) | Self::Text(_) | Self::Bytes(_) => None,
        }
    }

    /// All values as numbers; `false` if they are none.
    pub fn numbers(&self, into: &mut Vec<f64>) -> bool {
        into.clear();
        match self {
            Self::Double(list) => into.extend_from_slice(list),
            Self::Float(list) => into.extend(list.iter().map(|&value| f64::from(value))),
            Self::Int(list) => into.extend(list.iter().map(|&value| value as f64)),
            Self::UInt(list) => into.extend(list.iter().map(|&value| value as f64)),
            Self::Bool(_) | Self::Enum(_) | Self::Text(_) | Self::Bytes(_) => return false,
        }
        true
    }
}

/// A message taken apart: one list per leaf of its [`Layout`].
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// The lists, in the order of the leaves.
    pub lists: Vec<List>,
}

impl Values {
    /// Bytes of memory that the values take, roughly.
    pub fn weight(&self) -> usize {
        let bytes = |list: &List| match list {
            List::Double(list) => 8 * list.len(),
            List::Float(list) => 4 * list.len(),
            List::Int(list) => 8 * list.len(),
            List::UInt(list) => 8 * list.len(),
            List::Bool(list) => list.len(),
            List::Enum(list) => 4 * list.len(),
            List::Text(list) => list.iter().map(|text| 24 + text.len()).sum(),
            List::Bytes(list) => list.iter().map(|bytes| 24 + bytes.len()).sum(),
        };
        self.lists.iter().map(|list| 32 + bytes(list)).sum()
    }

    /// Gives back what is more memory than small messages take, where the values stay for the next message of a channel:
    /// of many channels, each would keep that of its largest message.
    pub fn release(&mut self) {
        /// Memory that is kept, for the messages of a step: a few numbers each \[bytes\].
        const KEPT: usize = 4096;
        for list in &mut self.lists {
            if let List::Text(_) | List::Bytes(_) = list {
                list.clear();
            }
        }
        if self.lists.iter().map(List::capacity).sum::<usize>() > KEPT {
            self.lists.iter_mut().for_each(List::renew);
        }
    }
}

/// A message that cannot be taken apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Misfit {
    /// It does not fit its type.
    #[error("the message does not fit its schema")]
    Schema,
    /// It would take more memory than there is for it.
    #[error("the message unpacks to more than --max-memory allows")]
    Memory,
}

impl Layout {
    /// Unfolds a message type, for messages that take as much memory as [`Limits::values`] allows by default.
    pub fn of(descriptor: &MessageDescriptor) -> Self {
        let mut builder = Builder { leaves: Vec::new(), open: Vec::new(), slots: 0, nodes: 0, paths: 0 };
        let place = Place::default();
        let root = builder.node(descriptor, &place);
        builder.leaf(Leaf {
            path: UNKNOWN.into(),
            numbers: Vec::new(),
            kind: Type::Bytes,
            lists: 1,
            ends_in_list: true,
            first_list: 0,
            is_single: false,
        });
        let leaves = builder.leaves;
        let mut by_path: Vec<u32> = (0..).take(leaves.len()).collect();
        // stable: of equal paths the first leaf comes first
        by_path.sort_by(|&i, &j| leaves[i as usize].path.cmp(&leaves[j as usize].path));
        let paths: usize = leaves.iter().map(|leaf| leaf.path.len() + 4 * leaf.numbers.len()).sum();
        let of_leaf = size_of::<Leaf>() + 64 + size_of::<u32>();
        let weight =
            paths + of_leaf * leaves.len() + 2 * size_of::<Slot>() * builder.slots + 512 * builder.nodes;
        let room = Limits::default().values();
        Self { leaves, descriptor: descriptor.clone(), root, by_path, room, weight }
    }

    /// The same for messages that take up to `room` bytes of memory.
    pub fn within(self, room: usize) -> Self {
        Self { room, ..self }
    }

    /// Memory that it takes \[bytes\].
    pub(crate) fn weight(&self) -> usize {
        self.weight
    }

    /// The type it was made of.
    pub fn descriptor(&self) -> &MessageDescriptor {
        &self.descriptor
    }

    /// Empty lists for [`Layout::decode`] to fill.
    pub fn values(&self) -> Values {
        Values { lists: self.leaves.iter().map(|leaf| List::new(&leaf.kind)).collect() }
    }

    /// True if the same bytes are the same values in another layout.
    pub fn is_like(&self, other: &Self) -> bool {
        let same = |(a, b): (&Leaf, &Leaf)| a.path == b.path && a.numbers == b.numbers && a.kind == b.kind;
        let same_file = self.descriptor.descriptor_proto() == other.descriptor.descriptor_proto();
        same_file
            && self.leaves.len() == other.leaves.len()
            && self.leaves.iter().zip(&other.leaves).all(same)
    }

    /// Index of a leaf by its path.
    pub fn find(&self, path: &str) -> Option<usize> {
        let path_of = |&leaf: &u32| self.leaves[leaf as usize].path.as_str();
        let place = self.by_path.partition_point(|leaf| path_of(leaf) < path);
        self.by_path.get(place).filter(|leaf| path_of(leaf) == path).map(|&leaf| leaf as usize)
    }
}

/// Where a node hangs in the tree of a type.
#[derive(Clone, Default)]
struct Place {
    path: String,
    numbers: Vec<u32>,
    lists: usize,
    first_list: Option<usize>,
    /// True below something that need not be there.
    is_optional: bool,
}

struct Builder {
    leaves: Vec<Leaf>,
    open: Vec<String>,
    /// Fields so far, those included that have no leaf.
    slots: usize,
    nodes: usize,
    /// Length of all paths so far \[bytes\].
    paths: usize,
}

impl Builder {
    fn leaf(&mut self, leaf: Leaf) -> usize {
        self.leaves.push(leaf);
        self.leaves.len() - 1
    }

    fn node(&mut self, message: &MessageDescriptor, place: &Place) -> Node {
        self.open.push(message.full_name().to_owned());
        let mut node = Node { near: vec![None; 64], ..Node::default() };
        self.nodes += 1;
        self.slots += message.fields().len();
        let groups: HashMap<String, usize> =
            message.oneofs().enumerate().map(|(i, group)| (group.name().to_owned(), i)).collect();
        for field in message.fields() {
            let slot = self.slot(&field, place, &groups);
            let (index, number) = (node.slots.len(), slot.number);
            match (node.near.get_mut(number as usize), u8::try_from(index)) {
                (Some(near), Ok(index)) => *near = Some(index),
                _ => drop(node.far.insert(number, index)),
            }
            node.slots.push(slot);
        }
        self.open.pop();
        node
    }

    fn slot(&mut self, field: &FieldDescriptor, place: &Place, groups: &HashMap<String, usize>) -> Slot {
        let name = field.name();
        let is_list = field.is_list() || field.is_map();
        let has_presence = !is_list && field.supports_presence();
        let mut inner = Place {
            path: if place.path.is_empty() { name.to_owned() } else { format!("{}.{name}", place.path) },
            numbers: [&place.numbers[..], &[field.number()]].concat(),
            lists: place.lists + usize::from(is_list),
            first_list: place.first_list.or(is_list.then_some(place.numbers.len())),
            is_optional: place.is_optional || has_presence,
        };
        self.paths += inner.path.len();
        let message = match field.kind() {
            Kind::Message(message) if self.unfolds(field, &message, &inner) => Some(message),
            _ => None,
        };
        // the number of values of a leaf says how long its list is, except below other lists and for messages
        let varies = is_list || has_presence;
        let is_counted = varies && (place.lists > 0 || (is_list && message.is_some()));
        let count = is_counted.then(|| {
            self.leaf(Leaf {
                path: format!("{}.{COUNT}", inner.path),
                numbers: inner.numbers.clone(),
                kind: Type::UInt,
                lists: place.lists,
                ends_in_list: true,
                first_list: place.first_list.unwrap_or(inner.numbers.len()),
                is_single: false,
            })
        });
        let content = match message {
            Some(message) => {
                inner.is_optional &= inner.lists == 0;
                Content::Message { node: self.node(&message, &inner), is_map: field.is_map() }
            }
            None => {
                let (scalar, kind) = scalar(field);
                let leaf = self.leaf(Leaf {
                    first_list: inner.first_list.unwrap_or(inner.numbers.len()),
                    path: inner.path,
                    numbers: inner.numbers,
                    kind,
                    lists: inner.lists,
                    ends_in_list: is_list,
                    is_single: inner.lists == 0 && !inner.is_optional,
                });
                Content::Scalar { leaf, scalar }
            }
        };
        let group = field.containing_oneof().and_then(|group| groups.get(group.name()).copied());
        Slot { number: field.number(), group, is_list, has_presence, count, content }
    }

    fn unfolds(&self, field: &FieldDescriptor, message: &MessageDescriptor, place: &Place) -> bool {
        !field.is_group()
            && place.numbers.len() < MAX_DEPTH
            && self.slots + message.fields().len() < MAX_LEAVES
            && self.paths < MAX_PATHS
            && !self.open.iter().any(|name| name == message.full_name())
    }
}

fn scalar(field: &FieldDescriptor) -> (Scalar, Type) {
    match field.kind() {
        Kind::Double => (Scalar::Double, Type::Double),
        Kind::Float => (Scalar::Float, Type::Float),
        Kind::Int32 => (Scalar::Int32, Type::Int),
        Kind::Int64 => (Scalar::Int64, Type::Int),
        Kind::Uint32 => (Scalar::UInt32, Type::UInt),
        Kind::Uint64 => (Scalar::UInt64, Type::UInt),
        Kind::Sint32 => (Scalar::SInt32, Type::Int),
        Kind::Sint64 => (Scalar::SInt64, Type::Int),
        Kind::Fixed32 => (Scalar::Fixed32, Type::UInt),
        Kind::Fixed64 => (Scalar::Fixed64, Type::UInt),
        Kind::Sfixed32 => (Scalar::SFixed32, Type::Int),
        Kind::Sfixed64 => (Scalar::SFixed64, Type::Int),
        Kind::Bool => (Scalar::Bool, Type::Bool),
        Kind::Enum(kind) => (Scalar::Enum, Type::Enum(kind)),
        Kind::String => (Scalar::Text, Type::Text),
        Kind::Bytes => (Scalar::Bytes, Type::Bytes),
        Kind::Message(_) if field.is_group() => (Scalar::Group, Type::Bytes),
        Kind::Message(_) => (Scalar::Bytes, Type::Bytes),
    }
}
