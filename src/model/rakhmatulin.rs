//! The simplified theory of Rakhmatulin: one displacement along the impact, \[KA\] Eqs. 17–19,
//!
//! ```text
//! u_tt = u_zz + c_s²(u_rr + u_r/r)       σ_zz = ∂u/∂z       u = 0 on the backing z = h
//! ```
//!
//! Two levels of `u` are kept, rows 0 (the surface) to nz (the backing), column by column; the next level overwrites
//! the one before. A strip under the surface goes step by step; the interior follows behind it in passes over many
//! levels ([`super::sweep`]), and catches up before anything of it is shown.
//!
//! Work is limited by two cones, both exact to the bit. A wave moves one node per step at most, so at level k
//! everything below row k, and outside the loaded surface by k nodes, is at rest and not touched. And where nothing
//! but the surface is looked at, what lies deeper than the steps that are left can no longer be seen there.

use rayon::prelude::*;

use super::{
    BackingPeak, Extent, Field, Model, TargetEnergy,
    stencil::{Column, column_axial, column_kinetic, columns_shear, free_surface},
    sweep::{LAG, Lanes, Levels, Lit, RowPeak, STRIP, Sweep, Weights, advance_strip},
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

/// Rows that are shown in one pass over the columns.
const BAND: usize = 16;

/// The simplified model.
pub struct Rakhmatulin {
    grid: Grid,
    levels: Levels,
    outward: Vec<f64>,
    inward: Vec<f64>,
    /// c_s²·Δz/Δr
    shear: f64,
    sight: Sight,
    lanes: Lanes,
    /// Level k of the surface.
    level: usize,
    /// Columns that may differ from 0 at level k.
    columns: usize,
    /// Levels that the interior lags behind the surface.
    behind: Vec<Lit>,
    /// Peak of the row before the backing, over all levels but the newest, and at the newest.
    peaks: [RowPeak; 2],
    column_energy: Vec<TargetEnergy>,
}

impl Rakhmatulin {
    /// A target at rest.
    ///
    /// * `c_s`: shear wave speed \[c_p\]; `c_s·Δt ≤ Δr` for stability
    pub fn new(grid: Grid, c_s: f64, sight: Sight) -> Self {
        let courant = c_s * grid.dt() / grid.dr;
        assert!(courant <= 1.0 + 1e-9, "unstable: radial Courant number {courant}");
        let (outward, inward) = grid.radial_weights();
        let scaled = |weights: Vec<f64>| weights.iter().map(|w| 0.25 * courant * courant * w).collect();
        Self {
            levels: Levels::new(grid.nz + 1, grid.nr()),
            outward: scaled(outward),
            inward: scaled(inward),
            shear: c_s * c_s * grid.dz / grid.dr,
            sight,
            lanes: Lanes::detect(),
            level: 0,
            columns: 0,
            behind: Vec::with_capacity(LAG),
            peaks: Default::default(),
            column_energy: vec![TargetEnergy::default(); grid.nr()],
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

    /// Level that is shown after the step from it to the next one.
    fn shown(&self) -> usize {
        self.level - 1
    }

    /// Columns that may differ from 0 at level k+1, given the loaded part of the surface.
    fn next_columns(&self, surface: &Surface) -> usize {
        (self.columns + 1).max(surface.loaded).min(self.grid.nr())
    }

    /// A field at node (j, i) of the level that is shown.
    fn show(&self, field: Field, surface: &Surface, shown: usize, j: usize, i: usize) -> f64 {
        let (dz, dt, nz) = (self.grid.dz, self.grid.dt(), self.grid.nz);
        let u = self.levels.column(shown, i);
        match field {
            Field::Displacement => u[j],
            Field::Stress if j == 0 => surface.pressure[i],
            // −∂u/∂z, on the backing with the odd image u_{nz+1} = −u_{nz−1}
            Field::Stress if j == nz => u[nz - 1] / dz,
            Field::Stress => (u[j - 1] - u[j + 1]) / (2.0 * dz),
            Field::Velocity if j == nz => 0.0,
            Field::Velocity => {
                // (u^{k+1} − u^{k−1})/(2Δt), where the scheme run backwards gives u^{k−1} again
                let next = self.levels.column(self.level, i)[j];
                let four = |column: &[f64]| {
                    let above = if j == 0 { column[1] } else { column[j - 1] };
                    (above + column[j + 1], above + column[j + 1] + 2.0 * column[j])
                };
                let (ends, here) = four(u);
                let mut radial = 0.0;
                if i + 1 < self.grid.nr() {
                    radial += self.outward[i] * (four(self.levels.column(shown, i + 1)).1 - here);
                }
                if i > 0 {
                    radial -= self.inward[i] * (here - four(self.levels.column(shown, i - 1)).1);
                }
                let push = if j == 0 { surface.compliance[i] * surface.pressure[i] } else { 0.0 };
                let before = (ends - next) + radial + push;
                (next - before) / (2.0 * dt)
            }
        }
    }

    /// Brings the interior up to the level of the surface.
    fn catch_up(&mut self) {
        if self.behind.is_empty() {
            return;
        }
        let sweep = Sweep {
            levels: &mut self.levels,
            weights: Weights { outward: &self.outward, inward: &self.inward },
            base: self.level - self.behind.len(),
            lit: &self.behind,
            last_row: self.grid.nz - 1,
            lanes: self.lanes,
        };
        let [earlier, newest] = sweep.run();
        self.note_peaks(earlier, newest);
        self.behind.clear();
    }

    /// Takes note of peaks of the row before the backing, of levels before the newest one and of the newest. What was the
    /// newest counts as settled only once the surface has gone on.
    fn note_peaks(&mut self, earlier: RowPeak, newest: RowPeak) {
        let [mut settled, mut last] = self.peaks;
        if last.level < self.level {
            settled = settled.larger(last);
            last = RowPeak::default();
        }
        self.peaks = [settled.larger(earlier), last.larger(newest)];
    }
}

impl Model for Rakhmatulin {
    fn predict(&mut self, surface: &mut Surface) {
        let columns = (self.columns + 1).min(self.grid.nr());
        let level = self.level;
        let mut around = [0, 1, 2].map(|m| self.levels.top_before(level, m));
        for i in 0..columns {
            let before = self.levels.column(level + 1, i)[0];
            surface.free[i] = free_surface(before, around, self.outward[i], self.inward[i]);
            if i + 1 < columns {
                around = [around[1], around[2], self.levels.top_before(level, i + 3)];
            }
        }
        // half cell of mass a·Δz/2: Δt²·a·p/(a·Δz/2)
        surface.compliance.fill(2.0 * self.grid.dt() * self.grid.dt() / self.grid.dz);
    }

    fn advance(&mut self, surface: &Surface) {
        if self.behind.len() == LAG {
            self.catch_up();
        }
        let columns = self.next_columns(surface);
        self.level += 1;
        let lit = Lit { rows: self.rows(self.level), columns };
        self.behind.push(lit);
        self.columns = columns;

        for (i, &u) in surface.displacement[..columns].iter().enumerate() {
            self.levels.column_mut(self.level, i)[0] = u;
        }
        let rows = STRIP - self.behind.len();
        let weights = Weights { outward: &self.outward, inward: &self.inward };
        advance_strip(&mut self.levels, self.level, weights, rows, lit, self.lanes);
        let last_row = self.grid.nz - 1;
        if last_row < rows.min(lit.rows) {
            let value = |i: usize| self.levels.column(self.level, i)[last_row];
            let start = RowPeak { level: self.level, ..RowPeak::default() };
            let newest = (0..columns).fold(start, |peak, i| peak.with(value(i), self.level, i));
            self.note_peaks(RowPeak::default(), newest);
        }
    }

    fn energy(&mut self) -> TargetEnergy {
        self.catch_up();
        let rows = (self.level + 1).min(self.grid.nz) + 1;
        let (dz, dt, shear) = (self.grid.dz, self.grid.dt(), self.shear);
        let (levels, level, grid) = (&self.levels, self.level, &self.grid);
        let columns = self.columns;
        self.column_energy[..columns]
            .par_iter_mut()
            .with_min_len((NODES_PER_TASK / rows).max(1))
            .enumerate()
            .for_each(|(i, energy)| {
                let column = |i: usize| Column {
                    earlier: &levels.column(level + 1, i)[..rows],
                    later: &levels.column(level, i)[..rows],
                };
                let (area, here) = (grid.area[i], column(i));
                energy.kinetic = 0.5 * area * dz * column_kinetic(here, dt);
                energy.strain = 0.5 * area / dz * column_axial(here);
                if grid.face[i] > 0.0 {
                    energy.strain += 0.5 * grid.face[i] * shear * columns_shear(here, column(i + 1));
                }
            });
        // in the order of columns: the same sum on any number of threads
        let mut total = TargetEnergy::default();
        for column in &self.column_energy[..columns] {
            total.kinetic += column.kinetic;
            total.strain += column.strain;
        }
        total
    }

    fn backing_peak(&mut self) -> BackingPeak {
        self.catch_up();
        // odd image beyond the backing, u_{nz+1} = −u_{nz−1}: ∂u/∂z = −u_{nz−1}/Δz
        let RowPeak { value, level, column } = self.peaks[0];
        BackingPeak { strain: value / self.grid.dz, r: self.grid.r(column), step: level as u64 }
    }

    fn sample(&self, field: Field, surface: &Surface, values: &mut Vec<f32>) -> Extent {
        assert!(
            self.behind.is_empty(),
            "frames are shown after the energy, which brings the interior up to date"
        );
        let shown = self.shown();
        let nr = self.columns.max(1);
        let rows = self.level.min(self.grid.nz + 1);
        values.clear();
        values.resize(nr * rows, 0.0);
        // fields are stored by columns and shown by rows: some rows at a time, so that caches keep both
        for first in (0..rows).step_by(BAND) {
            for i in 0..nr {
                for j in first..(first + BAND).min(rows) {
                    values[j * nr + i] = self.show(field, surface, shown, j, i) as f32;
                }
            }
        }
        Extent { nr, nz: rows }
    }

    fn surface(&self, values: &mut Vec<f64>) {
        let shown = self.shown();
        values.clear();
        values.extend((0..self.columns).map(|i| self.levels.column(shown, i)[0]));
    }

    fn find_non_finite(&mut self) -> Option<(f64, f64)> {
        self.catch_up();
        let rows = self.rows(self.level).max(1);
        (0..self.columns).find_map(|i| {
            let column = &self.levels.column(self.level, i)[..rows];
            column.iter().position(|u| !u.is_finite()).map(|j| (self.grid.r(i), j as f64 * self.grid.dz))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Geometry, MeshKind, Spacing};

    /// The scheme step by step over the whole mesh, written down as plainly as possible.
    struct Plain {
        now: Vec<Vec<f64>>,
        before: Vec<Vec<f64>>,
    }

    impl Plain {
        fn new(grid: &Grid) -> Self {
            let zeros = vec![vec![0.0; grid.nr()]; grid.nz + 1];
            Self { now: zeros.clone(), before: zeros }
        }

        /// Advances to the next level, the surface being moved to `surface`.
        fn step(&mut self, model: &Rakhmatulin, surface: &[f64]) {
            let nr = surface.len();
            let now = &self.now;
            for (j, row) in self.before.iter_mut().enumerate() {
                for i in 0..nr {
                    if j == 0 {
                        row[i] = surface[i];
                    } else if j + 1 < now.len() {
                        let mean = |i: usize| (now[j - 1][i] + now[j + 1][i]) + 2.0 * now[j][i];
                        let outer = if i + 1 < nr { mean(i + 1) } else { 0.0 };
                        let inner = if i > 0 { mean(i - 1) } else { 0.0 };
                        let radial =
                            model.outward[i] * (outer - mean(i)) - model.inward[i] * (mean(i) - inner);
                        row[i] = ((now[j - 1][i] + now[j + 1][i]) - row[i]) + radial;
                    }
                }
            }
            std::mem::swap(&mut self.now, &mut self.before);
        }
    }

    /// Numbers that look random and repeat.
    struct Noise(u64);

    impl Noise {
        fn next(&mut self, below: usize) -> usize {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 33) as usize) % below
        }
    }

    /// Moves the surface of a model and of the plain scheme alike and compares them at odd steps, bit by bit.
    fn compare(seed: u64, threads: usize) {
        let mut noise = Noise(seed);
        let geometry = [Geometry::Axisymmetric, Geometry::Plane][noise.next(2)];
        let kind = [MeshKind::Matched, MeshKind::Paper][noise.next(2)];
        let (nr, nz) = (1 + noise.next(400), 2 + noise.next(150));
        let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(nz) };
        let grid = Grid::new(geometry, kind, spacing, nr, nz);
        let c_s = 0.5 * (1 + noise.next(100)) as f64 / 100.0;
        let mut model = Rakhmatulin::new(grid.clone(), c_s, Sight::Field);
        if noise.next(3) == 0 {
            model.lanes = Lanes::Baseline;
        }
        let mut plain = Plain::new(&grid);
        let mut surface = Surface::new(nr);
        surface.loaded = 1 + noise.next(nr);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        for step in 0..60 + noise.next(120) {
            model.predict(&mut surface);
            for i in 0..nr {
                let push = if i < surface.loaded { noise.next(1000) as f64 / 1000.0 } else { 0.0 };
                surface.displacement[i] = surface.free[i] + push;
            }
            pool.install(|| model.advance(&surface));
            plain.step(&model, &surface.displacement);
            if noise.next(9) == 0 || step < 3 {
                pool.install(|| model.catch_up());
                for (level, rows) in [(model.level, &plain.now), (model.level + 1, &plain.before)] {
                    for (j, row) in rows.iter().enumerate() {
                        for (i, a) in row.iter().enumerate() {
                            let b = &model.levels.column(level, i)[j];
                            assert!(
                                a == b,
                                "seed {seed}, {threads} threads, step {step}, ({j}, {i}): {a} {b}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn the_interior_behind_the_surface_is_the_plain_scheme() {
        for seed in 0..40 {
            compare(seed, 1 + seed as usize % 3);
        }
    }

    #[test]
    fn the_newest_level_is_no_peak_yet() {
        // on shallow layers the strip reaches the backing, on deep ones the interior does
        for nz in [3, 10, 17, 18, 19, 40] {
            let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(nz) };
            let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, 20, nz);
            let mut model = Rakhmatulin::new(grid, 0.4, Sight::Field);
            let mut surface = Surface::new(20);
            surface.loaded = 20;
            for step in 0..120u64 {
                model.predict(&mut surface);
                // pushed ever harder, so that every level has a larger peak than the one before
                surface.displacement.fill((step * step) as f64);
                model.advance(&surface);
                if step % 7 == 0 || step == 119 {
                    let peak = model.backing_peak();
                    assert!(peak.step <= step, "{nz} rows, step {step}: {peak:?}");
                }
            }
            assert!(model.backing_peak().strain > 0.0);
        }
    }

    #[test]
    fn peaks_of_the_backing_do_not_depend_on_when_the_interior_catches_up() {
        let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(40) };
        let grid = Grid::new(Geometry::Axisymmetric, MeshKind::Matched, spacing, 200, 40);
        let peaks = |every: usize| {
            let mut model = Rakhmatulin::new(grid.clone(), 0.4, Sight::Field);
            let mut surface = Surface::new(200);
            surface.loaded = 20;
            let mut seen = Vec::new();
            for step in 0..150 {
                model.predict(&mut surface);
                surface.displacement.copy_from_slice(&surface.free);
                surface.displacement[..20].fill((step as f64 * 0.1).sin());
                model.advance(&surface);
                if step % every == 0 {
                    model.catch_up();
                }
                if step % 49 == 48 {
                    seen.push(model.backing_peak());
                }
            }
            seen
        };
        let often = peaks(1);
        assert!(often.iter().skip(1).all(|peak| peak.strain > 0.0 && peak.step > 0));
        assert_eq!(often, peaks(7));
        assert_eq!(often, peaks(1000));
    }
}
