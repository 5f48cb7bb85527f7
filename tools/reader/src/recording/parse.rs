//! Parsing of single records, with the lengths inside them checked first: the parser allocates what they claim.

use mcap::{
    McapError,
    records::{Record, op},
};

use super::ENTRY;

/// A part of a record's content.
#[derive(Clone, Copy)]
enum Part {
    Fixed(usize),
    /// A length of four bytes, and as many bytes.
    Block,
    /// A length of four bytes, and as many bytes of texts, keys and values in turn.
    Texts,
}

use Part::{Block, Fixed, Texts};

/// Parts of the content of a record up to the last that has a length; none for records without.
fn parts(opcode: u8) -> &'static [Part] {
    match opcode {
        op::HEADER => &[Block, Block],
        op::SCHEMA => &[Fixed(2), Block, Block, Block],
        op::CHANNEL => &[Fixed(2 + 2), Block, Block, Texts],
        op::CHUNK => &[Fixed(8 + 8 + 8 + 4), Block, Fixed(8)],
        op::MESSAGE_INDEX => &[Fixed(2), Block],
        op::CHUNK_INDEX => &[Fixed(8 + 8 + 8 + 8), Block, Fixed(8), Block, Fixed(8 + 8)],
        // the name, the media type; then the length of the data, which the parser checks, and a checksum
        op::ATTACHMENT => &[Fixed(8 + 8), Block, Block, Fixed(8 + 4)],
        op::ATTACHMENT_INDEX => &[Fixed(8 + 8 + 8 + 8 + 8), Block, Block],
        op::STATISTICS => &[Fixed(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8), Block],
        op::METADATA => &[Block, Texts],
        op::METADATA_INDEX => &[Fixed(8 + 8), Block],
        _ => &[],
    }
}

/// Takes a block with its length off the front.
pub(super) fn block<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (block, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *bytes = rest;
    Some(block)
}

/// Number of keys and values of a record, if every length inside it stays inside it.
fn entries(opcode: u8, mut bytes: &[u8]) -> Option<usize> {
    let mut entries = 0;
    let step = |part: &Part| match part {
        Fixed(size) => {
            let rest = bytes.get(*size..)?;
            bytes = rest;
            Some(())
        }
        Block => block(&mut bytes).map(drop),
        Texts => {
            let mut texts = block(&mut bytes)?;
            while !texts.is_empty() {
                block(&mut texts)?;
                entries += 1;
            }
            Some(())
        }
    };
    parts(opcode).iter().try_for_each(step)?;
    Some(entries)
}

/// Parses the content of a record, or says in words why that cannot be.
///
/// * `limit`: memory that it may take \[bytes\]
pub(crate) fn parse(opcode: u8, data: &[u8], limit: usize) -> Result<Record<'_>, String> {
    let entries = entries(opcode, data).ok_or_else(|| explain(&McapError::UnexpectedEof))? / 2;
    if entries.saturating_mul(ENTRY) > limit {
        return Err(format!(
            "a record with {entries} entries takes more memory than its limit of {limit} (--max-memory)"
        ));
    }
    mcap::parse_record(opcode, data).map_err(|error| explain(&error))
}

/// An error in a record or in the content of a chunk, in words.
pub(super) fn explain(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof => "a length inside a record goes beyond its end".into(),
        other => other.to_string(),
    }
}
