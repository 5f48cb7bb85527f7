//! Sweeps, as processes: stopped and continued, in shards, changed, wrong.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    thread::sleep,
    time::Duration,
};

use percuss::sweep::journal::State;
use signal_hook::consts::SIGINT;
use tempfile::TempDir;

use crate::files::forge;

pub fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
    command.current_dir(folder).arg("sweep").args(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

fn sweep(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the program starts")
}

/// What is said of a sweep that succeeds: on standard output, and beside it.
pub fn succeed(folder: &Path, arguments: &[&str]) -> [String; 2] {
    let output = sweep(folder, arguments);
    let texts = [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("text"));
    assert!(output.status.success(), "{arguments:?}: {}", texts[1]);
    texts
}

/// What is said of a sweep that fails with this exit status.
pub fn refusal(folder: &Path, arguments: &[&str], status: i32) -> String {
    let output = sweep(folder, arguments);
    let text = String::from_utf8(output.stderr).expect("messages are text");
    assert_eq!(output.status.code(), Some(status), "{arguments:?}: {text}");
    text
}

/// Small cases: some milliseconds each.
pub const SMALL: [&str; 5] = ["fig5", "--set", "mesh.cells=20", "--set", "record.frames=0"];

/// A sweep of 120 of them.
const MANY: [&str; 4] =
    ["--vary", "indenter.mass=0.5:50:40:log", "--vary", "target.shear_wave_speed=0.3,0.4,0.5"];

fn many<'a>(rest: &[&'a str]) -> Vec<&'a str> {
    [&SMALL[..], &MANY, rest].concat()
}

pub fn text(path: impl AsRef<Path>) -> String {
    let path = path.as_ref();
    fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn lines(path: impl AsRef<Path>) -> usize {
    text(path).lines().count()
}

/// Names of the recordings of a sweep.
pub fn recordings(sweep: &Path) -> Vec<String> {
    let Ok(entries) = fs::read_dir(sweep.join("runs")) else { return Vec::new() };
    let name = |entry: std::io::Result<fs::DirEntry>| entry.expect("an entry").file_name().into_string();
    let mut names: Vec<String> = entries.map(|entry| name(entry).expect("a name")).collect();
    names.sort();
    names
}

fn summaries(sweep: &Path) -> [Vec<u8>; 2] {
    ["summary.csv", "summary.parquet"].map(|name| fs::read(sweep.join(name)).expect("a summary"))
}

#[test]
fn a_sweep_that_is_killed_twenty_times_has_the_same_summary() {
    let folder = folder();
    succeed(folder.path(), &many(&["-o", "whole", "--keep", "none", "-q"]));
    let whole = summaries(&folder.path().join("whole"));
    assert_eq!(String::from_utf8_lossy(&whole[0]).lines().count(), 121);
    assert!(!folder.path().join("whole/runs").exists());
    // instants that no clock of the machine knows
    let mut state = 1_u64;
    let mut instant = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        Duration::from_micros(state >> 48)
    };
    let path = folder.path().join("killed");
    for keep in ["none", "all"] {
        drop(fs::remove_dir_all(&path));
        // of one that was killed at its very beginning
        fs::create_dir(&path).expect("room");
        fs::write(path.join("sweep.toml.kill.part"), "case =").expect("room");
        let start = || -> Child {
            command(folder.path(), &many(&["-o", "killed", "--keep", keep, "-q"]))
                .spawn()
                .expect("the program starts")
        };
        for _ in 0..20 {
            let mut child = start();
            sleep(instant());
            child.kill().expect("a signal");
            child.wait().expect("an end");
            // no recording has its name before it is whole
            for name in recordings(&path).iter().filter(|name| name.ends_with(".mcap")) {
                let bytes = fs::read(path.join("runs").join(name)).expect("a recording");
                assert!(bytes.ends_with(b"\x89MCAP0\r\n"), "{name}");
            }
        }
        assert!(start().wait().expect("an end").success());
        assert!(summaries(&path) == whole, "{keep}");
        let names = recordings(&path);
        assert_eq!(names.len(), if keep == "all" { 120 } else { 0 }, "{names:?}");
        assert!(names.iter().all(|name| name.ends_with(".mcap")), "{names:?}");
    }
}

