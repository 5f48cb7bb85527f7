//! TOML text with spans: the place of every value, and of every problem.
//!
//! A document is the text of a case file and, behind it, the settings; offsets count through all of them, so that a problem
//! is shown where its value was written.

use std::{
    cell::RefCell,
    ops::{Range, RangeInclusive},
};

use percuss_output::text::{clipped, short};
use serde::de::DeserializeOwned;
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue, ValueDeserializer},
};

use super::{CaseBuilder, CaseErrors, Problem, bounds::Bounds, errors::Excerpt};

/// Place in all texts together.
pub type Span = Range<usize>;

/// A value and its place.
#[derive(Clone, Debug)]
pub struct Given<T> {
    pub value: T,
    pub span: Span,
}

/// The value without its place.
pub fn value<T>(given: Given<T>) -> T {
    given.value
}

/// Place of a value.
pub fn span_of<T>(given: &Option<Given<T>>) -> Option<Span> {
    given.as_ref().map(|given| given.span.clone())
}

/// Problems that are kept: the first of a text. Of the others there is a count.
const MOST_PROBLEMS: usize = 50;

/// Characters of a problem and of its help that are kept: a value may be of any length.
const LONGEST_MESSAGE: usize = 400;
const LONGEST_HELP: usize = 2000;

/// The texts a case is read from, the case file and one for each setting, and the problems found in them so far.
pub struct Document {
    sources: Vec<Source>,
    problems: RefCell<Notes>,
}

/// A problem, and its place in all texts together.
struct Note {
    span: Range<usize>,
    message: String,
    help: Option<String>,
}

/// The first problems in the order of the text, and how many more there are.
#[derive(Default)]
struct Notes {
    first: Vec<Note>,
    more: usize,
}

impl Notes {
    fn push(&mut self, note: Note) {
        self.first.push(note);
        if self.first.len() >= 2 * MOST_PROBLEMS {
            self.sort();
        }
    }

    fn sort(&mut self) {
        self.first.sort_by_key(|note| note.span.start);
        self.more += self.first.len().saturating_sub(MOST_PROBLEMS);
        self.first.truncate(MOST_PROBLEMS);
    }
}

struct Source {
    name: String,
    text: String,
    /// Place of the text: behind all others before it.
    start: usize,
}

impl Document {
    /// The texts of a case; a setting whose value is no TOML is taken as a string.
    pub fn new(given: &CaseBuilder) -> Self {
        let mut document = Self { sources: Vec::new(), problems: RefCell::default() };
        // an editor's byte order mark is no part of the text
        document.push(&given.name, given.text.strip_prefix('\u{feff}').unwrap_or(&given.text));
        for setting in &given.settings {
            match setting.split_once('=') {
                Some((key, value)) if DeTable::parse(setting).is_err() => {
                    document.push("--set", &format!("{key}={}", toml::Value::String(value.trim().into())));
                }
                _ => document.push("--set", setting),
            }
        }
        document
    }

    fn push(&mut self, name: &str, text: &str) {
        let start = self.sources.last().map_or(0, |last| last.start + last.text.len() + 1);
        self.sources.push(Source { name: name.into(), text: text.into(), start });
    }

