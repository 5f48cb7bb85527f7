//! What a recording holds, gathered in one pass over the whole file.

use std::{
    collections::{BTreeMap, HashMap},
    path::Path,
    sync::Arc,
};

use mcap::records::Record;
use prost_reflect::DescriptorPool;

use crate::{
    field::time_leaf,
    recording::{Damage, Found, Limits, Next, OpenError, Scan, seconds},
    wire::Layout,
};

/// A channel.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Topic.
    pub topic: String,
    /// Name of the schema, empty if there is none.
    pub schema: String,
    /// Encoding of the messages.
    pub encoding: String,
    /// Metadata: units, meanings, axes.
    pub metadata: BTreeMap<String, String>,
    /// Type of the messages, if they are protobuf and the schema is sound.
    pub layout: Option<Arc<Layout>>,
    /// Number of messages.
    pub count: u64,
    /// First and last log time \[ns\].
    pub span: Option<(u64, u64)>,
}

impl Channel {
    /// Unit of a field; `None` if unknown or a plain number.
    pub fn unit(&self, field: &str) -> Option<&str> {
        self.metadata.get(&format!("unit.{field}")).map(String::as_str).filter(|unit| *unit != "1")
    }

    /// True if it shows in another form what other channels hold: its metadata has the key `derived`.
    pub fn is_derived(&self) -> bool {
        self.metadata.contains_key("derived")
    }

    /// Time of a message: its field `time`, else its log time in seconds.
    pub fn time_of(&self, bytes: &[u8], log_time: u64) -> f64 {
        let time = self.layout.as_ref().and_then(|layout| layout.peek(time_leaf(layout)?, bytes));
        time.unwrap_or_else(|| seconds(log_time))
    }

    /// True if messages say their time themselves.
    pub fn has_time(&self) -> bool {
        self.layout.as_ref().is_some_and(|layout| time_leaf(layout).is_some())
    }

    /// What the axes of arrays are made of: names of fields that only describe them, or positions.
    pub fn axis_parts(&self) -> Vec<&str> {
        let axes = self.metadata.iter().filter(|(key, _)| key.starts_with("axis."));
        axes.flat_map(|(_, axis)| axis.split([',', ';']).map(str::trim)).collect()
    }
}

/// An attachment, without its content.
#[derive(Clone, Debug)]
pub struct Attachment {
    /// Name.
    pub name: String,
    /// Media type.
    pub media_type: String,
    /// Size \[bytes\].
    pub size: u64,
}

impl Attachment {
    /// Bytes of memory that it takes, roughly.
    pub(crate) fn weight(&self) -> usize {
        64 + self.name.len() + self.media_type.len()
    }
}

/// Compressions that are listed by name.
const MAX_COMPRESSIONS: usize = 16;

/// A metadata record.
#[derive(Clone, Debug)]
pub struct Metadata {
    /// Name.
    pub name: String,
    /// Entries.
    pub entries: BTreeMap<String, String>,
}

impl Metadata {
    /// Bytes of memory that it takes, roughly.
    pub(crate) fn weight(&self) -> usize {
        let entries = self.entries.iter().map(|(key, value)| 64 + key.len() + value.len());
        64 + self.name.len() + entries.sum::<usize>()
    }
}

/// Chunks as the summary of the file lists them.
#[derive(Clone, Debug, Default)]
pub struct Chunks {
    /// Number of chunks.
    pub count: u64,
    /// Size in the file \[bytes\].
    pub compressed: u64,
    /// Size of their content \[bytes\].
    pub uncompressed: u64,
    /// Compressions used.
    pub compression: Vec<String>,
}

/// What a recording holds.
#[derive(Clone, Debug, Default)]
pub struct Overview {
    /// Profile and library of the header.
    pub profile: String,
    /// Program that wrote the file.
    pub library: String,
    /// Channels in the order of their ids.
    pub channels: BTreeMap<u16, Channel>,
    /// Attachments in the order of the file.
    pub attachments: Vec<Attachment>,
    /// Metadata records in the order of the file.
    pub metadata: Vec<Metadata>,
    /// Chunks, where the file has a summary.
    pub chunks: Chunks,
    /// True if the file is whole and sound from magic to magic.
    pub complete: bool,
    /// What is damaged or cut off.
    pub damages: Vec<Damage>,
}

/// Descriptors and channels as they come up in a file.
pub struct Directory {
    schemas: HashMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    room: usize,
    overflowed: bool,
}

struct Schema {
    name: String,
    encoding: String,
    pool: Option<DescriptorPool>,
    layout: Option<Arc<Layout>>,
}

impl Directory {
    /// Has room for as much as the limits say.
    pub fn new(limits: Limits) -> Self {
        Self {
            schemas: HashMap::new(),
            channels: BTreeMap::new(),
            room: limits.directory(),
            overflowed: false,
        }
    }

