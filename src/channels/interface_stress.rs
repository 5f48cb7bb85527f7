//! `/interface/stress`: stress at the surface nodes out to the largest radius ever in contact.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, view::View};

/// The interface stress channel.
pub struct InterfaceStress {
    every: u64,
    message: percuss::InterfaceStress,
}

impl InterfaceStress {
    /// At the interval of `case`.
    pub fn new(case: &Case) -> Self {
        Self { every: case.record.interface_every, message: percuss::InterfaceStress::default() }
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
            FieldNote::new("r0", "R", "radius of the first node"),
            FieldNote::new("dr", "R", "distance between nodes"),
            FieldNote::new("stress", "γc_p²", meaning).along("r0,dr").even(),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        if !view.step.is_multiple_of(self.every) {
            return;
        }
        let message = &mut self.message;
        (message.step, message.time) = (view.step, view.time);
        (message.r0, message.dr) = (view.interface.r0, view.interface.dr);
        message.stress.clear();
        message.stress.extend_from_slice(&view.interface.pressure);
        outlet.put(message);
    }
}
