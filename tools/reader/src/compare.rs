//! Compares two recordings, number by number.
//!
//! ```text
//! structure: channels and fields that both have       (units, types, names: told before any number)
//! stream:    one thread per file unpacks and hands on the messages of those channels
//! align:     messages that belong together: by step, by time, or interpolated
//! measure:   one meter per field: first and largest difference, norms, tolerance
//! ```
//!
//! Memory does not grow with the length of the recordings: messages wait only until their counterparts are read.

mod align;
mod clock;
mod measure;
mod meter;
mod resample;
mod shift;
mod stream;
mod structure;
mod sums;
mod tolerance;
mod tube;

use std::{
    collections::{BTreeMap, BTreeSet, HashMap},
    path::PathBuf,
};

pub use align::{Alignment, Mode};
pub use measure::{Divergence, Measure, Place, Scale, Sums};
pub use shift::MAX_SHIFT;
pub use structure::{Change, Finding, Kind};
pub use tolerance::{Rule, Rules, Tolerance, Tube};

use clock::Start;

use crate::{
    channel::Channel,
    messages::Recording,
    recording::{Damage, OpenError},
    select::{Pattern, Window},
    wire::Leaf,
};

/// How to compare.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Topics; all if empty.
    pub topics: Vec<Pattern>,
    /// Patterns of fields; all if empty.
    pub fields: Vec<Pattern>,
    /// How messages are brought together; by itself if none.
    pub mode: Option<Mode>,
    /// Times count from the start of each recording. Without a mode, also where the recordings have no time in common.
    pub relative: bool,
    /// What is allowed.
    pub rules: Rules,
    /// Times compared, and every n-th sample of a channel.
    pub window: Window,
    /// What not-a-number is equal to.
    pub nan: NotANumber,
    /// Stop at the first difference beyond tolerance.
    pub fail_fast: bool,
}

/// What not-a-number is equal to, besides the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NotANumber {
    /// Nothing.
    #[default]
    SameBits,
    /// Any other.
    EqualsItself,
    /// Anything: it stands for no value, and what has none is not compared.
    Skipped,
}

impl NotANumber {
    /// True if `x` and `y` count as equal because of what is not a number.
    fn forgives(self, x: f64, y: f64) -> bool {
        match self {
            Self::SameBits => false,
            Self::EqualsItself => x.is_nan() && y.is_nan(),
            Self::Skipped => self.skips(x, y),
        }
    }

    /// True if `x` and `y` are not compared because one is not a number.
    fn skips(self, x: f64, y: f64) -> bool {
        self == Self::Skipped && (x.is_nan() || y.is_nan())
    }
}

/// Messages of both recordings that belong together, as they stand in the files.
pub struct Matched<'a> {
    /// Channel of the reference.
    pub channel: u16,
    /// Channel of the new recording.
    pub other: u16,
    /// Log time of the reference \[ns\].
    pub log_time: u64,
    /// Message of the reference.
    pub a: &'a [u8],
    /// Message of the new recording.
    pub b: &'a [u8],
}

/// Sees every two messages that are compared as they are, not interpolated.
pub type Watch<'a> = &'a mut dyn FnMut(&Matched<'_>) -> Result<(), String>;

/// What came out.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Differences of structure.
    pub structure: Vec<Finding>,
    /// What the recordings say differently of themselves.
    pub provenance: Vec<Change>,
    /// Channels that both have.
    pub channels: Vec<ChannelReport>,
    /// Topics left out because they show what others hold; they are compared if they are named.
    pub derived: BTreeSet<String>,
    /// What is damaged, by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Recordings that did not come to their planned end.
    pub partial: Vec<PathBuf>,
    /// True if not everything was compared, because of [`Options::fail_fast`].
    pub stopped_early: bool,
    /// What was to be compared and could not be.
    pub gaps: Vec<Gap>,
    /// For every rule, whether it fits a topic or field of the recordings.
    pub fitting: Vec<bool>,
}