    /// Takes note of a schema or channel record; other records are left alone.
    pub fn learn(&mut self, record: &Record<'_>) {
        match record {
            Record::Schema { header, data } if !self.schemas.contains_key(&header.id) => {
                if !self.has_room(header.name.len() + data.len()) {
                    return;
                }
                let is_protobuf = header.encoding == "protobuf";
                let pool = is_protobuf.then(|| DescriptorPool::decode(data.as_ref()).ok()).flatten();
                let (name, encoding) = (header.name.clone(), header.encoding.clone());
                self.schemas.insert(header.id, Schema { name, encoding, pool, layout: None });
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                let entries = channel.metadata.iter().map(|(key, value)| 64 + key.len() + value.len());
                if !self.has_room(256 + channel.topic.len() + entries.sum::<usize>()) {
                    return;
                }
                let schema = self.schemas.get_mut(&channel.schema_id);
                let known = Channel {
                    topic: channel.topic.clone(),
                    schema: schema.as_ref().map_or_else(String::new, |schema| schema.name.clone()),
                    encoding: channel.message_encoding.clone(),
                    metadata: channel.metadata.clone(),
                    layout: schema
                        .filter(|_| channel.message_encoding == "protobuf")
                        .and_then(Schema::layout),
                    count: 0,
                    span: None,
                };
                self.channels.insert(channel.id, known);
            }
            _ => {}
        }
    }

    /// True, and so many bytes less of room, if there is room for what a record says.
    pub(crate) fn has_room(&mut self, bytes: usize) -> bool {
        match self.room.checked_sub(bytes) {
            Some(room) => self.room = room,
            None => self.overflowed = true,
        }
        !self.overflowed
    }

    /// True if there was no room for all schemas, channels and metadata: what follows of those is left out.
    pub fn has_overflowed(&self) -> bool {
        self.overflowed
    }

    /// A channel by its id.
    pub fn channel(&self, id: u16) -> Option<&Channel> {
        self.channels.get(&id)
    }

    /// The channels by their ids.
    pub fn channels(&self) -> &BTreeMap<u16, Channel> {
        &self.channels
    }

    /// The channels themselves.
    pub fn into_channels(self) -> BTreeMap<u16, Channel> {
        self.channels
    }

    /// What is known of a schema.
    pub fn schema(&self, id: u16) -> Option<SchemaState> {
        let schema = self.schemas.get(&id)?;
        let pool = schema.pool.as_ref();
        Some(SchemaState {
            name: schema.name.clone(),
            encoding: schema.encoding.clone(),
            is_sound: pool.is_some_and(|pool| pool.get_message_by_name(&schema.name).is_some()),
        })
    }
}

/// What is known of a schema.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SchemaState {
    /// Name.
    pub name: String,
    /// Encoding.
    pub encoding: String,
    /// True if it is protobuf and describes the message it is named after.
    pub is_sound: bool,
}

impl Schema {
    /// The layout of its messages, made once.
    fn layout(&mut self) -> Option<Arc<Layout>> {
        if self.layout.is_none() {
            let message = self.pool.as_ref()?.get_message_by_name(&self.name)?;
            self.layout = Some(Arc::new(Layout::of(&message)));
        }
        self.layout.clone()
    }
}

impl Overview {
    /// Reads a whole file.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is no MCAP file. Damage is no error: what is sound is there.
    pub fn read(path: &Path, limits: Limits) -> Result<Self, OpenError> {
        let mut scan = Scan::open(path, limits)?;
        let mut directory = Directory::new(limits);
        let mut overview = Self::default();
        while scan.next(|found| overview.take(found, &mut directory))? != Next::End {}
        overview.complete = scan.is_complete() && !directory.overflowed;
        overview.damages = scan.damages().to_vec();
        if directory.overflowed {
            let reason = format!(
                "more than {} bytes of schemas, channels and metadata; the rest is left out (--max-memory)",
                limits.directory()
            );
            overview.damages.push(Damage { offset: 0, bytes: 0, reason });
        }
        overview.channels = directory.channels;
        Ok(overview)
    }

    fn take(&mut self, found: Found<'_>, directory: &mut Directory) {
        directory.learn(&found.record);
        match found.record {
            Record::Header(header) => (self.profile, self.library) = (header.profile, header.library),
            Record::Message { header, .. } => {
                if let Some(channel) = directory.channels.get_mut(&header.channel_id) {
                    let time = header.log_time;
                    let (first, last) = channel.span.unwrap_or((time, time));
                    channel.span = Some((first.min(time), last.max(time)));
                    channel.count += 1;
                }
            }
            Record::Attachment { header, data, .. } => {
                let attachment =
                    Attachment { name: header.name, media_type: header.media_type, size: data.len() as u64 };
                if directory.has_room(attachment.weight()) {
                    self.attachments.push(attachment);
                }
            }
            Record::Metadata(record) => {
                let record = Metadata { name: record.name, entries: record.metadata };
                if directory.has_room(record.weight()) {
                    self.metadata.push(record);
                }
            }
            Record::ChunkIndex(index) => {
                self.chunks.count += 1;
                self.chunks.compressed += index.compressed_size;
                self.chunks.uncompressed += index.uncompressed_size;
                let names = &self.chunks.compression;
                if !names.contains(&index.compression) && names.len() < MAX_COMPRESSIONS {
                    self.chunks.compression.push(index.compression);
                }
            }
            _ => {}
        }
    }

    /// First and last log time of all messages \[ns\].
    pub fn span(&self) -> Option<(u64, u64)> {
        let spans = self.channels.values().filter_map(|channel| channel.span);
        spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
    }

    /// Entries of a metadata record.
    pub fn metadata(&self, name: &str) -> Option<&BTreeMap<String, String>> {
        self.metadata.iter().rev().find(|record| record.name == name).map(|record| &record.entries)
    }

    /// How the recording ended, in its own words; `None` if it does not say.
    pub fn status(&self) -> Option<&str> {
        self.metadata("percuss.status")?.get("status").map(String::as_str)
    }

    /// True for recordings of percuss.
    pub fn is_percuss(&self) -> bool {
        self.metadata("percuss.run").is_some()
    }
}
