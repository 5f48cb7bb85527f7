//! One-dimensional limits of both theories: before an edge wave arrives, the columns under a flat punch are independent.
//!
//! ```text
//! p(r, t) = V0·[1 + 2·(number of reflections so far)]      fronts at t = 2mh
//! ```

use super::{case, points::arrivals, run};
use crate::closed_forms::column::Column;

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
        let case = case("fig5", &overrides);
        let there_and_back = 2 * case.sizes.nz as u64;
        for (step, p) in run(&case, |view| (view.step, view.interface.pressure[0])) {
            let [expected, ..] = arrivals(step, 0, there_and_back, 1);
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

#[test]
fn a_body_of_finite_mass_on_a_column_moves_as_in_closed_form() {
    // nearly no shear waves: what the edge adds to the drag is c_s·t/2 of it
    let error = |mass: f64, h: f64, cells: usize| {
        let overrides = [
            "target.shear_wave_speed=1e-4".to_owned(),
            "mesh.kind=paper".to_owned(),
            format!("target.thickness={h:?}"),
            format!("indenter.mass={mass:?}"),
            format!("mesh.cells={cells}"),
            "run.end_time=3.0".to_owned(),
            "record.frames=0".to_owned(),
        ];
        let column = Column::new(1.0, mass, h);
        // steps without a front: there it is the mean of before and after
        let between = |time: &f64| (0.5 * time / h).fract() * 2.0 * h > 1.5 / cells as f64;
        let views =
            run(&case("fig5", &overrides), |view| (view.time, view.velocity, view.interface.pressure[0]));
        let apart = views.iter().position(|(time, _, p)| *time > 0.0 && *p <= 0.0).unwrap_or(views.len());
        let seen = views[..apart].iter().filter(|(time, ..)| *time > 0.0 && between(time));
        let errors = seen.map(|&(time, velocity, p)| {
            (velocity - column.body_velocity(time)).abs().max((p - column.pressure(time)).abs())
        });
        let errors: Vec<f64> = errors.collect();
        assert!(errors.len() > cells / 2, "{} steps", errors.len());
        errors.into_iter().fold(0.0, f64::max)
    };
    // of first order: a front arrives between two steps. Measured for M = 2, 0.047 and 0.024 on 50 and 100 cells
    for (mass, h) in [(2.0, 0.5), (5.0, 1.0), (0.5, 2.0)] {
        let [coarse, fine] = [50, 100].map(|cells| error(mass, h, cells));
        assert!(fine < 0.03 && fine < 0.6 * coarse, "M = {mass}, h = {h}: {coarse:e} {fine:e}");
    }
}

#[test]
fn reflections_of_the_full_theory_are_sharp_at_every_node() {
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
                let case = case("fig5", &overrides);
                let (there_and_back, grid) = (2 * case.sizes.nz as u64, case.grid());
                let mut worst: f64 = 0.0;
                for (step, time, pressure) in
                    run(&case, |view| (view.step, view.time, view.interface.pressure.to_vec()))
                {
                    // lateral damping reaches four columns per step, the rest one
                    let reach = time * if damping == "0.0" { 1.0 } else { 4.0 } + 4.0 * grid.dr;
                    let [expected, ..] = arrivals(step, 0, there_and_back, 1);
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
