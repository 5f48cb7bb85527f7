//! The values of a decoded message: one typed list per leaf.

use super::leaf::Type;

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

/// Does the same with the values of a list, whatever their type.
macro_rules! each {
    ($list:expr, $values:ident => $result:expr) => {
        match $list {
            List::Double($values) => $result,
            List::Float($values) => $result,
            List::Int($values) => $result,
            List::UInt($values) => $result,
            List::Bool($values) => $result,
            List::Enum($values) => $result,
            List::Text($values) => $result,
            List::Bytes($values) => $result,
        }
    };
}

/// Memory of a value in a list, that of texts and byte strings themselves aside \[bytes\].
fn width<T>(_: &[T]) -> usize {
    size_of::<T>()
}

impl List {
    /// An empty list for the values of a type.
    pub(super) fn new(kind: &Type) -> Self {
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

    /// Memory of a value, that of texts and byte strings themselves aside \[bytes\].
    pub(super) fn width(&self) -> usize {
        each!(self, list => width(list))
    }

    /// Memory that is reserved for values, that of texts and byte strings themselves aside \[bytes\].
    fn capacity(&self) -> usize {
        each!(self, list => list.capacity() * width(list))
    }

    /// Number of values.
    pub fn len(&self) -> usize {
        each!(self, list => list.len())
    }

    /// True if there is no value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(super) fn clear(&mut self) {
        each!(self, list => list.clear());
    }

    pub(super) fn pop(&mut self) {
        each!(self, list => drop(list.pop()));
    }

    pub(super) fn push_default(&mut self) {
        each!(self, list => list.push(Default::default()));
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

/// Key of a map.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Key {
    /// A truth value.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A whole number that is not negative.
    UInt(u64),
    /// A text.
    Text(String),
}

impl List {
    /// Value `index` as the key of a map, where it can be one.
    pub(crate) fn key(&self, index: usize) -> Option<Key> {
        match self {
            Self::Bool(list) => list.get(index).copied().map(Key::Bool),
            Self::Int(list) => list.get(index).copied().map(Key::Int),
            Self::UInt(list) => list.get(index).copied().map(Key::UInt),
            Self::Text(list) => list.get(index).cloned().map(Key::Text),
            _ => None,
        }
    }
}

/// A decoded message: one list per leaf of its [`Layout`](super::Layout).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// The lists, in the order of the leaves.
    pub lists: Vec<List>,
}

impl Values {
    /// Memory that the values take, approximately \[bytes\].
    pub fn weight(&self) -> usize {
        let content = |list: &List| match list {
            List::Text(list) => list.iter().map(String::len).sum(),
            List::Bytes(list) => list.iter().map(Vec::len).sum(),
            _ => 0,
        };
        self.lists.iter().map(|list| 32 + list.len() * list.width() + content(list)).sum()
    }

    /// Frees memory beyond what small messages take, where the values are reused for the next message of a channel: of
    /// many channels, each would keep that of its largest message.
    pub fn release(&mut self) {
        /// Memory that is kept, for the messages of a step: a few numbers each \[bytes\].
        const KEPT: usize = 4096;
        for list in &mut self.lists {
            if let List::Text(_) | List::Bytes(_) = list {
                list.clear();
            }
        }
        if self.lists.iter().map(List::capacity).sum::<usize>() > KEPT {
            self.lists.iter_mut().for_each(|list| each!(list, values => *values = Vec::new()));
        }
    }
}
