//! What is chosen of messages: places in nested lists, points and lines of matrices, times, outputs.

use std::fs;

use prost_reflect::Value;
use serde_json::{Value as Json, json};

use crate::{
    desk::Desk,
    forge::{Channel, Forged, forge, list, message, plain, pool, text_map, types},
    si,
};

fn desk_of(recordings: &[(&str, &Forged)]) -> Desk {
    let files = recordings.iter().map(|(name, recording)| (*name, recording.write(plain())));
    Desk::new(&files.collect::<Vec<_>>())
}

/// Joints at two times: of some angles, poses and tags.
fn arm_recording(messages: &[Json]) -> Forged {
    let types_of_arm = "Arm time:double joints:[Joint]\n\
        Joint angle:?double pose:Pose tags:[int32] load:double\n\
        Pose x:double y:?double";
    let file = types("lab", types_of_arm, ("Unused", ["NONE", "SOME"]));
    let pool = pool(&file);
    let arm = |(k, joints): (u64, &Json)| {
        (k * 1_000_000_000, message(&pool, "Arm", &json!({"time": k as f64, "joints": joints})))
    };
    let channel = Channel {
        topic: "/arm".into(),
        message: "Arm".into(),
        metadata: text_map(&[]),
        messages: (0..).zip(messages).map(arm).collect(),
    };
    Forged { file, channels: vec![channel], attachments: Vec::new(), metadata: Vec::new() }
}

/// Angles 1, none, 3; then only the second joint has one. Poses likewise, with an own gap in y.
fn arms() -> [Json; 2] {
    [
        json!([
            {"angle": 1, "pose": {"x": 10, "y": 11}, "tags": [1, 2]},
            {},
            {"angle": 3, "pose": {"x": 30}, "tags": [3]},
        ]),
        json!([{}, {"angle": 2, "pose": {"x": 20, "y": 21}, "tags": [4, 5, 6]}]),
    ]
}

fn arm() -> Forged {
    arm_recording(&arms())
}

#[test]
fn values_keep_their_place_beside_absent_ones() {
    let desk = desk_of(&[("arm.mcap", &arm())]);
    let trace = |fields: &str| desk.text(0, &["trace", "arm.mcap", "--topic", "/arm", "--field", fields]);
    assert_eq!(
        trace("joints.angle"),
        "time,joints[0].angle,joints[1].angle,joints[2].angle\n0.0,1.0,,3.0\n1.0,,2.0,\n"
    );
    assert_eq!(
        trace("joints.pose.x,joints[0].pose.y,joints[1].pose.y,joints[2].pose.y"),
        "time,joints[0].pose.x,joints[1].pose.x,joints[2].pose.x,joints[0].pose.y,joints[1].pose.y,\
         joints[2].pose.y\n0.0,10.0,,30.0,11.0,,\n1.0,,20.0,,,21.0,\n"
    );
    // plain numbers are there for every element
    assert_eq!(
        trace("joints.load"),
        "time,joints[0].load,joints[1].load,joints[2].load\n0.0,0.0,0.0,0.0\n1.0,0.0,0.0,\n"
    );
    // a list inside a list: both indices, and all elements of one
    assert_eq!(trace("joints[2].tags[0],joints[1].tags[2]").lines().nth(2), Some("1.0,,6"));
    assert_eq!(trace("joints[0].tags"), "time,joints[0].tags[0],joints[0].tags[1]\n0.0,1,2\n1.0,,\n");
    assert_eq!(trace("joints.tags[1]"), "time,joints[0].tags[1],joints[1].tags[1]\n0.0,2,\n1.0,,5\n");
    // all of the topic has the same columns
    let all = desk.text(0, &["trace", "arm.mcap", "--topic", "/arm"]);
    for name in ["joints[1].angle", "joints[2].pose.y", "joints[2].tags[0]"] {
        assert!(all.lines().next().expect("headings").split(',').any(|known| known == name), "{name}: {all}");
    }
}

