//! A message type as a list of leaves.

use std::collections::HashMap;

use prost_reflect::{FieldDescriptor, Kind, MessageDescriptor};

use super::{
    leaf::{COUNT, Leaf, MAX_LEAVES, Type, UNKNOWN},
    list::{List, Values},
};
use crate::recording::Limits;

/// Greatest total length of the paths of the leaves \[bytes\]; what lies beyond stays bytes.
const MAX_PATHS: usize = 4 << 20;

/// Deepest nesting that is unfolded; what lies beyond stays bytes.
const MAX_DEPTH: usize = 32;

/// Messages whose fields are a time together.
const TIMES: [&str; 2] = ["google.protobuf.Timestamp", "google.protobuf.Duration"];

/// A message type as a list of leaves, and how to find them on the wire.
#[derive(Clone, Debug)]
pub struct Layout {
    /// The leaves, in the order of the type's declaration; the last is [`UNKNOWN`].
    pub leaves: Vec<Leaf>,
    pub(super) descriptor: MessageDescriptor,
    pub(super) root: Node,
    /// Names in JSON, where messages are that.
    pub(super) names: Option<Names>,
    by_path: Vec<u32>,
    /// Memory that a message may take \[bytes\].
    pub(crate) room: usize,
    /// Memory that it takes itself \[bytes\].
    pub(crate) weight: usize,
}

/// The fields of an object by their names in JSON.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    pub(super) numbers: HashMap<String, u32>,
    /// The fields of objects inside, by the numbers of the fields that hold them.
    pub(super) inner: HashMap<u32, Names>,
    /// Numbers of the fields that say where arrays inside arrays begin and how long they are, by those of the arrays.
    pub(super) lengths: HashMap<u32, u32>,
    /// True if a message is no object but the value of its only field.
    pub(super) is_value: bool,
}

/// A message type, or that of a message inside it, as the decoder walks through it.
#[derive(Clone, Debug, Default)]
pub(super) struct Node {
    /// In the order of their numbers.
    pub(super) slots: Vec<Slot>,
}

impl Node {
    /// Index of the slot of a field number.
    pub(super) fn find(&self, number: u32) -> Option<usize> {
        self.slots.binary_search_by_key(&number, |slot| slot.number).ok()
    }
}

/// A field.
#[derive(Clone, Debug)]
pub(crate) struct Slot {
    /// As it is declared.
    pub(crate) field: FieldDescriptor,
    pub(super) number: u32,
    /// Oneof it belongs to: the last of its members wins.
    pub(super) group: Option<usize>,
    pub(crate) is_list: bool,
    pub(super) has_presence: bool,
    /// Leaf that counts its values.
    pub(crate) count: Option<usize>,
    pub(super) content: Content,
}

