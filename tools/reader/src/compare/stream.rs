//! Two files read at once: a thread for each decompresses it and hands on batches of messages.

use std::{
    collections::{BTreeMap, HashMap},
    path::PathBuf,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
};

use crate::{
    failure::Failure,
    messages::{Kept, Message, Messages, Recording},
    recording::Damage,
};

/// Bytes after which a batch is handed on.
const BATCH: usize = 1 << 20;

/// Messages after which a batch is handed on.
const MESSAGES: usize = BATCH / 64;

/// Batches that may lie between a reader and the comparison.
const AHEAD: usize = 4;

/// A file to be read, and the number of the aligner for each of its channels.
pub(super) struct Input<'a> {
    pub(super) recording: &'a Recording,
    pub(super) slots: BTreeMap<u16, usize>,
    /// First and last log time needed \[ns\].
    pub(super) window: Option<(u64, u64)>,
    /// Log time that both files are read in step from \[ns\].
    pub(super) origin: u64,
    /// Log time of the reference that passes in one of this file.
    pub(super) pace: f64,
    pub(super) order: Order,
}

/// In what order the messages of a channel are handed on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Order {
    /// That of the file, which has to be that of their log times, and of sequence numbers where those are equal.
    Checked,
    /// That of their log times and sequence numbers.
    Sorted,
    /// That of the file.
    File,
}

/// Messages with the numbers of their aligners, or the end of the file.
enum Parcel {
    Batch(Vec<(usize, Kept)>),
    End(Result<Vec<Damage>, Failure>),
}

impl<'a> Input<'a> {
    /// The messages that are compared.
    fn messages(&self) -> Result<Messages<'a>, Failure> {
        let ids = self.slots.keys().copied();
        if self.order != Order::Sorted {
            return self.recording.messages(ids, self.window);
        }
        let refusal = format!(
            "messages are so far from the order of their log times that more than {} bytes wait for their turn; raise \
             --max-memory, or compare them in the order of the file (--file-order)",
            self.recording.limits().kept()
        );
        self.recording.messages_in_turn(ids, self.window, refusal)
    }

    /// True if the messages of every channel that is compared come in the order of their log times.
    pub(super) fn is_ordered(&self) -> Result<bool, Failure> {
        let (mut last, mut is_ordered) = (HashMap::new(), true);
        self.messages()?.for_each(|next| {
            is_ordered &= follows(&mut last, &next.message);
            Ok(())
        })?;
        Ok(is_ordered)
    }

    /// Reads the file and hands on its messages in batches.
    fn read(&self, out: &SyncSender<Parcel>) -> Result<Vec<Damage>, Failure> {
        // a few of them may lie between a reader and the comparison
        let largest = self.recording.limits().record() / 4;
        let mut messages = self.messages()?;
        let (mut batch, mut bytes, mut last) = (Vec::new(), 0, HashMap::new());
        messages.for_each(|next| {
            let message = &next.message;
            if message.data.len() > largest {
                return Err(Failure::Failed(format!(
                    "a message of {} bytes is too large to be compared; raise --max-memory",
                    message.data.len()
                )));
            }
            if self.order == Order::Checked && !follows(&mut last, message) {
                return Err(Failure::Unsorted(next.channel.topic.clone()));
            }
            batch.push((self.slots[&message.channel], Kept::from(message)));
            bytes += message.data.len();
            if bytes < BATCH && batch.len() < MESSAGES {
                return Ok(());
            }
            send(std::mem::take(&mut batch), std::mem::take(&mut bytes), out)
        })?;
        send(batch, bytes, out)?;
        Ok(messages.seen().damages)
    }
}

/// True if a message is not earlier than the last of its channel.
fn follows(last: &mut HashMap<u16, (u64, u32)>, message: &Message<'_>) -> bool {
    let stamp = (message.log_time, message.sequence);
    last.insert(message.channel, stamp).is_none_or(|before| before <= stamp)
}

