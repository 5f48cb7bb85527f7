//! The viewers of a server: their subscriptions and next frames.

use std::{
    collections::{BTreeSet, HashMap, VecDeque},
    sync::{
        Condvar, Mutex, MutexGuard, PoisonError,
        mpsc::{SyncSender, TrySendError},
    },
    time::{Duration, Instant},
};

use tungstenite::Message;

use crate::{
    Playback, QUIET, Request,
    history::{Cursor, History},
    protocol::{Frame, Subscription},
};

/// Subscriptions of a viewer that come closer together than this are answered as one.
const BURST: Duration = Duration::from_millis(100);
/// Largest number of waiting answers to a viewer; further requests get none.
const ANSWERS: usize = 64;
/// Largest number of viewers.
pub const VIEWERS: usize = 16;

pub struct Viewers {
    state: Mutex<State>,
    /// Signals an entry or a request.
    changed: Condvar,
    requests: Option<SyncSender<Request>>,
}

struct State {
    history: History,
    channels: usize,
    viewers: HashMap<u64, Viewer>,
    /// Places taken: by viewers, and by connections that are about to close.
    places: usize,
    next: u64,
    subscribed: Option<Instant>,
    is_ending: bool,
}

struct Viewer {
    cursor: Cursor,
    /// Subscriptions that wait for the end of their burst, and the time of the last.
    wanted: Vec<(usize, u32)>,
    wanted_at: Instant,
    answers: VecDeque<Message>,
}

