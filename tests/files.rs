//! Files that `percuss` touches: its own, and no others.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    path::Path,
    process::Command,
};

use percuss::sweep::{
    SweepError,
    journal::{Entry, Journal, State, line},
};

use crate::sweep::{SMALL, folder, recordings, refusal, succeed, text};

/// A sweep of some small cases into the folder `s`.
fn small<'a>(vary: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], &["--vary", vary, "-o", "s"], rest].concat()
}

/// All files of a folder.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let name = |path: &Path| path.file_name().expect("a name").to_string_lossy().into_owned();
    entries
        .filter(|path| path.is_file())
        .map(|path| (name(&path), fs::read(&path).expect("a file")))
        .collect()
}

/// Changes the lines of the journal of a sweep, with checksums that fit.
pub fn forge(sweep: &Path, change: impl Fn(&mut Entry)) {
    let journal = sweep.join("manifest.jsonl");
    let forged = |old: &str| {
        let mut entry = serde_json::from_str(old).expect("a line");
        change(&mut entry);
        line(&entry)
    };
    fs::write(&journal, text(&journal).lines().map(forged).collect::<String>()).expect("room");
}

#[test]
fn names_of_runs_are_derived_and_never_read() {
    let folder = folder();
    let sweep = folder.path().join("s");
    let start = || succeed(folder.path(), &small("indenter.mass=1,2", &[]))[1].clone();
    start();
    let names = recordings(&sweep);
    let victim = folder.path().join("victim.txt");
    fs::write(&victim, "not a sweep's").expect("room");
    fs::create_dir(sweep.join("own")).expect("room");
    for file in ["../victim.txt", &victim.to_string_lossy(), "own", "manifest.jsonl", "runs", "sweep.toml"] {
        let before = contents(&sweep);
        forge(&sweep, |entry| (entry.case, entry.file) = (entry.case + 7, Some(file.into())));
        fs::remove_file(sweep.join("runs").join(&names[1])).expect("a recording");
        assert!(start().contains("2 cases, 1 to compute"), "{file}");
        assert_eq!(recordings(&sweep), names, "{file}");
        assert_eq!(text(&victim), "not a sweep's", "{file}");
        assert!(sweep.join("own").is_dir(), "{file}");
        assert_eq!(contents(&sweep)["sweep.toml"], before["sweep.toml"], "{file}");
    }
}

#[test]
fn a_recording_without_its_end_is_computed_again() {
    let folder = folder();
    let start = || succeed(folder.path(), &small("indenter.mass=1,2", &[]))[1].clone();
    start();
    let sweep = folder.path().join("s");
    let run = sweep.join("runs").join(&recordings(&sweep)[0]);
    let whole = fs::read(&run).expect("a recording");
    let magic = &whole[whole.len() - 8..];
    for damaged in [&[][..], &whole[..whole.len() - 1], magic, &[&whole[..whole.len() - 40], magic].concat()]
    {
        fs::write(&run, damaged).expect("room");
        assert!(start().contains("2 cases, 1 to compute"), "{} bytes", damaged.len());
        assert_eq!(fs::metadata(&run).expect("a recording").len(), whole.len() as u64);
    }
    assert!(start().contains("2 cases, 0 to compute"));
}

#[test]
fn a_sweep_that_is_refused_writes_nothing() {
    let folder = folder();
    let sweep = folder.path().join("s");
    succeed(folder.path(), &small("indenter.mass=1,2", &["-q", "--keep", "none", "--shard", "1/2"]));
    let journal = File::create(sweep.join("manifest.jsonl")).expect("a journal");
    let before = contents(&sweep);
    // cases are missing
    let error = refusal(folder.path(), &["s", "--merge", "--keep", "all"], 1);
    assert!(error.contains("1 of 2 cases are not done"), "{error}");
    // another process works on it
    journal.lock().expect("a lock");
    for arguments in
        [&small("indenter.mass=3,4", &[])[..], &["s", "--keep", "all"], &["s", "--script", "slurm"]]
    {
        let error = refusal(folder.path(), arguments, 1);
        assert!(error.contains("is locked"), "{error}");
    }
    assert!(contents(&sweep) == before);
}

