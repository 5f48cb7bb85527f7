//! Fields against time, as curves.

use std::{io, path::PathBuf};

use percuss_picture::{Curve, Panel};
use percuss_table::{Cell, Heading, Sink};

use super::{
    axes::{Line, keep_first_units, units},
    request::Request,
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
    Ok(Panel {
        x_label: time.with_unit(),
        y_label: common_label(&headings),
        curves,
        log_x: request.log.0,
        log_y: request.log.1,
        x_range: request.x_range,
        y_range: request.range,
        ..Panel::default()
    })
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
        left.outcome.damages.extend(found.outcome.damages);
        left.outcome.damages.dedup();
        left.outcome.undecoded += found.outcome.undecoded;
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
    if units(&right).len() > 1 {
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
