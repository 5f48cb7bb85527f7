//! The command line: arguments, where output goes, errors and exit status.

use std::{
    fs::{File, OpenOptions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::{
    command::{
        info::info,
        trace::{Request, TraceError, trace},
    },
    field::{Positions, Selection},
    format::{csv::Csv, json_lines::JsonLines},
    recording::{Damage, OpenError},
};

/// Reads protobuf MCAP recordings: what is in them, and any field against time.
#[derive(Debug, Parser)]
#[command(name = "percuss-read", version, about, long_about = None, arg_required_else_help = true, after_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  percuss-read info fig5.mcap
  percuss-read trace fig5.mcap                                     the drag, as CSV
  percuss-read trace fig5.mcap --topic /interface/stress --at r=0,0.5,0.9 -o stress.csv
  percuss-read trace fig5.mcap --topic /velocity --from 1 --to 2 --format jsonl

Exit status: 0 done, 1 failed, 2 usage, 3 done with loss: the file is damaged or cut off, what comes before is read.";

#[derive(Debug, Subcommand)]
enum Command {
    /// What a recording holds: run, channels, counts, units, times, metadata, attachments
    Info(InfoArguments),
    /// Fields of a topic against time, as CSV or JSON lines
    Trace(TraceArguments),
}

#[derive(Debug, Args)]
struct InfoArguments {
    /// Recording
    file: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const TRACE_EXAMPLES: &str = "\
Examples:
  percuss-read trace fig5.mcap --from 1.9 --to 2.1                 the drag around the first reflection
  percuss-read trace fig5.mcap --topic /probes --every 10 -o probes.csv
  percuss-read trace fig5.mcap --topic /interface/stress --at r=0,0.5,0.9 --format jsonl
  percuss-read trace fig5.mcap --topic /energy --field kinetic,strain,residual";

#[derive(Debug, Args)]
#[command(after_help = TRACE_EXAMPLES)]
struct TraceArguments {
    /// Recording
    file: PathBuf,
    /// Topic [default: /drag]
    #[arg(long)]
    topic: Option<String>,
    /// Fields, separated by commas; name[3] is one element of an array [default: all]
    #[arg(long = "field", value_name = "NAME", value_delimiter = ',')]
    fields: Vec<String>,
    /// Positions on the axis of arrays, for example r=0,0.5,0.9; linear interpolation
    #[arg(long, value_name = "R=LIST")]
    at: Option<Positions>,
    /// First time, in the unit of the time column
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Last time, in the unit of the time column
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Every n-th message of that time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// Output format [default: by the name of the output, else csv]
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Output file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing output file
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Comma-separated values, names and units in the first line
    Csv,
    /// One JSON object per line
    Jsonl,
}

/// How a command has ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done,
    /// Done with loss: the file is damaged or cut off.
    Loss,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Done => Self::SUCCESS,
            Exit::Loss => Self::from(3),
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
        match &self.command {
            Command::Info(arguments) => arguments.run(),
            Command::Trace(arguments) => arguments.run(),
        }
    }
}

/// Prints an error to stderr and returns its exit status.
pub fn report(error: &CliError) -> ExitCode {
    say(&format!("error: {error}"));
    let status = match error {
        CliError::Trace(TraceError::UnknownTopic { .. } | TraceError::Selection(_))
        | CliError::SameFile(_) => 2,
        _ => 1,
    };
    ExitCode::from(status)
}

fn say(text: &str) {
    // if even stderr is gone there is nobody left to tell
    drop(writeln!(io::stderr(), "{text}"));
}

/// A reader of our output that has had enough is no error.
fn forgive_broken_pipe(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

fn loss(path: &Path, damage: Option<&Damage>) -> Exit {
    let Some(damage) = damage else { return Exit::Done };
    let reason = &damage.reason;
    say(&format!(
        "warning: `{}`: {reason} (after {} bytes); what comes before is read",
        path.display(),
        damage.offset
    ));
    Exit::Loss
}

impl InfoArguments {
    fn run(&self) -> Result<Exit, CliError> {
        let (text, overview) = info(&self.file, self.json)?;
        let stdout = PathBuf::from("standard output");
        let result = io::stdout().write_all(text.as_bytes());
        forgive_broken_pipe(result).map_err(|error| CliError::Output { path: stdout, error })?;
        Ok(loss(&self.file, overview.damage.as_ref()))
    }
}

impl TraceArguments {
    fn run(&self) -> Result<Exit, CliError> {
        let request = Request {
            topic: self.topic.clone(),
            selection: Selection { fields: self.fields.clone(), at: self.at.clone() },
            from: self.from,
            to: self.to,
            every: self.every,
        };
        if let Some(output) = self.output.as_deref().filter(|output| is_same_file(output, &self.file)) {
            return Err(CliError::SameFile(output.into()));
        }
        let mut output = BufWriter::new(Output::new(self.output.as_deref(), self.force));
        let result = match self.format() {
            Format::Csv => trace(&self.file, &request, &mut Csv::new(&mut output)),
            Format::Jsonl => trace(&self.file, &request, &mut JsonLines::new(&mut output)),
        };
        let outcome = match result {
            Err(TraceError::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
                return Ok(Exit::Done);
            }
            Err(TraceError::Output(error)) => return Err(self.explain(error)),
            other => other?,
        };
        if outcome.undecoded > 0 {
            say(&format!("warning: {} messages do not fit their schema and are left out", outcome.undecoded));
            loss(&self.file, outcome.damage.as_ref());
            return Ok(Exit::Loss);
        }
        Ok(loss(&self.file, outcome.damage.as_ref()))
    }

    fn format(&self) -> Format {
        let extension = self.output.as_deref().and_then(Path::extension);
        let by_name = match extension.and_then(|extension| extension.to_str()) {
            Some("jsonl" | "ndjson" | "json") => Format::Jsonl,
            _ => Format::Csv,
        };
        self.format.unwrap_or(by_name)
    }

    fn explain(&self, error: io::Error) -> CliError {
        let path = self.output.clone().unwrap_or_else(|| "standard output".into());
        match error.kind() {
            io::ErrorKind::AlreadyExists => CliError::Exists(path),
            _ => CliError::Output { path, error },
        }
    }
}

/// Standard output, or a file that is created when the first byte is written: a request that fails leaves none.
enum Output {
    Standard(io::Stdout),
    Opened(File),
    Planned { path: PathBuf, overwrite: bool },
}

impl Output {
    fn new(path: Option<&Path>, overwrite: bool) -> Self {
        match path {
            Some(path) => Self::Planned { path: path.into(), overwrite },
            None => Self::Standard(io::stdout()),
        }
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Self::Planned { path, overwrite } = self {
            let mut options = OpenOptions::new();
            options.write(true);
            if *overwrite {
                options.create(true).truncate(true)
            } else {
                options.create_new(true)
            };
            *self = Self::Opened(options.open(path)?);
        }
        match self {
            Self::Standard(stdout) => stdout.write(bytes),
            Self::Opened(file) => file.write(bytes),
            Self::Planned { .. } => unreachable!("it has just been opened"),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Standard(stdout) => stdout.flush(),
            Self::Opened(file) => file.flush(),
            Self::Planned { .. } => Ok(()),
        }
    }
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    match (std::fs::canonicalize(a), std::fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}
