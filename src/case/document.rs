//! TOML text with spans: where every value stands, and every problem with it.
//!
//! A document is the text of a case file and, behind it, the settings; offsets count through all of them, so that a problem
//! is shown where its value was written.

use std::{ops::Range, sync::Arc};

use miette::NamedSource;
use serde::de::DeserializeOwned;
use toml::{
    Spanned,
    de::{DeTable, DeValue, ValueDeserializer},
};

use super::{CaseBuilder, CaseErrors, Problem, bounds::Bounds};

/// A value and where it stands.
#[derive(Clone, Debug)]
pub struct Given<T> {
    pub value: T,
    pub span: Range<usize>,
}

/// The texts a case is read from: the case file, then one for each setting.
pub struct Sources(Vec<Source>);

struct Source {
    name: String,
    /// The text behind as many blanks as all texts before it are long, so that its spans count through all of them.
    text: String,
    start: usize,
}

impl Sources {
    /// The texts of a case; a setting whose value is no TOML is taken as a string.
    pub fn new(given: &CaseBuilder) -> Self {
        let mut sources = Self(Vec::new());
        // an editor's byte order mark is no part of the text
        sources.push(&given.name, given.text.strip_prefix('\u{feff}').unwrap_or(&given.text));
        for setting in &given.settings {
            match setting.split_once('=') {
                Some((key, value)) if DeTable::parse(setting).is_err() => {
                    sources.push("--set", &format!("{key}={}", toml::Value::String(value.trim().into())));
                }
                _ => sources.push("--set", setting),
            }
        }
        sources
    }

    fn push(&mut self, name: &str, text: &str) {
        let start = self.0.last().map_or(0, |last| last.text.len() + 1);
        self.0.push(Source { name: name.into(), text: format!("{:start$}{text}", ""), start });
    }
}

/// A parsed document and the problems found in it so far.
pub struct Document<'t> {
    sources: &'t Sources,
    problems: Vec<(Range<usize>, String, Option<String>)>,
}

impl<'t> Document<'t> {
    /// Parses the texts; the root section holds what could be understood, later texts winning over earlier ones.
    pub fn parse(sources: &'t Sources) -> (Self, Section<'t>) {
        let mut document = Self { sources, problems: Vec::new() };
        let mut root = DeTable::new();
        for source in &sources.0 {
            let (table, errors) = DeTable::parse_recoverable(&source.text);
            for error in errors {
                let message = error.message().trim_end().to_owned();
                document.problem(error.span().unwrap_or(source.start..source.start), message, None);
            }
            merge(&mut root, table.into_inner());
        }
        (
            document,
            Section { path: String::new(), table: root, span: 0..0, keys: Vec::new(), refused: Vec::new() },
        )
    }

    /// Notes a problem.
    pub fn problem(&mut self, span: Range<usize>, message: String, help: Option<String>) {
        self.problems.push((span, message, help));
    }

    /// True if there are no problems so far.
    pub fn is_sound(&self) -> bool {
        self.problems.is_empty()
    }

    /// Ends reading: `value`, or all problems in the order of the text.
    pub fn finish<T>(mut self, value: Option<T>) -> Result<T, CaseErrors> {
        match value {
            Some(value) if self.problems.is_empty() => Ok(value),
            _ => {
                self.problems.sort_by_key(|(span, ..)| span.start);
                let problems = std::mem::take(&mut self.problems);
                let problems = problems.into_iter().map(|problem| self.locate(problem)).collect();
                Err(CaseErrors { name: self.sources.0[0].name.clone(), problems })
            }
        }
    }

    fn locate(&self, (span, message, help): (Range<usize>, String, Option<String>)) -> Problem {
        let source = self.sources.0.iter().rev().find(|source| source.start <= span.start);
        let place = source.filter(|source| !source.text.trim().is_empty()).map(|source| {
            let text = &source.text[source.start..];
            let start = (span.start - source.start).min(text.len());
            let end = (span.end - source.start).clamp(start, text.len());
            (NamedSource::new(&source.name, Arc::from(text)).with_language("TOML"), (start..end).into())
        });
        let (source_code, label) = place.unzip();
        Problem { message, help, source_code, label }
    }
}

/// A table of the document, read key by key.
pub struct Section<'t> {
    path: String,
    table: DeTable<'t>,
    span: Range<usize>,
    keys: Vec<&'static str>,
    /// Keys whose values were refused.
    refused: Vec<&'static str>,
}

impl<'t> Section<'t> {
    /// Where the section stands.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// Full name of a key.
    pub fn name(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }

    fn remove(&mut self, key: &'static str) -> Option<Spanned<DeValue<'t>>> {
        self.keys.push(key);
        self.table.remove(key)
    }

    /// A sub-table; an empty one if it is missing.
    pub fn section(&mut self, document: &mut Document<'t>, key: &'static str) -> Section<'t> {
        let path = self.name(key);
        let (keys, refused) = (Vec::new(), Vec::new());
        match self.remove(key).map(|value| (value.span(), value.into_inner())) {
            Some((span, DeValue::Table(table))) => Section { path, table, span, keys, refused },
            Some((span, other)) => {
                let message = format!("`{path}` is {}, it must be a table", describe(&other));
                document.problem(span.clone(), message, Some(format!("write it as [{path}]")));
                Section { path, table: DeTable::new(), span, keys, refused }
            }
            None => Section { path, table: DeTable::new(), span: self.span(), keys, refused },
        }
    }

