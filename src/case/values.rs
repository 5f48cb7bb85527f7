//! From a document to checked values: the one loop over all keys of a case.
//!
//! Values are dimensionless, whatever the case is written in; they go by their full names, `target.layer.2.thickness`. After a problem
//! reading continues without the value, so that one pass finds all problems; a document with problems yields no case.

use std::{collections::BTreeMap, iter};

use percuss_output::text::short;
use serde::{Deserialize, de::DeserializeOwned};
use toml::{
    Spanned, Value,
    de::{DeTable, DeValue, ValueDeserializer},
};

use super::{
    CaseErrors,
    document::{Document, Span, table, text},
    errors::is_alike,
    keys::{Absent, DEPTH, Key, Kind, LENGTH, LOAD, OF_INDENTER, ROOT, SECTIONS, SHAPES, SIZE, Section, Who},
    numbers::{Numbers, System},
};
use crate::{
    geometry::Geometry,
    material::{PRESETS, Preset},
    model::ModelKind,
    units::Dimension,
};

/// Checked values by the full names of their keys.
pub(super) type Checked = BTreeMap<String, Value>;

/// The values of a case, and where they stand.
pub(super) struct Values<'d> {
    pub document: &'d Document,
    pub system: System,
    pub model: ModelKind,
    /// Shape of the indenter, if there is such a one.
    pub shape: Option<String>,
    /// True for a load in place of an indenter.
    pub is_loaded: bool,
    /// Of a table there is an empty one, of a list of tables one of empty ones.
    pub checked: Checked,
    /// Places of all keys that are given, refused or not, and of sections.
    places: BTreeMap<String, Span>,
}

/// A value without the places inside.
fn plain(value: &Spanned<DeValue<'_>>) -> Option<Value> {
    Value::deserialize(ValueDeserializer::from(value.clone())).ok()
}

fn describe(value: &DeValue<'_>) -> String {
    match value.type_str() {
        name @ ("integer" | "array") => format!("an {name}"),
        name => format!("a {name}"),
    }
}

/// Full name of a key in a section.
pub(super) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

impl<'d> Values<'d> {
    /// Reads all keys of a document.
    ///
    /// # Errors
    ///
    /// An error of syntax.
    pub fn read(document: &'d Document) -> Result<Self, CaseErrors> {
        let mut root = document.root()?;
        let geometry =
            if text(&root, "geometry") == Some("plane") { Geometry::Plane } else { Geometry::Axisymmetric };
        let model = root.get("model").and_then(plain).and_then(|model| model.try_into().ok());
        let shape = table(&root, "indenter").and_then(|indenter| text(indenter, "shape"));
        let mut values = Self {
            document,
            system: System { numbers: Numbers::Unclear, geometry, scales: None },
            model: model.unwrap_or_default(),
            shape: shape.filter(|shape| SHAPES.contains(shape)).map(str::to_owned),
            is_loaded: root.contains_key(LOAD),
            checked: Checked::new(),
            places: BTreeMap::from([(String::new(), 0..0)]),
        };
        values.choose_system(&mut root);
        let tables = SECTIONS.each_ref().map(|section| (section, root.remove(section.path)));
        values.read_section(&ROOT, "", root);
        for (section, value) in tables {
            let of_indenter = OF_INDENTER.contains(&section.path);
            if let Some(value) = &value {
                values.mark(section.path, value.span());
                if values.is_loaded && of_indenter {
                    let message = format!("`[{}]` and `[{LOAD}]` are both given", section.path);
                    let help = "keep one of them: a load is in place of an indenter";
                    values.problem(section.path, message, help);
                }
            }
            let is_absent = if values.is_loaded { of_indenter } else { section.path == LOAD };
            let read = |value| values.read_value(&Kind::Table(section), section.path, &value);
            if !is_absent && value.and_then(read).is_none() {
                values.read_section(section, section.path, DeTable::new());
            }
        }
        Ok(values)
    }

