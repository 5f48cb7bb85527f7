//! What is seen of a recording, the same for pictures, films and pages: numbers over time, fewer points of curves, the part of a
//! section, its levels, and the units in which numbers are best read.

use std::{collections::BTreeSet, ops::Range};

use percuss_canvas as canvas;
use percuss_picture::Side;
use percuss_table::Heading;
use serde_json::Value;

use crate::{
    axis::Axis,
    channel::Channel,
    convention::{FIELD_STRESS, FIELDS},
    messages::Recording,
    pass::Pass,
    prefix::Prefixed,
    slice::Slice,
    units::Units,
};

/// Points of a curve that is drawn, at most; longer ones keep the extremes of every stretch.
const POINTS: usize = 1200;
/// Share of the range of the colours above which a value makes its row and column part of the picture.
const SEEN: f64 = 0.01;
/// A part of the section larger than this is not worth a picture of its own.
const LARGEST_PART: f64 = 0.8;
/// Values of a frame that the range of colours is estimated from, at most.
const SAMPLES: usize = 10_000;
/// Of all frames, at most: half of them are kept beyond that.
const ALL_SAMPLES: usize = 1 << 20;
/// Share of the values of all frames that the colours distinguish, where the recording does not say their range.
const SHOWN: f64 = 0.995;
/// Room around the part of a section that is shown, relative to its size.
const ROOM: f64 = 1.05;

/// A curve: times and values.
pub(super) type Curve = Vec<(f64, f64)>;

/// A channel that has messages, by its topic.
pub(super) fn find(recording: &Recording, fits: impl Fn(&str) -> bool) -> Option<u16> {
    let fits = |channel: &Channel| channel.count > 0 && channel.layout.is_some() && fits(&channel.topic);
    recording.channels.iter().find(|(_, channel)| fits(channel)).map(|(id, _)| *id)
}

/// A channel that has messages, and the leaf of one of its fields.
pub(super) fn find_leaf(recording: &Recording, topic: &str, field: &str) -> Option<(u16, usize)> {
    let id = find(recording, |known| known == topic)?;
    Some((id, recording.channels[&id].layout.as_ref()?.find(field)?))
}

/// Some fields of a channel over time.
#[derive(Default)]
pub(super) struct Points {
    id: u16,
    /// Their names and leaves, with a curve for every element.
    fields: Vec<(&'static str, usize, Vec<Curve>)>,
}

impl Points {
    /// Nothing yet of those fields that there are; recordings of earlier versions have fewer.
    pub(super) fn of(recording: &Recording, topic: &str, names: &[&'static str]) -> Self {
        let Some(id) = find(recording, |known| known == topic) else { return Self::default() };
        let layout = recording.channels[&id].layout.as_deref();
        let field = |name: &&'static str| Some((*name, layout?.find(name)?, Vec::new()));
        Self { id, fields: names.iter().filter_map(field).collect() }
    }

    pub(super) fn watch<'a>(&'a mut self, recording: &'a Recording, pass: &mut Pass<'a>) {
        let Self { id, fields } = self;
        if fields.is_empty() {
            return;
        }
        let mut numbers = Vec::new();
        pass.each(*id, move |moment, budget| {
            for (_, leaf, curves) in fields.iter_mut() {
                if !moment.values.lists[*leaf].numbers(&mut numbers) {
                    continue;
                }
                // a list grows to twice its length
                if !budget.spend(2 * size_of::<(f64, f64)>() * numbers.len()) {
                    return Err(recording.no_room("the points of the curves"));
                }
                curves.resize_with(curves.len().max(numbers.len()), Curve::new);
                let points = numbers.iter().map(|number| (moment.time, *number));
                curves.iter_mut().zip(points).for_each(|(curve, point)| curve.push(point));
            }
            Ok(())
        });
    }

