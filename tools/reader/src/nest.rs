//! Where in a message a value stands: the elements of the lists on its way, and what is absent on it.
//!
//! The list of a leaf holds the values that are there, one after the other. Which of `joints[0].angle`, `joints[1].angle`
//! a value is, the leaves beside it that count, [`COUNT`], determine: how many elements a list has, whether an optional field is
//! there. A value keeps its place so, whatever else is absent.

use std::{
    collections::{BTreeSet, HashMap},
    fmt,
    ops::Range,
};

use prost_reflect::Kind;

use crate::wire::{COUNT, Layout, List, Type, Values};

/// Longest key of a map that becomes a column of its own \[bytes\].
const MAX_KEY: usize = 1024;

/// An element of a list, or the entry of a map with a key.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Element {
    /// Number of the element.
    Number(usize),
    /// Key of the entry.
    Key(Key),
}

impl Element {
    /// Memory that it takes in a list of places \[bytes\].
    pub(crate) fn weight(&self) -> usize {
        let text = if let Self::Key(Key::Text(key)) = self { 16 + key.len() } else { 0 };
        2 * size_of::<Self>() + 48 + text
    }
}

impl fmt::Display for Element {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Key(Key::Bool(key)) => write!(f, "{key}"),
            Self::Key(Key::Int(key)) => write!(f, "{key}"),
            Self::Key(Key::UInt(key)) => write!(f, "{key}"),
            Self::Key(Key::Text(key)) => f.write_str(key),
        }
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

impl Key {
    /// The key that a text stands for in a map with keys of a type.
    fn parse(text: &str, kind: &Type) -> Option<Self> {
        match kind {
            Type::Bool => text.parse().ok().map(Self::Bool),
            Type::Int => text.parse().ok().map(Self::Int),
            Type::UInt => text.parse().ok().map(Self::UInt),
            Type::Text => Some(Self::Text(text.to_owned())),
            _ => None,
        }
    }

    /// A key as it is in a message; `None` if it is too long for the name of a column.
    fn at(list: &List, index: usize) -> Option<Self> {
        match list {
            List::Bool(list) => list.get(index).copied().map(Self::Bool),
            List::Int(list) => list.get(index).copied().map(Self::Int),
            List::UInt(list) => list.get(index).copied().map(Self::UInt),
            List::Text(list) => list.get(index).filter(|key| key.len() <= MAX_KEY).cloned().map(Self::Text),
            _ => None,
        }
    }

    fn is_at(&self, list: &List, index: usize) -> bool {
        match (self, list) {
            (Self::Bool(key), List::Bool(list)) => list.get(index) == Some(key),
            (Self::Int(key), List::Int(list)) => list.get(index) == Some(key),
            (Self::UInt(key), List::UInt(list)) => list.get(index) == Some(key),
            (Self::Text(key), List::Text(list)) => list.get(index) == Some(key),
            _ => false,
        }
    }
}

/// What a name has in brackets, as text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Index {
    pub(crate) text: String,
    /// True for the key of a map, false for a number.
    pub(crate) is_key: bool,
}

/// The leaves of a layout that count, by the path of what they count.
pub(crate) struct Counts<'a>(HashMap<&'a str, usize>);

impl<'a> Counts<'a> {
    pub(crate) fn of(layout: &'a Layout) -> Self {
        let counted = layout.leaves.iter().enumerate().filter_map(|(index, leaf)| {
            let path = leaf.path.strip_suffix(COUNT)?.strip_suffix('.')?;
            Some((path, index))
        });
        Self(counted.collect())
    }
}

/// A field on the way to a leaf.
#[derive(Clone, Debug)]
struct Part {
    name: String,
    is_list: bool,
    /// Leaf that counts it for each message that may hold it; `None` where its number needs no counting.
    count: Option<usize>,
    /// Leaf of the keys, where it is a map and the way continues to its values.
    keys: Option<(usize, Type)>,
}

/// The way to a leaf.
#[derive(Clone, Debug)]
pub(crate) struct Nest {
    leaf: usize,
    parts: Vec<Part>,
    /// True for the keys of a map and what has no list between it and those.
    is_entry: bool,
}

