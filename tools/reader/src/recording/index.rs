//! The summary at the end of a file: where its chunks are and what is in them.

use std::{
    collections::BTreeMap,
    io::{self, Read, Seek, SeekFrom},
};

use mcap::{
    MAGIC,
    records::{self, ChunkIndex, Record, Statistics, op},
};

use super::{Limits, parse::parse};

/// Bytes of opcode and length before every record.
pub(crate) const PREFIX: u64 = 9;

/// Bytes of the content of a footer.
const FOOTER: u64 = 20;

/// What the summary of a file says.
#[derive(Debug, Default)]
pub struct Index {
    /// Chunks by their offset.
    pub chunks: BTreeMap<u64, ChunkIndex>,
    /// Schema and channel records.
    pub directory: Vec<Record<'static>>,
    /// Counts.
    pub statistics: Option<Statistics>,
    /// Attachments.
    pub attachments: Vec<records::AttachmentIndex>,
    /// Metadata records.
    pub metadata: Vec<records::MetadataIndex>,
    /// Where the summary begins.
    pub start: u64,
}

impl Index {
    /// Reads the summary of a file; `None` if it has none, or none that is sound.
    ///
    /// # Errors
    ///
    /// The system fails to read.
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
        let Ok(Record::Footer(content)) = parse(op::FOOTER, &footer[PREFIX as usize..]) else {
            return Ok(None);
        };
        let size = footer_at.checked_sub(content.summary_start).filter(|_| content.summary_start > 0);
        let Some(size) = size.and_then(|size| usize::try_from(size).ok()).filter(|&s| s <= limits.record())
        else {
            return Ok(None);
        };
        source.seek(SeekFrom::Start(content.summary_start))?;
        let mut summary = vec![0; size];
        source.read_exact(&mut summary)?;
        let mut crc = crc32fast::Hasher::new();
        crc.update(&summary);
        crc.update(&footer[..footer.len() - 4]);
        if content.summary_crc != 0 && content.summary_crc != crc.finalize() {
            return Ok(None);
        }
        Ok(Self::parse(&summary, content.summary_start))
    }

    fn parse(mut bytes: &[u8], start: u64) -> Option<Self> {
        let mut index = Self { start, ..Self::default() };
        while !bytes.is_empty() {
            let (prefix, rest) = bytes.split_at_checked(PREFIX as usize)?;
            let length = u64::from_le_bytes(prefix[1..].try_into().ok()?);
            let (body, rest) = rest.split_at_checked(usize::try_from(length).ok()?)?;
            bytes = rest;
            match parse(prefix[0], body).ok()?.into_owned() {
                Record::ChunkIndex(chunk) => drop(index.chunks.insert(chunk.chunk_start_offset, chunk)),
                Record::Statistics(statistics) => index.statistics = Some(statistics),
                Record::AttachmentIndex(attachment) => index.attachments.push(attachment),
                Record::MetadataIndex(metadata) => index.metadata.push(metadata),
                record @ (Record::Schema { .. } | Record::Channel(_)) => index.directory.push(record),
                _ => {}
            }
        }
        Some(index)
    }
}
