//! The verbs as programs: exit status, outputs, what is written where.

use std::{
    fs,
    io::{BufRead, BufReader, Write},
    process::Stdio,
    sync::mpsc,
    thread,
    time::Duration,
};

use prost_reflect::Value;
use serde_json::Value as Json;

use crate::{
    desk::Desk,
    forge::{self, forge, plain},
    si,
};

/// `a.mcap`, the same again as `same.mcap`, and `b.mcap` that differs a little at step 20.
fn desk() -> Desk {
    let a = forge(60, 1);
    let mut b = a.clone();
    let force = forge::number(&b.channel("/scalar").messages[20].1, "force");
    b.set("/scalar", 20, "force", Value::F64(force + 1e-6));
    let [a, b] = [a, b].map(|recording| recording.write(plain()));
    Desk::new(&[("a.mcap", a.clone()), ("same.mcap", a), ("b.mcap", b)])
}

#[test]
fn diff_says_where_and_ends_accordingly() {
    let desk = desk();
    assert!(desk.text(0, &["diff", "a.mcap", "same.mcap"]).starts_with("a.mcap -> same.mcap: equal\n"));
    let text = desk.text(1, &["diff", "a.mcap", "b.mcap"]);
    for part in [
        "DIFFERENT",
        "first difference: /scalar.force at step 20, time 0.2",
        "equal: /profile, /slice, /note",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    assert!(!text.contains('\u{1b}'), "no colours where there is no terminal");
    assert!(desk.text(0, &["diff", "a.mcap", "b.mcap", "--abs", "1e-5"]).contains("within tolerance"));
    let explained = desk.text(0, &["diff", "a.mcap", "b.mcap", "--tol", "/scalar.*:rel=1e-3", "--explain"]);
    assert!(explained.contains("rule rel=1e-3 (--tol /scalar.*:rel=1e-3)"), "{explained}");
    assert!(explained.contains("rule bitwise"), "{explained}");
    desk.put("t.toml", "[[tolerance]]\nfield = '/scalar.force'\npeak_rel = 1e-6\n");
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--tolerances", "t.toml"]);
    // to compare nothing is no answer
    for more in [["--topic", "/nowhere"], ["--field", "nothing"]] {
        desk.text(2, &[&["diff", "a.mcap", "same.mcap"][..], &more].concat());
    }
    assert_eq!(desk.text(1, &["diff", "a.mcap", "b.mcap", "--summary"]).lines().count(), 6);
    let summary = desk.text(1, &["diff", "a.mcap", "b.mcap", "--summary"]);
    assert!(
        summary.starts_with("DIFFERENT  a.mcap -> b.mcap\n  ") && summary.contains(" beyond tolerance"),
        "{summary}"
    );
    let thin = desk.text(0, &["diff", "a.mcap", "b.mcap", "--summary", "--align", "linear", "--l2-rel", "1"]);
    assert!(!thin.contains("NaN"), "{thin}");
    for form in [&[] as &[&str], &["--summary"]] {
        let fast = desk.text(1, &[&["diff", "a.mcap", "b.mcap", "--fail-fast"], form].concat());
        assert!(fast.contains("stopped at the first difference beyond tolerance (--fail-fast)"), "{fast}");
        assert!(!fast.contains("no message in either") && !fast.contains("no time in common"), "{fast}");
    }
    assert!(desk.text(0, &["diff", "a.mcap", "same.mcap", "b.mcap", "--abs", "1"]).contains("2 comparisons"));
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--field", "load,p,values"]);
    desk.text(1, &["diff", "a.mcap", "b.mcap", "--field", "fo*"]);
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--every", "3"]);
    desk.text(1, &["diff", "a.mcap", "b.mcap", "--every", "4"]);
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--to", "0.19"]);
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--from", "0.21"]);
    // what could not be compared
    assert!(desk.error(2, &["diff", "a.mcap", "none.mcap"]).contains("none.mcap"));
    assert!(desk.error(2, &["diff", "a.mcap"]).contains("FILE"));
    assert!(desk.error(2, &["diff", "a.mcap", "b.mcap", "--tol", "size=1"]).contains("no tolerance"));
    desk.put("bad.toml", "[[tolerance]]\nfield = '*'\nsize = 1\n");
    assert!(desk.error(2, &["diff", "a.mcap", "b.mcap", "--tolerances", "bad.toml"]).contains("size"));
    // a damaged one: what is sound is compared
    let bytes = desk.bytes("a.mcap");
    desk.put("cut.mcap", &bytes[..bytes.len() - 3000]);
    assert!(desk.text(3, &["diff", "a.mcap", "cut.mcap"]).contains("damaged"));
}

#[test]
fn diff_leaves_derived_channels_to_what_they_are_made_from() {
    let desk = desk();
    let (a, mut b) = (forge(60, 1), forge(60, 2));
    b.channels = a.channels.clone();
    for (name, recording, force) in [("c.mcap", &a, 1.0), ("d.mcap", &b, 2.0)] {
        let mut recording = recording.clone();
        recording.channel("/scalar").metadata.insert("derived".into(), "from elsewhere".into());
        recording.set("/scalar", 20, "force", Value::F64(force));
        desk.put(name, recording.write(plain()));
    }
    let text = desk.text(0, &["diff", "c.mcap", "d.mcap"]);
    assert!(text.contains("not compared, made from the others: /scalar"), "{text}");
    let text = desk.text(1, &["diff", "c.mcap", "d.mcap", "--topic", "/scalar"]);
    assert!(text.contains("/scalar.force at step 20") && !text.contains("not compared"), "{text}");
}

#[test]
fn diff_as_json() {
    let desk = desk();
    let json = desk.json(1, &["diff", "a.mcap", "b.mcap", "--json"]);
    assert_eq!((&json["version"], &json["verdict"]), (&Json::from(4), &Json::from("different")));
    let comparison = &json["comparisons"][0];
    assert_eq!(comparison["first_beyond"]["step"], 20);
    assert_eq!(comparison["first_beyond"]["topic"], "/scalar");
    let fields = comparison["channels"][0]["fields"].as_array().expect("a list");
    let force = fields.iter().find(|field| field["field"] == "force").expect("the field");
    assert_eq!(
        (&force["differing"], &force["unit"], &force["within"]),
        (&1.into(), &"N".into(), &false.into())
    );
    assert!((force["max_abs"].as_f64().expect("a number") - 1e-6).abs() < 1e-12);
    for key in ["l1_rel", "l2_rel", "linf", "max_peak_rel", "correlation", "sprague_geers"] {
        assert!(!force[key].is_null(), "{key}");
    }
    // what does not differ is counted, and what is none is left out
    assert_eq!(comparison["channels"][0]["equal"]["count"], 60);
    assert!(fields.iter().all(|field| field["field"] == "force"), "{fields:?}");
    assert!(force.get("skipped").is_none() && comparison.get("damages").is_none(), "{comparison}");
    let same = desk.text(0, &["diff", "a.mcap", "a.mcap", "--json"]);
    assert!(same.lines().count() < 20 && !same.contains("null") && !same.contains("fields"), "{same}");
}

#[test]
fn folders_are_compared_file_by_file() {
    let desk = desk();
    for (folder, files) in
        [("old", &[("x", "a"), ("sub/y", "a")] as &[_]), ("new", &[("x", "same"), ("sub/y", "b")])]
    {
        for (name, source) in files {
            let target = desk.path(folder).join(format!("{name}.mcap"));
            fs::create_dir_all(target.parent().expect("a folder")).expect("a folder");
            fs::copy(desk.path(&format!("{source}.mcap")), target).expect("a file");
        }
    }
    let text = desk.text(1, &["diff", "old", "new", "--summary"]);
    assert!(text.contains("old/x.mcap -> new/x.mcap") && text.contains("2 comparisons: DIFFERENT"), "{text}");
    fs::copy(desk.path("a.mcap"), desk.path("old/z.mcap")).expect("a file");
    fs::copy(desk.path("a.mcap"), desk.path("new/z.mcap")).expect("a file");
    let fast = desk.text(1, &["diff", "old", "new", "--fail-fast"]);
    let counted = ["1 comparisons: DIFFERENT; 2 more were not made (--fail-fast)", "2 more"];
    assert!(counted.iter().all(|part| fast.contains(part)), "{fast}");
    let json = desk.json(1, &["diff", "old", "new", "--fail-fast", "--json"]);
    assert_eq!(json["not_made"], 2);
    desk.text(0, &["diff", "old", "new", "--abs", "1"]);
    fs::remove_file(desk.path("new/x.mcap")).expect("a file");
    assert!(desk.text(1, &["diff", "old", "new", "--abs", "1"]).contains("missing from the new folder"));
    assert!(desk.error(2, &["diff", "old", "a.mcap"]).contains("folder"));
}

#[test]
fn folders_without_anything_in_common_are_not_equal() {
    let desk = desk();
    for folder in ["empty", "void", "old", "new"] {
        fs::create_dir(desk.path(folder)).expect("a folder");
    }
    fs::copy(desk.path("a.mcap"), desk.path("old/x.mcap")).expect("a file");
    fs::copy(desk.path("a.mcap"), desk.path("new/y.mcap")).expect("a file");
    desk.put("void/notes.txt", "none");
    assert!(desk.error(2, &["diff", "empty", "void"]).contains("no recording"));
    let json = desk.json(2, &["diff", "empty", "void", "--json"]);
    assert_eq!(json["verdict"], "not_compared");
    assert!(desk.error(1, &["diff", "old", "new"]).contains("no recording is in both folders"));
    let text = desk.text(1, &["diff", "old", "new"]);
    for part in ["old/x.mcap: missing from the new folder", "new/y.mcap: only in the new folder"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    desk.text(1, &["diff", "old", "empty"]);
    desk.text(1, &["diff", "empty", "new"]);
}

#[test]
fn a_folder_is_accepted_with_what_is_new_in_it() {
    let desk = desk();
    let bytes = |name: &str| desk.bytes(name);
    for (folder, names) in [("old", ["x", "gone"]), ("new", ["x", "sub/y"])] {
        fs::create_dir_all(desk.path(folder).join("sub")).expect("a folder");
        let source = if folder == "old" { "a.mcap" } else { "b.mcap" };
        for name in names {
            fs::copy(desk.path(source), desk.path(&format!("{folder}/{name}.mcap"))).expect("a file");
        }
    }
    fs::remove_dir(desk.path("old/sub")).expect("an empty folder");
    // the reference is never made smaller: that it has more is said, and is a difference
    let reported = desk.error(1, &["diff", "old", "new", "--bless"]);
    for part in ["`old/x.mcap` is now `new/x.mcap`", "`old/sub/y.mcap` is new", "`old/gone.mcap` stays"] {
        assert!(reported.contains(part), "{part}: {reported}");
    }
    for name in ["x", "sub/y"] {
        assert_eq!(bytes(&format!("old/{name}.mcap")), bytes("b.mcap"), "{name}");
    }
    assert_eq!(bytes("old/gone.mcap"), bytes("a.mcap"));
    fs::remove_file(desk.path("old/gone.mcap")).expect("a file");
    desk.text(0, &["diff", "old", "new", "--bless"]);
    desk.text(0, &["diff", "old", "new"]);
    // a damaged one is not taken over
    let whole = bytes("a.mcap");
    desk.put("new/cut.mcap", &whole[..whole.len() - 3000]);
    assert!(desk.error(2, &["diff", "old", "new", "--bless"]).contains("`new/cut.mcap` is damaged"));
    assert!(!desk.path("old/cut.mcap").exists());
}

#[test]
fn tolerances_that_fit_nothing_are_reported() {
    let desk = desk();
    desk.put(
        "t.toml",
        "[[tolerance]]\nfield = '/scalar.*'\nabs = 1\n[[tolerance]]\nfield = '/skalar.*'\nabs = 1\n",
    );
    let command = ["diff", "a.mcap", "b.mcap", "--abs", "1", "--tolerances", "t.toml"];
    let more = ["--tol", "/slice.valeus:abs=1", "--tol", "/slice.values:abs=1", "--ignore", "/not,/note"];
    let reported = desk.error(0, &[&command[..], &more[..]].concat());
    let lines: Vec<&str> = reported.lines().collect();
    assert_eq!(lines.len(), 3, "{reported}");
    for part in [
        "`/not` (--ignore /not)",
        "`/slice.valeus` (--tol /slice.valeus:abs=1)",
        "`/skalar.*` (t.toml, tolerance 2)",
    ] {
        assert!(
            lines.iter().any(|line| line.starts_with("warning: ") && line.contains(part)),
            "{part}: {reported}"
        );
    }
    // what fits in one of several comparisons is no mistake
    desk.put("scalar.mcap", forge(60, 1).only("/scalar").write(plain()));
    let reported = desk.error(1, &["diff", "scalar.mcap", "scalar.mcap", "a.mcap", "--tol", "/note:abs=1"]);
    assert_eq!(reported, "");
}

#[test]
fn selections_without_values_are_not_equal() {
    let desk = desk();
    fn same<'a>(more: &[&'a str]) -> Vec<&'a str> {
        [&["diff", "a.mcap", "same.mcap"][..], more].concat()
    }
    for (more, why) in [
        (&["--from", "100"] as &[&str], "at times from 100"),
        (&["--from", "0.5", "--to", "0.4"], "at times from 0.5 to 0.4"),
        (&["--to", "-1"], "at times to -1"),
        (&["--ignore", "*"], "--ignore leaves no topic"),
        (&["--ignore", "*.*"], "no field that was chosen has a value"),
        (&["--field", "inner"], "no field that was chosen has a value"),
        (&["--topic", "/note", "--ignore", "/note.*"], "no field that was chosen has a value"),
    ] {
        let reported = desk.error(2, &same(more));
        assert!(reported.starts_with("error: ") && reported.contains(why), "{more:?}: {reported}");
        assert!(desk.text(2, &same(more)).starts_with("a.mcap -> same.mcap: NOT COMPARED\n"), "{more:?}");
        let json = desk.json(2, &same(&[more, &["--json"]].concat()));
        assert_eq!(
            (&json["verdict"], &json["comparisons"][0]["verdict"]),
            (&"not_compared".into(), &"not_compared".into())
        );
        assert!(json["comparisons"][0]["gaps"][0].as_str().expect("text").contains(why), "{json}");
        assert!(desk.text(2, &same(&[more, &["--summary"]].concat())).contains("NOT COMPARED  a.mcap"));
    }
    assert!(desk.error(2, &same(&["--from", "nan"])).contains("not a number"));
    // a part without values says so, and is not among the equal
    let text = desk.text(0, &same(&["--field", "force"]));
    assert!(text.contains("\nequal: /scalar\n"), "{text}");
    assert!(text.contains("\nno value compared: /profile, /slice, /note\n"), "{text}");
    let text = desk.text(0, &same(&["--to", "0.01"]));
    assert!(text.contains("\nno message in either: /note\n"), "{text}");
    // one has messages in the window, the other has not
    desk.put("long.mcap", forge(120, 1).write(plain()));
    let text = desk.text(1, &["diff", "a.mcap", "long.mcap", "--from", "0.8"]);
    assert!(text.contains("40 messages only in the new recording, the first at step 80, time 0.8"), "{text}");
    // all values are left out as NaN
    let mut hollow = forge(60, 1);
    hollow.set_all("/scalar", "force", |_| Value::F64(f64::NAN));
    desk.put("hollow.mcap", hollow.write(plain()));
    let hollow = ["diff", "a.mcap", "hollow.mcap", "--skip-nan", "--topic", "/scalar"];
    desk.text(2, &[&hollow[..], &["--field", "force"]].concat());
    assert!(desk.text(0, &[&hollow[..], &["--explain"]].concat()).contains("force [N]  no value"));
}

