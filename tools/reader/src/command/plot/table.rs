//! Columns of a table, as curves of one over another.

use std::path::Path;

use percuss_picture::{Curve, Medium, draw};
use percuss_table::{Cell, Heading};

use super::{
    axes::{Line, panel},
    request::{Drawn, Request},
};
use crate::{
    failure::Failure,
    recording::{Budget, Limits},
    tabular,
};

/// Largest number of values of a column that have a curve each.
const MAX_CURVES: usize = 1000;

/// Memory of a curve without its points \[bytes\].
const CURVE: usize = size_of::<Line>() + 256;

/// Draws column `y` of a table over column `x`, rows without both numbers left out and counted; a curve for each value of a
/// column, if the request names one, from the least to the greatest `x`: a table can have its rows in any order.
pub(super) fn of_columns(
    path: &Path,
    (x, y): (&str, &str),
    request: &Request,
    title: String,
    limits: Limits,
    medium: Medium,
) -> Result<Drawn, Failure> {
    request.check_curves()?;
    let names: Vec<&str> = [x, y].into_iter().chain(request.by.as_deref()).collect();
    let table = tabular::read(path, Some(&names), limits)?;
    let (xs, ys) = (&table.columns[0], &table.columns[1]);
    let by = table.headings.get(2).zip(table.columns.get(2));
    let mut lines: Vec<Line> = Vec::new();
    let mut budget = Budget::new(limits.kept());
    let mut lacking = 0;
    for (row, point) in xs.iter().zip(ys).enumerate() {
        let (Some(x), Some(y)) = (point.0.number(), point.1.number()) else {
            lacking += 1;
            continue;
        };
        let name =
            by.map_or_else(|| table.headings[1].name.clone(), |(heading, cells)| name(heading, &cells[row]));
        let known = lines.iter().position(|line| line.curve.name == name);
        if known.is_none() && lines.len() == MAX_CURVES {
            let text = format!("--by: more than {MAX_CURVES} values; choose a column that has fewer");
            return Err(Failure::Usage(text));
        }
        // a list grows to twice its length
        let curve = if known.is_none() { CURVE + name.len() } else { 0 };
        if !budget.spend(2 * size_of::<(f64, f64)>() + curve) {
            return Err(Failure::memory(path, "the points of the curves"));
        }
        let line = known.unwrap_or_else(|| {
            let curve = Curve { name, ..Curve::default() };
            lines.push(Line { curve, heading: table.headings[1].clone() });
            lines.len() - 1
        });
        lines[line].curve.points.push((x, y));
    }
    if lines.is_empty() {
        return Err(Failure::nothing("no row of the table has a number in both columns"));
    }
    if by.is_some() {
        lines.iter_mut().for_each(|line| line.curve.points.sort_by(|a, b| a.0.total_cmp(&b.0)));
    }
    let panel = percuss_picture::Panel { title, ..panel(&table.headings[0], lines, Vec::new(), request) };
    let picture = draw(&[panel], medium).map_err(Failure::drawing)?;
    Ok(Drawn { picture, lacking, ..Drawn::default() })
}

/// Name of the curve of a value: a number says what it is of.
fn name(heading: &Heading, value: &Cell) -> String {
    match (value.number(), &heading.unit) {
        (None, _) => value.to_string(),
        (_, None) => format!("{} = {value}", heading.name),
        (_, Some(unit)) => format!("{} = {value} {unit}", heading.name),
    }
}
