//! The verbs, one file each: from arguments to a result, printing left to the command line.

use std::{
    fs::{File, OpenOptions},
    io,
    path::Path,
};

pub mod cat;
pub mod diff;
pub mod export;
pub mod info;
pub mod plot;
pub mod recover;
pub mod replay;
pub mod report;
pub mod schema;
pub mod summary;
pub mod trace;
pub mod verify;

/// Creates a file, a new one unless it may be overwritten.
pub(crate) fn create(path: &Path, overwrite: bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create(overwrite).truncate(overwrite).create_new(!overwrite).open(path)
}
