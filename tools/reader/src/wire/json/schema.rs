//! JSON schemas: what of them says types.
//!
//! `type`, `properties`, `items`, `prefixItems`, `allOf`, `anyOf` and `oneOf` with one alternative besides `null`, and `$ref` inside
//! the schema are read. What a schema leaves open, messages have to say.

use std::fmt;

use indexmap::IndexMap;
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor, value::SeqAccessDeserializer};

use super::{Fields, MAX_DEPTH, Shape, field};
use crate::recording::Budget;

/// Memory of a schema while it is read, for each of its bytes \[bytes\].
const OF_BYTE: usize = 48;

/// The shape that a JSON schema describes.
///
/// # Errors
///
/// It is no JSON, or takes more memory than there is.
pub(crate) fn shape(bytes: &[u8], budget: &mut Budget) -> Result<Shape, String> {
    let memory = bytes.len().saturating_mul(OF_BYTE);
    if !budget.spend(memory) {
        return Err("it takes more memory than there is for definitions (--max-memory)".into());
    }
    let tree: Result<Tree, _> = serde_json::from_slice(bytes);
    let shape = tree.map(|tree| of(&tree, &tree, 0, budget)).map_err(|error| error.to_string());
    budget.give_back(memory);
    shape
}

/// A JSON document with its objects in the order of the text.
enum Tree {
    Text(String),
    List(Vec<Tree>),
    Object(IndexMap<String, Tree>),
    Other,
}

impl Tree {
    fn get(&self, name: &str) -> Option<&Self> {
        match self {
            Self::Object(entries) => entries.get(name),
            _ => None,
        }
    }

    fn items(&self, name: &str) -> &[Self] {
        match self.get(name) {
            Some(Self::List(items)) => items,
            _ => &[],
        }
    }

    fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    /// What `#/$defs/name` stands for.
    fn resolve(&self, reference: &str) -> Option<&Self> {
        let path = reference.strip_prefix('#')?;
        path.split('/')
            .skip(1)
            .try_fold(self, |tree, part| tree.get(&part.replace("~1", "/").replace("~0", "~")))
    }

    /// Its types, `null` left aside.
    fn types(&self) -> Vec<&str> {
        let types: Vec<&str> = match self.get("type") {
            Some(Self::Text(name)) => vec![name],
            Some(Self::List(names)) => names.iter().filter_map(Self::text).collect(),
            _ => Vec::new(),
        };
        types.into_iter().filter(|name| *name != "null").collect()
    }
}

impl<'de> Deserialize<'de> for Tree {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Builder)
    }
}

struct Builder;

