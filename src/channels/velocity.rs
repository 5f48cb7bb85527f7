//! `/velocity`: motion of the indenter, every step.

use super::{Channel, FieldNote, Outlet, step_and_time};
use crate::{message::percuss, view::View};

/// The velocity channel.
pub struct Velocity;

impl Channel for Velocity {
    fn topic(&self) -> &'static str {
        "/velocity"
    }

    fn schema(&self) -> &'static str {
        "percuss.Velocity"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let mut fields = step_and_time().to_vec();
        fields.push(FieldNote::new("velocity", "c_p", "velocity V of the indenter into the target"));
        fields.push(FieldNote::new("displacement", "R", "displacement w of the indenter into the target"));
        fields
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        outlet.put(&percuss::Velocity {
            step: view.step,
            time: view.time,
            velocity: view.velocity,
            displacement: view.depth,
        });
    }
}
