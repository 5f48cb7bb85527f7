//! Compiles the message files beside this script, and finds out which commit is built.
//!
//! protox parses the `.proto` files in pure Rust (no `protoc` needed) and prost-build turns them into the
//! Rust types of `percuss::message`. The descriptor set, comments included, is written next to them: it is
//! embedded in the program and from there copied into every recording.

use std::{env, error::Error, fs, path::PathBuf, process::Command};

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
    // every commit compiles a program anew that names it
    if env::var("PROFILE")? == "release" {
        commit();
    }
    Ok(())
}

/// Hands the commit to optimised programs, with `-dirty` if files have changed since; nothing where the source is in no repository
/// of its own.
fn commit() {
    let Some(root) = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from) else { return };
    let git = |arguments: &[&str]| {
        let mut command = Command::new("git");
        if let Some(above) = root.parent() {
            // a repository that has a copy of the source has other commits
            command.env("GIT_CEILING_DIRECTORIES", above);
        }
        let output = command.current_dir(&root).args(arguments).output().ok()?;
        let text = String::from_utf8(output.stdout).ok()?;
        output.status.success().then(|| text.trim().to_owned())
    };
    let Some(commit) = git(&["describe", "--always", "--dirty", "--abbrev=12", "--exclude=*"]) else {
        return;
    };
    println!("cargo::rustc-env=PERCUSS_COMMIT={commit}");
    // the log of HEAD grows with every commit and checkout
    let log =
        git(&["rev-parse", "--git-path", "logs/HEAD"]).map(|log| root.join(log)).filter(|log| log.exists());
    log.into_iter()
        .chain([root.join("src")])
        .for_each(|path| println!("cargo::rerun-if-changed={}", path.display()));
}
