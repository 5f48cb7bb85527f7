//! One reading of a recording for all who look at its messages.
//!
//! Observers register for the messages of a channel. Every chunk is read once, and every message that anyone looks at is decoded
//! once; what observers keep comes out of one budget.

use std::collections::{BTreeMap, BTreeSet};

pub use crate::messages::Seen;
use crate::{
    failure::Failure,
    instant::Instant,
    messages::{Decoded, Kept, Message, Next, Recording, TakeRecord},
    recording::{Budget, FileRecord},
    select::Window,
    wire::Values,
};

/// A decoded message.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Time, of the field `time` or the log time in seconds.
    pub time: f64,
    /// Log time \[ns\].
    pub log_time: u64,
    /// Its number among those of its channel in the window, from 0.
    pub number: u64,
    /// The message.
    pub values: Values,
}

/// Which messages of a channel are looked at.
enum Choice {
    /// Every n-th, and the last.
    Every(u64),
    Numbers(BTreeSet<u64>),
}

impl Choice {
    /// * `is_last`: asked once more of the last message, if it was not looked at
    fn holds(&self, number: u64, is_last: bool) -> bool {
        match self {
            Self::Every(every) => number.is_multiple_of(*every) != is_last,
            Self::Numbers(numbers) => !is_last && numbers.contains(&number),
        }
    }
}

/// What is made of a message, with the memory that is left for what is kept of it.
type Take<'a> = Box<dyn FnMut(&Moment, &mut Budget) -> Result<(), Failure> + 'a>;

/// What is made of a message that is not decoded.
type TakeBytes<'a> = Box<dyn FnMut(Message<'_>, Instant, &mut Budget) -> Result<(), Failure> + 'a>;

/// Who looks at a channel.
struct Watched<'a> {
    bytes: Vec<TakeBytes<'a>>,
    observers: Vec<(Choice, Take<'a>)>,
    moment: Moment,
    /// Messages so far.
    count: u64,
    /// The last message, if not all who look at the last have seen it.
    last: Option<Kept>,
}

/// One reading of a recording.
pub struct Pass<'a> {
    recording: &'a Recording,
    window: Window,
    channels: BTreeMap<u16, Watched<'a>>,
    records: Option<TakeRecord<'a>>,
    budget: Budget,
}

impl<'a> Pass<'a> {
    /// * `window`: times that are looked at, and every n-th of their messages
    pub fn over(recording: &'a Recording, window: Window) -> Self {
        let budget = Budget::new(recording.limits().kept());
        Self { recording, window, channels: BTreeMap::new(), records: None, budget }
    }

    /// The same with other memory for what is kept \[bytes\].
    pub(crate) fn keeping(self, bytes: usize) -> Self {
        Self { budget: Budget::new(bytes), ..self }
    }

    fn watched(&mut self, id: u16) -> &mut Watched<'a> {
        self.channels.entry(id).or_insert_with(|| Watched {
            bytes: Vec::new(),
            observers: Vec::new(),
            moment: Moment { time: 0.0, log_time: 0, number: 0, values: Values::default() },
            count: 0,
            last: None,
        })
    }

    fn observe(
        &mut self,
        id: u16,
        choice: Choice,
        take: impl FnMut(&Moment, &mut Budget) -> Result<(), Failure> + 'a,
    ) {
        self.watched(id).observers.push((choice, Box::new(take)));
    }

    /// Hands the messages of a channel to `take`, decoded; none of a channel that is not.
    pub(crate) fn each(
        &mut self,
        id: u16,
        take: impl FnMut(&Moment, &mut Budget) -> Result<(), Failure> + 'a,
    ) {
        self.every(id, 1, take);
    }

    /// Hands every n-th message of a channel to `take`, and the last.
    pub(crate) fn every(
        &mut self,
        id: u16,
        every: u64,
        take: impl FnMut(&Moment, &mut Budget) -> Result<(), Failure> + 'a,
    ) {
        let every = every.max(1).saturating_mul(self.window.every.max(1));
        self.observe(id, Choice::Every(every), take);
    }

    /// Hands the messages of a channel with some numbers to `take`.
    pub(crate) fn numbers(
        &mut self,
        id: u16,
        numbers: BTreeSet<u64>,
        take: impl FnMut(&Moment, &mut Budget) -> Result<(), Failure> + 'a,
    ) {
        self.observe(id, Choice::Numbers(numbers), take);
    }

    /// Hands the messages of a channel to `take` as they stand in the file.
    pub(crate) fn bytes(
        &mut self,
        id: u16,
        take: impl FnMut(Message<'_>, Instant, &mut Budget) -> Result<(), Failure> + 'a,
    ) {
        self.watched(id).bytes.push(Box::new(take));
    }

    /// Hands every record of the file to `take`, which is read as a whole then.
    pub(crate) fn records(&mut self, take: impl FnMut(FileRecord<'_>, Option<&mut Decoded<'_>>) + 'a) {
        self.records = Some(Box::new(take));
    }

    /// Reads the recording.
    pub fn run(self) -> Result<Seen, Failure> {
        let Self { recording, window, mut channels, records, mut budget } = self;
        let ids = || channels.keys().copied();
        let mut messages = match records {
            Some(take) => recording.messages_and_records(ids(), take)?,
            None => recording.messages(ids(), window.log_times_of(recording, ids()))?,
        };
        messages.for_each(|next| match channels.get_mut(&next.message.channel) {
            Some(watched) => watched.take(next, &window, &mut budget),
            None => Ok(()),
        })?;
        for watched in channels.values_mut() {
            if let Some(kept) = watched.last.take() {
                let number = watched.count - 1;
                messages.again(&kept, |next| watched.show(next, (number, true), &mut budget)).transpose()?;
            }
        }
        Ok(messages.seen())
    }
}

impl Watched<'_> {
    fn take(&mut self, next: &mut Next<'_, '_>, window: &Window, budget: &mut Budget) -> Result<(), Failure> {
        let instant = next.instant();
        if !window.holds(instant) {
            return Ok(());
        }
        self.bytes.iter_mut().try_for_each(|take| take(next.message, instant, budget))?;
        let number = self.count;
        self.count += 1;
        self.show(next, (number, false), budget)?;
        if !next.is_undecoded() && self.observers.iter().any(|(choice, _)| choice.holds(number, true)) {
            self.last = Some(Kept::from(&next.message));
        } else {
            self.last = None;
        }
        Ok(())
    }

    /// Shows a message to those who look at it.
    fn show(
        &mut self,
        next: &mut Next<'_, '_>,
        (number, is_last): (u64, bool),
        budget: &mut Budget,
    ) -> Result<(), Failure> {
        let Self { observers, moment, .. } = self;
        let chosen = |(choice, _): &&mut (Choice, Take<'_>)| choice.holds(number, is_last);
        let mut chosen = observers.iter_mut().filter(chosen).peekable();
        if chosen.peek().is_none() {
            return Ok(());
        }
        (moment.time, moment.log_time, moment.number) =
            (next.instant().number(), next.message.log_time, number);
        let Some(values) = next.values() else { return Ok(()) };
        std::mem::swap(&mut moment.values, values);
        let shown = chosen.try_for_each(|(_, take)| take(moment, budget));
        std::mem::swap(&mut moment.values, values);
        shown
    }
}
