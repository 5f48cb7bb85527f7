//! `verify`: everything in a recording that can be checked against something else in it.

mod content;

use std::{path::PathBuf, sync::Arc};

use clap::Args;
use percuss_table::measures::Measure;
use serde::Serialize;
use serde_json::{Value, json};

use crate::{
    command::summary::measures,
    convention::{
        CASE, DRAG, Ending, MEASURES, RECORDS, RECOVERED, RESOLVED_CASE, RUN, STATUS, VALIDITY, VELOCITY,
        required_topics,
    },
    failure::Failure,
    recording::{Damage, Limits, Scan},
    text::{printable, short},
    verb::{Exit, Verb, if_read, show},
};

pub(super) use content::Content;

const VERIFY_EXAMPLES: &str = "\
Every checksum, the index against the data, the schemas, every message against its schema, the order of times, the \
counts; of percuss recordings also that everything is there that a run records, or that the closed form knows.

Examples:
  percuss-read verify fig5.mcap
  percuss-read verify --json *.mcap

Exit status: 0 sound, 1 not sound, 2 usage, 3 sound, but messages cannot be decoded, or the run did not come to its planned \
end.";

/// Whether a recording is sound: checksums, index, schemas, counts
#[derive(Debug, Args)]
#[command(after_help = VERIFY_EXAMPLES)]
pub struct Verify {
    /// Recordings
    #[arg(required = true)]
    pub(crate) files: Vec<PathBuf>,
    /// Print JSON, one document per recording and line
    #[arg(long)]
    json: bool,
}

impl Verb for Verify {
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        let mut exit = Exit::Done;
        for file in &self.files {
            let report = verify_scan(Scan::open(file, limits)?, limits)?;
            let name = file.to_string_lossy();
            let text = if self.json { format!("{}\n", report.to_json(&name)) } else { report.to_text(&name) };
            if_read(show(&text, self.json))?;
            exit =
                match (report.is_sound() || report.is_undecoded_only(), report.partial || !report.is_sound())
                {
                    (false, _) => Exit::No,
                    (true, true) if exit == Exit::Done => Exit::Loss,
                    (true, _) => exit,
                };
        }
        Ok(exit)
    }
}

/// Verifies what a scan reads.
///
/// # Errors
///
/// The source cannot be read.
pub fn verify_scan(mut scan: Scan, limits: Limits) -> Result<Report, Failure> {
    let index = Arc::clone(scan.index());
    let mut content = Content::new(limits, &index);
    scan.for_each(|found| content.take(found, None))?;
    Ok(conclude(content, scan.damages()))
}

/// What is wrong with a file, once all of its records have been taken.
///
/// * `damages`: what could not be read
pub(super) fn conclude(mut content: Content<'_>, damages: &[Damage]) -> Report {
    content.end();
    check_percuss(&mut content, damages.is_empty());
    let mut report = content.report;
    for damage in damages {
        report.problem(damage.offset, damage.reason.clone());
    }
    report.problems.sort_by_key(|problem| problem.offset);
    report
}

/// Checks a recording of percuss; other files are left as they are.
///
/// * `is_whole`: true if all of the file was read
fn check_percuss(content: &mut Content<'_>, is_whole: bool) {
    let Some(run) = content.entries(RUN) else { return };
    let mut problems = Vec::new();
    for name in RECORDS.iter().filter(|name| content.entries(name).is_none()) {
        problems.push(format!("the metadata record `{name}` is missing"));
    }
    for name in [CASE, RESOLVED_CASE] {
        if !content.attachment_names.iter().any(|known| known == name) {
            problems.push(format!("the attachment `{name}` is missing"));
        }
    }
    for topic in required_topics(run).iter().filter(|topic| count(content, topic).is_none()) {
        problems.push(format!("the channel `{topic}` is missing"));
    }
    let status = content.entries(STATUS);
    let word = status.and_then(|status| status.get("status"));
    let ending = word.and_then(|word| Ending::of(word));
    if let (Some(word), None) = (word, ending) {
        problems.push(format!("the status `{}` is not known", short(word)));
    }
    let last: Option<u64> = status.and_then(|status| status.get("last_step")?.parse().ok());
    if let Some(steps) = last.map(|last| last + 1) {
        for topic in [DRAG, VELOCITY] {
            if let Some(found) = count(content, topic).filter(|found| *found != steps) {
                problems.push(format!("`{topic}` has {found} messages for {steps} steps"));
            }
        }
        let planned: Option<u64> = run.get("steps").and_then(|steps| steps.parse().ok());
        if let Some(planned) = planned.filter(|planned| planned + 1 != steps)
            && ending == Some(Ending::Completed)
        {
            problems.push(format!("the run says completed after {steps} steps of {}", planned + 1));
        }
    }
    if is_whole {
        problems.extend(wrong_measures(content));
    }
    content.report.partial = ending == Some(Ending::Early);
    for problem in problems {
        content.report.problem(0, problem);
    }
}

/// What the run has recorded of its measures and its messages do not say. Nothing where messages are lost.
fn wrong_measures(content: &Content<'_>) -> Vec<String> {
    let is_lossy = content.report.undecoded > 0 || content.entries(RECOVERED).is_some();
    let Some(recorded) = content.entries(MEASURES).filter(|_| !is_lossy) else { return Vec::new() };
    let problem = |Measure { name, value, .. }: Measure| {
        let (found, computed) = (recorded.get(&*name), value.map(|value| value.to_string()));
        let or_nothing =
            |text: Option<&String>| text.map_or("nothing".into(), |text| short(text).into_owned());
        (found != computed.as_ref()).then(|| {
            let (found, computed) = (or_nothing(found), or_nothing(computed.as_ref()));
            format!("`{MEASURES}` says {name} {found}, the messages say {computed}")
        })
    };
    measures(&content.observed, content.entries(VALIDITY)).into_iter().filter_map(problem).collect()
}

/// Messages on a topic; `None` if there is no channel of that topic.
fn count(content: &Content<'_>, topic: &str) -> Option<u64> {
    let channels = content.directory.channels().iter().filter(|(_, channel)| channel.topic == topic);
    let counts = channels.map(|(id, _)| content.series.get(id).map_or(0, |series| series.count));
    counts.reduce(|a, b| a + b)
}

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
