//! From a case back to a case file with every default and derived choice explicit.

use std::borrow::Cow;

use percuss_output::text::{printable, toml_string};
use serde::{Serialize, Serializer};
use toml::Value;

use super::{
    Parameters,
    keys::{Kind, LOAD, MATERIAL, OF_INDENTER, ROOT, SECTIONS, Section},
    numbers::{Numbers, System},
    values::join,
};
use crate::units::Dimension;

/// A part of a case file, in the order of the table of keys.
enum Part {
    Value(Value),
    Table(Vec<(&'static str, Part)>),
    List(Vec<Part>),
}

impl Serialize for Part {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Value(value) => value.serialize(serializer),
            Self::Table(entries) => serializer.collect_map(entries.iter().map(|(key, part)| (key, part))),
            Self::List(parts) => serializer.collect_seq(parts),
        }
    }
}

/// A value as the case has it, its numbers in the units of the case.
fn written(value: &Value, kind: &Kind, system: System) -> Value {
    match (value, kind.dimension()) {
        (Value::Float(x), Some(dimension)) => kind.system(system).written(dimension, *x),
        (Value::Array(list), _) => {
            let of = |i: usize| match kind {
                Kind::List { of, .. } => of,
                Kind::Pair(kinds) => &kinds[i % 2],
                _ => kind,
            };
            Value::Array(list.iter().enumerate().map(|(i, value)| written(value, of(i), system)).collect())
        }
        (Value::Table(table), _) => {
            let entries = table.iter().map(|(key, value)| (key.clone(), written(value, kind, system)));
            Value::Table(entries.collect())
        }
        _ => value.clone(),
    }
}

impl Parameters {
    fn section(&self, section: &Section, path: &str) -> Part {
        let part = |name: &'static str| {
            let full = join(path, name);
            let kind = &section.keys.iter().find(|row| row.name == name)?.kind;
            let part = match (kind, self.resolved.get(&full)?) {
                (Kind::Tables(of, ..), Value::Array(list)) => {
                    let tables = (1..=list.len()).map(|number| format!("{full}.{number}"));
                    Part::List(tables.map(|table| self.section(of, &table)).collect())
                }
                (Kind::Table(of) | Kind::NameOr(_, of), Value::Table(_)) => self.section(of, &full),
                (Kind::Material, _) => self.section(&MATERIAL, &full),
                (kind, value) => Part::Value(written(value, kind, self.system())),
            };
            Some((name, part))
        };
        Part::Table(section.names().into_iter().filter_map(part).collect())
    }

    fn parts(&self) -> Part {
        let Part::Table(mut parts) = self.section(&ROOT, "") else { unreachable!("a section is a table") };
        let is_of_this = |section: &&Section| match self.load {
            Some(_) => !OF_INDENTER.contains(&section.path),
            None => section.path != LOAD,
        };
        let sections = SECTIONS.iter().filter(is_of_this);
        parts.extend(sections.map(|section| (section.path, self.section(section, section.path))));
        Part::Table(parts)
    }

    /// The case with another value of a key, or without it.
    fn with(&self, key: &str, value: Option<&str>) -> Self {
        let mut case = self.clone();
        case.resolved.remove(key);
        case.resolved.extend(value.map(|value| (key.to_owned(), value.into())));
        case
    }

    /// The case as TOML with every default and derived choice explicit; it repeats the run.
    pub fn resolved_toml(&self) -> String {
        let text =
            |case: &Self| toml::to_string(&case.parts()).expect("a case is plain tables, text and numbers");
        match printable(&self.title) {
            Cow::Borrowed(_) => text(self),
            // on one line, so that a title cannot command what shows it
            Cow::Owned(_) => {
                let title = format!("title = {}", toml_string(&self.title));
                text(&self.with("title", Some(""))).replacen("title = \"\"", &title, 1)
            }
        }
    }

    /// All that the results of a case depend on, as a text: not its title, nor when its checkpoints are written.
    pub fn identity(&self) -> String {
        let case = self.with("title", None).with("run.checkpoint_every", None);
        serde_json::to_string(&case.parts()).expect("a case is plain maps, text and numbers")
    }

    /// The case as JSON with every default and derived choice explicit; an infinite mass becomes `null`, as JSON has no infinity.
    pub fn resolved_json(&self) -> serde_json::Value {
        serde_json::to_value(self.parts()).expect("a case is plain maps, text and numbers")
    }

    /// A dimensionless number as case files of this case have it: plain, or as a quantity.
    pub fn written(&self, dimension: Dimension, x: f64) -> Value {
        self.system().written(dimension, x)
    }

    pub(super) fn system(&self) -> System {
        let numbers = if self.scales.is_some() { Numbers::Physical } else { Numbers::Dimensionless };
        System { numbers, geometry: self.geometry, scales: self.scales }
    }
}
