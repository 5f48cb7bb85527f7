//! What is known of a message while it is decoded, from the wire or from JSON: which of its fields have been there.

use super::{
    cursor::spend,
    layout::{Content, Node, Scalar},
    leaf::DecodeError,
    list::List,
};
use crate::recording::Budget;

/// Memory of a text or byte string, besides its bytes: its place in a list and its block \[bytes\].
pub(super) const BLOCK: usize = 24 + 16;

/// How many values each slot of a message has had.
#[derive(Default)]
pub(super) struct Seen {
    near: [u32; 16],
    far: Vec<u64>,
}

impl Seen {
    pub(super) fn count(&self, index: usize) -> u64 {
        match self.near.get(index) {
            Some(&count) => u64::from(count),
            None => self.far.get(index - self.near.len()).copied().unwrap_or(0),
        }
    }

    pub(super) fn add(&mut self, index: usize, more: u64, is_list: bool) {
        let count = if is_list { self.count(index).saturating_add(more) } else { 1 };
        match self.near.get_mut(index) {
            Some(near) => *near = u32::try_from(count).unwrap_or(u32::MAX),
            None => {
                let far = index - self.near.len();
                if self.far.len() <= far {
                    self.far.resize(far + 1, 0);
                }
                self.far[far] = count;
            }
        }
    }
}

/// Adds what follows from what the message holds: counts, and defaults of what it does not hold.
pub(super) fn complete(
    node: &Node,
    seen: &Seen,
    lists: &mut [List],
    budget: &mut Budget,
) -> Result<(), DecodeError> {
    for (index, slot) in node.slots.iter().enumerate() {
        let number = seen.count(index);
        if let Some(List::UInt(list)) = slot.count.map(|leaf| &mut lists[leaf]) {
            spend(budget, 8)?;
            list.push(number);
        }
        if let Content::Scalar(Scalar { leaf, .. }) = slot.content
            && number == 0
            && !slot.is_list
            && !slot.has_presence
        {
            spend(budget, size(&lists[leaf]))?;
            lists[leaf].push_default();
        }
    }
    Ok(())
}

/// Memory of a value \[bytes\]; of a text or byte string, what it takes besides its bytes.
pub(super) fn size(list: &List) -> usize {
    match list {
        List::Text(_) | List::Bytes(_) => BLOCK,
        numbers => numbers.width(),
    }
}
