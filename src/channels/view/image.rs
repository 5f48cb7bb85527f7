//! `/view/image`: the section as a picture file with axes and colours explained, for every viewer that shows images, and for talks.
//!
//! The pixels of the section are the levels of `/view/field`, each drawn as a square of whole pixels, so that both directions have
//! one scale. Above it stands the indenter, its shape and depth exaggerated less than in `/view/scene`, so that it does not cover what
//! it causes.

use std::sync::{Arc, Mutex};

use percuss_canvas::{Align, Raster, Text};

use super::{Viewport, WORLD, plate::Plate, section::Section, timestamp, viewport::range};
use crate::{
    case::Case,
    channels::{Channel, Rate, lock},
    message::foxglove,
    model::Frame,
    units::Units,
    view::View,
};

/// Exaggeration over that of the scene.
const PRESSED: f64 = 0.25;

struct Picture {
    section: Arc<Mutex<Section>>,
    plate: Plate,
    units: Units,
    /// Height of the face of the indenter over its tip at each column from the axis on, as far as the indenter reaches \[pixels\].
    face: Vec<i64>,
    /// Pixels of a displacement of R.
    pressed: f64,
    pixels: Raster,
    /// True for a load in place of an indenter.
    is_loaded: bool,
}

/// The channel of a case: it shows the first of the recorded fields.
pub fn channel(case: &Case, viewport: &Arc<Viewport>, section: &Arc<Mutex<Section>>) -> Channel {
    let (viewport, section, drawn) = (Arc::clone(viewport), Arc::clone(section), case.clone());
    // of sections, pixels take 0.75 bytes
    let bytes = (6 << 10) + 3 * (viewport.columns * (viewport.rows + viewport.above)) as u64 / 2;
    let mut picture = None;
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
        let picture = picture.get_or_insert_with(|| Picture::new(&drawn, &viewport, &section));
        picture.draw(view, &frame.fields);
        message.data.clear();
        picture.encode(&mut message.data).expect("memory takes every byte");
        outlet.put(&message);
    })
    .emits(Rate::Frame(bytes))
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
        Self {
            section: Arc::clone(section),
            units: case.units(),
            face: plate.section.face(&viewport.face, [plate.scale, PRESSED * plate.scale]),
            pressed: PRESSED * viewport.exaggeration * plate.scale,
            pixels: plate.base.clone(),
            is_loaded: case.load.is_some(),
            plate,
        }
    }

    fn draw(&mut self, view: &View<'_>, frame: &Frame) {
        self.pixels.pixels.copy_from_slice(&self.plate.base.pixels);
        let mut section = lock(&self.section);
        let fields = section.fields();
        self.plate.paint(section.levels(view.step, frame), fields, &mut self.pixels);
        drop(section);
        let section = &self.plate.section;
        // one that gives is part of the section
        if view.striker.is_none() && !self.is_loaded {
            section.indenter(&mut self.pixels, &self.face, self.pressed * view.depth);
        }
        section.contact(&mut self.pixels, view.contact_radius * self.plate.scale);
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