/// A recording of JSON messages, which have no fields here.
fn json_messages(times: impl IntoIterator<Item = u64>) -> Vec<u8> {
    forge::of_texts("/status", "json", times, "{}")
}

#[test]
fn no_two_of_ten_unrelated_recordings_are_equal() {
    let desk = desk();
    let mut other_topics = forge(60, 5);
    other_topics.channels.iter_mut().for_each(|channel| channel.topic.push_str("/other"));
    let mut empty_channels = forge(60, 6);
    empty_channels.channels.iter_mut().for_each(|channel| channel.messages.clear());
    let mut no_channels = forge(60, 7);
    no_channels.channels.clear();
    let mut derived = forge(60, 8);
    for channel in &mut derived.channels {
        channel.metadata.insert("derived".into(), "others".into());
    }
    let mut elsewhere = forge(60, 9).only("/profile");
    elsewhere.set_all("/profile", "r0", |_| Value::F64(1e3));
    let recordings = [
        forge(60, 1).write(plain()),
        forge(200, 2).later(1_000_000_000_000).write(plain()),
        forge(201, 3).later(1_700_000_000_123_456_789).write(plain()),
        forge(201, 4).later(1_750_000_000_987_654_321).write(plain()),
        other_topics.write(plain()),
        empty_channels.write(plain()),
        no_channels.write(plain()),
        derived.write(plain()),
        elsewhere.write(plain()),
        json_messages((0..50).map(|k| 1_700_000_000_000_000_000 + k * k * 10_000_000)),
    ];
    let name = |i: usize| format!("{i}.mcap");
    for (i, bytes) in recordings.iter().enumerate() {
        desk.put(&name(i), bytes);
    }
    for i in 0..recordings.len() {
        for j in (0..recordings.len()).filter(|&j| j != i) {
            for more in [&[] as &[&str], &["--align", "relative"], &["--align", "linear"]] {
                let (a, b) = (name(i), name(j));
                let output = desk.read(&[&["diff", &a, &b][..], more].concat());
                let [text, said] =
                    [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("text"));
                let is_right = match output.status.code() {
                    Some(1) => text.contains("DIFFERENT"),
                    Some(2) => text.contains("NOT COMPARED") && said.contains("error: "),
                    _ => false,
                };
                assert!(is_right, "{i} and {j} {more:?}: {}: {text}{said}", output.status);
            }
        }
    }
    let reported = desk.error(1, &["diff", &name(2), &name(3)]);
    assert!(reported.contains("have no time in common: times count from the start of each"), "{reported}");
    assert!(desk.error(2, &["diff", &name(5), &name(6), "--ignore", "*"]).contains("nothing was compared"));
    // to itself each is equal, if there is anything in it
    for i in 0..recordings.len() {
        let expected = if [5, 6, 7].contains(&i) { 2 } else { 0 };
        desk.text(expected, &["diff", &name(i), &name(i)]);
    }
}

