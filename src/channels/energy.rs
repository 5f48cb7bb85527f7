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
        let unit = self.units.energy;
        [
            ("kinetic", "kinetic energy of the target"),
            ("strain", "strain energy of the target"),
            ("indenter", "kinetic energy of an indenter of finite mass"),
            ("dissipated", "energy lost so far to nodes that struck the indenter and stuck"),
            ("damped", "energy taken out so far by the damping of waves that the mesh does not resolve"),
            ("work", "work done so far by a motion that is prescribed"),
            ("residual", "initial + work - all of the above: rounding"),
        ]
        .map(|(name, meaning)| FieldNote::new(name, unit.name, format!("{meaning}{}", unit.part())))
        .into()
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
