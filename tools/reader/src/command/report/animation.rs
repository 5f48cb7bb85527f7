//! The field of a report: frames of one byte a pixel.

use base64::{Engine, engine::general_purpose::STANDARD};
use percuss_table::Heading;
use serde_json::{Value, json};

use crate::{
    axis::Axis,
    convention,
    messages::Recording,
    recording::{Damage, OpenError},
    slice::{Layer, Side, Slice, slice, visit},
};

/// Frames, at most.
const FRAMES: u64 = 120;
/// Pixels of a frame, at most.
const PIXELS: f64 = 16_000.0;
/// Level of the value 0, and levels on either side of it.
const ZERO: f64 = 128.0;
const SIDE: f64 = 126.0;
/// Values of a frame that the range of colours is estimated from, at most.
const SAMPLES: usize = 10_000;
/// Columns or rows of a frame, at most.
const LONGEST: f64 = 4000.0;
/// Share of the values of all frames that the colours distinguish, where the recording does not say their range.
const SHOWN: f64 = 0.995;

/// How far the frames reach, and how large their values are.
#[derive(Default)]
struct Bounds {
    width: f64,
    depth: f64,
    samples: Vec<f64>,
    unit: Option<String>,
    length_unit: Option<String>,
    /// Of the rows.
    coordinate: Option<String>,
}

impl Bounds {
    fn take(&mut self, slice: Slice) {
        let (columns, rows) = (&slice.columns, &slice.rows);
        // a step beyond the last, unless they are listed
        let width = match columns {
            Side::Even { length, .. } => columns.at(*length),
            Side::Listed(_) => columns.at(columns.length().saturating_sub(1)),
        };
        self.width = self.width.max(width);
        self.depth = self.depth.max(rows.at(rows.length().saturating_sub(1)));
        let step = slice.values.len().div_ceil(SAMPLES).max(31);
        let values = slice.values.iter().step_by(step).map(|value| value.abs());
        self.samples.extend(values.filter(|value| *value > 0.0 && value.is_finite()));
        self.unit = slice.unit;
        let [Heading { unit, name, .. }, _] = slice.axes;
        (self.length_unit, self.coordinate) = (unit, Some(name));
    }

    /// The value that the share of those to be distinguished does not exceed.
    fn quantile(&mut self) -> Option<f64> {
        self.samples.sort_by(f64::total_cmp);
        self.samples.get((self.samples.len() as f64 * SHOWN) as usize).copied()
    }

    /// Columns, rows and size of a pixel; `None` for a field as narrow as a line, or of no size at all.
    fn raster(&self) -> Option<(usize, usize, f64)> {
        let pixel = (self.width * self.depth / PIXELS).sqrt();
        let (columns, rows) = ((self.width / pixel).ceil(), (self.depth / pixel).ceil());
        let is_picture = (1.0..=LONGEST).contains(&columns) && (1.0..=LONGEST).contains(&rows);
        is_picture.then_some((columns as usize, rows as usize, pixel))
    }
}

/// The frames of a matrix channel: `null` if it is none.
pub fn animation(recording: &Recording, id: u16, damages: &mut Vec<Damage>) -> Result<Value, OpenError> {
    let channel = &recording.channels[&id];
    let Some(leaf) = Axis::matrices(channel).next() else { return Ok(Value::Null) };
    let every = channel.count.div_ceil(FRAMES).max(1);
    let mut bounds = Bounds::default();
    damages.extend(visit(recording, id, every, |moment| {
        slice(channel, leaf, &moment).into_iter().for_each(|slice| bounds.take(slice));
    })?);
    let Some(quantile) = bounds.quantile() else { return Ok(Value::Null) };
    let Some((columns, rows, pixel)) = bounds.raster() else { return Ok(Value::Null) };
    let mut views = recording.channels.values();
    let recorded = views.find_map(|view| convention::colour_range(&view.metadata, &channel.topic));
    let range = recorded.unwrap_or(quantile);
    let (mut times, mut frames) = (Vec::new(), Vec::new());
    damages.extend(visit(recording, id, every, |moment| {
        if let Some(slice) = slice(channel, leaf, &moment) {
            times.push(moment.time);
            frames.push(STANDARD.encode(raster(&slice, (rows, columns), pixel, range)));
        }
    })?);
    let coordinate = bounds.coordinate.as_deref().unwrap_or_default();
    let share = |depth: f64| (depth / (rows as f64 * pixel)).clamp(0.0, 1.0);
    let layer =
        |layer: Layer| json!({ "name": layer.name, "from": share(layer.top), "to": share(layer.bottom) });
    let layers: Vec<Value> = recording.layers(coordinate).into_iter().map(layer).collect();
    Ok(json!({
        "name": channel.topic,
        "unit": bounds.unit,
        "length_unit": bounds.length_unit,
        "columns": columns,
        "rows": rows,
        "width": bounds.width,
        "depth": bounds.depth,
        "layers": layers,
        "range": range,
        "zero": ZERO,
        "side": SIDE,
        "times": times,
        "frames": frames,
    }))
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
