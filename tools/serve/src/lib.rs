//! Sends messages to viewers over the Foxglove WebSocket protocol, for live runs (`percuss run --live`) and replays
//! (`percuss-read replay`).
//!
//! Knows topics, schemas and bytes, nothing of physics or files. Sending never waits: messages go into one [`history`] from which
//! every viewer is served at its own speed, each message after its own time. Who comes later gets what has been sent so far,
//! series whole and of pictures the last; a viewer that is too slow loses pictures, then the oldest of the rest.

use std::{
    collections::BTreeMap,
    io,
    net::{Shutdown, TcpListener, TcpStream},
    process,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, channel},
    },
    thread::{self, JoinHandle},
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use tungstenite::Message;

mod address;
mod audience;
mod history;
mod protocol;
mod viewer;

pub use address::{Address, AddressError};

use audience::Audience;

/// Viewers subscribe panel by panel, in bursts over half a second to one and a half: who is quiet for so long has all it wants.
pub const QUIET: Duration = Duration::from_millis(1500);
/// How long the end waits for viewers to fetch what is under way.
const LINGER: Duration = Duration::from_secs(3);
const PAUSE: Duration = Duration::from_millis(20);
/// Connections at a time; more are turned away.
const CONNECTIONS: usize = 64;

/// Reads how much log time is to pass in a second.
///
/// # Errors
///
/// It is no number above 0.
pub fn speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(speed) if speed.is_finite() && speed > 0.0 => Ok(speed),
        _ => Err("a speed is a number above 0".into()),
    }
}

/// Reads a number of seconds.
///
/// # Errors
///
/// It is no number, or below 0.
pub fn seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    seconds.ok_or_else(|| "seconds are a number from 0 up".into())
}

/// A channel to serve.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Topic.
    pub topic: String,
    /// Encoding of the messages.
    pub encoding: String,
    /// Name, encoding and data of the schema, if there is one.
    pub schema: Option<(String, String, Vec<u8>)>,
    /// Metadata.
    pub metadata: BTreeMap<String, String>,
}

/// What a viewer asks of a player.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Play, or stand still.
    pub play: bool,
    /// Speed, 1 for the time of the messages; none to leave it as it is.
    pub speed: Option<f64>,
    /// Time to go to \[ns\].
    pub seek: Option<u64>,
    /// What the answer needs.
    pub answer: Answer,
}

/// Who has made a request, for the answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    viewer: u64,
    request: String,
}

/// Where a player stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playback {
    /// What it does.
    pub state: Playing,
    /// Its time \[ns\].
    pub time: u64,
    /// Its speed, 1 for the time of the messages.
    pub speed: f64,
}

/// What a player does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Playing {
    /// Plays.
    Playing,
    /// Stands still.
    Paused,
    /// Has come to the end.
    Ended,
}

/// Why nothing can be served.
#[derive(Debug, thiserror::Error)]
#[error("cannot serve at {address}: {error}")]
pub struct ServeError {
    address: Address,
    error: io::Error,
}

/// A server that viewers connect to.
pub struct Server {
    host: String,
    port: u16,
    audience: Arc<Audience>,
    requests: Mutex<Receiver<Request>>,
    is_closed: Arc<AtomicBool>,
    door: Option<JoinHandle<Vec<Connection>>>,
}

/// A connection and its thread.
struct Connection {
    stream: TcpStream,
    thread: JoinHandle<()>,
}

impl Server {
    /// Opens a server.
    ///
    /// * `name`: what viewers call it
    /// * `range`: first and last time \[ns\] of a recording that viewers may play as they like
    ///
    /// # Errors
    ///
    /// The address is not to be had.
    pub fn open(
        address: &Address,
        name: &str,
        channels: &[Channel],
        range: Option<(u64, u64)>,
    ) -> Result<Self, ServeError> {
        let failed = |error| ServeError { address: address.clone(), error };
        let listener = TcpListener::bind((address.host.as_str(), address.port)).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let port = listener.local_addr().map_err(failed)?.port();
        let (sender, requests) = channel();
        let audience = Arc::new(Audience::new(channels.len(), sender));
        let is_closed = Arc::new(AtomicBool::new(false));
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        let session = format!("{}-{since}", process::id());
        let mut greeting = vec![protocol::server_info(name, &session, range)];
        greeting.extend(protocol::advertise(channels));
        let door = {
            let (audience, is_closed) = (Arc::clone(&audience), Arc::clone(&is_closed));
            thread::spawn(move || welcome(&listener, &audience, &is_closed, greeting.into()))
        };
        Ok(Self {
            host: address.host.clone(),
            port,
            audience,
            requests: Mutex::new(requests),
            is_closed,
            door: Some(door),
        })
    }

