//! Flat punch at constant velocity on layers over a rigid back: at long times the drag grows as fast as the static stiffness says.

use rayon::prelude::*;

use super::{mesh, run, stack, waves};
use crate::{
    contact::{Contact, Rule},
    exact::{disc_stiffness::DiscStiffness, elastic_strip_stiffness::ElasticStripStiffness},
    geometry::Geometry,
    grid::{Back, Edge},
    indenter::Indenter,
    model::{
        Coverage, FrameFields, ModelKind, elastic,
        rakhmatulin::Rakhmatulin,
        scheme::{Corner, Order},
    },
    shape::{Head, Shape},
};

/// Slope of the straight line nearest to a series of `(t, value)`.
fn slope(series: &[(f64, f64)]) -> f64 {
    let n = series.len() as f64;
    let mean = series.iter().fold([0.0; 2], |sum, (t, value)| [sum[0] + t / n, sum[1] + value / n]);
    let above: f64 = series.iter().map(|(t, value)| (t - mean[0]) * (value - mean[1])).sum();
    above / series.iter().map(|(t, _)| (t - mean[0]).powi(2)).sum::<f64>()
}

/// Slope of the drag of a punch at velocity 1 between two times, relative to the static one, minus 1.
fn error(theory: ModelKind, geometry: Geometry, cells: usize, [from, to]: [f64; 2]) -> f64 {
    let stack = stack(&[[1.0, 1.0, 0.5, 0.5], [0.3, 0.6, 0.3, 0.3], [2.0, 1.2, 0.6, 0.3]], Back::Rigid);
    let stiffness = match geometry {
        Geometry::Axisymmetric => DiscStiffness::on_stack(&stack, theory).expect("range").drag_slope(),
        Geometry::Plane => ElasticStripStiffness::on_stack(&stack, theory).expect("range").drag_slope(),
    };
    // the fastest waves along r, and the edge where the first layer puts it
    let (speed, edge) = match theory {
        ModelKind::Rakhmatulin => (0.6, Edge::FOURTH.offset - Edge::FOURTH.slope * (1.0 - 0.5 / 0.6)),
        ModelKind::Elastic => (1.2, Edge::elastic(0.5).offset),
    };
    let dr = 1.0 / (cells as f64 - 0.5 + edge);
    let grid = mesh(&stack, geometry, dr, speed, 1.5 + 0.5 * speed * to);
    let grid = if theory == ModelKind::Elastic { grid.with_cells_between_nodes() } else { grid };
    let shape = Shape::new(Head::Flat { edge_radius: 0.0 }, Some(1.0));
    let mut contact = Contact::new(Rule::Bilateral, shape, geometry, &grid, 1.0, 0.5);
    let mut indenter = Indenter::new(f64::INFINITY, 1.0, grid.dt());
    let size = (grid.nr(), (to / grid.dt()) as usize);
    let mut drags = Vec::new();
    let push = |step: usize, surface: &mut _| {
        drags.push((step as f64 * grid.dt(), contact.step(surface, &mut indenter).drag));
    };
    match theory {
        ModelKind::Rakhmatulin => {
            let theory = Rakhmatulin::layered(grid.clone(), &waves(&stack), Corner::new(Order::Fourth, 1.0));
            run(theory.reference(Coverage::Everything, FrameFields::default()), size, push, |_, _, _| {});
        }
        ModelKind::Elastic => {
            let theory = elastic::layered(grid.clone(), &waves(&stack), 0.5);
            run(theory.reference(Coverage::Everything, FrameFields::default()), size, push, |_, _, _| {});
        }
    }
    drags.retain(|row| row.0 > from);
    slope(&drags) / (stiffness / stack.thickness()) - 1.0
}

#[test]
fn slopes_of_the_drag_are_static_stiffnesses() {
    // measured 1.9e-4, −8.6e-4, −1.8e-4, 5.0e-4
    let cases = [
        (ModelKind::Rakhmatulin, Geometry::Axisymmetric, 12, [30.0, 60.0]),
        (ModelKind::Rakhmatulin, Geometry::Plane, 12, [60.0, 100.0]),
        (ModelKind::Elastic, Geometry::Axisymmetric, 16, [20.0, 40.0]),
        (ModelKind::Elastic, Geometry::Plane, 12, [20.0, 40.0]),
    ];
    cases.into_par_iter().for_each(|(theory, geometry, cells, span)| {
        let error = error(theory, geometry, cells, span);
        assert!(error.abs() < 1e-3, "{theory:?}, {geometry:?}: {error:e}");
    });
}