#[test]
fn log_times_are_decimal_fractions() {
    let desk = desk();
    let times = [1_700_000_000_150_000_000, 1_700_000_000_200_000_000, 1_700_000_008_999_640_000];
    desk.put("wall.mcap", json_messages(times));
    let text = desk.text(0, &["info", "wall.mcap"]);
    assert!(text.contains("1700000000.15 s to 1700000008.99964 s"), "{text}");
    desk.put("early.mcap", json_messages([60_000_000, 8_999_640_000]));
    let text = desk.text(0, &["info", "early.mcap"]);
    assert!(text.contains("0.06 s to 8.99964 s"), "{text}");
}

#[test]
fn a_new_recording_is_accepted_only_when_asked() {
    let desk = desk();
    let before = desk.bytes("a.mcap");
    desk.text(1, &["diff", "a.mcap", "b.mcap"]);
    assert_eq!(desk.bytes("a.mcap"), before);
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--bless"]);
    assert_eq!(desk.bytes("a.mcap"), desk.bytes("b.mcap"));
    let bytes = desk.bytes("a.mcap");
    desk.put("cut.mcap", &bytes[..bytes.len() - 3000]);
    assert!(desk.error(2, &["diff", "a.mcap", "cut.mcap", "--bless"]).contains("damaged"));
    assert_eq!(desk.bytes("a.mcap"), bytes);
}

