//! Every verb over every hostile file: within the cap on memory and 64 MB for the program, within ten seconds, with a
//! documented exit status, and no crash. The address space of every process is limited, so that one that asks for more aborts.
//!
//! `cargo test` runs every verb over every file, and further forms of the verbs over some of the files; with `PERCUSS_FULL=1` every
//! form meets every file.

mod records;
mod replays;
pub mod types;
mod values;
pub mod watch;

use std::{
    cmp::Reverse,
    collections::BTreeSet,
    fs,
    path::Path,
    process::Command,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use clap::CommandFactory;
use tempfile::TempDir;
use watch::{MEMORY, complaints, watch, watch_with};

use crate::{forge, is_full};

/// A hostile file: what it is, and what makes it.
type Case = (&'static str, fn() -> Vec<u8>);

const LEAST: usize = 60;

/// Every verb in the form that reads most. `a.mcap` is the hostile file, `b.mcap` a sound one.
pub const VERBS: [&str; 13] = [
    "info a.mcap",
    "verify a.mcap",
    "schema a.mcap",
    "cat a.mcap",
    "animate a.mcap --topic * -o a.gif --frames 3 --width 320 --force",
    "trace a.mcap --topic * -o t.csv --force",
    "plot a.mcap --topic * -o p.svg --force",
    "diff a.mcap a.mcap",
    "export a.mcap --attachments -o out --force",
    "export a.mcap --topic * -o f.npy --force",
    "report a.mcap -o r.html --force",
    "summary a.mcap",
    "recover a.mcap -o r.mcap --force",
];

/// Verbs that read no recording, and the one that waits for viewers, which has a test of its own.
const OTHERS: [&str; 3] = ["completions", "man", "replay"];

/// Further forms of them that read otherwise.
const FORMS: [&str; 29] = [
    "info a.mcap --json",
    "animate a.mcap -o a.gif --force",
    "verify a.mcap --json",
    "cat a.mcap --topic /a,/drag --from 0 --to 1 --every 2",
    "trace a.mcap",
    "trace a.mcap --topic * --format jsonl",
    "trace a.mcap --topic * -o t.parquet --force",
    "trace a.mcap --topic * -o t.npy --force",
    "trace a.mcap --topic * -o t.npz --force",
    "trace a.mcap --topic * --align nearest",
    "trace a.mcap --topic * --align linear",
    "trace a.mcap a.mcap --topic * --stack",
    "trace a.mcap b.mcap --topic * --time iso",
    "plot a.mcap",
    "plot a.mcap --topic * --map -o p.png --force",
    "plot a.mcap --topic * --at-time 0,1 -o p.pdf --force",
    "diff a.mcap a.mcap --align time",
    "diff a.mcap a.mcap --align step",
    "diff a.mcap a.mcap --align nearest",
    "diff a.mcap a.mcap --align linear",
    "diff a.mcap a.mcap --align cubic",
    "diff a.mcap a.mcap --align relative",
    "diff b.mcap a.mcap --json",
    "diff a.mcap b.mcap --peak-rel 1e-6 --l2-rel 1e-6 --plot d.svg --write-diff d.mcap --force",
    "export a.mcap --attachment a -o attachment --force",
    "export a.mcap --topic * -o f.png --force",
    "export a.mcap --topic * -o f.vti --at-time 0 --force",
    "summary a.mcap b.mcap --format json",
    "recover a.mcap -o r.mcap --force --json",
];

/// Without `PERCUSS_FULL` each form meets one file in so many: it must have no divisor in common with the number of forms.
const SHARE: usize = 8;

fn cases() -> Vec<Case> {
    [records::CASES, types::CASES, values::CASES].concat()
}

pub fn make(name: &str) -> Vec<u8> {
    let (_, make) = cases().into_iter().find(|case| case.0 == name).expect("a hostile file of this name");
    make()
}

#[test]
fn hostile_files_are_many_and_have_names() {
    let names: BTreeSet<&str> = cases().iter().map(|(name, _)| *name).collect();
    assert_eq!(names.len(), cases().len(), "each has a name of its own");
    assert!(names.len() >= LEAST, "{} hostile files", names.len());
}

#[test]
fn every_verb_is_watched() {
    let watched: BTreeSet<&str> =
        VERBS.iter().filter_map(|verb| verb.split(' ').next()).chain(OTHERS).collect();
    let program = percuss_reader::cli::Arguments::command();
    let verbs: BTreeSet<&str> = program.get_subcommands().map(clap::Command::get_name).collect();
    assert_eq!(watched, verbs, "a verb is watched, or is none");
}

/// Where the process that makes a hostile file puts it, and which it makes.
const PLACE: &str = "WATCHDOG_PLACE";
const NAME: &str = "WATCHDOG_NAME";
/// Set in a process that watches.
const WATCHES: &str = "WATCHDOG_WATCHES";

/// This program, with one test of this module.
fn this_test(name: &str) -> Command {
    let (_, module) = module_path!().split_once("::").expect("a module of the program");
    let mut command = Command::new(std::env::current_exe().expect("this program"));
    command.args(["--exact", &format!("{module}::{name}"), "--include-ignored"]);
    command
}

/// Makes a hostile file, if the environment asks for one.
#[test]
#[ignore = "what `folder_of` starts"]
fn one_is_made() {
    if let (Ok(place), Ok(name)) = (std::env::var(PLACE), std::env::var(NAME)) {
        fs::write(place, make(&name)).expect("a file");
    }
}

/// A folder with a hostile file. Another process makes it: the memory of this one counts as that of those it starts.
fn folder_of(name: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.mcap");
    let made = this_test("one_is_made").envs([(PLACE, path.as_os_str()), (NAME, name.as_ref())]).output();
    let made = made.expect("it starts");
    assert!(made.status.success() && path.exists(), "{name}: {}", String::from_utf8_lossy(&made.stdout));
    folder
}

/// Runs a test of this module in a process of its own, where no other test takes memory.
fn alone(name: &str, watch: impl FnOnce()) {
    if std::env::var_os(WATCHES).is_some() {
        return watch();
    }
    let watched = this_test(name).arg("--nocapture").env(WATCHES, "1").output().expect("it starts");
    let text = String::from_utf8_lossy(&watched.stdout);
    println!("{text}{}", String::from_utf8_lossy(&watched.stderr));
    assert!(watched.status.success() && text.contains("1 passed"));
}

/// Hands the numbers and names of the hostile files and folders with them to `take`, on several threads.
fn on_threads(threads: usize, take: impl Fn(usize, &str, &Path) + Sync) {
    let (cases, next) = (cases(), AtomicUsize::new(0));
    // some can be watched alone, by a part of their names
    let wanted = std::env::var("WATCHDOG").unwrap_or_default();
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let number = next.fetch_add(1, Ordering::Relaxed);
                    let Some((name, _)) = cases.get(number) else { break };
                    if name.contains(&wanted) {
                        take(number, name, folder_of(name).path());
                    }
                }
            });
        }
    });
}

