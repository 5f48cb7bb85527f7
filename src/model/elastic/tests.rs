//! The scheme by itself: against its energy, its spectrum, its plane waves, and random fields over 10⁵ steps.

use rayon::prelude::*;

use super::*;
use crate::{
    case::Case,
    contact::Contact,
    geometry::Geometry,
    grid::{MeshKind, Spacing},
    indenter::Indenter,
    model::{Model, Request, noise::Noise},
    surface::Surface,
};

/// `c_s/c_p` of targets from near-incompressible ones to those that stretch as they are stretched across.
const SPEEDS: [f64; 7] = [0.1, 0.3, 0.5, 0.6, 0.7, 0.8, 0.86];
const GEOMETRIES: [Geometry; 2] = [Geometry::Axisymmetric, Geometry::Plane];

/// A layer of `rows` rows and `columns` columns, Δz = Δt = 1.
fn layer(geometry: Geometry, rows: usize, columns: usize, dr: f64, c_s: f64, damping: f64) -> CellScheme {
    let spacing = Spacing { dr, dz: 1.0, layer_rows: Some(rows) };
    let grid = Grid::new(geometry, MeshKind::Matched, spacing, columns, rows);
    theory(grid.with_cells_between_nodes(), c_s, damping)
}

impl CellScheme {
    fn rest(&self) -> Level<2> {
        [(); 2].map(|()| ndarray::Array2::zeros((self.grid.nz + 1, self.grid.nr())))
    }

    /// A level whose values follow from field, row and column; the backing does not yield.
    fn level(&self, mut value: impl FnMut(usize, usize, usize) -> f64) -> Level<2> {
        let mut level = self.rest();
        for (field, values) in level.iter_mut().enumerate() {
            for ((j, i), u) in values.indexed_iter_mut() {
                *u = if field == 0 && j == self.grid.nz { 0.0 } else { value(field, j, i) };
            }
        }
        level
    }

    fn random(&self, seed: u64) -> Level<2> {
        let mut noise = Noise(seed);
        self.level(|_, _, _| noise.unit() - 0.5)
    }

    fn mass(&self, field: usize, j: usize, i: usize) -> f64 {
        let area = if field == 0 {
            self.grid.area[i]
        } else {
            cells::lateral_area(&self.grid, i).expect("a column")
        };
        self.depth(j) * area
    }

    /// `−Δt²` times the accelerations that stresses cause.
    fn stiff(&self, now: &Level<2>) -> Level<2> {
        let mut level = self.rest();
        for j in 0..=self.grid.nz {
            for i in 0..self.grid.nr() {
                let accelerations = self.at_row(j).accelerations(self.reading(now), i);
                for (field, level) in level.iter_mut().enumerate() {
                    level[[j, i]] = -accelerations[field];
                }
            }
        }
        level[0].row_mut(self.grid.nz).fill(0.0);
        level
    }

    /// `4σE_r²` of a level.
    fn damping_of(&self, moved: &Level<2>) -> Level<2> {
        let rest = self.rest();
        self.level(|field, j, i| -self.damped(0.0, [&rest, moved], field, j, i))
    }

    /// Product of levels in which the scheme without damping is symmetric.
    fn product(&self, a: &Level<2>, b: &Level<2>) -> f64 {
        let rows = |field: usize| {
            a[field].indexed_iter().map(move |((j, i), u)| self.mass(field, j, i) * u * b[field][[j, i]])
        };
        rows(0).sum::<f64>() + rows(1).sum::<f64>()
    }
}

/// `a + factor·b`
fn combined(a: &Level<2>, factor: f64, b: &Level<2>) -> Level<2> {
    [&a[0] + &(&b[0] * factor), &a[1] + &(&b[1] * factor)]
}

