//! Flat punch at constant velocity on a target of the full theory: at long times the drag grows as fast as the static stiffness says.
//!
//! ```text
//! half-space:          dF/dw = (8/π)·β²(1 − β²)              force per πR²γc_p²
//! layer, smooth base:  A_d(h), the disc problem with (cosh 2ξh − 1)/(sinh 2ξh + 2ξh) in its kernel
//! ```

use std::f64::consts::PI;

use rayon::prelude::*;

use super::{on_mesh, run, slope};

/// Slope of the drag of a punch at velocity 1, relative to the static one, minus 1.
fn error(c_s: f64, layer: Option<f64>, cells: usize) -> f64 {
    let (name, from, to) = if layer.is_some() { ("fig5", 33.0, 44.0) } else { ("fig4", 8.0, 16.0) };
    let overrides = [
        "model=elastic".to_owned(),
        "impact.contact=bilateral".to_owned(),
        format!("target.shear_wave_speed={c_s}"),
        format!("run.end_time={to}"),
    ];
    let case = on_mesh(name, cells, &overrides);
    let rows = run(&case, |view| (view.time, view.drag));
    let late: Vec<(f64, f64)> = rows.into_iter().filter(|row| row.0 > from).collect();
    let expected = layer.unwrap_or(8.0 / PI * c_s * c_s * (1.0 - c_s * c_s));
    slope(&late) / expected - 1.0
}

#[test]
fn slopes_of_the_drag_are_static_stiffnesses() {
    // c_s/c_p, A_d of a layer of thickness 1, cells. Measured with the default damping 4.5e-4, 3.7e-4;
    // 9.7e-4, 7.7e-4.
    let cases = [(0.3, None, 16), (0.5, None, 16), (0.3, Some(0.458537), 24), (0.5, Some(1.049764), 16)];
    cases.into_par_iter().for_each(|(c_s, layer, cells)| {
        let error = error(c_s, layer, cells);
        assert!(error.abs() <= 1e-3, "c_s = {c_s}, layer {layer:?}: {error:e}");
    });
}