impl Nest {
    /// The way to a leaf of a layout.
    pub(crate) fn of(layout: &Layout, counts: &Counts<'_>, leaf: usize) -> Self {
        let mut message = Some(layout.descriptor().clone());
        let (mut path, mut parts, mut is_entry) = (String::new(), Vec::new(), false);
        let numbers = &layout.leaves[leaf].numbers;
        for (i, &number) in numbers.iter().enumerate() {
            let Some(field) = message.as_ref().and_then(|message| message.get_field(number)) else { break };
            if !path.is_empty() {
                path.push('.');
            }
            path.push_str(field.name());
            is_entry |= i + 2 == numbers.len() && field.is_map();
            let is_to_value = field.is_map() && numbers.get(i + 1) == Some(&2);
            let keys = if is_to_value { layout.find(&format!("{path}.key")) } else { None };
            parts.push(Part {
                name: field.name().to_owned(),
                is_list: field.is_list() || field.is_map(),
                count: counts.0.get(path.as_str()).copied(),
                keys: keys.map(|leaf| (leaf, layout.leaves[leaf].kind.clone())),
            });
            message = match field.kind() {
                Kind::Message(inner) => Some(inner),
                _ => None,
            };
        }
        Self { leaf, parts, is_entry }
    }

    /// Number of lists on the way.
    pub(crate) fn lists(&self) -> usize {
        self.parts.iter().filter(|part| part.is_list).count()
    }

    /// True if there is a map on the way to one of its values.
    pub(crate) fn has_keys(&self) -> bool {
        self.parts.iter().any(|part| part.keys.is_some())
    }

    /// True for a field of the entries of a map, its keys or its values.
    pub(crate) fn is_map_entry(&self) -> bool {
        self.is_entry
    }

    /// True if some of the elements are entries of maps that are chosen by number.
    pub(crate) fn numbers_entries(&self, elements: &[Option<Element>]) -> bool {
        let lists = self.parts.iter().filter(|part| part.is_list).zip(elements);
        lists
            .into_iter()
            .any(|(part, element)| part.keys.is_some() && matches!(element, Some(Element::Number(_))))
    }

    /// Name of the value at an element of each list: `joints[0].angle`, `gains[kd]`. Lists without one are named whole.
    pub(crate) fn name(&self, elements: &[Option<Element>]) -> String {
        let mut elements = elements.iter();
        let (mut name, mut is_value) = (String::new(), false);
        for part in &self.parts {
            // the value of a key needs no name of its own
            if std::mem::take(&mut is_value) {
                continue;
            }
            if !name.is_empty() {
                name.push('.');
            }
            name.push_str(&part.name);
            let element = if part.is_list { elements.next().and_then(Option::as_ref) } else { None };
            if let Some(element) = element {
                name.push_str(&format!("[{element}]"));
                is_value = matches!(element, Element::Key(_));
            }
        }
        name
    }

    /// The name of the first element of all lists.
    pub(crate) fn example(&self) -> String {
        self.name(&vec![Some(Element::Number(0)); self.lists()])
    }

    /// The elements that a name chooses of each list: one for every part of the path that has an index, which has to be a
    /// list. `None` if a part that is none has one, or one is no number or key.
    pub(crate) fn elements(&self, indices: &[Option<Index>]) -> Option<Vec<Option<Element>>> {
        let fits = indices.len() == self.parts.len()
            && self.parts.iter().zip(indices).all(|(part, index)| part.is_list || index.is_none());
        let element = |(part, index): (&Part, &Option<Index>)| match (index, &part.keys) {
            (None, _) => Some(None),
            (Some(index), Some((_, kind))) if index.is_key => {
                Key::parse(&index.text, kind).map(|key| Some(Element::Key(key)))
            }
            (Some(index), _) => index.text.parse().ok().map(|number| Some(Element::Number(number))),
        };
        let of_lists = self.parts.iter().zip(indices).filter(|(part, _)| part.is_list);
        if fits { of_lists.map(element).collect() } else { None }
    }

    /// The place of one element of every list; the last list without one is the array that is asked for its elements.
    pub(crate) fn spot(&self, elements: &[Option<Element>]) -> Spot {
        let mut elements = elements.iter();
        let step = |part: &Part| {
            let index = match part.is_list {
                true => elements.next().cloned().flatten(),
                false => Some(Element::Number(0)),
            };
            let keys = part.keys.as_ref().map(|(leaf, _)| *leaf);
            // a single field that needs no counting changes nothing
            (part.is_list || part.count.is_some()).then_some(Step { count: part.count, keys, index })
        };
        Spot { leaf: self.leaf, steps: self.parts.iter().filter_map(step).collect() }
    }

