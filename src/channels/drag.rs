//! `/drag`: resistance to the indenter, every step.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, units::Units};

/// The drag channel, in the units of `case`.
pub fn channel(case: &Case) -> Channel {
    let Units { length, time, force, .. } = case.units();
    let fields = vec![
        FieldNote::new("force", force.name, format!("drag F on the indenter{}", force.part())),
        FieldNote::new("contact_radius", length.name, "contact radius r*"),
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
