//! Tests of both theories on layered targets, under the plain stepper's operators. Those against closed forms are beside these, in `exact`.

use ndarray::Array2;

use super::{
    Field,
    blocked::Instructions,
    body::{Body, Material},
    cell_scheme::CellScheme,
    elastic::{self, FEWEST_SLIDING},
    noise::Noise,
    rakhmatulin::Rakhmatulin,
    reference::{Level, Scheme},
    scheme::{Corner, Order},
};
use crate::{
    geometry::Geometry,
    grid::{Back, Bond, Grid, MeshKind, Rim, Spacing},
    material::{Stiffness, Waves},
};

mod stability;

const GEOMETRIES: [Geometry; 2] = [Geometry::Axisymmetric, Geometry::Plane];

/// A layer of a stack: axial steps, impedance, c_p and c_s.
#[derive(Clone, Copy, Debug)]
pub struct Ply {
    pub steps: usize,
    impedance: f64,
    c_p: f64,
    c_s: f64,
    bond: Bond,
}

#[derive(Clone, Debug)]
pub struct Stack {
    pub plies: Vec<Ply>,
    back: Back,
    geometry: Geometry,
}

const DT: f64 = 0.1;

impl Stack {
    /// A mesh of `nr` columns, as dense as the faster of the speeds allows.
    ///
    /// * `speed`: along r, of a layer
    fn grid(&self, nr: usize, speed: impl FnMut(&Ply) -> f64) -> Grid {
        let dr = DT * self.plies.iter().map(speed).fold(0.0, f64::max);
        let spacing = Spacing { dr, dz: DT, layer_rows: Some(1) };
        let layers: Vec<_> = self.plies.iter().map(|ply| (ply.steps, ply.c_p * DT, ply.bond)).collect();
        Grid::new(self.geometry, MeshKind::Matched, spacing, nr, 1).with_layers(DT, &layers, self.back)
    }

    fn waves(&self) -> Vec<Waves> {
        self.plies.iter().map(|ply| Waves { impedance: ply.impedance, shear: ply.c_s }).collect()
    }

    pub fn simplified(&self, nr: usize, corner: Option<Corner>) -> (Grid, Rakhmatulin) {
        let grid = self.grid(nr, |ply| ply.c_s);
        (grid.clone(), Rakhmatulin::layered(grid, &self.waves(), corner))
    }

    pub fn full(&self, nr: usize, damping: f64) -> (Grid, CellScheme) {
        let grid = self.grid(nr, |ply| ply.c_p).with_cells_between_nodes();
        (grid.clone(), elastic::layered(grid, &self.waves(), damping))
    }

    /// A mesh with cells between nodes whose widths and heights are those of [`Stack::full`] times `stretch` of a number, at least 1.
    pub fn body(&self, nr: usize, damping: f64, stretch: impl FnMut(usize) -> f64) -> (Grid, Body) {
        let stiffness = |ply: &Ply| Stiffness::isotropic(ply.c_s / ply.c_p);
        let stiffness: Vec<_> = self.plies.iter().map(stiffness).collect();
        self.anisotropic(&stiffness, None, nr, damping, stretch)
    }

    /// The same of layers of other stiffness, with or without a rim.
    fn anisotropic(
        &self,
        stiffness: &[Stiffness],
        rim: Option<Rim>,
        nr: usize,
        damping: f64,
        mut stretch: impl FnMut(usize) -> f64,
    ) -> (Grid, Body) {
        let mut lateral = stiffness.iter().map(|stiffness| stiffness.lateral.sqrt());
        let slack = if rim == Some(Rim::Free) { 0.97 } else { 1.0 };
        let uniform = self.grid(nr, |ply| ply.c_p * lateral.next().unwrap_or(1.0) / slack);
        let widths = (0..=nr).map(|i| uniform.dr * stretch(i)).collect();
        let mut j = 0;
        let layers: Vec<(Vec<f64>, Bond)> = self
            .plies
            .iter()
            .map(|ply| {
                let heights = (0..ply.steps).map(|_| {
                    j += 1;
                    ply.c_p * DT * stretch(j)
                });
                (heights.collect(), ply.bond)
            })
            .collect();
        let grid = Grid::graded(self.geometry, widths, DT, &layers, self.back, true, rim);
        let material = |(ply, stiffness): (&Ply, &Stiffness)| Material {
            impedance: ply.impedance,
            speed: ply.c_p,
            stiffness: *stiffness,
        };
        let materials: Vec<_> = self.plies.iter().zip(stiffness).map(material).collect();
        (grid.clone(), Body::new(grid, &materials, damping, Instructions::detect()))
    }