    /// The contents of all texts, where later ones override earlier ones.
    ///
    /// # Errors
    ///
    /// The first error of syntax, alone: what is behind it may be anything.
    pub fn root(&self) -> Result<Section<'_>, CaseErrors> {
        let mut table = DeTable::new();
        for source in &self.sources {
            let (part, errors) = DeTable::parse_recoverable(&source.text);
            for error in errors {
                let span = error.span().unwrap_or_default();
                let span = source.start + span.start..source.start + span.end;
                match error.message().trim_end() {
                    "duplicate key" => {
                        self.problem(
                            span.clone(),
                            format!("`{}` is given twice", short(self.written(&span))),
                            "keep one of them",
                        );
                    }
                    message => {
                        let note =
                            Note { span, message: clipped(message, LONGEST_MESSAGE).into(), help: None };
                        self.problems.replace(Notes { first: vec![note], more: 0 });
                        return self.finish(None);
                    }
                }
            }
            merge(&mut table, moved_table(part.into_inner(), source.start));
        }
        Ok(Section::new(self, String::new(), table, 0..0))
    }

    /// The text at a place.
    pub fn written(&self, span: &Range<usize>) -> &str {
        let source = self.sources.iter().rev().find(|source| source.start <= span.start);
        let place = |source: &Source| span.start - source.start..span.end - source.start;
        source.and_then(|source| source.text.get(place(source))).unwrap_or_default()
    }

    /// Notes a problem.
    pub fn problem(&self, span: Range<usize>, message: impl Into<String>, help: impl Into<String>) {
        let message = clipped(&message.into(), LONGEST_MESSAGE).into_owned();
        let help = Some(clipped(&help.into(), LONGEST_HELP).into_owned());
        self.problems.borrow_mut().push(Note { span, message, help });
    }

    /// True if there are no problems so far.
    pub fn is_sound(&self) -> bool {
        self.problems.borrow().first.is_empty()
    }

    /// Ends reading: `value`, or all problems in the order of the text.
    pub fn finish<T>(&self, value: Option<T>) -> Result<T, CaseErrors> {
        match value {
            Some(value) if self.is_sound() => Ok(value),
            _ => {
                let mut notes = self.problems.take();
                notes.sort();
                let problems = notes.first.into_iter().map(|note| self.locate(note)).collect();
                Err(CaseErrors { name: self.sources[0].name.clone(), problems, more: notes.more })
            }
        }
    }

    fn locate(&self, Note { span, message, help }: Note) -> Problem {
        let source = self.sources.iter().rev().find(|source| source.start <= span.start);
        let place = source.filter(|source| !source.text.trim().is_empty()).map(|source| {
            Excerpt::of(&source.name, &source.text, span.start - source.start..span.end - source.start)
        });
        let (source_code, label) = place.unzip();
        Problem { message, help, source_code, label }
    }
}

/// A table of the document, read key by key.
pub struct Section<'t> {
    pub document: &'t Document,
    path: String,
    table: DeTable<'t>,
    span: Range<usize>,
    keys: Vec<&'static str>,
    /// Keys whose values were refused.
    refused: Vec<&'static str>,
}

impl<'t> Section<'t> {
    fn new(document: &'t Document, path: String, table: DeTable<'t>, span: Range<usize>) -> Self {
        Self { document, path, table, span, keys: Vec::new(), refused: Vec::new() }
    }

    /// Place of the section.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// Notes a problem.
    pub fn problem(&self, span: Range<usize>, message: impl Into<String>, help: impl Into<String>) {
        self.document.problem(span, message, help);
    }

