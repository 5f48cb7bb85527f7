//! `plot`: fields against time, arrays over their axis at chosen times, matrices as images, arrays over place and time, columns
//! of tables.

mod axes;
mod curves;
mod frames;
mod map;

use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
};

use axes::{Line, panel};
use clap::Args;
use curves::{Lines, of_columns, sides};
use frames::at_times;
use indexmap::IndexMap;
use map::over_time;
use percuss_picture::{Medium, Panel, draw};
use percuss_table::Heading;

use crate::{
    axis::Axis,
    command::trace::names,
    convention,
    failure::Failure,
    field::Selection,
    measured::{Sources, is_table},
    messages::Recording,
    recording::Limits,
    select::{self, Bound, Pattern, Window, finite_time},
    units::Units,
    verb::{Chosen, Exit, Losses, Verb, Write, by_extension, has_colour, say},
};

pub(crate) use curves::traces;

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
    pub(crate) files: Vec<PathBuf>,
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

/// What to draw.
#[derive(Args, Clone, Debug, Default)]
pub struct Request {
    /// Topics; if none, that of [`select::channels_or_default`](crate::select::channels_or_default).
    #[arg(skip)]
    pub topics: Vec<Pattern>,
    /// Fields and positions.
    #[arg(skip)]
    pub selection: Selection,
    /// Fields on an axis at the right, of the chosen topics or of another: FIELD or TOPIC.FIELD; may be repeated
    #[arg(long, value_name = "FIELD")]
    #[arg(conflicts_with_all = ["at_times", "map"])]
    pub right: Vec<String>,
    /// An array over its axis and over time, as an image; a matrix along a line, --at r=0 or --at z=0.5. Nearest-neighbour
    /// in both; missing elements are 0
    #[arg(long, conflicts_with_all = ["at_times", "every"])]
    pub map: bool,
    /// Times: arrays over their axis, or a matrix as an image, at the nearest messages; in the unit that is recorded or with one,
    /// 87us, whatever prefix the picture has
    #[arg(long = "at-time", value_name = "T", value_delimiter = ',', allow_negative_numbers = true, value_parser = finite_time)]
    #[arg(conflicts_with_all = ["from", "to", "every"])]
    pub at_times: Option<Vec<Bound>>,
    /// Times, and every n-th row.
    #[command(flatten)]
    pub window: Window,
    /// Log times as seconds since 1970 instead of from the start of the recording
    #[arg(long)]
    pub epoch: bool,
    /// Draw columns of a table (CSV, JSON lines, Parquet, .npz): the one along the horizontal axis; a column is named without its
    /// unit
    #[arg(long, value_name = "KEY", requires = "y")]
    #[arg(conflicts_with_all = ["topics", "fields", "at", "right", "map", "at_times", "from", "to", "every", "epoch"])]
    pub x: Option<String>,
    /// The column along the vertical axis
    #[arg(long, value_name = "KEY", requires = "x")]
    pub y: Option<String>,
    /// A column whose every value has a curve of its own, drawn from the least to the greatest of --x
    #[arg(long, value_name = "KEY", requires = "x")]
    pub by: Option<String>,
    /// Tables beside recordings.
    #[command(flatten)]
    pub sources: Sources,
    /// Time that is added to those of tables beside recordings, in the unit of the recording or with one, 5us
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = finite_time)]
    pub time_offset: Option<Bound>,
    /// Units that are chosen.
    #[command(flatten)]
    pub units: Units,
    /// Logarithmic axes, horizontal and vertical.
    #[arg(skip)]
    pub log: (bool, bool),
    /// Ends of the vertical axis, or of the colours of an image, in the unit of the recording: LOW,HIGH
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub range: Option<(f64, f64)>,
    /// Ends of the horizontal axis, in the unit of the recording: LOW,HIGH [default of the image of a matrix: where it can be seen]
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub x_range: Option<(f64, f64)>,
    /// Ends of the vertical axis of an image, in the unit of the recording: LOW,HIGH
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    pub y_range: Option<(f64, f64)>,
    /// Title [default: the names of the files]
    #[arg(long)]
    pub title: Option<String>,
}

impl Request {
    /// A recording, and the topics whose arrays are drawn: the stress of the interface if none are named.
    fn open_arrays(&self, path: &Path, limits: Limits) -> Result<(Recording, Vec<u16>), Failure> {
        let mut recording = Recording::open(path, limits)?;
        if self.epoch {
            recording.count_from(0);
        }
        let default = [convention::INTERFACE.parse().expect("a plain topic")];
        let topics = if self.topics.is_empty() { &default[..] } else { &self.topics };
        let ids = select::channels(&recording, topics)?;
        Ok((recording, ids))
    }

    /// Refuses what only images have.
    fn check_curves(&self) -> Result<(), Failure> {
        match self.y_range {
            Some(_) => {
                Err(Failure::Usage("--y-range is for images; --range is the vertical axis of curves".into()))
            }
            None => Ok(()),
        }
    }
}

/// Two numbers, the lower first.
fn range(text: &str) -> Result<(f64, f64), String> {
    let numbers = text.split_once(',').and_then(|(low, high)| {
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        Some((number(low)?, number(high)?))
    });
    numbers
        .filter(|(low, high)| low < high)
        .ok_or_else(|| "write a range as LOW,HIGH, the lower end first".into())
}

#[derive(Default)]
pub struct Drawn {
    pub picture: Vec<u8>,
    /// What of its files could not be read.
    pub losses: Losses,
    pub notes: Vec<String>,
}

/// What a file of this name is drawn as.
pub(super) fn medium(output: &Path) -> Result<Medium, Failure> {
    by_extension(output, &Medium::FILES, None)
}

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
        drawn.notes.iter().for_each(|note| say(note));
        Ok(drawn.losses.report())
    }
}

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
    let notes = outcome.left_out.iter().map(|error| format!("note: left out: {error}")).collect();
    Ok(Drawn { picture, losses: outcome.losses, notes })
}

const MAX_PANELS: usize = 12;

/// A diagram for every unit, one below the other; curves of an axis at the right go into the first.
fn panels(
    time: &Heading,
    lines: Vec<Line>,
    mut right: Vec<Line>,
    request: &Request,
    title: String,
) -> Result<Vec<Panel>, Failure> {
    let mut groups = IndexMap::<Option<String>, Vec<Line>>::new();
    for line in lines {
        groups.entry(line.heading.unit.clone()).or_default().push(line);
    }
    if groups.len() > MAX_PANELS {
        let text = format!("the curves have {} different units; choose fields with --field", groups.len());
        return Err(Failure::Usage(text));
    }
    let groups = groups.into_values();
    let mut panels: Vec<Panel> =
        groups.map(|group| panel(time, group, std::mem::take(&mut right), request)).collect();
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
