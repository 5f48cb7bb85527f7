//! What the targets share. They are in `fuzz_targets`, one for each kind of input from outside; how to run them is in `run`.
//!
//! A recording comes out of a file of its own in memory: the reader works on files. What a target does with an input must
//! neither panic nor take more memory than the cap that it is given (`LIMITS`), far below that of the fuzzer.

use std::{
    fs::{self, File},
    path::{Path, PathBuf},
    process,
};

#[cfg(feature = "reader")]
mod reader;

#[cfg(feature = "reader")]
pub use reader::{LIMITS, Nowhere};

/// A file in memory, replaced with every input.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = place(name);
    fs::write(&path, bytes).expect("room in memory");
    path
}

/// An empty file in memory for output.
pub fn output(name: &str) -> (PathBuf, File) {
    let path = place(name);
    let file = File::create(&path).expect("room in memory");
    (path, file)
}

fn place(name: &str) -> PathBuf {
    Path::new("/dev/shm").join(format!("percuss-fuzz-{}-{name}", process::id()))
}
