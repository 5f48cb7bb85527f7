//! `trace`: fields of topics against time, from one recording or many.

mod join;

use std::{
    io,
    path::{Path, PathBuf},
};

use crate::{
    channel::Channel,
    convention,
    extent::{Extent, Extents},
    field::{Column, Columns, MAX_TABLE, Positions, Selection, SelectionError, columns},
    messages::{Messages, POLL, Recording},
    recording::{Damage, Limits, OpenError, log_times},
    select::{self, Pattern, UnknownTopic, Window},
    table::{Cell, Heading, Kind, Sink},
    wire::Values,
};

pub use join::Align;
use join::{Joiner, Rows};

/// What to trace.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Topics; [`convention::DRAG`] if none.
    pub topics: Vec<Pattern>,
    /// Fields and positions.
    pub selection: Selection,
    /// Times, in the unit of the time column, and every n-th row.
    pub window: Window,
    /// How rows come about.
    pub align: Align,
    /// Files one after the other with their names in the first column, instead of side by side.
    pub stack: bool,
    /// Keeps reading a file that is being written.
    pub follow: bool,
}

/// How much there was.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Rows written.
    pub rows: u64,
    /// What is damaged, by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Bytes of the files that were read, summaries left aside.
    pub bytes_read: u64,
    /// Fields that are left out of whole topics, and why.
    pub left_out: Vec<SelectionError>,
    /// Names of columns without a value in any row.
    pub empty: Vec<String>,
}

/// Why a trace failed.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// A file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no such topic.
    #[error(transparent)]
    UnknownTopic(#[from] UnknownTopic),
    /// The fields asked for are not there.
    #[error(transparent)]
    Selection(#[from] SelectionError),
    /// Times that cannot stand in one column.
    #[error("times are in {first} and in {other}; trace them one by one")]
    TimeUnits {
        /// Unit of the first.
        first: String,
        /// Unit that differs.
        other: String,
    },
    /// Files to be stacked have different columns.
    #[error("`{}` has other columns than `{}`; trace them side by side, or choose fields both have", other.display(), first.display())]
    Columns {
        /// First file.
        first: PathBuf,
        /// File that differs.
        other: PathBuf,
    },
    /// What has to be kept of the messages has no room.
    #[error("{0}")]
    Memory(io::Error),
    /// The output cannot be written.
    #[error("cannot write the output: {0}")]
    Output(io::Error),
}

impl From<io::Error> for TraceError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::OutOfMemory => Self::Memory(error),
            _ => Self::Output(error),
        }
    }
}

/// Writes a table of the requested fields: a row per time, a column per file, topic and field.
///
/// # Errors
///
/// A file cannot be read, the request does not fit it, or the output cannot be written. Damage is no error: what is
/// sound is written, and the outcome tells.
pub fn trace(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
    sink: &mut dyn Sink,
) -> Result<Outcome, TraceError> {
    let mut outcome = Outcome::default();
    let mut files = Vec::new();
    for (path, name) in paths.iter().zip(names(paths)) {
        files.push(Traced::open(path, name, request, limits, &mut outcome.left_out)?);
    }
    check_units(&files)?;
    let mut filled = Vec::new();
    let begun = if request.stack {
        let first = stacked_headings(&files, paths, request.align)?;
        let file_heading = Heading { name: "file".into(), unit: None, kind: Kind::Text };
        let begun = [&[file_heading][..], &first].concat();
        sink.begin(&begun)?;
        for (file, path) in files.iter().zip(paths) {
            let label = Some(Cell::Text(path.display().to_string()));
            run(std::slice::from_ref(file), request, label, sink, &mut outcome, &mut filled)?;
            sink.group()?;
        }
        begun
    } else {
        let begun = headings(&files, paths.len() > 1, request.align);
        sink.begin(&begun)?;
        run(&files, request, None, sink, &mut outcome, &mut filled)?;
        begun
    };
    sink.end()?;
    let is_empty = |i: &usize| !filled.get(*i).copied().unwrap_or(false);
    outcome.empty = (0..begun.len()).filter(is_empty).map(|i| begun[i].name.clone()).collect();
    Ok(outcome)
}

