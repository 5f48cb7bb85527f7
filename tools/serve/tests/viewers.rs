//! Viewers get every message at its own time, at any time of connection and in any order of subscriptions.

use std::{
    net::TcpStream,
    thread,
    time::{Duration, Instant},
};

use percuss_serve::{Access, QUIET, Server};

use crate::viewer::Viewer;

const TOPICS: [&str; 4] = ["/drag", "/velocity", "/log", "/view/scene"];
const STEP: u64 = 20_000_000;
const LONG: Duration = Duration::from_secs(10);

fn server() -> Server {
    crate::open(&TOPICS, None, Access::default())
}

/// Sends steps of a run of 300: numbers at every step, a picture at every tenth, a line at the first and the last.
fn run(server: &Server, steps: std::ops::RangeInclusive<u64>, pause: Duration) {
    for step in steps {
        let time = step * STEP;
        if step == 0 || step == 300 {
            server.send(2, time, b"a line");
        }
        server.send(0, time, &step.to_le_bytes());
        server.send(1, time, &step.to_le_bytes());
        if step.is_multiple_of(10) {
            server.send(3, time, &[0; 20_000]);
        }
        thread::sleep(pause);
    }
}

fn all_times() -> Vec<u64> {
    (0..=300).map(|step| step * STEP).collect()
}

#[test]
fn every_message_comes_at_its_own_time_at_any_pace() {
    for pause in [0, 1] {
        let server = server();
        let mut viewer = Viewer::connect(&server.url());
        viewer.subscribe(&TOPICS);
        while !server.is_ready(1) {
            viewer.watch(Duration::from_millis(20), |_| false);
        }
        thread::scope(|scope| {
            scope.spawn(|| run(&server, 0..=300, Duration::from_millis(pause)));
            viewer.watch(LONG, |viewer| viewer.messages["/velocity"].len() == 301);
        });
        viewer.watch(LONG, |viewer| viewer.messages["/view/scene"].len() == 31);
        assert_eq!(viewer.times("/drag"), all_times());
        assert_eq!(viewer.times("/velocity"), all_times());
        assert_eq!(viewer.times("/log"), [0, 300 * STEP]);
        assert_eq!(viewer.times("/view/scene").len(), 31, "it keeps up: all pictures");
        assert_eq!(viewer.jumps, 0);
    }
}

#[test]
fn a_late_viewer_gets_complete_series_and_the_last_picture() {
    let server = server();
    run(&server, 0..=200, Duration::ZERO);
    let mut viewer = Viewer::connect(&server.url());
    viewer.subscribe(&TOPICS);
    viewer.watch(LONG, |viewer| viewer.messages["/velocity"].len() == 201);
    viewer.watch(Duration::from_millis(200), |_| false);
    assert_eq!(viewer.times("/view/scene"), [200 * STEP]);
    run(&server, 201..=300, Duration::ZERO);
    viewer.watch(LONG, |viewer| viewer.messages["/velocity"].len() == 301);
    assert_eq!((viewer.times("/drag"), viewer.times("/velocity")), (all_times(), all_times()));
    assert_eq!(viewer.times("/log"), [0, 300 * STEP]);
}

#[test]
fn panel_by_panel_subscriptions_get_all_of_each() {
    let server = server();
    thread::scope(|scope| {
        scope.spawn(|| run(&server, 0..=300, Duration::from_millis(6)));
        let mut viewer = Viewer::connect(&server.url());
        for (topic, pause) in [("/drag", 500), ("/log", 500), ("/velocity", 400)] {
            viewer.watch(Duration::from_millis(pause), |_| false);
            viewer.subscribe(&[topic]);
        }
        viewer.watch(LONG, |viewer| {
            viewer.messages["/log"].len() == 2 && viewer.messages["/velocity"].len() == 301
        });
        assert_eq!((viewer.times("/drag"), viewer.times("/velocity")), (all_times(), all_times()));
        assert_eq!(viewer.times("/log"), [0, 300 * STEP]);
        assert_eq!(viewer.jumps, 2, "each later panel takes the viewer back once");
    });
}

#[test]
fn a_run_waits_for_the_last_panel() {
    let server = server();
    assert!(server.is_ready(0) && !server.is_ready(1));
    let mut viewer = Viewer::connect(&server.url());
    for (topic, pause) in [("/drag", 200), ("/log", 1000), ("/velocity", 1000)] {
        viewer.watch(Duration::from_millis(pause), |_| false);
        assert!(!server.is_ready(1));
        viewer.subscribe(&[topic]);
    }
    let start = Instant::now();
    while !server.is_ready(1) && start.elapsed() < LONG {
        thread::sleep(Duration::from_millis(5));
    }
    let waited = start.elapsed();
    assert!(
        QUIET - Duration::from_millis(50) < waited && waited < QUIET + Duration::from_secs(1),
        "{waited:?}"
    );
    viewer.leave();
    assert!(!server.is_ready(1), "it has left");
}

#[test]
fn slow_or_silent_viewers_delay_neither_the_run_nor_its_end() {
    let server = server();
    // one without a handshake, one that never reads
    let silent = TcpStream::connect(server.url().trim_start_matches("ws://")).expect("it listens");
    let mut slow = Viewer::connect(&server.url());
    slow.subscribe(&TOPICS);
    thread::sleep(Duration::from_millis(300));
    let start = Instant::now();
    for step in 0..2000 {
        server.send(3, step, &[0; 100_000]);
    }
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    let start = Instant::now();
    server.hold(Duration::from_millis(300), || false);
    assert!(start.elapsed() >= Duration::from_millis(300), "a viewer is there");
    drop(server);
    assert!(start.elapsed() < Duration::from_secs(6), "{:?}", start.elapsed());
    drop((silent, slow));
    // the silent one alone is no reason to wait
    let server = self::server();
    let silent = TcpStream::connect(server.url().trim_start_matches("ws://")).expect("it listens");
    thread::sleep(Duration::from_millis(100));
    let start = Instant::now();
    server.hold(LONG, || false);
    drop(server);
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    drop(silent);
}

#[test]
fn the_end_waits_until_viewers_have_left() {
    let server = server();
    run(&server, 0..=300, Duration::ZERO);
    let mut viewer = Viewer::connect(&server.url());
    viewer.subscribe(&["/drag"]);
    crate::wait_for_viewer(&server);
    let start = Instant::now();
    thread::scope(|scope| {
        scope.spawn(move || {
            viewer.watch(Duration::from_millis(500), |_| false);
            assert_eq!(viewer.times("/drag"), all_times());
            viewer.leave();
        });
        server.hold(LONG, || false);
    });
    let held = start.elapsed();
    assert!(Duration::from_millis(400) < held && held < Duration::from_secs(3), "{held:?}");
    // a viewer at the end gets the close frame after everything else
    let mut viewer = Viewer::connect(&server.url());
    viewer.subscribe(&["/drag"]);
    crate::wait_for_viewer(&server);
    let end = thread::spawn(move || drop(server));
    viewer.watch(LONG, |_| false);
    assert!(viewer.is_closed);
    assert_eq!(viewer.times("/drag"), all_times());
    end.join().expect("it ends");
}
