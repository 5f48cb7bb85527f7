//! `/view/field`: the recorded fields over the section, both sides of the axis, for the 3D panels of viewers.
//!
//! One byte per field and cell, and the colour of the first field: viewers have no colours with white in the middle, and show these
//! as "RGBA (separate fields)".

use std::sync::{Arc, Mutex};

use percuss_canvas::{EMPTY, ZERO, diverging, share};

use super::{
    Sheet, Viewport, WORLD,
    section::{Section, level_step},
    timestamp,
    viewport::range,
};
use crate::{
    case::Case,
    channels::{Channel, FieldNote, Rate, lock},
    message::foxglove::{self, PackedElementField, packed_element_field::NumericType},
};

/// Names of the parts of a colour, as viewers know them.
const COLOUR: [&str; 4] = ["red", "green", "blue", "alpha"];

pub fn channel(case: &Case, viewport: &Viewport, section: &Arc<Mutex<Section>>) -> Channel {
    let world = viewport.world;
    let notes = vec![
        FieldNote::new("column_count", "1", "cells of a row, r < 0 and r > 0"),
        FieldNote::new("row_stride", "bytes", "from row to row"),
        FieldNote::new("cell_stride", "bytes", "from cell to cell"),
        FieldNote::new("cell_size", world.unit.name, "size of a cell"),
        FieldNote::new(
            "data",
            "1",
            "colours of the first field (red, green, blue, alpha), and levels: value = (level - level.zero) * level.step.<field>, held at colour_range.<field>; exact values are in /field/<field>",
        ),
    ];
    let fields = lock(section).fields();
    let stride = fields + COLOUR.len();
    let pixels = 2 * (viewport.columns * (viewport.rows + viewport.above)) as u64;
    let packed = |(offset, name): (usize, &str)| PackedElementField {
        name: name.into(),
        offset: offset as u32,
        r#type: NumericType::Uint8.into(),
    };
    let names = case.record.fields.iter().map(|field| field.name()).chain(COLOUR);
    let colours: Vec<[u8; 3]> = (0..=u8::MAX).map(|level| diverging(share(level))).collect();
    let mut message = foxglove::Grid {
        timestamp: None,
        frame_id: WORLD.into(),
        // the lower left corner of the section
        pose: Some(world.at(
            -(viewport.columns as f64) * viewport.pixel,
            -(viewport.rows as f64) * viewport.pixel,
            viewport.height_of(Sheet::Field),
        )),
        column_count: 2 * viewport.columns as u32,
        cell_size: Some(world.square(viewport.pixel)),
        row_stride: (2 * viewport.columns * stride) as u32,
        cell_stride: stride as u32,
        fields: names.enumerate().map(packed).collect(),
        data: Vec::new(),
    };
    let section = Arc::clone(section);
    let channel = Channel::new("/view/field", "foxglove.Grid", notes, move |view, outlet| {
        let Some(frame) = &view.frame else { return };
        message.timestamp = Some(timestamp(outlet));
        message.data.clear();
        for levels in lock(&section).levels(view.step, &frame.fields).chunks_exact(fields) {
            message.data.extend_from_slice(levels);
            let [red, green, blue] = colours[usize::from(levels[0])];
            let alpha = if levels[0] == EMPTY { 0 } else { u8::MAX };
            message.data.extend_from_slice(&[red, green, blue, alpha]);
        }
        outlet.put(&message);
    })
    .emits(Rate::Frame(pixels * stride as u64));
    case.record.fields.iter().fold(channel.remark("level.zero", ZERO.to_string()), |channel, &field| {
        let range = range(case, field);
        channel
            .remark(format!("level.step.{}", field.name()), level_step(range).to_string())
            .remark(format!("colour_range.{}", field.name()), format!("{},{range}", -range))
    })
}
