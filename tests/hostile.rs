//! Hostile texts: far too long, or commands to what shows them. As processes, with little memory.

use std::{
    fs::{self, File},
    path::Path,
    process::{Command, Output, Stdio},
    time::{Duration, Instant},
};

use tempfile::TempDir;

/// Memory that a process may have \[KiB\]; twenty times less than what the texts here once took.
const MEMORY: u64 = 1 << 20;

/// Longest time of a refusal, on any machine.
const LONGEST: Duration = Duration::from_secs(20);

/// The sections of a small case.
const CASE: &str = "[target]\nthickness = 1.0\nshear_wave_speed = 0.5\n[indenter]\nshape = \"flat\"\nradius = 1.0\n\
                    [mesh]\ncells = 10\n[run]\nend_time = 0.5\n";

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Runs the program with little memory.
fn percuss(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new("sh");
    command.arg("-c").arg(format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\""));
    command.arg(assert_cmd::cargo::cargo_bin!("percuss")).args(arguments).current_dir(folder);
    let start = Instant::now();
    let output = command.stdin(Stdio::null()).output().expect("the program starts");
    assert!(start.elapsed() < LONGEST, "{arguments:?}: {:?}", start.elapsed());
    output
}

/// What is said of a refusal as an invalid case or usage; nothing is written.
fn refusal(folder: &Path, arguments: &[&str]) -> String {
    let count = || fs::read_dir(folder).expect("a folder").count();
    let before = count();
    let output = percuss(folder, arguments);
    let text = String::from_utf8(output.stderr).expect("messages are text");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    assert_eq!(count(), before, "{arguments:?}: {text}");
    text
}

#[test]
fn many_problems_are_counted() {
    let folder = folder();
    let keys: String = (0..80_000).map(|i| format!("k{i:05} = 1\n")).collect();
    fs::write(folder.path().join("keys.toml"), keys + CASE).expect("room");
    for verb in ["check", "run", "exact", "study", "layout"] {
        let text = refusal(folder.path(), &[verb, "keys.toml", "--set", "mesh.cells=many"]);
        assert!(
            text.contains("80001 problems") && text.contains("and 79951 more problems"),
            "{verb}: {text}"
        );
        // the first of the text, each with its line
        assert!(text.contains("[keys.toml:50:1]") && !text.contains("[keys.toml:51:1]"), "{verb}: {text}");
        assert!(text.len() < 50_000, "{verb}: {} bytes", text.len());
    }
    let vary: String = (1..=1000).map(|mass| format!("{mass},")).collect();
    let vary = format!("indenter.mass={}", vary.trim_end_matches(','));
    let text = refusal(folder.path(), &["sweep", "keys.toml", "--vary", &vary]);
    assert!(text.contains("80000 problems") && text.len() < 50_000, "{text}");
    // values and keys of any length are cut, a line of any length is shown around its place
    let long = "x".repeat(5_000_000);
    fs::write(folder.path().join("long.toml"), format!("title = [\"{long}\"]\n\"{long}\" = 1\n{CASE}"))
        .expect("room");
    let text = refusal(folder.path(), &["check", "long.toml"]);
    assert!(text.contains("`title` =") && text.contains("unknown key") && text.contains("xxx…`"), "{text}");
    assert!(text.contains("[long.toml:1:9]") && text.contains("[long.toml:2:1]"), "{} bytes", text.len());
    assert!(text.len() < 20_000, "{} bytes", text.len());
    // settings count from their own beginning, however many there are
    let settings: Vec<String> = (0..2000).map(|i| format!("mesh.cells={}", i + 10)).collect();
    let set = settings.iter().flat_map(|setting| ["--set", setting]).chain(["--set", "mesh.kind=odd"]);
    let text = refusal(folder.path(), &["check", "fig5"].into_iter().chain(set).collect::<Vec<_>>());
    assert!(text.contains("[--set:1:11]") && text.contains("mesh.kind=\"odd\""), "{text}");
}

