//! The section as a raster of levels: recorded fields, downsampled to pixels, one byte per field and pixel.
//!
//! The pictures of a frame share one raster.

use percuss_canvas::{EMPTY, SIDE, ZERO, level};

use super::viewport::{Viewport, range};
use crate::{
    case::Case,
    grid::place,
    model::{Extent, Field, Frame, Sample},
};

/// Value of one level in the colour range ± `range`.
pub fn level_step(range: f64) -> f64 {
    range / SIDE
}

/// Row and column of the node of the field that a pixel shows; none beside an indenter that gives.
type Node = Option<[usize; 2]>;

/// The raster of a frame, shape `(rows, columns, fields)`: rows from the deepest up, columns from the left.
pub struct Section {
    fields: Vec<Field>,
    /// Levels of a dimensionless 1.
    scales: Vec<f32>,
    /// Nodes of the right half, shape `(rows, columns)`, and how many of them are those of the target.
    nodes: Vec<Node>,
    columns: usize,
    target: usize,
    step: Option<u64>,
    levels: Vec<u8>,
}

impl Section {
    pub fn new(case: &Case, viewport: &Viewport) -> Self {
        let (grid, shown) = (case.grid(), case.shown_nodes());
        let every = case.record.field_every as f64;
        let (above, depths) = shown.z.split_at(shown.above);
        let middle = |pixel: usize| (pixel as f64 + 0.5) * viewport.pixel;
        let column = |pixel| (grid.place(middle(pixel)) / every).round().max(0.0) as usize;
        let columns: Vec<usize> = (0..viewport.columns).map(column).collect();
        let rows = (0..viewport.rows).rev().map(|row| above.len() + nearest_row(depths, middle(row)));
        let mut nodes: Vec<Node> = rows.flat_map(|j| columns.iter().map(move |i| Some([j, *i]))).collect();
        let target = nodes.len();
        nodes.extend(striker_nodes(case, viewport, above, &shown.r));
        let units = case.units();
        let levels = |field: &Field| field.unit(&units).scale / level_step(range(case, *field));
        Self {
            scales: case.record.fields.iter().map(|field| levels(field) as f32).collect(),
            fields: case.record.fields.clone(),
            columns: columns.len(),
            nodes,
            target,
            step: None,
            levels: Vec::new(),
        }
    }

    pub fn fields(&self) -> usize {
        self.fields.len()
    }

    pub fn levels(&mut self, step: u64, frame: &Frame) -> &[u8] {
        if self.step != Some(step) {
            self.step = Some(step);
            let fields = self.fields.len();
            // at rest, unless a node of the sample follows
            self.levels.clear();
            self.levels.resize(2 * self.target * fields, ZERO);
            self.levels.resize(2 * self.nodes.len() * fields, EMPTY);
            for (number, (field, scale)) in self.fields.iter().zip(&self.scales).enumerate() {
                let sample = frame.sample(*field).expect("a frame has every field that is recorded");
                fill(&mut self.levels, (number, fields), (&self.nodes, self.columns), sample, *scale);
            }
        }
        &self.levels
    }
}

/// Fills in the levels of one of the fields, both halves.
///
/// * `nodes`: of the right half, and how many a row has
fn fill(
    levels: &mut [u8],
    (field, fields): (usize, usize),
    (nodes, columns): (&[Node], usize),
    sample: &Sample,
    scale: f32,
) {
    let Extent { nr, nz } = sample.extent;
    for (row, nodes) in levels.chunks_exact_mut(2 * columns * fields).zip(nodes.chunks_exact(columns)) {
        let (left, right) = row.split_at_mut(columns * fields);
        let cells = right.chunks_exact_mut(fields).zip(left.chunks_exact_mut(fields).rev());
        for ((right, left), node) in cells.zip(nodes) {
            // a sample ends where nothing has moved
            if let Some([j, i]) = *node
                && j < nz
                && i < nr
            {
                let value = level(sample.values[j * nr + i] * scale);
                (right[field], left[field]) = (value, value);
            }
        }
    }
}

/// Nodes of an indenter that gives, for pixels above the surface: it stands over the gap that its head leaves.
///
/// * `depths`: of its rows, from the rear on
/// * `radii`: of the columns that are shown
fn striker_nodes(case: &Case, viewport: &Viewport, depths: &[f64], radii: &[f64]) -> Vec<Node> {
    let Some(striker) = &case.indenter.striker else { return Vec::new() };
    let (shape, radius) = (case.shape(), striker.body.radius.unwrap_or(f64::INFINITY));
    // from the nose up
    let heights: Vec<f64> = depths.iter().rev().map(|z| -z).collect();
    let middle = |pixel: usize| (pixel as f64 + 0.5) * viewport.pixel;
    let node = |row: usize, column: usize| {
        let r = middle(column);
        // a gap is one from the height of a pixel on
        let height = middle(row) - shape.profile(r);
        let up = nearest_row(&heights, height.max(0.0));
        let is_inside = r <= radius && height > -viewport.pixel && up < heights.len();
        let column = (place(radii, r).round().max(0.0) as usize).min(radii.len() - 1);
        is_inside.then(|| [heights.len() - 1 - up, column])
    };
    (0..viewport.above)
        .flat_map(|row| (0..viewport.columns).map(move |column| (row, column)))
        .map(|(row, column)| node(row, column))
        .collect()
}

/// Number of the nearest of some depths, at an interface on the side of `depth`; beyond the last one there is none.
fn nearest_row(depths: &[f64], depth: f64) -> usize {
    let below = depths.partition_point(|z| *z <= depth);
    let Some(&lower) = depths.get(below) else {
        // half a distance of rows below the last one
        let [.., before, last] = depths else { return 0 };
        return if depth - last < 0.5 * (last - before) { below - 1 } else { below };
    };
    if below > 0 && depth - depths[below - 1] < lower - depth { below - 1 } else { below }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_the_nearest_of_their_layer() {
        let depths = [0.0, 0.2, 0.4, 0.4, 0.5, 0.6];
        let places = [0.0, 0.11, 0.39, 0.41, 0.44, 0.46, 0.59, 0.64, 0.66];
        let rows = places.map(|z| nearest_row(&depths, z));
        assert_eq!(rows, [0, 1, 2, 3, 3, 4, 5, 5, 6]);
        let even = [0.0, 0.1, 0.2];
        assert_eq!([0.04, 0.06, 0.14, 0.16].map(|z| nearest_row(&even, z)), [0, 1, 1, 2]);
    }

    #[test]
    fn both_halves_are_mirror_images() {
        let nodes = [1, 0].map(|row| [0, 1, 2].map(|column| Some([row, column])));
        let nodes = (nodes.as_flattened(), 3);
        let extent = Extent { nr: 2, nz: 1 };
        let slice = Sample { field: Field::Stress, extent, values: vec![10.0, 20.0] };
        let mut levels = vec![ZERO; 2 * 6];
        fill(&mut levels, (0, 1), nodes, &slice, 1.0);
        assert_eq!(levels[..6], [ZERO; 6], "below what has moved");
        assert_eq!(levels[6..], [128, 148, 138, 138, 148, 128]);
        // the second of two fields
        let mut levels = vec![ZERO; 2 * 12];
        fill(&mut levels, (1, 2), nodes, &slice, 1.0);
        assert_eq!(levels[12..], [128, 128, 128, 148, 128, 138, 128, 138, 128, 148, 128, 128]);
    }
}