/// The next output to a viewer.
pub enum Next {
    Answers(VecDeque<Message>),
    /// Frames, in the list of the caller.
    Frames,
    /// The end: it has left, or the server ends and it has read everything.
    End,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Viewers {
    /// No viewers yet.
    ///
    /// * `channels`: number of channels
    /// * `requests`: where requests to the player go, if there is one
    pub fn new(channels: usize, requests: Option<SyncSender<Request>>) -> Self {
        Self {
            state: Mutex::new(State {
                history: History::new(channels),
                channels,
                viewers: HashMap::new(),
                places: 0,
                next: 0,
                subscribed: None,
                is_ending: false,
            }),
            changed: Condvar::new(),
            requests,
        }
    }

    /// Adds a viewer and returns its id, unless all [`VIEWERS`] places are taken.
    pub fn enter(&self) -> Option<u64> {
        let mut state = lock(&self.state);
        if state.places >= VIEWERS || state.is_ending {
            return None;
        }
        state.places += 1;
        let id = state.next;
        state.next += 1;
        let cursor = state.history.cursor(id);
        let viewer =
            Viewer { cursor, wanted: Vec::new(), wanted_at: Instant::now(), answers: VecDeque::new() };
        state.viewers.insert(id, viewer);
        Some(id)
    }

    pub fn leave(&self, id: u64) {
        lock(&self.state).viewers.remove(&id);
        self.changed.notify_all();
    }

    /// Gives back the place of a viewer that has left.
    pub fn free(&self) {
        lock(&self.state).places -= 1;
    }

    /// Subscribes a viewer to channels.
    ///
    /// # Errors
    ///
    /// The last of them that is impossible; the others count.
    pub fn subscribe(&self, id: u64, wanted: Vec<Subscription>) -> Result<(), String> {
        let mut state = lock(&self.state);
        let channels = state.channels;
        state.subscribed = Some(Instant::now());
        let Some(viewer) = state.viewers.get_mut(&id) else { return Ok(()) };
        let mut outcome = Ok(());
        let known = viewer.cursor.subscriptions().chain(viewer.wanted.iter().copied());
        let (mut used, mut names): (BTreeSet<usize>, BTreeSet<u32>) = known.unzip();
        for Subscription { id: name, channel_id } in wanted {
            let Some(channel) = channel_id.checked_sub(1).filter(|channel| *channel < channels) else {
                outcome = Err(format!("there is no channel {channel_id}"));
                continue;
            };
            if used.contains(&channel) || names.contains(&name) {
                outcome = Err(format!(
                    "subscription {name} to channel {channel_id}: one of the two is in use already"
                ));
                continue;
            }
            used.insert(channel);
            names.insert(name);
            viewer.wanted.push((channel, name));
            viewer.wanted_at = Instant::now();
        }
        self.changed.notify_all();
        outcome
    }

    pub fn unsubscribe(&self, id: u64, subscriptions: &BTreeSet<u32>) {
        if let Some(viewer) = lock(&self.state).viewers.get_mut(&id) {
            viewer.wanted.retain(|(_, name)| !subscriptions.contains(name));
            viewer.cursor.unsubscribe(subscriptions);
        }
    }

    /// Sends an answer to a viewer, before its frames.
    pub fn answer(&self, id: u64, message: Message) {
        if let Some(viewer) = lock(&self.state).viewers.get_mut(&id)
            && viewer.answers.len() < ANSWERS
        {
            viewer.answers.push_back(message);
            self.changed.notify_all();
        }
    }

    /// Passes the request of a viewer to the player.
    ///
    /// # Errors
    ///
    /// There is no player, or too many requests wait for it.
    pub fn request(&self, request: Request) -> Result<(), String> {
        let Some(requests) = &self.requests else { return Err("this server has no playback control".into()) };
        match requests.try_send(request) {
            Err(TrySendError::Full(_)) => Err("too many requests of playback control at once".into()),
            Ok(()) | Err(TrySendError::Disconnected(_)) => Ok(()),
        }
    }

    /// Number of viewers with a subscription.
    pub fn count(&self) -> usize {
        let has_any =
            |viewer: &&Viewer| !viewer.wanted.is_empty() || viewer.cursor.subscriptions().next().is_some();
        lock(&self.state).viewers.values().filter(has_any).count()
    }

    /// True if there has been no subscription for [`QUIET`].
    pub fn is_quiet(&self) -> bool {
        lock(&self.state).subscribed.is_none_or(|at| at.elapsed() >= QUIET)
    }

    /// True if there are no viewers, with or without subscriptions.
    pub fn is_empty(&self) -> bool {
        lock(&self.state).viewers.is_empty()
    }

    /// Adds to the history, and wakes all viewers.
    pub fn update(&self, change: impl FnOnce(&mut History)) {
        change(&mut lock(&self.state).history);
        self.changed.notify_all();
    }

    /// Ends the server: viewers get the end when they have read everything.
    pub fn end(&self) {
        lock(&self.state).is_ending = true;
        self.changed.notify_all();
    }

    /// Waits for the next frames or answers of a viewer.
    ///
    /// * `frames`: an empty list for the frames
    pub fn next(&self, id: u64, frames: &mut Vec<Frame>) -> Next {
        let mut guard = lock(&self.state);
        loop {
            let State { history, viewers, is_ending, .. } = &mut *guard;
            let Some(viewer) = viewers.get_mut(&id) else { return Next::End };
            if !viewer.answers.is_empty() {
                return Next::Answers(std::mem::take(&mut viewer.answers));
            }
            let age = viewer.wanted_at.elapsed();
            let mut rest = None;
            if !viewer.wanted.is_empty() {
                if age >= BURST || *is_ending {
                    let back = history.subscribe(&mut viewer.cursor, viewer.wanted.drain(..));
                    if let (Some(time), Some(playback)) = (back, history.player()) {
                        let playback = Playback { time, ..playback };
                        frames.push(Frame::Playback { playback, did_seek: true, request: None });
                    }
                } else {
                    rest = Some(BURST - age);
                }
            }
            history.read(&mut viewer.cursor, frames);
            if !frames.is_empty() {
                return Next::Frames;
            }
            if !history.is_at_end(&viewer.cursor) {
                // many entries of other viewers' channels: release the lock in between
                drop(guard);
                guard = lock(&self.state);
                continue;
            }
            guard = match rest {
                Some(rest) => {
                    let waited = self.changed.wait_timeout(guard, rest);
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
                None if *is_ending => return Next::End,
                None => self.changed.wait(guard).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }
}
