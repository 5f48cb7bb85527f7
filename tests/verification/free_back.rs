//! Plates with a free back, struck and left to themselves for long: nothing drifts, and what happens is what happens on finer meshes.
//!
//! With the last row of nodes on the face (numerics 1 and 2) the rows of even and of odd j + k moved apart, kicked by contact that opens and
//! closes: kinetic energy 292, 1210, 6929 and 13, 25, 36 events on 25, 50, 100 cells where 1.5 came in.

use percuss::{
    case::Case,
    view::{EventKind, View},
};
use rayon::prelude::*;

use super::{case, energy_and_momentum::energies, run};

/// Number of separations and later contacts, and the last velocity.
fn story(case: &Case) -> (usize, f64) {
    let steps = run(case, |view: &View<'_>| {
        let is_contact = |kind| matches!(kind, EventKind::Separation | EventKind::Recontact);
        (view.events.iter().filter(|event| is_contact(event.kind)).count(), view.velocity)
    });
    (steps.iter().map(|step| step.0).sum(), steps.last().expect("steps").1)
}

#[test]
fn contact_with_a_free_plate_converges() {
    let thin = ["mesh.damping=1.0", "target.thickness=0.5", "indenter.mass=3.0", "run.end_time=30.0"];
    let seen: Vec<_> = [25, 50, 100]
        .into_par_iter()
        .map(|cells| {
            let cells = format!("mesh.cells={cells}");
            let settings = ["target.back=free", "impact.contact=unilateral", "record.frames=60", &cells];
            let case = case("fig5", &[&thin[..], &settings].concat());
            let most = energies(&case).0.iter().map(|energy| energy.kinetic).fold(0.0, f64::max);
            let (events, velocity) = story(&case);
            (events, velocity, most)
        })
        .collect();
    // measured 7, 9, 11 events, and 7 on 200 cells: the surface touches the punch for moments, of which a mesh has one more or less; velocities
    // -0.2647, -0.2698, -0.2737, and -0.2756 on 200 cells
    assert!(seen.iter().all(|(events, _, most)| (7..=11).contains(events) && *most < 1.5), "{seen:?}");
    let [coarse, middle, fine] = [0, 1, 2].map(|number: usize| seen[number].1);
    assert!((coarse - middle).abs() < 0.006 && (middle - fine).abs() < (coarse - middle).abs(), "{seen:?}");
    assert!((fine + 0.2756).abs() < 0.003, "{seen:?}");
}

#[test]
fn free_plates_never_have_more_energy_than_was_brought_in() {
    let mut state = 11u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let mut plates = Vec::new();
    for number in 0..100 {
        let model = ["rakhmatulin", "elastic"][number % 2];
        let geometry = ["axisymmetric", "plane"][number / 2 % 2];
        let layers = match number / 4 % 3 {
            0 => format!(
                "{{ thickness = {:.4}, shear_wave_speed = 0.4 }}, {{ thickness = {:.4}, density = {:.3}, wave_speed = {:.3}, shear_wave_speed = 0.5 }}",
                0.3 + unit(),
                0.3 + unit(),
                0.3 + 2.0 * unit(),
                0.8 + unit()
            ),
            _ => format!(
                "{{ thickness = {:.4}, shear_wave_speed = {:.3} }}",
                0.25 + unit(),
                0.2 + 0.4 * unit()
            ),
        };
        let head = match number / 3 % 3 {
            0 => "shape = \"flat\"\nradius = 1.0",
            1 => "shape = \"sphere\"\nnose_radius = 1.0",
            _ => "shape = \"flat\"\nradius = 1.0\nedge_radius = 0.3",
        };
        let damping = ["", "damping = 0.0\n"][number / 5 % 2];
        plates.push(format!(
            "model = \"{model}\"\ngeometry = \"{geometry}\"\n[target]\nback = \"free\"\nlayer = [{layers}]\n[indenter]\n{head}\n\
             mass = {:.3}\n[impact]\nvelocity = {:.4}\n[mesh]\nouter_radius = 2.5\n{damping}[run]\nend_time = 150.0\n\
             [record]\nframes = 300\n",
            0.1 + 3.0 * unit(),
            0.01 + 0.05 * unit()
        ));
    }
    plates.par_iter().for_each(|text| {
        // the first mesh on which waves cross two layers in whole steps
        let on_mesh =
            |cells: usize| Case::parse("plate", text, &[format!("mesh.cells={cells}")], "".as_ref()).ok();
        let case = (14..100).find_map(on_mesh).unwrap_or_else(|| panic!("{text}"));
        let initial = 0.5 * case.indenter.mass * case.impact.velocity.powi(2);
        for energy in energies(&case).0 {
            let total = energy.kinetic + energy.strain + energy.indenter;
            assert!(total < initial * (1.0 + 1e-9), "{text}\n{energy:?} of {initial:e}");
            // the strain energy of waves of few nodes is less than 0, the product of two levels, and their kinetic energy above the sum
            assert!(energy.kinetic < 1.5 * initial, "{text}\n{energy:?} of {initial:e}");
        }
    });
}