#[test]
fn an_index_stands_on_the_part_that_repeats() {
    let desk = desk_of(&[("arm.mcap", &arm())]);
    let trace = |field: &str| desk.error(2, &["trace", "arm.mcap", "--topic", "/arm", "--field", field]);
    assert!(trace("joints.pose.x[0]").contains("write joints[0].pose.x"));
    assert!(trace("joints.pose[0].x").contains("write joints[0].pose.x"));
    assert!(trace("time[0]").contains("leave out the index"));
    for name in ["joints[0", "joints[x].angle", "joints[0]x.angle", "joints.[#]"] {
        assert!(trace(name).contains("no field"), "{name}");
    }
    // what is never there is said
    let (_, notes) = desk.both(0, &["trace", "arm.mcap", "--topic", "/arm", "--field", "joints[7].angle"]);
    assert!(notes.contains("without a value in any row: joints[7].angle"), "{notes}");
    // diff names the same place
    let mut other = arms();
    other[0][0]["pose"]["x"] = json!(-1);
    desk.put("other.mcap", arm_recording(&other).write(plain()));
    let (text, _) = desk.both(1, &["diff", "arm.mcap", "other.mcap"]);
    assert!(text.contains("/arm.joints[0].pose.x"), "{text}");
}

#[test]
fn profiles_keep_places_too() {
    use percuss_reader::{
        messages::Recording,
        recording::Limits,
        slice::{moments, profile},
    };
    let desk = desk_of(&[("arm.mcap", &arm())]);
    let recording = Recording::open(&desk.path("arm.mcap"), Limits::default()).expect("a recording");
    let (&id, channel) = recording.channels.first_key_value().expect("a channel");
    let (moments, ..) = moments(&recording, id, &[0.0.into()], false).expect("a moment");
    let layout = channel.layout.as_ref().expect("a type");
    let points = |path: &str| {
        profile(channel, layout.find(path).expect("a leaf"), &moments[0]).expect("a profile").points
    };
    assert_eq!(points("joints.angle"), [(0.0, 1.0), (2.0, 3.0)]);
    assert_eq!(points("joints.pose.y"), [(0.0, 11.0)]);
}

#[test]
fn a_large_array_is_left_out_of_a_whole_topic() {
    let mut recording = forge(3, 1);
    recording.set_all("/profile", "p", |_| list([1.0; 10_001]));
    let desk = desk_of(&[("a.mcap", &recording)]);
    let topics = ["trace", "a.mcap", "--topic", "/scalar,/profile,/slice", "--to", "0"];
    let (rows, notes) = desk.both(0, &topics);
    assert!(rows.starts_with("time,/scalar.step,") && rows.lines().count() == 2, "{rows}");
    assert!(notes.contains("left out: `p` of `/profile` has more than 10000 elements"), "{notes}");
    // so are matrices
    assert!(notes.contains("left out: `values` of `/slice` is a matrix"), "{notes}");
    // a table of nothing but steps is none
    for (topic, why) in [("/profile", "has more than 10000 elements"), ("/slice", "whole it is in an .npz")] {
        assert!(desk.error(2, &["trace", "a.mcap", "--topic", topic]).contains(why));
    }
    // asked for by name it is refused
    assert!(desk.error(2, &["trace", "a.mcap", "--topic", "/profile", "--field", "p"]).contains("10000"));
    let some = desk.text(0, &["trace", "a.mcap", "--topic", "/profile", "--at", "r=0.5"]);
    assert!(some.starts_with("time,step,p@r=0.5 [Pa]\n0.0,0,1.0\n"), "{some}");
}

#[test]
fn columns_of_points_keep_the_depth() {
    let mut recording = forge(3, 1);
    recording.channel("/profile").metadata =
        text_map(&[("r", "0,0"), ("z", "0,0.002"), ("unit.r", "m"), ("unit.z", "m")]);
    recording.set_all("/profile", "p", |_| list([1.5, 2.5]));
    let desk = desk_of(&[("a.mcap", &recording)]);
    let trace = |more: &[&str]| desk.text(0, &[&["trace", "a.mcap", "--topic", "/profile"], more].concat());
    let rows = trace(&["--to", "0"]);
    assert!(rows.starts_with("time,step,r0,dr,\"p@r=0,z=0\",\"p@r=0,z=2mm\"\n0.0,0,"), "{rows}");
    assert_eq!(trace(&["--field", "p@r=0,z=2mm", "--to", "0"]), "time,\"p@r=0,z=2mm\"\n0.0,2.5\n");
    // dimensionless ones as they are
    recording.channel("/profile").metadata = text_map(&[("r", "0,0.5"), ("z", "0.25,1")]);
    let desk = desk_of(&[("a.mcap", &recording)]);
    let rows = desk.text(0, &["trace", "a.mcap", "--topic", "/profile", "--field", "p"]);
    assert!(rows.starts_with("time,\"p@r=0,z=0.25\",\"p@r=0.5,z=1\"\n"), "{rows}");
}

