//! Stability of random stacks of both theories: the largest eigenvalue of a step, and fields after many steps.
//!
//! Without damping a step is `u^{k+1} = 2u^k − u^{k−1} − A·u^k`, stable as long as A, symmetric in the product of masses, has no
//! eigenvalue beyond 4.
//! With `PERCUSS_FULL=1` there are 300 stacks, and ten of them run for a hundred thousand steps.

use super::*;

/// Iterations of Lanczos, which find an eigenvalue of `4(1 + 10⁻³)` to rounding among these several hundred.
const ITERATIONS: usize = 200;

/// A random level with what is one node moving as one, and the backing at rest.
fn random<const FIELDS: usize>(grid: &Grid, scheme: &impl Scheme<FIELDS>, seed: u64) -> Level<FIELDS> {
    let (mut noise, mut level) = (Noise(seed), rest(grid, scheme));
    for (j, field) in (0..=grid.nz).flat_map(|j| (0..FIELDS).map(move |field| (j, field))) {
        level[field].row_mut(j).iter_mut().take(grid.nr()).for_each(|u| *u = noise.unit() - 0.5);
    }
    for interface in 1..grid.layers.len() {
        let first = grid.layers[interface].first;
        for (field, values) in level.iter_mut().enumerate() {
            if field == 0 || grid.layers[interface].bond == Bond::Welded {
                let row = values.row(first - 1).to_owned();
                values.row_mut(first).assign(&row);
            }
        }
    }
    if grid.back == Back::Rigid {
        level[0].row_mut(grid.nz).fill(0.0);
    }
    if grid.rim == Some(Rim::Guided) {
        level[1].column_mut(grid.nr() - 1).fill(0.0);
    }
    level
}

/// `a + factor·b`
fn sum<const FIELDS: usize>(a: &Level<FIELDS>, factor: f64, b: &Level<FIELDS>) -> Level<FIELDS> {
    std::array::from_fn(|field| &a[field] + &(&b[field] * factor))
}