/// Something that was to be compared and could not be. To call it equal would be no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Gap {
    /// No value at all was compared.
    #[error("nothing was compared: {0}")]
    Nothing(String),
    /// Both recordings have messages, at times of which none is in both.
    #[error(
        "`{topic}`: no time in common: {} messages from {} to {}, {} from {} to {} in the new recording; --align relative \
         counts times from the start of each recording, --align order compares one message after the other",
        messages[0], spans[0].0, spans[0].1, messages[1], spans[1].0, spans[1].1
    )]
    Apart {
        /// Topic.
        topic: String,
        /// Messages of reference and new recording.
        messages: [u64; 2],
        /// First and last time of both.
        spans: [(f64, f64); 2],
    },
    /// Arrays of a field have no part of their axes in common.
    #[error("`{topic}.{field}`: the axes of its arrays have no part in common, in none of {samples} samples")]
    Elsewhere {
        /// Topic.
        topic: String,
        /// Path of the field.
        field: String,
        /// Samples.
        samples: u64,
    },
}

impl Options {
    /// True if a field takes part.
    fn compares(&self, topic: &str, field: &str) -> bool {
        let chosen = self.fields.is_empty() || self.fields.iter().any(|pattern| pattern.fits(field));
        chosen && !self.rules.ignores(topic, Some(field))
    }
}

impl Comparison {
    /// True if something is different beyond tolerance.
    pub fn is_different(&self) -> bool {
        !self.structure.is_empty() || self.channels.iter().any(ChannelReport::is_different)
    }

    /// True if all that was to be compared was, and is within tolerance.
    pub fn is_within(&self) -> bool {
        !self.is_different() && self.gaps.is_empty()
    }

    /// True if all that was to be compared was, and is the same bit for bit.
    pub fn is_equal(&self) -> bool {
        self.is_within() && !self.channels.iter().any(ChannelReport::is_notable)
    }

    /// True if a file is damaged or did not come to its planned end.
    pub fn is_lossy(&self) -> bool {
        !self.damages.is_empty() || !self.partial.is_empty()
    }

    /// The earliest difference of all, or the earliest beyond tolerance, with its topic and field.
    pub fn first(&self, beyond: bool) -> Option<(&str, &FieldReport, &Divergence)> {
        let all = self.channels.iter().flat_map(|channel| {
            channel.fields.iter().filter(|field| !field.ignored).filter_map(move |field| {
                let first = if beyond { &field.measure.first_beyond } else { &field.measure.first };
                Some((channel.topic.as_str(), field, first.as_ref()?))
            })
        });
        all.min_by(|x, y| x.2.place.time.total_cmp(&y.2.place.time))
    }
}

/// A channel that both recordings have.
#[derive(Clone, Debug, Default)]
pub struct ChannelReport {
    /// Topic.
    pub topic: String,
    /// How messages were brought together.
    pub alignment: Alignment,
    /// Samples compared.
    pub compared: u64,
    /// Messages of the reference without counterpart.
    pub only_a: u64,
    /// Messages of the new recording without counterpart.
    pub only_b: u64,
    /// Earliest message without counterpart: its place, and whether it is the reference's.
    pub first_alone: Option<(Place, bool)>,
    /// Messages of both in the window of time that was asked for.
    pub messages: [u64; 2],
    /// First and last time of those.
    pub spans: [Option<(f64, f64)>; 2],
    /// Messages of both outside the common window of time, where that is not held against them.
    pub outside: [u64; 2],
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Arrays were compared on the common range of different axes.
    pub axes_differ: bool,
    /// Fields.
    pub fields: Vec<FieldReport>,
}

impl ChannelReport {
    /// True if something of the channel is different beyond tolerance.
    pub fn is_different(&self) -> bool {
        self.only_a + self.only_b + self.undecoded > 0 || self.fields.iter().any(|field| !field.within)
    }

    /// True if all that was to be compared was, and is within tolerance.
    pub fn is_within(&self) -> bool {
        !self.is_different() && self.gaps().next().is_none()
    }

    /// True if not everything of the channel is in both recordings, the same bit for bit.
    pub fn is_notable(&self) -> bool {
        let part = self.outside != [0; 2] || self.axes_differ;
        let differs =
            |field: &FieldReport| !field.ignored && (field.measure.differing + field.measure.apart > 0);
        part || !self.is_within() || self.fields.iter().any(differs)
    }

    /// Values compared.
    pub fn values(&self) -> u64 {
        let fields = self.fields.iter().filter(|field| !field.ignored);
        fields.map(|field| field.measure.elements - field.measure.skipped).sum()
    }

