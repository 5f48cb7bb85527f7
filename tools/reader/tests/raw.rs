//! Files put together record by record, as no writer would, and recordings of other programs: protobuf and JSON, on a wall clock.

use std::{collections::BTreeMap, io::Cursor};

use mcap::{Compression, WriteOptions, Writer, records::MessageHeader};
use prost_reflect::{DescriptorPool, DynamicMessage, prost::Message};

use crate::forge;

/// A record with a forged length, or not.
pub fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = vec![opcode];
    bytes.extend((body.len() as u64).to_le_bytes());
    bytes.extend(body);
    bytes
}

pub fn text(text: &[u8]) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes()[..], text].concat()
}

/// Records behind a header; the file ends with the last of them.
pub fn file(records: &[Vec<u8>]) -> Vec<u8> {
    let header = record(0x01, &[text(b""), text(b"test")].concat());
    [mcap::MAGIC, &header, &records.concat()].concat()
}

/// Records behind a header, and a summary, up to the magic bytes at the end; without checksums.
pub fn whole(records: &[Vec<u8>], summary: &[u8]) -> Vec<u8> {
    let mut bytes = file(records);
    bytes.extend(record(0x0f, &[0; 4]));
    let start = if summary.is_empty() { 0 } else { bytes.len() as u64 };
    bytes.extend(summary);
    bytes.extend(record(0x02, &[&start.to_le_bytes()[..], &[0; 8 + 4]].concat()));
    bytes.extend(mcap::MAGIC);
    bytes
}

pub fn map(entries: &[(&str, &str)]) -> Vec<u8> {
    entries.iter().flat_map(|(key, value)| [text(key.as_bytes()), text(value.as_bytes())].concat()).collect()
}

pub fn channel(id: u16, schema: u16, topic: &str, metadata: &[u8]) -> Vec<u8> {
    channel_of(id, schema, topic, "protobuf", metadata)
}

/// * `encoding`: of its messages
pub fn channel_of(id: u16, schema: u16, topic: &str, encoding: &str, metadata: &[u8]) -> Vec<u8> {
    let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
    record(0x04, &[ids, text(topic.as_bytes()), text(encoding.as_bytes()), text(metadata)].concat())
}

pub fn schema(id: u16, name: &str, data: &[u8]) -> Vec<u8> {
    record(0x03, &[id.to_le_bytes().to_vec(), text(name.as_bytes()), text(b"protobuf"), text(data)].concat())
}

pub fn message(channel: u16, data: &[u8]) -> Vec<u8> {
    message_at(channel, 0, data)
}

/// * `time`: log time \[ns\]
pub fn message_at(channel: u16, time: u64, data: &[u8]) -> Vec<u8> {
    let times = [time.to_le_bytes(), time.to_le_bytes()].concat();
    record(0x05, &[&channel.to_le_bytes()[..], &[0; 4], &times, data].concat())
}

pub fn metadata(name: &str, entries: &[(&str, &str)]) -> Vec<u8> {
    record(0x0c, &[text(name.as_bytes()), text(&map(entries))].concat())
}

pub fn chunk(uncompressed: u64, compression: &[u8], data: &[u8]) -> Vec<u8> {
    chunk_at((0, 0), uncompressed, compression, data)
}

/// A chunk of messages from a log time to another.
pub fn chunk_at(times: (u64, u64), uncompressed: u64, compression: &[u8], data: &[u8]) -> Vec<u8> {
    let head = [times.0, times.1, uncompressed].map(u64::to_le_bytes).concat();
    let (checksum, length) = ([0; 4].to_vec(), (data.len() as u64).to_le_bytes().to_vec());
    record(0x06, &[head, checksum, text(compression), length, data.to_vec()].concat())
}

/// Records in a chunk that is compressed as tightly as can be.
pub fn compressed(records: &[Vec<u8>]) -> Vec<u8> {
    let records = records.concat();
    chunk(records.len() as u64, b"zstd", &zstd::bulk::compress(&records, 3).expect("compressed bytes"))
}