#[test]
fn accelerations_are_the_derivative_of_the_energy() {
    // W is ½a(u, u) with a symmetric a, and the product form of the scheme is ½a of both levels: −m·ü_n = a(u, e_n) with unit
    // vectors e_n. Measured: 4e-16 of the largest.
    for geometry in GEOMETRIES {
        for (rows, columns, dr) in [(1, 3, 1.0), (2, 2, 1.3), (4, 6, 1.0), (5, 4, 1.2)] {
            for c_s in SPEEDS {
                let scheme = layer(geometry, rows, columns, dr, c_s, 0.0);
                let now = scheme.random(rows as u64);
                let force = scheme.stiff(&now);
                let (mut worst, mut largest) = (0.0, 0.0);
                for (field, force) in force.iter().enumerate() {
                    for ((j, i), stiff) in force.indexed_iter() {
                        if field == 0 && j == rows {
                            continue;
                        }
                        let mut unit = scheme.rest();
                        unit[field][[j, i]] = 1.0;
                        let derivative = 2.0 * scheme.energy(&now, &unit).strain;
                        let force = stiff * scheme.mass(field, j, i);
                        worst = f64::max(worst, (force - derivative).abs());
                        largest = f64::max(largest, derivative.abs());
                    }
                }
                assert!(worst <= 1e-13 * largest, "{geometry:?}, {rows}×{columns}, c_s = {c_s}: {worst:e}");
            }
        }
    }
}

#[test]
fn energy_of_uniform_strains_is_that_of_the_theory() {
    // u = αz, v = γr: ε = α, d = 2γ (plane γ): W = ½ε² + λεd + ½d² per volume, less the hoop term µ(v²)_,r: it integrates to
    // µγ²r² at the outer radius
    let (alpha, gamma, c_s) = (0.7, -0.4, 0.35);
    for geometry in GEOMETRIES {
        let scheme = layer(geometry, 3, 6, 1.25, c_s, 0.0);
        let (nr, dr) = (scheme.grid.nr(), scheme.grid.dr);
        let grid = &scheme.grid;
        let level = [(0, alpha), (1, gamma)].map(|(field, slope)| {
            ndarray::Array2::from_shape_fn((4, nr), |(j, i)| {
                slope * if field == 0 { j as f64 * grid.dz } else { grid.r(i) }
            })
        });
        let strain = |j, i| {
            cells::strain_energy(
                scheme.cell_strains(&level, j, i),
                scheme.cell_strains(&level, j, i),
                scheme.layer_weights(0).1[i].cell / grid.dz,
                scheme.layer_weights(0).0,
            )
        };
        // cells out to ρ = (nr − ½)Δr, the last one that has both its columns
        let sum: f64 = (0..3).flat_map(|j| (0..nr).map(move |i| (j, i))).map(|(j, i)| strain(j, i)).sum();
        let (d, area) = match geometry {
            Geometry::Plane => (gamma, (nr as f64 - 0.5) * dr),
            // weights w_i = 2ρ_iΔr of a radius (nr − ½)Δr, and 1/4 as in 1 + 3 + … = n²
            Geometry::Axisymmetric => (2.0 * gamma, (nr as f64 * (nr as f64 - 1.0) + 0.25) * dr * dr),
        };
        let lame = 1.0 - 2.0 * c_s * c_s;
        let expected = (0.5 * alpha * alpha + lame * alpha * d + 0.5 * d * d) * area * 3.0;
        assert!((sum / expected - 1.0).abs() < 1e-13, "{geometry:?}: {sum} {expected}");
    }
}

/// Largest eigenvalue of a symmetric tridiagonal matrix, by counting those beyond a number (Sturm).
fn largest_eigenvalue(diagonal: &[f64], beside: &[f64]) -> f64 {
    let beyond = |x: f64| {
        let mut pivot = f64::INFINITY;
        diagonal.iter().enumerate().any(|(n, d)| {
            let coupling = if n == 0 { 0.0 } else { beside[n - 1] * beside[n - 1] / pivot };
            pivot = d - x - coupling;
            pivot > 0.0
        })
    };
    let (mut low, mut high) = (0.0, 16.0);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if beyond(middle) { low = middle } else { high = middle }
    }
    low
}

