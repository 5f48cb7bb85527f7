//! Damaged case files and profiles are refused with a text or are sound: none makes the check panic, hang or take much memory.
//!
//! The texts are the cases and profiles of the tables. `PERCUSS_MUTATIONS=100000 cargo test --test cases damaged` tries so many; the
//! numbers are the same in every run. A process that takes more than 2 GiB is stopped by no test here, so memory is read from the
//! system.

use std::{
    env, fs,
    path::Path,
    time::{Duration, Instant},
};

use percuss::case::Case;

use super::{BAD, table};

/// Damaged texts unless the environment says otherwise.
const MUTATIONS: usize = 4000;
/// Longest check of one case, on a machine that is busy.
const LONGEST: Duration = Duration::from_secs(5);
/// Memory that all checks together may add \[bytes\].
const MEMORY: u64 = 256 << 20;

/// Texts that stand in for a part of a line.
const PARTS: [&str; 24] = [
    "0",
    "-1",
    "1e308",
    "5e-324",
    "nan",
    "-inf",
    "9223372036854775807",
    "1e-300",
    "\"\"",
    "\"half-space\"",
    "[]",
    "[[0, 0], [1, 1]]",
    "{}",
    "true",
    "\"1e300 m\"",
    "\"10 mm\"",
    "\"-5 us\"",
    "\"steel\"",
    "\"profile\"",
    "= =",
    "[indenter]",
    "\u{0}",
    "\u{202e}",
    "\\u0000",
];

/// Numbers that look random and are the same every time (xorshift).
struct Dice(u64);

impl Dice {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 20) as usize % limit.max(1)
    }
}

/// Texts of the entries of some tables.
fn texts(tables: &[&str]) -> Vec<String> {
    tables.iter().flat_map(|name| table::read(name)).map(|entry| entry.text).collect()
}

/// A text with one to four changes.
fn mutate(text: &str, other: &str, dice: &mut Dice) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..1 + dice.below(4) {
        let at = dice.below(lines.len());
        let Some(line) = lines.get_mut(at) else { continue };
        let part = PARTS[dice.below(PARTS.len())];
        match dice.below(6) {
            0 => drop(lines.remove(at)),
            1 => {
                let copy = line.clone();
                lines.push(copy);
            }
            2 => lines.insert(at, other.lines().nth(dice.below(20)).unwrap_or_default().to_owned()),
            3 => {
                let key = line.split_once(['=', ',']).map_or(line.as_str(), |(key, _)| key);
                let separator = if line.contains('=') { "=" } else { "," };
                *line = format!("{key}{separator} {part}");
            }
            4 => {
                let mut bytes = line.clone().into_bytes();
                let byte = dice.below(bytes.len());
                if let Some(byte) = bytes.get_mut(byte) {
                    *byte ^= 1 << dice.below(7);
                }
                *line = String::from_utf8_lossy(&bytes).into_owned();
            }
            _ => {
                let end = (0..=dice.below(line.len() + 1)).rev().find(|end| line.is_char_boundary(*end));
                line.truncate(end.unwrap_or(0));
            }
        }
    }
    lines.join("\n")
}

/// Memory of this process that was ever in use \[bytes\].
fn peak_memory() -> u64 {
    let status = fs::read_to_string("/proc/self/status").expect("a Linux kernel");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a peak");
    line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number") * 1024
}

fn count() -> usize {
    env::var("PERCUSS_MUTATIONS").map_or(MUTATIONS, |count| count.parse().expect("a number"))
}

/// Checks a text; true if it is a sound case.
fn check(text: &str, settings: &[String], folder: &Path) -> bool {
    let start = Instant::now();
    let case = Case::parse("case.toml", text, settings, folder);
    assert!(start.elapsed() < LONGEST, "{:?} for\n{text}", start.elapsed());
    match case {
        Ok(case) => {
            let resolved = case.resolved_toml();
            let again = Case::parse("resolved.toml", &resolved, &[], folder);
            let again = again.unwrap_or_else(|error| panic!("{error}: {:?} of\n{text}", error.problems));
            assert_eq!(again.resolved_toml(), resolved, "{text}");
            true
        }
        Err(error) => {
            assert!(!error.problems.is_empty(), "{text}");
            false
        }
    }
}

#[test]
fn damaged_cases_are_refused_or_sound() {
    let texts = [texts(&["valid.txt"]), texts(&BAD)].concat();
    let folder = table::profiles();
    let (mut dice, mut sound) = (Dice(0xbb67_ae85_84ca_a73b), 0);
    let before = peak_memory();
    for _ in 0..count() {
        let text = &texts[dice.below(texts.len())];
        let text = mutate(text, &texts[dice.below(texts.len())], &mut dice);
        sound += usize::from(check(&text, &[], folder.path()));
    }
    println!("{} of {} are sound", sound, count());
    assert!(sound > 0 && sound < count());
    let grown = peak_memory() - before;
    assert!(grown < MEMORY, "{grown} bytes more");
}

#[test]
fn damaged_profiles_are_refused_or_sound() {
    let cases: Vec<String> =
        texts(&["valid.txt"]).into_iter().filter(|text| text.contains("\nfile = ")).collect();
    let profiles = texts(&["profiles.txt"]);
    let folder = tempfile::tempdir().expect("a folder");
    let settings = ["indenter.file=\"nose.csv\"".to_owned()];
    let (mut dice, mut sound) = (Dice(0x3c6e_f372_fe94_f82b), 0);
    for _ in 0..count() {
        let text =
            mutate(&profiles[dice.below(profiles.len())], &profiles[dice.below(profiles.len())], &mut dice);
        fs::write(folder.path().join("nose.csv"), text).expect("a file");
        let case = &cases[dice.below(cases.len())];
        let case = Case::parse("case.toml", case, &settings, folder.path());
        sound += usize::from(case.is_ok());
    }
    println!("{} of {} are sound", sound, count());
    assert!(sound > 0 && sound < count());
}
