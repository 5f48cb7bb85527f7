//! `info`: what a recording holds.

use std::path::{Path, PathBuf};

use clap::Args;
use percuss_table::Heading;
use serde_json::{Value, json};

use crate::{
    channel::Channel,
    command::trace::iso,
    convention::{RUN, STATUS},
    failure::Failure,
    instant::seconds,
    messages::Recording,
    recording::Limits,
    text::{printable, short},
    verb::{Exit, Verb, loss, show},
};

const INFO_EXAMPLES: &str = "\
Examples:
  percuss-read info fig5.mcap
  percuss-read info fig5.mcap --json
  percuss-read info fig5.mcap.part  # of a run in progress";

/// What a recording holds: run, channels, counts, units, times, metadata, attachments
#[derive(Debug, Args)]
#[command(after_help = INFO_EXAMPLES)]
pub struct Info {
    /// Recording
    pub(crate) file: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl Verb for Info {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        let (text, recording) = info(&self.file, self.json, limits)?;
        show(&text, self.json)?;
        Ok(loss(&self.file, &recording.damages))
    }
}

/// Version of the JSON form.
pub const JSON_VERSION: u32 = 2;

/// Widest that the column of topics gets; longer ones stick out.
const MAX_WIDTH: usize = 60;

/// Largest number of fields of a channel that are listed.
const MAX_SHOWN: usize = 12;

/// Reads a recording and describes it, as text or JSON.
///
/// # Errors
///
/// The file cannot be read or is no MCAP file.
pub fn info(path: &Path, as_json: bool, limits: Limits) -> Result<(String, Recording), Failure> {
    let recording = Recording::read(path, limits)?;
    let size = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    let text = if as_json {
        format!("{:#}\n", to_json(path, size, &recording))
    } else {
        to_text(path, size, &recording)
    };
    Ok((text, recording))
}

fn to_json(path: &Path, size: u64, recording: &Recording) -> Value {
    let channels = recording.channels.iter().map(|(id, channel)| {
        json!({
            "id": id,
            "topic": channel.topic,
            "schema": channel.schema,
            "encoding": channel.encoding,
            "messages": channel.count,
            "decodable": channel.layout.is_some(),
            "start_ns": channel.span.map(|span| span.0),
            "end_ns": channel.span.map(|span| span.1),
            "metadata": channel.metadata,
        })
    });
    let metadata = recording.metadata.iter();
    json!({
        "version": JSON_VERSION,
        "file": path.to_string_lossy(),
        "bytes": size,
        "complete": recording.complete,
        "damages": recording.damages,
        "percuss": recording.is_percuss(),
        "status": recording.status(),
        "library": recording.library,
        "profile": recording.profile,
        "start_ns": recording.span.map(|span| span.0),
        "end_ns": recording.span.map(|span| span.1),
        "messages": recording.channels.values().map(|channel| channel.count).sum::<u64>(),
        "chunks": recording.chunks,
        "channels": channels.collect::<Vec<_>>(),
        "attachments": recording.attachments,
        "metadata": metadata.map(|m| json!({ "name": m.name, "entries": m.entries })).collect::<Vec<_>>(),
    })
}

