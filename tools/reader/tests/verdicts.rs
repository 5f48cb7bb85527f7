//! What could not be compared is never equal: parts of recordings against each other, with every way of comparing, in both
//! directions; and small pairs of files in which something is easily passed over.

use percuss_reader::{
    command::diff::verdict,
    compare::{Comparison, Mode, Options, Rules, compare},
    messages::Recording,
    recording::Limits,
};
use serde_json::json;

use crate::{
    desk::Desk,
    guests::{Guest, types, write},
    raw,
};

/// Messages of the whole recording.
const WHOLE: usize = 24;

/// Message `i` of the whole recording, every 0.1 s: a curve that no line follows.
fn part(chosen: &[usize]) -> Vec<u8> {
    let message = |&i: &usize| {
        let time = i as f64 * 0.1;
        (
            i as u64 * 100_000_000,
            json!({ "time": time, "x": (3.0 * time).sin() + 2.0 }).to_string().into_bytes(),
        )
    };
    let mut guest = Guest::json("/curve", None, &[]);
    guest.messages = chosen.iter().map(message).collect();
    write(&[guest], None)
}

fn comparison(desk: &Desk, names: [&str; 2], options: &Options) -> Comparison {
    let open = |name: &str| Recording::open(&desk.path(name), Limits::default()).expect("a recording");
    compare(&open(names[0]), &open(names[1]), options, None).expect("a comparison")
}

#[test]
fn parts_are_equal_only_to_themselves() {
    let all = 0..WHOLE;
    let parts: Vec<Vec<usize>> = vec![
        all.clone().collect(),
        vec![0],
        vec![WHOLE - 1],
        vec![0, WHOLE - 1],
        vec![11],
        all.clone().step_by(2).collect(),
        all.clone().skip(1).step_by(2).collect(),
        all.clone().step_by(3).collect(),
        (0..12).collect(),
        (12..WHOLE).collect(),
        (6..18).collect(),
        all.clone().filter(|&i| i != 7).collect(),
        (0..WHOLE - 1).collect(),
        (1..WHOLE).collect(),
    ];
    let names: Vec<String> = (0..parts.len()).map(|i| format!("{i}.mcap")).collect();
    let files: Vec<(&str, Vec<u8>)> =
        names.iter().map(String::as_str).zip(parts.iter().map(|part| self::part(part))).collect();
    let desk = Desk::new(&files);
    let modes = [
        None,
        Some(Mode::Step),
        Some(Mode::Time),
        Some(Mode::Nearest),
        Some(Mode::Linear),
        Some(Mode::Cubic),
    ];
    let tolerances: [&[&str]; 6] =
        [&[], &["rel=1e-6"], &["abs=1e-6"], &["peak_rel=1e-6"], &["l2_rel=1e-6"], &["abs=10"]];
    let mut cases = 0;
    for (i, a) in parts.iter().enumerate() {
        for (j, b) in parts.iter().enumerate() {
            for (mode, rules) in
                modes.iter().flat_map(|mode| tolerances.iter().map(move |rules| (*mode, *rules)))
            {
                for common in [false, true] {
                    cases += 1;
                    let list = rules.iter().map(|rule| rule.parse().expect("a rule")).collect();
                    let options =
                        Options { mode, common, rules: Rules { rules: list }, ..Options::default() };
                    let found = comparison(&desk, [&names[i], &names[j]], &options);
                    let case = format!("{a:?}, {b:?}, {mode:?}, {rules:?}, {common}");
                    let channel = &found.channels[0];
                    assert_eq!(channel.messages, [a.len() as u64, b.len() as u64], "{case}");
                    // every message of the reference is compared or counted
                    assert_eq!(channel.compared + channel.only_a, a.len() as u64, "{case}");
                    if i == j {
                        assert!(found.is_equal(), "{case}: {:?}", verdict(&found));
                        continue;
                    }
                    assert!(!found.is_equal(), "{case}");
                    if common {
                        assert!(!found.is_within() || channel.compared > 0, "{case}");
                        continue;
                    }
                    assert!(!found.is_within() || channel.only_a + channel.only_b == 0, "{case}");
                    let ends = |part: &[usize]| (part[0], part[part.len() - 1]);
                    let is_inside = ends(a).0 >= ends(b).0 && ends(a).1 <= ends(b).1;
                    // interpolated where that is asked for or allowed by 10: all of the reference has to lie in the new one;
                    // without any time in common, times count from the start of each, which is reported
                    let is_apart = ends(a).1 < ends(b).0 || ends(b).1 < ends(a).0;
                    let is_chosen = mode.is_none() && rules == ["abs=10"];
                    let between = mode.is_some_and(Mode::is_between) || is_chosen;
                    if is_chosen && is_apart {
                        assert!(channel.alignment.starts.is_some(), "{case}");
                        continue;
                    }
                    assert!(!found.is_within() || (between && is_inside), "{case}: {:?}", verdict(&found));
                }
            }
        }
    }
    assert_eq!(cases, parts.len() * parts.len() * modes.len() * tolerances.len() * 2);
}

