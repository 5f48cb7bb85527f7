//! The fast engine against the plain stepper in whole runs: contact, indenter, events, energies, frames.
//!
//! The engine skips nodes outside the light cone, whose values are below 1e-20 of those inside; where λ = 1 and without the corner
//! term they are 0, and runs are the same bit by bit. Elsewhere a difference of one last bit grows to a hundred in some hundred steps. Energies are summed
//! in another order.

use percuss::{
    case::Case,
    model::Field,
    simulation::{Engine, Simulation},
    view::View,
};

use super::{case, observe};

/// All steps of a run.
fn views(case: &Case, engine: Engine) -> Vec<View<'static>> {
    observe(Simulation::with_engine(case, engine), |view| view.share())
}

/// Numbers of a step: the indenter's and the interface stress.
fn numbers(view: &View<'_>) -> Vec<f64> {
    let indenter = [view.drag, view.velocity, view.depth, view.contact_radius];
    indenter.into_iter().chain(view.interface.pressure.iter().copied()).collect()
}

/// Largest difference of the numbers of two runs, relative to the largest of them.
fn compare(case: &Case) -> f64 {
    let [fast, plain] = [Engine::Blocked, Engine::Reference].map(|engine| views(case, engine));
    assert_eq!(fast.len(), plain.len());
    let largest = plain.iter().flat_map(numbers).fold(0.0, |most: f64, number| most.max(number.abs()));
    let mut worst = 0.0;
    for (a, b) in fast.iter().zip(&plain) {
        assert_eq!((a.step, a.time, &a.events), (b.step, b.time, &b.events));
        assert_eq!(numbers(a).len(), numbers(b).len());
        for (a, b) in numbers(a).into_iter().zip(numbers(b)) {
            worst = f64::max(worst, (a - b).abs() / largest);
        }
        assert_eq!(a.frame.is_some(), b.frame.is_some(), "step {}", a.step);
        if let (Some(a), Some(b)) = (&a.frame, &b.frame) {
            let scale = b.energy.kinetic + b.energy.strain + b.energy.indenter;
            let pairs = [(a.energy.kinetic, b.energy.kinetic), (a.energy.strain, b.energy.strain)];
            assert!(pairs.iter().all(|(a, b)| (a - b).abs() <= 1e-12 * scale), "{pairs:?}");
            for field in [Field::Displacement, Field::Velocity, Field::Stress] {
                let [a, b] = [a, b].map(|frame| frame.fields.sample(field).expect("a recorded field"));
                assert_eq!(a.extent, b.extent);
                // single precision, and the precursor ahead of waves
                let near = |(a, b): (&f32, &f32)| (a - b).abs() <= 2e-7 * b.abs() + 1e-14;
                assert!(a.values.iter().zip(&b.values).all(near), "{field:?}");
            }
        }
    }
    worst
}

const FIELDS: &str = "record.fields=[\"displacement\", \"velocity\", \"stress\"]";

#[test]
fn runs_without_dispersion_are_the_same_bits() {
    for (name, more) in [
        ("fig5", &["indenter.mass=2.0"][..]),
        ("fig2", &[]),
        ("fig8-m2.5", &["impact.contact=bilateral"]),
        ("fig6a", &["geometry=plane"]),
    ] {
        let scheme = ["mesh.order=2", "mesh.damping=0.0"];
        let case = case(name, &[&["mesh.cells=40", "record.frames=20", FIELDS], &scheme[..], more].concat());
        assert_eq!(compare(&case), 0.0, "{name}");
    }
}

#[test]
fn runs_with_dispersion_are_the_same_but_for_rounding() {
    for (name, more) in [
        ("fig5", &["mesh.kind=paper", "mesh.outer_radius=4"][..]),
        ("fig5", &["indenter.mass=2.0"]),
        ("fig8-m2.5", &["impact.contact=bilateral", "mesh.damping=0.0"]),
        ("fig6a", &["geometry=plane"]),
        ("fig2-prescribed", &["target.shear_wave_speed=0.37"]),
        ("fig7b", &["target.thickness=0.9", "record.field_every=3"]),
    ] {
        let case = case(name, &[&["mesh.cells=40", "record.frames=20", FIELDS][..], more].concat());
        let worst = compare(&case);
        assert!(worst < 1e-12, "{name}: {worst:e}");
    }
}
