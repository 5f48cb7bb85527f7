//! The full linear theory of elasticity: displacements along the impact and along r, \[KA\] Eqs. 2, 3, 6,
//!
//! ```text
//! u_tt = (ε + λd)_,z + (1/r)(r µg)_,r       v_tt = (λε + d)_,r + µg_,z        µ = c_s², λ = 1 − 2µ
//! z = 0: ε + λd = −p, g = 0      backing z = h, smooth: u = 0, g = 0      axis: v = 0, g = 0
//! ```
//!
//! The scheme is derived in [`super::cells`]. This module puts its operators together, node by node, for the plain stepper and for what
//! the fast engine shows.

use super::{
    Coverage, Field, Model, Sampling, TargetEnergy,
    blocked::{Engine, Instructions},
    cells::{self, Cell, CellStrains, Column, ColumnWeights, Medium, Row, Strain},
    reference::{Level, Levels, Reference, Scheme},
    scheme::{self, RadialWeights},
};
use crate::grid::{Geometry, Grid};

/// Largest lateral damping σ on any target. Stable inside it are `σ ≤ 2(1 − k)`, and k is 0.6 at most.
pub const LARGEST_DAMPING: f64 = 0.8;

/// Fewest rows of cells in a layer. Where surface and backing meet at the axis one row is not stable, nor are two with damping
/// (`λ_max Δt²/4` up to 1.009; measured with E_r in place of 4E_r², growth by up to 11 % per step).
pub const FEWEST_ROWS: usize = 4;

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

/// The full theory on a mesh, as the plain stepper wants it.
#[derive(Clone, Debug)]
pub struct Elastic {
    grid: Grid,
    medium: Medium,
    weights: Vec<ColumnWeights>,
    /// Lateral damping σ.
    damping_number: f64,
    /// Weights of the lateral damping, if there is any.
    damping: Option<[Vec<RadialWeights>; 2]>,
}

impl Elastic {
    /// The theory on a mesh, see [`Grid::with_cells_between_nodes`].
    ///
    /// * `c_s`: shear wave speed \[c_p\], below √3/2
    /// * `damping`: σ of the lateral damping, see [`largest_damping`]
    ///
    /// # Panics
    ///
    /// If the scheme is not stable: `Δt > Δr`, or with that damping.
    pub fn new(grid: Grid, c_s: f64, damping: f64) -> Self {
        let medium = Medium::new(&grid, c_s);
        assert!(medium.courant <= 1.0 + ROUNDING, "unstable: Courant number {}", medium.courant);
        assert!((0.0..=largest_damping(c_s)).contains(&damping), "unstable: damping {damping}");
        let weights = cells::column_weights(&grid, &medium);
        let damping_number = damping;
        let damping = (damping > 0.0).then(|| cells::damping_weights(&grid, damping));
        Self { grid, medium, weights, damping_number, damping }
    }

    /// A target at rest under the plain stepper.
    ///
    /// * `shown`: what is shown
    pub fn reference<T>(self, shown: impl Into<Sampling>) -> Reference<T, Self, 2> {
        Reference::new(self.grid.clone(), self, shown)
    }

    /// Where row `j` is.
    fn row(&self, j: usize) -> Row {
        match j {
            0 => Row::Surface,
            j if j == self.grid.nz => Row::Backing,
            _ => Row::Interior,
        }
    }

    /// Displacement number `field` in column `i`, which may be an image about the axis or at rest beyond the mesh.
    fn at(&self, level: &Level<2>, field: usize, j: usize, i: isize) -> f64 {
        let (column, sign) = image(field, i);
        if column < self.grid.nr() { sign * level[field][[j, column]] } else { 0.0 }
    }

    /// Columns i−1, i, i+1 around row `j`, and the weights of the cells between them.
    ///
    /// * `at`: displacements by their number, row and column; that of images about the axis and of nodes beyond the mesh, too
    fn columns(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        j: usize,
        i: usize,
    ) -> ([Column; 3], [&ColumnWeights; 2]) {
        let rows = [j.saturating_sub(1), j, (j + 1).min(self.grid.nz)];
        let columns = [-1, 0, 1].map(|di| {
            let [u, v] = [0, 1].map(|field| rows.map(|j| at(field, j, i as isize + di)));
            Column::new(self.row(j), u, v)
        });
        (columns, [&self.weights[i], &self.weights[i + 1]])
    }

