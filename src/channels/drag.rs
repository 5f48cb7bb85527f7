//! `/drag`: resistance to the indenter, every step.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, units::Units};

pub fn channel(case: &Case) -> Channel {
    let Units { length, time, force, .. } = case.units();
    let (what, radius) = match case.load {
        Some(_) => ("force F of the load", "radius of what is loaded"),
        None => ("drag F on the indenter", "contact radius r*"),
    };
    let fields = vec![
        FieldNote::new("force", force.name, format!("{what}{}", force.part())),
        FieldNote::new("contact_radius", length.name, radius),
    ];
    Channel::new("/drag", "percuss.Drag", fields, move |view, outlet| {
        outlet.put(&percuss::Drag {
            step: view.step,
            time: time.of(view.time),
            force: force.of(view.drag),
            contact_radius: length.of(view.contact_radius),
        });
    })
    .emits(Rate::Step(HEAD))
}
