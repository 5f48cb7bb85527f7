//! `/drag`: resistance to the indenter, every step.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, units::Units, view::View};

/// The drag channel.
pub struct Drag {
    units: Units,
}

impl Drag {
    /// In the units of `case`.
    pub fn new(case: &Case) -> Self {
        Self { units: case.units() }
    }
}

impl Channel for Drag {
    fn topic(&self) -> &'static str {
        "/drag"
    }

    fn schema(&self) -> &'static str {
        "percuss.Drag"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let Units { length, force, .. } = self.units;
        vec![
            FieldNote::new("force", force.name, format!("drag F on the indenter{}", force.part())),
            FieldNote::new("contact_radius", length.name, "contact radius r*"),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        outlet.put(&percuss::Drag {
            step: view.step,
            time: self.units.time.of(view.time),
            force: self.units.force.of(view.drag),
            contact_radius: self.units.length.of(view.contact_radius),
        });
    }
}
