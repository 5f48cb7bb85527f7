//! `trace`: fields of a topic against time.

use std::{collections::HashMap, io, path::Path};

use mcap::records::Record;
use prost_reflect::{DynamicMessage, FieldDescriptor, MessageDescriptor};

use crate::{
    field::{Column, Selection, SelectionError, columns},
    overview::{Channel, Directory},
    recording::{Damage, OpenError, Scan},
    table::{Cell, Sink},
};

/// Topic that is traced if none is named: the drag of percuss.
pub const DEFAULT_TOPIC: &str = "/drag";

/// What to trace.
#[derive(Clone, Debug, Default)]
pub struct Request {
    /// Topic; [`DEFAULT_TOPIC`] if none.
    pub topic: Option<String>,
    /// Fields and positions.
    pub selection: Selection,
    /// First time, in the unit of the time column.
    pub from: Option<f64>,
    /// Last time, in the unit of the time column.
    pub to: Option<f64>,
    /// Every n-th message; 1 for all.
    pub every: u64,
}

/// How much there was.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Rows written.
    pub rows: u64,
    /// What ended reading early.
    pub damage: Option<Damage>,
    /// Messages that could not be decoded.
    pub undecoded: u64,
}

/// Why a trace failed.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is no such topic.
    #[error("there is no topic `{topic}`; the recording has {known}")]
    UnknownTopic {
        /// Topic asked for.
        topic: String,
        /// Topics that exist.
        known: String,
    },
    /// The fields asked for are not there.
    #[error(transparent)]
    Selection(#[from] SelectionError),
    /// The output cannot be written.
    #[error("cannot write the output: {0}")]
    Output(#[from] io::Error),
}

/// Writes a table of the requested fields, one row per message.
///
/// # Errors
///
/// The file cannot be read, the request does not fit it, or the output cannot be written. Damage is no error: the
/// rows before it are written, and the outcome tells.
pub fn trace(path: &Path, request: &Request, sink: &mut dyn Sink) -> Result<Outcome, TraceError> {
    let topic = request.topic.as_deref().unwrap_or(DEFAULT_TOPIC);
    let channel = find_channel(path, topic)?;
    let message = channel.message.clone();
    let mut failure = None;
    let mut lengths = None;
    let mut longest = |field: &FieldDescriptor| {
        let message = message.as_ref().expect("only decodable channels have fields");
        let lengths = lengths.get_or_insert_with(|| array_lengths(path, topic, message));
        match lengths {
            Ok(lengths) => lengths.get(&field.number()).copied().unwrap_or(0),
            Err(error) => {
                failure = Some(std::mem::replace(error, OpenError::NotMcap(path.into())));
                0
            }
        }
    };
    let columns = columns(&channel, &request.selection, &mut longest)?;
    if let Some(error) = failure {
        return Err(error.into());
    }
    let headings: Vec<_> = columns.iter().map(|column| column.heading.clone()).collect();
    sink.begin(&headings)?;
    let mut rows =
        Rows { request, columns: &columns, cells: Vec::new(), seen: 0, outcome: Outcome::default() };
    let damage = for_each_message(path, topic, |descriptor, data, log_time| match descriptor {
        Some(descriptor) => match DynamicMessage::decode(descriptor.clone(), data) {
            Ok(message) => rows.take(&message, log_time, sink),
            Err(_) => {
                rows.outcome.undecoded += 1;
                Ok(())
            }
        },
        None => Ok(()),
    })?;
    sink.end()?;
    let mut outcome = rows.outcome;
    outcome.damage = damage;
    Ok(outcome)
}

struct Rows<'a> {
    request: &'a Request,
    columns: &'a [Column],
    cells: Vec<Cell>,
    seen: u64,
    outcome: Outcome,
}

impl Rows<'_> {
    fn take(&mut self, message: &DynamicMessage, log_time: u64, sink: &mut dyn Sink) -> io::Result<()> {
        let time = self.columns[0].cell(message, log_time);
        let number = time.number().unwrap_or(f64::NAN);
        let Request { from, to, every, .. } = self.request;
        if from.is_some_and(|from| number < from) || to.is_some_and(|to| number > to) {
            return Ok(());
        }
        self.seen += 1;
        if !(self.seen - 1).is_multiple_of((*every).max(1)) {
            return Ok(());
        }
        self.cells.clear();
        self.cells.push(time);
        self.cells.extend(self.columns[1..].iter().map(|column| column.cell(message, log_time)));
        self.outcome.rows += 1;
        sink.row(&self.cells)
    }
}

/// The first channel of a topic.
fn find_channel(path: &Path, topic: &str) -> Result<Channel, TraceError> {
    let mut scan = Scan::open(path)?;
    let mut directory = Directory::default();
    let mut known: Vec<String> = Vec::new();
    loop {
        let next = scan.next(|record| {
            directory.learn(&record);
            match record {
                Record::Channel(channel) => directory.channel(channel.id).cloned(),
                _ => None,
            }
        })?;
        match next {
            Some(Some(channel)) if channel.topic == topic => return Ok(channel),
            Some(Some(channel)) if !known.contains(&channel.topic) => known.push(channel.topic),
            Some(_) => {}
            None => {
                let known = if known.is_empty() { "none".into() } else { known.join(", ") };
                return Err(TraceError::UnknownTopic { topic: topic.into(), known });
            }
        }
    }
}

/// Calls `take` for every message of a topic, with its type, data and log time.
fn for_each_message(
    path: &Path,
    topic: &str,
    mut take: impl FnMut(Option<&MessageDescriptor>, &[u8], u64) -> io::Result<()>,
) -> Result<Option<Damage>, TraceError> {
    let mut scan = Scan::open(path)?;
    let mut directory = Directory::default();
    loop {
        let next = scan.next(|record| {
            directory.learn(&record);
            let Record::Message { header, data } = record else { return Ok(()) };
            match directory.channel(header.channel_id).filter(|channel| channel.topic == topic) {
                Some(channel) => take(channel.message.as_ref(), &data, header.log_time),
                None => Ok(()),
            }
        })?;
        match next {
            Some(result) => result?,
            None => return Ok(scan.damage().cloned()),
        }
    }
}

/// Greatest length of every array field over all messages of a topic, by field number.
fn array_lengths(
    path: &Path,
    topic: &str,
    message: &MessageDescriptor,
) -> Result<HashMap<u32, usize>, OpenError> {
    let mut lengths = HashMap::new();
    let arrays: Vec<FieldDescriptor> = message.fields().filter(FieldDescriptor::is_list).collect();
    let result = for_each_message(path, topic, |_, data, _| {
        if let Ok(decoded) = DynamicMessage::decode(message.clone(), data) {
            for field in &arrays {
                let length = decoded.get_field(field).as_list().map_or(0, <[_]>::len);
                let longest: &mut usize = lengths.entry(field.number()).or_default();
                *longest = (*longest).max(length);
            }
        }
        Ok(())
    });
    match result {
        Ok(_) => Ok(lengths),
        Err(TraceError::Open(error)) => Err(error),
        Err(_) => unreachable!("nothing else can fail here"),
    }
}
