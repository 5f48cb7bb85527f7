//! `summary`: a row of measures per recording.

mod reading;

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self},
    iter::repeat,
    path::{Path, PathBuf},
};

use clap::Args;
use percuss_table::{Cell, CellType, Heading, Sink, measures::Measure};
use toml::Value;

use crate::{
    convention::{CASE, DERIVED_KEYS, RESOLVED_CASE, RUN},
    failure::Failure,
    messages::Recording,
    prefix::{InUnits, Largest},
    recording::{Budget, Limits},
    scales::{Conversion, Scales},
    toml_keys,
    units::Units,
    verb::{Exit, Losses, TableFormat, UnitChoice, Verb, Write, commit, say},
};

pub(super) use reading::{Reading, Source, measures, watch};

const SUMMARY_HELP: &str = "\
Of a finished run the numbers are those that it has recorded of itself, in percuss.summary, and no message is read: verify compares
both. Of others, as of older programs, cut off or recovered, they are measured from the messages. What a recording does not say is empty, never 0:
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
  yield_ratio          largest stress of von Mises over the yield strength, on graded meshes, likewise
  tensile_ratio        largest first principal stress over the tensile strength, likewise
  interface.<n>.tension, interface.<n>.shear  of targets of layers, from the struck surface down: largest tension and shear of
                       interface n, with radius and time in interface.<n>.tension_r, _time, ...; shear in the full theory, of welded
                       layers; of an indenter with layers, from its nose up, indenter.interface.<n>.tension, ...

Units are those of the first recording; others are converted if the recording in SI carries its scales. CSV and text show SI
columns with prefixes (µs, kN) unless --units base is given; JSON and Parquet keep the units that are recorded.

