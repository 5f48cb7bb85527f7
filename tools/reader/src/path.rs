//! Where in a message a value stands: the elements of the lists on its way, and what is absent on it.
//!
//! The list of a leaf holds the values that are there, one after the other. Which of `joints[0].angle`, `joints[1].angle`
//! a value is, the leaves beside it that count, [`COUNT`](crate::wire::COUNT), determine: how many elements a list has, whether an optional field is
//! there. A value keeps its place so, whatever else is absent.

use std::{collections::BTreeSet, fmt, ops::Range, sync::Arc};

use crate::wire::{Key, Layout, Leaf, List, Slot, Type, Values};

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

    /// True for the key at a place of a list.
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

/// A field on the way to a leaf.
#[derive(Debug)]
struct Part {
    name: String,
    is_list: bool,
    /// Leaf that counts it for each message that may hold it; `None` where its number needs no counting.
    count: Option<usize>,
    /// Leaf of the keys, where it is a map and the way continues to its values.
    keys: Option<(usize, Type)>,
}

/// The way to a leaf, and the elements of the lists on it: to one value, or, where none of a list is chosen, to an array.
#[derive(Clone, Debug)]
pub(crate) struct Path {
    pub(crate) leaf: usize,
    parts: Arc<[Part]>,
    /// One of every list.
    elements: Vec<Option<Element>>,
}

impl Path {
    /// The way to a leaf of a layout, no elements chosen.
    pub(crate) fn of(layout: &Layout, leaf: usize) -> Self {
        let Leaf { numbers, lists, .. } = &layout.leaves[leaf];
        let part = |(i, slot): (usize, &Slot)| Part {
            name: slot.field.name().to_owned(),
            is_list: slot.is_list,
            count: slot.count,
            keys: slot
                .keys()
                .filter(|_| numbers.get(i + 1) == Some(&2))
                .map(|keys| (keys, layout.leaves[keys].kind.clone())),
        };
        let parts = layout.way(leaf).enumerate().map(part).collect();
        Self { leaf, parts, elements: vec![None; *lists] }
    }

    /// The way to one element of every list, or to all of some.
    pub(crate) fn at(&self, elements: impl IntoIterator<Item = Element>) -> Self {
        Self { elements: elements.into_iter().map(Some).collect(), ..self.clone() }
    }

    /// The elements that a name chooses of each list: one for every part of the path that has an index, which has to be a
    /// list. `None` if a part that is none has one, or one is no number or key.
    pub(crate) fn indexed(&self, indices: &[Option<Index>]) -> Option<Self> {
        let element = |(part, index): (&Part, &Option<Index>)| match (index, &part.keys) {
            (None, _) => Some(None),
            (Some(index), Some((_, kind))) if index.is_key => {
                Key::parse(&index.text, kind).map(|key| Some(Element::Key(key)))
            }
            (Some(index), _) => index.text.parse().ok().map(|number| Some(Element::Number(number))),
        };
        let (lists, others): (Vec<_>, Vec<_>) =
            self.parts.iter().zip(indices).partition(|(part, _)| part.is_list);
        if others.iter().any(|(_, index)| index.is_some()) {
            return None;
        }
        let elements = lists.into_iter().map(element).collect::<Option<_>>()?;
        Some(Self { elements, ..self.clone() })
    }

    /// Number of lists on the way.
    pub(crate) fn lists(&self) -> usize {
        self.elements.len()
    }

    /// True if there is a map on the way to one of its values.
    pub(crate) fn has_keys(&self) -> bool {
        self.parts.iter().any(|part| part.keys.is_some())
    }

    /// True if an element is chosen of every list.
    pub(crate) fn is_value(&self) -> bool {
        self.elements.iter().all(Option::is_some)
    }

    /// True if elements of all lists are those that are chosen.
    pub(crate) fn holds(&self, place: &[Element]) -> bool {
        let mut pairs = place.iter().zip(&self.elements);
        pairs.all(|(element, chosen)| chosen.as_ref().is_none_or(|chosen| chosen == element))
    }

