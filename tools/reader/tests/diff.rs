//! `diff` finds whatever is different, reports where, and nothing else: 500 random mutations, 100 equal pairs. The table `diff`
//! has what it says of each way of comparing.

use mcap::{Compression, WriteOptions};
use prost_reflect::Value;

use crate::{
    cases::change,
    desk::Desk,
    forge::{self, Dice, Forged, forge, plain},
};

/// What is said of two files, by a comparison that ends with a status.
fn compared(status: i32, [a, b]: [Vec<u8>; 2], more: &[&str], round: u64) -> String {
    let desk = Desk::new(&[("a.mcap", a), ("b.mcap", b)]);
    let (text, said) = desk.both(status, &[&["diff", "a.mcap", "b.mcap"], more].concat());
    assert_eq!(said, "", "round {round}");
    text
}

/// Step and topic.field[element] of the first difference that is reported.
fn first(text: &str) -> Option<(u64, &str)> {
    let (name, place) = text.split_once("first difference: ")?.1.lines().next()?.split_once(" at step ")?;
    let (step, _) = place.split_once(',')?;
    Some((step.parse().ok()?, name.split(' ').next()?))
}

/// What a mutation should be reported as.
enum Expected {
    /// First difference at a step and element.
    At(u64, String),
    /// A message without counterpart at a step of a topic.
    Unmatched(u64, &'static str),
    /// A finding of structure on topic.field.
    Structure(String),
    /// The sign of a zero at a step of /profile.p[3]: all bits count, the number is the same.
    Zero(u64),
}

/// Lines that change one thing somewhere in a recording, and what is reported of it.
fn mutation(recording: &Forged, dice: &mut Dice) -> (Vec<String>, Expected) {
    let kind = dice.below(10);
    // a message of a topic, its number and its step
    let one = |topic: &str, dice: &mut Dice| {
        let channel = recording.channels.iter().find(|channel| channel.topic == topic).expect("the topic");
        let at = dice.below(channel.messages.len());
        let message = &channel.messages[at].1;
        let step = message.get_field_by_name("step").and_then(|step| step.as_u64()).expect("a number");
        (at, step, message)
    };
    let (line, expected) = match kind {
        // one value: a unit in the last place, 1e-9, not a number
        0..=2 => {
            let (topic, field, is_float) = [
                ("/scalar", "force", false),
                ("/scalar", "load", true),
                ("/profile", "p", false),
                ("/slice", "values", true),
            ][dice.below(4)];
            let (at, step, message) = one(topic, dice);
            let element = match &*message.get_field_by_name(field).expect("a field") {
                Value::List(list) => format!("[{}]", dice.below(list.len())),
                _ => String::new(),
            };
            let sum = match (kind, is_float) {
                (2, _) => "nan",
                // 1e-9 is less than half a unit in the last place of a float near 1
                (_, true) => "next_float(x)",
                (0, false) => "next(x)",
                (_, false) => "x + 1e-9",
            };
            let name = format!("{topic}.{field}{element}");
            (format!("set {topic}[{at}] {field}{element} = {sum}"), Expected::At(step, name))
        }
        // a series is three steps late from some step on
        3 => {
            let messages = &recording.channels[0].messages;
            let from = 5 + dice.below(messages.len() - 20);
            let force = |i: usize| messages[i].1.get_field_by_name("force").and_then(|force| force.as_f64());
            let line = |i| format!("set /scalar[{i}] force = {:?}", force(i - 3).expect("a number"));
            let expected = Expected::At(from as u64, "/scalar.force".into());
            return ((from..messages.len()).map(line).collect(), expected);
        }
        4 => {
            let topic = ["/scalar", "/profile", "/slice", "/note"][dice.below(4)];
            let (at, step, _) = one(topic, dice);
            (format!("remove {topic}[{at}]"), Expected::Unmatched(step, topic))
        }
        5 => {
            let (kind, topic) = [("Scalar", "/scalar"), ("Profile", "/profile")][dice.below(2)];
            let types = &recording.file.message_type;
            let fields = &types.iter().find(|message| message.name() == kind).expect("the type").field;
            let name = fields[2 + dice.below(fields.len() - 2)].name();
            (format!("field {kind} {name} renamed"), Expected::Structure(format!("{topic}.{name}")))
        }
        6 => {
            let (topic, field, unit) =
                [("/scalar", "force", "kN"), ("/profile", "p", "MPa"), ("/profile", "r0", "mm")]
                    [dice.below(3)];
            (format!("meta {topic} unit.{field}={unit}"), Expected::Structure(format!("{topic}.{field}")))
        }
        7 => {
            let (at, step, _) = one("/scalar", dice);
            let (field, sum) = [("count", "x + 1"), ("flag", "1 - x")][dice.below(2)];
            (format!("set /scalar[{at}] {field} = {sum}"), Expected::At(step, format!("/scalar.{field}")))
        }
        8 => {
            let (at, step, _) = one("/note", dice);
            let (name, field, sum) = [
                ("text", "text", "\"other\"".to_owned()),
                ("parts[1].x", "parts[1]", r#"{"x": -7, "tags": [1, -2]}"#.to_owned()),
                (
                    "parts.tags[1]",
                    "parts[0]",
                    format!(r#"{{"x": {:?}, "tags": [1, -3]}}"#, forge::time(step)),
                ),
            ][dice.below(3)]
            .clone();
            (format!("set /note[{at}] {field} = {sum}"), Expected::At(step, format!("/note.{name}")))
        }
        _ => {
            let (at, step, _) = one("/profile", dice);
            (format!("set /profile[{at}] p[3] = -0.0"), Expected::Zero(step))
        }
    };
    (vec![line], expected)
}

#[test]
fn five_hundred_mutations_are_found_and_located() {
    let mut dice = Dice(20_261_121);
    for round in 0..500 {
        let mut a = forge(60, round);
        let mut b = a.clone();
        let (lines, expected) = mutation(&a, &mut dice);
        lines.iter().for_each(|line| change(&mut b, line));
        if let Expected::Zero(_) = expected {
            change(&mut a, &lines[0].replace("-0.0", "0"));
        }
        let files = || [&a, &b].map(|recording| recording.write(plain()));
        let text = compared(1, files(), &[], round);
        match expected {
            Expected::Zero(step) => {
                assert_eq!(first(&text), Some((step, "/profile.p[3]")), "round {round}");
                let tolerant = compared(0, files(), &["--abs", "0"], round);
                assert!(
                    tolerant.starts_with("a.mcap -> b.mcap: within tolerance\n"),
                    "round {round}: {tolerant}"
                );
            }
            Expected::At(step, name) => {
                assert_eq!(first(&text), Some((step, name.as_str())), "round {round}");
            }
            Expected::Unmatched(step, topic) => {
                let part = text.split("\n\n").find(|part| part.starts_with(&format!("{topic}  ")));
                let missing = format!("! 1 messages only in the reference, the first at step {step},");
                let part = part.expect("the topic is reported");
                assert!(
                    part.contains(&missing) && !part.contains("only in the new"),
                    "round {round}: {text}"
                );
            }
            Expected::Structure(name) => {
                assert!(text.contains(&format!("\n  {name}: ")), "round {round}: {name}, {text}");
            }
        }
    }
}

#[test]
fn a_hundred_equal_pairs_raise_no_alarm() {
    let containers = || {
        [
            plain(),
            WriteOptions::new().compression(Some(Compression::Zstd)),
            WriteOptions::new().compression(Some(Compression::Lz4)).chunk_size(Some(1000)),
            plain().use_chunks(false),
            plain().emit_summary_records(false).emit_summary_offsets(false),
        ]
    };
    for round in 0..100 {
        let recording = forge(40, round);
        let a = recording.write(containers()[round as usize % 5].clone());
        let b = recording.write(containers()[round as usize / 5 % 5].clone());
        let text = compared(0, [a, b], &["--json"], round);
        let document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let comparison = &document["comparisons"][0];
        let counts = serde_json::json!({ "/scalar": 40, "/profile": 40, "/slice": 4, "/note": 2 });
        assert_eq!(
            (&comparison["verdict"], &comparison["equal"]),
            (&"equal".into(), &counts),
            "round {round}"
        );
        assert!(comparison.get("channels").is_none() && comparison.get("first").is_none(), "{comparison}");
    }
}