#[test]
fn the_difference_is_a_picture_and_a_recording() {
    let desk = desk();
    desk.text(1, &["diff", "a.mcap", "b.mcap", "--plot", "d.svg", "--write-diff", "d.mcap"]);
    let svg = fs::read_to_string(desk.path("d.svg")).expect("a picture");
    assert!(svg.contains("/scalar.force") && svg.contains("new - reference"));
    let rows = desk.text(0, &["trace", "d.mcap", "--topic", "/diff/scalar", "--field", "force,step"]);
    let row = rows.lines().nth(21).expect("the row of step 20");
    let cells: Vec<f64> = row.split(',').map(|cell| cell.parse().expect("a number")).collect();
    assert!((cells[1] - 1e-6).abs() < 1e-12 && cells[2] == 20.0, "{row}");
    assert!(rows.lines().nth(20).expect("a row").contains(",0.0,"));
    desk.text(0, &["verify", "d.mcap"]);
    // existing outputs are kept
    assert!(desk.error(2, &["diff", "a.mcap", "b.mcap", "--plot", "d.svg"]).contains("--force"));
    assert!(
        desk.error(2, &["diff", "a.mcap", "b.mcap", "--write-diff", "a.mcap", "--force"]).contains("itself")
    );
    desk.text(0, &["diff", "a.mcap", "same.mcap", "--plot", "none.svg"]);
    assert!(!desk.path("none.svg").exists(), "no picture of no difference");
}