/// `λ_max/4` of `Δt²M⁻¹K + 8σE_r²` in the space that `steps` powers of it span (Lanczos): powers of the matrix, as in power iteration,
/// and never more than the true value.
fn spectral_bound(scheme: &CellScheme, steps: usize) -> f64 {
    let mut now = scheme.random(7);
    let norm = scheme.product(&now, &now).sqrt();
    now = now.map(|field| field / norm);
    let mut before = scheme.rest();
    let (mut diagonal, mut beside) = (Vec::new(), Vec::new());
    for _ in 0..steps {
        let mut next = scheme.stiff(&now);
        if scheme.damping().is_some() {
            next = combined(&next, 2.0, &scheme.damping_of(&now));
        }
        let along = scheme.product(&next, &now);
        next = combined(&next, -along, &now);
        next = combined(&next, -beside.last().copied().unwrap_or(0.0), &before);
        diagonal.push(along);
        let norm = scheme.product(&next, &next).sqrt();
        beside.push(norm);
        before = now;
        now = next.map(|field| field / norm);
    }
    largest_eigenvalue(&diagonal, &beside) / 4.0
}

#[test]
fn no_mode_is_faster_than_the_time_step_allows() {
    // λ_max Δt²/4 ≤ 1. Measured 0.9846 to 0.99963 (40×40, plane: the ladder wave along z, cos²(π/4J)).
    let mut cases = Vec::new();
    for geometry in GEOMETRIES {
        for c_s in SPEEDS {
            for dr in [1.0, 1.2] {
                cases.extend(
                    [(10, 10), (40, 40), (200, 12)].map(|(rows, columns)| (geometry, c_s, dr, rows, columns)),
                );
            }
        }
    }
    cases.into_par_iter().for_each(|(geometry, c_s, dr, rows, columns)| {
        let bound = spectral_bound(&layer(geometry, rows, columns, dr, c_s, 0.0), 120);
        let name = format!("{geometry:?}, c_s = {c_s}, Δr = {dr}, {rows}×{columns}");
        assert!(bound <= 1.0, "{name}: {bound}");
        assert!(bound > 0.98, "{name}: {bound}, the largest is found");
    });
}

#[test]
fn the_largest_damping_leaves_the_spectrum_within_the_bound() {
    // λ_max of Δt²M⁻¹K + 8σE_r²
    let fastest = 0.75f64.sqrt() - 1e-6;
    for c_s in SPEEDS.into_iter().chain([0.82, 0.83, 0.84, 0.85, fastest]) {
        for geometry in [Geometry::Plane, Geometry::Axisymmetric] {
            let bound = spectral_bound(&layer(geometry, 20, 30, 1.0, c_s, largest_damping(c_s)), 150);
            assert!(bound <= 1.0 && bound > 0.99, "{geometry:?}, c_s = {c_s}: {bound}");
        }
    }
}

/// Energy and largest displacement after random steps and after `steps` more.
fn grown(scheme: &CellScheme, steps: usize) -> [(f64, f64); 2] {
    let mut levels = [scheme.random(1), scheme.random(2), scheme.rest()];
    let look = |[before, now, _]: &[Level<2>; 3]| {
        let energy = scheme.energy(before, now);
        let largest = now.iter().flatten().fold(0.0, |most, u| f64::max(most, u.abs()));
        (energy.kinetic + energy.strain, largest)
    };
    let first = look(&levels);
    for _ in 0..steps {
        let [before, now, next] = &mut levels;
        for j in 0..=scheme.grid.nz {
            for i in 0..scheme.grid.nr() {
                let [u, v] = scheme.next(before, now, j, i);
                (next[0][[j, i]], next[1][[j, i]]) = (u, v);
            }
        }
        levels.rotate_left(1);
    }
    [first, look(&levels)]
}

