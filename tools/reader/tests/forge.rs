//! Recordings made for tests: of another writer than percuss, with everything a message can hold.
#![allow(dead_code, reason = "each test program uses some of it")]

use std::{collections::BTreeMap, io::Cursor};

use mcap::{
    Attachment, WriteOptions, Writer,
    records::{MessageHeader, Metadata},
};
use prost_reflect::{
    DescriptorPool, DynamicMessage, MapKey, MessageDescriptor, Value,
    prost::Message,
    prost_types::{
        DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
        FileDescriptorProto, FileDescriptorSet, MessageOptions,
        field_descriptor_proto::{Label, Type},
    },
};

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

/// Messages of the tests: `Scalar`, `Profile`, `Slice`, `Note`.
pub fn file() -> FileDescriptorProto {
    let one = |name: &str, number, kind| field(name, number, Label::Optional, kind, None);
    let many = |name: &str, number, kind| field(name, number, Label::Repeated, kind, None);
    let message = |name: &str, field: Vec<FieldDescriptorProto>| DescriptorProto {
        name: Some(name.into()),
        field,
        ..Default::default()
    };
    let start = || vec![one("step", 1, Type::Uint64), one("time", 2, Type::Double)];
    let with = |more: Vec<FieldDescriptorProto>| [start(), more].concat();
    let mut note = message(
        "Note",
        with(vec![
            one("text", 3, Type::String),
            field("kind", 4, Label::Optional, Type::Enum, Some(".lab.Kind")),
            field("place", 5, Label::Optional, Type::Message, Some(".lab.Place")),
            field("parts", 6, Label::Repeated, Type::Message, Some(".lab.Place")),
            one("raw", 7, Type::Bytes),
            field("sizes", 8, Label::Repeated, Type::Message, Some(".lab.Note.SizesEntry")),
            field("inner", 9, Label::Optional, Type::Message, Some(".lab.Note")),
        ]),
    );
    note.nested_type = vec![DescriptorProto {
        name: Some("SizesEntry".into()),
        field: vec![one("key", 1, Type::String), one("value", 2, Type::Double)],
        options: Some(MessageOptions { map_entry: Some(true), ..Default::default() }),
        ..Default::default()
    }];
    let values = ["CALM", "LOUD"].iter().zip(0..).map(|(name, number)| EnumValueDescriptorProto {
        name: Some((*name).into()),
        number: Some(number),
        ..Default::default()
    });
    FileDescriptorProto {
        name: Some("lab.proto".into()),
        package: Some("lab".into()),
        syntax: Some("proto3".into()),
        message_type: vec![
            message(
                "Scalar",
                with(vec![
                    one("force", 3, Type::Double),
                    one("load", 4, Type::Float),
                    one("count", 5, Type::Sint64),
                    one("flag", 6, Type::Bool),
                ]),
            ),
            message(
                "Profile",
                with(vec![
                    one("r0", 3, Type::Double),
                    one("dr", 4, Type::Double),
                    many("p", 5, Type::Double),
                ]),
            ),
            message(
                "Slice",
                with(vec![
                    one("r0", 3, Type::Double),
                    one("dr", 4, Type::Double),
                    one("nr", 5, Type::Uint32),
                    one("z0", 6, Type::Double),
                    one("dz", 7, Type::Double),
                    one("nz", 8, Type::Uint32),
                    many("values", 9, Type::Float),
                ]),
            ),
            message("Place", vec![one("x", 1, Type::Double), many("tags", 2, Type::Int32)]),
            note,
        ],
        enum_type: vec![EnumDescriptorProto {
            name: Some("Kind".into()),
            value: values.collect(),
            ..Default::default()
        }],
        ..Default::default()
    }
}

