//! The engine on meshes of some hundred nodes, cut into tiles as small: for interpreters and sanitizers, which look at every load
//! and store of every thread.

use super::*;
use crate::model::blocked::tiling::Sizes;

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

/// What differs from one small case to the next.
struct Small {
    geometry: Geometry,
    instructions: Instructions,
    coverage: Coverage,
    every: usize,
    pool: ThreadPool,
    name: String,
}

impl Small {
    fn new(noise: &mut Noise, seed: u64) -> Self {
        let turn = seed as usize;
        // the first three: three threads with 8 numbers in a vector, one with 2, two with 4
        let threads = [3, 1, 2][turn % 3];
        let instructions = Instructions::PLAIN[[2, 0, 1][(turn + turn / 3) % 3]];
        let geometry = [Geometry::Axisymmetric, Geometry::Plane][turn % 2];
        let coverage = [Coverage::Field, Coverage::Everything][noise.next(2)];
        Self {
            geometry,
            instructions,
            coverage,
            every: 1 + noise.next(3),
            pool: rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool"),
            name: format!("small, seed {seed}, {coverage:?}, {instructions:?}, {threads} threads"),
        }
    }

    /// A mesh with up to five tile rows and several bands.
    fn grid(&self, noise: &mut Noise, kind: MeshKind) -> Grid {
        let more = if cfg!(miri) { [3, 3] } else { [24, 14] };
        let (nr, nz) = (17 + noise.next(more[0]), 12 + noise.next(more[1]));
        let spacing = Spacing { dr: 0.1, dz: 0.1, layer_rows: Some(nz) };
        Grid::new(self.geometry, kind, spacing, nr, nz)
    }
}

/// Points at and between nodes, lines both ways.
fn few_gauges() -> Gauges {
    Gauges {
        points: vec![[0.0, 0.0], [0.53, 0.31], [0.8, 1.0], [1.17, 1.19]],
        lines: vec![Line::R(0.63), Line::Z(0.85)],
    }
}

/// A small mesh with one displacement.
fn axial(noise: &mut Noise, seed: u64, corner: Option<Corner>, coverage: Option<Coverage>) -> Axial {
    let small = Small::new(noise, seed);
    let kinds = [MeshKind::Matched, MeshKind::Paper];
    let kind = if corner.is_some() { MeshKind::Matched } else { kinds[noise.next(2)] };
    let grid = small.grid(noise, kind);
    let shown = match coverage {
        Some(_) => nothing().into(),
        None => Sampling { frames: FrameFields { every: small.every, ..all_fields() }, gauges: few_gauges() },
    };
    let theory = Rakhmatulin::new(grid.clone(), 0.4, corner);
    let coverage = coverage.unwrap_or(small.coverage);
    let mut engine = theory.clone().engine(coverage, shown.clone(), small.instructions);
    engine.field.cut(Sizes::SMALL);
    Twins {
        engine,
        reference: theory.reference(shown),
        every: small.every,
        pool: small.pool,
        name: format!("{}, {corner:?}", small.name),
        grid,
    }
}

type Axial = Twins<Rakhmatulin, 1>;

/// A small mesh of the full theory.
fn elastic_twins(
    noise: &mut Noise,
    seed: u64,
    damping: f64,
    coverage: Option<Coverage>,
) -> Twins<CellScheme, 2> {
    let small = Small::new(noise, seed);
    let grid = small.grid(noise, MeshKind::Matched).with_cells_between_nodes();
    let fields = if cfg!(miri) { vec![Field::VelocityR, Field::Stress] } else { Field::ALL.to_vec() };
    let frames = FrameFields { every: small.every, fields };
    let shown = match coverage {
        Some(_) => nothing().into(),
        None => Sampling { frames, gauges: few_gauges() },
    };
    let theory = elastic::theory(grid.clone(), 0.5, damping);
    let coverage = coverage.unwrap_or(small.coverage);
    let mut engine = theory.clone().engine(coverage, shown.clone(), small.instructions);
    engine.field.cut(Sizes::SMALL);
    Twins {
        engine,
        reference: theory.reference(shown),
        every: small.every,
        pool: small.pool,
        name: format!("{}, elastic, {damping}", small.name),
        grid,
    }
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

/// Looks at nothing but the surface: what the engine leaves out below must not be missed.
fn compare_surface<S: Scheme<FIELDS>, const FIELDS: usize>(
    mut twins: Twins<S, FIELDS>,
    noise: &mut Noise,
    steps: usize,
) {
    let mut surface = Surface::new(twins.grid.nr());
    surface.loaded = 5;
    for step in 0..steps {
        twins.engine.predict(&mut surface);
        let mut plain = surface.clone();
        twins.reference.predict(&mut plain);
        let columns = twins.engine.cone.active_columns();
        assert_eq!(surface.free[..columns], plain.free[..columns], "{}, step {step}", twins.name);
        for i in 0..twins.grid.nr() {
            surface.displacement[i] = if i < 5 { noise.next(1000) as f64 } else { surface.free[i] };
        }
        twins.pool.install(|| twins.engine.advance(&surface, step, Request::default()));
        assert_eq!(twins.engine.next(false), Some((step, None, None)));
        plain.clone_from(&surface);
        let columns = twins.engine.cone.active_columns();
        plain.displacement[columns..].fill(0.0);
        let active = twins.engine.cone.active(step + 1);
        twins.reference.hold_at_rest(twins.grid.nz + 1, active.columns.min(twins.grid.nr()));
        twins.reference.advance(&plain, step, Request::default());
    }
}

#[test]
fn only_the_surface() {
    for seed in seeds() {
        let steps = STEPS.iter().sum();
        let coverage = Some(Coverage::Surface { last_step: steps - 1 });
        let noise = &mut Noise(seed);
        let corner = [None, Corner::new(Order::Fourth, 0.0)][seed as usize / 3 % 2];
        compare_surface(axial(noise, seed, corner, coverage), noise, steps);
        compare_surface(elastic_twins(noise, seed, 0.5, coverage), noise, steps);
    }
}
