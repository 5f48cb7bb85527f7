//! Live runs as viewers see them. The viewer puts messages at the time it received last, as Lichtblick does.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use crate::{
    program::serving,
    viewer::{Stamped, Viewer},
};

const LONG: Duration = Duration::from_secs(60);

/// A live run of Fig. 5 with 300 steps, and its address.
fn live(folder: &Path, arguments: &[&str]) -> (Child, String) {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
    command.args(["run", "fig5", "-o", "run.mcap", "--live", "0"]).args(arguments);
    serving(command.current_dir(folder))
}

/// Receives until the last log line of the run and the last drag.
fn watch_to_the_end(viewer: &mut Viewer) {
    let is_end = |message: &Stamped| message.data.windows(9).any(|part| part == b"completed");
    viewer.watch(LONG, |viewer| viewer.messages["/log"].iter().any(is_end));
    viewer.watch(Duration::from_millis(300), |_| false);
}

/// `t = k/50` for k = 0 … 300 \[ns\].
fn times() -> Vec<u64> {
    (0..=300).map(|step| step * 20_000_000).collect()
}

fn ends(mut child: Child, viewer: Viewer) {
    viewer.leave();
    let start = Instant::now();
    assert!(child.wait().expect("it ends").success());
    assert!(
        start.elapsed() < Duration::from_secs(5),
        "it ends when viewers have left: {:?}",
        start.elapsed()
    );
}

#[test]
fn points_are_at_their_times_at_any_pace() {
    for pace in [&[][..], &["--pace", "10"], &["--pace"]] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (child, url) = live(folder.path(), &[&["--wait"], pace].concat());
        let mut viewer = Viewer::connect(&url);
        // panel by panel: the run begins after the last subscription
        for topic in ["/drag", "/view/scene", "/log", "/velocity"] {
            viewer.subscribe(&[topic]);
            viewer.watch(Duration::from_millis(450), |_| false);
        }
        watch_to_the_end(&mut viewer);
        assert_eq!((viewer.times("/drag"), viewer.times("/velocity")), (times(), times()), "pace {pace:?}");
        assert_eq!(viewer.times("/log").first(), Some(&0));
        assert!(!viewer.times("/view/scene").is_empty());
        assert_eq!(viewer.jumps, 0, "pace {pace:?}");
        ends(child, viewer);
    }
}

#[test]
fn late_viewers_and_panels_receive_the_beginning() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (child, url) = live(folder.path(), &["--pace", "2"]);
    let mut viewer = Viewer::connect(&url);
    for (topic, pause) in [("/drag", 500), ("/log", 500), ("/velocity", 400)] {
        viewer.watch(Duration::from_millis(pause), |_| false);
        viewer.subscribe(&[topic]);
    }
    watch_to_the_end(&mut viewer);
    assert_eq!((viewer.times("/drag"), viewer.times("/velocity")), (times(), times()));
    assert_eq!(viewer.times("/log").first(), Some(&0));
    assert!(viewer.jumps > 0, "the run was under way");
    // after the last step
    let mut late = Viewer::connect(&url);
    late.subscribe(&["/drag", "/log", "/view/scene"]);
    watch_to_the_end(&mut late);
    assert_eq!(late.times("/drag"), times());
    assert_eq!(late.times("/view/scene"), [6_000_000_000]);
    viewer.leave();
    ends(child, late);
}

#[test]
fn idle_connections_do_not_hold_the_end() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mut child, url) = live(folder.path(), &["--set", "mesh.cells=10", "--pace", "6"]);
    let silent = TcpStream::connect(url.trim_start_matches("ws://")).expect("it listens");
    let mut half = TcpStream::connect(url.trim_start_matches("ws://")).expect("it listens");
    half.write_all(b"GET / HTTP/1.1\r\nHost: localhost\r\n").expect("it reads");
    let unsubscribed = Viewer::connect(&url);
    let start = Instant::now();
    assert!(child.wait().expect("it ends").success());
    assert!(start.elapsed() < Duration::from_secs(5), "{:?}", start.elapsed());
    drop((silent, half, unsubscribed));
}

#[test]
fn a_foreign_page_is_refused_and_the_option_that_allows_it_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (allowed, status) in [(&[][..], "403"), (&["--allow-origin", "https://viewer.example"], "101")] {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
        command.args([
            "run",
            "fig5",
            "-o",
            "run.mcap",
            "--force",
            "--live",
            "0",
            "--wait",
            "--set",
            "mesh.cells=10",
        ]);
        let mut child = command
            .args(allowed)
            .current_dir(folder.path())
            .stderr(Stdio::piped())
            .spawn()
            .expect("it starts");
        let mut lines =
            BufReader::new(child.stderr.take().expect("stderr is taken")).lines().map_while(Result::ok);
        let at = lines.find_map(|line| Some(line.split_once("ws://")?.1.split(' ').next()?.to_owned()));
        let mut stream = TcpStream::connect(at.expect("an address")).expect("it listens");
        let request = "GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: https://viewer.example\r\nConnection: Upgrade\r\n\
            Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\
            Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n";
        stream.write_all(request.as_bytes()).expect("it reads");
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).expect("an answer");
        assert_eq!(answer, format!("HTTP/1.1 {status}").as_bytes());
        if status == "403" {
            let line = lines.find(|line| line.contains("refused")).expect("a line on standard error");
            assert!(line.contains("--allow-origin https://viewer.example"), "{line}");
        }
        child.kill().expect("it waits for a viewer");
        child.wait().expect("it ends");
    }
}
