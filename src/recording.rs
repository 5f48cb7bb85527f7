//! The recorder: messages, attachments and metadata into an MCAP file. It knows no physics.
//!
//! The caller encodes messages into batches; a writer thread compresses and writes them. The queue between them is
//! bounded: a slow disk slows the caller down, and no message is dropped. The first error of the writer ends the
//! recording and is returned by the next call. Messages can also be encoded on the writer thread, by deferred work.
//! Batches are large, because each one costs a computing thread on the same core its caches.
//!
//! Chunks are closed at the end of the step that fills them and written whole: after a crash every closed chunk can be read.
//!
//! Channels, metadata records and attachments of a recording are in the guide, `tools/guide/src/recording.md`, the history of the format in
//! `changelog.md` there. Units and meanings of all fields are in the metadata of their channels.
//!
//! What holds when something fails is there too, and in `guarantees.md`: a recording is written as `NAME.mcap.part` and gets its name once it is
//! whole; how a run continues from what is left is in [`crate::checkpoint`].

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread::JoinHandle,
};

use mcap::{Attachment, McapError, records::Metadata};
use percuss_output::{Left, Part, PartError, cause};
use prost::Message;
use serde::{Deserialize, Serialize};

pub(crate) mod copy;
pub(crate) mod writer;

use copy::CopyError;
use writer::WriterThread;

/// Version of the recording format, `major.minor`: readers of the same major version understand it.
///
/// * 1.0: the first.
/// * 1.1: slices of a field have one shape; force, mass and energy of plane runs are per length, in units of their own;
///   `Event.since`.
/// * 1.2: `Energy.damped`; order and damping of the scheme in the run record.
/// * 2.0: physical cases are recorded in SI, with their scales in the run record; shapes are geometry (`nose_radius`, `slope`).
/// * 2.1: mass, force and energy of physical plane cases are those of the whole body and contact, in 2.0 of the half x ≥ 0.
/// * 2.2: targets of several layers and with a free back: `FieldSlice.z`, `LineSlice.s`, `Energy.layer_strain`, `Energy.layer_kinetic`,
///   `Event.interface`; layers and back in the run record. Other recordings have nothing new.
/// * 2.3: `impact_velocity`, `mesh_loss`, `interface.<n>.tension` and `interface.<n>.shear` in `percuss.validity`, in an indenter `indenter.interface.<n>.tension` and so on; `Energy.residual` is absent where waves are damped; the record `percuss.summary`.
///   `percuss.Sensor`. Graded meshes: `FieldSlice.r`, `InterfaceStress.r`, `LineSlice.s` along r, too; the record `percuss.mesh`.
pub const FORMAT_VERSION: &str = "2.3";

/// Revision of the numerics: results of the same revision are the same bit for bit. It changes with the golden digests, which a
/// test of theirs (`tests/golden.rs`) demands.
///
/// * 1: the first that recordings and checkpoints carry;
/// * 2: products are fused with the sums they are added to;
/// * 3: a free back lies half a row of cells below the last row of nodes; what is computed does not depend on what is recorded; the extension of a head that spreads is the turn of its contact; strengths that are passed are events on all meshes;
/// * 4: on graded meshes lateral damping takes as much per cell where cells are wide as where they are narrow, and contact radii are found from pressure and gap.
pub const NUMERICS: u32 = 4;

/// Uncompressed size at which a chunk is closed \[bytes\]: smaller ones lose less in a crash and cost more index. From 256 KiB
/// to 4 MiB the size of the file differs by 0.2 % and the time by less than can be measured.
pub const CHUNK_TARGET: u64 = 4 << 20;

/// Size of a message in a chunk without its bytes: opcode and length of the record, channel, sequence, two times \[bytes\].
pub(crate) const MESSAGE_HEADER: u64 = 31;
/// Size at which a batch goes to the writer thread \[bytes\].
const BATCH_TARGET: usize = 1 << 20;
/// Batches in the queue between caller and writer.
const QUEUE_LENGTH: usize = 4;

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

/// When a recording is synchronised with the disk.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Synchronise {
    /// Every chunk before the next one: a power failure loses the open chunk only
    Chunk,
    /// The whole file before it gets its name
    #[default]
    End,
    /// Whenever the system does it
    Never,
}

/// Where a recording goes, and how.
#[derive(Clone, Debug)]
pub struct Destination {
    /// The file.
    pub path: PathBuf,
    /// Replace a file of this name, and what an earlier run has left of one.
    pub overwrite: bool,
    /// When it is synchronised with the disk.
    pub synchronise: Synchronise,
    /// Leave out what differs from run to run: the same program writes the same bytes.
    pub reproducible: bool,
}

impl Destination {
    /// A new file, synchronised at its end.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), overwrite: false, synchronise: Synchronise::default(), reproducible: false }
    }
}

