//! `/velocity`: motion of the indenter, every step.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, units::Units};

pub fn channel(case: &Case) -> Channel {
    let Units { length, time, speed, .. } = case.units();
    let gives = case.indenter.striker.is_some();
    let of = match case.load {
        Some(_) => "what is loaded, a mean weighted by the pressure,",
        None if gives => "the indenter's centre of mass",
        None => "the indenter",
    };
    let mut fields = vec![
        FieldNote::new("velocity", speed.name, format!("velocity V of {of} into the target")),
        FieldNote::new("displacement", length.name, format!("displacement w of {of} into the target")),
    ];
    if gives {
        fields.push(FieldNote::new("nose", speed.name, "velocity of the indenter's nose, on the axis"));
        fields.push(FieldNote::new("rear", speed.name, "velocity of the indenter's rear, on the axis"));
    }
    Channel::new("/velocity", "percuss.Velocity", fields, move |view, outlet| {
        outlet.put(&percuss::Velocity {
            step: view.step,
            time: time.of(view.time),
            velocity: speed.of(view.velocity),
            displacement: length.of(view.depth),
            nose: view.striker.map(|striker| speed.of(striker.nose)),
            rear: view.striker.map(|striker| speed.of(striker.rear)),
        });
    })
    .emits(Rate::Step(HEAD))
}
