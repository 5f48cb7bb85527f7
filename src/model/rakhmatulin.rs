//! The simplified theory of Rakhmatulin: one displacement along the impact, \[KA\] Eqs. 17–19,
//!
//! ```text
//! u_tt = u_zz + c_s²(u_rr + u_r/r)       σ_zz = ∂u/∂z       u = 0 on the backing z = h
//! ```
//!
//! Two levels of `u` are kept, rows 0 (the surface) to nz (the backing), in the order of radii; the next level overwrites
//! the one before. A strip under the surface goes step by step; the interior follows behind it in passes over many
//! levels ([`super::sweep`], [`super::interior`]), and catches up before anything of it is shown.
//!
//! Work is limited to the light cone ([`super::cone`]): what has moved and can still be seen.

use ndarray::s;
use rayon::prelude::*;

use super::{
    BackingPeak, Extent, Field, Model, TargetEnergy,
    cone::{Cone, Sight},
    interior::Interior,
    lanes::{Lanes, PACK},
    levels::Levels,
    stencil::{RowEnergy, Rows, free_surface},
    sweep::{Ground, Lit, RowPeak, lag, strip_rows},
};
use crate::{grid::Grid, surface::Surface};

/// Number of nodes below which a parallel task is not worth its start.
const NODES_PER_TASK: usize = 16_384;

/// The simplified model.
pub struct Rakhmatulin {
    grid: Grid,
    field: Interior,
    /// c_s²·Δz/Δr
    shear: f64,
    cone: Cone,
    /// Level k of the surface.
    level: usize,
    /// Levels that no sweep of the interior has begun yet.
    behind: Vec<Lit>,
    /// Largest peak of the row before the backing so far, and that of the newest level.
    peaks: [RowPeak; 2],
    /// Cell areas and face weights, for whole packs.
    area: Vec<f64>,
    face: Vec<f64>,
    row_energies: Vec<[RowEnergy; 2]>,
    /// Sums over z on the surface.
    four: Vec<f64>,
}

impl Rakhmatulin {
    /// A target at rest.
    ///
    /// * `c_s`: shear wave speed \[c_p\]; `c_s·Δt ≤ Δr` for stability
    pub fn new(grid: Grid, c_s: f64, sight: Sight) -> Self {
        Self::with_lanes(grid, c_s, sight, Lanes::detect())
    }

    fn with_lanes(grid: Grid, c_s: f64, sight: Sight, lanes: Lanes) -> Self {
        let courant = c_s * grid.dt() / grid.dr;
        assert!(courant <= 1.0 + 1e-9, "unstable: radial Courant number {courant}");
        let levels = Levels::new(grid.nz + 1, grid.nr());
        let (outward, inward) = grid.radial_weights();
        // columns that only fill the last pack have no weight and stay at rest
        let padded = |mut weights: Vec<f64>| {
            weights.resize(levels.columns(), 0.0);
            weights
        };
        let scaled =
            |weights: Vec<f64>| padded(weights.iter().map(|w| 0.25 * courant * courant * w).collect());
        Self {
            area: padded(grid.area.clone()),
            face: padded(grid.face.clone()),
            field: Interior::new(Ground {
                outward: scaled(outward),
                inward: scaled(inward),
                lag: lag(grid.nz),
                last_row: grid.nz - 1,
                lanes,
                levels,
            }),
            shear: c_s * c_s * grid.dz / grid.dr,
            cone: Cone::new(sight, courant.min(1.0), grid.nz, grid.nr()),
            level: 0,
            behind: Vec::with_capacity(lag(grid.nz)),
            peaks: Default::default(),
            row_energies: Vec::new(),
            four: Vec::new(),
            grid,
        }
    }

    /// Level that is shown after the step from it to the next one.
    fn shown(&self) -> usize {
        self.level - 1
    }

