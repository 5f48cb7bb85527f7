//! What a file holds, checked record by record against its index, its schemas and its statistics.

use std::{
    collections::{BTreeMap, HashSet},
    hash::{BuildHasher, RandomState},
};

use mcap::records::{ChunkHeader, MessageHeader, MessageIndexEntry, Record, Statistics, op};
use percuss_table::measures::Observations;
use serde::de::IgnoredAny;

use super::{Problem, Report};
use crate::{
    axis::Axis,
    command::summary::Source,
    convention::RUN,
    directory::Directory,
    messages::{Decoded, Decoder, Metadata, widen},
    recording::{FileRecord, Index, Limits},
    text::short,
    wire::DecodeError,
};

pub(in crate::command) struct Content<'a> {
    index: &'a Index,
    pub(super) report: Report,
    pub(super) directory: Directory,
    hasher: RandomState,
    /// Messages by channel, defined or not.
    pub(super) series: BTreeMap<u16, Series>,
    /// What they say of the impact.
    pub(in crate::command) observed: Observations,
    span: Option<(u64, u64)>,
    channels: HashSet<u16>,
    schemas: HashSet<u16>,
    chunk: Option<Chunk>,
    indexed_chunks: u64,
    attachments: Extras<'a>,
    pub(super) attachment_names: Vec<String>,
    metadata_records: Extras<'a>,
    pub(super) metadata: Vec<Metadata>,
    /// Messages that no checksum covers.
    unchecked: u64,
    is_first: bool,
    /// First record of every kind in the summary.
    summary: BTreeMap<u8, u64>,
    is_summary: bool,
}

#[derive(Default)]
pub(super) struct Series {
    pub(super) count: u64,
    last_time: u64,
    /// Messages that are earlier than those before them.
    backwards: u64,
    decoder: Option<Decoder>,
    /// Known with the first message that can be decoded.
    meaning: Option<Meaning>,
}

/// What values of messages are.
struct Meaning {
    /// Axes of arrays that messages list.
    axes: Vec<(usize, Axis)>,
    /// What they say of the impact.
    source: Option<Source>,
}

/// Records beside the messages, attachments or metadata.
struct Extras<'a> {
    what: &'static str,
    /// How many the index lists, and where it says that they are, with their names.
    listed: usize,
    places: HashSet<(u64, &'a str)>,
    count: u32,
}

impl<'a> Extras<'a> {
    fn new(what: &'static str, listed: impl ExactSizeIterator<Item = (u64, &'a str)>) -> Self {
        Self { what, listed: listed.len(), places: listed.collect(), count: 0 }
    }

    /// Counts a record, and finds it in the index if there is one.
    fn take(&mut self, offset: u64, name: &str, report: &mut Report) {
        self.count += 1;
        if !self.places.is_empty() && !self.places.contains(&(offset, name)) {
            report.problem(offset, format!("{} `{}` is not in the index", self.what, short(name)));
        }
    }

    fn are_missing(&self) -> bool {
        self.listed as u32 > self.count
    }
}

struct Chunk {
    offset: u64,
    header: ChunkHeader,
    entries: BTreeMap<u16, Entries>,
    span: Option<(u64, u64)>,
    indexes: usize,
}

/// Messages of a channel in a chunk, or what an index says of them, in whatever order: how many, and the sum of a hash of
/// each. The hashes have random keys, so that no file can be made to add up. A list would take half as much memory as
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

impl<'a> Content<'a> {
    pub(in crate::command) fn new(limits: Limits, index: &'a Index) -> Self {
        Self {
            index,
            report: Report::default(),
            directory: Directory::new(limits),
            hasher: RandomState::new(),
            series: BTreeMap::new(),
            observed: Observations::default(),
            span: None,
            channels: HashSet::new(),
            schemas: HashSet::new(),
            chunk: None,
            indexed_chunks: 0,
            attachments: Extras::new(
                "attachment",
                index.attachments.iter().map(|entry| (entry.offset, entry.name.as_str())),
            ),
            attachment_names: Vec::new(),
            metadata_records: Extras::new(
                "metadata",
                index.metadata.iter().map(|entry| (entry.offset, entry.name.as_str())),
            ),
            metadata: Vec::new(),
            unchecked: 0,
            is_first: true,
            summary: BTreeMap::new(),
            is_summary: false,
        }
    }

