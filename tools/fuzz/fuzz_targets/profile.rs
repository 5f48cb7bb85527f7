//! A CSV file with the profile of an indenter, in a dimensionless and in a physical case.

#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use percuss::case::Case;
use percuss_fuzz::file;

const PLAIN: &str = r#"
[target]
thickness = 1.0
shear_wave_speed = 0.5
[indenter]
shape = "profile"
[impact]
velocity = 0.1
[mesh]
cells = 10
[run]
end_time = 1.0
"#;

const PHYSICAL: &str = r#"
[target]
thickness = "20 mm"
material = "pmma"
[indenter]
shape = "profile"
length_unit = "10 mm"
[impact]
velocity = "5 m/s"
[mesh]
cells = 10
[run]
end_time = "20 us"
"#;

fuzz_target!(|bytes: &[u8]| {
    let path = file("nose.csv", bytes);
    let setting = format!("indenter.file={:?}", path.display().to_string());
    for text in [PLAIN, PHYSICAL] {
        drop(Case::parse("case.toml", text, &[setting.clone()], Path::new("/")));
    }
});
