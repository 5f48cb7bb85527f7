//! The command line: which verbs there are.

use std::{path::PathBuf, sync::LazyLock};

use clap::{Args, CommandFactory, Parser, Subcommand};
use percuss_output::manual::{Shell, completions, page, write_pages};

use crate::{
    command::{
        animate::Animate, cat::Cat, diff::Diff, export::Export, info::Info, plot::Plot, recover::Recover,
        replay::Replay, report::Report, schema::Schema, summary::Summary, trace::Trace, verify::Verify,
    },
    failure::Failure,
    recording::Limits,
    units::prefer,
    verb::{Exit, Files, Verb, print},
};

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
    const UNITS: [(&str, u64); 8] = [
        ("", 1),
        ("B", 1),
        ("kB", 1_000),
        ("MB", 1_000_000),
        ("GB", 1_000_000_000),
        ("KiB", 1 << 10),
        ("MiB", 1 << 20),
        ("GiB", 1 << 30),
    ];
    let (digits, unit) = text.split_at(text.trim_end_matches(|c: char| c.is_ascii_alphabetic()).len());
    let unit = UNITS.iter().find(|(name, _)| *name == unit);
    match unit.and_then(|(_, unit)| digits.trim().parse::<u64>().ok()?.checked_mul(*unit)) {
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

/// The verbs, each with the files that it reads; what is said of it stands with its arguments.
macro_rules! verbs {
    ($($name:ident($verb:ty $(, $files:ident)?);)*) => {
        #[derive(Debug, Subcommand)]
        enum Command {
            $($name(Box<$verb>),)*
        }

        impl Command {
            fn run(&self, limits: Limits) -> Result<Exit, Failure> {
                match self {
                    $(Self::$name(verb) => {
                        $(verb.$files.note_parts();)?
                        verb.run(limits)
                    })*
                }
            }
        }
    };
}

verbs! {
    Info(Info, file);
    Trace(Trace, files);
    Summary(Summary, files);
    Plot(Plot, files);
    Animate(Animate, file);
    Diff(Diff, files);
    Verify(Verify, files);
    Recover(Recover, file);
    Replay(Replay, file);
    Report(Report, file);
    Export(Export, file);
    Cat(Cat, file);
    Schema(Schema, file);
    Completions(Completions);
    Man(Manual);
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

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  percuss-read completions bash > \\
      ~/.local/share/bash-completion/completions/percuss-read
  percuss-read completions zsh > ~/.zfunc/_percuss-read
  percuss-read completions fish > \\
      ~/.config/fish/completions/percuss-read.fish";

/// Completions for a shell
#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS_EXAMPLES)]
struct Completions {
    /// Shell
    shell: Shell,
}

impl Verb for Completions {
    fn run(&self, _: Limits) -> Result<Exit, Failure> {
        print(&completions(Arguments::command(), self.shell))?;
        Ok(Exit::Done)
    }
}

const MANUAL_EXAMPLES: &str = "\
Examples:
  percuss-read man | man -l -
  percuss-read man -o ~/.local/share/man/man1";

/// The page of the manual, or those of all commands
#[derive(Debug, Args)]
#[command(after_help = MANUAL_EXAMPLES)]
struct Manual {
    /// Folder to write the pages of all commands to, in place of older ones
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

impl Verb for Manual {
    fn run(&self, _: Limits) -> Result<Exit, Failure> {
        match &self.output {
            None => print(&page(Arguments::command()))?,
            Some(folder) => drop(write_pages(Arguments::command(), folder)?),
        }
        Ok(Exit::Done)
    }
}
