//! What has been sent so far: the queue of every viewer, and what newcomers are shown.
//!
//! Messages stand in one list in the order they were sent; a viewer is a [`Cursor`] in it. The newest messages, the *backlog*,
//! are all there. Of older ones
//!
//! * *series* (small messages: numbers, events, log lines) are kept from the beginning, so that a newcomer's plots are whole;
//! * *pictures* (a channel with any message above [`SERIES_MESSAGE`]) keep the last message only.
//!
//! Memory is bounded: where series outgrow their share, the channel that takes most keeps every second message, then every
//! fourth, and so on from its beginning. A viewer that reads too slowly loses what has left the list, thus pictures first.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use crate::{Playback, protocol::Frame};

/// Largest message of a series \[bytes\].
pub const SERIES_MESSAGE: usize = 4 << 10;
/// Memory of the backlog, and of the series before it \[bytes\].
const LIMITS: Limits = Limits { backlog: 32 << 20, series: 64 << 20 };
/// What an entry takes beside the bytes of its message, about \[bytes\].
const ENTRY_OVERHEAD: usize = 128;
/// Entries that one look at the list passes, and bytes that it takes along, at most.
const LOOK: usize = 4096;
const LOOK_BYTES: usize = 256 << 10;

#[derive(Clone, Copy, Debug)]
struct Limits {
    backlog: usize,
    series: usize,
}

/// An entry of the list.
#[derive(Debug)]
enum Entry {
    Message {
        channel: usize,
        log_time: u64,
        bytes: Arc<[u8]>,
    },
    Time(u64),
    /// Where the player stands; with the viewer and the name of the request that it answers.
    Playback {
        playback: Playback,
        did_seek: bool,
        answers: Option<(u64, String)>,
    },
}

impl Entry {
    fn cost(&self) -> usize {
        match self {
            Self::Message { bytes, .. } => bytes.len() + ENTRY_OVERHEAD,
            Self::Time(_) | Self::Playback { .. } => ENTRY_OVERHEAD,
        }
    }
}

/// What is kept of a channel behind the backlog.
#[derive(Debug, Default)]
struct Kept {
    is_picture: bool,
    /// Number of the newest message.
    newest: Option<u64>,
    /// Numbers of kept messages.
    numbers: Vec<u64>,
    /// Memory of them \[bytes\]; the one picture does not count.
    cost: usize,
    /// Messages that have left the backlog.
    seen: u64,
    /// One in `2^thinned` of them is kept.
    thinned: u32,
}

/// All messages that viewers may still ask for.
#[derive(Debug)]
pub struct History {
    limits: Limits,
    entries: BTreeMap<u64, Entry>,
    /// Number of the next entry.
    next: u64,
    /// Number of the entry that newcomers begin with.
    start: u64,
    backlog: VecDeque<u64>,
    backlog_cost: usize,
    channels: Vec<Kept>,
    series_cost: usize,
}

/// Where a viewer stands in the list, and what it wants of it.
#[derive(Debug)]
pub struct Cursor {
    /// The viewer.
    viewer: u64,
    /// Number of the next entry it looks at.
    next: u64,
    /// Up to this number it catches up with what others have seen: pictures are left out but the last.
    present: u64,
    /// Number of the first time or state that goes to it.
    states: u64,
    /// Subscription to a channel, and the first entry that goes to it.
    subscriptions: BTreeMap<usize, (u32, u64)>,
    /// The time it was told last \[ns\].
    clock: Option<u64>,
}

impl Cursor {
    /// Channels with their subscriptions.
    pub fn subscriptions(&self) -> impl Iterator<Item = (usize, u32)> {
        self.subscriptions.iter().map(|(channel, (id, _))| (*channel, *id))
    }

    /// Ends a subscription.
    pub fn unsubscribe(&mut self, id: u32) {
        self.subscriptions.retain(|_, (known, _)| *known != id);
    }
}

impl History {
    /// An empty history of so many channels.
    pub fn new(channels: usize) -> Self {
        Self::with_limits(channels, LIMITS)
    }

    fn with_limits(channels: usize, limits: Limits) -> Self {
        Self {
            limits,
            entries: BTreeMap::new(),
            next: 0,
            start: 0,
            backlog: VecDeque::new(),
            backlog_cost: 0,
            channels: (0..channels).map(|_| Kept::default()).collect(),
            series_cost: 0,
        }
    }