    /// Adds the elements of the lists on the way that a message holds, those without a value counted, until there are
    /// `most`.
    pub(crate) fn places(&self, values: &Values, most: usize, places: &mut BTreeSet<Vec<Element>>) {
        let last = self.parts.iter().rposition(|part| part.is_list).map_or(0, |last| last + 1);
        let mut elements = Vec::new();
        self.descend(&self.parts[..last], 0, values, most, &mut elements, places);
    }

    /// The part of [`Self::places`] below one message, `number` among those of its path.
    fn descend(
        &self,
        parts: &[Part],
        number: usize,
        values: &Values,
        most: usize,
        elements: &mut Vec<Element>,
        places: &mut BTreeSet<Vec<Element>>,
    ) {
        let Some((part, parts)) = parts.split_first() else {
            places.insert(elements.clone());
            return;
        };
        let held = match part.count {
            Some(leaf) => held(values, leaf, number).unwrap_or(0..0),
            None if part.is_list => 0..values.lists[self.leaf].len(),
            None => number..number + 1,
        };
        for (element, index) in held.enumerate() {
            if places.len() >= most {
                return;
            }
            if part.is_list {
                elements.push(match &part.keys {
                    Some((leaf, _)) => match Key::at(&values.lists[*leaf], index) {
                        Some(key) => Element::Key(key),
                        None => continue,
                    },
                    None => Element::Number(element),
                });
            }
            self.descend(parts, index, values, most, elements, places);
            if part.is_list {
                elements.pop();
            }
        }
    }
}

/// One step on the way to a value.
#[derive(Clone, Debug)]
struct Step {
    count: Option<usize>,
    /// Leaf of the keys of a map.
    keys: Option<usize>,
    /// Element; `None` for the array that is asked for its elements.
    index: Option<Element>,
}

/// The place of a value, or of an array of values, in the messages of a layout.
#[derive(Clone, Debug)]
pub(crate) struct Spot {
    leaf: usize,
    steps: Vec<Step>,
}

impl Spot {
    /// Number of the value in the list of its leaf, if it is there.
    ///
    /// * `element`: that of the array, where the spot is one
    pub(crate) fn rank(&self, values: &Values, element: usize) -> Option<usize> {
        self.steps.iter().try_fold(0, |number, step| follow(values, number, step, element))
    }

    /// Number of elements of the array, those that hold no value counted.
    pub(crate) fn length(&self, values: &Values) -> usize {
        let mut number = 0;
        for step in &self.steps {
            if step.index.is_none() {
                return match step.count {
                    Some(leaf) => held(values, leaf, number).map_or(0, |held| held.len()),
                    None => values.lists[self.leaf].len(),
                };
            }
            match follow(values, number, step, 0) {
                Some(next) => number = next,
                None => return 0,
            }
        }
        usize::from(number < values.lists[self.leaf].len())
    }
}

/// Numbers of the elements that a message holds, `number` among those of its path, among all of their path.
///
/// * `leaf`: counts them
fn held(values: &Values, leaf: usize, number: usize) -> Option<Range<usize>> {
    let List::UInt(counts) = &values.lists[leaf] else { return None };
    let first = usize::try_from(counts.get(..number)?.iter().sum::<u64>()).ok()?;
    Some(first..first.checked_add(usize::try_from(*counts.get(number)?).ok()?)?)
}

/// From the number of a message among those of its path to that of an element it holds; `None` if it does not.
fn follow(values: &Values, number: usize, step: &Step, element: usize) -> Option<usize> {
    let index = match &step.index {
        None => element,
        Some(Element::Number(number)) => *number,
        Some(Element::Key(key)) => return entry(values, number, step, key),
    };
    // without a count it is the only list on the way
    let Some(leaf) = step.count else { return Some(index) };
    let held = held(values, leaf, number)?;
    (index < held.len()).then(|| held.start + index)
}

/// Number of the entry with a key among those of all maps of its path, of the map of a message.
fn entry(values: &Values, number: usize, step: &Step, key: &Key) -> Option<usize> {
    let (List::UInt(counts), keys) = (&values.lists[step.count?], &values.lists[step.keys?]) else {
        return None;
    };
    // every entry has its key, or entries cannot be distinguished
    if counts.iter().sum::<u64>() != keys.len() as u64 {
        return None;
    }
    held(values, step.count?, number)?.find(|&index| key.is_at(keys, index))
}