#[test]
fn verify_and_recover() {
    let desk = desk();
    assert!(desk.text(0, &["verify", "a.mcap"]).contains("sound"));
    let bytes = desk.bytes("a.mcap");
    desk.put("cut.mcap", &bytes[..bytes.len() / 2]);
    let json = desk.json(1, &["verify", "--json", "cut.mcap"]);
    assert_eq!((&json["version"], &json["sound"]), (&1.into(), &false.into()));
    let text = desk.text(3, &["recover", "cut.mcap", "-o", "whole.mcap"]);
    assert!(text.contains("lost:"), "{text}");
    desk.text(0, &["verify", "whole.mcap"]);
    let info = desk.text(0, &["info", "whole.mcap"]);
    assert!(info.contains("percuss.recovered") && info.contains("lost.000"), "{info}");
    assert!(desk.error(1, &["recover", "cut.mcap", "-o", "whole.mcap"]).contains("--force"));
    assert!(desk.error(2, &["recover", "cut.mcap", "-o", "cut.mcap", "--force"]).contains("itself"));
    // a sound one: nothing is lost, all is there
    assert!(desk.text(0, &["recover", "a.mcap", "-o", "copy.mcap"]).contains("nothing was lost"));
    assert!(desk.text(0, &["diff", "a.mcap", "copy.mcap"]).contains("equal"));
}