    /// Adds a message.
    pub fn message(&mut self, channel: usize, log_time: u64, bytes: &[u8]) {
        let number = self.next;
        let kept = &mut self.channels[channel];
        kept.newest = Some(number);
        if bytes.len() > SERIES_MESSAGE {
            kept.is_picture = true;
        }
        if kept.is_picture {
            // older ones are of no more use than those a slow viewer finds in the backlog
            self.drop_kept(channel);
        }
        self.push(Entry::Message { channel, log_time, bytes: bytes.into() });
    }

    /// Adds a time \[ns\] without a message; a later one takes its place as long as nothing else comes between.
    pub fn time(&mut self, time: u64) {
        if let Some(number) = self.backlog.back().copied()
            && matches!(self.entries.get(&number), Some(Entry::Time(_)))
        {
            self.backlog.pop_back();
            self.remove_from_backlog(number);
        }
        self.push(Entry::Time(time));
    }

    /// Adds the state of a player.
    ///
    /// * `answers`: the viewer and the name of its request, if it is an answer
    pub fn playback(&mut self, playback: Playback, did_seek: bool, answers: Option<(u64, String)>) {
        self.push(Entry::Playback { playback, did_seek, answers });
    }

    /// Forgets what has been sent: newcomers begin with what comes next. Viewers still get what they have not fetched.
    pub fn begin_again(&mut self) {
        for channel in 0..self.channels.len() {
            self.drop_kept(channel);
            let is_picture = self.channels[channel].is_picture;
            self.channels[channel] = Kept { is_picture, ..Kept::default() };
        }
        self.start = self.next;
    }

    fn push(&mut self, entry: Entry) {
        self.backlog_cost += entry.cost();
        self.backlog.push_back(self.next);
        self.entries.insert(self.next, entry);
        self.next += 1;
        while self.backlog_cost > self.limits.backlog
            && self.backlog.len() > 1
            && let Some(number) = self.backlog.pop_front()
        {
            self.retire(number);
        }
    }

    fn remove_from_backlog(&mut self, number: u64) {
        if let Some(entry) = self.entries.remove(&number) {
            self.backlog_cost -= entry.cost();
        }
    }

    /// Takes an entry out of the backlog, and keeps it if it belongs to what newcomers are shown.
    fn retire(&mut self, number: u64) {
        let channel = match self.entries.get(&number) {
            Some(Entry::Message { channel, .. }) if number >= self.start => *channel,
            _ => return self.remove_from_backlog(number),
        };
        let kept = &mut self.channels[channel];
        let is_due = kept.seen.is_multiple_of(1 << kept.thinned);
        kept.seen += 1;
        let is_kept = if kept.is_picture { kept.newest == Some(number) } else { is_due };
        if !is_kept {
            return self.remove_from_backlog(number);
        }
        let cost = self.entries[&number].cost();
        kept.numbers.push(number);
        self.backlog_cost -= cost;
        if kept.is_picture {
            return;
        }
        kept.cost += cost;
        self.series_cost += cost;
        while self.series_cost > self.limits.series && self.thin() {}
    }

    /// Keeps every second message of the channel that takes most; false if there is none to thin out.
    fn thin(&mut self) -> bool {
        let many = |kept: &&mut Kept| kept.numbers.len() > 1;
        let Some(kept) = self.channels.iter_mut().filter(many).max_by_key(|kept| kept.cost) else {
            return false;
        };
        let (mut even, mut cost) = (Vec::with_capacity(kept.numbers.len() / 2 + 1), 0);
        for (i, number) in kept.numbers.drain(..).enumerate() {
            if i % 2 == 0 {
                cost += self.entries[&number].cost();
                even.push(number);
            } else {
                self.entries.remove(&number);
            }
        }
        self.series_cost -= kept.cost - cost;
        (kept.numbers, kept.cost) = (even, cost);
        kept.thinned += 1;
        true
    }

    /// Lets go of what is kept of a channel behind the backlog.
    fn drop_kept(&mut self, channel: usize) {
        let kept = &mut self.channels[channel];
        for number in kept.numbers.drain(..) {
            self.entries.remove(&number);
        }
        self.series_cost -= std::mem::take(&mut kept.cost);
    }

    /// A viewer that has just come.
    pub fn cursor(&self, viewer: u64) -> Cursor {
        Cursor {
            viewer,
            next: self.next,
            present: self.next,
            states: self.next,
            subscriptions: BTreeMap::new(),
            clock: None,
        }
    }

