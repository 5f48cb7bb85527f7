//! Opening a recording: by its summary, or by reading all of it.

use std::{collections::BTreeMap, fs::File, path::Path};

use mcap::records::Record;

use super::{Attachment, Chunks, Metadata, Recording};
use crate::{
    convention,
    directory::{Directory, SHOWN, defined_again, weight_of_entries},
    failure::Failure,
    recording::{Damage, FileRecord, Limits, Opened, open_file},
    text::short,
};

/// Compressions that are listed by name.
const MAX_COMPRESSIONS: usize = 16;

/// Flaws of definitions that are noted, at most.
const MAX_NOTED: usize = 100;

/// Messages of a channel that is not defined so far.
#[derive(Default)]
struct Early {
    count: u64,
    /// Log times \[ns\].
    span: Option<(u64, u64)>,
    /// Of the first.
    offset: u64,
}

impl Attachment {
    fn weight(&self) -> usize {
        256 + SHOWN * (self.name.len() + self.media_type.len())
    }
}

impl Metadata {
    pub(crate) fn weight(&self) -> usize {
        256 + SHOWN * self.name.len() + weight_of_entries(&self.entries)
    }
}

impl From<mcap::records::Metadata> for Metadata {
    /// The record without the checksum of its entries.
    fn from(mut record: mcap::records::Metadata) -> Self {
        let has_checksum = convention::has_checksum(&record.name);
        let stated = has_checksum.then(|| record.metadata.remove(convention::CHECKSUM)).flatten();
        let is_sound = stated.as_ref().is_none_or(|stated| *stated == convention::checksum(&record.metadata));
        Self { name: record.name, entries: record.metadata, has_checksum: stated.is_some(), is_sound }
    }
}

impl Recording {
    /// Opens a recording: by its summary if that is sound, else by reading all of it.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is no MCAP file.
    pub fn open(path: &Path, limits: Limits) -> Result<Self, Failure> {
        let recording = Self::unread(open_file(path)?, path, limits)?;
        match recording.clone().by_index()? {
            Some(recording) => Ok(recording),
            None => recording.whole(),
        }
    }

    /// Opens a recording by reading all of it.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is no MCAP file. Damage is no error: what is sound is there.
    pub fn read(path: &Path, limits: Limits) -> Result<Self, Failure> {
        Self::of(open_file(path)?, path, limits)
    }

    /// The recording in a file that is open already.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is no MCAP file.
    pub(crate) fn of(file: File, path: &Path, limits: Limits) -> Result<Self, Failure> {
        Self::unread(file, path, limits)?.whole()
    }

    fn whole(mut self) -> Result<Self, Failure> {
        let mut scan = self.scan()?;
        let (mut directory, mut early) = (Directory::new(self.limits), BTreeMap::new());
        scan.for_each(|found| self.take(found, &mut directory, &mut early))?;
        for (id, Early { count, span, offset }) in early {
            let reason = match directory.channels.get_mut(&id) {
                // where a definition stands says nothing of what it defines
                Some(channel) => {
                    channel.count += count;
                    for time in span.into_iter().flat_map(<[u64; 2]>::from) {
                        channel.span = Some(widen(channel.span, time));
                        self.span = Some(widen(self.span, time));
                    }
                    format!("{count} messages of channel {id} stand before its definition")
                }
                None => format!("{count} messages of channel {id}, which is not defined"),
            };
            self.note(offset, reason);
        }
        self.define(directory)?;
        self.complete = scan.is_complete() && self.refused.is_empty();
        self.damages = [scan.damages(), &self.refused].concat();
        Ok(self)
    }

    /// Takes over the channels and what was refused of them.
    fn define(&mut self, directory: Directory) -> Result<(), Failure> {
        self.refused.extend(directory.refused());
        self.channels = directory.channels;
        self.learn_json(directory.shapes, directory.budget)?;
        self.count_from(self.start_date().unwrap_or(0));
        Ok(())
    }

    fn unread(file: File, path: &Path, limits: Limits) -> Result<Self, Failure> {
        Ok(Self {
            path: path.into(),
            profile: String::new(),
            library: String::new(),
            channels: BTreeMap::new(),
            metadata: Vec::new(),
            attachments: Vec::new(),
            chunks: Chunks::default(),
            span: None,
            complete: false,
            damages: Vec::new(),
            refused: Vec::new(),
            limits,
            file: Opened::of(file, path, limits)?,
            from_index: false,
        })
    }