fn print_largest(mut all: Vec<(u64, Duration, String)>) {
    /// Lines that are printed.
    const SHOWN: usize = 20;
    all.sort_by_key(|(memory, ..)| Reverse(*memory));
    for (memory, time, what) in all.iter().take(SHOWN) {
        println!("{memory:>4} MiB {:>6.2} s  {what}", time.as_secs_f64());
    }
}

#[test]
fn every_verb_over_every_hostile_file() {
    alone("every_verb_over_every_hostile_file", watch_every_verb);
}

fn watch_every_verb() {
    let sound = forge::forge(30, 1).write(forge::plain());
    let (wrong, measured) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
    let threads = thread::available_parallelism().map_or(2, usize::from);
    let runs = AtomicUsize::new(0);
    on_threads(threads, |number, what, folder| {
        fs::write(folder.join("b.mcap"), &sound).expect("a file");
        let forms = FORMS.iter().enumerate().filter(|(i, _)| is_full() || (number + i) % SHARE == 0);
        for verb in VERBS.into_iter().chain(forms.map(|(_, form)| *form)) {
            runs.fetch_add(1, Ordering::Relaxed);
            let arguments: Vec<&str> = verb.split(' ').collect();
            let ending = watch(folder, &arguments);
            let mut wrong = wrong.lock().expect("no panic");
            for complaint in complaints(&ending, MEMORY) {
                let text = format!("{what}: `{verb}` {complaint}: {}", first_lines(&ending.stderr));
                println!("{text}");
                wrong.push(text);
            }
            let of = format!("{what}: `{verb}`");
            measured.lock().expect("no panic").push((ending.memory, ending.time, of));
        }
        refuse_pages_that_are_left(what, folder);
    });
    print_largest(measured.into_inner().expect("no panic"));
    let wrong = wrong.into_inner().expect("no panic");
    let runs = runs.into_inner();
    println!("{runs} runs");
    assert!(wrong.is_empty(), "{} of {runs}:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn what_takes_gigabytes_stays_within_the_default_cap() {
    alone("what_takes_gigabytes_stays_within_the_default_cap", watch_with_the_default_cap);
}

fn watch_with_the_default_cap() {
    /// Memory by default \[MiB\], and addresses \[KiB\].
    const DEFAULT: (u64, u64) = (1024, 4_000_000);
    let files = [
        "a million channels",
        "a million channels in the summary",
        "twenty chunks of 250 MB of empty messages",
        "chunks that claim too little",
        "a case of long keys",
        "a JSON schema of a large part used again and again",
    ];
    for name in files {
        let folder = folder_of(name);
        for verb in ["diff a.mcap a.mcap", "trace a.mcap --topic * --to -1", "summary a.mcap"] {
            let arguments: Vec<&str> = verb.split(' ').collect();
            // what holds five gigabytes is not read to its end for this
            if name.starts_with("twenty") && !verb.starts_with("diff") {
                continue;
            }
            let ending = watch_with(folder.path(), DEFAULT.0, DEFAULT.1, &arguments);
            println!("{name}: `{verb}` {} MiB {:?}", ending.memory, ending.time);
            let complaints = complaints(&ending, DEFAULT.0);
            assert!(
                complaints.is_empty(),
                "{name}: `{verb}` {complaints:?}: {}",
                first_lines(&ending.stderr)
            );
        }
    }
}

/// What a file says cannot leave its place in a page: its scripts are those of the reader.
fn refuse_pages_that_are_left(what: &str, folder: &Path) {
    if let Ok(page) = fs::read_to_string(folder.join("r.html")) {
        assert!(!page.contains("<script>alert"), "{what}: a script of the file is in the page");
    }
}

fn first_lines(text: &str) -> String {
    text.lines()
        .take(3)
        .map(|line| line.chars().take(200).collect::<String>())
        .collect::<Vec<_>>()
        .join(" / ")
}
