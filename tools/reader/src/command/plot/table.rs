//! A table of a file, as curves of one column over another.

use std::path::Path;

use percuss_picture::{Curve, Medium, draw};
use percuss_table::Heading;

use super::{
    axes::{Line, panel},
    request::{Drawn, PlotError, Request},
};
use crate::{
    recording::{Budget, Limits, OpenError, open_file},
    text::short,
};

/// Largest number of values of a column that have a curve each.
const MAX_CURVES: usize = 1000;

/// Memory of a curve without its points \[bytes\].
const CURVE: usize = size_of::<Line>() + 256;

/// Draws column `y` of a table over column `x`, rows without both numbers left out; a curve for each value of a column, if the
/// request names one.
pub(super) fn of_columns(
    path: &Path,
    (x, y): (&str, &str),
    request: &Request,
    title: String,
    limits: Limits,
    medium: Medium,
) -> Result<Drawn, PlotError> {
    request.check_curves()?;
    let refuse = |what| OpenError::Memory { path: path.into(), what };
    let file = open_file(path)?;
    // a row may be as long as the file
    if file.metadata().is_ok_and(|data| data.len() > limits.record() as u64) {
        return Err(refuse("the rows of the table").into());
    }
    let unreadable = |error| PlotError::Table { path: path.into(), error };
    let mut rows = csv::Reader::from_reader(file);
    let headings: Vec<Heading> = rows.headers().map_err(unreadable)?.iter().map(heading).collect();
    let column = |key: &str| {
        let known = || headings.iter().map(|heading| short(&heading.name)).collect::<Vec<_>>().join(", ");
        let place = headings.iter().position(|heading| heading.name == key);
        place.ok_or_else(|| PlotError::Unfit(format!("the table has no column `{key}`; it has {}", known())))
    };
    let (x, y) = (column(x)?, column(y)?);
    let by = request.by.as_deref().map(column).transpose()?;
    let mut lines: Vec<Line> = Vec::new();
    let mut budget = Budget::new(limits.kept());
    for row in rows.records() {
        let row = row.map_err(unreadable)?;
        let number = |column: usize| row.get(column)?.trim().parse::<f64>().ok();
        let (Some(x), Some(y_value)) = (number(x), number(y)) else { continue };
        let name = by.map_or(headings[y].name.as_str(), |by| row.get(by).unwrap_or_default());
        let known = lines.iter().position(|line| line.curve.name == name);
        if known.is_none() && lines.len() == MAX_CURVES {
            let text = format!("--by: more than {MAX_CURVES} values; choose a column that has fewer");
            return Err(PlotError::Unfit(text));
        }
        // a list grows to twice its length
        let curve = if known.is_none() { CURVE + name.len() } else { 0 };
        if !budget.spend(2 * size_of::<(f64, f64)>() + curve) {
            return Err(refuse("the points of the curves").into());
        }
        let line = known.unwrap_or_else(|| {
            let curve = Curve { name: name.into(), ..Curve::default() };
            lines.push(Line { curve, heading: headings[y].clone() });
            lines.len() - 1
        });
        lines[line].curve.points.push((x, y_value));
    }
    if lines.is_empty() {
        return Err(PlotError::Nothing("no row of the table has a number in both columns".into()));
    }
    let panel = percuss_picture::Panel { title, ..panel(&headings[x], lines, Vec::new(), request) };
    let picture = draw(&[panel], medium).map_err(PlotError::Draw)?;
    Ok(Drawn { picture, damages: Vec::new(), undecoded: 0, left_out: Vec::new() })
}

/// Name and unit in the head of a column, `force [kN]`.
fn heading(text: &str) -> Heading {
    let with_unit = text.strip_suffix(']').and_then(|text| text.rsplit_once(" ["));
    let (name, unit) = with_unit.map_or((text, None), |(name, unit)| (name, Some(unit)));
    Heading::new(name, unit)
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
