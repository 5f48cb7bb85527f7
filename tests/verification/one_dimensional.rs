//! One-dimensional limits: before an edge wave arrives, the columns under a flat punch are independent.
//!
//! ```text
//! p(r, t) = V0·[1 + 2·(number of reflections so far)]      fronts at t = 2mh
//! ```

use super::{case, run};

#[test]
fn reflections_are_sharp() {
    // fronts arrive at t = 2mh; the edge wave at r = 0 at t = 1/c_s, and where the radial Courant number is not 1
    // its dispersed precursor somewhat earlier: stop at 0.8/c_s
    for (h, c_s) in [(1.0, 0.2), (0.5, 0.25), (0.7, 0.1)] {
        let overrides = [
            format!("run.end_time={}", 0.8 / c_s),
            "record.frames=0".to_owned(),
            "mesh.cells=60".to_owned(),
            "impact.velocity=0.4".to_owned(),
            format!("target.thickness={h:?}"),
            format!("target.shear_wave_speed={c_s}"),
        ];
        let case = case("fig5", &overrides.each_ref().map(String::as_str));
        let rows = case.sizes.nz as u64;
        for (step, p) in run(&case, |view| (view.step, view.interface.pressure[0])) {
            // half the jump at the step the front arrives, all of it one step later, nothing before or after
            let fronts = step / (2 * rows);
            let expected = if step == 0 {
                0.5
            } else if step.is_multiple_of(2 * rows) {
                2.0 * fronts as f64
            } else {
                1.0 + 2.0 * fronts as f64
            };
            // rounding only: sums of some hundred terms of size w/Δt
            assert!((p - 0.4 * expected).abs() < 1e-11, "h = {h}, step {step}: {p}");
        }
    }
}

#[test]
fn pressure_is_the_velocity_of_a_punch_of_finite_mass() {
    // half-space, before the edge wave: p(0, t) = V(t)
    let case = case("fig8-m2.5", &["run.end_time=1.8", "record.frames=0"]);
    for (step, p, velocity) in run(&case, |view| (view.step, view.interface.pressure[0], view.velocity)) {
        if step > 0 {
            assert!((p - velocity).abs() < 1e-12, "step {step}: p = {p}, V = {velocity}");
        }
    }
}