fn to_text(path: &Path, size: u64, recording: &Recording) -> String {
    let mut text = format!("{}: {}\n", printable(&path.to_string_lossy()), headline(recording));
    let mut line = |key: &str, value: String| text.push_str(&format!("  {key:<11} {}\n", printable(&value)));
    if let Some(title) = recording.entries(RUN).and_then(|run| run.get("title")) {
        line("title", title.clone());
    }
    line("written by", recording.library.clone());
    line("size", format!("{size} bytes"));
    let chunks = &recording.chunks;
    if chunks.count > 0 {
        let name = |name: &String| if name.is_empty() { "uncompressed".to_owned() } else { name.clone() };
        let names: Vec<String> = chunks.compression.iter().map(name).collect();
        let share = 100.0 * chunks.compressed as f64 / chunks.uncompressed.max(1) as f64;
        line("chunks", format!("{}, {}, compressed to {share:.0} %", chunks.count, names.join(", ")));
    }
    if let Some((start, end)) = recording.span {
        line("log time", format!("{} s to {} s", seconds(start), seconds(end)));
        if recording.start_date().is_some() {
            line("start", iso(start));
            line("duration", format!("{} s", seconds(end - start)));
        }
    }
    for damage in &recording.damages {
        line("damage", format!("{} (at byte {}, {} bytes lost)", damage.reason, damage.offset, damage.bytes));
    }

    text.push_str(&channels(recording));
    if !recording.attachments.is_empty() {
        text.push_str("\nattachments\n");
        for attachment in &recording.attachments {
            let (name, media_type) = (printable(&attachment.name), printable(&attachment.media_type));
            let size = attachment.size;
            text.push_str(&format!("  {name}  {size} bytes  {media_type}\n"));
        }
    }
    for record in &recording.metadata {
        text.push_str(&format!("\n{}\n", printable(&record.name)));
        for (key, value) in record.entries.iter().filter(|(_, value)| !value.trim().is_empty()) {
            text.push_str(&format!("  {} = {}\n", printable(key), printable(value)));
        }
    }
    text
}

fn channels(recording: &Recording) -> String {
    let mut text = "\nchannels\n".to_owned();
    let widths = recording.channels.values().map(|channel| printable(&channel.topic).chars().count());
    let width = widths.max().unwrap_or(0).min(MAX_WIDTH);
    for channel in recording.channels.values() {
        let fields = match &channel.layout {
            Some(_) => units(channel),
            None => format!("({} messages are not decoded)", short(&channel.encoding)),
        };
        let (topic, schema) = (printable(&channel.topic), printable(&channel.schema));
        let count = match recording.start_date() {
            Some(_) => format!("{:>8}  {:>9}", channel.count, rate(channel)),
            None => format!("{:>8}", channel.count),
        };
        let encoding = match recording.is_percuss() {
            true => String::new(),
            false => format!("{:<8} ", short(&channel.encoding)),
        };
        let row = format!("  {topic:<width$}  {count}  {encoding}{schema:<24} {fields}");
        text.push_str(row.trim_end());
        text.push('\n');
    }
    text
}

/// Messages per second, to three digits; nothing of fewer than two.
fn rate(channel: &Channel) -> String {
    let span = channel.span.map(|(first, last)| seconds(last - first)).filter(|span| *span > 0.0);
    let Some(span) = span else { return String::new() };
    let rate = channel.count.saturating_sub(1) as f64 / span;
    let rounded = format!("{rate:.2e}").parse().unwrap_or(rate);
    format!("{rounded} Hz")
}

/// Complete or not, in words.
fn headline(recording: &Recording) -> String {
    let kind = match recording.entries(RUN).and_then(|run| run.get("format_version")) {
        Some(version) => format!("percuss recording, format {}", printable(version)),
        None => "MCAP file".into(),
    };
    let state = match (recording.complete, recording.status()) {
        (true, Some("completed")) => "completed".to_owned(),
        (true, Some(status)) => {
            let record = recording.entries(STATUS);
            let message = record.and_then(|record| record.get("message")).map_or("", String::as_str);
            format!("{} ({})", printable(status), printable(message))
        }
        (true, None) if recording.is_percuss() => "no status record: the run did not end".to_owned(),
        (true, None) => "complete".to_owned(),
        (false, _) => "PARTIAL: damaged or cut off".to_owned(),
    };
    format!("{kind}, {state}")
}

/// Fields with units, in the order of the message.
fn units(channel: &Channel) -> String {
    let Some(layout) = &channel.layout else { return String::new() };
    let axes = channel.axis_parts();
    let fields = || layout.leaves.iter().filter(|leaf| !axes.contains(leaf.path.as_str()) && leaf.is_data());
    let names = fields().take(MAX_SHOWN).map(|leaf| {
        let array = if leaf.ends_in_list { "[]" } else { "" };
        let name = format!("{}{array}", short(&leaf.path));
        Heading::new(&name, channel.unit(&leaf.path).map(short).as_deref()).with_unit()
    });
    let names = names.collect::<Vec<_>>().join(", ");
    match fields().count() {
        0..=MAX_SHOWN => names,
        more => format!("{names}, … ({more} fields)"),
    }
}