/// Headings of files one after the other, which have to be the same.
fn stacked_headings(files: &[Traced], paths: &[PathBuf], align: Align) -> Result<Vec<Heading>, TraceError> {
    let headings = |file: &Traced| headings(std::slice::from_ref(file), false, align);
    let first = files.first().map(headings).unwrap_or_default();
    match files.iter().zip(paths).find(|(file, _)| headings(file) != first) {
        Some((_, other)) => Err(TraceError::Columns { first: paths[0].clone(), other: other.clone() }),
        None => Ok(first),
    }
}

/// Names of files in headings: without folder and extension where that tells them apart.
pub(crate) fn names(paths: &[PathBuf]) -> Vec<String> {
    let stem = |path: &PathBuf| {
        path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
    };
    let stems: Vec<String> = paths.iter().map(stem).collect();
    let is_alone = |name: &String| stems.iter().filter(|other| *other == name).count() == 1;
    match stems.iter().all(is_alone) {
        true => stems,
        false => paths.iter().map(|path| path.display().to_string()).collect(),
    }
}

/// Refuses times that channels give in different units.
fn check_units(files: &[Traced]) -> Result<(), TraceError> {
    let times = files.iter().flat_map(|file| &file.slots).filter(|slot| slot.time.leaf.is_some());
    let mut units = times.filter_map(|slot| slot.time.heading.unit.as_ref());
    let Some(first) = units.next() else { return Ok(()) };
    match units.find(|unit| *unit != first) {
        Some(other) => Err(TraceError::TimeUnits { first: first.clone(), other: other.clone() }),
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
) -> Result<(), TraceError> {
    let mut streams = files.iter().map(|file| file.stream(request)).collect::<Result<Vec<_>, _>>()?;
    let mut base = 0;
    for stream in &mut streams {
        stream.base = base;
        base += stream.file.slots.len();
    }
    let widths: Vec<usize> = files.iter().flat_map(|file| file.slots.iter().map(Slot::width)).collect();
    let limits = files.first().map_or_else(Limits::default, |file| file.recording.limits());
    let mut rows = Rows { window: request.window, seen: 0, label, sink, outcome, filled, cells: Vec::new() };
    let mut joiner = Joiner::new(request.align, widths, limits.kept());
    loop {
        // the file that is behind goes first, so that rows of equal times meet
        let behind =
            streams.iter_mut().filter(|stream| !stream.done).min_by(|a, b| a.time.total_cmp(&b.time));
        let Some(stream) = behind else { break };
        match stream.next(request)? {
            Step::Sample(slot, time, cells) => joiner.put(slot, time, cells),
            Step::Pending => {
                joiner.drain(true, &mut rows)?;
                rows.sink.flush()?;
                std::thread::sleep(POLL);
            }
            Step::Over => joiner.ended(stream.slots()),
        }
        joiner.drain(false, &mut rows)?;
    }
    joiner.drain(true, &mut rows)?;
    for stream in streams {
        rows.outcome.undecoded += stream.undecoded;
        rows.outcome.bytes_read += stream.messages.bytes_read();
        let path = &stream.file.recording.path;
        let damages = stream.messages.damages().iter().map(|damage| (path.clone(), damage.clone()));
        rows.outcome.damages.extend(damages);
    }
    Ok(())
}

/// A file and what of it is traced.
struct Traced {
    recording: Recording,
    name: String,
    slots: Vec<Slot>,
}

/// A channel that is traced; its columns without the time.
struct Slot {
    id: u16,
    topic: String,
    time: Column,
    columns: Vec<Column>,
}

impl Slot {
    fn width(&self) -> usize {
        self.columns.len()
    }
}

impl Traced {
    fn open(
        path: &Path,
        name: String,
        request: &Request,
        limits: Limits,
        all_left_out: &mut Vec<SelectionError>,
    ) -> Result<Self, TraceError> {
        let mut recording = Recording::open(path, limits)?;
        let default = [convention::DRAG.parse().expect("a plain topic")];
        let patterns = if request.topics.is_empty() { &default[..] } else { &request.topics };
        // of a file that is being written, the topics may still be to come
        while request.follow && select::channels(&recording, patterns).is_err() {
            std::thread::sleep(POLL);
            recording = Recording::open(path, limits)?;
        }
        let ids = select::channels(&recording, patterns)?;
        let many = ids.len() > 1;
        let (mut slots, mut width) = (Vec::new(), 0);
        let mut extents: Option<Result<Extents, OpenError>> = None;
        let mut found = Found::new(&request.selection);
        for &id in &ids {
            let channel = &recording.channels[&id];
            let mut extent = |leaf: usize| {
                let extents = extents.get_or_insert_with(|| Extents::read(&recording, &ids));
                let extent = extents.as_ref().map_or_else(|_| Extent::default(), |known| known.of(id, leaf));
                // what is still to be written may reach farther
                if request.follow { Extent { reaches: Vec::new(), ..extent } } else { extent }
            };
            let selection = match many {
                true => fitting(channel, &request.selection, &mut found),
                false => Some(request.selection.clone()),
            };
            let Some(selection) = selection else { continue };
            let Columns { time, fields, left_out } = columns(channel, &selection, &mut extent)?;
            all_left_out.extend(left_out);
            width += fields.len();
            if width > MAX_TABLE {
                return Err(SelectionError::TooWide { topic: channel.topic.clone(), columns: width }.into());
            }
            slots.push(Slot { id, topic: channel.topic.clone(), time, columns: fields });
        }
        if let Some(Err(error)) = extents {
            return Err(error.into());
        }
        if many {
            let channels: Vec<&Channel> = ids.iter().map(|id| &recording.channels[id]).collect();
            found.check(&request.selection, &channels)?;
        }
        Ok(Self { recording, name, slots })
    }

    fn stream(&self, request: &Request) -> Result<Stream<'_>, OpenError> {
        let by_time = self.slots.iter().all(|slot| slot.time.leaf.is_some());
        let Window { from, to, .. } = request.window;
        let window = match by_time {
            true => self.recording.log_window(from, to),
            false => Some(log_times(from, to, 1.0)),
        };
        let mut messages = self.recording.messages(self.slots.iter().map(|slot| slot.id), window)?;
        if request.follow {
            messages.follow();
        }
        let values = self.slots.iter().map(|slot| {
            let layout = self.recording.channels[&slot.id].layout.as_ref();
            layout.map_or(Values { lists: Vec::new() }, |layout| layout.values())
        });
        let values = values.collect();
        Ok(Stream {
            file: self,
            messages,
            values,
            base: 0,
            time: f64::NEG_INFINITY,
            undecoded: 0,
            done: false,
        })
    }
}

