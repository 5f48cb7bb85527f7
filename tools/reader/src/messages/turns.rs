//! Messages in the order of their log times and sequence numbers, whatever their order in the file.

use std::collections::BTreeMap;

use super::{Kept, Message, Recording};
use crate::failure::Failure;

/// Log time, sequence number, and number in the file.
type Key = (u64, u32, u64);

/// Messages, each of which waits until nothing earlier can come.
pub(super) struct Turns {
    waiting: BTreeMap<Key, Kept>,
    /// What waits, and what may \[bytes\].
    bytes: usize,
    room: usize,
    read: u64,
    /// Earliest log time of what comes after a chunk.
    floors: BTreeMap<u64, u64>,
    offset: Option<u64>,
    /// Nothing earlier than this log time can come.
    floor: u64,
    pub(super) is_over: bool,
    /// Why reading fails if there is no room.
    refusal: String,
}

impl Turns {
    pub(super) fn of(
        recording: &Recording,
        ids: &BTreeMap<u16, impl Sized>,
        refusal: String,
    ) -> Result<Self, Failure> {
        let mut floor = u64::MAX;
        let mut floors = BTreeMap::new();
        if recording.from_index {
            let scan = recording.scan()?;
            for (&offset, chunk) in scan.index().chunks.iter().rev() {
                let holds = chunk.message_index_offsets.keys().any(|id| ids.contains_key(id));
                if chunk.message_index_length == 0 || holds {
                    floors.insert(offset, floor);
                    floor = floor.min(chunk.message_start_time);
                }
            }
        }
        Ok(Self {
            waiting: BTreeMap::new(),
            bytes: 0,
            room: recording.limits().kept(),
            read: 0,
            floors,
            offset: None,
            floor: 0,
            is_over: false,
            refusal,
        })
    }

    pub(super) fn put(&mut self, message: &Message<'_>) -> Result<(), Failure> {
        let offset = message.offset;
        if let Some(before) = self.offset.replace(offset).filter(|before| *before != offset) {
            self.floor = self.floors.get(&before).copied().unwrap_or(0);
        }
        let kept = Kept::from(message);
        self.bytes += kept.weight();
        self.waiting.insert((message.log_time, message.sequence, self.read), kept);
        self.read += 1;
        match self.bytes > self.room {
            true => Err(Failure::Failed(self.refusal.clone())),
            false => Ok(()),
        }
    }

    /// What has its turn now.
    pub(super) fn next(&mut self) -> Option<Kept> {
        let first = self.waiting.first_entry().filter(|first| first.key().0 < self.floor || self.is_over)?;
        let kept = first.remove();
        self.bytes -= kept.weight();
        Some(kept)
    }
}

impl Kept {
    /// Memory that it takes while it waits \[bytes\].
    fn weight(&self) -> usize {
        2 * size_of::<(Key, Self)>() + self.data.len()
    }
}