    /// `Δt²` times the accelerations of node (j, i) but for damping.
    ///
    /// * `at`: displacements, see [`Elastic::columns`]
    pub(super) fn accelerations(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        j: usize,
        i: usize,
    ) -> [f64; 2] {
        let (columns, weights) = self.columns(at, j, i);
        let [inner, outer] =
            [0, 1].map(|cell| Cell::new(&columns[cell], &columns[cell + 1], weights[cell], &self.medium));
        cells::accelerations(&inner, &outer, weights[0])
    }

    /// What lateral damping adds to displacement number `field` of node (j, i).
    fn damped(&self, before: &Level<2>, now: &Level<2>, field: usize, j: usize, i: usize) -> Option<f64> {
        let weights = &self.damping.as_ref()?[field];
        let moved = |i: isize| self.at(now, field, j, i) - self.at(before, field, j, i);
        // −√(4σ)·E_r of it, which has the images that it has
        let once = |i: isize| {
            let (column, sign) = image(field, i);
            let Some(weights) = weights.get(column) else { return 0.0 };
            let i = column as isize;
            sign * scheme::double_radial([moved(i - 2), moved(i), moved(i + 2)], *weights)
        };
        let i = i as isize;
        Some(-scheme::double_radial([once(i - 2), once(i), once(i + 2)], weights[i as usize]))
    }

    /// Strains of the cell between rows j and j+1 at the inner side of column `i`.
    fn cell_strains(&self, level: &Level<2>, j: usize, i: usize) -> CellStrains {
        let [u, v] = [0, 1].map(|field| {
            [i as isize - 1, i as isize].map(|i| [j, j + 1].map(|j| self.at(level, field, j, i)))
        });
        cells::cell_strains(u, v, &self.weights[i], &self.medium)
    }

    /// Strains at node (j, i).
    ///
    /// * `at`: displacements, see [`Elastic::columns`]
    /// * `pressure`: on the surface at this node
    pub(super) fn strain(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        pressure: f64,
        j: usize,
        i: usize,
    ) -> Strain {
        let hoop = match self.grid.geometry {
            Geometry::Axisymmetric => at(1, j, i as isize) / self.grid.r(i),
            Geometry::Plane => 0.0,
        };
        if j == 0 {
            let v = [-1, 0, 1].map(|di| at(1, 0, i as isize + di));
            let weights = [&self.weights[i], &self.weights[i + 1]];
            return Strain::on_surface(v, weights, &self.medium, self.grid.dz, hoop, pressure);
        }
        let (columns, weights) = self.columns(at, j, i);
        let [inner, here, outer] = &columns;
        let mean = Strain::mean([inner, here, outer], weights, &self.medium, self.grid.dz, hoop);
        // the backing is smooth
        if j == self.grid.nz { Strain { shear: 0.0, ..mean } } else { mean }
    }

    /// The largest principal strain by magnitude in the middle of the cell between rows j and j+1 at the inner side of column `i`.
    ///
    /// * `at`: displacements, see [`Elastic::columns`]
    pub(super) fn largest_strain(&self, at: impl Fn(usize, usize, isize) -> f64, j: usize, i: usize) -> f64 {
        let [u, v] = [0, 1]
            .map(|field| [i as isize - 1, i as isize].map(|column| [j, j + 1].map(|j| at(field, j, column))));
        let ColumnWeights { inner, outer, hoop, .. } = self.weights[i];
        cells::largest_strain(u, v, [inner, outer], hoop, self.medium.courant) / (2.0 * self.grid.dz)
    }

    /// What a field of stress shows.
    ///
    /// # Panics
    ///
    /// If the field is none of stress.
    pub(super) fn stress(&self, field: Field, strain: &Strain) -> f64 {
        let stress = strain.stress(&self.medium);
        match field {
            Field::Stress => -stress.zz,
            Field::StressRr => -stress.rr,
            Field::StressTt => -stress.tt,
            Field::StressRz => -stress.rz,
            Field::Pressure => stress.pressure(),
            Field::VonMises => stress.von_mises(),
            Field::MaxShear => stress.max_shear(),
            Field::Displacement | Field::DisplacementR | Field::Velocity | Field::VelocityR => {
                unreachable!("{field:?} is no stress")
            }
        }
    }