/// Which parts of a selection any of several channels has.
struct Found {
    fields: Vec<bool>,
    at: Vec<bool>,
}

impl Found {
    fn new(selection: &Selection) -> Self {
        Self { fields: vec![false; selection.fields.len()], at: vec![false; selection.at.len()] }
    }

    /// What none of them has is told like that of a single channel.
    fn check(&self, selection: &Selection, channels: &[&Channel]) -> Result<(), SelectionError> {
        let missing = |found: &[bool]| found.iter().position(|found| !found);
        let decoded = channels.iter().find(|channel| channel.layout.is_some()).or(channels.first());
        if let (Some(missing), Some(channel)) = (missing(&self.fields), decoded) {
            return Err(SelectionError::unknown_field(channel, &selection.fields[missing]));
        }
        match missing(&self.at) {
            Some(missing) => Err(SelectionError::no_axis(channels, &selection.at[missing])),
            None => Ok(()),
        }
    }
}

/// What of a selection a channel has, where several are traced; `None` if it has nothing of it. What is there is marked as
/// found.
fn fitting(channel: &Channel, selection: &Selection, found: &mut Found) -> Option<Selection> {
    let fits = |fields: &[String], at: &[Positions]| {
        let selection = Selection { fields: fields.to_vec(), at: at.to_vec() };
        match columns(channel, &selection, &mut |_| Extent::default()) {
            Ok(_) => true,
            Err(SelectionError::UnknownField { .. } | SelectionError::NoAxis { .. }) => false,
            // there, but not to be had: that is told
            Err(error) => !matches!(error, SelectionError::NotProtobuf { .. }),
        }
    };
    let mut fields = Vec::new();
    for (field, found) in selection.fields.iter().zip(&mut found.fields) {
        if fits(std::slice::from_ref(field), &[]) {
            *found = true;
            fields.push(field.clone());
        }
    }
    if !selection.fields.is_empty() && fields.is_empty() {
        return None;
    }
    let mut at = Vec::new();
    for (positions, found) in selection.at.iter().zip(&mut found.at) {
        if fits(&fields, std::slice::from_ref(positions)) {
            *found = true;
            at.push(positions.clone());
        }
    }
    fits(&fields, &at).then_some(Selection { fields, at })
}

