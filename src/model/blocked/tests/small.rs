//! The engine on meshes of some hundred nodes, cut into tiles as small: for interpreters and sanitizers, which look at every load
//! and store of every thread.

use super::*;
use crate::model::{Dependence, blocked::tiles::Sizes};

/// Numbers of steps: enough for several passes that begin before the one before them is over. Interpreters take seconds for what
/// else is a millisecond.
const STEPS: [usize; 2] = if cfg!(miri) { [9, 2] } else { [14, 8] };

/// Numbers of threads and widths of vectors in both geometries, each with any other; an interpreter takes one of them, that of the
/// environment.
fn seeds() -> std::ops::Range<u64> {
    if !cfg!(miri) {
        return 0..36;
    }
    let seed = std::env::var("SMALL_SEED").map_or(0, |seed| seed.parse().expect("a number"));
    seed..seed + 1
}

/// Numbers of threads, widths of vectors and coverage of a small case.
fn setting(noise: &mut Noise, seed: u64) -> Setting {
    let turn = seed as usize;
    // the first three: three threads with 8 numbers in a vector, one with 2, two with 4
    Setting {
        threads: [3, 1, 2][turn % 3],
        instructions: Instructions::PLAIN[[2, 0, 1][(turn + turn / 3) % 3]],
        coverage: [Coverage::Field, Coverage::Everything][noise.below(2)],
        every: 1 + noise.below(3),
        columns: usize::MAX,
    }
}

/// A mesh with up to five tile rows and several bands.
fn grid(noise: &mut Noise, seed: u64, kind: MeshKind) -> Grid {
    let more = if cfg!(miri) { [3, 3] } else { [24, 14] };
    let (nr, nz) = (17 + noise.below(more[0]), 12 + noise.below(more[1]));
    let spacing = Spacing { dr: 0.1, dz: 0.1, layer_rows: Some(nz) };
    Grid::new([Geometry::Axisymmetric, Geometry::Plane][seed as usize % 2], kind, spacing, nr, nz)
}

impl Setting {
    /// Some fields, and points at and between nodes, lines both ways; with a coverage of its own nothing is shown.
    fn small(&mut self, fields: Vec<Field>, coverage: Option<Coverage>) -> Sampling {
        if let Some(coverage) = coverage {
            self.coverage = coverage;
            return nothing().into();
        }
        let gauges = Gauges {
            points: vec![[0.0, 0.0], [0.53, 0.31], [0.8, 1.0], [1.17, 1.19]],
            lines: vec![Line::R(0.63), Line::Z(0.85)],
            columns: usize::MAX,
        };
        self.shown(fields, gauges)
    }
}

/// A small mesh with one displacement.
fn axial(
    noise: &mut Noise,
    seed: u64,
    corner: Option<Corner>,
    coverage: Option<Coverage>,
) -> Twins<Axial, Rakhmatulin, 1> {
    let mut setting = setting(noise, seed);
    let kinds = [MeshKind::Matched, MeshKind::Paper];
    let kind = if corner.is_some() { MeshKind::Matched } else { kinds[noise.below(2)] };
    let grid = grid(noise, seed, kind);
    let shown = setting.small(all_fields().fields, coverage);
    let theory = Rakhmatulin::new(grid.clone(), 0.4, corner);
    let mut engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
    engine.field.cut(Sizes::SMALL);
    let reference = theory.reference(coverage.map_or(setting.coverage, |_| Coverage::Field), shown);
    setting.twins(&format!("small, seed {seed}, {corner:?}"), grid, (engine, reference))
}

/// A small mesh of the full theory.
fn elastic_twins(
    noise: &mut Noise,
    seed: u64,
    damping: f64,
    coverage: Option<Coverage>,
) -> Twins<Full, CellScheme, 2> {
    let mut setting = setting(noise, seed);
    let grid = grid(noise, seed, MeshKind::Matched).with_cells_between_nodes();
    let fields = if cfg!(miri) { vec![Field::VelocityR, Field::Stress] } else { Field::ALL.to_vec() };
    let shown = setting.small(fields, coverage);
    let mut theory = elastic::theory(grid.clone(), 0.5, damping);
    if coverage.is_none() {
        theory = theory.with_strengths(strengths(seed, &grid));
    }
    let mut engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
    engine.field.cut(Sizes::SMALL);
    let reference = theory.reference(coverage.map_or(setting.coverage, |_| Coverage::Field), shown);
    setting.twins(&format!("small, seed {seed}, elastic, {damping}"), grid, (engine, reference))
}

