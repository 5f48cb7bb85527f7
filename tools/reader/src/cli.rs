//! The command line: arguments, and which of them carries out what.

mod animate;
mod cat;
mod chosen;
mod diff;
mod export;
mod info;
mod manual;
mod outcome;
mod output;
mod plot;
mod recover;
mod replay;
mod report;
mod schema;
mod summary;
mod trace;
mod verify;

use std::sync::LazyLock;

use clap::{Parser, Subcommand};

pub use outcome::{CliError, Exit, report};

use crate::recording::Limits;
use animate::AnimateArguments;
use cat::CatArguments;
use diff::DiffArguments;
use export::ExportArguments;
use info::InfoArguments;
use manual::{CompletionsArguments, ManualArguments};
use plot::PlotArguments;
use recover::RecoverArguments;
use replay::ReplayArguments;
use report::ReportArguments;
use schema::SchemaArguments;
use summary::SummaryArguments;
use trace::TraceArguments;
use verify::VerifyArguments;

/// Reads MCAP recordings, protobuf or JSON: tables and pictures of any field, comparison number by number, verification, recovery.
#[derive(Debug, Parser)]
#[command(name = "percuss-read", version, long_version = VERSION.as_str(), about, long_about = None, arg_required_else_help = true, after_help = EXAMPLES)]
pub struct Arguments {
    /// Memory that reading may take, whatever a file claims: 1GiB, 500MB
    #[arg(long, global = true, value_name = "SIZE", default_value = "1GiB", value_parser = memory)]
    max_memory: u64,
    #[command(subcommand)]
    command: Command,
}

/// What is built: the version, and the commit if it is known.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let version = env!("CARGO_PKG_VERSION");
    percuss_output::COMMIT.map_or_else(|| version.to_owned(), |commit| format!("{version}\ncommit {commit}"))
});

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
  percuss-read trace fig5.mcap --topic /interface/stress --at r=0,0.5,0.9 \\
      -o stress.csv
  percuss-read summary fig9-*.mcap  # a row per recording
  percuss-read plot fig5.mcap       # the drag, drawn in the terminal
  percuss-read plot fig5.mcap --topic /interface/stress --at-time 1,2,3 \\
      -o profiles.svg
  percuss-read animate ball.mcap -o ball.gif
  percuss-read diff old.mcap new.mcap --peak-rel 1e-9
  percuss-read verify fig5.mcap
  percuss-read recover damaged.mcap -o recovered.mcap
  percuss-read export fig5.mcap --topic /field/stress --at-time 2.5 \\
      -o field.vti
  percuss-read replay fig5.mcap     # to viewers that connect
  percuss-read report fig5.mcap     # into fig5.html
  percuss-read cat running.mcap.part --topic /drag --follow

Exit status: 0 done, 1 failed, 2 usage, 3 done with loss: a file is damaged or cut off, what is sound is read. diff: \
0 equal within tolerance, 1 different, 2 could not compare. verify: 1 not sound, 3 sound, but the run was not \
finished.";

#[derive(Debug, Subcommand)]
enum Command {
    /// What a recording holds: run, channels, counts, units, times, metadata, attachments
    Info(InfoArguments),
    /// Fields against time: CSV, JSON lines, Parquet, NumPy
    Trace(TraceArguments),
    /// A row per recording: peak force, impulse, contact, rebound, energy left, largest strain
    Summary(SummaryArguments),
    /// Fields against time, arrays over their axis, matrices and arrays over time as images: SVG, PNG, PDF or in the terminal
    Plot(Box<PlotArguments>),
    /// Section, profile and drag as a moving picture: GIF, MP4
    Animate(AnimateArguments),
    /// Two recordings, or folders of them, number by number
    Diff(Box<DiffArguments>),
    /// Whether a recording is sound: checksums, index, schemas, counts
    Verify(VerifyArguments),
    /// A finished recording from one that is damaged or cut off
    Recover(RecoverArguments),
    /// A recording served to viewers in its own time, with play, pause and seek
    Replay(ReplayArguments),
    /// A recording of a run, or a sweep, as one web page, for people without a viewer
    Report(ReportArguments),
    /// Attachments, and fields at one time (NPY, VTK, PNG, SVG)
    Export(ExportArguments),
    /// Whole messages as JSON lines, also of a recording that is still being written
    Cat(CatArguments),
    /// The message types of a recording, as text
    Schema(SchemaArguments),
    /// Completions for a shell
    Completions(CompletionsArguments),
    /// The page of the manual, or those of all commands
    Man(ManualArguments),
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
            Command::Summary(arguments) => arguments.run(limits),
            Command::Plot(arguments) => arguments.run(limits),
            Command::Animate(arguments) => arguments.run(limits),
            Command::Verify(arguments) => arguments.run(limits),
            Command::Recover(arguments) => arguments.run(limits),
            Command::Replay(arguments) => arguments.run(limits),
            Command::Report(arguments) => arguments.run(limits),
            Command::Export(arguments) => arguments.run(limits),
            Command::Cat(arguments) => arguments.run(limits),
            Command::Schema(arguments) => arguments.run(limits),
            Command::Completions(arguments) => arguments.run(),
            Command::Man(arguments) => arguments.run(),
            // status 1 says that recordings differ: whatever fails here is another
            Command::Diff(arguments) => {
                arguments.run(limits).map_err(|error| CliError::NotCompared(Box::new(error)))
            }
        }
    }
}
