//! Two files read at once: a thread for each unpacks it and hands on batches of messages.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{
        Arc, Mutex,
        mpsc::{Receiver, SyncSender, sync_channel},
    },
    thread,
};

use super::{CompareError, Options, Watch, align::Aligner};
use crate::{messages::Recording, recording::Damage};

/// Bytes after which a batch is handed on.
const BATCH: usize = 1 << 20;

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
}

/// Buffers to be used again: new ones of this size cost more than what is done with them.
type Pool = Arc<Mutex<Vec<Vec<u8>>>>;

/// Some messages one after the other.
#[derive(Default)]
pub(super) struct Batch {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
    pool: Pool,
}

impl Batch {
    fn new(pool: &Pool) -> Self {
        let buffer = pool.lock().ok().and_then(|mut buffers| buffers.pop());
        Self { bytes: buffer.unwrap_or_default(), entries: Vec::new(), pool: Arc::clone(pool) }
    }
}

impl Drop for Batch {
    fn drop(&mut self) {
        if let Ok(mut buffers) = self.pool.lock()
            && buffers.len() <= AHEAD
        {
            let mut buffer = std::mem::take(&mut self.bytes);
            buffer.clear();
            buffer.shrink_to(2 * BATCH);
            buffers.push(buffer);
        }
    }
}

struct Entry {
    slot: usize,
    log_time: u64,
    end: usize,
}

/// A message of a batch.
#[derive(Clone)]
pub(super) struct Item {
    content: Content,
    pub(super) log_time: u64,
}

#[derive(Clone)]
enum Content {
    InBatch { batch: Arc<Batch>, start: usize, end: usize },
    Own(Box<[u8]>),
}

impl Item {
    pub(super) fn bytes(&self) -> &[u8] {
        match &self.content {
            Content::InBatch { batch, start, end } => &batch.bytes[*start..*end],
            Content::Own(bytes) => bytes,
        }
    }

    /// Lets go of the batch, if the message is a small part of it: one that waits would keep all of it in memory.
    pub(super) fn keep(&mut self) {
        if let Content::InBatch { batch, start, end } = &self.content
            && (end - start) * 2 < batch.bytes.len()
        {
            self.content = Content::Own(batch.bytes[*start..*end].into());
        }
    }
}

enum Parcel {
    Batch(Batch),
    End(Result<Vec<Damage>, CompareError>),
}

/// Reads a file and hands on its messages in batches.
fn read(input: &Input<'_>, out: &SyncSender<Parcel>) -> Result<Vec<Damage>, CompareError> {
    // a few of them may lie between a reader and the comparison
    let largest = input.recording.limits().record() / 4;
    let mut messages = input.recording.messages(input.slots.keys().copied(), input.window)?;
    let pool = Pool::default();
    let mut batch = Batch::new(&pool);
    messages.for_each(|message| {
        if message.data.len() > largest {
            return Err(CompareError::TooLarge { bytes: message.data.len() });
        }
        batch.bytes.extend_from_slice(message.data);
        let (slot, end) = (input.slots[&message.channel], batch.bytes.len());
        batch.entries.push(Entry { slot, log_time: message.log_time, end });
        if batch.bytes.len() < BATCH && batch.entries.len() < BATCH / 64 {
            return Ok(());
        }
        send(std::mem::replace(&mut batch, Batch::new(&pool)), out)
    })?;
    send(batch, out)?;
    Ok(messages.damages().to_vec())
}

/// Hands on a batch.
fn send(batch: Batch, out: &SyncSender<Parcel>) -> Result<(), CompareError> {
    // nothing waits behind a large one: empty batches take its place until it has been received
    let fillers = if batch.bytes.len() > 2 * BATCH { AHEAD } else { 0 };
    let fillers = std::iter::repeat_with(Batch::default).take(fillers);
    for batch in std::iter::once(batch).chain(fillers) {
        let is_received = out.send(Parcel::Batch(batch));
        is_received.map_err(|_| CompareError::Watch("the comparison has stopped early".into()))?;
    }
    Ok(())
}

/// One file as the comparison sees it.
struct Side {
    parcels: Receiver<Parcel>,
    batch: Arc<Batch>,
    next: usize,
    start: usize,
    /// Log time since the origin \[ns\].
    elapsed: u64,
    origin: u64,
    over: Option<Vec<Damage>>,
}

impl Side {
    /// The next message with the number of its aligner.
    fn next(&mut self) -> Result<Option<(usize, Item)>, CompareError> {
        while self.next >= self.batch.entries.len() {
            if self.over.is_some() {
                return Ok(None);
            }
            match self.parcels.recv() {
                Ok(Parcel::Batch(batch)) => (self.batch, self.next, self.start) = (Arc::new(batch), 0, 0),
                Ok(Parcel::End(end)) => self.over = Some(end?),
                Err(_) => self.over = Some(Vec::new()),
            }
        }
        let entry = &self.batch.entries[self.next];
        let content = Content::InBatch { batch: Arc::clone(&self.batch), start: self.start, end: entry.end };
        let item = Item { content, log_time: entry.log_time };
        (self.next, self.start) = (self.next + 1, entry.end);
        self.elapsed = entry.log_time.saturating_sub(self.origin);
        Ok(Some((entry.slot, item)))
    }
}

/// Reads both files and hands their messages to the aligners. Answers what was damaged, and whether it stopped early.
pub(super) fn run(
    files: [Input<'_>; 2],
    options: &Options,
    channels: &mut [Aligner<'_>],
    watch: &mut Option<Watch<'_>>,
) -> Result<(Vec<(PathBuf, Damage)>, bool), CompareError> {
    thread::scope(|scope| {
        let mut sides = files.each_ref().map(|input| {
            let (out, parcels) = sync_channel(AHEAD);
            scope.spawn(move || {
                let end = read(input, &out);
                // fails if the comparison has stopped early
                drop(out.send(Parcel::End(end)));
            });
            let (batch, origin) = (Arc::default(), input.origin);
            Side { parcels, batch, next: 0, start: 0, elapsed: 0, origin, over: None }
        });
        let mut ended = [false; 2];
        while ended != [true; 2] {
            // the file that is behind goes first, so that few messages have to wait
            let side = usize::from(ended[0] || (!ended[1] && sides[1].elapsed < sides[0].elapsed));
            match sides[side].next()? {
                Some((slot, item)) => {
                    let channel = &mut channels[slot];
                    channel.push(side, item, watch)?;
                    if options.fail_fast && channel.has_failed() {
                        return Ok((damages(&files, &sides), true));
                    }
                }
                None => {
                    ended[side] = true;
                    for channel in channels.iter_mut() {
                        channel.end(side, watch)?;
                    }
                }
            }
        }
        Ok((damages(&files, &sides), false))
    })
}

fn damages(files: &[Input<'_>; 2], sides: &[Side; 2]) -> Vec<(PathBuf, Damage)> {
    let of = |(input, side): (&Input<'_>, &Side)| {
        let damages = side.over.clone().unwrap_or_default();
        let path = input.recording.path.clone();
        damages.into_iter().map(move |damage| (path.clone(), damage)).collect::<Vec<_>>()
    };
    files.iter().zip(sides).flat_map(of).collect()
}
