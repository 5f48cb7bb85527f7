//! Runs that are killed or interrupted and continue, as processes, against runs that are not. Every test has its own folder.

use std::{
    collections::BTreeMap,
    fs,
    ops::Range,
    path::Path,
    process::{Child, Command, Output, Stdio},
    sync::Arc,
    thread::{self, sleep},
    time::{Duration, Instant},
};

use signal_hook::{consts::SIGHUP, flag};
use tempfile::TempDir;

/// Longest wait for a file.
const PATIENCE: Duration = Duration::from_secs(120);

/// Runs of both models, small, with all kinds of channels.
const CASES: [[&str; 7]; 3] = [
    [
        "fig5",
        "mesh.cells=30",
        "run.end_time=6",
        "record.points=[[0, 0.5]]",
        "record.lines=[{ r = 0 }]",
        "record.sensor=[{ r = 0.2 }, { r = 0.2, aperture = 0.1, band = [0.5, 4] }]",
        "record.frames=40",
    ],
    [
        "elastic-fig5",
        "mesh.cells=20",
        "run.end_time=6",
        "record.points=[[0, 0.5]]",
        "record.lines=[{ z = 0.5 }]",
        "record.sensor=[{ r = 2, quantity = \"velocity\" }]",
        "record.frames=40",
    ],
    [
        "coating",
        "impact.velocity=20 m/s",
        "mesh.cells=20",
        "run.end_time=1.5 us",
        "record.points=[[\"0 mm\", \"0.2 mm\"]]",
        "record.fields=[\"damage_ratio\"]",
        "record.frames=40",
    ],
];

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// `percuss run` of a case with settings, into `a.mcap`.
fn command(folder: &Path, case: &[&str], arguments: &[&str]) -> Command {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
    command.current_dir(folder).args(["run", case[0], "-o", "a.mcap"]);
    command.args(case[1..].iter().flat_map(|setting| ["--set", setting])).args(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

fn run(folder: &Path, case: &[&str], arguments: &[&str]) -> Output {
    command(folder, case, arguments).output().expect("the program starts")
}

fn succeed(folder: &Path, case: &[&str], arguments: &[&str]) -> String {
    let output = run(folder, case, arguments);
    let text = String::from_utf8(output.stderr).expect("messages are text");
    assert!(output.status.success(), "{arguments:?}: {text}");
    text
}

/// What is said of a run that fails.
fn refusal(folder: &Path, case: &[&str], arguments: &[&str]) -> String {
    let output = run(folder, case, arguments);
    let text = String::from_utf8(output.stderr).expect("messages are text");
    assert!(matches!(output.status.code(), Some(1 | 2)), "{arguments:?}: {}, {text}", output.status);
    text
}

/// Starts a run of two seconds at least, on any machine, with frequent checkpoints.
fn start(folder: &Path, case: &[&str], arguments: &[&str]) -> Child {
    let mut command =
        command(folder, case, &["--pace", "3", "--set", "run.checkpoint_every=0.05", "--quiet"]);
    command.args(arguments).spawn().expect("the program starts")
}

/// Waits until a file is there.
fn wait_for(path: &Path) {
    let start = Instant::now();
    while !path.exists() {
        assert!(start.elapsed() < PATIENCE, "{} does not come", path.display());
        sleep(Duration::from_millis(5));
    }
}

/// Starts a run and kills it some time after its first checkpoint.
fn kill(folder: &Path, case: &[&str], arguments: &[&str]) {
    let mut child = start(folder, case, arguments);
    wait_for(&folder.join("a.mcap.checkpoint"));
    sleep(Duration::from_millis(200));
    child.kill().expect("it runs");
    child.wait().expect("it has ended");
    assert!(!folder.join("a.mcap").exists());
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// A recording but for its host and where its chunks end.
#[derive(PartialEq)]
struct Contents {
    /// Topic, sequence, log and publish time, bytes.
    messages: Vec<(String, u32, u64, u64, Vec<u8>)>,
    metadata: BTreeMap<String, BTreeMap<String, String>>,
    attachments: BTreeMap<String, Vec<u8>>,
}

fn contents(path: &Path) -> Contents {
    let bytes = fs::read(path).expect("a recording");
    let summary = mcap::Summary::read(&bytes).expect("a sound file").expect("a summary");
    let messages = mcap::MessageStream::new(&bytes).expect("messages").map(|message| {
        let message = message.expect("a sound message");
        let topic = message.channel.topic.clone();
        (topic, message.sequence, message.log_time, message.publish_time, message.data.into_owned())
    });
    let metadata = summary.metadata_indexes.iter().map(|index| mcap::read::metadata(&bytes, index));
    let metadata =
        metadata.map(|record| record.expect("a record")).map(|record| (record.name, record.metadata));
    let attachments = summary.attachment_indexes.iter().map(|index| mcap::read::attachment(&bytes, index));
    let attachments = attachments.map(|record| record.expect("an attachment"));
    Contents {
        messages: messages.collect(),
        metadata: metadata.filter(|(name, _)| name != "percuss.host").collect(),
        attachments: attachments.map(|record| (record.name, record.data.into_owned())).collect(),
    }
}

/// Compares a recording with one that was never interrupted.
fn compare(expected: &Contents, path: &Path) {
    let found = contents(path);
    assert!(expected.messages.len() > 100);
    for (number, (expected, found)) in expected.messages.iter().zip(&found.messages).enumerate() {
        assert!(
            expected == found,
            "message {number}: {} {}, {} {}",
            expected.0,
            expected.1,
            found.0,
            found.1
        );
    }
    assert_eq!(expected.messages.len(), found.messages.len());
    assert_eq!(expected.metadata, found.metadata);
    assert!(expected.attachments == found.attachments);
}

/// The recording of a run that is not interrupted; the resolved case has all its settings.
fn expected(case: &[&str]) -> Contents {
    let folder = folder();
    succeed(folder.path(), case, &["--threads", "1", "--set", "run.checkpoint_every=0.05", "--quiet"]);
    contents(&folder.path().join("a.mcap"))
}

/// Continues a run to its end.
fn resume(folder: &Path, case: &[&str], threads: &str) -> String {
    succeed(folder, case, &["--resume", "--threads", threads, "--set", "run.checkpoint_every=0.05"])
}

#[test]
fn a_killed_run_continues_on_other_threads() {
    for (case, threads) in CASES.iter().zip(["3", "1", "2"]) {
        let (expected, folder) = (expected(case), folder());
        kill(folder.path(), case, &["--threads", "2"]);
        let text = refusal(folder.path(), case, &[]);
        assert!(text.contains("--resume") && text.contains("--force"), "{text}");
        // what a resumption that was killed has left
        fs::write(folder.path().join("a.mcap.part.new"), "half").expect("room");
        let text = resume(folder.path(), case, threads);
        assert!(text.contains("continues at step"), "{text}");
        compare(&expected, &folder.path().join("a.mcap"));
        assert_eq!(names(folder.path()), ["a.mcap"]);
        // once more
        assert!(resume(folder.path(), case, threads).contains("is complete"));
        compare(&expected, &folder.path().join("a.mcap"));
    }
}

#[test]
fn checkpoints_change_no_message() {
    for case in &CASES {
        let folder = folder();
        let mut seen = Vec::new();
        for every in ["0", "1e-9"] {
            let every = format!("run.checkpoint_every={every}");
            succeed(folder.path(), case, &["--force", "--set", &every]);
            assert_eq!(names(folder.path()), ["a.mcap"]);
            seen.push(contents(&folder.path().join("a.mcap")).messages);
        }
        assert!(seen[0] == seen[1]);
    }
}

/// Sends a signal to a run, which ends at once with a status.
fn interrupt(child: &mut Child, signal: &str, code: i32) {
    let start = Instant::now();
    let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status();
    assert!(sent.expect("kill").success());
    assert_eq!(child.wait().expect("it has ended").code(), Some(code));
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
}

#[test]
fn a_run_that_computes_is_interrupted_too() {
    let folder = folder();
    let long = ["fig5", "mesh.cells=400", "run.end_time=2000", "mesh.outer_radius=2", "record.frames=10"];
    let mut child = command(folder.path(), &long, &["--quiet"]).spawn().expect("the program starts");
    wait_for(&folder.path().join("a.mcap.part"));
    sleep(Duration::from_millis(300));
    interrupt(&mut child, "INT", 130);
}

#[test]
fn an_interrupted_run_continues_as_often_as_it_takes() {
    let case = &CASES[0];
    let (expected, folder) = (expected(case), folder());
    // what is handled here cannot be ignored in the programs started here, as it would be under `nohup`
    flag::register(SIGHUP, Arc::default()).expect("a handler");
    // with a checkpoint at the interruption only
    for (signal, code) in [("INT", 130), ("TERM", 143), ("HUP", 129)] {
        let first = if signal == "INT" { &[][..] } else { &["--resume"] };
        let mut command = command(folder.path(), case, &["--pace", "3", "--set", "run.checkpoint_every=0"]);
        let mut child = command.args(first).spawn().expect("the program starts");
        wait_for(&folder.path().join("a.mcap.part"));
        sleep(Duration::from_millis(300));
        interrupt(&mut child, signal, code);
        assert_eq!(names(folder.path()), ["a.mcap.checkpoint", "a.mcap.part"]);
        let part = contents(&folder.path().join("a.mcap.part"));
        let status = &part.metadata["percuss.status"];
        assert_eq!(status["status"], "interrupted");
        assert_eq!(status["message"], format!("interrupted by SIG{signal}"));
        let steps = part.messages.iter().filter(|(topic, ..)| topic == "/drag").count();
        assert_eq!((steps - 1).to_string(), status["last_step"], "every step that was done is there");
    }
    resume(folder.path(), case, "2");
    compare(&expected, &folder.path().join("a.mcap"));
}

#[test]
fn a_run_that_is_killed_at_any_instant_continues() {
    // side by side: they wait most of the time
    thread::scope(|scope| {
        let runs = (0..).zip(&CASES).map(|(seed, case)| scope.spawn(move || kill_at_any_instant(seed, case)));
        runs.collect::<Vec<_>>().into_iter().for_each(|run| run.join().expect("it continues"));
    });
}

fn kill_at_any_instant(seed: u64, case: &[&str]) {
    let (expected, folder) = (expected(case), folder());
    let (part, checkpoint) = (folder.path().join("a.mcap.part"), folder.path().join("a.mcap.checkpoint"));
    let mut noise = seed + 1;
    for attempt in 1.. {
        let threads = (1 + attempt % 3).to_string();
        // so early that there may be nothing, no checkpoint, or a copy under way; ever later, so that it ends
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let instant = Duration::from_millis((noise >> 33) % (80 * attempt));
        let can_resume = part.exists() && checkpoint.exists();
        let how = if can_resume { "--resume" } else { "--force" };
        let mut child = start(folder.path(), case, &[how, "--threads", &threads]);
        sleep(instant);
        child.kill().expect("a process");
        let status = child.wait().expect("it has ended");
        if folder.path().join("a.mcap").exists() && !part.exists() {
            break;
        }
        assert!(!status.success() && status.code().is_none(), "{status}, attempt {attempt}");
    }
    compare(&expected, &folder.path().join("a.mcap"));
    assert!(!folder.path().join("a.mcap.part.new").exists());
}

/// The first chunk of a recording: its record.
fn first_chunk(bytes: &[u8]) -> Range<usize> {
    const CHUNK: u8 = 6;
    let mut start = 8;
    loop {
        let length = u64::from_le_bytes(bytes[start + 1..start + 9].try_into().expect("eight bytes"));
        let end = start + 9 + length as usize;
        if bytes[start] == CHUNK {
            return start..end;
        }
        start = end;
    }
}

#[test]
fn what_cannot_continue_is_refused_and_stays() {
    let case = &CASES[0];
    let folder = folder();
    let [part, checkpoint] = ["a.mcap.part", "a.mcap.checkpoint"].map(|name| folder.path().join(name));
    kill(folder.path(), case, &[]);
    let whole = [&part, &checkpoint].map(|path| fs::read(path).expect("a file"));
    let refused = |settings: &[&str], part_now: &[u8], checkpoint_now: &[u8]| {
        fs::write(&part, part_now).expect("room");
        fs::write(&checkpoint, checkpoint_now).expect("room");
        let text = refusal(folder.path(), case, &[&["--resume"], settings].concat());
        assert!(fs::read(&part).expect("it stays") == part_now, "{text}");
        assert_eq!(names(folder.path()), ["a.mcap.checkpoint", "a.mcap.part"], "{text}");
        text
    };
    let [sound, state] = &whole;
    let text = refused(&["--set", "mesh.cells=31"], sound, state);
    assert!(text.contains("mesh.cells is 30 there, 31 here"), "{text}");
    let text = refused(&["--engine", "reference"], sound, state);
    assert!(text.contains("--engine blocked"), "{text}");
    let other = self::folder();
    kill(other.path(), &[&case[..], &["target.shear_wave_speed=0.45"]].concat(), &[]);
    let part_of_another = fs::read(other.path().join("a.mcap.part")).expect("a part");
    let text = refused(&[], &part_of_another, state);
    assert!(text.contains("target.shear_wave_speed is 0.45 there, 0.5 here"), "{text}");
    let mut flipped = state.clone();
    flipped[state.len() / 2] ^= 4;
    let text = refused(&[], sound, &flipped);
    assert!(text.contains("is damaged"), "{text}");
    let text = refused(&[], &[], state);
    assert!(text.contains("cannot continue"), "{text}");
    // the head is there, the messages are not
    let text = refused(&[], &sound[..sound.len() / 4], state);
    assert!(text.contains("cannot continue `a.mcap.part`"), "{text}");
    let chunk = first_chunk(sound);
    for place in [chunk.start + 3, chunk.start + 60, (chunk.start + chunk.end) / 2, chunk.end - 1] {
        let mut flipped = sound.clone();
        flipped[place] ^= 4;
        let text = refused(&[], &flipped, state);
        assert!(text.contains("cannot continue `a.mcap.part`"), "{place} of {chunk:?}: {text}");
    }
    fs::write(&part, sound).expect("room");
    fs::write(&checkpoint, state).expect("room");
    resume(folder.path(), case, "1");
    compare(&expected(case), &folder.path().join("a.mcap"));
}

#[test]
fn one_command_serves_the_first_start_and_all_others() {
    let case = &CASES[0];
    let (folder, expected) = (folder(), expected(case));
    let [whole, part, checkpoint] =
        ["a.mcap", "a.mcap.part", "a.mcap.checkpoint"].map(|name| folder.path().join(name));
    // nothing there; killed before the first checkpoint; killed before the case was written
    let mut left = None;
    for length in [None, Some(usize::MAX), Some(0)] {
        if let Some(length) = length {
            let recorded: &Vec<u8> = left.as_ref().expect("a recording");
            fs::remove_file(&whole).expect("it is there");
            fs::write(&part, &recorded[..length.min(recorded.len() / 4)]).expect("room");
        }
        resume(folder.path(), case, "2");
        compare(&expected, &whole);
        assert_eq!(names(folder.path()), ["a.mcap"]);
        left = Some(fs::read(&whole).expect("a recording"));
    }
    // what is complete stays
    let before = fs::metadata(&whole).and_then(|metadata| metadata.modified()).expect("a time");
    assert!(resume(folder.path(), case, "1").contains("is complete"));
    assert_eq!(fs::metadata(&whole).and_then(|metadata| metadata.modified()).expect("a time"), before);
    // that of another case, complete or not, is refused and stays
    let other = ["--resume", "--set", "mesh.cells=31"];
    for (from, to) in [(&whole, &whole), (&whole, &part)] {
        fs::rename(from, to).expect("room");
        let text = refusal(folder.path(), case, &other);
        assert!(text.contains("mesh.cells is 30 there, 31 here") && text.contains("--force"), "{text}");
        assert_eq!(fs::read(to).ok(), left);
    }
    fs::rename(&part, &whole).expect("room");
    fs::write(&whole, "a file").expect("room");
    let text = refusal(folder.path(), case, &["--resume"]);
    assert!(text.contains("has none that can be read"), "{text}");
    assert!(!part.exists() && !checkpoint.exists());
}

#[test]
fn bounces_go_on_at_the_impact_that_is_missing() {
    let case = [
        "ball",
        "run.bounces=3",
        "run.end_time=300us",
        "mesh.contact_cells=8",
        "target.thickness=half-space",
        "record.frames=0",
    ];
    let whole = folder();
    let text = succeed(whole.path(), &case, &[]);
    assert!(text.contains("flight between impacts is jumped over"), "{text}");
    let all = ["a-1.mcap", "a-2.mcap", "a-3.mcap", "a-bounces.csv"];
    assert_eq!(names(whole.path()), all);
    let table = fs::read_to_string(whole.path().join(all[3])).expect("a table");
    let (head, rows) = table.split_once('\n').expect("a head");
    assert_eq!(head, "impact,velocity [m/s],peak_force [N],contact_duration [s],restitution");
    let rows: Vec<[f64; 5]> = rows
        .lines()
        .map(|row| {
            let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("a number")).collect();
            cells.try_into().expect("five columns")
        })
        .collect();
    assert_eq!(rows.len(), 3);
    assert!((rows[0][1] - 5.0).abs() < 1e-12, "{table}");
    for pair in rows.windows(2) {
        let [_, velocity, force, duration, e] = pair[0];
        assert!((pair[1][1] / (velocity * e) - 1.0).abs() < 1e-12 && e < 1.0, "{table}");
        // slower: less force, longer contact
        assert!(pair[1][2] < force && pair[1][3] > duration, "{table}");
    }
    // interrupted in the second impact: of each 2 s
    let part = folder();
    let arguments = ["--pace", "1", "--set", "run.checkpoint_every=0.05", "--quiet"];
    let mut child = command(part.path(), &case, &arguments).spawn().expect("the program starts");
    wait_for(&part.path().join("a-2.mcap.part"));
    sleep(Duration::from_millis(200));
    interrupt(&mut child, "INT", 130);
    assert_eq!(names(part.path()), ["a-1.mcap", "a-2.mcap.checkpoint", "a-2.mcap.part"]);
    let text = resume(part.path(), &case, "2");
    assert!(text.contains("`a-1.mcap` is complete") && text.contains("continues at step"), "{text}");
    assert_eq!(names(part.path()), all);
    assert_eq!(fs::read_to_string(part.path().join(all[3])).expect("a table"), table);
    // an impact that is cut off
    let cut = [&case[..], &["run.end_time=100us"]].concat();
    let text = refusal(folder().path(), &cut, &[]);
    assert!(text.contains("impact 1 of 3") && text.contains("run.end_time = 100.0 µs"), "{text}");
}
