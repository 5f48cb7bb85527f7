//! `diff` finds whatever is different, reports where, and nothing else: 500 random mutations, 100 equal pairs, and one
//! test per way of comparing.

use mcap::{Compression, WriteOptions};
use percuss_reader::{
    command::diff::{Style, Verdict, to_text, verdict},
    compare::{
        Change, ChannelReport, Comparison, Difference, FieldReport, Finding, Hint, Mode, NanRule, Options,
        Rules, compare,
    },
    messages::Recording,
    recording::Limits,
    select::Window,
    wire::Layout,
};
use prost_reflect::{
    DynamicMessage, Value,
    prost::Message,
    prost_types::field_descriptor_proto::{Label, Type},
};

use crate::{
    desk::Desk,
    forge::{self, Dice, Forged, by_log_time, forge, list, number, plain},
    raw,
};

/// Compares two files.
fn compared(a: &[u8], b: &[u8], options: &Options) -> Comparison {
    let desk = Desk::new(&[("a.mcap", a.to_vec()), ("b.mcap", b.to_vec())]);
    let open = |name| Recording::open(&desk.path(name), Limits::default()).expect("a recording");
    compare(&open("a.mcap"), &open("b.mcap"), options, None).expect("a comparison")
}

fn forged(a: &Forged, b: &Forged, options: &Options) -> Comparison {
    compared(&a.write(plain()), &b.write(plain()), options)
}

fn verdict_of(a: &Forged, b: &Forged, options: &Options) -> Verdict {
    verdict(&forged(a, b, options))
}

fn channel<'a>(comparison: &'a Comparison, topic: &str) -> &'a ChannelReport {
    comparison.channels.iter().find(|channel| channel.topic == topic).expect("the channel")
}

fn field<'a>(comparison: &'a Comparison, topic: &str, path: &str) -> &'a FieldReport {
    let fields = &channel(comparison, topic).fields;
    fields.iter().find(|field| field.path == path).expect("the field")
}

fn rules(rules: &[&str]) -> Options {
    let rules = rules.iter().map(|rule| rule.parse().expect("a rule")).collect();
    Options { rules: Rules { rules }, ..Options::default() }
}

