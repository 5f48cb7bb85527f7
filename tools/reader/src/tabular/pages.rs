//! Pages of a column in a Parquet file: plain values or places in a dictionary, with a level for every cell that can be empty.
//!
//! ```text
//! page:    header (Thrift, compact), data: compressed as a whole
//! data:    [length of the levels: u32, levels: hybrid of 1 bit,] values
//! values:  plain: number after number, bools as bits, texts with their lengths; or places: width: u8, hybrid of that many bits
//! hybrid:  runs: header 2n, value, repeated n times; header 2n + 1, 8n values of some bits each
//! ```
//!
//! The reader of pages in the crate `parquet` is not used: it takes the memory that a page claims before it reads it, panics at
//! long numbers of runs and at texts that are cut off, and counts for seconds over a list of seven bytes in a header.

use percuss_table::Cell;

use super::Flaw;

/// Numbers that stand for kinds of pages and ways of writing values.
const DATA_PAGE: i64 = 0;
const DICTIONARY_PAGE: i64 = 2;
const PLAIN: i64 = 0;
const PLAIN_DICTIONARY: i64 = 2;
const RLE: i64 = 3;
const RLE_DICTIONARY: i64 = 8;

/// Deepest nesting of a header.
const DEPTH: usize = 8;

/// Reads a plain value; nothing if the input ends in it.
pub(super) type Read = fn(&mut Input<'_>) -> Option<Cell>;

/// How a column is written in a group of rows.
#[derive(Clone, Copy)]
pub(super) struct Chunk {
    /// Its values; bools, which are bits, without it.
    pub(super) read: Option<Read>,
    /// Compressed with zstd.
    pub(super) is_compressed: bool,
    /// Cells can be empty.
    pub(super) has_gaps: bool,
    /// Largest page, uncompressed \[bytes\].
    pub(super) most: usize,
}

/// Hands the cells of all pages to `take`.
pub(super) fn read(
    data: &[u8],
    chunk: Chunk,
    take: &mut dyn FnMut(Cell) -> Result<(), Flaw>,
) -> Result<(), Flaw> {
    let mut rest = Input(data);
    let mut dictionary: Vec<Cell> = Vec::new();
    while !rest.0.is_empty() {
        let cut = || Flaw::of("a page is damaged or cut off");
        let header = Header::read(&mut rest).ok_or_else(cut)?;
        let compressed =
            usize::try_from(header.compressed).ok().and_then(|length| rest.take(length)).ok_or_else(cut)?;
        if header.checksum.is_some_and(|checksum| checksum as u32 != crc32fast::hash(compressed)) {
            return Err(Flaw::of("a page does not have its checksum"));
        }
        let length = usize::try_from(header.uncompressed).map_err(Flaw::of)?;
        if length > chunk.most {
            return Err(Flaw::Memory);
        }
        let uncompressed = if chunk.is_compressed {
            Some(zstd::bulk::decompress(compressed, length).map_err(Flaw::of)?)
        } else {
            None
        };
        let page = uncompressed.as_deref().unwrap_or(compressed);
        match header.kind {
            DICTIONARY_PAGE if chunk.read.is_some() => {
                let mut values = Plain { input: Input(page), read: chunk.read, bit: 0 };
                dictionary = (0..header.count).map_while(|_| values.next()).collect();
            }
            DATA_PAGE => {
                read_page(page, &header, chunk, &dictionary, take)?.ok_or_else(cut)?;
            }
            other => return Err(Flaw::of(format!("pages of kind {other} are not read"))),
        }
    }
    Ok(())
}

/// Takes the cells of a page; nothing if it ends too early.
fn read_page(
    page: &[u8],
    header: &Header,
    chunk: Chunk,
    dictionary: &[Cell],
    take: &mut dyn FnMut(Cell) -> Result<(), Flaw>,
) -> Result<Option<()>, Flaw> {
    let mut input = Input(page);
    let mut levels = None;
    if chunk.has_gaps {
        let Some(data) = input.array().and_then(|length| input.take(u32::from_le_bytes(length) as usize))
        else {
            return Ok(None);
        };
        levels = Some(Hybrid::new(data, 1));
    }
    let mut values: Box<dyn Iterator<Item = Cell>> = match header.encoding {
        PLAIN => Box::new(Plain { input, read: chunk.read, bit: 0 }),
        PLAIN_DICTIONARY | RLE_DICTIONARY => {
            let width = input.byte().unwrap_or_default();
            let places = Hybrid::new(input.0, usize::from(width).min(32));
            Box::new(places.map_while(|place| dictionary.get(place as usize).cloned()))
        }
        other => return Err(Flaw::of(format!("values written in way {other} of Parquet are not read"))),
    };
    if levels.is_some() && header.levels != RLE {
        return Err(Flaw::of(format!("levels written in way {} of Parquet are not read", header.levels)));
    }
    for _ in 0..header.count {
        let cell = match levels.as_mut().map(Iterator::next) {
            Some(None) => None,
            Some(Some(0)) => Some(Cell::Empty),
            _ => values.next(),
        };
        let Some(cell) = cell else { return Ok(None) };
        take(cell)?;
    }
    Ok(Some(()))
}

#[derive(Default)]
struct Header {
    kind: i64,
    uncompressed: i64,
    compressed: i64,
    checksum: Option<i64>,
    count: i64,
    encoding: i64,
    levels: i64,
}

impl Header {
    fn read(input: &mut Input<'_>) -> Option<Self> {
        let mut header = Self::default();
        input.fields(DEPTH, &mut |input, id, kind| {
            match (id, kind) {
                (1, INT) => header.kind = input.int()?,
                (2, INT) => header.uncompressed = input.int()?,
                (3, INT) => header.compressed = input.int()?,
                (4, INT) => header.checksum = Some(input.int()?),
                // of a data page, of a dictionary
                (5 | 7, STRUCT) => input.fields(DEPTH, &mut |input, id, kind| {
                    match (id, kind) {
                        (1, INT) => header.count = input.int()?,
                        (2, INT) => header.encoding = input.int()?,
                        (3, INT) => header.levels = input.int()?,
                        _ => input.skip(kind, DEPTH)?,
                    }
                    Some(())
                })?,
                _ => input.skip(kind, DEPTH)?,
            }
            Some(())
        })?;
        Some(header)
    }
}

/// Kinds of fields of Thrift: 32-bit numbers, structures.
const INT: u8 = 5;
const STRUCT: u8 = 12;

/// Takes the value of a field, by its number and kind; nothing if the input ends in it.
type Take<'a, 'f> = &'f mut dyn FnMut(&mut Input<'a>, i64, u8) -> Option<()>;

