//! What definitions are charged against what they take: by itself in its process, whose memory is measured.

use std::{borrow::Cow, fs};

use mcap::records::{Record, SchemaHeader};
use percuss_reader::{directory::Directory, recording::Limits};
use prost_reflect::{
    prost::Message,
    prost_types::{
        DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
        FileDescriptorProto, FileDescriptorSet,
        field_descriptor_proto::{Label, Type},
    },
};

/// Memory of this process in use \[bytes\].
fn resident() -> usize {
    let text = fs::read_to_string("/proc/self/statm").expect("the memory in use");
    let pages: usize = text.split(' ').nth(1).and_then(|pages| pages.parse().ok()).expect("a number");
    pages * 4096
}

fn file(name: &str) -> FileDescriptorProto {
    FileDescriptorProto { name: Some(name.into()), syntax: Some("proto3".into()), ..Default::default() }
}

#[test]
fn types_that_are_accepted_fit_into_their_share() {
    const MANY: i32 = 20_000;
    let field = |i: i32| FieldDescriptorProto {
        name: Some(format!("f{i}")),
        number: Some(i + 1),
        label: Some(Label::Optional.into()),
        r#type: Some(Type::Double.into()),
        ..Default::default()
    };
    // numbers that protobuf keeps for itself
    let fields = (0..MANY).map(field).filter(|field| !(19_000..20_000).contains(&field.number()));
    let value =
        |i: i32| EnumValueDescriptorProto { name: Some(format!("V{i}")), number: Some(i), options: None };
    let message = |name: String| DescriptorProto { name: Some(name), ..Default::default() };
    let mut messages = file("messages");
    messages.message_type = (0..MANY).map(|i| message(format!("M{i}"))).collect();
    messages.message_type.push(message("A".into()));
    let mut of_fields = file("fields");
    of_fields.message_type = vec![DescriptorProto { field: fields.collect(), ..message("B".into()) }];
    let mut values = file("values");
    values.enum_type = vec![EnumDescriptorProto {
        name: Some("E".into()),
        value: (0..MANY).map(value).collect(),
        ..Default::default()
    }];
    // all at once: what is freed after one would be taken again for the next
    let data = FileDescriptorSet { file: vec![messages, of_fields, values] }.encode_to_vec();
    let header = SchemaHeader { id: 1, name: "A".into(), encoding: "protobuf".into() };
    let record = Record::Schema { header, data: Cow::Borrowed(&data) };
    let before = resident();
    // the least memory that they are accepted with
    let accepted = (20..36).map(|power| Limits { memory: 1 << power }).find_map(|limits| {
        let mut directory = Directory::new(limits);
        directory.learn(&record);
        directory.flaw(1).is_none().then_some((limits, directory))
    });
    let (limits, directory) = accepted.expect("room for them");
    let (taken, share) = (resident().saturating_sub(before), limits.directory());
    assert!(taken <= share, "{taken} bytes are taken of {share}");
    assert!(taken * 16 > share, "{taken} bytes are taken of {share}: far too much is charged");
    drop(directory);
}
