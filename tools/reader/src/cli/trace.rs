//! Arguments of `trace`.

use std::{io::BufWriter, path::PathBuf};

use clap::{Args, ValueEnum};
use percuss_table::{Sink, csv::Csv, parquet::Parquet};

use super::{
    chosen::Chosen,
    outcome::{CliError, Exit, losses, say, say_left_out, say_parts},
    output::{Output, PROGRAM, UnitChoice, chosen_format, commit, refuse_inputs, unless_closed},
};
use crate::{
    command::trace::{Outcome, Prefixes, Request, TraceError, arrays, trace},
    format::{
        json_lines::JsonLines,
        npy::{Npy, Shape},
    },
    recording::Limits,
};

const TRACE_EXAMPLES: &str = "\
Examples:
  # the drag around the first reflection
  percuss-read trace fig5.mcap --from 1.9 --to 2.1
  percuss-read trace fig5.mcap --topic /probes --every 10 -o probes.csv
  percuss-read trace fig5.mcap --topic /interface/stress --at r=0,0.5,0.9 \\
      --format jsonl
  # points in the target
  percuss-read trace fig5.mcap --topic /field/stress --at r=0,z=0.5 \\
      --at r=1,z=0.2
  # all of it: stress over time, z, r
  percuss-read trace fig5.mcap --topic /field/stress -o field.npz
  percuss-read trace fig5.mcap --topic /energy \\
      --field kinetic,strain,residual
  percuss-read trace steel.mcap --units base  # s and N, not µs and kN
  # in chosen units
  percuss-read trace ball.mcap --unit force=N --unit time=ms
  # of another program, with dates
  percuss-read trace robot.mcap --topic /control --field gains[kd] \\
      --time iso

--from, --to and positions of --at are in the units that are recorded, unless they have one: --from 32us --at \
r=0.1mm. On an interface between layers a position is in the upper one.";

#[derive(Debug, Args)]
#[command(after_help = TRACE_EXAMPLES)]
pub(super) struct TraceArguments {
    /// Recordings
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    chosen: Chosen,
    #[command(flatten)]
    request: Request,
    /// Output format [default: by the name of the output; csv for standard output and names without an extension]
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Units of SI columns in CSV, except with --follow; the other formats keep those that are recorded, as scripts read them
    /// [default: prefixed for recordings of percuss, base for others]
    #[arg(long, value_enum)]
    units: Option<UnitChoice>,
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
    /// Apache Parquet, units in its metadata
    Parquet,
    /// One NumPy matrix of all columns
    Npy,
    /// NumPy arrays, one per column; of one topic with a field, a profile or a line, all of it over time, z and r, with these
    Npz,
}

impl TraceArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(&self.files);
        refuse_inputs(self.output.as_deref(), self.files.iter())?;
        let format = self.format()?;
        let request = Request {
            topics: self.chosen.topics.clone(),
            selection: self.chosen.selection(),
            prefixes: match (format, self.units) {
                (Format::Csv, None) => Prefixes::OfPercuss,
                (Format::Csv, Some(UnitChoice::Prefixed)) => Prefixes::Always,
                _ => Prefixes::Never,
            },
            ..self.request.clone()
        };
        let mut output = BufWriter::new(Output::new(self.output.as_deref(), self.force));
        let written = match (format, self.files.as_slice()) {
            (Format::Npz, [file]) => arrays(file, &request, limits, &mut output),
            _ => Ok(None),
        };
        let result = match written {
            Ok(None) => self.table(format, &request, limits, &mut output),
            written => written.map(Option::unwrap_or_default),
        };
        let result = result.and_then(|outcome| Ok(commit(output).map(|()| outcome)?));
        let Some(outcome) = unless_closed(result, self.output.as_deref())? else { return Ok(Exit::Done) };
        say_left_out(&outcome.left_out);
        self.say_empty(&outcome);
        if !outcome.hidden.is_empty() {
            let names = outcome.hidden.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            say(&format!(
                "note: without a column, as neither the schema nor the first messages have them: {names}; `cat` shows them"
            ));
        }
        if outcome.undecoded > 0 {
            say(&format!(
                "warning: {} messages do not fit their schema, or unpack to more than --max-memory allows, and are left out",
                outcome.undecoded
            ));
            losses(&outcome.damages);
            return Ok(Exit::Loss);
        }
        Ok(losses(&outcome.damages))
    }

    /// Writes a table of columns.
    fn table(
        &self,
        format: Format,
        request: &Request,
        limits: Limits,
        output: &mut BufWriter<Output>,
    ) -> Result<Outcome, TraceError> {
        let mut sink: Box<dyn Sink> = match format {
            Format::Csv => Box::new(Csv::new(output)),
            Format::Jsonl => Box::new(JsonLines::new(output)),
            Format::Parquet => Box::new(Parquet::new(output, PROGRAM, limits.kept())),
            Format::Npy => Box::new(Npy::new(output, Shape::Matrix, limits.memory)),
            Format::Npz => Box::new(Npy::new(output, Shape::Archive, limits.memory)),
        };
        trace(&self.files, request, limits, &mut *sink)
    }

    fn format(&self) -> Result<Format, CliError> {
        const FORMATS: [(&str, Format); 7] = [
            ("csv", Format::Csv),
            ("jsonl", Format::Jsonl),
            ("ndjson", Format::Jsonl),
            ("json", Format::Jsonl),
            ("parquet", Format::Parquet),
            ("npy", Format::Npy),
            ("npz", Format::Npz),
        ];
        chosen_format(self.format, self.output.as_deref(), &FORMATS, Format::Csv)
    }

    /// Says what came out empty.
    fn say_empty(&self, outcome: &Outcome) {
        const NAMES: usize = 8;
        if outcome.rows == 0 {
            let is_windowed = self.request.window.from.is_some() || self.request.window.to.is_some();
            let why = if is_windowed { " from --from to --to" } else { "" };
            say(&format!("note: no rows: these topics have no messages{why}"));
        } else if !outcome.empty.is_empty() {
            let names: Vec<&str> = outcome.empty.iter().take(NAMES).map(String::as_str).collect();
            let more = match outcome.empty.len().saturating_sub(NAMES) {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            say(&format!("note: without a value in any row: {}{more}", names.join(", ")));
        }
    }
}
