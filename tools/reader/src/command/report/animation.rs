//! The field of a report: frames of one byte a pixel, of the part that is worth looking at and of the whole section.

use base64::{Engine, engine::general_purpose::STANDARD};
use percuss_canvas::{colour, diverging, palette};
use percuss_table::Heading;
use serde_json::{Value, json};

use super::body::Body;
use crate::{
    command::view::{Bounds, Scale, Section, main_field, raster},
    failure::Failure,
    messages::Recording,
    pass::Pass,
    recording::Damage,
    select::Window,
    slice::{Layer, slice},
};

/// Frames, at most.
const FRAMES: u64 = 120;
/// Pixels of a frame, at most; of the whole section beside a part of it.
const PIXELS: f64 = 16_000.0;
const WHOLE_PIXELS: f64 = 6_000.0;
/// Columns or rows of a frame, at most.
const LONGEST: f64 = 4000.0;

/// The picture of a section; `None` for a field as narrow as a line, or of no size at all.
fn picture(section: Section, pixels: f64) -> Option<Picture> {
    let pixel = (section.width * section.height() / pixels).sqrt();
    let (columns, rows) = ((section.width / pixel).ceil(), (section.height() / pixel).ceil());
    let is_picture = (1.0..=LONGEST).contains(&columns) && (1.0..=LONGEST).contains(&rows);
    let size = (rows as usize, columns as usize);
    is_picture.then_some(Picture { section, size, pixel, frames: Vec::new() })
}

struct Picture {
    section: Section,
    /// Rows and columns.
    size: (usize, usize),
    pixel: f64,
    frames: Vec<String>,
}

impl Picture {
    /// * `layers`: of the target
    /// * `length`: how lengths are read
    fn json(self, layers: &[Layer], length: &Scale) -> Value {
        let (rows, columns) = self.size;
        let share = |depth: f64| ((depth - self.section.top) / (rows as f64 * self.pixel)).clamp(0.0, 1.0);
        let layer = |layer: &Layer| json!({ "name": layer.name, "from": share(layer.top), "to": share(layer.bottom) });
        json!({
            "columns": columns,
            "rows": rows,
            "width": length.number(self.section.width),
            "depth": length.number(self.section.depth),
            "top": length.number(self.section.top),
            "pixel": length.number(self.pixel),
            "layers": layers.iter().map(layer).collect::<Vec<_>>(),
            "frames": self.frames,
        })
    }
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
    /// * `time`: how times are read
    /// * `body`: the indenter at the times of the frames
    pub(super) fn json(
        self,
        time: &Scale,
        body: impl FnOnce(&[f64]) -> Body,
    ) -> Result<(Value, Vec<Damage>), Failure> {
        let Self { recording, id, leaf, every, mut bounds, times } = self;
        let channel = &recording.channels[&id];
        let none = (Value::Null, Vec::new());
        let (Some(quantile), Some(frame)) = (bounds.quantile(), bounds.largest.clone()) else {
            return Ok(none);
        };
        let ([row, _], unit) = (frame.axes, frame.unit);
        let range = recording.colour_range(&channel.topic).unwrap_or(quantile);
        let part = bounds.part(range).and_then(|part| picture(part, PIXELS));
        let whole = picture(bounds.whole, if part.is_some() { WHOLE_PIXELS } else { PIXELS });
        let mut pictures: Vec<Picture> = part.into_iter().chain(whole).collect();
        if pictures.is_empty() {
            return Ok(none);
        }
        let mut pass = Pass::over(recording, Window::default());
        pass.every(id, every, |moment, _| {
            if let Some(slice) = slice(channel, leaf, moment) {
                for picture in &mut pictures {
                    let pixels = raster(&slice, picture.size, (picture.pixel, picture.section.top), range);
                    picture.frames.push(STANDARD.encode(pixels));
                }
            }
            Ok(())
        });
        let damages = pass.run()?.damages;
        let layers = recording.layers(&row.name);
        let scale = |unit: &Option<String>, largest| {
            Scale::of_page(&[Heading::new("", unit.as_deref())], [largest].into_iter())
        };
        let value = scale(&unit, range);
        // as the first view is best read
        let first = pictures.first().map_or(0.0, |picture| picture.section.width.max(picture.section.depth));
        let length = scale(&row.unit, first);
        let [lowest, highest] = [2, 254].map(colour);
        let field = json!({
            "name": channel.topic,
            "unit": value.name().or(unit.as_deref()),
            "length_unit": length.name().or(row.unit.as_deref()),
            "views": pictures.into_iter().map(|picture| picture.json(&layers, &length)).collect::<Vec<_>>(),
            "body": body(&times).json(&length),
            "range": value.number(range),
            "bar": [lowest, highest],
            "palette": STANDARD.encode(palette(diverging)[..=usize::from(highest)].as_flattened()),
            "times": time.numbers(times),
        });
        Ok((field, damages))
    }
}