impl Slot {
    /// Leaf of the keys of a map.
    pub(crate) fn keys(&self) -> Option<usize> {
        let Content::Message { node, is_map: true } = &self.content else { return None };
        match node.slots[node.find(1)?].content {
            Content::Scalar(Scalar { leaf, .. }) => Some(leaf),
            Content::Message { .. } => None,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) enum Content {
    Scalar(Scalar),
    Message { node: Node, is_map: bool },
}

/// A field whose values are those of a leaf.
#[derive(Clone, Debug)]
pub(super) struct Scalar {
    pub(super) leaf: usize,
    pub(super) kind: Kind,
    /// Wire type of a value that is not packed.
    pub(super) wire_type: u8,
}

impl Layout {
    /// Unfolds a message type, for messages that take as much memory as [`Limits::values`] allows by default.
    pub fn of(descriptor: &MessageDescriptor) -> Self {
        let mut builder = Builder { leaves: Vec::new(), open: Vec::new(), slots: 0, nodes: 0, paths: 0 };
        let root = builder.node(descriptor, &Branch::default());
        let mut leaves = builder.leaves;
        leaves.push(Leaf { lists: 1, ends_in_list: true, is_single: false, ..Leaf::whole(UNKNOWN) });
        let mut by_path: Vec<u32> = (0..).take(leaves.len()).collect();
        // stable: of equal paths the first leaf comes first
        by_path.sort_by(|&i, &j| leaves[i as usize].path.cmp(&leaves[j as usize].path));
        let paths: usize = leaves.iter().map(|leaf| leaf.path.len() + 4 * leaf.numbers.len()).sum();
        let of_leaf = size_of::<Leaf>() + 64 + size_of::<u32>();
        let weight =
            paths + of_leaf * leaves.len() + 2 * size_of::<Slot>() * builder.slots + 512 * builder.nodes;
        let room = Limits::default().values();
        Self { leaves, descriptor: descriptor.clone(), root, names: None, by_path, room, weight }
    }

    /// The same for messages that take up to `room` bytes of memory.
    pub fn within(self, room: usize) -> Self {
        Self { room, ..self }
    }

    /// True if messages are JSON.
    pub fn is_json(&self) -> bool {
        self.names.is_some()
    }

    /// The type it was made of; for JSON one that says the same.
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
            && self.is_json() == other.is_json()
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

/// The way from the message to one of its fields.
#[derive(Clone, Default)]
struct Branch {
    path: String,
    numbers: Vec<u32>,
    lists: usize,
    first_list: Option<usize>,
    /// True below something that need not be there.
    is_optional: bool,
}

impl Branch {
    fn join(&self, field: &FieldDescriptor, is_list: bool, has_presence: bool) -> Self {
        let name = field.name();
        Self {
            path: if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) },
            numbers: [&self.numbers[..], &[field.number()]].concat(),
            lists: self.lists + usize::from(is_list),
            first_list: self.first_list.or(is_list.then_some(self.numbers.len())),
            is_optional: self.is_optional || has_presence,
        }
    }
}

/// True if an empty message of a type has no value in any leaf: every field of it need not be there.
fn says_nothing(message: &MessageDescriptor) -> bool {
    message.fields().all(|field| field.is_list() || field.is_map() || field.supports_presence())
}

struct Builder {
    leaves: Vec<Leaf>,
    /// Names of the types that are being unfolded.
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

    fn node(&mut self, message: &MessageDescriptor, branch: &Branch) -> Node {
        self.open.push(message.full_name().to_owned());
        self.nodes += 1;
        self.slots += message.fields().len();
        let groups: HashMap<String, usize> =
            message.oneofs().enumerate().map(|(i, group)| (group.name().to_owned(), i)).collect();
        let slots = message.fields().map(|field| self.slot(field, branch, &groups)).collect();
        self.open.pop();
        Node { slots }
    }

    fn slot(&mut self, field: FieldDescriptor, parent: &Branch, groups: &HashMap<String, usize>) -> Slot {
        let is_list = field.is_list() || field.is_map();
        let has_presence = !is_list && field.supports_presence();
        let mut branch = parent.join(&field, is_list, has_presence);
        self.paths += branch.path.len();
        let message = match field.kind() {
            Kind::Message(message) if self.unfolds(&field, &message, &branch) => Some(message),
            _ => None,
        };
        // the number of values of a leaf says how long its list is, or that a message is there, except below other lists, for lists of
        // messages, and for messages of which no leaf has a value
        let varies = is_list || has_presence;
        let is_silent = message.as_ref().is_some_and(says_nothing);
        let is_counted = varies && (parent.lists > 0 || (is_list && message.is_some()) || is_silent);
        let count = is_counted.then(|| {
            self.leaf(Leaf {
                path: format!("{}.{COUNT}", branch.path),
                numbers: branch.numbers.clone(),
                kind: Type::UInt,
                lists: parent.lists,
                ends_in_list: true,
                first_list: parent.first_list.unwrap_or(branch.numbers.len()),
                is_single: false,
                is_key: true,
                declared: None,
            })
        });
        let content = match message {
            Some(message) => {
                branch.is_optional &= branch.lists == 0;
                Content::Message { node: self.node(&message, &branch), is_map: field.is_map() }
            }
            None => Content::Scalar(self.scalar(&field, branch, is_list)),
        };
        let group = field.containing_oneof().and_then(|group| groups.get(group.name()).copied());
        Slot { number: field.number(), field, group, is_list, has_presence, count, content }
    }

