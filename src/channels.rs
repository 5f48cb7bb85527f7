//! The channels of a recording: one file each, and the catalogue that lists them.
//!
//! A channel encodes a [`View`] into messages and describes their fields. It does not know how a view is computed, nor files.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use prost::Message;

use crate::{
    case::Case,
    message::descriptor_set,
    recording::{Batch, ChannelSpec, MESSAGE_HEADER, Recorder, RecordingError},
    units::{Unit, Units},
    view::View,
};

mod band_pass;
mod drag;
mod energy;
mod event;
mod field;
mod interface_stress;
mod line;
pub mod log;
mod points;
mod probes;
mod sensor;
mod velocity;
pub mod view;

type Observe = Box<dyn FnMut(&View<'_>, &mut Outlet<'_>) + Send>;

/// Payload of a message of few numbers, and of the numbers that one of many begins with \[bytes\].
const HEAD: u64 = 36;

/// How often a channel emits a message, and its estimated payload \[bytes\].
#[derive(Clone, Copy)]
enum Rate {
    /// As it happens, which is rarely.
    Event,
    Step(u64),
    /// Every `record.interface_every` steps.
    Interval(u64),
    Frame(u64),
}

impl Rate {
    /// Estimated size of all messages in a recording \[bytes\].
    fn size(self, case: &Case) -> u64 {
        let steps = case.sizes.steps;
        let (count, payload) = match self {
            Self::Event => return 0,
            Self::Step(payload) => (steps + 1, payload),
            Self::Interval(payload) => (steps.div_ceil(case.record.interface_every) + 1, payload),
            Self::Frame(payload) => (case.frames().count(), payload),
        };
        // record header and index entry
        count * (MESSAGE_HEADER + 16 + payload)
    }
}

pub struct Channel {
    topic: String,
    schema: &'static str,
    fields: Vec<FieldNote>,
    remarks: Vec<(String, String)>,
    rate: Rate,
    observe: Observe,
}

impl Channel {
    /// A channel.
    ///
    /// * `schema`: full name of the message type
    /// * `fields`: units and meanings of the numeric fields, without `step` and `time`, which begin every percuss message
    /// * `observe`: emits the messages of a step
    pub fn new(
        topic: impl Into<String>,
        schema: &'static str,
        fields: Vec<FieldNote>,
        observe: impl FnMut(&View<'_>, &mut Outlet<'_>) + Send + 'static,
    ) -> Self {
        let (topic, remarks, rate) = (topic.into(), Vec::new(), Rate::Event);
        Self { topic, schema, fields, remarks, rate, observe: Box::new(observe) }
    }

    fn emits(self, rate: Rate) -> Self {
        Self { rate, ..self }
    }

    pub fn remark(mut self, key: impl Into<String>, value: impl Into<String>) -> Self {
        self.remarks.push((key.into(), value.into()));
        self
    }

    fn metadata(&self, units: &Units) -> BTreeMap<String, String> {
        let mut map = BTreeMap::new();
        let mut add = |note: &FieldNote| {
            map.insert(format!("unit.{}", note.name), note.unit.into());
            map.insert(format!("meaning.{}", note.name), note.meaning.clone().into_owned());
            map.extend(note.axis.iter().map(|axis| (format!("axis.{}", note.name), axis.clone())));
            map.extend(note.symmetry.map(|symmetry| (format!("symmetry.{}", note.name), symmetry.into())));
        };
        self.fields.iter().for_each(&mut add);
        if self.schema.starts_with("percuss.") {
            add(&FieldNote::new("step", "1", "number k of the step"));
            add(&FieldNote::new("time", units.time.name, "time t = k dt"));
        }
        map.extend(self.remarks.iter().cloned());
        if self.topic.starts_with(view::TOPICS) {
            // comparisons skip such channels: their sources are compared
            map.insert("derived".into(), "drawn from the other channels".into());
        }
        map
    }
}

/// Positions as the axis of an array.
fn list(length: Unit, positions: impl Iterator<Item = f64>) -> String {
    positions.map(|x| length.of(x).to_string()).collect::<Vec<_>>().join(",")
}

/// Unit and meaning of a field, for the metadata of its channel.
#[derive(Clone, Debug)]
pub struct FieldNote {
    name: &'static str,
    unit: &'static str,
    meaning: Cow<'static, str>,
    axis: Option<String>,
    symmetry: Option<&'static str>,
}

impl FieldNote {
    pub fn new(name: &'static str, unit: &'static str, meaning: impl Into<Cow<'static, str>>) -> Self {
        Self { name, unit, meaning: meaning.into(), axis: None, symmetry: None }
    }

    /// An array with an axis: names of fields for a uniform one (`r0,dr`), or the positions themselves.
    pub fn along(self, axis: impl Into<String>) -> Self {
        Self { axis: Some(axis.into()), ..self }
    }

    /// An array that is even about the origin of its axis: between 0 and its first node lies a parabola.
    pub fn even(mut self) -> Self {
        self.symmetry = Some("even");
        self
    }
}

/// Destination of the messages of a channel.
pub struct Outlet<'a> {
    batch: &'a mut Batch,
    channel: usize,
    /// Log time of the step \[ns\].
    log_time: u64,
}

impl Outlet<'_> {
    pub fn put(&mut self, message: &impl Message) {
        self.batch.put(self.channel, self.log_time, message);
    }
}

/// Log time of a step, `round(1e9·playback_rate·time)` \[ns\].
///
/// * `time`: in the units of the recording
pub fn log_time(time: f64, playback_rate: f64) -> u64 {
    (1e9 * playback_rate * time).round() as u64
}

