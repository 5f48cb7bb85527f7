//! Sends messages to viewers over the Foxglove WebSocket protocol, for live runs (`percuss run --live`) and replays
//! (`percuss-read replay`).
//!
//! Knows topics, schemas and bytes, nothing of physics or files. Sending never waits: every viewer has a queue of its own,
//! and one that is too slow loses the oldest messages in it.

use std::{
    collections::{BTreeMap, HashMap},
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        mpsc::{Receiver, Sender, channel},
    },
    thread,
    time::{Duration, Instant},
};

use foxglove::{
    ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema, WebSocketServer,
    WebSocketServerHandle,
    websocket::{
        Capability, ChannelView, Client, PlaybackCommand, PlaybackControlRequest, PlaybackState,
        PlaybackStatus, ServerListener,
    },
};

mod address;

pub use address::{Address, AddressError};

/// Messages that may wait for a viewer; then the oldest are dropped.
const BACKLOG: usize = 1024;
/// Shortest distance between two messages that tell viewers the time: a viewer that does not read for `BACKLOG` of these
/// is disconnected.
const TICK: Duration = Duration::from_millis(5);
/// How long the end waits for viewers to fetch what is under way.
const LINGER: Duration = Duration::from_secs(3);
const PAUSE: Duration = Duration::from_millis(20);

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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Request {
    /// Play, or stand still.
    pub play: bool,
    /// Speed, 1 for the time of the messages.
    pub speed: f64,
    /// Time to go to \[ns\].
    pub seek: Option<u64>,
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
    error: FoxgloveError,
}

/// What viewers have told the server.
#[derive(Default)]
struct Audience {
    /// Number of subscriptions of every viewer that has any.
    subscriptions: HashMap<u32, usize>,
    /// Number of subscriptions ever.
    arrivals: u64,
    playback: Option<Playback>,
}

struct Listener {
    audience: Arc<Mutex<Audience>>,
    requests: Mutex<Sender<Request>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl ServerListener for Listener {
    fn on_subscribe(&self, client: Client, _channel: ChannelView) {
        let mut audience = lock(&self.audience);
        *audience.subscriptions.entry(client.id().into()).or_default() += 1;
        audience.arrivals += 1;
    }

    fn on_unsubscribe(&self, client: Client, _channel: ChannelView) {
        let mut audience = lock(&self.audience);
        let id = client.id().into();
        if let Some(count) = audience.subscriptions.get_mut(&id) {
            *count -= 1;
            if *count == 0 {
                audience.subscriptions.remove(&id);
            }
        }
    }

    fn on_playback_control_request(&self, request: PlaybackControlRequest) -> Option<PlaybackState> {
        let mut audience = lock(&self.audience);
        let playback = audience.playback.as_mut()?;
        let speed = f64::from(request.playback_speed);
        if speed.is_finite() && speed > 0.0 {
            playback.speed = speed;
        }
        let play = request.playback_command == PlaybackCommand::Play;
        playback.state = if play { Playing::Playing } else { Playing::Paused };
        playback.time = request.seek_time.unwrap_or(playback.time);
        let asked = Request { play, speed: playback.speed, seek: request.seek_time };
        // if the player is gone there is nobody left to ask
        let _ = lock(&self.requests).send(asked);
        Some(state(playback, request.seek_time.is_some(), Some(request.request_id)))
    }
}

fn state(playback: &Playback, did_seek: bool, request_id: Option<String>) -> PlaybackState {
    PlaybackState {
        status: match playback.state {
            Playing::Playing => PlaybackStatus::Playing,
            Playing::Paused => PlaybackStatus::Paused,
            Playing::Ended => PlaybackStatus::Ended,
        },
        current_time: playback.time,
        playback_speed: playback.speed as f32,
        did_seek,
        request_id,
    }
}

/// A server that viewers connect to.
pub struct Server {
    handle: Option<WebSocketServerHandle>,
    /// Keeps the channels advertised: the server does not.
    _context: Arc<Context>,
    host: String,
    channels: Vec<Arc<RawChannel>>,
    audience: Arc<Mutex<Audience>>,
    requests: Mutex<Receiver<Request>>,
    told: Mutex<Told>,
}

/// What time viewers were told last, and when.
#[derive(Default)]
struct Told {
    time: u64,
    at: Option<Instant>,
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
        let context = Context::new();
        let (sender, requests) = channel();
        let audience = Arc::new(Mutex::new(Audience::default()));
        if let Some((start, _)) = range {
            lock(&audience).playback = Some(Playback { state: Playing::Playing, time: start, speed: 1.0 });
        }
        let build = |channel: &Channel| {
            let schema = channel.schema.clone();
            ChannelBuilder::new(&channel.topic)
                .context(&context)
                .message_encoding(&channel.encoding)
                .schema(schema.map(|(name, encoding, data)| Schema::new(name, encoding, data)))
                .metadata(channel.metadata.clone())
                .build_raw()
        };
        let channels = channels.iter().map(build).collect::<Result<_, _>>().map_err(failed)?;
        let mut server = WebSocketServer::new()
            .context(&context)
            .bind(&address.host, address.port)
            .name(name)
            .capabilities([Capability::Time])
            .message_backlog_size(BACKLOG)
            .listener(Arc::new(Listener { audience: Arc::clone(&audience), requests: Mutex::new(sender) }));
        if let Some((start, end)) = range {
            server = server.playback_time_range(start, end);
        }
        let handle = server.start_blocking().map_err(failed)?;
        Ok(Self {
            handle: Some(handle),
            _context: context,
            host: address.host.clone(),
            channels,
            audience,
            requests: Mutex::new(requests),
            told: Mutex::default(),
        })
    }

