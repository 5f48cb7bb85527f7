//! `/velocity`: motion of the indenter, every step.

use super::{Channel, FieldNote, Outlet};
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
        vec![
            FieldNote::new("velocity", "c_p", "velocity V of the indenter into the target"),
            FieldNote::new("displacement", "R", "displacement w of the indenter into the target"),
        ]
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
