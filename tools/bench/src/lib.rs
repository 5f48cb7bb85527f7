//! What the benchmarks share.

use std::{fmt::Display, process::ExitCode};

/// Ends a program: says what went wrong, if anything has.
pub fn exit(result: Result<(), impl Display>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// The value in the middle; of an even number of values the larger one there.
///
/// # Panics
///
/// If there is none, or one cannot be compared.
pub fn median<T: PartialOrd + Copy>(values: impl IntoIterator<Item = T>) -> T {
    let mut values: Vec<T> = values.into_iter().collect();
    values.sort_by(|a, b| a.partial_cmp(b).expect("times and ratios are numbers"));
    values[values.len() / 2]
}
