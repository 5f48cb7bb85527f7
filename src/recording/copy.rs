//! What an earlier run has recorded: its case, and its messages chunk by chunk.
//!
//! Nothing of the file is trusted: no length in it takes memory that the file, or the checkpoint that belongs to it, does not have, and a chunk
//! is compared with its checksum before anything of it is used.

use std::{
    fs::File,
    io::{BufReader, Read},
    path::Path,
};

use mcap::{
    McapError, parse_record,
    records::{MessageHeader, Record, op},
    sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions},
};
use prost::Message;

/// Largest chunk of a recording that a case names \[bytes\].
const LARGEST_CHUNK: usize = 256 << 20;

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

/// Takes a text with its length off the front.
fn text<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
    let (length, rest) = bytes.split_first_chunk()?;
    let (text, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
    *bytes = rest;
    Some(text)
}

/// The content of an attachment of this name, if the record is that and sound.
fn content<'a>(record: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let (body, checksum) = record.split_last_chunk()?;
    // two times, the name, the media type, the length of the content
    let mut rest = body.get(16..)?;
    let found = text(&mut rest)?;
    text(&mut rest)?;
    let (length, content) = rest.split_first_chunk()?;
    let is_it = found == name.as_bytes() && u64::from_le_bytes(*length) == content.len() as u64;
    (is_it && crc32fast::hash(body) == u32::from_le_bytes(*checksum)).then_some(content)
}

/// Text of the attachment `name` of a recording, which stands before its messages; `None` if there is none that can be read.
pub fn attachment(path: &Path, name: &str) -> Option<String> {
    let text = find_record(&mut File::open(path).ok()?, |opcode, data| {
        Ok(match opcode {
            op::CHUNK => Some(None),
            op::ATTACHMENT => content(data, name).map(|content| String::from_utf8(content.to_vec()).ok()),
            _ => None,
        })
    });
    text.ok().flatten().flatten()
}

/// Entries of the metadata records of these names in a recording; `None` unless all can be read.
#[cfg(feature = "cli")]
pub fn metadata<const N: usize>(
    path: &Path,
    names: [&str; N],
) -> Option<[std::collections::BTreeMap<String, String>; N]> {
    let mut found = [const { None }; N];
    let all = find_record(&mut File::open(path).ok()?, |opcode, data| {
        if opcode == op::METADATA
            && let Record::Metadata(record) = parse_record(opcode, data).map_err(|error| read(&error))?
            && let Some(place) = names.iter().position(|name| *name == record.name)
        {
            found[place] = Some(record.metadata);
        }
        Ok(found.iter().all(Option::is_some).then_some(()))
    });
    all.ok().flatten()?;
    Some(found.map(Option::unwrap_or_default))
}

/// Calls `f` on every message and, without one, at the end of every chunk, until it returns false.
///
/// * `largest`: no chunk is larger \[bytes\]
pub fn for_each_message(
    file: &mut File,
    largest: usize,
    mut f: impl FnMut(Option<(MessageHeader, &[u8])>) -> Result<bool, CopyError>,
) -> Result<(), CopyError> {
    let done = find_record(file, |opcode, data| {
        if opcode != op::CHUNK {
            return Ok(None);
        }
        for_each_record(data, largest, |opcode, data| {
            if opcode == op::MESSAGE
                && let Record::Message { header, data } =
                    parse_record(op::MESSAGE, data).map_err(|error| read(&error))?
            {
                f(Some((header, &data)))?;
            }
            Ok(())
        })?;
        Ok((!f(None)?).then_some(()))
    })?;
    done.ok_or_else(|| CopyError::Read("it ends before the last message that its checkpoint counts".into()))
}

/// Calls `f` on the opcode and the bytes of every record in a chunk.
fn for_each_record(
    chunk: &[u8],
    largest: usize,
    mut f: impl FnMut(u8, &[u8]) -> Result<(), CopyError>,
) -> Result<(), CopyError> {
    let mut reader = open_chunk(chunk, largest)?;
    while let Some(event) = reader.next_event() {
        match event.map_err(|error| read(&error))? {
            // it wants what follows the chunk
            LinearReadEvent::ReadRequest(_) => break,
            LinearReadEvent::Record { opcode, data } => f(opcode, data)?,
        }
    }
    Ok(())
}

