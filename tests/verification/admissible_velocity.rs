//! Closing estimate of \[KA\]: the impact velocity that keeps the strain within 0.005. A run at the velocity found keeps it,
//! for any head.

use percuss::{
    advice::admissible::{CLOSE, Limit, Trial, find},
    session,
    simulation::Simulation,
    validity::STRAIN_LIMIT,
};

use super::case;

/// The velocity found for a built-in case, and the number of trials.
fn search(name: &str, overrides: &[&str]) -> (Trial, usize) {
    let mut trials = 0;
    let found = find(&case(name, overrides), Limit::Strain, |_| trials += 1)
        .unwrap_or_else(|error| panic!("{error}"));
    (found, trials)
}

/// Largest strain of a run, relative to the limit, and the admissible velocity of its validity.
fn strain(name: &str, overrides: &[&str]) -> (f64, Option<f64>) {
    let mut simulation = Simulation::new(&case(name, overrides));
    let validity = session::run(&mut simulation, &mut []).expect("finite numbers").validity;
    (validity.strain.value / STRAIN_LIMIT, validity.admissible_velocity())
}

#[test]
fn a_run_at_the_velocity_found_keeps_the_limit() {
    // f = r²/7 and f = r/1000; velocity of the case, cells
    for (name, head, given, cells) in
        [("fig2", "indenter.nose_radius=3.5", 1.0, 400), ("fig6a", "indenter.slope=0.001", 0.02, 100)]
    {
        let cells = format!("mesh.cells={cells}");
        let shared = ["record.frames=0", &cells, "impact.contact=unilateral", "run.end_time=0.5", head];
        let setting = |velocity: f64| format!("impact.velocity={velocity:?}");
        let at = |velocity: f64| strain(name, &[&shared[..], &[&setting(velocity)]].concat());
        let (found, trials) = search(name, &[&shared[..], &[&setting(given)]].concat());
        let (share, scaled) = at(found.velocity);
        println!("{name}: V0 = {:e}, {trials} trials, strain {share} of the limit", found.velocity);
        assert!((CLOSE..=1.0).contains(&share), "{name}: {share}");
        assert!(trials <= 12 && scaled.is_none(), "{name}: {trials}");
        // scaling the run of the case gives an inadmissible velocity
        let wrong = given / at(given).0;
        println!("{name}: scaled V0 = {wrong:e}, strain {} of the limit", at(wrong).0);
        assert!(at(wrong).0 > 1.2, "{name}: {}", at(wrong).0);
    }
}

#[test]
fn flat_faces_scale() {
    for mass in ["inf", "2.5"] {
        let shared = ["record.frames=0", "mesh.cells=50", &format!("indenter.mass={mass}")];
        let (found, trials) = search("fig5", &shared);
        let velocity = format!("impact.velocity={:?}", found.velocity);
        let (share, scaled) = strain("fig5", &[&shared[..], &[&velocity]].concat());
        assert!((share - 1.0).abs() < 1e-9 && trials == 1, "{mass}: {share}");
        assert!((scaled.expect("it scales") / found.velocity - 1.0).abs() < 1e-9);
    }
}

#[test]
fn a_head_too_sharp_for_any_velocity_is_reported() {
    // a cone slower than the waves strains the target in proportion to its slope
    let overrides = ["record.frames=0", "mesh.cells=20", "impact.contact=unilateral", "indenter.slope=20"];
    let error = find(&case("fig6a", &overrides), Limit::Strain, |_| ()).expect_err("too sharp").to_string();
    assert!(error.contains("no impact velocity") && error.contains("mesh.cells"), "{error}");
}
