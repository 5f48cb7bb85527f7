//! Recordings of protobuf messages: of another writer than percuss, with everything a message can hold; of percuss; and the same in
//! SI units with made-up scales.

use std::{
    collections::{BTreeMap, HashMap},
    io::Cursor,
    path::Path,
};

use mcap::{
    Attachment, MessageStream, Summary, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
};
use percuss::{
    advice::Advised,
    case::{Case, builtin},
    recording::Destination,
    session::{self, Recording, Source},
    simulation::Simulation,
};
use percuss_reader::convention::{CHECKSUM, checksum};
use prost_reflect::{
    DescriptorPool, DynamicMessage, Value,
    prost::Message,
    prost_types::{
        DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
        FileDescriptorProto, FileDescriptorSet, MessageOptions, OneofDescriptorProto,
        field_descriptor_proto::{Label, Type},
    },
};
use serde_json::{Value as Json, json};

/// Numbers that look random and are the same every time (xorshift64*).
pub struct Dice(pub u64);

impl Dice {
    pub fn roll(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.roll() >> 33) as usize % limit.max(1)
    }

    pub fn unit(&mut self) -> f64 {
        (self.roll() >> 11) as f64 / (1u64 << 53) as f64
    }
}

pub fn field(
    name: &str,
    number: i32,
    label: Label,
    kind: Type,
    type_name: Option<&str>,
) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(label.into()),
        r#type: Some(kind.into()),
        type_name: type_name.map(str::to_owned),
        ..Default::default()
    }
}

/// Adds a field by its name and type: `double`, `?double` (optional), `[double]`, `map<string,double>`, `Place` (of the package),
/// `google.protobuf.Timestamp`, `=Mode` (the enumeration).
fn add(message: &mut DescriptorProto, package: &str, number: i32, name: &str, kind: &str) {
    let (label, kind) = match kind.strip_prefix('[').and_then(|kind| kind.strip_suffix(']')) {
        Some(kind) => (Label::Repeated, kind),
        None => (Label::Optional, kind),
    };
    let full =
        |name: &str| if name.contains('.') { format!(".{name}") } else { format!(".{package}.{name}") };
    let scalar = |kind: &str| Type::from_str_name(&format!("TYPE_{}", kind.to_uppercase()));
    let map = kind.strip_prefix("map<").and_then(|kind| kind.strip_suffix('>')?.split_once(','));
    message.field.push(if let Some((key, value)) = map {
        let mut entry = type_of(&format!("Entry{number}"), Vec::new());
        add(&mut entry, package, 1, "key", key);
        add(&mut entry, package, 2, "value", value);
        entry.options = Some(MessageOptions { map_entry: Some(true), ..Default::default() });
        message.nested_type.push(entry);
        let entry = format!(".{package}.{}.Entry{number}", message.name());
        field(name, number, Label::Repeated, Type::Message, Some(&entry))
    } else if let Some(kind) = kind.strip_prefix('=') {
        field(name, number, label, Type::Enum, Some(&full(kind)))
    } else if let Some(kind) = kind.strip_prefix('?').and_then(scalar) {
        let group = OneofDescriptorProto { name: Some(format!("_{name}")), options: None };
        message.oneof_decl.push(group);
        FieldDescriptorProto {
            oneof_index: Some(message.oneof_decl.len() as i32 - 1),
            proto3_optional: Some(true),
            ..field(name, number, label, kind, None)
        }
    } else if let Some(kind) = scalar(kind) {
        field(name, number, label, kind, None)
    } else {
        field(name, number, label, Type::Message, Some(&full(kind)))
    });
}

pub fn type_of(name: &str, field: Vec<FieldDescriptorProto>) -> DescriptorProto {
    DescriptorProto { name: Some(name.into()), field, ..Default::default() }
}

pub fn file_of(name: &str, message_type: Vec<DescriptorProto>) -> FileDescriptorProto {
    let (name, syntax) = (Some(name.into()), Some("proto3".into()));
    FileDescriptorProto { name, syntax, message_type, ..Default::default() }
}