    /// From the summary, if it names every channel, all metadata and all attachments.
    fn by_index(mut self) -> Result<Option<Self>, Failure> {
        let mut scan = self.scan()?;
        let index = scan.index().clone();
        let Some(statistics) = &index.statistics else { return Ok(None) };
        let mut directory = Directory::new(self.limits);
        index.directory.iter().for_each(|record| directory.learn(record));
        let is_whole = directory.channels.len() == statistics.channel_count as usize
            && index.metadata.len() == statistics.metadata_count as usize
            && index.attachments.len() == statistics.attachment_count as usize
            && !directory.has_overflowed();
        if !is_whole {
            return Ok(None);
        }
        for entry in &index.metadata {
            scan.go_to(entry.offset)?;
            let found = scan.next(|found| match found.record {
                Record::Metadata(record) if found.offset == entry.offset => Some(Metadata::from(record)),
                _ => None,
            })?;
            // reading all of the file says what is wrong with it
            let Some(record) = found.flatten().filter(|record| record.is_sound && record.name == entry.name)
            else {
                return Ok(None);
            };
            // the index may name a record any number of times: each is read again
            let length = usize::try_from(entry.length).unwrap_or(usize::MAX);
            if !directory.has_room(record.weight().max(length)) {
                return Ok(None);
            }
            self.metadata.push(record);
        }
        let checked = || self.metadata.iter().filter(|record| convention::has_checksum(&record.name));
        if checked().any(|record| record.has_checksum) && !checked().all(|record| record.has_checksum) {
            // the key of a checksum is damaged
            return Ok(None);
        }
        for entry in &index.attachments {
            let (name, media_type) = (entry.name.clone(), entry.media_type.clone());
            let attachment = Attachment { name, media_type, size: entry.data_size };
            if !directory.has_room(attachment.weight()) {
                return Ok(None);
            }
            self.attachments.push(attachment);
        }
        for (id, channel) in &mut directory.channels {
            channel.count = statistics.channel_message_counts.get(id).copied().unwrap_or(0);
        }
        self.span = (statistics.message_count > 0)
            .then_some((statistics.message_start_time, statistics.message_end_time));
        self.from_index = true;
        self.define(directory)?;
        self.damages.clone_from(&self.refused);
        Ok(Some(self))
    }

    /// Notes a flaw of the file that all who read messages are told.
    fn note(&mut self, offset: u64, reason: String) {
        if self.refused.len() < MAX_NOTED {
            self.refused.push(Damage { offset, bytes: 0, reason });
        }
    }

    fn take(&mut self, found: FileRecord<'_>, directory: &mut Directory, early: &mut BTreeMap<u16, Early>) {
        if let Record::Channel(channel) = &found.record
            && let Some(known) = directory.channels.get(&channel.id)
            && (known.topic != channel.topic || known.encoding != channel.message_encoding)
        {
            self.note(found.offset, defined_again(channel, &known.topic));
        }
        directory.learn(&found.record);
        match found.record {
            // as long as they please, as often as they please
            Record::Header(header)
                if directory.has_room(SHOWN * (header.profile.len() + header.library.len())) =>
            {
                (self.profile, self.library) = (header.profile, header.library);
            }
            Record::Message { header, .. } => {
                let (count, span) = if let Some(channel) = directory.channels.get_mut(&header.channel_id) {
                    self.span = Some(widen(self.span, header.log_time));
                    (&mut channel.count, &mut channel.span)
                } else {
                    let first = Early { offset: found.offset, ..Early::default() };
                    let early = early.entry(header.channel_id).or_insert(first);
                    (&mut early.count, &mut early.span)
                };
                *count += 1;
                *span = Some(widen(*span, header.log_time));
            }
            Record::Attachment { header, data, .. } => {
                let size = found.left_out.map_or(data.len() as u64, |left_out| left_out.size);
                let attachment = Attachment { name: header.name, media_type: header.media_type, size };
                if directory.has_room(attachment.weight()) {
                    self.attachments.push(attachment);
                }
            }
            Record::Metadata(record) => {
                let record = Metadata::from(record);
                if directory.has_room(record.weight()) {
                    if !record.is_sound {
                        let name = short(&record.name);
                        let reason = format!("the metadata record `{name}` does not have its checksum");
                        self.refused.push(Damage { offset: found.offset, bytes: 0, reason });
                    }
                    self.metadata.push(record);
                }
            }
            Record::ChunkIndex(index) => {
                let chunks = &mut self.chunks;
                chunks.count += 1;
                chunks.compressed = chunks.compressed.saturating_add(index.compressed_size);
                chunks.uncompressed = chunks.uncompressed.saturating_add(index.uncompressed_size);
                let names = &mut chunks.compression;
                let is_new = !names.contains(&index.compression) && names.len() < MAX_COMPRESSIONS;
                if is_new && directory.has_room(SHOWN * index.compression.len()) {
                    names.push(index.compression);
                }
            }
            _ => {}
        }
    }
}

/// The span of log times with one more \[ns\].
pub(crate) fn widen(span: Option<(u64, u64)>, time: u64) -> (u64, u64) {
    span.map_or((time, time), |(first, last)| (first.min(time), last.max(time)))
}