/// `/slice` with values 6 + 2 j + 10 i in row j and column i, of which frame k shows 1 + k rows and 2 + k columns: at most
/// 6 and 7. The axes begin at z = 0 and r = 0.05, the steps are 0.2 and 0.1.
fn growing() -> Forged {
    let mut recording = forge(60, 1);
    let (nr, nz) = (|k: usize| 2 + k as u32, |k: usize| 1 + k as u32);
    let value = |j: u32, i: u32| Value::F32(6.0 + 2.0 * j as f32 + 10.0 * i as f32);
    recording.set_all("/slice", "r0", |_| Value::F64(0.05));
    recording.set_all("/slice", "nr", |k| Value::U32(nr(k)));
    recording.set_all("/slice", "nz", |k| Value::U32(nz(k)));
    recording.set_all("/slice", "values", |k| {
        Value::List((0..nz(k)).flat_map(|j| (0..nr(k)).map(move |i| value(j, i))).collect())
    });
    recording
}

/// The numbers of a column, the first row without the headings.
fn column(rows: &str, index: usize) -> Vec<f64> {
    let cell = |line: &str| line.rsplit(',').nth(index).expect("a cell").parse().expect("a number");
    rows.lines().skip(1).map(cell).collect()
}

fn near(found: &[f64], expected: &[f64]) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5)
}

#[test]
fn points_of_a_matrix_over_time() {
    let desk = desk_of(&[("a.mcap", &growing())]);
    let trace = |more: &[&str]| desk.text(0, &[&["trace", "a.mcap", "--topic", "/slice"], more].concat());
    // row 1.5, column 1.5
    let rows = trace(&["--field", "values", "--at", "r=0.2,z=0.3"]);
    assert!(rows.starts_with("time,\"values@r=0.2,z=0.3 [Pa]\"\n"), "{rows}");
    // the first frame leaves out rows 1 and 2, the second row 2: they are at rest
    assert!(near(&column(&rows, 0), &[0.0, 11.5, 24.0, 24.0, 24.0, 24.0]), "{rows}");
}

#[test]
fn points_and_lines_are_named_and_can_be_asked_for_by_name() {
    let desk = desk_of(&[("a.mcap", &growing())]);
    let trace = |more: &[&str]| desk.text(0, &[&["trace", "a.mcap", "--topic", "/slice"], more].concat());
    let by_option = trace(&["--field", "values", "--at", "z=0,r=0.05,0.15", "--at", "r=0.25,z=0"]);
    let head = by_option.lines().next();
    assert_eq!(
        head,
        Some("time,\"values@z=0,r=0.05 [Pa]\",\"values@z=0,r=0.15 [Pa]\",\"values@r=0.25,z=0 [Pa]\"")
    );
    assert_eq!(trace(&["--field", "values@z=0,r=0.05,0.15,values@r=0.25,z=0"]), by_option);
    // half a step before the first column its value holds
    assert!(near(&column(&trace(&["--field", "values@r=0,z=0"]), 0), &[6.0; 6]));
    // one coordinate: all places of the other, the same in every row
    let rows = trace(&["--field", "values", "--at", "r=0.05"]);
    let head = rows.lines().next().expect("headings");
    assert_eq!(head.matches("values@r=0.05,z=").count(), 6, "{head}");
    assert!(near(&column(&rows, 5), &[6.0; 6]), "{rows}");
    assert!(near(&column(&rows, 0), &[0.0, 0.0, 0.0, 0.0, 0.0, 16.0]), "{rows}");
    assert_eq!(trace(&["--field", "values", "--at", "z=1"]).matches("values@z=1,r=").count(), 7);
}