/// The status of `diff` of two texts of JSON messages, both ways.
fn of_json([a, b]: [&[&str]; 2], status: i32, options: &[&str]) -> String {
    let file = |messages: &[&str]| {
        let messages: Vec<String> = messages.iter().map(|text| (*text).to_owned()).collect();
        write(&[Guest::json("/j", None, &messages)], None)
    };
    let desk = Desk::new(&[("a.mcap", file(a)), ("b.mcap", file(b))]);
    desk.text(status, &[&["diff", "b.mcap", "a.mcap"], options].concat());
    for name in ["a.mcap", "b.mcap"] {
        desk.text(0, &[&["diff", name, name], options].concat());
    }
    desk.text(status, &[&["diff", "a.mcap", "b.mcap"], options].concat())
}

#[test]
fn numbers_of_json_are_compared_with_all_their_digits() {
    let [most, less] = [r#"{"u":18446744073709551615}"#, r#"{"u":18446744073709551614}"#];
    of_json([&[most, r#"{"u":1}"#], &[less, r#"{"u":1}"#]], 1, &[]);
    let text = of_json([&[r#"{"u":9007199254740993}"#], &[r#"{"u":9007199254740995}"#]], 1, &[]);
    assert!(text.contains("9007199254740993 -> 9007199254740995"), "{text}");
    of_json([&[r#"{"u":9007199254740993}"#], &[r#"{"u":9007199254740995}"#]], 1, &["--abs", "1"]);
    of_json([&[r#"{"u":9007199254740993}"#], &[r#"{"u":9007199254740995}"#]], 0, &["--abs", "2"]);
    // with fractions in other messages they are texts
    let [odd, even] = [r#"{"u":9007199254740993}"#, r#"{"u":9007199254740992}"#];
    of_json([&[odd, r#"{"u":0.5}"#], &[even, r#"{"u":0.5}"#]], 1, &[]);
    // and where that is not known from the first messages, the message does not fit
    let many = |last: &'static str| [vec![r#"{"u":0.5}"#; 200], vec![last]].concat();
    of_json([&many(odd), &many(even)], 1, &[]);
    // what a program writes of a double-precision number is one
    of_json(
        [
            &[r#"{"u":0.5}"#, r#"{"u":1234567890123456800}"#],
            &[r#"{"u":0.5}"#, r#"{"u":1.2345678901234568e18}"#],
        ],
        0,
        &[],
    );
}

#[test]
fn arrays_inside_arrays_have_their_lengths() {
    for (a, b) in [
        ("[[1,2],[3]]", "[[1],[2,3]]"),
        ("[[1],2]", "[1,[2]]"),
        ("[[],1]", "[1,[]]"),
        ("[[[1]],[[2]]]", "[[[1],[2]]]"),
        ("[[1,2,3]]", "[1,2,3]"),
    ] {
        let [a, b] = [a, b].map(|array| format!(r#"{{"a":{array}}}"#));
        of_json([&[&a], &[&b]], 1, &[]);
        of_json([&[&a], &[&b]], 1, &["--abs", "10"]);
    }
    of_json([&[r#"{"a":[[1,2],[3]]}"#], &[r#"{"a":[[1,2],[3.5]]}"#]], 0, &["--abs", "1"]);
}

#[test]
fn whole_numbers_differ_by_what_they_differ() {
    let pool = types("Whole i:int64 u:uint64");
    let file = |i: i64, u: u64| {
        let mut guest = Guest::protobuf("/whole", &pool, "Whole", &[]);
        guest.messages =
            vec![(0, [raw::whole_number(1, i.cast_unsigned()), raw::whole_number(2, u)].concat())];
        write(&[guest], None)
    };
    let desk =
        Desk::new(&[("a.mcap", file(1 << 60, u64::MAX)), ("b.mcap", file((1 << 60) + 1, u64::MAX - 1))]);
    let text = desk.text(1, &["diff", "a.mcap", "b.mcap"]);
    assert!(text.contains("1152921504606846976 -> 1152921504606846977"), "{text}");
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--abs", "1"]);
    desk.text(1, &["diff", "a.mcap", "b.mcap", "--abs", "0.5"]);
    desk.text(1, &["diff", "a.mcap", "b.mcap", "--rel", "1e-19"]);
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--rel", "1e-18"]);
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--ulp", "1"]);
}

#[test]
fn keys_of_maps_have_no_tolerance_and_the_last_of_two_counts() {
    let pool = types("Maps m:map<int32,double>");
    let entry =
        |key: u64, value: f64| raw::block(1, &[raw::whole_number(1, key), raw::double(2, value)].concat());
    let file = |entries: &[Vec<u8>]| {
        let mut guest = Guest::protobuf("/maps", &pool, "Maps", &[]);
        guest.messages = vec![(0, entries.concat())];
        write(&[guest], None)
    };
    let desk = Desk::new(&[
        ("a.mcap", file(&[entry(1, 2.0), entry(3, 4.0)])),
        ("moved.mcap", file(&[entry(2, 2.0), entry(3, 4.0)])),
        ("doubled.mcap", file(&[entry(3, 9.0), entry(1, 2.0), entry(3, 4.0)])),
        ("first.mcap", file(&[entry(3, 4.0), entry(1, 2.0), entry(3, 9.0)])),
    ]);
    desk.text(1, &["diff", "a.mcap", "moved.mcap", "--abs", "10"]);
    desk.text(0, &["diff", "a.mcap", "doubled.mcap"]);
    desk.text(1, &["diff", "a.mcap", "first.mcap"]);
}

#[test]
fn the_order_of_the_file_counts_if_it_is_asked_for() {
    let file = |order: &[u64]| {
        let mut guest = Guest::json("/j", None, &[]);
        let message = |&k: &u64| (k * 10, json!({ "x": k }).to_string().into_bytes());
        guest.messages = order.iter().map(message).collect();
        write(&[guest], None)
    };
    let desk = Desk::new(&[("a.mcap", file(&[0, 1, 2, 3, 4])), ("b.mcap", file(&[0, 2, 4, 1, 3]))]);
    for (a, b) in [("a.mcap", "b.mcap"), ("b.mcap", "a.mcap")] {
        let text = desk.text(0, &["diff", a, b]);
        assert!(text.contains("equal"), "{text}");
        desk.text(1, &["diff", a, b, "--file-order"]);
        desk.text(0, &["diff", a, b, "--abs", "1e-9"]);
    }
    let written = ["diff", "a.mcap", "b.mcap", "--write-diff", "difference.mcap"];
    desk.text(0, &written);
}

#[test]
fn two_messages_at_one_time_are_a_jump() {
    let file = |between: bool| {
        let mut guest = Guest::json("/j", None, &[]);
        let message = |time: f64, x: f64| {
            ((time * 1e9) as u64, json!({ "time": time, "x": x }).to_string().into_bytes())
        };
        for k in 0..20 {
            let time = f64::from(k) * 0.1;
            guest.messages.push(message(time, time));
            if k == 7 {
                guest.messages.push(message(time, time + 5.0));
            }
            if between {
                let later = time + 0.05;
                guest.messages.push(message(later, later + if k == 7 { 4.95 * 0.5 + 0.025 } else { 0.0 }));
            }
        }
        write(&[guest], None)
    };
    let desk = Desk::new(&[("a.mcap", file(false)), ("b.mcap", file(true))]);
    for mode in ["linear", "cubic", "nearest"] {
        let options = ["--align", mode, "--abs", "1e-9", "--common"];
        desk.text(0, &[&["diff", "a.mcap", "b.mcap"], &options[..]].concat());
        desk.text(0, &[&["diff", "a.mcap", "a.mcap"], &options[..4]].concat());
    }
}

#[test]
fn fields_say_how_their_numbers_and_types_differ() {
    let file = |fields: &str| {
        let pool = types(&format!("Curve {fields}"));
        let messages: Vec<_> = (0..5).map(|k| json!({ "time": f64::from(k), "x": k, "n": k })).collect();
        write(&[Guest::protobuf("/curve", &pool, "Curve", &messages)], None)
    };
    let messages: Vec<String> =
        (0..5).map(|k| json!({ "time": f64::from(k), "x": k, "n": k }).to_string()).collect();
    let mut json = Guest::json("/curve", None, &messages);
    // messages in JSON are timed by their log times
    (0..).zip(&mut json.messages).for_each(|(k, message)| message.0 = k * 1_000_000_000);
    let desk = Desk::new(&[
        ("a.mcap", file("time:double x:double n:int32")),
        ("numbers.mcap", file("time:double n:int32 x:double")),
        ("types.mcap", file("time:double x:double n:sint64")),
        ("json.mcap", write(&[json], None)),
    ]);
    let text = desk.text(1, &["diff", "a.mcap", "numbers.mcap"]);
    assert!(text.contains("/curve.x: field number 2 became 3"), "{text}");
    let text = desk.text(1, &["diff", "a.mcap", "types.mcap"]);
    assert!(text.contains("/curve.n: type int32 became sint64"), "{text}");
    // copies by other programs, in their own types or in JSON
    desk.text(1, &["diff", "a.mcap", "json.mcap"]);
    for copy in ["numbers.mcap", "types.mcap", "json.mcap"] {
        desk.text(0, &["diff", "a.mcap", copy, "--by-name"]);
        desk.text(0, &["diff", copy, "a.mcap", "--by-name"]);
    }
}

#[cfg(unix)]
#[test]
fn folders_are_compared_with_all_that_is_in_them() {
    use std::{fs, os::unix::fs::symlink};
    let desk = Desk::new(&[]);
    for folder in ["a/in", "b", "elsewhere"] {
        fs::create_dir_all(desk.path(folder)).expect("room");
    }
    let (same, other) = (part(&[0, 1, 2]), part(&[0, 1, 3]));
    for (name, bytes) in
        [("a/in/x.mcap", &same), ("elsewhere/x.mcap", &other), ("a/y.MCAP", &same), ("b/y.MCAP", &other)]
    {
        desk.put(name, bytes);
    }
    for folder in ["a", "b"] {
        desk.put(&format!("{folder}/z.mcap.part"), &same);
    }
    symlink(desk.path("elsewhere"), desk.path("b/in")).expect("a link");
    // around in a circle
    symlink(desk.path("b"), desk.path("b/again")).expect("a link");
    let text = desk.text(1, &["diff", "a", "b", "--summary"]);
    assert!(text.ends_with("3 comparisons: DIFFERENT\n"), "{text}");
    assert_eq!(text.matches("DIFFERENT  a").count(), 2, "{text}");
}

#[test]
fn reports_say_how_much_was_compared() {
    let desk = Desk::new(&[
        ("a.mcap", part(&(0..24).collect::<Vec<_>>())),
        ("b.mcap", part(&(0..14).collect::<Vec<_>>())),
    ]);
    let text =
        desk.text(1, &["diff", "a.mcap", "b.mcap", "--abs", "1e-2", "--markdown", "--junit", "report.xml"]);
    assert!(text.contains("| b.mcap | /curve | DIFFERENT | 14 of 24 and 14 |"), "{text}");
    assert!(
        text.ends_with("Messages compared: 14 of 24 in the references and 14 in the new recordings.\n"),
        "{text}"
    );
    desk.text(0, &["diff", "a.mcap", "b.mcap", "--common", "--junit", "common.xml"]);
    let report = String::from_utf8(desk.bytes("common.xml")).expect("text");
    assert!(report.contains("messages compared: 14 of 24 and 14"), "{report}");
}
