//! A recording that is open for reading: its channels, and the messages of some of them.
//!
//! Where the file has a sound summary, [`Recording::open`] reads nothing else, and [`Recording::messages`] reads only
//! the chunks that hold what is asked for. Otherwise both read the whole file.

mod json;
mod open;
mod turns;

pub(crate) use open::widen;
pub(crate) use turns::Turns;

use std::{
    collections::{BTreeMap, BTreeSet},
    path::PathBuf,
    time::Duration,
};

use mcap::records::{MessageHeader, Record};
use percuss_picture::Layer;
use serde::Serialize;

use crate::{
    channel::Channel,
    convention::{self, Ending},
    failure::Failure,
    recording::{Damage, FileRecord, Index, LeftOut, Limits, Opened, Scan},
};

/// Pause before looking again for more of a file that is being written.
pub const POLL: Duration = Duration::from_millis(100);

/// An attachment, without its content.
#[derive(Clone, Debug, Serialize)]
pub struct Attachment {
    /// Name.
    pub name: String,
    /// Media type.
    pub media_type: String,
    /// Size \[bytes\].
    #[serde(rename = "bytes")]
    pub size: u64,
}

/// A metadata record.
#[derive(Clone, Debug)]
pub struct Metadata {
    /// Name.
    pub name: String,
    /// Entries, without their checksum.
    pub entries: BTreeMap<String, String>,
    /// True if they have a checksum.
    pub has_checksum: bool,
    /// False if it is another.
    pub is_sound: bool,
}

/// Chunks as the summary of the file lists them.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Chunks {
    /// Number of chunks.
    pub count: u64,
    /// Size in the file \[bytes\].
    #[serde(rename = "compressed_bytes")]
    pub compressed: u64,
    /// Size of their content \[bytes\].
    #[serde(rename = "uncompressed_bytes")]
    pub uncompressed: u64,
    /// Compressions used.
    pub compression: Vec<String>,
}

/// A recording and what it holds.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The file.
    pub path: PathBuf,
    /// Profile of the header; empty if only the summary was read.
    pub profile: String,
    /// Program that wrote it; empty if only the summary was read.
    pub library: String,
    /// Channels by their ids.
    pub channels: BTreeMap<u16, Channel>,
    /// Metadata records in the order of the file.
    pub metadata: Vec<Metadata>,
    /// Attachments in the order of the file.
    pub attachments: Vec<Attachment>,
    /// Chunks, if all of the file was read and it has a summary.
    pub chunks: Chunks,
    /// First and last log time of all messages \[ns\].
    pub span: Option<(u64, u64)>,
    /// True if all of the file was read and it is sound from magic to magic.
    pub complete: bool,
    /// What is damaged or cut off, as far as it had to be read, or was refused.
    pub damages: Vec<Damage>,
    /// What of these was refused because it takes too much memory; reported again by all who read messages.
    refused: Vec<Damage>,
    limits: Limits,
    file: Opened,
    from_index: bool,
}

impl Recording {
    /// Memory that reading may take.
    pub fn limits(&self) -> Limits {
        self.limits
    }

    /// The error of what has to be kept of it and has no room.
    pub(crate) fn no_room(&self, what: &'static str) -> Failure {
        Failure::memory(&self.path, what)
    }

    /// First log time \[ns\], where log times are dates: later than any recording that counts from 0 lasts.
    pub fn start_date(&self) -> Option<u64> {
        /// A year \[ns\].
        const YEAR: u64 = 365 * 86_400 * 1_000_000_000;
        self.span.map(|span| span.0).filter(|start| *start >= YEAR)
    }

    /// Lets the log times of channels whose messages have no time of their own count from an origin \[ns\].
    pub fn count_from(&mut self, origin: u64) {
        for channel in self.channels.values_mut().filter(|channel| !channel.has_time()) {
            channel.origin = origin;
        }
    }

    /// Entries of a metadata record.
    pub fn entries(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata.iter().rev().find(|record| record.name == name).map(|record| &record.entries)
    }

