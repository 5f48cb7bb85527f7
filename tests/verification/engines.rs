//! The fast engine against the plain stepper in whole runs: contact, indenter, events, energies, frames.
//!
//! Both leave the same nodes at rest, and runs are the same bit by bit. Energies are summed in another order.

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

/// Compares the runs of both engines.
fn compare(case: &Case) {
    let [fast, plain] = [Engine::Blocked, Engine::Reference].map(|engine| views(case, engine));
    assert_eq!(fast.len(), plain.len());
    for (a, b) in fast.iter().zip(&plain) {
        assert_eq!((a.step, a.time, &a.events), (b.step, b.time, &b.events));
        assert_eq!(numbers(a), numbers(b), "step {}", a.step);
        assert_eq!(a.frame.is_some(), b.frame.is_some(), "step {}", a.step);
        if let (Some(a), Some(b)) = (&a.frame, &b.frame) {
            let scale = b.energy.kinetic + b.energy.strain + b.energy.indenter;
            let pairs = [(a.energy.kinetic, b.energy.kinetic), (a.energy.strain, b.energy.strain)];
            assert!(pairs.iter().all(|(a, b)| (a - b).abs() <= 1e-12 * scale), "{pairs:?}");
            for field in [Field::Displacement, Field::Velocity, Field::Stress] {
                let [a, b] = [a, b].map(|frame| frame.fields.sample(field).expect("a recorded field"));
                assert_eq!(a.extent, b.extent);
                // of the precursor ahead of waves the engine shows no more than has been reached
                let same = |(a, b): (&f32, &f32)| a == b || (a - b).abs() <= 1e-14;
                assert!(a.values.iter().zip(&b.values).all(same), "{field:?}");
            }
        }
    }
}

const FIELDS: &str = "record.fields=[\"displacement\", \"velocity\", \"stress\"]";

#[test]
fn both_engines_give_the_same_bits() {
    let second = ["mesh.order=2", "mesh.damping=0.0"];
    for (name, more) in [
        ("fig5", &["indenter.mass=2.0", second[0], second[1]][..]),
        ("fig2", &second),
        ("fig8-m2.5", &["impact.contact=bilateral", second[0], second[1]]),
        ("fig6a", &["geometry=plane", second[0], second[1]]),
        ("fig5", &["mesh.kind=paper", "mesh.outer_radius=4"]),
        ("fig5", &["indenter.mass=2.0"]),
        ("fig8-m2.5", &["impact.contact=bilateral", "mesh.damping=0.0"]),
        ("fig6a", &["geometry=plane"]),
        ("fig2-prescribed", &["target.shear_wave_speed=0.37"]),
        ("fig7b", &["target.thickness=0.9", "record.field_every=3"]),
        ("elastic-fig5", &["run.end_time=2.0"]),
    ] {
        let case = case(name, &[&["mesh.cells=40", "record.frames=20", FIELDS][..], more].concat());
        compare(&case);
    }
}
