//! Opening a file and reading its records in order, with limits and checksums.
//!
//! The sans-io reader of the `mcap` crate does the parsing. Chunks are verified before any message of theirs comes
//! out, and no record or chunk larger than [`RECORD_LIMIT`] is taken into memory, whatever the file claims.

use std::{
    fs::File,
    io::{self, BufReader, Read},
    path::{Path, PathBuf},
};

use mcap::{
    McapError,
    records::{Record, op},
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

/// Largest record or chunk that is read, compressed or not \[bytes\].
pub const RECORD_LIMIT: usize = 256 << 20;

/// Why a file cannot be read at all.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The system refuses.
    #[error("cannot read `{}`: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The file does not begin like an MCAP file.
    #[error("`{}` is not an MCAP file: it does not begin with the MCAP magic bytes", .0.display())]
    NotMcap(PathBuf),
}

/// Where and why reading ended before the end of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Bytes that had been read.
    pub offset: u64,
    /// What is wrong there.
    pub reason: String,
}

/// The records of a file in the order of the file; those in chunks come out one by one.
pub struct Scan {
    path: PathBuf,
    file: BufReader<File>,
    reader: LinearReader,
    offset: u64,
    damage: Option<Damage>,
    footer_seen: bool,
    done: bool,
}

impl Scan {
    /// Opens a file and checks that it begins like an MCAP file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or is something else.
    pub fn open(path: &Path) -> Result<Self, OpenError> {
        let fail = |error| OpenError::Io { path: path.into(), error };
        let mut file = BufReader::new(File::open(path).map_err(fail)?);
        let mut magic = [0; mcap::MAGIC.len()];
        match file.read_exact(&mut magic) {
            Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => return Err(fail(error)),
            Err(_) => return Err(OpenError::NotMcap(path.into())),
            Ok(()) if magic != mcap::MAGIC => return Err(OpenError::NotMcap(path.into())),
            Ok(()) => {}
        }
        let options = LinearReaderOptions::default()
            .with_prevalidate_chunk_crcs(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_check_finishes_after_end_magic(true)
            .with_record_length_limit(RECORD_LIMIT);
        let mut reader = LinearReader::new_with_options(options);
        reader.insert(magic.len()).copy_from_slice(&magic);
        reader.notify_read(magic.len());
        Ok(Self {
            path: path.into(),
            file,
            reader,
            offset: magic.len() as u64,
            damage: None,
            footer_seen: false,
            done: false,
        })
    }

    /// Hands the next record to `take`; `None` at the end, whether sound or damaged.
    ///
    /// # Errors
    ///
    /// The system fails to read. Damage is no error: see [`Scan::damage`].
    pub fn next<T>(&mut self, take: impl FnOnce(Record<'_>) -> T) -> Result<Option<T>, OpenError> {
        loop {
            if self.done {
                return Ok(None);
            }
            // the borrow of an event's data must end before the reader is fed
            let need = match self.reader.next_event() {
                None => {
                    self.done = true;
                    continue;
                }
                Some(Ok(LinearReadEvent::ReadRequest(need))) => need,
                Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                    self.footer_seen |= opcode == op::FOOTER;
                    match parse(opcode, data) {
                        Ok(record) => return Ok(Some(take(record))),
                        Err(error) => {
                            let damage = Damage { offset: self.offset, reason: explain(&error) };
                            (self.damage, self.done) = (Some(damage), true);
                            continue;
                        }
                    }
                }
                Some(Err(error)) => {
                    let damage = Damage { offset: self.offset, reason: explain(&error) };
                    (self.damage, self.done) = (Some(damage), true);
                    continue;
                }
            };
            let buffer = self.reader.insert(need);
            let read = match self.file.read(buffer) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(OpenError::Io { path: self.path.clone(), error }),
                Ok(read) => read,
            };
            self.offset += read as u64;
            self.reader.notify_read(read);
        }
    }

    /// What ended the scan before the end of the recording, if anything.
    pub fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    /// True once the whole file has been read and was sound, from magic to magic.
    pub fn is_complete(&self) -> bool {
        self.done && self.damage.is_none() && self.footer_seen
    }
}

/// Parses a record; lengths inside it are checked where the parser trusts them.
fn parse(opcode: u8, data: &[u8]) -> Result<Record<'_>, McapError> {
    if opcode == op::ATTACHMENT && !attachment_fits(data) {
        return Err(McapError::BadAttachmentLength { header: 0, available: data.len() as u64 });
    }
    mcap::parse_record(opcode, data)
}

/// True if the header of an attachment, up to and including the length of its data, and a checksum are there.
fn attachment_fits(data: &[u8]) -> bool {
    const TIMES: usize = 16;
    const LENGTH: usize = 4;
    let text_end = |start: usize| {
        let length = data.get(start..start + LENGTH)?;
        let length = u32::from_le_bytes(length.try_into().ok()?) as usize;
        (start + LENGTH).checked_add(length)
    };
    let header = text_end(TIMES).and_then(text_end);
    header.is_some_and(|end| end.saturating_add(8 + 4) <= data.len())
}

fn explain(error: &McapError) -> String {
    match error {
        McapError::UnexpectedEof => "the file ends in the middle of a record".into(),
        other => other.to_string(),
    }
}