/// Headings of files side by side, the time first.
fn headings(files: &[Traced], many_files: bool, align: Align) -> Vec<Heading> {
    let slots = || files.iter().flat_map(|file| &file.slots);
    let first = slots().next().map(|slot| slot.time.heading.clone());
    let same = |time: &Heading| slots().all(|slot| slot.time.heading == *time);
    let time = first.filter(same).unwrap_or(Heading { name: "time".into(), ..Heading::default() });
    let interpolated = align == Align::Linear && slots().count() > 1;
    let kind = |kind: Kind| match kind {
        Kind::Float | Kind::Int | Kind::UInt if interpolated => Kind::Double,
        kind => kind,
    };
    let mut headings = vec![Heading { kind: Kind::Double, ..time }];
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

/// The samples of a file.
struct Stream<'a> {
    file: &'a Traced,
    messages: Messages,
    values: Vec<Values>,
    /// Number of its first slot among those of all files.
    base: usize,
    time: f64,
    undecoded: u64,
    done: bool,
}

enum Step {
    Sample(usize, f64, Vec<Cell>),
    Pending,
    Over,
}

impl Stream<'_> {
    fn slots(&self) -> std::ops::Range<usize> {
        self.base..self.base + self.file.slots.len()
    }

    /// The next sample of the time asked for.
    fn next(&mut self, request: &Request) -> Result<Step, OpenError> {
        loop {
            let (file, values, undecoded) = (self.file, &mut self.values, &mut self.undecoded);
            let next = self.messages.next(|message| {
                let index = file.slots.iter().position(|slot| slot.id == message.channel)?;
                let slot = &file.slots[index];
                let channel: &Channel = &file.recording.channels[&slot.id];
                let layout = channel.layout.as_ref()?;
                if layout.decode(message.data, &mut values[index]).is_err() {
                    *undecoded += 1;
                    return None;
                }
                let time = slot.time.cell(&values[index], message.log_time).number().unwrap_or(f64::NAN);
                let cell = |column: &Column| column.cell(&values[index], message.log_time);
                let sample = request
                    .window
                    .holds(time)
                    .then(|| (index, time, slot.columns.iter().map(cell).collect()));
                values[index].release();
                sample
            })?;
            match next {
                Some(Some((slot, time, cells))) => {
                    self.time = time;
                    return Ok(Step::Sample(self.base + slot, time, cells));
                }
                Some(None) => {}
                None => {
                    self.done = self.messages.is_over();
                    return Ok(if self.done { Step::Over } else { Step::Pending });
                }
            }
        }
    }
}
