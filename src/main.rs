//! The `percuss` program: arguments in, exit status out. Everything else is in the library.

use std::process::ExitCode;

use percuss::cli::{Arguments, report};
use percuss_output::manual::parse;

fn main() -> ExitCode {
    match parse::<Arguments>().run() {
        Ok(status) => status.into(),
        Err(error) => report(&error),
    }
}
