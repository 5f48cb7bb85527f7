//! A recording that is open for reading: its channels, and the messages of some of them.
//!
//! Where the file has a sound summary, [`Recording::open`] reads nothing else, and [`Recording::messages`] reads only
//! the chunks that hold what is asked for. Otherwise both read the whole file. All that reads fails where the system does.

mod decoder;
mod json;
mod open;
mod turns;

pub(crate) use decoder::{Decoded, Decoder};
pub(crate) use open::widen;
use turns::Turns;

use std::{collections::BTreeMap, path::PathBuf, time::Duration};

use mcap::records::{MessageHeader, Record};
use percuss_picture::Layer;
use serde::Serialize;

use crate::{
    channel::Channel,
    convention::{self, Ending},
    failure::Failure,
    instant::Instant,
    recording::{Damage, FileRecord, Index, LeftOut, Limits, Opened, Scan},
    wire::Values,
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
        &self.file.index
    }

    pub(crate) fn scan(&self) -> Result<Scan, Failure> {
        self.file.scan(&self.path, self.limits)
    }

    /// The messages of some channels, in the order of the file.
    ///
    /// * `window`: first and last log time \[ns\]; messages outside may come out too
    pub fn messages(
        &self,
        ids: impl IntoIterator<Item = u16>,
        window: Option<(u64, u64)>,
    ) -> Result<Messages<'_>, Failure> {
        let channels = self.decoders(ids);
        let mut scan = self.scan()?;
        scan.note(&self.refused);
        if self.from_index {
            scan.only(|chunk| {
                let (first, last) = window.unwrap_or((0, u64::MAX));
                let is_listed = chunk.message_index_length > 0;
                let holds = chunk.message_index_offsets.keys().any(|id| channels.contains_key(id));
                (!is_listed || holds) && chunk.message_start_time <= last && first <= chunk.message_end_time
            });
        }
        Ok(Messages { scan, channels, turns: None, records: None, undecoded: 0 })
    }

    /// The same of the whole file, each of whose records is handed to `take`.
    pub(crate) fn messages_and_records<'a>(
        &'a self,
        ids: impl IntoIterator<Item = u16>,
        take: TakeRecord<'a>,
    ) -> Result<Messages<'a>, Failure> {
        let (scan, channels) = (self.scan()?, self.decoders(ids));
        Ok(Messages { scan, channels, turns: None, records: Some(take), undecoded: 0 })
    }

    /// The same in the order of their log times and sequence numbers.
    ///
    /// * `refusal`: why it fails where too many have to wait for their turn
    pub(crate) fn messages_in_turn(
        &self,
        ids: impl IntoIterator<Item = u16>,
        window: Option<(u64, u64)>,
        refusal: String,
    ) -> Result<Messages<'_>, Failure> {
        let messages = self.messages(ids, window)?;
        let turns = Some(Turns::of(self, &messages.channels, refusal)?);
        Ok(Messages { turns, ..messages })
    }

    /// False if the order of messages is not known before all of them have been read.
    pub(crate) fn has_index(&self) -> bool {
        self.from_index && !self.index().chunks.is_empty()
    }

    fn decoders(&self, ids: impl IntoIterator<Item = u16>) -> BTreeMap<u16, Known<'_>> {
        let known = |id| self.channels.get(&id).map(|channel| (id, (channel, Decoder::of(channel))));
        ids.into_iter().filter_map(known).collect()
    }

    /// Hands the name and content of every attachment to `take`, until that returns something; of one that has no room what is known of it.
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

#[derive(Clone, Debug, Default)]
pub(crate) struct Kept {
    pub(crate) channel: u16,
    pub(crate) sequence: u32,
    /// \[ns\]
    pub(crate) log_time: u64,
    /// \[ns\]
    pub(crate) publish_time: u64,
    pub(crate) data: Vec<u8>,
}

impl From<&Message<'_>> for Kept {
    fn from(message: &Message<'_>) -> Self {
        let &Message { channel, sequence, log_time, publish_time, data, .. } = message;
        Self { channel, sequence, log_time, publish_time, data: data.to_vec() }
    }
}

impl Kept {
    /// The message, without its place.
    pub(crate) fn message(&self) -> Message<'_> {
        let &Self { channel, sequence, log_time, publish_time, ref data } = self;
        Message { offset: 0, channel, sequence, log_time, publish_time, data }
    }
}

