//! The messages are what the files of `schemas` say.
//!
//! protox parses the `.proto` files (no `protoc` needed) and prost-build turns them into the Rust types of `percuss::message`,
//! `src/message/*.rs`. The descriptor set, comments included, is `schemas/descriptors.binpb`: it is embedded in the program and
//! from there copied into every recording. All are committed, as compiling the compilers takes longer than all of percuss. After a
//! change of a `.proto` file, and before the code that uses it,
//!
//! ```text
//! PERCUSS_BLESS=1 cargo test schemas
//! ```

use std::{fs, path::Path};

use prost_build::Config;

/// Messages of other makers that channels use, relative to `schemas`; imports are added.
const FOREIGN: [&str; 5] = [
    "foxglove/CompressedImage.proto",
    "foxglove/FrameTransforms.proto",
    "foxglove/Grid.proto",
    "foxglove/Log.proto",
    "foxglove/SceneUpdate.proto",
];

#[test]
fn messages_are_those_of_the_schemas() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let schemas = root.join("schemas");
    let own = fs::read_dir(&schemas).expect("a folder").map(|entry| entry.expect("a file").path());
    let own = own.filter(|path| path.extension().is_some_and(|extension| extension == "proto"));
    let mut files: Vec<_> = own.chain(FOREIGN.map(|file| schemas.join(file))).collect();
    files.sort();
    let mut compiler = protox::Compiler::new([&schemas]).expect("a folder");
    compiler.include_imports(true).include_source_info(true);
    compiler.open_files(files).expect("sound schemas");
    let out = tempfile::tempdir().expect("a temporary folder");
    let mut config = Config::new();
    config.enable_type_names().out_dir(out.path());
    config.compile_fds(compiler.file_descriptor_set()).expect("Rust types");
    let read = |path: &Path| fs::read(path).expect("generated code");
    let made = [
        ("src/message/percuss.rs", read(&out.path().join("percuss.rs"))),
        ("src/message/foxglove.rs", read(&out.path().join("foxglove.rs"))),
        ("schemas/descriptors.binpb", compiler.encode_file_descriptor_set()),
    ];
    for (name, made) in made {
        let path = root.join(name);
        if std::env::var_os("PERCUSS_BLESS").is_some() {
            fs::write(&path, &made).expect("a file of this crate");
        }
        let is_fresh = fs::read(&path).is_ok_and(|committed| committed == made);
        assert!(is_fresh, "{name} is not what the schemas say: PERCUSS_BLESS=1 cargo test schemas");
    }
}
