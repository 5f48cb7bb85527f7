//! Finds out which commit is built.

use std::{env, path::PathBuf, process::Command};

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    // embedding the commit rebuilds on every commit, so only release builds do it
    if env::var("PROFILE").is_ok_and(|profile| profile == "release") {
        commit();
    }
}

/// Hands the commit to the programs, with `-dirty` if files have changed since; nothing where the source is in no repository of
/// its own.
fn commit() {
    let Some(here) = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from) else { return };
    // this is `tools/output` of the repository
    let Some(root) = here.ancestors().nth(2) else { return };
    let git = |arguments: &[&str]| {
        let mut command = Command::new("git");
        if let Some(above) = root.parent() {
            // a repository that has a copy of the source has other commits
            command.env("GIT_CEILING_DIRECTORIES", above);
        }
        let output = command.current_dir(root).args(arguments).output().ok()?;
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
        .chain([root.join("src"), root.join("tools/reader/src")])
        .for_each(|path| println!("cargo::rerun-if-changed={}", path.display()));
}
