//! `schema`: the descriptors in a recording as text in the language of `.proto` files.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::Args;
use prost_reflect::{
    EnumDescriptor, FieldDescriptor, FileDescriptor, Kind, MessageDescriptor, OneofDescriptor, Syntax,
};

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
    pub(crate) file: PathBuf,
    /// Topics, separated by commas; `*` stands for anything [default: all]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    topics: Vec<Pattern>,
}

impl Verb for Schema {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        print(&schema(&self.file, &self.topics, limits)?)?;
        Ok(Exit::Done)
    }
}

/// The files that describe the messages of some topics (all if none is named), as text.
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
                text.push_str(&Text::of(&file));
                text.push('\n');
            }
        }
    }
    Ok(text)
}

/// A file of the language, written line by line.
#[derive(Default)]
struct Text {
    text: String,
    /// Braces that are open.
    depth: usize,
}

impl Text {
    fn of(file: &FileDescriptor) -> String {
        let mut text = Self::default();
        let syntax = if file.syntax() == Syntax::Proto2 { "proto2" } else { "proto3" };
        text.line(&format!("// {}\nsyntax = \"{syntax}\";", file.name()));
        if !file.package_name().is_empty() {
            text.line(&format!("\npackage {};", file.package_name()));
        }
        for dependency in file.dependencies() {
            text.line(&format!("\nimport \"{}\";", dependency.name()));
        }
        for message in file.messages() {
            text.line("");
            text.message(&message);
        }
        for kind in file.enums() {
            text.line("");
            text.values(&kind);
        }
        text.text
    }

    fn line(&mut self, line: &str) {
        self.text.push_str(&format!("{:1$}{line}\n", "", 2 * self.depth));
    }

    /// Braces with what is in them.
    fn block(&mut self, head: &str, content: impl FnOnce(&mut Self)) {
        self.line(&format!("{head} {{"));
        self.depth += 1;
        content(self);
        self.depth -= 1;
        self.line("}");
    }

    /// What the source of the schema says of a place in it.
    fn comment(&mut self, file: &FileDescriptor, path: &[i32]) {
        let source = file.file_descriptor_proto().source_code_info.as_ref();
        let location = source.and_then(|source| source.location.iter().find(|place| place.path == path));
        let comments = location.and_then(|location| location.leading_comments.as_deref());
        for line in comments.unwrap_or_default().trim_end().lines() {
            self.line(&format!("//{line}"));
        }
    }

    fn message(&mut self, message: &MessageDescriptor) {
        self.comment(&message.parent_file(), message.path());
        self.block(&format!("message {}", message.name()), |text| text.body(message));
    }

    /// What a message type holds.
    fn body(&mut self, message: &MessageDescriptor) {
        message.child_enums().for_each(|inner| self.values(&inner));
        let groups: Vec<Kind> =
            message.fields().filter(FieldDescriptor::is_group).map(|f| f.kind()).collect();
        let is_group = |inner: &MessageDescriptor| groups.contains(&Kind::Message(inner.clone()));
        for inner in message.child_messages().filter(|inner| !inner.is_map_entry() && !is_group(inner)) {
            self.message(&inner);
        }
        // in the order of the declaration, those of a oneof after the first of them
        let place = |field: &FieldDescriptor| field.path().last().copied();
        let first = |field: &FieldDescriptor| {
            let places = oneof(field).map(|group| group.fields().filter_map(|field| place(&field)).min());
            places.flatten().or_else(|| place(field))
        };
        let mut fields: Vec<FieldDescriptor> = message.fields().collect();
        fields.sort_by_key(|field| (first(field), place(field)));
        for fields in fields.chunk_by(|a, b| oneof(a).is_some() && oneof(a) == oneof(b)) {
            let file = message.parent_file();
            self.comment(&file, fields[0].path());
            let Some(group) = oneof(&fields[0]) else {
                self.field(&fields[0]);
                continue;
            };
            self.block(&format!("oneof {}", group.name()), |text| {
                text.field(&fields[0]);
                for field in &fields[1..] {
                    // what is said of it stands where the oneof does
                    text.depth -= 1;
                    text.comment(&file, field.path());
                    text.depth += 1;
                    text.field(field);
                }
            });
        }
        for range in message.extension_ranges() {
            self.line(&format!("extensions {} to {};", range.start, range.end - 1));
        }
    }

    fn field(&mut self, field: &FieldDescriptor) {
        let is_proto2 = field.parent_file().syntax() == Syntax::Proto2;
        let label = match () {
            () if field.is_map() || oneof(field).is_some() => "",
            () if field.is_list() => "repeated ",
            () if field.is_required() => "required ",
            () if is_proto2 || (field.supports_presence() && !matches!(field.kind(), Kind::Message(_))) => {
                "optional "
            }
            () => "",
        };
        let number = field.number();
        match field.kind() {
            // its type is declared where it is
            Kind::Message(of) if field.is_group() => {
                self.block(&format!("{label}group {} = {number}", of.name()), |text| text.body(&of));
            }
            _ => {
                let (kind, options) = (kind_text(field), options_text(field, is_proto2));
                self.line(&format!("{label}{kind} {} = {number}{options};", field.name()));
            }
        }
    }

    fn values(&mut self, kind: &EnumDescriptor) {
        /// Number of the values among the fields of the descriptor of an enum.
        const VALUES: i32 = 2;
        self.comment(&kind.parent_file(), kind.path());
        let values = &kind.enum_descriptor_proto().value;
        let mut numbers = BTreeSet::new();
        let has_alias = !values.iter().all(|value| numbers.insert(value.number()));
        self.block(&format!("enum {}", kind.name()), |text| {
            if has_alias {
                text.line("option allow_alias = true;");
            }
            // in the order of the declaration: the first is the default
            for (value, index) in values.iter().zip(0..) {
                text.comment(&kind.parent_file(), &[kind.path(), &[VALUES, index]].concat());
                text.line(&format!("{} = {};", value.name(), value.number()));
            }
        });
    }
}

/// The oneof that a field is written in.
fn oneof(field: &FieldDescriptor) -> Option<OneofDescriptor> {
    let is_optional = field.field_descriptor_proto().proto3_optional.unwrap_or(false);
    field.containing_oneof().filter(|_| !is_optional)
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