Examples:
  percuss-read summary fig9-m1.mcap
  percuss-read summary fig9-*.mcap -o masses.csv
  percuss-read summary sweep/*.mcap --format json
  percuss-read summary ball.mcap --unit force=N --unit time=ms

Exit status: 0 done, 1 failed, 2 usage, 3 a recording is damaged or its run was not finished: what is there was used.";

/// A row per recording: peak force, impulse, contact, rebound, energy left, largest strain
#[derive(Debug, Args)]
#[command(after_help = SUMMARY_HELP)]
pub struct Summary {
    /// Recordings of runs
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Output format [default: by the name of the output; text for standard output and names without an extension]
    #[arg(long, value_parser = TableFormat::among(&TableFormat::SUMMARY))]
    format: Option<TableFormat>,
    /// Units of SI columns in text and CSV
    #[arg(long, value_enum, default_value = "prefixed")]
    units: UnitChoice,
    #[command(flatten)]
    chosen: Units,
    #[command(flatten)]
    write: Write,
}

impl Verb for Summary {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        self.write.refuse_inputs(&self.files)?;
        let format = self.write.format(self.format, &TableFormat::SUMMARY, TableFormat::Text)?;
        let prefixed = self.units == UnitChoice::Prefixed && format.is_for_reading();
        let mut output = self.write.begin();
        let result =
            summary(&self.files, prefixed, &self.chosen, limits, &mut *format.sink(&mut output, limits));
        let outcome = result.and_then(|outcome| commit(output).map(|()| outcome));
        let outcome = outcome.map_err(|failure| failure.at(self.write.path()))?;
        for (path, status) in &outcome.partial {
            say(&format!("warning: `{}`: the run was not finished ({status})", path.display()));
        }
        let exit = outcome.losses.report();
        Ok(if outcome.partial.is_empty() { exit } else { Exit::Loss })
    }
}

/// What was wrong with the recordings; the summary says what is there nevertheless.
#[derive(Debug, Default)]
pub struct Outcome {
    /// What could not be read.
    pub losses: Losses,
    /// Recordings of runs that did not come to a planned end, and what they say of it.
    pub partial: Vec<(PathBuf, String)>,
}

struct Read {
    recording: Recording,
    reading: Reading,
    case: BTreeMap<String, Value>,
}

impl Read {
    fn open(path: &Path, limits: Limits) -> Result<Self, Failure> {
        let recording = Recording::open(path, limits)?;
        if !recording.is_percuss() {
            return Err(Failure::not_percuss(path, "percuss-read trace` shows"));
        }
        let reading = Reading::of(&recording)?;
        let keys = |name| -> Result<BTreeMap<String, Value>, Failure> {
            let file = recording.attachment(name)?;
            let keys = file.and_then(|file| toml_keys::entries(&file, &mut Budget::new(limits.kept())));
            Ok(keys.unwrap_or_default())
        };
        let mut case = keys(RESOLVED_CASE)?;
        case.retain(|_, value| !value.is_array());
        let given = keys(CASE)?;
        case.retain(|key, _| !DERIVED_KEYS.contains(&key.as_str()) || given.contains_key(key));
        Ok(Self { recording, reading, case })
    }

    fn title(&self) -> Cell {
        let title = self.recording.entries(RUN).and_then(|run| run.get("title"));
        title.map_or(Cell::Empty, |title| Cell::Text(title.clone()))
    }

    /// The measures in the units of the first recording.
    fn cells(&self, reference: &Self, scales: &Scales) -> Result<Vec<Cell>, Failure> {
        let Reading { measures, units, .. } = &self.reading;
        let cell = |Measure { name: column, quantity, value }: &Measure| {
            let Some(value) = *value else { return Ok(Cell::Empty) };
            let factors = quantity.factors(units).zip(quantity.factors(&reference.reading.units));
            let pairs =
                factors.map(|(from, to)| from.into_iter().zip(to).collect::<Vec<_>>()).unwrap_or_default();
            let different = pairs.into_iter().filter(|(from, to)| from != to);
            let conversions: Option<Vec<Conversion>> =
                different.map(|(from, to)| scales.conversion(from, to)).collect();
            let conversions = conversions.ok_or_else(|| {
                let [path, reference_path] = [self, reference].map(|of| of.recording.path.display());
                let [first, other] = [&reference.reading.units, units].map(|of| quantity.unit(of).unwrap_or_default());
                Failure::Usage(format!(
                    "`{path}` has {column} in {other} and `{reference_path}` in {first}, and no scale that leads from one to \
                     the other is recorded; summarise them one by one"
                ))
            })?;
            Ok(Cell::Double(conversions.into_iter().fold(value, |value, by| by.apply(value))))
        };
        measures.iter().map(cell).collect()
    }
}

/// Writes a table with a row per recording.
///
/// * `prefixed`: SI columns get the prefix that suits their largest number
/// * `units`: units that are chosen
///
/// # Errors
///
/// A file cannot be read or is no recording of percuss, the units do not go together, or the output cannot be written.
pub fn summary(
    paths: &[PathBuf],
    prefixed: bool,
    units: &Units,
    limits: Limits,
    sink: &mut dyn Sink,
) -> Result<Outcome, Failure> {
    let files = paths.iter().map(|path| Read::open(path, limits)).collect::<Result<Vec<_>, _>>()?;
    let Some(first) = files.first() else { return Ok(Outcome::default()) };
    let parameters = parameters(&files);
    let headings = headings(&parameters, &files);
    let mut rows = Vec::new();
    for file in &files {
        let scales = Scales::between(&file.recording, &first.recording);
        let start = [Cell::Text(file.recording.path.display().to_string()), file.title()];
        let case = parameters.iter().map(|heading| parameter(file.case.get(&heading.name), heading.kind));
        let cells =
            start.into_iter().chain(case).chain(file.cells(first, &scales)?).chain(repeat(Cell::Empty));
        rows.push(cells.take(headings.len()).collect::<Vec<Cell>>());
    }
    write(&headings, &rows, prefixed, units, sink)?;
    let mut outcome = Outcome::default();
    for Read { recording, reading, .. } in files {
        if recording.is_partial() {
            let status = recording.status().unwrap_or("without a status").to_owned();
            outcome.partial.push((recording.path.clone(), status));
        }
        outcome.losses.add(&recording.path, reading.seen);
    }
    Ok(outcome)
}

fn write(
    headings: &[Heading],
    rows: &[Vec<Cell>],
    prefixed: bool,
    units: &Units,
    sink: &mut dyn Sink,
) -> io::Result<()> {
    let mut largest = Largest::default();
    largest.begin(headings)?;
    rows.iter().try_for_each(|row| largest.row(row))?;
    let groups: Vec<String> = headings.iter().map(|heading| heading.name.clone()).collect();
    let choose = |unit: &str, largest| units.shown(unit, largest, prefixed);
    let mut sink = InUnits::new(sink, largest.units(headings, &groups, choose));
    sink.begin(headings)?;
    rows.iter().try_for_each(|row| sink.row(row))?;
    sink.end()
}

/// Columns of the parameters of the case that differ between the recordings: numbers, if all of them are, in one unit.
fn parameters(files: &[Read]) -> Vec<Heading> {
    let keys: BTreeSet<&String> = files.iter().flat_map(|file| file.case.keys()).collect();
    let differs = |key: &&String| files.iter().any(|file| file.case.get(*key) != files[0].case.get(*key));
    let heading = |key: &String| {
        let mut values = files.iter().filter_map(|file| file.case.get(key)).map(quantity);
        let unit = values.next().flatten().map(|(_, unit)| unit);
        let unit = unit.filter(|unit| values.all(|value| value.is_some_and(|(_, other)| other == *unit)));
        match unit {
            Some(unit) => Heading::new(key, unit),
            None => Heading { name: key.clone(), unit: None, kind: CellType::Text },
        }
    };
    // the title has a column of its own
    keys.into_iter().filter(|key| *key != "title").filter(differs).map(heading).collect()
}

/// A number and its unit, if a value is one: `1.5` or `"20 mm"`.
fn quantity(value: &Value) -> Option<(f64, Option<&str>)> {
    match value {
        Value::Float(number) => Some((*number, None)),
        Value::Integer(number) => Some((*number as f64, None)),
        Value::String(text) => {
            let (number, unit) = text.split_once(' ')?;
            Some((number.parse().ok()?, Some(unit)))
        }
        _ => None,
    }
}

fn parameter(value: Option<&Value>, kind: CellType) -> Cell {
    match (value, value.and_then(quantity)) {
        (None, _) => Cell::Empty,
        (_, Some((number, _))) if kind == CellType::Double => Cell::Double(number),
        (Some(Value::String(text)), _) => Cell::Text(text.clone()),
        (Some(other), _) => Cell::Text(other.to_string()),
    }
}

/// Columns: those of the measures of the recording that has most, in the units of the first.
fn headings(parameters: &[Heading], files: &[Read]) -> Vec<Heading> {
    let text = |name: &str| Heading { name: name.into(), unit: None, kind: CellType::Text };
    let most = files.iter().map(|file| &file.reading.measures).max_by_key(|measures| measures.len());
    let measures = most.into_iter().flatten().map(|measure| measure.heading(&files[0].reading.units));
    [text("file"), text("title")].into_iter().chain(parameters.iter().cloned()).chain(measures).collect()
}
