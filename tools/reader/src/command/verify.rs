//! `verify`: everything in a recording that can be checked against something else in it.

mod content;
mod percuss;
mod report;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::Args;

use crate::{
    failure::Failure,
    recording::{Damage, Limits, Scan},
    verb::{Exit, Verb, if_read, show},
};

pub(super) use content::Content;
pub use report::{JSON_VERSION, Problem, Report};

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
    files: Vec<PathBuf>,
    /// Print JSON, one document per recording and line
    #[arg(long)]
    json: bool,
}

impl Verb for Verify {
    fn files(&self) -> &[PathBuf] {
        &self.files
    }

    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        let mut exit = Exit::Done;
        for file in &self.files {
            let report = verify(file, limits)?;
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

/// Verifies a file.
///
/// # Errors
///
/// The file cannot be read or is no MCAP file.
pub fn verify(path: &Path, limits: Limits) -> Result<Report, Failure> {
    verify_scan(Scan::open(path, limits)?, limits)
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
    percuss::check(&mut content, damages.is_empty());
    let mut report = content.report;
    for damage in damages {
        report.problem(damage.offset, damage.reason.clone());
    }
    report.problems.sort_by_key(|problem| problem.offset);
    report
}
