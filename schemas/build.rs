//! Compiles the message files beside this script.
//!
//! protox parses the `.proto` files in pure Rust (no `protoc` needed) and prost-build turns them into the
//! Rust types of `percuss::message`. The descriptor set, comments included, is written next to them: it is
//! embedded in the program and from there copied into every recording.

use std::{env, error::Error, fs, path::PathBuf};

use prost_build::Config;

/// The message of every channel, relative to this folder; imports are added.
const FILES: [&str; 15] = [
    "drag.proto",
    "energy.proto",
    "event.proto",
    "field_slice.proto",
    "foxglove/CompressedImage.proto",
    "foxglove/FrameTransforms.proto",
    "foxglove/Grid.proto",
    "foxglove/Log.proto",
    "foxglove/SceneUpdate.proto",
    "interface_stress.proto",
    "line_slice.proto",
    "points.proto",
    "probes.proto",
    "surface_profile.proto",
    "velocity.proto",
];

fn main() -> Result<(), Box<dyn Error>> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?).join("schemas");
    let out = PathBuf::from(env::var("OUT_DIR")?);
    println!("cargo::rerun-if-changed={}", root.display());

    let mut compiler = protox::Compiler::new([&root])?;
    compiler.include_imports(true).include_source_info(true);
    compiler.open_files(FILES.map(|file| root.join(file)))?;
    fs::write(out.join("descriptors.binpb"), compiler.encode_file_descriptor_set())?;

    let mut config = Config::new();
    config.enable_type_names();
    config.compile_fds(compiler.file_descriptor_set())?;
    Ok(())
}
