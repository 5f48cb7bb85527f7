//! Targets of layers: rows at listed depths, an interface's depth twice, what jumps there.

use std::fs;

use prost_reflect::{DynamicMessage, Value};
use serde_json::{Value as Json, json};

use crate::{
    desk::Desk,
    forge::{self, Channel, Forged, STEP_NS, list, plain, text_map, time},
};

/// Types as percuss has them from format 2.2 on, in the package `lab`.
const TYPES: &str = "Slice step:uint64 time:double r0:double dr:double nr:uint32 z0:double dz:double nz:uint32 values:[float] z:[double]\n\
    Line step:uint64 time:double s0:double ds:double stress:[double] s:[double]\n\
    Energy step:uint64 time:double kinetic:double strain:double layer_strain:[double] layer_kinetic:[double]";

/// Depths of two layers with an interface at 0.4.
const DEPTHS: [f64; 6] = [0.0, 0.2, 0.4, 0.4, 0.45, 0.5];
const RADII: usize = 5;
const MESSAGES: u64 = 4;

/// A field that jumps at the depth 0.4, in the lower layer steep; linear in each.
fn jump(z: f64, is_lower: bool) -> f64 {
    if is_lower { 10.0 + 20.0 * z } else { 1.0 + z }
}

/// A recording of a field over rows, and of the line r = 0 through it.
///
/// * `list`: none in a target of one layer, whose first two depths say where the others are
/// * `value`: of the field at r = 0 and step 0, by the number of a row
fn recording(depths: &[f64], is_listed: bool, value: impl Fn(usize) -> f64) -> Forged {
    let file = forge::types("lab", TYPES, ("Kind", ["CALM", "LOUD"]));
    let pool = forge::pool(&file);
    let at = |name: &str, step: u64, mut content: Json| {
        (content["step"], content["time"]) = (step.into(), time(step).into());
        (step * STEP_NS, forge::message(&pool, name, &content))
    };
    let listed = if is_listed { depths } else { &[] };
    let (z0, dz) = (depths[0], depths[1] - depths[0]);
    let rows = |step: u64| (0..depths.len()).map(move |j| (j, time(step)));
    let slice = |step: u64| {
        let row = |(j, t): (usize, f64)| (0..RADII).map(move |i| (j, t + 0.1 * i as f64));
        let values: Vec<f64> = rows(step).flat_map(row).map(|(j, more)| value(j) + more).collect();
        let content = json!({"r0": 0.0, "dr": 0.1, "nr": RADII, "z0": z0, "dz": dz, "nz": depths.len(), "values": values, "z": listed});
        at("Slice", step, content)
    };
    let line = |step: u64| {
        let stress: Vec<f64> = rows(step).map(|(j, t)| value(j) + t).collect();
        at("Line", step, json!({"s0": z0, "ds": dz, "stress": stress, "s": listed}))
    };
    let energy = |step: u64| {
        let layers = if is_listed { json!([1.0, 2.0]) } else { json!([]) };
        let content = json!({"kinetic": 3.0, "strain": 3.0, "layer_strain": layers, "layer_kinetic": layers});
        at("Energy", step, content)
    };
    let channel = |topic: &str, message: &str, metadata: &[(&str, &str)], messages| Channel {
        topic: topic.into(),
        message: message.into(),
        metadata: text_map(metadata),
        messages,
    };
    let lengths = [("unit.r0", "m"), ("unit.z0", "m"), ("unit.z", "m"), ("unit.values", "Pa")];
    let of_slice = [&lengths[..], &[("axis.values", "z0,dz,nz,z;r0,dr,nr")]].concat();
    let of_line = [("unit.s0", "m"), ("axis.stress", "s0,ds,s"), ("line", "r = 0")];
    let run = [
        ("format_version", "2.2"),
        ("layers", "2"),
        ("layer.1.name", "alumina"),
        ("layer.1.top", "0"),
        ("layer.1.bottom", "0.4"),
        ("layer.2.name", "epoxy"),
        ("layer.2.top", "0.4"),
        ("layer.2.bottom", "0.5"),
    ];
    let run = if is_listed { &run[..] } else { &run[..1] };
    Forged {
        file,
        channels: vec![
            channel("/field/stress", "Slice", &of_slice, (0..MESSAGES).map(slice).collect()),
            channel("/line/0", "Line", &of_line, (0..MESSAGES).map(line).collect()),
            channel("/energy", "Energy", &[], (0..MESSAGES).map(energy).collect()),
        ],
        attachments: Vec::new(),
        metadata: vec![
            ("percuss.run".into(), text_map(run)),
            ("percuss.status".into(), text_map(&[("status", "completed")])),
        ],
    }
}

