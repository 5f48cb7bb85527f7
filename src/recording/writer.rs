//! The writer thread: compresses chunks and writes the file. Every option that reaches the bytes of the file is set here.

use std::{
    io::{self, BufWriter},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread::JoinHandle,
};

use crc32fast::Hasher;
use mcap::{McapError, WriteOptions, Writer, records::MessageHeader, write::NoSeek};
use percuss_output::{Counted, Left, Part};

use super::{
    Batch, CHUNK_TARGET, ChannelSpec, Compression, Entry, Job, MESSAGE_HEADER, Synchronise, Tap, Written,
    copy::{CopyError, for_each_message},
};

/// Zstandard's fast level. Level 3 makes files 0.4 to 1 % smaller and takes longer: the last bits of waves are noise. They
/// stay, because a recording has the computed numbers in a form that standard tools read.
const ZSTD_LEVEL: u32 = 1;

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

/// Handles jobs until the queue ends, then completes the file.
///
/// * `spent`: takes back empty batches for reuse
pub(super) fn run(
    file: Part,
    compression: Compression,
    synchronise: Synchronise,
    jobs: &Receiver<Job>,
    spent: SyncSender<Batch>,
) -> Result<(), McapError> {
    let handle = file.handle();
    let disk = Disk::new(handle.clone(), synchronise)?;
    let mut thread = WriterThread {
        writer: write_options(compression).create(NoSeek::new(BufWriter::new(file)))?,
        spent,
        disk,
        file: handle,
        written: Written::default(),
        hasher: Hasher::new(),
        deferred: Batch::default(),
        chunk: 0,
        tap: None,
        is_whole: false,
    };
    let result = jobs.iter().try_for_each(|job| job(&mut thread));
    // without its stream the writer does not finish a file that has failed or was abandoned
    let WriterThread { writer, disk, is_whole, .. } = thread;
    let output = writer.into_inner().into_inner();
    let earlier = disk.end();
    result?;
    // the system reports an error of the disk only once
    earlier?;
    let file = output.into_inner().map_err(|error| error.into_error())?;
    let is_lasting = synchronise != Synchronise::Never;
    if is_whole {
        file.commit(is_lasting)?;
    } else if is_lasting {
        file.synchronise()?;
    }
    Ok(())
}

/// Synchronises closed chunks with the disk.
enum Disk {
    /// On this thread, before the next chunk.
    Here(Counted),
    /// On a thread of its own, while others are written: the end of a run waits less.
    Beside(SyncSender<()>, JoinHandle<io::Result<()>>),
    Nowhere,
}

impl Disk {
    fn new(file: Counted, synchronise: Synchronise) -> io::Result<Self> {
        Ok(match synchronise {
            Synchronise::Chunk => Self::Here(file),
            Synchronise::End => {
                let (wake, closed_chunks) = sync_channel(1);
                let work = move || closed_chunks.iter().try_for_each(|()| file.synchronise());
                Self::Beside(wake, std::thread::Builder::new().name("disk".into()).spawn(work)?)
            }
            Synchronise::Never => Self::Nowhere,
        })
    }

    fn chunk(&self) -> io::Result<()> {
        match self {
            Self::Here(file) => file.synchronise(),
            Self::Beside(wake, _) => {
                // while it is busy with an earlier chunk, the next request covers this one too
                _ = wake.try_send(());
                Ok(())
            }
            Self::Nowhere => Ok(()),
        }
    }

