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
    model::Field,
    recording::{Batch, ChannelSpec, Recorder, RecordingError},
    units::Units,
    view::View,
};

mod drag;
mod energy;
mod event;
mod field;
mod interface_stress;
mod line;
pub mod log;
mod points;
mod probes;
mod velocity;
pub mod view;

/// A recorded channel.
pub trait Channel: Send {
    /// Topic.
    fn topic(&self) -> &str;

    /// Full name of the message type.
    fn schema(&self) -> &'static str;

    /// Units and meanings of the numeric fields, without `step` and `time`, which begin every percuss message.
    fn fields(&self) -> Vec<FieldNote>;

    /// Further entries of the metadata of the channel.
    fn remarks(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// Emits the messages of a step.
    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>);
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
    /// A field without an axis.
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
    log_time: u64,
}

impl Outlet<'_> {
    /// Adds a message.
    pub fn put(&mut self, message: &impl Message) {
        self.batch.put(self.channel, self.log_time, message);
    }

    /// Log time of the step \[ns\].
    pub fn log_time(&self) -> u64 {
        self.log_time
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
    channels: Vec<Box<dyn Channel>>,
    /// Channels that emit messages at frames only, fields and pictures, numbered after them. They observe on the writer
    /// thread, from a view that shares the frame, while the run continues.
    frames: Arc<Mutex<Vec<Box<dyn Channel>>>>,
    /// Memory of the fields of a frame \[bytes\].
    frame_size: usize,
    units: Units,
    playback_rate: f64,
}

impl Catalogue {
    /// The channels that `case` records.
    pub fn new(case: &Case) -> Self {
        let mut channels: Vec<Box<dyn Channel>> = vec![
            Box::new(interface_stress::InterfaceStress::new(case)),
            Box::new(drag::Drag::new(case)),
            Box::new(velocity::Velocity::new(case)),
            Box::new(probes::Probes::new(case)),
            Box::new(energy::Energy::new(case)),
            Box::new(event::Event::new(case)),
            Box::new(log::Log),
        ];
        if !case.record.points.is_empty() {
            channels.push(Box::new(points::Points::new(case)));
        }
        for (number, line) in case.record.lines.iter().enumerate() {
            channels.push(Box::new(line::LineSlice::new(case, number, *line)));
        }
        let slice = |field: &Field| -> Box<dyn Channel> { Box::new(field::FieldSlice::new(case, *field)) };
        let slices = case.record.fields.iter().map(slice);
        Self::with(case, channels, slices.chain(view::channels(case)).collect())
    }

    /// The channels of a closed form for `case`.
    ///
    /// * `has_drag`: true if the form has the drag
    pub fn exact(case: &Case, has_drag: bool) -> Self {
        let mut channels: Vec<Box<dyn Channel>> = vec![
            Box::new(interface_stress::InterfaceStress::new(case)),
            Box::new(velocity::Velocity::new(case)),
            Box::new(probes::Probes::new(case)),
            Box::new(log::Log),
        ];
        if has_drag {
            channels.push(Box::new(drag::Drag::new(case)));
        }
        Self::with(case, channels, Vec::new())
    }

    fn with(case: &Case, channels: Vec<Box<dyn Channel>>, frames: Vec<Box<dyn Channel>>) -> Self {
        let frames = Arc::new(Mutex::new(frames));
        let (units, playback_rate) = (case.units(), case.record.playback_rate);
        Self { channels, frames, frame_size: case.frame_size(), units, playback_rate }
    }

    /// Maps every channel, in the order of their numbers.
    fn map<T>(&self, f: impl Fn(&dyn Channel) -> T) -> Vec<T> {
        let frames = lock(&self.frames);
        self.channels.iter().chain(frames.iter()).map(|channel| f(channel.as_ref())).collect()
    }

    /// Topics, schemas and metadata of all channels.
    pub fn specs(&self) -> Vec<ChannelSpec> {
        self.map(|channel| ChannelSpec {
            topic: channel.topic().into(),
            schema: channel.schema().into(),
            descriptors: descriptor_set(channel.schema()),
            metadata: metadata(channel, &self.units),
        })
    }

    /// Topics of all channels.
    pub fn topics(&self) -> Vec<String> {
        self.map(|channel| channel.topic().to_owned())
    }

    /// Passes a step to every channel.
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    pub fn observe(&mut self, view: &View<'_>, recorder: &mut Recorder) -> Result<(), RecordingError> {
        let log_time = log_time(self.units.time.of(view.time), self.playback_rate);
        observe_all(&mut self.channels, 0, view, log_time, recorder.batch());
        if view.frame.is_none() {
            return recorder.hand_over_if_full();
        }
        let (view, frames, first) = (view.share(), Arc::clone(&self.frames), self.channels.len());
        let observe = move |batch: &mut Batch| observe_all(&mut lock(&frames), first, &view, log_time, batch);
        recorder.defer(self.frame_size, Box::new(observe))
    }

    /// Writes a line to the log channel.
    ///
    /// * `time`: time of the line \[R/c_p\]
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    pub fn say(
        &self,
        level: log::Level,
        time: f64,
        text: &str,
        recorder: &mut Recorder,
    ) -> Result<(), RecordingError> {
        let channel = self.channels.iter().position(|channel| channel.topic() == log::TOPIC);
        let channel = channel.expect("the log is in the catalogue");
        let log_time = log_time(self.units.time.of(time), self.playback_rate);
        Outlet { batch: recorder.batch(), channel, log_time }.put(&log::line(level, log_time, text));
        recorder.hand_over_if_full()
    }
}

/// Locks shared data, even if a thread has panicked while it held the lock.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Passes a step to channels, the first of which has the number `first`.
fn observe_all(
    channels: &mut [Box<dyn Channel>],
    first: usize,
    view: &View<'_>,
    log_time: u64,
    batch: &mut Batch,
) {
    for (channel, observer) in channels.iter_mut().enumerate() {
        observer.observe(view, &mut Outlet { batch, channel: first + channel, log_time });
    }
}

fn metadata(channel: &dyn Channel, units: &Units) -> BTreeMap<String, String> {
    let mut map = BTreeMap::new();
    let mut fields = channel.fields();
    if channel.schema().starts_with("percuss.") {
        fields.push(FieldNote::new("step", "1", "number k of the step"));
        fields.push(FieldNote::new("time", units.time.name, "time t = k dt"));
    }
    for field in fields {
        map.insert(format!("unit.{}", field.name), field.unit.into());
        map.insert(format!("meaning.{}", field.name), field.meaning.into_owned());
        if let Some(axis) = field.axis {
            map.insert(format!("axis.{}", field.name), axis);
        }
        if let Some(symmetry) = field.symmetry {
            map.insert(format!("symmetry.{}", field.name), symmetry.into());
        }
    }
    map.extend(channel.remarks());
    if channel.topic().starts_with(view::TOPICS) {
        // comparisons skip such channels: their sources are compared
        map.insert("derived".into(), "drawn from the other channels".into());
    }
    map
}
