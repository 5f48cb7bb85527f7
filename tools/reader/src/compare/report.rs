//! What a comparison found.

use std::{collections::BTreeSet, path::PathBuf};

use super::{
    measure::{Divergence, Location, Measure},
    mode::Mode,
    structure::{Change, Finding},
    tolerance::Rule,
};
use crate::{instant::Instant, messages::Recording, recording::Damage, wire::Leaf};

/// What a comparison found.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Differences of structure.
    pub structure: Vec<Finding>,
    /// Differences that are not compared: of metadata, attachments, names of enums, headers of messages.
    pub provenance: Vec<Change>,
    /// Channels that both have.
    pub channels: Vec<ChannelReport>,
    /// Topics left out because they show what others hold; they are compared if they are named.
    pub derived: BTreeSet<String>,
    /// Residuals of rounding that are not compared; they are if they are named.
    pub residuals: BTreeSet<String>,
    /// What is damaged, by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Recordings that did not come to their planned end.
    pub partial: Vec<PathBuf>,
    /// True if not everything was compared, because of [`super::Options::fail_fast`].
    pub stopped_early: bool,
    /// What was to be compared and could not be: to call it equal would be no answer.
    pub gaps: Vec<String>,
    /// For every rule, whether it fits a topic or field of the recordings.
    pub fitting: Vec<bool>,
    /// How the new recording was put into the units of the reference, if that was needed.
    pub converted: Option<Converted>,
    /// What was added to the times of the new recording.
    pub offset: Option<f64>,
}

/// How a recording was put into other units.
#[derive(Clone, Copy, Debug)]
pub enum Converted {
    /// From SI into dimensionless numbers, by its own scales.
    FromSi,
    /// From dimensionless numbers into SI, by the scales of the reference.
    ToSi,
}

impl Converted {
    /// The same in words.
    ///
    /// * `a`, `b`: names of reference and new recording
    pub(crate) fn text(self, a: &str, b: &str) -> String {
        match self {
            Self::FromSi => format!("{b} is converted from SI by its scales"),
            Self::ToSi => format!("{b} is converted to SI by the scales of {a}"),
        }
    }
}

/// How two recordings or channels compare.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The same bit for bit.
    #[default]
    Equal,
    /// Within tolerance.
    Within,
    /// Something that was to be compared could not be, and nothing else is beyond tolerance.
    NotCompared,
    /// Beyond tolerance.
    Different,
}

impl Verdict {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Equal => "equal",
            Self::Within => "within tolerance",
            Self::NotCompared => "NOT COMPARED",
            Self::Different => "DIFFERENT",
        }
    }

    /// True if something is different, or was not compared.
    pub fn has_failed(self) -> bool {
        self >= Self::NotCompared
    }
}

impl Comparison {
    /// Adds what is known of the state of a recording: its damages, if the comparison met none, and whether it is partial.
    pub(super) fn add_state(&mut self, recording: &Recording) {
        let path = &recording.path;
        if !self.damages.iter().any(|(known, _)| known == path) {
            self.damages.extend(recording.damages.iter().map(|damage| (path.clone(), damage.clone())));
        }
        if recording.is_partial() {
            self.partial.push(path.clone());
        }
    }

    /// Adds what differs of the headers of messages, once for all channels.
    pub(super) fn add_stamps(&mut self) {
        for (i, (what, unit)) in
            [("log time", " ns"), ("publish time", " ns"), ("sequence", "")].iter().enumerate()
        {
            let stamps = self.channels.iter().map(|channel| (&channel.topic, channel.stamps[i]));
            let differing: Vec<_> = stamps.filter(|(_, stamp)| stamp.count > 0).collect();
            let Some((topic, Stamp { first: Some((a, b)), .. })) = differing.first() else { continue };
            let messages: u64 = differing.iter().map(|(_, stamp)| stamp.count).sum();
            self.provenance.push(Change {
                place: (*what).into(),
                key: format!("of {messages} messages, first of {topic}"),
                a: Some(format!("{a}{unit}")),
                b: Some(format!("{b}{unit}")),
            });
        }
    }

