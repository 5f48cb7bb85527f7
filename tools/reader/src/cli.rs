//! The command line: arguments, where output goes, errors and exit status.

mod cat;
mod chosen;
mod diff;
mod export;
mod info;
mod output;
mod plot;
mod recover;
mod replay;
mod report;
mod schema;
mod trace;
mod verify;

use std::{
    io::{self, IsTerminal, Write},
    path::PathBuf,
    process::ExitCode,
};

use clap::{Parser, Subcommand};

use crate::{
    command::{
        cat::CatError, export::ExportError, plot::PlotError, recover::RecoverError, replay::ReplayError,
        report::ReportError, schema::SchemaError, trace::TraceError,
    },
    compare::CompareError,
    field::SelectionError,
    recording::{Damage, Limits, OpenError},
    slice::MomentError,
    text::lines,
};
use cat::CatArguments;
use diff::DiffArguments;
use export::ExportArguments;
use info::InfoArguments;
use plot::PlotArguments;
use recover::RecoverArguments;
use replay::ReplayArguments;
use report::ReportArguments;
use schema::SchemaArguments;
use trace::TraceArguments;
use verify::VerifyArguments;

/// Reads protobuf MCAP recordings: tables and pictures of any field, comparison number by number, verification, recovery.
#[derive(Debug, Parser)]
#[command(name = "percuss-read", version, about, long_about = None, arg_required_else_help = true, after_help = EXAMPLES)]
pub struct Arguments {
    /// Memory that reading may take, whatever a file claims: 1GiB, 500MB
    #[arg(long, global = true, value_name = "SIZE", default_value = "1GiB", value_parser = memory)]
    max_memory: u64,
    #[command(subcommand)]
    command: Command,
}

/// Smallest memory to work with \[bytes\].
const LEAST_MEMORY: u64 = 1 << 20;

/// A number of bytes with an optional unit.
fn memory(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit: u64 = match &text[digits.len()..] {
        "" | "B" => 1,
        "kB" => 1_000,
        "MB" => 1_000_000,
        "GB" => 1_000_000_000,
        "KiB" => 1 << 10,
        "MiB" => 1 << 20,
        "GiB" => 1 << 30,
        _ => return Err("write a size as 500MB, 1GiB or a number of bytes".into()),
    };
    let size = digits.trim().parse::<u64>().ok().and_then(|number| number.checked_mul(unit));
    match size {
        Some(size) if size >= LEAST_MEMORY => Ok(size),
        Some(_) => Err("at least 1MiB is needed".into()),
        None => Err("write a size as 500MB, 1GiB or a number of bytes".into()),
    }
}

const EXAMPLES: &str = "\
Examples:
  percuss-read info fig5.mcap
  percuss-read trace fig5.mcap --topic /interface/stress --at r=0,0.5,0.9 -o stress.csv
  percuss-read plot fig5.mcap                                      the drag, drawn in the terminal
  percuss-read plot fig5.mcap --topic /interface/stress --at-time 1,2,3 -o profiles.svg
  percuss-read diff old.mcap new.mcap --peak-rel 1e-9
  percuss-read verify fig5.mcap
  percuss-read recover damaged.mcap -o recovered.mcap
  percuss-read export fig5.mcap --topic /field/stress --at-time 2.5 -o field.vti
  percuss-read replay fig5.mcap                                    to viewers that connect
  percuss-read report fig5.mcap                                    into fig5.html
  percuss-read cat running.mcap --topic /drag --follow

Exit status: 0 done, 1 failed, 2 usage, 3 done with loss: a file is damaged or cut off, what is sound is read. diff: 0 equal
within tolerance, 1 different, 2 could not compare. verify: 1 not sound, 3 sound, but the run was not finished.";

#[derive(Debug, Subcommand)]
enum Command {
    /// What a recording holds: run, channels, counts, units, times, metadata, attachments
    Info(InfoArguments),
    /// Fields against time: CSV, JSON lines, Parquet, NumPy
    Trace(TraceArguments),
    /// Fields against time, arrays over their axis, matrices as images: SVG, PNG or in the terminal
    Plot(PlotArguments),
    /// Two recordings, or folders of them, number by number
    Diff(Box<DiffArguments>),
    /// Whether a recording is sound: checksums, index, schemas, counts
    Verify(VerifyArguments),
    /// A finished recording from one that is damaged or cut off
    Recover(RecoverArguments),
    /// A recording served to viewers in its own time, with play, pause and seek
    Replay(ReplayArguments),
    /// A recording of a run as one web page, for people without a viewer
    Report(ReportArguments),
    /// Attachments, and fields at one time (NPY, VTK, PNG, SVG)
    Export(ExportArguments),
    /// Whole messages as JSON lines, also of a recording that is still being written
    Cat(CatArguments),
    /// The message types of a recording, as text
    Schema(SchemaArguments),
}

