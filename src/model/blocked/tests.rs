//! The engine against the plain stepper, and against itself.

use rayon::ThreadPool;

use super::*;
use crate::{
    geometry::Geometry,
    grid::{Layer, MeshKind, Spacing},
    model::{
        Coverage, Field, Frame, Gauges, Line, Sample, TargetEnergy, elastic,
        layers::Stack,
        noise::Noise,
        rakhmatulin::Rakhmatulin,
        reference::{Reference, Scheme},
        scheme::{Corner, Order},
        strength::Strength,
    },
};

mod small;

/// Random points and lines, at nodes, between them and a little beyond the mesh; none now and then.
fn gauges(noise: &mut Noise, grid: &Grid) -> Gauges {
    let radius = |noise: &mut Noise| match noise.below(3) {
        0 => grid.r(noise.below(grid.nr())),
        _ => 1.05 * grid.nr() as f64 * grid.dr * noise.below(1000) as f64 / 1000.0,
    };
    let depth = |noise: &mut Noise| match noise.below(4) {
        0 => grid.z(noise.below(grid.nz + 1)),
        1 => [0.0, grid.bottom(&grid.layers[grid.layers.len() - 1])][noise.below(2)],
        _ => 1.05 * grid.z(grid.nz) * noise.below(1000) as f64 / 1000.0,
    };
    let (points, lines) = (noise.below(4) * noise.below(20), noise.below(4));
    let line = |noise: &mut Noise| match noise.below(2) {
        0 => Line::R(radius(noise)),
        _ => Line::Z(depth(noise)),
    };
    Gauges {
        points: (0..points).map(|_| [radius(noise), depth(noise)]).collect(),
        lines: (0..lines).map(|_| line(noise)).collect(),
        columns: 1 + noise.below(2 * grid.nr()),
    }
}

/// Random strengths of the layers of a mesh, unknown now and then; some are passed and some are not.
fn strengths(seed: u64, grid: &Grid) -> Vec<Strength> {
    let noise = &mut Noise(seed);
    let mut strength = |scale: f64| (noise.below(4) > 0).then(|| scale * (1 + noise.below(100)) as f64);
    let layer = |_: &Layer| Strength {
        yielding: strength(0.5),
        tensile: strength(0.2),
        bond: strength(0.2).zip(strength(0.05)).map(|(normal, shear)| [normal, shear]),
    };
    grid.layers.iter().map(layer).collect()
}

/// An engine and the plain stepper on the same mesh; both take the number of a step with it.
struct Twins<E: Theory, S, const FIELDS: usize> {
    grid: Grid,
    engine: Engine<usize, E>,
    reference: Reference<usize, S, FIELDS>,
    every: usize,
    columns: usize,
    pool: ThreadPool,
    /// What the case is called in messages.
    name: String,
}

/// How an engine computes, and what is shown.
struct Setting {
    instructions: Instructions,
    coverage: Coverage,
    every: usize,
    columns: usize,
    threads: usize,
}

impl Setting {
    fn random(noise: &mut Noise, seed: u64) -> Self {
        let instructions = Instructions::all();
        Self {
            instructions: instructions[noise.below(instructions.len())],
            coverage: [Coverage::Field, Coverage::Everything][noise.below(3) / 2],
            every: 1 + noise.below(2) * noise.below(5),
            columns: [usize::MAX, 2 + noise.below(20)][noise.below(2)],
            threads: 1 + seed as usize % 3,
        }
    }

    /// What is shown of some fields.
    fn shown(&self, fields: Vec<Field>, gauges: Gauges) -> Sampling {
        Sampling {
            frames: FrameFields { every: self.every, columns: self.columns, fields },
            gauges,
            tension: Some(0.05),
            ..Sampling::default()
        }
    }

    /// * `models`: an engine and the plain stepper
    fn twins<E: Theory, S, const FIELDS: usize>(
        self,
        name: &str,
        grid: Grid,
        (engine, reference): (Engine<usize, E>, Reference<usize, S, FIELDS>),
    ) -> Twins<E, S, FIELDS> {
        let Self { instructions, coverage, every, columns, threads } = self;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let name = format!("{name}, {coverage:?}, {instructions:?}, {threads} threads");
        Twins { grid, engine, reference, every, columns, pool, name }
    }
}