    /// The address for viewers.
    pub fn url(&self) -> String {
        if self.host.contains(':') {
            format!("ws://[{}]:{}", self.host, self.port)
        } else {
            format!("ws://{}:{}", self.host, self.port)
        }
    }

    /// Number of viewers that have subscribed to something.
    pub fn viewers(&self) -> usize {
        self.audience.count()
    }

    /// True if so many viewers have subscribed to all they want, as far as can be told: nobody has subscribed for
    /// [`QUIET`].
    pub fn is_ready(&self, viewers: usize) -> bool {
        viewers == 0 || (self.viewers() >= viewers && self.audience.is_quiet())
    }

    /// Sends a message to those who have subscribed to its channel, and keeps it for those who will.
    ///
    /// * `channel`: its number in the list that the server was opened with
    /// * `log_time`: its time \[ns\]
    pub fn send(&self, channel: usize, log_time: u64, bytes: &[u8]) {
        self.audience.message(channel, log_time, bytes);
    }

    /// Tells viewers the time \[ns\] if there is no message to do so.
    pub fn tell_time(&self, time: u64) {
        self.audience.time(time);
    }

    /// Forgets what has been sent: newcomers begin with what comes next.
    pub fn begin_again(&self) {
        self.audience.begin_again();
    }

    /// What viewers have asked for; waits for it until then.
    pub fn request(&self, wait: Duration) -> Option<Request> {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(wait).ok()
    }

    /// Tells viewers where the player stands, after what has been sent before.
    ///
    /// * `did_seek`: it has jumped there
    /// * `answer`: the request this answers
    pub fn tell_playback(&self, playback: Playback, did_seek: bool, answer: Option<Answer>) {
        self.audience.playback(playback, did_seek, answer);
    }

    /// Holds the end until all viewers have left, for so long at most, or until `is_over`.
    pub fn hold(&self, longest: Duration, is_over: impl Fn() -> bool) {
        let start = Instant::now();
        while self.viewers() > 0 && start.elapsed() < longest && !is_over() {
            thread::sleep(PAUSE);
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.is_closed.store(true, Ordering::Relaxed);
        let connections = self.door.take().and_then(|door| door.join().ok()).unwrap_or_default();
        self.audience.end();
        let start = Instant::now();
        while !self.audience.is_empty() && start.elapsed() < LINGER {
            thread::sleep(PAUSE);
        }
        // who is slow, or has never said a word, is not waited for
        for connection in connections {
            drop(connection.stream.shutdown(Shutdown::Both));
            drop(connection.thread.join());
        }
    }
}

/// Takes connections until the server is closed; returns those there are.
fn welcome(
    listener: &TcpListener,
    audience: &Arc<Audience>,
    is_closed: &AtomicBool,
    greeting: Arc<[Message]>,
) -> Vec<Connection> {
    let mut connections: Vec<Connection> = Vec::new();
    while !is_closed.load(Ordering::Relaxed) {
        // errors are those of single connections, or pass
        let Ok((stream, _)) = listener.accept() else {
            thread::sleep(PAUSE);
            continue;
        };
        connections.retain(|connection| !connection.thread.is_finished());
        let Ok(copy) = stream.try_clone() else { continue };
        if connections.len() >= CONNECTIONS {
            continue;
        }
        let (audience, greeting) = (Arc::clone(audience), Arc::clone(&greeting));
        let thread = thread::spawn(move || viewer::serve(stream, &audience, &greeting));
        connections.push(Connection { stream: copy, thread });
    }
    connections
}
