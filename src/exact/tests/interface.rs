//! Stress on the axis of two layers of different c_s, simplified theory: orders of convergence in the middle of either layer and at their interface, under
//! a smooth pressure and under a ball.

use super::{mesh, orders, press, relative_rms, run, stack, waves};
use crate::{
    contact::{Contact, Rule},
    geometry::Geometry,
    grid::{Back, Grid},
    indenter::Indenter,
    model::{
        Coverage, Gauges, Sampling,
        rakhmatulin::Rakhmatulin,
        scheme::{Corner, Order},
    },
    shape::{Head, Shape},
    surface::Surface,
};

const END: f64 = 3.0;

/// Stress in the middle of the upper layer, at the interface and in the middle of the lower one, at whole multiples of the coarsest step.
///
/// * `push`: of a mesh
fn stresses<P: FnMut(usize, &mut Surface)>(refinement: usize, push: impl Fn(&Grid) -> P) -> Vec<[f64; 3]> {
    let stack = stack(&[[1.0, 1.0, 0.5, 0.5], [0.3, 0.6, 0.3, 0.6]], Back::Rigid);
    let grid = mesh(&stack, Geometry::Axisymmetric, 1.0 / (32 * refinement) as f64, 0.5, 2.0);
    let points = [0.25, 0.5, 0.8].map(|z| [0.0, z]).to_vec();
    let sampling = Sampling { gauges: Gauges { points, ..Gauges::default() }, ..Sampling::default() };
    let model = Rakhmatulin::layered(grid.clone(), &waves(&stack), Corner::new(Order::Fourth, 1.0));
    let size = (grid.nr(), (END / grid.dt()) as usize);
    let mut seen = Vec::new();
    run(model.reference(Coverage::Everything, sampling), size, push(&grid), |step, _, points| {
        if step % refinement == 0 {
            seen.push([0, 1, 2].map(|number| points[number].stress));
        }
    });
    seen
}

/// Checks mean orders, by the rms over all times of the changes from mesh to mesh.
fn check<P: FnMut(usize, &mut Surface)>(push: impl Fn(&Grid) -> P, least: [f64; 3]) {
    let meshes = [1, 2, 4, 8].map(|refinement| stresses(refinement, &push));
    for (point, least) in least.into_iter().enumerate() {
        let change = |pair: &[Vec<[f64; 3]>]| {
            let pairs: Vec<_> = pair[0].iter().zip(&pair[1]).map(|(a, b)| (a[point], b[point])).collect();
            relative_rms(&pairs)
        };
        let changes: Vec<f64> = meshes.windows(2).map(change).collect();
        let mean = 0.5 * orders(&changes).iter().sum::<f64>();
        assert!(mean > least, "point {point}: order {mean} of {changes:?}");
    }
}

#[test]
fn a_smooth_pressure() {
    // sin⁴ in time and a bell along r
    let push = |grid: &Grid| {
        let (dt, bell): (f64, Vec<f64>) =
            (grid.dt(), (0..grid.nr()).map(|i| (-8.0 * grid.r(i).powi(2)).exp()).collect());
        move |step: usize, surface: &mut Surface| {
            let time = step as f64 * dt;
            let pulse = if time < 1.0 { (std::f64::consts::PI * time).sin().powi(4) } else { 0.0 };
            press(surface, |i| pulse * bell[i]);
        }
    };
    // measured 1.90, 1.04, 2.20: the stress at an interface of different c_s is shown to first order
    check(push, [1.8, 1.0, 1.9]);
}

#[test]
fn a_ball() {
    let push = |grid: &Grid| {
        let shape = Shape::new(Head::Paraboloid { nose_radius: 1.0 }, None);
        let mut contact = Contact::new(Rule::Unilateral, shape, grid, 0.1, 0.5);
        let mut indenter = Indenter::new(0.2, 0.1, grid.dt());
        move |_: usize, surface: &mut Surface| {
            contact.step(surface, &mut indenter, 0.0);
        }
    };
    // measured 1.34, 1.18, 1.44: fronts, and the edge of the contact, where the stress is not smooth
    check(push, [1.2, 1.0, 1.3]);
}
