//! Replays as viewers see them. The viewer puts messages at the time it was reported last, as Lichtblick does.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    path::Path,
    process::{Child, Command},
    thread,
    time::Duration,
};

use mcap::{Writer, records::MessageHeader};

use crate::{
    program::serving,
    raw::{Foreign, foreign, types},
    viewer::Viewer,
};

const LONG: Duration = Duration::from_secs(30);

/// Log times of the drag: 301, from 0 to 3 s.
fn times() -> Vec<u64> {
    (0..=300).map(|step| step * 10_000_000).collect()
}

/// A recording of numbers at every step, a picture at every tenth, and a line at the first.
fn record(path: &Path) {
    let mut writer = Writer::new(File::create_new(path).expect("a file")).expect("a writer");
    let [drag, log, picture] = ["/drag", "/log", "/picture"]
        .map(|topic| writer.add_channel(0, topic, "json", &BTreeMap::new()).expect("a channel"));
    for (step, log_time) in times().into_iter().enumerate() {
        let sequence = step as u32;
        let mut write = |channel_id, data: &[u8]| {
            let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
            writer.write_to_known_channel(&header, data).expect("room");
        };
        if step == 0 {
            write(log, b"\"it begins\"");
        }
        if step.is_multiple_of(10) {
            write(picture, &[b' '; 20_000]);
        }
        // the last of its time: a viewer that has it has everything
        write(drag, step.to_string().as_bytes());
    }
    writer.finish().expect("an end");
}

/// A replay, and its address.
fn replay(folder: &Path, arguments: &[&str]) -> (Child, String) {
    let path = folder.join("run.mcap");
    if !fs::exists(&path).expect("a folder") {
        record(&path);
    }
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss-read"));
    command.args(["replay", "run.mcap", "--addr", "0"]).args(arguments);
    serving(command.current_dir(folder))
}

#[test]
fn who_subscribes_panel_by_panel_sees_the_beginning() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut child, url) = replay(folder.path(), &["--speed", "2", "--once"]);
    let mut viewer = Viewer::connect(&url);
    for topic in ["/drag", "/picture", "/log"] {
        viewer.subscribe(&[topic]);
        viewer.watch(Duration::from_millis(450), |_| false);
    }
    viewer.watch(LONG, |viewer| viewer.messages["/drag"].len() == 301);
    viewer.watch(Duration::from_millis(200), |_| false);
    assert_eq!((viewer.times("/drag"), viewer.times("/log")), (times(), vec![0]));
    assert_eq!(viewer.times("/picture").len(), 31);
    // a viewer that comes when all has been played
    let mut late = Viewer::connect(&url);
    late.subscribe(&["/picture", "/drag"]);
    late.watch(LONG, |viewer| viewer.messages["/drag"].len() == 301);
    assert_eq!((late.times("/drag"), late.times("/picture")), (times(), vec![3_000_000_000]));
    viewer.leave();
    late.leave();
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn a_window_of_dates_is_chosen_to_the_nanosecond() {
    const DATE: u64 = 1_700_000_000_123_456_789;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut drag = Foreign::new("/drag", "json", &types(""), &[]);
    drag.messages = (DATE..DATE + 5).map(|time| (time, b"1".to_vec())).collect();
    fs::write(folder.path().join("run.mcap"), foreign(&[drag], None)).expect("room");
    let (mut child, url) =
        replay(folder.path(), &["--once", "--from", "1700000000.12345679", "--to", "1700000000.123456792"]);
    let mut viewer = Viewer::connect(&url);
    viewer.subscribe(&["/drag"]);
    viewer.watch(LONG, |viewer| viewer.messages["/drag"].len() >= 3);
    viewer.watch(Duration::from_millis(300), |_| false);
    assert_eq!(viewer.times("/drag"), [1, 2, 3].map(|late| DATE + late));
    viewer.leave();
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn a_panel_that_comes_in_the_middle_or_after_the_end_begins_nothing_anew() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut child, url) = replay(folder.path(), &["--speed", "3"]);
    let mut viewer = Viewer::connect(&url);
    viewer.subscribe(&["/drag"]);
    viewer.watch(LONG, |viewer| viewer.messages["/drag"].len() > 100);
    viewer.subscribe(&["/picture"]);
    viewer.watch(LONG, |viewer| viewer.jumps == 1 && viewer.messages["/drag"].len() == 301);
    let pictures = viewer.times("/picture");
    assert!(pictures.len() < 25 && pictures.last() == Some(&3_000_000_000), "{pictures:?}");
    viewer.subscribe(&["/log"]);
    viewer.watch(LONG, |viewer| viewer.jumps == 2 && viewer.messages["/drag"].len() == 301);
    viewer.watch(Duration::from_secs(2), |_| false);
    assert_eq!((viewer.times("/drag"), viewer.times("/log"), viewer.jumps), (times(), vec![0], 2));
    // when all have left, the next sees it from the beginning
    viewer.leave();
    thread::sleep(Duration::from_millis(500));
    let mut next = Viewer::connect(&url);
    next.subscribe(&["/drag", "/picture"]);
    next.watch(LONG, |viewer| viewer.messages["/drag"].len() == 301);
    assert_eq!((next.times("/drag"), next.times("/picture").len()), (times(), 31));
    child.kill().expect("it runs");
    child.wait().expect("it ends");
}
