//! Parquet: typed columns, a row group for every stacked file or [`GROUP`] rows.

use std::{
    io::{self, Write},
    sync::Arc,
};

use parquet::{
    basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel},
    data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, FloatType, Int64Type},
    errors::ParquetError,
    file::{
        metadata::KeyValue,
        properties::WriterProperties,
        writer::{SerializedColumnWriter, SerializedFileWriter},
    },
    schema::types::Type,
};

use crate::table::{Cell, CellType, Heading, Sink};

/// Rows after which a row group is written.
const GROUP: usize = 1 << 16;

/// Cells after which a row group is written, whatever the number of rows, and bytes of text.
const GROUP_CELLS: usize = 1 << 22;
const GROUP_TEXT: usize = 16 << 20;

/// Memory of a column, besides its name: its type, in every form that is kept of it \[bytes\].
const COLUMN: usize = 2048;

/// Memory of a column in a row group that has been written: its place, which stands at the end of the file \[bytes\].
const PLACE: usize = 512;

/// Writes Parquet. Units are in the key-value metadata of the file as `unit.<column>`.
pub struct Parquet<W: Write + Send> {
    output: Option<W>,
    writer: Option<SerializedFileWriter<W>>,
    created_by: String,
    headings: Vec<Heading>,
    columns: Vec<Vec<Cell>>,
    /// Text of the rows since the last group \[bytes\].
    text: usize,
    /// Memory for the rows of a group \[bytes\].
    room: usize,
    /// Memory that is left for columns and their places \[bytes\].
    left: usize,
}

impl<W: Write + Send> Parquet<W> {
    /// Writes to `output`.
    ///
    /// * `created_by`: name and version of the program, as the file says them
    /// * `room`: memory for the rows of a group, and as much again for columns and their places \[bytes\]
    pub fn new(output: W, created_by: &str, room: usize) -> Self {
        let (output, created_by) = (Some(output), created_by.into());
        let (headings, columns) = (Vec::new(), Vec::new());
        Self { output, writer: None, created_by, headings, columns, text: 0, room, left: room }
    }

    /// Spends memory for what is kept until the end of the file.
    fn spend(&mut self, bytes: usize) -> io::Result<()> {
        if let Some(left) = self.left.checked_sub(bytes) {
            self.left = left;
            return Ok(());
        }
        let text = "a Parquet file keeps a place for every column of every group of rows: these take more memory than \
                    --max-memory allows; choose fewer fields, write another format, or raise it";
        Err(io::Error::new(io::ErrorKind::OutOfMemory, text))
    }

    /// True if the rows since the last group are as many as a group has, or as there is memory for.
    fn is_full(&self) -> bool {
        let rows = self.columns.first().map_or(0, Vec::len);
        let cells = GROUP_CELLS.min(self.room / size_of::<Cell>());
        rows >= GROUP || rows * self.columns.len() >= cells || self.text >= GROUP_TEXT.min(self.room / 2)
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        self.text = 0;
        if self.columns.first().is_none_or(Vec::is_empty) {
            return Ok(());
        }
        self.spend(PLACE * self.columns.len()).map_err(|error| ParquetError::External(Box::new(error)))?;
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let mut group = writer.next_row_group()?;
        for (heading, cells) in self.headings.iter().zip(&mut self.columns) {
            let mut column = group.next_column()?.expect("a column for every heading");
            write_column(&mut column, heading.kind, std::mem::take(cells))?;
            column.close()?;
        }
        group.close()?;
        Ok(())
    }
}

fn write_column(
    column: &mut SerializedColumnWriter<'_>,
    kind: CellType,
    cells: Vec<Cell>,
) -> Result<usize, ParquetError> {
    let number = |cell: Cell| cell.number().unwrap_or(f64::NAN);
    match kind {
        CellType::Double => write_cells::<DoubleType>(column, cells, number),
        CellType::Float => write_cells::<FloatType>(column, cells, |cell| number(cell) as f32),
        CellType::Int | CellType::UInt => write_cells::<Int64Type>(column, cells, |cell| match cell {
            Cell::Int(value) => value,
            // the same bits: the logical type says that they are unsigned
            Cell::UInt(value) => value as i64,
            other => number(other) as i64,
        }),
        CellType::Bool => write_cells::<BoolType>(column, cells, |cell| cell == Cell::Bool(true)),
        CellType::Text => write_cells::<ByteArrayType>(column, cells, |cell| match cell {
            Cell::Text(text) => ByteArray::from(text.into_bytes()),
            _ => ByteArray::from(Vec::new()),
        }),
    }
}

fn write_cells<T: DataType>(
    column: &mut SerializedColumnWriter<'_>,
    cells: Vec<Cell>,
    value: impl FnMut(Cell) -> T::T,
) -> Result<usize, ParquetError> {
    // 1 where there is a value
    let levels: Vec<i16> = cells.iter().map(|cell| i16::from(*cell != Cell::Empty)).collect();
    let values: Vec<T::T> = cells.into_iter().filter(|cell| *cell != Cell::Empty).map(value).collect();
    column.typed::<T>().write_batch(&values, Some(&levels), None)
}

fn column_type(heading: &Heading) -> Result<Type, ParquetError> {
    let (physical, logical) = match heading.kind {
        CellType::Double => (Physical::DOUBLE, None),
        CellType::Float => (Physical::FLOAT, None),
        CellType::Int => (Physical::INT64, None),
        CellType::UInt => (Physical::INT64, Some(LogicalType::integer(64, false))),
        CellType::Bool => (Physical::BOOLEAN, None),
        CellType::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder = Type::primitive_type_builder(&heading.name, physical);
    builder.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build()
}

fn fail(error: ParquetError) -> io::Error {
    match error {
        ParquetError::External(inner) => match inner.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(inner) => io::Error::other(inner),
        },
        other => io::Error::other(other),
    }
}

impl<W: Write + Send> Sink for Parquet<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.spend(headings.iter().map(|heading| COLUMN + 4 * heading.name.len()).sum())?;
        let fields = headings.iter().map(|heading| column_type(heading).map(Arc::new));
        let fields = fields.collect::<Result<Vec<_>, _>>().map_err(fail)?;
        let schema = Type::group_type_builder("trace").with_fields(fields).build().map_err(fail)?;
        let units = headings.iter().filter_map(|heading| {
            let unit = heading.unit.clone()?;
            Some(KeyValue::new(format!("unit.{}", heading.name), unit))
        });
        let properties = WriterProperties::builder()
            .set_created_by(self.created_by.clone())
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_key_value_metadata(Some(units.collect()))
            .build();
        if let Some(output) = self.output.take() {
            let writer = SerializedFileWriter::new(output, Arc::new(schema), Arc::new(properties));
            self.writer = Some(writer.map_err(fail)?);
        }
        self.headings = headings.to_vec();
        self.columns = vec![Vec::new(); headings.len()];
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        for (column, cell) in self.columns.iter_mut().zip(cells) {
            if let Cell::Text(text) = cell {
                self.text += text.len();
            }
            column.push(cell.clone());
        }
        if self.is_full() {
            return self.write_group().map_err(fail);
        }
        Ok(())
    }

    fn group(&mut self) -> io::Result<()> {
        self.write_group().map_err(fail)
    }

    fn end(&mut self) -> io::Result<()> {
        self.write_group().map_err(fail)?;
        if let Some(writer) = self.writer.take() {
            writer.close().map_err(fail)?;
        }
        Ok(())
    }
}