    /// Writes row `j` of a field at the level that is shown.
    fn show(&self, field: Field, surface: &Surface, j: usize, values: &mut [f32]) {
        let (dz, dt, nz, shown) = (self.grid.dz, self.grid.dt(), self.grid.nz, self.shown());
        let row = |j: usize| self.field.row(shown, j);
        let n = values.len();
        match field {
            Field::Displacement => {
                values.iter_mut().zip(row(j)).for_each(|(value, u)| *value = *u as f32);
            }
            Field::Stress if j == 0 => {
                values.iter_mut().zip(&surface.pressure).for_each(|(value, p)| *value = *p as f32);
            }
            // −∂u/∂z, on the backing with the odd image u_{nz+1} = −u_{nz−1}
            Field::Stress if j == nz => {
                values.iter_mut().zip(row(nz - 1)).for_each(|(value, u)| *value = (u / dz) as f32);
            }
            Field::Stress => {
                let (above, below) = (&row(j - 1)[..n], &row(j + 1)[..n]);
                for (value, (a, b)) in values.iter_mut().zip(above.iter().zip(below)) {
                    *value = ((a - b) / (2.0 * dz)) as f32;
                }
            }
            Field::Velocity if j == nz => values.fill(0.0),
            Field::Velocity => {
                // (u^{k+1} − u^{k−1})/(2Δt)
                let mut before = vec![0.0; n.next_multiple_of(PACK)];
                self.before(surface, j, &mut before);
                let next = self.field.row(self.level, j);
                for (value, (next, before)) in values.iter_mut().zip(next.iter().zip(&before)) {
                    *value = ((next - before) / (2.0 * dt)) as f32;
                }
            }
        }
    }

    /// Writes row `j` at the level before the one that is shown, whole packs of it, from that one and the next one.
    fn before(&self, surface: &Surface, j: usize, row: &mut [f64]) {
        if j == self.grid.nz {
            row.fill(0.0);
        } else if j > 0 {
            self.field.row_before(self.level, j, row);
        } else {
            // u_0^{k−1} = 2u_1 − u_0^{k+1} + λ²·Λ_r U_0 + compliance·p
            let n = row.len().min(self.grid.nr());
            let next = self.field.row(self.level, 0);
            let [top, below] = [0, 1].map(|j| &self.field.row(self.shown(), j)[..=n]);
            let Ground { outward, inward, .. } = self.field.ground();
            free_surface(next, top, below, [outward, inward], &mut Vec::new(), &mut row[..n]);
            for (u, (p, compliance)) in row.iter_mut().zip(surface.pressure.iter().zip(&surface.compliance)) {
                *u += compliance * p;
            }
        }
    }

    /// Lets the interior follow up to the level of the surface.
    fn follow(&mut self) {
        if !self.behind.is_empty() {
            let peaks = self.field.follow(self.level - self.behind.len(), &self.behind);
            self.behind.clear();
            self.note_peaks(&peaks);
        }
    }

    /// Brings the interior up to the level of the surface.
    fn catch_up(&mut self) {
        self.follow();
        let peaks = self.field.settle();
        self.note_peaks(&peaks);
    }

    /// Takes note of peaks of the row before the backing, see [`Interior::follow`].
    fn note_peaks(&mut self, peaks: &[[RowPeak; 2]]) {
        for &[earlier, last] in peaks {
            self.note_peak(earlier);
            self.note_peak(last);
        }
    }

    /// Takes note of a peak of the row before the backing. That of the newest level counts only once the surface has gone
    /// on.
    fn note_peak(&mut self, peak: RowPeak) {
        let [settled, newest] = &mut self.peaks;
        for peak in [std::mem::take(newest), peak] {
            let slot = if peak.level < self.level { &mut *settled } else { &mut *newest };
            *slot = slot.larger(peak);
        }
    }
}

impl Model for Rakhmatulin {
    fn predict(&mut self, surface: &mut Surface) {
        // what is beyond is at rest, and free
        let columns = (self.cone.columns() + 1).min(self.grid.nr());
        let before = self.field.row(self.level + 1, 0);
        let [top, below] = [0, 1].map(|j| &self.field.row(self.level, j)[..=columns]);
        let Ground { outward, inward, .. } = self.field.ground();
        free_surface(before, top, below, [outward, inward], &mut self.four, &mut surface.free[..columns]);
        // half cell of mass a·Δz/2: Δt²·a·p/(a·Δz/2)
        surface.compliance.fill(2.0 * self.grid.dt() * self.grid.dt() / self.grid.dz);
    }

