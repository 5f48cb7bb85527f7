//! A field that both recordings have, measured message by message.

use super::{
    convert::Converter,
    measure::{Location, Measure},
    meter::{Meter, Sample},
    options::Options,
    report::{ChannelReport, FieldReport},
    resample::common,
    structure::WHOLE,
    sums::Scale,
};
use crate::{
    axis::Axis,
    channel::Channel,
    convention,
    wire::{Layout, Leaf, List, Values},
};

/// A field of a pair of channels.
pub(super) struct ComparedField {
    leaf: Leaf,
    unit: Option<String>,
    pub(super) leaf_a: usize,
    leaf_b: usize,
    axis_a: Axis,
    axis_b: Axis,
    even: bool,
    pub(super) ignored: bool,
    /// It only describes axes of the others.
    is_axis_part: bool,
    /// It only says when or in which message the others are.
    pub(super) is_key: bool,
    /// Values were compared that stand between elements.
    is_resampled: bool,
    pub(super) meter: Meter,
}

impl ComparedField {
    /// The fields of two channels.
    ///
    /// * `leaves`: those of both
    /// * `converter`: what puts the new channel into the units of the reference
    /// * `known`: scale of a leaf over the whole reference, if a tolerance needs it
    pub(super) fn all(
        [a, b]: [&Channel; 2],
        [layout_a, layout_b]: [&Layout; 2],
        leaves: &[(usize, usize)],
        converter: &Converter,
        options: &Options,
        known: impl Fn(usize) -> Option<Scale>,
    ) -> Vec<Self> {
        let axis_parts = [a.axis_parts(), b.axis_parts()];
        let field = |&(leaf_a, leaf_b): &(usize, usize)| {
            let leaf = layout_a.leaves[leaf_a].clone();
            let path = leaf.path.as_str();
            let axis_a = Axis::of(leaf_a, layout_a, a);
            Self {
                unit: a.unit(path).map(str::to_owned),
                leaf_a,
                leaf_b,
                axis_b: converter.axis(Axis::of(leaf_b, layout_b, b), &axis_a),
                axis_a,
                even: convention::is_even(&a.metadata, path),
                is_axis_part: axis_parts.iter().any(|parts| parts.contains(path)),
                is_key: is_key(layout_a, leaf_a),
                ..Self::of(&a.topic, leaf, options, known(leaf_a))
            }
        };
        leaves.iter().map(field).collect()
    }

    /// Whole messages of a topic, compared as bytes.
    pub(super) fn whole(topic: &str, options: &Options) -> Self {
        Self::of(topic, Leaf::whole(WHOLE), options, None)
    }

    /// The first leaf of both, without a unit or an axis.
    fn of(topic: &str, leaf: Leaf, options: &Options, known: Option<Scale>) -> Self {
        // keys and counts say which values belong together: nothing is allowed of them
        let rule = options.rules.of(topic, &leaf.path).filter(|_| !leaf.is_key).cloned();
        Self {
            unit: None,
            leaf_a: 0,
            leaf_b: 0,
            axis_a: Axis::Unknown,
            axis_b: Axis::Unknown,
            even: false,
            ignored: !options.compares(topic, &leaf.path),
            is_axis_part: false,
            is_key: false,
            is_resampled: false,
            meter: Meter::new(rule, known, options.nan),
            leaf,
        }
    }

    /// Measures the field in a message of each recording; true if its axes differ.
    ///
    /// * `interpolated`: `b` stands between two messages, and fields that say which message it is are not compared
    /// * `starts`: where the times of both count from
    pub(super) fn measure(
        &mut self,
        a: &Values,
        b: &Values,
        place: &Location,
        interpolated: bool,
        starts: Option<[f64; 2]>,
    ) -> bool {
        let (list_a, list_b) = (&a.lists[self.leaf_a], &b.lists[self.leaf_b]);
        if self.is_unseen(interpolated, starts.is_some()) {
            // their scale is still wanted
            self.meter.take_same(list_a, place.clone());
            return false;
        }
        if let Some(starts) = starts.filter(|_| self.leaf.path == convention::TIME && self.leaf.is_single)
            && let (Some(a), Some(b)) = (list_a.number(0), list_b.number(0))
        {
            let [a, b] = since(starts, [a, b]).map(|time| List::Double(vec![time]));
            self.meter.take(&a, &b, &Sample { place: place.clone(), position: &|_| None });
            return false;
        }
        let axis = &self.axis_a;
        let (sides, names) = (axis.sides(a, list_a.len()), axis.coordinates());
        let position = |index: usize| match sides.as_slice() {
            [side] if index < side.length() => Some(format!("{} = {}", names[0], side.at(index))),
            [rows, columns] => {
                let width = columns.length().max(1);
                let (z, r) = (rows.at(index / width), columns.at(index % width));
                Some(format!("{} = {z}, {} = {r}", names[0], names[1]))
            }
            _ => None,
        };
        let sample = |position| Sample { place: place.clone(), position };
        let axes = [(list_a, axis, a), (list_b, &self.axis_b, b)];
        let Some(common) = common(axes, self.even, interpolated) else {
            self.meter.take(list_a, list_b, &sample(&position));
            return false;
        };
        self.meter.measure.dropped += common.dropped as u64;
        if common.a.is_empty() && !(list_a.is_empty() && list_b.is_empty()) {
            self.meter.measure.apart += 1;
        } else {
            let position = |i: usize| position(*common.chosen.get(i)?);
            let [a, b] = [common.a, common.b].map(List::Double);
            self.meter.take(&a, &b, &sample(&position));
        }
        self.is_resampled |= common.axes_differ;
        common.axes_differ
    }

