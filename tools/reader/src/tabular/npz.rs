//! Archives of NumPy arrays: a stored array of numbers a column, named like it. They know no units.
//!
//! `ndarray_npy::NpzReader` is not used: it takes the memory for as many files, headers as long and arrays as large as the
//! archive claims to have, before it reads them.

use percuss_table::{Cell, Heading};

use super::{Columns, Flaw};

/// Signatures in a ZIP file, and the lengths of what they begin, without names and comments \[bytes\].
const END: (&[u8], usize) = (b"PK\x05\x06", 22);
const ENTRY: (&[u8], usize) = (b"PK\x01\x02", 46);
const LOCAL: (&[u8], usize) = (b"PK\x03\x04", 30);

/// A file in the archive.
struct Entry<'a> {
    name: String,
    is_stored: bool,
    checksum: u32,
    data: &'a [u8],
}

pub(super) fn read(bytes: &[u8], columns: &mut Columns<'_>) -> Result<(), Flaw> {
    let entries = entries(bytes).ok_or_else(|| Flaw::of("its directory is damaged or cut off"))?;
    let known = entries.iter().map(|entry| Heading::new(&entry.name, None)).collect();
    let chosen = columns.begin(known)?;
    for (column, place) in chosen.into_iter().enumerate() {
        let entry = &entries[place];
        let fail = |what: &str| Flaw::of(format!("`{}` {what}", entry.name));
        if !entry.is_stored {
            return Err(fail("is compressed, which is not read; write it with numpy.savez"));
        }
        if crc32fast::hash(entry.data) != entry.checksum {
            return Err(fail("does not have its checksum"));
        }
        let mut cells = cells(entry.data)
            .ok_or_else(|| fail("is not a list of numbers of 8 bytes, of floats or of bools"))?;
        cells.try_for_each(|cell| columns.push(column, cell))?;
        if columns.table.columns[column].len() != columns.table.columns[0].len() {
            return Err(fail("is not as long as the others"));
        }
    }
    Ok(())
}

fn u16_at(bytes: &[u8], at: usize) -> Option<usize> {
    Some(usize::from(u16::from_le_bytes(bytes.get(at..at + 2)?.try_into().ok()?)))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?))
}

/// What begins at a place, if it has the signature.
fn at<'a>(bytes: &'a [u8], place: usize, (signature, length): (&[u8], usize)) -> Option<&'a [u8]> {
    let part = bytes.get(place..)?;
    (part.starts_with(signature) && part.len() >= length).then_some(part)
}

/// The files of the archive, by the directory at its end.
fn entries(bytes: &[u8]) -> Option<Vec<Entry<'_>>> {
    let end =
        (0..=bytes.len().checked_sub(END.1)?).rev().take(1 << 16).find_map(|place| at(bytes, place, END))?;
    let mut place = u32_at(end, 16)? as usize;
    let mut entries = Vec::new();
    for _ in 0..u16_at(end, 10)? {
        let entry = at(bytes, place, ENTRY)?;
        let [name, extra, comment] = [28, 30, 32].map(|at| u16_at(entry, at));
        let name_end = ENTRY.1 + name?;
        let name = String::from_utf8_lossy(entry.get(ENTRY.1..name_end)?);
        let start = u32_at(entry, 42)? as usize;
        let local = at(bytes, start, LOCAL)?;
        let data = start + LOCAL.1 + u16_at(local, 26)? + u16_at(local, 28)?;
        entries.push(Entry {
            name: name.strip_suffix(".npy").unwrap_or(&name).into(),
            is_stored: u16_at(entry, 10)? == 0,
            checksum: u32_at(entry, 16)?,
            data: bytes.get(data..data + u32_at(entry, 20)? as usize)?,
        });
        place += name_end + extra? + comment?;
    }
    Some(entries)
}

/// The numbers of an array of one dimension, with the header of NumPy in front; its length is that of the data.
fn cells(array: &[u8]) -> Option<impl Iterator<Item = Cell>> {
    let (start, length): (usize, usize) = match array.strip_prefix(b"\x93NUMPY")?.first()? {
        1 => (10, u16_at(array, 8)?),
        _ => (12, u32_at(array, 8)? as usize),
    };
    let header = str::from_utf8(array.get(start..start.checked_add(length)?)?).ok()?;
    let value = |key: &str| Some(header.split_once(key)?.1.trim_start_matches([':', ' ', '\'']));
    let (shape, _) = value("'shape'")?.strip_prefix('(')?.split_once(')')?;
    let count: usize = shape.strip_suffix(',')?.parse().ok()?;
    let (kind, _) = value("'descr'")?.split_once('\'')?;
    let (size, cell): (usize, fn([u8; 8]) -> Cell) = match kind {
        "<f8" => (8, |bytes| Cell::Double(f64::from_le_bytes(bytes))),
        "<i8" => (8, |bytes| Cell::Int(i64::from_le_bytes(bytes))),
        "<u8" => (8, |bytes| Cell::UInt(u64::from_le_bytes(bytes))),
        "<f4" => (4, |[a, b, c, d, ..]| Cell::Float(f32::from_le_bytes([a, b, c, d]))),
        "|b1" => (1, |[byte, ..]| Cell::Bool(byte != 0)),
        _ => return None,
    };
    let data = &array[start + length..];
    let number = move |part: &[u8]| {
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(part);
        cell(bytes)
    };
    (Some(data.len()) == count.checked_mul(size)).then(|| data.chunks_exact(size).map(number))
}