/// A channel with its messages.
#[derive(Clone)]
pub struct Channel {
    pub topic: String,
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
    let descriptor = |name: &str| pool.get_message_by_name(&format!("lab.{name}")).expect("the message");
    let mut dice = Dice(seed.wrapping_mul(2_654_435_761).wrapping_add(1));
    let phase = dice.unit();
    let start = |descriptor: MessageDescriptor, step: u64| {
        let mut message = DynamicMessage::new(descriptor);
        message.set_field_by_name("step", Value::U64(step));
        message.set_field_by_name("time", Value::F64(time(step)));
        message
    };
    let (mut scalars, mut profiles, mut slices, mut notes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for step in 0..steps {
        let t = time(step);
        let mut scalar = start(descriptor("Scalar"), step);
        scalar.set_field_by_name("force", Value::F64((3.0 * t + phase).sin() + 2.0));
        scalar.set_field_by_name("load", Value::F32((1.0 + t).sqrt() as f32));
        scalar.set_field_by_name("count", Value::I64(step as i64 * 7 - 3));
        scalar.set_field_by_name("flag", Value::Bool(step % 3 == 0));
        scalars.push((step * STEP_NS, scalar));
        let mut profile = start(descriptor("Profile"), step);
        profile.set_field_by_name("r0", Value::F64(0.025));
        profile.set_field_by_name("dr", Value::F64(0.05));
        let p = |i: u64| (phase + t * 2.0 - 0.05 * i as f64).cos() + 1.5;
        profile.set_field_by_name("p", Value::List((0..12 + step / 20).map(|i| Value::F64(p(i))).collect()));
        profiles.push((step * STEP_NS, profile));
        if step % 10 == 0 {
            let mut slice = start(descriptor("Slice"), step);
            for (name, value) in [("r0", 0.0), ("dr", 0.1), ("z0", 0.0), ("dz", 0.2)] {
                slice.set_field_by_name(name, Value::F64(value));
            }
            slice.set_field_by_name("nr", Value::U32(6));
            slice.set_field_by_name("nz", Value::U32(4));
            let value = |i: u32| (t as f32 + i as f32 * 0.3 + phase as f32).sin();
            slice.set_field_by_name("values", Value::List((0..24).map(|i| Value::F32(value(i))).collect()));
            slices.push((step * STEP_NS, slice));
        }
        if step % 25 == 5 {
            let mut note = start(descriptor("Note"), step);
            note.set_field_by_name("text", Value::String(format!("step {step}")));
            note.set_field_by_name("kind", Value::EnumNumber((step % 2) as i32));
            let mut place = DynamicMessage::new(descriptor("Place"));
            place.set_field_by_name("x", Value::F64(t));
            place.set_field_by_name("tags", Value::List(vec![Value::I32(1), Value::I32(-2)]));
            note.set_field_by_name("place", Value::Message(place.clone()));
            note.set_field_by_name(
                "parts",
                Value::List(vec![Value::Message(place.clone()), Value::Message(place)]),
            );
            note.set_field_by_name("raw", Value::Bytes(vec![1, 2, 3].into()));
            let sizes = [("b", 2.0), ("a", 1.0)];
            let sizes = sizes.map(|(key, value)| (MapKey::String(key.into()), Value::F64(value)));
            note.set_field_by_name("sizes", Value::Map(sizes.into_iter().collect()));
            notes.push((step * STEP_NS, note));
        }
    }
    let channel = |topic: &str, message: &str, metadata: &[(&str, &str)], messages| Channel {
        topic: topic.into(),
        message: message.into(),
        metadata: text_map(metadata),
        messages,
    };
    Forged {
        file,
        channels: vec![
            channel("/scalar", "Scalar", &[("unit.force", "N"), ("unit.time", "s")], scalars),
            channel(
                "/profile",
                "Profile",
                &[("unit.p", "Pa"), ("unit.r0", "m"), ("axis.p", "r0,dr")],
                profiles,
            ),
            channel(
                "/slice",
                "Slice",
                &[("axis.values", "z0,dz,nz;r0,dr,nr"), ("unit.values", "Pa")],
                slices,
            ),
            channel("/note", "Note", &[], notes),
        ],
        attachments: vec![("case.toml".into(), format!("seed = {seed}\nsteps = {steps}\n").into_bytes())],
        metadata: vec![("lab".into(), text_map(&[("who", "me")]))],
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
            let schema =
                writer.add_schema(&format!("lab.{}", channel.message), "protobuf", &set).expect("a schema");
            let id =
                writer.add_channel(schema, &channel.topic, "protobuf", &channel.metadata).expect("a channel");
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
}

/// Chunks of 8 KiB, no compression.
pub fn plain() -> WriteOptions {
    WriteOptions::new().compression(None).chunk_size(Some(8 << 10))
}
