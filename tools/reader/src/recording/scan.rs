//! The records of a file, one after the other.

mod outer;
mod search;

use std::{
    borrow::Cow,
    collections::HashSet,
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use mcap::{
    MAGIC,
    records::{ChunkIndex, Record, op},
    sans_io::linear_reader::{LinearReadEvent, LinearReader},
};

use super::{
    CHECKSUMS_COUNT, Damage, Index, Limits,
    file::open_file,
    index::PREFIX,
    parse::{block, explain, parse},
    unreadable,
};
use crate::{failure::Failure, text::short};

/// Where the bytes of a recording come from.
pub trait Source: Read + Seek + Send {}

impl<T: Read + Seek + Send> Source for T {}

/// A file that is open and its summary, both read any number of times.
#[derive(Clone, Debug)]
pub(crate) struct Opened {
    file: Arc<Mutex<File>>,
    /// Empty if there is none.
    pub(crate) index: Arc<Index>,
}

impl Opened {
    /// * `path`: its name in errors
    pub(crate) fn of(file: File, path: &Path, limits: Limits) -> Result<Self, Failure> {
        let file = Arc::new(Mutex::new(file));
        let mut reader = Reader { file: file.clone(), position: 0 };
        let index = Index::read(&mut reader, limits).map_err(unreadable(path))?.unwrap_or_default();
        Ok(Self { file, index: Arc::new(index) })
    }

    pub(crate) fn scan(&self, path: &Path, limits: Limits) -> Result<Scan, Failure> {
        let reader = Reader { file: self.file.clone(), position: 0 };
        Scan::indexed(Box::new(reader), self.index.clone(), path, limits)
    }
}

/// A place in a file that is shared.
struct Reader {
    file: Arc<Mutex<File>>,
    position: u64,
}

impl Reader {
    /// The file, alone for this reader.
    fn file(&self) -> MutexGuard<'_, File> {
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Read for Reader {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let mut file = self.file();
        file.seek(SeekFrom::Start(self.position))?;
        let read = file.read(bytes)?;
        drop(file);
        self.position += read as u64;
        Ok(read)
    }
}

impl Seek for Reader {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.position = match to {
            SeekFrom::Start(position) => position,
            SeekFrom::Current(by) => self.position.saturating_add_signed(by),
            SeekFrom::End(_) => self.file().seek(to)?,
        };
        Ok(self.position)
    }
}

/// Damages after which reading is given up.
const MAX_DAMAGES: usize = 1000;

/// Buffers larger than that are given back once a chunk has been read \[bytes\].
const LARGE: usize = 16 << 20;

/// A record and where it stands.
pub struct FileRecord<'a> {
    /// Offset of the record in the file, or of the chunk it is in.
    pub offset: u64,
    /// Offset in the uncompressed content of its chunk, if it is in one.
    pub inside: Option<u64>,
    /// The record. A chunk comes with its header only; what is in it follows, once its checksum is verified.
    pub record: Record<'a>,
    /// The content of an attachment that has no room: it is verified, and empty in the record.
    pub left_out: Option<LeftOut>,
}

/// A content that has no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LeftOut {
    /// Its size \[bytes\].
    pub size: u64,
    /// Its checksum.
    pub crc: u32,
}

impl LeftOut {
    /// In words, where it is wanted.
    pub(crate) fn refusal(self, name: &str) -> String {
        let (name, size) = (short(name), self.size);
        format!("attachment `{name}`: its {size} bytes are more than --max-memory allows")
    }
}

/// Reads the records of a file in its order; those in chunks come out one by one.
pub struct Scan {
    path: PathBuf,
    source: BufReader<Box<dyn Source>>,
    limits: Limits,
    length: u64,
    position: u64,
    body: Vec<u8>,
    decompressor: Option<LinearReader>,
    open: Option<Open>,
    index: Arc<Index>,
    skip: HashSet<u64>,
    crc: Option<crc32fast::Hasher>,
    damages: Vec<Damage>,
    /// Damages that were there before anything was read.
    noted: usize,
    grows: bool,
    part: Part,
    /// What of the record that was read last had no room.
    left_out: Option<LeftOut>,
}

/// The chunk that is being decompressed.
struct Open {
    offset: u64,
    end: u64,
    inside: u64,
    is_large: bool,
    refusal: Option<String>,
}

/// Part of the file that is being read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Data,
    Summary,
    Over,
}