    /// Takes a record.
    ///
    /// * `decoded`: of messages that others look at, what decodes them
    pub(in crate::command) fn take(&mut self, found: FileRecord<'_>, decoded: Option<&mut Decoded<'_>>) {
        let FileRecord { offset, inside, record, .. } = found;
        let is_header = matches!(record, Record::Header(_));
        if std::mem::take(&mut self.is_first) != is_header {
            let text = if is_header { "a second header" } else { "the first record is no header" };
            self.report.problem(offset, text);
        }
        if inside.is_none() && !matches!(record, Record::MessageIndex(_)) {
            self.close_chunk();
        }
        if self.is_summary && inside.is_none() {
            self.summary.entry(record.opcode()).or_insert(offset);
        }
        match record {
            Record::Schema { .. } => self.schema(offset, &record),
            Record::Channel(_) => self.channel(offset, &record),
            Record::Message { header, data } => self.message(offset, inside, (&header, &data), decoded),
            Record::Chunk { header, .. } => self.open_chunk(offset, header),
            Record::MessageIndex(entry) => self.message_index(offset, entry.channel_id, &entry.records),
            Record::Attachment { header, .. } => self.attachment(offset, header.name),
            Record::Metadata(record) => self.metadata(offset, record.into()),
            Record::DataEnd(end) => {
                self.is_summary = true;
                if end.data_section_crc != 0 {
                    self.unchecked = 0;
                }
            }
            Record::Footer(footer) => self.footer(offset, footer.summary_start, footer.summary_offset_start),
            Record::SummaryOffset(entry) => {
                let group = self.summary.get(&entry.group_opcode);
                // some writers list groups that are empty
                let is_empty = entry.group_length == 0 && group.is_none();
                if !is_empty && group != Some(&entry.group_start) {
                    let text = format!("summary offset of opcode {:#04x} points nowhere", entry.group_opcode);
                    self.report.problem(offset, text);
                }
            }
            _ => {}
        }
    }

    fn schema(&mut self, offset: u64, record: &Record<'_>) {
        let Record::Schema { header, .. } = record else { return };
        if !self.schemas.insert(header.id) {
            return;
        }
        self.directory.learn(record);
        if let Some(reason) = self.directory.flaw(header.id) {
            let colon = if reason.is_empty() { "" } else { ": " };
            let name = short(&header.name);
            let text = format!("the schema `{name}` does not describe its message{colon}{reason}");
            self.report.problem(offset, text);
        }
    }

    fn channel(&mut self, offset: u64, record: &Record<'_>) {
        let Record::Channel(channel) = record else { return };
        self.directory.learn(record);
        if channel.schema_id != 0 && !self.schemas.contains(&channel.schema_id) {
            let (topic, schema) = (short(&channel.topic), channel.schema_id);
            let text = format!("channel `{topic}` names schema {schema}, which is not there");
            self.report.problem(offset, text);
        }
        let known = self.directory.channels().get(&channel.id);
        let same = known.is_some_and(|k| k.topic == channel.topic && k.metadata == channel.metadata);
        if !self.channels.insert(channel.id) && !same && !self.directory.has_overflowed() {
            self.report.problem(offset, format!("channel {} is defined twice, differently", channel.id));
        }
    }

