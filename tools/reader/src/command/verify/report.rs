//! What verifying found, for people and for scripts.

use serde::Serialize;
use serde_json::{Value, json};

use crate::text::printable;

/// Version of the JSON form.
pub const JSON_VERSION: u32 = 1;

/// Problems that are reported one by one.
const MAX_LISTED: usize = 200;

/// Something that is wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// Where \[bytes from the start of the file\].
    pub offset: u64,
    /// What.
    pub text: String,
}

/// What verifying found.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Report {
    /// What is wrong.
    pub problems: Vec<Problem>,
    /// Problems beyond those that are listed.
    #[serde(rename = "more_problems")]
    pub unlisted: u64,
    /// What is unusual but allowed.
    pub remarks: Vec<String>,
    /// Of the problems, those of messages that cannot be decoded.
    pub undecoded: u64,
    /// Messages.
    pub messages: u64,
    /// Chunks.
    pub chunks: u64,
    /// True for a sound recording of percuss that did not come to its planned end.
    pub partial: bool,
}

impl Report {
    /// True if nothing is wrong.
    pub fn is_sound(&self) -> bool {
        self.problems.is_empty()
    }

    /// True if nothing is wrong but messages that cannot be decoded.
    pub fn is_undecoded_only(&self) -> bool {
        self.undecoded > 0 && self.problems.len() as u64 + self.unlisted == self.undecoded
    }

    pub(super) fn problem(&mut self, offset: u64, text: impl Into<String>) {
        if self.problems.len() < MAX_LISTED {
            self.problems.push(Problem { offset, text: text.into() });
        } else {
            self.unlisted += 1;
        }
    }

    /// The report for people.
    pub fn to_text(&self, name: &str) -> String {
        let state = match (self.is_sound(), self.partial) {
            (true, false) => "sound",
            (true, true) => "sound, but PARTIAL: the run did not come to its planned end",
            (false, _) => "NOT SOUND",
        };
        let name = printable(name);
        let mut text = format!("{name}: {state}; {} messages in {} chunks\n", self.messages, self.chunks);
        for problem in &self.problems {
            text.push_str(&format!("  at byte {}: {}\n", problem.offset, printable(&problem.text)));
        }
        if self.unlisted > 0 {
            text.push_str(&format!("  … and {} more\n", self.unlisted));
        }
        for remark in &self.remarks {
            text.push_str(&format!("  remark: {}\n", printable(remark)));
        }
        text
    }

    /// The report for scripts.
    pub fn to_json(&self, name: &str) -> Value {
        let mut value = json!(self);
        value["version"] = JSON_VERSION.into();
        value["file"] = name.into();
        value["sound"] = self.is_sound().into();
        value
    }
}
