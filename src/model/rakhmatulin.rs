//! The simplified theory of Rakhmatulin: one displacement along the impact, \[KA\] Eqs. 17–19,
//!
//! ```text
//! u_tt = u_zz + c_s²(u_rr + u_r/r)       σ_zz = ∂u/∂z       u = 0 on the backing z = h
//! ```
//!
//! Two levels of `u` are kept, arrays `(nz + 1, nr + 1)`: row 0 is the surface, row nz the backing; column nr is
//! a neighbour for the last node and always 0. The next level overwrites the one before.
//!
//! Work is limited by two cones, both exact to the bit. A wave moves one node per step at most, so at level k
//! everything below row k, and outside the loaded surface by k nodes, is at rest and not touched. And where nothing
//! but the surface is looked at, what lies deeper than the steps that are left can no longer be seen there.

use ndarray::{Array2, ArrayView1, ArrayViewMut1, Axis, s};
use rayon::prelude::*;

use super::{
    Extent, Field, Model, TargetEnergy,
    stencil::{RowPair, advance_row, row_kinetic, rows_strain},
};
use crate::{grid::Grid, surface::Surface};

/// What is looked at during a run, which says how deep the field must be computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// The whole field, at any time.
    Field,
    /// Only the surface, up to and including this step.
    Surface {
        /// Last step of the run.
        last_step: usize,
    },
}

/// Number of nodes below which a parallel task is not worth its start.
const NODES_PER_TASK: usize = 16_384;

/// The simplified model.
pub struct Rakhmatulin {
    grid: Grid,
    now: Array2<f64>,
    before: Array2<f64>,
    outward: Vec<f64>,
    inward: Vec<f64>,
    /// c_s²·Δz/Δr
    shear: f64,
    sight: Sight,
    /// Level k of `now`.
    level: usize,
    /// Columns that may differ from 0 at level k.
    columns: usize,
    row_energy: Vec<TargetEnergy>,
}

impl Rakhmatulin {
    /// A target at rest.
    ///
    /// * `c_s`: shear wave speed \[c_p\]; `c_s·Δt ≤ Δr` for stability
    pub fn new(grid: Grid, c_s: f64, sight: Sight) -> Self {
        let courant = c_s * grid.dt() / grid.dr;
        assert!(courant <= 1.0 + 1e-9, "unstable: radial Courant number {courant}");
        let shape = (grid.nz + 1, grid.nr() + 1);
        let (outward, inward) = grid.radial_weights();
        let scaled = |weights: Vec<f64>| weights.iter().map(|w| 0.25 * courant * courant * w).collect();
        Self {
            now: Array2::zeros(shape),
            before: Array2::zeros(shape),
            outward: scaled(outward),
            inward: scaled(inward),
            shear: c_s * c_s * grid.dz / grid.dr,
            sight,
            level: 0,
            columns: 0,
            row_energy: vec![TargetEnergy::default(); grid.nz + 1],
            grid,
        }
    }

    /// Rows that may differ from 0 and are still of use at `level`: the light cone, from above and from below.
    fn rows(&self, level: usize) -> usize {
        let lit = level.min(self.grid.nz);
        match self.sight {
            Sight::Field => lit,
            // p^K needs rows 0 and 1 at level K, and one row more for each step before
            Sight::Surface { last_step } => lit.min((last_step + 2).saturating_sub(level)),
        }
    }

    /// Displacement at level k, after the step to level k+1.
    fn shown(&self) -> &Array2<f64> {
        &self.before
    }

    /// Columns that may differ from 0 at level k+1, given the loaded part of the surface.
    fn next_columns(&self, surface: &Surface) -> usize {
        (self.columns + 1).max(surface.loaded).min(self.grid.nr())
    }
}

/// A row of a mesh array as a slice.
fn slice<'a>(row: ArrayView1<'a, f64>) -> &'a [f64] {
    row.to_slice().expect("rows are contiguous")
}

fn slice_mut<'a>(row: ArrayViewMut1<'a, f64>) -> &'a mut [f64] {
    row.into_slice().expect("rows are contiguous")
}

impl Model for Rakhmatulin {
    fn predict(&mut self, surface: &mut Surface) {
        let columns = (self.columns + 1).min(self.grid.nr());
        let row = &mut surface.free[..columns];
        row.copy_from_slice(&slice(self.before.row(0))[..columns]);
        let (here, below) = (slice(self.now.row(0)), slice(self.now.row(1)));
        advance_row(row, below, here, below, &self.outward, &self.inward);
        // half cell of mass a·Δz/2: Δt²·a·p/(a·Δz/2)
        surface.compliance.fill(2.0 * self.grid.dt() * self.grid.dt() / self.grid.dz);
    }

