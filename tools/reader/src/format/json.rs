//! One JSON document: the units of the columns, and the rows as objects.

use std::io::{self, Write};

use percuss_table::{Cell, Heading, Sink};
use serde_json::{Map, Value};

use super::json_lines::Row;

/// Writes `{"units": {column: unit}, "rows": [{column: value}]}`, with values as in [`super::json_lines`].
pub struct Json<W: Write> {
    output: W,
    headings: Vec<Heading>,
    rows: usize,
}

impl<W: Write> Json<W> {
    /// Writes to `output`.
    pub fn new(output: W) -> Self {
        Self { output, headings: Vec::new(), rows: 0 }
    }
}

impl<W: Write> Sink for Json<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.headings = headings.to_vec();
        let units = headings
            .iter()
            .filter_map(|heading| Some((heading.name.clone(), Value::String(heading.unit.clone()?))));
        let units: Map<String, Value> = units.collect();
        write!(self.output, "{{\"units\":{},\"rows\":[", Value::Object(units))
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.output.write_all(if self.rows == 0 { b"\n" } else { b",\n" })?;
        self.rows += 1;
        serde_json::to_writer(&mut self.output, &Row { headings: &self.headings, cells })?;
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        self.output.write_all(b"\n]}\n")?;
        self.output.flush()
    }
}