    fn advance(&mut self, surface: &Surface) {
        let lag = self.field.ground().lag;
        if self.behind.len() == lag {
            self.follow();
        }
        self.level += 1;
        self.cone.advance(self.level, surface.loaded);
        let (columns, lit) = (self.cone.columns(), self.cone.lit(self.level));
        self.behind.push(lit);
        // the row below the lowest one is read
        self.field.open(lit.rows.max(strip_rows(lag)) + 1);

        self.field.row_mut(self.level, 0)[..columns].copy_from_slice(&surface.displacement[..columns]);
        let rows = strip_rows(lag) - self.behind.len();
        self.field.advance_strip(self.level, rows, lit);
        let last_row = self.grid.nz - 1;
        if last_row < rows.min(lit.rows) {
            let row = &self.field.row(self.level, last_row)[..columns];
            let start = RowPeak { level: self.level, ..RowPeak::default() };
            let newest = row.iter().enumerate().fold(start, |peak, (i, u)| peak.with(*u, self.level, i));
            self.note_peak(newest);
        }
    }

    fn energies(&mut self, surface: &Surface) -> [TargetEnergy; 2] {
        self.catch_up();
        let rows = self.level.min(self.grid.nz);
        let columns = self.cone.lit(self.level).columns;
        let mut row_energies = std::mem::take(&mut self.row_energies);
        row_energies.clear();
        row_energies.resize(rows, Default::default());
        let rows_per_task = (NODES_PER_TASK / columns.max(1)).max(8);
        let (area, face) = (&self.area[..columns], &self.face[..columns]);
        let lanes = self.field.ground().lanes;
        row_energies.par_chunks_mut(rows_per_task).enumerate().for_each(|(task, energies)| {
            let first = task * rows_per_task;
            // rows j and j + 1 at level k − 1, with a zero at their ends
            let mut before = [vec![0.0; columns + 1], vec![0.0; columns + 1]];
            self.before(surface, first, &mut before[0][..columns]);
            for (j, energies) in (first..).zip(energies) {
                self.before(surface, j + 1, &mut before[1][..columns]);
                let pair = |level: usize| [self.field.row(level, j), self.field.row(level, j + 1)];
                let (here, next) = (pair(self.shown()), pair(self.level));
                let before_here = Rows { earlier: before.each_ref().map(Vec::as_slice), later: here };
                let here_next = Rows { earlier: here, later: next };
                *energies = [before_here, here_next].map(|rows| lanes.row_energy(rows, area, face));
                before.swap(0, 1);
            }
        });
        let (dz, dt) = (self.grid.dz, self.grid.dt());
        // in the order of rows: the same sum on any number of threads
        let mut totals = [TargetEnergy::default(); 2];
        for (j, energies) in row_energies.iter().enumerate() {
            // the surface has half a cell of mass
            let mass = if j == 0 { 0.5 } else { 1.0 };
            for (total, energy) in totals.iter_mut().zip(energies) {
                total.kinetic += 0.5 * dz * mass * energy.kinetic / (dt * dt);
                total.strain += 0.5 * energy.axial / dz + 0.5 * self.shear * energy.shear;
            }
        }
        self.row_energies = row_energies;
        totals
    }

    fn backing_peak(&mut self) -> BackingPeak {
        self.catch_up();
        // odd image beyond the backing, u_{nz+1} = −u_{nz−1}: ∂u/∂z = −u_{nz−1}/Δz
        self.note_peak(RowPeak::default());
        let RowPeak { value, level, column } = self.peaks[0];
        BackingPeak { strain: value / self.grid.dz, r: self.grid.r(column), step: level as u64 }
    }

