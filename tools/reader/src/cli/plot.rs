//! Arguments of `plot`.

use std::{
    io::{self, IsTerminal},
    path::{Path, PathBuf},
};

use clap::Args;

use super::{
    chosen::{Chosen, finite_time},
    outcome::{CliError, Exit, has_colour, losses, say, say_left_out},
    output::{by_extension, refuse_inputs, write},
};
use percuss_picture::Medium;

use crate::{
    command::plot::{Request, plot},
    recording::Limits,
    select::Window,
};

const PLOT_EXAMPLES: &str = "\
Examples:
  percuss-read plot fig5.mcap                                      the drag, drawn in the terminal
  percuss-read plot fig5.mcap --topic /interface/stress --at r=0,0.5,0.9 -o stress.svg
  percuss-read plot fig5.mcap --topic /interface/stress --at-time 1,2,3 -o profiles.png
  percuss-read plot fig5.mcap --topic /field/stress --at-time 2.5 --range 0,3 -o field.png
  percuss-read plot fig4.mcap --topic /field/stress --at z=0.05,0.1 --at-time 1 -o rows.svg      lines over r
  percuss-read plot fig4.mcap --topic /field/stress --at r=0,z=0.1 -o point.svg                  a point over time
  percuss-read plot old.mcap new.mcap --topic /velocity --log y -o velocity.svg";

#[derive(Debug, Args)]
#[command(after_help = PLOT_EXAMPLES)]
pub(super) struct PlotArguments {
    /// Recordings, drawn over each other
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    chosen: Chosen,
    /// Times: arrays over their axis, or a matrix as an image, at the nearest messages
    #[arg(long, value_name = "T", value_delimiter = ',', allow_negative_numbers = true, value_parser = finite_time)]
    #[arg(conflicts_with_all = ["from", "to", "every"])]
    at_time: Option<Vec<f64>>,
    #[command(flatten)]
    window: Window,
    /// Logarithmic axes: x, y or xy
    #[arg(long, value_name = "AXES", value_parser = ["x", "y", "xy"])]
    log: Option<String>,
    /// Ends of the vertical axis, or of the colours of an image: LOW,HIGH
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    range: Option<(f64, f64)>,
    /// Ends of the horizontal axis: LOW,HIGH
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    x_range: Option<(f64, f64)>,
    /// Title [default: the names of the files]
    #[arg(long)]
    title: Option<String>,
    /// Output file, .svg or .png [default: text on standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing output file
    #[arg(long)]
    force: bool,
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

/// What a file of this name is drawn as.
pub(super) fn medium(output: &Path) -> Result<Medium, CliError> {
    by_extension(output, &[("svg", Medium::Svg), ("png", Medium::Png)], None)
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
        refuse_inputs(self.output.as_deref(), self.files.iter())?;
        let medium = self.output.as_deref().map_or(Ok(terminal()), medium)?;
        if let Some(output) = self.output.as_ref().filter(|output| output.exists() && !self.force) {
            return Err(CliError::Exists(output.clone()));
        }
        let log = self.log.as_deref().unwrap_or_default();
        let request = Request {
            topics: self.chosen.topics.clone(),
            selection: self.chosen.selection(),
            at_times: self.at_time.clone(),
            window: self.window,
            log: (log.contains('x'), log.contains('y')),
            x_range: self.x_range,
            range: self.range,
            title: self.title.clone(),
        };
        let drawn = plot(&self.files, &request, limits, medium)?;
        write(self.output.as_deref(), self.force, &drawn.picture)?;
        say_left_out(&drawn.left_out);
        let exit = losses(&drawn.damages);
        if drawn.undecoded > 0 {
            say(&format!("warning: {} messages do not fit their schema and are left out", drawn.undecoded));
            return Ok(Exit::Loss);
        }
        Ok(exit)
    }
}