    /// How far the colours of a field reach from 0, by the metadata of the views, if any says it.
    pub(crate) fn colour_range(&self, topic: &str) -> Option<f64> {
        self.channels.values().find_map(|view| convention::colour_range(&view.metadata, topic))
    }

    /// Layers of the target of a percuss recording, where positions on a coordinate are depths.
    pub(crate) fn layers(&self, coordinate: &str) -> Vec<Layer> {
        let run = self.entries(convention::RUN).filter(|_| coordinate == convention::DEPTH);
        run.map(convention::layers).unwrap_or_default()
    }

    /// True for recordings of percuss.
    pub fn is_percuss(&self) -> bool {
        self.entries(convention::RUN).is_some()
    }

    /// How the recording ended, in its own words; `None` if it does not say.
    pub fn status(&self) -> Option<&str> {
        self.entries(convention::STATUS)?.get("status").map(String::as_str)
    }

    /// True for recordings of percuss that have not come to a planned end.
    pub fn is_partial(&self) -> bool {
        let ending = self.status().and_then(Ending::of);
        self.is_percuss() && !matches!(ending, Some(Ending::Completed | Ending::Stopped))
    }

    /// Log time that passes in a unit of the time of steps \[s\], and that unit, of messages that do not say their time themselves; `None` where
    /// it is not known.
    pub(crate) fn step_clock(&self, channel: &Channel) -> Option<(f64, Option<&str>)> {
        let rate = convention::playback_rate(self.entries(convention::RUN)?);
        let rate = rate.filter(|rate| *rate > 0.0 && !channel.has_time())?;
        let timed = self.channels.values().find(|channel| channel.has_time());
        Some((rate, timed.and_then(Channel::time_unit)))
    }

    /// Log times of a window of message times \[s or the unit of `time`\], if their relation is known.
    pub fn log_window(&self, from: Option<f64>, to: Option<f64>) -> Option<(u64, u64)> {
        let rate = convention::playback_rate(self.entries(convention::RUN)?)?;
        // a nanosecond of room for rounding
        let low = from.map_or(0, |from| (from * rate * 1e9).floor().max(1.0) as u64 - 1);
        let high = to.map_or(u64::MAX, |to| ((to * rate * 1e9).ceil().max(0.0) as u64).saturating_add(1));
        Some((low, high))
    }

    /// The summary of the file, empty if there is none.
    pub(crate) fn index(&self) -> &Index {
        self.file.index()
    }

    /// Reads the file from its start on.
    pub(crate) fn scan(&self) -> Result<Scan, Failure> {
        self.file.scan(&self.path, self.limits)
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
    ) -> Result<Messages, Failure> {
        let ids: BTreeSet<u16> = ids.into_iter().collect();
        Ok(Messages { scan: self.scan_for(&ids, window)?, ids })
    }

    /// Reads what can hold messages of some channels.
    pub(crate) fn scan_for(&self, ids: &BTreeSet<u16>, window: Option<(u64, u64)>) -> Result<Scan, Failure> {
        let mut scan = self.scan()?;
        scan.note(&self.refused);
        if self.from_index {
            scan.only(|chunk| {
                let (first, last) = window.unwrap_or((0, u64::MAX));
                let is_listed = chunk.message_index_length > 0;
                let holds = chunk.message_index_offsets.keys().any(|id| ids.contains(id));
                (!is_listed || holds) && chunk.message_start_time <= last && first <= chunk.message_end_time
            });
        }
        Ok(scan)
    }

    /// The earliest log time after each chunk that holds some channels: of what begins at the offset or before it, nothing
    /// earlier is still to come. Empty if the file has no index.
    ///
    /// * `ids`: of the channels
    pub(crate) fn floors(&self, ids: impl IntoIterator<Item = u16>) -> Result<BTreeMap<u64, u64>, Failure> {
        let ids: BTreeSet<u16> = ids.into_iter().collect();
        if !self.from_index {
            return Ok(BTreeMap::new());
        }
        let scan = self.scan()?;
        let chunks = scan.index().chunks.iter().rev().filter(|(_, chunk)| {
            chunk.message_index_length == 0 || chunk.message_index_offsets.keys().any(|id| ids.contains(id))
        });
        let mut floor = u64::MAX;
        let floors = chunks.map(|(&offset, chunk)| {
            let after = floor;
            floor = floor.min(chunk.message_start_time);
            (offset, after)
        });
        Ok(floors.collect())
    }