/// Hands on a batch of so many bytes.
fn send(batch: Vec<(usize, Kept)>, bytes: usize, out: &SyncSender<Parcel>) -> Result<(), Failure> {
    // after a large batch, fill the queue with empty ones so that only one is in memory
    let fillers = if bytes > 2 * BATCH { AHEAD } else { 0 };
    let fillers = std::iter::repeat_with(Vec::new).take(fillers);
    std::iter::once(batch).chain(fillers).try_for_each(|batch| {
        let sent = out.send(Parcel::Batch(batch));
        sent.map_err(|_| Failure::Failed("the comparison has stopped early".into()))
    })
}

/// One file as the comparison sees it.
struct Feed {
    parcels: Receiver<Parcel>,
    batch: std::vec::IntoIter<(usize, Kept)>,
    /// Log time since the origin, of the latest message so far \[ns\].
    elapsed: u64,
    /// That of the last one, which may come late, and its aligner; that of the last one of every aligner.
    last: (usize, u64),
    by_slot: HashMap<usize, u64>,
    origin: u64,
    pace: f64,
    over: Option<Vec<Damage>>,
}

impl Feed {
    /// The next message with the number of its aligner.
    fn next(&mut self) -> Result<Option<(usize, Kept)>, Failure> {
        loop {
            if let Some((slot, item)) = self.batch.next() {
                let elapsed = item.log_time.saturating_sub(self.origin);
                // only messages that wait depend on it: no number does
                let elapsed = if self.pace == 1.0 { elapsed } else { (elapsed as f64 * self.pace) as u64 };
                self.elapsed = self.elapsed.max(elapsed);
                self.last = (slot, elapsed);
                self.by_slot.insert(slot, elapsed);
                return Ok(Some((slot, item)));
            }
            if self.over.is_some() {
                return Ok(None);
            }
            match self.parcels.recv() {
                Ok(Parcel::Batch(batch)) => self.batch = batch.into_iter(),
                Ok(Parcel::End(end)) => self.over = Some(end?),
                Err(_) => self.over = Some(Vec::new()),
            }
        }
    }

    /// True if its last message came late, and the other file has not come as far with those of its aligner.
    fn waits_for(&self, other: &Self) -> bool {
        let (slot, elapsed) = self.last;
        elapsed < self.elapsed && other.by_slot.get(&slot).is_none_or(|other| *other < elapsed)
    }
}

/// Reads both files and hands their messages to `take`: the number of the file, and the message with the number of its
/// aligner or `None` at the end; `take` returns false to stop early. Returns what was damaged, and whether it stopped.
pub(super) fn run(
    files: [Input<'_>; 2],
    mut take: impl FnMut(usize, Option<(usize, Kept)>) -> Result<bool, Failure>,
) -> Result<(Vec<(PathBuf, Damage)>, bool), Failure> {
    thread::scope(|scope| {
        let mut feeds = files.each_ref().map(|input| {
            let (out, parcels) = sync_channel(AHEAD);
            scope.spawn(move || {
                let end = input.read(&out);
                // fails if the comparison has stopped early
                drop(out.send(Parcel::End(end)));
            });
            let (batch, Input { origin, pace, .. }) = (Vec::new().into_iter(), input);
            let (last, by_slot) = ((0, 0), HashMap::new());
            Feed { parcels, batch, elapsed: 0, last, by_slot, origin: *origin, pace: *pace, over: None }
        });
        let (mut ended, mut stopped, mut side) = ([false; 2], false, 0);
        while ended != [true; 2] && !stopped {
            // read from the file with the earlier time, so few messages are kept
            side = match feeds[side].waits_for(&feeds[1 - side]) {
                true if !ended[1 - side] => 1 - side,
                _ => usize::from(ended[0] || (!ended[1] && feeds[1].elapsed < feeds[0].elapsed)),
            };
            let next = feeds[side].next()?;
            ended[side] = next.is_none();
            stopped = !take(side, next)?;
        }
        let damages = files.iter().zip(feeds).flat_map(|(input, feed)| {
            let path = &input.recording.path;
            feed.over.unwrap_or_default().into_iter().map(|damage| (path.clone(), damage))
        });
        Ok((damages.collect(), stopped))
    })
}
