//! The `percuss-read` program: arguments in, exit status out. Everything else is in the library.

use std::process::ExitCode;

use percuss_output::{discard_at_signals, manual::parse};
use percuss_reader::cli::{Arguments, CliError, report};

fn main() -> ExitCode {
    let arguments = parse::<Arguments>();
    match discard_at_signals().map_err(CliError::Signals).and_then(|()| arguments.run()) {
        Ok(exit) => exit.into(),
        Err(error) => report(&error),
    }
}