/// Largest eigenvalue of A, by the method of Lanczos.
fn largest_eigenvalue<const FIELDS: usize>(grid: &Grid, scheme: &impl Scheme<FIELDS>, seed: u64) -> f64 {
    let still = rest(grid, scheme);
    let stiffness = |u: &Level<FIELDS>| {
        let mut next = rest(grid, scheme);
        scheme.advance(&still, u, &mut next, [grid.nz + 1, grid.nr()]);
        std::array::from_fn(|field| &u[field] * 2.0 - &next[field])
    };
    // the product of masses, from kinetic energies
    let square = |u: &Level<FIELDS>| scheme.energy(&still, u).kinetic;
    let product =
        |a: &Level<FIELDS>, b: &Level<FIELDS>| 0.25 * (square(&sum(a, 1.0, b)) - square(&sum(a, -1.0, b)));
    let (mut diagonal, mut beside) = (Vec::new(), vec![0.0]);
    let mut before = rest(grid, scheme);
    let mut now = random(grid, scheme, seed);
    now = sum(&still, square(&now).sqrt().recip(), &now);
    for _ in 0..ITERATIONS {
        let mut next = stiffness(&now);
        let along = product(&next, &now);
        next = sum(&sum(&next, -along, &now), -beside[diagonal.len()], &before);
        let size = square(&next).sqrt();
        diagonal.push(along);
        beside.push(size);
        if size < 1e-12 {
            break;
        }
        next = sum(&still, 1.0 / size, &next);
        before = std::mem::replace(&mut now, next);
    }
    // no eigenvalue of the tridiagonal matrix lies above x if all pivots of T − x are negative
    let is_above = |x: f64| {
        let mut pivot = 1.0;
        diagonal.iter().zip(&beside).all(|(entry, beside)| {
            pivot = entry - x - beside * beside / pivot;
            pivot < 0.0
        })
    };
    let (mut low, mut high) = (0.0, 16.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if is_above(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

/// Largest displacement in the second half of `steps` relative to that in the first, after a random start at rest.
fn growth<const FIELDS: usize>(grid: &Grid, scheme: &impl Scheme<FIELDS>, seed: u64, steps: usize) -> f64 {
    let start = random(grid, scheme, seed);
    let mut levels = Levels { before: start.clone(), now: start, nr: grid.nr() };
    let mut largest = || {
        (0..steps / 2).fold(0.0, |largest: f64, _| {
            levels.step(scheme, |_, free| free);
            levels.now.iter().flatten().fold(largest, |largest, u| largest.max(u.abs()))
        })
    };
    let first = largest();
    largest() / first
}

#[test]
fn random_stacks_are_stable() {
    let is_full = std::env::var_os("PERCUSS_FULL").is_some();
    let (stacks, steps) = if is_full { (300, 3000) } else { (24, 600) };
    let mut noise = Noise(3);
    for number in 0..stacks {
        let steps = if is_full && number < 10 { 100_000 } else { steps };
        let stack = Stack::random(&mut noise);
        let order = [Order::Second, Order::Fourth][noise.below(2)];
        let dampings = ([0.0, 1.0, 4.0 / 3.0][noise.below(3)], [0.0, 0.5][noise.below(2)]);
        let check = |theory: &str, eigenvalue: f64, growth: f64| {
            let name = format!("{theory}, {stack:?}, {order:?}, {dampings:?}");
            assert!(eigenvalue <= 4.0 * (1.0 + 1e-12), "{name}: {eigenvalue}");
            // λ_max·Δt²/4 = 1 + ε grows as e^(2√ε) per step: by 400 in the second 300 steps for ε = 1e-4
            assert!(growth < 4.0, "{name}: {growth}");
        };
        let simplified = |damping: f64| stack.simplified(12, Corner::new(order, damping));
        let (grid, scheme) = simplified(0.0);
        let eigenvalue = largest_eigenvalue(&grid, &scheme, number);
        let (grid, scheme) = simplified(dampings.0);
        check("simplified", eigenvalue, growth(&grid, &scheme, number, steps));
        let (grid, scheme) = stack.full(12, 0.0);
        let eigenvalue = largest_eigenvalue(&grid, &scheme, number);
        let (grid, scheme) = stack.full(12, dampings.1);
        check("full", eigenvalue, growth(&grid, &scheme, number, steps));
        let ratio = 1.0 + noise.unit();
        let random = noise.below(2) == 0;
        let mut stretch = |number: usize| match random {
            true => 1.0 + 3.0 * noise.unit(),
            false => ratio.powi(number.saturating_sub(3).min(6) as i32),
        };
        let (grid, scheme) = stack.body(12, 0.0, &mut stretch);
        let eigenvalue = largest_eigenvalue(&grid, &scheme, number);
        let (grid, scheme) = stack.body(12, dampings.1, &mut stretch);
        check("graded", eigenvalue, growth(&grid, &scheme, number, steps));
        let rim = [None, Some(Rim::Free), Some(Rim::Guided)][noise.below(3)];
        let stiffness: Vec<_> = stack.plies.iter().map(|_| any_stiffness(&mut noise)).collect();
        let mut stretch = |number: usize| match random {
            true => 1.0 + 3.0 * noise.unit(),
            false => ratio.powi(number.saturating_sub(3).min(6) as i32),
        };
        let (grid, scheme) = stack.anisotropic(&stiffness, rim, 12, 0.0, &mut stretch);
        let eigenvalue = largest_eigenvalue(&grid, &scheme, number);
        let (grid, scheme) = stack.anisotropic(&stiffness, rim, 12, 0.7 * dampings.1, &mut stretch);
        let name = format!("{rim:?}, {stiffness:?}");
        check(&name, eigenvalue, growth(&grid, &scheme, number, steps));
    }
}

/// Of a stable solid with one axis of symmetry: A from 0.1 to 16.
fn any_stiffness(noise: &mut Noise) -> Stiffness {
    let lateral = 0.1 * 160f64.powf(noise.unit());
    let coupled = lateral.sqrt() * (1.1 * noise.unit() - 0.2);
    Stiffness {
        lateral,
        coupled,
        shear: lateral.min(1.0) * (0.01 + 0.69 * noise.unit()),
        // (C11 + C12)·C33 > 2C13²
        plane: (0.3 * lateral).min(0.9 * (lateral - coupled * coupled)),
    }
}

#[test]
fn nothing_alternates_for_ever_over_a_free_back() {
    // λ_max·Δt²/4 = 1 is a double root at −1, with which rows of even and of odd j + k move apart
    let check = |eigenvalue: f64, most: f64, name: &str| {
        println!("{name} {}", 1.0 - eigenvalue / 4.0);
        assert!(eigenvalue / 4.0 < most, "{name}: {}", eigenvalue / 4.0);
    };
    for geometry in GEOMETRIES {
        for c_s in [0.1, 0.3, 0.5, 0.7, 0.8] {
            let plies = vec![Ply { steps: 10, impedance: 1.0, c_p: 1.0, c_s, bond: Bond::Welded }];
            let stack = Stack { plies, back: Back::Free, geometry };
            let (grid, scheme) = stack.full(24, 0.0);
            check(largest_eigenvalue(&grid, &scheme, 1), 0.9992, &format!("full, {stack:?}"));
            for order in [Order::Second, Order::Fourth] {
                let (grid, scheme) = stack.simplified(24, Corner::new(order, 0.0));
                let eigenvalue = largest_eigenvalue(&grid, &scheme, 1);
                check(eigenvalue, 1.0 - 1e-5, &format!("simplified, {order:?}, {stack:?}"));
            }
        }
    }
    let mut noise = Noise(17);
    for number in 0..30 {
        let stack = Stack { back: Back::Free, ..Stack::random(&mut noise) };
        let (grid, scheme) = stack.full(12, 0.0);
        check(largest_eigenvalue(&grid, &scheme, number), 1.0 - 1e-6, &format!("full, {stack:?}"));
        let (grid, scheme) = stack.simplified(12, Corner::new(Order::Fourth, 0.0));
        check(largest_eigenvalue(&grid, &scheme, number), 1.0 - 1e-6, &format!("simplified, {stack:?}"));
    }
}
