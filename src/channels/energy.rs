//! `/energy`: the energy ledger, at frames, of which the last step is one; none without frames.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, units::Units, view::View};

/// The energy channel.
pub struct Energy {
    units: Units,
}

impl Energy {
    /// In the units of `case`.
    pub fn new(case: &Case) -> Self {
        Self { units: case.units() }
    }
}

impl Channel for Energy {
    fn topic(&self) -> &'static str {
        "/energy"
    }

    fn schema(&self) -> &'static str {
        "percuss.Energy"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let unit = self.units.energy.name;
        vec![
            FieldNote::new("kinetic", unit, "kinetic energy of the target"),
            FieldNote::new("strain", unit, "strain energy of the target"),
            FieldNote::new("indenter", unit, "kinetic energy of an indenter of finite mass"),
            FieldNote::new(
                "dissipated",
                unit,
                "energy lost so far to nodes that struck the indenter and stuck",
            ),
            FieldNote::new(
                "damped",
                unit,
                "energy taken out so far by the damping of waves that the mesh does not resolve",
            ),
            FieldNote::new("work", unit, "work done so far by a motion that is prescribed"),
            FieldNote::new("residual", unit, "initial + work - all of the above: rounding"),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(frame) = &view.frame else { return };
        let (energy, unit) = (frame.energy, self.units.energy);
        outlet.put(&percuss::Energy {
            step: view.step,
            time: self.units.time.of(view.time),
            kinetic: unit.of(energy.kinetic),
            strain: unit.of(energy.strain),
            indenter: unit.of(energy.indenter),
            dissipated: unit.of(energy.dissipated),
            work: unit.of(energy.work),
            residual: unit.of(energy.residual),
            damped: unit.of(energy.damped),
        });
    }
}
