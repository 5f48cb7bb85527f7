//! The simplified theory of Rakhmatulin: one displacement along the impact, \[KA\] Eqs. 17–19,
//!
//! ```text
//! u_tt = u_zz + c_s²(u_rr + u_r/r)       σ_zz = ∂u/∂z       u = 0 on the backing z = h
//! ```
//!
//! The scheme is derived in [`super::scheme`]. This module puts its operators together, node by node, for the plain stepper,
//! and its weights, column by column, for the fast engine.

use super::{
    Coverage, Field, FrameFields, Model, TargetEnergy,
    blocked::{Engine, Instructions},
    reference::{Level, Levels, Reference, Scheme},
    scheme::{self, RadialWeights},
};
use crate::grid::Grid;

/// The simplified theory on a mesh, as the plain stepper wants it.
#[derive(Clone, Debug)]
pub struct Rakhmatulin {
    grid: Grid,
    weights: Vec<RadialWeights>,
    /// Radial Courant number.
    courant: f64,
    /// `c_s²·Δz/Δr`
    stiffness: f64,
}

/// Slack for a Courant number of 1 but for rounding.
const ROUNDING: f64 = 1e-9;

impl Rakhmatulin {
    /// The theory on a mesh.
    ///
    /// * `c_s`: shear wave speed \[c_p\]
    ///
    /// # Panics
    ///
    /// If the scheme is not stable: `c_s·Δt > Δr`.
    pub fn new(grid: Grid, c_s: f64) -> Self {
        let courant = scheme::radial_courant(&grid, c_s);
        assert!(courant <= 1.0 + ROUNDING, "unstable: radial Courant number {courant}");
        let weights = scheme::radial_weights(&grid, c_s);
        Self { weights, courant, stiffness: c_s * c_s * grid.dz / grid.dr, grid }
    }

    /// A target at rest under the fast engine.
    ///
    /// * `coverage`: what must be computed
    /// * `shown`: what frames show
    pub fn blocked<T: Send + 'static>(self, coverage: Coverage, shown: FrameFields) -> Box<dyn Model<T>> {
        Box::new(self.engine(coverage, shown, Instructions::detect()))
    }

    pub(super) fn engine<T>(
        self,
        coverage: Coverage,
        shown: FrameFields,
        instructions: Instructions,
    ) -> Engine<T> {
        Engine::new(self.grid, &self.weights, self.courant.min(1.0), coverage, shown, instructions)
    }

    /// A target at rest under the plain stepper.
    ///
    /// * `shown`: what frames show
    pub fn reference<T>(self, shown: FrameFields) -> Reference<T, Self, 1> {
        Reference::new(self.grid.clone(), self, shown)
    }

    /// Level `u` around node (j, i), with the images beyond surface and backing handed to `operator`.
    fn around<R>(
        &self,
        u: &Level<1>,
        j: usize,
        i: usize,
        operator: impl FnOnce(&dyn Fn(isize, isize) -> f64) -> R,
    ) -> R {
        let [u] = u;
        let node = |dj: isize, di: isize| {
            let (j, i) = (j.wrapping_add_signed(dj), i.wrapping_add_signed(di));
            // nothing moves beyond the outermost column, and nothing crosses its face
            if i < self.grid.nr() { u[[j, i]] } else { 0.0 }
        };
        match j {
            0 => operator(&scheme::surface(node)),
            _ if j == self.grid.nz => operator(&scheme::backing(node)),
            _ => operator(&node),
        }
    }
}

impl Scheme<1> for Rakhmatulin {
    fn next(&self, [before]: &Level<1>, now: &Level<1>, j: usize, i: usize) -> [f64; 1] {
        let (before, weights) = (before[[j, i]], self.weights[i]);
        [self.around(now, j, i, |u| match i {
            0 => scheme::axis(u, before, weights),
            _ => scheme::interior(u, before, weights),
        })]
    }

    fn compliance(&self, _i: usize) -> f64 {
        scheme::compliance(self.grid.dt(), self.grid.dz)
    }

    fn energy(&self, [earlier]: &Level<1>, [later]: &Level<1>) -> TargetEnergy {
        let Grid { dz, nz, ref area, ref face, .. } = self.grid;
        let levels = [earlier, later];
        let mut energy = TargetEnergy::default();
        for j in 0..nz {
            // the surface has half a cell
            let depth = if j == 0 { 0.5 * dz } else { dz };
            for i in 0..self.grid.nr() {
                let moved = later[[j, i]] - earlier[[j, i]];
                energy.kinetic += scheme::kinetic_energy(depth * area[i], moved, self.grid.dt());
                let stretches = levels.map(|u| u[[j + 1, i]] - u[[j, i]]);
                energy.strain += scheme::axial_energy(area[i], stretches, dz);
                if i + 1 < self.grid.nr() {
                    let slides = levels.map(|u| {
                        let mean = |i: usize| 0.5 * (u[[j, i]] + u[[j + 1, i]]);
                        mean(i + 1) - mean(i)
                    });
                    energy.strain += scheme::shear_energy(self.stiffness * face[i], slides);
                }
            }
        }
        energy
    }

    fn show(&self, field: Field, levels: Levels<'_, 1>, pressure: &[f64], j: usize, i: usize) -> f64 {
        let [before, now, next] = levels;
        match field {
            Field::Displacement => now[0][[j, i]],
            Field::Velocity => scheme::velocity(before[0][[j, i]], next[0][[j, i]], self.grid.dt()),
            Field::Stress if j == 0 => pressure[i],
            Field::Stress => self.around(now, j, i, |u| scheme::stress(u(-1, 0), u(1, 0), self.grid.dz)),
        }
    }

    fn backing_strain(&self, level: &Level<1>, i: usize) -> f64 {
        self.around(level, self.grid.nz, i, |u| -scheme::stress(u(-1, 0), u(1, 0), self.grid.dz))
    }
}
