//! A plane wave through 1, 2, 5 and 12 layers with impedances up to 1:100, against [`crate::exact::stack`]: exact to rounding in both
//! theories.

use crate::{
    exact::stack::Stack,
    geometry::Geometry,
    grid::{Back, Grid},
    model::{
        Coverage, FrameFields, elastic,
        rakhmatulin::Rakhmatulin,
        reference::{Reference, Scheme},
        scheme::{Corner, Order},
    },
    surface::Surface,
};

use super::{mesh, run, stack, waves};

const STEPS: usize = 70;
const DT: f64 = 0.1;

/// Largest error of the pressure in the middle of a flat face, relative to the largest pressure.
fn error<S: Scheme<FIELDS>, const FIELDS: usize>(
    stack: &Stack,
    grid: &Grid,
    model: Reference<(), S, FIELDS>,
) -> f64 {
    let (mut error, mut largest) = (0.0, 0.0);
    let push = |step: usize, surface: &mut Surface| {
        let u = (step + 1) as f64 * grid.dt();
        surface.displacement.fill(u);
        surface.pressure[0] = (u - surface.free[0]) / surface.compliance[0];
    };
    run(model, (grid.nr(), STEPS), push, |step, surface, _| {
        let expected = stack.pressure(0.0, step as f64 * grid.dt()).expect("in range");
        error = f64::max(error, (surface.pressure[0] - expected).abs());
        largest = f64::max(largest, expected.abs());
    });
    error / largest
}

#[test]
fn normal_incidence_is_exact_for_any_stack() {
    for count in [1, 2, 5, 12] {
        for back in [Back::Rigid, Back::Free] {
            let layer = |number: usize| {
                // impedances from 0.1 to 10 in no order, speeds from 0.5 to 1.5
                let [x, y] = [0.618_034, 0.414_214].map(|step| (number as f64 * step).fract());
                let impedance = if number == 0 { 1.0 } else { 10f64.powf(2.0 * x - 1.0) };
                let wave_speed = 0.5 + y;
                let is_last = number + 1 == count;
                let half = if is_last && back == Back::Free { 0.5 } else { 0.0 };
                let steps = (4 + number % 3) as f64 + half;
                [impedance, wave_speed, 0.3, steps * DT * wave_speed]
            };
            let stack = stack(&(0..count).map(layer).collect::<Vec<_>>(), back);
            let check = |error: f64, name: &str| {
                // measured up to 5e-14
                assert!(error < 1e-13, "{count} layers, {back:?}, {name}: {error:e}");
            };
            // columns enough that what the outermost one does is not there yet
            let fastest = stack.layers().iter().map(|layer| layer.wave_speed).fold(0.0, f64::max);
            for order in [Order::Second, Order::Fourth] {
                let dr = 0.3 * DT;
                let grid = mesh(&stack, Geometry::Axisymmetric, dr, 0.3, (2 * STEPS + 4) as f64 * dr);
                let theory = Rakhmatulin::layered(grid.clone(), &waves(&stack), Corner::new(order, 1.0));
                check(
                    error(&stack, &grid, theory.reference(Coverage::Everything, FrameFields::default())),
                    &format!("simplified, {order:?}"),
                );
            }
            let dr = fastest * DT;
            let grid = mesh(&stack, Geometry::Axisymmetric, dr, fastest, (STEPS + 6) as f64 * dr);
            let grid = grid.with_cells_between_nodes();
            let theory = elastic::layered(grid.clone(), &waves(&stack), 0.0);
            check(
                error(&stack, &grid, theory.reference(Coverage::Everything, FrameFields::default())),
                "full",
            );
        }
    }
}