/// Types of a package, and an enumeration with its values.
///
/// * `messages`: a line for each, with its name and its fields as `NAME:TYPE`, numbered from 1
pub fn types(package: &str, messages: &str, (name, values): (&str, [&str; 2])) -> FileDescriptorProto {
    let message = |line: &str| {
        let mut words = line.split_whitespace();
        let mut message = type_of(words.next().expect("a name"), Vec::new());
        for (field, number) in words.zip(1..) {
            let (name, kind) = field.split_once(':').expect("a type");
            add(&mut message, package, number, name, kind);
        }
        message
    };
    let value = |(name, number): (&str, i32)| EnumValueDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        options: None,
    };
    let value = values.into_iter().zip(0..).map(value).collect();
    FileDescriptorProto {
        package: Some(package.into()),
        enum_type: vec![EnumDescriptorProto { name: Some(name.into()), value, ..Default::default() }],
        ..file_of(&format!("{package}.proto"), messages.lines().map(message).collect())
    }
}

pub fn file() -> FileDescriptorProto {
    let messages = "Scalar step:uint64 time:double force:double load:float count:sint64 flag:bool\n\
        Profile step:uint64 time:double r0:double dr:double p:[double]\n\
        Slice step:uint64 time:double r0:double dr:double nr:uint32 z0:double dz:double nz:uint32 values:[float]\n\
        Place x:double tags:[int32]\n\
        Note step:uint64 time:double text:string kind:=Kind place:Place parts:[Place] raw:bytes \
        sizes:map<string,double> inner:Note";
    types("lab", messages, ("Kind", ["CALM", "LOUD"]))
}

/// A message of the package `lab`, given in the JSON mapping.
pub fn message(pool: &DescriptorPool, name: &str, content: &Json) -> DynamicMessage {
    let descriptor = pool.get_message_by_name(&format!("lab.{name}")).expect("the type");
    DynamicMessage::deserialize(descriptor, content).expect("a message")
}

#[derive(Clone)]
pub struct Channel {
    pub topic: String,
    /// Name of the type; without one they are JSON.
    pub message: String,
    pub metadata: BTreeMap<String, String>,
    pub messages: Vec<(u64, DynamicMessage)>,
}

impl Channel {
    pub fn new(
        topic: &str,
        message: &str,
        metadata: &[(&str, &str)],
        messages: Vec<(u64, DynamicMessage)>,
    ) -> Self {
        Self { topic: topic.into(), message: message.into(), metadata: text_map(metadata), messages }
    }
}

#[derive(Clone)]
pub struct Forged {
    pub file: FileDescriptorProto,
    pub channels: Vec<Channel>,
    pub attachments: Vec<(String, Vec<u8>)>,
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
}

/// A smooth curve between -1 and 1, of the period 2π, that is the same number on every machine.
pub fn wave(x: f64) -> f64 {
    let phase = (x / std::f64::consts::PI).rem_euclid(2.0);
    if phase < 1.0 { 4.0 * phase * (1.0 - phase) } else { -4.0 * (phase - 1.0) * (2.0 - phase) }
}

pub fn text_map(entries: &[(&str, &str)]) -> BTreeMap<String, String> {
    entries.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
}

pub fn pool(file: &FileDescriptorProto) -> DescriptorPool {
    let set = FileDescriptorSet { file: vec![file.clone()] };
    DescriptorPool::from_file_descriptor_set(set).expect("a sound schema")
}

/// Nanoseconds between steps of the recordings.
pub const STEP_NS: u64 = 10_000_000;

pub fn time(step: u64) -> f64 {
    step as f64 * 0.01
}

