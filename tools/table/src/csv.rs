//! Comma-separated values with a header of names and units.

use std::io::{self, Write};

use crate::table::{Cell, Heading, Sink};

/// Writes CSV; numbers in the shortest form that reads back as the same number.
pub struct Csv<W: Write> {
    writer: ::csv::Writer<W>,
    text: Vec<String>,
}

impl<W: Write> Csv<W> {
    /// Writes to `output`.
    pub fn new(output: W) -> Self {
        Self { writer: ::csv::Writer::from_writer(output), text: Vec::new() }
    }

    fn write(&mut self, cells: impl Iterator<Item = String>) -> io::Result<()> {
        self.text.clear();
        self.text.extend(cells);
        self.writer.write_record(&self.text).map_err(|error| match error.into_kind() {
            ::csv::ErrorKind::Io(error) => error,
            other => io::Error::other(format!("{other:?}")),
        })
    }
}

impl<W: Write> Sink for Csv<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.write(headings.iter().map(Heading::with_unit))
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.write(cells.iter().map(Cell::to_string))
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    fn end(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back() {
        let mut output = Vec::new();
        let mut csv = Csv::new(&mut output);
        let unit = Some("R".to_owned());
        let cells = [0.1, 1e-300, 2.0 / 3.0, f64::NAN, f64::INFINITY];
        csv.begin(&cells.map(|_| Heading { name: "a".into(), unit: unit.clone(), ..Heading::default() }))
            .expect("begin");
        csv.row(&cells.map(Cell::Double)).expect("row");
        csv.end().expect("end");
        drop(csv);
        let text = String::from_utf8(output).expect("text");
        let (header, row) = text.trim_end().split_once('\n').expect("two lines");
        assert_eq!(header, "a [R],a [R],a [R],a [R],a [R]");
        for (cell, text) in cells.iter().zip(row.split(',')) {
            let back: f64 = text.parse().expect("a number");
            assert!(back == *cell || (back.is_nan() && cell.is_nan()), "{text}");
        }
    }
}
