//! `recover`: a finished file from one that is damaged or cut off.

use std::{
    collections::{BTreeMap, BTreeSet},
    io::{self, BufWriter},
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::Args;
use mcap::{
    Attachment, Compression, McapError, WriteOptions, Writer,
    records::{Metadata, Record},
    write::NoSeek,
};
use percuss_output::text::printable;
use serde_json::json;

use crate::{
    convention,
    directory::defined_again,
    failure::Failure,
    instant::seconds,
    recording::{Budget, Damage, FileRecord, Limits, Scan},
    text::short,
    verb::{Exit, Verb, Write, by_extension, commit, print, print_document},
};

const RECOVER_EXAMPLES: &str = "\
Copies every sound message, attachment and metadata record into a new, finished file, and lists what was lost; the \
new file lists it too, in the metadata record `percuss.recovered`. The damaged file is left as it is.

Examples:
  percuss-read recover damaged.mcap -o recovered.mcap

Exit status: 0 nothing was lost, 1 failed, 2 usage, 3 something was lost.";

/// A finished recording from one that is damaged or cut off
#[derive(Debug, Args)]
#[command(after_help = RECOVER_EXAMPLES)]
#[command(mut_arg("output", |new| new.help("New recording").required(true)))]
pub struct Recover {
    /// Damaged recording
    pub(crate) file: PathBuf,
    #[command(flatten)]
    write: Write,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const RECOVER_VERSION: u32 = 1;

impl Verb for Recover {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        self.write.refuse_inputs([&self.file])?;
        let path = self.write.named()?;
        by_extension(path, &[("mcap", ())], Some(()))?;
        // what is no recording leaves no new file
        drop(Scan::open(&self.file, limits)?);
        let mut output = self.write.begin();
        let recovered = recover(&self.file, &mut output, limits);
        let recovered = recovered.and_then(|recovered| commit(output).map(|()| recovered));
        let recovered = recovered.map_err(|failure| failure.at(Some(path)))?;
        if self.json {
            let document = json!({
                "version": RECOVER_VERSION,
                "file": self.file.to_string_lossy(),
                "output": path.to_string_lossy(),
                "messages": recovered.messages,
                "chunks": recovered.chunks,
                "lost": recovered.lost,
            });
            print_document(&format!("{document:#}\n"))?;
        } else {
            let [file, output] =
                [self.file.as_path(), path].map(|path| printable(&path.to_string_lossy()).into_owned());
            let (messages, extras) = (recovered.messages, recovered.extras);
            let mut text = format!(
                "{file} -> {output}: {messages} messages, {extras} attachments and metadata records kept\n"
            );
            if recovered.lost.is_empty() {
                text.push_str("  nothing was lost\n");
            }
            for lost in &recovered.lost {
                text.push_str(&format!("  lost: {lost}\n"));
            }
            print(&text)?;
        }
        Ok(if recovered.lost.is_empty() { Exit::Done } else { Exit::Loss })
    }
}

/// Lost definitions that are reported one by one.
const MAX_LOST: usize = 1000;

/// Topics of a lost chunk that are reported one by one.
const MAX_TOPICS: usize = 20;

/// Uncompressed size after which a chunk is closed, besides where the chunks of the source end \[bytes\].
const CHUNK: u64 = 4 << 20;

/// What was kept and what was lost.
#[derive(Clone, Debug, Default)]
pub struct Recovered {
    /// Messages kept.
    pub messages: u64,
    /// Chunks kept.
    pub chunks: u64,
    /// Attachments and metadata records kept.
    pub extras: u64,
    /// What was lost, in words.
    pub lost: Vec<String>,
}

/// Copies every sound message, attachment and metadata record of a file into a new one, chunk by chunk.
///
/// # Errors
///
/// The file cannot be read or the new one not written.
pub fn recover(path: &Path, output: impl io::Write, limits: Limits) -> Result<Recovered, Failure> {
    let (profile, library, compression) = look_ahead(path, limits)?;
    let options = WriteOptions::new()
        .profile(profile)
        .library(library)
        .compression(compression)
        .compression_level(1)
        .compression_threads(0)
        .chunk_size(Some(CHUNK))
        .disable_seeking(true);
    let writer = options.create(NoSeek::new(BufWriter::new(output)))?;
    let mut scan = Scan::open(path, limits)?;
    let mut copy = Copy {
        writer,
        budget: Budget::new(limits.directory()),
        result: Recovered::default(),
        topics: BTreeMap::new(),
        schemas: BTreeSet::new(),
        unknown: BTreeMap::new(),
        chunk: None,
    };
    // the summary may name what the damaged part defined
    let index = Arc::clone(scan.index());
    for record in &index.directory {
        copy.define(record)?;
    }
    let (mut reported, mut looked) = (0, false);
    loop {
        let next = scan.next(|found| {
            // a definition counts wherever it stands: without a summary, that takes a reading of its own
            if let Record::Message { header, .. } = &found.record
                && !looked
                && !copy.topics.contains_key(&header.channel_id)
            {
                looked = true;
                Scan::open(path, limits)?
                    .find_map(|found| copy.define(&found.record).err())?
                    .map_or(Ok(()), Err)?;
            }
            Ok::<_, Failure>(copy.take(found)?)
        })?;
        for damage in &scan.damages()[reported..] {
            copy.lose(damage);
        }
        reported = scan.damages().len();
        let Some(copied) = next else { return Ok(copy.finish(path)?) };
        copied?;
    }
}

/// Header and first compression of a file.
fn look_ahead(path: &Path, limits: Limits) -> Result<(String, String, Option<Compression>), Failure> {
    let mut scan = Scan::open(path, limits)?;
    let (mut profile, mut library) = (String::new(), String::new());
    let compression = scan.find_map(|found| match found.record {
        Record::Header(header) => {
            (profile, library) = (header.profile, header.library);
            None
        }
        Record::Chunk { header, .. } => Some(header.compression),
        _ => None,
    })?;
    let compression = match compression.as_deref() {
        Some("lz4") => Some(Compression::Lz4),
        Some("zstd") | None => Some(Compression::Zstd),
        Some(_) => None,
    };
    Ok((profile, library, compression))
}

struct Copy<W: io::Write> {
    writer: Writer<NoSeek<BufWriter<W>>>,
    /// Memory for definitions and places, which the writer keeps until it writes the summary.
    budget: Budget,
    result: Recovered,
    topics: BTreeMap<u16, String>,
    schemas: BTreeSet<u16>,
    unknown: BTreeMap<u16, u64>,
    chunk: Option<Chunk>,
}

struct Chunk {
    offset: u64,
    span: (u64, u64),
    /// Messages of every channel that were copied.
    kept: BTreeMap<u16, u64>,
    /// Messages of every channel that its indexes list; they come after a damage.
    indexed: BTreeMap<u16, u64>,
    /// How it was lost.
    lost: Option<String>,
}

impl<W: io::Write> Copy<W> {
    fn define(&mut self, record: &Record<'_>) -> Result<(), McapError> {
        let weight = match record {
            Record::Schema { header, data } if !self.schemas.contains(&header.id) => {
                data.len() + header.name.len() + header.encoding.len()
            }
            Record::Channel(channel) if !self.topics.contains_key(&channel.id) => {
                let entries = channel.metadata.iter().map(|(key, value)| 160 + key.len() + value.len());
                2 * channel.topic.len() + channel.message_encoding.len() + entries.sum::<usize>()
            }
            Record::Channel(channel) if self.topics[&channel.id] != channel.topic => {
                let text = defined_again(channel, &self.topics[&channel.id]);
                if !self.result.lost.contains(&text) {
                    self.lose_one_of_many(text);
                }
                return Ok(());
            }
            _ => return Ok(()),
        };
        // as the writer has it, and once more while it writes
        if !self.budget.spend(512 + 2 * weight) {
            let reason = "it takes more memory than there is for it (--max-memory)";
            self.lose_one_of_many(format!("a definition: {reason}"));
            return Ok(());
        }
        match self.add(record) {
            Err(error) if !matches!(error, McapError::Io(_)) => {
                self.lose_one_of_many(format!("a definition: {}", short(&error.to_string())));
                Ok(())
            }
            added => added,
        }
    }

    /// Adds a definition that is new; a channel whose schema is lost is left out.
    fn add(&mut self, record: &Record<'_>) -> Result<(), McapError> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id);
                self.writer.add_schema_with_id(header.id, &header.name, &header.encoding, data).map(drop)
            }
            Record::Channel(channel)
                if channel.schema_id == 0 || self.schemas.contains(&channel.schema_id) =>
            {
                let (encoding, metadata) = (&channel.message_encoding, &channel.metadata);
                let (id, schema, topic) = (channel.id, channel.schema_id, &channel.topic);
                self.writer.add_channel_with_id(id, schema, topic, encoding, metadata)?;
                self.topics.insert(id, topic.clone());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Notes something of which a hostile file may hold millions.
    fn lose_one_of_many(&mut self, text: String) {
        if self.result.lost.len() < MAX_LOST {
            self.result.lost.push(text);
        }
    }

    /// True if there is room for the place of an attachment or metadata record in the summary.
    fn has_place(&mut self, what: &str, name: &str) -> bool {
        let has_room = self.budget.spend(256 + 2 * name.len());
        if !has_room {
            let name = short(name);
            self.lose_one_of_many(format!(
                "{what} `{name}`: its place has no room in the summary (--max-memory)"
            ));
        }
        has_room
    }

    fn take(&mut self, found: FileRecord<'_>) -> Result<(), McapError> {
        let FileRecord { offset, inside, record, left_out } = found;
        if inside.is_none() && !matches!(record, Record::MessageIndex(_)) {
            self.end_chunk()?;
        }
        self.define(&record)?;
        match record {
            Record::Chunk { header, .. } => {
                let span = (header.message_start_time, header.message_end_time);
                let (kept, indexed) = (BTreeMap::new(), BTreeMap::new());
                self.chunk = Some(Chunk { offset, span, kept, indexed, lost: None });
            }
            Record::Message { header, data } => {
                if !self.topics.contains_key(&header.channel_id) {
                    *self.unknown.entry(header.channel_id).or_default() += 1;
                    return Ok(());
                }
                self.writer.write_to_known_channel(&header, &data)?;
                self.result.messages += 1;
                if let Some(chunk) = &mut self.chunk {
                    *chunk.kept.entry(header.channel_id).or_default() += 1;
                }
            }
            Record::MessageIndex(index) => {
                if let Some(chunk) = &mut self.chunk {
                    chunk.indexed.insert(index.channel_id, index.records.len() as u64);
                }
            }
            Record::Attachment { header, .. } if let Some(left_out) = left_out => {
                self.result.lost.push(left_out.refusal(&header.name));
            }
            Record::Attachment { header, data, .. } if self.has_place("attachment", &header.name) => {
                self.result.extras += 1;
                self.writer.attach(&Attachment {
                    log_time: header.log_time,
                    create_time: header.create_time,
                    name: header.name,
                    media_type: header.media_type,
                    data,
                })?;
            }
            Record::Metadata(record) if self.has_place("metadata record", &record.name) => {
                self.result.extras += 1;
                self.writer.write_metadata(&record)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// Notes a damage; if it is that of the open chunk, its indexes are still to come.
    fn lose(&mut self, damage: &Damage) {
        let Damage { offset, bytes, reason } = damage;
        let text = format!("{bytes} bytes at byte {offset}: {reason}");
        match self.chunk.as_mut().filter(|chunk| chunk.offset == *offset) {
            Some(chunk) => chunk.lost = Some(text),
            None => self.result.lost.push(text),
        }
    }

    /// Called once all that belongs to a chunk has been seen.
    fn end_chunk(&mut self) -> Result<(), McapError> {
        let Some(Chunk { span, kept, indexed, lost, .. }) = self.chunk.take() else { return Ok(()) };
        self.writer.flush()?;
        self.result.chunks += u64::from(!kept.is_empty());
        let Some(lost) = lost else { return Ok(()) };
        let count = |(id, indexed): (&u16, &u64)| {
            let missing = indexed - kept.get(id).copied().unwrap_or(0).min(*indexed);
            let topic =
                self.topics.get(id).map_or_else(|| format!("channel {id}"), |topic| short(topic).into());
            format!("{missing} of {topic}")
        };
        let mut counts: Vec<String> = indexed.iter().take(MAX_TOPICS).map(count).collect();
        if indexed.len() > MAX_TOPICS {
            counts.push(format!("and of {} more", indexed.len() - MAX_TOPICS));
        }
        let what = if counts.is_empty() { "unknown messages".into() } else { counts.join(", ") };
        let (from, to) = (seconds(span.0), seconds(span.1));
        self.result.lost.push(format!("{lost}; a chunk of log time {from} s to {to} s with {what}"));
        Ok(())
    }

    fn finish(mut self, source: &Path) -> Result<Recovered, McapError> {
        self.end_chunk()?;
        for (id, count) in std::mem::take(&mut self.unknown) {
            self.result.lost.push(format!("{count} messages of channel {id}, whose definition is lost"));
        }
        if !self.result.lost.is_empty() {
            let mut metadata = BTreeMap::from([("source".to_owned(), source.display().to_string())]);
            let lost = self.result.lost.iter().enumerate();
            metadata.extend(lost.map(|(i, text)| (format!("lost.{i:03}"), text.clone())));
            self.writer.write_metadata(&Metadata { name: convention::RECOVERED.into(), metadata })?;
        }
        self.writer.finish()?;
        let file = self.writer.into_inner().into_inner();
        file.into_inner().map_err(|error| McapError::Io(error.into_error()))?;
        Ok(self.result)
    }
}