#[test]
fn shards_have_the_same_summary() {
    let folder = folder();
    succeed(folder.path(), &many(&["-o", "whole", "--keep", "none", "-q"]));
    let whole = summaries(&folder.path().join("whole"));
    for of in [1, 3, 7] {
        let name = format!("of{of}");
        let missing = ["-o", &name, "--keep", "none", "-q", "--shard", &format!("1/{of}")].map(str::to_owned);
        succeed(folder.path(), &many(&missing.each_ref().map(String::as_str)));
        if of > 1 {
            let text = refusal(folder.path(), &[&name, "--merge"], 1);
            assert!(text.contains("of 120 cases are not done"), "{text}");
        }
        let shards: Vec<Child> = (2..=of)
            .map(|i| {
                command(folder.path(), &[&name, "-q", "--shard", &format!("{i}/{of}")])
                    .spawn()
                    .expect("a start")
            })
            .collect();
        for mut shard in shards {
            assert!(shard.wait().expect("an end").success());
        }
        let path = folder.path().join(&name);
        let parts: usize = (1..=of).map(|i| lines(path.join(format!("manifest-{i}-of-{of}.jsonl")))).sum();
        assert_eq!(parts, 120);
        assert_eq!(lines(path.join(format!("summary-1-of-{of}.csv"))), 1 + 120_usize.div_ceil(of));
        succeed(folder.path(), &[&name, "--merge", "-q"]);
        assert!(summaries(&path) == whole, "{of} shards");
        assert_eq!(lines(path.join("manifest.jsonl")), 120);
    }
    for (shard, expected) in [("0/3", "is no shard"), ("4/3", "is no shard"), ("1", "is no shard")] {
        assert!(refusal(folder.path(), &["of3", "--shard", shard], 2).contains(expected));
    }
}

#[test]
fn a_changed_sweep_computes_what_is_new() {
    let folder = folder();
    let path = folder.path().join("s");
    let start = |values: &str| {
        let vary = format!("indenter.mass={values}");
        let [_, said] = succeed(folder.path(), &[&SMALL[..], &["--vary", &vary, "-o", "s"]].concat());
        said
    };
    assert!(start("1,2,3").contains("3 cases, 3 to compute"));
    let first = recordings(&path);
    let of = |number: usize| fs::read(path.join("runs").join(&first[number])).expect("a recording");
    let kept = [of(1), of(2)];
    // other numbers for the same cases, one twice, and one that goes
    assert!(start("5,2,3,2").contains("4 cases, 1 to compute"));
    let names = recordings(&path);
    assert_eq!(names.len(), 4, "{names:?}");
    let digest = |name: &str| name[7..].to_owned();
    for (number, old) in [(2, 1), (3, 2)] {
        let name = names.iter().find(|name| digest(name) == digest(&first[old])).expect("it is there");
        assert!(name.starts_with(&format!("{number:06}-")), "{name}");
        assert!(fs::read(path.join("runs").join(name)).expect("a recording") == kept[old - 1]);
    }
    let summary = text(path.join("summary.csv"));
    let rows: Vec<Vec<&str>> = summary.lines().skip(1).map(|row| row.split(',').collect()).collect();
    let masses: Vec<&str> = rows.iter().map(|row| row[1]).collect();
    assert_eq!(masses, ["5.0", "2.0", "3.0", "2.0"]);
    assert_eq!(rows[1][2..], rows[3][2..]);
    let again = summaries(&path);
    assert!(start("5,2,3,2").contains("0 to compute"));
    assert!(summaries(&path) == again);
    // a recording that is gone is computed again, and with none kept it is not missed
    let new = names.iter().find(|name| name.starts_with("000001-") && !first.contains(name)).expect("a case");
    fs::remove_file(path.join("runs").join(new)).expect("it is there");
    assert!(succeed(folder.path(), &["s", "--keep", "none"])[1].contains("0 to compute"));
    assert!(succeed(folder.path(), &["s", "--keep", "all"])[1].contains("1 to compute"));
    assert!(summaries(&path) == again);
}

