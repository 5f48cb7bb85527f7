//! Layers of rows along z.
//!
//! Rows have numbers, of which an interface has two, one of either layer; *depths* are counted in axial steps from the surface, and both
//! rows of an interface are at one.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::Grid;

/// Far side of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Back {
    /// Smooth and rigid, u = 0.
    Rigid,
    /// Free of stress, half a row of cells below the last row of nodes.
    Free,
}

impl Back {
    /// What lies between the last row of nodes and it, in rows of cells.
    pub fn overhang(self) -> f64 {
        match self {
            Self::Rigid => 0.0,
            Self::Free => 0.5,
        }
    }
}

/// How a layer is joined to the one above it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bond {
    /// Both displacements are shared.
    Welded,
    /// u_z is shared, and there is no shear stress.
    Sliding,
}

/// Rows of a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Number of its first row of nodes.
    pub first: usize,
    /// Number of axial steps; its last row has the number `first + steps`.
    pub steps: usize,
    /// Depth of the first row \[R\].
    pub top: f64,
    /// Distance of rows, on a graded mesh of the first two \[R\].
    pub dz: f64,
    /// What lies below its last row, in rows of cells: half a one above a free back, else nothing.
    pub overhang: f64,
    /// How it is joined to the layer above.
    pub bond: Bond,
}

impl Layer {
    /// Number of its last row of nodes.
    pub fn last(&self) -> usize {
        self.first + self.steps
    }
}

impl Grid {
    /// The same mesh with other layers.
    ///
    /// * `dt`: time step \[R/c_p\]
    /// * `layers`: axial steps of each, their distance and how it is joined to the one above, from the surface down
    ///
    /// # Panics
    ///
    /// If there is no layer.
    pub fn with_layers(mut self, dt: f64, layers: &[(usize, f64, Bond)], back: Back) -> Self {
        let (mut first, mut top) = (0, 0.0);
        self.layers = Vec::new();
        for &(steps, dz, bond) in layers {
            self.layers.push(Layer { first, steps, top, dz, overhang: 0.0, bond });
            (first, top) = (first + steps + 1, top + steps as f64 * dz);
        }
        if let Some(last) = self.layers.last_mut() {
            last.overhang = back.overhang();
        }
        (self.dz, self.nz, self.dt, self.back) = (self.layers[0].dz, first - 1, dt, back);
        self
    }

    /// Number of the layer that row `j` belongs to.
    pub fn layer_of(&self, j: usize) -> usize {
        if j <= self.layers[0].last() { 0 } else { self.layers.partition_point(|layer| layer.last() < j) }
    }

    /// Number of the interface that row `j` is at, which is that of the layer above it, if it is at one.
    pub fn interface_of(&self, j: usize) -> Option<usize> {
        let number = self.layer_of(j);
        if j == self.layers[number].first {
            return number.checked_sub(1);
        }
        (j == self.layers[number].last() && number + 1 < self.layers.len()).then_some(number)
    }

    /// The layer that row `j` belongs to.
    pub fn layer(&self, j: usize) -> &Layer {
        &self.layers[self.layer_of(j)]
    }

    /// Rows of cells of its layer that move with row `j`: half a one at either face of the layer, and a whole one above a free back.
    pub fn cell_rows(&self, j: usize) -> f64 {
        let layer = self.layer(j);
        match j {
            j if j == layer.first => 0.5,
            j if j == layer.last() => 0.5 + layer.overhang,
            _ => 1.0,
        }
    }

    /// True if row `j` is the last one above a free back.
    pub fn is_above_free_back(&self, j: usize) -> bool {
        j == self.nz && self.back == Back::Free
    }

    /// Depth of row `j` \[R\].
    pub fn z(&self, j: usize) -> f64 {
        let layer = self.layer(j);
        self.depth_in(layer, (j - layer.first) as f64)
    }

    /// Depth of the lower face of a layer \[R\].
    pub fn bottom(&self, layer: &Layer) -> f64 {
        self.depth_in(layer, layer.steps as f64 + layer.overhang)
    }

    /// Axial steps from the surface to the last row.
    pub fn depth(&self) -> usize {
        self.nz + 1 - self.layers.len()
    }

    /// Numbers of the rows at some depths; beyond the last row numbers go on with depths.
    pub fn rows_at(&self, depths: Range<usize>) -> Range<usize> {
        // interface number k, from 1 on, has rows first − 1 and first, at depth first − k
        let interfaces = || (1..).zip(&self.layers[1..]);
        let row = |depth: usize| {
            depth + interfaces().take_while(|(number, layer)| layer.first - number < depth).count()
        };
        row(depths.start)..row(depths.end)
    }

    /// Rows that are shown if every so many are: every so many of each layer from its first one on, and where there are several also the last
    /// one of each, so that no interface is missing.
    pub fn shown_rows(&self, every: usize) -> Vec<usize> {
        let rows = self.layers.iter().flat_map(|layer| {
            let last = (self.layers.len() > 1 && layer.steps % every != 0).then(|| layer.last());
            (layer.first..=layer.last()).step_by(every).chain(last)
        });
        rows.collect()
    }
}
