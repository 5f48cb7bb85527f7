//! `schema`: the descriptors in a recording as text in the language of `.proto` files.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::Args;
use prost_reflect::{EnumDescriptor, FieldDescriptor, FileDescriptor, Kind, MessageDescriptor, Syntax};

use crate::{
    failure::Failure,
    messages::Recording,
    recording::Limits,
    select::{self, Pattern},
    text::short,
    verb::{Exit, Verb, print},
};

const SCHEMA_EXAMPLES: &str = "\
Examples:
  percuss-read schema fig5.mcap --topic /drag
  percuss-read schema fig5.mcap > messages.proto";

/// The message types of a recording, as text
#[derive(Debug, Args)]
#[command(after_help = SCHEMA_EXAMPLES)]
pub struct Schema {
    /// Recording
    file: PathBuf,
    /// Topics, separated by commas; `*` stands for anything [default: all]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    topics: Vec<Pattern>,
}

impl Verb for Schema {
    fn files(&self) -> &[PathBuf] {
        std::slice::from_ref(&self.file)
    }

    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        print(&schema(&self.file, &self.topics, limits)?)?;
        Ok(Exit::Done)
    }
}

/// The files that describe the messages of some topics (all if none is named), as text.
///
/// # Errors
///
/// The file cannot be read, or there is no such topic.
pub fn schema(path: &Path, topics: &[Pattern], limits: Limits) -> Result<String, Failure> {
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
    body_text(message, depth, text);
    text.push_str(&format!("{indent}}}\n"));
}

/// What a message type holds.
fn body_text(message: &MessageDescriptor, depth: usize, text: &mut String) {
    let indent = "  ".repeat(depth);
    for inner in message.child_enums() {
        enum_text(&inner, depth + 1, text);
    }
    let groups: Vec<FieldDescriptor> = message.fields().filter(FieldDescriptor::is_group).collect();
    let is_group =
        |inner: &MessageDescriptor| groups.iter().any(|field| field.kind() == Kind::Message(inner.clone()));
    for inner in message.child_messages().filter(|inner| !inner.is_map_entry() && !is_group(inner)) {
        message_text(&inner, depth + 1, text);
    }
    // in the order of the declaration
    let mut fields: Vec<FieldDescriptor> = message.fields().collect();
    // those of a oneof after the first of them
    let place = |field: &FieldDescriptor| field.path().last().copied();
    let first = |field: &FieldDescriptor| {
        let group = field.containing_oneof().filter(|_| !is_proto3_optional(field));
        group
            .and_then(|group| group.fields().filter_map(|field| place(&field)).min())
            .or_else(|| place(field))
    };
    fields.sort_by_key(|field| (first(field), place(field)));
    let (mut fields, mut open) = (fields.into_iter().peekable(), None::<String>);
    while let Some(field) = fields.next() {
        text.push_str(&comment(&message.parent_file(), field.path(), &format!("{indent}  ")));
        let group = field.containing_oneof().filter(|_| !is_proto3_optional(&field));
        let is_proto2 = message.parent_file().syntax() == Syntax::Proto2;
        let label = match () {
            () if field.is_map() || group.is_some() => "",
            () if field.is_list() => "repeated ",
            () if field.is_required() => "required ",
            () if is_proto2 || (field.supports_presence() && !matches!(field.kind(), Kind::Message(_))) => {
                "optional "
            }
            () => "",
        };
        let inner = if group.is_some() { "    " } else { "  " };
        if let Some(group) = &group
            && open.as_deref() != Some(group.name())
        {
            text.push_str(&format!("{indent}  oneof {} {{\n", group.name()));
        }
        match field.kind() {
            // its type is declared where it is
            Kind::Message(of) if field.is_group() => {
                text.push_str(&format!(
                    "{indent}{inner}{label}group {} = {} {{\n",
                    of.name(),
                    field.number()
                ));
                body_text(&of, depth + 1 + usize::from(group.is_some()), text);
                text.push_str(&format!("{indent}{inner}}}\n"));
            }
            _ => {
                let (kind, name, number) = (kind_text(&field), field.name(), field.number());
                let options = options_text(&field, is_proto2);
                text.push_str(&format!("{indent}{inner}{label}{kind} {name} = {number}{options};\n"));
            }
        }
        let next = fields.peek().and_then(FieldDescriptor::containing_oneof);
        open = group.map(|group| group.name().to_owned());
        if open.is_some() && next.map(|next| next.name().to_owned()) != open {
            text.push_str(&format!("{indent}  }}\n"));
            open = None;
        }
    }
    for range in message.extension_ranges() {
        text.push_str(&format!("{indent}  extensions {} to {};\n", range.start, range.end - 1));
    }
}

/// Options of a field that say how it is written, and its default.
fn options_text(field: &FieldDescriptor, is_proto2: bool) -> String {
    let mut options = Vec::new();
    let is_packable =
        field.is_list() && !matches!(field.kind(), Kind::String | Kind::Bytes | Kind::Message(_));
    if is_packable && field.is_packed() == is_proto2 {
        options.push(format!("packed = {}", field.is_packed()));
    }
    if let Some(default) = field.field_descriptor_proto().default_value.as_ref() {
        let text = match field.kind() {
            Kind::String => serde_json::Value::from(default.as_str()).to_string(),
            // with its escapes
            Kind::Bytes => format!("\"{default}\""),
            _ => default.clone(),
        };
        options.push(format!("default = {text}"));
    }
    if options.is_empty() { String::new() } else { format!(" [{}]", options.join(", ")) }
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
    /// Number of the values among the fields of the descriptor of an enum.
    const VALUES: i32 = 2;
    let indent = "  ".repeat(depth);
    text.push_str(&comment(&kind.parent_file(), kind.path(), &indent));
    text.push_str(&format!("{indent}enum {} {{\n", kind.name()));
    // in the order of the declaration: the first is the default
    let values = &kind.enum_descriptor_proto().value;
    let mut numbers = BTreeSet::new();
    if !values.iter().all(|value| numbers.insert(value.number())) {
        text.push_str(&format!("{indent}  option allow_alias = true;\n"));
    }
    for (value, index) in values.iter().zip(0..) {
        let path = [kind.path(), &[VALUES, index]].concat();
        text.push_str(&comment(&kind.parent_file(), &path, &format!("{indent}  ")));
        text.push_str(&format!("{indent}  {} = {};\n", value.name(), value.number()));
    }
    text.push_str(&format!("{indent}}}\n"));
}
