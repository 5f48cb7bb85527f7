//! Tables of cases: text files with many entries.
//!
//! ```text
//! == NAME on BASE: what is special about it
//! [indenter]
//! radius = "-3 mm"
//! --
//! what is said about it
//! ```
//! BASE is a case of `valid.txt`; sections of the entry replace those of its name, lines before them come first. An entry without
//! BASE is a whole text. Comments `# --set KEY=VALUE` are settings of the command line.

use std::{
    fs,
    path::{Path, PathBuf},
};

use percuss::case::{Case, CaseErrors};

/// One entry of a table.
pub struct Entry {
    /// First line, without `== `.
    head: String,
    /// Text below it.
    patch: String,
    /// The complete text of the case.
    pub text: String,
    /// What is said about it, as the table has it.
    pub says: String,
}

impl Entry {
    pub fn name(&self) -> &str {
        self.head.split([' ', ':']).next().unwrap_or_default()
    }

    /// Name of the case that it is based on.
    pub fn base(&self) -> Option<&str> {
        let (words, _) = self.head.split_once(':').unwrap_or((&self.head, ""));
        words.split_once(" on ").map(|(_, base)| base)
    }

    /// Reads the case, with profiles from this folder.
    pub fn parse(&self, folder: &Path) -> Result<Case, CaseErrors> {
        let settings = self.text.lines().filter_map(|line| line.strip_prefix("# --set "));
        let settings: Vec<String> = settings.map(str::to_owned).collect();
        Case::parse(&format!("{}.toml", self.name()), &self.text, &settings, folder)
    }

    /// The entry as the table has it if this is said about it.
    pub fn with(&self, says: &str) -> String {
        format!("== {}\n{}--\n{}", self.head, self.patch, says)
    }
}

pub fn path(table: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases").join(table)
}

/// All entries of a table.
pub fn read(table: &str) -> Vec<Entry> {
    let bases = if table == "valid.txt" { Vec::new() } else { read("valid.txt") };
    let mut entries: Vec<Entry> = Vec::new();
    let file = fs::read_to_string(path(table)).expect("a table");
    for entry in format!("\n{file}").split("\n== ").skip(1) {
        let entry = entry.trim_end_matches('\n');
        let (head, rest) = entry.split_once('\n').unwrap_or((entry, ""));
        let (patch, says) = format!("\n{rest}\n")
            .split_once("\n--\n")
            .map_or((format!("{rest}\n"), String::new()), |(patch, says)| (lines(patch), lines(says)));
        let mut entry = Entry { head: head.to_owned(), text: patch.clone(), patch, says };
        if let Some(name) = entry.base() {
            let base = bases.iter().chain(&entries).find(|base| base.name() == name);
            entry.text = patched(&base.expect("a case of valid.txt").text, &entry.patch);
        }
        entries.push(entry);
    }
    entries
}

/// A text without blank lines around it, and with a line feed at its end.
fn lines(text: &str) -> String {
    let text = text.trim_matches('\n');
    if text.is_empty() { String::new() } else { format!("{text}\n") }
}

/// A case with some of its sections replaced.
fn patched(base: &str, patch: &str) -> String {
    let [base, mut patch] = [base, patch].map(sections);
    let mut text = vec![patch.remove(0)];
    for section in base.into_iter().skip(1) {
        let name = section.lines().next();
        let own = patch.iter().position(|section| section.lines().next() == name);
        text.push(own.map_or(section, |own| patch.remove(own)));
    }
    text.extend(patch);
    text.retain(|section| !section.is_empty());
    text.join("\n")
}

/// The lines before the first section, and every section.
fn sections(text: &str) -> Vec<String> {
    format!("\n{text}")
        .split("\n[")
        .enumerate()
        .map(|(i, section)| lines(&format!("{}{section}", if i == 0 { "" } else { "[" })))
        .collect()
}

/// A folder with the profiles that cases name.
pub fn profiles() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for profile in read("profiles.txt") {
        fs::write(folder.path().join(profile.name()), &profile.text).expect("a file");
    }
    folder
}