    /// What was to be compared and could not be.
    pub fn gaps(&self) -> impl Iterator<Item = Gap> {
        let topic = || self.topic.clone();
        let apart = match self.spans {
            [Some(a), Some(b)] if self.compared + self.only_a + self.only_b == 0 => {
                Some(Gap::Apart { topic: topic(), messages: self.messages, spans: [a, b] })
            }
            _ => None,
        };
        let elsewhere = move |field: &FieldReport| {
            let measure = &field.measure;
            let samples = measure.apart;
            let is_gap = !field.ignored && measure.elements == 0 && samples > 0;
            is_gap.then(|| Gap::Elsewhere { topic: topic(), field: field.path.clone(), samples })
        };
        apart.into_iter().chain(self.fields.iter().filter_map(elsewhere))
    }
}

/// A field that both recordings have.
#[derive(Clone, Debug)]
pub struct FieldReport {
    /// Path.
    pub path: String,
    /// The leaf of the reference, which names elements.
    pub element: Leaf,
    /// Unit.
    pub unit: Option<String>,
    /// Rule that applied; `None` is bitwise.
    pub rule: Option<Rule>,
    /// Not compared: by a rule, or because it only says where and when the others are.
    pub ignored: bool,
    /// Within tolerance.
    pub within: bool,
    /// How far apart.
    pub measure: Measure,
    /// Samples by which the new recording is later, the time that is, and what is left of the root mean square
    /// difference with that shift.
    pub shift: Option<(i64, f64, f64)>,
}

/// Compares two recordings; `a` is the reference.
///
/// # Errors
///
/// A file cannot be read, or `watch` failed.
pub fn compare(
    a: &Recording,
    b: &Recording,
    options: &Options,
    mut watch: Option<Watch<'_>>,
) -> Result<Comparison, CompareError> {
    structure::find_chosen(a, b, options)?;
    let (mut pairs, structure) = structure::pair(a, b, options);
    clock::set_starts(a, b, options, &mut pairs)?;
    let provenance = structure::provenance(a, b)?;
    let derived = structure::derived(a, b, options);
    let fitting = structure::fitting(a, b, &options.rules);
    let mut comparison = Comparison { structure, provenance, derived, fitting, ..Comparison::default() };
    let fields = pairs.iter().map(|pair| pair.leaves.len() + 1).sum::<usize>();
    if fields.saturating_mul(FIELD) > a.limits().record() {
        return Err(CompareError::Fields { fields });
    }
    // times that count from a start are not those of the file
    let is_relative = pairs.iter().any(|pair| pair.starts.is_some());
    let window = |recording: &Recording| match is_relative {
        true => None,
        false => recording.log_window(options.window.from, options.window.to),
    };
    let scales = if pairs.iter().any(|pair| needs_scale(a, pair, &options.rules)) {
        scales(a, &pairs, options, window(a))?
    } else {
        HashMap::new()
    };
    let mut channels: Vec<align::Aligner<'_>> = Vec::new();
    let (mut by_a, mut by_b) = (BTreeMap::new(), BTreeMap::new());
    let room = a.limits().waiting() / pairs.len().max(1);
    for pair in pairs {
        by_a.insert(pair.a, channels.len());
        by_b.insert(pair.b, channels.len());
        channels.push(align::Aligner::new(a, b, pair, options, &scales, room));
    }
    let [origin_a, origin_b] = clock::origins(a, b, options);
    let files = [
        stream::Input { recording: a, slots: by_a, window: window(a), origin: origin_a },
        stream::Input { recording: b, slots: by_b, window: window(b), origin: origin_b },
    ];
    let (damages, stopped_early) = stream::run(files, options, &mut channels, &mut watch)?;
    comparison.damages = damages;
    for recording in [a, b] {
        let known = comparison.damages.iter().any(|(path, _)| *path == recording.path);
        if !known {
            let damages = recording.damages.iter().map(|damage| (recording.path.clone(), damage.clone()));
            comparison.damages.extend(damages);
        }
        if recording.is_partial() {
            comparison.partial.push(recording.path.clone());
        }
    }
    comparison.stopped_early = stopped_early;
    comparison.channels = channels.into_iter().map(align::Aligner::report).collect();
    comparison.gaps = gaps(&comparison, options);
    Ok(comparison)
}