#[test]
fn the_worst_recording_is_kept_alone() {
    let folder = folder();
    let vary = ["--vary", "indenter.mass=1,8,3", "--keep", "worst:peak_force", "-q"];
    succeed(folder.path(), &[&SMALL[..], &vary, &["-o", "s"]].concat());
    let path = folder.path().join("s");
    let names = recordings(&path);
    assert!(names.len() == 1 && names[0].starts_with("000002-"), "{names:?}");
    assert!(text(path.join("manifest.jsonl")).contains(&format!("\"file\":\"runs/{}\"", names[0])));
    succeed(folder.path(), &["s", "-q"]);
    assert_eq!(recordings(&path), names);
    let error = refusal(
        folder.path(),
        &[&SMALL[..], &["--vary", "indenter.mass=1,2", "--keep", "worst:drag"]].concat(),
        2,
    );
    assert!(error.contains("`drag` is no measure; known: peak_force"), "{error}");
}

#[test]
fn failures_are_listed_and_computed_again_if_asked_for() {
    let folder = folder();
    let path = folder.path().join("s");
    let vary = ["--vary", "indenter.mass=1,2,3", "--keep", "none", "-q"];
    succeed(folder.path(), &[&SMALL[..], &vary, &["-o", "s"]].concat());
    let good = text(path.join("summary.csv"));
    forge(&path, |entry| {
        if entry.case == 2 {
            (entry.state, entry.message) = (State::Failed, Some("it burst".into()));
            entry.measures = Default::default();
        }
    });
    let error = refusal(folder.path(), &["s", "-q"], 1);
    assert!(error.contains("1 of 3 cases failed: 2;") && error.contains("--rerun-failed"), "{error}");
    let summary = text(path.join("summary.csv"));
    assert!(summary.lines().any(|row| row.starts_with("2,2.0,failed,,,")), "{summary}");
    succeed(folder.path(), &["s", "-q", "--rerun-failed"]);
    assert_eq!(text(path.join("summary.csv")), good);
    // where a recording cannot be written it is not the fault of the case: the sweep ends, and goes on when it can
    let blocked: PathBuf = path.join("runs");
    fs::write(&blocked, "in the way").expect("room");
    let error = refusal(folder.path(), &["s", "-q", "--keep", "all"], 1);
    assert!(error.contains("runs"), "{error}");
    fs::remove_file(&blocked).expect("it is there");
    succeed(folder.path(), &["s", "-q", "--keep", "all"]);
    assert_eq!(recordings(&path).len(), 3);
    assert_eq!(text(path.join("summary.csv")), good);
}

#[test]
fn an_interrupted_sweep_goes_on() {
    let folder = folder();
    // half a second each at least
    let slow =
        ["fig5", "--set", "mesh.cells=200", "--set", "record.frames=0", "--vary", "indenter.mass=1:5:9"];
    let mut child = command(folder.path(), &[&slow[..], &["-o", "s", "--threads", "1"]].concat())
        .spawn()
        .expect("a start");
    let manifest = folder.path().join("s/manifest.jsonl");
    while !fs::read_to_string(&manifest).is_ok_and(|text| text.contains('\n')) {
        sleep(Duration::from_millis(5));
    }
    let pid = i32::try_from(child.id()).expect("a number");
    Command::new("kill").args(["-INT", &pid.to_string()]).status().expect("a signal");
    let output = child.wait().expect("an end");
    assert_eq!(output.code(), Some(128 + SIGINT));
    let done = lines(&manifest);
    assert!((1..9).contains(&done), "{done}");
    assert!(!folder.path().join("s/summary.csv").exists());
    let [_, said] = succeed(folder.path(), &["s"]);
    assert!(said.contains(&format!("9 cases, {} to compute", 9 - done)), "{said}");
    let names = recordings(&folder.path().join("s"));
    assert!(names.len() == 9 && names.iter().all(|name| name.ends_with(".mcap")), "{names:?}");
}

