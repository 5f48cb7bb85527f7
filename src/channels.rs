//! The channels of a recording: one file each, and the catalogue that lists them.
//!
//! A channel turns a [`View`] into messages and says in plain text what their fields mean. It knows nothing of how
//! a view came about or of files.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use prost::Message;

use crate::{
    case::Case,
    message::descriptor_set,
    recording::{Batch, ChannelSpec, Recorder, RecordingError},
    view::View,
};

mod drag;
mod energy;
mod event;
mod field;
mod interface_stress;
pub mod log;
mod probes;
mod velocity;
pub mod view;

/// A recorded channel.
pub trait Channel: Send {
    /// Topic.
    fn topic(&self) -> &'static str;

    /// Full name of the message type.
    fn schema(&self) -> &'static str;

    /// Units and meanings of the numeric fields.
    fn fields(&self) -> Vec<FieldNote>;

    /// What else the metadata of the channel says.
    fn remarks(&self) -> Vec<(String, String)> {
        Vec::new()
    }

    /// Writes what the channel has to say about a step.
    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>);
}

/// Unit and meaning of a field, for the metadata of its channel.
#[derive(Clone, Debug)]
pub struct FieldNote {
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    axis: Option<String>,
    symmetry: Option<&'static str>,
}

impl FieldNote {
    /// A field without an axis.
    pub const fn new(name: &'static str, unit: &'static str, meaning: &'static str) -> Self {
        Self { name, unit, meaning, axis: None, symmetry: None }
    }

    /// An array with an axis: names of fields for a uniform one (`r0,dr`), or the positions themselves.
    pub fn along(self, axis: impl Into<String>) -> Self {
        Self { axis: Some(axis.into()), ..self }
    }

    /// An array that is even about the origin of its axis: between 0 and its first node lies a parabola.
    pub const fn even(mut self) -> Self {
        self.symmetry = Some("even");
        self
    }
}

/// The notes on `step` and `time`, which begin every percuss message.
fn step_and_time() -> [FieldNote; 2] {
    [FieldNote::new("step", "1", "number k of the step"), FieldNote::new("time", "R/c_p", "time t = k dt")]
}

/// Where a channel puts its messages.
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
pub fn log_time(time: f64, playback_rate: f64) -> u64 {
    (1e9 * playback_rate * time).round() as u64
}

/// All channels of a case. To add one, add its line here.
pub struct Catalogue {
    /// Channels that look at every step, numbered from 0.
    channels: Vec<Box<dyn Channel>>,
    /// Channels of frames, numbered after them.
    frames: FrameChannels,
    playback_rate: f64,
}

impl Catalogue {
    /// The channels that `case` records.
    pub fn new(case: &Case) -> Self {
        let channels: Vec<Box<dyn Channel>> = vec![
            Box::new(interface_stress::InterfaceStress::new(case)),
            Box::new(drag::Drag::new(case)),
            Box::new(velocity::Velocity),
            Box::new(probes::Probes::new(case)),
            Box::new(energy::Energy::new(case)),
            Box::new(event::Event),
            Box::new(log::Log),
        ];
        let slices = case.record.fields.iter().map(|field| field::FieldSlice::new(case, *field));
        let views = view::channels(case);
        let slices = slices.into_iter().map(|slice| Box::new(slice) as Box<dyn Channel>);
        let frames = FrameChannels::new(slices.chain(views).collect(), case.frame_size());
        Self { channels, frames, playback_rate: case.record.playback_rate }
    }

    /// The channels that a closed form can fill for `case`.
    ///
    /// * `knows_drag`: true if it knows the drag
    pub fn exact(case: &Case, knows_drag: bool) -> Self {
        let mut channels: Vec<Box<dyn Channel>> = vec![
            Box::new(interface_stress::InterfaceStress::new(case)),
            Box::new(velocity::Velocity),
            Box::new(probes::Probes::new(case)),
            Box::new(log::Log),
        ];
        if knows_drag {
            channels.push(Box::new(drag::Drag::new(case)));
        }
        let frames = FrameChannels::new(Vec::new(), 0);
        Self { channels, frames, playback_rate: case.record.playback_rate }
    }