pub fn varint(mut value: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    while value >= 0x80 {
        bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    bytes.push(value as u8);
    bytes
}

/// A field of a protobuf message that has a length.
pub fn block(number: usize, content: &[u8]) -> Vec<u8> {
    [varint(number << 3 | 2), varint(content.len()), content.to_vec()].concat()
}

/// An attachment whose content claims a length.
pub fn attachment_of(name: &[u8], claimed: u64, content: &[u8]) -> Vec<u8> {
    let head = [&[0; 16][..], &text(name), &text(b"text/plain"), &claimed.to_le_bytes()].concat();
    record(0x09, &[&head, content, &[0; 4]].concat())
}

pub fn attachment(name: &str, content: &[u8]) -> Vec<u8> {
    attachment_of(name.as_bytes(), content.len() as u64, content)
}

pub fn attachment_index(offset: u64, length: u64, size: u64, name: &str) -> Vec<u8> {
    let numbers = [offset, length, 0, 0, size].map(u64::to_le_bytes).concat();
    record(0x0a, &[numbers, text(name.as_bytes()), text(b"text/plain")].concat())
}

pub fn metadata_index(offset: u64, length: u64, name: &str) -> Vec<u8> {
    record(0x0d, &[[offset, length].map(u64::to_le_bytes).concat(), text(name.as_bytes())].concat())
}

/// What the statistics of a file count, and the messages of its channels.
#[derive(Clone, Debug, Default)]
pub struct Counts {
    pub messages: u64,
    pub schemas: u16,
    pub channels: u32,
    pub attachments: u32,
    pub metadata: u32,
    pub chunks: u32,
    pub times: (u64, u64),
    pub of_channels: Vec<(u16, u64)>,
}

pub fn statistics(counts: &Counts) -> Vec<u8> {
    let of_channel = |&(id, count): &(u16, u64)| [&id.to_le_bytes()[..], &count.to_le_bytes()].concat();
    let of_channels: Vec<u8> = counts.of_channels.iter().flat_map(of_channel).collect();
    let body = [
        counts.messages.to_le_bytes().to_vec(),
        counts.schemas.to_le_bytes().to_vec(),
        [counts.channels, counts.attachments, counts.metadata, counts.chunks].map(u32::to_le_bytes).concat(),
        [counts.times.0, counts.times.1].map(u64::to_le_bytes).concat(),
        text(&of_channels),
    ];
    record(0x0b, &body.concat())
}

#[derive(Clone, Debug, Default)]
pub struct ChunkEntry {
    pub times: (u64, u64),
    pub offset: u64,
    pub length: u64,
    /// Channels, and where their message indexes are.
    pub channels: Vec<(u16, u64)>,
    pub index_length: u64,
    pub compression: &'static str,
    pub compressed: u64,
    pub uncompressed: u64,
}

impl ChunkEntry {
    pub fn record(&self) -> Vec<u8> {
        let numbers = [self.times.0, self.times.1, self.offset, self.length].map(u64::to_le_bytes).concat();
        let channel = |&(id, at): &(u16, u64)| [&id.to_le_bytes()[..], &at.to_le_bytes()].concat();
        let channels: Vec<u8> = self.channels.iter().flat_map(channel).collect();
        let sizes = [self.compressed, self.uncompressed].map(u64::to_le_bytes).concat();
        let body = [
            numbers,
            text(&channels),
            self.index_length.to_le_bytes().to_vec(),
            text(self.compression.as_bytes()),
            sizes,
        ];
        record(0x08, &body.concat())
    }
}

/// Where the first record behind the header begins.
pub fn first_offset() -> u64 {
    file(&[]).len() as u64
}

/// Messages in chunks behind their definitions, with a summary that says so, once `change` has forged it.
///
/// * `definitions`: schemas and channels
/// * `chunks`: their records and times
pub fn indexed(
    definitions: &[Vec<u8>],
    chunks: &[(Vec<u8>, (u64, u64))],
    change: impl FnOnce(&mut Vec<ChunkEntry>, &mut Counts),
) -> Vec<u8> {
    let mut offset = first_offset() + definitions.concat().len() as u64;
    let (mut entries, mut records) = (Vec::new(), definitions.to_vec());
    for (content, times) in chunks {
        let data = zstd::bulk::compress(content, 3).expect("compressed bytes");
        let chunk = chunk_at(*times, content.len() as u64, b"zstd", &data);
        entries.push(ChunkEntry {
            times: *times,
            offset,
            length: chunk.len() as u64,
            compression: "zstd",
            compressed: data.len() as u64,
            uncompressed: content.len() as u64,
            ..ChunkEntry::default()
        });
        offset += chunk.len() as u64;
        records.push(chunk);
    }
    let count = |opcode: u8| definitions.iter().filter(|record| record[0] == opcode).count();
    let mut counts = Counts {
        schemas: count(0x03) as u16,
        channels: count(0x04) as u32,
        chunks: chunks.len() as u32,
        times: (
            chunks.iter().map(|(_, times)| times.0).min().unwrap_or(0),
            chunks.iter().map(|(_, times)| times.1).max().unwrap_or(0),
        ),
        ..Counts::default()
    };
    change(&mut entries, &mut counts);
    let entries: Vec<Vec<u8>> = entries.iter().map(ChunkEntry::record).collect();
    whole(&records, &[definitions.concat(), entries.concat(), statistics(&counts)].concat())
}

/// Bytes over and over, compressed as tightly as can be without having them all in memory.
pub fn compressed_repeats(part: &[u8], times: usize) -> Vec<u8> {
    let mut encoder = zstd::Encoder::new(Vec::new(), 3).expect("an encoder");
    // in large pieces, which is faster
    let piece = part.repeat((1 << 20) / part.len().max(1) + 1);
    let mut left = part.len() * times;
    while left > 0 {
        let length = left.min(piece.len());
        std::io::Write::write_all(&mut encoder, &piece[..length]).expect("room");
        left -= length;
    }
    encoder.finish().expect("compressed bytes")
}

/// A number as a field of eight bytes.
pub fn double(number: usize, value: f64) -> Vec<u8> {
    [varint(number << 3 | 1), value.to_le_bytes().to_vec()].concat()
}

/// A number as a field of one to ten bytes.
pub fn whole_number(number: usize, value: u64) -> Vec<u8> {
    [varint(number << 3), varint(value as usize)].concat()
}

/// Log time of the first messages of other programs: 2023-11-14T22:13:20Z \[ns\].
pub const START: u64 = 1_700_000_000_000_000_000;

/// Nanoseconds between them.
pub const STEP: u64 = 100_000_000;

/// Types of messages in the package `guest`, a line for each, with an enum `Mode` of `IDLE` and `RUN`.
pub fn types(messages: &str) -> DescriptorPool {
    let mut file = forge::types("guest", messages, ("Mode", ["IDLE", "RUN"]));
    file.dependency = ["timestamp", "duration", "any", "struct", "wrappers", "field_mask"]
        .map(|name| format!("google/protobuf/{name}.proto"))
        .to_vec();
    let mut pool = DescriptorPool::global();
    pool.add_file_descriptor_proto(file).expect("sound types");
    pool
}

/// Name, encoding and content of a schema.
pub type Schema = (String, &'static str, Vec<u8>);

pub struct Foreign {
    pub topic: String,
    /// The type of its messages: `json`, the name of a schema, or a type of the package `guest`.
    pub kind: String,
    schema: Option<Schema>,
    /// Log times and content.
    pub messages: Vec<(u64, Vec<u8>)>,
}

impl Foreign {
    /// * `schemas`: those that are no types of `pool`
    pub fn new(topic: &str, kind: &str, pool: &DescriptorPool, schemas: &[Schema]) -> Self {
        let schema = match schemas.iter().find(|(name, ..)| name == kind) {
            _ if matches!(kind, "json" | "text") => None,
            Some(schema) => Some(schema.clone()),
            None => Some((format!("guest.{kind}"), "protobuf", pool.encode_to_vec())),
        };
        Self { topic: topic.into(), kind: kind.into(), schema, messages: Vec::new() }
    }

    /// The bytes of a message that is given in JSON.
    pub fn encoded(&self, pool: &DescriptorPool, content: &str) -> Vec<u8> {
        let Some((name, "protobuf", _)) = &self.schema else { return content.as_bytes().to_vec() };
        let content: serde_json::Value = serde_json::from_str(content).expect("JSON");
        let descriptor = pool.get_message_by_name(name).expect("the type");
        DynamicMessage::deserialize(descriptor, content).expect("a message").encode_to_vec()
    }
}

/// A recording of some channels; messages in the order of the channels, whatever their log times.
pub fn foreign(channels: &[Foreign], compression: Option<Compression>) -> Vec<u8> {
    let options = WriteOptions::new().library("another program").compression(compression);
    let mut writer: Writer<Cursor<Vec<u8>>> = options.create(Cursor::new(Vec::new())).expect("a writer");
    for channel in channels {
        let (schema, encoding) = match &channel.schema {
            Some((name, encoding, text)) => {
                let id = writer.add_schema(name, encoding, text).expect("a schema");
                (id, if *encoding == "protobuf" { encoding } else { "json" })
            }
            None => (0, channel.kind.as_str()),
        };
        let id = writer.add_channel(schema, &channel.topic, encoding, &BTreeMap::new()).expect("a channel");
        for (sequence, (log_time, data)) in (0..).zip(&channel.messages) {
            let (log_time, publish_time) = (*log_time, *log_time);
            let header = MessageHeader { channel_id: id, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, data).expect("a message");
        }
    }
    writer.finish().expect("the end");
    writer.into_inner().into_inner()
}
