//! The summary at the end of a file: where its chunks are and what is in them.

use std::{
    collections::{BTreeMap, HashSet},
    io::{self, Read, Seek, SeekFrom},
};

use mcap::{
    MAGIC,
    records::{self, ChunkIndex, Record, Statistics, op},
};

use super::{Budget, CHECKSUMS_COUNT, ENTRY, Limits, parse::parse};

/// Bytes of opcode and length before every record.
pub(crate) const PREFIX: u64 = 9;

/// Bytes of the content of a footer.
const FOOTER: u64 = 20;

/// The summary of a file.
#[derive(Debug, Default)]
pub struct Index {
    /// Chunks by their offset.
    pub chunks: BTreeMap<u64, ChunkIndex>,
    /// Schema and channel records, the first of every id.
    pub directory: Vec<Record<'static>>,
    /// Counts.
    pub statistics: Option<Statistics>,
    /// Attachments.
    pub attachments: Vec<records::AttachmentIndex>,
    /// Metadata records.
    pub metadata: Vec<records::MetadataIndex>,
    /// Where the summary begins.
    pub start: u64,
    /// True if the summary is sound but takes more memory than there is for it: it is left out as if there were none.
    pub is_too_large: bool,
}

impl Index {
    /// Reads the summary of a file; `None` if it has none, or none that is sound.
    pub fn read(source: &mut (impl Read + Seek), limits: Limits) -> io::Result<Option<Self>> {
        let length = source.seek(SeekFrom::End(0))?;
        let tail = PREFIX + FOOTER + MAGIC.len() as u64;
        let Some(footer_at) = length.checked_sub(tail) else { return Ok(None) };
        source.seek(SeekFrom::Start(footer_at))?;
        let mut bytes = vec![0; tail as usize];
        source.read_exact(&mut bytes)?;
        let (footer, magic) = bytes.split_at((PREFIX + FOOTER) as usize);
        if magic != MAGIC || footer[0] != op::FOOTER || footer[1..9] != FOOTER.to_le_bytes() {
            return Ok(None);
        }
        let Ok(Record::Footer(content)) = parse(op::FOOTER, &footer[PREFIX as usize..], limits.record())
        else {
            return Ok(None);
        };
        let size = footer_at.checked_sub(content.summary_start).filter(|_| content.summary_start > 0);
        let Some(size) = size.and_then(|size| usize::try_from(size).ok()) else { return Ok(None) };
        if size > limits.record() {
            return Ok(Some(Self::too_large()));
        }
        source.seek(SeekFrom::Start(content.summary_start))?;
        let mut summary = vec![0; size];
        source.read_exact(&mut summary)?;
        let mut crc = crc32fast::Hasher::new();
        crc.update(&summary);
        crc.update(&footer[..footer.len() - 4]);
        if CHECKSUMS_COUNT && content.summary_crc != 0 && content.summary_crc != crc.finalize() {
            return Ok(None);
        }
        Ok(Self::parse(&summary, content.summary_start, limits))
    }

    /// A summary that is there but cannot be kept.
    fn too_large() -> Self {
        Self { is_too_large: true, ..Self::default() }
    }

    fn parse(mut bytes: &[u8], start: u64, limits: Limits) -> Option<Self> {
        let mut index = Self { start, ..Self::default() };
        let mut budget = Budget::new(limits.directory());
        // ids of schemas, of channels
        let mut known = [HashSet::new(), HashSet::new()];
        while !bytes.is_empty() {
            let (prefix, rest) = bytes.split_at_checked(PREFIX as usize)?;
            let length = u64::from_le_bytes(prefix[1..].try_into().ok()?);
            let (body, rest) = rest.split_at_checked(usize::try_from(length).ok()?)?;
            bytes = rest;
            let record = parse(prefix[0], body, budget.left()).ok()?;
            let is_new = match &record {
                Record::Schema { header, .. } => known[0].insert(header.id),
                Record::Channel(channel) => known[1].insert(channel.id),
                Record::ChunkIndex(_)
                | Record::Statistics(_)
                | Record::AttachmentIndex(_)
                | Record::MetadataIndex(_) => true,
                _ => false,
            };
            if !is_new {
                continue;
            }
            if !budget.spend(weight(&record, body.len())) {
                return Some(Self::too_large());
            }
            match record.into_owned() {
                Record::ChunkIndex(chunk) => drop(index.chunks.insert(chunk.chunk_start_offset, chunk)),
                Record::Statistics(statistics) => index.statistics = Some(statistics),
                Record::AttachmentIndex(attachment) => index.attachments.push(attachment),
                Record::MetadataIndex(metadata) => index.metadata.push(metadata),
                record => index.directory.push(record),
            }
        }
        Some(index)
    }
}

/// Memory that a record of the summary takes \[bytes\].
fn weight(record: &Record<'_>, length: usize) -> usize {
    /// A record in a list that grows, with the blocks that its texts are in.
    const RECORD: usize = 512;
    const NUMBER: usize = 32;
    let entries = match record {
        Record::Channel(channel) => ENTRY * channel.metadata.len(),
        Record::ChunkIndex(chunk) => NUMBER * chunk.message_index_offsets.len(),
        Record::Statistics(statistics) => NUMBER * statistics.channel_message_counts.len(),
        _ => 0,
    };
    RECORD + length + entries
}
