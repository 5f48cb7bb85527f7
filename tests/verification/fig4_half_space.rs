//! \[KA\] Fig. 4: axisymmetric flat punch on a half-space, infinite mass, c_s = 0.5.
//!
//! Reference: drag of an independent prototype of the scheme. Goal: the same to its printed digits.

use super::{at, case, run};

#[test]
fn drag_at_four_times() {
    let case = case("fig4", &["mesh.cells=100", "record.frames=0"]);
    let drag = run(&case, |view| (view.time, view.drag));
    for (t, expected) in [(0.25, 1.12691), (0.5, 1.25750), (1.0, 1.52879), (1.5, 1.81218)] {
        // the reference has six digits and the times lie between steps, where F is interpolated: 5e-5
        let got = at(&drag, t);
        assert!((got - expected).abs() <= 5e-5, "F({t}) = {got}, expected {expected}");
    }
}

#[test]
fn depth_slices_are_recorded_with_the_sign_of_the_interface() {
    let case = case("fig4", &["mesh.cells=50"]);
    let grid = case.grid();
    let slices = run(&case, |view| {
        let mut values = Vec::new();
        let frame = view.frame.expect("every step is a frame");
        let extent = frame.fields.sample(percuss::model::Field::Stress, &mut values);
        // row 0 is the interface; before any edge wave comes, stress under the middle is V0 behind the front z = t
        let middle: Vec<f32> = (0..extent.nz).map(|j| values[j * extent.nr]).collect();
        (view.time, view.interface.pressure[0], middle)
    });
    for (time, pressure, middle) in slices.into_iter().skip(1).filter(|row| row.0 < 1.8) {
        assert_eq!(middle[0], pressure as f32);
        for (j, &value) in middle.iter().enumerate() {
            let z = j as f64 * grid.dz;
            let expected = match ((z - time) / grid.dz).round() as i64 {
                i64::MIN..=-1 => 1.0,
                0 => 0.5,
                _ => 0.0,
            };
            assert!((f64::from(value) - expected).abs() < 1e-6, "t = {time}, z = {z}: {value}");
        }
    }
}

#[test]
fn what_cannot_be_seen_is_not_missed() {
    // without frames a half-space is computed only as deep as the surface can still hear of; nothing changes there
    let outer = "mesh.outer_radius=4";
    for name in ["fig4", "fig6a", "fig8-m2.5", "fig9-m1"] {
        let look = |case| run(&case, |view| (view.drag.to_bits(), view.velocity.to_bits()));
        let whole = case(name, &["mesh.cells=30", "run.end_time=1.5", outer]);
        let part = case(name, &["mesh.cells=30", "run.end_time=1.5", outer, "record.frames=0"]);
        assert!(part.sizes.nz < whole.sizes.nz, "{name}");
        assert_eq!(look(whole), look(part), "{name}");
    }
}
