//! \[KA\] Fig. 8: flat punch of finite mass on a half-space, c_s = 0.5.
//!
//! Reference: an independent prototype. t_ext = 5.14, 7.76, 11.38 and V = 0 at 2.66, 3.92, 5.70 for M = 2.5, 5, 10. (The
//! paper's t_ext = 3.03, 4.96, 9.36 do not follow from its equations.)

use percuss::{
    contact::event::EventKind,
    simulation::{Ending, Simulation},
};

use super::{case, run};

/// The step of a mesh of 100 cells is 0.02: an event is seen at most one step late.
const TOLERANCE: f64 = 0.03;

#[test]
fn rebound_and_extension() {
    for (name, rebound, extension) in
        [("fig8-m2.5", 2.66, 5.14), ("fig8-m5", 3.92, 7.76), ("fig8-m10", 5.70, 11.38)]
    {
        for contact in ["unilateral", "bilateral"] {
            let rule = format!("impact.contact={contact}");
            let case = case(name, &["mesh.cells=100", "record.frames=0", &rule]);
            let events: Vec<_> = run(&case, |view| {
                view.events.iter().map(|event| (event.kind, view.time, event.r)).collect::<Vec<_>>()
            })
            .concat();
            let find = |kind| events.iter().find(|event| event.0 == kind).expect("the event happens");
            let (_, time, _) = find(EventKind::Rebound);
            assert!((time - rebound).abs() < TOLERANCE, "{name} {contact}: V = 0 at {time}");
            let (_, time, r) = find(EventKind::Extension);
            assert!((time - extension).abs() < TOLERANCE, "{name} {contact}: t_ext = {time}");
            // the edge is pressed longest: tension begins on the axis
            assert_eq!(*r, Some(case.grid().r0), "{name} {contact}");
            assert_eq!(events.last().map(|event| event.0), Some(EventKind::Stopped));
        }
    }
}

#[test]
fn going_on_after_the_extension_is_an_option() {
    let case = case("fig8-m2.5", &["run.stop=separation", "record.frames=0"]);
    let mut simulation = Simulation::new(&case).expect("a solver");
    let mut kinds = Vec::new();
    while let Some(view) = simulation.step().expect("finite numbers") {
        kinds.extend(view.events.iter().map(|event| event.kind));
    }
    let expected = [EventKind::Rebound, EventKind::Extension, EventKind::Separation, EventKind::Stopped];
    assert_eq!(kinds, expected);
    assert!(matches!(simulation.ending(), Some(Ending::Stopped(_))));
}
