//! Every verb over every hostile file: within the cap on memory and 64 MB for the program, within ten seconds, with a
//! documented exit status, and no crash. The address space of every process is limited, so that one that asks for more aborts.

mod records;
mod replays;
mod types;
mod values;
mod watch;

use std::{
    collections::{BTreeMap, BTreeSet},
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

use tempfile::TempDir;
use watch::{MEMORY, complaints, watch, watch_with};

use crate::forge;

/// A hostile file: what it is, and what makes it.
type Case = (&'static str, fn() -> Vec<u8>);

/// Least number of hostile files.
const LEAST: usize = 60;

/// Every verb, in every form that reads otherwise. `a.mcap` is the hostile file, `b.mcap` a sound one.
const VERBS: [&str; 41] = [
    "info a.mcap",
    "info a.mcap --json",
    "verify a.mcap",
    "verify a.mcap --json",
    "schema a.mcap",
    "cat a.mcap",
    "cat a.mcap --topic /a,/drag --from 0 --to 1 --every 2",
    "trace a.mcap",
    "trace a.mcap --topic * -o t.csv --force",
    "trace a.mcap --topic * --format jsonl",
    "trace a.mcap --topic * -o t.parquet --force",
    "trace a.mcap --topic * -o t.npy --force",
    "trace a.mcap --topic * -o t.npz --force",
    "trace a.mcap --topic * --align nearest",
    "trace a.mcap --topic * --align linear",
    "trace a.mcap a.mcap --topic * --stack",
    "trace a.mcap b.mcap --topic * --time iso",
    "plot a.mcap",
    "plot a.mcap --topic * -o p.svg --force",
    "plot a.mcap --topic * --map -o p.png --force",
    "plot a.mcap --topic * --at-time 0,1 -o p.pdf --force",
    "diff a.mcap a.mcap",
    "diff a.mcap a.mcap --align time",
    "diff a.mcap a.mcap --align order",
    "diff a.mcap a.mcap --align step",
    "diff a.mcap a.mcap --align nearest",
    "diff a.mcap a.mcap --align linear",
    "diff a.mcap a.mcap --align cubic",
    "diff a.mcap a.mcap --align relative",
    "diff b.mcap a.mcap --json",
    "diff a.mcap b.mcap --peak-rel 1e-6 --l2-rel 1e-6 --plot d.svg --write-diff d.mcap --force",
    "export a.mcap --attachments -o out --force",
    "export a.mcap --attachment a -o attachment --force",
    "export a.mcap --topic * -o f.npy --force",
    "export a.mcap --topic * -o f.png --force",
    "export a.mcap --topic * -o f.vti --at-time 0 --force",
    "report a.mcap -o r.html --force",
    "summary a.mcap",
    "summary a.mcap b.mcap --format json",
    "recover a.mcap -o r.mcap --force",
    "recover a.mcap -o r.mcap --force --json",
];

/// All hostile files.
fn cases() -> Vec<Case> {
    [records::CASES, types::CASES, values::CASES].concat()
}

/// Where the process that makes a hostile file puts it, and which it makes.
const PLACE: &str = "WATCHDOG_PLACE";
const NAME: &str = "WATCHDOG_NAME";

#[test]
fn hostile_files_are_many_and_have_names() {
    let names: BTreeSet<&str> = cases().iter().map(|(name, _)| *name).collect();
    assert_eq!(names.len(), cases().len(), "each has a name of its own");
    assert!(names.len() >= LEAST, "{} hostile files", names.len());
    // in a process of its own, to make one of them
    if let (Ok(place), Ok(name)) = (std::env::var(PLACE), std::env::var(NAME)) {
        let (_, make) = cases().into_iter().find(|case| case.0 == name).expect("a hostile file of this name");
        fs::write(place, make()).expect("a file");
    }
}

/// A folder with a hostile file. Another process makes it: the memory of this one counts as that of those it starts.
fn folder_of(name: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let made = Command::new(std::env::current_exe().expect("this program"))
        .args(["--exact", "hostile_files_are_many_and_have_names"])
        .envs([(PLACE, folder.path().join("a.mcap").as_os_str()), (NAME, name.as_ref())])
        .output()
        .expect("it starts");
    assert!(made.status.success(), "{name}: {}", String::from_utf8_lossy(&made.stdout));
    folder
}

/// Hands the names of the hostile files and folders with them to `take`, on several threads.
fn on_threads(threads: usize, take: impl Fn(&str, &Path) + Sync) {
    let (cases, next) = (cases(), AtomicUsize::new(0));
    // some can be watched alone, by a part of their names
    let wanted = std::env::var("WATCHDOG").unwrap_or_default();
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((name, _)) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if name.contains(&wanted) {
                        take(name, folder_of(name).path());
                    }
                }
            });
        }
    });
}

/// What a verb, or a file, has taken at most.
#[derive(Default)]
struct Most {
    memory: u64,
    time: Duration,
    elapsed: Duration,
    of: [String; 2],
}

impl Most {
    fn join(&mut self, ending: &watch::Ending, of: &str) {
        if ending.memory > self.memory {
            (self.memory, self.of[0]) = (ending.memory, of.into());
        }
        if ending.time > self.time {
            (self.time, self.of[1]) = (ending.time, of.into());
        }
        self.elapsed = self.elapsed.max(ending.elapsed);
    }
}

/// Lines that are printed of those that have taken most.
const SHOWN: usize = 20;

/// Prints who has taken most.
fn tell(title: &str, all: &BTreeMap<String, Most>) {
    println!("\n{title}");
    let mut all: Vec<_> = all.iter().collect();
    all.sort_by_key(|(_, most)| std::cmp::Reverse(most.memory));
    for (name, Most { memory, time, of: [by_memory, by_time], .. }) in all.into_iter().take(SHOWN) {
        println!("{name:<60} {memory:>4} MiB {:>6.2} s  {by_memory} | {by_time}", time.as_secs_f64());
    }
}

#[test]
fn every_verb_over_every_hostile_file() {
    let sound = forge::forge(30, 1).write(forge::plain());
    let (wrong, measured) = (Mutex::new(Vec::new()), Mutex::new([BTreeMap::new(), BTreeMap::new()]));
    let threads = thread::available_parallelism().map_or(2, usize::from);
    on_threads(threads, |what, folder| {
        fs::write(folder.join("b.mcap"), &sound).expect("a file");
        for verb in VERBS {
            let arguments: Vec<&str> = verb.split(' ').collect();
            let ending = watch(folder, &arguments);
            let mut wrong = wrong.lock().expect("no panic");
            for complaint in complaints(&ending, MEMORY) {
                let text = format!("{what}: `{verb}` {complaint}: {}", first_lines(&ending.stderr));
                println!("{text}");
                wrong.push(text);
            }
            let [by_file, by_verb]: &mut [BTreeMap<String, Most>; 2] =
                &mut measured.lock().expect("no panic");
            by_file.entry(what.into()).or_default().join(&ending, verb);
            by_verb.entry(verb.into()).or_default().join(&ending, what);
        }
        refuse_pages_that_are_left(what, folder);
    });
    let [by_file, by_verb] = measured.into_inner().expect("no panic");
    tell("files", &by_file);
    tell("verbs", &by_verb);
    let wrong = wrong.into_inner().expect("no panic");
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), cases().len() * VERBS.len(), wrong.join("\n"));
}

#[test]
fn what_takes_gigabytes_stays_within_the_default_cap() {
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
