//! The channels of a recording: one file each, and the catalogue that lists them.
//!
//! A channel turns a [`View`] into messages and says in plain text what their fields mean. It knows nothing of how
//! a view came about or of files.

use std::collections::BTreeMap;

use prost::Message;

use crate::{
    case::Case,
    message::descriptor_set,
    recording::{ChannelSpec, Recorder, RecordingError},
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
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) -> Result<(), RecordingError>;

    /// Size of all messages of a run before compression, about \[bytes\].
    fn size(&self, case: &Case) -> u64;
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
    recorder: &'a mut Recorder,
    channel: usize,
    log_time: u64,
}

impl Outlet<'_> {
    /// Adds a message.
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    pub fn put(&mut self, message: &impl Message) -> Result<(), RecordingError> {
        self.recorder.message(self.channel, self.log_time, message)
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

/// Bytes a message takes beside its payload: record header and index entry.
const MESSAGE_OVERHEAD: u64 = 31 + 16;

/// All channels of a case. To add one, add its line here.
pub struct Catalogue {
    channels: Vec<Box<dyn Channel>>,
    playback_rate: f64,
}

impl Catalogue {
    /// The channels that `case` records.
    pub fn new(case: &Case) -> Self {
        let mut channels: Vec<Box<dyn Channel>> = vec![
            Box::new(interface_stress::InterfaceStress::new(case)),
            Box::new(drag::Drag),
            Box::new(velocity::Velocity),
            Box::new(probes::Probes::new(case)),
            Box::new(energy::Energy),
            Box::new(event::Event),
            Box::new(log::Log),
        ];
        let slices: Vec<_> = case.record.fields.iter().map(|field| field::FieldSlice::new(*field)).collect();
        let views = view::channels(case, &slices);
        channels.extend(slices.into_iter().map(|slice| Box::new(slice) as Box<dyn Channel>));
        channels.extend(views);
        Self { channels, playback_rate: case.record.playback_rate }
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
            channels.push(Box::new(drag::Drag));
        }
        Self { channels, playback_rate: case.record.playback_rate }
    }

    /// Topics, schemas and metadata of all channels.
    pub fn specs(&self) -> Vec<ChannelSpec> {
        let specs = self.channels.iter().map(|channel| ChannelSpec {
            topic: channel.topic().into(),
            schema: channel.schema().into(),
            descriptors: descriptor_set(channel.schema()),
            metadata: metadata(&channel.fields()).into_iter().chain(channel.remarks()).collect(),
        });
        specs.collect()
    }

    /// Topics of all channels.
    pub fn topics(&self) -> Vec<String> {
        self.channels.iter().map(|channel| channel.topic().to_owned()).collect()
    }

    /// Lets every channel look at a step.
    ///
    /// # Errors
    ///
    /// The first error of the recorder.
    pub fn observe(&mut self, view: &View<'_>, recorder: &mut Recorder) -> Result<(), RecordingError> {
        let log_time = log_time(view.time, self.playback_rate);
        for (channel, observer) in self.channels.iter_mut().enumerate() {
            observer.observe(view, &mut Outlet { recorder, channel, log_time })?;
        }
        Ok(())
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
        Outlet { recorder, channel, log_time }.put(&log::line(level, log_time, text))
    }

    /// Size of all messages of a run before compression, about \[bytes\].
    pub fn size(&self, case: &Case) -> u64 {
        self.channels.iter().map(|channel| channel.size(case)).sum()
    }
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

/// Number of messages of a channel that speaks every step.
fn every_step(case: &Case) -> u64 {
    case.sizes.steps + 1
}