#[test]
fn what_is_no_text_of_a_person_is_refused_unread() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    File::create(path("huge.toml")).and_then(|file| file.set_len(1 << 40)).expect("a file with a hole");
    fs::create_dir(path("folder.toml")).expect("room");
    fs::write(path("latin.toml"), b"# caf\xe9\n").expect("room");
    assert!(percuss(folder.path(), &["run", "fig5", "--set", "run.end_time=0.1", "-q"]).status.success());
    let fifo = Command::new("mkfifo").arg(path("pipe.toml")).status().expect("mkfifo");
    assert!(fifo.success());
    let kinds = [
        ("huge.toml", "is longer than 16 MiB"),
        ("folder.toml", "is a folder"),
        ("latin.toml", "byte 0xe9 in line 1 is not valid UTF-8"),
        ("fig5.mcap", "is a recording (MCAP)"),
        ("pipe.toml", "is a pipe"),
    ];
    for (name, expected) in kinds {
        for verb in ["check", "run", "exact", "study", "layout"] {
            let text = refusal(folder.path(), &[verb, name]);
            assert!(text.contains(expected) && text.contains(name), "{verb} {name}: {text}");
        }
        let profile = format!("indenter.file={name}");
        let profile =
            refusal(folder.path(), &["check", "fig5", "--set", "indenter.shape=profile", "--set", &profile]);
        assert!(profile.contains(expected) && profile.contains(name), "{profile}");
        let table = refusal(folder.path(), &["sweep", "fig5", "--vary", name]);
        assert!(table.contains(expected) && table.contains(name), "{table}");
    }
    assert!(refusal(folder.path(), &["run", "fig5.mcap"]).contains("percuss-read"));
    for name in ["huge.toml", "latin.toml", "fig5.mcap"] {
        assert!(refusal(folder.path(), &["sweep", name, "--vary", "indenter.mass=1,2"]).contains(name));
    }
    let name = "n".repeat(100_000);
    assert!(refusal(folder.path(), &["check", &name]).len() < 2000);
}

/// Commands to a terminal, and to the machine that runs a job.
const WICKED: &str = "t\n::error::w\u{1b}[2J\u{9b}1m\u{202e}\r##[error]\u{200b}";

/// Panics if a text commands what shows it.
fn assert_harmless(arguments: &[&str], text: &str) {
    let is_command =
        |c: char| (c.is_control() && !matches!(c, '\n' | '\t')) || "\u{202e}\u{200b}".contains(c);
    assert!(!text.contains(is_command), "{arguments:?}: {text:?}");
    let is_job = |line: &str| line.trim_start().starts_with("::") || line.contains("##[");
    assert!(!text.lines().any(is_job), "{arguments:?}: {text:?}");
}

