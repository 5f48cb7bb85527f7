//! Separation of indenter and target: a node that opens for a step is none.

use percuss::{
    case::Case,
    view::{Event, EventKind},
};

use super::{case, run};

/// A slow sharp ball on a half-space: on a coarse mesh its contact begins as a single node, which opens every other step.
fn ball(cells: usize, stop: &str) -> Case {
    let stop = format!("run.stop={stop}");
    let cells = format!("mesh.cells={cells}");
    let ball = ["indenter.mass=10", "indenter.nose_radius=0.05", "impact.velocity=0.1", "run.end_time=60"];
    let target = ["target.thickness=\"half-space\"", "target.shear_wave_speed=0.55", "record.frames=0"];
    case("fig2", &[&ball[..], &target, &[&stop, &cells]].concat())
}

/// Events, with the times of their steps.
fn events(case: &Case) -> Vec<(f64, Event)> {
    let warns = |event: &&Event| !matches!(event.kind, EventKind::Warning(_));
    run(case, |view| {
        view.events.iter().filter(warns).map(|event| (view.time, event.clone())).collect::<Vec<_>>()
    })
    .concat()
}

#[test]
fn a_chattering_node_does_not_end_a_run() {
    let case = ball(10, "separation");
    let hold = case.sizes.dr / case.target.material.shear_wave_speed;
    let events = events(&case);
    let kinds: Vec<EventKind> = events.iter().map(|(_, event)| event.kind).collect();
    assert_eq!(kinds.iter().filter(|kind| **kind == EventKind::Separation).count(), 1, "{kinds:?}");
    assert_eq!(kinds.last(), Some(&EventKind::Stopped));
    let (seen, separation) = events
        .iter()
        .find(|(_, event)| event.kind == EventKind::Separation)
        .expect("the ball leaves the target");
    // the first node opens at t = 0.18, and the ball leaves after its rebound
    let since = separation.since.expect("a separation knows since when");
    assert!((30.0..35.0).contains(&since), "{since}");
    assert!(
        *seen >= since + hold * (1.0 - 1e-9) && *seen <= since + hold + 2.0 * case.sizes.dt,
        "{seen} {since}"
    );
}

#[test]
fn a_separation_is_not_followed_by_contact_at_once() {
    for cells in [3, 5, 10, 20] {
        let events = events(&ball(cells, "never"));
        let kinds: Vec<EventKind> = events.iter().map(|(_, event)| event.kind).collect();
        assert!(!kinds.contains(&EventKind::Recontact), "{cells} cells: {kinds:?}");
    }
}

#[test]
fn a_ball_on_its_way_in_is_not_apart() {
    // on a thin layer a node bounces for longer than Δr/c_s, at the rate of the echoes of the backing
    let ball = ["indenter.mass=10", "indenter.nose_radius=0.005", "impact.velocity=0.1", "run.end_time=60"];
    let target = ["target.thickness=0.2", "target.shear_wave_speed=0.55", "record.frames=0"];
    let case = case("fig2", &[&ball[..], &target, &["run.stop=separation", "mesh.cells=10"]].concat());
    let events = events(&case);
    let time = |kind| events.iter().find(|(_, event)| event.kind == kind).map(|(time, _)| *time);
    let (rebound, separation) = (time(EventKind::Rebound), time(EventKind::Separation));
    assert!(rebound.is_some() && separation > rebound, "{rebound:?} {separation:?}");
    assert!(separation.is_some_and(|time| (40.0..45.0).contains(&time)), "{separation:?}");
}
