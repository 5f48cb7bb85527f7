//! `/view/image`: the section as a picture file, for every viewer that shows images.
//!
//! The picture is a PNG of palette colours whose pixels are the levels of `/view/field`, stored without compression: the
//! compression of the chunk finds the same bytes in the grid before it, which is faster than compressing twice.

use std::sync::{Arc, Mutex};

use super::{Viewport, WORLD, colours::palette, section::Section, timestamp, viewport::range};
use crate::{
    case::Case,
    channels::{Channel, lock},
    message::foxglove,
    model::Frame,
    view::View,
};

/// Levels with a colour of their own in the palette.
const NOTHING: u8 = 0;
const INDENTER: u8 = 1;

/// The picture of a frame.
struct Picture {
    section: Arc<Mutex<Section>>,
    columns: usize,
    rows: usize,
    /// Rows above the surface that show the contact.
    margin: usize,
    pixel: f64,
    palette: Vec<u8>,
    pixels: Vec<u8>,
}

/// The channel of a case: it shows the first of the recorded fields.
pub fn channel(case: &Case, viewport: &Viewport, section: &Arc<Mutex<Section>>) -> Channel {
    let mut picture = Picture {
        section: Arc::clone(section),
        columns: 2 * viewport.columns,
        rows: viewport.rows,
        margin: (viewport.rows / 16).max(2),
        pixel: viewport.pixel,
        palette: palette(),
        pixels: Vec::new(),
    };
    let mut message = foxglove::CompressedImage {
        frame_id: WORLD.into(),
        format: "png".into(),
        ..foxglove::CompressedImage::default()
    };
    let shown = case.record.fields[0];
    let range = range(case, shown);
    Channel::new("/view/image", "foxglove.CompressedImage", Vec::new(), move |view, outlet| {
        let Some(frame) = &view.frame else { return };
        message.timestamp = Some(timestamp(outlet));
        picture.draw(view, &frame.fields);
        message.data.clear();
        picture.encode(&mut message.data).expect("memory takes every byte");
        outlet.put(&message);
    })
    .remark("shows", format!("/field/{}", shown.name()))
    .remark(format!("colour_range.{}", shown.name()), format!("{},{range}", -range))
    .remark("colours", "blue tension, white 0, red compression; grey above: the contact")
}

impl Picture {
    fn draw(&mut self, view: &View<'_>, frame: &Frame) {
        let half = self.columns / 2;
        let contact = ((view.contact_radius / self.pixel).round() as usize).min(half);
        self.pixels.clear();
        for _ in 0..self.margin {
            let row = self.pixels.len();
            self.pixels.resize(row + self.columns, NOTHING);
            self.pixels[row + half - contact..row + half + contact].fill(INDENTER);
        }
        let mut section = lock(&self.section);
        let fields = section.fields();
        // rows of images begin at the top
        for row in section.levels(view.step, frame).chunks_exact(self.columns * fields).rev() {
            if fields == 1 {
                self.pixels.extend_from_slice(row);
            } else {
                self.pixels.extend(row.iter().step_by(fields));
            }
        }
    }

    /// Writes the pixels as a file.
    fn encode(&self, data: &mut Vec<u8>) -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(data, self.columns as u32, (self.rows + self.margin) as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(self.palette.as_slice());
        encoder.set_compression(png::Compression::NoCompression);
        encoder.set_filter(png::Filter::NoFilter);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels)?;
        writer.finish()
    }
}