/// How messages were read.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// What of the file is damaged.
    pub damages: Vec<Damage>,
    /// Messages that do not fit their schema, of those that were decoded.
    pub undecoded: u64,
}

/// What is made of every record of the file, and of messages that can be decoded.
pub(crate) type TakeRecord<'a> = Box<dyn FnMut(FileRecord<'_>, Option<&mut Decoded<'_>>) + 'a>;

type Known<'a> = (&'a Channel, Option<Decoder>);

/// The messages of some channels, one after the other.
pub struct Messages<'a> {
    scan: Scan,
    channels: BTreeMap<u16, Known<'a>>,
    turns: Option<Turns>,
    records: Option<TakeRecord<'a>>,
    undecoded: u64,
}

/// The next message, decoded if that is asked for.
pub struct Next<'a, 'd> {
    /// As it stands in the file.
    pub message: Message<'a>,
    /// Its channel.
    pub channel: &'a Channel,
    decoded: Option<Decoded<'d>>,
}

impl Next<'_, '_> {
    pub(crate) fn instant(&self) -> Instant {
        self.channel.instant(self.message.data, self.message.log_time, self.channel.origin)
    }

    /// The decoded message; `None` if it does not fit its schema, or there is none.
    pub(crate) fn values(&mut self) -> Option<&mut Values> {
        self.decoded.as_mut()?.values(self.message.data).ok()
    }

    /// True if it was decoded in vain.
    pub(crate) fn is_undecoded(&self) -> bool {
        self.decoded.as_ref().is_some_and(Decoded::is_undecoded)
    }
}

impl Messages<'_> {
    /// Waits for more at the end of a file that has no footer yet.
    pub fn follow(&mut self) {
        self.scan.follow();
    }

    /// Hands the next message to `take`; `None` at the end, or where a file that is being written holds no more for now.
    pub fn next<T>(&mut self, take: impl FnOnce(&mut Next<'_, '_>) -> T) -> Result<Option<T>, Failure> {
        while let Some(turns) = &mut self.turns {
            if let Some(kept) = turns.next() {
                return Ok(self.again(&kept, take));
            }
            if turns.is_over {
                return Ok(None);
            }
            let put = self.scan.find_map(|found| {
                let message = Message::of(&found)?;
                self.channels.contains_key(&message.channel).then(|| turns.put(&message))
            })?;
            turns.is_over = put.transpose()?.is_none();
        }
        let Self { scan, channels, records, undecoded, .. } = self;
        let mut take = Some(take);
        scan.find_map(|found| {
            let mut decoded = None;
            let taken = Message::of(&found).and_then(|message| {
                let known = channels.get_mut(&message.channel)?;
                let (taken, next) = hand(message, known, undecoded, take.take()?);
                decoded = next;
                Some(taken)
            });
            if let Some(records) = records {
                records(found, decoded.as_mut());
            }
            taken
        })
    }

    /// Hands the messages one by one to `take`, up to the end or to where a file that is being written holds no more for
    /// now.
    pub fn for_each(
        &mut self,
        mut take: impl FnMut(&mut Next<'_, '_>) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        while let Some(taken) = self.next(&mut take)? {
            taken?;
        }
        Ok(())
    }

    /// Hands a message that was kept to `take` once more.
    pub(crate) fn again<T>(&mut self, kept: &Kept, take: impl FnOnce(&mut Next<'_, '_>) -> T) -> Option<T> {
        let known = self.channels.get_mut(&kept.channel)?;
        Some(hand(kept.message(), known, &mut self.undecoded, take).0)
    }

    /// True at the end of the file; false as long as it may grow.
    pub fn is_over(&self) -> bool {
        self.scan.is_over()
    }

    /// What was wrong so far.
    pub fn seen(&self) -> Seen {
        Seen { damages: self.scan.damages().to_vec(), undecoded: self.undecoded }
    }
}

/// Hands a message to `take`, counts it if it was decoded in vain, and hands it on as far as it was decoded.
fn hand<'a, T>(
    message: Message<'_>,
    (channel, decoder): &'a mut Known<'_>,
    undecoded: &mut u64,
    take: impl FnOnce(&mut Next<'_, 'a>) -> T,
) -> (T, Option<Decoded<'a>>) {
    let mut next = Next { message, channel, decoded: decoder.as_mut().map(Decoder::next) };
    let taken = take(&mut next);
    *undecoded += u64::from(next.is_undecoded());
    (taken, next.decoded)
}