    fn message(
        &mut self,
        offset: u64,
        inside: Option<u64>,
        (header, data): (&MessageHeader, &[u8]),
        decoded: Option<&mut Decoded<'_>>,
    ) {
        self.report.messages += 1;
        let (id, time) = (header.channel_id, header.log_time);
        let series = self.series.entry(id).or_default();
        series.count += 1;
        series.backwards += u64::from(time < series.last_time);
        series.last_time = time;
        self.span = Some(widen(self.span, time));
        // 0 stands for no checksum
        let is_checked = self.chunk.as_ref().is_some_and(|chunk| chunk.header.uncompressed_crc != 0);
        self.unchecked += u64::from(!is_checked);
        if let (Some(chunk), Some(inside)) = (&mut self.chunk, inside) {
            chunk.span = Some(widen(chunk.span, time));
            chunk.entries.entry(id).or_default().add(&self.hasher, time, inside);
        }
        let channels = self.directory.channels();
        let Some(channel) = channels.get(&id) else {
            self.report.problem(offset, format!("a message of channel {id}, which is not defined"));
            return;
        };
        if channel.encoding == "json" {
            if serde_json::from_slice::<IgnoredAny>(data).is_err() {
                self.undecoded(offset, header, "is no JSON");
            }
            return;
        }
        let is_own = decoded.is_none();
        let mut look = |decoded: &mut Decoded<'_>| {
            let Meaning { axes, source } = series.meaning.get_or_insert_with(|| {
                let layout = decoded.layout();
                let axis = |leaf| (leaf, Axis::of(leaf, layout, channel));
                let axes = (0..layout.leaves.len()).map(axis).filter(|(_, axis)| axis.is_listed()).collect();
                let is_first = channels.range(..id).all(|(_, other)| other.topic != channel.topic);
                // others who look at them measure them too
                Meaning { axes, source: Source::of(channel).filter(|_| is_first && is_own) }
            });
            let values = decoded.values(data)?;
            if let Some(source) = source {
                let time = channel.instant(data, time, channel.origin).number();
                source.show(channel, time, values, &mut self.observed);
            }
            Ok(axes.iter().find_map(|(leaf, axis)| axis.flaw(*leaf, values)))
        };
        if is_own && series.decoder.is_none() {
            series.decoder = Decoder::of(channel);
        }
        let flaw = match (decoded, &mut series.decoder) {
            (Some(decoded), _) => look(decoded),
            (None, Some(decoder)) => look(&mut decoder.next()),
            (None, None) => return,
        };
        match flaw {
            Ok(None) => {}
            Ok(Some(flaw)) => {
                let topic = short(&channel.topic);
                self.report.problem(offset, format!("a message of `{topic}` at log time {time} {flaw}"));
            }
            Err(DecodeError::SchemaMismatch) => self.undecoded(offset, header, "does not fit its schema"),
            Err(DecodeError::Memory) => {
                self.undecoded(offset, header, "unpacks to more than --max-memory allows");
            }
        }
    }

    fn undecoded(&mut self, offset: u64, header: &MessageHeader, flaw: &str) {
        let channel = self.directory.channels().get(&header.channel_id);
        let topic = channel.map_or(String::new(), |channel| short(&channel.topic).to_string());
        let time = header.log_time;
        self.report.undecoded += 1;
        self.report.problem(offset, format!("a message of `{topic}` at log time {time} {flaw}"));
    }

    fn open_chunk(&mut self, offset: u64, header: ChunkHeader) {
        self.report.chunks += 1;
        if let Some(entry) = self.index.chunks.get(&offset) {
            self.indexed_chunks += 1;
            let same = entry.compressed_size == header.compressed_size
                && entry.uncompressed_size == header.uncompressed_size
                && entry.compression == header.compression
                && entry.message_start_time == header.message_start_time
                && entry.message_end_time == header.message_end_time;
            if !same {
                self.report.problem(offset, "the chunk index does not describe this chunk");
            }
        } else if !self.index.chunks.is_empty() {
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

    fn attachment(&mut self, offset: u64, name: String) {
        self.attachments.take(offset, &name, &mut self.report);
        if self.directory.has_room(256 + name.len()) {
            self.attachment_names.push(name);
        }
    }

    fn metadata(&mut self, offset: u64, record: Metadata) {
        self.metadata_records.take(offset, &record.name, &mut self.report);
        if self.directory.has_room(record.weight()) {
            self.metadata.push(record);
        }
    }

    fn footer(&mut self, offset: u64, summary_start: u64, summary_offset_start: u64) {
        let first = self.summary.iter().filter(|(opcode, _)| **opcode != op::FOOTER).map(|(_, first)| *first);
        if summary_start != first.min().unwrap_or(0) {
            self.report.problem(offset, "the footer does not point at the summary");
        }
        let offsets = self.summary.get(&op::SUMMARY_OFFSET).copied().unwrap_or(0);
        if summary_offset_start != offsets && (summary_offset_start, offsets) != (0, 0) {
            self.report.problem(offset, "the footer does not point at the summary offsets");
        }
    }

    pub(super) fn end(&mut self) {
        self.close_chunk();
        let index = self.index;
        let refused = self.directory.refused().into_iter().map(|damage| damage.reason);
        let of_index = "no room for the schemas, channels and chunks of the summary (--max-memory)";
        let refused = refused.chain(index.is_too_large.then(|| of_index.into()));
        // reported however many problems there are: it is why others are not
        let refused = refused.map(|reason| format!("{reason}; that is not verified"));
        self.report.problems.extend(refused.map(|text| Problem { offset: 0, text }));
        let missing = (index.chunks.len() as u64).saturating_sub(self.indexed_chunks);
        if missing > 0 {
            let text = format!("the chunk index lists {missing} chunks that are not there");
            self.report.problem(index.start, text);
        }
        if self.attachments.are_missing() || self.metadata_records.are_missing() {
            self.report.problem(index.start, "the summary lists attachments or metadata that are not there");
        }
        if let Some(statistics) = &index.statistics {
            self.statistics(index.start, statistics);
        }
        self.order();
        if self.unchecked > 0 {
            let text = format!(
                "{} of {} messages have no checksum: damage that leaves them readable is not seen",
                self.unchecked, self.report.messages
            );
            self.report.remarks.push(text);
        }
    }

    /// Messages of percuss are in the order of their times; other programs need not write them so.
    fn order(&mut self) {
        let is_percuss = self.entries(RUN).is_some();
        for (id, series) in self.series.iter().filter(|(_, series)| series.backwards > 0) {
            let topic = short(self.directory.channels().get(id).map_or("", |channel| &channel.topic));
            let text =
                format!("{} messages of `{topic}` are earlier than those before them", series.backwards);
            match is_percuss {
                true => self.report.problem(0, text),
                false => self.report.remarks.push(text),
            }
        }
    }

    fn statistics(&mut self, at: u64, statistics: &Statistics) {
        let span = self.span.unwrap_or((0, 0));
        let claims = [
            ("messages", statistics.message_count, self.report.messages),
            ("schemas", u64::from(statistics.schema_count), self.schemas.len() as u64),
            ("channels", u64::from(statistics.channel_count), self.channels.len() as u64),
            ("attachments", u64::from(statistics.attachment_count), u64::from(self.attachments.count)),
            (
                "metadata records",
                u64::from(statistics.metadata_count),
                u64::from(self.metadata_records.count),
            ),
            ("chunks", u64::from(statistics.chunk_count), self.report.chunks),
            ("first log time", statistics.message_start_time, span.0),
            ("last log time", statistics.message_end_time, span.1),
        ];
        for (what, claimed, seen) in claims.into_iter().filter(|(_, claimed, seen)| claimed != seen) {
            self.report.problem(at, format!("the statistics say {what} {claimed}, the file holds {seen}"));
        }
        let listed = statistics.channel_message_counts.iter().filter(|(_, count)| **count > 0);
        let listed: BTreeMap<u16, u64> = listed.map(|(&id, &count)| (id, count)).collect();
        let is_listed = |(id, series): (&u16, &Series)| listed.get(id) == Some(&series.count);
        if !listed.is_empty() && (listed.len() != self.series.len() || !self.series.iter().all(is_listed)) {
            self.report.problem(at, "the statistics of single channels are wrong");
        }
    }

    pub(super) fn entries(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata.iter().rev().find(|record| record.name == name).map(|record| &record.entries)
    }
}
