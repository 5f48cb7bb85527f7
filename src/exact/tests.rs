//! Layered targets of both theories under the plain stepper against closed forms, and their orders of convergence.

use crate::{
    exact::stack::{Stack, StackLayer},
    geometry::Geometry,
    grid::{Back, Bond, Grid, LayerSteps, MeshKind, Spacing},
    material::Waves,
    model::{
        Model, PointState, Request,
        reference::{Reference, Scheme},
    },
    surface::Surface,
};

mod coating;
mod interface;
mod plane_wave;
mod spreading;
#[path = "../../tests/closed_forms/surface_wave.rs"]
mod surface_wave;
#[path = "../../tests/closed_forms/transfer.rs"]
mod transfer;

/// A layer by impedance, longitudinal and shear wave speed, and thickness.
fn layer([impedance, wave_speed, shear_wave_speed, thickness]: [f64; 4]) -> StackLayer {
    StackLayer { impedance, wave_speed, shear_wave_speed, thickness }
}

fn stack(layers: &[[f64; 4]], back: Back) -> Stack {
    Stack::new(&layers.iter().map(|values| layer(*values)).collect::<Vec<_>>(), back).expect("a stack")
}

fn waves(stack: &Stack) -> Vec<Waves> {
    let waves = |layer: &StackLayer| Waves { impedance: layer.impedance, shear: layer.shear_wave_speed };
    stack.layers().iter().map(waves).collect()
}

/// A matched mesh of a stack, over a rigid back one whose transit times have a common measure: with half a step in the last layer that would be
/// another stack for every mesh, see [`computed`].
///
/// * `speed`: of the fastest waves along r
/// * `radius`: of the mesh
fn mesh(stack: &Stack, geometry: Geometry, dr: f64, speed: f64, radius: f64) -> Grid {
    let back = stack.back().expect("a stack with a back");
    let mut layers: Vec<_> =
        stack.layers().iter().map(|layer| (layer.thickness / layer.wave_speed, 0.0)).collect();
    layers.last_mut().expect("a layer").1 = back.overhang();
    let fit = LayerSteps::fit(&layers, dr / speed).expect("thick layers");
    let LayerSteps { dt, steps, changes } = fit;
    let largest = if back == Back::Rigid { 1e-12 } else { 0.025 };
    assert!(changes.iter().all(|change| change.abs() < largest), "transit times of whole steps: {changes:?}");
    let row = |((steps, (_, overhang)), layer): ((usize, &(f64, f64)), &StackLayer)| {
        (steps, layer.thickness / (steps as f64 + overhang), Bond::Welded)
    };
    let rows: Vec<_> = steps.into_iter().zip(&layers).zip(stack.layers()).map(row).collect();
    let spacing = Spacing { dr, dz: dt, layer_rows: Some(1) };
    let nr = (radius / dr).ceil() as usize;
    Grid::new(geometry, MeshKind::Matched, spacing, nr, 1).with_layers(dt, &rows, back)
}

/// The stack whose wave speeds are those of a mesh.
fn computed(stack: &Stack, grid: &Grid) -> Stack {
    let layers = stack.layers().iter().zip(&grid.layers);
    let layers = layers.map(|(layer, rows)| StackLayer { wave_speed: rows.dz / grid.dt(), ..*layer });
    Stack::new(&layers.collect::<Vec<_>>(), grid.back).expect("a stack")
}

/// Runs a target, and shows the surface and the points in every step.
///
/// * `push`: what settles pressure and displacement of the free surface in a step
fn run<S: Scheme<FIELDS>, const FIELDS: usize>(
    mut model: Reference<(), S, FIELDS>,
    (nodes, steps): (usize, usize),
    mut push: impl FnMut(usize, &mut Surface),
    mut look: impl FnMut(usize, &Surface, &[PointState]),
) {
    let mut surface = Surface::new(nodes);
    for step in 0..steps {
        model.predict(&mut surface);
        push(step, &mut surface);
        model.advance(&surface, (), Request::default());
        let gauges = Model::next(&mut model, true).expect("the step").gauges;
        look(step, &surface, &gauges.unwrap_or_default().points);
    }
}

/// Presses on a free surface.
///
/// * `pressure`: on node i
fn press(surface: &mut Surface, pressure: impl Fn(usize) -> f64) {
    for i in 0..surface.free.len() {
        surface.pressure[i] = pressure(i);
        surface.displacement[i] = surface.free[i] + surface.compliance[i] * surface.pressure[i];
    }
}

/// Root of the mean square of errors, relative to that of the expected values.
///
/// * `pairs`: value and expected value
fn relative_rms(pairs: &[(f64, f64)]) -> f64 {
    let sum = |square: fn(&(f64, f64)) -> f64| pairs.iter().map(square).sum::<f64>();
    (sum(|(value, expected)| (value - expected).powi(2)) / sum(|(_, expected)| expected.powi(2))).sqrt()
}

/// Observed orders of convergence of errors on meshes refined by two.
fn orders(errors: &[f64]) -> Vec<f64> {
    errors.windows(2).map(|pair| (pair[0] / pair[1]).log2()).collect()
}
