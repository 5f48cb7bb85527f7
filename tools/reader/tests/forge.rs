//! Recordings made for tests: of another writer than percuss, with everything a message can hold.

use std::{collections::BTreeMap, io::Cursor};

use mcap::{
    Attachment, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
};
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

/// A file of types.
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

/// Messages of the tests.
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

/// A field of a message that is a number.
pub fn number(message: &DynamicMessage, field: &str) -> f64 {
    message.get_field_by_name(field).and_then(|value| value.as_f64()).expect("a number")
}

/// A list of numbers as a field.
pub fn list(numbers: impl IntoIterator<Item = f64>) -> Value {
    Value::List(numbers.into_iter().map(Value::F64).collect())
}

/// A channel with its messages.
#[derive(Clone)]
pub struct Channel {
    pub topic: String,
    /// Name of the type; without one they are JSON.
    pub message: String,
    pub metadata: BTreeMap<String, String>,
    pub messages: Vec<(u64, DynamicMessage)>,
}

/// A recording before it is written.
#[derive(Clone)]
pub struct Forged {
    pub file: FileDescriptorProto,
    pub channels: Vec<Channel>,
    pub attachments: Vec<(String, Vec<u8>)>,
    pub metadata: Vec<(String, BTreeMap<String, String>)>,
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

/// Time of a step in the recordings.
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
        let (force, load) = ((3.0 * t + phase).sin() + 2.0, (1.0 + t).sqrt() as f32);
        let (count, flag) = (step as i64 * 7 - 3, step.is_multiple_of(3));
        at("Scalar", step, json!({"force": force, "load": load, "count": count, "flag": flag}))
    };
    let profile = |step: u64| {
        let p = |i: u64| (phase + time(step) * 2.0 - 0.05 * i as f64).cos() + 1.5;
        let p: Vec<f64> = (0..12 + step / 20).map(p).collect();
        at("Profile", step, json!({"r0": 0.025, "dr": 0.05, "p": p}))
    };
    let slice = |step: u64| {
        let value = |i: u32| (time(step) as f32 + i as f32 * 0.3 + phase as f32).sin();
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
    let channel = |topic: &str, message: &str, metadata: &[(&str, &str)], messages| Channel {
        topic: topic.into(),
        message: message.into(),
        metadata: text_map(metadata),
        messages,
    };
    let of_profile = [("unit.p", "Pa"), ("unit.r0", "m"), ("axis.p", "r0,dr")];
    let of_slice = [("axis.values", "z0,dz,nz;r0,dr,nr"), ("unit.values", "Pa")];
    let of_scalar = [("unit.force", "N"), ("unit.time", "s")];
    let slices = (0..steps).step_by(10).map(slice).collect();
    let channels = vec![
        channel("/scalar", "Scalar", &of_scalar, (0..steps).map(scalar).collect()),
        channel("/profile", "Profile", &of_profile, (0..steps).map(profile).collect()),
        channel("/slice", "Slice", &of_slice, slices),
        channel("/note", "Note", &[], (5..steps).step_by(25).map(note).collect()),
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
    Channel {
        topic: topic.into(),
        message: "Place".into(),
        metadata: BTreeMap::new(),
        messages: messages.into_iter().map(message).collect(),
    }
}

impl Forged {
    /// The recording as a file.
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

    /// Sets a field of one message of a topic.
    pub fn set(&mut self, topic: &str, message: usize, field: &str, value: Value) {
        self.channel(topic).messages[message].1.set_field_by_name(field, value);
    }

    /// Sets a field of every message of a topic, by the number of the message.
    pub fn set_all(&mut self, topic: &str, field: &str, value: impl Fn(usize) -> Value) {
        let messages = self.channel(topic).messages.iter_mut().enumerate();
        messages.for_each(|(i, (_, message))| message.set_field_by_name(field, value(i)));
    }

    /// The recording without other topics.
    pub fn only(mut self, topic: &str) -> Self {
        self.channels.retain(|channel| channel.topic == topic);
        self
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

/// A recording of a topic without a type, with the same text at some log times \[ns\].
pub fn of_texts(topic: &str, encoding: &str, times: impl IntoIterator<Item = u64>, content: &str) -> Vec<u8> {
    let mut writer = plain().library("x").create(Cursor::new(Vec::new())).expect("a writer");
    let channel_id = writer.add_channel(0, topic, encoding, &BTreeMap::new()).expect("a channel");
    for log_time in times {
        let header = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, content.as_bytes()).expect("a message");
    }
    writer.finish().expect("the end");
    writer.into_inner().into_inner()
}

/// Chunks of 8 KiB, no compression.
pub fn plain() -> WriteOptions {
    WriteOptions::new().compression(None).chunk_size(Some(8 << 10))
}
