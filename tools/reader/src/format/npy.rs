//! Arrays of NumPy: one matrix of all columns (`.npy`), or one array per column (`.npz`).

use std::io::{self, Cursor, Write};

use ndarray::{Array1, Array2, ArrayView1};
use ndarray_npy::{NpzWriter, WritableElement, WriteDataError, WriteNpyExt};
use percuss_table::{Cell, CellType, Heading, Sink};

/// Longest text of an array \[characters\].
const TEXT: usize = 64;

/// A text of an array: `<U64`, longer ones are cut off.
pub(crate) struct Text([u32; TEXT]);

impl Text {
    /// As it stands in an array.
    pub(crate) fn of(text: &str) -> Self {
        let mut characters = [0; TEXT];
        characters.iter_mut().zip(text.chars()).for_each(|(place, c)| *place = c.into());
        Self(characters)
    }
}

impl WritableElement for Text {
    fn type_descriptor() -> py_literal::Value {
        py_literal::Value::String(format!("<U{TEXT}"))
    }

    fn write<W: Write>(&self, mut writer: W) -> Result<(), WriteDataError> {
        let bytes: Vec<u8> = self.0.iter().flat_map(|c| c.to_le_bytes()).collect();
        writer.write_all(&bytes).map_err(WriteDataError::from)
    }

    fn write_slice<W: Write>(slice: &[Self], mut writer: W) -> Result<(), WriteDataError> {
        slice.iter().try_for_each(|text| text.write(&mut writer))
    }
}

/// How the columns are laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One matrix of doubles, a row per row; names are lost.
    Matrix,
    /// An archive with an array per column, named after it, in the type of the column.
    Archive,
}

/// Writes arrays of NumPy. Empty cells are NaN; columns that have some are doubles. The table is kept in memory
/// until it ends, because the arrays begin with their lengths.
pub struct Npy<W: Write> {
    output: W,
    shape: Shape,
    room: usize,
    headings: Vec<Heading>,
    columns: Vec<Column>,
}

#[derive(Clone, Default)]
struct Column {
    numbers: Vec<f64>,
    /// Of whole numbers, which doubles may not hold.
    integers: Vec<i64>,
    has_gaps: bool,
}

impl<W: Write> Npy<W> {
    pub fn new(output: W, shape: Shape, memory: u64) -> Self {
        let room = usize::try_from(memory / 32).unwrap_or(usize::MAX);
        Self { output, shape, room, headings: Vec::new(), columns: Vec::new() }
    }
}

impl<W: Write> Sink for Npy<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        if let Some(text) = headings.iter().find(|heading| heading.kind == CellType::Text) {
            let name = &text.name;
            return Err(io::Error::other(format!(
                "`{name}` is text, which arrays of numbers do not hold; choose --field, or another format"
            )));
        }
        self.headings = headings.to_vec();
        self.columns = vec![Column::default(); headings.len()];
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.room = self.room.checked_sub(cells.len()).ok_or_else(|| {
            io::Error::other(
                "the table is larger than --max-memory; write CSV or Parquet, or choose less of it",
            )
        })?;
        for ((cell, column), heading) in cells.iter().zip(&mut self.columns).zip(&self.headings) {
            let number = match cell {
                Cell::Bool(value) => Some(f64::from(u8::from(*value))),
                other => other.number(),
            };
            column.has_gaps |= number.is_none();
            column.numbers.push(number.unwrap_or(f64::NAN));
            if self.shape == Shape::Archive && matches!(heading.kind, CellType::Int | CellType::UInt) {
                column.integers.push(match cell {
                    Cell::Int(value) => *value,
                    // the same bits, to be written as unsigned
                    Cell::UInt(value) => *value as i64,
                    _ => 0,
                });
            }
        }
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        match self.shape {
            Shape::Matrix => {
                let (columns, rows) = (&self.columns, self.columns.first().map_or(0, |x| x.numbers.len()));
                let matrix = Array2::from_shape_fn((rows, columns.len()), |(i, j)| columns[j].numbers[i]);
                matrix.write_npy(&mut self.output).map_err(io::Error::other)?;
            }
            Shape::Archive => {
                let bytes = self.archive().map_err(io::Error::other)?;
                self.output.write_all(&bytes)?;
            }
        }
        self.output.flush()
    }
}

impl<W: Write> Npy<W> {
    fn archive(&self) -> Result<Vec<u8>, ndarray_npy::WriteNpzError> {
        let mut archive = NpzWriter::new(Cursor::new(Vec::new()));
        for (heading, column) in self.headings.iter().zip(&self.columns) {
            // a path in the archive has no leading separator
            let name = heading.name.trim_start_matches('/').replace('/', ".");
            let Column { numbers, integers, has_gaps } = column;
            match heading.kind {
                CellType::Float => {
                    archive.add_array(name, &numbers.iter().map(|&x| x as f32).collect::<Array1<f32>>())
                }
                CellType::Int if !has_gaps => archive.add_array(name, &ArrayView1::from(integers.as_slice())),
                CellType::UInt if !has_gaps => archive
                    .add_array(name, &integers.iter().map(|&bits| bits as u64).collect::<Array1<u64>>()),
                CellType::Bool if !has_gaps => {
                    archive.add_array(name, &numbers.iter().map(|&x| x != 0.0).collect::<Array1<bool>>())
                }
                _ => archive.add_array(name, &ArrayView1::from(numbers.as_slice())),
            }?;
        }
        Ok(archive.finish()?.into_inner())
    }
}