    /// Hands the name and content of every attachment to `take`, until that returns something; of one that has no room what is known of it.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn find_attachment<T>(
        &self,
        mut take: impl FnMut(&str, Result<&[u8], LeftOut>) -> Option<T>,
    ) -> Result<Option<T>, Failure> {
        let mut scan = self.scan()?;
        if self.from_index {
            scan.only(|_| false);
        }
        scan.find_map(|found| match found.record {
            Record::Attachment { header, data, .. } => {
                take(&header.name, found.left_out.map_or(Ok(&data), Err))
            }
            _ => None,
        })
    }

    /// The content of an attachment.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn attachment(&self, name: &str) -> Result<Option<Vec<u8>>, Failure> {
        let found =
            self.find_attachment(|known, content| (known == name).then(|| content.map(<[u8]>::to_vec)))?;
        found.transpose().map_err(|_| self.no_room("the bytes of this attachment"))
    }
}

/// A message as it stands in the file.
#[derive(Clone, Copy, Debug)]
pub struct Message<'a> {
    /// Where its chunk begins in the file, or itself where it is in none \[bytes\].
    pub offset: u64,
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

impl<'a> Message<'a> {
    /// The message that a record of the file is, if it is one.
    pub(crate) fn of(found: &'a FileRecord<'_>) -> Option<Self> {
        let Record::Message { header, data } = &found.record else { return None };
        let MessageHeader { channel_id: channel, sequence, log_time, publish_time } = *header;
        Some(Self { offset: found.offset, channel, sequence, log_time, publish_time, data })
    }
}

/// A message that is kept.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kept {
    pub(crate) channel: u16,
    pub(crate) sequence: u32,
    /// \[ns\]
    pub(crate) log_time: u64,
    pub(crate) data: Vec<u8>,
}

impl Kept {
    /// Keeps another in its place.
    pub(crate) fn replace(&mut self, Message { channel, sequence, log_time, data, .. }: &Message<'_>) {
        (self.channel, self.sequence, self.log_time) = (*channel, *sequence, *log_time);
        self.data.clear();
        self.data.extend_from_slice(data);
    }

    /// The message, without what was not kept of it: its place, and when it was published.
    pub(crate) fn message(&self) -> Message<'_> {
        let Self { channel, sequence, log_time, data } = self;
        let (channel, sequence, log_time) = (*channel, *sequence, *log_time);
        Message { offset: 0, channel, sequence, log_time, publish_time: log_time, data }
    }
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

    /// Hands the next message to `take`; `None` at the end, or where a file that is being written holds no more for now.
    ///
    /// # Errors
    ///
    /// The system fails to read.
    pub fn next<T>(&mut self, take: impl FnOnce(Message<'_>) -> T) -> Result<Option<T>, Failure> {
        let (ids, mut take) = (&self.ids, Some(take));
        self.scan.find_map(|found| {
            let message = Message::of(&found).filter(|message| ids.contains(&message.channel))?;
            take.take().map(|take| take(message))
        })
    }

    /// Hands the messages one by one to `take`, up to the end or to where a file that is being written holds no more for
    /// now.
    ///
    /// # Errors
    ///
    /// The system fails to read, or `take` fails.
    pub fn for_each(
        &mut self,
        mut take: impl FnMut(Message<'_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        while let Some(taken) = self.next(&mut take)? {
            taken?;
        }
        Ok(())
    }

    /// True at the end of the file; false as long as it may grow.
    pub fn is_over(&self) -> bool {
        self.scan.is_over()
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