    /// A random stack of 1 to 4 layers.
    pub fn random(noise: &mut Noise) -> Self {
        let count = 1 + noise.below(4);
        let ply = |number: usize, noise: &mut Noise| {
            let c_p = 0.4 + 1.2 * noise.unit();
            Ply {
                steps: if count == 1 { 4 } else { 2 } + noise.below(5),
                impedance: if number == 0 { 1.0 } else { 100f64.powf(noise.unit() * 2.0 - 1.0) },
                c_p,
                c_s: c_p * (0.2 + 0.6 * noise.unit()),
                bond: [Bond::Welded, Bond::Sliding][noise.below(2)],
            }
        };
        let mut plies: Vec<Ply> = (0..count).map(|number| ply(number, noise)).collect();
        for number in 0..count {
            let slides = |ply: usize| (1..count).contains(&ply) && plies[ply].bond == Bond::Sliding;
            if slides(number) || slides(number + 1) {
                plies[number].steps = plies[number].steps.max(FEWEST_SLIDING);
            }
        }
        Self { plies, back: [Back::Rigid, Back::Free][noise.below(2)], geometry: GEOMETRIES[noise.below(2)] }
    }
}

fn rest<const FIELDS: usize>(grid: &Grid, scheme: &impl Scheme<FIELDS>) -> Level<FIELDS> {
    [(); FIELDS].map(|()| Array2::zeros((grid.nz + 1, scheme.stride())))
}

/// Three consecutive levels.
struct Levels<const FIELDS: usize> {
    before: Level<FIELDS>,
    now: Level<FIELDS>,
    /// Columns of the mesh.
    nr: usize,
}

impl<const FIELDS: usize> Levels<FIELDS> {
    fn at_rest(grid: &Grid, scheme: &impl Scheme<FIELDS>) -> Self {
        Self { before: rest(grid, scheme), now: rest(grid, scheme), nr: grid.nr() }
    }

    /// Goes on by a step, and returns the level before.
    ///
    /// * `surface`: u_z of surface node i, given that of the free surface
    fn step(
        &mut self,
        scheme: &impl Scheme<FIELDS>,
        mut surface: impl FnMut(usize, f64) -> f64,
    ) -> Level<FIELDS> {
        let mut next = self.now.clone();
        scheme.advance(&self.before, &self.now, &mut next, [self.now[0].nrows(), self.nr]);
        for i in 0..self.nr {
            next[0][[0, i]] = surface(i, next[0][[0, i]]);
        }
        std::mem::replace(&mut self.before, std::mem::replace(&mut self.now, next))
    }
}

/// Largest difference of two levels relative to the larger, the first cut by an interface after `row`.
fn difference<const FIELDS: usize>(cut: &Level<FIELDS>, whole: &Level<FIELDS>, row: usize) -> f64 {
    let (mut error, mut size) = (0.0, 0.0);
    for (cut, whole) in cut.iter().zip(whole) {
        for ((j, i), u) in cut.indexed_iter() {
            let expected = whole[[if j > row { j - 1 } else { j }, i]];
            (error, size) = (f64::max(error, (u - expected).abs()), f64::max(size, expected.abs()));
        }
    }
    error / size
}

