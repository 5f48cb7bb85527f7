//! Two files read at once: a thread for each decompresses it and hands on batches of messages.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
};

use super::error::CompareError;
use crate::{
    messages::{Message, Recording},
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
}

/// A message.
pub(super) struct Item {
    pub(super) bytes: Vec<u8>,
    pub(super) log_time: u64,
    pub(super) publish_time: u64,
    pub(super) sequence: u32,
}

/// Messages with the numbers of their aligners, or the end of the file.
enum Parcel {
    Batch(Vec<(usize, Item)>),
    End(Result<Vec<Damage>, CompareError>),
}

/// Reads a file and hands on its messages in batches.
fn read(input: &Input<'_>, out: &SyncSender<Parcel>) -> Result<Vec<Damage>, CompareError> {
    // a few of them may lie between a reader and the comparison
    let largest = input.recording.limits().record() / 4;
    let mut messages = input.recording.messages(input.slots.keys().copied(), input.window)?;
    let (mut batch, mut bytes) = (Vec::new(), 0);
    messages.for_each(|message| {
        if message.data.len() > largest {
            return Err(CompareError::TooLarge { bytes: message.data.len() });
        }
        bytes += message.data.len();
        let Message { log_time, publish_time, sequence, data, .. } = message;
        let item = Item { bytes: data.to_vec(), log_time, publish_time, sequence };
        batch.push((input.slots[&message.channel], item));
        if bytes < BATCH && batch.len() < MESSAGES {
            return Ok(());
        }
        send(std::mem::take(&mut batch), std::mem::take(&mut bytes), out)
    })?;
    send(batch, bytes, out)?;
    Ok(messages.damages().to_vec())
}

/// Hands on a batch of so many bytes.
fn send(batch: Vec<(usize, Item)>, bytes: usize, out: &SyncSender<Parcel>) -> Result<(), CompareError> {
    // nothing waits behind a large one: empty batches take its place until it has been received
    let fillers = if bytes > 2 * BATCH { AHEAD } else { 0 };
    let fillers = std::iter::repeat_with(Vec::new).take(fillers);
    std::iter::once(batch).chain(fillers).try_for_each(|batch| {
        let sent = out.send(Parcel::Batch(batch));
        sent.map_err(|_| CompareError::Watch("the comparison has stopped early".into()))
    })
}

/// One file as the comparison sees it.
struct Feed {
    parcels: Receiver<Parcel>,
    batch: std::vec::IntoIter<(usize, Item)>,
    /// Log time since the origin \[ns\].
    elapsed: u64,
    origin: u64,
    pace: f64,
    over: Option<Vec<Damage>>,
}

impl Feed {
    /// The next message with the number of its aligner.
    fn next(&mut self) -> Result<Option<(usize, Item)>, CompareError> {
        loop {
            if let Some((slot, item)) = self.batch.next() {
                let elapsed = item.log_time.saturating_sub(self.origin);
                // only messages that wait depend on it: no number does
                self.elapsed = if self.pace == 1.0 { elapsed } else { (elapsed as f64 * self.pace) as u64 };
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
}

/// Reads both files and hands their messages to `take`: the number of the file, and the message with the number of its
/// aligner or `None` at the end; `take` returns false to stop early. Returns what was damaged, and whether it stopped.
pub(super) fn run(
    files: [Input<'_>; 2],
    mut take: impl FnMut(usize, Option<(usize, Item)>) -> Result<bool, CompareError>,
) -> Result<(Vec<(PathBuf, Damage)>, bool), CompareError> {
    thread::scope(|scope| {
        let mut feeds = files.each_ref().map(|input| {
            let (out, parcels) = sync_channel(AHEAD);
            scope.spawn(move || {
                let end = read(input, &out);
                // fails if the comparison has stopped early
                drop(out.send(Parcel::End(end)));
            });
            let (batch, Input { origin, pace, .. }) = (Vec::new().into_iter(), input);
            Feed { parcels, batch, elapsed: 0, origin: *origin, pace: *pace, over: None }
        });
        let (mut ended, mut stopped) = ([false; 2], false);
        while ended != [true; 2] && !stopped {
            // the file that is behind goes first, so that few messages have to wait
            let side = usize::from(ended[0] || (!ended[1] && feeds[1].elapsed < feeds[0].elapsed));
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
