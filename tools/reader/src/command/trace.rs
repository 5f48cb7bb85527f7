//! `trace`: fields of topics against time, from one recording or many.

mod arrays;
mod join;
mod request;
mod source;

use std::{collections::HashSet, iter, path::PathBuf, slice, thread};

use clap::Args;
use join::{Joiner, Rows};
use percuss_table::{Cell, CellType, Heading, Sink};
use request::Clock;
use source::{Slot, Traced};

use crate::{
    convention,
    failure::Failure,
    field::SelectionError,
    messages::POLL,
    prefix::{InUnits, Largest, takes_prefix},
    recording::{Limits, without_part},
    verb::{Chosen, Exit, TableFormat, UnitChoice, Verb, Write, commit, say},
};

use arrays::arrays;
pub(crate) use request::iso;
pub use request::{Align, Outcome, Prefixes, Request, TimeForm};

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
    pub(crate) files: Vec<PathBuf>,
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
        for error in &outcome.left_out {
            say(&format!("note: left out: {error}"));
        }
        self.say_empty(&outcome);
        if !outcome.hidden.is_empty() {
            let names = outcome.hidden.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            say(&format!(
                "note: without a column, as neither the schema nor the first messages have them: {names}; `cat` shows them"
            ));
        }
        Ok(outcome.losses.report())
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
    check(&files, request.time, &outcome.left_out)?;
    let mut heads = match request.stack {
        true => stacked_heads(&files, paths, request)?,
        false => heads(&files, paths.len() > 1, request),
    };
    if !request.selection.for_curves {
        // columns of one name get others, from the second on
        let mut names = Names::default();
        heads.iter_mut().for_each(|head| head.heading.name = names.take(&head.topic, &head.heading.name));
    }
    let (begun, groups): (Vec<Heading>, Vec<String>) =
        heads.into_iter().map(|head| (head.heading, head.field)).unzip();
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
        scaled = InUnits::new(sink, largest.units(&begun, &groups, choose));
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

/// Names of columns, as they stand in archives, each of which is there once.
#[derive(Default)]
struct Names(HashSet<String>);

impl Names {
    /// A name that is free: the wanted one, else that with its topic in front, else that with a number behind.
    fn take(&mut self, topic: &str, name: &str) -> String {
        let with_topic = (!name.contains(['/', ':'])).then(|| format!("{topic}.{name}"));
        let numbered = (2..).map(|number| format!("{name}#{number}"));
        let mut names = [name.to_owned()].into_iter().chain(with_topic).chain(numbered);
        let is_free = |name: &String| self.0.insert(name.trim_start_matches('/').replace('/', "."));
        names.find(is_free).unwrap_or_default()
    }
}

/// A column.
struct Head {
    heading: Heading,
    topic: String,
    /// What it is of: all columns of an array have the same prefix.
    field: String,
}

/// Columns of files one after the other, which have to be the same.
fn stacked_heads(files: &[Traced], paths: &[PathBuf], request: &Request) -> Result<Vec<Head>, Failure> {
    let heads = |file: &Traced| heads(slice::from_ref(file), false, request);
    let headings = |file: &Traced| heads(file).into_iter().map(|head| head.heading).collect::<Vec<_>>();
    let Some(first) = files.first() else { return Ok(Vec::new()) };
    if let Some((_, other)) = files.iter().zip(paths).find(|(file, _)| headings(file) != headings(first)) {
        return Err(Failure::Usage(format!(
            "`{}` has other columns than `{}`; trace them side by side, or choose fields both have",
            other.display(),
            paths[0].display()
        )));
    }
    let heading = Heading { name: "file".into(), unit: None, kind: CellType::Text };
    let file = Head { heading, topic: String::new(), field: "(file)".into() };
    Ok(iter::once(file).chain(heads(first)).collect())
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

/// Refuses a table of nothing but steps and times, where what was left out are the values, times that channels give in different
/// units, and another form of log times where messages have times that are none.
fn check(files: &[Traced], form: TimeForm, left_out: &[SelectionError]) -> Result<(), Failure> {
    let slots = || files.iter().flat_map(|file| &file.slots);
    let mut columns = slots().flat_map(|slot| &slot.columns);
    if let Some(error) = left_out.first()
        && columns.all(|column| column.heading.name == convention::STEP)
    {
        return Err(error.clone().into());
    }
    let mut timed = slots().filter(|slot| slot.time.leaf.is_some());
    let mut units = timed.clone().filter_map(|slot| slot.time.heading.unit.as_ref());
    let text = if let Some(first) = units.next()
        && let Some(other) = units.find(|unit| *unit != first)
    {
        format!("times are in {first} and in {other}; trace them one by one")
    } else if let Some(Slot { topic, .. }) = timed.next().filter(|_| form != TimeForm::Seconds) {
        format!(
            "messages of `{topic}` have a time of their own; --time is for topics that are timed by their log time"
        )
    } else {
        return Ok(());
    };
    Err(Failure::Usage(text))
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
            Some((slot, time, cells)) => joiner.put(slot, time, cells),
            None if stream.done => joiner.ended(stream.slots()),
            None => {
                joiner.drain(true, &mut rows)?;
                rows.sink.flush()?;
                thread::sleep(POLL);
            }
        }
        joiner.drain(false, &mut rows)?;
    }
    joiner.finish(&mut rows)?;
    outcome.rows += rows.written;
    for stream in streams {
        outcome.hidden.extend(stream.hidden);
        outcome.losses.add(&stream.file.recording.path, stream.messages.seen());
    }
    Ok(())
}

/// Columns of files side by side, the time first.
fn heads(files: &[Traced], many_files: bool, request: &Request) -> Vec<Head> {
    let slots = || files.iter().flat_map(|file| file.slots.iter().map(move |slot| (file, slot)));
    let first = slots().next().map(|(_, slot)| slot.time.heading.clone());
    let same = |time: &Heading| slots().all(|(_, slot)| slot.time.heading == *time);
    let time = first.filter(same).unwrap_or(Heading::new("time", None));
    let interpolated = request.align == Align::Linear && slots().count() > 1;
    let kind = |kind: CellType| match kind {
        CellType::Float | CellType::Int | CellType::UInt if interpolated => CellType::Double,
        kind => kind,
    };
    let clock = Clock { form: request.time, origin: 0 };
    let heading = clock.heading(Heading { kind: CellType::Double, ..time });
    let mut heads = vec![Head { heading, topic: String::new(), field: "(time)".into() }];
    for (file, slot) in slots() {
        let topic = if file.slots.len() > 1 { format!("{}.", slot.topic) } else { String::new() };
        let name = if many_files { format!("{}:", file.name) } else { String::new() };
        let layout = file.recording.channels[&slot.id].layout.as_ref();
        let path = |leaf: usize| layout.map(|layout| layout.leaves[leaf].path.as_str());
        heads.extend(slot.columns.iter().map(|column| Head {
            heading: Heading {
                name: format!("{name}{topic}{}", column.heading.name),
                unit: column.heading.unit.clone(),
                kind: kind(column.heading.kind),
            },
            topic: slot.topic.clone(),
            field: format!("{}.{}", slot.topic, column.leaf.and_then(path).unwrap_or_default()),
        }));
    }
    heads
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_given_once() {
        let mut names = Names::default();
        let taken =
            ["time", "time", "time", "/p.time", "x", "/a/b.x", "/a.b.x"].map(|name| names.take("/p", name));
        assert_eq!(taken, ["time", "/p.time", "time#2", "/p.time#2", "x", "/a/b.x", "/a.b.x#2"]);
    }
}
