//! Replays of hostile files: what is wrong is said, and they end.

use std::{
    io::{BufRead, BufReader},
    net::TcpStream,
    process::Stdio,
    sync::Mutex,
    time::{Duration, Instant},
};

use tungstenite::{ClientRequestBuilder, Message, client};
use wait4::Wait4;

use super::{
    alone, first_lines, on_threads, print_largest,
    watch::{Ending, MEMORY, command, complaints},
};

/// More addresses than other verbs need: every connection has its threads \[KiB\].
const ADDRESSES: u64 = 1_200_000;

/// Most of the time a replay waits for viewers.
const THREADS: usize = 4;

/// A viewer that subscribes to everything and reads until the server closes, or has nothing more to say.
fn view(url: &str) -> Option<()> {
    let longest = Duration::from_secs(20);
    let stream = TcpStream::connect(url.trim_start_matches("ws://")).ok()?;
    stream.set_read_timeout(Some(longest)).ok()?;
    let request = ClientRequestBuilder::new(url.parse().ok()?).with_sub_protocol("foxglove.websocket.v1");
    let (mut socket, _) = client(request, stream).ok()?;
    let started = Instant::now();
    while started.elapsed() < longest {
        let Message::Text(text) = socket.read().ok()? else { continue };
        let json: serde_json::Value = serde_json::from_str(&text).ok()?;
        let Some(channels) = json["channels"].as_array().filter(|_| json["op"] == "advertise") else {
            continue;
        };
        let ids = channels
            .iter()
            .map(|channel| serde_json::json!({"id": channel["id"], "channelId": channel["id"]}));
        let ids: Vec<_> = ids.collect();
        socket
            .send(Message::text(serde_json::json!({"op": "subscribe", "subscriptions": ids}).to_string()))
            .ok()?;
    }
    None
}

/// Replays a file to a viewer, much faster than it was recorded.
fn replay(folder: &std::path::Path) -> Ending {
    let arguments = ["replay", "a.mcap", "--addr", "127.0.0.1:0", "--once", "--hold", "0", "--speed", "1e12"];
    let mut child =
        command(folder, MEMORY, ADDRESSES, &arguments).stderr(Stdio::piped()).spawn().expect("a shell");
    let mut stderr = String::new();
    for line in BufReader::new(child.stderr.take().expect("stderr")).lines() {
        let line = line.expect("text");
        if let Some(url) = line.split_whitespace().find(|word| word.starts_with("ws://")) {
            view(url);
        }
        stderr += &(line + "\n");
    }
    let used = child.wait4().expect("an end");
    Ending {
        status: used.status.code().filter(|status| *status < 128),
        stderr,
        memory: used.rusage.maxrss >> 20,
        time: used.rusage.utime + used.rusage.stime,
    }
}

#[test]
fn replays_of_hostile_files_end() {
    alone("replays::replays_of_hostile_files_end", watch_replays);
}

fn watch_replays() {
    let (wrong, most) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
    on_threads(THREADS, |_, what, folder| {
        let ending = replay(folder);
        let mut all = complaints(&ending, MEMORY);
        if ending.status != Some(0) && ending.stderr.is_empty() {
            all.push("says nothing".into());
        }
        let said = first_lines(&ending.stderr);
        let mut wrong = wrong.lock().expect("no panic");
        wrong.extend(all.into_iter().map(|complaint| format!("{what}: {complaint}: {said}")));
        most.lock().expect("no panic").push((ending.memory, ending.time, what.to_owned()));
    });
    print_largest(most.into_inner().expect("no panic"));
    let wrong = wrong.into_inner().expect("no panic");
    assert!(wrong.is_empty(), "{}:\n{}", wrong.len(), wrong.join("\n"));
}
