//! Problems of a case, each with its place in the text.

use std::sync::Arc;

use miette::{Diagnostic, NamedSource, SourceSpan};

/// All problems of a case.
#[derive(Debug, thiserror::Error, Diagnostic)]
#[error("invalid case `{name}`: {}", count(.problems.len()))]
pub struct CaseErrors {
    pub(super) name: String,
    /// The problems, in the order of the text.
    #[related]
    pub problems: Vec<Problem>,
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
    pub(super) source_code: Option<NamedSource<Arc<str>>>,
    #[label("here")]
    pub(super) label: Option<SourceSpan>,
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
        // as alike as one slip of the fingers leaves them
        let alike = |known: &&&str| strsim::damerau_levenshtein(known, name) <= 1 + name.len() / 8;
        let meant = names.iter().filter(alike).map(|known| format!("`{known}`")).collect::<Vec<_>>();
        let meant =
            if meant.is_empty() { String::new() } else { format!("did you mean {}? ", meant.join(" or ")) };
        let help = format!(
            "{meant}CASE is the path of a TOML file or one of the built-in cases: {}",
            names.join(", ")
        );
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