    fn end(self) -> io::Result<()> {
        let Self::Beside(wake, thread) = self else { return Ok(()) };
        drop(wake);
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

/// The file, and what is under way to it.
pub(super) struct WriterThread {
    pub(super) writer: Writer<NoSeek<BufWriter<Part>>>,
    pub(super) spent: SyncSender<Batch>,
    disk: Disk,
    /// The same file, to synchronise it.
    file: Counted,
    written: Written,
    /// Of all messages.
    hasher: Hasher,
    /// Batch for deferred messages, reused.
    deferred: Batch,
    /// Size of the messages in the open chunk \[bytes\].
    chunk: u64,
    pub(super) tap: Option<Box<dyn Tap>>,
    /// True if the file gets its name.
    pub(super) is_whole: bool,
}

impl WriterThread {
    /// Brings all messages onto the disk, and returns what has been written.
    pub(super) fn seal(&mut self) -> Result<Written, McapError> {
        self.close_chunk()?;
        if !matches!(self.disk, Disk::Nowhere) {
            self.file.synchronise()?;
        }
        Ok(self.written())
    }

    /// Writes the messages of a batch and empties it.
    pub(super) fn write(&mut self, batch: &mut Batch) -> Result<(), McapError> {
        let mut start = 0;
        for entry in batch.entries.drain(..) {
            match entry {
                Entry::Message { channel, log_time, end } => {
                    let bytes = &batch.bytes[start..end];
                    let sequence = sequence(self.written.messages[channel]);
                    let header =
                        MessageHeader { channel_id: id(channel), sequence, log_time, publish_time: log_time };
                    self.put(channel, &header, bytes)?;
                    if let Some(tap) = &mut self.tap {
                        tap.message(channel, log_time, bytes);
                    }
                    start = end;
                }
                Entry::Deferred(make) => {
                    let mut deferred = std::mem::take(&mut self.deferred);
                    make(&mut deferred);
                    self.write(&mut deferred)?;
                    self.deferred = deferred;
                }
                Entry::EndOfStep if self.chunk >= CHUNK_TARGET => {
                    self.close_chunk()?;
                    self.disk.chunk()?;
                }
                Entry::EndOfStep => {}
            }
        }
        batch.bytes.clear();
        batch.deferred = 0;
        Ok(())
    }

    fn put(&mut self, channel: usize, header: &MessageHeader, bytes: &[u8]) -> Result<(), McapError> {
        let MessageHeader { channel_id, sequence, log_time, publish_time } = *header;
        self.hasher.update(&channel_id.to_le_bytes());
        self.hasher.update(&sequence.to_le_bytes());
        self.hasher.update(&[log_time.to_le_bytes(), publish_time.to_le_bytes()].concat());
        self.hasher.update(bytes);
        let size = MESSAGE_HEADER + bytes.len() as u64;
        self.chunk += size;
        let written = &mut self.written;
        written.messages[channel] += 1;
        written.bytes += size;
        written.largest_chunk = written.largest_chunk.max(self.chunk);
        self.writer.write_to_known_channel(header, bytes)
    }

    fn written(&self) -> Written {
        Written { checksum: self.hasher.clone().finalize(), ..self.written.clone() }
    }

    /// Ends the open chunk, if there is one, and hands all to the system.
    fn close_chunk(&mut self) -> Result<(), McapError> {
        self.chunk = 0;
        self.writer.flush()
    }

    /// Copies what an earlier run has left, up to what is counted as written, and takes its place. Chunks end where they did.
    pub(super) fn copy(&mut self, mut left: Left, expected: &Written) -> Result<(), CopyError> {
        let read = |what: String| CopyError::Read(what);
        let messages = &expected.messages;
        if messages.len() != self.written.messages.len() {
            let (found, expected) = (messages.len(), self.written.messages.len());
            return Err(read(format!("its checkpoint counts {found} channels, the case has {expected}")));
        }
        // with the schemas of all channels, which messages do not count
        let largest =
            usize::try_from(expected.largest_chunk.saturating_add(CHUNK_TARGET)).unwrap_or(usize::MAX);
        for_each_message(left.file(), largest, |found| match found {
            Some((header, bytes)) => {
                let channel = usize::from(header.channel_id).wrapping_sub(1);
                let next = self.written.messages.get(channel).filter(|count| **count < messages[channel]);
                if next.is_none_or(|count| sequence(*count) != header.sequence) {
                    let (sequence, id) = (header.sequence, header.channel_id);
                    return Err(read(format!(
                        "message {sequence} of channel {id} is not the next one that its checkpoint counts"
                    )));
                }
                self.put(channel, &header, bytes)?;
                Ok(true)
            }
            None => {
                self.close_chunk()?;
                Ok(self.written.messages != *messages)
            }
        })?;
        if self.written() != *expected {
            return Err(read("its messages are not those that its checkpoint belongs to".into()));
        }
        left.replace().map_err(|error| CopyError::Write(error.into()))
    }

    pub(super) fn declare(&mut self, channels: Vec<ChannelSpec>) -> Result<(), McapError> {
        self.written.messages = vec![0; channels.len()];
        channels.into_iter().enumerate().try_for_each(|(channel, spec)| {
            let schema = self.writer.add_schema(&spec.schema, "protobuf", &spec.descriptors)?;
            self.writer.add_channel_with_id(id(channel), schema, &spec.topic, "protobuf", &spec.metadata)?;
            Ok(())
        })
    }
}

/// Number in the file of the message that follows `messages` others of its channel.
fn sequence(messages: u64) -> u32 {
    // it wraps
    messages as u32
}

/// Id of a channel in the file, counted from 1.
fn id(channel: usize) -> u16 {
    channel as u16 + 1
}