/// Two layers, of which the field jumps from one to the other.
fn layered() -> Forged {
    recording(&DEPTHS, true, |j| jump(DEPTHS[j], j >= 3))
}

fn desk_of(recording: &Forged) -> Desk {
    Desk::new(&[("a.mcap", recording.write(plain()))])
}

/// The cells of the last row of a trace behind its time, and the names of the columns.
fn traced(desk: &Desk, more: &[&str]) -> (Vec<f64>, Vec<String>) {
    let lines = desk.lines(&[&["trace", "a.mcap", "--format", "csv"], more].concat());
    let cells = |line: &String| line.split(',').skip(1).map(str::to_owned).collect::<Vec<_>>();
    let numbers = cells(lines.last().expect("a row"));
    (numbers.iter().map(|cell| cell.parse().expect("a number")).collect(), vec![lines[0].clone()])
}

fn assert_near(values: &[f64], expected: &[f64]) {
    let are_near = values.iter().zip(expected).all(|(x, y)| (x - y).abs() < 1e-6);
    assert!(values.len() == expected.len() && are_near, "{values:?}, expected {expected:?}");
}

#[test]
fn positions_lie_in_one_layer() {
    let desk = desk_of(&layered());
    let last = time(MESSAGES - 1);
    for (z, value) in [
        ("0", 1.0),
        ("0.1", 1.1),
        ("0.399999", 1.399999),
        ("0.4", 1.4),
        ("0.400001", 18.00002),
        ("0.41", 18.2),
        ("0.5", 20.0),
    ] {
        let at = format!("r=0.05,z={z}");
        let (values, _) = traced(&desk, &["--topic", "/field/stress", "--field", "values", "--at", &at]);
        assert_near(&values, &[value + last + 0.05]);
        let (values, _) =
            traced(&desk, &["--topic", "/line/0", "--field", "stress", "--at", &format!("s={z}")]);
        assert_near(&values, &[value + last]);
    }
    let error = desk.error(2, &["trace", "a.mcap", "--topic", "/field/stress", "--at", "r=0,z=0.51"]);
    assert!(error.contains("reaches from z=0 to z=0.5"), "{error}");
    // along a line the interface is one column, of the upper side
    let (values, head) = traced(&desk, &["--topic", "/field/stress", "--field", "values", "--at", "r=0"]);
    assert_near(&values, &[1.0, 1.2, 1.4, 19.0, 20.0].map(|value| value + last));
    assert_eq!(head[0].matches("z=0.4 [Pa]").count(), 1, "{head:?}");
    // and what describes the axis is no column of its own
    let (values, _) = traced(&desk, &["--topic", "/line/0"]);
    assert_eq!(values.len(), 1 + DEPTHS.len());
    let (values, _) = traced(&desk, &["--topic", "/line/0", "--field", "s"]);
    assert_near(&values, &DEPTHS);
    let (values, head) = traced(&desk, &["--topic", "/energy"]);
    assert!(values.len() == 7 && head[0].contains("layer_strain[1]"), "{head:?}");
}

