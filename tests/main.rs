//! What percuss promises, as a library and as a program. Case files are checked in a program of their own, `cases`, whose memory
//! is measured.
//!
//! With `PERCUSS_FULL=1` what takes minutes is done in full: see `verification`.

mod checkpoint;
mod cli;
mod closed_forms;
mod files;
mod golden;
mod hostile;
mod house;
mod live;
mod recording;
mod schemas;
mod sweep;
mod verification;

#[path = "../tools/serve/tests/program.rs"]
mod program;
#[path = "../tools/serve/tests/viewer.rs"]
mod viewer;

use percuss::case::Case;

/// True for the full form of what takes minutes.
fn is_full() -> bool {
    std::env::var_os("PERCUSS_FULL").is_some()
}

/// A built-in case with overrides.
fn case(name: &str, overrides: &[impl AsRef<str>]) -> Case {
    let overrides: Vec<String> = overrides.iter().map(|text| text.as_ref().to_owned()).collect();
    Case::load(name, &overrides).unwrap_or_else(|errors| panic!("{errors:?}"))
}