    /// The address for viewers.
    pub fn url(&self) -> String {
        let port = self.handle.as_ref().map_or(0, WebSocketServerHandle::port);
        if self.host.contains(':') {
            format!("ws://[{}]:{port}", self.host)
        } else {
            format!("ws://{}:{port}", self.host)
        }
    }

    /// Number of viewers that have subscribed to something.
    pub fn viewers(&self) -> usize {
        lock(&self.audience).subscriptions.len()
    }

    /// Number of subscriptions there have ever been.
    pub fn arrivals(&self) -> u64 {
        lock(&self.audience).arrivals
    }

    /// Sends a message to those who have subscribed to its channel.
    ///
    /// * `channel`: its number in the list that the server was opened with
    /// * `log_time`: its time \[ns\]
    pub fn send(&self, channel: usize, log_time: u64, bytes: &[u8]) {
        self.tell_time(log_time);
        self.channels[channel].log_with_meta(bytes, PartialMetadata::with_log_time(log_time));
    }

    /// Tells viewers the time \[ns\], unless they were told just now.
    pub fn tell_time(&self, time: u64) {
        let mut told = lock(&self.told);
        let is_due = told.at.is_none_or(|at| time != told.time && at.elapsed() >= TICK);
        if let Some(handle) = self.handle.as_ref().filter(|_| is_due) {
            handle.broadcast_time(time);
            *told = Told { time, at: Some(Instant::now()) };
        }
    }

    /// What viewers have asked for; waits for it until then.
    pub fn request(&self, wait: Duration) -> Option<Request> {
        lock(&self.requests).recv_timeout(wait).ok()
    }

    /// Tells viewers where the player stands.
    ///
    /// * `did_seek`: it has jumped there
    pub fn tell_playback(&self, playback: Playback, did_seek: bool) {
        lock(&self.audience).playback = Some(playback);
        if let Some(handle) = &self.handle {
            handle.broadcast_playback_state(state(&playback, did_seek, None));
        }
    }

    /// Notes where the player stands, for viewers that ask.
    pub fn note_playback(&self, playback: Playback) {
        lock(&self.audience).playback = Some(playback);
    }

    /// Gives viewers a while to fetch what is under way, before the end.
    pub fn linger(&self) {
        let start = Instant::now();
        while self.viewers() > 0 && start.elapsed() < LINGER {
            thread::sleep(PAUSE);
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        if let Some(handle) = self.handle.take() {
            handle.stop().wait_blocking();
        }
    }
}