#[test]
fn topics_and_files_share_rows() {
    let desk = desk();
    let both = ["trace", "a.mcap", "--topic", "/scalar,/slice", "--field", "force,values[3]", "--to", "0.1"];
    let rows = desk.text(0, &both);
    let lines: Vec<&str> = rows.lines().collect();
    assert_eq!(lines[0], "time,/scalar.force [N],/slice.values[3] [Pa]");
    assert_eq!(lines.len(), 1 + 11);
    let gaps: Vec<usize> = (1..12).filter(|&i| lines[i].ends_with(',')).collect();
    assert_eq!(gaps, [2, 3, 4, 5, 6, 7, 8, 9, 10], "a slice every tenth step");
    let rows = desk.text(0, &[&both[..], &["--align", "linear"]].concat());
    assert!(rows.lines().all(|line| !line.ends_with(',')), "{rows}");
    let rows = desk.text(0, &["trace", "a.mcap", "b.mcap", "--topic", "/scalar", "--field", "force"]);
    assert_eq!(rows.lines().next(), Some("time [s],a:force [N],b:force [N]"));
    let differing = rows.lines().skip(1).filter(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        cells[1] != cells[2]
    });
    assert_eq!(differing.count(), 1);
    let rows =
        desk.text(0, &["trace", "a.mcap", "b.mcap", "--topic", "/scalar", "--field", "force", "--stack"]);
    assert_eq!(rows.lines().count(), 1 + 120);
    assert!(rows.lines().nth(61).expect("a row").starts_with("b.mcap,0.0,"));
    // nested fields and positions
    let rows = desk.text(
        0,
        &["trace", "a.mcap", "--topic", "/note", "--field", "place.x,parts[1].x,kind,sizes[0].value"],
    );
    assert_eq!(rows.lines().nth(1), Some("0.05,0.05,0.05,LOUD,1.0"));
    let rows = desk.text(0, &["trace", "a.mcap", "--topic", "/profile", "--field", "p@r=0.05", "--to", "0"]);
    assert!(rows.starts_with("time,p@r=0.05 [Pa]\n0.0,"), "{rows}");
    assert!(desk.error(2, &["trace", "a.mcap", "--topic", "/nothing*"]).contains("/scalar"));
}

#[test]
fn tables_in_every_format() {
    let desk = desk();
    for name in ["t.csv", "t.jsonl", "t.parquet", "t.npy", "t.npz"] {
        desk.text(0, &["trace", "a.mcap", "--topic", "/scalar", "-o", name]);
    }
    let start = |name: &str, length: usize| desk.bytes(name)[..length].to_vec();
    assert_eq!(start("t.parquet", 4), b"PAR1");
    assert_eq!(start("t.npy", 6), b"\x93NUMPY");
    assert_eq!(start("t.npz", 2), b"PK");
    let matrix: ndarray::Array2<f64> = ndarray_npy::read_npy(desk.path("t.npy")).expect("a matrix");
    assert_eq!(matrix.dim(), (60, 6));
    assert_eq!((matrix[[7, 0]], matrix[[7, 1]], matrix[[7, 4]]), (0.07, 7.0, 46.0));
    let mut archive =
        ndarray_npy::NpzReader::new(fs::File::open(desk.path("t.npz")).expect("a file")).expect("npz");
    let count: ndarray::Array1<i64> = archive.by_name("count").expect("an array of integers");
    assert_eq!(count[59], 59 * 7 - 3);
    let flag: ndarray::Array1<bool> = archive.by_name("flag").expect("an array of truth values");
    assert!(flag[0] && !flag[1]);
    let error = desk.error(1, &["trace", "a.mcap", "--topic", "/note", "-o", "n.npy"]);
    assert!(error.contains("text"), "{error}");
    assert!(!desk.path("n.npy").exists());
}

#[test]
fn pictures_in_every_medium() {
    let desk = desk();
    for command in [
        "plot a.mcap b.mcap --topic /scalar --field force -o p.svg",
        "plot a.mcap --topic /profile --at-time 0.1,0.5 -o q.svg",
        "plot a.mcap --topic /slice --at-time 0.3 -o r.png",
        "plot a.mcap --topic /slice --at z=0.3 --at-time 0.3 --log x -o s.svg",
        "plot a.mcap --topic /scalar --field force --range -1,4 --x-range 0,1 -o t.png",
    ] {
        desk.text(0, &command.split(' ').collect::<Vec<_>>());
    }
    let svg = |name: &str| fs::read_to_string(desk.path(name)).expect("a picture");
    for part in ["force [N]", "a:force", "b:force", "time [ms]"] {
        assert!(svg("p.svg").contains(part), "{part}");
    }
    for part in ["p [Pa]", "r [mm]", "time 0.1", "time 0.5"] {
        assert!(svg("q.svg").contains(part), "{part}");
    }
    assert!(svg("s.svg").contains("values [mPa]"));
    for name in ["r.png", "t.png"] {
        assert_eq!(desk.bytes(name)[..4], *b"\x89PNG");
    }
    let drawn = desk.text(0, &["plot", "a.mcap", "--topic", "/scalar", "--field", "force"]);
    assert!(drawn.lines().count() >= 20 && drawn.contains("time [ms]"), "{drawn}");
    assert!(drawn.chars().any(|c| ('\u{2801}'..='\u{28ff}').contains(&c)), "braille: {drawn}");
    assert!(!drawn.contains('\u{1b}'), "no colours where there is no terminal");
    assert!(
        desk.error(2, &["plot", "a.mcap", "--topic", "/note", "--at-time", "0.1", "--field", "text"])
            .contains("nothing to draw")
    );
    assert!(desk.error(2, &["plot", "a.mcap", "-o", "p.eps"]).contains(".svg"));
    assert!(desk.error(1, &["plot", "a.mcap", "--topic", "/scalar", "-o", "p.svg"]).contains("--force"));
}