/// A random stack of layers, and columns as small.
fn layers(noise: &mut Noise) -> (Stack, usize) {
    (Stack::random(noise), 17 + noise.below(if cfg!(miri) { 3 } else { 24 }))
}

/// Small layers with one displacement.
fn axial_layers(noise: &mut Noise, seed: u64) -> Twins<Axial, Rakhmatulin, 1> {
    let (setting, (stack, nr)) = (setting(noise, seed), layers(noise));
    let corner =
        Corner::new([Order::Fourth, Order::Second][seed as usize / 2 % 2], [1.0, 0.0][seed as usize % 2]);
    let (grid, theory) = stack.simplified(nr, corner);
    let shown = setting.shown(all_fields().fields, gauges(noise, &grid));
    let mut engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
    engine.field.cut(Sizes::SMALL);
    let reference = theory.reference(setting.coverage, shown);
    setting.twins(&format!("small, seed {seed}, {corner:?}, {stack:?}"), grid, (engine, reference))
}

/// Small layers of the full theory.
fn elastic_layers(noise: &mut Noise, seed: u64) -> Twins<Full, CellScheme, 2> {
    let (setting, (stack, nr)) = (setting(noise, seed), layers(noise));
    let (grid, theory) = stack.full(nr, 0.3);
    let theory = theory.with_strengths(strengths(seed, &grid));
    let shown = setting.shown(vec![Field::VelocityR, Field::Stress], gauges(noise, &grid));
    let mut engine = theory.clone().engine(setting.coverage, shown.clone(), setting.instructions);
    engine.field.cut(Sizes::SMALL);
    let reference = theory.reference(setting.coverage, shown);
    setting.twins(&format!("small, seed {seed}, elastic, {stack:?}"), grid, (engine, reference))
}

#[test]
fn one_displacement() {
    for seed in seeds() {
        compare(seed, |noise, seed| axial(noise, seed, None, None), STEPS);
    }
}

#[test]
fn one_displacement_to_fourth_order() {
    for seed in seeds() {
        let corner = Corner::new(Order::Fourth, 0.0);
        compare(seed, |noise, seed| axial(noise, seed, corner, None), STEPS);
    }
}

#[test]
fn one_displacement_with_damped_corners() {
    for seed in seeds() {
        let corner = Corner::new([Order::Second, Order::Fourth][seed as usize % 2], 1.0);
        compare(seed, |noise, seed| axial(noise, seed, corner, None), STEPS);
    }
}

#[test]
fn two_displacements() {
    for seed in seeds() {
        let damping = [0.5, 0.0][seed as usize / 4 % 2];
        compare(seed, |noise, seed| elastic_twins(noise, seed, damping, None), STEPS);
    }
}

#[test]
fn layers_of_both_theories() {
    for seed in seeds() {
        compare(seed, axial_layers, STEPS);
        compare(seed, elastic_layers, STEPS);
    }
}

/// Columns that are loaded and looked at.
const LOADED: usize = 5;

/// Looks at nothing but the surface of the first columns: what the engine leaves out below and beside must not be missed.
fn compare_surface<E: Theory, S: Scheme<FIELDS>, const FIELDS: usize>(
    mut twins: Twins<E, S, FIELDS>,
    noise: &mut Noise,
    steps: usize,
) {
    let mut surface = Surface::new(twins.grid.nr());
    surface.loaded = LOADED;
    for step in 0..steps {
        twins.engine.predict(&mut surface);
        let mut plain = surface.clone();
        twins.reference.predict(&mut plain);
        assert_eq!(surface.free[..LOADED], plain.free[..LOADED], "{}, step {step}", twins.name);
        for i in 0..twins.grid.nr() {
            surface.displacement[i] = if i < LOADED { noise.below(1000) as f64 } else { surface.free[i] };
        }
        twins.pool.install(|| twins.engine.advance(&surface, step, Request::default()));
        assert_eq!(twins.engine.next(false), Some(bare(step)));
        twins.reference.advance(&surface, step, Request::default());
    }
}

#[test]
fn only_the_surface() {
    for seed in seeds() {
        let steps = STEPS.iter().sum();
        let coverage = Some(Coverage::Rows(Dependence { last_step: steps - 1, depths: 1 }));
        let noise = &mut Noise(seed);
        let corner = [None, Corner::new(Order::Fourth, 0.0)][seed as usize / 3 % 2];
        compare_surface(axial(noise, seed, corner, coverage), noise, steps);
        compare_surface(elastic_twins(noise, seed, 0.5, coverage), noise, steps);
    }
}
