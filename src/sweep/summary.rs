//! The summary of a sweep: a row for every case that is done.

use std::io;

use percuss_table::{Cell, CellType, Heading, Sink, measures::Measure};

use super::{
    journal::{Done, Entry},
    plan::Plan,
    spec::number,
};
use crate::{
    case::quantity_si,
    geometry::Geometry,
    measuring::{self, nothing},
};

/// Writes the rows of some cases, by their numbers; those that are not done have none.
pub fn write(
    plan: &Plan,
    done: &Done,
    mut numbers: impl Iterator<Item = usize>,
    sink: &mut dyn Sink,
) -> io::Result<()> {
    let interfaces = interfaces(plan, done);
    let headings = headings(plan, nothing(interfaces));
    sink.begin(&headings)?;
    numbers.try_for_each(|number| {
        let entry = done.entries.get(&plan.cases[number - 1].digest);
        entry.map_or(Ok(()), |entry| sink.row(&row(plan, (&headings, interfaces), number, entry)))
    })?;
    sink.end()
}

/// Most interfaces of layers that target and indenter of a case of a sweep have.
fn interfaces(plan: &Plan, done: &Done) -> [usize; 2] {
    let all = done.entries.values().map(|entry| entry.measures.interfaces);
    all.fold(plan.first.sizes.interfaces(), |most, these| [0, 1].map(|body| most[body].max(these[body])))
}

/// The columns of a summary: number of the case, what varies, how it ended, what was measured, what it is warned of.
fn headings(plan: &Plan, measures: Vec<Measure>) -> Vec<Heading> {
    let is_si = plan.first.scales.is_some();
    // dimensionless recordings have units too: those of the theory
    let units = measuring::units(plan.first.units());
    let text = |name: &str, kind| Heading { name: name.into(), unit: None, kind };
    let varied = plan.keys().enumerate().map(|(column, key)| match column_unit(plan, column) {
        Some(unit) => Heading { name: key.into(), unit: unit.filter(|_| is_si), kind: CellType::Double },
        None => text(key, CellType::Text),
    });
    let start = [text("case", CellType::UInt)].into_iter();
    let measured = measures.into_iter().map(move |measure| measure.heading(&units));
    let end = [text("warnings", CellType::Text)];
    start.chain(varied).chain([text("status", CellType::Text)]).chain(measured).chain(end).collect()
}

/// The row of a case in a summary.
fn row(
    plan: &Plan,
    (headings, interfaces): (&[Heading], [usize; 2]),
    number: usize,
    entry: &Entry,
) -> Vec<Cell> {
    let geometry = plan.first.geometry;
    let varied = plan.values(number).zip(&headings[1..]).map(|(value, heading)| match heading.kind {
        CellType::Double => {
            number_of(value, geometry).map_or(Cell::Empty, |(number, _)| Cell::Double(number))
        }
        _ => Cell::Text(text_of(value)),
    });
    let measured = entry.measures.values(interfaces).map(|value| value.map_or(Cell::Empty, Cell::Double));
    let start = [Cell::UInt(number as u64)].into_iter();
    let warnings = if entry.warnings.is_empty() { Cell::Empty } else { Cell::Text(entry.warnings.join(";")) };
    start
        .chain(varied)
        .chain([Cell::Text(entry.state.name().into())])
        .chain(measured)
        .chain([warnings])
        .collect()
}

/// Unit of a column of varied values if all of them are numbers in it; plain ones have none.
fn column_unit(plan: &Plan, column: usize) -> Option<Option<String>> {
    let mut values = plan.column(column).map(|value| number_of(value, plan.first.geometry));
    let (_, unit) = values.next()??;
    values.all(|value| value.is_some_and(|(_, other)| other == unit)).then(|| unit.map(str::to_owned))
}

/// A value of a case file for people: a text without its quotes.
fn text_of(value: &str) -> String {
    match value.parse() {
        Ok(toml::Value::String(text)) => text,
        _ => value.trim_matches('"').to_owned(),
    }
}

/// A value of a case file as a number, a quantity in SI with its unit.
fn number_of(value: &str, geometry: Geometry) -> Option<(f64, Option<&'static str>)> {
    let value = value.trim().trim_matches('"');
    match number(value) {
        Some(number) => Some((number, None)),
        None => quantity_si(value, geometry).map(|(number, unit)| (number, Some(unit))),
    }
}
