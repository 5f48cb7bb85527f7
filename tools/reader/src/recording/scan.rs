//! The records of a file, one after the other.

use std::{
    borrow::Cow,
    collections::HashSet,
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    sync::Arc,
};

use mcap::{
    MAGIC,
    records::{ChunkIndex, Record, op},
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

use super::{
    Damage, Index, Limits, OpenError,
    index::PREFIX,
    parse::{explain, parse},
};

/// Where the bytes of a recording come from.
pub trait Source: Read + Seek + Send {}

impl<T: Read + Seek + Send> Source for T {}

/// Damages after which reading is given up.
const MAX_DAMAGES: usize = 1000;

/// Buffers larger than that are given back once a chunk has been read \[bytes\].
const LARGE: usize = 16 << 20;

/// A record and where it stands.
pub struct Found<'a> {
    /// Offset of the record in the file, or of the chunk it is in.
    pub offset: u64,
    /// Offset in the unpacked content of its chunk, if it is in one.
    pub inside: Option<u64>,
    /// The record. A chunk comes with its header only; what is in it follows, once it has proved sound.
    pub record: Record<'a>,
}

/// What comes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next<T> {
    /// A record, and what was made of it.
    Record(T),
    /// The file may still be growing, and holds no further whole record now.
    Pending,
    /// The end.
    End,
}

/// Reads the records of a file in its order; those in chunks come out one by one.
pub struct Scan {
    path: PathBuf,
    source: BufReader<Box<dyn Source>>,
    limits: Limits,
    length: u64,
    position: u64,
    read: u64,
    body: Vec<u8>,
    unpacker: Option<LinearReader>,
    open: Option<Open>,
    index: Arc<Index>,
    skip: HashSet<u64>,
    crc: Option<crc32fast::Hasher>,
    damages: Vec<Damage>,
    /// Damages that were there before anything was read.
    noted: usize,
    grows: bool,
    part: Part,
}

/// The chunk that is being unpacked.
struct Open {
    offset: u64,
    end: u64,
    inside: u64,
    is_large: bool,
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
    pub fn open(path: &Path, limits: Limits) -> Result<Self, OpenError> {
        let file = File::open(path).map_err(OpenError::io(path))?;
        Self::of(Box::new(file), path, limits)
    }