    /// A value, if the key is there and the value fits.
    ///
    /// * `allowed`: what to write, for the message
    pub fn get<T: DeserializeOwned>(
        &mut self,
        document: &mut Document<'t>,
        key: &'static str,
        allowed: &str,
    ) -> Option<Given<T>> {
        let value = self.remove(key)?;
        let span = value.span();
        match T::deserialize(ValueDeserializer::from(value)) {
            Ok(value) => Some(Given { value, span }),
            Err(error) => {
                let place = error.span().filter(|place| !place.is_empty()).unwrap_or(span);
                let message = format!("`{}`: {}", self.name(key), error.message().trim_end());
                self.refuse(document, key, place, message, allowed)
            }
        }
    }

    /// A value that must be there.
    pub fn require<T: DeserializeOwned>(
        &mut self,
        document: &mut Document<'t>,
        key: &'static str,
        allowed: &str,
    ) -> Option<Given<T>> {
        let given = self.get(document, key, allowed);
        self.need(document, key, given.is_some(), allowed);
        given
    }

    /// A number within bounds, if the key is there.
    pub fn number(
        &mut self,
        document: &mut Document<'t>,
        key: &'static str,
        bounds: Bounds,
    ) -> Option<Given<f64>> {
        let given = self.get(document, key, &bounds.to_string())?;
        self.check(document, key, given, bounds)
    }

    /// A number within bounds that must be there.
    pub fn require_number(
        &mut self,
        document: &mut Document<'t>,
        key: &'static str,
        bounds: Bounds,
    ) -> Option<Given<f64>> {
        let given = self.require(document, key, &bounds.to_string())?;
        self.check(document, key, given, bounds)
    }

    /// A whole number within bounds, if the key is there.
    pub fn count(
        &mut self,
        document: &mut Document<'t>,
        key: &'static str,
        range: std::ops::RangeInclusive<u64>,
    ) -> Option<Given<u64>> {
        let allowed = format!("a whole number from {} to {}", range.start(), range.end());
        let given: Given<i64> = self.get(document, key, &allowed)?;
        match u64::try_from(given.value).ok().filter(|value| range.contains(value)) {
            Some(value) => Some(Given { value, span: given.span }),
            None => {
                let message = format!("`{}` = {} is not possible", self.name(key), given.value);
                self.refuse(document, key, given.span, message, &allowed)
            }
        }
    }

    fn check(
        &mut self,
        document: &mut Document<'t>,
        key: &'static str,
        given: Given<f64>,
        bounds: Bounds,
    ) -> Option<Given<f64>> {
        if bounds.contain(given.value) {
            return Some(given);
        }
        let message = format!("`{}` = {:?} is not possible", self.name(key), given.value);
        self.refuse(document, key, given.span, message, &bounds.to_string())
    }

    fn refuse<T>(
        &mut self,
        document: &mut Document<'t>,
        key: &'static str,
        span: Range<usize>,
        message: String,
        allowed: &str,
    ) -> Option<T> {
        self.refused.push(key);
        document.problem(span, message, Some(format!("allowed: {allowed}")));
        None
    }

    /// True if `key` is there but its value was refused.
    pub fn is_refused(&self, key: &str) -> bool {
        self.refused.contains(&key)
    }

    /// Notes that `key` is missing, unless it is there but wrong, which has been said already.
    ///
    /// * `present`: whether a value has been read
    pub fn need(&self, document: &mut Document<'t>, key: &str, present: bool, meaning: &str) {
        if !present && !self.is_refused(key) {
            let name = self.name(key);
            let help = format!("add `{name}`: {meaning}");
            document.problem(self.span(), format!("`{name}` is missing"), Some(help));
        }
    }

    /// Refuses what is left in the section.
    pub fn end(self, document: &mut Document<'t>) {
        for (key, _) in &self.table {
            let name = self.name(key.get_ref());
            let place =
                if self.path.is_empty() { "at the top level".into() } else { format!("in [{}]", self.path) };
            let help = format!("known {place}: {}", self.keys.join(", "));
            document.problem(key.span(), format!("unknown key `{name}`"), Some(help));
        }
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value.type_str() {
        name @ ("integer" | "array") => format!("an {name}"),
        name => format!("a {name}"),
    }
}

/// Puts the entries of `later` into `table`, table by table.
fn merge<'t>(table: &mut DeTable<'t>, later: DeTable<'t>) {
    for (key, value) in later {
        let name = key.get_ref().clone();
        match (table.get_mut(name.as_ref()).map(Spanned::get_mut), value.get_ref()) {
            (Some(DeValue::Table(inner)), DeValue::Table(_)) => {
                if let DeValue::Table(more) = value.into_inner() {
                    merge(inner, more);
                }
            }
            _ => {
                table.remove(name.as_ref());
                table.insert(key, value);
            }
        }
    }
}
