//! `plot`: fields against time, arrays over their axis at chosen times, matrices as images, arrays over place and time, columns
//! of tables.

pub(super) mod axes;
mod curves;
pub(super) mod cut;
mod frames;
mod map;
mod request;
mod table;

use std::path::PathBuf;

use percuss_picture::{Medium, Panel, draw};
use percuss_table::Heading;

use crate::{
    axis::Axis,
    command::trace::{Outcome, names},
    measured::is_table,
    messages::Recording,
    recording::Limits,
    select::{self, Bound},
};

use axes::{Line, panel, units};
pub(crate) use curves::traces;
use curves::{Lines, sides};
use frames::at_times;
use map::over_time;
pub use request::{Drawn, PlotError, Request};
use table::of_columns;

/// Draws a picture.
///
/// # Errors
///
/// A file cannot be read, or there is nothing in it to draw.
pub fn plot(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
    medium: Medium,
) -> Result<Drawn, PlotError> {
    let title = request.title.clone().unwrap_or_else(|| names(paths).join(", "));
    if let (Some(x), Some(y)) = (&request.x, &request.y) {
        let [path] = paths else { return Err(PlotError::Unfit("draw tables one by one".into())) };
        return of_columns(path, (x, y), request, title, limits, medium);
    }
    let mut request = request.clone();
    request.sources.offset = request.time_offset.map_or(0.0, Bound::number);
    request.sources = request.sources.among(paths.iter()).map_err(PlotError::Unfit)?;
    let request = &request;
    if let Some(table) = paths.iter().find(|path| is_table(path))
        && (paths.iter().all(|path| is_table(path)) || request.map || request.at_times.is_some())
    {
        let text = format!("`{}` is a table; choose its columns with --x and --y", table.display());
        return Err(PlotError::Unfit(text));
    }
    if request.map {
        return over_time(paths, request, limits, medium);
    }
    if let Some(times) = &request.at_times {
        return at_times(paths, request, times, &title, limits, medium);
    }
    if shows_last_frame(paths, request, limits)? {
        if request.window.from.is_some() || request.window.to.is_some() || request.window.every > 1 {
            let text = "--from, --to and --every choose times of curves; choose a frame with --at-time";
            return Err(PlotError::Unfit(text.into()));
        }
        return at_times(paths, request, &[], &title, limits, medium);
    }
    request.check_curves()?;
    let (Lines { time, lines, outcome }, right) = sides(paths, request, limits)?;
    let panels = panels(&time, lines, right, request, title)?;
    let picture = draw(&panels, medium).map_err(PlotError::Draw)?;
    let Outcome { damages, undecoded, left_out, .. } = outcome;
    Ok(Drawn { picture, damages, undecoded, left_out, ..Drawn::default() })
}

/// Largest number of diagrams in a picture.
const MAX_PANELS: usize = 12;

/// A diagram for every unit, one below the other; curves of an axis at the right go into the first.
fn panels(
    time: &Heading,
    lines: Vec<Line>,
    mut right: Vec<Line>,
    request: &Request,
    title: String,
) -> Result<Vec<Panel>, PlotError> {
    let units = units(&lines);
    if units.len() > MAX_PANELS {
        let text = format!("the curves have {} different units; choose fields with --field", units.len());
        return Err(PlotError::Unfit(text));
    }
    let mut groups: Vec<Vec<Line>> = units.iter().map(|_| Vec::new()).collect();
    for line in lines {
        if let Some(i) = units.iter().position(|unit| *unit == line.heading.unit) {
            groups[i].push(line);
        }
    }
    let mut panels: Vec<Panel> =
        groups.into_iter().map(|group| panel(time, group, std::mem::take(&mut right), request)).collect();
    if let Some(first) = panels.first_mut() {
        first.title = title;
    }
    Ok(panels)
}

/// True if what is asked for is a matrix, whole or along lines, without a time: that of the last message is drawn.
fn shows_last_frame(paths: &[PathBuf], request: &Request, limits: Limits) -> Result<bool, PlotError> {
    let Some(path) = paths.iter().find(|path| !is_table(path)).filter(|_| !request.topics.is_empty()) else {
        return Ok(false);
    };
    let recording = Recording::open(path, limits)?;
    let ids = select::channels(&recording, &request.topics)?;
    let [id] = ids.as_slice() else { return Ok(false) };
    let channel = &recording.channels[id];
    let Some(layout) = &channel.layout else { return Ok(false) };
    let is_wanted = |leaf: &usize| {
        let fields = &request.selection.fields;
        fields.is_empty() || fields.contains(&layout.leaves[*leaf].path)
    };
    let axes = (0..layout.leaves.len()).filter(is_wanted).map(|leaf| Axis::of(leaf, layout, channel));
    let matrix = axes.into_iter().find(|axis| axis.is_matrix());
    let at = &request.selection.at;
    let Some(axis) = matrix else { return Ok(false) };
    let lines = at.iter().filter(|at| at.are_lines(&axis)).count();
    if lines > 0 && lines < at.len() {
        let text = "points and lines do not go into one picture: give both coordinates to each --at for curves over \
                    time, or one for lines at one time";
        return Err(PlotError::Unfit(text.into()));
    }
    Ok(if at.is_empty() { paths.len() == 1 } else { lines > 0 })
}
