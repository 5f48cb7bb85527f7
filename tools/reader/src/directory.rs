//! Definitions: schema and channel records become channels, within the memory there is for them.

use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
};

use mcap::records::{self, Record, SchemaHeader};
use prost_reflect::DescriptorPool;

use crate::{
    channel::Channel,
    recording::{Budget, Damage, ENTRY, Limits},
    text::short,
    wire::{
        Layout, List,
        json::{self, Shape},
        schema::{SchemaError, pool},
    },
};

/// Forms in which a text of a file is kept until it is printed, some longer than the text: escaped, in a document.
pub(crate) const SHOWN: usize = 8;

/// Memory of the entries of a metadata record \[bytes\].
pub(crate) fn weight_of_entries(entries: &BTreeMap<String, String>) -> usize {
    entries.iter().map(|(key, value)| ENTRY + SHOWN * (key.len() + value.len())).sum()
}

/// Descriptors and channels as they come up in a file.
pub struct Directory {
    schemas: HashMap<u16, Schema>,
    pub(crate) channels: BTreeMap<u16, Channel>,
    /// What the schemas of channels with JSON messages say of these.
    pub(crate) shapes: BTreeMap<u16, Shape>,
    /// Memory that is left for definitions.
    pub(crate) budget: Budget,
    limits: Limits,
    overflowed: bool,
    refused: Vec<Damage>,
}

#[derive(Default)]
struct Schema {
    name: String,
    encoding: String,
    pool: Option<DescriptorPool>,
    layout: Option<Arc<Layout>>,
    /// What a JSON schema says.
    shape: Shape,
    reason: Option<String>,
}

/// Schemas that are reported one by one where there is no room for their types.
const MAX_REFUSED: usize = 16;

/// What is said of a channel that is defined twice, differently.
pub(crate) fn defined_again(channel: &records::Channel, first: &str) -> String {
    let (id, first, other) = (channel.id, short(first), short(&channel.topic));
    format!("channel {id} is defined again as `{other}`: it stays `{first}`")
}

impl Directory {
    /// Has room for as much as the limits say.
    pub fn new(limits: Limits) -> Self {
        Self {
            schemas: HashMap::new(),
            channels: BTreeMap::new(),
            shapes: BTreeMap::new(),
            budget: Budget::new(limits.directory()),
            limits,
            overflowed: false,
            refused: Vec::new(),
        }
    }

    /// Adds a schema or channel record; other records are ignored.
    pub fn learn(&mut self, record: &Record<'_>) {
        match record {
            Record::Schema { header, data } if !self.schemas.contains_key(&header.id) => {
                self.add_schema(header, data);
            }
            Record::Channel(channel) if !self.channels.contains_key(&channel.id) => {
                self.add_channel(channel);
            }
            _ => {}
        }
    }

    fn add_schema(&mut self, header: &SchemaHeader, data: &[u8]) {
        if !self.has_room(512 + SHOWN * (header.name.len() + header.encoding.len())) {
            return;
        }
        let (name, encoding) = (header.name.clone(), header.encoding.clone());
        let mut schema = Schema { name, encoding, ..Schema::default() };
        if header.encoding == "jsonschema" {
            // where it says nothing, the messages do
            match json::shape(data, &mut self.budget) {
                Ok(shape) => schema.shape = shape,
                Err(error) => schema.reason = Some(short(&error).into_owned()),
            }
        }
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

    fn add_channel(&mut self, channel: &records::Channel) {
        let schema = self.schemas.get(&channel.schema_id).map_or(String::new(), |schema| schema.name.clone());
        let texts = channel.topic.len() + channel.message_encoding.len() + schema.len();
        if !self.has_room(1024 + SHOWN * texts + weight_of_entries(&channel.metadata)) {
            return;
        }
        let mut known = Channel {
            topic: channel.topic.clone(),
            schema,
            encoding: channel.message_encoding.clone(),
            metadata: channel.metadata.clone(),
            ..Channel::default()
        };
        match known.encoding.as_str() {
            "protobuf" => known.layout = self.layout(channel.schema_id, &channel.topic),
            "json" => {
                let shape = self.schemas.get(&channel.schema_id).map(|schema| &schema.shape);
                let weight = shape.map_or(0, Shape::weight);
                // a shape is kept for every channel
                let shape = shape.filter(|_| self.budget.spend(weight)).cloned().unwrap_or_default();
                self.shapes.insert(channel.id, shape);
            }
            _ => {}
        }
        self.channels.insert(channel.id, known);
    }

    /// The layout of the messages of a channel; made once for every schema.
    fn layout(&mut self, schema_id: u16, topic: &str) -> Option<Arc<Layout>> {
        let schema = self.schemas.get_mut(&schema_id)?;
        let layout = match &schema.layout {
            Some(layout) => Some(layout.clone()),
            None => {
                let message = schema.pool.as_ref()?.get_message_by_name(&schema.name)?;
                let layout = Layout::of(&message).within(self.limits.values());
                schema.layout = self.budget.spend(layout.weight).then(|| Arc::new(layout));
                schema.layout.clone()
            }
        };
        // every channel keeps a decoded message and names for its fields
        let layout = layout.filter(|layout| self.budget.spend(layout.leaves.len() * size_of::<List>()));
        if layout.is_none() {
            self.refuse(format!("the fields of `{}` (--max-memory)", short(topic)));
        }
        layout
    }

    fn refuse(&mut self, what: String) {
        if self.refused.len() < MAX_REFUSED {
            self.refused.push(Damage::refusal(format!("no room for {what}")));
        }
    }

    /// Spends memory for a record; false if there is no room for it, and from then on.
    pub(crate) fn has_room(&mut self, bytes: usize) -> bool {
        self.overflowed |= !self.budget.spend(bytes);
        !self.overflowed
    }

    /// What was refused because there was no room for it.
    pub(crate) fn refused(&self) -> Vec<Damage> {
        let mut refused = self.refused.clone();
        if self.overflowed {
            let room = self.limits.directory();
            refused.push(Damage::refusal(format!(
                "schemas, channels and metadata take more than {room} bytes; the rest is left out (--max-memory)"
            )));
        }
        refused
    }

    /// True if there was no room for all schemas, channels and metadata: what follows of those is left out.
    pub fn has_overflowed(&self) -> bool {
        self.overflowed
    }

    /// The channels by their ids.
    pub fn channels(&self) -> &BTreeMap<u16, Channel> {
        &self.channels
    }

    /// Why a protobuf schema does not describe the message it is named after; `None` if it does. Empty where the descriptors
    /// are sound.
    pub fn flaw(&self, id: u16) -> Option<&str> {
        let schema = self.schemas.get(&id).filter(|schema| schema.encoding == "protobuf")?;
        match &schema.pool {
            Some(pool) if pool.get_message_by_name(&schema.name).is_some() => None,
            _ => Some(schema.reason.as_deref().unwrap_or_default()),
        }
    }
}
