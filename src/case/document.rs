//! TOML text with spans: where every value stands, and every problem with it.
//!
//! A document is the text of a case file and, behind it, the texts of the overrides; offsets count through all of
//! them, so that a problem can be shown where its value was written.

use std::{fmt, ops::Range, sync::Arc};

use miette::{Diagnostic, NamedSource, SourceSpan};
use serde::de::DeserializeOwned;
use toml::{
    Spanned,
    de::{DeTable, DeValue, ValueDeserializer},
};

/// All problems of a case.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("invalid case `{name}`: {}", count(.problems.len()))]
pub struct CaseErrors {
    name: String,
    /// The problems, in the order of the text.
    #[related]
    pub problems: Vec<Problem>,
}

/// One problem of a case.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{message}")]
pub struct Problem {
    /// What is wrong, naming key and value.
    pub message: String,
    #[help]
    help: Option<String>,
    #[source_code]
    source_code: Option<NamedSource<Arc<str>>>,
    #[label("here")]
    label: Option<SourceSpan>,
}

fn count(n: usize) -> String {
    if n == 1 { "1 problem".into() } else { format!("{n} problems") }
}

impl CaseErrors {
    fn single(name: &str, message: String, help: String) -> Self {
        let problem = Problem { message, help: Some(help), source_code: None, label: None };
        Self { name: name.into(), problems: vec![problem] }
    }

    /// The file cannot be read.
    pub(super) fn unreadable(name: &str, error: &std::io::Error) -> Self {
        let names: Vec<&str> = super::builtin::names().collect();
        let help =
            format!("CASE is the path of a TOML file or one of the built-in cases: {}", names.join(", "));
        Self::single(name, format!("`{name}` is no built-in case, and as a file: {error}"), help)
    }

    /// The file is not text.
    pub(super) fn not_utf8(name: &str, error: &std::string::FromUtf8Error) -> Self {
        let place = error.utf8_error().valid_up_to();
        let before = &error.as_bytes()[..place];
        let line = before.iter().filter(|&&byte| byte == b'\n').count() + 1;
        let byte = error.as_bytes().get(place).copied().unwrap_or_default();
        let message = format!("line {line}: byte 0x{byte:02x} is not valid UTF-8");
        Self::single(name, message, "save the case file as UTF-8 text".into())
    }
}

/// A value and where it stands.
#[derive(Clone, Debug)]
pub struct Given<T> {
    pub value: T,
    pub span: Range<usize>,
}

/// The texts a case is read from: the case file, then one for each override.
pub struct Sources(Vec<Source>);

struct Source {
    name: String,
    text: Arc<str>,
    start: usize,
}

impl Sources {
    /// Takes a case file and overrides `key=value`; an override whose value is no TOML is taken as a string.
    pub fn new(name: &str, text: &str, overrides: &[String]) -> Self {
        // an editor's byte order mark is no part of the text
        let text = text.strip_prefix('\u{feff}').unwrap_or(text).to_owned();
        let mut sources = Self(Vec::new());
        sources.push(name, text);
        for given in overrides {
            let text = match given.split_once('=') {
                Some((key, value)) if DeTable::parse(given).is_err() => {
                    format!("{key}={}", toml::Value::String(value.trim().into()))
                }
                _ => given.clone(),
            };
            sources.push("--set", text);
        }
        sources
    }

    fn push(&mut self, name: &str, text: String) {
        let start = self.0.last().map_or(0, |s| s.start + s.text.len() + 1);
        self.0.push(Source { name: name.into(), text: text.into(), start });
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
                document.problem(shift(error.span().unwrap_or_default(), source.start), message, None);
            }
            merge(&mut root, shift_table(table.into_inner(), source.start));
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
        let source =
            self.sources.0.iter().rev().find(|s| s.start <= span.start).filter(|s| !s.text.trim().is_empty());
        let Some(source) = source else {
            return Problem { message, help, source_code: None, label: None };
        };
        let start = (span.start - source.start).min(source.text.len());
        let end = (span.end - source.start).clamp(start, source.text.len());
        let source_code = NamedSource::new(&source.name, source.text.clone()).with_language("TOML");
        Problem { message, help, source_code: Some(source_code), label: Some((start..end).into()) }
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

/// Bounds of a number; never NaN.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    low: f64,
    high: f64,
    low_open: bool,
    high_open: bool,
    or_infinite: bool,
}

impl Bounds {
    /// `low < x ≤ high`
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, high, low_open: true, high_open: false, or_infinite: false }
    }

    /// `low < x < high`
    pub const fn between(low: f64, high: f64) -> Self {
        Self { high_open: true, ..Self::above(low, high) }
    }

    /// `low ≤ x ≤ high`
    pub const fn within(low: f64, high: f64) -> Self {
        Self { low_open: false, ..Self::above(low, high) }
    }

    /// Also infinity.
    pub const fn or_infinite(self) -> Self {
        Self { or_infinite: true, ..self }
    }

    /// True if `x` is allowed.
    pub fn contain(&self, x: f64) -> bool {
        (self.or_infinite && x == f64::INFINITY)
            || ((if self.low_open { x > self.low } else { x >= self.low })
                && (if self.high_open { x < self.high } else { x <= self.high }))
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (low, high) = (if self.low_open { ">" } else { "≥" }, if self.high_open { "<" } else { "≤" });
        write!(f, "a number {low} {} and {high} {}", self.low, self.high)?;
        if self.or_infinite { write!(f, ", or inf") } else { Ok(()) }
    }
}

fn describe(value: &DeValue<'_>) -> String {
    match value.type_str() {
        name @ ("integer" | "array") => format!("an {name}"),
        name => format!("a {name}"),
    }
}

fn shift(span: Range<usize>, by: usize) -> Range<usize> {
    span.start + by..span.end + by
}

/// Makes the spans of a table count from the start of all texts.
fn shift_table(table: DeTable<'_>, by: usize) -> DeTable<'_> {
    let entries = table.into_iter().map(|(key, value)| {
        let span = shift(key.span(), by);
        (Spanned::new(span, key.into_inner()), shift_value(value, by))
    });
    entries.collect()
}

fn shift_value(value: Spanned<DeValue<'_>>, by: usize) -> Spanned<DeValue<'_>> {
    let span = shift(value.span(), by);
    let value = match value.into_inner() {
        DeValue::Table(table) => DeValue::Table(shift_table(table, by)),
        DeValue::Array(array) => {
            DeValue::Array(array.into_iter().map(|item| shift_value(item, by)).collect())
        }
        scalar => scalar,
    };
    Spanned::new(span, value)
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
