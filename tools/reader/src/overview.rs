//! What a recording holds, gathered in one pass over the whole file.

use std::{
    collections::{BTreeMap, HashMap, HashSet},
    path::Path,
    sync::Arc,
};

use mcap::records::Record;
use prost_reflect::DescriptorPool;

use crate::{
    field::time_leaf,
    recording::{Budget, Damage, Found, Limits, Next, OpenError, Scan, seconds},
    text::short,
    wire::{
        Layout, List,
        schema::{SchemaError, pool},
    },
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

    /// What the axes of arrays are made of: names of fields that only describe them.
    pub fn axis_parts(&self) -> HashSet<&str> {
        /// Names of an axis at most: start, step and number of rows and of columns. More parts are positions.
        const NAMES: usize = 6;
        let axes = self.metadata.iter().filter(|(key, _)| key.starts_with("axis."));
        let parts = axes.map(|(_, axis)| axis.split([',', ';']).map(str::trim));
        parts.filter(|parts| parts.clone().nth(NAMES).is_none()).flatten().collect()
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
    /// Memory that it takes \[bytes\].
    pub(crate) fn weight(&self) -> usize {
        256 + SHOWN * (self.name.len() + self.media_type.len())
    }
}

/// Forms in which a text of a file is kept until it is printed, some longer than the text: escaped, in a document.
const SHOWN: usize = 8;

/// Memory of an entry of a map of texts, besides its bytes \[bytes\].
const ENTRY: usize = 160;

fn weight_of_entries(entries: &BTreeMap<String, String>) -> usize {
    entries.iter().map(|(key, value)| ENTRY + SHOWN * (key.len() + value.len())).sum()
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
    /// Memory that it takes \[bytes\].
    pub(crate) fn weight(&self) -> usize {
        256 + SHOWN * self.name.len() + weight_of_entries(&self.entries)
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
    /// What is damaged or cut off, or was refused.
    pub damages: Vec<Damage>,
    /// What of these was refused because it takes too much memory.
    pub(crate) refused: Vec<Damage>,
}

/// Descriptors and channels as they come up in a file.
pub struct Directory {
    schemas: HashMap<u16, Schema>,
    channels: BTreeMap<u16, Channel>,
    budget: Budget,
    limits: Limits,
    overflowed: bool,
    refused: Vec<Damage>,
}

struct Schema {
    name: String,
    encoding: String,
    pool: Option<DescriptorPool>,
    layout: Option<Arc<Layout>>,
    /// Why a descriptor set is not used.
    reason: Option<String>,
}

/// Schemas that are told one by one where there is no room for their types.
const MAX_REFUSED: usize = 16;

impl Directory {
    /// Has room for as much as the limits say.
    pub fn new(limits: Limits) -> Self {
        Self {
            schemas: HashMap::new(),
            channels: BTreeMap::new(),
            budget: Budget::new(limits.directory()),
            limits,
            overflowed: false,
            refused: Vec::new(),
        }
    }

    /// Takes note of a schema or channel record; other records are left alone.
    pub fn learn(&mut self, record: &Record<'_>) {
        match record {
            Record::Schema { header, data } if !self.schemas.contains_key(&header.id) => {
                if !self.has_room(512 + SHOWN * (header.name.len() + header.encoding.len())) {
                    return;
                }
                let (name, encoding) = (header.name.clone(), header.encoding.clone());
                let mut schema = Schema { name, encoding, pool: None, layout: None, reason: None };
                if header.encoding == "protobuf" {
                    match pool(data, self.budget.left()) {
                        Ok((pool, weight)) => {
                            schema.pool = Some(pool);
                            self.has_room(weight);
                        }
                        Err(error) => {
                            schema.reason = Some(short(&error.to_string()).into_owned());
                            if let SchemaError::TooLarge { .. } = error {
                                self.refuse(format!("the schema `{}`: {error}", short(&header.name)));
                            }
                        }
                    }
                }
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                let schema = self.schemas.get_mut(&channel.schema_id);
                let name = schema.as_ref().map_or(0, |schema| schema.name.len());
                let texts = channel.topic.len() + channel.message_encoding.len() + name;
                let weight = 1024 + SHOWN * texts + weight_of_entries(&channel.metadata);
                if !self.has_room(weight) {
                    return;
                }
                let is_protobuf = channel.message_encoding == "protobuf";
                let layout = if is_protobuf { self.layout(channel.schema_id, &channel.topic) } else { None };
                let schema = self.schemas.get(&channel.schema_id);
                let known = Channel {
                    topic: channel.topic.clone(),
                    schema: schema.map_or_else(String::new, |schema| schema.name.clone()),
                    encoding: channel.message_encoding.clone(),
                    metadata: channel.metadata.clone(),
                    layout,
                    count: 0,
                    span: None,
                };
                self.channels.insert(channel.id, known);
            }
            _ => {}
        }
    }

    /// The layout of the messages of a channel; made once for every schema.
    fn layout(&mut self, schema_id: u16, topic: &str) -> Option<Arc<Layout>> {
        let schema = self.schemas.get_mut(&schema_id)?;
        if schema.layout.is_none() {
            let message = schema.pool.as_ref()?.get_message_by_name(&schema.name)?;
            let layout = Layout::of(&message).within(self.limits.values());
            if !self.budget.spend(layout.weight()) {
                self.refuse(format!("the fields of `{}` (--max-memory)", short(topic)));
                return None;
            }
            schema.layout = Some(Arc::new(layout));
        }
        let layout = schema.layout.clone()?;
        // every channel keeps a message, taken apart, and names for its fields
        if !self.budget.spend(layout.leaves.len() * size_of::<List>()) {
            self.refuse(format!("the fields of `{}` (--max-memory)", short(topic)));
            return None;
        }
        Some(layout)
    }

    fn refuse(&mut self, what: String) {
        if self.refused.len() < MAX_REFUSED {
            self.refused.push(Damage { offset: 0, bytes: 0, reason: format!("no room for {what}") });
        }
    }

    /// True, and so many bytes less of room, if there is room for what a record says.
    pub(crate) fn has_room(&mut self, bytes: usize) -> bool {
        self.overflowed |= !self.budget.spend(bytes);
        !self.overflowed
    }

    /// What was refused because there was no room for it.
    pub(crate) fn refused(&self) -> Vec<Damage> {
        let mut refused = self.refused.clone();
        if self.overflowed {
            let room = self.limits.directory();
            let reason = format!(
                "schemas, channels and metadata take more than {room} bytes; the rest is left out (--max-memory)"
            );
            refused.push(Damage { offset: 0, bytes: 0, reason });
        }
        refused
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
        let is_sound = pool.is_some_and(|pool| pool.get_message_by_name(&schema.name).is_some());
        let (name, encoding) = (schema.name.clone(), schema.encoding.clone());
        Some(SchemaState { name, encoding, is_sound, reason: schema.reason.clone() })
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
    /// Why its types are not known, where it is protobuf.
    pub reason: Option<String>,
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
        overview.refused = directory.refused();
        overview.complete = scan.is_complete() && overview.refused.is_empty();
        overview.damages = scan.damages().to_vec();
        overview.damages.extend_from_slice(&overview.refused);
        overview.channels = directory.channels;
        Ok(overview)
    }

    fn take(&mut self, found: Found<'_>, directory: &mut Directory) {
        directory.learn(&found.record);
        match found.record {
            // as long as they please, as often as they please
            Record::Header(header)
                if directory.has_room(SHOWN * (header.profile.len() + header.library.len())) =>
            {
                (self.profile, self.library) = (header.profile, header.library);
            }
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
                let is_new = !names.contains(&index.compression) && names.len() < MAX_COMPRESSIONS;
                if is_new && directory.has_room(SHOWN * index.compression.len()) {
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
