//! The command line: which verbs there are.

mod manual;

use std::sync::LazyLock;

use clap::{Parser, Subcommand};

use crate::{
    command::{
        animate::Animate, cat::Cat, diff::Diff, export::Export, info::Info, plot::Plot, recover::Recover,
        replay::Replay, report::Report, schema::Schema, summary::Summary, trace::Trace, verify::Verify,
    },
    failure::Failure,
    recording::Limits,
    units::prefer,
    verb::{Exit, run},
};
use manual::{Completions, Manual};

/// Reads MCAP recordings, protobuf or JSON: tables and pictures of any field, comparison number by number, verification, recovery.
#[derive(Debug, Parser)]
#[command(name = "percuss-read", version, long_version = VERSION.as_str(), long_about = None, arg_required_else_help = true, after_help = EXAMPLES)]
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

/// The verbs; what is said of each stands with its arguments.
macro_rules! verbs {
    ($($name:ident($verb:ty),)*) => {
        #[derive(Debug, Subcommand)]
        enum Command {
            $($name(Box<$verb>),)*
        }

        impl Command {
            fn run(&self, limits: Limits) -> Result<Exit, Failure> {
                match self {
                    $(Self::$name(verb) => run(verb.as_ref(), limits),)*
                }
            }
        }
    };
}

verbs! {
    Info(Info),
    Trace(Trace),
    Summary(Summary),
    Plot(Plot),
    Animate(Animate),
    Diff(Diff),
    Verify(Verify),
    Recover(Recover),
    Replay(Replay),
    Report(Report),
    Export(Export),
    Cat(Cat),
    Schema(Schema),
    Completions(Completions),
    Man(Manual),
}

impl Arguments {
    /// Carries them out.
    ///
    /// # Errors
    ///
    /// What is asked for cannot be had.
    pub fn run(&self) -> Result<Exit, Failure> {
        prefer()?;
        self.command.run(Limits { memory: self.max_memory })
    }
}
