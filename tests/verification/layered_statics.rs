//! Flat punch at constant velocity on layers over a rigid back: at long times the drag grows as fast as the static stiffness says,
//! [`disc_stiffness`](crate::closed_forms::disc_stiffness) and [`elastic_strip_stiffness`](crate::closed_forms::elastic_strip_stiffness).

use percuss::{
    case::Case,
    exact::stack::{Stack, StackLayer},
    geometry::Geometry,
    grid::Back,
    model::ModelKind,
};
use rayon::prelude::*;

use super::{run, slope};
use crate::closed_forms::{disc_stiffness::DiscStiffness, elastic_strip_stiffness::ElasticStripStiffness};

const TARGET: &str = "[[target.layer]]\nthickness = 0.5\nshear_wave_speed = 0.5\n\
    [[target.layer]]\nthickness = 0.3\ndensity = 0.5\nwave_speed = 0.6\nshear_wave_speed = 0.3\n\
    [[target.layer]]\nthickness = 0.3\ndensity = 1.6666666666666667\nwave_speed = 1.2\nshear_wave_speed = 0.6\n";

/// Slope of the drag of a punch at velocity 1 between two times, relative to the static one, minus 1.
fn error(model: ModelKind, geometry: Geometry, cells: usize, [from, to]: [f64; 2]) -> f64 {
    let layer = |[impedance, wave_speed, shear_wave_speed, thickness]: [f64; 4]| StackLayer {
        impedance,
        wave_speed,
        shear_wave_speed,
        thickness,
    };
    let layers = [[1.0, 1.0, 0.5, 0.5], [0.3, 0.6, 0.3, 0.3], [2.0, 1.2, 0.6, 0.3]].map(layer);
    let stack = Stack::new(&layers, Back::Rigid).expect("a stack");
    let (plane, stiffness) = match geometry {
        Geometry::Axisymmetric => ("axisymmetric", DiscStiffness::on_stack(&stack, model).drag_slope()),
        Geometry::Plane => ("plane", ElasticStripStiffness::on_stack(&stack, model).drag_slope()),
    };
    let model = if model == ModelKind::Elastic { "elastic" } else { "rakhmatulin" };
    let text = format!(
        "model = \"{model}\"\ngeometry = \"{plane}\"\n{TARGET}[indenter]\nshape = \"flat\"\nradius = 1.0\n[impact]\nvelocity = 1.0\n\
         contact = \"bilateral\"\n[mesh]\ncells = {cells}\n[run]\nend_time = {to:?}\n[record]\nframes = 0\n"
    );
    let case = Case::parse("layers", &text, &[], "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let drags = run(&case, |view| (view.time, view.drag));
    let late: Vec<_> = drags.into_iter().filter(|row| row.0 > from).collect();
    slope(&late) / (stiffness / stack.thickness()) - 1.0
}

#[test]
fn slopes_of_the_drag_on_layers_are_static_stiffnesses() {
    // measured 4.4e-4, −6.3e-4, 7.2e-4, 4.8e-4
    let cases = [
        (ModelKind::Rakhmatulin, Geometry::Axisymmetric, 12, [30.0, 60.0]),
        (ModelKind::Rakhmatulin, Geometry::Plane, 12, [60.0, 100.0]),
        (ModelKind::Elastic, Geometry::Axisymmetric, 24, [20.0, 40.0]),
        (ModelKind::Elastic, Geometry::Plane, 12, [40.0, 80.0]),
    ];
    cases.into_par_iter().for_each(|(model, geometry, cells, span)| {
        let error = error(model, geometry, cells, span);
        assert!(error.abs() < 1e-3, "{model:?}, {geometry:?}: {error:e}");
    });
}
