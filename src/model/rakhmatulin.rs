//! The simplified theory of Rakhmatulin: one displacement along the impact, \[KA\] Eqs. 17–19,
//!
//! ```text
//! u_tt = u_zz + c_s²(u_rr + u_r/r)       σ_zz = ∂u/∂z       u = 0 on the backing z = h
//! ```
//!
//! Two levels of `u` are kept, rows 0 (the surface) to nz (the backing), in the order of radii; the next level overwrites
//! the one before. A strip under the surface goes step by step; the interior follows behind it in passes over many
//! levels ([`super::sweep`], [`super::interior`]). Frames are taken down on the way ([`super::survey`]).
//!
//! Work is limited to the light cone ([`super::cone`]): what has moved and can still be seen.

use std::{collections::VecDeque, sync::Arc};

use ndarray::s;

use super::{
    BackingPeak, Extent, Model, Show, TargetFrame,
    cone::{Cone, Sight},
    interior::Interior,
    lanes::Lanes,
    levels::Levels,
    stencil::free_surface,
    survey::{Found, Survey},
    sweep::{Ground, Lit, RowPeak, Stage, Top, lag, strip_rows, wait_until},
};
use crate::{grid::Grid, surface::Surface};

/// The simplified model.
pub struct Rakhmatulin {
    grid: Grid,
    field: Interior,
    cone: Cone,
    /// Level k of the surface.
    level: usize,
    /// Levels that no sweep of the interior has begun yet.
    behind: Vec<Stage>,
    show: Show,
    /// Surveys that have been ordered, in the order of levels, with the surface.
    surveys: VecDeque<(Arc<Survey>, Vec<f64>)>,
    /// Frames that nobody has asked for yet.
    frames: VecDeque<TargetFrame>,
    /// Largest peak of the row before the backing so far, and that of the newest level.
    peaks: [RowPeak; 2],
    /// Sums over z on the surface.
    four: Vec<f64>,
}

impl Rakhmatulin {
    /// A target at rest.
    ///
    /// * `c_s`: shear wave speed \[c_p\]; `c_s·Δt ≤ Δr` for stability
    /// * `show`: what frames show
    pub fn new(grid: Grid, c_s: f64, sight: Sight, show: Show) -> Self {
        Self::with_lanes(grid, c_s, sight, show, Lanes::detect())
    }

