//! `verify`: everything in a recording that can be held against something else in it.

use std::{
    collections::{BTreeMap, HashMap, HashSet},
    hash::{BuildHasher, RandomState},
    path::Path,
    sync::Arc,
};

use mcap::records::{ChunkHeader, MessageIndexEntry, Record, Statistics, op};
use serde_json::{Value, json};

use crate::{
    overview::{Directory, Metadata},
    recording::{Found, Index, Limits, Next, OpenError, Scan},
    text::{printable, short},
    wire::{DecodeError, Values},
};

/// Version of the JSON form.
pub const JSON_VERSION: u32 = 1;

/// Problems that are told one by one.
const MAX_TOLD: usize = 200;

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Where \[bytes from the start of the file\].
    pub offset: u64,
    /// What.
    pub text: String,
}

/// What verifying found.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// What is wrong.
    pub problems: Vec<Problem>,
    /// Problems beyond those that are told.
    pub untold: u64,
    /// What is unusual but allowed.
    pub remarks: Vec<String>,
    /// Messages.
    pub messages: u64,
    /// Chunks.
    pub chunks: u64,
    /// True for a sound recording of percuss that did not come to its planned end.
    pub partial: bool,
}

impl Report {
    /// True if nothing is wrong.
    pub fn is_sound(&self) -> bool {
        self.problems.is_empty()
    }

    fn problem(&mut self, offset: u64, text: impl Into<String>) {
        if self.problems.len() < MAX_TOLD {
            self.problems.push(Problem { offset, text: text.into() });
        } else {
            self.untold += 1;
        }
    }

    /// The report for people.
    pub fn to_text(&self, name: &str) -> String {
        let state = match (self.is_sound(), self.partial) {
            (true, false) => "sound",
            (true, true) => "sound, but PARTIAL: the run did not come to its planned end",
            (false, _) => "NOT SOUND",
        };
        let mut text = format!("{name}: {state}; {} messages in {} chunks\n", self.messages, self.chunks);
        for problem in &self.problems {
            text.push_str(&format!("  at byte {}: {}\n", problem.offset, printable(&problem.text)));
        }
        if self.untold > 0 {
            text.push_str(&format!("  … and {} more\n", self.untold));
        }
        for remark in &self.remarks {
            text.push_str(&format!("  remark: {}\n", printable(remark)));
        }
        text
    }

    /// The report for scripts.
    pub fn to_json(&self, name: &str) -> Value {
        let problems = self.problems.iter().map(|p| json!({ "offset": p.offset, "text": p.text }));
        json!({
            "version": JSON_VERSION,
            "file": name,
            "sound": self.is_sound(),
            "partial": self.partial,
            "messages": self.messages,
            "chunks": self.chunks,
            "problems": problems.collect::<Vec<_>>(),
            "more_problems": self.untold,
            "remarks": self.remarks,
        })
    }
}

/// Verifies a file.
///
/// # Errors
///
/// The file cannot be read or is no MCAP file.
pub fn verify(path: &Path, limits: Limits) -> Result<Report, OpenError> {
    verify_scan(Scan::open(path, limits)?, limits)
}

/// Verifies what a scan reads.
///
/// # Errors
///
/// The source cannot be read.
pub fn verify_scan(mut scan: Scan, limits: Limits) -> Result<Report, OpenError> {
    let mut state = State::new(limits);
    let index = Arc::clone(scan.index());
    while scan.next(|found| state.take(found, &index))? != Next::End {}
    state.end(&index);
    let mut report = state.report;
    for damage in scan.damages() {
        report.problem(damage.offset, damage.reason.clone());
    }
    report.problems.sort_by_key(|problem| problem.offset);
    Ok(report)
}