    /// True if two messages of the new recording are the same in it as far as it is not interpolated.
    pub(super) fn is_alike(&self, b: &Values, other: &Values) -> bool {
        let (list, other) = (&b.lists[self.leaf_b], &other.lists[self.leaf_b]);
        self.ignored || self.is_key || matches!(list, List::Double(_) | List::Float(_)) || list == other
    }

    /// Counts elements that were cut off between messages.
    ///
    /// * `cut`: for every leaf of the new recording
    pub(super) fn cut(&mut self, cut: &[usize]) {
        self.meter.measure.dropped += cut[self.leaf_b] as u64;
    }

    /// True if it is compared, and something is allowed of it.
    pub(super) fn is_tolerant(&self) -> bool {
        !self.ignored && !self.is_bitwise()
    }

    fn is_bitwise(&self) -> bool {
        self.meter.rule.as_ref().is_none_or(|rule| rule.tolerance.is_bitwise())
    }

    /// True if it is not compared because it says which message it is: between messages, and as a date where times
    /// count from the start of each recording.
    fn is_unseen(&self, interpolated: bool, relative: bool) -> bool {
        self.is_key && (interpolated || (relative && self.is_stamp()))
    }

    /// True for the stamp of a message, no plain number.
    fn is_stamp(&self) -> bool {
        self.is_key && !matches!(self.leaf.path.as_str(), convention::STEP | convention::TIME)
    }

    /// Ends the comparison.
    ///
    /// * `channel`: what is known of it
    /// * `is_tolerant`: something is allowed of one of its fields
    /// * `between`: messages did not have to belong together one by one
    /// * `relative`: times count from the start of each recording
    pub(super) fn report(
        mut self,
        channel: &ChannelReport,
        is_tolerant: bool,
        between: bool,
        relative: bool,
    ) -> FieldReport {
        self.meter.finish();
        let is_axis_part = self.is_axis_part && channel.axes_differ && is_tolerant;
        let is_unseen = self.is_unseen(between, relative);
        let ignored = self.ignored || is_axis_part || is_unseen;
        let is_between = self.is_resampled || (channel.interpolated && !(self.is_axis_part && is_tolerant));
        let is_bitwise = self.is_bitwise() && !self.leaf.is_key;
        let untolerated = !ignored && is_between && is_bitwise && self.meter.measure.elements > 0;
        // what lies beyond the other's axes was not compared
        let Measure { dropped, elements, apart, .. } = self.meter.measure;
        let lacks_elements = !channel.common && dropped > 0 && (elements > 0 || apart == 0);
        FieldReport {
            untolerated,
            unseen_stamp: is_unseen && self.is_stamp() && !self.ignored,
            within: ignored || (self.meter.is_within() && !untolerated && !lacks_elements),
            leaf: self.leaf,
            unit: self.unit,
            ignored,
            rule: self.meter.rule,
            measure: self.meter.measure,
        }
    }
}

/// Times from the starts of both recordings; the same if they agree up to the rounding of the times themselves.
fn since([start_a, start_b]: [f64; 2], [a, b]: [f64; 2]) -> [f64; 2] {
    let (x, y) = (a - start_a, b - start_b);
    let rounding = 4.0 * f64::EPSILON * a.abs().max(b.abs());
    if (x - y).abs() <= rounding { [x, x] } else { [x, y] }
}

/// Fields that say which message it is, and when: `step`, `time`, and those of type `google.protobuf.Timestamp` that are stamps of the
/// message by their names.
fn is_key(layout: &Layout, index: usize) -> bool {
    let leaf = &layout.leaves[index];
    let parent = layout.way(index).last().map(|slot| slot.field.parent_message().full_name());
    matches!(leaf.path.as_str(), convention::STEP | convention::TIME)
        || (leaf.lists == 0 && parent == Some("google.protobuf.Timestamp") && layout.is_stamp(index))
}
