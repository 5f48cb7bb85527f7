//! A shape as a message type, every field of which is optional, and the names that its fields have in JSON.

use std::collections::HashMap;

use prost_reflect::{
    DescriptorPool, MessageDescriptor,
    prost_types::{
        DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet,
        field_descriptor_proto::{Label, Type},
    },
};

use super::{Fields, Shape};
use crate::wire::{
    layout::Names,
    leaf::{COUNT, MAX_LEAVES},
};

/// The message type of a shape; `None` if nothing is known of it.
pub(super) fn message(shape: &Shape, name: &str) -> Option<(MessageDescriptor, Names)> {
    let mut builder = Builder::default();
    let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
    let name = name.rsplit(['.', '/']).next().unwrap_or_default().chars().map(plain).collect::<String>();
    let name = if name.starts_with(|c: char| c.is_ascii_alphabetic()) { name } else { "Message".to_owned() };
    let names = match shape {
        Shape::Unknown => return None,
        Shape::Object(fields) if fields.is_empty() => return None,
        Shape::Object(fields) => builder.message(name.clone(), fields),
        other => {
            let fields = Fields::from([("value".into(), other.clone())]);
            Names { is_value: true, ..builder.message(name.clone(), &fields) }
        }
    };
    let file = FileDescriptorProto {
        name: Some("json".into()),
        message_type: builder.messages,
        ..FileDescriptorProto::default()
    };
    let pool = DescriptorPool::from_file_descriptor_set(FileDescriptorSet { file: vec![file] }).ok()?;
    Some((pool.get_message_by_name(&name)?, names))
}

#[derive(Default)]
struct Builder {
    messages: Vec<DescriptorProto>,
    /// Types inside so far, and fields.
    parts: usize,
    fields: usize,
}

impl Builder {
    fn message(&mut self, name: String, fields: &Fields) -> Names {
        let (mut names, mut taken, mut protos) = (Names::default(), HashMap::new(), Vec::new());
        // after the numbers of all fields
        let mut free = i32::try_from(fields.len()).unwrap_or(i32::MAX);
        for ((key, shape), number) in fields.iter().zip(1_i32..) {
            if self.fields == MAX_LEAVES {
                // what has no leaf is kept like a field that is not known
                break;
            }
            self.fields += 1;
            let is_nested = matches!(shape, Shape::Nested(_));
            let (label, shape) = match shape {
                Shape::List(element) | Shape::Nested(element) => (Label::Repeated, element.as_ref()),
                shape => (Label::Optional, shape),
            };
            let (kind, type_name) = match shape {
                Shape::Object(inner) => {
                    self.parts += 1;
                    let part = format!("{name}_Part{}", self.parts);
                    let inner = self.message(part.clone(), inner);
                    names.inner.insert(number.unsigned_abs(), inner);
                    (Type::Message, Some(format!(".{part}")))
                }
                Shape::Bool => (Type::Bool, None),
                Shape::Integer => (Type::Int64, None),
                Shape::Number => (Type::Double, None),
                Shape::Unknown | Shape::Text | Shape::List(_) | Shape::Nested(_) => (Type::String, None),
            };
            let field = unique(key, &mut taken);
            names.numbers.insert(key.clone(), number.unsigned_abs());
            if is_nested {
                free = free.saturating_add(1);
                names.lengths.insert(number.unsigned_abs(), free.unsigned_abs());
                protos.push(proto(format!("{field}{COUNT}"), free, Label::Repeated, Type::Uint64, None));
            }
            protos.push(proto(field, number, label, kind, type_name));
        }
        self.messages.push(DescriptorProto { name: Some(name), field: protos, ..DescriptorProto::default() });
        names
    }
}

fn proto(
    name: String,
    number: i32,
    label: Label,
    kind: Type,
    type_name: Option<String>,
) -> FieldDescriptorProto {
    FieldDescriptorProto {
        json_name: Some(name.clone()),
        name: Some(name),
        number: Some(number),
        label: Some(label.into()),
        r#type: Some(kind.into()),
        type_name,
        ..FieldDescriptorProto::default()
    }
}

/// A name that no other field of the object has, without what has a meaning in the names of leaves.
///
/// * `taken`: names that others have, and the number from which on there may be names like them
fn unique(key: &str, taken: &mut HashMap<String, u32>) -> String {
    let plain = |c: char| if c.is_control() || ".[]@,;".contains(c) { '_' } else { c };
    let name: String = key.chars().map(plain).collect();
    let name = if name.is_empty() { "_".to_owned() } else { name };
    let free = match taken.get(&name) {
        None => name,
        Some(&next) => {
            let numbered = (next..).map(|number| (number, format!("{name}_{number}")));
            let free = numbered.into_iter().find(|(_, numbered)| !taken.contains_key(numbered));
            let (number, free) = free.unwrap_or((next, name.clone()));
            taken.insert(name, number.saturating_add(1));
            free
        }
    };
    taken.insert(free.clone(), 2);
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_become_the_same_get_numbers() {
        let mut taken = HashMap::new();
        let names = ["a.b", "a_b_3", "a[b", "a]b", "a_b_3", ""].map(|key| unique(key, &mut taken));
        assert_eq!(names, ["a_b", "a_b_3", "a_b_2", "a_b_4", "a_b_3_2", "_"]);
    }
}