impl Scan {
    /// Opens a file and checks that it begins like an MCAP file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or is something else.
    pub fn open(path: &Path, limits: Limits) -> Result<Self, Failure> {
        Opened::of(open_file(path)?, path, limits)?.scan(path, limits)
    }

    /// Reads from any source of bytes; `path` is its name in errors.
    ///
    /// # Errors
    ///
    /// The source cannot be read, or is something else.
    pub fn of(mut source: Box<dyn Source>, path: &Path, limits: Limits) -> Result<Self, Failure> {
        let index = Index::read(&mut source, limits).map_err(unreadable(path))?.unwrap_or_default();
        Self::indexed(source, Arc::new(index), path, limits)
    }

    fn indexed(
        source: Box<dyn Source>,
        index: Arc<Index>,
        path: &Path,
        limits: Limits,
    ) -> Result<Self, Failure> {
        let mut source = BufReader::with_capacity(1 << 16, source);
        let io = |error| Failure::Read { path: path.into(), error };
        let length = source.seek(SeekFrom::End(0)).map_err(io)?;
        source.seek(SeekFrom::Start(0)).map_err(io)?;
        let mut magic = [0; MAGIC.len()];
        match source.read_exact(&mut magic) {
            Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => return Err(io(error)),
            Ok(()) if magic == MAGIC => {}
            Err(_) | Ok(()) => {
                return Err(Failure::Failed(format!(
                    "`{}` is not an MCAP file: it does not begin with the MCAP magic bytes",
                    path.display()
                )));
            }
        }
        let mut crc = crc32fast::Hasher::new();
        crc.update(&magic);
        Ok(Self {
            path: path.into(),
            source,
            limits,
            length,
            position: MAGIC.len() as u64,
            body: Vec::new(),
            decompressor: None,
            open: None,
            index,
            skip: HashSet::new(),
            crc: Some(crc),
            damages: Vec::new(),
            noted: 0,
            grows: false,
            part: Part::Data,
            left_out: None,
        })
    }

    /// Leaves out chunks that are not wanted, where the file has an index. The checksum over the whole file cannot
    /// be verified then; that of every chunk that is read still is.
    pub fn only(&mut self, wanted: impl Fn(&ChunkIndex) -> bool) {
        let unwanted = self.index.chunks.values().filter(|chunk| !wanted(chunk));
        self.skip = unwanted.map(|chunk| chunk.chunk_start_offset).collect();
        if !self.skip.is_empty() {
            self.crc = None;
        }
    }

    /// Adds what was refused to the damages, before anything is read.
    pub(crate) fn note(&mut self, refused: &[Damage]) {
        self.damages.extend_from_slice(refused);
        self.noted += refused.len();
    }

    /// True if anything of what was read was damaged.
    fn has_damage(&self) -> bool {
        self.damages.len() > self.noted
    }

    /// Waits for more at the end of a file that has no footer yet: no record instead of damage.
    pub fn follow(&mut self) {
        self.grows = true;
    }

    /// Continues at a record of the file, a chunk for example. The checksum over the whole file cannot be verified then; that
    /// of every chunk that is read still is.
    pub fn go_to(&mut self, offset: u64) -> Result<(), Failure> {
        // the index may say anything
        self.seek(offset.min(self.length)).map_err(unreadable(&self.path))?;
        (self.open, self.crc, self.part) = (None, None, Part::Data);
        Ok(())
    }

    /// The summary of the file, empty if there is none.
    pub fn index(&self) -> &Arc<Index> {
        &self.index
    }

    /// What was wrong so far.
    pub fn damages(&self) -> &[Damage] {
        &self.damages
    }

    /// True at the end; false as long as a file that is being written may grow.
    pub fn is_over(&self) -> bool {
        self.part == Part::Over
    }

    /// True once the whole file has been read and was sound, from magic to magic.
    pub fn is_complete(&self) -> bool {
        self.part == Part::Over && self.damages.is_empty()
    }

