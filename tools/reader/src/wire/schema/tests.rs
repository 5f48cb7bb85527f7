//! What is kept of sets that are used; the hostile files of the tests have those that are refused.

use prost_reflect::prost_types::{
    DescriptorProto, FieldDescriptorProto, FileDescriptorProto, SourceCodeInfo,
    field_descriptor_proto::{Label, Type},
    source_code_info::Location,
};

use super::{filter::put_block, *};

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
    let (pool, _) =
        pool(&FileDescriptorSet { file: vec![file] }.encode_to_vec(), 1 << 20).expect("a sound set");
    let a = pool.get_message_by_name("A").expect("the message");
    assert_eq!(a.fields().map(|field| field.name().to_owned()).collect::<Vec<_>>(), ["x"]);
    let file = a.parent_file();
    let places = &file.file_descriptor_proto().source_code_info.as_ref().expect("comments").location;
    assert_eq!(places.len(), 1);
    assert_eq!(places[0].leading_comments.as_deref(), Some(" what A is\n"));
}

#[test]
fn elements_are_counted_whatever_the_memory() {
    let (mut set, empty) = (Vec::new(), [0x22, 0].repeat(70_000));
    put_block(1, &empty, &mut set);
    assert!(matches!(pool(&set, 1 << 30), Err(SchemaError::Unsound(_))));
}