/// How a command has ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done,
    /// Done, and the answer is no: recordings differ, a recording is not sound.
    No,
    /// Done with loss: the file is damaged or cut off.
    Loss,
    /// There is no answer: what was asked for is not in what was read.
    NoAnswer,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Done => Self::SUCCESS,
            Exit::No => Self::from(1),
            Exit::Loss => Self::from(3),
            Exit::NoAnswer => Self::from(2),
        }
    }
}

/// Why a command has failed.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Tracing failed.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// No picture.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// Nothing recovered.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// Nothing replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// No report.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// Nothing exported.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// No messages shown.
    #[error(transparent)]
    Cat(#[from] CatError),
    /// No schema shown.
    #[error(transparent)]
    Schema(#[from] SchemaError),
    /// A comparison could not be made.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Why there is no comparison.
    #[error(transparent)]
    NotCompared(Box<CliError>),
    /// The command line asks for something that does not go together.
    #[error("{0}")]
    Usage(String),
    /// The output exists.
    #[error("`{}` exists; choose another output with -o, or overwrite it with --force", .0.display())]
    Exists(PathBuf),
    /// Output would go where the input is.
    #[error("`{}` is the recording itself; choose another output with -o", .0.display())]
    SameFile(PathBuf),
    /// The output cannot be created or written.
    #[error("cannot write `{}`: {error}", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

impl Arguments {
    /// Carries out the command.
    ///
    /// # Errors
    ///
    /// Why it failed; to be handed to [`report`].
    pub fn run(&self) -> Result<Exit, CliError> {
        let limits = Limits { memory: self.max_memory };
        match &self.command {
            Command::Info(arguments) => arguments.run(limits),
            Command::Trace(arguments) => arguments.run(limits),
            Command::Plot(arguments) => arguments.run(limits),
            Command::Verify(arguments) => arguments.run(limits),
            Command::Recover(arguments) => arguments.run(limits),
            Command::Replay(arguments) => arguments.run(limits),
            Command::Report(arguments) => arguments.run(limits),
            Command::Export(arguments) => arguments.run(limits),
            Command::Cat(arguments) => arguments.run(limits),
            Command::Schema(arguments) => arguments.run(limits),
            // status 1 says that recordings differ: whatever fails here is another
            Command::Diff(arguments) => {
                arguments.run(limits).map_err(|error| CliError::NotCompared(Box::new(error)))
            }
        }
    }
}

/// Prints an error to stderr and returns its exit status.
pub fn report(error: &CliError) -> ExitCode {
    say(&format!("error: {error}"));
    let misfit = |error: &TraceError| {
        matches!(
            error,
            TraceError::UnknownTopic(_)
                | TraceError::Selection(_)
                | TraceError::Columns { .. }
                | TraceError::TimeUnits { .. }
        )
    };
    let status = match error {
        CliError::Trace(error) | CliError::Plot(PlotError::Trace(error)) if misfit(error) => 2,
        CliError::Plot(
            PlotError::Nothing(_) | PlotError::Unfit(_) | PlotError::Moment(MomentError::Outside { .. }),
        )
        | CliError::Export(
            ExportError::UnknownTopic(_)
            | ExportError::NoAttachment { .. }
            | ExportError::NoMatrix(_)
            | ExportError::Several { .. }
            | ExportError::Moment(MomentError::Outside { .. }),
        )
        | CliError::Cat(CatError::UnknownTopic(_))
        | CliError::Schema(SchemaError::UnknownTopic(_))
        | CliError::Replay(ReplayError::Empty { .. })
        | CliError::Report(ReportError::NotPercuss(_))
        | CliError::SameFile(_)
        | CliError::Usage(_)
        | CliError::NotCompared(_) => 2,
        _ => 1,
    };
    ExitCode::from(status)
}

/// Says which fields of whole topics are left out.
fn say_left_out(left_out: &[SelectionError]) {
    for error in left_out {
        say(&format!("note: left out: {error}"));
    }
}

fn say(text: &str) {
    // if even stderr is gone there is nobody left to tell
    drop(writeln!(io::stderr(), "{}", lines(text)));
}

/// True if standard output is a terminal that wants colours.
fn has_colour() -> bool {
    let unwanted = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !unwanted
}

fn loss(damages: &[(PathBuf, Damage)]) -> Exit {
    for (path, damage) in damages {
        let Damage { offset, bytes, reason } = damage;
        say(&format!("warning: `{}`: {reason} (at byte {offset}, {bytes} bytes lost)", path.display()));
    }
    if damages.is_empty() { Exit::Done } else { Exit::Loss }
}
