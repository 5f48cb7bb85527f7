//! What is chosen of messages: places in nested lists, points and lines of matrices, times, outputs.

mod forge;

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output, Stdio},
};

use forge::{Forged, forge, plain};
use tempfile::TempDir;

struct Desk(TempDir);

impl Desk {
    fn new(recordings: &[(&str, &Forged)]) -> Self {
        let desk = Self(tempfile::tempdir().expect("a folder"));
        for (name, recording) in recordings {
            fs::write(desk.path(name), recording.write(plain())).expect("a file");
        }
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn read(&self, status: i32, arguments: &[&str]) -> (String, String) {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss-read"));
        command.current_dir(self.0.path()).args(arguments).stdin(Stdio::null());
        let Output { status: exit, stdout, stderr } = command.output().expect("the program starts");
        let (stdout, stderr) = (String::from_utf8(stdout), String::from_utf8(stderr));
        let (stdout, stderr) = (stdout.expect("text"), stderr.expect("text"));
        assert_eq!(exit.code(), Some(status), "{arguments:?}: {stderr}");
        (stdout, stderr)
    }

    fn text(&self, arguments: &[&str]) -> String {
        self.read(0, arguments).0
    }

    /// What a run that is a mistake of usage says.
    fn refusal(&self, arguments: &[&str]) -> String {
        self.read(2, arguments).1
    }
}

#[test]
fn outputs_of_unknown_formats_are_refused() {
    let desk = Desk::new(&[("a.mcap", &forge(60, 1)), ("b.mcap", &forge(60, 2))]);
    for (arguments, known) in [
        (&["trace", "a.mcap", "--topic", "/scalar", "-o"] as &[&str], ".csv, .jsonl"),
        (&["plot", "a.mcap", "--topic", "/scalar", "-o"], ".svg, .png"),
        (&["export", "a.mcap", "--topic", "/slice", "-o"], ".npy, .vti, .png, .svg"),
        (&["diff", "a.mcap", "b.mcap", "--plot"], ".svg, .png"),
        (&["diff", "a.mcap", "b.mcap", "--write-diff"], ".mcap"),
        (&["recover", "a.mcap", "-o"], ".mcap"),
        (&["report", "a.mcap", "-o"], ".html"),
    ] {
        for name in ["x.xlsx", "x.mat", "x.h5", "x.tsv", "x.txt", "x.csv.gz"] {
            let text = desk.refusal(&[arguments, &[name]].concat());
            assert!(text.contains(known) && text.contains(name), "{arguments:?}: {text}");
            assert!(!desk.path(name).exists());
        }
    }
    // in any case of letters, without an extension, and where the format is said
    for (name, more) in [("X.CSV", &[] as &[&str]), ("table", &[]), ("x.txt", &["--format", "csv"])] {
        let arguments = [&["trace", "a.mcap", "--topic", "/scalar", "-o", name], more].concat();
        desk.text(&arguments);
        assert!(fs::read_to_string(desk.path(name)).expect("a table").starts_with("time [s],step"));
    }
}