/// Numbers of an attribute of the elements of an SVG that begin like this.
fn attributes(svg: &str, element: &str, name: &str) -> Vec<f64> {
    let elements = svg.split(element).skip(1).map(|rest| rest.split('>').next().unwrap_or_default());
    let value = |element: &str| element.split(&format!(" {name}=\"")).nth(1)?.split('"').next()?.parse().ok();
    elements.filter_map(value).collect()
}

#[test]
fn pictures_show_interfaces_and_names() {
    let desk = desk_of(&layered());
    let requests: [&[&str]; 3] = [
        &["--topic", "/field/stress", "--at-time", "0.02"],
        &["--topic", "/field/stress", "--map", "--at", "r=0"],
        &["--topic", "/line/0", "--map"],
    ];
    for request in requests {
        desk.text(0, &[&["plot", "a.mcap", "-o", "p.svg", "--force"], request].concat());
        let svg = fs::read_to_string(desk.path("p.svg")).expect("a picture");
        for text in ["alumina", "epoxy", "z [mm]"] {
            assert!(svg.contains(&format!("<title>{text}</title>")), "{request:?}: no {text}");
        }
        desk.text(0, &[&["plot", "a.mcap", "-o", "p.png", "--force"], request].concat());
    }
    // a surface, an index and a single layer have none
    let even = desk_of(&recording(&[0.0, 0.1, 0.2, 0.3], false, |j| j as f64));
    even.text(0, &["plot", "a.mcap", "-o", "p.svg", "--topic", "/field/stress", "--at-time", "0.02"]);
    assert!(!fs::read_to_string(even.path("p.svg")).expect("a picture").contains("alumina"));
    let (text, _) = desk.both(0, &["plot", "a.mcap", "--topic", "/field/stress", "--at-time", "0.02"]);
    assert!(text.contains("0.4"), "{text}");
}

#[test]
fn colours_end_at_the_interface() {
    // a field of two values: one row of colours for each layer
    let desk = desk_of(&recording(&DEPTHS, true, |j| if j < 3 { -1.0 } else { 1.0 }));
    for request in [["--at-time", "0"].as_slice(), &["--map", "--at", "r=0"]] {
        let request = [&["plot", "a.mcap", "-o", "p.svg", "--force", "--topic", "/field/stress"], request];
        desk.text(0, &request.concat());
        let svg = fs::read_to_string(desk.path("p.svg")).expect("a picture");
        let lines = attributes(&svg, "<line", "y1").into_iter().zip(attributes(&svg, "<line", "y2"));
        let tops = attributes(&svg, "<rect", "y");
        let is_interface = |(y, end): &(f64, f64)| y == end && tops.iter().any(|top| (top - y).abs() < 0.02);
        assert!(lines.filter(is_interface).count() >= 1, "no line where cells begin: {tops:?}");
    }
}

/// The verdict of a comparison, and what it says.
fn diff(a: &Forged, b: &Forged, status: i32, more: &[&str]) -> String {
    let desk = Desk::new(&[("a.mcap", a.write(plain())), ("b.mcap", b.write(plain()))]);
    desk.text(status, &[&["diff", "a.mcap", "b.mcap", "--ignore", "/energy"], more].concat())
}

#[test]
fn recordings_are_compared_by_their_depths() {
    let a = layered();
    diff(&a, &a, 0, &[]);
    // other rows in the same layers: linear in each, so nothing differs if nothing is mixed
    let finer = [0.0, 0.1, 0.15, 0.4, 0.4, 0.42, 0.5];
    let finer = recording(&finer, true, |j| jump(finer[j], j >= 4));
    for (a, b) in [(&a, &finer), (&finer, &a)] {
        let text = diff(a, b, 0, &["--abs", "1e-5"]);
        assert!(!text.contains("not compared"), "{text}");
        diff(a, b, 1, &[]);
    }
    // the interface elsewhere
    let shifted = [0.0, 0.2, 0.44, 0.44, 0.45, 0.5];
    let shifted = recording(&shifted, true, |j| jump(shifted[j], j >= 3));
    let text = diff(&a, &shifted, 1, &["--abs", "1e-5"]);
    assert!(text.contains("z = 0.4"), "{text}");
}

