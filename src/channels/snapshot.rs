//! A frame that outlives its step: what the channels of frames show, so that they can do so on the thread that writes, while
//! the run goes on.

use crate::view::{Energy, Fields, Frame, Interface, View};

/// A copy of a [`View`] that is a frame.
pub struct Snapshot {
    step: u64,
    time: f64,
    drag: f64,
    contact_radius: f64,
    velocity: f64,
    depth: f64,
    energy: Energy,
    pressure: Vec<f64>,
    punch_radius: f64,
    complete: bool,
    fields: Fields,
}

impl Snapshot {
    /// Takes a frame, with its fields.
    pub fn take(view: &View<'_>, frame: &Frame<'_>) -> Self {
        Self {
            step: view.step,
            time: view.time,
            drag: view.drag,
            contact_radius: view.contact_radius,
            velocity: view.velocity,
            depth: view.depth,
            energy: frame.energy,
            pressure: view.interface.pressure.to_vec(),
            punch_radius: view.interface.punch_radius,
            complete: view.interface.complete,
            fields: frame.fields.take(),
        }
    }

    /// The frame.
    pub fn view(&self) -> View<'_> {
        View {
            step: self.step,
            time: self.time,
            interface: Interface {
                r0: self.fields.lattice().r0,
                dr: self.fields.lattice().dr,
                pressure: &self.pressure,
                punch_radius: self.punch_radius,
                complete: self.complete,
                exact: None,
            },
            drag: self.drag,
            contact_radius: self.contact_radius,
            velocity: self.velocity,
            depth: self.depth,
            events: &[],
            frame: Some(Frame { energy: self.energy, fields: &self.fields }),
        }
    }
}