#[test]
fn random_fields_stay_bounded_for_a_hundred_thousand_steps() {
    // the energy stays within 3e-14, the largest displacement within 14 times that at the beginning, and neither drifts: waves near
    // the shortest ones beat slowly
    let mut cases = Vec::new();
    for geometry in GEOMETRIES {
        for c_s in SPEEDS {
            cases.extend([0.0, largest_damping(c_s)].map(|damping| (geometry, c_s, damping)));
        }
    }
    cases.into_par_iter().for_each(|(geometry, c_s, damping)| {
        let name = format!("{geometry:?}, c_s = {c_s}, σ = {damping}");
        // what is damped would have grown long before
        let steps = if damping == 0.0 { 100_000 } else { 10_000 };
        let [(energy, largest), (last, most)] =
            grown(&layer(geometry, FEWEST_ROWS, 6, 1.0, c_s, damping), steps);
        let is_kept = if damping == 0.0 { (last / energy - 1.0).abs() < 1e-12 } else { last < energy };
        assert!(is_kept && most < 100.0 * largest, "{name}: {energy} {largest}, then {last} {most}");
    });
}

#[test]
fn cells_of_a_layer_of_one_row_are_not_stable_at_the_axis() {
    // the case reader refuses such layers
    let bound = |rows| spectral_bound(&layer(Geometry::Axisymmetric, rows, 14, 1.0, 0.1, 0.0), 60);
    let bounds = [1, FEWEST_ROWS].map(bound);
    assert!(bounds[0] > 1.003 && bounds[1] < 1.0, "{bounds:?}");
}

/// Responses of u and v to a plane wave `cos(q_z j + q_r i + φ)` of either, far from boundaries: −S·cos in this form, S the symmetric
/// matrix of the interior.
fn symbol(c_s: f64, q_z: f64, q_r: f64) -> [[f64; 2]; 2] {
    let scheme = layer(Geometry::Plane, 6, 6, 1.0, c_s, 0.0);
    [0, 1].map(|moved| {
        let phase = |j: usize, i: usize| q_z * (j as f64 - 3.0) + q_r * (i as f64 - 3.0);
        let level = scheme.level(|field, j, i| if field == moved { phase(j, i).cos() } else { 0.0 });
        scheme.at_row(3).accelerations(scheme.reading(&level), 3).map(|acceleration| -acceleration)
    })
}

#[test]
fn waves_are_those_of_the_dispersion_relation() {
    // P and S decouple: eigenvalues 4(f + kxy) and 4(β²f + kxy)
    for c_s in SPEEDS {
        let hourglass = (4.0 * c_s * c_s * (2.0 - c_s * c_s) / 3.0).min(0.6);
        for (q_z, q_r) in [(0.3, 0.4), (1.0, 0.2), (2.0, 2.5), (3.0, 3.1), (0.0, 1.0), (1.7, 0.0)] {
            let [x, y] = [q_z, q_r].map(|q: f64| (0.5 * q).sin().powi(2));
            let f = x * (1.0 - y) + y * (1.0 - x);
            let [p, s] = [1.0, c_s * c_s].map(|share| 4.0 * (share * f + hourglass * x * y));
            let [[a, b], [c, d]] = symbol(c_s, q_z, q_r);
            assert!(
                (a + d - p - s).abs() < 1e-13 && (a * d - b * c - p * s).abs() < 1e-13,
                "{c_s} {q_z} {q_r}"
            );
        }
    }
}