impl Twins<Full, CellScheme, 2> {
    /// A random mesh of the full theory.
    fn elastic(noise: &mut Noise, seed: u64) -> Self {
        let geometry = [Geometry::Axisymmetric, Geometry::Plane][noise.below(2)];
        let (nr, nz) =
            (1 + noise.below(250), 1 + noise.below(if seed.is_multiple_of(4) { 300 } else { 100 }));
        let spacing = Spacing { dr: [0.1, 0.12][noise.below(2)], dz: 0.1, layer_rows: Some(nz) };
        let (c_s, damping) = ([0.3, 0.5, 0.7][noise.below(3)], [0.0, 0.5][noise.below(2)]);
        let grid = Grid::new(geometry, MeshKind::Matched, spacing, nr, nz);
        let grid = grid.with_cells_between_nodes();
        let theory = elastic::theory(grid.clone(), c_s, damping).with_strengths(strengths(seed, &grid));
        let setting = Setting::random(noise, seed);
        let shown = setting.shown(Field::ALL.to_vec(), gauges(noise, &grid));
        let engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
        let reference = theory.reference(setting.coverage, shown);
        setting.twins(&format!("elastic, seed {seed}, {damping}"), grid, (engine, reference))
    }

    /// A random mesh of layers.
    fn layered(noise: &mut Noise, seed: u64) -> Self {
        let (stack, nr) = (stack(noise), 1 + noise.below(250));
        let damping = [0.0, 0.3][noise.below(2)];
        let (grid, theory) = stack.full(nr, damping);
        let theory = theory.with_strengths(strengths(seed, &grid));
        let setting = Setting::random(noise, seed);
        let shown = setting.shown(Field::ALL.to_vec(), gauges(noise, &grid));
        let engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
        let reference = theory.reference(setting.coverage, shown);
        setting.twins(&format!("seed {seed}, {damping}, {stack:?}"), grid, (engine, reference))
    }
}

/// A random stack, deeper than the near-surface band now and then.
fn stack(noise: &mut Noise) -> Stack {
    let mut stack = Stack::random(noise);
    for ply in &mut stack.plies {
        ply.steps += noise.below(2) * noise.below(100);
    }
    stack
}

impl Twins<Axial, Rakhmatulin, 1> {
    /// A random mesh.
    fn new(noise: &mut Noise, seed: u64) -> Self {
        let geometry = [Geometry::Axisymmetric, Geometry::Plane][noise.below(2)];
        let kind = [MeshKind::Matched, MeshKind::Paper][noise.below(2)];
        // deep ones, too, where the interior lags as far behind as it may
        let (nr, nz) =
            (1 + noise.below(400), 1 + noise.below(if seed.is_multiple_of(4) { 600 } else { 150 }));
        let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(nz) };
        let grid = Grid::new(geometry, kind, spacing, nr, nz);
        let orders = [Order::Second, Order::Fourth];
        let corner = Corner::new(orders[noise.below(2)], [0.0, 1.0, 4.0 / 3.0][noise.below(3)]);
        let corner = corner.filter(|_| kind == MeshKind::Matched);
        let c_s = 0.5 * (1 + noise.below(100)) as f64 / 100.0;
        let theory = Rakhmatulin::new(grid.clone(), c_s, corner);
        let setting = Setting::random(noise, seed);
        let shown = setting.shown(all_fields().fields, gauges(noise, &grid));
        let engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
        let reference = theory.reference(setting.coverage, shown);
        setting.twins(&format!("seed {seed}, {corner:?}"), grid, (engine, reference))
    }

    /// A random mesh of layers.
    fn layered(noise: &mut Noise, seed: u64) -> Self {
        let (stack, nr) = (stack(noise), 1 + noise.below(400));
        let orders = [Order::Second, Order::Fourth];
        let corner = Corner::new(orders[noise.below(2)], [0.0, 1.0, 4.0 / 3.0][noise.below(3)]);
        let (grid, theory) = stack.simplified(nr, corner);
        let setting = Setting::random(noise, seed);
        let shown = setting.shown(all_fields().fields, gauges(noise, &grid));
        let engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
        let reference = theory.reference(setting.coverage, shown);
        setting.twins(&format!("seed {seed}, {corner:?}, {stack:?}"), grid, (engine, reference))
    }
}

