//! The field of a report: frames of one byte a pixel.

use base64::{Engine, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use crate::{
    axis::Axis,
    convention,
    messages::Recording,
    recording::{Damage, OpenError},
    slice::{Side, Slice, slice, visit},
};

/// Frames, at most.
const FRAMES: u64 = 120;
/// Pixels of a frame, at most.
const PIXELS: f64 = 16_000.0;
/// Level of the value 0, and levels on either side of it.
const ZERO: f64 = 128.0;
const SIDE: f64 = 126.0;
/// Values of a frame that are looked at for the range of colours, at most.
const SAMPLES: usize = 10_000;
/// Columns or rows of a frame, at most.
const LONGEST: f64 = 4000.0;
/// Share of the values of all frames that the colours are to tell apart, where the recording does not say their range.
const SHOWN: f64 = 0.995;

/// The frames of a matrix channel: `null` if it is none.
pub fn animation(recording: &Recording, id: u16, damages: &mut Vec<Damage>) -> Result<Value, OpenError> {
    let channel = &recording.channels[&id];
    let Some(leaf) = Axis::matrices(channel).next() else { return Ok(Value::Null) };
    let every = channel.count.div_ceil(FRAMES).max(1);

    // how far the frames reach, and how large their values are
    let (mut width, mut depth, mut samples) = (0.0_f64, 0.0_f64, Vec::new());
    let mut unit = None;
    damages.extend(visit(recording, id, every, |moment| {
        let Some(slice) = slice(channel, leaf, &moment) else { return };
        width = width.max(slice.columns.start + slice.columns.step * slice.columns.length as f64);
        depth = depth.max(slice.rows.start + slice.rows.step * (slice.rows.length as f64 - 1.0));
        let step = slice.values.len().div_ceil(SAMPLES).max(31);
        samples
            .extend(slice.values.iter().step_by(step).map(|value| value.abs()).filter(|value| *value > 0.0));
        unit = slice.unit;
    })?);
    samples.retain(|value| value.is_finite());
    samples.sort_by(f64::total_cmp);
    let Some(quantile) = samples.get((samples.len() as f64 * SHOWN) as usize).copied() else {
        return Ok(Value::Null);
    };
    let mut views = recording.channels.values();
    let recorded = views.find_map(|view| convention::colour_range(&view.metadata, &channel.topic));
    let range = recorded.unwrap_or(quantile);
    let pixel = (width * depth / PIXELS).sqrt();
    let (columns, rows) = ((width / pixel).ceil(), (depth / pixel).ceil());
    // a field as narrow as a line, or of no size at all, is no picture
    if !((1.0..=LONGEST).contains(&columns) && (1.0..=LONGEST).contains(&rows)) {
        return Ok(Value::Null);
    }
    let (columns, rows) = (columns as usize, rows as usize);
    let (mut times, mut frames) = (Vec::new(), Vec::new());
    damages.extend(visit(recording, id, every, |moment| {
        if let Some(slice) = slice(channel, leaf, &moment) {
            times.push(moment.time);
            frames.push(STANDARD.encode(raster(&slice, (rows, columns), pixel, range)));
        }
    })?);
    Ok(json!({
        "name": channel.topic,
        "unit": unit,
        "columns": columns,
        "rows": rows,
        "width": width,
        "depth": depth,
        "range": range,
        "zero": ZERO,
        "side": SIDE,
        "times": times,
        "frames": frames,
    }))
}

/// The value at the node nearest to every pixel as a level; what is cut off is at rest.
fn raster(slice: &Slice, (rows, columns): (usize, usize), pixel: f64, range: f64) -> Vec<u8> {
    let node = |pixel_index: usize, side: &Side| {
        let place = (pixel_index as f64 + 0.5) * pixel;
        let node = ((place - side.start) / side.step).round().max(0.0) as usize;
        (node < side.length).then_some(node)
    };
    let columns: Vec<Option<usize>> = (0..columns).map(|i| node(i, &slice.columns)).collect();
    let mut levels = Vec::with_capacity(rows * columns.len());
    for row in 0..rows {
        let row = node(row, &slice.rows).map(|row| &slice.values[row * slice.columns.length..]);
        let level = |column: &Option<usize>| {
            let value = row.zip(*column).map_or(0.0, |(row, column)| row[column]);
            // a value that is not a number becomes 0, which stands for none
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
        let side = |length| Side { start: 0.0, step: 1.0, length };
        let slice = Slice {
            name: String::new(),
            topic: String::new(),
            unit: None,
            time: 0.0,
            rows: side(2),
            columns: side(2),
            coordinates: ["z".into(), "r".into()],
            units: [None, None],
            even: false,
            values: vec![1.0, -1.0, 0.5, f64::NAN],
        };
        // pixels of half a unit: their middles are at 0.25, 0.75, 1.25, …
        let levels = raster(&slice, (3, 4), 0.5, 1.0);
        assert_eq!(levels[..4], [254, 2, 2, 128]);
        assert_eq!(levels[4..8], [191, 0, 0, 128]);
    }
}
