//! Files that can be read: regular ones. Of a recording that is not complete, the name says so.

use std::{
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use percuss_output::kind_name;

use crate::{convention::PART, failure::Failure};

/// Opens a file; what is none is refused before it is opened, as opening a pipe without a writer blocks.
pub fn open_file(path: &Path) -> Result<File, Failure> {
    let kind = fs::metadata(path).map_err(unreadable(path))?.file_type();
    if !kind.is_file() {
        return Err(Failure::Failed(format!(
            "cannot read `{}`: it is {}; a recording is a regular file",
            path.display(),
            kind_name(kind)
        )));
    }
    File::open(path).map_err(unreadable(path))
}

/// Why a file cannot be read; where there is none, but one of that name that is not complete, that is said.
pub(super) fn unreadable(path: &Path) -> impl FnOnce(io::Error) -> Failure {
    let path = path.to_owned();
    move |error| match part_of(&path, &error) {
        Some(part) => Failure::Failed(format!(
            "`{}` does not exist; there is `{}`, a recording that is not complete; read that, or continue the run with \
             `percuss run --resume`",
            path.display(),
            part.display()
        )),
        None => Failure::Read { path, error },
    }
}

/// True if the name of a recording says that it is not complete: `run.mcap.part`.
pub fn is_part(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == PART)
}

/// The name of a recording once it is complete: `run.mcap` of `run.mcap.part`.
pub fn without_part(path: &Path) -> PathBuf {
    if is_part(path) { path.with_extension("") } else { path.to_owned() }
}

/// The recording that is not complete, where there is none of a name.
fn part_of(path: &Path, error: &io::Error) -> Option<PathBuf> {
    let mut name = path.file_name()?.to_owned();
    name.push(".");
    name.push(PART);
    let part = path.with_file_name(name);
    (error.kind() == io::ErrorKind::NotFound && part.is_file()).then_some(part)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_is_not_complete() {
        assert!(is_part(Path::new("a/run.mcap.part")) && !is_part(Path::new("a/part")));
        assert!(!is_part(Path::new("a/run.mcap")));
        assert_eq!(without_part(Path::new("a/run.mcap.part")), Path::new("a/run.mcap"));
        assert_eq!(without_part(Path::new("a/run.mcap")), Path::new("a/run.mcap"));
    }
}
