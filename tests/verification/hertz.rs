//! Contact radius of a ball on a half-space against Hertz, `a³ = 3Fρ/(4E*)` with `E* = E/(1 − ν²)` of the target under a rigid ball.
//!
//! ```text
//!   \  F  /      slow: the contact is quasi-static
//!    `-_-´
//!  ───│a│─── PMMA
//! ```

use percuss::case::Case;

use super::run;

const BALL: &str = "model = \"elastic\"\n[target]\nthickness = \"half-space\"\nmaterial = \"pmma\"\n[indenter]\n\
    shape = \"sphere\"\nnose_radius = \"3 mm\"\nmaterial = \"steel\"\n[impact]\nvelocity = \"2 m/s\"\n\
    [run]\nend_time = \"30 us\"\n[record]\nframes = 0\nprobes = []\n";

#[test]
fn the_contact_radius_is_that_of_hertz() {
    for (cells, least, most) in [(25, -0.01, 0.10), (50, 0.0, 0.03)] {
        let case = Case::parse("ball", BALL, &[format!("mesh.cells={cells}")], "".as_ref());
        let case = case.unwrap_or_else(|errors| panic!("{errors:?}"));
        // (πF)ρ/E* in units of R = ρ and γc_p²; µ = c_s², λ = 1 − 2µ, E* = 4µ(λ + µ)/(λ + 2µ)
        let shear = case.target.material.shear_wave_speed.powi(2);
        let modulus = 4.0 * shear * (1.0 - shear);
        let hertz = |drag: f64| (0.75 * std::f64::consts::PI * drag / modulus).cbrt();
        let seen = run(&case, |view| (view.drag, view.contact_radius));
        let peak = seen.iter().map(|(drag, _)| *drag).fold(0.0, f64::max);
        for (drag, radius) in seen.into_iter().filter(|(drag, _)| *drag > 0.2 * peak) {
            let error = radius / hertz(drag) - 1.0;
            assert!((least..most).contains(&error), "{cells} cells, F = {drag}: {error}");
        }
    }
}