/// Messages of one topic of a whole recording, in the order of the file.
///
/// * `units`: entries that the metadata of its channel must have
/// * `most`: no more of them are allowed
pub fn messages<M: Message + Default>(
    path: &Path,
    topic: &str,
    units: &[(&str, &str)],
    most: usize,
) -> Result<Vec<M>, String> {
    let (mut channel, mut found, mut is_whole) = (None, Vec::new(), false);
    let mut take = |opcode, data: &[u8]| -> Result<(), CopyError> {
        match parse_record(opcode, data).map_err(|error| read(&error))? {
            Record::Channel(record) if record.topic == topic => {
                let has = |(key, unit): &(&str, &str)| record.metadata.get(*key).is_some_and(|of| of == unit);
                if let Some((key, unit)) = units.iter().find(|entry| !has(entry)) {
                    return Err(CopyError::Read(format!("{key} of {topic} is not {unit}")));
                }
                channel = Some(record.id);
            }
            Record::Message { header, data } if Some(header.channel_id) == channel => {
                if found.len() == most {
                    return Err(CopyError::Read(format!("{topic} has more than {most} messages")));
                }
                found.push(M::decode(&*data).map_err(|error| read(&error))?);
            }
            _ => {}
        }
        Ok(())
    };
    let mut file = File::open(path).map_err(|error| error.to_string())?;
    let done = find_record(&mut file, |opcode, data| {
        match opcode {
            op::CHUNK => for_each_record(data, LARGEST_CHUNK, &mut take)?,
            op::CHANNEL | op::MESSAGE => take(opcode, data)?,
            op::DATA_END => is_whole = true,
            _ => {}
        }
        Ok(is_whole.then_some(()))
    });
    match done {
        Err(CopyError::Read(error)) => Err(error),
        Err(CopyError::Write(error)) => Err(error.to_string()),
        Ok(None) => Err("it is no whole recording; `percuss-read recover` saves what it has".into()),
        Ok(Some(())) if channel.is_none() => Err(format!("it has no topic {topic}")),
        Ok(Some(())) => Ok(found),
    }
}

/// A reader of what is in a chunk, which compares its checksum first.
fn open_chunk(chunk: &[u8], largest: usize) -> Result<LinearReader, CopyError> {
    if !is_tiled(chunk) {
        return Err(CopyError::Read("a record reaches beyond its chunk".into()));
    }
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(largest.max(chunk.len()));
    let mut reader = LinearReader::new_with_options(options);
    for bytes in [&[op::CHUNK], &(chunk.len() as u64).to_le_bytes()[..], chunk] {
        reader.insert(bytes.len()).copy_from_slice(bytes);
        reader.notify_read(bytes.len());
    }
    Ok(reader)
}

/// False if a chunk is not compressed and its records do not end where it does, which the reader does not look at.
fn is_tiled(chunk: &[u8]) -> bool {
    // two times, size and checksum of the records
    let Some(mut rest) = chunk.get(28..) else { return true };
    if text(&mut rest).is_none_or(|compression| !compression.is_empty()) {
        return true;
    }
    let Some((size, rest)) = rest.split_first_chunk() else { return true };
    let size = usize::try_from(u64::from_le_bytes(*size)).ok();
    let Some(mut records) = size.and_then(|size| rest.get(..size)) else { return true };
    while let Some((prefix, rest)) = records.split_first_chunk::<9>() {
        let length = prefix[1..].try_into().map_or(u64::MAX, u64::from_le_bytes);
        match usize::try_from(length).ok().and_then(|length| rest.get(length..)) {
            Some(rest) => records = rest,
            None => return false,
        }
    }
    records.is_empty()
}

#[cfg(test)]
mod tests;
