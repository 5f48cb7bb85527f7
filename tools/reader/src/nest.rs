//! Where in a message a value stands: the elements of the lists on its way, and what is absent on it.
//!
//! The list of a leaf holds the values that are there, one after the other. Which of `joints[0].angle`, `joints[1].angle`
//! a value is, the leaves beside it that count, [`COUNT`], determine: how many elements a list has, whether an optional field is
//! there. A value keeps its place so, whatever else is absent.

use std::collections::{BTreeSet, HashMap};

use prost_reflect::Kind;

use crate::wire::{COUNT, Layout, List, Values};

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
}

/// The way to a leaf.
#[derive(Clone, Debug)]
pub(crate) struct Nest {
    leaf: usize,
    parts: Vec<Part>,
}

impl Nest {
    /// The way to a leaf of a layout.
    pub(crate) fn of(layout: &Layout, counts: &Counts<'_>, leaf: usize) -> Self {
        let mut message = Some(layout.descriptor().clone());
        let (mut path, mut parts) = (String::new(), Vec::new());
        for &number in &layout.leaves[leaf].numbers {
            let Some(field) = message.as_ref().and_then(|message| message.get_field(number)) else { break };
            if !path.is_empty() {
                path.push('.');
            }
            path.push_str(field.name());
            parts.push(Part {
                name: field.name().to_owned(),
                is_list: field.is_list() || field.is_map(),
                count: counts.0.get(path.as_str()).copied(),
            });
            message = match field.kind() {
                Kind::Message(inner) => Some(inner),
                _ => None,
            };
        }
        Self { leaf, parts }
    }

    /// Number of lists on the way.
    pub(crate) fn lists(&self) -> usize {
        self.parts.iter().filter(|part| part.is_list).count()
    }

    /// Name of the value at an element of each list: `joints[0].angle`. Lists without one are named whole.
    pub(crate) fn name(&self, elements: &[Option<usize>]) -> String {
        let mut elements = elements.iter();
        let mut name = String::new();
        for part in &self.parts {
            if !name.is_empty() {
                name.push('.');
            }
            name.push_str(&part.name);
            let element = if part.is_list { elements.next().copied().flatten() } else { None };
            if let Some(element) = element {
                name.push_str(&format!("[{element}]"));
            }
        }
        name
    }

    /// The elements that a name chooses of each list: one for every part of the path that has an index, which has to be a
    /// list. `None` if a part that is none has one.
    pub(crate) fn elements(&self, indices: &[Option<usize>]) -> Option<Vec<Option<usize>>> {
        let fits = indices.len() == self.parts.len()
            && self.parts.iter().zip(indices).all(|(part, index)| part.is_list || index.is_none());
        let of_lists = self.parts.iter().zip(indices).filter(|(part, _)| part.is_list);
        fits.then(|| of_lists.map(|(_, index)| *index).collect())
    }

    /// The place of one element of every list; the last list without one is the array that is asked for its elements.
    pub(crate) fn spot(&self, elements: &[Option<usize>]) -> Spot {
        let mut elements = elements.iter();
        let step = |part: &Part| {
            let index = match part.is_list {
                true => elements.next().copied().flatten(),
                false => Some(0),
            };
            // a single field that needs no counting changes nothing
            (part.is_list || part.count.is_some()).then_some(Step { count: part.count, index })
        };
        Spot { leaf: self.leaf, steps: self.parts.iter().filter_map(step).collect() }
    }

    /// Adds the elements of the lists on the way that a message holds, those without a value counted, until there are
    /// `most`.
    pub(crate) fn places(&self, values: &Values, most: usize, places: &mut BTreeSet<Vec<usize>>) {
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
        elements: &mut Vec<usize>,
        places: &mut BTreeSet<Vec<usize>>,
    ) {
        let Some((part, parts)) = parts.split_first() else {
            places.insert(elements.clone());
            return;
        };
        let (count, first) = match part.count.map(|leaf| &values.lists[leaf]) {
            Some(List::UInt(counts)) => {
                let count = counts.get(number).copied().unwrap_or(0);
                (count, counts.iter().take(number).sum::<u64>())
            }
            _ if part.is_list => (values.lists[self.leaf].len() as u64, 0),
            _ => (1, number as u64),
        };
        for element in 0..count {
            if places.len() >= most {
                return;
            }
            if part.is_list {
                elements.push(element as usize);
            }
            self.descend(parts, (first + element) as usize, values, most, elements, places);
            if part.is_list {
                elements.pop();
            }
        }
    }
}

/// One step on the way to a value.
#[derive(Clone, Copy, Debug)]
struct Step {
    count: Option<usize>,
    /// Element; `None` for the array that is asked for its elements.
    index: Option<usize>,
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
                    Some(leaf) => count(values, leaf, number).unwrap_or(0) as usize,
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

fn count(values: &Values, leaf: usize, number: usize) -> Option<u64> {
    match &values.lists[leaf] {
        List::UInt(counts) => counts.get(number).copied(),
        _ => None,
    }
}

/// From the number of a message among those of its path to that of an element it holds; `None` if it does not.
fn follow(values: &Values, number: usize, step: &Step, element: usize) -> Option<usize> {
    let index = step.index.unwrap_or(element);
    match step.count {
        // the only list on the way
        None => Some(index),
        Some(leaf) => {
            let List::UInt(counts) = &values.lists[leaf] else { return None };
            if index as u64 >= *counts.get(number)? {
                return None;
            }
            let before: u64 = counts[..number].iter().sum();
            usize::try_from(before).ok()?.checked_add(index)
        }
    }
}
