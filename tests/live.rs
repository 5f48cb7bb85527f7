//! Live runs as viewers see them. The viewer puts messages at the time it received last, as Lichtblick does.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use crate::{
    program::serving,
    viewer::{Stamped, Viewer},
};

#[test]
fn points_are_at_their_times_at_any_pace() {
    // side by side: they wait most of the time
    thread::scope(|scope| {
        let paces = [&[][..], &["--pace", "10"], &["--pace"]];
        let runs = paces.map(|pace| scope.spawn(move || watch_at_pace(pace)));
        runs.into_iter().for_each(|run| run.join().expect("points at their times"));
    });
}

/// A live run of Fig. 5 with 300 steps, from the last subscription to its end.
fn watch_at_pace(pace: &[&str]) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
    command.args(["run", "fig5", "-o", "run.mcap", "--live", "0", "--wait"]).args(pace);
    let (mut child, url) = serving(command.current_dir(&folder));
    let mut viewer = Viewer::connect(&url);
    // panel by panel: the run begins after the last subscription
    for topic in ["/drag", "/view/scene", "/log", "/velocity"] {
        viewer.subscribe(&[topic]);
        viewer.watch(Duration::from_millis(450), |_| false);
    }
    let is_end = |message: &Stamped| message.data.windows(9).any(|part| part == b"completed");
    viewer.watch(Duration::from_secs(60), |viewer| viewer.messages["/log"].iter().any(is_end));
    viewer.watch(Duration::from_millis(300), |_| false);
    // t = k/50 [ns]
    let times: Vec<u64> = (0..=300).map(|step| step * 20_000_000).collect();
    assert_eq!((&viewer.times("/drag"), &viewer.times("/velocity")), (&times, &times), "pace {pace:?}");
    assert_eq!(viewer.times("/log").first(), Some(&0));
    assert!(!viewer.times("/view/scene").is_empty());
    assert_eq!(viewer.jumps, 0, "pace {pace:?}");
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
fn a_foreign_page_is_refused_and_the_option_that_allows_it_named() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (allowed, status) in [(&[][..], "403"), (&["--allow-origin", "https://viewer.example"], "101")] {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("percuss"));
        command.args("run fig5 -o run.mcap --force --live 0 --wait --set mesh.cells=10".split(' '));
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