#[test]
fn longitudinal_waves_along_z_and_r_are_exact() {
    // c = 1 for every wave number: cos(q(x − t)) continues as itself. Along z with damping too. Over 20 steps away from boundaries.
    const STEPS: usize = 20;
    for c_s in SPEEDS {
        for q in [0.1, 0.7, 1.9, 3.1] {
            for (field, damping) in [(0, 0.0), (0, largest_damping(c_s)), (1, 0.0)] {
                let scheme = layer(Geometry::Plane, 50, 200, 1.0, c_s, damping);
                let wave = |k: f64| {
                    move |moved: usize, j: usize, i: usize| {
                        let along = if field == 0 { j } else { i } as f64;
                        if moved == field { (q * (along - k) + 0.3).cos() } else { 0.0 }
                    }
                };
                let mut levels = [scheme.level(wave(-1.0)), scheme.level(wave(0.0)), scheme.rest()];
                let mut worst = 0.0;
                for step in 1..=STEPS {
                    let [before, now, next] = &mut levels;
                    // lateral damping reaches over four columns
                    for j in step..50 - step {
                        for i in 4 * step..200 - 4 * step {
                            let [u, v] = scheme.next(before, now, j, i);
                            (next[0][[j, i]], next[1][[j, i]]) = (u, v);
                        }
                    }
                    levels.rotate_left(1);
                }
                let exact = wave(STEPS as f64);
                for (moved, level) in levels[1].iter().enumerate() {
                    for j in STEPS..50 - STEPS {
                        for i in 4 * STEPS..200 - 4 * STEPS {
                            worst = f64::max(worst, (level[[j, i]] - exact(moved, j, i)).abs());
                        }
                    }
                }
                assert!(worst < 1e-12, "c_s = {c_s}, q = {q}, field {field}, σ = {damping}: {worst:e}");
            }
        }
    }
}

/// Largest error of the force on the whole surface of a half-space under a prescribed paraboloid, 0.2 < t < 1, relative to that at t = 1.
fn force_error(cells: usize, c_s: f64) -> f64 {
    let settings = [
        "model=elastic".to_owned(),
        "target.thickness=\"half-space\"".to_owned(),
        format!("target.shear_wave_speed={c_s}"),
        format!("mesh.cells={cells}"),
        // beyond the waves of the contact, all of which count
        "mesh.outer_radius=1.8".to_owned(),
        "run.end_time=1.0".to_owned(),
        "record.frames=0".to_owned(),
    ];
    let case = Case::load("fig2-prescribed", &settings).expect("a built-in case");
    let (grid, velocity) = (case.grid(), case.impact.velocity);
    let mut surface = Surface::new(grid.nr());
    let mut contact = Contact::new(case.impact.contact, case.shape(), &grid, velocity, 1.0);
    let mut indenter = Indenter::new(f64::INFINITY, velocity, grid.dt());
    let mut target = theory(grid.clone(), c_s, case.mesh.damping)
        .reference::<()>(Coverage::Everything, Sampling::default());
    let mut worst: f64 = 0.0;
    for step in 0..=case.sizes.steps {
        target.predict(&mut surface);
        contact.step(&mut surface, &mut indenter, 0.0);
        let force: f64 = grid.area.iter().zip(&surface.pressure).map(|(area, p)| area * p).sum();
        // A = r*² = kt, per πR²
        let t = step as f64 * grid.dt();
        if t > 0.2 {
            worst = worst.max((force / (velocity * 0.2) - t).abs());
        }
        target.advance(&surface, (), Request::default());
        while target.next(true).is_some() {}
    }
    worst
}

#[test]
fn the_force_on_the_whole_surface_is_that_of_plane_waves() {
    // waves along the surface carry none of it: F = V0·A(t), until reflections return
    for c_s in [0.3, 0.6] {
        let errors = [50, 100].map(|cells| force_error(cells, c_s));
        // measured 3.4e-4, 8.5e-5 for both: second order
        assert!(errors[1] <= 1.1e-4, "c_s = {c_s}: {errors:?}");
        let order = (errors[0] / errors[1]).log2();
        assert!((1.9..2.1).contains(&order), "c_s = {c_s}: order {order} of {errors:?}");
    }
}
