//! Where in a message a value stands: the elements of the lists on its way, and what is absent on it.
//!
//! The list of a leaf holds the values that are there, one after the other. Which of `joints[0].angle`, `joints[1].angle`
//! a value is, the leaves beside it say that count, [`COUNT`]: how many elements a list has, whether an optional field is
//! there. A value keeps its place so, whatever else is absent.

use std::collections::HashMap;

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

    /// Lengthens `lengths`, one per list on the way, to what a message holds; a message without a value says nothing.
    pub(crate) fn measure(&self, values: &Values, lengths: &mut Vec<usize>) {
        let list = &values.lists[self.leaf];
        if list.is_empty() {
            return;
        }
        let lists = self.parts.iter().filter(|part| part.is_list);
        lengths.resize(self.lists(), 0);
        for (part, longest) in lists.zip(lengths) {
            let length = match part.count.map(|leaf| &values.lists[leaf]) {
                Some(List::UInt(counts)) => counts.iter().copied().max().unwrap_or(0) as usize,
                _ => list.len(),
            };
            *longest = (*longest).max(length);
        }
    }
}

/// All combinations of an element of each list that is not chosen yet, the last list fastest. `None` if there are more
/// than `most`.
pub(crate) fn combinations(
    chosen: &[Option<usize>],
    lengths: &[usize],
    most: usize,
) -> Option<Vec<Vec<Option<usize>>>> {
    let length = |i: usize| lengths.get(i).copied().unwrap_or(0);
    let open = chosen.iter().enumerate().filter(|(_, element)| element.is_none());
    let count = open.clone().try_fold(1_usize, |count, (i, _)| count.checked_mul(length(i)))?;
    if count > most {
        return None;
    }
    let mut all = vec![chosen.to_vec()];
    for (i, _) in open {
        let with = |elements: Vec<Option<usize>>| {
            (0..length(i)).map(move |element| {
                let mut elements = elements.clone();
                elements[i] = Some(element);
                elements
            })
        };
        all = all.into_iter().flat_map(with).collect();
    }
    Some(all)
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
