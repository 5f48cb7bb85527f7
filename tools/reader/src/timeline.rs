//! The messages of a recording by their log time, from any time on: chunk by chunk with the index, each chunk after its
//! checksum is verified.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap, HashMap},
    path::{Path, PathBuf},
};

use mcap::records::Record;
use percuss_serve::Channel;

use crate::{
    failure::Failure,
    recording::{Budget, Damage, ENTRY, Limits, Scan, Source},
};

/// Chunks that are searched for the last messages before a time.
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

impl Event {
    fn weight(&self) -> usize {
        size_of::<Self>() + 16 + self.data.len()
    }
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
    path: PathBuf,
    next_chunk: usize,
    waiting: BinaryHeap<Reverse<Event>>,
    waiting_bytes: usize,
    read: u64,
    from: u64,
    limit: usize,
}

impl Timeline {
    /// A recording with an index that names every channel and every message; `None` if it has none.
    ///
    /// # Errors
    ///
    /// The source cannot be read, or is no MCAP file, or its index takes too much memory.
    pub fn open(source: Box<dyn Source>, path: &Path, limits: Limits) -> Result<Option<Self>, Failure> {
        let scan = Scan::of(source, path, limits)?;
        let index = scan.index();
        let memory = |what| Failure::memory(path, what);
        if index.is_too_large {
            return Err(memory("the schemas, channels and chunks of its index"));
        }
        let Some(statistics) = &index.statistics else { return Ok(None) };
        let channels =
            definitions(&index.directory, limits).ok_or_else(|| memory("its channels with their schemas"))?;
        let is_empty = statistics.channel_message_counts.values().all(|count| *count == 0);
        let is_whole = channels.len() == statistics.channel_count as usize
            && index.chunks.len() == statistics.chunk_count as usize
            && (is_empty || !index.chunks.is_empty());
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
            path: path.into(),
            next_chunk: 0,
            waiting: BinaryHeap::new(),
            waiting_bytes: 0,
            read: 0,
            from: 0,
            limit: limits.kept(),
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

    /// Continues with the first message at or after a log time \[ns\].
    pub fn go_to(&mut self, time: u64) {
        (self.from, self.next_chunk, self.waiting_bytes) = (time, 0, 0);
        self.waiting.clear();
    }

    /// The next message.
    ///
    /// # Errors
    ///
    /// The file cannot be read; chunks overlap too much.
    pub fn next_event(&mut self) -> Result<Option<Event>, Failure> {
        while let Some(&chunk) = self.chunks.get(self.next_chunk) {
            if self.waiting.peek().is_some_and(|Reverse(event)| event.log_time < chunk.first) {
                break;
            }
            self.next_chunk += 1;
            if chunk.last >= self.from {
                let from = self.from;
                for event in self.decompress(chunk, |event| event.log_time >= from)? {
                    self.waiting_bytes += event.weight();
                    self.waiting.push(Reverse(event));
                }
                // the content of one chunk may be as large as that, whatever waits besides
                if self.waiting_bytes > 2 * self.limit {
                    return Err(Failure::Failed(format!(
                        "chunks overlap in time so much that more than {} bytes wait for their turn; raise --max-memory",
                        2 * self.limit
                    )));
                }
            }
        }
        let next = self.waiting.pop().map(|Reverse(event)| event);
        self.waiting_bytes -= next.as_ref().map_or(0, Event::weight);
        Ok(next)
    }

    /// The last message of every channel before a log time \[ns\], as far as they are in the chunks just before it.
    pub fn latest_before(&mut self, time: u64) -> Result<Vec<Event>, Failure> {
        let mut chunks: Vec<Chunk> = self.chunks.iter().copied().filter(|chunk| chunk.first < time).collect();
        chunks.sort_by_key(|chunk| Reverse(chunk.last));
        let mut latest = HashMap::<u16, Event>::new();
        for chunk in chunks.into_iter().take(LOOK_BACK) {
            for event in self.decompress(chunk, |event| event.log_time < time)? {
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

    /// The messages of a chunk that are wanted.
    fn decompress(
        &mut self,
        chunk: Chunk,
        is_wanted: impl Fn(&Event) -> bool,
    ) -> Result<Vec<Event>, Failure> {
        self.scan.go_to(chunk.offset)?;
        let (mut events, mut budget) = (Vec::new(), Budget::new(self.limit));
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
            let Some((true, message)) = next else { return Ok(events) };
            self.read += 1;
            let known = |event: &Event| self.channels.contains_key(&event.channel);
            if let Some(event) = message.filter(known).filter(&is_wanted) {
                if !budget.spend(event.weight()) {
                    let (path, what) = (self.path.clone(), "the messages of a chunk");
                    return Err(Failure::memory(&path, what));
                }
                events.push(event);
            }
        }
    }
}

/// Channels with their schemas; `None` if they take too much memory.
fn definitions(directory: &[Record<'static>], limits: Limits) -> Option<BTreeMap<u16, Channel>> {
    let mut schemas = HashMap::new();
    for record in directory {
        if let Record::Schema { header, data } = record {
            schemas.insert(header.id, (header, data));
        }
    }
    let (mut channels, mut budget) = (BTreeMap::new(), Budget::new(limits.directory()));
    for record in directory {
        let Record::Channel(channel) = record else { continue };
        let schema = schemas.get(&channel.schema_id);
        // a channel whose schema is not repeated in the summary cannot be defined from it
        if channel.schema_id != 0 && schema.is_none() {
            continue;
        }
        let of_schema =
            schema.map_or(0, |(header, data)| header.name.len() + header.encoding.len() + data.len());
        let of_entries = channel.metadata.iter().map(|(key, value)| ENTRY + key.len() + value.len());
        if !budget.spend(512 + channel.topic.len() + of_schema + of_entries.sum::<usize>()) {
            return None;
        }
        let definition = Channel {
            topic: channel.topic.clone(),
            encoding: channel.message_encoding.clone(),
            schema: schema
                .map(|(header, data)| (header.name.clone(), header.encoding.clone(), data.to_vec())),
            metadata: channel.metadata.clone(),
        };
        channels.insert(channel.id, definition);
    }
    Some(channels)
}
