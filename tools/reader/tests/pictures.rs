//! Pictures: which quantities share an axis, units with prefixes, maps over place and time.

use std::fs;

use prost_reflect::Value;

use crate::{
    desk::Desk,
    forge::{Forged, forge, list, number, plain},
    si,
};

/// A folder with a recording `a.mcap`.
fn desk_of(recording: &Forged) -> Desk {
    Desk::new(&[("a.mcap", recording.write(plain()))])
}

/// The texts of an SVG that a request draws.
fn texts(desk: &Desk, more: &[&str]) -> Vec<String> {
    desk.text(0, &[&["plot", "a.mcap", "-o", "p.svg", "--force"], more].concat());
    let svg = fs::read_to_string(desk.path("p.svg")).expect("a picture");
    svg.split("<title>").skip(1).filter_map(|rest| Some(rest.split_once("</title>")?.0.to_owned())).collect()
}

/// True if all of some texts are among others.
fn have(texts: &[String], expected: &[&str]) -> bool {
    expected.iter().all(|text| texts.iter().any(|known| known == text))
}

#[test]
fn a_topic_shows_one_quantity_unless_more_are_named() {
    let desk = desk_of(&forge(60, 1));
    let bare = texts(&desk, &["--topic", "/scalar"]);
    assert!(have(&bare, &["force [N]", "time [ms]"]) && !have(&bare, &["load"]), "{bare:?}");
    let named = texts(&desk, &["--topic", "/scalar", "--field", "force,load"]);
    assert!(have(&named, &["force [N]", "load"]), "{named:?}");
    assert_eq!(named.iter().filter(|text| *text == "time [ms]").count(), 2, "two diagrams: {named:?}");
}

#[test]
fn fields_of_any_topic_go_to_the_right() {
    let desk = desk_of(&forge(60, 1));
    let own = texts(&desk, &["--topic", "/scalar", "--right", "load"]);
    assert!(have(&own, &["force [N]", "load", "force", "load (right)"]), "{own:?}");
    let other = texts(&desk, &["--topic", "/scalar", "--right", "/profile.p@r=0.1,0.2"]);
    assert!(have(&other, &["force [N]", "p [Pa]", "p@r=0.1 (right)", "p@r=0.2 (right)"]), "{other:?}");
    let refused = |more: &[&str], part: &str| {
        let error = desk.error(2, &[&["plot", "a.mcap", "--topic", "/scalar"], more].concat());
        assert!(error.contains(part), "{error}");
    };
    refused(&["--right", "load", "--right", "/profile.p@r=0.1"], "different units");
    refused(&["--right", "weight"], "`weight`");
    refused(&["--right", "load", "--at-time", "0.1"], "--at-time");
}

/// The recording with forces of meganewtons and times of nanoseconds.
fn physical() -> Forged {
    let mut recording = forge(60, 1);
    for (_, message) in &mut recording.channel("/scalar").messages {
        for (field, factor) in [("force", 1e6), ("time", 1e-6)] {
            let value = number(message, field);
            message.set_field_by_name(field, Value::F64(value * factor));
        }
    }
    recording
}

#[test]
fn axes_have_prefixes_and_arguments_have_none() {
    let desk = desk_of(&physical());
    let whole = texts(&desk, &["--topic", "/scalar"]);
    assert!(have(&whole, &["force [MN]", "time [ns]"]), "{whole:?}");
    let cut = texts(&desk, &["--topic", "/scalar", "--range", "0,5e3", "--x-range", "0,2e-9"]);
    assert!(have(&cut, &["force [kN]", "time [ns]", "5", "2"]), "{cut:?}");
    let drawn = desk.text(0, &["plot", "a.mcap", "--topic", "/scalar"]);
    let labels: Vec<&str> = drawn.lines().skip(1).take(1).collect();
    assert_eq!(labels, ["force [MN]"], "{drawn}");
}

/// A profile of ones that grows from 12 to 14 elements, and matrices of the numbers of their rows.
fn plateau() -> Forged {
    let mut recording = forge(60, 1);
    recording.set_all("/profile", "p", |step| list(vec![1.0; 12 + step / 20]));
    recording.set_all("/slice", "values", |_| {
        Value::List((0..24_u8).map(|i| Value::F32(f32::from(i / 6))).collect())
    });
    recording
}

#[test]
fn a_map_shows_an_array_over_place_and_time() {
    let desk = desk_of(&plateau());
    let profile = texts(&desk, &["--topic", "/profile", "--map"]);
    assert!(have(&profile, &["/profile", "r [mm]", "time", "p [Pa]", "1"]), "{profile:?}");
    // what a message leaves out is zero: the two outermost places, at the top, begin later
    let shades = |more: &[&str]| {
        let drawn = desk.text(0, &[&["plot", "a.mcap", "--map", "--topic"], more].concat());
        let row = |line: &str| Some(line.split_once('│')?.1.trim_end_matches('│').to_owned());
        drawn.lines().filter_map(row).collect::<Vec<String>>()
    };
    let rows = shades(&["/profile"]);
    let starts: Vec<Option<usize>> =
        rows.iter().map(|row| row.chars().position(|shade| shade == '█')).collect();
    let mut expected = vec![Some(40), Some(20)];
    expected.extend([Some(0); 12]);
    assert_eq!(starts, expected, "{rows:?}");
    // rows of a matrix go down, as in a section
    let slice = texts(&desk, &["--topic", "/slice", "--map", "--at", "r=0"]);
    assert!(have(&slice, &["/slice at r=0", "z", "slice [Pa]", "3"]), "{slice:?}");
    let rows = shades(&["/slice", "--at", "r=0"]);
    let firsts: Vec<Option<char>> = rows.iter().map(|row| row.chars().next()).collect();
    assert_eq!(firsts, [Some(' '), Some('░'), Some('▓'), Some('█')], "{rows:?}");
}

