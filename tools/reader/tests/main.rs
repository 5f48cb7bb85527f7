//! What the reader promises, as a library and as a program.

mod cli;
mod closed_forms;
mod containers;
mod diff;
mod hostile;
mod mutations;
mod others;
mod parts;
mod pictures;
mod replay;
mod selections;
mod summary;
mod timeline;
mod units;
mod verbs;
mod watchdog;
mod wire;

// shared by them
mod desk;
mod forge;
mod guests;
mod raw;
mod si;

#[path = "../../serve/tests/program.rs"]
mod program;
#[path = "../../serve/tests/viewer.rs"]
mod viewer;
