//! Sets that are used, and sets that are refused.

use prost_reflect::prost::Message;
use prost_reflect::prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet, MessageOptions, SourceCodeInfo, UninterpretedOption,
    field_descriptor_proto::{Label, Type},
    source_code_info::Location,
    uninterpreted_option::NamePart,
};

use super::{filter::put_block, *};

const ROOM: usize = 64 << 20;

pub(crate) fn field(name: &str, number: i32, kind: Type, type_name: Option<&str>) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        type_name: type_name.map(str::to_owned),
        ..Default::default()
    }
}

pub(crate) fn file(name: &str, message_type: Vec<DescriptorProto>) -> FileDescriptorProto {
    FileDescriptorProto {
        name: Some(name.into()),
        syntax: Some("proto3".into()),
        message_type,
        ..Default::default()
    }
}

pub(crate) fn message(name: &str, field: Vec<FieldDescriptorProto>) -> DescriptorProto {
    DescriptorProto { name: Some(name.into()), field, ..Default::default() }
}

fn of(file: Vec<FileDescriptorProto>) -> Result<DescriptorPool, SchemaError> {
    pool(&FileDescriptorSet { file }.encode_to_vec(), ROOM).map(|(pool, _)| pool)
}

fn refusal(file: Vec<FileDescriptorProto>) -> String {
    of(file).expect_err("a refusal").to_string()
}

#[test]
fn what_the_reader_uses_is_kept() {
    let mut file = file("a.proto", vec![message("A", vec![field("x", 1, Type::Double, None)])]);
    let place = |path: Vec<i32>, comment: Option<&str>| Location {
        path,
        span: vec![1, 2, 3],
        leading_comments: comment.map(str::to_owned),
        ..Default::default()
    };
    let location = vec![place(vec![4, 0], Some(" what A is\n")), place(vec![4, 0, 2, 0], None)];
    file.source_code_info = Some(SourceCodeInfo { location });
    file.enum_type = vec![EnumDescriptorProto {
        name: Some("E".into()),
        value: vec![EnumValueDescriptorProto { name: Some("ZERO".into()), number: Some(0), options: None }],
        ..Default::default()
    }];
    let pool = of(vec![file]).expect("a sound set");
    let a = pool.get_message_by_name("A").expect("the message");
    assert_eq!(a.fields().map(|field| field.name().to_owned()).collect::<Vec<_>>(), ["x"]);
    assert_eq!(pool.get_enum_by_name("E").expect("the enumeration").values().count(), 1);
    let file = a.parent_file();
    let places = &file.file_descriptor_proto().source_code_info.as_ref().expect("comments").location;
    assert_eq!(places.len(), 1);
    assert_eq!(places[0].leading_comments.as_deref(), Some(" what A is\n"));
}

#[test]
fn other_syntaxes_are_refused() {
    // prost-reflect panics with each
    for syntax in ["editions", "", "proto4"] {
        let mut file = file("a.proto", vec![message("A", vec![field("x", 1, Type::Double, None)])]);
        file.syntax = Some(syntax.into());
        assert!(refusal(vec![file]).contains(&format!("`{syntax}`")), "{syntax}");
    }
}

#[test]
fn circles_and_mazes_of_public_imports_are_refused() {
    // prost-reflect follows each without end
    let import = |name: &str, imports: &[&str]| {
        let mut file = file(name, vec![]);
        file.dependency = imports.iter().map(|&import| import.to_owned()).collect();
        file.public_dependency = (0..imports.len() as i32).collect();
        file
    };
    assert!(refusal(vec![import("a", &["a"])]).contains("circles"));
    assert!(refusal(vec![import("a", &["b"]), import("b", &["a"])]).contains("circles"));
    let names: Vec<String> = (0..64).map(|i| i.to_string()).collect();
    let maze = |i: usize| match i {
        0 => import("0", &[]),
        i => import(&names[i], &[&names[i - 1], &names[i - 1]]),
    };
    assert!(refusal((0..64).map(maze).collect()).contains("circles or too often"));
    assert!(of(vec![import("a", &["b"]), import("b", &["c"]), import("c", &[])]).is_ok());
}

#[test]
fn options_that_mean_something_else_do_no_harm() {
    // the set brings its own `FieldOptions`, whose `ctype` is a text: prost-reflect panics when it reads it back
    let mut own =
        file("own.proto", vec![message("FieldOptions", vec![field("ctype", 1, Type::String, None)])]);
    own.package = Some("google.protobuf".into());
    let mut wicked = field("x", 1, Type::Double, None);
    wicked.options = Some(prost_reflect::prost_types::FieldOptions {
        uninterpreted_option: vec![UninterpretedOption {
            name: vec![NamePart { name_part: "ctype".into(), is_extension: false }],
            string_value: Some(b"text".to_vec()),
            ..Default::default()
        }],
        ..Default::default()
    });
    let pool = of(vec![own, file("a.proto", vec![message("A", vec![wicked])])]).expect("a sound set");
    assert!(pool.get_message_by_name("A").is_some());
}

#[test]
fn maps_that_are_none_are_refused() {
    let entry = |fields: Vec<FieldDescriptorProto>| {
        let mut entry = message("Entry", fields);
        entry.options = Some(MessageOptions { map_entry: Some(true), ..Default::default() });
        let mut map = field("map", 1, Type::Message, Some(".Entry"));
        map.label = Some(Label::Repeated.into());
        vec![file("a.proto", vec![entry, message("A", vec![map])])]
    };
    let (key, value) = (field("key", 1, Type::String, None), field("value", 2, Type::Double, None));
    assert!(of(entry(vec![key.clone(), value.clone()])).is_ok());
    assert!(refusal(entry(vec![])).contains("`Entry` is no entry of a map"));
    assert!(refusal(entry(vec![key])).contains("`Entry` is no entry of a map"));
    let number = field("key", 1, Type::Double, None);
    assert!(refusal(entry(vec![number, value])).contains("`Entry` is no entry of a map"));
}

#[test]
fn what_unpacks_to_much_is_refused_before_it_is_unpacked() {
    let many = |count: usize, one: &[u8]| {
        let file = one.repeat(count);
        let mut set = Vec::new();
        put_block(1, &file, &mut set);
        set
    };
    // empty messages; empty places in the source are dropped
    let empty = many(60_000, &[0x22, 0]);
    assert!(matches!(pool(&empty, ROOM), Err(SchemaError::TooLarge { .. })));
    assert!(matches!(pool(&many(70_000, &[0x22, 0]), 1 << 30), Err(SchemaError::Unsound(_))));
    let source = [0x0a, 0].repeat(500_000);
    let mut places = Vec::new();
    put_block(9, &source, &mut places);
    assert!(pool(&many(1, &places), 1 << 20).is_ok());
    // fields in a message with a long name
    let mut long = vec![0x0a];
    long.extend([0x80 | (3000 & 0x7f) as u8, (3000 >> 7) as u8]);
    long.extend([b'A'; 3000]);
    long.extend([0x12, 0].repeat(20_000));
    let mut inner = Vec::new();
    put_block(4, &long, &mut inner);
    assert!(matches!(pool(&many(1, &inner), ROOM), Err(SchemaError::TooLarge { .. })));
}