/// All channels of a case. To add one, add its line here.
pub struct Catalogue {
    /// Channels that observe every step, numbered from 0.
    channels: Vec<Channel>,
    /// Channels that emit messages at frames only, fields and pictures, numbered after them. They observe on the writer
    /// thread, from a view that shares the frame, while the run continues.
    frames: Arc<Mutex<Vec<Channel>>>,
    /// What sensors hold back to the end, see [`sensor`].
    held: Vec<sensor::Held>,
    /// Memory of the fields of a frame \[bytes\].
    frame_size: usize,
    units: Units,
    playback_rate: f64,
}

impl Catalogue {
    /// The channels that `case` records.
    pub fn new(case: &Case) -> Self {
        let mut channels: Vec<Channel> = vec![
            interface_stress::channel(case),
            drag::channel(case),
            velocity::channel(case),
            probes::channel(case),
            energy::channel(case),
            event::channel(case),
            log::channel(),
        ];
        if !case.record.points.is_empty() {
            channels.push(points::channel(case));
        }
        for (number, line) in case.record.lines.iter().enumerate() {
            channels.push(line::channel(case, number, *line));
        }
        let sensors = channels.len();
        channels.extend((0..case.record.sensors.len()).map(|number| sensor::channel(case, number)));
        let held = (0..case.record.sensors.len())
            .filter_map(|number| sensor::Held::new(case, number, sensors + number));
        let slices = case.record.fields.iter().map(|field| field::channel(case, *field));
        let held = held.collect();
        Self { held, ..Self::with(case, channels, slices.chain(view::channels(case)).collect()) }
    }

    /// The channels of a closed form for `case`.
    ///
    /// * `has_drag`: true if the form has the drag
    pub fn exact(case: &Case, has_drag: bool) -> Self {
        let mut channels: Vec<Channel> = vec![
            interface_stress::channel(case),
            velocity::channel(case),
            probes::channel(case),
            log::channel(),
        ];
        if has_drag {
            channels.push(drag::channel(case));
        }
        Self::with(case, channels, Vec::new())
    }

    fn with(case: &Case, channels: Vec<Channel>, frames: Vec<Channel>) -> Self {
        let frames = Arc::new(Mutex::new(frames));
        let (units, playback_rate) = (case.units(), case.record.playback_rate);
        Self { channels, frames, held: Vec::new(), frame_size: case.frame_size(), units, playback_rate }
    }

    /// Maps every channel, in the order of their numbers.
    fn map<T>(&self, f: impl Fn(&Channel) -> T) -> Vec<T> {
        let frames = lock(&self.frames);
        self.channels.iter().chain(frames.iter()).map(f).collect()
    }

    pub fn specs(&self) -> Vec<ChannelSpec> {
        self.map(|channel| ChannelSpec {
            topic: channel.topic.clone(),
            schema: channel.schema.into(),
            descriptors: descriptor_set(channel.schema),
            metadata: channel.metadata(&self.units),
        })
    }

    pub fn topics(&self) -> Vec<String> {
        self.map(|channel| channel.topic.clone())
    }

    /// Estimated size of all messages before compression \[bytes\].
    pub fn estimated_size(&self, case: &Case) -> u64 {
        self.map(|channel| channel.rate.size(case)).into_iter().sum()
    }

    pub fn observe(&mut self, view: &View<'_>, recorder: &mut Recorder) -> Result<(), RecordingError> {
        let log_time = log_time(self.units.time.of(view.time), self.playback_rate);
        observe_all(&mut self.channels, 0, view, log_time, &mut recorder.batch);
        self.held.iter_mut().for_each(|held| held.take(view));
        if view.frame.is_none() {
            return recorder.hand_over_if_full();
        }
        let (view, frames, first) = (view.share(), Arc::clone(&self.frames), self.channels.len());
        let observe = move |batch: &mut Batch| observe_all(&mut lock(&frames), first, &view, log_time, batch);
        recorder.defer(self.frame_size, Box::new(observe))
    }

    /// What has been held back so far.
    pub fn held(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        self.held.iter_mut().map(|held| &mut held.values)
    }

    pub fn release(&self, recorder: &mut Recorder) -> Result<(), RecordingError> {
        for held in &self.held {
            for message in held.messages() {
                let log_time = log_time(message.time, self.playback_rate);
                Outlet { batch: &mut recorder.batch, channel: held.channel, log_time }.put(&message);
                recorder.end_step();
                recorder.hand_over_if_full()?;
            }
        }
        Ok(())
    }

    /// Writes a line to the log channel.
    ///
    /// * `time`: time of the line \[R/c_p\]
    pub fn say(
        &self,
        level: log::Level,
        time: f64,
        text: &str,
        recorder: &mut Recorder,
    ) -> Result<(), RecordingError> {
        let channel = self.channels.iter().position(|channel| channel.topic == log::TOPIC);
        let channel = channel.expect("the log is in the catalogue");
        let log_time = log_time(self.units.time.of(time), self.playback_rate);
        Outlet { batch: &mut recorder.batch, channel, log_time }.put(&log::line(level, log_time, text));
        recorder.hand_over_if_full()
    }
}

/// Locks shared data, even if a thread has panicked while it held the lock.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Passes a step to channels, the first of which has the number `first`.
fn observe_all(channels: &mut [Channel], first: usize, view: &View<'_>, log_time: u64, batch: &mut Batch) {
    for (channel, observer) in channels.iter_mut().enumerate() {
        (observer.observe)(view, &mut Outlet { batch, channel: first + channel, log_time });
    }
}