#[test]
fn layers_are_compared_with_one_layer_on_the_same_depths() {
    let even: Vec<f64> = (0..=10).map(|j| f64::from(j) * 0.05).collect();
    let mut even = recording(&even, false, |j| 1.0 + even[j]);
    // as before format 2.2
    for (topic, key, axis) in
        [("/field/stress", "axis.values", "z0,dz,nz;r0,dr,nr"), ("/line/0", "axis.stress", "s0,ds")]
    {
        even.channel(topic).metadata.insert(key.into(), axis.into());
    }
    let layered = recording(&DEPTHS, true, |j| 1.0 + DEPTHS[j]);
    for (a, b) in [(&layered, &even), (&even, &layered)] {
        let text = diff(a, b, 0, &["--abs", "1e-5"]);
        assert!(!text.contains("axis `"), "{text}");
    }
    let other = recording(&DEPTHS, true, |j| 1.0 + DEPTHS[j] * DEPTHS[j]);
    diff(&other, &even, 1, &["--abs", "1e-5"]);
}

#[test]
fn depths_in_metres_are_those_in_radii() {
    /// Metres in a radius.
    const RADIUS: f64 = 0.0137;
    let mut plain = layered().only("/field/stress");
    let mut physical = plain.clone();
    physical.metadata[0].1.insert("scale.length_m".into(), RADIUS.to_string());
    for (recording, unit, radius) in [(&mut plain, "R", 1.0), (&mut physical, "m", RADIUS)] {
        let channel = recording.channel("/field/stress");
        for field in ["r0", "dr", "z0", "dz"] {
            channel.metadata.insert(format!("unit.{field}"), unit.into());
            for (_, message) in &mut channel.messages {
                let value = forge::number(message, field) * radius;
                message.set_field_by_name(field, Value::F64(value));
            }
        }
        channel.metadata.insert("unit.z".into(), unit.into());
        recording.set_all("/field/stress", "z", |_| list(DEPTHS.map(|z| z * radius)));
    }
    for (a, b) in [(&plain, &physical), (&physical, &plain)] {
        let text = diff(a, b, 0, &["--abs", "1e-12"]);
        assert!(!text.contains("axes differ"), "{text}");
    }
}

#[test]
fn depths_go_into_a_rectilinear_grid() {
    let desk = desk_of(&layered());
    let export = |name: &'static str| ["export", "a.mcap", "--topic", "/field/stress", "-o", name];
    desk.text(0, &export("f.vtr"));
    let bytes = desk.bytes("f.vtr");
    let place = bytes.windows(3).position(|part| part == b">\n_").expect("the data") + 3;
    let head = String::from_utf8_lossy(&bytes[..place]);
    assert!(head.contains("x is r [m], y is z [m]"), "{head}");
    assert!(head.contains("<RectilinearGrid WholeExtent=\"0 4 0 5 0 0\">"), "{head}");
    let numbers = |offset: usize| -> Vec<f64> {
        let word = |i: usize| bytes[place + offset + 8 * i..][..8].try_into().expect("eight bytes");
        let length = u64::from_le_bytes(word(0)) as usize / 8;
        (1..=length).map(|i| f64::from_le_bytes(word(i))).collect()
    };
    let offset = |name: &str| -> usize {
        let (_, rest) =
            head.split_once(&format!("Name=\"{name}\" format=\"appended\" offset=\"")).expect("an array");
        rest.split('"').next().expect("an offset").parse().expect("a number")
    };
    assert_eq!(numbers(offset("z [m]")), DEPTHS);
    assert_near(&numbers(offset("r [m]")), &[0.0, 0.1, 0.2, 0.3, 0.4]);
    assert_eq!(numbers(offset("plane")), [0.0]);
    let values = numbers(offset("stress [Pa]"));
    assert_near(&[values[2 * RADII], values[3 * RADII]], &[1.43, 18.03]);
    assert!(desk.error(2, &export("f.vti")).contains("write a .vtr"));
    desk.text(0, &export("f.npz"));
    let file = fs::File::open(desk.path("f.npz")).expect("an archive");
    let mut archive = ndarray_npy::NpzReader::new(file).expect("an archive");
    let depths: ndarray::Array1<f64> = archive.by_name("z").expect("depths");
    let values: ndarray::Array2<f64> = archive.by_name("values").expect("values");
    assert_eq!((depths.as_slice(), values.dim()), (Some(&DEPTHS[..]), (DEPTHS.len(), RADII)));
}