/// What has been seen so far.
struct State {
    report: Report,
    directory: Directory,
    hasher: RandomState,
    values: HashMap<u16, Values>,
    counts: BTreeMap<u16, u64>,
    last_time: HashMap<u16, u64>,
    span: Option<(u64, u64)>,
    channels: HashSet<u16>,
    schemas: HashSet<u16>,
    backwards: BTreeMap<u16, u64>,
    chunk: Option<Chunk>,
    indexed_chunks: u64,
    attachments: u32,
    attachment_names: Vec<String>,
    metadata: Vec<Metadata>,
    metadata_count: u32,
    first_record: bool,
    summary: BTreeMap<u8, (u64, u64)>,
    data_end: Option<u64>,
}

/// A chunk and the messages in it.
struct Chunk {
    offset: u64,
    header: ChunkHeader,
    entries: BTreeMap<u16, Entries>,
    span: Option<(u64, u64)>,
    indexes: usize,
}

/// Messages of a channel in a chunk, or what an index says of them, in whatever order: how many, and the sum of a hash of
/// each. The hashes are keyed by chance, so that no file can be made to add up. A list would take half as much memory as
/// the chunk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Entries {
    count: u64,
    sum: u64,
}

impl Entries {
    fn add(&mut self, hasher: &RandomState, log_time: u64, offset: u64) {
        self.count += 1;
        self.sum = self.sum.wrapping_add(hasher.hash_one((log_time, offset)));
    }
}

impl State {
    fn new(limits: Limits) -> Self {
        Self {
            report: Report::default(),
            directory: Directory::new(limits),
            hasher: RandomState::new(),
            values: HashMap::new(),
            counts: BTreeMap::new(),
            last_time: HashMap::new(),
            span: None,
            channels: HashSet::new(),
            schemas: HashSet::new(),
            backwards: BTreeMap::new(),
            chunk: None,
            indexed_chunks: 0,
            attachments: 0,
            attachment_names: Vec::new(),
            metadata: Vec::new(),
            metadata_count: 0,
            first_record: true,
            summary: BTreeMap::new(),
            data_end: None,
        }
    }

    fn take(&mut self, found: Found<'_>, index: &Index) {
        let Found { offset, inside, record } = found;
        let is_header = matches!(record, Record::Header(_));
        if std::mem::take(&mut self.first_record) != is_header {
            let text = if is_header { "a second header" } else { "the first record is no header" };
            self.report.problem(offset, text);
        }
        if inside.is_none() && !matches!(record, Record::MessageIndex(_)) {
            self.close_chunk();
        }
        if self.data_end.is_some() && inside.is_none() {
            self.summary.entry(record.opcode()).or_insert((offset, offset)).1 = offset;
        }
        self.learn(offset, &record);
        match record {
            Record::Message { header, data } => self.message(offset, inside, &header, &data),
            Record::Chunk { header, .. } => self.open_chunk(offset, header, index),
            Record::MessageIndex(entry) => self.message_index(offset, entry.channel_id, &entry.records),
            Record::Attachment { header, .. } => {
                self.attachments += 1;
                let known = index.attachments.iter().any(|a| a.offset == offset && a.name == header.name);
                if !index.attachments.is_empty() && !known {
                    let name = short(&header.name);
                    self.report.problem(offset, format!("attachment `{name}` is not in the index"));
                }
                if self.directory.has_room(256 + header.name.len()) {
                    self.attachment_names.push(header.name);
                }
            }
            Record::Metadata(record) => {
                let known = index.metadata.iter().any(|m| m.offset == offset && m.name == record.name);
                if !index.metadata.is_empty() && !known {
                    let name = short(&record.name);
                    self.report.problem(offset, format!("metadata `{name}` is not in the index"));
                }
                self.metadata_count += 1;
                let record = Metadata { name: record.name, entries: record.metadata };
                if self.directory.has_room(record.weight()) {
                    self.metadata.push(record);
                }
            }
            Record::DataEnd(_) => {
                const LENGTH: u64 = 9 + 4;
                self.data_end = Some(offset + LENGTH);
            }
            Record::Footer(footer) => self.footer(offset, footer.summary_start, footer.summary_offset_start),
            Record::SummaryOffset(entry) => {
                let group = self.summary.get(&entry.group_opcode);
                // some writers list groups that are empty
                let is_empty = entry.group_length == 0 && group.is_none();
                if !is_empty && group.is_none_or(|&(first, _)| first != entry.group_start) {
                    let text = format!("summary offset of opcode {:#04x} points nowhere", entry.group_opcode);
                    self.report.problem(offset, text);
                }
            }
            _ => {}
        }
    }

