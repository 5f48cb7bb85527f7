//! One reading of a recording for all who look at its messages.
//!
//! Observers register for the messages of a channel. Every chunk is read once, and every message that anyone looks at is decoded
//! once; what observers keep comes out of one budget.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    channel::Channel,
    failure::Failure,
    instant::Instant,
    messages::{Message, Recording},
    recording::{Budget, Damage, FileRecord},
    select::Window,
    wire::{DecodeError, Layout, Values},
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

/// How a pass went.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// What of the file is damaged.
    pub damages: Vec<Damage>,
    /// Messages that do not fit their schema, of those that were looked at.
    pub undecoded: u64,
    /// Bytes of the file that were read.
    pub bytes: u64,
}

/// Which messages of a channel are looked at.
enum Choice {
    /// Every n-th, and the last.
    Every(u64),
    /// Those of these numbers.
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

/// What is made of every record of the file; and of messages, whether they were decoded, and how that went.
type TakeRecord<'a> = Box<dyn FnMut(FileRecord<'_>, Option<Result<(), DecodeError>>) + 'a>;

/// A channel that is looked at.
struct Watched<'a> {
    channel: &'a Channel,
    /// Those of no channel that is not decoded are shown to observers.
    layout: Option<&'a Layout>,
    bytes: Vec<TakeBytes<'a>>,
    observers: Vec<(Choice, Take<'a>)>,
    moment: Moment,
    /// Messages so far.
    count: u64,
    /// The last message, if not all who look at the last have seen it.
    last: Option<(Instant, u64, Vec<u8>)>,
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

    /// A channel that is looked at; `None` if there is none of this id.
    fn watched(&mut self, id: u16) -> Option<&mut Watched<'a>> {
        let channel = self.recording.channels.get(&id)?;
        let layout = channel.layout.as_deref();
        let values = || layout.map_or_else(|| Values { lists: Vec::new() }, Layout::values);
        Some(self.channels.entry(id).or_insert_with(|| Watched {
            channel,
            layout,
            bytes: Vec::new(),
            observers: Vec::new(),
            moment: Moment { time: 0.0, log_time: 0, number: 0, values: values() },
            count: 0,
            last: None,
        }))
    }

    fn observe(
        &mut self,
        id: u16,
        choice: Choice,
        take: impl FnMut(&Moment, &mut Budget) -> Result<(), Failure> + 'a,
    ) {
        if let Some(watched) = self.watched(id).filter(|watched| watched.layout.is_some()) {
            watched.observers.push((choice, Box::new(take)));
        }
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
        if let Some(watched) = self.watched(id) {
            watched.bytes.push(Box::new(take));
        }
    }

    /// Hands every record of the file to `take`, which is read as a whole then.
    pub(crate) fn records(&mut self, take: impl FnMut(FileRecord<'_>, Option<Result<(), DecodeError>>) + 'a) {
        self.records = Some(Box::new(take));
    }

    /// Log times that hold all of the window \[ns\]; `None` if that is not known.
    fn log_times(&self) -> Option<(u64, u64)> {
        let mut channels = self.channels.values().map(|watched| watched.channel);
        if channels.clone().all(Channel::has_time) {
            let (from, to) = self.window.numbers();
            return self.recording.log_window(from, to);
        }
        let origin = channels.clone().map(|channel| channel.origin).max().unwrap_or(0);
        channels.all(|channel| !channel.has_time()).then(|| self.window.log_times(origin))
    }

    /// Reads the recording.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or an observer fails.
    pub fn run(mut self) -> Result<Seen, Failure> {
        let mut undecoded = 0;
        let mut scan = match &self.records {
            Some(_) => self.recording.scan()?,
            None => self.recording.scan_for(&self.channels.keys().copied().collect(), self.log_times())?,
        };
        let Self { window, channels, records, budget, .. } = &mut self;
        let failed = scan.find_map(|found| {
            let mut fit = None;
            if let Some(message) = Message::of(&found)
                && let Some(watched) = channels.get_mut(&message.channel)
            {
                match watched.take(message, window, budget) {
                    Ok(known) => fit = known,
                    Err(error) => return Some(error),
                }
                undecoded += u64::from(matches!(fit, Some(Err(_))));
            }
            if let Some(take) = records {
                take(found, fit);
            }
            None
        })?;
        if let Some(error) = failed {
            return Err(error);
        }
        for watched in channels.values_mut() {
            undecoded += u64::from(watched.end(budget)?);
        }
        Ok(Seen { damages: scan.damages().to_vec(), undecoded, bytes: scan.bytes_read() })
    }
}

impl Watched<'_> {
    /// Takes a message; answers whether it was decoded, and how that went.
    fn take(
        &mut self,
        message: Message<'_>,
        window: &Window,
        budget: &mut Budget,
    ) -> Result<Option<Result<(), DecodeError>>, Failure> {
        let Message { log_time, data, .. } = message;
        let instant = self.channel.instant(data, log_time, self.channel.origin);
        if !window.holds(instant) {
            return Ok(None);
        }
        self.bytes.iter_mut().try_for_each(|take| take(message, instant, budget))?;
        let number = self.count;
        self.count += 1;
        if self.observers.iter().any(|(choice, _)| choice.holds(number, true)) {
            let (at, time, bytes) = self.last.get_or_insert((instant, log_time, Vec::new()));
            (*at, *time) = (instant, log_time);
            bytes.clear();
            bytes.extend_from_slice(data);
        } else {
            self.last = None;
        }
        if !self.observers.iter().any(|(choice, _)| choice.holds(number, false)) {
            return Ok(None);
        }
        self.show((instant, log_time, data), (number, false), budget).map(Some)
    }

    /// Shows the last message to those who have not seen it; true if it is decoded for the first time, and in vain.
    fn end(&mut self, budget: &mut Budget) -> Result<bool, Failure> {
        let Some((instant, log_time, data)) = self.last.take() else { return Ok(false) };
        let number = self.count - 1;
        let is_new = !self.observers.iter().any(|(choice, _)| choice.holds(number, false));
        Ok(self.show((instant, log_time, &data), (number, true), budget)?.is_err() && is_new)
    }

    /// Decodes a message and shows it to those who look at it.
    fn show(
        &mut self,
        (instant, log_time, data): (Instant, u64, &[u8]),
        (number, is_last): (u64, bool),
        budget: &mut Budget,
    ) -> Result<Result<(), DecodeError>, Failure> {
        let Some(layout) = self.layout else { return Ok(Ok(())) };
        let decoded = layout.decode(data, &mut self.moment.values);
        if decoded.is_ok() {
            (self.moment.time, self.moment.log_time, self.moment.number) =
                (instant.number(), log_time, number);
            let chosen = self.observers.iter_mut().filter(|(choice, _)| choice.holds(number, is_last));
            for (_, take) in chosen {
                take(&self.moment, budget)?;
            }
        }
        self.moment.values.release();
        Ok(decoded)
    }
}