#[test]
fn physical_cases_tables_and_sweep_files() {
    let folder = folder();
    let ball = "[target]\nthickness = \"10 mm\"\nmaterial = \"pmma\"\n[indenter]\nshape = \"sphere\"\nnose_radius = \"5 mm\"\n\
                material = \"steel\"\n[impact]\nvelocity = \"5 m/s\"\n[mesh]\ncells = 20\n[run]\nend_time = \"20 us\"\n\
                [record]\nframes = 0\n";
    fs::create_dir(folder.path().join("cases")).expect("room");
    fs::write(folder.path().join("cases/ball.toml"), ball).expect("room");
    let table = "impact.velocity,target.material\n# slow ones\n2 m/s,pmma\n500 cm/s, steel\n";
    fs::write(folder.path().join("cases/table.csv"), table).expect("room");
    succeed(folder.path(), &["cases/ball.toml", "--vary", "cases/table.csv", "-q"]);
    let summary = text(folder.path().join("ball-sweep/summary.csv"));
    let rows: Vec<&str> = summary.lines().collect();
    assert!(
        rows[0].starts_with("case,impact.velocity [m/s],target.material,status,peak_force [N],"),
        "{summary}"
    );
    assert!(
        rows[1].starts_with("1,2.0,pmma,completed,") && rows[2].starts_with("2,5.0,steel,completed,"),
        "{summary}"
    );
    // the folder stands by itself
    fs::rename(folder.path().join("cases"), folder.path().join("elsewhere")).expect("room");
    assert!(succeed(folder.path(), &["ball-sweep"])[1].contains("0 to compute"));
    // a sweep file says the same
    let file = "case = \"ball.toml\"\nkeep = \"none\"\n[[vary]]\nfile = \"table.csv\"\n";
    fs::write(folder.path().join("elsewhere/sweep-of-balls.toml"), file).expect("room");
    succeed(folder.path(), &["elsewhere/sweep-of-balls.toml", "-o", "again", "-q"]);
    assert_eq!(text(folder.path().join("again/summary.csv")), summary);
    let file = "case = \"fig5\"\nset = [\"mesh.cells=20\", \"record.frames=0\"]\ncombine = { lhs = { samples = 4, seed = 3 } }\n\
                [[vary]]\nkey = \"indenter.mass\"\nvalues = \"1:10:log\"\n";
    fs::write(folder.path().join("lhs.toml"), file).expect("room");
    let vary = ["--vary", "indenter.mass=1:10:log", "--lhs", "4", "--seed", "3"];
    succeed(folder.path(), &["lhs.toml", "--keep", "none", "-o", "a", "-q"]);
    succeed(folder.path(), &[&SMALL[..], &vary, &["--keep", "none", "-o", "b", "-q"]].concat());
    assert!(summaries(&folder.path().join("a")) == summaries(&folder.path().join("b")));
}

#[test]
fn warnings_stand_in_the_journal_the_summary_and_at_the_end() {
    const LAMINATE: &str = "model = \"elastic\"\n[target]\nback = \"free\"\n[[target.layer]]\nmaterial = \"alumina\"\nthickness = \"6 mm\"\n\
        [[target.layer]]\nmaterial = \"epoxy\"\nthickness = \"0.3 mm\"\n[indenter]\nshape = \"sphere\"\nnose_radius = \"6.35 mm\"\n\
        material = \"steel\"\n[impact]\nvelocity = \"10 m/s\"\n[mesh]\ncells = 25\n[run]\nend_time = \"20 us\"\n[record]\nframes = 0\n";
    let folder = folder();
    fs::write(folder.path().join("ball.toml"), LAMINATE).expect("room");
    let percuss = |arguments: &[&str]| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
        command.current_dir(folder.path()).args(arguments).output().expect("the program starts")
    };
    // as many as a run says
    let said = String::from_utf8(percuss(&["run", "ball.toml"]).stderr).expect("text");
    let count = said.lines().filter(|line| line.starts_with("warning: ")).count();
    assert!(count >= 3, "{said}");
    let vary = ["ball.toml", "--vary", "impact.velocity=\"9 m/s\",\"10 m/s\"", "--keep", "none", "-o", "s"];
    let [_, said] = succeed(folder.path(), &vary);
    let summary = text(folder.path().join("s/summary.csv"));
    let mut rows = summary.lines();
    assert!(rows.next().is_some_and(|heading| heading.ends_with(",warnings")), "{summary}");
    let warnings: Vec<&str> = rows.map(|row| row.rsplit(',').next().unwrap_or_default()).collect();
    let subjects: Vec<&str> = warnings[1].split(';').collect();
    assert_eq!((warnings.len(), subjects.len()), (2, count), "{summary}");
    assert!(["rigid", "cells"].iter().all(|subject| subjects.contains(subject)), "{subjects:?}");
    assert!(said.contains("warnings: ") && said.contains("rigid in 2"), "{said}");
    let journal = text(folder.path().join("s/manifest.jsonl"));
    let listed = format!("\"warnings\":[\"{}\"]", subjects.join("\",\""));
    assert!(journal.lines().any(|line| line.contains(&listed)), "{journal}");
    // those of a study, with the cells of the meshes that have them
    let settings = ["--set", "mesh.cells=12", "--set", "run.end_time=10 us", "-q"];
    for output in ["study.csv", "study.json"] {
        let study = percuss(&[&["study", "ball.toml", "-o", output], &settings[..]].concat());
        let said = String::from_utf8(study.stdout).expect("text");
        assert!(said.contains("\nwarning, 12, 24, 48 cells: the indenter is taken as rigid"), "{said}");
    }
    assert!(
        text(folder.path().join("study.csv"))
            .lines()
            .all(|row| row.ends_with(",warnings") || row.contains("rigid"))
    );
    assert!(text(folder.path().join("study.json")).contains("\"about\": \"rigid\""));
}

