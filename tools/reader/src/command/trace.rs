//! `trace`: fields of topics against time, from one recording or many.

mod arrays;
mod clock;
mod join;
mod names;
mod request;
mod source;

use std::{iter, path::PathBuf, slice, thread};

use clap::Args;
use clock::Clock;
use join::{Joiner, Rows};
use names::Names;
use percuss_table::{Cell, CellType, Heading, Sink};
use source::{Step, Traced};

use crate::{
    convention,
    failure::Failure,
    field::{Column, SelectionError},
    messages::{POLL, Seen},
    prefix::{InUnits, Largest, takes_prefix},
    recording::{Limits, without_part},
    verb::{Chosen, Exit, TableFormat, UnitChoice, Verb, Write, commit, losses, say, say_left_out},
};

pub use arrays::arrays;
pub use clock::TimeForm;
pub(crate) use clock::iso;
pub use join::Align;
pub use request::{Outcome, Prefixes, Request};

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

/// Fields against time: CSV, JSON lines, Parquet, NumPy
#[derive(Debug, Args)]
#[command(after_help = TRACE_EXAMPLES)]
pub struct Trace {
    /// Recordings
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    chosen: Chosen,
    #[command(flatten)]
    request: Request,
    /// Output format [default: by the name of the output; csv for standard output and names without an extension]
    #[arg(long, value_parser = TableFormat::among(&TableFormat::TRACE))]
    format: Option<TableFormat>,
    /// Units of SI columns in CSV, except with --follow; the other formats keep those that are recorded, as scripts read them
    /// [default: prefixed for recordings of percuss, base for others]
    #[arg(long, value_enum)]
    units: Option<UnitChoice>,
    #[command(flatten)]
    write: Write,
}

impl Verb for Trace {
    fn files(&self) -> &[PathBuf] {
        &self.files
    }

    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        self.write.refuse_inputs(&self.files)?;
        let format = self.write.format(self.format, &TableFormat::TRACE, TableFormat::Csv)?;
        let request = Request {
            topics: self.chosen.topics.clone(),
            selection: self.chosen.selection(),
            prefixes: match (format.is_for_reading(), self.units) {
                (true, None) => Prefixes::OfPercuss,
                (true, Some(UnitChoice::Prefixed)) => Prefixes::Always,
                _ => Prefixes::Never,
            },
            ..self.request.clone()
        };
        let outcome = self.take(format, &request, limits).map_err(|failure| failure.at(self.write.path()))?;
        say_left_out(&outcome.left_out);
        self.say_empty(&outcome);
        if !outcome.hidden.is_empty() {
            let names = outcome.hidden.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            say(&format!(
                "note: without a column, as neither the schema nor the first messages have them: {names}; `cat` shows them"
            ));
        }
        Ok(losses(&outcome.damages, outcome.undecoded))
    }
}

