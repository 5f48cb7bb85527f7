//! Comma-separated values: `force [kN]` is a name and its unit.

use percuss_table::{Cell, Heading};

use super::{Columns, Flaw};

pub(super) fn read(bytes: &[u8], columns: &mut Columns<'_>) -> Result<(), Flaw> {
    let mut rows = ::csv::Reader::from_reader(bytes);
    let head = rows.headers().map_err(Flaw::of)?;
    if head.len() == 1 && head[0].contains(';') {
        return Err(Flaw::of("its columns are between semicolons: a CSV file has commas there"));
    }
    let known = head.iter().map(heading).collect();
    let chosen = columns.begin(known)?;
    for row in rows.records() {
        let row = row.map_err(Flaw::of)?;
        for (column, &place) in chosen.iter().enumerate() {
            columns.push(column, cell(row.get(place).unwrap_or_default().trim()))?;
        }
    }
    Ok(())
}

/// Name and unit in the head of a column.
fn heading(text: &str) -> Heading {
    let with_unit = text.strip_suffix(']').and_then(|text| text.rsplit_once(" ["));
    let (name, unit) = with_unit.map_or((text, None), |(name, unit)| (name, Some(unit)));
    Heading::new(name, unit)
}

fn cell(text: &str) -> Cell {
    match (text.parse(), text.parse(), text.parse()) {
        _ if text.is_empty() => Cell::Empty,
        (Ok(number), ..) => Cell::Int(number),
        (_, Ok(number), _) => Cell::UInt(number),
        (.., Ok(number)) => Cell::Double(number),
        _ => Cell::Text(text.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_stand_in_brackets() {
        for (text, name, unit) in [
            ("force [kN]", "force", Some("kN")),
            ("stress@r=0.5 [γc_p²]", "stress@r=0.5", Some("γc_p²")),
            ("list[3]", "list[3]", None),
            ("list[3] [m]", "list[3]", Some("m")),
        ] {
            let Heading { name: found, unit: found_unit, .. } = heading(text);
            assert_eq!((found.as_str(), found_unit.as_deref()), (name, unit));
        }
    }
}