#[test]
fn every_verb_reads_layers() {
    let desk = desk_of(&layered());
    desk.text(0, &["summary", "a.mcap"]);
    let page = desk.both(0, &["report", "a.mcap", "-o", "r.html"]);
    let page = (page, fs::read_to_string(desk.path("r.html")).expect("a page")).1;
    assert!(page.contains("\"name\":\"epoxy\"") && page.contains("\"from\":0.7"), "{}", page.len());
    // what else a recording of percuss holds is missing
    let verified = desk.text(1, &["verify", "a.mcap"]);
    assert!(!verified.contains("lists"), "{verified}");
}

#[test]
fn depths_that_are_not_sound_are_refused() {
    let bad: [(&[f64], &str); 4] = [
        (&DEPTHS[..5], "lists 5 positions for 6 elements"),
        (&[0.0, 0.2, f64::NAN, 0.4, 0.45, 0.5], "lists the position NaN"),
        (&[0.0, 0.2, 0.4, 0.4, 0.45, f64::INFINITY], "lists the position inf"),
        (&[0.0, 0.2, 0.4, 0.3, 0.45, 0.5], "lists the position 0.3 behind 0.4"),
    ];
    for (depths, said) in bad {
        let mut recording = layered();
        let set = |message: &mut DynamicMessage, field| {
            message.set_field_by_name(field, list(depths.iter().copied()));
        };
        set(&mut recording.channel("/field/stress").messages[1].1, "z");
        set(&mut recording.channel("/line/0").messages[1].1, "s");
        let desk = desk_of(&recording);
        let requests: [(&[&str], i32); 8] = [
            (&["verify", "a.mcap"], 1),
            (&["trace", "a.mcap", "--topic", "/field/stress", "--at", "r=0,z=0.1"], 2),
            (&["trace", "a.mcap", "--topic", "/line/0", "--at", "s=0.1"], 2),
            (&["plot", "a.mcap", "--topic", "/field/stress", "--at-time", "0.01", "-o", "p.svg"], 2),
            (&["plot", "a.mcap", "--topic", "/field/stress", "--map", "--at", "r=0", "-o", "p.svg"], 2),
            (&["plot", "a.mcap", "--topic", "/line/0", "--at-time", "0.01", "-o", "p.svg"], 2),
            (&["plot", "a.mcap", "--topic", "/line/0", "--map", "-o", "p.svg"], 2),
            (&["export", "a.mcap", "--topic", "/field/stress", "--at-time", "0.01", "-o", "f.vtr"], 1),
        ];
        for (request, status) in requests {
            let (text, error) = desk.both(status, request);
            let all = text + &error;
            assert!(all.contains(said), "{request:?}: {all}");
        }
        // elements without a place are compared by their number, and a report shows what it can
        desk.text(0, &["diff", "a.mcap", "a.mcap", "--abs", "1e-6"]);
        desk.text(0, &["report", "a.mcap", "-o", "r.html"]);
    }
    // rows that are as many as the message has values for
    let mut recording = layered();
    recording.set("/field/stress", 0, "nz", Value::U32(7));
    let error = desk_of(&recording)
        .error(1, &["export", "a.mcap", "--topic", "/field/stress", "--at-time", "0", "-o", "f.npy"]);
    assert!(error.contains("lists 6 positions for 7 elements along z"), "{error}");
}
