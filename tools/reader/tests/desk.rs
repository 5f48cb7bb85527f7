//! A folder of recordings, and the reader run in it.

use std::{
    fs,
    path::PathBuf,
    process::{Command, Output, Stdio},
};

use tempfile::TempDir;

use crate::watchdog::watch;

pub struct Desk {
    folder: TempDir,
    /// True if the reader has little memory.
    is_limited: bool,
}

impl Desk {
    /// A folder with some files in it.
    pub fn new(files: &[(&str, Vec<u8>)]) -> Self {
        let desk = Self { folder: tempfile::tempdir().expect("a folder"), is_limited: false };
        for (name, bytes) in files {
            desk.put(name, bytes);
        }
        desk
    }

    /// One with the file `a.mcap`, where the reader has as much memory as under watch.
    pub fn limited(bytes: Vec<u8>) -> Self {
        Self { is_limited: true, ..Self::new(&[("a.mcap", bytes)]) }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Writes a file.
    pub fn put(&self, name: &str, bytes: impl AsRef<[u8]>) {
        fs::write(self.path(name), bytes).expect("a file");
    }

    /// The bytes of a file.
    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).expect("a file")
    }

    pub fn command(&self, arguments: &[&str]) -> Command {
        if self.is_limited {
            let mut command = watch::command(self.folder.path(), watch::MEMORY, watch::ADDRESSES, arguments);
            command.stdout(Stdio::piped());
            return command;
        }
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss-read"));
        command.current_dir(self.folder.path()).args(arguments).stdin(Stdio::null());
        command
    }

    pub fn read(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the program starts")
    }

    /// Standard output and standard error of a run that ends with a status.
    pub fn both(&self, status: i32, arguments: &[&str]) -> (String, String) {
        let Output { status: exit, stdout, stderr } = self.read(arguments);
        let (stdout, stderr) = (String::from_utf8(stdout), String::from_utf8(stderr));
        let (stdout, stderr) = (stdout.expect("text"), stderr.expect("text"));
        assert_eq!(exit.code(), Some(status), "{arguments:?}: {stderr}");
        (stdout, stderr)
    }

    /// Both of a run with words as arguments, one behind the other.
    pub fn all(&self, status: i32, words: &str) -> String {
        let (stdout, stderr) = self.both(status, &words.split(' ').collect::<Vec<_>>());
        stdout + &stderr
    }

    /// Standard output of a run that ends with a status.
    pub fn text(&self, status: i32, arguments: &[&str]) -> String {
        self.both(status, arguments).0
    }

    /// Standard error of a run that ends with a status.
    pub fn error(&self, status: i32, arguments: &[&str]) -> String {
        self.both(status, arguments).1
    }

    /// The document that a run prints.
    pub fn json(&self, status: i32, arguments: &[&str]) -> serde_json::Value {
        serde_json::from_str(&self.text(status, arguments)).expect("JSON")
    }

    /// Lines of a run that succeeds.
    pub fn lines(&self, arguments: &[&str]) -> Vec<String> {
        self.text(0, arguments).lines().map(str::to_owned).collect()
    }
}
