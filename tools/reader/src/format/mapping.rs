//! Messages in the JSON mapping of protobuf, none of which is hidden: what the mapping has no form for, as a time out of range or
//! an `Any` of an unknown type, is written field by field; the entries of maps are in the order of their keys.

use base64::{Engine, engine::general_purpose::STANDARD};
use prost_reflect::{
    DynamicMessage, Kind, MapKey, MessageDescriptor, ReflectMessage, SerializeOptions, Value,
};
use serde::ser::{Error, Serialize, SerializeMap, Serializer};

use super::json::special;
use crate::wire::dynamic;

/// Deepest nesting of messages in messages of unknown type, `Any`.
const MAX_DEPTH: usize = 16;

#[derive(Clone, Copy)]
pub(crate) struct Mapped<'a> {
    pub(crate) message: &'a DynamicMessage,
    /// Memory of a decoded message \[bytes\].
    pub(crate) room: usize,
    /// Number of `Any` that it is in.
    depth: usize,
}

impl<'a> Mapped<'a> {
    /// * `room`: memory of a decoded message \[bytes\]
    pub(crate) fn new(message: &'a DynamicMessage, room: usize) -> Self {
        Self { message, room, depth: 0 }
    }

    /// The form that the mapping has for a type of its own, if this message has it.
    fn form(&self) -> Option<serde_json::Value> {
        let number = |name: &str| -> Option<i64> {
            let value = self.message.get_field_by_name(name)?;
            value.as_i64().or_else(|| value.as_i32().map(i64::from))
        };
        match self.message.descriptor().full_name() {
            // of both signs, it is no duration, though it would have a text
            "google.protobuf.Duration" if number("seconds")?.signum() * number("nanos")?.signum() < 0 => None,
            "google.protobuf.Timestamp" | "google.protobuf.Duration" | "google.protobuf.FieldMask" => {
                let options = SerializeOptions::new();
                self.message.serialize_with_options(serde_json::value::Serializer, &options).ok()
            }
            _ => None,
        }
    }

    /// The message in an `Any`, if its type is known and it fits.
    fn content(&self) -> Option<(String, DynamicMessage)> {
        let url = self.message.get_field_by_name("type_url")?.as_str()?.to_owned();
        let name = url.rsplit('/').next()?.to_owned();
        let descriptor: MessageDescriptor =
            self.message.descriptor().parent_pool().get_message_by_name(&name)?;
        let content = self.message.get_field_by_name("value")?;
        let content = dynamic(&descriptor, content.as_bytes()?, self.room).ok()?;
        (self.depth < MAX_DEPTH).then_some((url, content))
    }

    fn fields<M: SerializeMap>(&self, map: &mut M) -> Result<(), M::Error> {
        for field in self.message.descriptor().fields() {
            if field.supports_presence() && !self.message.has_field(&field) {
                continue;
            }
            let (value, kind) = (self.message.get_field(&field), field.kind());
            map.serialize_entry(field.name(), &Part { value: &value, kind: &kind, of: *self })?;
        }
        for (extension, value) in self.message.extensions() {
            let kind = extension.kind();
            map.serialize_entry(extension.json_name(), &Part { value, kind: &kind, of: *self })?;
        }
        Ok(())
    }
}

impl Serialize for Mapped<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let descriptor = self.message.descriptor();
        if let Some(form) = self.form() {
            return form.serialize(serializer);
        }
        let single = |name: &str| descriptor.get_field_by_name(name);
        match descriptor.full_name() {
            "google.protobuf.Any" => {
                if let Some((url, content)) = self.content() {
                    let content = Mapped { message: &content, room: self.room, depth: self.depth + 1 };
                    let mut map = serializer.serialize_map(None)?;
                    map.serialize_entry("@type", &url)?;
                    if is_own(content.message.descriptor().full_name()) {
                        map.serialize_entry("value", &content)?;
                    } else {
                        content.fields(&mut map)?;
                    }
                    return map.end();
                }
            }
            "google.protobuf.Value" => {
                return match self.message.fields().next() {
                    Some((field, value)) if field.name() != "null_value" => {
                        Part { value, kind: &field.kind(), of: *self }.serialize(serializer)
                    }
                    _ => serializer.serialize_none(),
                };
            }
            name => {
                let only = match name {
                    "google.protobuf.Struct" | "google.protobuf.ListValue" => {
                        single("fields").or_else(|| single("values"))
                    }
                    name => single("value").filter(|_| is_wrapper(name)),
                };
                if let Some(field) = only {
                    let (value, kind) = (self.message.get_field(&field), field.kind());
                    return Part { value: &value, kind: &kind, of: *self }.serialize(serializer);
                }
            }
        }
        let mut map = serializer.serialize_map(None)?;
        self.fields(&mut map)?;
        map.end()
    }
}

