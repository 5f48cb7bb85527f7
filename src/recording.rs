//! The recorder: messages, attachments and metadata into an MCAP file. It knows no physics.
//!
//! The caller encodes messages into batches; a writer thread compresses and writes them. The queue between them is
//! bounded: a slow disk slows the caller down, and nothing is dropped. The first error of the writer ends the
//! recording and comes back from the next call. What can wait is left to the writer thread whole, as work that makes messages.
//! Batches are large, because whoever computes on the writer's core loses its caches with every one of them.
//!
//! Chunks are closed at the end of the step that fills them and written whole: after a crash every chunk that was
//! closed can be read. Everything that reaches the bytes of the file is set explicitly here.

use std::{
    collections::BTreeMap,
    fs::{File, OpenOptions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread::JoinHandle,
};

use mcap::{
    Attachment, McapError, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};
use prost::Message;
use serde::{Deserialize, Serialize};

/// Version of the recording format, `major.minor`: readers of the same major version understand it.
///
/// * 1.0: the first.
/// * 1.1: slices of a field have one shape; force, mass and energy of plane runs are per length, in units of their own;
///   `Event.since`.
pub const FORMAT_VERSION: &str = "1.1";

/// Uncompressed size at which a chunk is closed \[bytes\]: smaller ones lose less in a crash and cost more index. From 256 KiB to 4 MiB
/// the size of the file differs by 0.2 % and the time by less than can be measured.
pub const CHUNK_TARGET: u64 = 4 << 20;

/// What a message takes in a chunk beside its bytes: opcode and length of the record, channel, sequence, two times \[bytes\].
pub(crate) const MESSAGE_HEADER: u64 = 31;
/// Size at which a batch goes to the writer thread \[bytes\].
const BATCH_TARGET: usize = 1 << 20;
/// Batches under way between caller and writer.
const QUEUE_LENGTH: usize = 4;
/// Zstandard's fast level. Level 3 makes files 0.4 to 1 % smaller and takes longer: the last bits of waves are noise. They stay,
/// because readers shall find the numbers that were computed, in a form that needs no code of ours.
const ZSTD_LEVEL: u32 = 1;

/// Compression of chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compression {
    /// None.
    None,
    /// LZ4.
    Lz4,
    /// Zstandard, level 1.
    Zstd,
}

/// Why a recording failed.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file exists and may not be overwritten.
    #[error("`{}` exists; choose another output with -o, or overwrite it with --force", .0.display())]
    Exists(PathBuf),
    /// The file cannot be created.
    #[error("cannot create `{}`: {error}", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: io::Error,
    },
    /// Writing failed; what is on disk is incomplete and says so by its missing end.
    #[error("cannot write `{}`: {error}; the file is incomplete", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why not.
        error: Box<McapError>,
    },
}

/// One channel of a recording.
#[derive(Clone, Debug)]
pub struct ChannelSpec {
    /// Topic.
    pub topic: String,
    /// Full name of the message type.
    pub schema: String,
    /// Serialised `FileDescriptorSet` of the message type.
    pub descriptors: Vec<u8>,
    /// Units, meanings and axes of the fields.
    pub metadata: BTreeMap<String, String>,
}

/// Messages on their way to the writer.
#[derive(Default)]
pub struct Batch {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
    /// What messages are to be made from \[bytes\].
    waiting: usize,
}

enum Entry {
    /// A message and where its bytes end.
    Message { channel: usize, log_time: u64, end: usize },
    /// Work that makes messages.
    Later(Box<dyn FnOnce(&mut Batch) + Send>),
    /// A place where a chunk may end.
    EndOfStep,
}

impl Batch {
    /// Adds a message.
    ///
    /// * `channel`: number of the channel
    /// * `log_time`: log and publish time \[ns\]
    pub fn put(&mut self, channel: usize, log_time: u64, message: &impl Message) {
        message.encode(&mut self.bytes).expect("a Vec grows");
        self.entries.push(Entry::Message { channel, log_time, end: self.bytes.len() });
    }
}

