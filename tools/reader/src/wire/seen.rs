//! What is known of a message while it is decoded, from the wire or from JSON: which of its fields have been there.

use smallvec::{SmallVec, smallvec};

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
pub(super) struct Seen(SmallVec<[u64; 16]>);

impl Seen {
    pub(super) fn of(node: &Node) -> Self {
        Self(smallvec![0; node.slots.len()])
    }

    pub(super) fn count(&self, index: usize) -> u64 {
        self.0[index]
    }

    pub(super) fn add(&mut self, index: usize, more: u64, is_list: bool) {
        self.0[index] = if is_list { self.0[index].saturating_add(more) } else { 1 };
    }
}

/// Adds what follows from what the message holds: counts, and defaults of what it does not hold.
pub(super) fn complete(
    node: &Node,
    seen: &Seen,
    lists: &mut [List],
    budget: &mut Budget,
) -> Result<(), DecodeError> {
    for (slot, &number) in node.slots.iter().zip(&seen.0) {
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