#[test]
fn a_folder_of_something_else_stays_as_it_is() {
    let folder = folder();
    let other = folder.path().join("s");
    let sweep = "# mine\ncase = \"fig5\"\n[[vary]]\nkey = \"indenter.mass\"\nvalues = [1, 2]\n";
    for files in [
        &["case.toml"][..],
        &["sweep.toml"],
        &["case.toml", "sweep.toml"],
        &["manifest.jsonl"],
        &["summary.csv"],
    ] {
        fs::create_dir(&other).expect("room");
        for file in files {
            fs::write(other.join(file), sweep).expect("room");
        }
        let before = contents(&other);
        let error = refusal(folder.path(), &small("indenter.mass=1,2", &[]), 1);
        assert!(error.contains("is no folder of a sweep"), "{error}");
        let error = refusal(folder.path(), &["s"], 2);
        let expected =
            if files.contains(&"sweep.toml") { "was not written by a sweep" } else { "without a sweep" };
        assert!(error.contains(expected), "{error}");
        assert!(contents(&other) == before, "{files:?}");
        fs::remove_dir_all(&other).expect("it is there");
    }
}

#[test]
fn lines_are_kept_while_another_process_replaces_the_journal() {
    const LINES: usize = 2000;
    let folder = folder();
    let path = folder.path().join("manifest.jsonl");
    let open = || loop {
        match Journal::open(&path) {
            Ok(journal) => return journal,
            Err(SweepError::Busy(_)) => {}
            Err(error) => panic!("{error}"),
        }
    };
    let entry = |case: usize| Entry {
        case,
        digest: format!("{case:032x}").try_into().expect("a digest"),
        state: State::Completed,
        message: None,
        file: None,
        seconds: 0.0,
        host: String::new(),
        measures: BTreeMap::new().into(),
        warnings: Vec::new(),
    };
    std::thread::scope(|scope| {
        let writer = scope.spawn(|| (0..LINES).for_each(|case| open().append(&entry(case)).expect("a line")));
        let new = folder.path().join("new");
        while !writer.is_finished() {
            let _lock = open();
            fs::copy(&path, &new).expect("room");
            fs::rename(&new, &path).expect("a name");
        }
    });
    assert_eq!(text(&path).lines().count(), LINES);
}

#[test]
fn an_output_that_is_an_input_is_refused() {
    let folder = folder();
    let case = "[target]\nthickness = 1.0\nshear_wave_speed = 0.5\n[indenter]\nshape = \"profile\"\nfile = \"nose.csv\"\n\
                [mesh]\ncells = 10\n[run]\nend_time = 0.5\n[record]\nframes = 0\n";
    let at = |name: &str| folder.path().join(name);
    fs::write(at("a.toml"), case).expect("room");
    fs::write(at("nose.csv"), "r,f\n0,0\n1,0.5\n").expect("room");
    fs::hard_link(at("nose.csv"), at("other.csv")).expect("a link");
    fs::hard_link(at("a.toml"), at("a.mcap")).expect("a link");
    fs::create_dir(at("below")).expect("room");
    let before = contents(folder.path());
    for (command, output) in [
        ("layout", "a.toml"),
        ("layout", "below/../a.toml"),
        ("layout", "nose.csv"),
        ("study", "nose.csv"),
        ("study", "other.csv"),
        ("run", "a.mcap"),
        ("exact", "a.mcap"),
    ] {
        let arguments = [command, "a.toml", "-o", output, "--force"];
        let mut program = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
        let result = program.current_dir(folder.path()).args(arguments).output().expect("the program starts");
        let said = String::from_utf8_lossy(&result.stderr).into_owned();
        assert_eq!(result.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(
            command == "exact" || said.contains("is what the case is read from"),
            "{arguments:?}: {said}"
        );
        assert!(contents(folder.path()) == before, "{arguments:?}");
    }
}