    /// Displacements of a level as the operators read them.
    fn reading<'a>(&'a self, level: &'a Level<2>) -> impl Fn(usize, usize, isize) -> f64 + 'a {
        |field, j, i| self.at(level, field, j, i)
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
    ) -> Engine<T> {
        Engine::with_cells(self, coverage, shown, instructions)
    }

    /// The mesh.
    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Constants of the material.
    pub(super) fn medium(&self) -> &Medium {
        &self.medium
    }

    /// Weights by column, shape `(nr + 1,)`.
    pub(super) fn weights(&self) -> &[ColumnWeights] {
        &self.weights
    }

    /// Lateral damping σ.
    pub(super) fn damping_number(&self) -> f64 {
        self.damping_number
    }

    /// Weights of the lateral damping by column, if there is any.
    pub(super) fn damping(&self) -> Option<&[Vec<RadialWeights>; 2]> {
        self.damping.as_ref()
    }

    /// Share of a row's cells in the mass of its nodes.
    fn depth(&self, j: usize) -> f64 {
        if j == 0 || j == self.grid.nz { 0.5 * self.grid.dz } else { self.grid.dz }
    }
}

/// Column that stands at column `i` of displacement number `field`, and its sign: u is even about the axis, v odd.
fn image(field: usize, i: isize) -> (usize, f64) {
    (scheme::image_column(i), if i < 0 && field == 1 { -1.0 } else { 1.0 })
}

impl Scheme<2> for Elastic {
    fn next(&self, before: &Level<2>, now: &Level<2>, j: usize, i: usize) -> [f64; 2] {
        let accelerations = self.accelerations(self.reading(now), j, i);
        let next = [0, 1].map(|field| {
            let free = cells::advanced(before[field][[j, i]], now[field][[j, i]], accelerations[field]);
            match self.damped(before, now, field, j, i) {
                Some(added) => free + added,
                None => free,
            }
        });
        // the backing does not yield
        if j == self.grid.nz { [0.0, next[1]] } else { next }
    }

    fn compliance(&self, _i: usize) -> f64 {
        scheme::compliance(self.grid.dt(), self.grid.dz)
    }

    fn energy(&self, earlier: &Level<2>, later: &Level<2>) -> TargetEnergy {
        let Grid { dz, nz, .. } = self.grid;
        let mut energy = TargetEnergy::default();
        for j in 0..=nz {
            for i in 0..self.grid.nr() {
                let areas = [Some(self.grid.area[i]), cells::lateral_area(&self.grid, i)];
                for (field, area) in areas.into_iter().enumerate() {
                    let moved = later[field][[j, i]] - earlier[field][[j, i]];
                    let mass = self.depth(j) * area.unwrap_or_default();
                    energy.kinetic += scheme::kinetic_energy(mass, moved, self.grid.dt());
                }
            }
        }
        for j in 0..nz {
            for i in 0..=self.grid.nr() {
                let [a, b] = [earlier, later].map(|level| self.cell_strains(level, j, i));
                energy.strain += cells::strain_energy(a, b, self.weights[i].cell / dz, &self.medium);
            }
        }
        energy
    }

    fn show(&self, field: Field, levels: Levels<'_, 2>, pressure: &[f64], j: usize, i: usize) -> f64 {
        let [before, now, next] = levels;
        let velocity =
            |field: usize| scheme::velocity(before[field][[j, i]], next[field][[j, i]], self.grid.dt());
        match field {
            Field::Displacement => now[0][[j, i]],
            Field::DisplacementR => now[1][[j, i]],
            Field::Velocity => velocity(0),
            Field::VelocityR => velocity(1),
            _ => self.stress(field, &self.strain(self.reading(now), pressure[i], j, i)),
        }
    }

    fn surface_strain(&self, now: &Level<2>, pressure: f64, i: usize) -> f64 {
        self.strain(self.reading(now), pressure, 0, i).largest_on_face()
    }

    fn cell_strain(&self, now: &Level<2>, j: usize, i: usize) -> f64 {
        self.largest_strain(self.reading(now), j, i)
    }

    fn backing_strain(&self, level: &Level<2>, i: usize) -> f64 {
        self.strain(self.reading(level), 0.0, self.grid.nz, i).largest_on_face()
    }
}

#[cfg(test)]
mod tests;
