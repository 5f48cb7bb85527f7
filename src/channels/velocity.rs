//! `/velocity`: motion of the indenter, every step.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, units::Units, view::View};

/// The velocity channel.
pub struct Velocity {
    units: Units,
}

impl Velocity {
    /// In the units of `case`.
    pub fn new(case: &Case) -> Self {
        Self { units: case.units() }
    }
}

impl Channel for Velocity {
    fn topic(&self) -> &'static str {
        "/velocity"
    }

    fn schema(&self) -> &'static str {
        "percuss.Velocity"
    }

    fn fields(&self) -> Vec<FieldNote> {
        vec![
            FieldNote::new("velocity", self.units.speed.name, "velocity V of the indenter into the target"),
            FieldNote::new(
                "displacement",
                self.units.length.name,
                "displacement w of the indenter into the target",
            ),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        outlet.put(&percuss::Velocity {
            step: view.step,
            time: self.units.time.of(view.time),
            velocity: self.units.speed.of(view.velocity),
            displacement: self.units.length.of(view.depth),
        });
    }
}