#[test]
fn two_layers_of_one_material_are_one_layer() {
    fn check<const FIELDS: usize>([cut, whole]: [(Grid, impl Scheme<FIELDS>); 2], row: usize, name: &str) {
        let [mut a, mut b] = [Levels::at_rest(&cut.0, &cut.1), Levels::at_rest(&whole.0, &whole.1)];
        let (mut pushes, mut same) = (Noise(7), Noise(7));
        for _ in 0..40 {
            a.step(&cut.1, |i, free| if i < 4 { free + 0.1 * pushes.unit() } else { free });
            b.step(&whole.1, |i, free| if i < 4 { free + 0.1 * same.unit() } else { free });
        }
        let error = difference(&a.now, &b.now, row);
        assert!(error < 1e-14, "{name}: {error:e}");
    }
    let ply = Ply { steps: 9, impedance: 1.0, c_p: 1.0, c_s: 0.5, bond: Bond::Welded };
    for geometry in GEOMETRIES {
        for back in [Back::Rigid, Back::Free] {
            let stack = |plies: Vec<Ply>| Stack { plies, back, geometry };
            let cut = stack(vec![Ply { steps: 4, ..ply }, Ply { steps: 5, ..ply }]);
            let whole = stack(vec![ply]);
            // the mixed-derivative correction has no difference across an interface
            let second = [&cut, &whole].map(|stack| stack.simplified(14, None));
            check(second, 4, &format!("simplified, {geometry:?}, {back:?}"));
            let full = [&cut, &whole].map(|stack| stack.full(14, 0.5));
            check(full, 4, &format!("full, {geometry:?}, {back:?}"));
        }
    }
}

#[test]
fn stacks_keep_the_energy_that_the_surface_gives() {
    fn check<const FIELDS: usize>(grid: &Grid, scheme: &impl Scheme<FIELDS>, name: &str) {
        let (mut levels, mut noise, mut work, mut gross) =
            (Levels::at_rest(grid, scheme), Noise(11), 0.0, 0.0);
        for _ in 0..120 {
            let pushes: Vec<f64> = (0..grid.nr()).map(|_| noise.unit() - 0.5).collect();
            let before = levels.step(scheme, |i, free| free + pushes[i]);
            for (i, push) in pushes.iter().enumerate() {
                let moved = levels.now[0][[0, i]] - before[0][[0, i]];
                let done = 0.5 * grid.area[i] * push / scheme.compliance(i) * moved;
                (work, gross) = (work + done, gross + done.abs());
            }
        }
        let energy = scheme.energy(&levels.before, &levels.now);
        let rest = work - energy.kinetic - energy.strain;
        assert!(rest.abs() < 1e-12 * gross, "{name}: {rest:e} of {gross}");
    }
    let mut noise = Noise(5);
    for _ in 0..12 {
        let stack = Stack::random(&mut noise);
        for order in [Order::Second, Order::Fourth] {
            let (grid, scheme) = stack.simplified(9, Corner::new(order, 0.0));
            check(&grid, &scheme, &format!("simplified, {stack:?}, {order:?}"));
        }
        let (grid, scheme) = stack.full(9, 0.0);
        check(&grid, &scheme, &format!("full, {stack:?}"));
        let (grid, scheme) = stack.body(9, 0.0, |_| 1.0 + noise.unit());
        check(&grid, &scheme, &format!("graded, {stack:?}"));
    }
}

