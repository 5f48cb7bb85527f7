//! `/view/field`: the recorded fields over the section, both sides of the axis, for the 3D panels of viewers.
//!
//! One byte per field and cell: by default viewers map bytes 0 to 255 to colours, so the picture needs no settings.

use std::sync::{Arc, Mutex};

use super::{
    Sheet, Viewport, WORLD,
    section::{Section, ZERO, level_step},
    timestamp,
    viewport::range,
};
use crate::{
    case::Case,
    channels::{Channel, FieldNote, lock},
    message::foxglove::{self, PackedElementField, packed_element_field::NumericType},
    model::Field,
};

/// The channel of a case.
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
            "levels: value = (level - level.zero) * level.step.<field>, held at colour_range.<field>; exact values are in /field/<field>",
        ),
    ];
    let fields = lock(section).fields() as u32;
    let packed = |(offset, field): (usize, &Field)| PackedElementField {
        name: field.name().into(),
        offset: offset as u32,
        r#type: NumericType::Uint8.into(),
    };
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
        row_stride: 2 * viewport.columns as u32 * fields,
        cell_stride: fields,
        fields: case.record.fields.iter().enumerate().map(packed).collect(),
        data: Vec::new(),
    };
    let section = Arc::clone(section);
    let channel = Channel::new("/view/field", "foxglove.Grid", notes, move |view, outlet| {
        let Some(frame) = &view.frame else { return };
        message.timestamp = Some(timestamp(outlet));
        message.data.clear();
        message.data.extend_from_slice(lock(&section).levels(view.step, &frame.fields));
        outlet.put(&message);
    });
    case.record.fields.iter().fold(channel.remark("level.zero", ZERO.to_string()), |channel, &field| {
        let range = range(case, field);
        channel
            .remark(format!("level.step.{}", field.name()), level_step(range).to_string())
            .remark(format!("colour_range.{}", field.name()), format!("{},{range}", -range))
    })
}