/// Largest difference, first step and topic.field[element] that a comparison reports.
fn first(comparison: &Comparison) -> Option<(u64, String)> {
    let (topic, field, divergence) = comparison.first(false)?;
    let name = format!("{topic}.{}", field.element.element(divergence.place.element));
    Some((divergence.place.step?, name))
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
        let comparison = forged(&a, &b, &Options::default());
        match expected {
            Expected::Zero(at) => {
                assert_eq!(verdict(&comparison), Verdict::Different, "round {round}");
                assert_eq!(first(&comparison), Some((at as u64, "/profile.p[3]".into())), "round {round}");
                let tolerant = forged(&a, &b, &rules(&["abs=0"]));
                assert_eq!(verdict(&tolerant), Verdict::Within, "round {round}");
            }
            Expected::At(step, name) => {
                assert_eq!(verdict(&comparison), Verdict::Different, "round {round}: {name}");
                assert_eq!(first(&comparison), Some((step, name)), "round {round}");
            }
            Expected::Unmatched(step, topic) => {
                assert_eq!(verdict(&comparison), Verdict::Different, "round {round}: {topic}");
                let channel = channel(&comparison, topic);
                assert_eq!((channel.only_a, channel.only_b), (1, 0), "round {round}: {topic}");
                let (place, in_a) = channel.first_unmatched.as_ref().expect("a place");
                assert_eq!((place.step, *in_a), (Some(step), true), "round {round}: {topic}");
            }
            Expected::Structure(name) => {
                assert_eq!(verdict(&comparison), Verdict::Different, "round {round}: {name}");
                let reported = |finding: &Finding| {
                    format!("{}.{}", finding.topic, finding.field.clone().unwrap_or_default()) == name
                };
                assert!(
                    comparison.structure.iter().any(reported),
                    "round {round}: {name}, {:?}",
                    comparison.structure
                );
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
        let comparison = compared(&a, &b, &Options::default());
        assert_eq!(verdict(&comparison), Verdict::Equal, "round {round}");
        assert!(!comparison.is_lossy() && comparison.first(false).is_none());
        let compared: u64 = comparison.channels.iter().map(|channel| channel.compared).sum();
        assert_eq!(compared, 40 + 40 + 4 + 2);
    }
}

#[test]
fn not_a_number_is_the_same_bits() {
    let holding = |bits: u64| {
        let mut recording = forge(30, 1);
        recording.set("/scalar", 7, "force", Value::F64(f64::from_bits(bits)));
        recording
    };
    let a = holding(f64::NAN.to_bits());
    for tolerance in [&[] as &[&str], &["abs=1,rel=1"]] {
        let copy = forged(&a, &a, &rules(tolerance));
        assert_eq!(verdict(&copy), Verdict::Equal, "a copy is equal, {tolerance:?}");
    }
    // beside another difference too, where messages are not the same bytes
    let mut beside = a.clone();
    beside.set("/scalar", 7, "count", Value::I64(-9));
    let comparison = forged(&a, &beside, &Options::default());
    assert_eq!(first(&comparison), Some((7, "/scalar.count".into())));
    assert_eq!(verdict_of(&a, &beside, &rules(&["/scalar.count:ignore"])), Verdict::Equal);
    // other bits differ, unless all that are no numbers are alike
    let other = holding(f64::NAN.to_bits() | 5);
    let strict = forged(&a, &other, &Options::default());
    assert_eq!((verdict(&strict), first(&strict)), (Verdict::Different, Some((7, "/scalar.force".into()))));
    let (_, _, divergence) = strict.first(false).expect("a difference");
    assert_ne!(divergence.a, divergence.b, "distinguished");
    let asked = forged(&a, &other, &Options { nan: NanRule::EqualsItself, ..Options::default() });
    assert_eq!(verdict(&asked), Verdict::Equal);
    // against a number it differs still, unless it stands for no value
    let whole = forge(30, 1);
    let [strict, skipped] = [NanRule::EqualsItself, NanRule::Skipped]
        .map(|nan| forged(&whole, &a, &Options { nan, ..Options::default() }));
    assert_eq!(first(&strict), Some((7, "/scalar.force".into())));
    assert_eq!(verdict(&skipped), Verdict::Equal);
}

#[test]
fn tolerances_apply_to_what_they_name() {
    let a = forge(60, 2);
    let mut b = a.clone();
    for (_, message) in &mut b.channel("/scalar").messages {
        let force = number(message, "force");
        message.set_field_by_name("force", Value::F64(force * (1.0 + 1e-6)));
    }
    for (given, expected) in [
        (&[] as &[&str], Verdict::Different),
        (&["rel=2e-6"], Verdict::Within),
        (&["/scalar.force:rel=2e-6"], Verdict::Within),
        (&["/scalar:peak_rel=1.1e-6"], Verdict::Within),
        (&["/scalar:peak_rel=0.9e-6"], Verdict::Different),
        (&["/scalar:range_rel=1e-5"], Verdict::Within),
        (&["/scalar:abs=1e-7"], Verdict::Different),
        (&["/scalar:abs=1e-5"], Verdict::Within),
        (&["/scalar:l2_rel=1.1e-6"], Verdict::Within),
        (&["/scalar:l2_rel=0.9e-6"], Verdict::Different),
        (&["/scalar:ulp=1000000000000"], Verdict::Within),
        (&["/profile:abs=1"], Verdict::Different),
        (&["/scalar.force:bitwise", "*:abs=1"], Verdict::Different),
        (&["/scalar.force:ignore"], Verdict::Equal),
        // the curve has a maximum: there no neighbour reaches a value that is a millionth larger
        (&["/scalar:tube=0.01:1e-9"], Verdict::Different),
        (&["/scalar:tube=0.01:4e-6"], Verdict::Within),
    ] {
        assert_eq!(verdict_of(&a, &b, &rules(given)), expected, "{given:?}");
    }
}

#[test]
fn late_recordings_are_moved() {
    // a curve at other times, 0.137 later
    let curve = |count: u64, interval: f64, late: f64| {
        let mut recording = constant((0..count).map(|k| (k, k as f64 * interval + late)));
        let x = |k: usize| (3.0 * k as f64 * interval).sin();
        recording.set_all("/scalar", "force", |k| Value::F64(x(k)));
        recording
    };
    let (a, b) = (curve(200, 0.01, 0.0), curve(250, 0.008, 0.137));
    let desk = Desk::new(&[("a.mcap", a.write(plain())), ("b.mcap", b.write(plain()))]);
    let compared =
        ["diff", "a.mcap", "b.mcap", "--field", "force", "--align", "linear", "--common", "--abs", "1e-3"];
    desk.text(1, &compared);
    desk.text(0, &[&compared[..], &["--time-offset", "-0.137"]].concat());
    let found = desk.json(0, &[&compared[..], &["--time-offset", "fit", "--json"]].concat());
    let offset = found["comparisons"][0]["time_offset"].as_f64().expect("a number");
    assert!((offset + 0.137).abs() < 1e-4, "{offset}");
    let text = desk.text(0, &[&compared[..], &["--time-offset", "fit"]].concat());
    assert!(text.contains(" is added to the times of the new recording"), "{text}");
    // times are compared as they are moved
    let late = desk.text(1, &["diff", "a.mcap", "a.mcap", "--time-offset", "1e-9"]);
    assert!(late.contains("200 of 200 values differ") && late.contains("/scalar.time"), "{late}");
    let moved = curve(200, 0.01, 0.25).write(plain());
    desk.put("moved.mcap", moved);
    desk.text(0, &["diff", "a.mcap", "moved.mcap", "--time-offset=-0.25", "--tol", "time:abs=1e-12"]);
    // nothing that varies is nothing to go by
    let flat = constant((0..20).map(|k| (k, k as f64))).write(plain());
    desk.put("flat.mcap", flat);
    let said = desk.error(2, &["diff", "flat.mcap", "flat.mcap", "--time-offset", "fit"]);
    assert!(said.contains("that vary"), "{said}");
}

/// A recording of a function of time and radius at other times and radii.
fn sampled(steps: u64, interval: f64, dr: f64, n: usize) -> Forged {
    let mut recording = forge(steps, 0);
    recording.channels.truncate(2);
    let f = |t: f64, r: f64| (2.0 * t).sin() * (1.0 - r * r) + t;
    let t = |step: usize| step as f64 * interval;
    for channel in &mut recording.channels {
        channel.messages.iter_mut().enumerate().for_each(|(k, (at, _))| *at = (t(k) * 1e9).round() as u64);
    }
    for topic in ["/profile", "/scalar"] {
        recording.set_all(topic, "time", |k| Value::F64(t(k)));
    }
    recording.set_all("/profile", "r0", |_| Value::F64(dr / 2.0));
    recording.set_all("/profile", "dr", |_| Value::F64(dr));
    recording.set_all("/profile", "p", |k| list((0..n).map(|i| f(t(k), (i as f64 + 0.5) * dr))));
    recording.set_all("/scalar", "force", |k| Value::F64(f(t(k), 0.0)));
    recording.set_all("/scalar", "load", |_| Value::F32(0.0));
    recording
}

#[test]
fn other_times_and_meshes_are_interpolated() {
    let (coarse, fine) = (sampled(50, 0.02, 0.1, 10), sampled(140, 0.007, 0.03, 31));
    let loose = |mode| {
        let options = rules(&["/scalar.count:ignore", "/scalar.flag:ignore", "*:abs=10"]);
        Options { mode, common: true, ..options }
    };
    let worst = |comparison: &Comparison, topic: &str, path: &str| {
        field(comparison, topic, path).measure.max.as_ref().map_or(0.0, |(max, _)| *max)
    };
    let linear = forged(&coarse, &fine, &loose(None));
    assert_eq!(verdict(&linear), Verdict::Within, "{:?}", linear.structure);
    let profile = channel(&linear, "/profile");
    assert_eq!(profile.alignment.mode, Some(Mode::Linear));
    assert!(profile.alignment.automatic && profile.axes_differ);
    // the fine recording ends at 139 · 0.007 = 0.973
    assert_eq!((profile.compared, profile.only_a, profile.only_b), (49, 1, 49));
    let reversed = forged(&fine, &coarse, &loose(None));
    let profile = channel(&reversed, "/profile");
    assert_eq!((profile.compared, profile.only_a, profile.only_b), (140, 0, 0));
    // what only one of them has is no difference only if that is said; the fine one needs all of the coarse one
    let all = Options { common: false, ..loose(None) };
    assert_eq!(verdict_of(&coarse, &fine, &all), Verdict::Different);
    assert_eq!(verdict_of(&fine, &coarse, &all), Verdict::Within);
    let [by_linear, by_cubic, by_nearest] = [None, Some(Mode::Cubic), Some(Mode::Nearest)]
        .map(|mode| worst(&forged(&coarse, &fine, &loose(mode)), "/scalar", "force"));
    // f'' = 4: h²/8·f'' = 2.5e-5; the cubic's error is of fourth order; the nearest is off by up to h/2·f'
    assert!((1e-6..2.5e-5).contains(&by_linear), "{by_linear}");
    assert!(by_cubic < 1e-7, "{by_cubic}");
    assert!((1e-3..1.2e-2).contains(&by_nearest), "{by_nearest}");
    assert!(worst(&linear, "/profile", "p") < 4e-4, "interpolated in the radius too");
    // unasked, other radii are a difference like any other
    assert_eq!(verdict_of(&coarse, &fine, &Options::default()), Verdict::Different);
}

#[test]
fn matrices_on_other_grids_are_compared_where_both_are() {
    let make = |dr: f64, nr: u32, dz: f64, nz: u32| {
        let mut recording = forge(30, 0).only("/slice");
        let value = |j: u32, i: u32| (2.0 * f64::from(j) * dz + 3.0 * f64::from(i) * dr) as f32;
        let values = (0..nz).flat_map(|j| (0..nr).map(move |i| Value::F32(value(j, i)))).collect();
        let fields = [
            ("dr", Value::F64(dr)),
            ("dz", Value::F64(dz)),
            ("nr", Value::U32(nr)),
            ("nz", Value::U32(nz)),
            ("values", Value::List(values)),
        ];
        for (name, value) in fields {
            recording.set_all("/slice", name, |_| value.clone());
        }
        recording
    };
    let options = Options { common: true, ..rules(&["*:abs=1e-5"]) };
    let comparison = forged(&make(0.1, 6, 0.2, 4), &make(0.04, 20, 0.05, 9), &options);
    assert_eq!(verdict(&comparison), Verdict::Within);
    // rows to 0.4 of 0.6, columns to 0.5 of 0.5
    assert_eq!(field(&comparison, "/slice", "values").measure.elements, 3 * 3 * 6);
    assert!(comparison.channels[0].axes_differ);
    // the same grid, cut off elsewhere: the common part agrees, the sizes do not
    let cut = forged(&make(0.1, 6, 0.2, 4), &make(0.1, 5, 0.2, 3), &options);
    assert_eq!(verdict(&cut), Verdict::Different);
    let wrong = cut.channels[0].fields.iter().filter(|field| !field.within);
    assert_eq!(wrong.map(|field| &field.path).collect::<Vec<_>>(), ["nr", "nz"]);
}

/// Gives the scalars of a recording the type that its file has now.
fn retype_scalars(recording: &mut Forged) {
    let descriptor = forge::pool(&recording.file).get_message_by_name("lab.Scalar").expect("the message");
    for (_, message) in &mut recording.channel("/scalar").messages {
        let bytes = message.encode_to_vec();
        *message = DynamicMessage::decode(descriptor.clone(), &bytes[..]).expect("a message");
    }
}

#[test]
fn schemas_of_different_versions_are_aligned() {
    let a = forge(30, 4);
    let mut b = a.clone();
    let fields = &mut b.file.message_type[0].field;
    fields[3].name = Some("weight".into());
    fields.remove(5);
    fields.push(forge::field("extra", 11, Label::Optional, Type::Double, None));
    for (_, message) in &mut b.channel("/scalar").messages {
        message.clear_field_by_name("flag");
    }
    retype_scalars(&mut b);
    let comparison = forged(&a, &b, &Options::default());
    let kinds: Vec<(Option<&str>, &Difference)> =
        comparison.structure.iter().map(|finding| (finding.field.as_deref(), &finding.difference)).collect();
    assert!(kinds.contains(&(Some("load"), &Difference::Renamed("weight".into()))), "{kinds:?}");
    assert!(kinds.contains(&(Some("flag"), &Difference::Missing)), "{kinds:?}");
    assert!(kinds.contains(&(Some("extra"), &Difference::Extra)), "{kinds:?}");
    let scalar = channel(&comparison, "/scalar");
    assert!(scalar.fields.iter().all(|field| field.within), "what both have agrees");
    let ignoring =
        forged(&a, &b, &rules(&["/scalar.load:ignore", "/scalar.flag:ignore", "/scalar.extra:ignore"]));
    assert_eq!(verdict(&ignoring), Verdict::Equal, "{:?}", ignoring.structure);
}

/// What the recordings say differently of themselves.
fn provenance(comparison: &Comparison) -> Vec<String> {
    let change = |change: &Change| {
        let [a, b] = [&change.a, &change.b].map(|text| text.clone().unwrap_or_default());
        format!("{} {}: {a} -> {b}", change.place, change.key)
    };
    comparison.provenance.iter().map(change).collect()
}

#[test]
fn what_the_case_says_differently_is_reported() {
    let a = forge(30, 5);
    let mut b = a.clone();
    b.attachments[0].1 = b"seed = 6\nsteps = 30\n[mesh]\ncells = 4\n".to_vec();
    b.metadata[0].1.insert("who".into(), "you".into());
    let comparison = forged(&a, &b, &Options::default());
    assert_eq!(
        verdict(&comparison),
        Verdict::Equal,
        "provenance is reported, and is no difference of numbers"
    );
    let expected = ["lab who: me -> you", "case.toml mesh.cells:  -> 4", "case.toml seed: 5 -> 6"];
    assert_eq!(provenance(&comparison), expected);
}

#[test]
fn programs_of_another_commit_or_numerics_are_mentioned() {
    let record = |name: &str, entries: &[(&str, &str)]| (name.to_owned(), forge::text_map(entries));
    let of = |version: &str, numerics: &str, commit: &str, host: &str| {
        let mut recording = forge(20, 5);
        let run = [("percuss_version", version), ("numerics", numerics)];
        recording.metadata.push(record("percuss.run", &run));
        recording.metadata.push(record("percuss.host", &[("commit", commit), ("host", host)]));
        recording
    };
    let mentioned = |b: &Forged| -> Vec<String> {
        let comparison = forged(&of("0.1.0", "1", "aaa", "here"), b, &Options::default());
        assert_eq!(verdict(&comparison), Verdict::Equal);
        let text = to_text(("a", "b"), &comparison, Style::default());
        let lines = text.lines().filter_map(|line| line.trim().strip_prefix("percuss."));
        lines.map(str::to_owned).collect()
    };
    assert_eq!(mentioned(&of("0.1.0", "1", "aaa", "there")), [""; 0]);
    assert_eq!(
        mentioned(&of("0.2.0", "2", "bbb", "there")),
        ["host commit: aaa -> bbb", "run numerics: 1 -> 2", "run percuss_version: 0.1.0 -> 0.2.0"]
    );
}

#[test]
fn topics_derived_in_one_recording_only_are_compared_either_way() {
    let own = forge(20, 5);
    let mut derived = own.clone();
    derived.channel("/scalar").metadata.insert("derived".into(), "/profile".into());
    for (a, b) in [(&own, &derived), (&derived, &own)] {
        let comparison = forged(a, b, &Options::default());
        assert_eq!((verdict(&comparison), comparison.derived.len()), (Verdict::Equal, 0));
        assert_eq!(channel(&comparison, "/scalar").compared, 20);
        assert_eq!(comparison.provenance.len(), 1, "{:?}", comparison.provenance);
    }
    let comparison = forged(&derived, &derived, &Options::default());
    assert_eq!(comparison.derived.iter().collect::<Vec<_>>(), ["/scalar"]);
}

#[test]
fn damaged_recordings_are_compared_as_far_as_they_are_sound() {
    let a = forge(400, 6).write(plain());
    let cut = &a[..a.len() * 2 / 3];
    let comparison = compared(&a, cut, &Options::default());
    assert!(comparison.is_lossy());
    let scalar = channel(&comparison, "/scalar");
    assert!(scalar.compared > 100 && scalar.only_a > 50 && scalar.only_b == 0);
    assert!(scalar.fields.iter().all(|field| field.measure.differing == 0));
}

#[test]
fn recordings_in_other_orders_are_equal_or_refused() {
    let a = forge(300, 8);
    let mut b = a.clone();
    // all profiles at the end of the file
    for (at, _) in &mut b.channel("/profile").messages {
        *at += 1_000_000_000_000;
    }
    let desk = Desk::new(&[("a.mcap", a.write(plain())), ("b.mcap", b.write(plain()))]);
    let run = |memory, topics: &[&str]| {
        let open = |name| Recording::open(&desk.path(name), Limits { memory }).expect("a recording");
        let topics = topics.iter().map(|topic| topic.parse().expect("a topic")).collect();
        compare(&open("a.mcap"), &open("b.mcap"), &Options { topics, ..Options::default() }, None)
    };
    assert_eq!(verdict(&run(1 << 30, &[]).expect("a comparison")), Verdict::Equal);
    let refused = run(1 << 20, &[]).expect_err("no room to wait");
    assert!(refused.to_string().contains("`/profile`"), "{refused}");
    assert_eq!(verdict(&run(3 << 20, &["/profile"]).expect("a comparison")), Verdict::Equal);
}

#[test]
fn maps_in_another_order_are_equal() {
    // two entries of `sizes` as two writers may order them
    let entry =
        |key: &str, value| raw::block(8, &[raw::block(1, key.as_bytes()), raw::double(2, value)].concat());
    let descriptor = forge::pool(&forge::file()).get_message_by_name("lab.Note").expect("the message");
    let layout = Layout::of(&descriptor);
    let decode = |bytes: &[u8]| {
        let mut values = layout.values();
        layout.decode(bytes, &mut values).expect("a message");
        values
    };
    let (a, b) = (entry("a", 1.0), entry("b", 2.0));
    assert_eq!(decode(&[a.clone(), b.clone()].concat()), decode(&[b, a].concat()));
}

#[test]
fn wall_clocks_are_compared_from_the_start_of_each_recording() {
    let wall = |start: u64, changed: Option<usize>, count: u64| {
        let mut recording = forge(60, 3);
        let x = |k: u64| (k as f64 * 0.1).sin() + if changed == Some(k as usize) { 1e-9 } else { 0.0 };
        let messages = (0..count).map(|k| (30_000_000 + k * 3_000_001, x(k)));
        recording.channels.push(by_log_time("/place", messages));
        recording.later(start)
    };
    let a = wall(1_700_000_000_123_456_789, None, 200);
    let day = 86_400_000_000_017;
    // by step where messages have one, by exact log time else: whole nanoseconds are subtracted
    let apart = wall(1_700_000_000_123_456_789 + day, None, 200);
    let strict = forged(&a, &apart, &Options::default());
    let [scalar, place] = ["/scalar", "/place"].map(|topic| channel(&strict, topic));
    assert_eq!((scalar.hint, place.hint), (Some(Hint::Relative), None), "times of messages are values");
    assert_eq!((verdict(&strict), place.is_different()), (Verdict::Different, false));
    let (asked, time) = (Options { relative: true, ..Options::default() }, || rules(&["time:ignore"]));
    let from_start = forged(&a, &apart, &asked);
    assert_eq!(verdict(&from_start), Verdict::Equal, "{:?}", first(&from_start));
    let same = forged(&a, &apart, &time());
    assert_eq!(verdict(&same), Verdict::Equal, "{:?}, {:?}", same.gaps, first(&same));
    let modes = |topic| channel(&same, topic).alignment.mode;
    assert_eq!((modes("/scalar"), modes("/place")), (Some(Mode::Step), Some(Mode::Time)));
    assert_eq!((channel(&same, "/scalar").compared, channel(&same, "/place").compared), (60, 200));
    for alignment in same.channels.iter().map(|channel| &channel.alignment) {
        let [start_a, start_b] = alignment.starts.expect("starts");
        assert!((start_a - 1_700_000_000.123_456_8).abs() < 1e-6, "{start_a}");
        assert!((start_b - start_a - 86_400.0).abs() < 1e-6, "{start_b}");
    }
    // where they differ is reported from the start
    let changed = forged(&a, &wall(5, Some(100), 200), &time());
    assert_eq!(verdict(&changed), Verdict::Different);
    let (topic, _, divergence) = changed.first(true).expect("a difference");
    assert_eq!((topic, divergence.place.time), ("/place", 0.3300001));
    // 200 messages against 201: the one more is counted
    let more = forged(&a, &wall(5, None, 201), &time());
    assert_eq!(verdict(&more), Verdict::Different);
    assert_eq!((channel(&more, "/place").only_a, channel(&more, "/place").only_b), (0, 1));
    // the window counts from the start too
    let options =
        Options { window: Window { from: Some(0.295.into()), to: Some(0.335.into()), every: 1 }, ..time() };
    let window = forged(&a, &wall(5, Some(150), 200), &options);
    assert_eq!((verdict(&window), channel(&window, "/scalar").compared), (Verdict::Equal, 4));
    // all channels have the same start: one that is late stays late
    let mut late = wall(5, None, 200);
    late.channel("/place").messages.iter_mut().for_each(|(at, _)| *at += 50_000_000);
    assert_eq!(verdict_of(&a, &late, &time()), Verdict::Different);
    // on one clock nothing is moved, unless that is asked for
    let (early, later) = (wall(5, None, 200), wall(100_000_005, None, 200));
    let moved = forged(&early, &later, &Options::default());
    assert!(moved.channels.iter().all(|channel| channel.alignment.starts.is_none()));
    assert_ne!(verdict(&moved), Verdict::Equal);
    let asked = forged(&early, &later, &Options { relative: true, ..Options::default() });
    assert_eq!(verdict(&asked), Verdict::Equal);
}

#[test]
fn long_recordings_of_wall_clocks_need_no_room_to_wait() {
    let wall = |start: u64| {
        let mut recording = forge(1, 3);
        recording.channels = vec![by_log_time("/place", (0..20_000).map(|k| (k * 1_000_000, k as f64)))];
        recording.later(start).write(plain())
    };
    let [a, b] = [1_700_000_000_000_000_000, 1_800_000_000_000_000_000].map(wall);
    let desk = Desk::new(&[("a.mcap", a), ("b.mcap", b)]);
    let [a, b] = ["a.mcap", "b.mcap"]
        .map(|name| Recording::open(&desk.path(name), Limits { memory: 1 << 20 }).expect("a recording"));
    for (a, b) in [(&a, &b), (&b, &a)] {
        let comparison = compare(a, b, &Options::default(), None).expect("a comparison");
        assert_eq!((verdict(&comparison), comparison.channels[0].compared), (Verdict::Equal, 20_000));
    }
}

#[test]
fn what_has_no_time_in_common_is_not_equal() {
    // the recordings have times in common, the channel has none
    let half = |at: u64| {
        let mut recording = forge(60, 3);
        recording.channels.push(by_log_time("/place", (0..5).map(|k| (at + k * 1_000_000, 1.0))));
        recording
    };
    let (a, b) = (half(0), half(500_000_000));
    let strict = forged(&a, &b, &Options::default());
    assert_eq!(verdict(&strict), Verdict::Different, "messages without a counterpart at their time");
    let loose = rules(&["/place:abs=1"]);
    let comparison = forged(&a, &b, &loose);
    assert_eq!(verdict(&comparison), Verdict::NotCompared);
    let reported: Vec<String> = comparison.gaps.iter().map(ToString::to_string).collect();
    assert!(
        reported.len() == 1 && reported[0].starts_with("`/place`: no time in common: 5 messages"),
        "{reported:?}"
    );
    // a difference elsewhere is certain all the same
    let mut c = b.clone();
    c.set("/scalar", 7, "force", Value::F64(7.0));
    assert_eq!(verdict_of(&a, &c, &loose), Verdict::Different);
    // one that was asked for moves no times
    for mode in [Mode::Nearest, Mode::Linear, Mode::Cubic] {
        let options = Options { mode: Some(mode), ..Options::default() };
        let apart = forged(&forge(60, 3), &forge(60, 3).later(10_000_000_000), &options);
        assert_eq!(verdict(&apart), Verdict::NotCompared, "{mode:?}");
        // one side has messages that the other has not
        let mut empty = forge(60, 3);
        empty.channels.iter_mut().for_each(|channel| channel.messages.clear());
        let of = |comparison: &Comparison| {
            let scalar = channel(comparison, "/scalar");
            (verdict(comparison), scalar.only_a, scalar.only_b)
        };
        let missing = forged(&forge(60, 3), &empty, &options);
        assert_eq!(of(&missing), (Verdict::Different, 60, 0), "{mode:?}");
        let extra = forged(&empty, &forge(60, 3), &options);
        assert_eq!(of(&extra), (Verdict::Different, 0, 60), "{mode:?}");
    }
}

#[test]
fn arrays_without_a_common_part_are_not_equal() {
    let at = |topic: &str, start: &str, value: f64| {
        let mut recording = forge(30, 0).only(topic);
        recording.set_all(topic, start, |_| Value::F64(value));
        recording
    };
    for (topic, start, field) in [("/profile", "r0", "p"), ("/slice", "z0", "values")] {
        let a = at(topic, start, 0.025);
        for mode in [None, Some(Mode::Linear)] {
            let options = Options { mode, ..rules(&["*:abs=100"]) };
            let comparison = forged(&a, &at(topic, start, 50.0), &options);
            assert_eq!(verdict(&comparison), Verdict::NotCompared, "{topic}");
            let reported = comparison.gaps[0].to_string();
            assert!(reported.starts_with(&format!("`{topic}.{field}`: the axes")), "{reported}");
            // a part of them in common is not the whole, unless that is asked for
            let near = at(topic, start, 0.175);
            assert_eq!(verdict_of(&a, &near, &options), Verdict::Different, "{topic}");
            let common = Options { common: true, ..options };
            assert_eq!(verdict_of(&a, &near, &common), Verdict::Within, "{topic}");
        }
    }
}

#[test]
fn bytes_are_compared_or_unmatched() {
    let plain_text =
        |times: &[u64], content: &str| forge::of_texts("/text", "text", times.iter().copied(), content);
    let (even, odd) = ([10, 20, 30, 40, 50, 60], [15, 25, 35, 45, 55]);
    let a = plain_text(&even, "{}");
    for mode in [None, Some(Mode::Linear), Some(Mode::Nearest), Some(Mode::Cubic)] {
        let options = Options { mode, ..Options::default() };
        assert_eq!(verdict(&compared(&a, &a, &options)), Verdict::Equal, "{mode:?}");
        let other = compared(&a, &plain_text(&even, "[]"), &options);
        assert_eq!(verdict(&other), Verdict::Different, "{mode:?}");
        let between = compared(&a, &plain_text(&odd, "{}"), &options);
        assert_eq!((between.channels[0].only_a, between.channels[0].only_b), (6, 5), "{mode:?}");
    }
    let ignoring = compared(&a, &plain_text(&even, "[]"), &rules(&["/text.(message):ignore"]));
    assert_eq!(verdict(&ignoring), Verdict::NotCompared, "what is ignored is not compared");
}

#[test]
fn an_infinite_reference_is_no_reason_to_allow_all() {
    let holding = |x: f64| {
        let mut recording = forge(30, 1);
        recording.set("/scalar", 7, "force", Value::F64(x));
        recording
    };
    let a = holding(f64::INFINITY);
    let verdict_of = |b: f64| verdict_of(&a, &holding(b), &rules(&["rel=1e-6"]));
    assert_eq!(verdict_of(f64::INFINITY), Verdict::Equal);
    assert_eq!(verdict_of(f64::NEG_INFINITY), Verdict::Different);
    assert_eq!(verdict_of(1.0), Verdict::Different);
}

/// Messages of `/scalar` that all say the same at steps and times of one's own.
fn constant(moments: impl Iterator<Item = (u64, f64)>) -> Forged {
    let mut recording = forge(1, 3).only("/scalar");
    let (_, first) = recording.channels[0].messages[0].clone();
    let message = |(step, time): (u64, f64)| {
        let mut message = first.clone();
        message.set_field_by_name("step", Value::U64(step));
        message.set_field_by_name("time", Value::F64(time));
        ((time * 1e9) as u64, message)
    };
    recording.channels[0].messages = moments.map(message).collect();
    recording
}

#[test]
fn without_a_tolerance_nothing_interpolated_is_equal() {
    let whole = || (0..40).map(|step| (step, step as f64 * 0.1));
    let base = constant(whole());
    let third = constant(whole().step_by(3).map(|(step, time)| (step + 1000, time)));
    let scaled = constant(whole().map(|(step, time)| (step, time * 1.01)));
    let shifted = constant(whole().map(|(step, time)| (step + 1000, time + 0.05)));
    let far = constant(whole().map(|(step, time)| (step, time + 1e6)));
    let hints = [Some(Hint::Between), Some(Hint::Between), Some(Hint::Between), Some(Hint::Relative)];
    for ((i, other), hint) in [third, scaled, shifted, far].iter().enumerate().zip(hints) {
        for (a, b) in [(&base, other), (other, &base)] {
            let strict = forged(a, b, &Options::default());
            assert_eq!(verdict(&strict), Verdict::Different, "{i}");
            assert_eq!(strict.channels[0].hint, hint, "{i}");
            let text = to_text(("a", "b"), &strict, Style::default());
            assert_eq!(text.matches("--align").count(), 1, "{text}");
            // a mode that is asked for is not a tolerance
            for mode in [Mode::Linear, Mode::Nearest, Mode::Cubic] {
                let asked = forged(a, b, &Options { mode: Some(mode), ..Options::default() });
                let expected = if i == 3 { Verdict::NotCompared } else { Verdict::Different };
                assert_eq!(verdict(&asked), expected, "{i}, {mode:?}");
            }
        }
    }
    // with one, the report says what was done, with the messages of both
    let third = constant(whole().step_by(3).map(|(step, time)| (step + 1000, time)));
    let loose = forged(&base, &third, &rules(&["l2_rel=1e-9"]));
    assert_eq!(verdict(&loose), Verdict::Within);
    let text = to_text(("a", "b"), &loose, Style::default());
    let expected = "interpolated linearly in time, 40 messages in the reference and 14 in the new recording";
    assert!(text.contains(expected), "{text}");
    let partly = forged(&base, &third, &rules(&["/scalar.force:l2_rel=1e-9"]));
    assert_eq!(verdict(&partly), Verdict::Different, "the other fields have no tolerance");
    // messages at the same times are not interpolated, whatever is asked for
    let linear = Options { mode: Some(Mode::Linear), ..Options::default() };
    assert_eq!(verdict_of(&base, &base, &linear), Verdict::Equal);
}

#[test]
fn times_and_steps_are_compared_like_fields() {
    let whole = || (0..40).map(|step| (step, step as f64 * 0.1));
    let base = constant(whole());
    let scaled = constant(whole().map(|(step, time)| (step, time * 1.01)));
    let strict = forged(&base, &scaled, &Options::default());
    assert_eq!(first(&strict), Some((1, "/scalar.time".into())));
    for rule in ["time:ignore", "time:rel=0.02", "/scalar.time:rel=0.02", "/scalar.time:ignore"] {
        let comparison = forged(&base, &scaled, &rules(&[rule]));
        assert!(comparison.is_within(), "{rule}: {:?}", first(&comparison));
        assert!(comparison.fitting[0], "{rule}");
    }
    assert_eq!(verdict_of(&base, &scaled, &rules(&["time:rel=0.005"])), Verdict::Different);
    // from the start of each recording too
    let numbered = constant(whole().map(|(step, time)| (step + 100, time + 1e6)));
    let relative = Options { relative: true, ..Options::default() };
    assert_eq!(
        first(&forged(&base, &numbered, &relative)).map(|(_, name)| name),
        Some("/scalar.step".into())
    );
    let stretched = constant(whole().map(|(step, time)| (step, 1e6 + time * (1.0 + 1e-5))));
    assert_eq!(
        first(&forged(&base, &stretched, &relative)).map(|(_, name)| name),
        Some("/scalar.time".into())
    );
    let moved = constant(whole().map(|(step, time)| (step, 1e6 + time)));
    assert_eq!(verdict_of(&base, &moved, &relative), Verdict::Equal);
}

/// `/profile` with positions as a list in its metadata, and p at each step.
fn listed(axis: &str, p: impl Fn(usize) -> Vec<f64>) -> Forged {
    let mut recording = forge(20, 3).only("/profile");
    recording.channels[0].metadata.insert("axis.p".into(), axis.into());
    recording.set_all("/profile", "p", |step| list(p(step)));
    recording
}

#[test]
fn what_cannot_be_aligned_is_compared_by_number() {
    let at = |changed: usize| move |step: usize| vec![1.0, if step == changed { 3.0 } else { 2.0 }];
    for axis in ["0,nan", "nan,nan", "nan,1", "0", "1,1", "0,inf"] {
        let (a, b) = (listed(axis, at(99)), listed(axis, at(3)));
        let strict = forged(&a, &b, &Options::default());
        assert_eq!(first(&strict), Some((3, "/profile.p[1]".into())), "{axis}");
        assert!(!channel(&strict, "/profile").axes_differ, "{axis}: equal texts are equal places");
        assert_eq!(verdict_of(&a, &b, &rules(&["abs=0.1"])), Verdict::Different, "{axis}");
        assert_eq!(verdict_of(&a, &a, &Options::default()), Verdict::Equal, "{axis}");
    }
    // of axes that differ, too
    let (a, b) = (listed("0,nan", at(99)), listed("0,1", at(3)));
    let loose = forged(&a, &b, &rules(&["abs=0.1"]));
    assert_eq!(first(&loose), Some((3, "/profile.p[1]".into())));
}

#[test]
fn places_that_are_no_numbers_are_compared_by_number() {
    for (topic, field, start) in
        [("/profile", "p", "r0"), ("/slice", "values", "z0"), ("/slice", "values", "dr")]
    {
        let mut a = forge(30, 0).only(topic);
        a.set_all(topic, start, |_| Value::F64(f64::NAN));
        let mut b = a.clone();
        let other = if topic == "/slice" { Value::F32(77.0) } else { Value::F64(77.0) };
        set_element(&mut b.channel(topic).messages[1].1, field, 1, other);
        for options in [Options::default(), rules(&["abs=0.1"])] {
            let comparison = forged(&a, &b, &options);
            assert_eq!(verdict(&comparison), Verdict::Different, "{topic}.{start}");
            assert_eq!(verdict_of(&a, &a, &options), Verdict::Equal, "{topic}.{start}");
        }
    }
}

#[test]
fn elements_that_resampling_drops_are_counted_as_not_compared() {
    let profile = |r0: f64, dr: f64, n: usize| {
        let mut recording = listed("r0,dr", |_| (0..n).map(|i| r0 + i as f64 * dr).collect());
        recording.set_all("/profile", "r0", |_| Value::F64(r0));
        recording.set_all("/profile", "dr", |_| Value::F64(dr));
        recording
    };
    let p = |comparison: &Comparison| {
        let FieldReport { within, measure, .. } = field(comparison, "/profile", "p");
        (*within, measure.elements, measure.dropped)
    };
    // 1, 2, ..., 10 against 1, 1.5, ..., 4: five, and none of the finer ones
    let (coarse, fine) = (profile(1.0, 1.0, 10), profile(1.0, 0.5, 7));
    let common = || Options { common: true, ..rules(&["abs=1e-9"]) };
    assert_eq!(p(&forged(&coarse, &fine, &rules(&["abs=1e-9"]))), (false, 20 * 4, 20 * 6));
    let loose = forged(&coarse, &fine, &common());
    assert_eq!(p(&loose), (true, 20 * 4, 20 * 6));
    let text = to_text(("a", "b"), &loose, Style::default());
    assert!(text.contains("120 elements outside the common range of the axes are not compared"), "{text}");
    // the other way around those of the coarse one beyond 4
    assert_eq!(p(&forged(&fine, &coarse, &common())), (true, 20 * 7, 20 * 6));
    // without a tolerance nothing resampled is equal
    let strict = forged(&coarse, &fine, &Options::default());
    assert_eq!(verdict(&strict), Verdict::Different);
    let flat = |mut recording: Forged| {
        recording.set_all("/profile", "p", |_| list([0.0; 8]));
        recording
    };
    let (a, b) = (flat(profile(1.0, 1.0, 8)), flat(profile(1.0, 0.5, 8)));
    assert_eq!(verdict_of(&a, &b, &Options::default()), Verdict::Different);
    assert_eq!(verdict_of(&a, &b, &Options { common: true, ..rules(&["*:abs=0"]) }), Verdict::Within);
}

#[test]
fn log_times_are_compared_in_nanoseconds() {
    const DATE: u64 = 1_700_000_000_123_456_789;
    let placed = |times: &dyn Fn(u64) -> u64, x: &dyn Fn(u64) -> f64| {
        let mut recording = forge(1, 3);
        recording.channels = vec![by_log_time("/place", (0..40).map(|k| (times(k), x(k))))];
        recording
    };
    // seconds as floating-point numbers are the same
    for (start, interval) in [(DATE, 100_000_000), (DATE, 1), (1 << 60, 1)] {
        let a = placed(&|k| start + k * interval, &|_| 1.0);
        // up to the end, or later than where the next one is
        let late = if interval == 1 { 30 } else { 9 };
        let b = placed(
            &|k| start + k * interval + u64::from(if interval == 1 { k > late } else { k == late }),
            &|_| 1.0,
        );
        for (a, b) in [(&a, &b), (&b, &a)] {
            let comparison = forged(a, b, &Options::default());
            assert_eq!(verdict(&comparison), Verdict::Different, "{start} {interval}");
            let place = channel(&comparison, "/place");
            assert_eq!((place.only_a, place.only_b), (1, 1), "{start} {interval}");
            assert_eq!(place.alignment.mode, Some(Mode::Time));
        }
        let text = to_text(("a", "b"), &forged(&b, &a, &Options::default()), Style::default());
        let first = start + if interval == 1 { late + 1 } else { late * interval };
        let first = format!("the first at time {}.{:09}", first / 1_000_000_000, first % 1_000_000_000);
        assert!(text.contains(first.trim_end_matches('0')), "{first}: {text}");
        assert_eq!(verdict_of(&a, &a, &Options::default()), Verdict::Equal);
    }
    // interpolated between times a nanosecond apart
    let line =
        |offset: u64, step: u64| placed(&|k| DATE + offset + k * step, &|k| (offset + k * step) as f64);
    let loose = Options { mode: Some(Mode::Linear), common: true, ..rules(&["abs=1e-9"]) };
    let comparison = forged(&line(1, 2), &line(0, 2), &loose);
    assert_eq!((verdict(&comparison), channel(&comparison, "/place").compared), (Verdict::Within, 39));
    // a window of them
    let bound = |text: &str| Some(text.parse().expect("a time"));
    let window = |from, to| Window { from: bound(from), to: bound(to), every: 1 };
    let window = window("1700000000.123456799", "1700000000.123456808");
    let options = Options { window, ..Options::default() };
    assert_eq!(channel(&forged(&line(0, 1), &line(0, 1), &options), "/place").compared, 10);
}

#[test]
fn what_differs_and_is_not_compared_is_mentioned_once() {
    let a = forge(30, 5);
    let mut b = a.clone();
    // log and publish times of three messages of two topics, whose field `time` rules
    for (topic, at) in [("/scalar", 3), ("/scalar", 4), ("/profile", 29)] {
        b.channel(topic).messages[at].0 += 7;
    }
    b.channel("/profile").metadata.insert("colour".into(), "red".into());
    let calm = &mut b.file.enum_type[0].value[0];
    calm.name = Some("QUIET".into());
    b.metadata.push(("percuss.status".into(), forge::text_map(&[("status", "failed")])));
    let comparison = forged(&a, &b, &Options::default());
    assert!(!comparison.is_different(), "{:?}", comparison.structure);
    let mut reported = provenance(&comparison);
    reported.sort();
    let expected = [
        "/note.kind name of 0: CALM -> QUIET",
        "/profile colour:  -> red",
        "log time of 3 messages, first of /scalar: 30000000 ns -> 30000007 ns",
        "percuss.status status:  -> failed",
        "publish time of 3 messages, first of /scalar: 30000000 ns -> 30000007 ns",
    ];
    // where a message moves behind another, the sequence numbers of both differ too
    reported.retain(|line| !line.starts_with("sequence"));
    assert_eq!(reported, expected);
}

#[test]
fn residuals_of_rounding_are_compared_where_they_are_named() {
    let with = |residual: f64| {
        let mut recording = forge(30, 5);
        recording.file.message_type[0].field[2].name = Some("residual".into());
        retype_scalars(&mut recording);
        recording.set_all("/scalar", "residual", |_| Value::F64(residual));
        recording.channel("/scalar").topic = "/energy".into();
        recording
    };
    let (a, b) = (with(0.0), with(4e-16));
    let comparison = forged(&a, &b, &Options::default());
    assert_eq!(verdict(&comparison), Verdict::Equal);
    assert!(
        to_text(("a", "b"), &comparison, Style::default())
            .contains("a residual of rounding: /energy.residual")
    );
    for (rule, expected) in [
        ("/energy.residual:bitwise", Verdict::Different),
        ("*.residual:abs=1e-12", Verdict::Within),
        ("/energy:abs=1e-20", Verdict::Equal),
        ("/energy.residual:ignore", Verdict::Equal),
    ] {
        assert_eq!(verdict_of(&a, &b, &rules(&[rule])), expected, "{rule}");
    }
    let named = Options { fields: vec!["residual".parse().expect("a field")], ..Options::default() };
    assert_eq!(verdict_of(&a, &b, &named), Verdict::Different);
}
