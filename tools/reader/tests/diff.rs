//! `diff` finds whatever is different, reports where, and nothing else: 500 random mutations, 100 equal pairs. The table `diff`
//! has what it says of each way of comparing.

use mcap::{Compression, WriteOptions};
use prost_reflect::{DynamicMessage, Value};

use crate::{
    desk::Desk,
    forge::{Dice, Forged, forge, plain},
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
    Zero(usize),
}

fn add(value: &mut Value, how: usize) {
    let f64_next = |x: f64| match how {
        0 => x.next_up(),
        1 => x + 1e-9,
        _ => f64::NAN,
    };
    match value {
        Value::F64(x) => *x = f64_next(*x),
        // 1e-9 is less than half a unit in the last place of a float near 1
        Value::F32(x) if how < 2 => *x = x.next_up(),
        Value::F32(x) => *x = f32::NAN,
        other => panic!("{other:?} is no floating-point number"),
    }
}

/// Sets an element of a list in a message.
fn set_element(message: &mut DynamicMessage, field: &str, i: usize, value: Value) {
    let mut list = message.get_field_by_name(field).expect("a field").into_owned();
    if let Value::List(list) = &mut list {
        list[i] = value;
    }
    message.set_field_by_name(field, list);
}

/// Sets /profile.p[3] of a step.
fn zero(recording: &mut Forged, step: usize, zero: f64) {
    set_element(&mut recording.channel("/profile").messages[step].1, "p", 3, Value::F64(zero));
}

/// The number of a step.
fn step_of(message: &DynamicMessage) -> u64 {
    message.get_field_by_name("step").and_then(|step| step.as_u64()).expect("a number")
}

/// Changes one thing somewhere in a recording.
fn mutate(recording: &mut Forged, dice: &mut Dice) -> Expected {
    let steps = recording.channels[0].messages.len() as u64;
    let kind = dice.below(10);
    match kind {
        // one value: a unit in the last place, 1e-9, not a number
        0..=2 => {
            let (topic, field) =
                [("/scalar", "force"), ("/scalar", "load"), ("/profile", "p"), ("/slice", "values")]
                    [dice.below(4)];
            let channel = recording.channel(topic);
            let at = dice.below(channel.messages.len());
            let message = &mut channel.messages[at].1;
            let step = step_of(message);
            let mut value = message.get_field_by_name(field).expect("a field").into_owned();
            let name = match &mut value {
                Value::List(list) => {
                    let i = dice.below(list.len());
                    add(&mut list[i], kind);
                    format!("{topic}.{field}[{i}]")
                }
                value => {
                    add(value, kind);
                    format!("{topic}.{field}")
                }
            };
            message.set_field_by_name(field, value);
            Expected::At(step, name)
        }
        // a series is three steps late from some step on
        3 => {
            let from = 5 + dice.below(steps as usize - 20);
            let channel = recording.channel("/scalar");
            let old: Vec<Value> = channel
                .messages
                .iter()
                .map(|(_, message)| message.get_field_by_name("force").expect("a field").into_owned())
                .collect();
            for (i, (_, message)) in channel.messages.iter_mut().enumerate().skip(from) {
                message.set_field_by_name("force", old[i - 3].clone());
            }
            Expected::At(from as u64, "/scalar.force".into())
        }
        4 => {
            let topic = ["/scalar", "/profile", "/slice", "/note"][dice.below(4)];
            let channel = recording.channel(topic);
            let at = dice.below(channel.messages.len());
            let (_, message) = channel.messages.remove(at);
            Expected::Unmatched(step_of(&message), topic)
        }
        5 => {
            let (message, topic) = [(0, "/scalar"), (1, "/profile")][dice.below(2)];
            let fields = &mut recording.file.message_type[message].field;
            let i = 2 + dice.below(fields.len() - 2);
            let name = fields[i].name.replace("renamed".into()).unwrap_or_default();
            Expected::Structure(format!("{topic}.{name}"))
        }
        6 => {
            let (topic, field, unit) =
                [("/scalar", "force", "kN"), ("/profile", "p", "MPa"), ("/profile", "r0", "mm")]
                    [dice.below(3)];
            recording.channel(topic).metadata.insert(format!("unit.{field}"), unit.into());
            Expected::Structure(format!("{topic}.{field}"))
        }
        7 => {
            let channel = recording.channel("/scalar");
            let at = dice.below(channel.messages.len());
            let message = &mut channel.messages[at].1;
            let field = ["count", "flag"][dice.below(2)];
            let value = match message.get_field_by_name(field).expect("a field").into_owned() {
                Value::I64(count) => Value::I64(count + 1),
                Value::Bool(flag) => Value::Bool(!flag),
                other => other,
            };
            message.set_field_by_name(field, value);
            Expected::At(at as u64, format!("/scalar.{field}"))
        }
        8 => {
            let channel = recording.channel("/note");
            let at = dice.below(channel.messages.len());
            let message = &mut channel.messages[at].1;
            let part = |name: &str, value| {
                let mut part = message.get_field_by_name("place").expect("a field").into_owned();
                if let Value::Message(part) = &mut part {
                    part.set_field_by_name(name, value);
                }
                part
            };
            let name = match dice.below(3) {
                0 => {
                    message.set_field_by_name("text", Value::String("other".into()));
                    "/note.text"
                }
                1 => {
                    let part = part("x", Value::F64(-7.0));
                    set_element(message, "parts", 1, part);
                    "/note.parts[1].x"
                }
                _ => {
                    let part = part("tags", Value::List(vec![Value::I32(1), Value::I32(-3)]));
                    set_element(message, "parts", 0, part);
                    "/note.parts.tags[1]"
                }
            };
            Expected::At(step_of(message), name.into())
        }
        _ => {
            let at = dice.below(recording.channel("/profile").messages.len());
            zero(recording, at, -0.0);
            Expected::Zero(at)
        }
    }
}

#[test]
fn five_hundred_mutations_are_found_and_located() {
    let mut dice = Dice(20_261_121);
    for round in 0..500 {
        let mut a = forge(60, round);
        let mut b = a.clone();
        let expected = mutate(&mut b, &mut dice);
        if let Expected::Zero(at) = expected {
            zero(&mut a, at, 0.0);
        }
        let files = || [&a, &b].map(|recording| recording.write(plain()));
        let text = compared(1, files(), &[], round);
        match expected {
            Expected::Zero(at) => {
                assert_eq!(first(&text), Some((at as u64, "/profile.p[3]")), "round {round}");
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
