//! A CSV file with the profile of an indenter, in a dimensionless and in a physical case.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use percuss::case::Case;
use percuss_fuzz::file;

const PLAIN: &str = include_str!("../seeds/profile/plain.toml");
const PHYSICAL: &str = include_str!("../seeds/profile/physical.toml");

fuzz_target!(|bytes: &[u8]| {
    let path = file("nose.csv", bytes);
    let setting = format!("indenter.file={:?}", path.display().to_string());
    for text in [PLAIN, PHYSICAL] {
        drop(Case::parse("case.toml", text, &[setting.clone()], Path::new("/")));
    }
});