    fn learn(&mut self, offset: u64, record: &Record<'_>) {
        match record {
            Record::Schema { header, .. } if self.schemas.insert(header.id) => {
                self.directory.learn(record);
                let state = self.directory.schema(header.id);
                if state.as_ref().is_some_and(|schema| schema.encoding == "protobuf" && !schema.is_sound) {
                    let reason = state.and_then(|schema| schema.reason);
                    let reason = reason.map_or_else(String::new, |reason| format!(": {reason}"));
                    let name = short(&header.name);
                    self.report.problem(
                        offset,
                        format!("the schema `{name}` does not describe its message{reason}"),
                    );
                }
            }
            Record::Channel(channel) => {
                self.directory.learn(record);
                if channel.schema_id != 0 && !self.schemas.contains(&channel.schema_id) {
                    let text = format!(
                        "channel `{}` names schema {}, which is not there",
                        short(&channel.topic),
                        channel.schema_id
                    );
                    self.report.problem(offset, text);
                }
                let known = self.directory.channel(channel.id);
                let same = known.is_some_and(|k| k.topic == channel.topic && k.metadata == channel.metadata);
                if !self.channels.insert(channel.id) && !same && !self.directory.has_overflowed() {
                    self.report
                        .problem(offset, format!("channel {} is defined twice, differently", channel.id));
                }
            }
            _ => {}
        }
    }

    fn message(
        &mut self,
        offset: u64,
        inside: Option<u64>,
        header: &mcap::records::MessageHeader,
        data: &[u8],
    ) {
        self.report.messages += 1;
        let (id, time) = (header.channel_id, header.log_time);
        *self.counts.entry(id).or_default() += 1;
        self.span = Some(widen(self.span, time));
        if self.last_time.insert(id, time).is_some_and(|last| time < last) {
            *self.backwards.entry(id).or_default() += 1;
        }
        if let (Some(chunk), Some(inside)) = (&mut self.chunk, inside) {
            chunk.span = Some(widen(chunk.span, time));
            chunk.entries.entry(id).or_default().add(&self.hasher, time, inside);
        }
        match self.directory.channel(id) {
            None => self.report.problem(offset, format!("a message of channel {id}, which is not defined")),
            Some(channel) => {
                if let Some(layout) = &channel.layout {
                    let values = self.values.entry(id).or_insert_with(|| layout.values());
                    if let Err(error) = layout.decode(data, values) {
                        let what = match error {
                            DecodeError::SchemaMismatch => "does not fit its schema",
                            DecodeError::Memory => "unpacks to more than --max-memory allows",
                        };
                        let topic = short(&channel.topic);
                        let text = format!("a message of `{topic}` at log time {time} {what}");
                        self.report.problem(offset, text);
                    }
                    values.release();
                }
            }
        }
    }

    fn open_chunk(&mut self, offset: u64, header: ChunkHeader, index: &Index) {
        self.report.chunks += 1;
        if let Some(entry) = index.chunks.get(&offset) {
            self.indexed_chunks += 1;
            let same = entry.compressed_size == header.compressed_size
                && entry.uncompressed_size == header.uncompressed_size
                && entry.compression == header.compression
                && entry.message_start_time == header.message_start_time
                && entry.message_end_time == header.message_end_time;
            if !same {
                self.report.problem(offset, "the chunk index does not describe this chunk");
            }
        } else if !index.chunks.is_empty() {
            self.report.problem(offset, "a chunk that the chunk index does not list");
        }
        self.chunk = Some(Chunk { offset, header, entries: BTreeMap::new(), span: None, indexes: 0 });
    }

