//! The field of a report: frames of one byte a pixel, of the part that is worth looking at and of the whole section.

use base64::{Engine, engine::general_purpose::STANDARD};
use percuss_picture::DIVERGING;
use percuss_table::Heading;
use serde_json::{Value, json};

use super::body::Body;
use crate::{
    axis::Axis,
    command::{plot::cut::Peaks, points::find},
    convention::{FIELD_STRESS, FIELDS},
    failure::Failure,
    messages::Recording,
    pass::Pass,
    recording::Damage,
    select::Window,
    slice::{Layer, Side, Slice, slice},
};

/// Frames, at most.
const FRAMES: u64 = 120;
/// Pixels of a frame, at most; of the whole section beside a part of it.
const PIXELS: f64 = 16_000.0;
const WHOLE_PIXELS: f64 = 6_000.0;
/// Share of the range of the colours above which a value makes its row and column part of the picture.
const SEEN: f64 = 0.01;
/// Room around that part, relative to its size.
const ROOM: f64 = 1.05;
/// A part of the section larger than this is not worth a picture of its own.
const LARGEST_PART: f64 = 0.8;
/// Level of the value 0, and levels on either side of it.
const ZERO: f64 = 128.0;
const SIDE: f64 = 126.0;
/// Values of a frame that the range of colours is estimated from, at most.
const SAMPLES: usize = 10_000;
/// Of all frames, at most: half of them are kept beyond that.
const ALL_SAMPLES: usize = 1 << 20;
/// Columns or rows of a frame, at most.
const LONGEST: f64 = 4000.0;
/// Share of the values of all frames that the colours distinguish, where the recording does not say their range.
const SHOWN: f64 = 0.995;

/// How far the frames reach, and how large their values are.
#[derive(Default)]
pub(in crate::command) struct Bounds {
    whole: Section,
    peaks: Peaks,
    /// Rows and columns of the largest frame.
    pub sides: Option<[Side; 2]>,
    samples: Vec<f64>,
    /// Of the values.
    pub unit: Option<String>,
    /// Of the sides.
    pub length_unit: Option<String>,
    /// Of the rows.
    pub coordinate: Option<String>,
}

impl Bounds {
    pub(in crate::command) fn take(&mut self, slice: Slice) {
        let (columns, rows) = (&slice.columns, &slice.rows);
        self.whole.width = self.whole.width.max(end(columns, columns.length()));
        self.whole.depth = self.whole.depth.max(rows.at(rows.length().saturating_sub(1)));
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
        self.unit = slice.unit;
        let [Heading { unit, name, .. }, _] = slice.axes;
        (self.length_unit, self.coordinate) = (unit, Some(name));
        let is_longer = |known: &[Side; 2]| {
            slice.rows.length() * slice.columns.length() > known[0].length() * known[1].length()
        };
        if self.sides.as_ref().is_none_or(is_longer) {
            self.sides = Some([slice.rows, slice.columns]);
        }
    }

    /// The value that the share of those to be distinguished does not exceed.
    pub(in crate::command) fn quantile(&mut self) -> Option<f64> {
        self.samples.sort_by(f64::total_cmp);
        self.samples.get((self.samples.len() as f64 * SHOWN) as usize).copied()
    }

    /// The part of the section with values above a share of the range; `None` if that is most of it, or nothing.
    pub(in crate::command) fn part(&self, range: f64) -> Option<Section> {
        let [rows, columns] = self.peaks.above(SEEN * range);
        let [row_side, column_side] = self.sides.as_ref()?;
        if rows.is_empty() {
            return None;
        }
        let (width, depth) = (end(column_side, columns.end), end(row_side, rows.end));
        let part = Section {
            width: (ROOM * width).min(self.whole.width),
            depth: (ROOM * depth).min(self.whole.depth),
        };
        (part.width * part.depth < LARGEST_PART * self.whole.width * self.whole.depth).then_some(part)
    }
}

/// Where the elements of a side end, of which there are `length`: a step beyond the last, unless they are listed.
fn end(side: &Side, length: usize) -> f64 {
    match side {
        Side::Even { .. } => side.at(length),
        Side::Listed(_) => side.at(length.saturating_sub(1)),
    }
}

/// A section from the axis and the surface on.
#[derive(Clone, Copy, Default)]
pub(in crate::command) struct Section {
    /// Out from the axis.
    pub width: f64,
    /// Down from the surface.
    pub depth: f64,
}

impl Section {
    /// Its picture; `None` for a field as narrow as a line, or of no size at all.
    fn picture(self, pixels: f64) -> Option<Picture> {
        let pixel = (self.width * self.depth / pixels).sqrt();
        let (columns, rows) = ((self.width / pixel).ceil(), (self.depth / pixel).ceil());
        let is_picture = (1.0..=LONGEST).contains(&columns) && (1.0..=LONGEST).contains(&rows);
        let size = (rows as usize, columns as usize);
        is_picture.then_some(Picture { section: self, size, pixel, frames: Vec::new() })
    }
}

/// A section in pixels.
struct Picture {
    section: Section,
    /// Rows and columns.
    size: (usize, usize),
    /// Edge of a pixel.
    pixel: f64,
    frames: Vec<String>,
}

impl Picture {
    /// * `layers`: of the target
    fn json(self, layers: &[Layer]) -> Value {
        let (rows, columns) = self.size;
        let share = |depth: f64| (depth / (rows as f64 * self.pixel)).clamp(0.0, 1.0);
        let layer = |layer: &Layer| json!({ "name": layer.name, "from": share(layer.top), "to": share(layer.bottom) });
        json!({
            "columns": columns,
            "rows": rows,
            "width": self.section.width,
            "depth": self.section.depth,
            "pixel": self.pixel,
            "layers": layers.iter().map(layer).collect::<Vec<_>>(),
            "frames": self.frames,
        })
    }
}