#[test]
fn what_is_wrong_is_said_before_anything_runs() {
    let folder = folder();
    fs::write(
        folder.path().join("wrong.toml"),
        "case = \"fig5\"\n[[vary]]\nkey = \"indenter.mass\"\nvalue = 1\n",
    )
    .expect("room");
    fs::write(folder.path().join("open.toml"), "case = \"fig5\n").expect("room");
    let lhs = "case = \"fig5\"\ncombine = { lhs = { samples = 'few', seed = 1 } }\nvary = []\n";
    fs::write(folder.path().join("few.toml"), lhs).expect("room");
    fs::write(folder.path().join("semicolons.csv"), "indenter.mass;mesh.cells\n1;20\n").expect("room");
    fs::create_dir(folder.path().join("other")).expect("room");
    fs::write(folder.path().join("other/file"), "not mine").expect("room");
    for (arguments, expected) in [
        (&["fig5"][..], "nothing is varied: add --vary"),
        (&["fig5", "--vary", "indenter.weight=1,2"], "unknown key `indenter.weight`"),
        (&["fig5", "--vary", "indenter.mass=1:1:5"], "the range is empty"),
        (&["fig5", "--vary", "indenter.mass=1:2:1000000000"], "no count of values"),
        (
            &["fig5", "--vary", "indenter.mass=1:2:40000", "--vary", "impact.velocity=1:2:25000"],
            "40000 x 25000 cases",
        ),
        (
            &["fig5", "--vary", "indenter.mass=1,-1,2,-2", "--vary", "mesh.cells=20,30"],
            "4 of 8 cases are wrong; none has been run",
        ),
        (&["fig5", "--vary", "indenter.mass=1,-1,2,-2", "--vary", "mesh.cells=20,30"], "case 3 and 1 others"),
        (&["fig5", "--vary", "indenter.mass=1,2", "--vary", "indenter.mass=3"], "varied twice"),
        (&["fig5", "--vary", "indenter.mass=1,2", "--set", "indenter.mass=3"], "is set and varied"),
        (
            &["fig5", "--zip", "--vary", "indenter.mass=1,2", "--vary", "mesh.cells=20"],
            "has 2 and `mesh.cells` has 1",
        ),
        (&["fig5", "--vary", "geometry=plane,axisymmetric"], "numbers of one column have one unit"),
        (&["fig5", "--vary", "missing.csv"], "missing.csv"),
        (&["fig55", "--vary", "indenter.mass=1,2"], "is no built-in case"),
        (&["fig55", "--vary", "indenter.mass=1,2"], "did you mean `fig5`?"),
        (&["fig5", "--vary", "semicolons.csv"], "between semicolons"),
        (&["fig5", "--vary", "indenter.mass=1,2", "--max-memory", "1e-6"], "more than --max-memory"),
        (&["wrong.toml"], "wrong.toml"),
        (&["open.toml"], "line 1, column 13"),
        (&["few.toml"], "\"few\" is no whole number from 0 on"),
        (&["nosuchdir"], "`nosuchdir` does not exist"),
        (&["other"], "without a sweep"),
        (&["other", "--vary", "indenter.mass=1,2"], "without a sweep"),
    ] {
        let error = refusal(folder.path(), arguments, 2);
        assert!(error.contains(expected), "{arguments:?}: {error}");
    }
    let occupied = refusal(folder.path(), &["fig5", "--vary", "indenter.mass=1,2", "-o", "other"], 1);
    assert!(occupied.contains("is no folder of a sweep"), "{occupied}");
    let entries = fs::read_dir(folder.path()).expect("a folder").count();
    assert_eq!(entries, 5, "nothing was written");
}

