//! What is asked for, as arguments and sweep files say it.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{
    SweepError, measure,
    spec::{Combine, Vary},
};
use crate::input::read_text;

/// Which recordings are kept.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Keep {
    #[default]
    All,
    /// None: the summary is what stays.
    None,
    /// That of the case with the largest value of a measure.
    Worst(String),
}

impl From<Keep> for String {
    fn from(keep: Keep) -> Self {
        match keep {
            Keep::All => "all".into(),
            Keep::None => "none".into(),
            Keep::Worst(measure) => format!("worst:{measure}"),
        }
    }
}

impl TryFrom<String> for Keep {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        match text.split_once(':') {
            None if text == "all" => Ok(Self::All),
            None if text == "none" => Ok(Self::None),
            Some(("worst", measure)) if measure::is_name(measure) => Ok(Self::Worst(measure.into())),
            Some(("worst", measure)) => {
                Err(format!("`{measure}` is no measure; known: {}", measure::names([1; 2]).join(", ")))
            }
            _ => Err(format!("`{text}` is not possible: all, none or worst:MEASURE")),
        }
    }
}

/// What is asked for, as `sweep.toml` has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// A built-in case or a file, which relative paths are seen from the folder of this file; where there is a text, its name in messages.
    pub case: String,
    /// Text of the case, once its file has been read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// Folder of relative paths in the text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub folder: Option<PathBuf>,
    /// Keys that are set in all cases, `key=value`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// Which recordings are kept.
    #[serde(default)]
    pub keep: Keep,
    #[serde(default)]
    pub combine: Combine,
    pub vary: Vec<Vary>,
}

impl Request {
    /// Reads a sweep file, `None` if the file is none: it has no `vary`.
    pub fn read(path: &Path) -> Result<Option<Self>, SweepError> {
        let fail = SweepError::unread(path);
        let text = read_text(path).map_err(|error| fail(error.to_string()))?;
        let wrong = |error: toml::de::Error| {
            let before = &text[..error.span().unwrap_or_default().start];
            let line = before.matches('\n').count() + 1;
            let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
            fail(format!("line {line}, column {column}: {}", error.message()))
        };
        let table: toml::Table = text.parse().map_err(wrong)?;
        if !table.contains_key("vary") {
            return Ok(None);
        }
        toml::from_str(&text).map(Some).map_err(wrong)
    }
}
