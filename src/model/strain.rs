//! The largest strain in the target: of which cells it is taken, and when.
//!
//! Cells near the contact are looked at in every step, as are both faces; all others in one step of [`INTERVAL`], which costs little.
//! Of cells it is the largest principal strain by magnitude in their middle, in the simplified theory, whose displacements are
//! along z only, `|∂u_z/∂z|`. On a half-space they are taken of the cells that the surface and the interfaces can still feel in the run,
//! so that they do not depend on what is recorded deeper.

use serde::{Deserialize, Serialize};

use crate::grid::Grid;

/// Rows of cells at the surface that are looked at in every step.
pub const NEAR_ROWS: usize = 4;
/// Columns beyond the contact that are looked at in every step.
pub const NEAR_COLUMNS: usize = 8;
/// Steps from one in which all cells are looked at to the next.
pub const INTERVAL: usize = 128;

/// Cells whose strain is taken at a level: the first rows, and of them the first columns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Watched {
    /// Number of rows of cells.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
}

impl Watched {
    /// * `loaded`: number of surface nodes that have been in contact
    /// * `depths`: rows of cells that may be looked at, by depth
    pub fn at(grid: &Grid, level: usize, loaded: usize, depths: usize) -> Self {
        let (rows, columns) = match level.is_multiple_of(INTERVAL) {
            true => (grid.nz, grid.nr()),
            false => (NEAR_ROWS, loaded + NEAR_COLUMNS),
        };
        Self {
            rows: rows.min(grid.rows_at(0..depths.min(grid.depth())).end),
            columns: columns.min(grid.nr()),
        }
    }
}

/// The largest strain of cells so far: where there are several, that of the earliest level, then of the uppermost row, then the
/// innermost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CellPeak {
    /// Strain by magnitude.
    pub strain: f64,
    /// Level.
    pub level: usize,
    /// Row of the cell, below that row of nodes.
    pub row: usize,
    /// Column of the cell, in the full theory at the inner side of that column of nodes.
    pub column: usize,
}

impl CellPeak {
    /// The larger of two peaks.
    pub fn larger(self, other: Self) -> Self {
        let place = |peak: &Self| (peak.level, peak.row, peak.column);
        let is_first = place(&other) < place(&self);
        if other.strain > self.strain || (other.strain == self.strain && is_first) { other } else { self }
    }

    /// The middle of the cell, `(r, z)` \[R\].
    pub fn place(&self, grid: &Grid) -> (f64, f64) {
        middle(grid, self.row, self.column)
    }
}

/// The middle of a cell, `(r, z)` \[R\].
pub fn middle(grid: &Grid, row: usize, column: usize) -> (f64, f64) {
    let r = match (grid.cells_between_nodes, column) {
        (false, i) => grid.r(i),
        (true, 0) => 0.0,
        (true, i) => grid.r(i) - 0.5 * grid.width(i),
    };
    let layer = grid.layer(row);
    (r, grid.depth_in(layer, (row - layer.first) as f64 + 0.5))
}