    fn message_index(&mut self, offset: u64, id: u16, records: &[MessageIndexEntry]) {
        let Some(chunk) = &mut self.chunk else {
            self.report.problem(offset, "a message index without a chunk");
            return;
        };
        chunk.indexes += 1;
        let mut listed = Entries::default();
        records.iter().for_each(|entry| listed.add(&self.hasher, entry.log_time, entry.offset));
        if chunk.entries.get(&id).copied().unwrap_or_default() != listed {
            let text =
                format!("the message index of channel {id} does not describe the chunk at {}", chunk.offset);
            self.report.problem(offset, text);
        }
    }

    /// Called once all that belongs to a chunk has been seen.
    fn close_chunk(&mut self) {
        let Some(chunk) = self.chunk.take() else { return };
        let claimed = (chunk.header.message_start_time, chunk.header.message_end_time);
        if chunk.span.is_some_and(|span| span != claimed) {
            self.report
                .problem(chunk.offset, "the times in the header of the chunk are not those of its messages");
        }
        if chunk.indexes > 0 && chunk.indexes < chunk.entries.len() {
            self.report.problem(chunk.offset, "the chunk has message indexes for some of its channels only");
        }
    }

    fn footer(&mut self, offset: u64, summary_start: u64, summary_offset_start: u64) {
        let first = self.summary.iter().filter(|(opcode, _)| **opcode != op::FOOTER);
        let first = first.map(|(_, &(first, _))| first).min();
        if summary_start != first.unwrap_or(0) {
            self.report.problem(offset, "the footer does not point at the summary");
        }
        let offsets = self.summary.get(&op::SUMMARY_OFFSET).map_or(0, |&(first, _)| first);
        if summary_offset_start != offsets && (summary_offset_start, offsets) != (0, 0) {
            self.report.problem(offset, "the footer does not point at the summary offsets");
        }
    }

    fn end(&mut self, index: &Index) {
        self.close_chunk();
        let mut refused: Vec<String> =
            self.directory.refused().into_iter().map(|damage| damage.reason).collect();
        if index.is_too_large {
            refused.push("no room for the schemas, channels and chunks of the summary (--max-memory)".into());
        }
        // told however many problems there are: it is why others are not
        let refused = refused.into_iter().map(|reason| format!("{reason}; that is not verified"));
        self.report.problems.extend(refused.map(|text| Problem { offset: 0, text }));
        if self.indexed_chunks < index.chunks.len() as u64 {
            let missing = index.chunks.len() as u64 - self.indexed_chunks;
            self.report
                .problem(index.start, format!("the chunk index lists {missing} chunks that are not there"));
        }
        if index.attachments.len() as u32 > self.attachments
            || index.metadata.len() as u32 > self.metadata_count
        {
            self.report.problem(index.start, "the summary lists attachments or metadata that are not there");
        }
        if let Some(statistics) = &index.statistics {
            self.statistics(index.start, statistics);
        }
        for (id, count) in std::mem::take(&mut self.backwards) {
            let topic = self.directory.channel(id).map_or("", |channel| &channel.topic);
            let topic = short(topic);
            let text = format!("{count} messages of `{topic}` are earlier than those before them");
            if self.entries("percuss.run").is_some() {
                self.report.problem(0, text);
            } else {
                self.report.remarks.push(text);
            }
        }
        self.percuss();
    }