    /// Asks every channel something, in the order of their numbers.
    fn each<T>(&self, ask: impl Fn(&dyn Channel) -> T) -> Vec<T> {
        let frames = lock(&self.frames.channels);
        self.channels.iter().chain(frames.iter()).map(|channel| ask(channel.as_ref())).collect()
    }

    /// Topics, schemas and metadata of all channels.
    pub fn specs(&self) -> Vec<ChannelSpec> {
        self.each(|channel| ChannelSpec {
            topic: channel.topic().into(),
            schema: channel.schema().into(),
            descriptors: descriptor_set(channel.schema()),
            metadata: all_metadata(channel),
        })
    }

    /// Topics of all channels.
    pub fn topics(&self) -> Vec<String> {
        self.each(|channel| channel.topic().to_owned())
    }

    /// Lets every channel look at a step.
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    pub fn observe(&mut self, view: &View<'_>, recorder: &mut Recorder) -> Result<(), RecordingError> {
        let log_time = log_time(view.time, self.playback_rate);
        let_speak(&mut self.channels, 0, view, log_time, recorder.batch());
        if view.frame.is_some() {
            self.frames.observe(view, self.channels.len(), log_time, recorder)
        } else {
            recorder.hand_over_if_full()
        }
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
        let log_time = log_time(time, self.playback_rate);
        Outlet { batch: recorder.batch(), channel, log_time }.put(&log::line(level, log_time, text));
        recorder.hand_over_if_full()
    }
}

/// What is shared, whatever has happened to a thread that held it.
fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn let_speak(
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

/// Channels that speak at frames only: fields and pictures. They do it on the thread that writes, from a view that
/// shares the frame, while the run goes on.
struct FrameChannels {
    channels: Arc<Mutex<Vec<Box<dyn Channel>>>>,
    is_empty: bool,
    /// Memory of the fields of a frame \[bytes\].
    frame_size: usize,
}

impl FrameChannels {
    fn new(channels: Vec<Box<dyn Channel>>, frame_size: usize) -> Self {
        let is_empty = channels.is_empty();
        Self { channels: Arc::new(Mutex::new(channels)), is_empty, frame_size }
    }

    /// Hands a frame over to the writer.
    ///
    /// * `first`: number of the first channel
    fn observe(
        &self,
        view: &View<'_>,
        first: usize,
        log_time: u64,
        recorder: &mut Recorder,
    ) -> Result<(), RecordingError> {
        if self.is_empty {
            return recorder.hand_over_if_full();
        }
        let view = view.share();
        let channels = Arc::clone(&self.channels);
        let make = move |batch: &mut Batch| {
            let mut channels = lock(&channels);
            let_speak(&mut channels, first, &view, log_time, batch);
        };
        recorder.later(self.frame_size, Box::new(make))
    }
}

fn all_metadata(channel: &dyn Channel) -> BTreeMap<String, String> {
    let mut map = metadata(&channel.fields());
    map.extend(channel.remarks());
    if channel.topic().starts_with(view::TOPICS) {
        // readers that compare recordings leave such channels to what they are made from
        map.insert("derived".into(), "drawn from the other channels".into());
    }
    map
}

fn metadata(fields: &[FieldNote]) -> BTreeMap<String, String> {
    let mut map = BTreeMap::new();
    for field in fields {
        map.insert(format!("unit.{}", field.name), field.unit.into());
        map.insert(format!("meaning.{}", field.name), field.meaning.into());
        if let Some(axis) = &field.axis {
            map.insert(format!("axis.{}", field.name), axis.clone());
        }
        if let Some(symmetry) = field.symmetry {
            map.insert(format!("symmetry.{}", field.name), symmetry.into());
        }
    }
    map
}
