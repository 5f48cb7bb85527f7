//! What listens on a port serves only whom it should, and survives everything that is sent to it.

use std::{
    fs,
    io::{ErrorKind, Read, Write},
    net::{Shutdown, TcpStream},
    sync::{Arc, Mutex, PoisonError, RwLock},
    thread,
    time::{Duration, Instant},
};

use percuss_serve::{Access, Playback, Playing, Server, VIEWERS};
use tungstenite::{ClientRequestBuilder, Message, WebSocket, client};

use crate::viewer::Viewer;

const LONG: Duration = Duration::from_secs(10);
const KEY: &str = "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==";

fn server() -> Server {
    crate::open(&["/drag", "/picture"], None, Access::default())
}

/// One with playback control.
fn player() -> Server {
    crate::open(&["/drag", "/picture"], Some((0, 1_000)), Access::default())
}

fn address(server: &Server) -> String {
    server.url().trim_start_matches("ws://").to_owned()
}

fn connect(server: &Server) -> TcpStream {
    let stream = TcpStream::connect(address(server)).expect("it listens");
    stream.set_read_timeout(Some(LONG)).expect("a socket");
    stream
}

/// A request for a viewer's connection, with further header lines.
fn request(host: &str, more: &str) -> String {
    format!(
        "GET / HTTP/1.1\r\nHost: {host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\n{KEY}\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n{more}\r\n"
    )
}

/// All bytes until the server closes.
fn read_to_end(stream: &mut TcpStream) -> Vec<u8> {
    let mut bytes = Vec::new();
    match stream.read_to_end(&mut bytes) {
        Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
            panic!("the connection is still open after {} bytes", bytes.len())
        }
        // closed, or reset as there were unread bytes
        _ => bytes,
    }
}

/// The first line of the answer to a request, and the rest of a refusal.
fn answer(server: &Server, text: &str) -> String {
    let mut stream = connect(server);
    stream.write_all(text.as_bytes()).expect("it reads");
    let mut bytes = vec![0; 4096];
    let count = stream.read(&mut bytes).unwrap_or(0);
    String::from_utf8_lossy(&bytes[..count]).into_owned()
}

/// A viewer's connection after the handshake.
fn socket(server: &Server) -> WebSocket<TcpStream> {
    let request = ClientRequestBuilder::new(server.url().parse().expect("an address"))
        .with_sub_protocol("foxglove.sdk.v1");
    client(request, connect(server)).expect("a server of the protocol").0
}

/// A viewer gets what it should, whatever has happened before.
fn serves_well(server: &Server) {
    let start = Instant::now();
    let mut viewer = Viewer::connect(&server.url());
    viewer.subscribe(&["/drag"]);
    server.send(0, 1, b"{}");
    viewer.watch(LONG, |viewer| !viewer.messages["/drag"].is_empty());
    assert_eq!(viewer.times("/drag").last(), Some(&1), "after {:?}", start.elapsed());
    viewer.leave();
}

/// The next frame whose first byte, of a text `{`, is this one.
fn next(socket: &mut WebSocket<TcpStream>, first: u8) -> Vec<u8> {
    loop {
        let data = socket.read().expect("a frame").into_data().to_vec();
        if data.first() == Some(&first) {
            return data;
        }
    }
}

/// A request of playback control with a name.
fn control(command: u8, speed: f32, seek: Option<u64>, name: &[u8]) -> Vec<u8> {
    let mut data = vec![3, command];
    data.extend(speed.to_le_bytes());
    data.push(u8::from(seek.is_some()));
    data.extend(seek.unwrap_or_default().to_le_bytes());
    data.extend((name.len() as u32).to_le_bytes());
    data.extend(name);
    data
}