/// Why a recording failed.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file cannot be begun.
    #[error(transparent)]
    Begin(#[from] PartError),
    /// Writing failed; the file is incomplete and lacks its end.
    #[error("cannot write `{}`: {}; the file is incomplete, its closed chunks can be read", .0.display(), cause(&**.1))]
    Write(PathBuf, Box<McapError>),
    /// What an earlier run has recorded cannot be read up to its checkpoint.
    #[error("cannot continue `{path}`: {1}; begin the run anew with --force in place of --resume", path = .0.display())]
    Continue(PathBuf, String),
}

/// CRC-32 of the entries of a metadata record in the order of their keys, each key and value followed by a zero: MCAP has no checksum of
/// its own for such records, only one of the whole file, which no reader of a part of it can compare.
fn checksum(entries: &BTreeMap<String, String>) -> String {
    let mut hasher = crc32fast::Hasher::new();
    for text in entries.iter().flat_map(|(key, value)| [key, value]) {
        hasher.update(text.as_bytes());
        hasher.update(&[0]);
    }
    format!("{:08x}", hasher.finalize())
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

/// What has been written of a recording: a checkpoint belongs to these messages and no others.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Written {
    /// Messages of every channel.
    pub messages: Vec<u64>,
    /// Size of all messages \[bytes\].
    pub bytes: u64,
    /// Size of the messages of the largest chunk \[bytes\].
    pub largest_chunk: u64,
    /// CRC-32 of all messages in the order of the file, each with its channel, number and times.
    pub checksum: u32,
}

#[derive(Default)]
pub(crate) struct Batch {
    bytes: Vec<u8>,
    entries: Vec<Entry>,
    /// Memory that deferred work holds \[bytes\].
    deferred: usize,
}

enum Entry {
    /// A message and the end of its bytes.
    Message { channel: usize, log_time: u64, end: usize },
    /// Work that encodes messages on the writer thread.
    Deferred(Box<dyn FnOnce(&mut Batch) + Send>),
    /// A chunk can end here.
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

type Job = Box<dyn FnOnce(&mut WriterThread) -> Result<(), McapError> + Send>;

/// Receiver of every message that is written, on the writer thread.
pub trait Tap: Send {
    /// Takes a message.
    ///
    /// * `channel`: its number
    /// * `log_time`: its log time \[ns\]
    fn message(&mut self, channel: usize, log_time: u64, bytes: &[u8]);
}

/// An MCAP file being written.
pub(crate) struct Recorder {
    /// Name of the file as long as it is being written.
    path: PathBuf,
    queue: Option<SyncSender<Job>>,
    /// Empty batches for reuse.
    spare: Receiver<Batch>,
    writer: Option<JoinHandle<Result<(), McapError>>>,
    /// Collects messages for the writer.
    pub batch: Batch,
}

impl Recorder {
    /// Begins the file. Errors of all methods below are the first one of the writer.
    pub fn create(destination: &Destination, compression: Compression) -> Result<Self, RecordingError> {
        Self::with_file(Part::create(&destination.path, destination.overwrite)?, destination, compression)
    }

    /// Begins the file anew, beside what an earlier run has left of it, for [`Recorder::copy`].
    pub fn resume(
        destination: &Destination,
        compression: Compression,
    ) -> Result<(Self, Left), RecordingError> {
        let (file, left) = Part::resume(&destination.path, destination.overwrite)?;
        Ok((Self::with_file(file, destination, compression)?, left))
    }

    fn with_file(
        file: Part,
        destination: &Destination,
        compression: Compression,
    ) -> Result<Self, RecordingError> {
        let Destination { path, synchronise, .. } = destination;
        let (queue, jobs) = sync_channel(QUEUE_LENGTH);
        let (spent, spare) = sync_channel(QUEUE_LENGTH);
        let (path, synchronise) = (file.path().unwrap_or(path).to_owned(), *synchronise);
        let writer = std::thread::Builder::new()
            .name("recording".into())
            .spawn(move || writer::run(file, compression, synchronise, &jobs, spent))
            .map_err(|error| PartError::System { path: path.clone(), error })?;
        Ok(Self { path, queue: Some(queue), spare, writer: Some(writer), batch: Batch::default() })
    }

    /// Declares the channels, numbered from 0 in this order.
    pub fn channels(&mut self, channels: Vec<ChannelSpec>) -> Result<(), RecordingError> {
        self.send(move |thread| thread.declare(channels))
    }

    /// Passes every message from here on to `tap` too.
    pub fn tap(&mut self, tap: Box<dyn Tap>) -> Result<(), RecordingError> {
        self.send(move |thread| {
            thread.tap = Some(tap);
            Ok(())
        })
    }

