//! Sends messages to viewers over the Foxglove WebSocket protocol, for live runs (`percuss run --live`) and replays
//! (`percuss-read replay`).
//!
//! Knows topics, schemas and bytes, nothing of physics or files. Sending never waits: messages go into one [`history`] from which
//! every viewer reads at its own speed, each message after its own time. A later viewer gets the messages sent so far: all of
//! series, the last of pictures. A viewer that is too slow loses pictures, then the oldest of the rest.
//!
//! # Who is served
//!
//! By default clients on this machine ([`Address`]), and no page of a foreign site in a browser at this machine: see
//! [`access`]. Nothing that a client sends is written or shown anywhere, with two exceptions: a report of a refusal names a
//! well-formed origin or host, and an error goes back to its sender, short and without control characters.
//!
//! # Limits
//!
//! | of | limit | beyond it |
//! | --- | --- | --- |
//! | connections in the handshake | 64 | the oldest is closed |
//! | viewers | 16 | the next is refused (503) |
//! | a handshake | 10 s in all, 16 KiB | the connection is closed |
//! | a request, or a frame of one | 256 KiB | the connection is closed |
//! | requests | 250 a second after the first 1000 | the client waits |
//! | bytes from a client | 1 MiB a second after the first 2 MiB | the client waits |
//! | subscriptions of a viewer | one to each channel | an error is answered |
//! | answers that wait for a viewer | 64 of 200 characters | further requests get none |
//! | requests that wait for a player | 64, with names of 256 bytes | an error is answered |
//! | messages that wait for viewers | [`history`] | the oldest are lost |
//! | a viewer that reads nothing of what is sent | 30 s | the connection is closed |
//! | the end of the server | 2 s | all connections are closed |

use std::{
    collections::BTreeMap,
    io,
    net::TcpListener,
    process,
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, sync_channel},
    },
    thread,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

mod acceptor;
pub mod access;
mod address;
mod connection;
mod history;
mod origin;
#[cfg(not(fuzzing))]
mod protocol;
#[cfg(fuzzing)]
pub mod protocol;
mod stream;
mod viewers;

pub use access::{Access, Report};
pub use address::{Address, AddressError};
pub use origin::{AllowedOrigin, Origin, OriginError};
pub use viewers::VIEWERS;

use acceptor::Acceptor;
use access::Admission;
use connection::Shared;
use history::History;
use viewers::Viewers;

/// Viewers subscribe panel by panel, in bursts over half a second to one and a half: subscriptions are complete after so long
/// without another.
pub const QUIET: Duration = Duration::from_millis(1500);
/// Longest wait at the end for viewers to read everything.
const LINGER: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(20);
/// Largest number of requests that wait for a player.
const WAITING_REQUESTS: usize = 64;

/// Parses a speed: log time per second.
///
/// # Errors
///
/// It is not a number above 0.
pub fn speed(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(speed) if speed.is_finite() && speed > 0.0 => Ok(speed),
        _ => Err("a speed is a number above 0".into()),
    }
}

/// Parses a number of seconds.
///
/// # Errors
///
/// It is not a number, or below 0.
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

/// Request of a viewer to a player.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Play, or pause.
    pub play: bool,
    /// New speed, 1 for the time of the messages.
    pub speed: Option<f64>,
    /// Time to go to \[ns\].
    pub seek: Option<u64>,
    /// Identifies the request in the answer.
    pub answer: Answer,
}

/// Viewer and name of a request, for the answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    viewer: u64,
    request: String,
}

/// State of a player.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Playback {
    /// Playing, paused or at the end.
    pub state: Playing,
    /// Its time \[ns\].
    pub time: u64,
    /// Its speed, 1 for the time of the messages.
    pub speed: f64,
}

/// Activity of a player.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Playing {
    /// Plays.
    Playing,
    /// Is paused.
    Paused,
    /// Is at the end.
    Ended,
}

/// Why an address cannot be served.
#[derive(Debug, thiserror::Error)]
#[error("cannot serve at {address}: {error}")]
pub struct ServeError {
    address: Address,
    error: io::Error,
}