/// The field that is shown first: the stress if it is recorded, else what there is.
pub(in crate::command) fn main_field(recording: &Recording) -> Option<(u16, usize)> {
    let stress = find(recording, |topic| topic == FIELD_STRESS);
    let id = stress.or_else(|| find(recording, |topic| topic.starts_with(FIELDS)))?;
    Axis::matrices(&recording.channels[&id]).next().map(|leaf| (id, leaf))
}

/// The field of a report: first how far its frames reach, then the frames.
pub(super) struct Field<'a> {
    recording: &'a Recording,
    id: u16,
    leaf: usize,
    every: u64,
    bounds: Bounds,
    times: Vec<f64>,
}

impl<'a> Field<'a> {
    pub(super) fn of(recording: &'a Recording) -> Option<Self> {
        let (id, leaf) = main_field(recording)?;
        let every = recording.channels[&id].count.div_ceil(FRAMES);
        Some(Self { recording, id, leaf, every, bounds: Bounds::default(), times: Vec::new() })
    }

    pub(super) fn watch<'b>(&'b mut self, pass: &mut Pass<'b>)
    where
        'a: 'b,
    {
        let channel = &self.recording.channels[&self.id];
        pass.every(self.id, self.every, |moment, _| {
            if let Some(slice) = slice(channel, self.leaf, moment) {
                self.times.push(moment.time);
                self.bounds.take(slice);
            }
            Ok(())
        });
    }

    /// Reads the frames; `null` if there are none. The first of its `views` is what a page begins with.
    ///
    /// * `body`: the indenter at the times of the frames
    pub(super) fn json(self, body: impl FnOnce(&[f64]) -> Body) -> Result<(Value, Vec<Damage>), Failure> {
        let Self { recording, id, leaf, every, mut bounds, times } = self;
        let channel = &recording.channels[&id];
        let none = (Value::Null, Vec::new());
        let Some(quantile) = bounds.quantile() else { return Ok(none) };
        let range = recording.colour_range(&channel.topic).unwrap_or(quantile);
        let part = bounds.part(range).and_then(|part| part.picture(PIXELS));
        let whole = bounds.whole.picture(if part.is_some() { WHOLE_PIXELS } else { PIXELS });
        let mut pictures: Vec<Picture> = part.into_iter().chain(whole).collect();
        if pictures.is_empty() {
            return Ok(none);
        }
        let mut pass = Pass::over(recording, Window::default());
        pass.every(id, every, |moment, _| {
            if let Some(slice) = slice(channel, leaf, moment) {
                for picture in &mut pictures {
                    let levels = raster(&slice, picture.size, picture.pixel, range);
                    picture.frames.push(STANDARD.encode(levels));
                }
            }
            Ok(())
        });
        let damages = pass.run()?.damages;
        let layers = recording.layers(bounds.coordinate.as_deref().unwrap_or_default());
        let field = json!({
            "name": channel.topic,
            "unit": bounds.unit,
            "length_unit": bounds.length_unit,
            "views": pictures.into_iter().map(|picture| picture.json(&layers)).collect::<Vec<_>>(),
            "body": body(&times).json(),
            "range": range,
            "zero": ZERO,
            "side": SIDE,
            "colours": DIVERGING,
            "times": times,
        });
        Ok((field, damages))
    }
}

/// The value at the node nearest to every pixel as a level; what is cut off is at rest.
fn raster(slice: &Slice, (rows, columns): (usize, usize), pixel: f64, range: f64) -> Vec<u8> {
    let node = |pixel_index: usize, side: &Side| side.cell((pixel_index as f64 + 0.5) * pixel);
    let columns: Vec<Option<usize>> = (0..columns).map(|i| node(i, &slice.columns)).collect();
    let mut levels = Vec::with_capacity(rows * columns.len());
    for row in 0..rows {
        let row = node(row, &slice.rows).map(|row| &slice.values[row * slice.columns.length()..]);
        let level = |column: &Option<usize>| {
            let value = row.zip(*column).map_or(0.0, |(row, column)| row[column]);
            // NaN becomes 0, which stands for no value
            ((value / range).clamp(-1.0, 1.0) * SIDE + ZERO).round() as u8
        };
        levels.extend(columns.iter().map(level));
    }
    levels
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
                bounds.take(Slice {
                    name: String::new(),
                    topic: String::new(),
                    unit: None,
                    time: 0.0,
                    rows: side(100),
                    columns: side(40),
                    axes: [Heading::new("z", None), Heading::new("r", None)],
                    even: false,
                    values,
                    layers: Vec::new(),
                });
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
        let picture = part.picture(PIXELS).expect("a picture");
        assert!(((picture.size.0 * picture.size.1) as f64) < 1.05 * PIXELS);
    }

    #[test]
    fn pixels_show_the_nearest_node() {
        let side = |length| Side::Even { start: 0.0, step: 1.0, length };
        let slice = Slice {
            name: String::new(),
            topic: String::new(),
            unit: None,
            time: 0.0,
            rows: side(2),
            columns: side(2),
            axes: [Heading::new("z", None), Heading::new("r", None)],
            even: false,
            values: vec![1.0, -1.0, 0.5, f64::NAN],
            layers: Vec::new(),
        };
        // pixels of half a unit: their middles are at 0.25, 0.75, 1.25, …
        let levels = raster(&slice, (3, 4), 0.5, 1.0);
        assert_eq!(levels[..4], [254, 2, 2, 128]);
        assert_eq!(levels[4..8], [191, 0, 0, 128]);
    }
}
