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
    channels::{Channel, FieldNote, Outlet, lock},
    message::foxglove::{self, PackedElementField, packed_element_field::NumericType},
    model::Field,
    view::View,
};

/// The channel.
pub struct Grid {
    section: Arc<Mutex<Section>>,
    /// Half of the colour range of every field, in its unit.
    ranges: Vec<(Field, f64)>,
    length: &'static str,
    message: foxglove::Grid,
}

impl Grid {
    /// The channel of a case.
    pub fn new(case: &Case, viewport: &Viewport, section: &Arc<Mutex<Section>>) -> Self {
        let fields = lock(section).fields() as u32;
        let packed = |(offset, field): (usize, &Field)| PackedElementField {
            name: field.name().into(),
            offset: offset as u32,
            r#type: NumericType::Uint8.into(),
        };
        let world = viewport.world;
        let message = foxglove::Grid {
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
        let ranges = case.record.fields.iter().map(|field| (*field, range(case, *field))).collect();
        Self { section: Arc::clone(section), ranges, length: world.unit.name, message }
    }
}

impl Channel for Grid {
    fn topic(&self) -> &'static str {
        "/view/field"
    }

    fn schema(&self) -> &'static str {
        "foxglove.Grid"
    }

    fn fields(&self) -> Vec<FieldNote> {
        vec![
            FieldNote::new("column_count", "1", "cells of a row, r < 0 and r > 0"),
            FieldNote::new("row_stride", "bytes", "from row to row"),
            FieldNote::new("cell_stride", "bytes", "from cell to cell"),
            FieldNote::new("cell_size", self.length, "size of a cell"),
            FieldNote::new(
                "data",
                "1",
                "levels: value = (level - level.zero) * level.step.<field>, held at colour_range.<field>; exact values are in /field/<field>",
            ),
        ]
    }

    fn remarks(&self) -> Vec<(String, String)> {
        let mut remarks = vec![("level.zero".to_owned(), ZERO.to_string())];
        for (field, range) in &self.ranges {
            remarks.push((format!("level.step.{}", field.name()), level_step(*range).to_string()));
            remarks.push((format!("colour_range.{}", field.name()), format!("{},{range}", -range)));
        }
        remarks
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(frame) = &view.frame else { return };
        self.message.timestamp = Some(timestamp(outlet));
        self.message.data.clear();
        self.message.data.extend_from_slice(lock(&self.section).levels(view.step, &frame.fields));
        outlet.put(&self.message);
    }
}
