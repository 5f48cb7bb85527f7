//! `/interface/stress`: stress at the surface nodes out to the largest radius ever in contact, every so many steps and at the last one.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, units::Units, view::View};

/// The interface stress channel.
pub struct InterfaceStress {
    every: u64,
    units: Units,
    message: percuss::InterfaceStress,
}

impl InterfaceStress {
    /// At the interval of `case`.
    pub fn new(case: &Case) -> Self {
        Self {
            every: case.record.interface_every,
            units: case.units(),
            message: percuss::InterfaceStress::default(),
        }
    }
}

impl Channel for InterfaceStress {
    fn topic(&self) -> &'static str {
        "/interface/stress"
    }

    fn schema(&self) -> &'static str {
        "percuss.InterfaceStress"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let meaning = "interface stress p = -sigma_zz, compression positive, at r0 + i dr";
        vec![
            FieldNote::new("r0", self.units.length.name, "radius of the first node"),
            FieldNote::new("dr", self.units.length.name, "distance between nodes"),
            FieldNote::new("stress", self.units.stress.name, meaning).along("r0,dr").even(),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        if !view.step.is_multiple_of(self.every) && !view.is_last {
            return;
        }
        let message = &mut self.message;
        let Units { length, time, stress, .. } = self.units;
        (message.step, message.time) = (view.step, time.of(view.time));
        (message.r0, message.dr) = (length.of(view.interface.r0), length.of(view.interface.dr));
        message.stress.clear();
        message.stress.extend(view.interface.pressure.iter().map(|p| stress.of(*p)));
        outlet.put(message);
    }
}