#[test]
fn fields_and_attachments_are_exported() {
    let desk = desk();
    let error = desk.error(0, &["export", "a.mcap", "--topic", "/slice", "--at-time", "0.21", "-o", "f.npy"]);
    assert!(error.contains("at time 0.2"), "{error}");
    let matrix: ndarray::Array2<f64> = ndarray_npy::read_npy(desk.path("f.npy")).expect("a matrix");
    assert_eq!(matrix.dim(), (4, 6));
    desk.text(0, &["export", "a.mcap", "--topic", "/slice", "-o", "f.vti"]);
    let vti = desk.bytes("f.vti");
    let head = String::from_utf8_lossy(&vti[..600]).into_owned();
    assert!(head.contains("WholeExtent=\"0 5 0 3 0 0\"") && head.contains("Spacing=\"0.1 0.2 1\""), "{head}");
    assert_eq!(desk.text(0, &["export", "a.mcap", "--attachment", "case.toml"]), "seed = 1\nsteps = 60\n");
    assert_eq!(desk.text(0, &["export", "a.mcap", "--attachments", "-o", "out"]), "out/case.toml\n");
    assert!(desk.error(2, &["export", "a.mcap", "--attachment", "none"]).contains("case.toml"));
    assert!(desk.error(2, &["export", "a.mcap", "--topic", "/scalar", "-o", "f.png"]).contains("no matrix"));
}

#[test]
fn schemas_and_messages_as_text() {
    let desk = desk();
    let schema = desk.text(0, &["schema", "a.mcap", "--topic", "/note"]);
    for part in [
        "message Note {",
        "map<string, double> sizes = 8;",
        "repeated lab.Place parts = 6;",
        "enum Kind {",
        "LOUD = 1;",
    ] {
        assert!(schema.contains(part), "{part}: {schema}");
    }
    let lines = desk.text(0, &["cat", "a.mcap", "--topic", "/note,/slice", "--to", "0.1"]);
    let lines: Vec<Json> = lines.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[1]["topic"], "/note");
    assert_eq!(lines[1]["message"]["place"]["x"], 0.05);
    assert_eq!(lines[1]["message"]["kind"], "LOUD");
    assert_eq!(lines[1]["message"]["sizes"]["b"], 2.0);
}

/// Number of messages on `/scalar` in the chunks that end before a place in a recording.
fn scalars_in_whole_chunks(bytes: &[u8], end: usize) -> usize {
    let summary = mcap::Summary::read(bytes).expect("a sound file").expect("a summary");
    let is_whole =
        |chunk: &&mcap::records::ChunkIndex| (chunk.chunk_start_offset + chunk.chunk_length) as usize <= end;
    let scalars = |chunk| {
        let messages = summary.stream_chunk(bytes, chunk).expect("a chunk");
        messages.filter(|message| message.as_ref().expect("a message").channel.topic == "/scalar").count()
    };
    summary.chunk_indexes.iter().filter(is_whole).map(scalars).sum()
}

