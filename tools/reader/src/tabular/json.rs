//! JSON: an object a row, one a line or in the list `rows` of a document, beside its `units`.

use std::collections::{BTreeMap, BTreeSet};

use percuss_table::{Cell, Heading};
use serde::{Deserialize, de::IgnoredAny};
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
    let document = (text.len() <= most).then(|| serde_json::from_str::<Document<'_>>(text).ok()).flatten();
    if let Some(Document { units, rows }) = document {
        return table(rows.iter().map(|row| row.get()).enumerate(), &units, columns);
    }
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    if lines.clone().any(|(_, line)| line.len() > most) {
        return Err(Flaw::Memory);
    }
    table(lines, &BTreeMap::new(), columns)
}

/// Takes numbered rows; a column is what any of them has.
fn table<'a>(
    rows: impl Iterator<Item = (usize, &'a str)> + Clone,
    units: &BTreeMap<String, String>,
    columns: &mut Columns<'_>,
) -> Result<(), Flaw> {
    /// Memory of a name besides its text \[bytes\].
    const NAME: usize = 64;
    let mut known = BTreeSet::new();
    for (number, row) in rows.clone() {
        for name in parse::<IgnoredAny>(number, row)?.into_keys() {
            if !known.contains(&name) {
                columns.spend(NAME + name.len())?;
                known.insert(name);
            }
        }
    }
    let heading = |name: &String| Heading::new(name, units.get(name).map(String::as_str));
    columns.begin(known.iter().map(heading).collect())?;
    let chosen: Vec<String> = columns.table.headings.iter().map(|heading| heading.name.clone()).collect();
    for (number, row) in rows {
        let row = parse::<Value>(number, row)?;
        for (column, name) in chosen.iter().enumerate() {
            let value = row.get(name);
            if columns.names.is_none() && matches!(value, Some(Value::Array(_) | Value::Object(_))) {
                return Err(Flaw::Nested(name.clone()));
            }
            columns.push(column, cell(value))?;
        }
    }
    Ok(())
}

fn parse<'a, T: Deserialize<'a>>(number: usize, row: &'a str) -> Result<BTreeMap<String, T>, Flaw> {
    serde_json::from_str(row).map_err(|error| Flaw::of(format!("row {}: {error}", number + 1)))
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
