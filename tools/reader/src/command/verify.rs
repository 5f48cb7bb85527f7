//! `verify`: everything in a recording that can be checked against something else in it.

mod content;
mod percuss;
mod report;

use std::{path::Path, sync::Arc};

use crate::recording::{Damage, Limits, OpenError, Scan};
pub(super) use content::Content;
pub use report::{JSON_VERSION, Problem, Report};

/// Verifies a file.
///
/// # Errors
///
/// The file cannot be read or is no MCAP file.
pub fn verify(path: &Path, limits: Limits) -> Result<Report, OpenError> {
    verify_scan(Scan::open(path, limits)?, limits)
}

/// Verifies what a scan reads.
///
/// # Errors
///
/// The source cannot be read.
pub fn verify_scan(mut scan: Scan, limits: Limits) -> Result<Report, OpenError> {
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
    percuss::check(&mut content);
    let mut report = content.report;
    for damage in damages {
        report.problem(damage.offset, damage.reason.clone());
    }
    report.problems.sort_by_key(|problem| problem.offset);
    report
}
