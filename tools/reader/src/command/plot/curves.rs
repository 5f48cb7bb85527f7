//! Curves: fields against time, and columns of a table over each other.

use std::{
    io,
    path::{Path, PathBuf},
};

use percuss_picture::{Curve, Medium, Panel, draw};
use percuss_table::{Cell, Heading, Sink};

use super::{
    Drawn, Request,
    axes::{Line, keep_first_units, panel},
};
use crate::{
    command::{
        trace::{Outcome, Request as Traced, trace},
        view::common_label,
    },
    convention,
    failure::Failure,
    field::{Selection, place_and_field},
    recording::{Budget, Limits},
    tabular,
};

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
}

/// Curves over an axis, and how reading them went.
pub(super) struct Lines {
    pub(super) time: Heading,
    pub(super) lines: Vec<Line>,
    pub(super) outcome: Outcome,
}

/// Fields against time, without those that only count, in the units of the recording.
pub(crate) fn traces(paths: &[PathBuf], request: &Request, limits: Limits) -> Result<Panel, Failure> {
    let Lines { time, lines, .. } = lines(paths, request, limits)?;
    let (curves, headings): (Vec<Curve>, Vec<Heading>) =
        lines.into_iter().map(|line| (line.curve, line.heading)).unzip();
    Ok(Panel { x_label: time.with_unit(), y_label: common_label(&headings), curves, ..Panel::default() })
}

/// Fields against time, without those that only count.
fn lines(paths: &[PathBuf], request: &Request, limits: Limits) -> Result<Lines, Failure> {
    let traced = Traced {
        topics: request.topics.clone(),
        selection: Selection { for_curves: true, ..request.selection.clone() },
        window: request.window,
        epoch: request.epoch,
        sources: request.sources.clone(),
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
    let time = table.headings.first().cloned().unwrap_or_default();
    let named = table.curves.into_iter().zip(table.headings.into_iter().skip(1));
    let lines: Vec<Line> = named
        .filter(|(curve, heading)| !is_counter(heading) && !curve.points.is_empty())
        .map(|(curve, heading)| Line { curve, heading })
        .collect();
    if lines.is_empty() {
        let left_out: Vec<String> = outcome.left_out.iter().map(|error| format!("; {error}")).collect();
        let text = format!("no field of these topics holds numbers in this time{}", left_out.concat());
        return Err(Failure::nothing(text));
    }
    Ok(Lines { time, lines, outcome })
}

/// The curves of a picture: those of the axis at the left, of one unit per topic unless fields are named, and those of the
/// axis at the right.
pub(super) fn sides(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
) -> Result<(Lines, Vec<Line>), Failure> {
    let mut left = lines(paths, request, limits)?;
    let mut right = Vec::new();
    for name in &request.right {
        let found = on_the_right(paths, name, request, limits)?;
        if let (Some(left), Some(right)) = (&left.time.unit, &found.time.unit)
            && left != right
        {
            let text = format!("times are in {left}, those of `{name}` in {right}; draw them one by one");
            return Err(Failure::Usage(text));
        }
        let (losses, others) = (&mut left.outcome.losses, found.outcome.losses);
        losses.damages.extend(others.damages);
        losses.damages.dedup();
        losses.undecoded += others.undecoded;
        right.extend(found.lines);
    }
    if request.selection.fields.is_empty() {
        // what is at the right is not at the left too
        left.lines
            .retain(|line| !request.right.iter().any(|name| name == place_and_field(&line.heading.name).1));
        keep_first_units(&mut left.lines);
    }
    if left.lines.is_empty() {
        let text = "no curve is left for the axis at the left; name one with --field";
        return Err(Failure::Usage(text.into()));
    }
    if right.iter().any(|line| line.heading.unit != right[0].heading.unit) {
        let text = "the fields on the axis at the right have different units; choose those of one unit";
        return Err(Failure::Usage(text.into()));
    }
    Ok((left, right))
}

/// A field of the chosen topics, or `topic.field`, for the axis at the right.
fn on_the_right(paths: &[PathBuf], name: &str, request: &Request, limits: Limits) -> Result<Lines, Failure> {
    let mut topics = request.topics.clone();
    let mut field = name;
    if let Some(path) = paths.first() {
        let recording = request.sources.open(path, limits)?;
        let topic =
            |topic: &'_ String| Some((topic.clone(), name.strip_prefix(topic.as_str())?.strip_prefix('.')?));
        let found = recording.channels.values().filter_map(|channel| topic(&channel.topic));
        if let Some((topic, rest)) = found.max_by_key(|(topic, _)| topic.len()) {
            topics = vec![topic.parse().map_err(Failure::nothing)?];
            field = rest;
        }
    }
    let selection = Selection { fields: vec![field.to_owned()], ..Selection::default() };
    lines(paths, &Request { topics, selection, ..request.clone() }, limits)
}

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
    let panel = Panel { title, ..panel(&table.headings[0], lines, Vec::new(), request) };
    let picture = draw(&[panel], medium).map_err(Failure::drawing)?;
    let note = format!("note: left out: {lacking} rows without a number in both columns");
    let notes = Some(note).filter(|_| lacking > 0).into_iter().collect();
    Ok(Drawn { picture, notes, ..Drawn::default() })
}

/// Name of the curve of a value: a number says what it is of.
fn name(heading: &Heading, value: &Cell) -> String {
    match (value.number(), &heading.unit) {
        (None, _) => value.to_string(),
        (_, None) => format!("{} = {value}", heading.name),
        (_, Some(unit)) => format!("{} = {value} {unit}", heading.name),
    }
}