    /// The curves of a field, one for each of its elements; none if it is not recorded.
    pub(super) fn curves(&self, name: &str) -> &[Curve] {
        self.fields.iter().find(|(known, ..)| *known == name).map_or(&[], |(.., curves)| curves)
    }

    /// The curve of a field of single numbers.
    pub(super) fn curve(&self, name: &str) -> &[(f64, f64)] {
        self.curves(name).first().map_or(&[], Vec::as_slice)
    }
}

/// The point of a curve, or whatever else is at places in their order, nearest to a place; of two that are equally near, the first.
///
/// * `is_lower`: of two at the place the second is meant
pub(super) fn nearest_point<T: Copy>(curve: &[(f64, T)], (place, is_lower): (f64, bool)) -> Option<(f64, T)> {
    let next = curve.partition_point(|point| point.0 < place || (is_lower && point.0 == place));
    let around = [next.checked_sub(1), Some(next)].into_iter().flatten().filter_map(|i| curve.get(i));
    let distance = |point: &&(f64, T)| (point.0 - place).abs();
    around.min_by(|a, b| distance(a).total_cmp(&distance(b))).copied()
}

/// The value of a curve at the point nearest to every time; NaN where it has none.
pub(super) fn nearest(curve: &[(f64, f64)], times: &[f64]) -> Vec<f64> {
    times.iter().map(|at| nearest_point(curve, (*at, false)).map_or(f64::NAN, |point| point.1)).collect()
}

/// The field that is shown first: the stress if it is recorded, else what there is.
pub(super) fn main_field(recording: &Recording) -> Option<(u16, usize)> {
    let stress = find(recording, |topic| topic == FIELD_STRESS);
    let id = stress.or_else(|| find(recording, |topic| topic.starts_with(FIELDS)))?;
    Axis::matrices(&recording.channels[&id]).next().map(|leaf| (id, leaf))
}

/// The largest magnitude in every row and column of matrices, from their first ones on.
#[derive(Default)]
pub(super) struct Peaks {
    rows: Vec<f64>,
    columns: Vec<f64>,
}

impl Peaks {
    /// Takes a matrix.
    ///
    /// * `values`: row-major
    /// * `width`: its columns
    pub(super) fn take(&mut self, values: &[f64], width: usize) {
        let rows = values.chunks_exact(width.max(1));
        self.rows.resize(self.rows.len().max(rows.len()), 0.0);
        self.columns.resize(self.columns.len().max(width), 0.0);
        for (row, largest) in rows.zip(&mut self.rows) {
            for (value, column) in row.iter().zip(&mut self.columns) {
                *largest = largest.max(value.abs());
                *column = column.max(value.abs());
            }
        }
    }

    /// The rows and the columns from the first to the last with a value above `least`; empty without any.
    pub(super) fn above(&self, least: f64) -> [Range<usize>; 2] {
        [&self.rows, &self.columns].map(|peaks| {
            let is_seen = |peak: &f64| *peak > least;
            let first = peaks.iter().position(is_seen).unwrap_or(peaks.len());
            first..peaks.iter().rposition(is_seen).map_or(first, |last| last + 1)
        })
    }
}

/// How far the frames reach, and how large their values are.
#[derive(Default)]
pub(super) struct Bounds {
    /// All of it.
    pub whole: Section,
    peaks: Peaks,
    /// The largest frame, without its values.
    pub largest: Option<Slice>,
    samples: Vec<f64>,
}

impl Bounds {
    pub(super) fn take(&mut self, slice: Slice) {
        let (columns, rows) = (&slice.columns, &slice.rows);
        self.whole.width = self.whole.width.max(end(columns, columns.length()));
        self.whole.depth = self.whole.depth.max(rows.at(rows.length().saturating_sub(1)));
        self.whole.top = self.whole.top.min(rows.at(0));
        self.peaks.take(&slice.values, columns.length());
        let step = slice.values.len().div_ceil(SAMPLES).max(31);
        let values = slice.values.iter().step_by(step).map(|value| value.abs());
        self.samples.extend(values.filter(|value| *value > 0.0 && value.is_finite()));
        if self.samples.len() > ALL_SAMPLES {
            let mut number = 0_u8;
            self.samples.retain(|_| {
                number ^= 1;
                number == 1
            });
        }
        let size = |slice: &Slice| slice.rows.length() * slice.columns.length();
        if self.largest.as_ref().is_none_or(|known| size(&slice) > size(known)) {
            self.largest = Some(Slice { values: Vec::new(), ..slice });
        }
    }

