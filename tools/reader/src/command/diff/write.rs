//! The difference of two recordings as a recording: the new one minus the reference, message by message.

use std::{
    collections::{BTreeMap, HashMap},
    io::BufWriter,
    path::Path,
};

use mcap::{
    WriteOptions, Writer,
    records::{MessageHeader, Metadata},
    write::NoSeek,
};
use percuss_output::Output;
use prost_reflect::{DynamicMessage, MessageDescriptor, ReflectMessage, Value, prost::Message};

use crate::{
    channel::Channel, compare::Matched, convention, failure::Failure, messages::Recording, wire::dynamic,
};

/// Writes differences: on `/diff/TOPIC`, in the message type of the topic, every floating-point number but times and
/// axes is b − a, all else is that of the reference. Viewers show such a file like a recording.
pub(super) struct DiffWriter {
    writer: Writer<NoSeek<BufWriter<Output>>>,
    channels: HashMap<u16, Target>,
    sequence: u32,
    /// Memory of a decoded message \[bytes\].
    room: usize,
}

/// A channel that is written.
struct Target {
    id: u16,
    a: MessageDescriptor,
    b: MessageDescriptor,
    /// Fields that are not subtracted.
    kept: Vec<String>,
}

impl DiffWriter {
    /// Creates the file with a channel for every topic that both recordings have.
    ///
    /// * `overwrite`: replace a file of this name
    pub(super) fn begin(path: &Path, overwrite: bool, a: &Recording, b: &Recording) -> Result<Self, Failure> {
        let file = Output::create(path, overwrite)?;
        let options = WriteOptions::new()
            .library(concat!("percuss-read/", env!("CARGO_PKG_VERSION")))
            .compression_threads(0)
            .disable_seeking(true);
        let mut writer = options.create(NoSeek::new(BufWriter::new(file)))?;
        let mut channels = HashMap::new();
        for (&id, channel) in &a.channels {
            let other = b.channels.values().find(|other| other.topic == channel.topic);
            let (Some(layout), Some(layout_b)) =
                (&channel.layout, other.and_then(|other| other.layout.as_ref()))
            else {
                continue;
            };
            if layout.is_json() || layout_b.is_json() {
                continue;
            }
            let descriptor = layout.descriptor();
            let pool = descriptor.parent_pool().encode_to_vec();
            let schema = writer.add_schema(descriptor.full_name(), "protobuf", &pool)?;
            let slash = if channel.topic.starts_with('/') { "" } else { "/" };
            let topic = format!("{}{slash}{}", convention::DIFFERENCES, channel.topic);
            let target = Target {
                id: writer.add_channel(schema, &topic, "protobuf", &channel.metadata)?,
                a: descriptor.clone(),
                b: layout_b.descriptor().clone(),
                kept: kept(channel),
            };
            channels.insert(id, target);
        }
        let entries = [("a", a), ("b", b)].map(|(key, of)| (key.to_owned(), of.path.display().to_string()));
        let metadata = BTreeMap::from(entries);
        let record = Metadata { name: convention::DIFFERENCE.into(), metadata };
        writer.write_metadata(&record)?;
        Ok(Self { writer, channels, sequence: 0, room: a.limits().values() / 2 })
    }

    /// Writes the difference of two messages.
    pub(super) fn take(&mut self, matched: &Matched<'_>) -> Result<(), Failure> {
        let Some(target) = self.channels.get(&matched.channel) else { return Ok(()) };
        let decode = |descriptor, data| dynamic(descriptor, data, self.room);
        let (Ok(mut a), Ok(b)) = (decode(&target.a, matched.a), decode(&target.b, matched.b)) else {
            return Ok(());
        };
        subtract(&mut a, &b, "", &target.kept);
        let header = MessageHeader {
            channel_id: target.id,
            sequence: self.sequence,
            log_time: matched.log_time,
            publish_time: matched.log_time,
        };
        self.sequence = self.sequence.wrapping_add(1);
        Ok(self.writer.write_to_known_channel(&header, &a.encode_to_vec())?)
    }

    /// Ends the file.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        self.writer.finish()?;
        let output =
            self.writer.into_inner().into_inner().into_inner().map_err(|error| error.into_error())?;
        Ok(output.commit()?)
    }
}

/// Fields that say where and when the others are.
fn kept(channel: &Channel) -> Vec<String> {
    let axes = channel.axis_parts().into_iter().map(str::to_owned);
    axes.chain([convention::TIME.to_owned()]).collect()
}

/// a ← b − a for floating-point numbers.
fn subtract(a: &mut DynamicMessage, b: &DynamicMessage, prefix: &str, kept: &[String]) {
    let fields: Vec<_> = a.descriptor().fields().collect();
    for field in fields {
        let path = format!("{prefix}{}", field.name());
        let other = b.get_field_by_name(field.name());
        let Some(other) = other.filter(|_| !kept.contains(&path)) else { continue };
        if field.supports_presence() && !a.has_field(&field) {
            continue;
        }
        let mut value = a.get_field(&field).into_owned();
        subtract_value(&mut value, &other, &format!("{path}."), kept);
        a.set_field(&field, value);
    }
}

fn subtract_value(a: &mut Value, b: &Value, prefix: &str, kept: &[String]) {
    match (a, b) {
        (Value::F64(a), Value::F64(b)) => *a = *b - *a,
        (Value::F32(a), Value::F32(b)) => *a = *b - *a,
        (Value::List(a), Value::List(b)) => {
            a.iter_mut().zip(b).for_each(|(a, b)| subtract_value(a, b, prefix, kept));
        }
        (Value::Message(a), Value::Message(b)) => subtract(a, b, prefix, kept),
        _ => {}
    }
}