    /// Subscribes a viewer to channels, of which it gets the history first.
    ///
    /// A viewer puts a message at the time it was told last, and forgets what it has when time goes back. So if the history
    /// begins before its time, it is told the whole history of all its channels anew. Returns the time it goes back to.
    pub fn subscribe(
        &self,
        cursor: &mut Cursor,
        subscriptions: impl IntoIterator<Item = (usize, u32)>,
    ) -> Option<u64> {
        let new: BTreeMap<usize, u32> = subscriptions.into_iter().collect();
        let begin = self.start.min(cursor.next);
        let mut missed = self.entries.range(begin..cursor.next).filter_map(|(_, entry)| match entry {
            Entry::Message { channel, log_time, .. } if new.contains_key(channel) => Some(*log_time),
            _ => None,
        });
        let back = missed.next().filter(|time| cursor.clock.is_some_and(|clock| *time < clock));
        for (_, from) in cursor.subscriptions.values_mut() {
            *from = if back.is_some() { begin } else { cursor.next.max(*from) };
        }
        cursor.subscriptions.extend(new.into_iter().map(|(channel, id)| (channel, (id, self.start))));
        cursor.states = cursor.next;
        cursor.next = begin;
        cursor.present = self.next;
        back
    }

    /// True if a viewer has been given all there is.
    pub fn is_at_end(&self, cursor: &Cursor) -> bool {
        cursor.next == self.next
    }

