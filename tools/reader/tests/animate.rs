//! Moving pictures, and time series for ParaView.

use std::{fs, process::Command};

use crate::{desk::Desk, si};

/// A folder with a short recording `ball.mcap` of seven frames.
fn desk() -> Desk {
    let desk = Desk::new(&[]);
    let settings = ["mesh.cells=10", "run.end_time=\"20 us\"", "record.frames=7"];
    si::record("ball", &settings, &desk.path("ball.mcap"));
    desk
}

/// Columns, rows and frames of a GIF.
fn size(desk: &Desk, name: &str) -> (u16, u16, usize) {
    let file = fs::File::open(desk.path(name)).expect("a picture");
    let mut decoder = gif::DecodeOptions::new().read_info(std::io::BufReader::new(file)).expect("a GIF");
    let mut frames = 0;
    while decoder.next_frame_info().expect("a frame").is_some() {
        frames += 1;
    }
    (decoder.width(), decoder.height(), frames)
}

#[test]
fn recordings_are_animated() {
    let desk = desk();
    desk.text(0, &["animate", "ball.mcap", "-o", "a.gif"]);
    let (width, height, frames) = size(&desk, "a.gif");
    assert!((width, frames) == (960, 7) && height > 300, "{width} x {height}, {frames}");
    desk.text(0, &["animate", "ball.mcap", "-o", "b.gif"]);
    let read = |name: &str| fs::read(desk.path(name)).expect("a picture");
    assert!(read("a.gif") == read("b.gif"), "the same recording is the same bytes");
    let part = ["animate", "ball.mcap", "--from", "5us", "--to", "15us", "--width", "480", "-o", "c.gif"];
    desk.text(0, &part);
    assert_eq!((size(&desk, "c.gif").0, size(&desk, "c.gif").2), (480, 3));
    desk.text(0, &["animate", "ball.mcap", "--frames", "2", "-o", "d.gif"]);
    assert_eq!(size(&desk, "d.gif").2, 2);
    // profile and drag alone
    si::record("ball", &["mesh.cells=10", "run.end_time=\"5 us\"", "record.frames=0"], &desk.path("e.mcap"));
    desk.text(0, &["animate", "e.mcap", "--frames", "5", "-o", "e.gif"]);
    assert_eq!(size(&desk, "e.gif").2, 5);
}

#[test]
fn what_cannot_be_animated_is_said() {
    let desk = desk();
    fs::write(desk.path("a.gif"), "mine").expect("room");
    for (arguments, status, reason) in [
        (&["animate", "ball.mcap", "-o", "a.gif"][..], 1, "a.gif"),
        (&["animate", "ball.mcap", "-o", "a.jpg"], 2, ".gif, .mp4"),
        (
            &["animate", "ball.mcap", "--topic", "/drag", "-o", "b.gif"],
            2,
            "`/drag` is no field with two axes",
        ),
        (&["animate", "ball.mcap", "--from", "1", "-o", "b.gif"], 2, "has no frames in this time"),
        (&["animate", "ball.mcap", "--range", "0", "-o", "b.gif"], 2, "not above 0"),
    ] {
        let error = desk.both(status, arguments).1;
        assert!(error.contains(reason), "{arguments:?}: {error}");
    }
    assert_eq!(fs::read(desk.path("a.gif")).expect("a file"), b"mine");
    let mut writer = mcap::Writer::new(std::io::Cursor::new(Vec::new())).expect("a writer");
    writer.finish().expect("an end");
    let other = Desk::new(&[("x.mcap", writer.into_inner().into_inner())]);
    let error = other.both(2, &["animate", "x.mcap", "-o", "x.gif"]).1;
    assert!(error.contains("nothing to animate"), "{error}");
    // without ffmpeg
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss-read"));
    command.args(["animate", "ball.mcap", "-o", "a.mp4"]).current_dir(desk.path("")).env("PATH", "");
    let output = command.output().expect("an end");
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(2) && error.contains("ffmpeg"), "{error}");
}

#[test]
fn a_time_series_names_its_frames() {
    let desk = desk();
    desk.text(0, &["export", "ball.mcap", "--topic", "/field/stress", "-o", "series.pvd"]);
    let text = fs::read_to_string(desk.path("series.pvd")).expect("a file");
    let sets: Vec<&str> = text.lines().filter(|line| line.starts_with("<DataSet")).collect();
    let part = |line: &str, key: &str| {
        line.split_once(&format!("{key}=\""))
            .and_then(|(_, rest)| rest.split_once('"'))
            .expect("a key")
            .0
            .to_owned()
    };
    let times: Vec<f64> = sets.iter().map(|set| part(set, "timestep").parse().expect("a time")).collect();
    assert!(times.len() == 7 && times.is_sorted_by(|a, b| a < b) && times[0] == 0.0, "{times:?}");
    for set in &sets {
        let frame = fs::read(desk.path(&part(set, "file"))).expect("a frame");
        let frame = String::from_utf8_lossy(&frame);
        assert!(frame.contains("ImageData") && frame.contains("stress [Pa]"));
    }
    let error = desk.both(1, &["export", "ball.mcap", "--topic", "/field/stress", "-o", "series.pvd"]).1;
    assert!(error.contains("series.pvd"), "{error}");
    let arguments = ["export", "ball.mcap", "--topic", "/field/stress", "--at-time", "1us", "-o", "b.pvd"];
    assert!(desk.both(2, &arguments).1.contains("of all times"));
}