/// A recording of `steps` steps with values that depend on `seed`.
pub fn forge(steps: u64, seed: u64) -> Forged {
    let file = file();
    let pool = pool(&file);
    let phase = Dice(seed.wrapping_mul(2_654_435_761).wrapping_add(1)).unit();
    let at = |name: &str, step: u64, mut content: Json| {
        (content["step"], content["time"]) = (step.into(), time(step).into());
        (step * STEP_NS, message(&pool, name, &content))
    };
    let scalar = |step: u64| {
        let t = time(step);
        let (force, load) = (wave(3.0 * t + phase) + 2.0, (1.0 + t).sqrt() as f32);
        let (count, flag) = (step as i64 * 7 - 3, step.is_multiple_of(3));
        at("Scalar", step, json!({"force": force, "load": load, "count": count, "flag": flag}))
    };
    let profile = |step: u64| {
        let p = |i: u64| wave(phase + time(step) * 2.0 - 0.05 * i as f64) + 1.5;
        let p: Vec<f64> = (0..12 + step / 20).map(p).collect();
        at("Profile", step, json!({"r0": 0.025, "dr": 0.05, "p": p}))
    };
    let slice = |step: u64| {
        let value = |i: u32| wave(time(step) + f64::from(i) * 0.3 + phase) as f32;
        let values: Vec<f32> = (0..24).map(value).collect();
        let content = json!({"r0": 0.0, "dr": 0.1, "nr": 6, "z0": 0.0, "dz": 0.2, "nz": 4, "values": values});
        at("Slice", step, content)
    };
    let note = |step: u64| {
        let place = json!({"x": time(step), "tags": [1, -2]});
        let content = json!({
            "text": format!("step {step}"),
            "kind": step % 2,
            "place": place,
            "parts": [place, place],
            "raw": "AQID",
            "sizes": {"a": 1.0, "b": 2.0},
        });
        at("Note", step, content)
    };
    let of_profile = [("unit.p", "Pa"), ("unit.r0", "m"), ("axis.p", "r0,dr")];
    let of_slice = [("axis.values", "z0,dz,nz;r0,dr,nr"), ("unit.values", "Pa")];
    let of_scalar = [("unit.force", "N"), ("unit.time", "s")];
    let slices = (0..steps).step_by(10).map(slice).collect();
    let channels = vec![
        Channel::new("/scalar", "Scalar", &of_scalar, (0..steps).map(scalar).collect()),
        Channel::new("/profile", "Profile", &of_profile, (0..steps).map(profile).collect()),
        Channel::new("/slice", "Slice", &of_slice, slices),
        Channel::new("/note", "Note", &[], (5..steps).step_by(25).map(note).collect()),
    ];
    Forged {
        file,
        channels,
        attachments: vec![("case.toml".into(), format!("seed = {seed}\nsteps = {steps}\n").into_bytes())],
        metadata: vec![("lab".into(), text_map(&[("who", "me")]))],
    }
}

/// A topic whose messages know no time but their log time: x at every time \[ns\].
pub fn by_log_time(topic: &str, messages: impl IntoIterator<Item = (u64, f64)>) -> Channel {
    let pool = pool(&file());
    let message = |(at, x): (u64, f64)| (at, message(&pool, "Place", &json!({ "x": x })));
    Channel::new(topic, "Place", &[], messages.into_iter().map(message).collect())
}

impl Forged {
    pub fn new(file: FileDescriptorProto) -> Self {
        Self { file, channels: Vec::new(), attachments: Vec::new(), metadata: Vec::new() }
    }

    pub fn write(&self, options: WriteOptions) -> Vec<u8> {
        let mut writer: Writer<Cursor<Vec<u8>>> =
            options.library("another program").create(Cursor::new(Vec::new())).expect("a writer");
        let set = FileDescriptorSet { file: vec![self.file.clone()] }.encode_to_vec();
        for (name, data) in &self.attachments {
            let attachment = Attachment {
                log_time: 0,
                create_time: 0,
                name: name.clone(),
                media_type: "text/plain".into(),
                data: data.into(),
            };
            writer.attach(&attachment).expect("an attachment");
        }
        let mut all: Vec<(u64, u16, Vec<u8>)> = Vec::new();
        for channel in &self.channels {
            let (schema, encoding) = match channel.message.as_str() {
                "" => (Ok(0), "json"),
                name => (writer.add_schema(&format!("lab.{name}"), "protobuf", &set), "protobuf"),
            };
            let schema = schema.expect("a schema");
            let id =
                writer.add_channel(schema, &channel.topic, encoding, &channel.metadata).expect("a channel");
            all.extend(channel.messages.iter().map(|(at, message)| (*at, id, message.encode_to_vec())));
        }
        all.sort_by_key(|(at, id, _)| (*at, *id));
        for (sequence, (at, id, data)) in (0..).zip(&all) {
            let header = MessageHeader { channel_id: *id, sequence, log_time: *at, publish_time: *at };
            writer.write_to_known_channel(&header, data).expect("a message");
        }
        for (name, metadata) in &self.metadata {
            let record = Metadata { name: name.clone(), metadata: metadata.clone() };
            writer.write_metadata(&record).expect("metadata");
        }
        writer.finish().expect("the end");
        writer.into_inner().into_inner()
    }