    /// Stamps of messages that are not compared, as topic.field.
    pub fn unseen_stamps(&self) -> Vec<String> {
        let of_channel = |channel: &ChannelReport| {
            let fields = channel.fields.iter().filter(|field| field.unseen_stamp);
            fields.map(|field| format!("{}.{}", channel.topic, field.leaf.path)).collect::<Vec<_>>()
        };
        self.channels.iter().flat_map(of_channel).collect()
    }

    /// Values compared, how many of them differ, and how many are beyond tolerance.
    pub(crate) fn counts(&self) -> [u64; 3] {
        let channels = self.channels.iter().map(ChannelReport::counts);
        channels.fold([0; 3], |sums, counts| [0, 1, 2].map(|i| sums[i] + counts[i]))
    }

    /// Verdict on all that was to be compared.
    pub fn verdict(&self) -> Verdict {
        let structure = if self.structure.is_empty() { Verdict::Equal } else { Verdict::Different };
        let gaps = if self.gaps.is_empty() { Verdict::Equal } else { Verdict::NotCompared };
        let channels = self.channels.iter().map(ChannelReport::verdict);
        channels.fold(structure.max(gaps), Verdict::max)
    }

    /// What is damaged or did not come to its planned end: which of both, in words, and what is compared.
    pub(crate) fn losses(&self) -> Vec<(&'static str, String, &'static str)> {
        let damages = self.damages.iter().map(|(path, damage)| {
            let line = format!("{}: {} (at byte {})", path.display(), damage.reason, damage.offset);
            ("damaged", line, "the sound part is compared")
        });
        let partial = self.partial.iter().map(|path| {
            let line = format!("{} did not come to its planned end", path.display());
            ("partial", line, "what there is is compared")
        });
        damages.chain(partial).collect()
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
        all.min_by(|x, y| x.2.place.time.total_cmp(y.2.place.time))
    }
}

/// What allows a difference that is one only because no tolerance is given.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Hint {
    /// Messages of other times.
    #[error(
        "without a tolerance only messages of the same step or exact time are compared; \
         --align linear --l2-rel … allows interpolated values"
    )]
    Between,
    /// Values between messages or elements.
    #[error("without a tolerance nothing interpolated is equal; give one, as --align linear --l2-rel …")]
    Tolerance,
    /// Messages or elements that only one recording has.
    #[error(
        "what only one recording has is not compared: --from and --to choose the times that are, --common only those that both \
         recordings have"
    )]
    Common,
    /// Recordings without any time in common.
    #[error(
        "without a tolerance times are not moved; --align relative counts them from the start of each recording"
    )]
    Relative,
}

/// Headers of messages that were compared and that differ in a number which does not take part.
#[derive(Clone, Copy, Debug, Default)]
pub struct Stamp {
    pub(super) count: u64,
    /// The numbers of the first of them in both recordings.
    pub(super) first: Option<(u64, u64)>,
}

/// A channel that both recordings have.
#[derive(Clone, Debug, Default)]
pub struct ChannelReport {
    /// Topic.
    pub topic: String,
    /// How messages were aligned; `None` if there was nothing to align.
    pub mode: Option<Mode>,
    /// True if that was chosen by looking at the messages.
    pub automatic: bool,
    /// Times of both recordings from which the times of their messages count; `None` if those are on one clock.
    pub starts: Option<[f64; 2]>,
    /// Samples compared.
    pub compared: u64,
    /// Messages of both without counterpart.
    pub only: [u64; 2],
    /// Earliest message without counterpart: its place, and whether it is the reference's.
    pub first_unmatched: Option<(Location, bool)>,
    /// Messages of the new recording between the times of the reference at which it is compared, by the mode that was asked for.
    pub between: u64,
    /// Messages of both in the window of time that was asked for.
    pub messages: [u64; 2],
    /// First and last time of those.
    pub(crate) spans: [Option<(Instant, Instant)>; 2],
    /// Messages without counterpart are no difference.
    pub common: bool,
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Log times, publish times and sequence numbers of messages compared that differ.
    pub stamps: [Stamp; 3],
    /// Values of the new recording were compared that stand between its messages.
    pub interpolated: bool,
    /// What would allow a difference that is one only because no tolerance is given.
    pub hint: Option<Hint>,
    /// Arrays were compared on the common range of different axes.
    pub axes_differ: bool,
    /// Fields.
    pub fields: Vec<FieldReport>,
}