#[test]
fn places_that_are_not_there_are_refused() {
    let desk = desk_of(&[("a.mcap", &growing())]);
    let refusal = |more: &[&str]| desk.error(2, &[&["trace", "a.mcap"], more].concat());
    for (arguments, parts) in [
        // the seven columns end at r = 0.7, half a step beyond the last, the six rows at z = 1.1
        (&["--topic", "/slice", "--at", "r=0.71,z=0"] as &[&str], &["r=0.71", "r=0 to r=0.7"] as &[&str]),
        (&["--topic", "/slice", "--at", "r=0,z=1.2"], &["z=1.2", "z=1.1"]),
        (&["--topic", "/slice", "--at", "r=-0.1"], &["r=-0.1", "r=0"]),
        (&["--topic", "/slice", "--at", "x=0"], &["axis named `x`", "`values` has z and r"]),
        (&["--topic", "/slice", "--at", "r=0,r=1"], &["given twice"]),
        (&["--topic", "/slice", "--at", "r=0,z="], &["not a number"]),
        (&["--topic", "/slice", "--field", "values[3]"], &["changes its shape", "--at"]),
        (&["--topic", "/profile", "--at", "r=0.1,z=0"], &["axis"]),
        // the longest profile of the recording has 14 elements
        (&["--topic", "/profile", "--at", "r=0.71"], &["r=0.71", "r=0.7"]),
        // no topic has it, however many there are
        (&["--topic", "/scalar,/note", "--at", "r=0"], &["axis named `r`", "/scalar`, `/note"]),
        (&["--topic", "/profile,/slice", "--at", "x=0"], &["axis named `x`", "`p` has r"]),
        (&["--topic", "/profile", "--field", "p@r=0.71"], &["outside"]),
        (&["--topic", "/profile", "--field", "p@r=q"], &["not a number"]),
    ] {
        let text = refusal(arguments);
        assert!(parts.iter().all(|part| text.contains(part)), "{arguments:?}: {text}");
    }
    // the contact has not come so far yet: empty, no error
    let rows = desk.text(0, &["trace", "a.mcap", "--topic", "/profile", "--field", "p@r=0.68"]);
    assert_eq!(rows.lines().filter(|line| line.ends_with(',')).count(), 40, "{rows}");
    // the same element in every message is there
    let whole = desk_of(&[("a.mcap", &forge(60, 1))]);
    whole.text(0, &["trace", "a.mcap", "--topic", "/slice", "--field", "values[3]"]);
}

#[test]
fn lines_and_points_are_drawn() {
    let desk = desk_of(&[("a.mcap", &growing())]);
    let draw = |name: &str, more: &[&str]| {
        desk.text(0, &[&["plot", "a.mcap", "--topic", "/slice", "-o", name], more].concat());
        fs::read_to_string(desk.path(name)).expect("a picture")
    };
    // texts of a picture, spaces and tags aside
    let has = |svg: &str, text: &str| svg.contains(&format!(">{text}<"));
    let over_z = draw("z.svg", &["--at", "r=0", "--at-time", "0.3"]);
    assert!(has(&over_z, "z") && !has(&over_z, "r"), "over z");
    let over_r = draw("r.svg", &["--at", "z=0.5", "--at-time", "0.3"]);
    assert!(has(&over_r, "r") && !has(&over_r, "z"), "over r");
    let last = draw("last.svg", &["--at", "r=0"]);
    assert!(has(&last, "z"), "the last frame");
    let over_time = draw("t.svg", &["--at", "r=0,z=0.5"]);
    assert!(has(&over_time, "time"), "over time");
    // a row that the frame leaves out is at rest, not missing
    draw("rest.svg", &["--at", "z=1", "--at-time", "0.1"]);
    let refusal = |more: &[&str]| desk.error(2, &[&["plot", "a.mcap"], more].concat());
    for (arguments, part) in [
        (&["--topic", "/slice", "--at", "r=0,z=0.5", "--at-time", "0.3"] as &[&str], "leave out --at-time"),
        (&["--topic", "/profile", "--at", "r=0", "--at-time", "0.3"], "leave out --at-time"),
        (&["--topic", "/slice", "--at", "r=0", "--at", "z=0", "--at-time", "0.3"], "no axis in common"),
        (&["--topic", "/slice", "--at", "r=0", "--at", "r=0,z=0"], "points and lines"),
        (&["--topic", "/slice", "--at", "r=0.9", "--at-time", "0.3"], "r=0.7"),
        (&["--topic", "/slice", "--at", "q=0", "--at-time", "0.3"], "`values` has z and r"),
        (&["--topic", "/slice,/profile", "--at-time", "0.3"], "one by one"),
        (&["--topic", "/slice", "--at-time", "0.3", "--from", "0.1"], "--from"),
        (&["--topic", "/slice", "--from", "0.1"], "--at-time"),
        (&["--topic", "/slice", "--log", "x"], "--log"),
        (&["--topic", "/profile", "--at-time", "0.3", "--field", "p,q"], "no field `q`"),
    ] {
        let text = refusal(arguments);
        assert!(text.contains(part), "{arguments:?}: {text}");
    }
}

