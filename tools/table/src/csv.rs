//! Comma-separated values with a header of names and units.

use std::io::{self, Write};

use crate::table::{Cell, Heading, Sink};

/// Writes CSV; numbers in the shortest form that reads back as the same number. Texts that a spreadsheet would compute begin with an
/// apostrophe.
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

/// A text that no spreadsheet takes for a formula.
fn inert(text: &str) -> String {
    let is_formula = text.starts_with(['=', '+', '-', '@', '\t', '\r', '\n']) && text.parse::<f64>().is_err();
    if is_formula { format!("'{text}") } else { text.into() }
}

impl<W: Write> Sink for Csv<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.write(headings.iter().map(|heading| inert(&heading.with_unit())))
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.write(cells.iter().map(|cell| match cell {
            Cell::Text(text) => inert(text),
            number => number.to_string(),
        }))
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
    fn no_text_is_a_formula_and_every_number_is_itself() {
        let texts =
            ["=cmd|' /C calc'!A0", "+1+2", "-1 mm", "@SUM(A1)", "\t=1", "\r=1", "steel", "-5", "+1e3"];
        let mut output = Vec::new();
        let mut csv = Csv::new(&mut output);
        csv.begin(&texts.map(|text| Heading::new(text, None))).expect("begin");
        csv.row(&texts.map(|text| Cell::Text(text.into()))).expect("row");
        let mut numbers = vec![Cell::Empty; texts.len()];
        (numbers[0], numbers[1]) = (Cell::Double(-1.5), Cell::Int(-2));
        csv.row(&numbers).expect("row");
        csv.end().expect("end");
        drop(csv);
        let rows: Vec<_> =
            ::csv::ReaderBuilder::new().has_headers(false).from_reader(&output[..]).into_records().collect();
        let written: Vec<Vec<String>> =
            rows.into_iter().map(|row| row.expect("a row").iter().map(str::to_owned).collect()).collect();
        let expected =
            texts.map(
                |text| if ["steel", "-5", "+1e3"].contains(&text) { text.into() } else { format!("'{text}") },
            );
        assert_eq!((&written[0][..], &written[1][..]), (&expected[..], &expected[..]));
        assert_eq!(written[2][..2], ["-1.5", "-2"]);
    }

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