    /// Sends the batch to the writer.
    pub fn hand_over(&mut self) -> Result<(), RecordingError> {
        if self.batch.entries.is_empty() {
            return Ok(());
        }
        let next = self.spare.try_recv().unwrap_or_default();
        let mut batch = std::mem::replace(&mut self.batch, next);
        self.push(move |thread| {
            thread.write(&mut batch)?;
            // a full queue has enough spare batches
            drop(thread.spent.try_send(batch));
            Ok(())
        })
    }

    /// Sends the batch to the writer if it is full.
    pub fn hand_over_if_full(&mut self) -> Result<(), RecordingError> {
        if self.batch.bytes.len() + self.batch.deferred >= BATCH_TARGET { self.hand_over() } else { Ok(()) }
    }

    /// Adds messages that are encoded on the writer thread, after those added before.
    ///
    /// * `size`: memory that `make` holds \[bytes\]
    pub fn defer(
        &mut self,
        size: usize,
        make: Box<dyn FnOnce(&mut Batch) + Send>,
    ) -> Result<(), RecordingError> {
        self.batch.entries.push(Entry::Deferred(make));
        self.batch.deferred += size;
        self.hand_over_if_full()
    }

    /// Ends a step, where a chunk that holds [`CHUNK_TARGET`] is closed.
    pub fn end_step(&mut self) {
        self.batch.entries.push(Entry::EndOfStep);
    }

    /// Copies the first messages of what an earlier run has left, in their order, and takes its place once they are on the
    /// disk. Until then it stays.
    ///
    /// * `written`: those
    pub fn copy(&mut self, left: Left, written: Written) -> Result<(), RecordingError> {
        let copied = self.ask(move |thread| match thread.copy(left, &written) {
            Ok(()) => Ok(Ok(())),
            Err(CopyError::Read(what)) => Ok(Err(what)),
            Err(CopyError::Write(error)) => Err(error),
        })?;
        copied.map_err(|what| RecordingError::Continue(self.path.clone(), what))
    }

    /// Closes the open chunk, waits until all messages are on the disk, and returns what has been written.
    pub fn seal(&mut self) -> Result<Written, RecordingError> {
        self.ask(WriterThread::seal)
    }

    /// Attaches a file; create and log time are 0.
    pub fn attach(&mut self, name: &str, media_type: &str, data: Vec<u8>) -> Result<(), RecordingError> {
        let (name, media_type, data) = (name.into(), media_type.into(), data.into());
        let attachment = Attachment { log_time: 0, create_time: 0, name, media_type, data };
        self.send(move |thread| thread.writer.attach(&attachment))
    }

    /// Writes a metadata record, with a checksum among its entries.
    pub fn metadata(
        &mut self,
        name: &str,
        mut entries: BTreeMap<String, String>,
    ) -> Result<(), RecordingError> {
        entries.insert("checksum".into(), checksum(&entries));
        let metadata = Metadata { name: name.into(), metadata: entries };
        self.send(move |thread| thread.writer.write_metadata(&metadata))
    }

    /// Writes the summary and waits until it is on the disk.
    ///
    /// * `is_whole`: the file gets its name; else it keeps that of a part
    pub fn finish(&mut self, is_whole: bool) -> Result<(), RecordingError> {
        self.send(move |thread| {
            thread.is_whole = is_whole;
            thread.writer.finish().map(drop)
        })?;
        self.queue = None;
        self.join()
    }

    fn ask<T: Send + 'static>(
        &mut self,
        job: impl FnOnce(&mut WriterThread) -> Result<T, McapError> + Send + 'static,
    ) -> Result<T, RecordingError> {
        let (sender, answer) = sync_channel(1);
        self.send(move |thread| {
            drop(sender.send(job(thread)?));
            Ok(())
        })?;
        match answer.recv() {
            Ok(answer) => Ok(answer),
            Err(_) => Err(self.join().expect_err("a writer that ends without an answer has failed")),
        }
    }

    /// Hands work to the writer thread, behind the batch.
    fn send(
        &mut self,
        job: impl FnOnce(&mut WriterThread) -> Result<(), McapError> + Send + 'static,
    ) -> Result<(), RecordingError> {
        self.hand_over()?;
        self.push(job)
    }

    fn push(
        &mut self,
        job: impl FnOnce(&mut WriterThread) -> Result<(), McapError> + Send + 'static,
    ) -> Result<(), RecordingError> {
        match self.queue.as_ref().map(|queue| queue.send(Box::new(job))) {
            Some(Ok(())) => Ok(()),
            // the writer has failed and returns its error
            _ => self.join(),
        }
    }

    fn join(&mut self) -> Result<(), RecordingError> {
        // the error of the writer is returned once; a further call panics instead of returning Ok
        let writer = self.writer.take().expect("a recorder that has failed is not used again");
        match writer.join() {
            Ok(Ok(())) => Ok(()),
            Ok(Err(error)) => Err(RecordingError::Write(self.path.clone(), Box::new(error))),
            Err(panic) => std::panic::resume_unwind(panic),
        }
    }
}