enum Job {
    Messages(Batch),
    Attachment { name: String, media_type: String, data: Vec<u8> },
    Metadata { name: String, entries: BTreeMap<String, String> },
    Channels(Vec<ChannelSpec>),
    Tap(Box<dyn Tap>),
    Finish,
}

/// Somebody who gets every message that is written, on the thread that writes.
pub trait Tap: Send {
    /// Takes a message.
    ///
    /// * `channel`: its number
    /// * `log_time`: its log time \[ns\]
    fn message(&mut self, channel: usize, log_time: u64, bytes: &[u8]);
}

/// Creates a file, a new one unless it may be overwritten.
pub(crate) fn create_file(path: &Path, overwrite: bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true);
    if overwrite {
        options.create(true).truncate(true)
    } else {
        options.create_new(true)
    };
    options.open(path)
}

/// An MCAP file being written.
pub struct Recorder {
    path: PathBuf,
    queue: Option<SyncSender<Job>>,
    spare: Receiver<Batch>,
    writer: Option<JoinHandle<Result<(), McapError>>>,
    batch: Batch,
}

impl Recorder {
    /// Creates the file.
    ///
    /// * `overwrite`: replace what is at `path`
    ///
    /// # Errors
    ///
    /// The file exists, or cannot be created.
    pub fn create(path: &Path, overwrite: bool, compression: Compression) -> Result<Self, RecordingError> {
        let file = create_file(path, overwrite).map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => RecordingError::Exists(path.into()),
            _ => RecordingError::Create { path: path.into(), error },
        })?;
        let (queue, jobs) = sync_channel(QUEUE_LENGTH);
        let (give_back, spare) = sync_channel(QUEUE_LENGTH);
        let writer = std::thread::Builder::new()
            .name("recording".into())
            .spawn(move || write(file, compression, &jobs, &give_back))
            .map_err(|error| RecordingError::Create { path: path.into(), error })?;
        Ok(Self {
            path: path.into(),
            queue: Some(queue),
            spare,
            writer: Some(writer),
            batch: Batch::default(),
        })
    }

    /// Declares the channels, numbered from 0 in this order.
    ///
    /// # Errors
    ///
    /// As for all methods below: the first error of the writer.
    pub fn channels(&mut self, channels: Vec<ChannelSpec>) -> Result<(), RecordingError> {
        self.send(Job::Channels(channels))
    }

    /// Hands every message from here on to `tap` too.
    ///
    /// # Errors
    ///
    /// The first error of the writer.
    pub fn tap(&mut self, tap: Box<dyn Tap>) -> Result<(), RecordingError> {
        self.send_batch()?;
        self.send(Job::Tap(tap))
    }

    /// Gives the writer what has been collected for it.
    ///
    /// # Errors
    ///
    /// The first error of the writer.
    pub fn hand_over(&mut self) -> Result<(), RecordingError> {
        self.send_batch()
    }

    /// Where messages are collected for the writer.
    pub fn batch(&mut self) -> &mut Batch {
        &mut self.batch
    }

    /// Gives the writer what has been collected for it, once that is worth it.
    ///
    /// # Errors
    ///
    /// The first error of the writer.
    pub fn hand_over_if_full(&mut self) -> Result<(), RecordingError> {
        if self.batch.bytes.len() + self.batch.waiting >= BATCH_TARGET { self.send_batch() } else { Ok(()) }
    }

    /// Leaves it to the writer to make messages; they come after those that were added before.
    ///
    /// * `size`: what they are made from \[bytes\]
    ///
    /// # Errors
    ///
    /// The first error of the writer.
    pub fn later(
        &mut self,
        size: usize,
        make: Box<dyn FnOnce(&mut Batch) + Send>,
    ) -> Result<(), RecordingError> {
        self.batch.entries.push(Entry::Later(make));
        self.batch.waiting += size;
        self.hand_over_if_full()
    }

    /// Ends a step: once a chunk holds [`CHUNK_TARGET`], it is closed at the end of a step and survives a crash.
    pub fn end_step(&mut self) {
        self.batch.entries.push(Entry::EndOfStep);
    }

    /// Attaches a file; create and log time are 0.
    ///
    /// # Errors
    ///
    /// The first error of the writer.
    pub fn attach(&mut self, name: &str, media_type: &str, data: Vec<u8>) -> Result<(), RecordingError> {
        self.send_batch()?;
        self.send(Job::Attachment { name: name.into(), media_type: media_type.into(), data })
    }

    /// Writes a metadata record.
    ///
    /// # Errors
    ///
    /// The first error of the writer.
    pub fn metadata(&mut self, name: &str, entries: BTreeMap<String, String>) -> Result<(), RecordingError> {
        self.send_batch()?;
        self.send(Job::Metadata { name: name.into(), entries })
    }

    /// Writes the summary and waits until the file is complete.
    ///
    /// # Errors
    ///
    /// The first error of the writer.
    pub fn finish(&mut self) -> Result<(), RecordingError> {
        self.send_batch()?;
        self.send(Job::Finish)?;
        self.queue = None;
        self.join()
    }

    fn send_batch(&mut self) -> Result<(), RecordingError> {
        if self.batch.entries.is_empty() {
            return Ok(());
        }
        let next = self.spare.try_recv().unwrap_or_default();
        let batch = std::mem::replace(&mut self.batch, next);
        self.send(Job::Messages(batch))
    }

    fn send(&mut self, job: Job) -> Result<(), RecordingError> {
        match self.queue.as_ref().map(|queue| queue.send(job)) {
            Some(Ok(())) => Ok(()),
            // the writer is gone: it has failed, and says why
            _ => self.join(),
        }
    }

    fn join(&mut self) -> Result<(), RecordingError> {
        // the first error is told once, and whoever goes on after it does not get an Ok
        let writer = self.writer.take().expect("a recorder that has failed is not used again");
        match writer.join() {
            Ok(Ok(())) => Ok(()),
            Ok(Err(error)) => Err(RecordingError::Write { path: self.path.clone(), error: Box::new(error) }),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}

type Output = NoSeek<BufWriter<File>>;

/// How recordings are written.
pub(crate) fn write_options(compression: Compression) -> WriteOptions {
    WriteOptions::new()
        .profile("")
        .library(format!("percuss/{}", env!("CARGO_PKG_VERSION")))
        .compression(match compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        })
        .compression_level(if compression == Compression::Zstd { ZSTD_LEVEL } else { 0 })
        .compression_threads(0)
        .chunk_size(None)
        .use_chunks(true)
        .disable_seeking(true)
        .emit_summary_records(true)
        .emit_summary_offsets(true)
        .emit_message_indexes(true)
        .calculate_chunk_crcs(true)
        .calculate_data_section_crc(true)
        .calculate_summary_section_crc(true)
        .calculate_attachment_crcs(true)
}

