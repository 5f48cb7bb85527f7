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

use crate::{
    messages::Recording,
    overview::Channel,
    recording::{Damage, Next, OpenError},
    select::Pattern,
    wire::Leaf,
};

/// How to compare.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Topics; all if empty.
    pub topics: Vec<Pattern>,
    /// Patterns of fields; all if empty.
    pub fields: Vec<Pattern>,
    /// Every n-th sample of a channel; 0 and 1 for all.
    pub every: u64,
    /// How messages are brought together; by itself if none.
    pub mode: Option<Mode>,
    /// What is allowed.
    pub rules: Rules,
    /// First time compared.
    pub from: Option<f64>,
    /// Last time compared.
    pub to: Option<f64>,
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
}

impl Options {
    /// True if a field takes part.
    fn compares(&self, topic: &str, field: &str) -> bool {
        let chosen = self.fields.is_empty() || self.fields.iter().any(|pattern| pattern.fits(field));
        chosen && !self.rules.ignores(topic, Some(field))
    }
}

impl Comparison {
    /// True if all that was compared is within tolerance.
    pub fn is_within(&self) -> bool {
        self.structure.is_empty() && self.channels.iter().all(ChannelReport::is_within)
    }

    /// True if all that was compared is the same bit for bit.
    pub fn is_equal(&self) -> bool {
        let same = |field: &FieldReport| field.ignored || (field.measure.differing == 0 && field.within);
        self.is_within() && self.channels.iter().all(|channel| channel.fields.iter().all(same))
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
#[derive(Clone, Debug)]
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
    /// Messages outside the common window of time, where that is not held against them.
    pub outside: u64,
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Arrays were compared on the common range of different axes.
    pub axes_differ: bool,
    /// Fields.
    pub fields: Vec<FieldReport>,
}

impl ChannelReport {
    /// True if the channel is within tolerance.
    pub fn is_within(&self) -> bool {
        self.only_a + self.only_b + self.undecoded == 0 && self.fields.iter().all(|field| field.within)
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
    let (pairs, structure) = structure::pair(a, b, options);
    let provenance = structure::provenance(a, b)?;
    let derived = structure::derived(a, b, options);
    let mut comparison = Comparison { structure, provenance, derived, ..Comparison::default() };
    let scales = if pairs.iter().any(|pair| needs_scale(a, pair, &options.rules)) {
        scales(a, &pairs, options)?
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
    let files = [stream::Input { recording: a, slots: by_a }, stream::Input { recording: b, slots: by_b }];
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
    Ok(comparison)
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
) -> Result<HashMap<(u16, usize), Scale>, OpenError> {
    let mut scales: HashMap<(u16, usize), Scale> = HashMap::new();
    let mut messages = a.messages(pairs.iter().map(|pair| pair.a), a.log_window(options.from, options.to))?;
    let mut values = HashMap::new();
    let mut numbers = Vec::new();
    loop {
        let next = messages.next(|message| {
            let channel: &Channel = &a.channels[&message.channel];
            let Some(layout) = &channel.layout else { return };
            let values = values.entry(message.channel).or_insert_with(|| layout.values());
            let time = channel.time_of(message.data, message.log_time);
            let is_outside =
                options.from.is_some_and(|from| time < from) || options.to.is_some_and(|to| time > to);
            if is_outside || layout.decode(message.data, values).is_err() {
                return;
            }
            for (leaf, list) in values.lists.iter().enumerate() {
                if list.numbers(&mut numbers) {
                    scales.entry((message.channel, leaf)).or_default().add(&numbers);
                }
            }
        })?;
        if !matches!(next, Next::Record(())) {
            return Ok(scales);
        }
    }
}
