//! JSON: an object per row, keys in the order of the columns; one on a line, or in the list `rows` of one document beside its `units`.

use std::{
    collections::BTreeMap,
    io::{self, Write},
};

use percuss_table::{Cell, Heading, Sink};
use serde::ser::{Serialize, SerializeMap, Serializer};

/// Writes JSON. NaN and infinities are the strings `"NaN"`, `"Infinity"` and `"-Infinity"`, as in the JSON mapping of protobuf; empty
/// cells are `null`.
pub struct Json<W: Write> {
    output: W,
    headings: Vec<Heading>,
    /// Rows so far, of a document.
    rows: Option<usize>,
}

impl<W: Write> Json<W> {
    /// Writes one object per line to `output`.
    pub fn lines(output: W) -> Self {
        Self { output, headings: Vec::new(), rows: None }
    }

    /// Writes `{"units": {column: unit}, "rows": [{column: value}]}` to `output`.
    pub fn document(output: W) -> Self {
        Self { rows: Some(0), ..Self::lines(output) }
    }
}

impl<W: Write> Sink for Json<W> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.headings = headings.to_vec();
        if self.rows.is_some() {
            let units = headings.iter().filter_map(|heading| Some((&heading.name, heading.unit.as_ref()?)));
            let units = serde_json::to_string(&units.collect::<BTreeMap<_, _>>())?;
            write!(self.output, "{{\"units\":{units},\"rows\":[")?;
        }
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        if let Some(rows) = &mut self.rows {
            self.output.write_all(if *rows == 0 { b"\n" } else { b",\n" })?;
            *rows += 1;
        }
        serde_json::to_writer(&mut self.output, &Row { headings: &self.headings, cells })?;
        self.output.write_all(if self.rows.is_none() { b"\n" } else { b"" })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }

    fn end(&mut self) -> io::Result<()> {
        self.output.write_all(if self.rows.is_some() { b"\n]}\n" } else { b"" })?;
        self.output.flush()
    }
}

/// A row as an object.
struct Row<'a> {
    headings: &'a [Heading],
    cells: &'a [Cell],
}

impl Serialize for Row<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.cells.len()))?;
        for (heading, cell) in self.headings.iter().zip(self.cells) {
            map.serialize_entry(&heading.name, &Value(cell))?;
        }
        map.end()
    }
}

struct Value<'a>(&'a Cell);

impl Serialize for Value<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Cell::Empty => serializer.serialize_none(),
            Cell::Bool(value) => serializer.serialize_bool(*value),
            Cell::Int(value) => serializer.serialize_i64(*value),
            Cell::UInt(value) => serializer.serialize_u64(*value),
            Cell::Float(value) if value.is_finite() => serializer.serialize_f32(*value),
            Cell::Float(value) => serializer.serialize_str(special(f64::from(*value))),
            Cell::Double(value) if value.is_finite() => serializer.serialize_f64(*value),
            Cell::Double(value) => serializer.serialize_str(special(*value)),
            Cell::Text(value) => serializer.serialize_str(value),
        }
    }
}

/// A number that JSON has no form for, as the JSON mapping of protobuf writes it.
pub(crate) fn special(value: f64) -> &'static str {
    if value.is_nan() {
        "NaN"
    } else if value > 0.0 {
        "Infinity"
    } else {
        "-Infinity"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_objects() {
        let mut output = Vec::new();
        let mut lines = Json::lines(&mut output);
        let heading = |name: &str| Heading::new(name, None);
        lines.begin(&["b", "a", "c", "d"].map(heading)).expect("begin");
        let row = [Cell::Double(0.1), Cell::Empty, Cell::Double(f64::NEG_INFINITY), Cell::Text("x\"".into())];
        lines.row(&row).expect("row");
        let text = String::from_utf8(output).expect("text");
        assert_eq!(text, "{\"b\":0.1,\"a\":null,\"c\":\"-Infinity\",\"d\":\"x\\\"\"}\n");
    }
}