    fn with_lanes(grid: Grid, c_s: f64, sight: Sight, show: Show, lanes: Lanes) -> Self {
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
            field: Interior::new(Ground {
                dz: grid.dz,
                dt: grid.dt(),
                area: padded(grid.area.clone()),
                outward: scaled(outward),
                inward: scaled(inward),
                lag: lag(grid.nz),
                last_row: grid.nz - 1,
                lanes,
                levels,
            }),
            cone: Cone::new(sight, courant.min(1.0), grid.nz, grid.nr()),
            level: 0,
            behind: Vec::new(),
            peaks: Default::default(),
            show,
            surveys: VecDeque::new(),
            frames: VecDeque::new(),
            four: Vec::new(),
            grid,
        }
    }

    /// Orders what is to be taken down of the level before, a frame, on the way to the newest one.
    fn order_survey(&mut self, lit: Lit) -> Arc<Survey> {
        let (every, columns) = (self.show.every, self.cone.columns());
        let extent = Extent {
            nr: columns.max(1).div_ceil(every),
            nz: self.level.min(self.grid.nz + 1).div_ceil(every),
        };
        let survey = Arc::new(Survey::new(self.level, self.field.ground(), lit.rows, &self.show, extent));
        let surface = self.field.row(self.level - 1, 0)[..columns].to_vec();
        self.surveys.push_back((Arc::clone(&survey), surface));
        survey
    }

    /// Lets the interior follow up to the level of the surface.
    fn follow(&mut self) {
        if !self.behind.is_empty() {
            let base = self.level - self.behind.len();
            let peaks = self.field.follow(base, std::mem::take(&mut self.behind));
            self.note_peaks(&peaks);
        }
    }

    /// Gathers what surveys have found that nobody works on any more.
    fn gather(&mut self) {
        while let Some((survey, _)) = self.surveys.front()
            && Arc::strong_count(survey) == 1
            && let Some((survey, surface)) = self.surveys.pop_front()
        {
            let survey = Arc::into_inner(survey).expect("nobody else has it");
            let Found { energy, next_kinetic, samples } = survey.end(self.field.ground());
            self.frames.push_back(TargetFrame { energy, next_kinetic, samples, surface });
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

    fn advance(&mut self, surface: &Surface, is_frame: bool) {
        let lag = self.field.ground().lag;
        if self.behind.len() == lag {
            self.follow();
        }
        self.level += 1;
        self.cone.advance(self.level, surface.loaded);
        let (columns, lit) = (self.cone.columns(), self.cone.lit(self.level));
        let stage = Stage { lit, survey: is_frame.then(|| self.order_survey(lit)) };
        // the row below the lowest one is read
        self.field.open(lit.rows.max(strip_rows(lag)) + 1);

        let rows = strip_rows(lag) - self.behind.len() - 1;
        let top = Top {
            displacement: &surface.displacement[..columns],
            free: &surface.free[..columns],
            pressure: &surface.pressure,
        };
        self.field.advance_strip(self.level, rows, &stage, top);
        self.behind.push(stage);
        let last_row = self.grid.nz - 1;
        if last_row < rows.min(lit.rows) {
            let row = &self.field.row(self.level, last_row)[..columns];
            let start = RowPeak { level: self.level, ..RowPeak::default() };
            let newest = row.iter().enumerate().fold(start, |peak, (i, u)| peak.with(*u, self.level, i));
            self.note_peak(newest);
        }
    }

    fn frame(&mut self, now: bool) -> Option<TargetFrame> {
        self.gather();
        if now && self.frames.is_empty() {
            self.catch_up();
            for (survey, _) in &self.surveys {
                // whoever did the last of it is about to let go of it
                wait_until(|| Arc::strong_count(survey) == 1);
            }
            self.gather();
        }
        self.frames.pop_front()
    }

    fn backing_peak(&mut self) -> BackingPeak {
        self.catch_up();
        // odd image beyond the backing, u_{nz+1} = −u_{nz−1}: ∂u/∂z = −u_{nz−1}/Δz
        self.note_peak(RowPeak::default());
        let RowPeak { value, level, column } = self.peaks[0];
        BackingPeak { strain: value / self.grid.dz, r: self.grid.r(column), step: level as u64 }
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
    use crate::model::{Field, Sample, TargetEnergy};

    /// The scheme step by step over all columns of the cone, written down as plainly as possible.
    struct Plain {
        now: Vec<Vec<f64>>,
        before: Vec<Vec<f64>>,
        c_s: f64,
    }

    impl Plain {
        fn new(grid: &Grid, c_s: f64) -> Self {
            let zeros = vec![vec![0.0; grid.nr()]; grid.nz + 1];
            Self { now: zeros.clone(), before: zeros, c_s }
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

        /// Energy between the two levels, with the weights of the mesh.
        fn energy(&self, model: &Rakhmatulin) -> TargetEnergy {
            let Ground { dz, dt, area, .. } = model.field.ground();
            let face = &model.grid.face;
            // c_s²·Δz/Δr
            let shear = self.c_s * self.c_s * dz / model.grid.dr;
            let (nz, nr) = (self.now.len() - 1, self.now[0].len());
            let mut energy = TargetEnergy::default();
            for j in 0..nz {
                for i in 0..nr {
                    let at = |level: &[Vec<f64>], j: usize, i: usize| if i < nr { level[j][i] } else { 0.0 };
                    let moved = self.now[j][i] - self.before[j][i];
                    let axial = |level: &[Vec<f64>]| at(level, j + 1, i) - at(level, j, i);
                    let mean = |level: &[Vec<f64>], i: usize| 0.5 * (at(level, j, i) + at(level, j + 1, i));
                    let radial = |level: &[Vec<f64>]| mean(level, i + 1) - mean(level, i);
                    let mass = if j == 0 { 0.5 } else { 1.0 };
                    energy.kinetic += 0.5 * dz * mass * area[i] * moved * moved / (dt * dt);
                    energy.strain += 0.5 * area[i] * axial(&self.now) * axial(&self.before) / dz;
                    energy.strain += 0.5 * shear * face[i] * radial(&self.now) * radial(&self.before);
                }
            }
            energy
        }

        /// Displacement, velocity and stress at the level before the newest one, every so many nodes.
        ///
        /// * `earlier`: the level before that
        fn fields(
            &self,
            model: &Rakhmatulin,
            earlier: &[Vec<f64>],
            pressure: &[f64],
            every: usize,
        ) -> [Vec<f32>; 3] {
            let (u, next, nz) = (&self.before, &self.now, self.now.len() - 1);
            let Ground { dz, dt, .. } = model.field.ground();
            let columns = model.cone.columns().max(1);
            let mut fields = [const { Vec::new() }; 3];
            for j in (0..model.level.min(nz + 1)).step_by(every) {
                for i in (0..columns).step_by(every) {
                    let stress = match j {
                        0 => pressure[i],
                        _ if j == nz => u[nz - 1][i] / dz,
                        _ => (u[j - 1][i] - u[j + 1][i]) / (2.0 * dz),
                    };
                    let velocity = (next[j][i] - earlier[j][i]) / (2.0 * dt);
                    for (field, value) in fields.iter_mut().zip([u[j][i], velocity, stress]) {
                        field.push(value as f32);
                    }
                }
            }
            fields
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

    /// Moves the surface of a model and of the plain scheme alike and compares them at odd steps, bit by bit; with them
    /// what frames show.
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
        let show = Show { every: 1 + noise.next(2) * noise.next(5), ..all_fields() };
        let mut model = Rakhmatulin::with_lanes(grid.clone(), c_s, Sight::Field, show.clone(), lanes);
        let mut plain = Plain::new(&grid, c_s);
        let mut surface = Surface::new(nr);
        surface.loaded = 1 + noise.next(nr);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        // looked at often, or so seldom that sweeps run into each other
        let [seldom, few] = [[9, 400][noise.next(2)], [1, 3, 50, 1000][noise.next(4)]];
        let steps = 60 + noise.next(120);
        let (mut expected, mut found) = (Vec::new(), Vec::new());
        let mut energy = TargetEnergy::default();
        for step in 0..steps {
            model.predict(&mut surface);
            for i in 0..nr {
                let push = if i < surface.loaded { noise.next(1000) as f64 / 1000.0 } else { 0.0 };
                surface.displacement[i] = surface.free[i] + push;
                surface.pressure[i] = push;
            }
            surface.loaded = nr.min(surface.loaded + noise.next(2));
            let is_frame = noise.next(few) == 0 || step + 1 == steps;
            pool.install(|| model.advance(&surface, is_frame));
            let before = plain.before.clone();
            plain.step(&model, &surface.displacement);
            let next_energy = plain.energy(&model);
            if is_frame {
                let fields = plain.fields(&model, &before, &surface.pressure, show.every);
                expected.push((fields, [energy, next_energy]));
            }
            energy = next_energy;
            let is_impatient = noise.next(2) == 0;
            found.extend(pool.install(|| model.frame(is_impatient)));
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
        while let Some(frame) = pool.install(|| model.frame(true)) {
            found.push(frame);
        }
        assert_eq!(found.len(), expected.len(), "seed {seed}");
        for (frame, (fields, energies)) in found.iter().zip(expected) {
            let [displacement, velocity, stress] = &fields;
            for (sample, values) in frame.samples.iter().zip([displacement, velocity, stress]) {
                assert!(sample.values == *values, "seed {seed}, {threads} threads: {:?}", sample.field);
            }
            let TargetFrame { energy: TargetEnergy { kinetic, strain }, next_kinetic, .. } = *frame;
            let [before, after] = energies;
            for (a, b) in [(kinetic, before.kinetic), (strain, before.strain), (next_kinetic, after.kinetic)]
            {
                let tolerance = 1e-12 * (before.kinetic + before.strain.abs()).max(b);
                assert!((a - b).abs() <= tolerance, "seed {seed}: {a} {b}");
            }
        }
    }

    fn all_fields() -> Show {
        Show { fields: vec![Field::Displacement, Field::Velocity, Field::Stress], every: 1 }
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
        let show = Show { fields: vec![Field::Displacement], every: 1 };
        let mut model = Rakhmatulin::new(grid, c_s, sight, show);
        let mut surface = Surface::new(400);
        surface.loaded = 40;
        let (mut free, mut energy, mut sample) = (Vec::new(), Vec::new(), None);
        for step in 0..steps {
            model.predict(&mut surface);
            free.extend_from_slice(&surface.free);
            surface.displacement.copy_from_slice(&surface.free);
            surface.displacement[..surface.loaded].fill((step + 1) as f64 * 0.01);
            model.advance(&surface, step % 50 == 49);
            if let Some(mut frame) = model.frame(step + 1 == steps) {
                energy.push(frame.energy);
                sample = frame.samples.pop();
            }
        }
        let Sample { extent, values, .. } = sample.expect("a frame of the last step");
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
    fn the_newest_level_is_no_peak_yet() {
        // on shallow layers the strip reaches the backing, on deep ones the interior does
        for nz in [3, 10, 17, 18, 19, 40] {
            let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(nz) };
            let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, 20, nz);
            let mut model = Rakhmatulin::new(grid, 0.4, Sight::Field, Show::default());
            let mut surface = Surface::new(20);
            surface.loaded = 20;
            for step in 0..120u64 {
                model.predict(&mut surface);
                // pushed ever harder, so that every level has a larger peak than the one before
                surface.displacement.fill((step * step) as f64);
                model.advance(&surface, false);
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
            let mut model = Rakhmatulin::new(grid.clone(), 0.4, Sight::Field, Show::default());
            let mut surface = Surface::new(200);
            surface.loaded = 20;
            let mut seen = Vec::new();
            for step in 0..150 {
                model.predict(&mut surface);
                surface.displacement.copy_from_slice(&surface.free);
                surface.displacement[..20].fill((step as f64 * 0.1).sin());
                model.advance(&surface, false);
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
