//! The `percuss-read` program: arguments in, exit status out. Everything else is in the library.

use std::process::ExitCode;

use percuss_output::{discard_at_signals, manual::parse};
use percuss_reader::{cli::Arguments, failure::Failure, verb::report};

fn main() -> ExitCode {
    let arguments = parse::<Arguments>();
    match discard_at_signals()
        .map_err(|error| Failure::Failed(format!("cannot watch for signals: {error}")))
        .and_then(|()| arguments.run())
    {
        Ok(exit) => exit.into(),
        Err(error) => report(&error),
    }
}
