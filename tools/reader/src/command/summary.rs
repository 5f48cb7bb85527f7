//! `summary`: a row of measures per recording.

mod reading;

use std::{
    borrow::Cow,
    collections::{BTreeMap, BTreeSet},
    io,
    iter::repeat,
    path::{Path, PathBuf},
};

use percuss_table::{Cell, CellType, Heading, Sink, measures::Measure};
use toml::Value;

pub(super) use reading::{Reading, watch};

use crate::{
    convention::{CASE, DERIVED_KEYS, RESOLVED_CASE, RUN},
    messages::Recording,
    prefix::{InUnits, Largest},
    recording::{Budget, Damage, Limits, OpenError},
    scales::{Conversion, Scales},
    toml_keys,
    units::Units,
};

/// Why there is no summary.
#[derive(Debug, thiserror::Error)]
pub enum SummaryError {
    /// A file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Not a recording of a run.
    #[error(
        "`{}` is not a percuss recording: it has no metadata record percuss.run; `percuss-read trace` shows its fields",
        .0.display()
    )]
    NotPercuss(PathBuf),
    /// Columns in units that nothing leads between.
    #[error(
        "`{}` has {column} in {other} and `{}` in {first}, and no scale that leads from one to the other is recorded; \
         summarise them one by one",
        path.display(), reference.display()
    )]
    Units {
        /// Recording with other units.
        path: PathBuf,
        /// First recording.
        reference: PathBuf,
        /// Column.
        column: Cow<'static, str>,
        /// Its unit in the first recording.
        first: String,
        /// Its unit in the other.
        other: String,
    },
    /// The output cannot be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] io::Error),
}

/// What was wrong with the recordings; the summary says what is there nevertheless.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Damages by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Recordings of runs that did not come to a planned end, and what they say of it.
    pub partial: Vec<(PathBuf, String)>,
}

/// A recording that has been read.
struct Read {
    recording: Recording,
    reading: Reading,
    case: BTreeMap<String, Value>,
}

impl Read {
    fn open(path: &Path, limits: Limits) -> Result<Self, SummaryError> {
        let recording = Recording::open(path, limits)?;
        if !recording.is_percuss() {
            return Err(SummaryError::NotPercuss(path.into()));
        }
        let reading = Reading::of(&recording)?;
        let keys = |name| -> Result<BTreeMap<String, Value>, OpenError> {
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
    fn cells(&self, reference: &Self, scales: &Scales) -> Result<Vec<Cell>, SummaryError> {
        let Reading { measures, units, .. } = &self.reading;
        let cell = |Measure { name: column, quantity, value }: &Measure| {
            let Some(value) = *value else { return Ok(Cell::Empty) };
            let factors = quantity.factors(units).zip(quantity.factors(&reference.reading.units));
            let pairs =
                factors.map(|(from, to)| from.into_iter().zip(to).collect::<Vec<_>>()).unwrap_or_default();
            let different = pairs.into_iter().filter(|(from, to)| from != to);
            let conversions: Option<Vec<Conversion>> =
                different.map(|(from, to)| scales.conversion(from, to)).collect();
            let conversions = conversions.ok_or_else(|| SummaryError::Units {
                path: self.recording.path.clone(),
                reference: reference.recording.path.clone(),
                column: column.clone(),
                first: quantity.unit(&reference.reading.units).unwrap_or_default(),
                other: quantity.unit(units).unwrap_or_default(),
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
) -> Result<Outcome, SummaryError> {
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
        outcome.undecoded += reading.seen.undecoded;
        if recording.is_partial() {
            let status = recording.status().unwrap_or("without a status").to_owned();
            outcome.partial.push((recording.path.clone(), status));
        }
        outcome
            .damages
            .extend(reading.seen.damages.into_iter().map(|damage| (recording.path.clone(), damage)));
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
