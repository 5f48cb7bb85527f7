//! The messages sent so far: the queue of every viewer, and the past for new viewers.
//!
//! Messages are in one list in the order in which they were sent; a viewer is a [`Cursor`] in it. The list has all of the newest
//! messages, the *backlog*. Of older ones
//!
//! * *series* (small messages: numbers, events, log lines) are kept from the beginning, so that the plots of a new viewer are
//!   complete;
//! * *pictures* (a channel with any message above [`SERIES_MESSAGE`]) keep the last message only.
//!
//! Memory is bounded: above the limit of series the largest channel is downsampled to every second message, then every fourth,
//! and so on from its beginning. A viewer that reads too slowly loses messages that have left the list, thus pictures first.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::Arc,
};

use crate::{Answer, Playback};

mod cursor;

pub use cursor::Cursor;

/// Largest message of a series \[bytes\].
pub const SERIES_MESSAGE: usize = 4 << 10;
/// Memory of the backlog, and of the series before it \[bytes\].
const LIMITS: Limits = Limits { backlog: 32 << 20, series: 64 << 20 };
/// Approximate memory of an entry without the bytes of its message \[bytes\].
const ENTRY_OVERHEAD: usize = 128;

#[derive(Clone, Copy, Debug)]
struct Limits {
    backlog: usize,
    series: usize,
}

#[derive(Debug)]
enum Entry {
    Message {
        channel: usize,
        log_time: u64,
        bytes: Arc<[u8]>,
    },
    Time(u64),
    /// State of the player, and the request that it answers.
    Playback {
        playback: Playback,
        did_seek: bool,
        answers: Option<Answer>,
    },
}

impl Entry {
    fn cost(&self) -> usize {
        match self {
            Self::Message { bytes, .. } => bytes.len() + ENTRY_OVERHEAD,
            Self::Time(_) => ENTRY_OVERHEAD,
            Self::Playback { answers, .. } => {
                ENTRY_OVERHEAD + answers.as_ref().map_or(0, |answer| answer.request.len())
            }
        }
    }
}

/// Messages of a channel that are kept after they have left the backlog.
#[derive(Debug, Default)]
struct Kept {
    is_picture: bool,
    newest: Option<u64>,
    /// Numbers of kept messages.
    numbers: Vec<u64>,
    /// Memory of them \[bytes\], without the one picture.
    cost: usize,
    /// Messages that have left the backlog.
    seen: u64,
    /// One in `2^halvings` of them is kept.
    halvings: u32,
}

/// All messages that viewers can still get.
#[derive(Debug)]
pub struct History {
    limits: Limits,
    entries: BTreeMap<u64, Entry>,
    next: u64,
    /// Number of the first entry for new viewers.
    start: u64,
    backlog: VecDeque<u64>,
    backlog_cost: usize,
    channels: Vec<Kept>,
    series_cost: usize,
    player: Option<Playback>,
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
            player: None,
        }
    }

    pub fn message(&mut self, channel: usize, log_time: u64, bytes: &[u8]) {
        let number = self.next;
        let kept = &mut self.channels[channel];
        kept.newest = Some(number);
        if bytes.len() > SERIES_MESSAGE {
            kept.is_picture = true;
        }
        if kept.is_picture {
            // only the last picture is kept after it has left the backlog
            self.drop_kept(channel);
        }
        self.push(Entry::Message { channel, log_time, bytes: bytes.into() });
    }

    /// Adds a time \[ns\] without a message, which replaces one at the end of the list.
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
    /// * `answers`: the request that it answers
    pub fn playback(&mut self, playback: Playback, did_seek: bool, answers: Option<Answer>) {
        self.player = Some(playback);
        self.push(Entry::Playback { playback, did_seek, answers });
    }

    pub fn player(&self) -> Option<Playback> {
        self.player
    }

    /// Ends the past of new viewers: they begin with the next entry. Viewers still get what they have not read.
    pub fn reset(&mut self) {
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

    /// Takes an entry out of the backlog, and keeps it if it belongs to the past of new viewers.
    fn retire(&mut self, number: u64) {
        let channel = match self.entries.get(&number) {
            Some(Entry::Message { channel, .. }) if number >= self.start => *channel,
            _ => return self.remove_from_backlog(number),
        };
        let kept = &mut self.channels[channel];
        let is_due = kept.seen.is_multiple_of(1 << kept.halvings);
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
        while self.series_cost > self.limits.series && self.downsample() {}
    }

    /// Keeps every second message of the largest channel; false if no channel has more than one.
    fn downsample(&mut self) -> bool {
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
        kept.halvings += 1;
        true
    }

    fn drop_kept(&mut self, channel: usize) {
        let kept = &mut self.channels[channel];
        for number in kept.numbers.drain(..) {
            self.entries.remove(&number);
        }
        self.series_cost -= std::mem::take(&mut kept.cost);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Frame;

    /// Log times by subscription of everything that a cursor reads, and the times sent to it.
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
    fn a_subscription_without_a_past_repeats_nothing() {
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
    fn memory_is_bounded_and_series_are_downsampled_evenly() {
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
    fn a_reset_ends_the_past_of_new_viewers() {
        let mut history = History::new(2);
        let mut old = history.cursor(0);
        history.subscribe(&mut old, [(0, 7)]);
        run(&mut history, 0..20);
        history.reset();
        run(&mut history, 0..5);
        assert_eq!(read(&history, &mut old).0[&7].len(), 25, "a viewer from before gets both");
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
        // read already: the next time is a new entry
        history.time(1001);
        assert_eq!(read(&history, &mut cursor).1, [1001]);
    }

    #[test]
    fn new_viewers_get_complete_series_and_the_last_picture() {
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
    fn a_later_subscription_repeats_the_past_of_all() {
        let mut history = History::new(3);
        run(&mut history, 0..50);
        history.message(2, 3, b"an event, written late");
        let mut cursor = history.cursor(0);
        history.subscribe(&mut cursor, [(0, 7)]);
        assert_eq!(read(&history, &mut cursor).0[&7].len(), 50);
        assert_eq!(history.subscribe(&mut cursor, [(1, 8)]), Some(0));
        let (messages, times) = read(&history, &mut cursor);
        assert_eq!((messages[&7].len(), messages[&8].len()), (50, 1));
        assert_eq!(times.first(), Some(&0), "time goes back: the viewer drops what it has");
    }
}