/// Bytes that are still to be read.
pub(super) struct Input<'a>(&'a [u8]);

impl<'a> Input<'a> {
    pub(super) fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn byte(&mut self) -> Option<u8> {
        self.array().map(|[byte]| byte)
    }

    /// A number in groups of 7 bits, the lowest first.
    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte < 0x80 {
                return Some(number);
            }
        }
        None
    }

    /// A number with a sign, in the lowest bit.
    fn int(&mut self) -> Option<i64> {
        self.varint().map(|number| (number >> 1) as i64 ^ -((number & 1) as i64))
    }

    /// Hands the fields of a structure to `take`.
    fn fields(&mut self, depth: usize, take: Take<'a, '_>) -> Option<()> {
        depth.checked_sub(1)?;
        let mut id = 0_i64;
        loop {
            let byte = self.byte()?;
            let (step, kind) = (byte >> 4, byte & 15);
            if kind == 0 {
                return Some(());
            }
            id = if step == 0 { self.int()? } else { id.checked_add(i64::from(step))? };
            take(self, id, kind)?;
        }
    }

    /// Passes a value of some kind.
    fn skip(&mut self, kind: u8, depth: usize) -> Option<()> {
        let depth = depth.checked_sub(1)?;
        match kind {
            // bools are in the kind
            1 | 2 => {}
            3 => drop(self.byte()?),
            4..=6 => drop(self.varint()?),
            7 => drop(self.take(8)?),
            8 => {
                let length = usize::try_from(self.varint()?).ok()?;
                self.take(length)?;
            }
            9 | 10 => {
                let byte = self.byte()?;
                let count = if byte >> 4 == 15 { self.varint()? } else { u64::from(byte >> 4) };
                // in lists, bools are bytes
                let kind = (byte & 15).max(3);
                (0..count).try_for_each(|_| self.skip(kind, depth))?;
            }
            STRUCT => self.fields(depth, &mut |input, _, kind| input.skip(kind, depth))?,
            _ => return None,
        }
        Some(())
    }
}

/// Plain values, one after the other.
struct Plain<'a> {
    input: Input<'a>,
    read: Option<Read>,
    /// Number of the next bool.
    bit: usize,
}

impl Iterator for Plain<'_> {
    type Item = Cell;

    fn next(&mut self) -> Option<Cell> {
        if let Some(read) = self.read {
            return read(&mut self.input);
        }
        let bit = bit(self.input.0, self.bit)?;
        self.bit += 1;
        Some(Cell::Bool(bit == 1))
    }
}

/// A bit by its number, from the lowest of the first byte on.
fn bit(data: &[u8], number: usize) -> Option<u32> {
    data.get(number / 8).map(|byte| u32::from(byte >> (number % 8) & 1))
}

/// Small numbers as runs of equal ones, or packed into bits.
struct Hybrid<'a> {
    rest: Input<'a>,
    /// Bits of a number.
    width: usize,
    /// Numbers that the run still has.
    left: u64,
    run: Run<'a>,
}

enum Run<'a> {
    Equal(u32),
    /// Bytes, and the number of the next bit.
    Packed(&'a [u8], usize),
}

impl<'a> Hybrid<'a> {
    fn new(data: &'a [u8], width: usize) -> Self {
        Self { rest: Input(data), width, left: 0, run: Run::Equal(0) }
    }

    /// Begins the next run.
    fn begin(&mut self) -> Option<()> {
        let header = self.rest.varint()?;
        (self.left, self.run) = if header & 1 == 0 {
            let bytes = self.rest.take(self.width.div_ceil(8))?;
            let value = bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte));
            (header >> 1, Run::Equal(value))
        } else {
            let groups = usize::try_from(header >> 1).ok()?;
            // the last group may be cut off behind its last number
            let length = groups.checked_mul(self.width)?.min(self.rest.0.len());
            (8 * groups as u64, Run::Packed(self.rest.take(length)?, 0))
        };
        Some(())
    }
}

impl Iterator for Hybrid<'_> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        while self.left == 0 {
            self.begin()?;
        }
        self.left -= 1;
        match &mut self.run {
            Run::Equal(value) => Some(*value),
            Run::Packed(data, next) => {
                let value = (0..self.width).try_fold(0, |value, i| Some(value | bit(data, *next + i)? << i));
                *next += self.width;
                value
            }
        }
    }
}
