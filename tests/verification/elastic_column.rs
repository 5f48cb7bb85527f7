//! One-dimensional limit of the full theory: under a wide flat punch, and out of reach of its edge, every column is by itself.
//!
//! ```text
//! p(r, t) = V0·[1 + 2·(number of reflections so far)]      fronts at t = 2mh
//! ```

use super::{case, run};

#[test]
fn reflections_are_sharp_at_every_node() {
    for geometry in ["axisymmetric", "plane"] {
        for (c_s, damping) in [(0.3, "0.0"), (0.5, "0.5"), (0.8, "0.8")] {
            for contact in ["unilateral", "prescribed"] {
                let overrides = [
                    "model=elastic".to_owned(),
                    format!("geometry={geometry}"),
                    format!("impact.contact={contact}"),
                    format!("target.shear_wave_speed={c_s}"),
                    format!("mesh.damping={damping}"),
                    "impact.velocity=0.4".to_owned(),
                    "indenter.radius=7.0".to_owned(),
                    "target.thickness=0.5".to_owned(),
                    "mesh.cells=140".to_owned(),
                    "run.end_time=6.0".to_owned(),
                    "record.frames=0".to_owned(),
                ];
                let case = case("fig5", &overrides.each_ref().map(String::as_str));
                let (rows, grid) = (case.sizes.nz as u64, case.grid());
                let mut worst: f64 = 0.0;
                for (step, time, pressure) in
                    run(&case, |view| (view.step, view.time, view.interface.pressure.to_vec()))
                {
                    // lateral damping reaches four columns per step, the rest one
                    let reach = time * if damping == "0.0" { 1.0 } else { 4.0 } + 4.0 * grid.dr;
                    let fronts = (step / (2 * rows)) as f64;
                    let expected = match step {
                        0 => 0.5,
                        step if step.is_multiple_of(2 * rows) => 2.0 * fronts,
                        _ => 1.0 + 2.0 * fronts,
                    };
                    for (_, p) in pressure.iter().enumerate().filter(|(i, _)| grid.r(*i) < 7.0 - reach) {
                        worst = worst.max((p - 0.4 * expected).abs());
                    }
                }
                // rounding, measured 2e-14 to 6e-14
                assert!(worst < 1e-11, "{geometry}, c_s = {c_s}, σ = {damping}, {contact}: {worst:e}");
            }
        }
    }
}
