//! Fields of messages as columns: their names and units, and what of a message is their cell.

mod columns;
mod selection;

use percuss_table::{Cell, Heading};
use prost_reflect::EnumDescriptor;

use crate::{
    axis::Axis,
    extent::{Reach, at_point},
    instant::Instant,
    path::Path,
    wire::{List, Values},
};

pub use columns::columns;
pub use selection::{Positions, Selection, SelectionError};

/// Largest number of columns of a table.
pub(crate) const MAX_TABLE: usize = 1 << 18;

/// The file and the topic in the name of a column, as far as it has them, and its field.
pub(crate) fn place_and_field(name: &str) -> (&str, &str) {
    // fields hold neither slashes nor colons, and a topic ends with a dot
    let after_file = name.rfind(':').map_or(0, |colon| colon + 1);
    let end = match name[after_file..].rfind('/') {
        Some(slash) => {
            let slash = after_file + slash;
            name[slash..].find('.').map_or(after_file, |dot| slash + dot + 1)
        }
        None => after_file,
    };
    name.split_at(end)
}

/// One column: how to find its cell in a message.
#[derive(Clone, Debug)]
pub struct Column {
    pub heading: Heading,
    /// The leaf it is taken from; `None` for the log time.
    pub leaf: Option<usize>,
    take: Take,
}

#[derive(Clone, Debug)]
enum Take {
    /// From an origin on \[ns\].
    LogTime {
        origin: u64,
    },
    Element {
        path: Path,
        enumeration: Option<EnumDescriptor>,
    },
    At {
        path: Path,
        axis: Axis,
        even: bool,
        position: f64,
    },
    /// Of a matrix; with its rows and columns over all messages, if those are known.
    Point {
        axis: Axis,
        even: bool,
        point: (f64, f64),
        whole: Option<[Reach; 2]>,
    },
}

/// What of a channel is taken into rows.
#[derive(Debug)]
pub struct Columns {
    pub time: Column,
    pub fields: Vec<Column>,
    /// Why fields are left out, where all of a channel are asked for.
    pub left_out: Vec<SelectionError>,
}

impl Column {
    /// Memory that it takes where it is traced: with its heading, its steps and a cell \[bytes\].
    pub(crate) fn weight(&self) -> usize {
        /// Blocks of its texts and of its steps \[bytes\].
        const BLOCKS: usize = 256;
        let unit = self.heading.unit.as_ref().map_or(0, String::len);
        size_of::<Self>() + BLOCKS + 3 * (self.heading.name.len() + unit)
    }

    /// The cell of this column for a message.
    ///
    /// * `log_time`: log time of the message \[ns\]
    pub fn cell(&self, values: &Values, log_time: u64) -> Cell {
        let list = self.leaf.map(|leaf| &values.lists[leaf]);
        match (&self.take, list) {
            (Take::LogTime { origin }, _) => Cell::Double(Instant::log(log_time, *origin).number()),
            (_, None) => Cell::Empty,
            (Take::Element { path, enumeration }, Some(list)) => {
                path.rank(values, 0).map_or(Cell::Empty, |rank| cell(list, rank, enumeration.as_ref()))
            }
            (Take::At { path, axis, even, position }, Some(list)) => {
                let value = |i: usize| list.number(path.rank(values, i)?);
                let side = axis.side(values, path.length(values));
                let found = side.and_then(|side| axis.value(&side, *even, (*position, false), value));
                found.map_or(Cell::Empty, Cell::Double)
            }
            (Take::Point { axis, even, point, whole }, Some(list)) => {
                let found = at_point(list, &axis.sides(values, 0), whole.as_ref(), *even, *point);
                found.map_or(Cell::Empty, Cell::Double)
            }
        }
    }
}

/// A value as a cell; empty where there is none.
pub(crate) fn cell(list: &List, index: usize, enumeration: Option<&EnumDescriptor>) -> Cell {
    let cell = match list {
        List::Double(list) => list.get(index).map(|&value| Cell::Double(value)),
        List::Float(list) => list.get(index).map(|&value| Cell::Float(value)),
        List::Int(list) => list.get(index).map(|&value| Cell::Int(value)),
        List::UInt(list) => list.get(index).map(|&value| Cell::UInt(value)),
        List::Bool(list) => list.get(index).map(|&value| Cell::Bool(value)),
        List::Text(list) => list.get(index).map(|value| Cell::Text(value.clone())),
        List::Enum(list) => list.get(index).map(|&number| {
            let Some(kind) = enumeration else { return Cell::Int(number.into()) };
            let name = kind.get_value(number);
            Cell::Text(name.map_or_else(|| number.to_string(), |value| value.name().to_owned()))
        }),
        List::Bytes(_) => None,
    };
    cell.unwrap_or(Cell::Empty)
}

#[cfg(test)]
mod tests;