    fn scalar(&mut self, field: &FieldDescriptor, branch: Branch, is_list: bool) -> Scalar {
        let leaf = self.leaf(Leaf {
            first_list: branch.first_list.unwrap_or(branch.numbers.len()),
            is_key: (field.number() == 1 && field.parent_message().is_map_entry())
                || branch.path.ends_with(COUNT),
            path: branch.path,
            numbers: branch.numbers,
            kind: Type::of(field.kind()),
            lists: branch.lists,
            ends_in_list: is_list,
            is_single: branch.lists == 0 && !branch.is_optional,
            declared: Some(field.kind()),
        });
        let wire_type = match field.kind() {
            _ if field.is_group() => 3,
            Kind::Double | Kind::Fixed64 | Kind::Sfixed64 => 1,
            Kind::Float | Kind::Fixed32 | Kind::Sfixed32 => 5,
            Kind::String | Kind::Bytes | Kind::Message(_) => 2,
            _ => 0,
        };
        Scalar { leaf, kind: field.kind(), wire_type }
    }

    fn unfolds(&self, field: &FieldDescriptor, message: &MessageDescriptor, branch: &Branch) -> bool {
        !field.is_group()
            && branch.numbers.len() < MAX_DEPTH
            && self.slots + message.fields().len() < MAX_LEAVES
            && self.paths < MAX_PATHS
            && !self.open.iter().any(|name| name == message.full_name())
    }
}

impl Layout {
    /// True for what is in a `header`, a `stamp` or a `timestamp`, or in a message or object that is a time: of type
    /// `google.protobuf.Timestamp` or `Duration`, or with seconds in `sec` beside `nsec` or `nanosec`.
    pub fn says_when(&self, leaf: usize) -> bool {
        let is_time = |kind| matches!(kind, Kind::Message(inner) if TIMES.contains(&inner.full_name()));
        let path = &self.leaves[leaf].path;
        let (parents, name) = path.rsplit_once('.').unwrap_or(("", path));
        let beside = |name: &str| self.find(&format!("{parents}.{name}")).is_some();
        let has_seconds = !parents.is_empty() && beside("sec") && (beside("nsec") || beside("nanosec"));
        self.is_stamp(leaf)
            || (has_seconds && matches!(name, "sec" | "nsec" | "nanosec"))
            || self.way(leaf).any(|slot| is_time(slot.field.kind()))
    }

    /// True for what is in a `header`, a `stamp` or a `timestamp`.
    pub(crate) fn is_stamp(&self, leaf: usize) -> bool {
        let path = &self.leaves[leaf].path;
        path.starts_with("header.") || path.split('.').any(|part| matches!(part, "stamp" | "timestamp"))
    }

    /// True for a count of a message that need not be there, no list.
    pub(crate) fn counts_presence(&self, leaf: usize) -> bool {
        let is_plain = |slot: &Slot| !slot.is_list && slot.count == Some(leaf);
        self.way(leaf).last().is_some_and(is_plain)
    }

    /// The fields that lead to a leaf.
    pub(crate) fn way(&self, leaf: usize) -> impl Iterator<Item = &Slot> {
        let mut node = Some(&self.root);
        self.leaves[leaf].numbers.iter().map_while(move |&number| {
            let slot = &node?.slots[node?.find(number)?];
            node = match &slot.content {
                Content::Message { node, .. } => Some(node),
                Content::Scalar(_) => None,
            };
            Some(slot)
        })
    }
}
