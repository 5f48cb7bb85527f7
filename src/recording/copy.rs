//! What an earlier run has recorded, chunk by chunk.

use std::{
    borrow::Cow,
    fs::File,
    io::{BufReader, Read},
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

/// Calls `f` on the messages of every chunk, until it returns false. The checksum of a chunk is compared after its last message.
pub fn for_each_chunk(
    file: &mut File,
    mut f: impl FnMut(&mut dyn Iterator<Item = Message>) -> Result<bool, CopyError>,
) -> Result<(), CopyError> {
    let read = |error: &dyn ToString| CopyError::Read(error.to_string());
    let length = file.metadata().map_err(|error| read(&error))?.len();
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        // no record takes more memory than there are bytes
        .with_record_length_limit(length as usize);
    let mut reader = LinearReader::new_with_options(options);
    let mut file = BufReader::new(file);
    while let Some(event) = reader.next_event() {
        let (opcode, data) = match event.map_err(|error| read(&error))? {
            LinearReadEvent::ReadRequest(need) => {
                let found = file.read(reader.insert(need)).map_err(|error| read(&error))?;
                reader.notify_read(found);
                continue;
            }
            LinearReadEvent::Record { opcode, data } => (opcode, data),
        };
        if opcode != op::CHUNK {
            continue;
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
        if !f(&mut messages)? {
            return Ok(());
        }
    }
    Err(CopyError::Read("it ends before the last message that its checkpoint counts".into()))
}