#[test]
fn playback_control_is_for_viewers_whose_protocol_has_it() {
    let _running = TESTS.read().unwrap_or_else(PoisonError::into_inner);
    let server = player();
    let state = |time| Playback { state: Playing::Paused, time, speed: 2.5 };
    let mut socket = socket(&server);
    let info = String::from_utf8(next(&mut socket, b'{')).expect("text");
    assert!(info.contains("playbackControl") && info.contains("dataEndTime"), "{info}");
    socket.send(Message::binary(control(1, 2.5, Some(300), b"r"))).expect("it listens");
    let request = server.request(LONG).expect("a request");
    assert_eq!((request.play, request.speed, request.seek), (false, Some(2.5), Some(300)));
    // as Lichtblick: it offers both, the older one first; this viewer panics at what it does not know
    let mut viewer = Viewer::connect(&server.url());
    viewer.subscribe(&["/drag"]);
    server.send_playback(state(300), true, Some(request.answer));
    server.send(0, 300, b"{}");
    let answer = next(&mut socket, 5);
    assert_eq!(
        (answer[1], &answer[10..14], &answer[14..]),
        (1, &2.5_f32.to_le_bytes()[..], &[1, 1, 0, 0, 0, b'r'][..])
    );
    viewer.watch(LONG, |viewer| !viewer.messages["/drag"].is_empty());
    // a later panel takes the viewer back, which has a state of its own
    server.send(1, 200, &[0; 20_000]);
    viewer.subscribe(&["/picture"]);
    viewer.watch(LONG, |viewer| !viewer.messages["/picture"].is_empty());
    viewer.leave();
    let older = ClientRequestBuilder::new(server.url().parse().expect("an address"))
        .with_sub_protocol("foxglove.websocket.v1");
    let (mut older, _) = client(older, connect(&server)).expect("a server of the protocol");
    let info = String::from_utf8(next(&mut older, b'{')).expect("text");
    assert!(info.contains(r#"["time"]"#) && !info.contains("dataEndTime"), "{info}");
    older.send(Message::binary(control(0, 1.0, None, b"r"))).expect("it listens");
    next(&mut older, b'{');
    let refusal = String::from_utf8(next(&mut older, b'{')).expect("text");
    assert!(refusal.contains("playback control is of foxglove.sdk.v1"), "{refusal}");
    assert_eq!(server.request(Duration::ZERO), None);
}

/// Held by tests: those that measure memory run alone.
static TESTS: RwLock<()> = RwLock::new(());

/// Memory of this process in RAM \[bytes\].
fn memory() -> usize {
    let pages = fs::read_to_string("/proc/self/statm").expect("a Linux kernel");
    pages.split(' ').nth(1).and_then(|pages| pages.parse::<usize>().ok()).expect("a number of pages") * 4096
}

/// Pseudo-random numbers of a fixed sequence.
struct Dice(u64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % sides as u64) as usize
    }
}

/// A masked frame of a client.
fn frame(first: u8, payload: &[u8]) -> Vec<u8> {
    let mut bytes = vec![first];
    match payload.len() {
        length @ 0..126 => bytes.push(0x80 | length as u8),
        length @ 126..65_536 => {
            bytes.push(0x80 | 126);
            bytes.extend((length as u16).to_be_bytes());
        }
        length => {
            bytes.push(0x80 | 127);
            bytes.extend((length as u64).to_be_bytes());
        }
    }
    bytes.extend([0; 4]);
    bytes.extend(payload);
    bytes
}

#[test]
fn foreign_origins_are_refused_with_a_text_and_reported_once() {
    let _running = TESTS.read().unwrap_or_else(PoisonError::into_inner);
    let lines = Arc::new(Mutex::new(Vec::new()));
    let copy = Arc::clone(&lines);
    let report = Arc::new(move |line: &str| copy.lock().expect("no panic").push(line.to_owned()));
    let origins = vec!["https://viewer.example".parse().expect("an origin")];
    let server = crate::open(&["/drag"], None, Access { origins, report });
    let host = address(&server);
    for (origin, is_served) in [
        ("", true),
        ("Origin: http://localhost:8080\r\n", true),
        ("Origin: file://\r\n", true),
        ("Origin: https://viewer.example\r\n", true),
        ("Origin: null\r\n", false),
        ("Origin: https://evil.example\r\n", false),
        ("Origin: https://evil.example\r\n", false),
        ("Origin: https://evil.example/ [2J\r\n", false),
        ("Origin: http://localhost\r\nOrigin: https://evil.example\r\n", false),
    ] {
        let text = answer(&server, &request(&host, origin));
        let status = if is_served { "HTTP/1.1 101 " } else { "HTTP/1.1 403 " };
        assert!(text.starts_with(status), "{origin:?}: {text}");
        assert!(!text.contains('\x1b'), "{text:?}");
    }
    // the parser of requests refuses this one
    assert_eq!(answer(&server, &request(&host, "Origin: https://evil.example\x1b[2J\r\n")), "");
    let rebound = answer(&server, &request("evil.example:8765", ""));
    assert!(rebound.starts_with("HTTP/1.1 403 ") && rebound.contains("evil.example"), "{rebound}");
    let lines = lines.lock().expect("no panic");
    let of_evil: Vec<_> = lines.iter().filter(|line| line.contains("https://evil.example")).collect();
    assert_eq!(of_evil.len(), 1, "{lines:?}");
    assert!(of_evil[0].contains("--allow-origin https://evil.example"), "{lines:?}");
    assert!(lines.iter().all(|line| !line.contains('\x1b')), "{lines:?}");
    serves_well(&server);
}