impl<E: Theory, S: Scheme<FIELDS>, const FIELDS: usize> Twins<E, S, FIELDS> {
    /// Moves both surfaces alike.
    fn advance(&mut self, surface: &mut Surface, noise: &mut Noise, step: usize, request: Request) {
        let nr = self.grid.nr();
        let mut plain = surface.clone();
        self.engine.predict(surface);
        self.reference.predict(&mut plain);
        assert_eq!(surface.free, plain.free, "{}, step {step}", self.name);
        assert_eq!(surface.compliance, plain.compliance);
        for i in 0..nr {
            let push = if i < surface.loaded { noise.below(1000) as f64 / 1000.0 } else { 0.0 };
            surface.displacement[i] = surface.free[i] + push;
            surface.pressure[i] = push;
        }
        surface.loaded = nr.min(surface.loaded + noise.below(2));
        let pressure = &surface.pressure[..surface.loaded];
        assert_eq!(
            self.engine.surface_strain(pressure),
            self.reference.surface_strain(pressure),
            "{}",
            self.name
        );
        self.pool.install(|| self.engine.advance(surface, step, request));
        self.reference.advance(surface, step, request);
    }

    /// Compares both levels, bit by bit.
    fn compare(&mut self, step: usize) {
        self.pool.install(|| self.engine.catch_up());
        let level = self.engine.level;
        for j in 0..=self.grid.nz {
            for field in 0..FIELDS {
                for (level, row) in [level, level - 1].into_iter().zip(self.reference.row(field, j)) {
                    let found = &self.engine.field.displacement(level, field, j)[..self.grid.nr()];
                    for (i, (a, b)) in row.iter().zip(found).enumerate() {
                        assert!(a == b, "{}, step {step}, u{field} ({j}, {i}): {a} {b}", self.name);
                    }
                }
            }
        }
    }

    /// Compares frames: fields number by number, energies but for rounding, because they are other sums.
    fn compare_frames(&self, expected: &Frame, found: &Frame) {
        let moved = found.surface.len();
        for (a, b) in expected.samples.iter().zip(&found.samples) {
            assert_eq!((a.field, a.extent), (b.field, b.extent));
            assert_eq!(a.extent, super::super::Extent::of(&self.grid, self.every, self.columns));
            let rows = a.values.chunks_exact(a.extent.nr).zip(b.values.chunks_exact(a.extent.nr));
            for (j, (a, b)) in rows.enumerate() {
                let shown = moved.clamp(1, self.columns).div_ceil(self.every);
                assert_eq!(a[..shown], b[..shown], "{}, row {j}", self.name);
                assert!(b[shown..].iter().all(|value| *value == 0.0), "{}, row {j}", self.name);
            }
        }
        assert_eq!(expected.surface[..moved], found.surface);
        let with_layers =
            |frame: &Frame| frame.layers.iter().copied().chain([frame.energy]).flatten().collect::<Vec<_>>();
        for (a, b) in with_layers(expected).into_iter().zip(with_layers(found)) {
            let tolerance = 1e-12 * (expected.energy[0].kinetic + expected.energy[0].strain.abs());
            let tolerance = tolerance.max(1e-12 * expected.energy[1].kinetic);
            assert!((a.kinetic - b.kinetic).abs() <= tolerance, "{}: {a:?} {b:?}", self.name);
            assert!((a.strain - b.strain).abs() <= tolerance, "{}: {a:?} {b:?}", self.name);
        }
    }
}

