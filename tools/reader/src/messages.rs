//! A recording that is open for reading: its channels, and the messages of some of them.
//!
//! Where the file has a sound summary, [`Recording::open`] reads nothing else, and [`Recording::messages`] reads only
//! the chunks that hold what is asked for. Otherwise both read the whole file.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::File,
    io::{Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    time::Duration,
};

use mcap::records::{Record, op};

use crate::{
    overview::{Attachment, Channel, Directory, Metadata, Overview},
    recording::{Damage, Index, Limits, Next, OpenError, PREFIX, Scan, parse},
};

/// Pause before looking again for more of a file that is being written.
pub const POLL: Duration = Duration::from_millis(100);

/// A recording and what it says of itself.
pub struct Recording {
    /// The file.
    pub path: PathBuf,
    /// Channels by their ids.
    pub channels: BTreeMap<u16, Channel>,
    /// Metadata records in the order of the file.
    pub metadata: Vec<Metadata>,
    /// Attachments in the order of the file.
    pub attachments: Vec<Attachment>,
    /// Program that wrote it; empty if only the summary was read.
    pub library: String,
    /// First and last log time of all messages \[ns\].
    pub span: Option<(u64, u64)>,
    /// What is damaged or cut off, as far as it had to be read, or was refused.
    pub damages: Vec<Damage>,
    /// What of these was refused because it takes too much memory; told again by all who read messages.
    refused: Vec<Damage>,
    limits: Limits,
    from_index: bool,
}

impl Recording {
    /// Opens a recording: by its summary if that is sound, else by reading all of it.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is no MCAP file.
    pub fn open(path: &Path, limits: Limits) -> Result<Self, OpenError> {
        let scan = Scan::open(path, limits)?;
        let io = |error| OpenError::Io { path: path.into(), error };
        if let Some(recording) = Self::from_index(path, scan.index(), limits).map_err(io)? {
            return Ok(recording);
        }
        let overview = Overview::read(path, limits)?;
        Ok(Self {
            path: path.into(),
            span: overview.span(),
            channels: overview.channels,
            metadata: overview.metadata,
            attachments: overview.attachments,
            library: overview.library,
            damages: overview.damages,
            refused: overview.refused,
            limits,
            from_index: false,
        })
    }

    /// From the summary, if it names every channel and all metadata.
    fn from_index(path: &Path, index: &Index, limits: Limits) -> std::io::Result<Option<Self>> {
        let Some(statistics) = &index.statistics else { return Ok(None) };
        let mut directory = Directory::new(limits);
        index.directory.iter().for_each(|record| directory.learn(record));
        let is_whole = directory.channels().len() == statistics.channel_count as usize
            && index.metadata.len() == statistics.metadata_count as usize
            && index.attachments.len() == statistics.attachment_count as usize
            && !directory.has_overflowed();
        if !is_whole {
            return Ok(None);
        }
        let mut file = File::open(path)?;
        let mut metadata = Vec::new();
        for entry in &index.metadata {
            let body = record_at(&mut file, entry.offset, entry.length, op::METADATA, limits)?;
            match body.as_deref().map(|body| parse(op::METADATA, body, limits.directory())) {
                Some(Ok(Record::Metadata(record))) => {
                    let record = Metadata { name: record.name, entries: record.metadata };
                    // the index may name a record any number of times: each is read again
                    let length = usize::try_from(entry.length).unwrap_or(usize::MAX);
                    if !directory.has_room(record.weight().max(length)) {
                        return Ok(None);
                    }
                    metadata.push(record);
                }
                _ => return Ok(None),
            }
        }
        let attachment = |entry: &mcap::records::AttachmentIndex| Attachment {
            name: entry.name.clone(),
            media_type: entry.media_type.clone(),
            size: entry.data_size,
        };
        let attachments: Vec<Attachment> = index.attachments.iter().map(attachment).collect();
        if !attachments.iter().all(|attachment| directory.has_room(attachment.weight())) {
            return Ok(None);
        }
        let refused = directory.refused();
        let mut channels = directory.into_channels();
        for (id, channel) in &mut channels {
            channel.count = statistics.channel_message_counts.get(id).copied().unwrap_or(0);
        }
        Ok(Some(Self {
            path: path.into(),
            channels,
            metadata,
            attachments,
            library: String::new(),
            span: (statistics.message_count > 0)
                .then_some((statistics.message_start_time, statistics.message_end_time)),
            damages: refused.clone(),
            refused,
            limits,
            from_index: true,
        }))
    }

    /// Memory that reading may take.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// Entries of a metadata record.
    pub fn entries(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata.iter().rev().find(|record| record.name == name).map(|record| &record.entries)
    }

    /// True for recordings of percuss that say how they ended, and have not come to a planned end.
    pub fn is_partial(&self) -> bool {
        let is_percuss = self.entries("percuss.run").is_some();
        let status = self.entries("percuss.status").and_then(|status| status.get("status"));
        is_percuss && !matches!(status.map(String::as_str), Some("completed" | "stopped"))
    }

