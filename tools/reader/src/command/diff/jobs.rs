//! What is compared with what, and how two recordings are compared and taken over.

use std::{
    collections::BTreeSet,
    fs, io,
    path::{Path, PathBuf},
};

use percuss_output::{Output, OutputError};

use super::write::DiffWriter;
use crate::{
    channel::Channel,
    compare::{Comparison, Options, compare},
    failure::Failure,
    measured::{Sources, is_table},
    messages::Recording,
    recording::{Limits, is_part, without_part},
    select::Pattern,
};

/// A reference and what is compared with it; of folders one of both may be missing.
pub(super) struct Job {
    pub(super) a: Option<PathBuf>,
    pub(super) b: Option<PathBuf>,
}

/// What is to be compared: every file with the first; folders file by file, by their names.
pub(super) fn jobs(paths: &[PathBuf]) -> io::Result<Vec<Job>> {
    let Some((first, others)) = paths.split_first() else { return Ok(Vec::new()) };
    let mut jobs = Vec::new();
    for other in others {
        match (first.is_dir(), other.is_dir()) {
            (false, false) => jobs.push(Job { a: Some(first.clone()), b: Some(other.clone()) }),
            (true, true) => {
                let (names_a, names_b) = (recordings(first)?, recordings(other)?);
                for name in names_a.union(&names_b) {
                    let [a, b] = [(first, &names_a), (other, &names_b)]
                        .map(|(folder, names)| names.contains(name).then(|| folder.join(name)));
                    jobs.push(Job { a, b });
                }
            }
            _ => {
                let kind = io::ErrorKind::InvalidInput;
                return Err(io::Error::new(kind, "a folder can only be compared with a folder"));
            }
        }
    }
    Ok(jobs)
}

/// Names of all recordings under a folder, relative to it: `*.mcap`, whatever the case, and those without an end,
/// `*.mcap.part`. Links are followed, but not into a folder that they are in.
fn recordings(folder: &Path) -> io::Result<BTreeSet<PathBuf>> {
    let mut names = BTreeSet::new();
    let mut open = vec![(PathBuf::new(), vec![fs::canonicalize(folder)?])];
    while let Some((place, inside)) = open.pop() {
        for entry in fs::read_dir(folder.join(&place))? {
            let name = place.join(entry?.file_name());
            let path = folder.join(&name);
            let whole = if is_part(&name) { without_part(&name) } else { name.clone() };
            let is_recording =
                whole.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("mcap"));
            if path.is_dir() {
                let real = fs::canonicalize(&path)?;
                if !inside.contains(&real) {
                    open.push((name, [inside.as_slice(), &[real]].concat()));
                }
            } else if is_recording {
                names.insert(name);
            }
        }
    }
    Ok(names)
}

/// Compares two recordings, writing their difference as well if that is asked for.
///
/// * `sources`: how they are opened; of a table its columns are compared
/// * `written`: file for the difference, and whether one of this name is replaced
///
/// # Errors
///
/// A file cannot be read or written.
pub fn diff(
    a: &Path,
    b: &Path,
    options: &Options,
    limits: Limits,
    sources: &Sources,
    written: Option<(&Path, bool)>,
) -> Result<Comparison, Failure> {
    let mut options = options.clone();
    let open = |path: &Path| sources.open(path, limits.of_two());
    let tables = [a, b].map(is_table);
    let (a, b) = (open(a)?, open(b)?);
    if tables.contains(&true) {
        // what a table has is what is compared
        options.by_name = true;
        let all = [&a, &b].into_iter().zip(tables).filter(|(_, is_table)| *is_table);
        let channels: Vec<&Channel> = all.flat_map(|(table, _)| table.channels.values()).collect();
        if options.topics.is_empty() {
            options.topics = channels.iter().map(|channel| Pattern::exact(&channel.topic)).collect();
        }
        if options.fields.is_empty() {
            let leaves = channels.iter().flat_map(|channel| channel.layout.iter());
            let leaves = leaves.flat_map(|layout| &layout.leaves);
            options.fields = leaves.map(|leaf| Pattern::exact(&leaf.path)).collect();
        }
    }
    let mut comparison = match written {
        None => compare(&a, &b, &options, None)?,
        Some((path, overwrite)) => {
            let compared = DiffWriter::begin(path, overwrite, &a, &b).and_then(|mut writer| {
                let compared = compare(&a, &b, &options, Some(&mut |matched| writer.take(matched)))?;
                writer.finish().map(|()| compared)
            });
            compared.map_err(|failure| failure.at(Some(path)))?
        }
    };
    if tables.contains(&true) {
        // a table says nothing of a run
        comparison.provenance.clear();
    }
    Ok(comparison)
}

/// True if a recording is undamaged, and came to its planned end if it says so.
pub(super) fn is_whole(path: &Path, limits: Limits) -> Result<bool, Failure> {
    let recording = Recording::read(path, limits)?;
    Ok(!recording.is_partial() && recording.damages.is_empty())
}

/// Puts a new recording in the place of the reference, whole or not at all.
pub(super) fn bless(reference: &Path, new: &Path) -> Result<(), OutputError> {
    let copy = || {
        reference.parent().map_or(Ok(()), fs::create_dir_all)?;
        let mut output = Output::create(reference, true)?;
        io::copy(&mut fs::File::open(new)?, &mut output)?;
        output.commit()
    };
    copy().map_err(|error| OutputError::new(reference, error))
}
