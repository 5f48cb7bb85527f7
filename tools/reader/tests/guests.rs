//! Recordings as other programs write them: protobuf and JSON, on a wall clock.

use std::{collections::BTreeMap, io::Cursor};

use mcap::{Compression, WriteOptions, Writer, records::MessageHeader};
use prost_reflect::{DescriptorPool, DynamicMessage, prost::Message};

use crate::forge;

/// Log time of the first messages: 2023-11-14T22:13:20Z \[ns\].
pub const START: u64 = 1_700_000_000_000_000_000;

/// Nanoseconds between messages.
pub const STEP: u64 = 100_000_000;

/// Types of messages in the package `guest`, a line for each, with an enum `Mode` of `IDLE` and `RUN`.
pub fn types(messages: &str) -> DescriptorPool {
    let mut file = forge::types("guest", messages, ("Mode", ["IDLE", "RUN"]));
    file.dependency = ["timestamp", "duration", "any", "struct", "wrappers", "field_mask"]
        .map(|name| format!("google/protobuf/{name}.proto"))
        .to_vec();
    let mut pool = DescriptorPool::global();
    pool.add_file_descriptor_proto(file).expect("sound types");
    pool
}

/// A channel of another program.
pub struct Guest {
    topic: String,
    /// Name, encoding and text.
    schema: Option<(String, &'static str, Vec<u8>)>,
    encoding: &'static str,
    /// Log times and content.
    pub messages: Vec<(u64, Vec<u8>)>,
}

/// Every message a step after the one before.
fn timed(messages: impl IntoIterator<Item = Vec<u8>>) -> Vec<(u64, Vec<u8>)> {
    (0..).zip(messages).map(|(i, message)| (START + i * STEP, message)).collect()
}

impl Guest {
    /// Protobuf messages, given in the JSON mapping.
    pub fn protobuf(topic: &str, pool: &DescriptorPool, name: &str, messages: &[serde_json::Value]) -> Self {
        let name = format!("guest.{name}");
        let descriptor = pool.get_message_by_name(&name).expect("the type");
        let message = |value: &serde_json::Value| {
            DynamicMessage::deserialize(descriptor.clone(), value).expect("a message").encode_to_vec()
        };
        Self {
            topic: topic.into(),
            schema: Some((name, "protobuf", pool.encode_to_vec())),
            encoding: "protobuf",
            messages: timed(messages.iter().map(message)),
        }
    }

    /// JSON messages, with a schema or without.
    pub fn json(topic: &str, schema: Option<(&str, &str)>, messages: &[String]) -> Self {
        Self {
            topic: topic.into(),
            schema: schema.map(|(name, text)| (name.into(), "jsonschema", text.as_bytes().to_vec())),
            encoding: "json",
            messages: timed(messages.iter().map(|message| message.as_bytes().to_vec())),
        }
    }
}

/// A recording of some channels; messages in the order of the channels, whatever their log times.
pub fn write(channels: &[Guest], compression: Option<Compression>) -> Vec<u8> {
    let options = WriteOptions::new().library("another program").compression(compression);
    let mut writer: Writer<Cursor<Vec<u8>>> = options.create(Cursor::new(Vec::new())).expect("a writer");
    for guest in channels {
        let schema = match &guest.schema {
            Some((name, encoding, text)) => writer.add_schema(name, encoding, text).expect("a schema"),
            None => 0,
        };
        let id =
            writer.add_channel(schema, &guest.topic, guest.encoding, &BTreeMap::new()).expect("a channel");
        for (sequence, (log_time, data)) in (0..).zip(&guest.messages) {
            let (log_time, publish_time) = (*log_time, *log_time);
            let header = MessageHeader { channel_id: id, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, data).expect("a message");
        }
    }
    writer.finish().expect("the end");
    writer.into_inner().into_inner()
}
