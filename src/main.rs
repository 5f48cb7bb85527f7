//! The `percuss` program: arguments in, exit status out. Everything else is in the library.

use std::process::ExitCode;

use clap::Parser;
use percuss::cli::{Arguments, report};

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(status) => status.into(),
        Err(error) => report(&error),
    }
}