    /// The value that the share of those to be distinguished does not exceed.
    pub(super) fn quantile(&mut self) -> Option<f64> {
        self.samples.sort_by(f64::total_cmp);
        self.samples.get((self.samples.len() as f64 * SHOWN) as usize).copied()
    }

    /// The part of the section with values above a share of the range; `None` if that is most of it, or nothing.
    pub(super) fn part(&self, range: f64) -> Option<Section> {
        let [rows, columns] = self.peaks.above(SEEN * range);
        let Slice { rows: row_side, columns: column_side, .. } = self.largest.as_ref()?;
        if rows.is_empty() {
            return None;
        }
        let (width, depth) = (end(column_side, columns.end), end(row_side, rows.end));
        let part = Section {
            top: (ROOM * row_side.at(rows.start)).clamp(self.whole.top, 0.0),
            width: (ROOM * width).min(self.whole.width),
            depth: (ROOM * depth).min(self.whole.depth),
        };
        (part.width * part.height() < LARGEST_PART * self.whole.width * self.whole.height()).then_some(part)
    }
}

/// Where the elements of a side end, of which there are `length`: a step beyond the last, unless they are listed.
fn end(side: &Side, length: usize) -> f64 {
    match side {
        Side::Even { .. } => side.at(length),
        Side::Listed(_) => side.at(length.saturating_sub(1)),
    }
}

/// A section from the axis on, and from the surface or the top of an indenter that has a field too.
#[derive(Clone, Copy, Default)]
pub(super) struct Section {
    /// Depth of its upper side, 0 or negative.
    pub top: f64,
    /// Out from the axis.
    pub width: f64,
    /// Down from the surface.
    pub depth: f64,
}

impl Section {
    /// From its upper side down.
    pub(super) fn height(&self) -> f64 {
        self.depth - self.top
    }
}

/// A section as pixels of the colours of pictures; what is cut off is at rest.
///
/// * `top`: depth of its upper side
pub(super) fn raster(
    slice: &Slice,
    (rows, columns): (usize, usize),
    (pixel, top): (f64, f64),
    range: f64,
) -> Vec<u8> {
    let shown =
        |side: &Side, from: f64, count: usize| side.pixels((from, from + count as f64 * pixel), count);
    let section = canvas::Section {
        columns: shown(&slice.columns, 0.0, columns),
        rows: shown(&slice.rows, top, rows),
        ..canvas::Section::default()
    };
    let mut raster = canvas::Raster::new(columns, rows);
    raster.pixels.fill(canvas::colour(canvas::ZERO));
    let value = |row: usize, column: usize| slice.values[row * slice.columns.length() + column];
    section
        .paint(&mut raster, |row, column| canvas::level((value(row, column) / range * canvas::SIDE) as f32));
    raster.pixels
}

/// The smallest and the largest point of every stretch, in their order.
pub(super) fn downsampled(points: &[(f64, f64)]) -> Curve {
    if points.len() <= POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(POINTS / 2);
    let extremes = |points: &[(f64, f64)]| {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (low, high) = (points.iter().min_by(by_value), points.iter().max_by(by_value));
        let mut pair: Curve = low.into_iter().chain(high).copied().collect();
        pair.sort_by(|a, b| a.0.total_cmp(&b.0));
        pair.dedup();
        pair
    };
    points.chunks(stretch).flat_map(extremes).collect()
}

/// Some points of a profile, the last among them: where the edge is the stress is highest.
pub(super) fn thinned(points: &[(f64, f64)], most: usize) -> Curve {
    let (step, last) = (points.len().div_ceil(most).max(1), points.len().saturating_sub(1));
    points.iter().enumerate().filter(|(i, _)| i % step == 0 || *i == last).map(|(_, point)| *point).collect()
}

/// A quantity in the prefixed unit in which its largest number is best read, and the factor of its numbers.
pub(super) fn prefixed(heading: &Heading, largest: f64, units: &Units) -> (Heading, f64) {
    match heading.unit.as_deref().and_then(|unit| units.choose(unit, largest)) {
        Some(Prefixed { factor, unit }) => (Heading { unit: Some(unit), ..heading.clone() }, factor),
        None => (heading.clone(), 1.0),
    }
}

/// Name and unit that all columns share, as far as they do.
pub(super) fn common_label(headings: &[Heading]) -> String {
    let base = |heading: &Heading| {
        let name = heading.name.rsplit(':').next().unwrap_or_default().to_owned();
        let name = name.split(['@', '[']).next().unwrap_or_default().to_owned();
        name.rsplit(['/', '.']).next().unwrap_or_default().to_owned()
    };
    let names: BTreeSet<String> = headings.iter().map(base).collect();
    let units: BTreeSet<Option<&String>> = headings.iter().map(|heading| heading.unit.as_ref()).collect();
    let name =
        if names.len() <= 3 { names.into_iter().collect::<Vec<_>>().join(", ") } else { "value".into() };
    let units: Vec<&str> = units.into_iter().map(|unit| unit.map_or("1", String::as_str)).collect();
    match units.as_slice() {
        [] | ["1"] => name,
        units => format!("{name} [{}]", units.join(", ")),
    }
}

/// An axis: its label, and the unit in which its numbers are best read.
#[derive(Clone, Debug, Default)]
pub(super) struct Scale {
    /// Name and unit.
    pub label: String,
    /// The unit with its prefix; none for numbers that stay as they are.
    pub unit: Option<Prefixed>,
}

impl Scale {
    /// Of quantities on one axis, whose numbers have a prefix if they have one unit.
    ///
    /// * `largest`: largest number on it by magnitude
    /// * `chosen`: units that are chosen
    pub(super) fn of(headings: &[Heading], largest: f64, chosen: &Units) -> Self {
        let mut units: Vec<Option<&str>> = headings.iter().map(|heading| heading.unit.as_deref()).collect();
        units.dedup();
        let unit = match units.as_slice() {
            [Some(unit)] => chosen.choose(unit, largest),
            _ => None,
        };
        let heading = |heading: &Heading| match &unit {
            Some(unit) => Heading::new(&heading.name, Some(&unit.unit)),
            None => heading.clone(),
        };
        Self { label: common_label(&headings.iter().map(heading).collect::<Vec<_>>()), unit }
    }