impl<'de> Visitor<'de> for Builder {
    type Value = Tree;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a JSON schema")
    }

    fn visit_bool<E>(self, _: bool) -> Result<Tree, E> {
        Ok(Tree::Other)
    }

    fn visit_i64<E>(self, _: i64) -> Result<Tree, E> {
        Ok(Tree::Other)
    }

    fn visit_u64<E>(self, _: u64) -> Result<Tree, E> {
        Ok(Tree::Other)
    }

    fn visit_f64<E>(self, _: f64) -> Result<Tree, E> {
        Ok(Tree::Other)
    }

    fn visit_unit<E>(self) -> Result<Tree, E> {
        Ok(Tree::Other)
    }

    fn visit_str<E>(self, text: &str) -> Result<Tree, E> {
        Ok(Tree::Text(text.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, sequence: A) -> Result<Tree, A::Error> {
        Vec::deserialize(SeqAccessDeserializer::new(sequence)).map(Tree::List)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Tree, A::Error> {
        let mut entries = IndexMap::new();
        while let Some((key, value)) = map.next_entry()? {
            entries.insert(key, value);
        }
        Ok(Tree::Object(entries))
    }
}

/// The shape of a part of a schema.
fn of(tree: &Tree, root: &Tree, depth: usize, budget: &mut Budget) -> Shape {
    // also what makes no field takes time, and definitions may use each other in circles
    if depth > MAX_DEPTH {
        return Shape::Text;
    }
    let alternatives = ["type", "anyOf", "oneOf"].map(|name| tree.items(name).len());
    if !budget.spend(64 + 8 * alternatives.iter().sum::<usize>()) {
        return Shape::Unknown;
    }
    if let Some(reference) = tree.get("$ref").and_then(Tree::text) {
        return root.resolve(reference).map_or(Shape::Unknown, |tree| of(tree, root, depth + 1, budget));
    }
    match tree.types().as_slice() {
        ["boolean"] => Shape::Bool,
        ["integer"] => Shape::Integer,
        ["number"] | ["number", "integer"] | ["integer", "number"] => Shape::Number,
        ["string"] => Shape::Text,
        ["array"] => list(tree, root, depth, budget),
        ["object"] => object(tree, root, depth, budget),
        [] if tree.get("properties").is_some() => object(tree, root, depth, budget),
        [] => alternative(tree, root, depth, budget),
        _ => Shape::Text,
    }
}

fn list(tree: &Tree, root: &Tree, depth: usize, budget: &mut Budget) -> Shape {
    let items = tree.get("items").filter(|items| matches!(items, Tree::Object(_)));
    let several = items.into_iter().chain(tree.items("items")).chain(tree.items("prefixItems"));
    let (mut element, mut is_nested) = (Shape::Unknown, false);
    for item in several {
        match of(item, root, depth + 1, budget) {
            // arrays inside arrays go one after the other
            Shape::List(inner) | Shape::Nested(inner) => {
                is_nested = true;
                element.join(*inner, budget);
            }
            shape => element.join(shape, budget),
        }
    }
    if is_nested { Shape::Nested(Box::new(element)) } else { Shape::List(Box::new(element)) }
}

fn object(tree: &Tree, root: &Tree, depth: usize, budget: &mut Budget) -> Shape {
    let mut fields = Fields::default();
    if let Some(Tree::Object(properties)) = tree.get("properties") {
        for (name, property) in properties {
            let shape = of(property, root, depth + 1, budget);
            if let Some(entry) = field(&mut fields, name, budget) {
                *entry = shape;
            }
        }
    }
    let mut shape = Shape::Object(fields);
    for part in tree.items("allOf") {
        shape.join(of(part, root, depth + 1, budget), budget);
    }
    shape
}

/// All of several parts, or the only alternative to nothing.
fn alternative(tree: &Tree, root: &Tree, depth: usize, budget: &mut Budget) -> Shape {
    let mut shape = Shape::Unknown;
    for part in tree.items("allOf") {
        shape.join(of(part, root, depth + 1, budget), budget);
    }
    let is_null = |tree: &&Tree| tree.get("type").and_then(Tree::text) == Some("null");
    let alternatives = tree.items("anyOf").iter().chain(tree.items("oneOf"));
    let alternatives: Vec<&Tree> = alternatives.filter(|tree| !is_null(tree)).collect();
    if let [only] = alternatives.as_slice() {
        shape.join(of(only, root, depth + 1, budget), budget);
    }
    shape
}

impl Shape {
    /// Takes in that a value may also be of another shape.
    fn join(&mut self, other: Self, budget: &mut Budget) {
        match (&mut *self, other) {
            (_, Self::Unknown) => {}
            (Self::Object(fields), Self::Object(others)) => {
                for (name, shape) in others {
                    if let Some(entry) = field(fields, &name, budget) {
                        entry.join(shape, budget);
                    }
                }
            }
            (Self::List(element), Self::List(other)) => element.join(*other, budget),
            (Self::Nested(element), Self::List(other) | Self::Nested(other)) => element.join(*other, budget),
            (Self::List(element), Self::Nested(other)) => {
                element.join(*other, budget);
                *self = Self::Nested(std::mem::take(element));
            }
            (_, other) => self.meet(other),
        }
    }
}
