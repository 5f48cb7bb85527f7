//! Reading: the place of a viewer in the history, and its next frames.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use super::{ENTRY_OVERHEAD, Entry, History};
use crate::protocol::Frame;

/// Largest number of entries that one read passes, and of bytes that it returns.
const READ_ENTRIES: usize = 4096;
const READ_BYTES: usize = 256 << 10;

/// The place of a viewer in the list, and its subscriptions.
#[derive(Debug)]
pub struct Cursor {
    viewer: u64,
    /// Number of the next entry that it reads.
    next: u64,
    /// Up to this number it catches up with the past: of pictures it gets the last only.
    present: u64,
    /// Number of the first time or state that it gets.
    states: u64,
    /// Subscription to a channel, and the first entry that it gets.
    subscriptions: BTreeMap<usize, (u32, u64)>,
    /// The last time sent to it \[ns\].
    clock: Option<u64>,
}

impl Cursor {
    /// Channels with their subscriptions.
    pub fn subscriptions(&self) -> impl Iterator<Item = (usize, u32)> {
        self.subscriptions.iter().map(|(channel, (id, _))| (*channel, *id))
    }

    pub fn unsubscribe(&mut self, ids: &BTreeSet<u32>) {
        self.subscriptions.retain(|_, (known, _)| !ids.contains(known));
    }

    /// Appends a time \[ns\], unless it is the last one sent.
    fn send_time(&mut self, time: u64, frames: &mut Vec<Frame>) {
        if self.clock.replace(time) != Some(time) {
            frames.push(Frame::Time(time));
        }
    }
}

impl History {
    pub fn cursor(&self, viewer: u64) -> Cursor {
        Cursor {
            viewer,
            next: self.next,
            present: self.next,
            states: self.next,
            subscriptions: BTreeMap::new(),
            clock: None,
        }
    }

    /// Subscribes a viewer to channels, whose past it gets first.
    ///
    /// A viewer places a message at the last time sent to it, and drops all messages when time goes back. So if the past begins
    /// before its time, it gets the past of all its channels again. Returns the time to which it goes back.
    pub fn subscribe(
        &self,
        cursor: &mut Cursor,
        subscriptions: impl IntoIterator<Item = (usize, u32)>,
    ) -> Option<u64> {
        let new: BTreeMap<usize, u32> = subscriptions.into_iter().collect();
        let begin = self.start.min(cursor.next);
        let mut missed = self.entries.range(begin..cursor.next).filter_map(|(_, entry)| match entry {
            Entry::Message { channel, log_time, .. } if new.contains_key(channel) => Some(*log_time),
            _ => None,
        });
        let back = missed.next().filter(|time| cursor.clock.is_some_and(|clock| *time < clock));
        for (_, from) in cursor.subscriptions.values_mut() {
            *from = if back.is_some() { begin } else { cursor.next.max(*from) };
        }
        cursor.subscriptions.extend(new.into_iter().map(|(channel, id)| (channel, (id, self.start))));
        cursor.states = cursor.next;
        cursor.next = begin;
        cursor.present = self.next;
        back
    }

    /// True if a viewer has read all entries.
    pub fn is_at_end(&self, cursor: &Cursor) -> bool {
        cursor.next == self.next
    }

    /// Appends the next frames for a viewer, up to a limit: every message after its time.
    pub fn read(&self, cursor: &mut Cursor, frames: &mut Vec<Frame>) {
        let mut bytes = 0;
        for (number, entry) in self.entries.range(cursor.next..).take(READ_ENTRIES) {
            if bytes > READ_BYTES {
                return;
            }
            cursor.next = number + 1;
            match entry {
                Entry::Message { channel, log_time, bytes: content } => {
                    let Some(&(subscription, from)) = cursor.subscriptions.get(channel) else { continue };
                    let kept = &self.channels[*channel];
                    let is_old_picture =
                        *number < cursor.present && kept.is_picture && kept.newest != Some(*number);
                    if *number < from || is_old_picture {
                        continue;
                    }
                    cursor.send_time(*log_time, frames);
                    bytes += content.len() + ENTRY_OVERHEAD;
                    let content = Arc::clone(content);
                    frames.push(Frame::Message { subscription, log_time: *log_time, content });
                }
                _ if *number < cursor.states => {}
                Entry::Time(time) => cursor.send_time(*time, frames),
                Entry::Playback { playback, did_seek, answers } => {
                    let answer = answers.as_ref().filter(|answer| answer.viewer == cursor.viewer);
                    frames.push(Frame::Playback {
                        playback: *playback,
                        did_seek: *did_seek,
                        request: answer.map(|answer| answer.request.clone()),
                    });
                }
            }
        }
        if self.entries.range(cursor.next..).next().is_none() {
            cursor.next = self.next;
        }
    }
}
