//! Arguments of `summary`.

use std::{io::BufWriter, path::PathBuf};

use clap::{Args, ValueEnum};
use percuss_table::{Sink, csv::Csv, parquet::Parquet};

use super::{
    outcome::{CliError, Exit, losses, say, say_parts},
    output::{Output, PROGRAM, UnitChoice, chosen_format, commit, refuse_inputs, unless_closed},
};
use crate::{
    command::summary::{Outcome, summary},
    format::{aligned::Aligned, json::Json},
    recording::Limits,
    units::Units,
};

const SUMMARY_HELP: &str = "\
Columns, from recorded messages only; what a recording does not say is empty, never 0:
  file, title          name of the recording, title of the case
  <parameter>          parameters of the case that differ between the recordings, by dotted keys, indenter.mass, as they are
                       given, with their unit; lists are left out, and so is what follows from the others (mesh.outer_radius, record.r_max, record.layer_tension)
  peak_force           largest force of /drag
  peak_time            time at which it is first reached
  impulse              integral of the force over time, by trapezia over all messages of /drag
  contact_duration     from the first to the last message of /drag with contact: a contact radius above 0 or a force other
                       than 0. Contact that lasts to the end of the recording counts as far as it is recorded
  contact_radius       largest contact radius
  depth                largest displacement of the indenter into the target
  rebound_velocity     velocity of the indenter when contact ends for good (SEPARATION without a later RECONTACT, at the
                       time since when nothing touches), if it moves back then
  restitution          e = -V/V0: rebound velocity over that of the impact (recordings before format 2.3: the first recorded)
  restitution_mesh_corrected  the same with the mesh's loss returned, the square root of e^2 + loss: the energy that nodes lose which
                       come into contact, over that of the indenter; it falls with the size of cells
  t_ext                time of the first EXTENSION: the interface needs tension, or the contact of a rounded head turns back
  energy_left          kinetic and strain energy of the target when contact ends for good, linear between the messages of
                       /energy; empty for runs without frames, which have none
  largest_strain       largest strain, with its radius, depth and time in largest_strain_r, _z and _time
  interface.<n>.tension, interface.<n>.shear  of targets of layers, from the struck surface down: largest tension and shear of
                       interface n, with radius and time in interface.<n>.tension_r, _time, ...; shear in the full theory, of welded
                       layers

Units are those of the first recording; others are converted if the recording in SI carries its scales. CSV and text show SI
columns with prefixes (µs, kN) unless --units base is given; JSON and Parquet keep the units that are recorded.

Examples:
  percuss-read summary fig9-m1.mcap
  percuss-read summary fig9-*.mcap -o masses.csv
  percuss-read summary sweep/*.mcap --format json
  percuss-read summary ball.mcap --unit force=N --unit time=ms

Exit status: 0 done, 1 failed, 2 usage, 3 a recording is damaged or its run was not finished: what is there was used.";

#[derive(Debug, Args)]
#[command(after_help = SUMMARY_HELP)]
pub(super) struct SummaryArguments {
    /// Recordings of runs
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Output format [default: by the name of the output; text for standard output and names without an extension]
    #[arg(long, value_enum)]
    format: Option<Format>,
    /// Units of SI columns in text and CSV
    #[arg(long, value_enum, default_value = "prefixed")]
    units: UnitChoice,
    #[command(flatten)]
    chosen: Units,
    /// Output file [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing output file
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    /// Aligned columns, numbers of five digits
    Text,
    /// Comma-separated values, names and units in the first line
    Csv,
    /// One document: units by column, and a list of rows
    Json,
    /// Apache Parquet, units in its metadata
    Parquet,
}

impl SummaryArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(&self.files);
        refuse_inputs(self.output.as_deref(), self.files.iter())?;
        let format = self.format()?;
        let prefixed = self.units == UnitChoice::Prefixed && matches!(format, Format::Text | Format::Csv);
        let mut output = BufWriter::new(Output::new(self.output.as_deref(), self.force));
        let mut sink: Box<dyn Sink> = match format {
            Format::Text => Box::new(Aligned::new(&mut output)),
            Format::Csv => Box::new(Csv::new(&mut output)),
            Format::Json => Box::new(Json::new(&mut output)),
            Format::Parquet => Box::new(Parquet::new(&mut output, PROGRAM, limits.kept())),
        };
        let result = summary(&self.files, prefixed, &self.chosen, limits, &mut *sink);
        drop(sink);
        let result = result.and_then(|outcome| Ok(commit(output).map(|()| outcome)?));
        let outcome = unless_closed(result, self.output.as_deref())?;
        Ok(outcome.map_or(Exit::Done, |outcome| report(&outcome)))
    }

    fn format(&self) -> Result<Format, CliError> {
        const FORMATS: [(&str, Format); 4] = [
            ("txt", Format::Text),
            ("csv", Format::Csv),
            ("json", Format::Json),
            ("parquet", Format::Parquet),
        ];
        chosen_format(self.format, self.output.as_deref(), &FORMATS, Format::Text)
    }
}

/// Says what was wrong with the recordings.
fn report(outcome: &Outcome) -> Exit {
    for (path, status) in &outcome.partial {
        say(&format!("warning: `{}`: the run was not finished ({status})", path.display()));
    }
    if outcome.undecoded > 0 {
        say(&format!("warning: {} messages do not fit their schema and are left out", outcome.undecoded));
    }
    let exit = losses(&outcome.damages);
    if outcome.partial.is_empty() && outcome.undecoded == 0 { exit } else { Exit::Loss }
}
