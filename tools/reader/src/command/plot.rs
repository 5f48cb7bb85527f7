//! `plot`: fields against time, arrays over their axis at chosen times, matrices as images, arrays over place and time, columns
//! of tables.

pub(super) mod axes;
mod curves;
pub(super) mod cut;
mod frames;
mod map;
mod request;
mod table;

use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
};

use axes::{Line, panel, units};
use clap::Args;
use curves::{Lines, sides};
use frames::at_times;
use map::over_time;
use percuss_picture::{Medium, Panel, draw};
use percuss_table::Heading;
use table::of_columns;

use crate::{
    axis::Axis,
    command::trace::{Outcome, names},
    failure::Failure,
    measured::is_table,
    messages::Recording,
    recording::Limits,
    select::{self, Bound},
    verb::{Chosen, Exit, Verb, Write, by_extension, has_colour, losses, say, say_left_out},
};

pub(crate) use curves::traces;
pub use request::{Drawn, Request};

const PLOT_EXAMPLES: &str = "\
Examples:
  # the drag, drawn in the terminal
  percuss-read plot fig5.mcap
  percuss-read plot fig5.mcap --topic /interface/stress --at r=0,0.5,0.9 \\
      -o stress.svg
  percuss-read plot fig5.mcap --topic /interface/stress --at-time 1,2,3 \\
      -o profiles.png
  percuss-read plot fig5.mcap --topic /field/stress --at-time 2.5 \\
      --range 0,3 -o field.png
  # two axes
  percuss-read plot fig5.mcap --right contact_radius \\
      --right /velocity.displacement -o drag.pdf
  # a diagram for each unit
  percuss-read plot fig5.mcap --topic /drag,/velocity --field force,velocity \\
      -o both.pdf
  # lines over r
  percuss-read plot fig4.mcap --topic /field/stress --at z=0.05,0.1 \\
      --at-time 1 -o rows.svg
  # over z, last frame
  percuss-read plot fig4.mcap --topic /field/stress --at r=0 -o axis.svg
  # a point over time
  percuss-read plot fig4.mcap --topic /field/stress --at r=0,z=0.1 \\
      -o point.svg
  percuss-read plot fig5.mcap --map -o r-t.png  # stress over r and time
  # over z and time
  percuss-read plot fig5.mcap --map --topic /field/stress --at r=0 \\
      --range=-3,3 -o z-t.png
  # in chosen units
  percuss-read plot ball.mcap --unit force=N --unit time=ms -o drag.svg
  percuss-read plot old.mcap new.mcap --topic /velocity --log y \\
      -o velocity.svg
  # with what was measured
  percuss-read plot ball.mcap measured.csv --rename load=force -o both.svg
  # a table, of percuss study
  percuss-read plot order.csv --x cells --y relative_error --by quantity \\
      --log xy
  # of a sweep
  percuss-read plot sweep/summary.parquet --x indenter.mass --y peak_force \\
      --by target.thickness -o force.svg

Without --field, a topic shows the fields that have the unit of its first. Quantities in SI units are drawn with the \
prefix that fits (µs, kN, MPa). --at, --at-time, --from and --to are in the unit that is recorded unless they have \
one, --at-time 87us; --range and --x-range are numbers in the unit of the recording.";

/// Fields against time, arrays over their axis, matrices and arrays over time as images: SVG, PNG, PDF or in the terminal
#[derive(Debug, Args)]
#[command(after_help = PLOT_EXAMPLES)]
#[command(mut_arg("output", |output| output.help("Output file, .svg, .pdf or .png [default: text on standard output]")))]
pub struct Plot {
    /// Recordings, drawn over each other, and tables beside them; or one table
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    chosen: Chosen,
    #[command(flatten)]
    request: Request,
    /// Logarithmic axes: x, y or xy
    #[arg(long, value_name = "AXES", value_parser = ["x", "y", "xy"])]
    log: Option<String>,
    #[command(flatten)]
    write: Write,
}

/// What a file of this name is drawn as.
pub(super) fn medium(output: &Path) -> Result<Medium, Failure> {
    by_extension(output, &Medium::FILES, None)
}

/// What is drawn on standard output.
fn terminal() -> Medium {
    const COLUMNS: usize = 100;
    const ROWS: usize = 30;
    let (columns, rows) = match terminal_size::terminal_size() {
        Some((width, height)) if io::stdout().is_terminal() => {
            (usize::from(width.0).max(40), usize::from(height.0).saturating_sub(2).max(12))
        }
        _ => (COLUMNS, ROWS),
    };
    Medium::Terminal { columns, rows, colour: has_colour() }
}

impl Verb for Plot {
    fn files(&self) -> &[PathBuf] {
        &self.files
    }

    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        self.write.refuse_inputs(&self.files)?;
        let medium = self.write.path().map_or(Ok(terminal()), medium)?;
        self.write.refuse_existing()?;
        let log = self.log.as_deref().unwrap_or_default();
        let request = Request {
            topics: self.chosen.topics.clone(),
            selection: self.chosen.selection(),
            log: (log.contains('x'), log.contains('y')),
            ..self.request.clone()
        };
        let drawn = plot(&self.files, &request, limits, medium)?;
        self.write.whole(&drawn.picture)?;
        say_left_out(&drawn.left_out);
        if let Some(remark) = &drawn.remark {
            say(remark);
        }
        if drawn.lacking > 0 {
            say(&format!("note: left out: {} rows without a number in both columns", drawn.lacking));
        }
        Ok(losses(&drawn.damages, drawn.undecoded))
    }
}

/// Draws a picture.
///
/// # Errors
///
/// A file cannot be read, or there is nothing in it to draw.
pub fn plot(paths: &[PathBuf], request: &Request, limits: Limits, medium: Medium) -> Result<Drawn, Failure> {
    let title = request.title.clone().unwrap_or_else(|| names(paths).join(", "));
    if let (Some(x), Some(y)) = (&request.x, &request.y) {
        let [path] = paths else { return Err(Failure::Usage("draw tables one by one".into())) };
        return of_columns(path, (x, y), request, title, limits, medium);
    }
    let mut request = request.clone();
    request.sources.offset = request.time_offset.map_or(0.0, Bound::number);
    request.sources = request.sources.among(paths.iter()).map_err(Failure::Usage)?;
    let request = &request;
    if let Some(table) = paths.iter().find(|path| is_table(path))
        && (paths.iter().all(|path| is_table(path)) || request.map || request.at_times.is_some())
    {
        let text = format!("`{}` is a table; choose its columns with --x and --y", table.display());
        return Err(Failure::Usage(text));
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
            return Err(Failure::Usage(text.into()));
        }
        return at_times(paths, request, &[], &title, limits, medium);
    }
    request.check_curves()?;
    let (Lines { time, lines, outcome }, right) = sides(paths, request, limits)?;
    let panels = panels(&time, lines, right, request, title)?;
    let picture = draw(&panels, medium).map_err(Failure::drawing)?;
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
) -> Result<Vec<Panel>, Failure> {
    let units = units(&lines);
    if units.len() > MAX_PANELS {
        let text = format!("the curves have {} different units; choose fields with --field", units.len());
        return Err(Failure::Usage(text));
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
fn shows_last_frame(paths: &[PathBuf], request: &Request, limits: Limits) -> Result<bool, Failure> {
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
        return Err(Failure::Usage(text.into()));
    }
    Ok(if at.is_empty() { paths.len() == 1 } else { lines > 0 })
}
