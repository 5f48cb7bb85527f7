//! Parsing of single records, with the lengths inside them checked first: the parser allocates what they claim.

use mcap::{
    McapError,
    records::{Record, op},
};

/// A part of a record's content.
#[derive(Clone, Copy)]
enum Part {
    /// So many bytes.
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
fn block<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (block, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *bytes = rest;
    Some(block)
}

/// True if every length inside a record stays inside it.
fn fits(opcode: u8, mut bytes: &[u8]) -> bool {
    let mut step = |part: &Part| match part {
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
            }
            Some(())
        }
    };
    parts(opcode).iter().all(|part| step(part).is_some())
}

/// Parses the content of a record.
pub(crate) fn parse(opcode: u8, data: &[u8]) -> Result<Record<'_>, McapError> {
    if !fits(opcode, data) {
        // the error a parser would give that runs out of bytes
        return Err(McapError::UnexpectedEof);
    }
    mcap::parse_record(opcode, data)
}

/// A parser's error in words.
pub(super) fn explain(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof => "a length inside a record goes beyond its end".into(),
        other => other.to_string(),
    }
}
