//! The full linear theory of elasticity: displacements along the impact and along r, \[KA\] Eqs. 2, 3, 6,
//!
//! ```text
//! u_tt = (ε + λd)_,z + (1/r)(r µg)_,r       v_tt = (λε + d)_,r + µg_,z        µ = c_s², λ = 1 − 2µ
//! z = 0: ε + λd = −p, g = 0      backing z = h, smooth: u = 0, g = 0      axis: v = 0, g = 0
//! ```
//!
//! The scheme is derived in [`super::cells`] and put together in [`super::cell_scheme`]. This module says where it is stable.

use std::ops::Range;

use super::{
    Coverage, Field, Model, Sampling, TargetEnergy,
    blocked::{Engine, Full, Instructions},
    cell_scheme::CellScheme,
    cells::{self, Stress},
    cone::LightCone,
    reference::{Level, Levels, Reference, Scheme, motion, node_by_node},
    scheme,
    strength::Strength,
};
use crate::{
    grid::{Back, Bond, Grid},
    material::Waves,
};

/// Largest lateral damping σ on any target. Stable inside it are `σ ≤ 2(1 − k)`, and k is 0.6 at most.
pub const LARGEST_DAMPING: f64 = 0.8;

/// Fewest rows of cells in a layer. Where surface and backing meet at the axis one row is not stable, nor are two with damping
/// (`λ_max Δt²/4` up to 1.009; measured with E_r in place of 4E_r², growth by up to 11 % per step).
pub const FEWEST_ROWS: usize = 4;
/// Fewest rows of a layer beside a sliding interface: with two there are stacks whose steps are not stable (measured, an eigenvalue of 4.004).
pub const FEWEST_SLIDING: usize = 3;

/// Slack for a Courant number of 1 but for rounding.
const ROUNDING: f64 = 1e-9;

/// Largest lateral damping σ that is stable on a target.
///
/// With `A = Δt²M⁻¹K` stable are σ as long as `A + 8σE_r²` has no eigenvalue beyond 4, and so at least as long as `A + 2σE_r` has none:
/// the spectrum of E_r ends at ¼. A mode of the free surface reaches that first over targets that stretch as they are stretched
/// across (λ < 0), soonest at the axis. Measured with E_r, Δr = Δz (with Δr > Δz it is more):
///
/// | c_s/c_p | 0.82 | 0.83 | 0.84 | 0.85 | 0.86 | 0.866 |
/// |---|---|---|---|---|---|---|
/// | plane, half-space | 0.825 | 0.82 | 0.82 | 0.712 | 0.588 | 0.51 |
/// | axisymmetric, 16 rows | 0.835 | 0.747 | 0.606 | 0.451 | 0.287 | 0.184 |
/// | this bound | 0.8 | 0.690 | 0.540 | 0.390 | 0.240 | 0.150 |
///
/// * `c_s`: shear wave speed \[c_p\], below √3/2
pub fn largest_damping(c_s: f64) -> f64 {
    (0.15 + 15.0 * (0.75f64.sqrt() - c_s)).min(LARGEST_DAMPING)
}

/// The full theory on a mesh, see [`Grid::with_cells_between_nodes`].
///
/// * `c_s`: shear wave speed \[c_p\], below √3/2
/// * `damping`: σ of the lateral damping, see [`largest_damping`]
///
/// # Panics
///
/// If the scheme is not stable: `Δt > Δr`, or with that damping.
pub fn theory(grid: Grid, c_s: f64, damping: f64) -> CellScheme {
    layered(grid, &[Waves::struck(c_s)], damping)
}

/// The full theory on a mesh of layers.
///
/// * `layers`: as many as the mesh has
/// * `damping`: σ of the lateral damping, see [`largest_damping`] of every layer
///
/// # Panics
///
/// If the scheme is not stable: `Δz > Δr`, or with that damping, in a layer.
pub fn layered(grid: Grid, layers: &[Waves], damping: f64) -> CellScheme {
    let scheme = CellScheme::new(grid, layers, damping);
    for layer in &scheme.layers {
        let courant = layer.medium.courant;
        assert!(courant <= 1.0 + ROUNDING, "unstable: Courant number {courant}");
        let largest = largest_damping(layer.medium.shear.sqrt());
        assert!((0.0..=largest).contains(&damping), "unstable: damping {damping}");
    }
    scheme
}

impl CellScheme {
    /// A target at rest under the plain stepper.
    ///
    /// * `coverage`: what must be computed
    /// * `shown`: what is shown
    pub fn reference<T>(self, coverage: Coverage, shown: impl Into<Sampling>) -> Reference<T, Self, 2> {
        let (grid, cone) = (self.grid.clone(), self.cone(coverage));
        Reference::new(grid, self, cone, shown)
    }

    /// The light cone of a load on the surface.
    fn cone(&self, coverage: Coverage) -> LightCone {
        let (courant, damping) = (self.courant().min(1.0), self.damping_number());
        LightCone::damped(coverage, courant, damping, self.grid.depth() + 1, self.grid.nr())
    }

    /// A target at rest under the fast engine.
    ///
    /// * `coverage`: what must be computed
    /// * `shown`: what is shown
    pub fn blocked<T: Send + 'static>(
        self,
        coverage: Coverage,
        shown: impl Into<Sampling>,
    ) -> Box<dyn Model<T>> {
        Box::new(self.engine(coverage, shown.into(), Instructions::detect()))
    }

    pub(super) fn engine<T>(
        self,
        coverage: Coverage,
        shown: Sampling,
        instructions: Instructions,
    ) -> Engine<T, Full> {
        let cone = self.cone(coverage);
        Engine::with_cells(self, cone, shown, instructions)
    }
}