/// True for the types of numbers and texts that need not be there.
fn is_wrapper(name: &str) -> bool {
    let of = name.strip_prefix("google.protobuf.").and_then(|name| name.strip_suffix("Value"));
    of.is_some_and(|of| {
        ["Double", "Float", "Int64", "UInt64", "Int32", "UInt32", "Bool", "String", "Bytes"].contains(&of)
    })
}

/// True for types that the mapping has a form of its own for.
fn is_own(name: &str) -> bool {
    let others = ["Any", "Timestamp", "Duration", "FieldMask", "Struct", "ListValue", "Value"];
    is_wrapper(name) || name.strip_prefix("google.protobuf.").is_some_and(|name| others.contains(&name))
}

#[derive(Clone, Copy)]
struct Part<'a> {
    value: &'a Value,
    kind: &'a Kind,
    of: Mapped<'a>,
}

impl Part<'_> {
    fn number<S: Serializer>(
        value: f64,
        serializer: S,
        write: impl FnOnce(S) -> Result<S::Ok, S::Error>,
    ) -> Result<S::Ok, S::Error> {
        if value.is_finite() { write(serializer) } else { serializer.serialize_str(special(value)) }
    }
}

impl Serialize for Part<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let of = |value| Part { value, ..*self };
        match self.value {
            Value::Bool(value) => serializer.serialize_bool(*value),
            Value::I32(value) => serializer.serialize_i32(*value),
            Value::U32(value) => serializer.serialize_u32(*value),
            // numbers of JSON may be of double precision
            Value::I64(value) => serializer.collect_str(value),
            Value::U64(value) => serializer.collect_str(value),
            Value::F32(value) => Self::number(f64::from(*value), serializer, |to| to.serialize_f32(*value)),
            Value::F64(value) => Self::number(*value, serializer, |to| to.serialize_f64(*value)),
            Value::String(value) => serializer.serialize_str(value),
            Value::Bytes(value) => serializer.serialize_str(&STANDARD.encode(value)),
            Value::EnumNumber(number) => {
                let names = if let Kind::Enum(names) = self.kind { Some(names) } else { None };
                match names.and_then(|names| names.get_value(*number)) {
                    Some(value) => serializer.serialize_str(value.name()),
                    None => serializer.serialize_i32(*number),
                }
            }
            Value::Message(message) => Mapped { message, ..self.of }.serialize(serializer),
            Value::List(list) => serializer.collect_seq(list.iter().map(of)),
            Value::Map(map) => {
                let Kind::Message(entry) = self.kind else { return Err(S::Error::custom("no map")) };
                let kind = entry.map_entry_value_field().kind();
                let mut entries: Vec<_> = map.iter().collect();
                entries.sort_by_key(|(key, _)| *key);
                let part = |value| Part { value, kind: &kind, of: self.of };
                serializer.collect_map(entries.into_iter().map(|(key, value)| (text(key), part(value))))
            }
        }
    }
}

/// A key as JSON has it.
fn text(key: &MapKey) -> String {
    match key {
        MapKey::Bool(key) => key.to_string(),
        MapKey::I32(key) => key.to_string(),
        MapKey::I64(key) => key.to_string(),
        MapKey::U32(key) => key.to_string(),
        MapKey::U64(key) => key.to_string(),
        MapKey::String(key) => key.clone(),
    }
}