    fn statistics(&mut self, at: u64, statistics: &Statistics) {
        let span = self.span.unwrap_or((0, 0));
        let counts: BTreeMap<u16, u64> = self.counts.clone();
        let listed: BTreeMap<u16, u64> = statistics
            .channel_message_counts
            .iter()
            .filter(|(_, n)| **n > 0)
            .map(|(&id, &n)| (id, n))
            .collect();
        let claims = [
            ("messages", statistics.message_count, self.report.messages),
            ("schemas", u64::from(statistics.schema_count), self.schemas.len() as u64),
            ("channels", u64::from(statistics.channel_count), self.channels.len() as u64),
            ("attachments", u64::from(statistics.attachment_count), u64::from(self.attachments)),
            ("metadata records", u64::from(statistics.metadata_count), u64::from(self.metadata_count)),
            ("chunks", u64::from(statistics.chunk_count), self.report.chunks),
            ("first log time", statistics.message_start_time, span.0),
            ("last log time", statistics.message_end_time, span.1),
        ];
        for (what, claimed, seen) in claims.into_iter().filter(|(_, claimed, seen)| claimed != seen) {
            self.report.problem(at, format!("the statistics say {what} {claimed}, the file holds {seen}"));
        }
        if !listed.is_empty() && listed != counts {
            self.report.problem(at, "the statistics of single channels are wrong");
        }
    }

    fn entries(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata.iter().rev().find(|record| record.name == name).map(|record| &record.entries)
    }

    /// What every recording of percuss holds.
    fn percuss(&mut self) {
        let Some(run) = self.entries("percuss.run").cloned() else { return };
        let mut problems = Vec::new();
        for name in ["percuss.host", "percuss.validity", "percuss.status"] {
            if self.entries(name).is_none() {
                problems.push(format!("the metadata record `{name}` is missing"));
            }
        }
        for name in ["case.toml", "case.resolved.toml"] {
            if !self.attachment_names.iter().any(|known| known == name) {
                problems.push(format!("the attachment `{name}` is missing"));
            }
        }
        let count = |topic: &str| {
            let ids = self.directory.channels().iter().filter(|(_, channel)| channel.topic == topic);
            let counts: Vec<u64> = ids.map(|(id, _)| self.counts.get(id).copied().unwrap_or(0)).collect();
            (!counts.is_empty()).then(|| counts.iter().sum::<u64>())
        };
        // a closed form records what it knows: all of them know the stress, not all of them the drag
        let required: &[&str] = match run.get("source").map(String::as_str) {
            Some("exact") => &["/interface/stress", "/velocity"],
            _ => &["/interface/stress", "/drag", "/velocity"],
        };
        for topic in required {
            if count(topic).is_none() {
                problems.push(format!("the channel `{topic}` is missing"));
            }
        }
        let status = self.entries("percuss.status").cloned();
        let status = status.as_ref();
        let word = status.and_then(|status| status.get("status")).map(String::as_str);
        match word {
            Some("completed" | "stopped") => {}
            Some("interrupted" | "failed") => self.report.partial = true,
            Some(other) => problems.push(format!("the status `{}` is not known", short(other))),
            None => {}
        }
        let last: Option<u64> = status.and_then(|status| status.get("last_step")?.parse().ok());
        if let Some(steps) = last.map(|last| last + 1) {
            for topic in ["/drag", "/velocity"] {
                if let Some(found) = count(topic).filter(|found| *found != steps) {
                    problems.push(format!("`{topic}` has {found} messages for {steps} steps"));
                }
            }
            let planned: Option<u64> = run.get("steps").and_then(|steps| steps.parse().ok());
            if word == Some("completed") && planned.is_some_and(|planned| planned + 1 != steps) {
                problems.push(format!(
                    "the run says completed after {steps} steps of {}",
                    planned.unwrap_or(0) + 1
                ));
            }
        }
        for problem in problems {
            self.report.problem(0, problem);
        }
    }
}

fn widen(span: Option<(u64, u64)>, time: u64) -> (u64, u64) {
    span.map_or((time, time), |(first, last)| (first.min(time), last.max(time)))
}
