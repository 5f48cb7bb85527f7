//! What a recording holds, gathered in one pass over the whole file.

use std::{
    collections::{BTreeMap, HashMap},
    path::Path,
};

use mcap::records::Record;
use prost_reflect::{DescriptorPool, MessageDescriptor};

use crate::recording::{Damage, OpenError, Scan};

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
    pub message: Option<MessageDescriptor>,
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

/// A metadata record.
#[derive(Clone, Debug)]
pub struct Metadata {
    /// Name.
    pub name: String,
    /// Entries.
    pub entries: BTreeMap<String, String>,
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
    /// What ended reading early.
    pub damage: Option<Damage>,
}

/// Descriptors and channels as they come up in a file.
#[derive(Default)]
pub struct Directory {
    schemas: HashMap<u16, (String, Option<DescriptorPool>)>,
    channels: BTreeMap<u16, Channel>,
}

impl Directory {
    /// Takes note of a schema or channel record; other records are left alone.
    pub fn learn(&mut self, record: &Record<'_>) {
        match record {
            Record::Schema { header, data } => {
                self.schemas.entry(header.id).or_insert_with(|| {
                    let is_protobuf = header.encoding == "protobuf";
                    let pool = is_protobuf.then(|| DescriptorPool::decode(data.as_ref()).ok()).flatten();
                    (header.name.clone(), pool)
                });
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id);
                let message = schema.filter(|_| channel.message_encoding == "protobuf");
                let message = message.and_then(|(name, pool)| pool.as_ref()?.get_message_by_name(name));
                self.channels.entry(channel.id).or_insert_with(|| Channel {
                    topic: channel.topic.clone(),
                    schema: schema.map_or_else(String::new, |(name, _)| name.clone()),
                    encoding: channel.message_encoding.clone(),
                    metadata: channel.metadata.clone(),
                    message,
                    count: 0,
                    span: None,
                });
            }
            _ => {}
        }
    }

    /// A channel by its id.
    pub fn channel(&self, id: u16) -> Option<&Channel> {
        self.channels.get(&id)
    }
}

impl Overview {
    /// Reads a whole file.
    ///
    /// # Errors
    ///
    /// The file cannot be read or is no MCAP file. Damage is no error: what was read before it is there.
    pub fn read(path: &Path) -> Result<Self, OpenError> {
        let mut scan = Scan::open(path)?;
        let mut directory = Directory::default();
        let mut overview = Self::default();
        while scan.next(|record| overview.take(record, &mut directory))?.is_some() {}
        overview.channels = directory.channels;
        overview.complete = scan.is_complete();
        overview.damage = scan.damage().cloned();
        Ok(overview)
    }

    fn take(&mut self, record: Record<'_>, directory: &mut Directory) {
        directory.learn(&record);
        match record {
            Record::Header(header) => (self.profile, self.library) = (header.profile, header.library),
            Record::Message { header, .. } => {
                if let Some(channel) = directory.channels.get_mut(&header.channel_id) {
                    let time = header.log_time;
                    let (first, last) = channel.span.unwrap_or((time, time));
                    channel.span = Some((first.min(time), last.max(time)));
                    channel.count += 1;
                }
            }
            Record::Attachment { header, data, .. } => self.attachments.push(Attachment {
                name: header.name,
                media_type: header.media_type,
                size: data.len() as u64,
            }),
            Record::Metadata(record) => {
                self.metadata.push(Metadata { name: record.name, entries: record.metadata });
            }
            Record::ChunkIndex(index) => {
                self.chunks.count += 1;
                self.chunks.compressed += index.compressed_size;
                self.chunks.uncompressed += index.uncompressed_size;
                if !self.chunks.compression.contains(&index.compression) {
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