impl Trace {
    /// Writes the table, or the arrays of one topic.
    fn take(&self, format: TableFormat, request: &Request, limits: Limits) -> Result<Outcome, Failure> {
        let mut output = self.write.begin();
        let written = match (format, self.files.as_slice()) {
            (TableFormat::Npz, [file]) => arrays(file, request, limits, &mut output)?,
            _ => None,
        };
        let outcome = match written {
            Some(outcome) => outcome,
            None => trace(&self.files, request, limits, &mut *format.sink(&mut output, limits))?,
        };
        commit(output)?;
        Ok(outcome)
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

/// Writes a table of the requested fields: a row per time, a column per file, topic and field.
///
/// In prefixed units SI columns get the prefix that suits their largest number, those of one array the same. That takes a
/// first pass over the messages, if there are such columns; what is still being written keeps its units.
///
/// # Errors
///
/// A file cannot be read, the request does not fit it, or the output cannot be written. Damage is no error: what is
/// sound is written, and the outcome says what is not.
pub fn trace(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
    sink: &mut dyn Sink,
) -> Result<Outcome, Failure> {
    let mut outcome = Outcome::default();
    let mut files = Vec::new();
    let origin = origin(paths, request, limits)?;
    for (path, name) in paths.iter().zip(names(paths)) {
        files.push(Traced::open(path, name, request, origin, limits, &mut outcome.left_out)?);
    }
    if !request.selection.for_curves && (paths.len() == 1 || request.stack) {
        files.iter_mut().for_each(Traced::leave_out_second_times);
    }
    check_values(&files, &outcome.left_out)?;
    check_units(&files)?;
    check_own_times(&files, request.time)?;
    let mut begun = if request.stack {
        let file_heading = Heading { name: "file".into(), unit: None, kind: CellType::Text };
        [&[file_heading][..], &stacked_headings(&files, paths, request)?].concat()
    } else {
        headings(&files, paths.len() > 1, request)
    };
    if !request.selection.for_curves {
        distinguish(&mut begun, &files, request.stack);
    }
    let is_percuss = |file: &Traced| file.recording.entries(convention::RUN).is_some();
    let prefixed = match request.prefixes {
        Prefixes::Never => false,
        _ if request.follow => false,
        Prefixes::OfPercuss => files.iter().all(is_percuss),
        Prefixes::Always => true,
    };
    let mut scaled;
    let sink = if (prefixed || !request.units.is_empty()) && begun.iter().any(takes_prefix) {
        let mut largest = Largest::default();
        largest.begin(&begun)?;
        let choose = |unit: &str, largest| request.units.shown(unit, largest, prefixed);
        if prefixed {
            run_all(&files, paths, request, &mut largest, &mut Outcome::default())?;
        }
        scaled = InUnits::new(sink, largest.units(&begun, &groups(&files, request.stack), choose));
        &mut scaled
    } else {
        sink
    };
    sink.begin(&begun)?;
    let filled = run_all(&files, paths, request, sink, &mut outcome)?;
    sink.end()?;
    let is_empty = |i: &usize| !filled.get(*i).copied().unwrap_or(false);
    outcome.empty = (0..begun.len()).filter(is_empty).map(|i| begun[i].name.clone()).collect();
    Ok(outcome)
}

/// Writes the rows of all files; answers which columns have had a value.
fn run_all(
    files: &[Traced],
    paths: &[PathBuf],
    request: &Request,
    sink: &mut dyn Sink,
    outcome: &mut Outcome,
) -> Result<Vec<bool>, Failure> {
    let mut filled = Vec::new();
    if !request.stack {
        run(files, request, None, sink, outcome, &mut filled)?;
        return Ok(filled);
    }
    for (file, path) in files.iter().zip(paths) {
        let label = Some(Cell::Text(path.display().to_string()));
        run(slice::from_ref(file), request, label, sink, outcome, &mut filled)?;
        sink.group()?;
    }
    Ok(filled)
}

/// For every column what it is of: a field of a topic, the time, the file.
fn groups(files: &[Traced], stack: bool) -> Vec<String> {
    let (start, files) = match stack {
        true => (vec!["(file)".to_owned(), "(time)".to_owned()], files.get(..1).unwrap_or(files)),
        false => (vec!["(time)".to_owned()], files),
    };
    let fields = files.iter().flat_map(|file| {
        file.slots.iter().flat_map(move |slot| {
            let layout = file.recording.channels[&slot.id].layout.as_ref();
            let leaf = move |leaf: usize| layout.map(|layout| layout.leaves[leaf].path.as_str());
            let path = move |column: &Column| column.leaf.and_then(leaf).unwrap_or_default();
            slot.columns.iter().map(move |column| format!("{}.{}", slot.topic, path(column)))
        })
    });
    start.into_iter().chain(fields).collect()
}

/// Gives columns of one name others, from the second on.
fn distinguish(headings: &mut [Heading], files: &[Traced], stack: bool) {
    let files = if stack { files.get(..1).unwrap_or(files) } else { files };
    let topics = files
        .iter()
        .flat_map(|file| &file.slots)
        .flat_map(|slot| slot.columns.iter().map(|_| slot.topic.as_str()));
    let others = if stack { 2 } else { 1 };
    let mut names = Names::default();
    for (heading, topic) in headings.iter_mut().zip(iter::repeat_n("", others).chain(topics)) {
        heading.name = names.take(topic, &heading.name);
    }
}

/// Headings of files one after the other, which have to be the same.
fn stacked_headings(files: &[Traced], paths: &[PathBuf], request: &Request) -> Result<Vec<Heading>, Failure> {
    let headings = |file: &Traced| headings(slice::from_ref(file), false, request);
    let first = files.first().map(headings).unwrap_or_default();
    match files.iter().zip(paths).find(|(file, _)| headings(file) != first) {
        Some((_, other)) => Err(Failure::Usage(format!(
            "`{}` has other columns than `{}`; trace them side by side, or choose fields both have",
            other.display(),
            paths[0].display()
        ))),
        None => Ok(first),
    }
}

/// Names of files in headings: without folder and extension where that distinguishes them.
pub(crate) fn names(paths: &[PathBuf]) -> Vec<String> {
    let stem = |path: &PathBuf| {
        let whole = without_part(path);
        whole.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
    };
    let stems: Vec<String> = paths.iter().map(stem).collect();
    let is_unique = |name: &String| stems.iter().filter(|other| *other == name).count() == 1;
    match stems.iter().all(is_unique) {
        true => stems,
        false => paths.iter().map(|path| path.display().to_string()).collect(),
    }
}

/// Log time that counts as 0 in all files \[ns\]; `None` if each counts from its own start.
fn origin(paths: &[PathBuf], request: &Request, limits: Limits) -> Result<Option<u64>, Failure> {
    if request.epoch {
        return Ok(Some(0));
    }
    if request.time == TimeForm::Seconds || paths.len() < 2 {
        return Ok(None);
    }
    // the rows of files side by side meet at the same date
    let mut first = u64::MAX;
    for path in paths {
        first = first.min(request.sources.open(path, limits)?.start_date().unwrap_or(0));
    }
    Ok(Some(first))
}

/// Refuses to write log times in another form where messages have times that are none.
fn check_own_times(files: &[Traced], form: TimeForm) -> Result<(), Failure> {
    let mut slots = files.iter().flat_map(|file| &file.slots);
    match slots.find(|slot| form != TimeForm::Seconds && slot.time.leaf.is_some()) {
        Some(slot) => Err(Failure::Usage(format!(
            "messages of `{}` have a time of their own; --time is for topics that are timed by their log time",
            slot.topic
        ))),
        None => Ok(()),
    }
}

/// Refuses a table of nothing but steps and times, where what was left out are the values.
fn check_values(files: &[Traced], left_out: &[SelectionError]) -> Result<(), Failure> {
    let mut columns = files.iter().flat_map(|file| &file.slots).flat_map(|slot| &slot.columns);
    match left_out.first() {
        Some(error) if columns.all(|column| column.heading.name == convention::STEP) => {
            Err(error.clone().into())
        }
        _ => Ok(()),
    }
}

/// Refuses times that channels give in different units.
fn check_units(files: &[Traced]) -> Result<(), Failure> {
    let times = files.iter().flat_map(|file| &file.slots).filter(|slot| slot.time.leaf.is_some());
    let mut units = times.filter_map(|slot| slot.time.heading.unit.as_ref());
    let Some(first) = units.next() else { return Ok(()) };
    match units.find(|unit| *unit != first) {
        Some(other) => {
            Err(Failure::Usage(format!("times are in {first} and in {other}; trace them one by one")))
        }
        None => Ok(()),
    }
}

/// Writes the rows of files that stand side by side.
fn run(
    files: &[Traced],
    request: &Request,
    label: Option<Cell>,
    sink: &mut dyn Sink,
    outcome: &mut Outcome,
    filled: &mut Vec<bool>,
) -> Result<(), Failure> {
    let mut slots = files.iter().flat_map(|file| &file.slots);
    let by_log_time = slots.all(|slot| slot.time.leaf.is_none());
    let (mut streams, mut base) = (Vec::new(), 0);
    for file in files {
        streams.push(file.stream(request, base, by_log_time)?);
        base += file.slots.len();
    }
    let widths = files.iter().flat_map(|file| file.slots.iter().map(|slot| slot.columns.len())).collect();
    let limits = files.first().map_or_else(Limits::default, |file| file.recording.limits());
    let clock = Clock { form: request.time, origin: files.first().map_or(0, Traced::origin) };
    let mut rows = Rows {
        window: request.window,
        clock,
        seen: 0,
        written: 0,
        label,
        sink,
        filled,
        cells: Vec::new(),
        left_out: None,
    };
    let mut joiner = Joiner::new(request.align, widths, limits.kept());
    loop {
        // read from the file with the earlier time, so equal times join
        let behind = streams.iter_mut().filter(|stream| !stream.done).min_by(|a, b| a.time.total_cmp(b.time));
        let Some(stream) = behind else { break };
        match stream.next(request)? {
            Step::Sample(slot, time, cells) => joiner.put(slot, time, cells),
            Step::Pending => {
                joiner.drain(true, &mut rows)?;
                rows.sink.flush()?;
                thread::sleep(POLL);
            }
            Step::Over => joiner.ended(stream.slots()),
        }
        joiner.drain(false, &mut rows)?;
    }
    joiner.finish(&mut rows)?;
    outcome.rows += rows.written;
    for stream in streams {
        outcome.hidden.extend(stream.hidden);
        let Seen { damages, undecoded, bytes } = stream.messages.seen();
        outcome.undecoded += undecoded;
        outcome.bytes_read += bytes;
        let path = &stream.file.recording.path;
        let damages = damages.into_iter().map(|damage| (path.clone(), damage));
        outcome.damages.extend(damages);
    }
    Ok(())
}

/// Headings of files side by side, the time first.
fn headings(files: &[Traced], many_files: bool, request: &Request) -> Vec<Heading> {
    let slots = || files.iter().flat_map(|file| &file.slots);
    let first = slots().next().map(|slot| slot.time.heading.clone());
    let same = |time: &Heading| slots().all(|slot| slot.time.heading == *time);
    let time = first.filter(same).unwrap_or(Heading::new("time", None));
    let interpolated = request.align == Align::Linear && slots().count() > 1;
    let kind = |kind: CellType| match kind {
        CellType::Float | CellType::Int | CellType::UInt if interpolated => CellType::Double,
        kind => kind,
    };
    let clock = Clock { form: request.time, origin: 0 };
    let mut headings = vec![clock.heading(Heading { kind: CellType::Double, ..time })];
    for file in files {
        for slot in &file.slots {
            let topic = if file.slots.len() > 1 { format!("{}.", slot.topic) } else { String::new() };
            let name = if many_files { format!("{}:", file.name) } else { String::new() };
            headings.extend(slot.columns.iter().map(|column| Heading {
                name: format!("{name}{topic}{}", column.heading.name),
                unit: column.heading.unit.clone(),
                kind: kind(column.heading.kind),
            }));
        }
    }
    headings
}
