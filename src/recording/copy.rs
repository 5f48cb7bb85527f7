//! What an earlier run has recorded: its case, and its messages chunk by chunk.

use std::{
    borrow::Cow,
    fs::File,
    io::{BufReader, Read},
    path::Path,
};

use mcap::{
    McapError, parse_record,
    read::ChunkReader,
    records::{MessageHeader, Record, op},
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};

/// Why messages cannot be copied.
pub enum CopyError {
    /// They are missing or damaged.
    Read(String),
    /// The new file cannot be written.
    Write(McapError),
}

impl From<McapError> for CopyError {
    fn from(error: McapError) -> Self {
        Self::Write(error)
    }
}

/// A message of a chunk.
type Message = Result<(MessageHeader, Cow<'static, [u8]>), CopyError>;

/// Calls `f` on the opcode and the bytes of every record, chunks as they are, until it returns a result; `None` if the file ends before.
fn find_record<T>(
    file: &mut File,
    mut f: impl FnMut(u8, &[u8]) -> Result<Option<T>, CopyError>,
) -> Result<Option<T>, CopyError> {
    let length = file.metadata().map_err(|error| read(&error))?.len();
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        // no record takes more memory than there are bytes
        .with_record_length_limit(length as usize);
    let mut reader = LinearReader::new_with_options(options);
    let mut file = BufReader::new(file);
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| read(&error))? {
            LinearReadEvent::ReadRequest(need) => {
                let found = file.read(reader.insert(need)).map_err(|error| read(&error))?;
                reader.notify_read(found);
            }
            LinearReadEvent::Record { opcode, data } => {
                if let Some(found) = f(opcode, data)? {
                    return Ok(Some(found));
                }
            }
        }
    }
    Ok(None)
}

fn read(error: &dyn ToString) -> CopyError {
    CopyError::Read(error.to_string())
}

/// Text of the attachment `name` of a recording, which stands before its messages; `None` if there is none that can be read.
pub fn attachment(path: &Path, name: &str) -> Option<String> {
    let text = find_record(&mut File::open(path).ok()?, |opcode, data| match opcode {
        op::CHUNK => Ok(Some(None)),
        op::ATTACHMENT => match parse_record(opcode, data).map_err(|error| read(&error))? {
            Record::Attachment { header, data, .. } if header.name == name => {
                Ok(Some(String::from_utf8(data.into_owned()).ok()))
            }
            _ => Ok(None),
        },
        _ => Ok(None),
    });
    text.ok().flatten().flatten()
}

/// Calls `f` on the messages of every chunk, until it returns false. The checksum of a chunk is compared after its last message.
pub fn for_each_chunk(
    file: &mut File,
    mut f: impl FnMut(&mut dyn Iterator<Item = Message>) -> Result<bool, CopyError>,
) -> Result<(), CopyError> {
    let done = find_record(file, |opcode, data| {
        if opcode != op::CHUNK {
            return Ok(None);
        }
        let Record::Chunk { header, data } = parse_record(opcode, data).map_err(|error| read(&error))? else {
            return Err(CopyError::Read("a chunk cannot be read".into()));
        };
        let records = ChunkReader::new(header, &data).map_err(|error| read(&error))?;
        let mut messages = records.filter_map(|record| match record {
            Ok(Record::Message { header, data }) => Some(Ok((header, Cow::Owned(data.into_owned())))),
            Ok(_) => None,
            Err(error) => Some(Err(read(&error))),
        });
        Ok((!f(&mut messages)?).then_some(()))
    })?;
    done.ok_or_else(|| CopyError::Read("it ends before the last message that its checkpoint counts".into()))
}