    /// Reads the tables of a list; what is no table is refused.
    ///
    /// * `most`: largest number of tables, and a word for them
    fn read_tables(
        &mut self,
        section: &Section,
        list: &str,
        (most, noun): (usize, &str),
        value: &Spanned<DeValue<'d>>,
    ) -> Option<Value> {
        let refuse = |values: &Self, name: &str, form, value: &Spanned<DeValue<'_>>| {
            let message = format!("`{name}` is {}, it must be {form}", describe(value.get_ref()));
            let help =
                format!("write each as [[{list}]]; --set {list}.1.KEY=VALUE changes one that is there");
            values.note(value.span(), message, help)
        };
        let DeValue::Array(found) = value.get_ref() else {
            return refuse(self, list, "a list of tables", value);
        };
        if !(1..=most).contains(&found.len()) {
            let message = format!("`{list}` has {} {noun}", found.len());
            return self.note(value.span(), message, format!("allowed: 1 to {most}"));
        }
        let read = (1..).zip(found).map(|(number, value)| {
            let path = format!("{list}.{number}");
            let DeValue::Table(table) = value.get_ref() else { return refuse(self, &path, "a table", value) };
            self.mark(&path, value.span());
            self.read_section(section, &path, table.clone());
            Some(Value::Table(toml::Table::new()))
        });
        let read: Vec<_> = read.collect();
        read.into_iter().collect::<Option<Vec<_>>>().map(Value::Array)
    }

    /// Reads the keys of a section, and completes it.
    pub fn read_section(&mut self, section: &Section, path: &str, table: DeTable<'d>) {
        for (key, value) in &table {
            self.places.insert(join(path, key.get_ref()), value.span());
        }
        for (key, value) in table {
            let name = join(path, key.get_ref());
            let mut rows = section.keys.iter().filter(|row| row.name == key.get_ref().as_ref());
            let fitting = rows.clone().find(|row| self.fits(row));
            match (fitting, rows.next()) {
                (None, None) => self.refuse_unknown(section, path, (key.span(), key.get_ref())),
                (None, Some(row)) => self.refuse_owner(row, &name),
                (Some(row), _) => match self.rival(row, path) {
                    Some(rival) => {
                        let message = format!("`{name}` and `{rival}` are both given");
                        self.problem(&name, message, "keep one of them");
                    }
                    None => {
                        let value = self.read_value(&row.kind, &name, &value);
                        self.checked.extend(value.map(|value| (name, value)));
                    }
                },
            }
        }
        for row in section.keys.iter().filter(|row| self.fits(row)).collect::<Vec<_>>() {
            let name = join(path, row.name);
            match row.absent {
                _ if self.is_given(&name) || self.rival(row, path).is_some() => {}
                Absent::Required => self.need(&name, &row.kind.allowed(&row.kind.system(self.system))),
                Absent::Value(text) => {
                    self.checked.insert(name, text.parse().expect("TOML in the table of keys"));
                }
                Absent::Words(_) => {}
            }
        }
    }

    /// True if this case may have the key.
    fn fits(&self, row: &Key) -> bool {
        let shape = self.shape.as_deref();
        match row.who {
            Who::All => true,
            Who::Model(model) => model == self.model,
            Who::Dimensionless => self.system.numbers != Numbers::Physical,
            Who::Physical => self.system.numbers != Numbers::Dimensionless,
            Who::Shapes(shapes) => shape.is_none_or(|shape| shapes.contains(&shape)),
        }
    }

    /// The key that is given and leaves no place for this one.
    fn rival(&self, row: &Key, path: &str) -> Option<String> {
        row.not_beside.iter().map(|other| join(path, other)).find(|other| self.is_given(other))
    }

    /// Refuses a key that other cases have.
    fn refuse_owner(&self, row: &Key, name: &str) {
        let (owner, remedy) = match row.who {
            Who::All => return,
            Who::Model(model) => (format!("needs model = \"{}\"", model.name()), "set the model"),
            Who::Dimensionless => (
                "needs a dimensionless case, and this one is physical".into(),
                "give shear_wave_speed and no material",
            ),
            Who::Physical => (
                "needs a physical case, and this one is dimensionless".into(),
                "give the target a material, in every layer",
            ),
            Who::Shapes(shapes) => {
                let (shapes, shape) = (shapes.join("\" or \""), self.shape.as_deref().unwrap_or_default());
                (format!("belongs to shape = \"{shapes}\", not to \"{shape}\""), "set indenter.shape")
            }
        };
        self.problem(name, format!("`{name}` {owner}"), format!("leave the key out, or {remedy}"));
    }

    /// Refuses a key that no case has.
    fn refuse_unknown(&self, section: &Section, path: &str, (place, key): (Span, &str)) {
        let mut known = section.names();
        if path.is_empty() {
            known.extend(SECTIONS.iter().map(|section| section.path));
        }
        let here = known.iter().find(|name| is_alike(name, key)).map(|name| join(path, name));
        let there = || SECTIONS.iter().find(|section| section.names().contains(&key));
        let meant = here.or_else(|| Some(join(there()?.path, key)));
        let meant = meant.map_or(String::new(), |name| format!("did you mean `{name}`? "));
        let section = if path.is_empty() { "at the top level".into() } else { format!("in [{path}]") };
        let message = format!("unknown key `{}`", short(&join(path, key)));
        self.document.problem(place, message, format!("{meant}known {section}: {}", known.join(", ")));
    }

    /// The dimensionless value of a key; none after a problem, or if it is in keys of its own.
    pub fn read_value(&mut self, kind: &Kind, name: &str, value: &Spanned<DeValue<'d>>) -> Option<Value> {
        let (place, system) = (value.span(), kind.system(self.system));
        match (kind, value.get_ref()) {
            (Kind::Material, _) => {
                if system.numbers != Numbers::Unclear {
                    self.read_material(name, value);
                }
                return None;
            }
            (Kind::Table(section) | Kind::NameOr(_, section), DeValue::Table(table)) => {
                self.read_section(section, name, table.clone());
                return Some(Value::Table(toml::Table::new()));
            }
            // a table in a list has no heading
            (Kind::Table(section), other) if section.path == name => {
                let message = format!("`{name}` is {}, it must be a table", describe(other));
                return self.note(place, message, format!("write it as [{name}]"));
            }
            (Kind::Tables(section, noun, most), _) => {
                return self.read_tables(section, name, (*most, noun), value);
            }
            _ => {}
        }
        let given = format!("`{name}` = {}", short(self.document.written(&place)));
        let number = plain(value);
        let read = match (kind, value.get_ref()) {
            // an integer that is too large, in a list or alone
            _ if number.is_none() => None,
            (Kind::Preset, DeValue::String(text)) => {
                let Some(preset) = Preset::find(text) else {
                    let names = PRESETS.map(|preset| preset.name).join(", ");
                    let help = format!("allowed: {names}; `percuss materials` lists their constants");
                    return self.note(place, format!("{given} is no material known here"), help);
                };
                Some(preset.name.into())
            }
            (Kind::Name(names) | Kind::NameOr(names, _), DeValue::String(text)) => {
                if !names.contains(&text.as_ref()) {
                    let message = format!("`{name}`: unknown value `{text}`");
                    return self.note(place, message, format!("allowed: {}", names.join(", ")));
                }
                number
            }
            (Kind::Text(_), DeValue::String(_)) => number,
            (Kind::Choice(numbers), DeValue::Integer(_)) => {
                number.filter(|number| number.as_integer().is_some_and(|number| numbers.contains(&number)))
            }
            (Kind::Count(low, high, _), DeValue::Integer(_)) => {
                let allowed = *low..=*high;
                number.filter(|number| number.as_integer().is_some_and(|number| allowed.contains(&number)))
            }
            (Kind::Number(bounds, _), DeValue::Integer(_) | DeValue::Float(_)) => {
                let number: Option<f64> = number.and_then(|number| number.try_into().ok());
                number.filter(|number| bounds.contain(*number)).map(Value::Float)
            }
            (Kind::Thickness, DeValue::String(text)) if text == "half-space" => number,
            (Kind::Quantity(..) | Kind::Si(..) | Kind::Thickness, _) => {
                let (dimension, bounds, or) = match kind {
                    Kind::Quantity(dimension, bounds) | Kind::Si(dimension, bounds) => {
                        (*dimension, *bounds, "")
                    }
                    _ => (Dimension::Length, SIZE, ", or \"half-space\""),
                };
                match system.read(&given, &number?, dimension, bounds) {
                    Ok(number) => Some(Value::Float(number)),
                    Err((message, help)) => return self.note(place, message, help + or),
                }
            }
            (Kind::List { noun, most, .. }, DeValue::Array(list)) if list.len() > *most => {
                let message = format!("`{name}` has {} {noun}", list.len());
                return self.note(place, message, format!("allowed: at most {most}"));
            }
            (Kind::List { of, .. }, DeValue::Array(list)) => {
                let read = self.read_items(iter::repeat(*of), name, list)?;
                let is_twice = |(i, item): &(usize, &Value)| item.is_str() && read[..*i].contains(item);
                if let Some((_, item)) = read.iter().enumerate().find(is_twice) {
                    let message = format!("`{name}` names {} twice", item.as_str().unwrap_or_default());
                    return self.note(place, message, "name each once".into());
                }
                Some(Value::Array(read))
            }
            (Kind::Pair(kinds), DeValue::Array(pair)) if pair.len() == 2 => {
                Some(Value::Array(self.read_items(kinds.iter(), name, pair)?))
            }
            (Kind::Line, DeValue::Table(line)) if line.len() == 1 => {
                let (axis, place) = line.iter().next()?;
                let axis = axis.get_ref().as_ref();
                let kind = if axis == "z" { DEPTH } else { LENGTH };
                let number = self.read_value(&kind, &join(name, axis), place)?;
                ["r", "z"].contains(&axis).then(|| toml::Table::from_iter([(axis.to_owned(), number)]).into())
            }
            _ => None,
        };
        if read.is_none() {
            let is_text = matches!(value.get_ref(), DeValue::String(_));
            let is_number = matches!(kind, Kind::Count(..) | Kind::Number(..) | Kind::Choice(_));
            let remark = if is_text && is_number { ", without quotes and unit" } else { "" };
            let help = format!("allowed: {}{remark}", kind.allowed(&system));
            return self.note(place, format!("{given} is not possible"), help);
        }
        read
    }

    /// The elements of a list.
    fn read_items<'k>(
        &mut self,
        kinds: impl Iterator<Item = &'k Kind>,
        name: &str,
        list: &[Spanned<DeValue<'d>>],
    ) -> Option<Vec<Value>> {
        let mut read = Vec::new();
        for (i, (kind, item)) in kinds.zip(list).enumerate() {
            let name = format!("{name}[{i}]");
            read.push(self.read_value(kind, &name, item)?);
            self.places.insert(name, item.span());
        }
        Some(read)
    }

    /// A value.
    ///
    /// # Panics
    ///
    /// If the table of keys and the type do not have the same names.
    pub fn get<T: DeserializeOwned>(&self, name: &str) -> Option<T> {
        let value = self.checked.get(name)?.clone();
        Some(value.try_into().unwrap_or_else(|error| panic!("{name}: {error}")))
    }

    /// The values of a section.
    ///
    /// # Panics
    ///
    /// As [`Self::get`].
    pub fn section<T: DeserializeOwned>(&self, path: &str) -> T {
        let start = join(path, "");
        let entry =
            |(name, value): (&String, &Value)| Some((name.strip_prefix(&start)?.to_owned(), value.clone()));
        let entries: toml::Table = self.checked.iter().filter_map(entry).collect();
        entries.try_into().unwrap_or_else(|error| panic!("{path}: {error}"))
    }

    pub fn number(&self, name: &str) -> Option<f64> {
        self.checked.get(name)?.as_float()
    }

    /// A number, which the complete case says in another way.
    pub fn take(&mut self, name: &str) -> Option<f64> {
        self.checked.remove(name)?.as_float()
    }

    /// Number of tables in a list, if it is given.
    pub fn count(&self, list: &str) -> Option<usize> {
        let tables = self.checked.get(list).and_then(Value::as_array);
        self.is_given(list).then(|| tables.map_or(0, Vec::len))
    }

    /// True if the key has a table.
    pub fn is_table(&self, name: &str) -> bool {
        self.checked.get(name).is_some_and(Value::is_table)
    }

    /// Names of the sections of layers of a body.
    ///
    /// * `body`: its section
    pub fn layer_paths(&self, body: &str) -> Vec<String> {
        match self.count(&format!("{body}.layer")) {
            None => vec![body.into()],
            Some(count) => (1..=count).map(|number| format!("{body}.layer.{number}")).collect(),
        }
    }

    /// Writes the only layer of a list as a target without a list.
    pub fn rename_only_layer(&mut self) {
        for (name, value) in self.checked.clone() {
            if let Some(key) = name.strip_prefix("target.layer.1.") {
                self.checked.remove(&name);
                if !["density", "wave_speed", "bond"].contains(&key) {
                    self.set(&format!("target.{key}"), value);
                }
            }
        }
    }

    /// True if the key is in the text, refused or not.
    pub fn is_given(&self, name: &str) -> bool {
        self.places.contains_key(name)
    }

    /// Sets a value that follows from others.
    pub fn set(&mut self, name: &str, value: impl Into<Value>) {
        self.checked.insert(name.to_owned(), value.into());
    }

    /// Place of a key, else of its section.
    pub fn place(&self, name: &str) -> Span {
        let section = name.rsplit_once('.').map_or("", |(section, _)| section);
        self.places.get(name).or(self.places.get(section)).cloned().unwrap_or(0..0)
    }

    pub fn written(&self, name: &str) -> &str {
        self.document.written(&self.place(name))
    }

    /// Notes a problem with a key, which leaves no value.
    pub fn problem(&self, name: &str, message: impl Into<String>, help: impl Into<String>) -> Option<()> {
        self.document.problem(self.place(name), message, help);
        None
    }

    /// Notes a problem with the value of a key.
    ///
    /// * `what`: is wrong, behind the key and its text
    pub fn refuse(&self, name: &str, what: &str, help: &str) -> Option<()> {
        self.problem(name, format!("`{name}` = {}{what}", short(self.written(name))), help)
    }

    /// Notes a problem with a key if it is given.
    ///
    /// * `what`: is wrong, behind the key
    pub fn unwanted(&self, name: &str, what: &str, help: &str) {
        if self.is_given(name) {
            self.problem(name, format!("`{name}`{what}"), help);
        }
    }

    /// Notes that a key is missing, unless it is refused.
    pub fn need(&self, name: &str, meaning: &str) {
        if !self.checked.contains_key(name) && !self.is_given(name) {
            self.problem(name, format!("`{name}` is missing"), format!("add `{name}`: {meaning}"));
        }
    }

    /// Notes a problem at a place, which leaves no value.
    fn note<T>(&self, place: Span, message: String, help: String) -> Option<T> {
        self.document.problem(place, message, help);
        None
    }

    /// Notes the place of a key that is read ahead of the others.
    pub fn mark(&mut self, name: &str, place: Span) {
        self.places.insert(name.to_owned(), place);
    }
}
