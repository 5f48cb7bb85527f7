//! Problems of a case, each with its place in the text.

use std::ops::Range;

use miette::{Diagnostic, MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};
use percuss_output::text::{lines, printable, short};
use serde_json::json;

use crate::input::InputError;

/// All problems of a case.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("invalid case `{}`: {}", short(.name), count(.problems.len() + .more))]
pub struct CaseErrors {
    pub(super) name: String,
    /// The problems, in the order of the text.
    #[related]
    pub problems: Vec<Problem>,
    /// How many more there are.
    pub more: usize,
}

/// One problem of a case.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("{message}")]
pub struct Problem {
    /// The problem, with key and value.
    pub message: String,
    #[help]
    pub(super) help: Option<String>,
    #[source_code]
    pub(super) source_code: Option<Excerpt>,
    #[label("here")]
    pub(super) label: Option<SourceSpan>,
}

/// The lines around a place of a text, as they may be shown.
#[derive(Debug)]
pub(super) struct Excerpt {
    name: String,
    text: String,
    /// Number of its first line, from 0 on, and of bytes before it on that line.
    first: (usize, usize),
}

/// Longest part of a text that is shown around a place, on either side, and of the place itself \[bytes\].
const LONGEST: usize = 200;

impl Excerpt {
    /// The lines around a span of a text, one before and one after it, and the span in them.
    pub(super) fn of(name: &str, text: &str, span: Range<usize>) -> (Self, SourceSpan) {
        let start = text.floor_char_boundary(span.start.min(text.len()));
        let end = text.floor_char_boundary(span.end.clamp(start, start + LONGEST));
        let line_before = |place: usize| text[..place].rfind('\n').unwrap_or_default();
        let line_after = |place: usize| text[place..].find('\n').map_or(text.len(), |length| place + length);
        let line_start = line_before(start);
        let first = match line_before(line_start) {
            0 => 0,
            newline => newline + 1,
        };
        let behind = |place: usize| (line_after(place) + 1).min(text.len());
        let last = behind(behind(end));
        let from = text.ceil_char_boundary(first.max(start.saturating_sub(LONGEST)));
        let to = text.floor_char_boundary(last.min(end + LONGEST));
        let (line, column) = text[..from]
            .rsplit_once('\n')
            .map_or((0, from), |(before, cut)| (before.matches('\n').count() + 1, cut.len()));
        let shown = |part: &str| lines(&part.replace("\r\n", "\n")).into_owned();
        let (before, label) = (shown(&text[from..start]), shown(&text[start..end]));
        let span = (before.len(), label.len()).into();
        let text = before + &label + &shown(&text[end..to]);
        (Self { name: printable(name).into_owned(), text, first: (line, column) }, span)
    }
}

impl SourceCode for Excerpt {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        before: usize,
        after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let found = self.text.read_span(span, before, after)?;
        let (line, column) = self.first;
        let column = if found.line() == 0 { found.column() + column } else { found.column() };
        let (data, span, lines) = (found.data(), *found.span(), found.line_count());
        let contents =
            MietteSpanContents::new_named(self.name.clone(), data, span, line + found.line(), column, lines);
        Ok(Box::new(contents.with_language("TOML")))
    }
}

/// True if a name is as alike a known one as a slip of the fingers leaves it.
pub(super) fn is_alike(known: &str, name: &str) -> bool {
    /// Longest name that is compared \[bytes\].
    const COMPARED: usize = 64;
    name.len() <= COMPARED && strsim::damerau_levenshtein(known, name) <= 1 + name.len() / 8
}

fn count(n: usize) -> String {
    if n == 1 { "1 problem".into() } else { format!("{n} problems") }
}

impl CaseErrors {
    fn single(name: &str, message: String, help: String) -> Self {
        let problem = Problem { message, help: Some(help), source_code: None, label: None };
        Self { name: name.into(), problems: vec![problem], more: 0 }
    }

    /// The problems with their places, for programs.
    pub fn json(&self) -> serde_json::Value {
        let problem = |problem: &Problem| {
            let place = problem.source_code.as_ref().zip(problem.label.as_ref()).and_then(|(text, label)| {
                let place = text.read_span(label, 0, 0).ok()?;
                Some(json!({ "text": text.name, "line": place.line() + 1, "column": place.column() + 1 }))
            });
            json!({ "message": problem.message, "help": problem.help, "place": place })
        };
        let problems: Vec<_> = self.problems.iter().map(problem).collect();
        json!({ "problems": problems, "more": self.more })
    }

    /// The file cannot be read.
    pub(super) fn unreadable(name: &str, error: &InputError) -> Self {
        let shown = short(name);
        if !matches!(error, InputError::System(_)) {
            let help = match error {
                InputError::Recording => {
                    "percuss-read reads recordings; `percuss-read export RECORDING --attachment case.toml` \
                                          writes the case that one was computed of"
                }
                _ => "CASE is the path of a TOML file or the name of a built-in case, see `percuss cases`",
            };
            return Self::single(name, format!("`{shown}` {error}"), help.into());
        }
        let names: Vec<&str> = super::builtin::names().collect();
        let alike = names.iter().filter(|known| is_alike(known, name));
        let meant = alike.map(|known| format!("`{known}`")).collect::<Vec<_>>();
        let meant =
            if meant.is_empty() { String::new() } else { format!("did you mean {}? ", meant.join(" or ")) };
        let help = format!(
            "{meant}CASE is the path of a TOML file or one of the built-in cases: {}",
            names.join(", ")
        );
        Self::single(name, format!("`{shown}` is no built-in case, and as a file: {error}"), help)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line, column and text of a place as it is shown, with a line before and after it.
    fn shown(text: &str, span: Range<usize>) -> (usize, usize, String) {
        let (excerpt, span) = Excerpt::of("case.toml", text, span);
        let place = excerpt.read_span(&span, 0, 0).expect("a place");
        let around = excerpt.read_span(&span, 1, 1).expect("a place");
        let around = str::from_utf8(around.data()).expect("a text").to_owned();
        assert!(excerpt.text.len() < 6 * LONGEST, "{}", excerpt.text.len());
        (place.line(), place.column(), around)
    }

    #[test]
    fn an_excerpt_is_short_and_knows_its_place() {
        let text = "a = 1\nb = 2\nc = 3\nd = 4\n";
        assert_eq!(shown(text, 12..13), (2, 0, "b = 2\nc = 3\nd = 4\n".into()));
        assert_eq!(shown(text, 0..1), (0, 0, "a = 1\nb = 2\n".into()));
        assert_eq!(shown(text, 400..500).0, 4);
        assert_eq!(shown(&text.replace('\n', "\r\n"), 14..15), (2, 0, "b = 2\nc = 3\nd = 4\n".into()));
        // one line of a megabyte
        let long = format!("x = 1\ny = \"{}\"\n", "γ".repeat(500_000));
        let (line, column, _) = shown(&long, 600_001..900_000);
        assert_eq!((line, column), (1, 600_001 - 6));
        let (line, column, around) = shown("a\n#\u{1b}[2J\u{202e}\nkey\u{7}=1", 11..14);
        assert_eq!((line, column, &*around), (2, 0, "#\\u{1b}[2J\\u{202e}\nkey\\u{7}=1"));
    }
}
