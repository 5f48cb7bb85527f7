//! Arguments of `plot`.

use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
};

use clap::Args;
use percuss_output::OutputError;
use percuss_picture::Medium;

use super::{
    chosen::Chosen,
    outcome::{CliError, Exit, has_colour, losses, say, say_left_out, say_parts},
    output::{by_extension, refuse_inputs, write},
};
use crate::{
    command::plot::{Request, plot},
    recording::Limits,
};

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

#[derive(Debug, Args)]
#[command(after_help = PLOT_EXAMPLES)]
pub(super) struct PlotArguments {
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
    /// Output file, .svg, .pdf or .png [default: text on standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing output file
    #[arg(long)]
    force: bool,
}

/// What a file of this name is drawn as.
pub(super) fn medium(output: &Path) -> Result<Medium, CliError> {
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

impl PlotArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(&self.files);
        refuse_inputs(self.output.as_deref(), self.files.iter())?;
        let medium = self.output.as_deref().map_or(Ok(terminal()), medium)?;
        OutputError::refuse_existing(self.output.as_deref(), self.force)?;
        let log = self.log.as_deref().unwrap_or_default();
        let request = Request {
            topics: self.chosen.topics.clone(),
            selection: self.chosen.selection(),
            log: (log.contains('x'), log.contains('y')),
            ..self.request.clone()
        };
        let drawn = plot(&self.files, &request, limits, medium)?;
        write(self.output.as_deref(), self.force, &drawn.picture)?;
        say_left_out(&drawn.left_out);
        if let Some(remark) = &drawn.remark {
            say(remark);
        }
        if drawn.lacking > 0 {
            say(&format!("note: left out: {} rows without a number in both columns", drawn.lacking));
        }
        let exit = losses(&drawn.damages);
        if drawn.undecoded > 0 {
            say(&format!("warning: {} messages do not fit their schema and are left out", drawn.undecoded));
            return Ok(Exit::Loss);
        }
        Ok(exit)
    }
}
