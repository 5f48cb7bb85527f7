//! Recordings of small cases, and the same in SI units with made-up scales.

use std::{
    collections::{BTreeMap, HashMap},
    fs,
    io::Cursor,
    path::Path,
};

use mcap::{
    MessageStream, Summary, Writer,
    records::{MessageHeader, Metadata},
};
use percuss::{
    case::{Case, builtin},
    recording::Destination,
    session::{self, Recording, Source},
    simulation::Simulation,
    warnings::Warned,
};
use prost_reflect::{DescriptorPool, DynamicMessage, Value, prost::Message};

/// Units: dimensionless, in SI, the key of the scale and the scale.
pub const SCALES: [(&str, &str, &str, f64); 6] = [
    ("R", "m", "scale.length_m", 0.013),
    ("R/c_p", "s", "scale.time_s", 2.3e-6),
    ("c_p", "m/s", "scale.speed_m_per_s", 5652.0),
    ("γc_p²", "Pa", "scale.stress_pa", 2.7e11),
    ("πR²γc_p²", "N", "scale.force_n", 1.4e8),
    ("πR³γc_p²", "J", "scale.energy_j", 1.9e6),
];

/// Records a built-in case with some settings.
pub fn record(name: &str, settings: &[&str], path: &Path) {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    let text = builtin::find(name).expect("a built-in case");
    let case = Case::parse(name, text, &settings, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let mut recording =
        Recording::create(&Destination::new(path), &case, Source::Simulation).expect("a new file");
    let mut steps = Warned::new(&case, Simulation::new(&case));
    session::run(&mut steps, &mut [&mut recording]).expect("room on the disk");
}

fn scaled(value: &Value, scale: f64) -> Value {
    match value {
        Value::F64(number) => Value::F64(number * scale),
        Value::F32(number) => Value::F32((f64::from(*number) * scale) as f32),
        Value::List(list) => Value::List(list.iter().map(|value| scaled(value, scale)).collect()),
        other => other.clone(),
    }
}

/// Unit and scale of every field of a channel.
fn scales(metadata: &BTreeMap<String, String>) -> HashMap<String, (&'static str, f64)> {
    let scale = |(key, unit): (&String, &String)| {
        let field = key.strip_prefix("unit.")?;
        let (_, si, _, scale) = SCALES.into_iter().find(|(dimensionless, ..)| dimensionless == unit)?;
        Some((field.to_owned(), (si, scale)))
    };
    metadata.iter().filter_map(scale).collect()
}

/// The metadata of a channel in SI; lists of positions are lengths.
fn metadata_in_si(metadata: &BTreeMap<String, String>) -> BTreeMap<String, String> {
    let scales = scales(metadata);
    let entry = |(key, value): (&String, &String)| {
        let unit =
            key.strip_prefix("unit.").and_then(|field| scales.get(field)).map(|(si, _)| (*si).to_owned());
        let list: Option<Vec<f64>> = value.split(',').map(|item| item.trim().parse().ok()).collect();
        let list = list.filter(|_| key.starts_with("axis.")).map(|list| {
            list.iter().map(|number| (number * SCALES[0].3).to_string()).collect::<Vec<_>>().join(",")
        });
        (key.clone(), unit.or(list).unwrap_or_else(|| value.clone()))
    };
    metadata.iter().map(entry).collect()
}

/// The channels of percuss of a recording in SI, with another relation of log time; `recorded` changes a scale as it stands in
/// the file.
pub fn in_si(bytes: &[u8], recorded: impl Fn(&str, f64) -> Option<f64>) -> Vec<u8> {
    let mut writer = Writer::new(Cursor::new(Vec::new())).expect("a writer");
    let mut channels = HashMap::new();
    for message in MessageStream::new(bytes).expect("a recording") {
        let message = message.expect("a message");
        let channel = &message.channel;
        let schema = channel.schema.as_ref().expect("a schema");
        if !schema.name.starts_with("percuss.") || channel.metadata.contains_key("derived") {
            continue;
        }
        let (id, descriptor, scales) = channels.entry(channel.id).or_insert_with(|| {
            let known = writer.add_schema(&schema.name, "protobuf", &schema.data).expect("a schema");
            let metadata = metadata_in_si(&channel.metadata);
            let id = writer.add_channel(known, &channel.topic, "protobuf", &metadata).expect("a channel");
            let pool = DescriptorPool::decode(schema.data.as_ref()).expect("a sound schema");
            (id, pool.get_message_by_name(&schema.name).expect("the type"), scales(&channel.metadata))
        });
        let mut content =
            DynamicMessage::decode(descriptor.clone(), message.data.as_ref()).expect("a message");
        for (field, (_, scale)) in scales.iter() {
            let known = descriptor.get_field_by_name(field).expect("the field");
            if content.has_field(&known) {
                let value = scaled(&content.get_field(&known), *scale);
                content.set_field(&known, value);
            }
        }
        let log_time = message.log_time * 2;
        let header =
            MessageHeader { channel_id: *id, sequence: message.sequence, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, &content.encode_to_vec()).expect("room");
    }
    let mut metadata = entries(bytes, "percuss.run");
    // of the entries as they were
    metadata.remove("checksum");
    metadata.insert("playback_rate".into(), (2.0 / SCALES[1].3).to_string());
    for (_, _, key, scale) in SCALES {
        if let Some(scale) = recorded(key, scale) {
            metadata.insert(key.into(), scale.to_string());
        }
    }
    writer.write_metadata(&Metadata { name: "percuss.run".into(), metadata }).expect("room");
    let status = Metadata { name: "percuss.status".into(), metadata: entries(bytes, "percuss.status") };
    writer.write_metadata(&status).expect("room");
    writer.finish().expect("an end");
    drop(writer.finish());
    writer.into_inner().into_inner()
}

/// Entries of a metadata record.
pub fn entries(bytes: &[u8], name: &str) -> BTreeMap<String, String> {
    let summary = Summary::read(bytes).expect("a sound file").expect("a summary");
    let index = summary.metadata_indexes.iter().find(|index| index.name == name).expect("the record");
    mcap::read::metadata(bytes, index).expect("a record").metadata
}

/// Writes the SI twin of a recording.
pub fn write_in_si(from: &Path, to: &Path, recorded: impl Fn(&str, f64) -> Option<f64>) {
    let bytes = fs::read(from).expect("the recording");
    fs::write(to, in_si(&bytes, recorded)).expect("a new file");
}