#[test]
fn text_from_files_commands_nothing() {
    let folder = folder();
    let title: String = WICKED.chars().map(|c| format!("\\U{:08X}", u32::from(c))).collect();
    fs::write(folder.path().join("a.toml"), format!("title = \"{title}\"\n{CASE}")).expect("room");
    let keys = format!("\"{title}\" = \"{title}\"\nmodel = \"{title}\"\n# \u{202e}\u{200b}\nmesh.x = 1\n");
    fs::write(folder.path().join("keys.toml"), keys + CASE).expect("room");
    // a control character in the text itself is an error of syntax, which shows it
    fs::write(folder.path().join("raw.toml"), format!("title = \"{WICKED}\"\n{CASE}")).expect("room");
    let sweep = format!("case = \"fig5\"\n[[vary]]\nkey = \"{title}\"\nvalues = [1, 2]\n");
    fs::write(folder.path().join("sweep.toml"), sweep).expect("room");
    fs::write(folder.path().join("syntax.toml"), format!("vary = [\"{WICKED}")).expect("room");
    fs::write(folder.path().join("vary.csv"), format!("\"{WICKED}\"\n1\n")).expect("room");
    let named = format!("{WICKED}.toml");
    fs::write(folder.path().join(&named), format!("{CASE}x = 1\n")).expect("room");
    let output = format!("{WICKED}.mcap");
    let (prescribed, short) = ("impact.contact=prescribed", "run.end_time=0.1");
    let all: [&[&str]; 20] = [
        &["check", "a.toml"],
        &["check", "a.toml", "--json"],
        &["check", "a.toml", "--resolved"],
        &["run", "a.toml"],
        &["run", "a.toml"],
        &["run", "a.toml", "-o", &output],
        &["run", "a.toml", "-o", &output, "--resume"],
        &["run", "fig5", "-o", &output, "--resume"],
        &["exact", "a.toml", "--set", prescribed],
        &["study", "a.toml", "--set", short],
        &["layout", "a.toml"],
        &["layout", "a.toml", "--viewer", "plotjuggler"],
        &["check", "keys.toml"],
        &["check", "keys.toml", "--json"],
        &["check", "raw.toml"],
        &["check", &named],
        &["check", "fig5", "--set", &output],
        &["sweep", "sweep.toml"],
        &["sweep", "syntax.toml"],
        &["sweep", "fig5", "--vary", "vary.csv"],
    ];
    for arguments in all {
        let output = percuss(folder.path(), arguments);
        let [stdout, stderr] =
            [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("text"));
        assert!(!stdout.is_empty() || !stderr.is_empty(), "{arguments:?}");
        assert_harmless(arguments, &stdout);
        assert_harmless(arguments, &stderr);
        match arguments {
            ["check", "a.toml"] => assert!(stdout.contains("a.toml: t\\n::error::w\\u{1b}[2J"), "{stdout}"),
            ["check", "a.toml", "--resolved"] => {
                // data is the same
                let table: toml::Table = stdout.parse().expect("TOML");
                assert_eq!(table["title"].as_str(), Some(WICKED));
            }
            ["check" | "layout", "a.toml", ..] if stdout.starts_with('{') => {
                let document: serde_json::Value = serde_json::from_str(&stdout).expect("JSON");
                assert!(document.to_string().contains("::error::w"), "{document}");
            }
            _ => {}
        }
    }
}

#[test]
fn a_name_fits_or_is_refused_before_the_run() {
    let folder = folder();
    let mut fitted = Vec::new();
    for length in 225..=260 {
        let name = "n".repeat(length - 5) + ".mcap";
        let output = percuss(
            folder.path(),
            &["run", "fig5", "--set", "mesh.cells=10", "--set", "run.end_time=0.1", "-o", &name],
        );
        let text = String::from_utf8(output.stderr).expect("text");
        let names: Vec<_> = fs::read_dir(folder.path()).expect("a folder").collect();
        if output.status.success() {
            assert!(names.len() == 1 && folder.path().join(&name).exists(), "{length}: {text}");
            assert!(!text.contains("without it"), "{length}: {text}");
            fs::remove_file(folder.path().join(&name)).expect("it is there");
            fitted.push(length);
        } else {
            assert!(
                names.is_empty() && text.starts_with("error: ") && text.lines().count() == 1,
                "{length}: {text}"
            );
            assert!(text.contains("too long"), "{length}: {text}");
        }
    }
    // with .checkpoint.part within the 255 bytes of file systems
    assert_eq!(fitted, (225..=239).collect::<Vec<_>>());
}

#[test]
fn a_value_with_a_dash_has_a_tip_that_works() {
    let folder = folder();
    let run = ["run", "fig5", "--set", "mesh.cells=10", "--set", "run.end_time=0.1"];
    let text = refusal(folder.path(), &[&run[..], &["-o", "-dash.mcap"]].concat());
    assert!(text.contains("to pass '-dash.mcap' as a value, write '-o=-dash.mcap'"), "{text}");
    let output = percuss(folder.path(), &[&run[..], &["-o=-dash.mcap"]].concat());
    assert!(output.status.success() && folder.path().join("-dash.mcap").exists());
}