    /// True if some of the elements are entries of maps that are chosen by number.
    pub(crate) fn numbers_entries(&self) -> bool {
        self.steps().any(|(part, element)| part.keys.is_some() && matches!(element, Some(Element::Number(_))))
    }

    /// The fields on the way, with the elements of those that are lists.
    fn steps(&self) -> impl Iterator<Item = (&Part, Option<&Element>)> {
        let mut elements = self.elements.iter();
        self.parts.iter().map(move |part| {
            (part, if part.is_list { elements.next().and_then(Option::as_ref) } else { None })
        })
    }

    /// Name of the value: `joints[0].angle`, `gains[kd]`. Lists without an element are named whole.
    pub(crate) fn name(&self) -> String {
        let (mut name, mut is_value) = (String::new(), false);
        for (part, element) in self.steps() {
            // the value of a key needs no name of its own
            if std::mem::take(&mut is_value) {
                continue;
            }
            if !name.is_empty() {
                name.push('.');
            }
            name.push_str(&part.name);
            if let Some(element) = element {
                name.push_str(&format!("[{element}]"));
                is_value = matches!(element, Element::Key(_));
            }
        }
        name
    }

    /// The name of the first element of all lists.
    pub(crate) fn example(&self) -> String {
        self.at(vec![Element::Number(0); self.lists()]).name()
    }

    /// Number of the value in the list of its leaf, if it is there.
    ///
    /// * `element`: that of the array, where the way leads to one
    pub(crate) fn rank(&self, values: &Values, element: usize) -> Option<usize> {
        self.steps().try_fold(0, |number, (part, chosen)| self.follow(part, values, number, chosen, element))
    }

    /// Number of elements of the array, those that hold no value counted.
    pub(crate) fn length(&self, values: &Values) -> usize {
        let mut number = 0;
        for (part, chosen) in self.steps() {
            if part.is_list && chosen.is_none() {
                return self.held(part, values, number).len();
            }
            match self.follow(part, values, number, chosen, 0) {
                Some(next) => number = next,
                None => return 0,
            }
        }
        usize::from(number < values.lists[self.leaf].len())
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
        for (element, index) in self.held(part, values, number).enumerate() {
            if places.len() >= most {
                return;
            }
            if part.is_list {
                elements.push(match &part.keys {
                    Some((leaf, _)) => match values.lists[*leaf].key(index) {
                        Some(Key::Text(text)) if text.len() > MAX_KEY => continue,
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

    /// From the number of a message among those of its path to that of an element it holds; `None` if it does not.
    ///
    /// * `element`: where none is chosen
    fn follow(
        &self,
        part: &Part,
        values: &Values,
        number: usize,
        chosen: Option<&Element>,
        element: usize,
    ) -> Option<usize> {
        let mut held = self.held(part, values, number);
        match chosen {
            Some(Element::Number(element)) => held.nth(*element),
            None if part.is_list => held.nth(element),
            None => held.next(),
            Some(Element::Key(key)) => {
                let (keys, List::UInt(counts)) =
                    (&values.lists[part.keys.as_ref()?.0], &values.lists[part.count?])
                else {
                    return None;
                };
                // every entry has its key, or entries cannot be distinguished
                let is_whole = counts.iter().sum::<u64>() == keys.len() as u64;
                held.find(|&index| is_whole && key.is_at(keys, index))
            }
        }
    }

    /// Numbers of the elements that a message holds, `number` among those of its path, among all of their path.
    fn held(&self, part: &Part, values: &Values, number: usize) -> Range<usize> {
        let Some(leaf) = part.count else {
            // the only list on the way
            return if part.is_list { 0..values.lists[self.leaf].len() } else { number..number + 1 };
        };
        let held = || {
            let List::UInt(counts) = &values.lists[leaf] else { return None };
            let first = usize::try_from(counts.get(..number)?.iter().sum::<u64>()).ok()?;
            Some(first..first.checked_add(usize::try_from(*counts.get(number)?).ok()?)?)
        };
        held().unwrap_or(0..0)
    }
}
