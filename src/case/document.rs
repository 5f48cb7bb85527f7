//! TOML text with spans: the place of every value, and of every problem.
//!
//! A document is the text of a case file and, behind it, the settings; offsets count through all of them, so that a problem
//! is shown where its value was written.

use std::{cell::RefCell, ops::Range};

use percuss_output::text::{clipped, short};
use toml::{
    Spanned,
    de::{DeString, DeTable, DeValue},
};

use super::{
    CaseBuilder, CaseErrors, Problem,
    errors::Excerpt,
    keys::{FORCE_ROWS, GRADED, LOAD},
};

/// Place in all texts together.
pub type Span = Range<usize>;

/// Problems that are kept: the first of a text. Of the others there is a count.
const MOST_PROBLEMS: usize = 50;

/// Characters of a problem and of its help that are kept: a value may be of any length.
const LONGEST_MESSAGE: usize = 400;
const LONGEST_HELP: usize = 2000;

/// The texts a case is read from, the case file and one for each setting, and the problems found in them so far.
#[derive(Default)]
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
    /// As many spaces as there are bytes in all texts before it, and the text: places in it are places in all texts together.
    text: String,
    /// Place of the text.
    start: usize,
}

impl Document {
    /// The texts of a case; a setting whose value is no TOML is taken as a string.
    pub fn new(given: &CaseBuilder) -> Self {
        let mut document = Self::default();
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
        let start = self.sources.last().map_or(0, |last| last.text.len() + 1);
        self.sources.push(Source { name: name.into(), text: " ".repeat(start) + text, start });
    }

    /// The contents of all texts, where later ones override earlier ones.
    ///
    /// # Errors
    ///
    /// The first syntax error, alone: after it the rest cannot be parsed reliably.
    pub fn root(&self) -> Result<DeTable<'_>, CaseErrors> {
        let mut table = DeTable::new();
        for source in &self.sources {
            let (part, errors) = DeTable::parse_recoverable(&source.text);
            for error in errors {
                let span = error.span().unwrap_or(source.start..source.start);
                let message = error.message().trim_end();
                if message != "duplicate key" {
                    let note = Note { span, message: clipped(message, LONGEST_MESSAGE).into(), help: None };
                    self.problems.replace(Notes { first: vec![note], more: 0 });
                    return self.finish(None);
                }
                let message = format!("`{}` is given twice", short(self.written(&span)));
                self.problem(span, message, "keep one of them");
            }
            let part = part.into_inner();
            replace(&mut table, &part);
            merge(&mut table, part, &source.text);
        }
        Ok(table)
    }

    /// The text at a place.
    pub fn written(&self, span: &Range<usize>) -> &str {
        self.source(span).and_then(|source| source.text.get(span.clone())).unwrap_or_default()
    }

    fn source(&self, span: &Span) -> Option<&Source> {
        self.sources.iter().rev().find(|source| source.start <= span.start)
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
        let source = self.source(&span).filter(|source| !source.text.trim().is_empty());
        let excerpt = |Source { name, text, start }: &Source| {
            Excerpt::of(name, &text[*start..], span.start - start..span.end - start)
        };
        let (source_code, label) = source.map(excerpt).unzip();
        Problem { message, help, source_code, label }
    }
}

pub(super) fn text<'a>(table: &'a DeTable<'_>, key: &str) -> Option<&'a str> {
    table.get(key)?.get_ref().as_str()
}

pub(super) fn table<'a, 't>(table: &'a DeTable<'t>, key: &str) -> Option<&'a DeTable<'t>> {
    table.get(key)?.get_ref().as_table()
}

pub(super) fn table_mut<'a, 't>(table: &'a mut DeTable<'t>, key: &str) -> Option<&'a mut DeTable<'t>> {
    match table.get_mut(key)?.get_mut() {
        DeValue::Table(inner) => Some(inner),
        _ => None,
    }
}

/// Keys whose place another key takes if a later text has it: its section, it, and they.
///
/// * `shape`: of the indenter
fn replaced(shape: &str) -> [(&'static str, &'static str, &'static [&'static str]); 6] {
    // a ball of another diameter is a whole one
    let size: &[&str] = if shape == "sphere" { &["nose_radius", "radius"] } else { &["radius"] };
    [
        ("mesh", "cells", &GRADED),
        ("mesh", GRADED[0], &["cells"]),
        ("impact", "velocity", &["drop"]),
        ("impact", "drop", &["velocity"]),
        ("indenter", "diameter", size),
        ("indenter", size[0], &["diameter"]),
    ]
}

/// Takes out of `earlier` what `later` says in another way.
fn replace(earlier: &mut DeTable<'_>, later: &DeTable<'_>) {
    let other_force = |force: &DeTable<'_>| FORCE_ROWS.iter().any(|key| force.contains_key(*key));
    if table(later, LOAD).and_then(|load| table(load, "force")).is_some_and(other_force)
        && let Some(load) = table_mut(earlier, LOAD)
    {
        load.remove("force");
    }
    let shape = |root| text(table(root, "indenter")?, "shape");
    let shape = shape(later).or_else(|| shape(earlier)).unwrap_or_default().to_owned();
    for (name, key, others) in replaced(&shape) {
        let Some(later) = table(later, name).filter(|later| later.contains_key(key)) else { continue };
        let Some(earlier) = table_mut(earlier, name) else { continue };
        for other in others.iter().filter(|other| !later.contains_key(**other)) {
            earlier.remove(*other);
        }
    }
}

/// Puts the entries of `later` into `table`, table by table; a material or a body that is given whole, `{…}`, takes the place of an earlier one.
///
/// * `text`: that `later` is from
fn merge<'t>(table: &mut DeTable<'t>, later: DeTable<'t>, text: &str) {
    for (key, value) in later {
        let name = key.get_ref().clone();
        let is_whole = matches!(name.as_ref(), "material" | "body") && text[value.span()].starts_with('{');
        let rest = match table.get_mut(name.as_ref()).filter(|_| !is_whole) {
            Some(earlier) => merge_value(earlier.get_mut(), value, text),
            None => Some(value),
        };
        if let Some(value) = rest {
            table.remove(name.as_ref());
            table.insert(key, value);
        }
    }
}

/// Puts a table into another one, or its entries, by their numbers from 1 on, into those of a list; any other value is returned.
fn merge_value<'t>(
    earlier: &mut DeValue<'t>,
    later: Spanned<DeValue<'t>>,
    text: &str,
) -> Option<Spanned<DeValue<'t>>> {
    let span = later.span();
    match (earlier, later.into_inner()) {
        (DeValue::Table(table), DeValue::Table(more)) => merge(table, more, text),
        (DeValue::Array(list), DeValue::Table(more)) if more.keys().all(|key| place(list, key).is_some()) => {
            for (key, value) in more {
                let place = place(list, &key).and_then(|place| list.get_mut(place));
                let element = place.expect("all keys are numbers of elements");
                if let Some(value) = merge_value(element.get_mut(), value, text) {
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