/// The writer thread: from the first job to the last, then the summary.
fn write(
    file: File,
    compression: Compression,
    jobs: &Receiver<Job>,
    give_back: &SyncSender<Batch>,
) -> Result<(), McapError> {
    let (synchronise, chunks) = sync_channel(1);
    let same_file = file.try_clone()?;
    let synchroniser = std::thread::Builder::new().name("disk".into()).spawn(move || {
        let is_closed = |()| synchronised(same_file.sync_data());
        chunks.iter().try_for_each(is_closed)
    })?;
    let writer = write_options(compression).create(NoSeek::new(BufWriter::new(file)))?;
    let (sequences, made) = (Vec::new(), Batch::default());
    let mut scribe = Scribe { writer, give_back, synchronise, sequences, made, chunk: 0, tap: None };
    let result = jobs.iter().try_for_each(|job| scribe.carry_out(job));
    // taking the stream back keeps the writer from finishing a file that has failed or was given up
    let Scribe { writer, synchronise, .. } = scribe;
    let mut output = writer.into_inner().into_inner();
    drop(synchronise);
    let earlier = synchroniser.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    result?;
    // the system tells an error only once
    earlier?;
    output.flush()?;
    Ok(synchronised(output.get_ref().sync_all())?)
}

/// Pipes and devices cannot be synchronised, and need not be.
fn synchronised(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::InvalidInput => Ok(()),
        result => result,
    }
}