    /// Full name of a key.
    pub fn name(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    fn remove(&mut self, key: &'static str) -> Option<Spanned<DeValue<'t>>> {
        self.know(key);
        self.table.remove(key)
    }

    /// The text of a value, without reading it: `None` if there is none or it is no text.
    pub fn text(&self, key: &str) -> Option<&str> {
        match self.table.get(key)?.get_ref() {
            DeValue::String(text) => Some(text),
            _ => None,
        }
    }

    /// Place of a key that is there and not read yet, else of the section.
    pub fn place(&self, key: &str) -> Range<usize> {
        self.table.get(key).map_or(self.span(), Spanned::span)
    }

    /// True if the value of any key was refused.
    pub fn has_refused(&self) -> bool {
        !self.refused.is_empty()
    }

    /// A sub-table that is there and not read yet.
    pub fn table(&self, key: &str) -> Option<&DeTable<'t>> {
        match self.table.get(key)?.get_ref() {
            DeValue::Table(table) => Some(table),
            _ => None,
        }
    }

    /// Notes that a key belongs to the section though it is not read.
    pub fn know(&mut self, key: &'static str) {
        if !self.keys.contains(&key) {
            self.keys.push(key);
        }
    }

    /// True if the key is there and not read yet.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// A sub-table; an empty one if it is missing.
    pub fn section(&mut self, key: &'static str) -> Section<'t> {
        let path = self.name(key);
        let (table, span) = match self.remove(key).map(|value| (value.span(), value.into_inner())) {
            Some((span, DeValue::Table(table))) => (table, span),
            Some((span, other)) => {
                let message = format!("`{path}` is {}, it must be a table", describe(&other));
                self.problem(span.clone(), message, format!("write it as [{path}]"));
                (DeTable::new(), span)
            }
            None => (DeTable::new(), self.span()),
        };
        Self::new(self.document, path, table, span)
    }

    /// The tables of a list, numbered from 1 on, if the key is there; what is no table is refused and left out.
    pub fn sections(&mut self, key: &'static str) -> Option<Given<Vec<Section<'t>>>> {
        let path = self.name(key);
        let value = self.remove(key)?;
        let span = value.span();
        let help = format!("write each as [[{path}]]; --set {path}.1.KEY=VALUE changes one that is there");
        let mut sections = Vec::new();
        let mut refuse = |place, name: &str, form, value: &DeValue<'_>| {
            self.refused.push(key);
            self.document.problem(
                place,
                format!("`{name}` is {}, it must be {form}", describe(value)),
                help.clone(),
            );
        };
        match value.into_inner() {
            DeValue::Array(list) => {
                for (number, value) in (1..).zip(list) {
                    let (path, span) = (format!("{path}.{number}"), value.span());
                    match value.into_inner() {
                        DeValue::Table(table) => sections.push(Self::new(self.document, path, table, span)),
                        other => refuse(span, &path, "a table", &other),
                    }
                }
            }
            other => refuse(span.clone(), &path, "a list of tables", &other),
        }
        Some(Given { value: sections, span })
    }

    /// A value, if the key is there and the value fits.
    ///
    /// * `allowed`: allowed values, for the message
    pub fn get<T: DeserializeOwned>(&mut self, key: &'static str, allowed: &str) -> Option<Given<T>> {
        let value = self.remove(key)?;
        let span = value.span();
        match T::deserialize(ValueDeserializer::from(value)) {
            Ok(value) => Some(Given { value, span }),
            Err(error) => {
                let place = error.span().filter(|place| !place.is_empty()).unwrap_or(span);
                let (message, remark) = self.mismatch(key, &place, error.message().trim_end());
                self.refuse(key, place, message, &format!("{allowed}{remark}"))
            }
        }
    }

    /// What is said of a value that does not fit, and a remark on what is allowed.
    ///
    /// * `error`: the reader's own words, which for other types are those of the program
    fn mismatch(&self, key: &str, place: &Range<usize>, error: &str) -> (String, &'static str) {
        let name = self.name(key);
        if !error.starts_with("invalid ") {
            let error = error.split(", expected").next().unwrap_or(error);
            return (format!("`{name}`: {}", error.replace("unknown variant", "unknown value")), "");
        }
        let written = self.document.written(place);
        let is_text = written.starts_with('"') && error.ends_with(['4', '8']);
        let remark = if is_text { ", without quotes and unit" } else { "" };
        (format!("`{name}` = {} is not possible", short(written)), remark)
    }

    /// A required value.
    pub fn require<T: DeserializeOwned>(&mut self, key: &'static str, allowed: &str) -> Option<Given<T>> {
        let given = self.get(key, allowed);
        self.need(key, given.is_some(), allowed);
        given
    }

    /// A number within bounds, if the key is there.
    pub fn number(&mut self, key: &'static str, bounds: Bounds) -> Option<Given<f64>> {
        let allowed = bounds.to_string();
        let given = self.get(key, &allowed)?;
        if bounds.contain(given.value) {
            return Some(given);
        }
        let message = format!("`{}` = {:?} is not possible", self.name(key), given.value);
        self.refuse(key, given.span, message, &allowed)
    }

    /// A whole number within bounds, if the key is there.
    pub fn count(&mut self, key: &'static str, range: RangeInclusive<u64>) -> Option<Given<u64>> {
        let allowed = format!("a whole number from {} to {}", range.start(), range.end());
        let given: Given<i64> = self.get(key, &allowed)?;
        match u64::try_from(given.value).ok().filter(|value| range.contains(value)) {
            Some(value) => Some(Given { value, span: given.span }),
            None => {
                let message = format!("`{}` = {} is not possible", self.name(key), given.value);
                self.refuse(key, given.span, message, &allowed)
            }
        }
    }

    /// Refuses the value of a key.
    ///
    /// * `allowed`: allowed values, for the message
    pub fn refuse<T>(
        &mut self,
        key: &'static str,
        span: Range<usize>,
        message: impl Into<String>,
        allowed: &str,
    ) -> Option<T> {
        self.mark_refused(key);
        self.problem(span, message, format!("allowed: {allowed}"));
        None
    }

    /// Notes that the value of a key was refused.
    pub fn mark_refused(&mut self, key: &'static str) {
        self.refused.push(key);
    }

    /// True if `key` is there but its value was refused.
    pub fn is_refused(&self, key: &str) -> bool {
        self.refused.contains(&key)
    }

    /// Notes that `key` is missing, unless it is there but refused.
    ///
    /// * `present`: whether a value has been read
    pub fn need(&self, key: &str, present: bool, meaning: &str) {
        if !present && !self.is_refused(key) {
            let name = self.name(key);
            self.problem(self.span(), format!("`{name}` is missing"), format!("add `{name}`: {meaning}"));
        }
    }

    /// Refuses the unread keys of the section.
    pub fn end(self) {
        let place =
            if self.path.is_empty() { "at the top level".into() } else { format!("in [{}]", self.path) };
        let help = format!("known {place}: {}", self.keys.join(", "));
        for (key, _) in &self.table {
            let name = self.name(key.get_ref());
            self.problem(key.span(), format!("unknown key `{}`", short(&name)), &help);
        }
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value.type_str() {
        name @ ("integer" | "array") => format!("an {name}"),
        name => format!("a {name}"),
    }
}

/// A table whose spans count from further on.
fn moved_table(table: DeTable<'_>, by: usize) -> DeTable<'_> {
    if by == 0 {
        return table;
    }
    table.into_iter().map(|(key, value)| (moved(key, by), moved_value(value, by))).collect()
}

fn moved_value(value: Spanned<DeValue<'_>>, by: usize) -> Spanned<DeValue<'_>> {
    let span = value.span();
    let value = match value.into_inner() {
        DeValue::Table(table) => DeValue::Table(moved_table(table, by)),
        DeValue::Array(list) => {
            DeValue::Array(list.into_iter().map(|value| moved_value(value, by)).collect())
        }
        other => other,
    };
    moved(Spanned::new(span, value), by)
}

fn moved<T>(given: Spanned<T>, by: usize) -> Spanned<T> {
    let span = given.span();
    Spanned::new(span.start + by..span.end + by, given.into_inner())
}

/// Puts the entries of `later` into `table`, table by table.
fn merge<'t>(table: &mut DeTable<'t>, later: DeTable<'t>) {
    for (key, value) in later {
        let name = key.get_ref().clone();
        let rest = match table.get_mut(name.as_ref()) {
            Some(earlier) => merge_value(earlier.get_mut(), value),
            None => Some(value),
        };
        if let Some(value) = rest {
            table.remove(name.as_ref());
            table.insert(key, value);
        }
    }
}

/// Puts a table into another one, or its entries, by their numbers from 1 on, into those of a list; any other value is returned.
fn merge_value<'t>(earlier: &mut DeValue<'t>, later: Spanned<DeValue<'t>>) -> Option<Spanned<DeValue<'t>>> {
    let span = later.span();
    match (earlier, later.into_inner()) {
        (DeValue::Table(table), DeValue::Table(more)) => merge(table, more),
        (DeValue::Array(list), DeValue::Table(more)) if more.keys().all(|key| place(list, key).is_some()) => {
            for (key, value) in more {
                let place = place(list, &key).and_then(|place| list.get_mut(place));
                let element = place.expect("all keys are numbers of elements");
                if let Some(value) = merge_value(element.get_mut(), value) {
                    *element = value;
                }
            }
        }
        (_, value) => return Some(Spanned::new(span, value)),
    }
    None
}

/// Place of the element of a list that a key names by its number.
fn place(list: &[Spanned<DeValue<'_>>], key: &Spanned<DeString<'_>>) -> Option<usize> {
    let place = key.get_ref().parse::<usize>().ok()?.checked_sub(1)?;
    (place < list.len()).then_some(place)
}