#[test]
fn equal_rows_and_columns_are_the_uniform_mesh() {
    let mut noise = Noise(23);
    for _ in 0..40 {
        let stack = Stack::random(&mut noise);
        let nr = 5 + noise.below(20);
        let (uniform, graded) = (stack.full(nr, 0.0), stack.body(nr, 0.0, |_| 1.0));
        let mut a = Levels::at_rest(&uniform.0, &uniform.1);
        let mut b = Levels::at_rest(&graded.0, &graded.1);
        let seed = noise.0;
        let (mut pushes, mut same) = (Noise(seed), Noise(seed));
        for _ in 0..40 {
            a.step(&uniform.1, |i, free| if i < 4 { free + 0.1 * pushes.unit() } else { free });
            b.step(&graded.1, |i, free| if i < 4 { free + 0.1 * same.unit() } else { free });
        }
        let (grid, size) = (&uniform.0, a.now[0].iter().fold(0.0, |size: f64, u| size.max(u.abs())));
        let close = |a: f64, b: f64, size: f64, what: &str| {
            assert!((a - b).abs() < 1e-12 * size, "{what}, {stack:?}: {a:e} {b:e} of {size:e}");
        };
        for (a, b) in a.now.iter().zip(&b.now) {
            a.indexed_iter().for_each(|(place, u)| close(*u, b[place], size, "displacement"));
        }
        let [uniform_energy, graded_energy] =
            [uniform.1.energy(&a.before, &a.now), graded.1.energy(&b.before, &b.now)];
        let gross = uniform_energy.kinetic + uniform_energy.strain.abs();
        close(uniform_energy.kinetic, graded_energy.kinetic, gross, "kinetic energy");
        close(uniform_energy.strain, graded_energy.strain, gross, "strain energy");
        let pressure = vec![0.3; nr];
        // stresses by what strains of the size of the displacements give
        let unit = 300.0 * size / grid.dr.min(grid.dz);
        for (j, i) in (0..=grid.nz).flat_map(|j| (0..nr).map(move |i| (j, i))) {
            let mut of_uniform = uniform.1.show([&a.before, &a.now, &a.now], &pressure, j, i);
            let mut of_graded = graded.1.show([&b.before, &b.now, &b.now], &pressure, j, i);
            for field in Field::ALL {
                close(of_uniform(field), of_graded(field), unit, field.name());
            }
            if j < grid.nz {
                let mut strains = [0.0; 2];
                uniform.1.look(&a.now, j, i..i + 1, |_, strain, _| strains[0] = strain);
                graded.1.look(&b.now, j, i..i + 1, |_, strain, _| strains[1] = strain);
                close(strains[0], strains[1], unit, "strain");
            }
        }
        for i in 0..nr {
            close(uniform.1.backing_strain(&a.now, i), graded.1.backing_strain(&b.now, i), unit, "back");
            for interface in 1..grid.layers.len() {
                let a = uniform.1.traction(&a.before, &a.now, interface - 1, i);
                let b = graded.1.traction(&b.before, &b.now, interface - 1, i);
                close(a[0], b[0], unit, "normal traction");
                close(a[1], b[1], unit, "shear traction");
            }
        }
    }
}

#[test]
fn what_a_force_moves_elsewhere_is_reciprocal() {
    // u_z at B after a push at A, times the mass of B, is u_z at A after that push at B, times the mass of A
    fn check<const FIELDS: usize>(
        grid: &Grid,
        scheme: &impl Scheme<FIELDS>,
        mass: impl Fn(usize, usize) -> f64,
    ) {
        let answer = |from: [usize; 2], to: [usize; 2]| -> Vec<f64> {
            let mut levels = Levels::at_rest(grid, scheme);
            levels.now[0][from] = 1.0;
            let step = |_| {
                levels.step(scheme, |_, free| free);
                levels.now[0][to] * mass(to[0], to[1])
            };
            (0..50).map(step).collect()
        };
        // inside, and in the last row and the one above it
        let a = [0, 0];
        for b in [[grid.layers[1].first + 1, 3], [grid.nz, 2], [grid.nz - 1, 0]] {
            let (there, back) = (answer(a, b), answer(b, a));
            let size = there.iter().fold(0.0, |size: f64, u| size.max(u.abs()));
            let error = there.iter().zip(&back).fold(0.0, |error: f64, (a, b)| error.max((a - b).abs()));
            assert!(size > 0.0 && error < 1e-12 * size, "{b:?}: {error:e} of {size:e}");
        }
    }
    let ply =
        |impedance: f64, c_p: f64| Ply { steps: 5, impedance, c_p, c_s: 0.5 * c_p, bond: Bond::Sliding };
    for geometry in GEOMETRIES {
        let plies = vec![ply(1.0, 1.0), ply(0.1, 0.6), ply(3.0, 1.3)];
        let stack = Stack { plies, back: Back::Free, geometry };
        let mass = |grid: &Grid, j: usize, i: usize| {
            let depth = if j == 0 { 0.5 } else { 1.0 };
            depth * stack.plies[grid.layer_of(j)].impedance * grid.area[i]
        };
        let (grid, scheme) = stack.simplified(9, Corner::new(Order::Fourth, 0.0));
        check(&grid, &scheme, |j, i| mass(&grid, j, i));
        let (grid, scheme) = stack.full(9, 0.0);
        check(&grid, &scheme, |j, i| mass(&grid, j, i));
    }
}

