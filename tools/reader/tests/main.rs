//! What the reader promises, as a library and as a program.
//!
//! With `PERCUSS_FULL=1` what takes minutes is done in full: see `mutations` and `watchdog`.

mod cases;
mod cli;
mod closed_forms;
mod containers;
mod diff;
mod hostile;
mod layers;
mod mutations;
mod parts;
mod replay;
mod summary;
mod tables;
mod timeline;
mod verbs;
mod verdicts;
mod watchdog;
mod wire;

// shared by them
mod desk;
mod forge;
mod raw;

#[path = "../../serve/tests/program.rs"]
mod program;
#[path = "../../serve/tests/viewer.rs"]
mod viewer;

/// True for the full form of what takes minutes.
fn is_full() -> bool {
    std::env::var_os("PERCUSS_FULL").is_some()
}