    /// Reads from any source of bytes; `path` is its name in errors.
    ///
    /// # Errors
    ///
    /// The source cannot be read, or is something else.
    pub fn of(source: Box<dyn Source>, path: &Path, limits: Limits) -> Result<Self, OpenError> {
        let mut source = BufReader::with_capacity(1 << 16, source);
        let io = |error| OpenError::Io { path: path.into(), error };
        let index = Arc::new(Index::read(&mut source, limits).map_err(io)?.unwrap_or_default());
        let length = source.seek(SeekFrom::End(0)).map_err(io)?;
        source.seek(SeekFrom::Start(0)).map_err(io)?;
        let mut magic = [0; MAGIC.len()];
        match source.read_exact(&mut magic) {
            Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => return Err(io(error)),
            Ok(()) if magic == MAGIC => {}
            Err(_) | Ok(()) => return Err(OpenError::NotMcap(path.into())),
        }
        let mut crc = crc32fast::Hasher::new();
        crc.update(&magic);
        Ok(Self {
            path: path.into(),
            source,
            limits,
            length,
            position: MAGIC.len() as u64,
            read: MAGIC.len() as u64,
            body: Vec::new(),
            unpacker: None,
            open: None,
            index,
            skip: HashSet::new(),
            crc: Some(crc),
            damages: Vec::new(),
            noted: 0,
            grows: false,
            part: Part::Data,
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

    /// Tells of what was refused before anything is read.
    pub(crate) fn note(&mut self, refused: &[Damage]) {
        self.damages.extend_from_slice(refused);
        self.noted += refused.len();
    }

    /// True if anything of what was read was damaged.
    fn has_damage(&self) -> bool {
        self.damages.len() > self.noted
    }

    /// Waits for more at the end of a file that has no footer yet: [`Next::Pending`] instead of damage.
    pub fn follow(&mut self) {
        self.grows = true;
    }

    /// Goes on at a record of the file, a chunk for example. The checksum over the whole file cannot be verified then; that
    /// of every chunk that is read still is.
    ///
    /// # Errors
    ///
    /// The system fails to read.
    pub fn go_to(&mut self, offset: u64) -> Result<(), OpenError> {
        self.seek(offset).map_err(OpenError::io(&self.path))?;
        (self.open, self.crc, self.part) = (None, None, Part::Data);
        Ok(())
    }

    /// The summary of the file, empty if there is none.
    pub fn index(&self) -> &Arc<Index> {
        &self.index
    }

    /// Bytes of the file that were read so far, the summary left aside.
    pub fn bytes_read(&self) -> u64 {
        self.read
    }

    /// What was wrong so far.
    pub fn damages(&self) -> &[Damage] {
        &self.damages
    }

    /// True once the whole file has been read and was sound, from magic to magic.
    pub fn is_complete(&self) -> bool {
        self.part == Part::Over && self.damages.is_empty()
    }

    /// Hands the next record to `take`.
    ///
    /// # Errors
    ///
    /// The system fails to read. Damage is no error: see [`Scan::damages`].
    pub fn next<T>(&mut self, take: impl FnOnce(Found<'_>) -> T) -> Result<Next<T>, OpenError> {
        loop {
            if let (Some(open), Some(unpacker)) = (&mut self.open, &mut self.unpacker) {
                let (offset, start) = (open.offset, open.inside);
                let reason = match unpacker.next_event() {
                    // the whole chunk was fed: it wants the next record of the file
                    None | Some(Ok(LinearReadEvent::ReadRequest(_))) => None,
                    Some(Ok(LinearReadEvent::Record { opcode, data })) => {
                        open.inside = start + PREFIX + data.len() as u64;
                        match parse(opcode, data, self.limits.record()) {
                            Ok(Record::Chunk { .. }) => Some("a chunk inside a chunk".into()),
                            Ok(record) => {
                                return Ok(Next::Record(take(Found { offset, inside: Some(start), record })));
                            }
                            Err(error) => Some(error.to_string()),
                        }
                    }
                    Some(Err(error)) => Some(explain(&error)),
                };
                let (bytes, is_large) = (open.end - offset, open.is_large);
                self.open = None;
                if is_large {
                    self.unpacker = None;
                }
                if let Some(reason) = reason {
                    self.unpacker = None;
                    self.damage(offset, bytes, reason);
                }
                continue;
            }
            if self.part == Part::Over {
                return Ok(Next::End);
            }
            match self.outer() {
                Err(error) => return Err(OpenError::Io { path: self.path.clone(), error }),
                Ok(Outer::Again) => {}
                Ok(Outer::Pending) => return Ok(Next::Pending),
                Ok(Outer::Chunk) => {
                    let offset = self.open.as_ref().map_or(self.position, |open| open.offset);
                    let header = match parse(op::CHUNK, &self.body, self.limits.record()) {
                        Ok(Record::Chunk { header, .. }) => Some(header),
                        _ => None,
                    };
                    // the unpacker has a copy
                    if self.body.len() > LARGE {
                        self.body = Vec::new();
                    }
                    if let Some(header) = header {
                        let record = Record::Chunk { header, data: Cow::Borrowed(&[]) };
                        return Ok(Next::Record(take(Found { offset, inside: None, record })));
                    }
                }
                Ok(Outer::Record { offset, opcode }) => {
                    match parse(opcode, &self.body, self.limits.record()) {
                        Ok(record) => return Ok(Next::Record(take(Found { offset, inside: None, record }))),
                        Err(error) => {
                            self.damage(offset, PREFIX + self.body.len() as u64, error.to_string());
                        }
                    }
                }
            }
        }
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

/// One record of the file, or none.
enum Outer {
    Chunk,
    Record { offset: u64, opcode: u8 },
    Pending,
    Again,
}

impl Scan {
    /// Reads the next record of the file into `body`; chunks are opened.
    fn outer(&mut self) -> io::Result<Outer> {
        let offset = self.position;
        if self.skip.contains(&offset) {
            let chunk = &self.index.chunks[&offset];
            let end = offset.saturating_add(chunk.chunk_length).saturating_add(chunk.message_index_length);
            self.seek(end.min(self.length).max(offset + 1))?;
            return Ok(Outer::Again);
        }
        let mut prefix = [0; PREFIX as usize];
        if self.length.saturating_sub(offset) < PREFIX {
            return self.ends_early(offset, "the file ends where another record should begin");
        }
        self.source.read_exact(&mut prefix)?;
        self.read += PREFIX;
        let opcode = prefix[0];
        let [_, length @ ..] = prefix;
        let length = u64::from_le_bytes(length);
        let end = (offset + PREFIX).saturating_add(length);
        if opcode == 0 {
            return self.resynchronise(offset, "not a record: opcode 0".into());
        }
        // a record that reaches over the beginning of a chunk has a wrong length
        if self.index.chunks.range(offset + 1..end.max(offset + 1)).next().is_some() {
            return self.resynchronise(offset, format!("the length of a record, {length}, is wrong"));
        }
        if end > self.length {
            if self.grows {
                self.seek(offset)?;
                return self.ends_early(offset, "");
            }
            let reason = format!("the file ends in the middle of a record of {length} bytes");
            return self.resynchronise(offset, reason);
        }
        if length > self.limits.record() as u64 {
            let limit = self.limits.record();
            let reason = format!("a record of {length} bytes exceeds the limit of {limit} (--max-memory)");
            return self.resynchronise(offset, reason);
        }
        self.body.resize(length as usize, 0);
        self.source.read_exact(&mut self.body)?;
        self.read += length;
        self.position = end;
        self.check_crc(offset, opcode, &prefix);
        if opcode == op::DATA_END && !self.skip.is_empty() {
            // the summary has been read and was sound, else nothing could be skipped
            self.part = Part::Over;
        }
        match opcode {
            op::CHUNK => {
                self.open_chunk(offset, &prefix);
                Ok(Outer::Chunk)
            }
            op::FOOTER => {
                self.end_magic()?;
                Ok(Outer::Record { offset, opcode })
            }
            _ => Ok(Outer::Record { offset, opcode }),
        }
    }

    /// What a file without a footer ends with; or it has grown meanwhile.
    fn ends_early(&mut self, offset: u64, reason: &str) -> io::Result<Outer> {
        if self.grows {
            let known = self.length;
            self.length = self.source.seek(SeekFrom::End(0))?;
            self.seek(offset)?;
            return Ok(if self.length > known { Outer::Again } else { Outer::Pending });
        }
        self.part = Part::Over;
        self.damage(offset, self.length - offset.min(self.length), reason.into());
        Ok(Outer::Again)
    }

    fn seek(&mut self, position: u64) -> io::Result<()> {
        self.source.seek(SeekFrom::Start(position))?;
        self.position = position;
        Ok(())
    }

    /// Adds a record to the checksum of its part of the file, and compares where the part ends.
    fn check_crc(&mut self, offset: u64, opcode: u8, prefix: &[u8]) {
        let ends = matches!(opcode, op::DATA_END | op::FOOTER);
        let saved = match ends.then(|| parse(opcode, &self.body, self.limits.record())) {
            Some(Ok(Record::DataEnd(end))) => Some(end.data_section_crc),
            Some(Ok(Record::Footer(footer))) => Some(footer.summary_crc),
            _ => None,
        };
        if opcode == op::FOOTER
            && let Some(crc) = &mut self.crc
        {
            crc.update(prefix);
            crc.update(&self.body[..self.body.len().saturating_sub(4)]);
        }
        match saved {
            None => {
                if let Some(crc) = &mut self.crc {
                    crc.update(prefix);
                    crc.update(&self.body);
                }
            }
            Some(saved) => {
                let calculated = self.crc.take().map(crc32fast::Hasher::finalize);
                let wrong = calculated.filter(|&calculated| saved != 0 && saved != calculated);
                if let Some(calculated) = wrong.filter(|_| !self.has_damage()) {
                    let part = if opcode == op::DATA_END { "data section" } else { "summary" };
                    let reason =
                        format!("CRC of the {part} failed: {saved:08x} is saved, {calculated:08x} found");
                    self.damage(offset, 0, reason);
                }
            }
        }
        if opcode == op::DATA_END && self.part == Part::Data {
            self.part = Part::Summary;
            self.crc = Some(crc32fast::Hasher::new());
        }
    }

    fn end_magic(&mut self) -> io::Result<()> {
        let rest = self.length - self.position;
        let mut magic = [0; MAGIC.len()];
        let whole = rest >= magic.len() as u64;
        if whole {
            self.source.read_exact(&mut magic)?;
        }
        let was = std::mem::replace(&mut self.part, Part::Over);
        if !whole || magic != MAGIC {
            self.damage(self.position, rest, "the magic bytes at the end are missing".into());
        } else if rest > magic.len() as u64 {
            let position = self.position + magic.len() as u64;
            self.damage(position, rest - magic.len() as u64, "the file goes on after its end".into());
        } else if was == Part::Data && !self.has_damage() {
            self.damage(self.position, 0, "the end of the data is not marked".into());
        }
        self.part = Part::Over;
        Ok(())
    }

    /// Finds where reading can go on: at the next chunk that is sound, or at the summary.
    fn resynchronise(&mut self, offset: u64, reason: String) -> io::Result<Outer> {
        self.crc = None;
        let indexed = self.index.chunks.range(offset + 1..).next().map(|(&offset, _)| offset);
        let summary = Some(self.index.start).filter(|&start| start > offset);
        let next = match indexed.or(summary) {
            Some(next) => Some(next),
            None => self.search(offset + 1)?,
        };
        match next.filter(|&next| next < self.length) {
            Some(next) => {
                self.seek(next)?;
                self.damage(offset, next - offset, reason);
            }
            None => {
                self.part = Part::Over;
                self.damage(offset, self.length - offset, reason);
            }
        }
        Ok(Outer::Again)
    }

    /// Looks for a chunk from an offset on.
    fn search(&mut self, from: u64) -> io::Result<Option<u64>> {
        const WINDOW: u64 = 1 << 20;
        /// Bytes of a record's prefix and a chunk's header, with the longest name of a compression.
        const HEAD: u64 = PREFIX + 8 + 8 + 8 + 4 + 4 + 4 + 8;
        let mut start = from;
        while start + HEAD <= self.length {
            self.seek(start)?;
            let size = (WINDOW + HEAD).min(self.length - start);
            let mut window = vec![0; size as usize];
            self.source.read_exact(&mut window)?;
            self.read += size;
            let heads = window.windows(HEAD as usize).enumerate();
            for (i, head) in heads.filter(|(_, head)| head[0] == op::CHUNK) {
                let offset = start + i as u64;
                if self.is_chunk(head, offset) {
                    return Ok(Some(offset));
                }
            }
            start += WINDOW;
        }
        Ok(None)
    }

    /// True if these bytes look like the beginning of a chunk record.
    fn is_chunk(&self, head: &[u8], offset: u64) -> bool {
        let u64_at =
            |at: usize| head.get(at..at + 8).and_then(|b| Some(u64::from_le_bytes(b.try_into().ok()?)));
        let length = u64_at(1).unwrap_or(u64::MAX);
        let fits = length <= self.limits.record() as u64 && offset + PREFIX + length <= self.length;
        let times = u64_at(9).zip(u64_at(17)).is_some_and(|(first, last)| first <= last);
        let unpacked = u64_at(25).is_some_and(|size| size <= self.limits.record() as u64);
        let name = match head.get(37..41) {
            Some([0, 0, 0, 0]) => Some(0),
            Some([3, 0, 0, 0]) => Some(3).filter(|_| head[41..44] == *b"lz4"),
            Some([4, 0, 0, 0]) => Some(4).filter(|_| head[41..45] == *b"zstd"),
            _ => None,
        };
        let packed = name.and_then(|name| u64_at(41 + name).map(|size| size + 40 + name as u64));
        fits && times && unpacked && packed == Some(length)
    }
}

impl Scan {
    /// Feeds a chunk to the unpacker, which verifies it before anything comes out.
    fn open_chunk(&mut self, offset: u64, prefix: &[u8]) {
        let limit = self.limits.record();
        let unpacker = self.unpacker.get_or_insert_with(|| {
            let options = LinearReaderOptions::default()
                .with_skip_start_magic(true)
                .with_skip_end_magic(true)
                .with_prevalidate_chunk_crcs(true)
                .with_record_length_limit(limit);
            LinearReader::new_with_options(options)
        });
        for bytes in [prefix, &self.body] {
            unpacker.insert(bytes.len()).copy_from_slice(bytes);
            // no bytes would mean the end of the file
            if !bytes.is_empty() {
                unpacker.notify_read(bytes.len());
            }
        }
        // how much a chunk unpacks to is known once it is unpacked; what it claims is checked against that
        let claimed = match parse(op::CHUNK, &self.body, limit) {
            Ok(Record::Chunk { header, .. }) => {
                usize::try_from(header.uncompressed_size).unwrap_or(usize::MAX)
            }
            _ => 0,
        };
        let is_large = self.body.len().max(claimed) > LARGE;
        self.open = Some(Open { offset, end: self.position, inside: 0, is_large });
    }
}
