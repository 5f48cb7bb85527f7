//! Live runs: recorded messages are also served to viewers, and the run can be paced for a person to follow.
//!
//! The messages are tapped on the writer thread: the run computes the same numbers and the file gets the same bytes with or
//! without viewers.

use std::{
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use percuss_serve::{Access, Address, Channel, ServeError, Server};

use crate::recording::{ChannelSpec, Tap};

/// Longest sleep between two checks for signals.
const NAP: Duration = Duration::from_millis(50);

impl Tap for Arc<Server> {
    fn message(&mut self, channel: usize, log_time: u64, bytes: &[u8]) {
        self.send(channel, log_time, bytes);
    }
}

/// Opens a server of the messages of a run on `channels`.
///
/// * `access`: who may connect
pub fn open(
    address: &Address,
    title: &str,
    channels: Vec<ChannelSpec>,
    access: Access,
) -> Result<Arc<Server>, ServeError> {
    let channel = |spec: ChannelSpec| Channel {
        topic: spec.topic,
        encoding: "protobuf".into(),
        schema: Some((spec.schema, "protobuf".into(), spec.descriptors)),
        metadata: spec.metadata,
    };
    let channels: Vec<Channel> = channels.into_iter().map(channel).collect();
    Server::open(address, &format!("percuss: {title}"), &channels, None, access).map(Arc::new)
}

/// Waits until so many viewers have subscribed, or `is_over`. Viewers subscribe panel by panel: their subscriptions are
/// complete when none has come for [`percuss_serve::QUIET`].
pub fn wait_for(server: &Server, viewers: usize, is_over: impl Fn() -> bool) {
    while !server.is_ready(viewers) && !is_over() {
        thread::sleep(NAP);
    }
}

#[derive(Debug)]
pub struct Pace {
    /// Log time per second.
    speed: f64,
    /// When the clock was started, and the log time then \[ns\].
    start: Option<(Instant, u64)>,
}

impl Pace {
    /// A pace of `speed` seconds of log time per second.
    pub fn new(speed: f64) -> Self {
        Self { speed, start: None }
    }

    /// Sleeps until it is time for a log time \[ns\], or `is_over`. The first call starts the clock at its log time, which is not 0 where a
    /// run continues.
    pub fn keep(&mut self, log_time: u64, is_over: impl Fn() -> bool) {
        let (start, first) = *self.start.get_or_insert_with(|| (Instant::now(), log_time));
        let log_time = log_time.saturating_sub(first);
        let due = Duration::try_from_secs_f64(log_time as f64 * 1e-9 / self.speed).unwrap_or(Duration::MAX);
        while !is_over() {
            match due.checked_sub(start.elapsed()) {
                Some(rest) if rest > Duration::ZERO => thread::sleep(rest.min(NAP)),
                _ => break,
            }
        }
    }
}
