//! Runs that are saved and restored, at every sixteenth and with other numbers of threads, against uninterrupted runs.

use rayon::ThreadPool;

use super::*;
use crate::{
    case::Case,
    simulation::{Engine, Steps},
    view::{Energy, View},
};

/// Parts of a run after each of which it is saved.
const PARTS: u64 = 16;

/// Points at nodes and between them, lines along both axes, frames and fields on some nodes: all that waits for the interior.
const GAUGES: [&str; 3] = [
    "record.points=[[0.3, 0.4], [0.0, 0.1], [1.1, 0.0]]",
    "record.lines=[{ r = 0.25 }, { z = 0.3 }]",
    "record.frames=11",
];

/// All that a view shows, bit by bit, and its events.
#[derive(Debug, PartialEq)]
struct Seen {
    step: u64,
    numbers: Vec<u64>,
    events: String,
}

impl Seen {
    fn new(view: &View<'_>) -> Self {
        let View { time, drag, contact_radius, velocity, depth, .. } = *view;
        let mut numbers = vec![time, drag, contact_radius, velocity, depth];
        numbers.extend(view.interface.pressure.iter());
        numbers.extend(view.striker.iter().flat_map(|striker| [striker.nose, striker.rear]));
        if let Some(frame) = &view.frame {
            let Energy { kinetic, strain, indenter, striker, dissipated, damped, work, residual } =
                frame.energy;
            numbers.extend([kinetic, strain, indenter, dissipated, damped, work]);
            numbers.extend(striker.iter().flat_map(|striker| [striker.kinetic, striker.strain]));
            numbers.extend(residual);
            numbers.extend(&frame.fields.surface);
            let samples = frame.fields.samples.iter();
            numbers.extend(samples.flat_map(|sample| sample.values.iter().map(|value| f64::from(*value))));
        }
        if let Some(gauges) = &view.gauges {
            let points = gauges.points.iter();
            numbers.extend(points.flat_map(|point| [point.displacement, point.velocity, point.stress]));
            numbers.extend(gauges.lines.iter().flatten());
        }
        Self {
            step: view.step,
            numbers: numbers.into_iter().map(f64::to_bits).collect(),
            events: format!("{:?} {}", view.events, view.interface.complete),
        }
    }
}

fn pool(threads: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
}

/// Takes steps until the run ends or `pause` have been returned; then those that are already computed, too.
fn show(simulation: &mut Simulation, threads: &ThreadPool, pause: u64, seen: &mut Vec<Seen>) {
    while let Some(view) = threads.install(|| simulation.step()).expect("a sound case") {
        seen.push(Seen::new(&view));
        if view.step + 1 >= pause {
            simulation.interrupt();
        }
    }
}

fn saved(simulation: &mut Simulation) -> Vec<u8> {
    let mut bytes = Vec::new();
    simulation.save(&mut StateWriter::new(&mut bytes)).expect("memory");
    bytes
}

/// How a run continues after it has been saved.
#[derive(Clone, Copy, PartialEq)]
enum Then {
    /// As if nothing had been.
    Proceed,
    /// From the state, in place of the beginning.
    Load,
}

/// Compares runs of a case with one that is not interrupted.
fn compare(case: &Case, engine: Engine, then: Then) {
    let pools = [1, 2, 3].map(pool);
    let mut expected = Vec::new();
    let mut simulation = Simulation::with_engine(case, engine);
    show(&mut simulation, &pools[0], u64::MAX, &mut expected);
    let validity = simulation.validity();
    assert!(
        simulation.ending().is_some() && expected.len() > 2 * PARTS as usize,
        "{}: {} steps",
        case.title,
        expected.len()
    );

    let mut seen = Vec::new();
    let mut simulation = Simulation::with_engine(case, engine);
    for part in 1..=PARTS {
        let pause = (part * expected.len() as u64 / PARTS).max(seen.len() as u64 + 1);
        show(&mut simulation, &pools[part as usize % 3], pause, &mut seen);
        if simulation.ending().is_some() {
            break;
        }
        assert!(simulation.drained().is_some());
        let state = saved(&mut simulation);
        if then == Then::Load {
            simulation = Simulation::with_engine(case, engine);
            simulation.load(&mut StateReader::new(&mut &state[..])).expect("the state of this case");
            // nothing of it is lost, nothing is added
            assert!(saved(&mut simulation) == state, "{}, step {}", case.title, seen.len());
        }
        simulation.resume();
    }
    show(&mut simulation, &pools[0], u64::MAX, &mut seen);
    assert_eq!(expected.len(), seen.len(), "{}", case.title);
    for (expected, seen) in expected.iter().zip(&seen) {
        assert!(expected == seen, "{}, {engine:?}, step {}", case.title, expected.step);
    }
    assert_eq!(validity, simulation.validity(), "{}", case.title);
}

fn compare_all(cases: &[(&str, &[&str])]) {
    for (name, settings) in cases {
        for gauges in [&GAUGES[..], &["record.frames=0"]] {
            let case = Case::sound(name, &[settings, gauges].concat());
            compare(&case, Engine::Blocked, Then::Load);
        }
    }
}

#[test]
fn a_run_of_the_simplified_theory_goes_on_bit_for_bit() {
    compare_all(&[
        ("fig5", &["mesh.cells=80", "run.end_time=3"]),
        ("fig5-plane", &["mesh.cells=30", "mesh.order=2", "mesh.damping=0.0", "indenter.edge_radius=0.2"]),
        ("fig3", &["mesh.cells=40", "mesh.order=2", "indenter.mass=1.0", "target.thickness=half-space"]),
        ("fig6a", &["mesh.cells=50", "run.end_time=5"]),
        ("fig7a", &["mesh.cells=30", "impact.contact=unilateral", "indenter.mass=0.7"]),
        // a punch that rebounds, separates and falls back, glued and not
        ("fig5", &["mesh.cells=24", "indenter.mass=0.5", "run.end_time=8"]),
        ("fig8-m2.5", &["mesh.cells=24", "impact.contact=bilateral", "run.end_time=8"]),
        ("fig5", &["mesh.kind=paper", "mesh.cells=40", "run.stop=extension"]),
    ]);
}

