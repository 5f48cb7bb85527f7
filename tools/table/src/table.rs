//! Named columns with units, and what takes their rows.

use std::{fmt, io};

/// What the cells of a column are, where they are not empty.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum CellType {
    /// Double-precision numbers.
    #[default]
    Double,
    /// Single-precision numbers.
    Float,
    /// Signed whole numbers.
    Int,
    /// Unsigned whole numbers.
    UInt,
    /// Truth values.
    Bool,
    /// Texts.
    Text,
}

/// A column.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Heading {
    /// Name.
    pub name: String,
    /// Unit; `None` if unknown or a plain number.
    pub unit: Option<String>,
    /// What the cells are.
    pub kind: CellType,
}

impl Heading {
    /// A column of numbers.
    pub fn new(name: &str, unit: Option<&str>) -> Self {
        Self { name: name.into(), unit: unit.map(str::to_owned), kind: CellType::Double }
    }

    /// Name with the unit in brackets.
    pub fn with_unit(&self) -> String {
        match &self.unit {
            Some(unit) => format!("{} [{unit}]", self.name),
            None => self.name.clone(),
        }
    }
}

/// One cell.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Nothing there.
    Empty,
    /// A truth value.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A whole number.
    UInt(u64),
    /// A single-precision number.
    Float(f32),
    /// A double-precision number.
    Double(f64),
    /// A text.
    Text(String),
}

impl Cell {
    /// The cell as a number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Int(value) => Some(*value as f64),
            Self::UInt(value) => Some(*value as f64),
            Self::Float(value) => Some(f64::from(*value)),
            Self::Double(value) => Some(*value),
            Self::Empty | Self::Bool(_) | Self::Text(_) => None,
        }
    }
}

impl fmt::Display for Cell {
    /// Numbers in the shortest form that reads back, with an exponent where that is shorter; nothing for an empty cell.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => Ok(()),
            Self::Bool(value) => write!(f, "{value}"),
            Self::Int(value) => write!(f, "{value}"),
            Self::UInt(value) => write!(f, "{value}"),
            Self::Float(value) => write!(f, "{value:?}"),
            Self::Double(value) => write!(f, "{value:?}"),
            Self::Text(value) => f.write_str(value),
        }
    }
}

/// Takes the rows of a table, one by one; fails where the output cannot be written.
pub trait Sink {
    /// Begins the table.
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()>;

    /// Takes a row; it has as many cells as there are headings.
    fn row(&mut self, cells: &[Cell]) -> io::Result<()>;

    /// Ends a group of rows: those of one file where several are stacked.
    fn group(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Hands on what was taken so far, where the format can.
    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }

    /// Ends the table.
    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}