/// Moves the surface of both alike and compares them at odd steps; with them what frames show.
///
/// * `fewest_steps`, `more`: number of steps, and how many numbers of steps are tried
fn compare<E: Theory, S: Scheme<FIELDS>, const FIELDS: usize>(
    seed: u64,
    twins: impl Fn(&mut Noise, u64) -> Twins<E, S, FIELDS>,
    [fewest_steps, more]: [usize; 2],
) {
    let mut noise = Noise(seed);
    let mut twins = twins(&mut noise, seed);
    let mut surface = Surface::new(twins.grid.nr());
    surface.loaded = 1 + noise.below(twins.grid.nr());
    // looked at often, or so seldom that passes run into each other
    let [seldom, few] = [[9, 400][noise.below(2)], [1, 3, 50, 1000][noise.below(4)]];
    let steps = fewest_steps + noise.below(more);
    let mut shown = Vec::new();
    for step in 0..steps {
        let is_frame = noise.below(few) == 0 || step + 1 == steps;
        let request = Request { frame: is_frame, lines: noise.below(3) == 0 };
        twins.advance(&mut surface, &mut noise, step, request);
        let is_impatient = noise.below(2) == 0;
        shown.extend(twins.pool.install(|| twins.engine.next(is_impatient)));
        if noise.below(seldom) == 0 || step < 3 || step + 1 == steps {
            twins.compare(step);
        }
    }
    while let Some(step) = twins.pool.install(|| twins.engine.next(true)) {
        shown.push(step);
    }
    assert_eq!(shown.len(), steps, "{}", twins.name);
    for (number, found) in shown.into_iter().enumerate() {
        let (expected, name) = (twins.reference.next(true).expect("as many steps"), &twins.name);
        assert_eq!(expected.gauges, found.gauges, "{name}, step {number}");
        assert_eq!(expected.tensions, found.tensions, "{name}, step {number}");
        assert_eq!(expected.failures, found.failures, "{name}, step {number}");
        assert_eq!([number; 2], [found.step, expected.step], "{name}");
        assert_eq!(expected.frame.is_some(), found.frame.is_some(), "{name}");
        if let (Some(expected), Some(found)) = (expected.frame, found.frame) {
            twins.compare_frames(&expected, &found);
        }
    }
    let (expected, found) = (twins.reference.strain_peak(), twins.engine.strain_peak());
    assert!(expected.strain > 0.0, "{}", twins.name);
    assert_eq!(expected, found, "{}", twins.name);
    assert_eq!(twins.reference.interface_peaks(), twins.engine.interface_peaks(), "{}", twins.name);
    assert_eq!(twins.reference.strength_peaks(), twins.engine.strength_peaks(), "{}", twins.name);
}

fn all_fields() -> FrameFields {
    FrameFields {
        fields: vec![Field::Displacement, Field::Velocity, Field::Stress],
        every: 1,
        columns: usize::MAX,
    }
}

/// A step that shows nothing.
fn bare<T>(step: T) -> CompletedStep<T> {
    CompletedStep { step, frame: None, gauges: None, tensions: Vec::new(), failures: Vec::new() }
}

fn nothing() -> FrameFields {
    FrameFields { fields: Vec::new(), every: 1, columns: usize::MAX }
}

/// Seeds of a test: a third of them, all with `PERCUSS_FULL=1`.
fn seeds(all: u64) -> std::ops::Range<u64> {
    0..if std::env::var_os("PERCUSS_FULL").is_some() { all } else { all / 3 }
}

#[test]
fn the_engine_is_the_plain_stepper() {
    for seed in seeds(60) {
        compare(seed, Twins::new, [60, 120]);
    }
}

#[test]
fn the_engine_is_the_plain_stepper_of_the_full_theory() {
    for seed in seeds(30) {
        compare(seed, Twins::elastic, [60, 120]);
    }
}

#[test]
fn the_engine_is_the_plain_stepper_on_layers() {
    for seed in seeds(60) {
        compare(seed, Twins::<Axial, Rakhmatulin, 1>::layered, [60, 120]);
    }
}

#[test]
fn the_engine_is_the_plain_stepper_of_the_full_theory_on_layers() {
    for seed in seeds(30) {
        compare(seed, Twins::<Full, CellScheme, 2>::layered, [60, 120]);
    }
}

fn engine(grid: &Grid, c_s: f64, coverage: Coverage, shown: FrameFields) -> Engine<(), Axial> {
    Rakhmatulin::new(grid.clone(), c_s, None).engine(coverage, shown.into(), Instructions::detect())
}

/// Surface, energies and the last field of a run under a hard push.
fn run_with(coverage: Coverage, c_s: f64, steps: usize) -> (Vec<f64>, Vec<TargetEnergy>, Vec<f32>) {
    let spacing = Spacing { dr: 0.01, dz: 0.01, layer_rows: Some(60) };
    let grid = Grid::new(Geometry::Axisymmetric, MeshKind::Paper, spacing, 400, 60);
    let shown = FrameFields { fields: vec![Field::Displacement], every: 1, columns: usize::MAX };
    let mut model = engine(&grid, c_s, coverage, shown);
    let mut surface = Surface::new(400);
    surface.loaded = 40;
    let (mut free, mut energy, mut last) = (Vec::new(), Vec::new(), None);
    for step in 0..steps {
        model.predict(&mut surface);
        free.extend_from_slice(&surface.free);
        surface.displacement.copy_from_slice(&surface.free);
        surface.displacement[..surface.loaded].fill((step + 1) as f64 * 0.01);
        let request = Request { frame: step % 50 == 49, lines: false };
        model.advance(&surface, (), request);
        while let Some(CompletedStep { frame, .. }) = model.next(step + 1 == steps) {
            if let Some(mut frame) = frame {
                energy.extend(frame.energy);
                last = frame.samples.pop();
            }
        }
    }
    let Sample { values, .. } = last.expect("a frame of the last step");
    (free, energy, values)
}