    /// Appends what comes next for a viewer, a limited amount of it: every message after its time.
    pub fn read(&self, cursor: &mut Cursor, frames: &mut Vec<Frame>) {
        let mut bytes = 0;
        for (number, entry) in self.entries.range(cursor.next..).take(LOOK) {
            if bytes > LOOK_BYTES {
                return;
            }
            cursor.next = number + 1;
            match entry {
                Entry::Message { channel, log_time, bytes: content } => {
                    let Some((id, from)) = cursor.subscriptions.get(channel) else { continue };
                    let kept = &self.channels[*channel];
                    let is_old_picture =
                        *number < cursor.present && kept.is_picture && kept.newest != Some(*number);
                    if number < from || is_old_picture {
                        continue;
                    }
                    if cursor.clock.replace(*log_time) != Some(*log_time) {
                        frames.push(Frame::Time(*log_time));
                    }
                    bytes += content.len() + ENTRY_OVERHEAD;
                    let content = Arc::clone(content);
                    frames.push(Frame::Message { subscription: *id, log_time: *log_time, content });
                }
                _ if *number < cursor.states => {}
                Entry::Time(time) => {
                    if cursor.clock.replace(*time) != Some(*time) {
                        frames.push(Frame::Time(*time));
                    }
                }
                Entry::Playback { playback, did_seek, answers } => {
                    let request = answers.as_ref().filter(|(viewer, _)| *viewer == cursor.viewer);
                    frames.push(Frame::Playback {
                        playback: *playback,
                        did_seek: *did_seek,
                        request: request.map(|(_, name)| name.clone()),
                    });
                }
            }
        }
        if self.entries.range(cursor.next..).next().is_none() {
            cursor.next = self.next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Log times by subscription of everything a cursor finds, and the times it is told.
    fn read(history: &History, cursor: &mut Cursor) -> (BTreeMap<u32, Vec<u64>>, Vec<u64>) {
        let (mut messages, mut times, mut clock) = (BTreeMap::<u32, Vec<u64>>::new(), Vec::new(), None);
        while !history.is_at_end(cursor) {
            let mut frames = Vec::new();
            history.read(cursor, &mut frames);
            for frame in frames {
                match frame {
                    Frame::Time(time) => {
                        clock = Some(time);
                        times.push(time);
                    }
                    Frame::Message { subscription, log_time, .. } => {
                        assert_eq!(clock, Some(log_time), "a message comes after its time");
                        messages.entry(subscription).or_default().push(log_time);
                    }
                    Frame::Playback { .. } => {}
                }
            }
        }
        (messages, times)
    }

    const PICTURE: [u8; SERIES_MESSAGE + 1] = [0; SERIES_MESSAGE + 1];

    fn run(history: &mut History, steps: std::ops::Range<u64>) {
        for step in steps {
            history.message(0, step, &[0; 40]);
            if step.is_multiple_of(10) {
                history.message(1, step, &PICTURE);
            }
        }
    }

    #[test]
    fn newcomers_get_series_whole_and_the_last_picture() {
        let mut history = History::new(2);
        run(&mut history, 0..301);
        let mut cursor = history.cursor(0);
        assert_eq!(history.subscribe(&mut cursor, [(0, 7), (1, 8)]), None);
        let (messages, times) = read(&history, &mut cursor);
        assert_eq!(messages[&7], (0..301).collect::<Vec<u64>>());
        assert_eq!(messages[&8], [300]);
        assert!(times.is_sorted());
        // from there on it gets everything
        run(&mut history, 301..321);
        let (messages, _) = read(&history, &mut cursor);
        assert_eq!((messages[&7].len(), &messages[&8]), (20, &vec![310, 320]));
    }

    #[test]
    fn a_later_subscription_takes_all_of_them_back() {
        let mut history = History::new(3);
        run(&mut history, 0..50);
        history.message(2, 3, b"an event, written late");
        let mut cursor = history.cursor(0);
        history.subscribe(&mut cursor, [(0, 7)]);
        assert_eq!(read(&history, &mut cursor).0[&7].len(), 50);
        assert_eq!(history.subscribe(&mut cursor, [(1, 8)]), Some(0));
        let (messages, times) = read(&history, &mut cursor);
        assert_eq!((messages[&7].len(), messages[&8].len()), (50, 1));
        assert_eq!(times.first(), Some(&0), "time goes back: what the viewer has gives way");
    }

    #[test]
    fn a_subscription_without_a_past_takes_nothing_back() {
        let mut history = History::new(3);
        let mut cursor = history.cursor(0);
        history.subscribe(&mut cursor, [(0, 7)]);
        run(&mut history, 0..50);
        read(&history, &mut cursor);
        assert_eq!(history.subscribe(&mut cursor, [(2, 9)]), None);
        run(&mut history, 50..60);
        history.message(2, 60, b"an event");
        let (messages, _) = read(&history, &mut cursor);
        assert_eq!((messages[&7].len(), messages[&9].len()), (10, 1));
    }

    #[test]
    fn memory_is_bounded_and_series_are_thinned_evenly() {
        let limits = Limits { backlog: 100_000, series: 100_000 };
        let mut history = History::with_limits(4, limits);
        history.message(2, 0, b"the run begins");
        history.message(3, 0, &PICTURE);
        let old_picture = PICTURE.len() + ENTRY_OVERHEAD;
        for step in 0..100_000 {
            history.message(0, step, &[0; 40]);
            if step.is_multiple_of(10) {
                history.message(1, step, &PICTURE);
            }
            if !step.is_multiple_of(97) {
                continue;
            }
            let cost: usize = history.entries.values().map(Entry::cost).sum();
            assert!([0, old_picture].contains(&(cost - history.backlog_cost - history.series_cost)));
            assert!(cost <= limits.backlog + limits.series + old_picture, "{cost}");
        }
        let mut cursor = history.cursor(0);
        history.subscribe(&mut cursor, [(0, 7), (1, 8), (2, 9), (3, 10)]);
        let (messages, times) = read(&history, &mut cursor);
        assert_eq!((&messages[&8], &messages[&9], &messages[&10]), (&vec![99_990], &vec![0], &vec![0]));
        assert!(times.is_sorted());
        let drag = &messages[&7];
        assert_eq!((drag.first(), drag.last()), (Some(&0), Some(&99_999)));
        let gap = drag[1] - drag[0];
        assert!(gap.is_power_of_two() && (256..1024).contains(&gap), "{gap}");
        let even = drag.windows(2).take_while(|pair| pair[1] - pair[0] == gap).count();
        assert!(even > 150, "the same distance up to the backlog: {even}");
    }

    #[test]
    fn who_begins_again_shows_newcomers_nothing_of_before() {
        let mut history = History::new(2);
        let mut old = history.cursor(0);
        history.subscribe(&mut old, [(0, 7)]);
        run(&mut history, 0..20);
        history.begin_again();
        run(&mut history, 0..5);
        assert_eq!(read(&history, &mut old).0[&7].len(), 25, "who was there gets both");
        let mut new = history.cursor(1);
        history.subscribe(&mut new, [(0, 7), (1, 8)]);
        let (messages, _) = read(&history, &mut new);
        assert_eq!((messages[&7].len(), messages[&8].len()), (5, 1));
    }

    #[test]
    fn times_without_messages_replace_each_other() {
        let mut history = History::new(1);
        let mut cursor = history.cursor(0);
        history.subscribe(&mut cursor, [(0, 7)]);
        history.message(0, 1, b"x");
        (2..1000).for_each(|time| history.time(time));
        assert_eq!(history.entries.len(), 2);
        assert_eq!(read(&history, &mut cursor).1, [1, 999]);
        // at the end of the list already: the next time is a new entry
        history.time(1001);
        assert_eq!(read(&history, &mut cursor).1, [1001]);
    }
}
