//! What percuss promises, as a library and as a program. Case files are checked in a program of their own, `cases`, whose memory
//! is measured.

mod checkpoint;
mod cli;
mod golden;
mod house;
mod live;
mod recording;
mod schemas;
mod verification;

#[path = "../tools/serve/tests/program.rs"]
mod program;
#[path = "../tools/serve/tests/viewer.rs"]
mod viewer;