#[test]
fn a_run_of_the_full_theory_goes_on_bit_for_bit() {
    compare_all(&[
        ("elastic-fig5", &["mesh.cells=40", "run.end_time=2"]),
        ("elastic-fig5-plane", &["mesh.cells=24", "mesh.damping=0.0", "run.end_time=4"]),
        (
            "elastic-fig3",
            &["mesh.cells=20", "indenter.mass=1.0", "target.thickness=half-space", "run.end_time=3"],
        ),
        ("elastic-fig6a", &["mesh.cells=24", "run.end_time=5"]),
        ("elastic-fig2-prescribed", &["mesh.cells=24", "run.end_time=6"]),
        ("elastic-fig8-m2.5", &["mesh.cells=16", "indenter.mass=0.5", "run.stop=never", "run.end_time=8"]),
        ("elastic-fig8-m5", &["mesh.cells=16", "impact.contact=bilateral", "run.stop=never"]),
        ("experiment-half-space", &["mesh.cells=16", "run.end_time=4"]),
    ]);
}

#[test]
fn a_physical_run_that_stops_by_itself_goes_on_bit_for_bit() {
    compare(&Case::sound("ball", &["mesh.cells=30"]), Engine::Blocked, Then::Load);
    compare(&Case::sound("laminate-glass", &["mesh.contact_cells=12"]), Engine::Blocked, Then::Load);
    let points = "record.points=[[\"0 mm\", \"-1 mm\"], [\"0 mm\", \"1 mm\"]]";
    let lines = "record.lines=[{ r = \"0 mm\" }, { z = \"-1 mm\" }]";
    let disc = Case::sound("disc", &["mesh.contact_cells=8", "run.end_time=\"12 us\"", points, lines]);
    compare(&disc, Engine::Blocked, Then::Load);
    let layers = "indenter.body.layer=[{ thickness = \"2 mm\", material = \"aluminium\" }, { thickness = \"3 mm\", \
                  material = \"steel\", bond_strength = { normal = \"5 MPa\", shear = \"2 MPa\" } }]";
    let short = [
        "mesh.contact_cells=16",
        "target.thickness=\"4 mm\"",
        "run.end_time=\"8 us\"",
        "record.points=[]",
        "record.lines=[]",
        layers,
    ];
    compare(&Case::sound("bar", &short), Engine::Blocked, Then::Load);
}

#[test]
fn a_run_that_is_written_down_is_the_same_run() {
    for name in ["fig3", "elastic-fig5"] {
        let case = Case::sound(name, &[&["mesh.cells=40", "run.end_time=2"], &GAUGES[..]].concat());
        compare(&case, Engine::Blocked, Then::Proceed);
    }
}

#[test]
fn the_plain_stepper_goes_on_bit_for_bit() {
    for (name, cells) in [("fig3", "mesh.cells=14"), ("elastic-fig5", "mesh.cells=12")] {
        let case = Case::sound(name, &[&[cells, "run.end_time=6"], &GAUGES[..]].concat());
        compare(&case, Engine::Reference, Then::Load);
    }
}

/// The state of a case in the middle of its run.
fn middle(case: &Case) -> Vec<u8> {
    let mut simulation = Simulation::new(case);
    show(&mut simulation, &pool(1), case.sizes.steps / 2, &mut Vec::new());
    saved(&mut simulation)
}

#[test]
fn states_of_other_cases_are_refused() {
    let here = Case::sound("fig5", &["mesh.cells=12", "run.end_time=2"]);
    for (name, settings) in [
        ("fig5", &["mesh.cells=13", "run.end_time=2"][..]),
        ("fig5", &["mesh.cells=12", "run.end_time=2", "mesh.outer_radius=4.5"]),
        ("fig5", &["mesh.cells=12", "run.end_time=12"]),
        ("elastic-fig5", &["mesh.cells=12", "run.end_time=2"]),
        ("fig5", &["mesh.cells=12", "run.end_time=2", "indenter.radius=0.5"]),
    ] {
        let state = middle(&Case::sound(name, settings));
        let error = Simulation::new(&here).load(&mut StateReader::new(&mut &state[..]));
        assert!(error.is_err(), "{name} {settings:?}");
    }
}

#[test]
fn damaged_states_are_refused_or_taken_up_without_panic() {
    let case = Case::sound("fig3", &["mesh.cells=8", "run.end_time=2", "mesh.outer_radius=2"]);
    let state = middle(&case);
    for length in (0..state.len()).step_by(1 + state.len() / 300) {
        let error = Simulation::new(&case).load(&mut StateReader::new(&mut &state[..length]));
        assert!(error.is_err(), "{length} of {} bytes", state.len());
    }
    let longer = [&state[..], &[0]].concat();
    assert!(Simulation::new(&case).load(&mut StateReader::new(&mut &longer[..])).is_err());
    for place in (0..state.len()).step_by(1 + state.len() / 600) {
        for flipped in [0x01, 0x80, 0xff] {
            let mut state = state.clone();
            state[place] ^= flipped;
            let mut simulation = Simulation::new(&case);
            if simulation.load(&mut StateReader::new(&mut &state[..])).is_ok() {
                // numbers may be wrong, which the checksum of the file is for
                while let Ok(Some(_)) = simulation.step() {}
            }
        }
    }
}