#[test]
fn nothing_is_lost_outside_the_cone() {
    for c_s in [0.1, 0.5, 0.9] {
        let (free, energy, field) = run_with(Coverage::Field, c_s, 600);
        let (all_free, all_energy, all_field) = run_with(Coverage::Everything, c_s, 600);
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
    // on shallow layers the near-surface band reaches the backing, on deep ones the interior does
    for nz in [3, 10, 17, 18, 19, 40] {
        let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(nz) };
        let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, 20, nz);
        let mut model = engine(&grid, 0.4, Coverage::Field, nothing());
        let mut surface = Surface::new(20);
        surface.loaded = 20;
        for step in 0..120u64 {
            model.predict(&mut surface);
            // pushed ever harder, so that every level has a larger peak than the one before
            surface.displacement.fill((step * step) as f64);
            model.advance(&surface, (), Request::default());
            if step % 7 == 0 || step == 119 {
                let peak = model.strain_peak();
                assert!(peak.step <= step, "{nz} rows, step {step}: {peak:?}");
            }
        }
        assert!(model.strain_peak().strain > 0.0);
    }
}

#[test]
fn peaks_of_the_backing_do_not_depend_on_when_the_interior_catches_up() {
    let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(40) };
    let grid = Grid::new(Geometry::Axisymmetric, MeshKind::Matched, spacing, 200, 40);
    let peaks = |every: usize| {
        let mut model = engine(&grid, 0.4, Coverage::Field, nothing());
        let mut surface = Surface::new(200);
        surface.loaded = 20;
        let mut seen = Vec::new();
        for step in 0..150 {
            model.predict(&mut surface);
            surface.displacement.copy_from_slice(&surface.free);
            surface.displacement[..20].fill((step as f64 * 0.1).sin());
            model.advance(&surface, (), Request::default());
            if step % every == 0 {
                model.catch_up();
            }
            if step % 49 == 48 {
                seen.push(model.strain_peak());
            }
        }
        seen
    };
    let often = peaks(1);
    assert!(often.iter().skip(1).all(|peak| peak.strain > 0.0 && peak.step > 0));
    assert_eq!(often, peaks(7));
    assert_eq!(often, peaks(1000));
}

#[test]
fn a_run_without_frames_keeps_no_passes() {
    let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(40) };
    let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, 50, 40);
    let mut model = engine(&grid, 0.4, Coverage::Field, nothing());
    let mut surface = Surface::new(50);
    surface.loaded = 20;
    for _ in 0..400 {
        model.predict(&mut surface);
        surface.displacement.copy_from_slice(&surface.free);
        surface.displacement[..20].fill(1.0);
        model.advance(&surface, (), Request::default());
        assert_eq!(model.next(false), Some(bare(())));
        assert!(model.field.passes() <= 2, "{} passes", model.field.passes());
    }
}

#[test]
fn steps_with_gauges_wait_for_no_more_than_memory_allows() {
    let spacing = Spacing { dr: 0.1, dz: 0.2, layer_rows: Some(400) };
    let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, 50, 400);
    let gauges = Gauges { points: vec![[0.0, 20.0]], ..Gauges::default() };
    let shown = Sampling { frames: nothing(), gauges, ..Sampling::default() };
    let mut model: Engine<usize, Axial> =
        Rakhmatulin::new(grid, 0.4, None).engine(Coverage::Field, shown, Instructions::detect());
    model.most_gauges = 5;
    let mut surface = Surface::new(50);
    surface.loaded = 20;
    let mut seen = 0;
    for step in 0..300 {
        model.predict(&mut surface);
        surface.displacement.copy_from_slice(&surface.free);
        surface.displacement[..20].fill(1.0);
        model.advance(&surface, step, Request::default());
        while let Some(CompletedStep { step: number, gauges, .. }) = model.next(false) {
            assert_eq!((number, gauges.map(|values| values.points.len())), (seen, Some(1)));
            seen += 1;
        }
        assert!(model.steps.len() <= 5, "{} steps", model.steps.len());
    }
    assert!(seen >= 295);
}
