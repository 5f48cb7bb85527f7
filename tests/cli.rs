//! The `percuss` program as a process: exit statuses, messages, files. Every test has its own folder.

use std::{
    fs,
    path::Path,
    process::{Command, Output, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn percuss(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
    command.current_dir(folder).args(arguments).env_remove("NO_COLOR").stdin(Stdio::null());
    command.output().expect("the program starts")
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).expect("messages are text")
}

fn recordings(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    names.map(|name| name.to_string_lossy().into_owned()).filter(|name| name.ends_with(".mcap")).collect()
}

/// A small valid case; tests replace lines of it.
const GOOD: &str = "\
title = \"a test\"
model = \"rakhmatulin\"
geometry = \"axisymmetric\"
[target]
thickness = 1.0
shear_wave_speed = 0.5
[indenter]
shape = \"flat\"
radius = 1.0
mass = inf
[impact]
velocity = 1.0
contact = \"unilateral\"
[mesh]
kind = \"matched\"
cells = 20
[run]
end_time = 1.0
stop = \"never\"
[record]
interface_every = 1
probes = [0.0, 0.5]
fields = [\"stress\"]
frames = 3
compression = \"zstd\"
playback_rate = 1.0
";

#[test]
fn both_engines_run_a_good_case() {
    let folder = folder();
    fs::write(folder.path().join("good.toml"), GOOD).expect("a file");
    let run = |engine: &str, name: &str| {
        let output = percuss(folder.path(), &["run", "good.toml", "--engine", engine, "-o", name]);
        assert!(output.stdout.is_empty(), "talk belongs on stderr");
        (output.status.code(), stderr(&output))
    };
    for engine in ["blocked", "reference"] {
        let name = format!("{engine}.mcap");
        let (status, messages) = run(engine, &name);
        assert_eq!(status, Some(0), "{messages}");
        assert!(messages.contains("completed"), "{messages}");
    }
    // a layer on the matched mesh has λ = 1: the same drag, bit by bit
    let drag = |name: &str| -> Vec<Vec<u8>> {
        let bytes = fs::read(folder.path().join(name)).expect("a recording");
        let messages = mcap::MessageStream::new(&bytes).expect("a sound file");
        let messages = messages.map(|message| message.expect("a sound message"));
        messages.filter(|message| message.channel.topic == "/drag").map(|m| m.data.to_vec()).collect()
    };
    assert!(drag("blocked.mcap").len() > 10);
    assert_eq!(drag("blocked.mcap"), drag("reference.mcap"));
    let (status, messages) = run("fast", "fast.mcap");
    assert_eq!(status, Some(2), "{messages}");
    assert!(messages.contains("fast") && messages.contains("reference"), "{messages}");
}

#[test]
fn bad_cases_are_refused_with_all_problems_where_they_are() {
    let folder = folder();
    let text = GOOD.replace("radius", "raduis").replace("cells = 20", "cells = 0");
    let text = text.replace("= 1.0\ncontact", "= -1\ncontact");
    // a byte order mark and Windows line ends do not shift places
    for (start, end) in [("", "\n"), ("\u{feff}", "\r\n")] {
        fs::write(folder.path().join("bad.toml"), format!("{start}{}", text.replace('\n', end)))
            .expect("a file");
        for verb in ["check", "run"] {
            let output = percuss(folder.path(), &[verb, "bad.toml", "--set", "run.end_time=nan"]);
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(2));
            for part in [
                "5 problems",
                "unknown key `indenter.raduis`",
                "[bad.toml:9:",
                "`indenter.radius` is missing",
                "`impact.velocity` = -1",
                "[bad.toml:12:",
                "`mesh.cells` = 0",
                "[bad.toml:16:",
                "[--set:1:",
            ] {
                assert!(message.contains(part), "{part}: {message}");
            }
        }
    }
    assert_eq!(recordings(folder.path()), Vec::<String>::new());
}

#[test]
fn files_that_are_no_cases() {
    let folder = folder();
    let contents: [(&str, &[u8], &str); 4] = [
        ("empty.toml", b"", "`target.thickness` is missing"),
        ("blank.toml", b"\xef\xbb\xbf\r\n", "`indenter.shape` is missing"),
        ("bytes.toml", b"title = \"\n\n\xff\"", "line 3"),
        ("prose.toml", b"once upon a time", "prose.toml:1:"),
    ];
    for (name, bytes, expected) in contents {
        fs::write(folder.path().join(name), bytes).expect("a file");
        let output = percuss(folder.path(), &["run", name]);
        assert_eq!(output.status.code(), Some(2), "{name}");
        assert!(stderr(&output).contains(expected), "{name}: {}", stderr(&output));
    }
    let output = percuss(folder.path(), &["run", "fig55"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("fig5-plane"), "the built-in cases are named: {}", stderr(&output));
    assert_eq!(recordings(folder.path()), Vec::<String>::new());
}

#[test]
fn invalid_arguments_are_refused() {
    let folder = folder();
    for arguments in [
        &["run", "fig5", "--set", "mesh.cells"] as &[&str],
        &["run", "fig5", "--threads", "0"],
        &["run", "fig5", "--threads", "100000"],
        &["run"],
        &["fly"],
    ] {
        let output = percuss(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(!output.stderr.is_empty());
    }
    assert_eq!(recordings(folder.path()), Vec::<String>::new());
}

#[test]
fn existing_outputs_are_kept_unless_forced() {
    let folder = folder();
    let path = folder.path().join("fig5.mcap");
    fs::write(&path, "precious").expect("a file");
    let arguments = ["run", "fig5", "--set", "mesh.cells=20"];
    let output = percuss(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("--force"));
    assert_eq!(fs::read(&path).expect("the file"), b"precious");
    // an invalid case does not touch the output either
    let output = percuss(folder.path(), &["run", "fig5", "--force", "--set", "mesh.cells=0"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read(&path).expect("the file"), b"precious");
    let output = percuss(folder.path(), &[&arguments as &[&str], &["--force", "--quiet"]].concat());
    assert!(output.status.success());
    assert!(output.stderr.is_empty(), "--quiet prints nothing");
    assert!(fs::read(&path).expect("the file").starts_with(mcap::MAGIC));
}

#[test]
fn a_case_file_is_never_its_own_output() {
    let folder = folder();
    let path = folder.path().join("good.toml");
    fs::write(&path, GOOD).expect("a file");
    let output = percuss(folder.path(), &["run", "good.toml", "-o", "./good.toml", "--force"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(fs::read_to_string(&path).expect("the file"), GOOD);
}

#[test]
fn recordings_are_not_named_like_other_files() {
    let folder = folder();
    for verb in ["run", "exact"] {
        for name in ["a.csv", "a.h5", "a.mcap.gz"] {
            let output = percuss(folder.path(), &[verb, "fig6a", "-o", name]);
            assert_eq!(output.status.code(), Some(2));
            assert!(stderr(&output).contains("recordings are .mcap"), "{}", stderr(&output));
            assert!(!folder.path().join(name).exists());
        }
    }
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = folder();
    fs::create_dir(folder.path().join("taken.mcap")).expect("a folder");
    for (output, expected) in [("nowhere/a.mcap", "nowhere/a.mcap"), ("taken.mcap", "taken.mcap")] {
        let output = percuss(folder.path(), &["run", "fig5", "--force", "-o", output]);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    }
    // a device that is always full
    if cfg!(target_os = "linux") {
        let output = percuss(folder.path(), &["run", "fig5", "--force", "-o", "/dev/full"]);
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("the file is incomplete"), "{}", stderr(&output));
        assert!(!stderr(&output).contains("completed"), "{}", stderr(&output));
    }
}

#[test]
fn a_ball_and_its_height_of_fall_give_its_force() {
    let folder = folder();
    let of = |verb: &str, more: &[&str]| {
        let settings = [
            "target.material=steel",
            "indenter.diameter=62.4 mm",
            "impact.drop=0.5 m",
            "target.thickness=half-space",
        ];
        let settings = settings.iter().flat_map(|setting| ["--set", setting]);
        let arguments = [verb, "ball"].into_iter().chain(settings).chain(more.iter().copied());
        percuss(folder.path(), &arguments.collect::<Vec<_>>())
    };
    let check = String::from_utf8(of("check", &[]).stdout).expect("text");
    for row in [
        "impact     by Hertz with the moduli of both bodies: peak force 67.13 kN",
        "yield      first by von Mises",
    ] {
        assert!(check.contains(row), "{check}");
    }
    // that of both moduli is computed: there is no other
    let gives = String::from_utf8(of("check", &["--set", "indenter.body=elastic"]).stdout).expect("text");
    assert_eq!([&check, &gives].map(|text| text.matches("by Hertz").count()), [2, 1], "{gives}");
    let json: serde_json::Value = serde_json::from_slice(&of("check", &["--json"]).stdout).expect("JSON");
    let force = |of: &str| json[of]["peak_force"].as_f64().expect("a force");
    // of the same moduli: 2^(2/5)
    assert!((force("hertz") / force("impact") / 2f64.powf(0.4) - 1.0).abs() < 1e-12, "{json}");
    let run = of(
        "run",
        &["--set", "indenter.body=elastic", "--set", "mesh.contact_cells=8", "--set", "record.frames=0"],
    );
    assert!(
        stderr(&run).contains("\npeak force 68.37 kN at t = 84.50 µs, contact 168.0 µs"),
        "{}",
        stderr(&run)
    );
}

#[test]
fn several_bounces_are_of_runs_alone() {
    let folder = folder();
    for command in [
        &["exact", "ball"][..],
        &["study", "ball"],
        &["check", "ball", "--admissible"],
        &["fit", "ball", "--to", "contact_duration=95 us", "--vary", "target.thickness=5 mm:15 mm"],
        &["sweep", "ball", "--vary", "indenter.mass=1 g,2 g"],
        &["run", "ball", "--live"],
    ] {
        let output = percuss(folder.path(), &[command, &["--set", "run.bounces=2"]].concat());
        assert_eq!(output.status.code(), Some(2), "{command:?}");
        assert!(stderr(&output).contains("run.bounces"), "{}", stderr(&output));
    }
    let check = percuss(folder.path(), &["check", "ball", "--set", "run.bounces=2"]);
    assert!(String::from_utf8_lossy(&check.stdout).contains("\nbounces    2 impacts"));
}

#[test]
fn the_width_of_fields_is_reported() {
    let folder = folder();
    let [narrow, whole] = ["--", "--set=record.r_max=inf"].map(|more| {
        let more = ["--set=mesh.cells=50", more].into_iter().filter(|more| *more != "--");
        let check =
            percuss(folder.path(), &["check", "ball"].into_iter().chain(more.clone()).collect::<Vec<_>>());
        let json = ["check", "ball", "--json"].into_iter().chain(more).collect::<Vec<_>>();
        let json = percuss(folder.path(), &json).stdout;
        let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        (String::from_utf8(check.stdout).expect("text"), json)
    });
    assert!(narrow.0.contains("section    to r = 64.56 mm of 558.0 mm (record.r_max)"), "{}", narrow.0);
    assert!(!whole.0.contains("section "), "{}", whole.0);
    let [narrow, whole] = [narrow.1, whole.1];
    assert!(narrow["case"]["record"]["r_max"].as_str().is_some_and(|r| r.starts_with("0.0645")));
    assert_eq!(narrow["estimate"]["whole_file_bytes"], whole["estimate"]["file_bytes"]);
    assert!(whole["estimate"]["whole_file_bytes"].is_null());
    let bytes = |value: &serde_json::Value| value["estimate"]["file_bytes"].as_u64().expect("a number");
    assert!(2 * bytes(&narrow) < bytes(&whole));
    let said = |more: &[&str]| {
        let settings = ["run.end_time=2 us", "mesh.outer_radius=300 mm", "mesh.cells=50"]
            .map(|setting| ["--set", setting])
            .concat();
        stderr(&percuss(folder.path(), &[&["run", "ball", "--force"], &settings[..], more].concat()))
    };
    assert!(
        said(&[]).contains("to r = ") && said(&[]).contains("--set record.r_max=inf shows all"),
        "{}",
        said(&[])
    );
    assert!(!said(&["--set", "record.r_max=100 mm"]).contains("shows all"));
}

#[test]
fn the_default_density_of_fields_is_reported() {
    let folder = folder();
    let many = ["--set", "record.frames=600", "--set", "run.end_time=12"];
    let run =
        |more: &[&str]| percuss(folder.path(), &[&["run", "fig5", "--force"], &many[..], more].concat());
    let check = percuss(folder.path(), &[&["check", "fig5"], &many[..]].concat());
    let table = String::from_utf8(check.stdout).expect("text");
    assert!(
        table.contains("600 of stress, at one node in 2 along r and along z (record.field_every)"),
        "{table}"
    );
    let downsampled = stderr(&run(&[]));
    assert!(
        downsampled
            .contains("fields show one node in 2 along r and along z; --set record.field_every=1 shows all"),
        "{downsampled}"
    );
    for every in ["1", "5"] {
        let asked = stderr(&run(&["--set", &format!("record.field_every={every}")]));
        assert!(asked.contains("completed") && !asked.contains("fields show"), "{asked}");
    }
}

#[test]
fn problems_are_json_with_their_places() {
    let folder = folder();
    fs::write(folder.path().join("bad.toml"), GOOD.replace("cells", "sells")).expect("a file");
    let output = percuss(folder.path(), &["check", "bad.toml", "--json", "--set", "run.end_time=-1"]);
    assert_eq!(output.status.code(), Some(2));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!((&json["valid"], &json["more"]), (&false.into(), &0.into()));
    let [key, value] = &json["problems"].as_array().expect("a list")[..] else { panic!("{json}") };
    assert_eq!(key["message"], "unknown key `mesh.sells`");
    assert!(key["help"].as_str().is_some_and(|help| help.contains("`mesh.cells`")), "{json}");
    let line = 1 + GOOD[..GOOD.find("cells").expect("the key")].matches('\n').count();
    assert_eq!(key["place"], serde_json::json!({ "text": "bad.toml", "line": line, "column": 1 }));
    assert_eq!(value["place"], serde_json::json!({ "text": "--set", "line": 1, "column": 14 }));
    let json = |case| serde_json::from_slice(&percuss(folder.path(), &["check", case, "--json"]).stdout);
    let json: serde_json::Value = json("none.toml").expect("JSON");
    assert!(json["problems"][0]["place"].is_null(), "{json}");
}

#[test]
fn check_estimates_the_bytes_of_a_run() {
    let folder = folder();
    let output = percuss(folder.path(), &["check", "fig5", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(json["sizes"]["steps"], 300);
    assert_eq!(json["sizes"]["nz"], 50);
    assert_eq!(json["case"]["mesh"]["cells"], 100);
    let estimate = json["estimate"]["message_bytes"].as_f64().expect("a number");

    // the resolved case is a case, and its own resolved case
    let resolved = percuss(folder.path(), &["check", "fig5", "--resolved"]);
    fs::write(folder.path().join("full.toml"), &resolved.stdout).expect("a file");
    let again = percuss(folder.path(), &["check", "full.toml", "--resolved"]);
    assert_eq!(resolved.stdout, again.stdout);

    // without compression the file is as large as its messages, within 10 %
    let output = percuss(folder.path(), &["run", "full.toml", "--set", "record.compression=none"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let size = fs::metadata(folder.path().join("full.mcap")).expect("the recording").len() as f64;
    assert!((size / estimate - 1.0).abs() < 0.1, "estimated {estimate}, is {size}");
}

#[test]
fn check_estimates_compressed_bytes() {
    let folder = folder();
    // half-spaces: one with a stop condition, one with a growing contact
    for (arguments, stops) in [
        (&["fig8-m5"][..], true),
        (&["fig6b", "--set", "mesh.cells=150", "--set", "record.compression=lz4"], false),
    ] {
        let output = percuss(folder.path(), &[&["check", "--json"], arguments].concat());
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        let run = percuss(folder.path(), &[&["run", "--force", "-o", "run.mcap"], arguments].concat());
        assert!(run.status.success(), "{}", stderr(&run));
        let estimate = json["estimate"]["file_bytes"].as_f64().expect("a number");
        let size = fs::metadata(folder.path().join("run.mcap")).expect("the recording").len() as f64;
        assert!((1.0 / 3.0..3.0).contains(&(estimate / size)), "estimated {estimate}, is {size}");
        let output = percuss(folder.path(), &[&["check"], arguments].concat());
        let table = String::from_utf8(output.stdout).expect("text");
        assert_eq!(table.lines().any(|line| line.starts_with("stop ")), stops, "{table}");
    }
}

#[test]
fn check_computes_nothing() {
    let folder = folder();
    let fine = ["fig5", "--set", "mesh.cells=2000", "--set", "run.end_time=30"];
    let start = Instant::now();
    let output = percuss(folder.path(), &[&["check", "--json"], &fine[..]].concat());
    assert!(start.elapsed() < Duration::from_secs(1), "a check is no run");
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(json["estimate"]["seconds"].as_f64().expect("a number") > 1.0);
    let output = percuss(folder.path(), &[&["check"], &fine[..]].concat());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("run time   about "), "{text}");
}

#[test]
fn a_profile_from_a_file_is_written_into_the_resolved_case() {
    let folder = folder();
    let nose = "# a blunt nose\nr, f\n0, 0\n0.5, 0.02\n1.0, 0.3\n";
    fs::create_dir(folder.path().join("cases")).expect("a folder");
    fs::write(folder.path().join("cases/nose.csv"), nose).expect("a file");
    let text = GOOD.replace("\"flat\"\nradius = 1.0", "\"profile\"\nfile = \"nose.csv\"");
    fs::write(folder.path().join("cases/nose.toml"), text).expect("a file");
    let output = percuss(folder.path(), &["check", "cases/nose.toml", "--resolved"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let resolved = String::from_utf8(output.stdout).expect("text");
    assert!(resolved.contains("points = [[0.0, 0.0], [0.5, 0.02], [1.0, 0.3]]"), "{resolved}");
    // the resolved case does not need the file
    fs::write(folder.path().join("full.toml"), resolved).expect("a file");
    let output = percuss(folder.path(), &["run", "full.toml"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(recordings(folder.path()), ["full.mcap"]);
}

#[test]
fn the_force_of_a_recording_presses() {
    let folder = folder();
    let of = |verb: &str, settings: &[&str]| {
        let settings = settings.iter().flat_map(|setting| ["--set", setting]);
        let start = [verb, "experiment-steel-plate", "--set", "mesh.cells=2", "--set", "record.frames=0"];
        percuss(folder.path(), &start.into_iter().chain(settings).collect::<Vec<_>>())
    };
    assert!(of("run", &[]).status.success());
    // the same force from its own recording: the pulse is not beside it
    let recording = "load.force.recording=experiment-steel-plate.mcap";
    let shown = of("check", &[recording]);
    assert!(shown.status.success(), "{}", stderr(&shown));
    let load = |output: &Output| {
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        text.lines().find(|line| line.starts_with("load")).expect("a load").to_owned()
    };
    assert!(load(&shown).contains("up to 16.") && load(&shown).ends_with("on a point"), "{}", load(&shown));
    // half of it is none
    let bytes = fs::read(folder.path().join("experiment-steel-plate.mcap")).expect("a recording");
    fs::write(folder.path().join("half.mcap"), &bytes[..bytes.len() / 2]).expect("room");
    fs::write(folder.path().join("f.csv"), "t [us],F [N]\n0,0\n2,5\n1,0\n").expect("room");
    for (setting, says) in [
        ("load.force.recording=half.mcap", "half.mcap"),
        ("load.force.recording=none.mcap", "No such file"),
        ("load.force.table=f.csv", "time does not increase from row 2 to row 3"),
        ("load.force={ table = \"f.csv\", peak = \"2 N\" }", "belongs to a pulse"),
        ("indenter.shape=flat", "keep one of them"),
        ("run.stop=separation", "this case has a load"),
        ("mesh.contact_cells=20", "needs a load with a radius"),
    ] {
        let refused = of("check", &[setting]);
        assert_eq!(refused.status.code(), Some(2), "{setting}");
        assert!(stderr(&refused).contains(says), "{setting}: {}", stderr(&refused));
    }
}

#[test]
fn built_in_cases_are_listed() {
    let folder = folder();
    let output = percuss(folder.path(), &["cases", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let cases = json["cases"].as_array().expect("a list");
    let names: Vec<&str> = cases.iter().filter_map(|case| case["name"].as_str()).collect();
    let mut expected: Vec<String> =
        ["fig2", "fig2a", "fig2-prescribed", "fig3", "fig4", "fig5", "fig5-plane"]
            .map(str::to_owned)
            .to_vec();
    expected.extend(["a", "b", "c", "d"].map(|part| format!("fig6{part}")));
    expected.extend(["a", "b"].map(|part| format!("fig7{part}")));
    expected.extend(["2.5", "5", "10"].map(|mass| format!("fig8-m{mass}")));
    expected.extend(["1", "2.5", "5", "10", "100", "inf"].map(|mass| format!("fig9-m{mass}")));
    let full = ["2", "2-prescribed", "3", "4", "5", "5-plane", "6a", "7b", "8-m2.5", "8-m5", "8-m10"];
    expected.extend(full.map(|figure| format!("elastic-fig{figure}")));
    let others = ["ball", "laminate-armour", "laminate-glass", "coating", "coating-soft", "layers"];
    expected.extend(others.map(str::to_owned));
    expected.extend(["laminate-carbon", "disc", "bar"].map(str::to_owned));
    let plates = ["aluminium", "aluminium-plate", "gabbro", "gabbro-plate", "glass", "steel", "steel-plate"];
    let others = ["zener", "zener-pmma", "zener-pmma-4mm", "bars", "half-space", "layered"];
    expected.extend(plates.iter().chain(&others).map(|name| format!("experiment-{name}")));
    assert_eq!(names, expected);
}

#[test]
fn errors_of_the_simplified_theory_are_noted() {
    let folder = folder();
    let coarse = ["--set", "mesh.cells=20", "--set", "record.frames=0"];
    let run =
        |verb: &str, more: &[&str]| percuss(folder.path(), &[&[verb, "fig5"], &coarse[..], more].concat());
    let note = "warning: for c_s/c_p = 0.5 the simplified theory errs by about 40 % in the drag at t = 6; model = \"elastic\"";
    let output = run("run", &[]);
    assert!(output.status.success() && output.stdout.is_empty());
    assert_eq!(stderr(&output).matches("simplified theory").count(), 1);
    assert!(stderr(&output).contains(note), "{}", stderr(&output));
    let output = run("check", &[]);
    assert!(stderr(&output).contains(note) && !String::from_utf8_lossy(&output.stdout).contains("warning"));
    // not where it is small, nor in the full theory
    for more in [["--set", "run.end_time=0.5"], ["--set", "model=elastic"]] {
        assert!(!stderr(&run("check", &more)).contains("theory"), "{more:?}");
    }
    assert!(run("run", &["--quiet", "--force"]).stderr.is_empty());
    let error = |more: &[&str]| {
        let output = run("check", &[more, &["--json"]].concat());
        assert!(output.stderr.is_empty(), "{}", stderr(&output));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        json["theory_error"].clone()
    };
    let found = &error(&[])["estimates"][0];
    assert_eq!((&found["quantity"], &found["time"]), (&"drag".into(), &6.0.into()));
    assert!(found["error"].as_f64().is_some_and(|error| (0.35..0.45).contains(&error)), "{found}");
    let missing = error(&["--set", "geometry=plane"]);
    assert!(missing["estimates"].as_array().is_some_and(Vec::is_empty), "{missing}");
    assert!(missing["not_estimated"].as_str().is_some_and(|reason| reason.contains("plane")), "{missing}");
    assert!(error(&["--set", "model=elastic"]).is_null());
}

#[test]
fn an_edge_that_waves_come_back_from_is_noted() {
    let folder = folder();
    let said = |radius: &str, more: &str| {
        let radius = format!("mesh.outer_radius={radius}");
        let set = ["check", "elastic-fig5", "--set", "mesh.cells=20", "--set", &radius, "--set", more];
        let output = percuss(folder.path(), &set);
        assert!(output.status.success(), "{}", stderr(&output));
        let said = stderr(&output);
        said.contains("waves come back") && said.contains("from the outer edge of the mesh")
    };
    // r_contact + t_end/2 = 4, and half of what the point is farther out than the contact
    assert!(said("3.9", "run.end_time=6") && !said("4.1", "run.end_time=6"));
    assert!(said("4.1", "record.points=[[2,0.5]]") && !said("4.6", "record.points=[[2,0.5]]"));
}

#[test]
fn a_material_that_is_given_whole_takes_the_place_of_another() {
    let folder = folder();
    let resolved = |set: &str| {
        let first = "target.material={youngs_modulus=\"70 GPa\", poisson_ratio=0.25, density=\"2500 kg/m3\", yield_strength=\"100 MPa\"}";
        let set = ["check", "ball", "--resolved", "--set", first, "--set", set];
        let output = percuss(folder.path(), &set);
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).expect("text").contains("yield_strength")
    };
    let whole = "target.material={bulk_modulus=\"5 GPa\", poisson_ratio=0.39, density=\"1.19 g/cm3\"}";
    assert!(!resolved(whole) && resolved("target.material.density=\"2600 kg/m3\""));
}

#[test]
fn closed_forms_are_recorded_or_refused() {
    let folder = folder();
    let output = percuss(folder.path(), &["exact", "fig2a"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(output.stdout.is_empty() && folder.path().join("fig2a-exact.mcap").exists());
    // a physical case has the end of its form in seconds
    let ball = percuss(
        folder.path(),
        &["exact", "ball", "--set", "target.thickness=\"half-space\"", "-o", "ball.mcap"],
    );
    assert!(stderr(&ball).contains("; t < 179.5 µs"), "{}", stderr(&ball));
    // an existing recording stays
    let again = percuss(folder.path(), &["exact", "fig2a"]);
    assert!(again.status.code() == Some(1) && stderr(&again).contains("--force"), "{}", stderr(&again));
    for (arguments, reason) in [
        (&["exact", "fig8-m5"][..], "infinite mass"),
        (
            &["exact", "fig6a", "--set", "indenter.slope=2.5", "--set", "impact.contact=unilateral"],
            "slower than the waves",
        ),
        (&["exact", "fig2", "--set", "geometry=plane"], "plane"),
        (&["exact", "fig4", "--set", "model=elastic"], "elastic"),
    ] {
        let output = percuss(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(
            stderr(&output).contains("no closed form") && stderr(&output).contains(reason),
            "{}",
            stderr(&output)
        );
    }
    assert_eq!(recordings(folder.path()), ["ball.mcap", "fig2a-exact.mcap"]);
}

#[test]
fn a_study_reports_orders_and_error_bars() {
    let folder = folder();
    let study = ["study", "fig5-plane", "--set", "mesh.cells=25", "--times", "1.5", "--probes", "0.5"];
    let output = percuss(folder.path(), &[&study[..], &["-o", "order.json", "--quiet"]].concat());
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    let text = fs::read_to_string(folder.path().join("order.json")).expect("results");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(json["closed_form"], "plane_punch");
    let cells: Vec<u64> = json["levels"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|level| level["cells"].as_u64())
        .collect();
    assert_eq!(cells, [25, 50, 100]);
    let stress = &json["quantities"][1];
    assert!(stress["name"].as_str().expect("a name").starts_with("stress at r = 0.5"));
    let error = stress["errors"][2].as_f64().expect("a number");
    assert!(error.abs() < 1e-3 && stress["exact_order"].as_f64().expect("an order") > 1.5, "{stress}");
    let table = percuss(folder.path(), &[&study[..], &["--quiet", "-o", "order.csv"]].concat());
    let text = String::from_utf8(table.stdout).expect("text");
    assert!(text.contains("100 cells") && text.contains("drag, t = 1.5"), "{text}");
    let csv = fs::read_to_string(folder.path().join("order.csv")).expect("results");
    let rows: Vec<&str> = csv.lines().filter(|row| row.starts_with("\"stress at r = 0.5")).collect();
    assert_eq!(rows.len(), 3, "{csv}");
    for ((row, value), cells) in rows.iter().zip(stress["values"].as_array().expect("a list")).zip(cells) {
        let row = row.split_once("\",").expect("a name in quotes").1;
        let row: Vec<&str> = row.split(',').collect();
        assert_eq!(row[1].parse::<u64>().expect("cells"), cells);
        assert_eq!(row[4].parse::<f64>().ok(), value.as_f64());
        let (exact, relative) = (stress["exact"].as_f64().expect("a number"), row[5].parse().unwrap_or(0.0));
        assert!((relative - (value.as_f64().expect("a number") / exact - 1.0).abs()).abs() < 1e-12, "{csv}");
    }
    for (more, status, reason) in [
        (&["--refine", "3"][..], 2, "power of two"),
        (&["--measures", "peak"], 2, "--measures peak: it is one of peak_force, peak_time, "),
        (&["--times", "99"], 2, "the run is from 0"),
        (&["-o", "order.svg"], 2, ".csv"),
        (&["-o", "order.csv"], 1, "--force"),
    ] {
        // an option given twice is an error of its own
        let base = if more[0] == "--times" { &study[..4] } else { &study[..] };
        let output = percuss(folder.path(), &[base, more].concat());
        assert_eq!(output.status.code(), Some(status), "{more:?}");
        assert!(stderr(&output).contains(reason), "{}", stderr(&output));
    }
}

#[test]
fn a_study_has_orders_of_what_is_measured_of_the_run() {
    let folder = folder();
    let ball = "model = \"elastic\"\n[target]\nthickness = \"half-space\"\nmaterial = \"pmma\"\n[indenter]\n\
        shape = \"sphere\"\nnose_radius = \"5 mm\"\nmaterial = \"pmma\"\n[impact]\nvelocity = \"10 m/s\"\n\
        [mesh]\ncontact_cells = 8\nnear_radius = \"1.2 mm\"\nnear_depth = \"1.2 mm\"\n[run]\nend_time = \"42 us\"\nstop = \"separation\"\n[record]\nframes = 0\n";
    fs::write(folder.path().join("ball.toml"), ball).expect("a case");
    let output = percuss(folder.path(), &["study", "ball.toml", "--times", "9us", "-o", "order.json", "-q"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let printed = String::from_utf8(output.stdout).expect("text");
    let text = fs::read_to_string(folder.path().join("order.json")).expect("results");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let quantities = json["quantities"].as_array().expect("a list");
    let quantity = |name: &str| quantities.iter().find(|quantity| quantity["name"] == name);
    // those of the run on the coarsest mesh
    let run = percuss(folder.path(), &["run", "ball.toml", "-o", "ball.mcap", "-q"]);
    assert!(run.status.success(), "{}", stderr(&run));
    let bytes = fs::read(folder.path().join("ball.mcap")).expect("a recording");
    let summary = &crate::recording::metadata(&bytes)["percuss.summary"];
    for (name, unit) in [
        ("peak_force", "N"),
        ("impulse", "N s"),
        ("contact_duration", "s"),
        ("contact_radius", "m"),
        ("restitution", "1"),
        ("restitution_mesh_corrected", "1"),
    ] {
        let quantity = quantity(name).unwrap_or_else(|| panic!("{name}: {text}"));
        assert_eq!(quantity["unit"], unit, "{name}");
        let values: Vec<f64> = quantity["values"]
            .as_array()
            .expect("a list")
            .iter()
            .filter_map(|value| value.as_f64())
            .collect();
        assert_eq!(Some(values[0]), summary.get(name).and_then(|value| value.parse().ok()), "{name}");
        let bar = quantity["error_bar"].as_f64().expect("a bar");
        assert!(values.len() == 3 && (values[2] - values[1]).abs() <= bar, "{quantity}");
        assert!(bar < 0.1 * values[2] && printed.contains(&format!("{name} [{unit}]")), "{quantity}");
    }
    assert!(quantity("depth").is_none());
    // a contact that outlasts the run has no duration yet
    let short = ["study", "ball.toml", "--set", "run.end_time=9us", "--times", "9us", "-q"];
    let measures = ["--measures", "depth,contact_duration"];
    let output = percuss(folder.path(), &[&short[..], &measures].concat());
    let printed = String::from_utf8(output.stdout).expect("text");
    assert!(printed.contains("depth [m]"), "{printed}");
    assert!(!printed.contains("contact_duration") && !printed.contains("peak_force"), "{printed}");
}

#[test]
fn layouts_are_printed_or_written() {
    let folder = folder();
    let printed = percuss(folder.path(), &["layout", "fig5"]);
    assert!(printed.status.success());
    let layout: serde_json::Value = serde_json::from_slice(&printed.stdout).expect("JSON");
    let panels = layout["configById"].as_object().expect("panels");
    // Lichtblick reads a title of its own
    for (name, panel) in panels {
        let title = panel["lichtblickPanelTitle"].as_str().expect("a title");
        assert_eq!(panel["foxglovePanelTitle"], title);
        for axis in ["xAxisLabel", "yAxisLabel"].iter().filter(|_| name.starts_with("Plot")) {
            assert!(panel[axis].as_str().is_some_and(|label| label.ends_with(']')), "{name}: {axis}");
        }
    }
    assert_eq!(panels["3D!section"]["lichtblickPanelTitle"], "Flat punch on a layer, Fig. 5");
    let write = ["layout", "fig5", "--viewer", "plotjuggler", "-o", "layout.xml"];
    assert!(percuss(folder.path(), &write).status.success());
    let text = fs::read_to_string(folder.path().join("layout.xml")).expect("a layout");
    // the last probe is at the edge, where the stress grows with the mesh
    assert!(text.contains("/probes/stress[4]") && !text.contains("/probes/stress[5]"), "{text}");
    let again = percuss(folder.path(), &write);
    assert_eq!(again.status.code(), Some(1));
    assert!(stderr(&again).contains("layout.xml"), "{}", stderr(&again));
    assert!(percuss(folder.path(), &[&write[..], &["--force"]].concat()).status.success());
    assert_eq!(percuss(folder.path(), &["layout", "fig55"]).status.code(), Some(2));
}

#[test]
fn live_runs_need_an_address_that_is_free() {
    let folder = folder();
    let small = ["run", "fig5", "--set", "mesh.cells=10", "--set", "run.end_time=0.5"];
    let run = |more: &[&str]| percuss(folder.path(), &[&small[..], more].concat());
    for bad in ["a:b", "127.0.0.1:99999"] {
        assert_eq!(run(&["--live", bad]).status.code(), Some(2));
    }
    assert_eq!(run(&["--pace", "0"]).status.code(), Some(2));
    assert_eq!(run(&["--wait"]).status.code(), Some(2), "no viewers to wait for");
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    let output = run(&["--live", &address]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains(&address), "{}", stderr(&output));
    assert_eq!(recordings(folder.path()), [""; 0], "no file is left behind");
    // without viewers the run keeps its pace and ends
    let start = Instant::now();
    let output = run(&["--live", "0", "--pace", "2", "-o", "paced.mcap"]);
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("live at ws://127.0.0.1:") && stderr(&output).contains("this machine only")
    );
    assert!(start.elapsed() >= Duration::from_millis(240), "half a unit at twice the speed");
    // numbers in another form are this machine, too
    let output = run(&["--live", "127.1:0", "--force"]);
    assert!(
        stderr(&output).contains("live at ws://127.0.0.1:") && stderr(&output).contains("this machine only"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_reproducible_recording_has_one_hash() {
    let folder = folder();
    let record = |name: &str, threads: &str, rest: &[&str]| {
        let arguments = ["run", "fig5", "--set", "mesh.cells=20", "--threads", threads, "-o", name, "-q"];
        let output = percuss(folder.path(), &[&arguments[..], rest].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read(folder.path().join(name)).expect("a recording")
    };
    let first = record("a.mcap", "1", &["--reproducible"]);
    // another second
    sleep(Duration::from_millis(1100));
    for threads in ["2", "3"] {
        assert!(
            record(&format!("{threads}.mcap"), threads, &["--reproducible"]) == first,
            "{threads} threads"
        );
    }
    assert!(record("b.mcap", "1", &[]) != first);
}

#[test]
fn shells_and_the_manual_know_all_commands() {
    let folder = folder();
    let said = |arguments: &[&str]| {
        let output = percuss(folder.path(), arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).expect("text")
    };
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let text = said(&["completions", shell]);
        assert!(text.contains("sweep") && text.contains("reproducible"), "{shell}");
    }
    assert!(said(&["man"]).contains(".TH percuss 1"));
    said(&["man", "-o", "pages"]);
    let page = fs::read_to_string(folder.path().join("pages/percuss-run.1")).expect("a page");
    assert!(page.contains(".TH percuss-run 1") && page.contains("\\-\\-reproducible"), "{page}");
}