    pub fn channel(&mut self, topic: &str) -> &mut Channel {
        self.channels.iter_mut().find(|channel| channel.topic == topic).expect("the channel")
    }

    /// The same later by some nanoseconds: log times, and times of messages.
    pub fn later(mut self, by: u64) -> Self {
        for (at, message) in self.channels.iter_mut().flat_map(|channel| &mut channel.messages) {
            *at += by;
            if let Some(time) = message.get_field_by_name("time").and_then(|time| time.as_f64()) {
                message.set_field_by_name("time", Value::F64(time + by as f64 / 1e9));
            }
        }
        self
    }
}

/// Chunks of 8 KiB, no compression.
pub fn plain() -> WriteOptions {
    WriteOptions::new().compression(None).chunk_size(Some(8 << 10))
}

/// Units: dimensionless, in SI, the key of the scale and the scale.
pub const SCALES: [(&str, &str, &str, f64); 6] = [
    ("R", "m", "scale.length_m", 0.013),
    ("R/c_p", "s", "scale.time_s", 2.3e-6),
    ("c_p", "m/s", "scale.speed_m_per_s", 5652.0),
    ("γc_p²", "Pa", "scale.stress_pa", 2.7e11),
    ("πR²γc_p²", "N", "scale.force_n", 1.4e8),
    ("πR³γc_p²", "J", "scale.energy_j", 1.9e6),
];

pub fn record(name: &str, settings: &[&str], path: &Path) {
    let settings: Vec<String> = settings.iter().map(|&setting| setting.to_owned()).collect();
    let text = builtin::find(name).expect("a built-in case");
    let case = Case::parse(name, &text, &settings, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let mut recording =
        Recording::create(&Destination::new(path), &case, Source::Simulation).expect("a new file");
    let mut steps = Advised::new(&case, Simulation::new(&case));
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

pub fn entries(bytes: &[u8], name: &str) -> BTreeMap<String, String> {
    let summary = Summary::read(bytes).expect("a sound file").expect("a summary");
    let index = summary.metadata_indexes.iter().find(|index| index.name == name).expect("the record");
    mcap::read::metadata(bytes, index).expect("a record").metadata
}

/// A recording with other metadata records: `change` makes a record of its entries without the checksum, or leaves it out.
pub fn with_metadata(
    bytes: &[u8],
    change: impl Fn(&str, BTreeMap<String, String>) -> Option<BTreeMap<String, String>>,
) -> Vec<u8> {
    let options = WriteOptions::new().compression_threads(0);
    let mut writer = options.create(Cursor::new(Vec::new())).expect("a writer");
    let summary = Summary::read(bytes).expect("a sound file").expect("a summary");
    for channel in summary.channels.values() {
        let schema = channel.schema.as_ref().expect("a schema");
        writer.add_schema_with_id(schema.id, &schema.name, &schema.encoding, &schema.data).expect("a schema");
        let (topic, encoding) = (&channel.topic, &channel.message_encoding);
        writer
            .add_channel_with_id(channel.id, schema.id, topic, encoding, &channel.metadata)
            .expect("a channel");
    }
    for message in MessageStream::new(bytes).expect("a recording") {
        let message = message.expect("a message");
        let (channel_id, sequence) = (message.channel.id, message.sequence);
        let header = MessageHeader {
            channel_id,
            sequence,
            log_time: message.log_time,
            publish_time: message.publish_time,
        };
        writer.write_to_known_channel(&header, &message.data).expect("room");
    }
    for index in &summary.attachment_indexes {
        writer.attach(&mcap::read::attachment(bytes, index).expect("an attachment")).expect("room");
    }
    for index in &summary.metadata_indexes {
        let Metadata { name, mut metadata } = mcap::read::metadata(bytes, index).expect("a record");
        metadata.remove(CHECKSUM);
        let Some(mut metadata) = change(&name, metadata) else { continue };
        metadata.insert(CHECKSUM.into(), checksum(&metadata));
        writer.write_metadata(&Metadata { name, metadata }).expect("room");
    }
    writer.finish().expect("an end");
    writer.into_inner().into_inner()
}
