//! The section as a raster of levels: recorded fields, thinned out to pixels, one byte per field and pixel.
//!
//! The pictures of a frame share it, so that it is made once.

use super::stage::{Stage, range};
use crate::{
    case::Case,
    channels::{field::SharedSlice, lock},
    message::percuss,
};

/// Level of the value 0.
pub const ZERO: u8 = 128;
/// Levels from 0 to the end of the range on either side; levels 0 and 1 stand for no value.
const SIDE: f64 = 126.0;

/// Smallest and largest level that stand for values.
pub fn level_range() -> (f64, f64) {
    (f64::from(ZERO) - SIDE, f64::from(ZERO) + SIDE)
}

/// Value of one level where the range of colours is ± `range`.
pub fn level_step(range: f64) -> f64 {
    range / SIDE
}

/// The raster of a frame, shape `(rows, columns, fields)`: rows from the deepest up, columns from the left.
pub struct Section {
    slices: Vec<SharedSlice>,
    /// 1 / value of a level.
    scales: Vec<f32>,
    /// Node of the field for every row from the deepest up, and for every column from the axis outwards.
    nodes: Nodes,
    step: Option<u64>,
    levels: Vec<u8>,
}

struct Nodes {
    rows: Vec<usize>,
    columns: Vec<usize>,
}

impl Section {
    /// The raster of `slices` on a stage.
    pub fn new(case: &Case, stage: &Stage, slices: Vec<SharedSlice>) -> Self {
        let grid = case.grid();
        let every = case.record.field_every as f64;
        let middle = |pixel: usize| (pixel as f64 + 0.5) * stage.pixel;
        let nearest = |x: f64| x.round().max(0.0) as usize;
        let fields = case.record.fields.iter();
        Self {
            scales: fields.map(|field| (1.0 / level_step(range(case, *field))) as f32).collect(),
            slices,
            nodes: Nodes {
                rows: (0..stage.rows).rev().map(|row| nearest(middle(row) / (every * grid.dz))).collect(),
                columns: (0..stage.columns)
                    .map(|i| nearest((middle(i) - grid.r0) / (every * grid.dr)))
                    .collect(),
            },
            step: None,
            levels: Vec::new(),
        }
    }

    /// Number of fields.
    pub fn fields(&self) -> usize {
        self.slices.len()
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.nodes.rows.len()
    }

    /// The levels of a step.
    pub fn levels(&mut self, step: u64) -> &[u8] {
        if self.step != Some(step) {
            self.step = Some(step);
            let fields = self.slices.len();
            let (rows, columns) = (self.nodes.rows.len(), self.nodes.columns.len());
            // all of it at rest, then what has moved
            self.levels.clear();
            self.levels.resize(rows * 2 * columns * fields, ZERO);
            for (field, (slice, scale)) in self.slices.iter().zip(&self.scales).enumerate() {
                fill(&mut self.levels, (field, fields), &self.nodes, &lock(slice), *scale);
            }
        }
        &self.levels
    }
}

/// Fills in the levels of one of the fields.
fn fill(
    levels: &mut [u8],
    (field, fields): (usize, usize),
    nodes: &Nodes,
    slice: &percuss::FieldSlice,
    scale: f32,
) {
    let (nr, nz) = (slice.nr as usize, slice.nz as usize);
    let columns = nodes.columns.len();
    let moved = nodes.columns.partition_point(|&node| node < nr);
    let mut half = vec![ZERO; moved];
    for (row, &node) in levels.chunks_exact_mut(2 * columns * fields).zip(&nodes.rows) {
        if node >= nz {
            continue;
        }
        let values = &slice.values[node * nr..][..nr];
        for (pixel, &node) in half.iter_mut().zip(&nodes.columns) {
            *pixel = level(values[node] * scale);
        }
        let (left, right) = row.split_at_mut(columns * fields);
        for (cell, pixel) in right.chunks_exact_mut(fields).zip(&half) {
            cell[field] = *pixel;
        }
        for (cell, pixel) in left.chunks_exact_mut(fields).rev().zip(&half) {
            cell[field] = *pixel;
        }
    }
}

/// Level of a value in units of a level, held within the range.
fn level(value: f32) -> u8 {
    // a cast from a float stops at 0 and 255; a value that is not a number becomes 0, which stands for none
    (value.clamp(-SIDE as f32, SIDE as f32) + (f32::from(ZERO) + 0.5)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_stand_for_values() {
        assert_eq!([-1e9, -126.0, -0.4, 0.0, 1.6, 1e9].map(level), [2, 2, 128, 128, 130, 254]);
        assert_eq!(level(f32::NAN), 0);
    }

    #[test]
    fn both_halves_are_mirror_images() {
        let nodes = Nodes { rows: vec![1, 0], columns: vec![0, 1, 2] };
        let slice = percuss::FieldSlice { nr: 2, nz: 1, values: vec![10.0, 20.0], ..Default::default() };
        let mut levels = vec![ZERO; 2 * 6];
        fill(&mut levels, (0, 1), &nodes, &slice, 1.0);
        assert_eq!(levels[..6], [ZERO; 6], "below what has moved");
        assert_eq!(levels[6..], [128, 148, 138, 138, 148, 128]);
        // the second of two fields
        let mut levels = vec![ZERO; 2 * 12];
        fill(&mut levels, (1, 2), &nodes, &slice, 1.0);
        assert_eq!(levels[12..], [128, 128, 128, 148, 128, 138, 128, 138, 128, 148, 128, 128]);
    }
}
