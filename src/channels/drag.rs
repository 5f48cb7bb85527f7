//! `/drag`: resistance to the indenter, every step.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, grid::Geometry, message::percuss, units, view::View};

/// The drag channel.
pub struct Drag {
    geometry: Geometry,
}

impl Drag {
    /// In the units of `case`.
    pub fn new(case: &Case) -> Self {
        Self { geometry: case.geometry }
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
            Geometry::Axisymmetric => "drag F on the indenter, F(0+) = V0 for a flat punch",
            Geometry::Plane => {
                "drag F on the half x >= 0 of the indenter, per length, F(0+) = V0 for a flat punch"
            }
        };
        vec![
            FieldNote::new("force", units::force(self.geometry), meaning),
            FieldNote::new("contact_radius", "R", "contact radius r*"),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        outlet.put(&percuss::Drag {
            step: view.step,
            time: view.time,
            force: view.drag,
            contact_radius: view.contact_radius,
        });
    }
}
