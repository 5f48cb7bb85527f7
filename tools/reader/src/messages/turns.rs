//! Messages in the order of their log times and sequence numbers, whatever their order in the file.

use crate::failure::Failure;
use std::{
    cmp::{Ordering, Reverse},
    collections::{BTreeMap, BinaryHeap},
};

use super::Recording;

/// What is made of messages, each waiting until nothing earlier can come.
pub(crate) struct Turns<T> {
    waiting: BinaryHeap<Reverse<Turn<T>>>,
    /// What waits, and what may \[bytes\].
    bytes: usize,
    room: usize,
    read: u64,
    /// Earliest log time of what comes after a chunk.
    floors: BTreeMap<u64, u64>,
    offset: Option<u64>,
    /// Nothing earlier than this log time can come.
    floor: u64,
    is_over: bool,
}

struct Turn<T> {
    /// Log time, sequence number, and number in the file.
    key: (u64, u32, u64),
    bytes: usize,
    item: T,
}

impl<T> PartialEq for Turn<T> {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl<T> Eq for Turn<T> {}

impl<T> PartialOrd for Turn<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for Turn<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.cmp(&other.key)
    }
}

impl<T> Turns<T> {
    /// Those of some channels of a recording.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub(crate) fn of(recording: &Recording, ids: impl IntoIterator<Item = u16>) -> Result<Self, Failure> {
        Ok(Self {
            waiting: BinaryHeap::new(),
            bytes: 0,
            room: recording.limits().kept(),
            read: 0,
            floors: recording.floors(ids)?,
            offset: None,
            floor: 0,
            is_over: false,
        })
    }

    /// Memory for what waits \[bytes\].
    pub(crate) fn room(&self) -> usize {
        self.room
    }

    /// False if the file has no index: then all of it waits for the end.
    pub(crate) fn has_index(&self) -> bool {
        !self.floors.is_empty()
    }

    /// Takes what is made of a message; false if there is no room for it.
    ///
    /// * `offset`: where its chunk begins
    /// * `bytes`: memory that it takes besides its place
    pub(crate) fn put(
        &mut self,
        offset: u64,
        (log_time, sequence): (u64, u32),
        bytes: usize,
        item: T,
    ) -> bool {
        if let Some(before) = self.offset.replace(offset).filter(|before| *before != offset) {
            self.floor = self.floors.get(&before).copied().unwrap_or(0);
        }
        let bytes = bytes + 2 * size_of::<Turn<T>>();
        self.bytes += bytes;
        self.waiting.push(Reverse(Turn { key: (log_time, sequence, self.read), bytes, item }));
        self.read += 1;
        self.bytes <= self.room
    }

    /// No more messages will come.
    pub(crate) fn end(&mut self) {
        self.is_over = true;
    }

    /// What has its turn now.
    pub(crate) fn next(&mut self) -> Option<T> {
        let Reverse(first) = self.waiting.peek()?;
        if first.key.0 >= self.floor && !self.is_over {
            return None;
        }
        let Reverse(turn) = self.waiting.pop()?;
        self.bytes -= turn.bytes;
        Some(turn.item)
    }
}
