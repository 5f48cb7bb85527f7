//! Waves along coated half-spaces of the full theory, 20 nodes to a wavelength: phase speed against [`super::surface_wave`].
//!
//! A short pulse of pressure `cos kx` all over the surface makes body waves, which leave, and a standing surface wave of that k.

use std::f64::consts::PI;

use crate::{
    exact::stack::Stack,
    geometry::Geometry,
    grid::{Back, Bond, Grid, MeshKind, Spacing},
    model::{Coverage, FrameFields, elastic},
};

use rayon::prelude::*;

use super::{press, run, stack, surface_wave::phase_speed, waves};

/// Nodes to a wavelength.
const NODES: f64 = 20.0;

/// Phase speed of the surface wave of a coating over a half-space.
///
/// * `dr`: distance of nodes; Δt = 1, and the coating has two rows
/// * `k`: wave number
fn measured(stack: &Stack, dr: f64, k: f64) -> f64 {
    // the second half is looked at
    let steps = 300;
    let [coating, space] = stack.layers() else { panic!("a coated half-space") };
    // neither end of the mesh is seen at the axis
    let layers = [(2, coating.wave_speed, Bond::Welded), (steps / 2 + 1, space.wave_speed, Bond::Welded)];
    let spacing = Spacing { dr, dz: 1.0, layer_rows: Some(1) };
    let grid = Grid::new(Geometry::Plane, MeshKind::Matched, spacing, steps + 4, 1)
        .with_layers(1.0, &layers, Back::Rigid)
        .with_cells_between_nodes();
    let model = elastic::layered(grid.clone(), &waves(stack), 0.0)
        .reference(Coverage::Everything, FrameFields::default());
    let mut motion = Vec::new();
    let push = |step: usize, surface: &mut _| {
        // two periods of shear waves that begin and end gently
        let turns = 0.5 * k / (2.0 * PI) * step as f64;
        let pulse =
            if turns < 2.0 { (2.0 * PI * turns).sin() * (0.5 * PI * turns).sin().powi(2) } else { 0.0 };
        press(surface, |i| pulse * (k * grid.r(i)).cos());
    };
    run(model, (grid.nr(), steps), push, |_, surface, _| motion.push(surface.displacement[0]));
    // u^{k+1} + u^{k−1} = 2cos(ωΔt)·u^k, in the mean of squares
    let late = &motion[steps / 2..];
    let sums = late.windows(3).map(|u| [(u[0] + u[2]) * u[1], 2.0 * u[1] * u[1]]);
    let [above, below] = sums.fold([0.0; 2], |sum, terms| [sum[0] + terms[0], sum[1] + terms[1]]);
    (above / below).acos() / k
}

#[test]
fn surface_waves_run_as_the_secular_determinant_says() {
    // impedance, c_p and c_s of a coating of two rows on a half-space of 1, 1, 0.5; measured −2.1e-3, −6.5e-3, 7.3e-3, 8e-4
    let coatings = [[1.0, 1.0, 0.5], [1.5, 1.6, 0.9], [3.0, 1.0, 0.5], [0.8, 0.8, 0.4]];
    let count = if std::env::var_os("PERCUSS_FULL").is_some() { coatings.len() } else { 2 };
    coatings[..count].par_iter().for_each(|[impedance, c_p, c_s]| {
        let dr = f64::max(*c_p, 1.0);
        let layers = [[*impedance, *c_p, *c_s, 2.0 * c_p], [1.0, 1.0, 0.5, f64::INFINITY]];
        let stack = stack(&layers, Back::Rigid);
        let k = 2.0 * PI / (NODES * dr);
        let expected = phase_speed(&stack, k).expect("a wave");
        let error = measured(&stack, dr, k) / expected - 1.0;
        assert!(error.abs() < 0.01, "c_p = {c_p}: {error:e} of {expected}");
    });
}