    /// Hands the next record to `take`; `None` at the end, or where a file that is being written holds no further whole
    /// record for now.
    ///
    /// # Errors
    ///
    /// The system fails to read; of damage see [`Scan::damages`].
    pub fn next<T>(&mut self, take: impl FnOnce(FileRecord<'_>) -> T) -> Result<Option<T>, Failure> {
        let mut take = Some(take);
        loop {
            if let Some(taken) = self.next_in_chunk(&mut take) {
                return Ok(Some(taken));
            }
            if self.is_over() {
                return Ok(None);
            }
            let next = self.outer().map_err(|error| self.explain(&error))?;
            match next {
                Outer::Again => {}
                Outer::Pending => return Ok(None),
                Outer::Record { offset, opcode } => {
                    if let Some(taken) = self.take_body(offset, opcode, &mut take) {
                        return Ok(Some(taken));
                    }
                }
            }
        }
    }

    /// Hands the records one by one to `take`, up to the end or to where a file that is being written holds no further
    /// whole record for now.
    pub fn for_each(&mut self, mut take: impl FnMut(FileRecord<'_>)) -> Result<(), Failure> {
        while self.next(&mut take)?.is_some() {}
        Ok(())
    }

    /// The same until `take` returns something.
    pub fn find_map<T>(
        &mut self,
        mut take: impl FnMut(FileRecord<'_>) -> Option<T>,
    ) -> Result<Option<T>, Failure> {
        while let Some(taken) = self.next(&mut take)? {
            if taken.is_some() {
                return Ok(taken);
            }
        }
        Ok(None)
    }

    /// Hands the next record of the open chunk to `take`; the chunk is closed where there is none.
    fn next_in_chunk<T, F: FnOnce(FileRecord<'_>) -> T>(&mut self, take: &mut Option<F>) -> Option<T> {
        if let Some((reason, open)) = self.open.as_mut().and_then(|open| Some((open.refusal.take()?, open))) {
            let (offset, bytes) = (open.offset, open.end - open.offset);
            self.open = None;
            self.damage(offset, bytes, reason);
            return None;
        }
        let (Some(open), Some(decompressor)) = (&mut self.open, &mut self.decompressor) else { return None };
        let (offset, start) = (open.offset, open.inside);
        let reason = match decompressor.next_event() {
            // the whole chunk was fed: it wants the next record of the file
            None | Some(Ok(LinearReadEvent::ReadRequest(_))) => None,
            Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                open.inside = start + PREFIX + data.len() as u64;
                match parse(opcode, data, self.limits.record()) {
                    Ok(Record::Chunk { .. }) => Some("a chunk inside a chunk".into()),
                    Ok(record) => {
                        let found = FileRecord { offset, inside: Some(start), record, left_out: None };
                        return take.take().map(|take| take(found));
                    }
                    Err(reason) => Some(reason),
                }
            }
            Some(Err(error)) => Some(explain(&error)),
        };
        let (bytes, is_large) = (open.end - offset, open.is_large);
        self.open = None;
        if is_large || reason.is_some() {
            self.decompressor = None;
        }
        if let Some(reason) = reason {
            self.damage(offset, bytes, reason);
        }
        None
    }

    /// Hands the record of the file that has just been read to `take`, a chunk without its content.
    fn take_body<T, F: FnOnce(FileRecord<'_>) -> T>(
        &mut self,
        offset: u64,
        opcode: u8,
        take: &mut Option<F>,
    ) -> Option<T> {
        let record = match parse(opcode, &self.body, self.limits.record()) {
            Ok(Record::Chunk { header, .. }) => Record::Chunk { header, data: Cow::Borrowed(&[]) },
            Ok(record) => record,
            Err(reason) => {
                // that of a chunk is reported once it is decompressed
                if opcode != op::CHUNK {
                    self.damage(offset, PREFIX + self.body.len() as u64, reason);
                }
                return None;
            }
        };
        let found = FileRecord { offset, inside: None, record, left_out: self.left_out };
        let taken = take.take().map(|take| take(found));
        // the decompressor has a copy of a chunk
        if opcode == op::CHUNK && self.body.len() > LARGE {
            self.body = Vec::new();
        }
        taken
    }

    /// Where the system fails to read, and why.
    fn explain(&self, error: &io::Error) -> Failure {
        let why = match error.kind() {
            io::ErrorKind::UnexpectedEof => "the file has become shorter while it was read".to_owned(),
            _ => error.to_string(),
        };
        let text = format!("{why} (near byte {})", self.position);
        Failure::Read { path: self.path.clone(), error: io::Error::new(error.kind(), text) }
    }

    fn damage(&mut self, offset: u64, bytes: u64, reason: String) {
        self.damages.push(Damage { offset, bytes, reason });
        if self.damages.len() >= MAX_DAMAGES + self.noted {
            let rest = self.length.saturating_sub(self.position);
            let reason = "so many damages that the rest is not read".into();
            self.damages.push(Damage { offset: self.position, bytes: rest, reason });
            self.part = Part::Over;
        }
    }
}

/// Whether a record of the file has been read.
enum Outer {
    Record { offset: u64, opcode: u8 },
    Pending,
    Again,
}