/// What was to be compared and could not be; that nothing was, only if nothing else says why.
fn gaps(comparison: &Comparison, options: &Options) -> Vec<Gap> {
    let mut gaps: Vec<Gap> = comparison.channels.iter().flat_map(ChannelReport::gaps).collect();
    let values: u64 = comparison.channels.iter().map(ChannelReport::values).sum();
    if values > 0 || !gaps.is_empty() || comparison.is_different() {
        return gaps;
    }
    let messages: u64 = comparison.channels.iter().flat_map(|channel| channel.messages).sum();
    let why = match (comparison.channels.is_empty(), messages) {
        (true, _) if !comparison.derived.is_empty() => {
            let topics: Vec<&str> = comparison.derived.iter().map(String::as_str).collect();
            format!(
                "all topics are derived from others; name those to compare (--topic {})",
                topics.join(",")
            )
        }
        (true, _) if options.rules.rules.iter().any(|rule| rule.tolerance.ignore) => {
            "--ignore leaves no topic".into()
        }
        (true, _) => "neither recording has a topic".into(),
        (false, 0) => match (options.window.from, options.window.to) {
            (None, None) => "neither recording has a message".into(),
            (from, to) => {
                let from = from.map_or(String::new(), |from| format!(" from {from}"));
                let to = to.map_or(String::new(), |to| format!(" to {to}"));
                format!("neither recording has a message at times{from}{to}; `info` shows their times")
            }
        },
        (false, _) => "no field that was chosen has a value (--topic, --field, --ignore, --skip-nan)".into(),
    };
    gaps.push(Gap::Nothing(why));
    gaps
}

/// Why a comparison failed.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// A file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A topic or field that was asked for is in neither recording: to call them equal would be no answer.
    #[error("neither recording has a {what} `{pattern}`")]
    Unknown {
        /// Topic or field.
        what: &'static str,
        /// As it was asked for.
        pattern: String,
    },
    /// More fields than there is memory to measure.
    #[error(
        "the recordings have {fields} fields, too many to compare at once; choose some (--topic), or raise --max-memory"
    )]
    Fields {
        /// Fields that both have.
        fields: usize,
    },
    /// A message that is too large to hand on to the comparison.
    #[error("a message of {bytes} bytes is too large to be compared; raise --max-memory")]
    TooLarge {
        /// Its length.
        bytes: usize,
    },
    /// Messages of the recordings are in orders so different that there is no memory to wait for counterparts.
    #[error(
        "messages of `{topic}` are too far from their counterparts in the other recording to be kept until those come; \
         compare that topic alone (--topic), or raise --max-memory"
    )]
    Waiting {
        /// Topic.
        topic: String,
    },
    /// Somebody who watched could not go on.
    #[error("{0}")]
    Watch(String),
}

/// Memory that comparing a field takes: sums, places, recent samples, numbers of the last message \[bytes\].
const FIELD: usize = 4096;

fn needs_scale(a: &Recording, pair: &structure::Pair, rules: &Rules) -> bool {
    let channel = &a.channels[&pair.a];
    let Some(layout) = &channel.layout else { return false };
    let rule = |leaf: usize| rules.of(&channel.topic, &layout.leaves[leaf].path);
    pair.leaves.iter().any(|&(leaf, _)| rule(leaf).is_some_and(|rule| rule.tolerance.needs_scale()))
}

/// Scale of every field of the reference over the time compared, by channel and leaf.
fn scales(
    a: &Recording,
    pairs: &[structure::Pair],
    options: &Options,
    window: Option<(u64, u64)>,
) -> Result<HashMap<(u16, usize), Scale>, OpenError> {
    let mut scales: HashMap<(u16, usize), Scale> = HashMap::new();
    let starts: HashMap<u16, Option<Start>> =
        pairs.iter().map(|pair| (pair.a, pair.starts.map(|[start, _]| start))).collect();
    let mut messages = a.messages(starts.keys().copied(), window)?;
    let mut values = HashMap::new();
    let mut numbers = Vec::new();
    messages.for_each(|message| -> Result<(), OpenError> {
        let channel: &Channel = &a.channels[&message.channel];
        let Some(layout) = &channel.layout else { return Ok(()) };
        let values = values.entry(message.channel).or_insert_with(|| layout.values());
        let time = clock::time(channel, starts[&message.channel], message.data, message.log_time);
        if !options.window.holds(time) || layout.decode(message.data, values).is_err() {
            return Ok(());
        }
        for (leaf, list) in values.lists.iter().enumerate() {
            if list.numbers(&mut numbers) {
                scales.entry((message.channel, leaf)).or_default().add(&numbers);
            }
        }
        values.release();
        Ok(())
    })?;
    Ok(scales)
}
