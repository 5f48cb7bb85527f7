//! `schema`: the descriptors in a recording as text in the language of `.proto` files.

use std::{collections::BTreeSet, path::Path, sync::Arc};

use prost_reflect::{EnumDescriptor, FieldDescriptor, FileDescriptor, Kind, MessageDescriptor, Syntax};

use crate::{
    messages::Recording,
    recording::{Limits, OpenError},
    select::{self, Pattern},
    text::short,
};

/// The files that describe the messages of some topics (all if none is named), as text.
///
/// # Errors
///
/// The file cannot be read, or there is no such topic.
pub fn schema(path: &Path, topics: &[Pattern], limits: Limits) -> Result<String, OpenError> {
    let recording = Recording::open(path, limits)?;
    let ids = select::channels(&recording, topics)?;
    let (mut text, mut seen, mut known) = (String::new(), BTreeSet::new(), BTreeSet::new());
    for channel in ids.iter().map(|id| &recording.channels[id]) {
        let Some(layout) = &channel.layout else {
            text.push_str(&format!(
                "// {}: {} is not a sound protobuf schema\n\n",
                short(&channel.topic),
                short(&channel.schema)
            ));
            continue;
        };
        // many channels may share a schema
        if !known.insert(Arc::as_ptr(layout)) {
            continue;
        }
        if layout.is_json() {
            let (topic, schema) = (short(&channel.topic), short(&channel.schema));
            text.push_str(&format!("// {topic}: JSON {schema}, read as\n"));
        }
        let file = layout.descriptor().parent_file();
        // the files it needs come before it
        for file in file.parent_pool().files() {
            if seen.insert(file.encode_to_vec()) {
                text.push_str(&file_text(&file));
                text.push('\n');
            }
        }
    }
    Ok(text)
}

fn file_text(file: &FileDescriptor) -> String {
    let syntax = if file.syntax() == Syntax::Proto2 { "proto2" } else { "proto3" };
    let mut text = format!("// {}\nsyntax = \"{syntax}\";\n", file.name());
    if !file.package_name().is_empty() {
        text.push_str(&format!("\npackage {};\n", file.package_name()));
    }
    for dependency in file.dependencies() {
        text.push_str(&format!("\nimport \"{}\";\n", dependency.name()));
    }
    for message in file.messages() {
        text.push('\n');
        message_text(&message, 0, &mut text);
    }
    for kind in file.enums() {
        text.push('\n');
        enum_text(&kind, 0, &mut text);
    }
    text
}

/// What the source of the schema says of a place in it.
fn comment(file: &FileDescriptor, path: &[i32], indent: &str) -> String {
    let source = file.file_descriptor_proto().source_code_info.as_ref();
    let location = source.and_then(|source| source.location.iter().find(|place| place.path == path));
    let comments = location.and_then(|location| location.leading_comments.as_deref()).unwrap_or_default();
    comments.trim_end().lines().map(|line| format!("{indent}//{line}\n")).collect()
}

fn message_text(message: &MessageDescriptor, depth: usize, text: &mut String) {
    let indent = "  ".repeat(depth);
    text.push_str(&comment(&message.parent_file(), message.path(), &indent));
    text.push_str(&format!("{indent}message {} {{\n", message.name()));
    for inner in message.child_enums() {
        enum_text(&inner, depth + 1, text);
    }
    for inner in message.child_messages().filter(|inner| !inner.is_map_entry()) {
        message_text(&inner, depth + 1, text);
    }
    // in the order of the declaration
    let mut fields: Vec<FieldDescriptor> = message.fields().collect();
    fields.sort_by_key(|field| field.path().last().copied());
    for field in fields {
        text.push_str(&comment(&message.parent_file(), field.path(), &format!("{indent}  ")));
        let group = field.containing_oneof().filter(|_| !is_proto3_optional(&field));
        let label = match () {
            () if field.is_map() => String::new(),
            () if field.is_list() => "repeated ".into(),
            () if field.is_required() => "required ".into(),
            () if group.is_none()
                && field.supports_presence()
                && !matches!(field.kind(), Kind::Message(_)) =>
            {
                "optional ".into()
            }
            () => String::new(),
        };
        let group = group.map_or(String::new(), |group| format!("  // one of {}", group.name()));
        let (kind, name, number) = (kind_text(&field), field.name(), field.number());
        text.push_str(&format!("{indent}  {label}{kind} {name} = {number};{group}\n"));
    }
    text.push_str(&format!("{indent}}}\n"));
}

fn is_proto3_optional(field: &FieldDescriptor) -> bool {
    field.field_descriptor_proto().proto3_optional.unwrap_or(false)
}

fn kind_text(field: &FieldDescriptor) -> String {
    if let (true, Kind::Message(entry)) = (field.is_map(), field.kind()) {
        let (key, value) =
            (kind_text(&entry.map_entry_key_field()), kind_text(&entry.map_entry_value_field()));
        return format!("map<{key}, {value}>");
    }
    match field.kind() {
        Kind::Message(message) => message.full_name().to_owned(),
        Kind::Enum(kind) => kind.full_name().to_owned(),
        other => format!("{other:?}").to_lowercase(),
    }
}

fn enum_text(kind: &EnumDescriptor, depth: usize, text: &mut String) {
    let indent = "  ".repeat(depth);
    text.push_str(&comment(&kind.parent_file(), kind.path(), &indent));
    text.push_str(&format!("{indent}enum {} {{\n", kind.name()));
    for value in kind.values() {
        text.push_str(&comment(&kind.parent_file(), value.path(), &format!("{indent}  ")));
        text.push_str(&format!("{indent}  {} = {};\n", value.name(), value.number()));
    }
    text.push_str(&format!("{indent}}}\n"));
}
