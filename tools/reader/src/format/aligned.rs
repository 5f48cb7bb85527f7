//! Columns aligned for reading: names, units below them, numbers of five digits.

use std::io::{self, Write};

use percuss_table::{Cell, Heading, Sink};

use crate::{prefix::short, text::printable};

/// Writes a table whose columns are aligned: texts to the left, numbers to the right, empty cells as `-`. It keeps the
/// rows to the end, so it is for tables with few of them.
pub struct Aligned<W: Write> {
    output: W,
    lines: Vec<Vec<String>>,
    is_text: Vec<bool>,
}

impl<W: Write> Aligned<W> {
    pub fn new(output: W) -> Self {
        Self { output, lines: Vec::new(), is_text: Vec::new() }
    }
}

impl<W: Write> Sink for Aligned<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.is_text = vec![false; headings.len()];
        self.lines.push(headings.iter().map(|heading| printable(&heading.name).into_owned()).collect());
        let unit = |heading: &Heading| {
            heading.unit.as_ref().map_or_else(String::new, |unit| format!("[{}]", printable(unit)))
        };
        self.lines.push(headings.iter().map(unit).collect());
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        for (is_text, cell) in self.is_text.iter_mut().zip(cells) {
            *is_text |= matches!(cell, Cell::Text(_));
        }
        self.lines.push(cells.iter().map(text).collect());
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        let length = |line: &Vec<String>, column: usize| line[column].chars().count();
        let width = |column| self.lines.iter().map(|line| length(line, column)).max().unwrap_or(0);
        let widths: Vec<usize> = (0..self.is_text.len()).map(width).collect();
        for line in &self.lines {
            let cells = line.iter().zip(&widths).zip(&self.is_text);
            let cells: Vec<String> = cells
                .map(|((cell, &width), is_text)| match is_text {
                    true => format!("{cell:<width$}"),
                    false => format!("{cell:>width$}"),
                })
                .collect();
            writeln!(self.output, "{}", cells.join("  ").trim_end())?;
        }
        self.output.flush()
    }
}

fn text(cell: &Cell) -> String {
    match cell {
        Cell::Empty => "-".into(),
        Cell::Float(_) | Cell::Double(_) => cell.number().map_or_else(String::new, short),
        other => printable(&other.to_string()).into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned() {
        let mut output = Vec::new();
        let mut table = Aligned::new(&mut output);
        let force = Heading::new("force", Some("µN"));
        table.begin(&[Heading::new("file", None), force]).expect("begin");
        table.row(&[Cell::Text("a".into()), Cell::Double(2.0 / 3.0)]).expect("row");
        table.row(&[Cell::Text("b.mcap".into()), Cell::Empty]).expect("row");
        table.row(&[Cell::Text("c\u{1b}".into()), Cell::Double(12.0)]).expect("row");
        table.end().expect("end");
        let text = String::from_utf8(output).expect("text");
        let expected =
            "file       force\n            [µN]\na        0.66667\nb.mcap         -\nc\\u{1b}       12\n";
        assert_eq!(text, expected);
    }
}
