//! The messages of a recording by their log time, from any time on: chunk by chunk with the index, each chunk once its
//! checksum has proved it sound.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap, HashMap},
    path::Path,
};

use mcap::records::Record;
use percuss_serve::Channel;

use crate::recording::{Damage, Limits, Next, OpenError, Scan, Source};

/// Chunks that are looked through for the last messages before a time.
const LOOK_BACK: usize = 16;

/// A message and when it was.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Event {
    /// Log time \[ns\].
    pub log_time: u64,
    /// Its number among all that were read: keeps the order of the file among equal times.
    order: u64,
    /// Id of its channel.
    pub channel: u16,
    /// Its bytes.
    pub data: Vec<u8>,
}

#[derive(Clone, Copy)]
struct Chunk {
    first: u64,
    last: u64,
    offset: u64,
}

/// A recording by log time.
pub struct Timeline {
    scan: Scan,
    /// Channels by their ids.
    channels: BTreeMap<u16, Channel>,
    /// By their first log time.
    chunks: Vec<Chunk>,
    /// Number of the next chunk to unpack.
    next_chunk: usize,
    waiting: BinaryHeap<Reverse<Event>>,
    waiting_bytes: usize,
    read: u64,
    from: u64,
    limit: usize,
}

/// Why there is no next message.
#[derive(Debug, thiserror::Error)]
pub enum TimelineError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Too many messages would have to wait for their time.
    #[error(
        "chunks overlap in time so much that more than {0} bytes wait for their turn; raise --max-memory"
    )]
    Overlap(usize),
}

impl Timeline {
    /// A recording with an index that names every channel and every message; `None` if it has none.
    ///
    /// # Errors
    ///
    /// The source cannot be read, or is no MCAP file.
    pub fn open(source: Box<dyn Source>, path: &Path, limits: Limits) -> Result<Option<Self>, OpenError> {
        let scan = Scan::of(source, path, limits)?;
        let index = scan.index();
        let Some(statistics) = &index.statistics else { return Ok(None) };
        let channels = definitions(&index.directory);
        let listed: u64 = statistics.channel_message_counts.values().sum();
        let is_whole = channels.len() == statistics.channel_count as usize
            && index.chunks.len() == statistics.chunk_count as usize
            && (listed == 0 || !index.chunks.is_empty());
        if !is_whole {
            return Ok(None);
        }
        let chunk = |(offset, chunk): (&u64, &mcap::records::ChunkIndex)| Chunk {
            first: chunk.message_start_time,
            last: chunk.message_end_time,
            offset: *offset,
        };
        let mut chunks: Vec<Chunk> = index.chunks.iter().map(chunk).collect();
        chunks.sort_by_key(|chunk| (chunk.first, chunk.offset));
        Ok(Some(Self {
            scan,
            channels,
            chunks,
            next_chunk: 0,
            waiting: BinaryHeap::new(),
            waiting_bytes: 0,
            read: 0,
            from: 0,
            limit: limits.record(),
        }))
    }

    /// Channels by their ids.
    pub fn channels(&self) -> &BTreeMap<u16, Channel> {
        &self.channels
    }

    /// First and last log time \[ns\]; `None` if there are no messages.
    pub fn span(&self) -> Option<(u64, u64)> {
        let last = self.chunks.iter().map(|chunk| chunk.last).max()?;
        Some((self.chunks[0].first, last))
    }

    /// What was wrong so far with what was read.
    pub fn damages(&self) -> &[Damage] {
        self.scan.damages()
    }

    /// Goes on with the first message at or after a log time \[ns\].
    pub fn go_to(&mut self, time: u64) {
        (self.from, self.next_chunk, self.waiting_bytes) = (time, 0, 0);
        self.waiting.clear();
    }

    /// The next message.
    ///
    /// # Errors
    ///
    /// The file cannot be read; chunks overlap too much.
    pub fn next_event(&mut self) -> Result<Option<Event>, TimelineError> {
        while let Some(&chunk) = self.chunks.get(self.next_chunk) {
            if self.waiting.peek().is_some_and(|Reverse(event)| event.log_time < chunk.first) {
                break;
            }
            self.next_chunk += 1;
            if chunk.last >= self.from {
                let from = self.from;
                for event in self.unpack(chunk)?.into_iter().filter(|event| event.log_time >= from) {
                    self.waiting_bytes += event.data.len();
                    self.waiting.push(Reverse(event));
                }
                // the content of one chunk may be as large as that, whatever waits besides
                if self.waiting_bytes > 2 * self.limit {
                    return Err(TimelineError::Overlap(2 * self.limit));
                }
            }
        }
        let next = self.waiting.pop().map(|Reverse(event)| event);
        self.waiting_bytes -= next.as_ref().map_or(0, |event| event.data.len());
        Ok(next)
    }

    /// The last message of every channel before a log time \[ns\], as far as they are in the chunks just before it.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn latest_before(&mut self, time: u64) -> Result<Vec<Event>, TimelineError> {
        let mut chunks: Vec<Chunk> = self.chunks.iter().copied().filter(|chunk| chunk.first < time).collect();
        chunks.sort_by_key(|chunk| Reverse(chunk.last));
        let mut latest = HashMap::<u16, Event>::new();
        for chunk in chunks.into_iter().take(LOOK_BACK) {
            for event in self.unpack(chunk)?.into_iter().filter(|event| event.log_time < time) {
                let known = latest.get(&event.channel).map(|known| known.log_time);
                if known.is_none_or(|known| known <= event.log_time) {
                    latest.insert(event.channel, event);
                }
            }
            if latest.len() == self.channels.len() {
                break;
            }
        }
        let mut latest: Vec<Event> = latest.into_values().collect();
        latest.sort();
        Ok(latest)
    }

    fn unpack(&mut self, chunk: Chunk) -> Result<Vec<Event>, OpenError> {
        self.scan.go_to(chunk.offset)?;
        let mut events = Vec::new();
        loop {
            let order = self.read;
            let next = self.scan.next(|found| {
                let message = match found.record {
                    Record::Message { header, data } => {
                        let (log_time, channel) = (header.log_time, header.channel_id);
                        Some(Event { log_time, order, channel, data: data.into_owned() })
                    }
                    _ => None,
                };
                (found.offset == chunk.offset, message)
            })?;
            let Next::Record((true, message)) = next else { return Ok(events) };
            self.read += 1;
            let known = |event: &Event| self.channels.contains_key(&event.channel);
            events.extend(message.filter(known));
        }
    }
}

/// Channels with their schemas.
fn definitions(directory: &[Record<'static>]) -> BTreeMap<u16, Channel> {
    let mut schemas = HashMap::new();
    for record in directory {
        if let Record::Schema { header, data } = record {
            schemas.insert(header.id, (header.name.clone(), header.encoding.clone(), data.to_vec()));
        }
    }
    let definition = |record: &Record<'static>| match record {
        // a channel whose schema is not repeated in the summary cannot be defined from it
        Record::Channel(channel) if channel.schema_id == 0 || schemas.contains_key(&channel.schema_id) => {
            let definition = Channel {
                topic: channel.topic.clone(),
                encoding: channel.message_encoding.clone(),
                schema: schemas.get(&channel.schema_id).cloned(),
                metadata: channel.metadata.clone(),
            };
            Some((channel.id, definition))
        }
        _ => None,
    };
    directory.iter().filter_map(definition).collect()
}
