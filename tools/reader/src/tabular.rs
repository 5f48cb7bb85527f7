//! Tables that were written, by this program or another, read back: columns by their names. CSV, JSON lines and documents, Parquet
//! and archives of NumPy arrays are distinguished by how they begin.

mod csv;
mod json;
mod npz;
mod pages;
mod parquet;

use std::{fs, path::Path};

use percuss_table::{Cell, Heading};

use crate::{
    failure::Failure,
    recording::{Budget, Limits, open_file},
    text::short,
};

/// Extensions of the names of tables.
pub const EXTENSIONS: [&str; 6] = ["csv", "json", "jsonl", "ndjson", "npz", "parquet"];

/// Columns of a table, all of the same length.
#[derive(Debug, Default)]
pub struct Table {
    /// Names and units.
    pub headings: Vec<Heading>,
    /// The cells of each, from the first row down.
    pub columns: Vec<Vec<Cell>>,
}

/// Reads columns of a table.
///
/// * `names`: those to read, without units, in this order; all columns without them
///
/// # Errors
///
/// The file cannot be read, is damaged, lacks a column, or takes more than the memory of the limits.
pub fn read(path: &Path, names: Option<&[&str]>, limits: Limits) -> Result<Table, Failure> {
    let refuse = || Failure::memory(path, "the rows of the table");
    let length = open_file(path)?.metadata().map_or(0, |data| data.len());
    if length > limits.record() as u64 {
        return Err(refuse());
    }
    let bytes = fs::read(path).map_err(|error| Failure::Read { path: path.into(), error })?;
    let mut columns = Columns { names, table: Table::default(), room: Budget::new(limits.kept()), limits };
    let begins = |magic: &[u8]| bytes.starts_with(magic);
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    let (format, read) = match first {
        _ if begins(b"PAR1") => ("Parquet", parquet::read(&bytes, &mut columns)),
        _ if begins(b"PK") => ("an archive of NumPy arrays", npz::read(&bytes, &mut columns)),
        Some(b'{') => ("JSON", json::read(&bytes, &mut columns)),
        _ => ("CSV", csv::read(&bytes, &mut columns)),
    };
    read.map_err(|flaw| match flaw {
        Flaw::NoColumn { name, known } => {
            Failure::Usage(format!("the table has no column `{name}`; it has {known}"))
        }
        Flaw::Nested(name) => Failure::Usage(format!(
            "`{}`: its column `{}` has lists or objects; write each of their values as a column of its own, or leave it out",
            path.display(),
            short(&name)
        )),
        Flaw::Unreadable(reason) => {
            Failure::Failed(format!("cannot read `{}` as {format}: {reason}", path.display()))
        }
        Flaw::Memory => refuse(),
    })?;
    Ok(columns.table)
}

/// What is wrong with a table.
enum Flaw {
    NoColumn {
        name: String,
        known: String,
    },
    /// A column holds lists or objects.
    Nested(String),
    Unreadable(String),
    Memory,
}

impl Flaw {
    fn of(error: impl ToString) -> Self {
        Self::Unreadable(error.to_string())
    }
}

/// Columns that are being read, and the memory for them.
struct Columns<'a> {
    names: Option<&'a [&'a str]>,
    table: Table,
    room: Budget,
    limits: Limits,
}

impl Columns<'_> {
    /// Begins the table; gives the numbers of the columns that are to be read.
    fn begin(&mut self, known: Vec<Heading>) -> Result<Vec<usize>, Flaw> {
        let place = |name: &&str| {
            known.iter().position(|heading| heading.name == **name).ok_or_else(|| Flaw::NoColumn {
                name: (*name).into(),
                known: known.iter().map(|heading| short(&heading.name)).collect::<Vec<_>>().join(", "),
            })
        };
        let chosen = match self.names {
            Some(names) => names.iter().map(place).collect::<Result<Vec<_>, _>>()?,
            None => (0..known.len()).collect(),
        };
        self.table.headings = chosen.iter().map(|&place| known[place].clone()).collect();
        self.table.columns = vec![Vec::new(); chosen.len()];
        Ok(chosen)
    }

    /// Takes the next cell of a column of the table.
    fn push(&mut self, column: usize, cell: Cell) -> Result<(), Flaw> {
        let text = if let Cell::Text(text) = &cell { text.capacity() } else { 0 };
        // a list grows to twice its length
        self.spend(2 * size_of::<Cell>() + text)?;
        self.table.columns[column].push(cell);
        Ok(())
    }

    /// Spends memory before it is taken.
    fn spend(&mut self, bytes: usize) -> Result<(), Flaw> {
        if self.room.spend(bytes) { Ok(()) } else { Err(Flaw::Memory) }
    }
}