impl CellScheme {
    /// Displacements of node (j, i) at level k+1, if the surface were free of stress.
    ///
    /// * `before`, `now`: levels k−1 and k
    fn next(&self, before: &Level<2>, now: &Level<2>, j: usize, i: usize) -> [f64; 2] {
        if let Some(interface) = self.grid.interface_of(j) {
            let last = self.grid.layers[interface].last();
            let [upper, lower] = self.faces(before, now, interface, i);
            let shares = scheme::shares(self.impedances(interface));
            let joined = [0, 1].map(|field| scheme::joined(shares, [upper[field], lower[field]]));
            return match self.grid.layers[interface + 1].bond {
                Bond::Welded => joined,
                Bond::Sliding => [joined[0], if j == last { upper[1] } else { lower[1] }],
            };
        }
        let next = self.by_itself(before, now, j, i);
        // a rigid backing does not yield
        if j == self.grid.nz && self.grid.back == Back::Rigid { [0.0, next[1]] } else { next }
    }
}

impl Scheme<2> for CellScheme {
    fn stride(&self) -> usize {
        self.grid.nr()
    }

    fn advance(&self, before: &Level<2>, now: &Level<2>, next: &mut Level<2>, part: [usize; 2]) {
        node_by_node(next, part, |j, i| self.next(before, now, j, i));
    }

    fn compliance(&self, _i: usize) -> f64 {
        scheme::compliance(self.grid.dt(), self.grid.dt())
    }

    fn traction(&self, before: &Level<2>, now: &Level<2>, interface: usize, i: usize) -> [f64; 2] {
        let [upper, lower] = self.faces(before, now, interface, i);
        let weight = scheme::traction_weight(self.impedances(interface), self.grid.dt());
        let [normal, shear] = [0, 1].map(|field| weight * (upper[field] - lower[field]));
        match self.grid.layers[interface + 1].bond {
            Bond::Welded => [normal, shear],
            Bond::Sliding => [normal, 0.0],
        }
    }

    fn energies(&self, earlier: &Level<2>, later: &Level<2>) -> Vec<TargetEnergy> {
        let Grid { nz, .. } = self.grid;
        let mut energies = vec![TargetEnergy::default(); self.layers.len()];
        for j in 0..=nz {
            for i in 0..self.grid.nr() {
                let areas = [Some(self.grid.area[i]), cells::lateral_area(&self.grid, i)];
                for (field, area) in areas.into_iter().enumerate() {
                    let moved = later[field][[j, i]] - earlier[field][[j, i]];
                    let mass = self.depth(j) * area.unwrap_or_default();
                    let energy = &mut energies[self.grid.layer_of(j)];
                    energy.kinetic += scheme::kinetic_energy(mass, moved, self.grid.dt());
                }
            }
        }
        for (number, layer) in self.layers.iter().enumerate() {
            let rows = &self.grid.layers[number];
            for j in rows.first..rows.last() {
                for i in 0..=self.grid.nr() {
                    let [a, b] = [earlier, later].map(|level| self.cell_strains(level, j, i));
                    let weight = layer.waves.impedance * layer.weights[i].cell / self.grid.dt();
                    energies[number].strain += cells::strain_energy(a, b, weight, &layer.medium);
                }
            }
            if self.grid.is_above_free_back(rows.last()) {
                for i in 0..=self.grid.nr() {
                    let spreads = [earlier, later].map(|level| self.spread(level, nz, i));
                    let weight = layer.waves.impedance * layer.weights[i].cell / self.grid.dt();
                    energies[number].strain += cells::membrane_energy(spreads, weight, &layer.medium);
                }
            }
        }
        energies
    }

    fn show(&self, levels: Levels<'_, 2>, pressure: &[f64], j: usize, i: usize) -> impl FnMut(Field) -> f64 {
        let mut strain = None;
        move |field| {
            motion(field, levels, self.grid.dt(), j, i).unwrap_or_else(|| {
                let row = self.at_row(j);
                let strain =
                    strain.get_or_insert_with(|| row.strain(self.reading(levels[1]), pressure[i], i));
                row.stress(field, strain)
            })
        }
    }

    fn surface_strain(&self, now: &Level<2>, pressure: f64, i: usize) -> f64 {
        self.at_row(0).strain(self.reading(now), pressure, i).largest_on_face()
    }

    fn look(
        &self,
        now: &Level<2>,
        j: usize,
        columns: Range<usize>,
        mut take: impl FnMut(usize, f64, Option<Stress>),
    ) {
        // no cell lies between the two rows of an interface
        if j != self.grid.layer(j).last() {
            let at = self.reading(now);
            let is_compared = CellScheme::strengths(self)[self.grid.layer_of(j)].is_known();
            columns.for_each(|i| {
                let stress = is_compared.then(|| self.cell_stress(&at, j, i));
                take(i, self.largest_strain(&at, j, i), stress);
            });
        }
    }

    fn backing_strain(&self, level: &Level<2>, i: usize) -> f64 {
        self.at_row(self.grid.nz).back_strain(self.reading(level), i).largest_on_face()
    }

    fn strengths(&self) -> &[Strength] {
        CellScheme::strengths(self)
    }

    fn face_stress(&self, now: &Level<2>, pressure: f64, row: usize, i: usize) -> Option<Stress> {
        Some(CellScheme::face_stress(self, self.reading(now), pressure, row, i))
    }
}

#[cfg(test)]
mod tests;