    /// The same on a page, where none is chosen.
    ///
    /// * `numbers`: all that stand on it
    pub(super) fn of_page(headings: &[Heading], numbers: impl Iterator<Item = f64>) -> Self {
        Self::of(headings, largest(numbers), &Units::default())
    }

    pub(super) fn number(&self, value: f64) -> Value {
        number(self.unit.as_ref().map_or(value, |unit| unit.apply(value)))
    }

    pub(super) fn numbers(&self, values: impl IntoIterator<Item = f64>) -> Vec<Value> {
        values.into_iter().map(|value| self.number(value)).collect()
    }

    pub(super) fn name(&self) -> Option<&str> {
        self.unit.as_ref().map(|unit| unit.unit.as_str())
    }
}

/// The largest magnitude among numbers that can be drawn.
pub(super) fn largest(numbers: impl Iterator<Item = f64>) -> f64 {
    numbers.map(f64::abs).filter(|number| number.is_finite()).fold(0.0, f64::max)
}

/// A number as short as six digits allow; `null` if it is none.
pub(super) fn number(value: f64) -> Value {
    format!("{value:.5e}").parse::<f64>().ok().filter(|value| value.is_finite()).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_part_is_where_values_are_above_a_hundredth() {
        let side = |length| Side::Even { start: 0.0, step: 0.5, length };
        let bounds = |seen: usize| {
            let mut bounds = Bounds::default();
            for frame in [1, 2] {
                // 0.02 is the farthest out of the second frame, 0.005 is not seen in any
                let mut values = vec![0.0; 100 * 40];
                (values[0], values[39]) = (1.0, 0.005);
                values[3 * 40 + seen / frame] = 0.02;
                bounds.take(Slice { rows: side(100), columns: side(40), values, ..Slice::default() });
            }
            bounds
        };
        let part = bounds(8).part(1.0).expect("a part");
        assert!((part.width - 1.05 * 4.5).abs() < 1e-12 && (part.depth - 1.05 * 2.0).abs() < 1e-12);
        assert!(bounds(8).part(1e3).is_none(), "nothing is seen");
        assert!(bounds(8).part(0.0).is_some());
        let mut all = bounds(8);
        all.peaks.take(&vec![1.0; 100 * 40], 40);
        assert!(all.part(1.0).is_none(), "most of it");
    }

    #[test]
    fn pixels_show_the_nearest_node() {
        let side = |length| Side::Even { start: 0.0, step: 1.0, length };
        let values = vec![1.0, -1.0, 0.5, f64::NAN];
        let slice = Slice { rows: side(2), columns: side(2), values, ..Slice::default() };
        // pixels of half a unit: their middles are at 0.25, 0.75, 1.25, …
        let levels = raster(&slice, (3, 4), (0.5, 0.0), 1.0);
        assert_eq!(levels[..4], [254, 2, 2, 128].map(canvas::colour));
        assert_eq!(levels[4..8], [191, 0, 0, 128].map(canvas::colour));
    }

    #[test]
    fn downsampling_keeps_the_extremes() {
        let mut points: Curve = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[77_777].1 = 5.0;
        points[33_333].1 = -5.0;
        let fewer = downsampled(&points);
        assert!(fewer.len() <= POINTS + 2);
        assert!(fewer.contains(&(77_777.0, 5.0)) && fewer.contains(&(33_333.0, -5.0)));
        assert!(fewer.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn the_nearest_point_counts() {
        let curve = [(0.0, 1.0), (1.0, 2.0), (2.0, 3.0)];
        assert_eq!(nearest(&curve, &[-1.0, 0.5, 0.6, 9.0]), [1.0, 1.0, 2.0, 3.0]);
        assert!(nearest(&[], &[0.0])[0].is_nan());
        let interface = [(0.0, 1.0), (1.0, 2.0), (1.0, 3.0), (1.5, 4.0)];
        let sides = [false, true].map(|is_lower| nearest_point(&interface, (1.0, is_lower)));
        assert_eq!(sides, [Some((1.0, 2.0)), Some((1.0, 3.0))]);
    }

    #[test]
    fn numbers_of_a_page_are_short_and_in_the_unit_that_is_best_read() {
        let scale = Scale::of_page(&[Heading::new("force", Some("N"))], [0.0, -1.5e6].into_iter());
        assert_eq!((scale.label.as_str(), scale.name()), ("force [MN]", Some("MN")));
        assert_eq!(scale.numbers([1_234_567.0, f64::NAN]), [Value::from(1.23457), Value::Null]);
        let plain = Scale::of_page(&[Heading::new("r", Some("R"))], [2.0].into_iter());
        assert_eq!((plain.label.as_str(), plain.name(), plain.number(2.0)), ("r [R]", None, 2.0.into()));
        let two = [Heading::new("kinetic", Some("J")), Heading::new("force", Some("N"))];
        assert_eq!(Scale::of_page(&two, [5e6].into_iter()).name(), None);
    }
}