#[test]
fn a_recording_is_followed_while_it_is_written() {
    /// Longest wait for lines that are due.
    const PATIENCE: Duration = Duration::from_secs(60);
    let desk = desk();
    let bytes = forge(400, 1).write(plain());
    let growing = desk.path("growing.mcap");
    // inside of chunks, between them and inside of the summary
    let parts: Vec<&[u8]> = bytes.chunks(bytes.len().div_ceil(9)).collect();
    for (verb, head) in [("cat", 0), ("trace", 1)] {
        fs::write(&growing, parts[0]).expect("a file");
        let arguments = [verb, "growing.mcap", "--topic", "/scalar", "--follow"];
        let mut child = desk
            .command(&arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let (line, lines) = mpsc::channel();
        let output = BufReader::new(child.stdout.take().expect("a pipe"));
        let reader = thread::spawn(move || output.lines().try_for_each(|text| line.send(text)));
        let mut seen = 0;
        for (i, part) in parts.iter().enumerate() {
            if i > 0 {
                let mut file = fs::OpenOptions::new().append(true).open(&growing).expect("the file");
                file.write_all(part).expect("a part");
            }
            // what is whole by now is shown while the rest is still to come
            let whole = scalars_in_whole_chunks(&bytes, (i + 1) * parts[0].len());
            while whole > 0 && seen < head + whole {
                lines.recv_timeout(PATIENCE).expect("a line is due").expect("text");
                seen += 1;
            }
        }
        reader.join().expect("it reads").expect("the test listens");
        seen += lines.iter().count();
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(seen, head + 400, "{verb}");
    }
}

#[test]
fn reports_are_of_runs() {
    let desk = desk();
    let error = desk.error(2, &["report", "a.mcap"]);
    assert!(error.contains("a.mcap") && error.contains("percuss.run"), "{error}");
    assert!(!desk.path("a.html").exists());
    assert!(desk.error(2, &["report", "a.mcap", "-o", "a.mcap", "--force"]).contains("recording itself"));
    desk.error(1, &["report", "missing.mcap"]);
}

#[test]
fn what_cannot_be_replayed() {
    let desk = desk();
    for address in ["a:b", "ws://127.0.0.1:1", "localhost:99999"] {
        assert!(desk.error(2, &["replay", "a.mcap", "--addr", address]).contains("HOST:PORT"));
    }
    for speed in ["0", "-1", "nan"] {
        desk.error(2, &["replay", "a.mcap", &format!("--speed={speed}")]);
    }
    let error = desk.error(2, &["replay", "a.mcap", "--from", "1e6", "--addr", "0"]);
    assert!(error.contains("no messages from 1000000"), "{error}");
    desk.error(1, &["replay", "missing.mcap"]);
    // an address that is taken
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = taken.local_addr().expect("an address").to_string();
    assert!(desk.error(1, &["replay", "a.mcap", "--addr", &address]).contains(&address));
}

#[test]
fn reports_colour_fields_as_the_views_of_the_recording_do() {
    let desk = Desk::new(&[]);
    let mut recording = forge(60, 1);
    recording.channel("/slice").topic = "/field/stress".into();
    recording.metadata.push(("percuss.run".into(), forge::text_map(&[("title", "a run")])));
    let range = |name: &str, recording: &forge::Forged| {
        desk.put(&format!("{name}.mcap"), recording.write(plain()));
        desk.text(0, &["report", &format!("{name}.mcap")]);
        let page = fs::read_to_string(desk.path(&format!("{name}.html"))).expect("a page");
        let text = page.split("\"range\":").nth(1).and_then(|rest| rest.split(',').next()).expect("a range");
        text.parse::<f64>().expect("a number")
    };
    // without views: what most of the values do not exceed, which are sines
    let estimated = range("plain", &recording);
    // in mPa, as the largest is less than 1 Pa
    assert!((900.0..=1000.0).contains(&estimated), "{estimated}");
    let metadata = &mut recording.channel("/note").metadata;
    metadata.insert("colour_range.stress".into(), "-2.5,2.5".into());
    assert_eq!(range("viewed", &recording), 2.5);
    // what is no range is none
    let metadata = &mut recording.channel("/note").metadata;
    metadata.insert("colour_range.stress".into(), "0,nan".into());
    assert_eq!(range("odd", &recording), estimated);
}

#[test]
fn a_comparison_is_reported_to_continuous_integration() {
    let desk = Desk::new(&[]);
    for (folder, speed) in [("old", "0.5"), ("new", "0.501")] {
        fs::create_dir(desk.path(folder)).expect("room");
        for (name, speed) in [("same", "0.5"), ("other", speed)] {
            let settings = ["mesh.cells=10", "record.frames=0", &format!("target.shear_wave_speed={speed}")];
            si::record("fig5", &settings, &desk.path(&format!("{folder}/{name}.mcap")));
        }
    }
    fs::copy(desk.path("old/same.mcap"), desk.path("old/gone.mcap")).expect("room");
    let (text, said) =
        desk.both(1, &["diff", "old", "new", "--markdown", "--junit", "report.xml", "--github"]);
    assert!(
        text.starts_with(
            "### percuss: DIFFERENT\n\n| recording | channel | verdict | messages compared | largest |\n"
        ),
        "{text}"
    );
    assert!(
        text.contains("| new/other.mcap | /drag | DIFFERENT | 31 of 31 and 31 | largest "),
        "{text}{said}"
    );
    assert!(
        text.contains("| old/gone.mcap | both recordings | DIFFERENT |  | missing from the new folder |"),
        "{text}"
    );
    assert!(text.contains("::error title=new/other.mcap /drag%3A DIFFERENT::/drag "), "{text}");
    assert!(!text.contains("new/same.mcap"), "{text}");
    let report = String::from_utf8(desk.bytes("report.xml")).expect("text");
    let count = |element: &str| report.matches(element).count();
    let failures = count("<failure ");
    assert!(failures > 2 && count("<testsuite ") == 3 && count("<error ") == 0, "{report}");
    assert!(report.contains(&format!("failures=\"{failures}\" errors=\"0\">")), "{report}");
    let same = "<testcase classname=\"new/same.mcap\" name=\"/drag\">\n      <system-out>messages compared: 31 of 31 and 31<";
    assert!(report.contains(same), "{report}");
    assert!(desk.both(2, &["diff", "old", "new", "--junit", "report.xml"]).1.contains("--force"));
    let (text, _) = desk.both(0, &["diff", "old/same.mcap", "new/same.mcap", "--markdown"]);
    assert!(text.starts_with("### percuss: equal\n\n0 of "), "{text}");
}