#[test]
fn an_exported_matrix_has_the_shape_of_the_recording() {
    let desk = desk_of(&[("a.mcap", &growing())]);
    for (time, name, touched) in [("0", "first.npy", 2), ("0.5", "last.npy", 42)] {
        desk.text(0, &["export", "a.mcap", "--topic", "/slice", "--at-time", time, "-o", name]);
        let matrix: ndarray::Array2<f64> = ndarray_npy::read_npy(desk.path(name)).expect("a matrix");
        assert_eq!(matrix.dim(), (6, 7));
        assert_eq!(matrix.iter().filter(|value| **value != 0.0).count(), touched);
        assert_eq!((matrix[[0, 0]], matrix[[0, 1]]), (6.0, 16.0));
    }
    let mut two = growing();
    let mut more = two.channel("/slice").clone();
    more.topic = "/slice/more".into();
    two.channels.push(more);
    desk.put("two.mcap", two.write(plain()));
    let text = desk.error(2, &["export", "two.mcap", "--topic", "/slice*", "-o", "x.npy"]);
    assert!(text.contains("/slice, /slice/more"), "{text}");
}

#[test]
fn times_outside_the_run_are_refused() {
    let desk = desk_of(&[("a.mcap", &forge(60, 1))]);
    for arguments in [
        &["export", "a.mcap", "--topic", "/slice", "-o", "x.npy", "--at-time", "99"] as &[&str],
        &["plot", "a.mcap", "--topic", "/slice", "--at-time", "99"],
        &["plot", "a.mcap", "--topic", "/profile", "--at-time", "0.1,99"],
        &["plot", "a.mcap", "--topic", "/profile", "--at-time=-99"],
    ] {
        let text = desk.error(2, arguments);
        assert!(text.contains("99 lies outside") && text.contains("from time 0 to 0.5"), "{text}");
        assert!(!desk.path("x.npy").exists());
    }
    for time in ["nan", "inf"] {
        desk.error(2, &["plot", "a.mcap", "--topic", "/profile", "--at-time", time]);
    }
    desk.error(2, &["trace", "a.mcap", "--topic", "/scalar", "--from", "nan"]);
    // the end of a run is rarely a multiple of its steps
    for time in ["0", "0.55", "0.6"] {
        desk.text(0, &["export", "a.mcap", "--topic", "/slice", "-o", "x.npy", "--at-time", time, "--force"]);
    }
    // a window without messages is said
    let (rows, notes) = desk.both(0, &["trace", "a.mcap", "--topic", "/scalar", "--from", "99"]);
    assert_eq!(rows.lines().count(), 1);
    assert!(notes.contains("no rows"), "{notes}");
}

