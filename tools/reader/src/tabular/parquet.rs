//! Parquet: flat columns, units in the key-value metadata of the file as `unit.<column>`.

use std::{sync::mpsc, thread, time::Duration};

use ::parquet::{
    basic::{Compression, LogicalType, Type},
    file::metadata::{ColumnChunkMetaData, ParquetMetaData, ParquetMetaDataReader},
};
use percuss_table::{Cell, Heading};

use super::{
    Columns, Flaw,
    pages::{self, Read},
};

/// What ends the file, and begins it.
const MAGIC: &[u8] = b"PAR1";

/// The longest description at the end of the file, as a share of the memory for definitions: it takes more when it is parsed.
const DESCRIPTION: usize = 8;

/// The longest time for it to be parsed, which takes milliseconds.
const LONGEST: Duration = Duration::from_secs(5);

/// The largest page, as a share of the memory for what is kept: its numbers take more as cells of a dictionary.
const PAGE: usize = 4;

pub(super) fn read(bytes: &[u8], columns: &mut Columns<'_>) -> Result<(), Flaw> {
    let metadata = metadata(bytes, columns.limits.directory() / DESCRIPTION)?;
    let file = metadata.file_metadata();
    let unit = |name: &str| {
        let entries = file.key_value_metadata()?;
        entries.iter().find(|entry| entry.key.strip_prefix("unit.") == Some(name))?.value.as_deref()
    };
    // fields inside others, and lists, are no columns of a table
    let schema = file.schema_descr();
    let is_flat =
        |&i: &usize| schema.column(i).path().parts().len() == 1 && schema.column(i).max_rep_level() == 0;
    let (flat, nested): (Vec<usize>, Vec<usize>) = (0..schema.num_columns()).partition(is_flat);
    if let (None, Some(&place)) = (columns.names, nested.first()) {
        return Err(Flaw::Nested(schema.column(place).path().parts().first().cloned().unwrap_or_default()));
    }
    let heading = |&place: &usize| {
        let column = schema.column(place);
        Heading::new(column.name(), unit(column.name()))
    };
    let chosen = columns.begin(flat.iter().map(heading).collect())?;
    for group in metadata.row_groups() {
        let rows = usize::try_from(group.num_rows()).map_err(Flaw::of)?;
        for (column, &place) in chosen.iter().enumerate() {
            let chunk =
                group.columns().get(flat[place]).ok_or_else(|| Flaw::of("a column lacks a group of rows"))?;
            read_chunk(bytes, chunk, rows, column, columns).map_err(|flaw| match flaw {
                Flaw::Unreadable(reason) => {
                    Flaw::of(format!("column `{}`: {reason}", chunk.column_descr().name()))
                }
                other => other,
            })?;
        }
    }
    Ok(())
}

/// The description of the file, which stands at its end with its length and the magic bytes behind it.
///
/// * `most`: longest description \[bytes\]
fn metadata(bytes: &[u8], most: usize) -> Result<ParquetMetaData, Flaw> {
    let cut = || Flaw::of("it does not end like a Parquet file; is it cut off?");
    let (rest, length) =
        bytes.strip_suffix(MAGIC).and_then(|rest| rest.split_last_chunk()).ok_or_else(cut)?;
    let length = u32::from_le_bytes(*length) as usize;
    let start = rest.len().checked_sub(length).ok_or_else(cut)?;
    if length > most {
        return Err(Flaw::Memory);
    }
    // the parser may panic, and counts to 2³¹ for a list that claims so many elements of no length: it is left behind then
    let (description, (sender, parsed)) = (rest[start..].to_vec(), mpsc::channel());
    thread::spawn(move || drop(sender.send(ParquetMetaDataReader::decode_metadata(&description))));
    let parsed = parsed.recv_timeout(LONGEST);
    parsed.map_err(|_| Flaw::of("the description at its end cannot be parsed in time"))?.map_err(Flaw::of)
}

/// Takes the cells of a column in a group of rows.
fn read_chunk(
    bytes: &[u8],
    chunk: &ColumnChunkMetaData,
    rows: usize,
    column: usize,
    columns: &mut Columns<'_>,
) -> Result<(), Flaw> {
    let is_compressed = match chunk.compression() {
        Compression::UNCOMPRESSED => false,
        Compression::ZSTD(_) => true,
        other => {
            return Err(Flaw::of(format!("compressed as {other}, which is not read; write it with zstd")));
        }
    };
    let descriptor = chunk.column_descr();
    let is_unsigned =
        matches!(descriptor.logical_type_ref(), Some(LogicalType::Integer(kind)) if !kind.is_signed);
    let read: Option<Read> = match chunk.column_type() {
        Type::DOUBLE => Some(|input| Some(Cell::Double(f64::from_le_bytes(input.array()?)))),
        Type::FLOAT => Some(|input| Some(Cell::Float(f32::from_le_bytes(input.array()?)))),
        Type::INT32 if is_unsigned => {
            Some(|input| Some(Cell::UInt(u32::from_le_bytes(input.array()?).into())))
        }
        Type::INT32 => Some(|input| Some(Cell::Int(i32::from_le_bytes(input.array()?).into()))),
        Type::INT64 if is_unsigned => Some(|input| Some(Cell::UInt(u64::from_le_bytes(input.array()?)))),
        Type::INT64 => Some(|input| Some(Cell::Int(i64::from_le_bytes(input.array()?)))),
        Type::BOOLEAN => None,
        Type::BYTE_ARRAY => Some(|input| {
            let length = u32::from_le_bytes(input.array()?) as usize;
            Some(Cell::Text(String::from_utf8_lossy(input.take(length)?).into_owned()))
        }),
        other => return Err(Flaw::of(format!("{other} is not read"))),
    };
    let outside = || Flaw::of("its place is outside of the file");
    let start = chunk.dictionary_page_offset().unwrap_or(i64::MAX).min(chunk.data_page_offset());
    let (start, length) =
        usize::try_from(start).ok().zip(usize::try_from(chunk.compressed_size()).ok()).ok_or_else(outside)?;
    let data = start.checked_add(length).and_then(|end| bytes.get(start..end)).ok_or_else(outside)?;
    let has_gaps = descriptor.max_def_level() > 0;
    let most = columns.limits.kept() / PAGE;
    let before = columns.table.columns[column].len();
    let mut take = |cell: Cell| columns.push(column, cell);
    pages::read(data, pages::Chunk { read, is_compressed, has_gaps, most }, &mut take)?;
    let found = columns.table.columns[column].len() - before;
    if found == rows { Ok(()) } else { Err(Flaw::of(format!("{found} cells in a group of {rows} rows"))) }
}