/// Who writes, and what has to be remembered about it.
struct Scribe<'a> {
    writer: Writer<Output>,
    give_back: &'a SyncSender<Batch>,
    /// To who sees to it that chunks reach the disk while others are made: then little is left to wait for at the end, and a
    /// machine that loses its power loses little.
    synchronise: SyncSender<()>,
    /// Number of the next message of every channel.
    sequences: Vec<u32>,
    /// Messages made here.
    made: Batch,
    /// Size of the messages in the open chunk \[bytes\].
    chunk: u64,
    tap: Option<Box<dyn Tap>>,
}

impl Scribe<'_> {
    fn carry_out(&mut self, job: Job) -> Result<(), McapError> {
        match job {
            Job::Messages(mut batch) => {
                self.write(&mut batch)?;
                // if there is no room for spares there are enough of them
                drop(self.give_back.try_send(batch));
                Ok(())
            }
            Job::Tap(tap) => {
                self.tap = Some(tap);
                Ok(())
            }
            Job::Attachment { name, media_type, data } => {
                let data = data.into();
                self.writer.attach(&Attachment { log_time: 0, create_time: 0, name, media_type, data })
            }
            Job::Metadata { name, entries } => {
                self.writer.write_metadata(&Metadata { name, metadata: entries })
            }
            Job::Finish => self.writer.finish().map(drop),
            Job::Channels(channels) => self.declare(channels),
        }
    }

    /// Writes the messages of a batch and empties it.
    fn write(&mut self, batch: &mut Batch) -> Result<(), McapError> {
        let mut start = 0;
        for entry in batch.entries.drain(..) {
            match entry {
                Entry::Message { channel, log_time, end } => {
                    let (bytes, sequence) = (&batch.bytes[start..end], self.sequences[channel]);
                    self.sequences[channel] = sequence.wrapping_add(1);
                    let header =
                        MessageHeader { channel_id: id(channel), sequence, log_time, publish_time: log_time };
                    self.writer.write_to_known_channel(&header, bytes)?;
                    self.chunk += MESSAGE_HEADER + bytes.len() as u64;
                    if let Some(tap) = &mut self.tap {
                        tap.message(channel, log_time, bytes);
                    }
                    start = end;
                }
                Entry::Later(make) => {
                    let mut made = std::mem::take(&mut self.made);
                    make(&mut made);
                    self.write(&mut made)?;
                    self.made = made;
                }
                Entry::EndOfStep if self.chunk >= CHUNK_TARGET => {
                    self.writer.flush()?;
                    self.chunk = 0;
                    // if it is still at an earlier chunk it will come to this one with a later one
                    _ = self.synchronise.try_send(());
                }
                Entry::EndOfStep => {}
            }
        }
        batch.bytes.clear();
        batch.waiting = 0;
        Ok(())
    }

    fn declare(&mut self, channels: Vec<ChannelSpec>) -> Result<(), McapError> {
        self.sequences = vec![0; channels.len()];
        channels.into_iter().enumerate().try_for_each(|(channel, spec)| {
            let schema = self.writer.add_schema(&spec.schema, "protobuf", &spec.descriptors)?;
            self.writer.add_channel_with_id(id(channel), schema, &spec.topic, "protobuf", &spec.metadata)?;
            Ok(())
        })
    }
}

/// Id of a channel in the file: they count from 1.
fn id(channel: usize) -> u16 {
    channel as u16 + 1
}
