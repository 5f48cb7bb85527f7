//! `/drag`: resistance to the indenter, every step.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, grid::Geometry, message::percuss, units::Units, view::View};

/// The drag channel.
pub struct Drag {
    geometry: Geometry,
    units: Units,
}

impl Drag {
    /// In the units of `case`.
    pub fn new(case: &Case) -> Self {
        Self { geometry: case.geometry, units: case.units() }
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
        let meaning = match self.geometry {
            Geometry::Axisymmetric => "drag F on the indenter",
            Geometry::Plane => "drag F on the half x >= 0 of the indenter, per length",
        };
        vec![
            FieldNote::new("force", self.units.force.name, meaning),
            FieldNote::new("contact_radius", self.units.length.name, "contact radius r*"),
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