/// The first longitudinal mode of a round bar between smooth rigid ends, ν = 0.29, has the phase speed of Pochhammer and Chree, with 20 nodes a wavelength.
#[test]
fn a_bar_has_the_first_mode_of_pochhammer_and_chree() {
    // c/√(E/γ) against a/λ, from their secular equation
    for (slenderness, expected) in [(0.25, 0.92175), (0.5, 0.68927), (1.0, 0.58607)] {
        let (steps, nu) = (10, 0.29f64);
        let c_s = ((1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))).sqrt();
        let plies = vec![Ply { steps, impedance: 1.0, c_p: 1.0, c_s, bond: Bond::Welded }];
        let stack = Stack { plies, back: Back::Rigid, geometry: Geometry::Axisymmetric };
        let (wavelength, least) = (2.0 * steps as f64 * DT, DT / 0.97);
        let radius = slenderness * wavelength;
        let nr = (radius / least + 0.5).floor() as usize;
        let stretch = radius / (nr as f64 - 0.5) / least;
        // of the columns, which are asked for first
        let mut asked = 0;
        let sizes = |_| {
            asked += 1;
            if asked <= nr + 1 { stretch } else { 1.0 }
        };
        let (grid, body) = stack.anisotropic(&[Stiffness::isotropic(c_s)], Some(Rim::Free), nr, 0.0, sizes);
        assert!((grid.r(nr - 1) / radius - 1.0).abs() < 1e-12);
        // wide where it is pressed together along z, as the mode is
        let mut levels = Levels::at_rest(&grid, &body);
        for (j, i) in (0..=grid.nz).flat_map(|j| (0..nr).map(move |i| (j, i))) {
            let phase = std::f64::consts::PI * j as f64 / steps as f64;
            levels.now[1][[j, i]] = phase.cos() * grid.r(i) / radius;
        }
        levels.before = levels.now.clone();
        let count = 6000;
        let seen: Vec<f64> = (0..count)
            .map(|_| {
                levels.step(&body, |_, _| 0.0);
                levels.now[1][[0, nr - 1]]
            })
            .collect();
        // the strongest frequency around that of the mode, under a window
        let youngs = c_s * c_s * (3.0 - 4.0 * c_s * c_s) / (1.0 - c_s * c_s);
        let speed = |omega: f64| omega / (2.0 * std::f64::consts::PI / wavelength) / youngs.sqrt();
        let strength = |omega: f64| {
            let (mut cos, mut sin) = (0.0, 0.0);
            for (step, v) in seen.iter().enumerate() {
                let share = (step as f64 + 0.5) / f64::from(count);
                let window = (std::f64::consts::PI * share).sin().powi(2);
                let (s, c) = libm::sincos(omega * DT * step as f64);
                (cos, sin) = (cos + window * v * c, sin + window * v * s);
            }
            cos.hypot(sin)
        };
        let middle = expected * youngs.sqrt() * 2.0 * std::f64::consts::PI / wavelength;
        let tried = (-200..=200).map(|n| middle * (1.0 + 1e-4 * f64::from(n)));
        let found = tried.max_by(|a, b| strength(*a).total_cmp(&strength(*b))).expect("frequencies");
        let error = speed(found) / expected - 1.0;
        println!(
            "a/λ = {slenderness}: c/c_b = {:.5}, {:.2} % off, {nr} columns",
            speed(found),
            100.0 * error
        );
        assert!(error.abs() < 5e-3, "{slenderness}: {error}");
    }
}