/// A server that viewers connect to.
pub struct Server {
    address: Address,
    is_loopback: bool,
    viewers: Arc<Viewers>,
    requests: Mutex<Receiver<Request>>,
    acceptor: Acceptor,
}

impl Server {
    /// Opens a server.
    ///
    /// * `name`: title in viewers
    /// * `range`: first and last time \[ns\] of a recording that viewers can play, those that know playback control
    /// * `access`: who may connect
    ///
    /// # Errors
    ///
    /// The address is not available.
    pub fn open(
        address: &Address,
        name: &str,
        channels: &[Channel],
        range: Option<(u64, u64)>,
        access: Access,
    ) -> Result<Self, ServeError> {
        let failed = |error| ServeError { address: address.clone(), error };
        let listener = TcpListener::bind((address.host.as_str(), address.port)).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let local = listener.local_addr().map_err(failed)?;
        let open_at = address.bound(local);
        let (sender, requests) = sync_channel(WAITING_REQUESTS);
        let viewers = Arc::new(Viewers::new(channels.len(), range.map(|_| sender)));
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
        let session = format!("{}-{since}", process::id());
        let shared = Shared {
            admission: Admission::new(&open_at.host, access),
            viewers: Arc::clone(&viewers),
            info: [None, range].map(|range| protocol::server_info(name, &session, range)),
            greeting: protocol::advertise(channels).collect(),
        };
        let acceptor = Acceptor::start(listener, shared).map_err(failed)?;
        Ok(Self {
            address: open_at,
            is_loopback: local.ip().is_loopback(),
            viewers,
            requests: Mutex::new(requests),
            acceptor,
        })
    }

    /// Machines that can connect, in words.
    pub fn reach(&self) -> &'static str {
        if self.is_loopback { "this machine only" } else { "every machine that reaches this one" }
    }

    /// The address for viewers.
    pub fn url(&self) -> String {
        format!("ws://{}", self.address)
    }

    /// Number of viewers with a subscription.
    pub fn viewers(&self) -> usize {
        self.viewers.count()
    }

    /// True if so many viewers have subscribed, and there has been no subscription for [`QUIET`].
    pub fn is_ready(&self, viewers: usize) -> bool {
        viewers == 0 || (self.viewers() >= viewers && self.viewers.is_quiet())
    }

    /// Sends a message to the subscribers of its channel, and keeps it for later ones.
    ///
    /// * `channel`: its number in the list that the server was opened with
    /// * `log_time`: its time \[ns\]
    pub fn send(&self, channel: usize, log_time: u64, bytes: &[u8]) {
        self.viewers.update(|history| history.message(channel, log_time, bytes));
    }

    /// Sends a time \[ns\] without a message.
    pub fn send_time(&self, time: u64) {
        self.viewers.update(|history| history.time(time));
    }

    /// Ends the past of new viewers: they begin with the next message.
    pub fn reset(&self) {
        self.viewers.update(History::reset);
    }

    /// The next request of a viewer; waits for it at most `wait`.
    pub fn request(&self, wait: Duration) -> Option<Request> {
        self.requests.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(wait).ok()
    }

    /// Sends the state of the player, after the messages sent before, to viewers that know playback control.
    ///
    /// * `did_seek`: true after a jump
    /// * `answer`: the request that it answers
    pub fn send_playback(&self, playback: Playback, did_seek: bool, answer: Option<Answer>) {
        self.viewers.update(|history| history.playback(playback, did_seek, answer));
    }

    /// Waits until all viewers have left, at most `longest`, or until `is_over`.
    pub fn hold(&self, longest: Duration, is_over: impl Fn() -> bool) {
        let start = Instant::now();
        while self.viewers() > 0 && start.elapsed() < longest && !is_over() {
            thread::sleep(PAUSE);
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.viewers.end();
        let connections = self.acceptor.end();
        let start = Instant::now();
        while !self.viewers.is_empty() && start.elapsed() < LINGER {
            thread::sleep(PAUSE);
        }
        // slow or silent connections are closed
        acceptor::close(connections);
    }
}