#[test]
fn tasks_of_slurm_with_any_indices_compute_every_case_once() {
    let folder = folder();
    succeed(folder.path(), &many(&["-o", "whole", "--keep", "none", "-q"]));
    let whole = summaries(&folder.path().join("whole"));
    let [row, steps, list] = [(0..=15).collect(), vec![4, 6, 8, 10], vec![3, 7, 11]];
    for (job, indices) in (1..).zip([row, steps, list, vec![5]]) {
        let name = format!("it's {job}");
        let [script, _] =
            succeed(folder.path(), &many(&["-o", &name, "--keep", "none", "--script", "slurm"]));
        let count = indices.len();
        let start = |index: &i32| -> Child {
            let mut command = Command::new("bash");
            command.arg("-c").arg(&script).env("SLURM_ARRAY_JOB_ID", job.to_string());
            command.env("SLURM_ARRAY_TASK_ID", index.to_string()).env("SLURM_CPUS_PER_TASK", "1");
            command.env("SLURM_ARRAY_TASK_MIN", indices[0].to_string());
            command.env("SLURM_ARRAY_TASK_COUNT", count.to_string()).spawn().expect("bash starts")
        };
        // all at once, then some again, as tasks that are requeued
        for indices in [&indices[..], &indices[count / 2..]] {
            let tasks: Vec<Child> = indices.iter().map(start).collect();
            for mut task in tasks {
                assert!(task.wait().expect("an end").success(), "{indices:?}");
            }
        }
        let path = folder.path().join(&name);
        let done: usize =
            (1..=count).map(|i| lines(path.join(format!("manifest-{i}-of-{count}.jsonl")))).sum();
        assert_eq!(done, 120, "{indices:?}");
        succeed(folder.path(), &[&name, "--merge", "-q"]);
        assert!(summaries(&path) == whole, "{indices:?}");
    }
}

#[test]
fn texts_are_no_formulas_and_numbers_of_any_base_are_numbers() {
    let folder = folder();
    fs::write(
        folder.path().join("t.csv"),
        "mesh.cells,title\n0x10,=cmd|' /C calc'!A0\n1_7,@SUM(A1)\n0b10010,-x\n",
    )
    .expect("room");
    succeed(
        folder.path(),
        &["fig5", "--set", "record.frames=0", "--vary", "t.csv", "--keep", "none", "-o", "s", "-q"],
    );
    let summary = text(folder.path().join("s/summary.csv"));
    let rows: Vec<&str> = summary.lines().skip(1).collect();
    for (row, start) in rows.iter().zip(["1,16.0,'=cmd|", "2,17.0,'@SUM", "3,18.0,'-x,"]) {
        assert!(row.starts_with(start), "{row}");
    }
}

#[test]
fn a_dry_run_writes_nothing_and_a_script_only_the_sweep() {
    let folder = folder();
    let [said, _] = succeed(folder.path(), &many(&["-o", "s", "--dry-run"]));
    assert!(said.contains("cases      120\n") && said.contains("run time   about"), "{said}");
    assert!(!folder.path().join("s").exists());
    for (scheduler, expected) in [
        ("slurm", "#SBATCH --array=1-16"),
        ("hyperqueue", "#HQ --array 1-16"),
        ("gnu-parallel", "parallel --quote"),
    ] {
        let [script, _] = succeed(folder.path(), &many(&["-o", "s", "--script", scheduler]));
        assert!(script.starts_with("#!/bin/bash\n") && script.contains(expected), "{script}");
        let syntax = Command::new("bash").args(["-n", "-c", &script]).status().expect("bash starts");
        assert!(syntax.success(), "{script}");
    }
    let names: BTreeSet<_> = fs::read_dir(folder.path().join("s"))
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name())
        .collect();
    assert_eq!(names, BTreeSet::from(["manifest.jsonl".into(), "sweep.toml".into()]));
}
