//! JSON: an object a row, one a line or in the list `rows` of a document, beside its `units`.

use std::collections::BTreeMap;

use percuss_table::{Cell, Heading};
use serde::Deserialize;
use serde_json::{Value, value::RawValue};

use super::{Columns, Flaw};
use crate::wire::json::special;

/// Bytes of JSON to one of the memory that they can take when they are parsed: a list of numbers of one digit takes most.
const GROWTH: usize = 16;

#[derive(Deserialize)]
struct Document<'a> {
    #[serde(default)]
    units: BTreeMap<String, String>,
    #[serde(borrow)]
    rows: Vec<&'a RawValue>,
}

pub(super) fn read(bytes: &[u8], columns: &mut Columns<'_>) -> Result<(), Flaw> {
    let text = str::from_utf8(bytes).map_err(Flaw::of)?;
    let most = columns.limits.record() / GROWTH;
    let mut chosen = Vec::new();
    let document = (text.len() <= most).then(|| serde_json::from_str::<Document<'_>>(text).ok()).flatten();
    if let Some(Document { units, rows }) = document {
        for (number, row) in rows.into_iter().enumerate() {
            take(row.get(), number, &units, &mut chosen, columns)?;
        }
        return Ok(());
    }
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    for (number, line) in lines {
        if line.len() > most {
            return Err(Flaw::Memory);
        }
        take(line, number, &BTreeMap::new(), &mut chosen, columns)?;
    }
    Ok(())
}

/// Takes a row; the first says which columns there are.
fn take(
    text: &str,
    number: usize,
    units: &BTreeMap<String, String>,
    chosen: &mut Vec<String>,
    columns: &mut Columns<'_>,
) -> Result<(), Flaw> {
    let row: BTreeMap<String, Value> =
        serde_json::from_str(text).map_err(|error| Flaw::of(format!("row {}: {error}", number + 1)))?;
    if number == 0 {
        let heading = |name: &String| Heading::new(name, units.get(name).map(String::as_str));
        columns.begin(row.keys().map(heading).collect())?;
        *chosen = columns.table.headings.iter().map(|heading| heading.name.clone()).collect();
    }
    chosen.iter().enumerate().try_for_each(|(column, name)| columns.push(column, cell(row.get(name))))
}

fn cell(value: Option<&Value>) -> Cell {
    match value {
        Some(Value::Bool(value)) => Cell::Bool(*value),
        Some(Value::Number(number)) => match (number.as_i64(), number.as_u64()) {
            (Some(number), _) => Cell::Int(number),
            (_, Some(number)) => Cell::UInt(number),
            _ => number.as_f64().map_or(Cell::Empty, Cell::Double),
        },
        Some(Value::String(text)) => special(text).map_or_else(|| Cell::Text(text.clone()), Cell::Double),
        None | Some(Value::Null | Value::Array(_) | Value::Object(_)) => Cell::Empty,
    }
}
