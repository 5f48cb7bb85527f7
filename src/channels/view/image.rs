//! `/view/image`: the section as a picture file with axes and colours explained, for every viewer that shows images, and for talks.
//!
//! The pixels of the section are the levels of `/view/field`, each drawn as a square of whole pixels, so that both directions have
//! one scale. Above it stands the indenter, its shape and depth exaggerated less than in `/view/scene`, so that it does not cover what
//! it causes.

use std::sync::{Arc, Mutex};

use percuss_canvas::{Align, BLACK, Raster, Text};

use super::{Viewport, WORLD, plate::Plate, section::Section, timestamp, viewport::range};
use crate::{
    case::Case,
    channels::{Channel, lock},
    message::foxglove,
    model::Frame,
    units::Units,
    view::View,
};

/// Exaggeration over that of the scene.
const PRESSED: f64 = 0.25;
/// Thickness of the contact \[pixels\].
const CONTACT: i64 = 3;

/// Draws the picture of a frame.
struct Picture {
    section: Arc<Mutex<Section>>,
    plate: Plate,
    units: Units,
    /// Height of the face of the indenter over its tip at each column from the axis on, as far as the indenter reaches \[pixels\].
    face: Vec<i64>,
    /// Pixels of a displacement of R.
    pressed: f64,
    pixels: Raster,
}

/// The channel of a case: it shows the first of the recorded fields.
pub fn channel(case: &Case, viewport: &Viewport, section: &Arc<Mutex<Section>>) -> Channel {
    let mut picture = Picture::new(case, viewport, section);
    let mut message = foxglove::CompressedImage {
        frame_id: WORLD.into(),
        format: "png".into(),
        ..foxglove::CompressedImage::default()
    };
    let shown = case.record.fields[0];
    let range = range(case, shown);
    let exaggeration = PRESSED * viewport.exaggeration;
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
    .remark(
        "colours",
        "blue tension, white 0, red compression; grey: the indenter, black below it: the contact",
    )
    .remark("exaggeration", exaggeration.to_string())
}

impl Picture {
    fn new(case: &Case, viewport: &Viewport, section: &Arc<Mutex<Section>>) -> Self {
        let plate = Plate::new(case, viewport);
        let columns = (viewport.edge() * plate.scale).round() as usize;
        let height = |column: usize| {
            let r = (column as f64 + 0.5) / plate.scale;
            let next = viewport.face.partition_point(|point| point[0] < r).clamp(1, viewport.face.len() - 1);
            let ([r0, y0], [r1, y1]) = (viewport.face[next - 1], viewport.face[next]);
            let y = y0 + (y1 - y0) * ((r - r0) / (r1 - r0)).min(1.0);
            (PRESSED * y * plate.scale).round() as i64
        };
        Self {
            section: Arc::clone(section),
            units: case.units(),
            face: (0..columns).map(height).collect(),
            pressed: PRESSED * viewport.exaggeration * plate.scale,
            pixels: plate.base.clone(),
            plate,
        }
    }

    fn draw(&mut self, view: &View<'_>, frame: &Frame) {
        self.pixels.pixels.copy_from_slice(&self.plate.base.pixels);
        let mut section = lock(&self.section);
        let fields = section.fields();
        self.plate.paint(section.levels(view.step, frame), fields, &mut self.pixels);
        drop(section);
        self.indenter(view);
        let Units { time, force, speed, .. } = self.units;
        let [time, force, speed] = [(time, view.time), (force, view.drag), (speed, view.velocity)]
            .map(|(unit, x)| unit.text_with_unit(3, x));
        let values = format!("t = {time},   F = {force},   V = {speed}").replace('-', "−");
        self.pixels.text(&Text {
            label: &values,
            at: self.plate.values,
            size: Plate::LETTERS,
            align: Align::Start,
            is_upright: false,
        });
    }

    /// The indenter from its face to the top of the plot, and the contact.
    fn indenter(&mut self, view: &View<'_>) {
        let Plate { axis, surface, top, scale, half, .. } = self.plate;
        let tip = surface + (self.pressed * view.depth).round() as i64;
        let mut before = tip;
        for (column, height) in (0..).zip(&self.face) {
            let face = (tip - height).max(top);
            let is_edge = column + 2 > self.face.len() as i64;
            for column in [axis + column, axis - column - 1] {
                self.pixels.fill([column, column + 1], [top, face], Plate::BODY);
                // its outline, joined to that of the column before
                let ink = if is_edge { [top, face] } else { [face.min(before - 1) - 1, before.max(face)] };
                self.pixels.fill([column, column + 1], [ink[0].max(top), ink[1]], BLACK);
            }
            before = face;
        }
        let contact = ((view.contact_radius * scale).round() as i64).min(half);
        self.pixels.fill([axis - contact, axis + contact], [surface - 1, surface - 1 + CONTACT], BLACK);
    }

    /// Writes the pixels as a file.
    fn encode(&self, data: &mut Vec<u8>) -> Result<(), png::EncodingError> {
        let mut encoder = png::Encoder::new(data, self.pixels.width as u32, self.pixels.height as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(self.plate.palette.as_flattened());
        encoder.set_compression(png::Compression::Fastest);
        // most rows are those above them
        encoder.set_filter(png::Filter::Up);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.pixels.pixels)?;
        writer.finish()
    }
}
