//! The `percuss-read` program: arguments in, exit status out. Everything else is in the library.

use std::process::ExitCode;

use clap::Parser;
use percuss_reader::cli::{Arguments, report};

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(exit) => exit.into(),
        Err(error) => report(&error),
    }
}