#[test]
fn maps_that_cannot_be_drawn_are_refused() {
    let desk = desk_of(&plateau());
    for (more, part) in [
        (&["--topic", "/slice"] as &[&str], "--at r=0"),
        (&["--topic", "/slice", "--at", "r=0,1"], "--at r=0"),
        (&["--topic", "/slice", "--at", "r=9"], "r=9"),
        (&["--topic", "/profile", "--at", "r=0.1"], "leave out --at"),
        (&["--topic", "/profile", "--from", "99"], "no messages"),
        (&["--topic", "/profile", "--from", "0.1", "--to", "0.1"], "one time only"),
        (&["--topic", "/profile", "--field", "weight"], "weight"),
        (&["--topic", "/profile,/slice"], "one topic"),
        (&["--topic", "/scalar"], "no array with an axis"),
        (&["--topic", "/profile", "--at-time", "0.1"], "--at-time"),
        (&["--topic", "/profile", "a.mcap"], "one recording"),
    ] {
        let error = desk.error(2, &[&["plot", "a.mcap", "--map", "-o", "p.svg"], more].concat());
        assert!(error.contains(part), "{more:?}: {error}");
    }
    assert!(!desk.path("p.svg").exists());
}

#[test]
fn documents_repeat_byte_for_byte() {
    let desk = desk_of(&forge(60, 1));
    for name in ["a.pdf", "b.pdf"] {
        desk.text(0, &["plot", "a.mcap", "--topic", "/scalar", "-o", name]);
    }
    let [a, b] = ["a.pdf", "b.pdf"].map(|name| desk.bytes(name));
    assert!(a.starts_with(b"%PDF-") && a == b);
    // without the whole font
    assert!(a.len() < 100_000, "{}", a.len());
}

#[test]
fn columns_of_a_table_are_curves() {
    let table = "name,cells,dr [m],error\n\"drag, t = 1\",50,0.02,1e-2\nstress,50,0.02,\n\"drag, t = 1\",100,0.01,2.5e-3\n\
                 stress,100,0.01,1e-4\nstress,200,0.005,2e-5\n";
    let desk = Desk::new(&[
        ("a.csv", table.into()),
        ("cut.csv", b"a,b\n1\n".to_vec()),
        ("a.mcap", forge(60, 1).write(plain())),
    ]);
    desk.text(
        0,
        &["plot", "a.csv", "--x", "dr", "--y", "error", "--by", "name", "--log", "xy", "-o", "a.svg"],
    );
    let svg = fs::read_to_string(desk.path("a.svg")).expect("a picture");
    for text in ["dr [mm]", "error", "drag, t = 1", "stress", "a"] {
        assert!(svg.contains(&format!("<title>{text}</title>")), "{text}");
    }
    assert!(desk.text(0, &["plot", "a.csv", "--x", "cells", "--y", "error"]).contains("cells"));
    for (status, arguments, part) in [
        (2, &["a.csv", "--x", "cells", "--y", "errors"] as &[_], "it has name, cells, dr, error"),
        (2, &["a.csv", "--x", "cells", "--y", "name"], "no row"),
        (2, &["a.csv", "cut.csv", "--x", "cells", "--y", "error"], "one by one"),
        (2, &["a.csv", "--x", "cells"], "--y"),
        (2, &["a.csv", "--x", "cells", "--y", "error", "--topic", "/drag"], "--topic"),
        (2, &["a.csv"], "--x and --y"),
        (1, &["cut.csv", "--x", "a", "--y", "b"], "cut.csv"),
        (1, &["a.mcap", "--x", "a", "--y", "b"], "a.mcap"),
        (1, &["none.csv", "--x", "a", "--y", "b"], "none.csv"),
    ] {
        let error = desk.error(status, &[&["plot"], arguments].concat());
        assert!(error.contains(part), "{arguments:?}: {error}");
    }
    let rows: String = (0..60_000).map(|i| format!("{i},{i}\n")).collect();
    desk.put("long.csv", format!("a,b\n{rows}"));
    let error = desk.error(1, &["plot", "long.csv", "--x", "a", "--y", "b", "--max-memory", "8MB"]);
    assert!(error.contains("--max-memory"), "{error}");
    let error = desk.error(2, &["plot", "long.csv", "--x", "a", "--y", "b", "--by", "a"]);
    assert!(error.contains("more than 1000 values"), "{error}");
}

#[test]
fn the_image_of_a_field_shows_where_something_can_be_seen() {
    let desk = Desk::new(&[]);
    si::record("fig9-m1", &["mesh.cells=10", "run.end_time=6", "record.frames=4"], &desk.path("a.mcap"));
    let plot = ["plot", "a.mcap", "--topic", "/field/stress", "--at-time"];
    let said = |arguments: &[&str]| desk.both(0, &[&plot[..], arguments].concat()).1;
    assert!(said(&["2", "-o", "part.svg"]).contains("drawn where something can be seen"));
    let all = said(&["2", "--x-range", "0,100", "-o", "all.svg"]);
    assert!(!all.contains("drawn where"), "{all}");
    assert!(desk.bytes("part.svg") != desk.bytes("all.svg"));
}
