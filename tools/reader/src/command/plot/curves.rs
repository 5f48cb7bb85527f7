//! Fields against time, as curves.

use std::{collections::BTreeSet, io, path::PathBuf};

use percuss_picture::{Curve, Panel};

use super::request::{PlotError, Request};
use crate::{
    command::trace::{Outcome, Request as Traced, trace},
    convention,
    field::Selection,
    recording::{Budget, Limits},
    table::{Cell, Heading, Sink},
};

/// Takes a table as curves.
struct Curves {
    headings: Vec<Heading>,
    curves: Vec<Curve>,
    budget: Budget,
}

impl Sink for Curves {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.headings = headings.to_vec();
        let curve = |heading: &Heading| Curve { name: heading.name.clone(), ..Curve::default() };
        self.curves = headings.iter().skip(1).map(curve).collect();
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        let Some((time, cells)) = cells.split_first() else { return Ok(()) };
        let time = time.number().unwrap_or(f64::NAN);
        for (curve, cell) in self.curves.iter_mut().zip(cells) {
            // an empty cell is a message of another topic, not a gap
            if let Some(number) = cell.number() {
                // a list grows to twice its length
                if !self.budget.spend(2 * size_of::<(f64, f64)>()) {
                    return Err(io::Error::new(
                        io::ErrorKind::OutOfMemory,
                        "the curves have more points than --max-memory allows; choose fields or times, or draw every n-th \
                         point (--every)",
                    ));
                }
                curve.points.push((time, number));
            }
        }
        Ok(())
    }

    fn end(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Fields against time, without those that only count.
pub(crate) fn traces(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
) -> Result<(Panel, Outcome), PlotError> {
    let traced = Traced {
        topics: request.topics.clone(),
        selection: Selection { for_curves: true, ..request.selection.clone() },
        window: request.window,
        epoch: request.epoch,
        ..Traced::default()
    };
    let budget = Budget::new(limits.kept());
    let mut table = Curves { headings: Vec::new(), curves: Vec::new(), budget };
    let outcome = trace(paths, &traced, limits, &mut table)?;
    let all_chosen = request.selection.fields.is_empty();
    let is_counter = |heading: &Heading| {
        let name = heading.name.rsplit([':', '.']).next().unwrap_or_default();
        all_chosen && matches!(name, convention::STEP | "log_time")
    };
    let (mut curves, mut headings) = (Vec::new(), Vec::new());
    for (curve, heading) in table.curves.into_iter().zip(&table.headings[1.min(table.headings.len())..]) {
        if !is_counter(heading) && !curve.points.is_empty() {
            curves.push(curve);
            headings.push(heading.clone());
        }
    }
    if curves.is_empty() {
        let left_out: Vec<String> = outcome.left_out.iter().map(|error| format!("; {error}")).collect();
        let text = format!("no field of these topics holds numbers in this time{}", left_out.concat());
        return Err(PlotError::Nothing(text));
    }
    let panel = Panel {
        x_label: table.headings.first().map_or_else(String::new, Heading::with_unit),
        y_label: common_label(&headings),
        curves,
        log_x: request.log.0,
        log_y: request.log.1,
        x_range: request.x_range,
        y_range: request.range,
        ..Panel::default()
    };
    Ok((panel, outcome))
}

/// Name and unit that all columns share, as far as they do.
pub(super) fn common_label(headings: &[Heading]) -> String {
    let base = |heading: &Heading| {
        let name = heading.name.rsplit(':').next().unwrap_or_default().to_owned();
        let name = name.split(['@', '[']).next().unwrap_or_default().to_owned();
        name.rsplit(['/', '.']).next().unwrap_or_default().to_owned()
    };
    let names: BTreeSet<String> = headings.iter().map(base).collect();
    let units: BTreeSet<Option<&String>> = headings.iter().map(|heading| heading.unit.as_ref()).collect();
    let name =
        if names.len() <= 3 { names.into_iter().collect::<Vec<_>>().join(", ") } else { "value".into() };
    let units: Vec<&str> = units.into_iter().map(|unit| unit.map_or("1", String::as_str)).collect();
    match units.as_slice() {
        ["1"] => name,
        units => format!("{name} [{}]", units.join(", ")),
    }
}
