//! A case file: read and checked, never run. A sound one is the same again from its complete text.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use percuss::case::Case;

fuzz_target!(|text: &str| {
    // nothing is read from a folder that is not there
    let folder = Path::new("/nonexistent");
    let Ok(case) = Case::parse("case.toml", text, &[], folder) else { return };
    let resolved = case.resolved_toml();
    let again = Case::parse("resolved.toml", &resolved, &[], folder);
    let again = again.unwrap_or_else(|error| panic!("{error}: {:?}\n{resolved}", error.problems));
    assert_eq!(again.resolved_toml(), resolved);
});
