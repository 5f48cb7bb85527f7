//! `/velocity`: motion of the indenter, every step.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, units::Units};

/// The velocity channel, in the units of `case`.
pub fn channel(case: &Case) -> Channel {
    let Units { length, time, speed, .. } = case.units();
    let fields = vec![
        FieldNote::new("velocity", speed.name, "velocity V of the indenter into the target"),
        FieldNote::new("displacement", length.name, "displacement w of the indenter into the target"),
    ];
    Channel::new("/velocity", "percuss.Velocity", fields, move |view, outlet| {
        outlet.put(&percuss::Velocity {
            step: view.step,
            time: time.of(view.time),
            velocity: speed.of(view.velocity),
            displacement: length.of(view.depth),
        });
    })
    .emits(Rate::Step(HEAD))
}