    /// Log times of a window of message times \[s or the unit of `time`\], if their relation is known.
    pub fn log_window(&self, from: Option<f64>, to: Option<f64>) -> Option<(u64, u64)> {
        let rate: f64 = self.entries("percuss.run")?.get("playback_rate")?.parse().ok()?;
        // one nanosecond of room for rounding
        let low = from.map_or(0, |from| (from * rate * 1e9).floor().max(1.0) as u64 - 1);
        let high = to.map_or(u64::MAX, |to| (to * rate * 1e9).ceil().max(0.0) as u64 + 1);
        Some((low, high))
    }

    /// The messages of some channels, in the order of the file.
    ///
    /// * `window`: first and last log time \[ns\]; messages outside may come out too
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn messages(
        &self,
        ids: impl IntoIterator<Item = u16>,
        window: Option<(u64, u64)>,
    ) -> Result<Messages, OpenError> {
        let ids: BTreeSet<u16> = ids.into_iter().collect();
        let mut scan = Scan::open(&self.path, self.limits)?;
        scan.note(&self.refused);
        if self.from_index {
            scan.only(|chunk| {
                let (first, last) = window.unwrap_or((0, u64::MAX));
                let is_listed = chunk.message_index_length > 0;
                let holds = chunk.message_index_offsets.keys().any(|id| ids.contains(id));
                (!is_listed || holds) && chunk.message_start_time <= last && first <= chunk.message_end_time
            });
        }
        Ok(Messages { scan, ids })
    }

    /// Hands the name and content of every attachment to `take`, until that answers something.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn find_attachment<T>(
        &self,
        mut take: impl FnMut(&str, &[u8]) -> Option<T>,
    ) -> Result<Option<T>, OpenError> {
        let mut scan = Scan::open(&self.path, self.limits)?;
        if self.from_index {
            scan.only(|_| false);
        }
        loop {
            let next = scan.next(|found| match found.record {
                Record::Attachment { header, data, .. } => take(&header.name, &data),
                _ => None,
            })?;
            match next {
                Next::Record(None) => {}
                Next::Record(taken) => return Ok(taken),
                Next::Pending | Next::End => return Ok(None),
            }
        }
    }

    /// The content of an attachment.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn attachment(&self, name: &str) -> Result<Option<Vec<u8>>, OpenError> {
        self.find_attachment(|known, content| (known == name).then(|| content.to_vec()))
    }
}

/// The content of the record at a place, if it is of that kind.
fn record_at(
    file: &mut File,
    offset: u64,
    length: u64,
    opcode: u8,
    limits: Limits,
) -> std::io::Result<Option<Vec<u8>>> {
    if length < PREFIX || length > limits.record() as u64 {
        return Ok(None);
    }
    file.seek(SeekFrom::Start(offset))?;
    let mut bytes = Vec::new();
    file.take(length).read_to_end(&mut bytes)?;
    let is_sound = bytes.len() as u64 == length
        && bytes[0] == opcode
        && bytes[1..PREFIX as usize] == (length - PREFIX).to_le_bytes();
    Ok(is_sound.then(|| bytes.split_off(PREFIX as usize)))
}

/// A message as it stands in the file.
#[derive(Clone, Copy, Debug)]
pub struct Message<'a> {
    /// Its channel.
    pub channel: u16,
    /// Its number among those of its channel, as its writer counted.
    pub sequence: u32,
    /// Log time \[ns\].
    pub log_time: u64,
    /// Publish time \[ns\].
    pub publish_time: u64,
    /// Content.
    pub data: &'a [u8],
}

/// The messages of some channels, one after the other.
pub struct Messages {
    scan: Scan,
    ids: BTreeSet<u16>,
}

impl Messages {
    /// Waits for more at the end of a file that has no footer yet.
    pub fn follow(&mut self) {
        self.scan.follow();
    }

    /// Hands the next message to `take`.
    ///
    /// # Errors
    ///
    /// The system fails to read.
    pub fn next<T>(&mut self, take: impl FnOnce(Message<'_>) -> T) -> Result<Next<T>, OpenError> {
        let mut take = Some(take);
        loop {
            let ids = &self.ids;
            let next = self.scan.next(|found| match found.record {
                Record::Message { header, data } if ids.contains(&header.channel_id) => {
                    let message = Message {
                        channel: header.channel_id,
                        sequence: header.sequence,
                        log_time: header.log_time,
                        publish_time: header.publish_time,
                        data: &data,
                    };
                    take.take().map(|take| take(message))
                }
                _ => None,
            })?;
            match next {
                Next::Record(Some(taken)) => return Ok(Next::Record(taken)),
                Next::Record(None) => {}
                Next::Pending => return Ok(Next::Pending),
                Next::End => return Ok(Next::End),
            }
        }
    }

    /// What was wrong so far.
    pub fn damages(&self) -> &[Damage] {
        self.scan.damages()
    }

    /// Bytes of the file that were read so far.
    pub fn bytes_read(&self) -> u64 {
        self.scan.bytes_read()
    }
}