#[test]
fn the_number_of_viewers_is_limited_and_places_come_free() {
    let _running = TESTS.read().unwrap_or_else(PoisonError::into_inner);
    let server = server();
    let seated: Vec<_> = (0..VIEWERS).map(|_| socket(&server)).collect();
    let text = answer(&server, &request(&address(&server), ""));
    assert!(text.starts_with("HTTP/1.1 503 ") && text.ends_with("taken\n"), "{text}");
    drop(seated);
    thread::sleep(Duration::from_millis(500));
    serves_well(&server);
}

#[test]
fn silent_connections_make_room_and_do_not_hold_the_end() {
    let _running = TESTS.read().unwrap_or_else(PoisonError::into_inner);
    let server = server();
    let mut silent: Vec<TcpStream> = (0..200).map(|_| connect(&server)).collect();
    // the last viewer is served although 200 were there before
    serves_well(&server);
    assert!(read_to_end(&mut silent[0]).is_empty(), "the oldest is closed");
    let unused = socket(&server);
    let start = Instant::now();
    server.hold(LONG, || false);
    drop(server);
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
    drop((silent, unused));
}

#[test]
fn a_viewer_that_never_reads_does_not_hold_the_end() {
    let _running = TESTS.read().unwrap_or_else(PoisonError::into_inner);
    let server = server();
    let mut deaf = socket(&server);
    deaf.send(Message::text(r#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":2}]}"#))
        .expect("it reads");
    crate::wait_for_viewer(&server);
    thread::sleep(Duration::from_millis(200));
    (0..300).for_each(|step| server.send(1, step, &[0; 100_000]));
    let start = Instant::now();
    drop(server);
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
}

#[test]
fn a_handshake_byte_by_byte_ends_after_ten_seconds() {
    // beside those that measure memory: it takes none, and waits
    let server = server();
    let mut slow = connect(&server);
    slow.set_nonblocking(true).expect("a socket");
    let start = Instant::now();
    slow.write_all(b"GET /").expect("it reads");
    loop {
        // a path without an end
        let sent = slow.write(b"x");
        let is_open = matches!(slow.read(&mut [0]), Err(error) if error.kind() == ErrorKind::WouldBlock);
        if sent.is_err() || !is_open {
            break;
        }
        assert!(start.elapsed() < Duration::from_secs(15), "it is still open");
        thread::sleep(Duration::from_millis(300));
    }
    assert!(start.elapsed() > Duration::from_secs(8), "{:?}", start.elapsed());
    serves_well(&server);
}

#[test]
fn a_broken_handshake_ends_its_connection_only() {
    let _running = TESTS.read().unwrap_or_else(PoisonError::into_inner);
    let server = server();
    let host = address(&server);
    let large = format!("X: {}\r\n", "x".repeat(17 << 10));
    let many: String = (0..300).map(|number| format!("X-{number}: 1\r\n")).collect();
    let hello: &[u8] =
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0";
    for bytes in [
        hello,
        b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
        b"GET / HTTP/1.0\r\nHost: localhost\r\n\r\n",
        b"POST /run HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\nhello",
        b"SSH-2.0-OpenSSH_9.9\r\n\r\n",
        b"\r\n\r\n\r\n\r\n",
        b"GET / HTTP/1.1\r\n: \r\n\r\n",
        &[0xff; 20_000],
        request(&host, &large).as_bytes(),
        request(&host, &many).as_bytes(),
        request(&host, "").replace(KEY, "Sec-WebSocket-Key: short").as_bytes(),
        request(&host, "").replace("foxglove", "other").as_bytes(),
        format!("{}junk", request(&host, "")).as_bytes(),
    ] {
        let mut stream = connect(&server);
        // it may close before it has read all
        drop(stream.write_all(bytes));
        drop(stream.shutdown(Shutdown::Write));
        let answer = read_to_end(&mut stream);
        assert!(
            !answer.starts_with(b"HTTP/1.1 101"),
            "{:?}",
            String::from_utf8_lossy(&bytes[..bytes.len().min(80)])
        );
    }
    serves_well(&server);
}

#[test]
fn broken_frames_end_their_connection_only() {
    let _running = TESTS.read().unwrap_or_else(PoisonError::into_inner);
    let server = server();
    let unmasked = b"\x81\x02{}".to_vec();
    let huge = [&[0x82, 0x80 | 127][..], &[0x7f; 8], &[0; 4]].concat();
    let above = [&[0x82, 0x80 | 127][..], &(1_u64 << 20).to_be_bytes(), &[0; 4]].concat();
    let fragments: Vec<u8> = [frame(0x01, &[b' '; 200_000]), frame(0x00, &[b' '; 200_000])].concat();
    for bytes in [
        unmasked,
        huge,
        above,
        fragments,
        frame(0x81, b"\xff\xfe not UTF-8"),
        frame(0x83, b"a reserved kind"),
        frame(0xf1, b"reserved bits"),
        frame(0x89, &[0; 126]),
        frame(0x09, b"half a ping"),
        frame(0x80, b"nothing to continue"),
        [frame(0x01, b"{"), frame(0x01, b"}")].concat(),
        frame(0x88, &[0]),
        frame(0x88, &[]),
    ] {
        let mut socket = socket(&server);
        drop(socket.get_mut().write_all(&bytes));
        read_to_end(socket.get_mut());
    }
    serves_well(&server);
}

#[test]
fn floods_neither_grow_memory_nor_starve_others() {
    let _running = TESTS.write().unwrap_or_else(PoisonError::into_inner);
    let server = player();
    let many: String = (0..20_000).map(|id| format!(r#"{{"id":{id},"channelId":{}}},"#, id % 3)).collect();
    let floods = [
        frame(0x89, &[b'p'; 125]),
        frame(0x00, &[]),
        frame(0x82, &control(0, 1.0, None, &[b'n'; 200])),
        frame(0x82, &control(0, 1.0, None, &[b'n'; 200_000])),
        frame(0x81, &[b'['; 100_000]),
        frame(0x81, br#"{"op":"getParameters"}"#),
        frame(0x81, br#"{"op":"unsubscribe","subscriptionIds":[1,2,3]}"#),
        frame(
            0x81,
            format!(r#"{{"op":"subscribe","subscriptions":[{}]}}"#, many.trim_end_matches(',')).as_bytes(),
        ),
    ];
    let before = memory();
    let end = Instant::now() + Duration::from_secs(3);
    thread::scope(|scope| {
        for bytes in &floods {
            let mut socket = socket(&server);
            scope.spawn(move || {
                let stream = socket.get_mut();
                stream.set_write_timeout(Some(Duration::from_millis(100))).expect("a socket");
                if bytes.starts_with(&[0]) {
                    stream.write_all(&frame(0x01, b"{")).expect("it reads");
                }
                // it sends as much as is taken, and reads nothing
                while Instant::now() < end {
                    if let Err(error) = stream.write_all(bytes)
                        && !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
                    {
                        break;
                    }
                }
            });
        }
        thread::sleep(Duration::from_millis(300));
        while Instant::now() < end {
            serves_well(&server);
            drop(server.request(Duration::ZERO));
        }
    });
    let grown = memory().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes more");
    let start = Instant::now();
    drop(server);
    assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
}

/// Sends bytes and leaves, some of the time after an answer.
fn send(server: &Server, bytes: &[u8], dice: &mut Dice) {
    let mut stream = connect(server);
    drop(stream.write_all(bytes));
    if dice.roll(8) == 0 {
        drop(stream.shutdown(Shutdown::Write));
        read_to_end(&mut stream);
    }
}

#[test]
fn garbage_and_mutated_streams_are_survived() {
    let _running = TESTS.write().unwrap_or_else(PoisonError::into_inner);
    // the full form takes minutes
    let streams = if std::env::var_os("PERCUSS_FULL").is_some() { 3000 } else { 600 };
    let server = player();
    let host = address(&server);
    let handshake = request(&host, "").into_bytes();
    let frames = [
        frame(0x81, br#"{"op":"subscribe","subscriptions":[{"id":1,"channelId":1},{"id":2,"channelId":2}]}"#),
        frame(0x81, br#"{"op":"unsubscribe","subscriptionIds":[1]}"#),
        frame(0x82, &control(1, 1.0, Some(9), b"id")),
        frame(0x89, b"ping"),
        frame(0x88, &[]),
    ]
    .concat();
    let before = memory();
    let mut dice = Dice(0x9e37_79b9_7f4a_7c15);
    for number in 0..streams {
        let mut bytes: Vec<u8> = match number % 3 {
            0 => (0..dice.roll(300)).map(|_| dice.roll(256) as u8).collect(),
            1 => handshake.clone(),
            _ => frames.clone(),
        };
        for _ in 0..dice.roll(6) {
            let at = dice.roll(bytes.len().max(1));
            match dice.roll(4) {
                0 => bytes.truncate(at),
                1 => bytes.insert(at.min(bytes.len()), dice.roll(256) as u8),
                _ if at < bytes.len() => bytes[at] ^= 1 << dice.roll(8),
                _ => {}
            }
        }
        if number % 3 == 2 {
            // after a sound handshake
            let mut stream = connect(&server);
            stream.write_all(&handshake).expect("it reads");
            let mut answer = [0; 12];
            if stream.read_exact(&mut answer).is_ok() && &answer == b"HTTP/1.1 101" {
                drop(stream.write_all(&bytes));
            }
        } else {
            send(&server, &bytes, &mut dice);
        }
        drop(server.request(Duration::ZERO));
    }
    thread::sleep(Duration::from_millis(500));
    serves_well(&server);
    let grown = memory().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes more");
}