    fn sample(&self, field: Field, every: usize, surface: &Surface, values: &mut Vec<f32>) -> Extent {
        assert!(
            self.behind.is_empty() && self.field.is_settled(),
            "frames are shown after the energy, which brings the interior up to date"
        );
        let columns = self.cone.columns().max(1);
        let (nr, nz) = (columns.div_ceil(every), self.level.min(self.grid.nz + 1).div_ceil(every));
        values.clear();
        values.resize(nr * nz, 0.0);
        let rows =
            values.par_chunks_exact_mut(nr).with_min_len((NODES_PER_TASK / columns).max(1)).enumerate();
        if every == 1 {
            rows.for_each(|(j, row)| self.show(field, surface, j, row));
        } else {
            rows.for_each_init(
                || vec![0.0; columns],
                |whole, (j, row)| {
                    self.show(field, surface, j * every, whole);
                    row.iter_mut().zip(whole.iter().step_by(every)).for_each(|(value, node)| *value = *node);
                },
            );
        }
        Extent { nr, nz }
    }

    fn surface(&self, values: &mut Vec<f64>) {
        let shown = self.shown();
        values.clear();
        values.extend_from_slice(&self.field.row(shown, 0)[..self.cone.columns()]);
    }

    fn find_non_finite(&mut self) -> Option<(f64, f64)> {
        self.catch_up();
        let rows = self.cone.lit(self.level).rows.max(1);
        let u = self.field.level(self.level);
        let lit = u.slice(s![..rows, ..self.cone.columns()]);
        let bad = lit.indexed_iter().find(|(_, u)| !u.is_finite()).map(|(place, _)| place);
        bad.map(|(j, i)| (self.grid.r(i), j as f64 * self.grid.dz))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{Geometry, MeshKind, Spacing};

    /// The scheme step by step over all columns of the cone, written down as plainly as possible.
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
            let (now, ground) = (&self.now, model.field.ground());
            for (j, row) in self.before.iter_mut().enumerate() {
                for i in 0..nr.min(model.cone.lit(model.level).columns) {
                    if j == 0 {
                        row[i] = if i < model.cone.columns() { surface[i] } else { 0.0 };
                    } else if j + 1 < now.len() {
                        let mean = |i: usize| (now[j - 1][i] + now[j + 1][i]) + 2.0 * now[j][i];
                        let outer = if i + 1 < nr { mean(i + 1) } else { 0.0 };
                        let inner = if i > 0 { mean(i - 1) } else { 0.0 };
                        let radial =
                            ground.outward[i] * (outer - mean(i)) - ground.inward[i] * (mean(i) - inner);
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
        // deep ones, too, where the interior lags as far behind as it may
        let (nr, nz) = (1 + noise.next(400), 2 + noise.next(if seed.is_multiple_of(4) { 600 } else { 150 }));
        let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(nz) };
        let grid = Grid::new(geometry, kind, spacing, nr, nz);
        let c_s = 0.5 * (1 + noise.next(100)) as f64 / 100.0;
        let lanes = Lanes::all();
        let lanes = lanes[noise.next(lanes.len())];
        let mut model = Rakhmatulin::with_lanes(grid.clone(), c_s, Sight::Field, lanes);
        let mut plain = Plain::new(&grid);
        let mut surface = Surface::new(nr);
        surface.loaded = 1 + noise.next(nr);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        // looked at often, or so seldom that sweeps run into each other
        let seldom = [9, 400][noise.next(2)];
        let steps = 60 + noise.next(120);
        for step in 0..steps {
            model.predict(&mut surface);
            for i in 0..nr {
                let push = if i < surface.loaded { noise.next(1000) as f64 / 1000.0 } else { 0.0 };
                surface.displacement[i] = surface.free[i] + push;
            }
            surface.loaded = nr.min(surface.loaded + noise.next(2));
            pool.install(|| model.advance(&surface));
            plain.step(&model, &surface.displacement);
            if noise.next(seldom) == 0 || step < 3 || step + 1 == steps {
                pool.install(|| model.catch_up());
                for (level, rows) in [(model.level, &plain.now), (model.level + 1, &plain.before)] {
                    for (j, row) in rows.iter().enumerate() {
                        for (i, a) in row.iter().enumerate() {
                            let b = &model.field.row(level, j)[i];
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

    /// Surface, energy and the last field of a run under a hard push, and the largest number in them.
    fn run_with(sight: Sight, c_s: f64, steps: usize) -> (Vec<f64>, Vec<TargetEnergy>, Vec<f32>) {
        let spacing = Spacing { dr: 0.01, dz: 0.01, layer_rows: Some(60) };
        let grid = Grid::new(Geometry::Axisymmetric, MeshKind::Paper, spacing, 400, 60);
        let mut model = Rakhmatulin::new(grid, c_s, sight);
        let mut surface = Surface::new(400);
        surface.loaded = 40;
        let (mut free, mut energy, mut values) = (Vec::new(), Vec::new(), Vec::new());
        for step in 0..steps {
            model.predict(&mut surface);
            free.extend_from_slice(&surface.free);
            surface.displacement.copy_from_slice(&surface.free);
            surface.displacement[..surface.loaded].fill((step + 1) as f64 * 0.01);
            model.advance(&surface);
            if step % 50 == 49 {
                energy.push(model.energies(&surface)[1]);
            }
        }
        let extent = model.sample(Field::Displacement, 1, &surface, &mut values);
        let mut whole = vec![0.0; 400 * 61];
        for j in 0..extent.nz {
            whole[j * 400..][..extent.nr].copy_from_slice(&values[j * extent.nr..][..extent.nr]);
        }
        (free, energy, whole)
    }

    #[test]
    fn nothing_is_lost_outside_the_cone() {
        for c_s in [0.1, 0.5, 0.9] {
            let (free, energy, field) = run_with(Sight::Field, c_s, 600);
            let (all_free, all_energy, all_field) = run_with(Sight::Everything, c_s, 600);
            let largest = all_free.iter().fold(0.0f64, |a, u| a.max(u.abs()));
            let worst = free.iter().zip(&all_free).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // one last bit that differs becomes a hundred of them in 600 steps, whatever made it differ
            assert!(worst < 1e-13 * largest, "c_s = {c_s}: {worst:e} of {largest}");
            for (a, b) in energy.iter().zip(&all_energy) {
                assert!((a.strain - b.strain).abs() < 1e-12 * b.strain, "c_s = {c_s}: {a:?} {b:?}");
                assert!((a.kinetic - b.kinetic).abs() < 1e-12 * b.kinetic, "c_s = {c_s}: {a:?} {b:?}");
            }
            assert_eq!(field.len(), all_field.len());
            let worst = field.iter().zip(&all_field).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            assert!(worst < 1e-6 * largest as f32, "c_s = {c_s}: {worst:e}");
        }
    }

    #[test]
    fn what_one_step_leaves_the_next_one_finds() {
        for geometry in [Geometry::Axisymmetric, Geometry::Plane] {
            let spacing = Spacing { dr: 0.1, dz: 0.1, layer_rows: Some(30) };
            let grid = Grid::new(geometry, MeshKind::Matched, spacing, 75, 30);
            let mut model = Rakhmatulin::new(grid, 0.7, Sight::Field);
            let mut surface = Surface::new(75);
            surface.loaded = 20;
            let mut left = TargetEnergy::default();
            for step in 0..150 {
                model.predict(&mut surface);
                surface.displacement.copy_from_slice(&surface.free);
                for i in 0..surface.loaded {
                    surface.displacement[i] = (0.1 * f64::from(step)).sin();
                    let push = surface.displacement[i] - surface.free[i];
                    surface.pressure[i] = push / surface.compliance[i];
                }
                model.advance(&surface);
                let [found, now] = model.energies(&surface);
                for (a, b) in [(found.kinetic, left.kinetic), (found.strain, left.strain)] {
                    assert!((a - b).abs() <= 1e-12 * (left.kinetic + left.strain), "step {step}: {a} {b}");
                }
                left = now;
            }
            assert!(left.kinetic > 0.0 && left.strain > 0.0);
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