#[test]
fn outputs_of_unknown_formats_are_refused() {
    let desk = desk_of(&[("a.mcap", &forge(60, 1)), ("b.mcap", &forge(60, 2))]);
    for (arguments, known) in [
        (&["trace", "a.mcap", "--topic", "/scalar", "-o"] as &[&str], ".csv, .jsonl"),
        (&["plot", "a.mcap", "--topic", "/scalar", "-o"], ".svg, .png"),
        (&["export", "a.mcap", "--topic", "/slice", "-o"], ".npy, .npz, .vti, .vtr, .png, .svg"),
        (&["diff", "a.mcap", "b.mcap", "--plot"], ".svg, .png"),
        (&["diff", "a.mcap", "b.mcap", "--write-diff"], ".mcap"),
        (&["recover", "a.mcap", "-o"], ".mcap"),
        (&["report", "a.mcap", "-o"], ".html"),
    ] {
        for name in ["x.xlsx", "x.mat", "x.h5", "x.tsv", "x.txt", "x.csv.gz"] {
            let text = desk.error(2, &[arguments, &[name]].concat());
            assert!(text.contains(known) && text.contains(name), "{arguments:?}: {text}");
            assert!(!desk.path(name).exists());
        }
    }
    // in any case of letters, without an extension, and where the format is said
    for (name, more) in [("X.CSV", &[] as &[&str]), ("table", &[]), ("x.txt", &["--format", "csv"])] {
        let arguments = [&["trace", "a.mcap", "--topic", "/scalar", "-o", name], more].concat();
        desk.text(0, &arguments);
        assert!(fs::read_to_string(desk.path(name)).expect("a table").starts_with("time [s],step"));
    }
}

#[test]
fn times_in_different_units_do_not_share_a_column() {
    let mut other = forge(60, 1);
    other.channel("/scalar").metadata.insert("unit.time".into(), "ms".into());
    let desk = desk_of(&[("a.mcap", &forge(60, 1)), ("b.mcap", &other)]);
    let text = desk.error(2, &["trace", "a.mcap", "b.mcap", "--topic", "/scalar"]);
    assert!(text.contains("times are in s and in ms"), "{text}");
    // files of the same name are distinguished
    fs::create_dir(desk.path("old")).expect("a folder");
    fs::copy(desk.path("a.mcap"), desk.path("old/a.mcap")).expect("a file");
    let rows = desk.text(0, &["trace", "a.mcap", "old/a.mcap", "--topic", "/scalar", "--field", "force"]);
    assert_eq!(rows.lines().next(), Some("time [s],a.mcap:force [N],old/a.mcap:force [N]"));
}

#[test]
fn messages_are_chosen_by_the_time_of_steps() {
    let desk = Desk::new(&[]);
    let settings = ["mesh.cells=10", "run.end_time=\"20 us\"", "record.frames=5"];
    si::record("ball", &settings, &desk.path("ball.mcap"));
    let rows = desk.lines(&["trace", "ball.mcap", "--at-time", "5.01us,15us", "--units", "base"]);
    let times: Vec<f64> = rows[1..]
        .iter()
        .map(|row| row.split(',').next().and_then(|t| t.parse().ok()).expect("a time"))
        .collect();
    assert!(
        times.len() == 2 && times.iter().zip([5e-6, 15e-6]).all(|(a, b)| (a - b).abs() < 2e-7),
        "{rows:?}"
    );
    // also what is timed by its log time, which is slower
    let at = ["--topic", "/view/image", "--at-time", "10us"];
    let lines = desk.lines(&[&["cat", "ball.mcap"][..], &at].concat());
    assert_eq!(lines.len(), 1, "{lines:?}");
    let said = desk.both(0, &[&["export", "ball.mcap", "-o", "a.png"][..], &at].concat()).1;
    let time =
        said.trim().strip_prefix("image at ").and_then(|time| time.parse::<f64>().ok()).expect("a time");
    assert!((time - 10e-6).abs() < 2e-6, "{said}");
    let late = ["--topic", "/view/image", "--at-time", "1ms"];
    for verb in [&["cat", "ball.mcap"][..], &["export", "ball.mcap", "-o", "b.png"]] {
        let error = desk.error(2, &[verb, &late].concat());
        assert!(error.contains("time 0.001 lies outside the recording"), "{error}");
    }
    si::record("fig5", &["mesh.cells=10", "run.end_time=1"], &desk.path("fig5.mcap"));
    let error = desk.error(2, &["cat", "fig5.mcap", "--topic", "/view/image", "--at-time", "1us"]);
    assert!(error.contains("are in R/c_p"), "{error}");
}