impl ChannelReport {
    /// True if messages that were to be compared were not.
    pub(super) fn lacks_messages(&self) -> bool {
        self.undecoded > 0 || (!self.common && !self.is_apart() && self.only != [0; 2])
    }

    /// True if messages of other times were compared.
    pub(crate) fn is_between(&self) -> bool {
        self.mode.is_some_and(Mode::is_between)
    }

    /// True if both recordings have messages and interpolation finds no time in common: nothing can be said.
    fn is_apart(&self) -> bool {
        self.is_between() && self.compared == 0 && self.spans.iter().all(Option::is_some)
    }

    /// Verdict on the channel; equal is what both recordings have, all of it and the same bit for bit.
    pub fn verdict(&self) -> Verdict {
        let part = self.only != [0; 2] || self.between > 0 || self.axes_differ || self.interpolated;
        let differs = |FieldReport { ignored, measure, .. }: &FieldReport| {
            !ignored && measure.differing + measure.apart + measure.dropped > 0
        };
        match self {
            _ if self.lacks_messages() || self.fields.iter().any(|field| !field.within) => Verdict::Different,
            _ if self.gaps().next().is_some() => Verdict::NotCompared,
            _ if part || self.fields.iter().any(differs) => Verdict::Within,
            _ => Verdict::Equal,
        }
    }

    /// Values compared, how many of them differ, and how many are beyond tolerance.
    fn counts(&self) -> [u64; 3] {
        let fields = self.fields.iter().filter(|field| !field.ignored);
        fields.fold([0; 3], |[values, differing, beyond], FieldReport { measure, .. }| {
            let compared = measure.elements - measure.skipped;
            [values + compared, differing + measure.differing, beyond + measure.beyond]
        })
    }

    /// Values compared.
    pub(crate) fn values(&self) -> u64 {
        self.counts()[0]
    }

    /// That both recordings have messages, at times of which none is in both, if it is so.
    pub(crate) fn apart(&self) -> Option<String> {
        let span = |span: Option<(Instant, Instant)>| span.map(|(from, to)| (from.number(), to.number()));
        let [(from_a, to_a), (from_b, to_b)] = [span(self.spans[0])?, span(self.spans[1])?];
        let (topic, [count_a, count_b]) = (&self.topic, self.messages);
        self.is_apart().then(|| {
            format!(
                "`{topic}`: no time in common: {count_a} messages from {from_a} to {to_a}, {count_b} from {from_b} to {to_b} in \
                 the new recording; --align relative counts times from the start of each recording"
            )
        })
    }

    /// What was to be compared and could not be: all messages, or all arrays of a field.
    pub(super) fn gaps(&self) -> impl Iterator<Item = String> {
        let elsewhere = |FieldReport { leaf, ignored, measure, .. }: &FieldReport| {
            let is_gap = !ignored && measure.elements == 0 && measure.apart > 0;
            is_gap.then(|| {
                format!(
                    "`{}.{}`: the axes of its arrays have no part in common, in none of {} samples",
                    self.topic, leaf.path, measure.apart
                )
            })
        };
        self.apart().into_iter().chain(self.fields.iter().filter_map(elsewhere))
    }
}

/// A field that both recordings have.
#[derive(Clone, Debug)]
pub struct FieldReport {
    /// The leaf of the reference.
    pub leaf: Leaf,
    pub unit: Option<String>,
    /// Rule that applied; `None` is bitwise.
    pub rule: Option<Rule>,
    /// Not compared: by a rule, or because it only says where and when the others are.
    pub ignored: bool,
    /// Not compared, as it is the stamp of a message, and times count from the start of each recording or lie between messages.
    pub unseen_stamp: bool,
    /// Its values stand between messages or elements, and it has no tolerance: nothing such is equal.
    pub untolerated: bool,
    /// Within tolerance.
    pub within: bool,
    /// How far apart.
    pub measure: Measure,
}
