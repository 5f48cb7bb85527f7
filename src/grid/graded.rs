//! Meshes whose cells grow with the distance from the contact.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::{Back, Bond, Grid, Layer, MeshKind, Spacing};
use crate::geometry::Geometry;

/// What holds the rim of a target that ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rim {
    /// Nothing: it is free of stress.
    Free,
    /// A smooth guide, v = 0: plane waves along z run as in a layer without end.
    Guided,
}

/// Where the nodes of a graded mesh are.
#[derive(Clone, Debug)]
pub(super) struct Positions {
    /// Radii of the nodes, shape `(nr,)` \[R\].
    pub radii: Vec<f64>,
    /// Widths h_i of the cells at their inner sides, shape `(nr + 1,)`: the first from the axis' image of node 0, the last outside \[R\].
    widths: Vec<f64>,
    /// Depths of the rows of nodes, shape `(nz + 1,)` \[R\].
    pub depths: Vec<f64>,
    /// Heights of the cells below them, of the last row of a layer 0 \[R\].
    heights: Vec<f64>,
}

/// Sizes of neighbouring cells: `near` of them alike, then each by a ratio larger than the one before, up to a largest one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Size of the first \[R\].
    pub first: f64,
    /// Length over which they are alike \[R\].
    pub near: f64,
    /// Ratio, at least 1.
    pub ratio: f64,
    /// Largest size \[R\].
    pub largest: f64,
}

/// Slack for a length that is a sum of sizes but for rounding.
const ROUNDING: f64 = 1e-9;

impl Growth {
    /// Of sizes that are all alike.
    pub fn none(size: f64) -> Self {
        Self { first: size, near: f64::INFINITY, ratio: 1.0, largest: size }
    }

    /// Size of the cell that begins at a distance, the one before it having `before`.
    pub fn size(&self, distance: f64, before: f64) -> f64 {
        // the near zone may be a whole number of cells
        if distance < self.near * (1.0 - ROUNDING) {
            self.first
        } else {
            (before * self.ratio).min(self.largest).max(before)
        }
    }
}

impl Grid {
    /// A graded mesh with cells between nodes.
    ///
    /// * `widths`: of the cells from that about the axis outwards, one more than there are nodes: node 0 is half a width from the axis \[R\]
    /// * `rim`: if the last node stands on the rim of the target: then there is no last cell
    /// * `dt`: time step \[R/c_p\]
    /// * `layers`: heights of the rows of cells of each from the surface down \[R\], and how it is joined to the one above. Above a free
    ///   back half a row more, of the height of the last one, is below them
    ///
    /// # Panics
    ///
    /// Without nodes, or layers.
    pub fn graded(
        geometry: Geometry,
        widths: Vec<f64>,
        dt: f64,
        layers: &[(Vec<f64>, Bond)],
        back: Back,
        has_back: bool,
        rim: Option<Rim>,
    ) -> Self {
        let (dr, nr) = (widths[0], widths.len() - 1);
        let rows: Vec<_> = layers.iter().map(|(heights, bond)| (heights.len(), heights[0], *bond)).collect();
        let spacing = Spacing { dr, dz: rows[0].1, layer_rows: has_back.then_some(rows[0].0) };
        let mut grid = Self::new(geometry, MeshKind::Matched, spacing, nr, 1).with_layers(dt, &rows, back);
        let mut radii = vec![0.5 * dr];
        radii.extend(widths[1..nr].iter().scan(0.5 * dr, |r, width| {
            *r += width;
            Some(*r)
        }));
        let (mut depths, mut all_heights, mut top) = (Vec::new(), Vec::new(), 0.0);
        for (layer, (heights, _)) in grid.layers.iter_mut().zip(layers) {
            layer.top = top;
            for height in heights.iter().chain([&0.0]) {
                depths.push(top);
                all_heights.push(*height);
                top += height;
            }
        }
        grid.positions = Some(Positions { radii, widths, depths, heights: all_heights });
        (grid.cells_between_nodes, grid.rim) = (true, rim);
        let inner = |i: usize| if i == 0 { grid.cell_area(0) } else { 0.5 * grid.cell_area(i) };
        grid.area = (0..nr).map(|i| inner(i) + 0.5 * grid.cell_area(i + 1)).collect();
        grid
    }

    /// True if cells grow with the distance from the contact.
    pub fn is_graded(&self) -> bool {
        self.positions.is_some()
    }

    /// Radii of the nodes of a graded mesh \[R\].
    pub fn radii(&self) -> Option<Arc<[f64]>> {
        self.positions.as_ref().map(|positions| positions.radii.as_slice().into())
    }

    /// Width of the cell at the inner side of node `i`, up to the one outside the last node \[R\].
    pub fn width(&self, i: usize) -> f64 {
        self.positions.as_ref().map_or(self.dr, |positions| positions.widths[i])
    }

    /// Area of the cell between nodes i−1 and i, `2ρ_ih_i`, plane h_i; that about the axis is half a cell, `(h_0/2)²`, plane h_0/2. Beyond a
    /// rim there is none.
    pub fn cell_area(&self, i: usize) -> f64 {
        if self.rim.is_some() && i == self.nr() {
            return 0.0;
        }
        let width = self.width(i);
        let inner = if i == 0 { 0.0 } else { self.r(i - 1) };
        let outer = if i == 0 { 0.5 * width } else { inner + width };
        match self.geometry {
            Geometry::Axisymmetric => (outer + inner) * (outer - inner),
            Geometry::Plane => outer - inner,
        }
    }

    /// Height of the cells below row `j`, above the last row of a layer that of the row above \[R\].
    pub fn height(&self, j: usize) -> f64 {
        let layer = self.layer(j);
        let j = j.min(layer.last() - 1);
        self.positions.as_ref().map_or(layer.dz, |positions| positions.heights[j])
    }

    /// Depth at `x` axial steps below the first row of a layer \[R\].
    pub(crate) fn depth_in(&self, layer: &Layer, x: f64) -> f64 {
        let Some(Positions { depths, .. }) = &self.positions else { return layer.top + x * layer.dz };
        let row = (x as usize).min(layer.steps - 1);
        let j = layer.first + row;
        depths[j] + (x - row as f64) * self.height(j)
    }

    /// Axial steps from the first row of a layer down to a depth, the inverse of [`Grid::depth_in`].
    pub(crate) fn steps_in(&self, layer: &Layer, z: f64) -> f64 {
        let Some(Positions { depths, .. }) = &self.positions else { return (z - layer.top) / layer.dz };
        place(&depths[layer.first..=layer.last()], z)
    }

    /// Place of a radius among the nodes, in distances of them from node 0.
    pub(crate) fn place(&self, r: f64) -> f64 {
        let Some(Positions { radii, .. }) = &self.positions else { return (r - self.r0) / self.dr };
        place(radii, r)
    }
}

/// Place of a position among others that grow, in distances of them from the first; beyond the ends in that of the two there.
pub fn place(positions: &[f64], x: f64) -> f64 {
    let i = positions.partition_point(|position| *position <= x).clamp(1, positions.len() - 1) - 1;
    i as f64 + (x - positions[i]) / (positions[i + 1] - positions[i])
}

/// Where a mesh of these widths ends, the last of them being beyond its last node \[R\].
pub fn outer_radius(widths: &[f64]) -> f64 {
    widths.iter().sum::<f64>() - 0.5 * widths[0]
}