    fn advance(&mut self, surface: &Surface) {
        let columns = self.next_columns(surface);
        let rows = self.rows(self.level + 1);
        slice_mut(self.before.row_mut(0))[..columns].copy_from_slice(&surface.displacement[..columns]);
        if rows > 1 {
            let (now, outward, inward) = (&self.now, &self.outward, &self.inward);
            let advance = |j: usize, row: ArrayViewMut1<f64>| {
                let row = &mut slice_mut(row)[..columns];
                let [above, here, below] = [j - 1, j, j + 1].map(|j| slice(now.row(j)));
                advance_row(row, above, here, below, outward, inward);
            };
            let mut inner = self.before.slice_mut(s![1..rows, ..]);
            inner
                .axis_iter_mut(Axis(0))
                .into_par_iter()
                .with_min_len((NODES_PER_TASK / columns).max(1))
                .enumerate()
                .for_each(|(m, row)| advance(m + 1, row));
        }
        std::mem::swap(&mut self.before, &mut self.now);
        self.level += 1;
        self.columns = columns;
    }

    fn energy(&mut self) -> TargetEnergy {
        let rows = (self.level + 1).min(self.grid.nz);
        let columns = self.columns.min(self.grid.nr());
        let (area, face) = (&self.grid.area[..columns], &self.grid.face[..columns]);
        let (dz, dt, shear) = (self.grid.dz, self.grid.dt(), self.shear);
        let (before, now) = (&self.before, &self.now);
        self.row_energy[..rows]
            .par_iter_mut()
            .with_min_len((NODES_PER_TASK / columns.max(1)).max(1))
            .enumerate()
            .for_each(|(j, energy)| {
                let earlier = RowPair { upper: slice(before.row(j)), lower: slice(before.row(j + 1)) };
                let later = RowPair { upper: slice(now.row(j)), lower: slice(now.row(j + 1)) };
                let cell = if j == 0 { 0.5 * dz } else { dz };
                energy.kinetic = cell * row_kinetic(area, earlier.upper, later.upper, dt);
                energy.strain = rows_strain(area, face, earlier, later, dz, shear);
            });
        // in row order: the same sum on any number of threads
        let mut total = TargetEnergy::default();
        for row in &self.row_energy[..rows] {
            total.kinetic += row.kinetic;
            total.strain += row.strain;
        }
        total
    }

    fn backing_strain(&self) -> Option<(f64, f64)> {
        let nz = self.grid.nz;
        if self.level < nz {
            return None;
        }
        // odd image beyond the backing, u_{nz+1} = −u_{nz−1}: ∂u/∂z = −u_{nz−1}/Δz
        let last = self.shown().row(nz - 1);
        let strain = |(i, u): (usize, &f64)| ((u / self.grid.dz).abs(), self.grid.r(i));
        slice(last)[..self.columns]
            .iter()
            .enumerate()
            .map(strain)
            .reduce(|a, b| if b.0 > a.0 { b } else { a })
    }

    fn sample(&self, field: Field, surface: &Surface, values: &mut Vec<f32>) -> Extent {
        let u = self.shown();
        let (dz, dt, nz) = (self.grid.dz, self.grid.dt(), self.grid.nz);
        let nr = self.columns.max(1);
        let rows = self.level.min(nz + 1);
        values.clear();
        let mut scratch = vec![0.0; nr];
        for j in 0..rows {
            let here = &slice(u.row(j))[..nr];
            match field {
                Field::Displacement => values.extend(here.iter().map(|&u| u as f32)),
                Field::Stress if j == 0 => values.extend(surface.pressure[..nr].iter().map(|&p| p as f32)),
                Field::Stress => {
                    // −∂u/∂z, central; on the backing with the odd image u_{nz+1} = −u_{nz−1}
                    let above = slice(u.row(j - 1));
                    for i in 0..nr {
                        let below = if j == nz { -above[i] } else { u[[j + 1, i]] };
                        values.push(((above[i] - below) / (2.0 * dz)) as f32);
                    }
                }
                Field::Velocity if j == nz => values.extend(std::iter::repeat_n(0.0f32, nr)),
                Field::Velocity => {
                    // (u^{k+1} − u^{k−1})/(2Δt), where the scheme run backwards gives u^{k−1} again
                    let next = &slice(self.now.row(j))[..nr];
                    scratch.copy_from_slice(next);
                    let below = slice(u.row(j + 1));
                    let above = if j == 0 { below } else { slice(u.row(j - 1)) };
                    advance_row(&mut scratch, above, slice(u.row(j)), below, &self.outward, &self.inward);
                    for i in 0..nr {
                        let push = if j == 0 { surface.compliance[i] * surface.pressure[i] } else { 0.0 };
                        values.push(((next[i] - (scratch[i] + push)) / (2.0 * dt)) as f32);
                    }
                }
            }
        }
        Extent { nr, nz: rows }
    }

    fn find_non_finite(&self) -> Option<(f64, f64)> {
        let rows = self.rows(self.level).max(1);
        let region = self.now.slice(s![..rows, ..self.columns]);
        let found = region.indexed_iter().find(|(_, u)| !u.is_finite());
        found.map(|((j, i), _)| (self.grid.r(i), j as f64 * self.grid.dz))
    }
}
