//! A frame that outlives its step: what the channels of frames show, so that they can do so on the thread that writes, while
//! the run goes on.

use std::sync::{Mutex, PoisonError};

use super::lock;
use crate::{
    model::{Extent, Field},
    view::{Energy, Fields, Frame, Interface, Lattice, View},
};

/// A copy of a [`View`] that is a frame.
#[derive(Default)]
pub struct Snapshot {
    step: u64,
    time: f64,
    drag: f64,
    contact_radius: f64,
    velocity: f64,
    depth: f64,
    energy: Energy,
    pressure: Vec<f64>,
    displacement: Vec<f64>,
    lattice: Lattice,
    punch_radius: f64,
    complete: bool,
    /// Fields that have been sampled and not been asked for yet; buffers for the next frame once they have.
    samples: Mutex<Vec<Sample>>,
}

struct Sample {
    field: Field,
    extent: Extent,
    values: Vec<f32>,
}

impl Snapshot {
    /// Takes a frame; what the snapshot held before is gone, its memory is used again.
    ///
    /// * `fields`: those that will be asked for
    /// * `every`: nodes from one that they show to the next
    pub fn take(&mut self, view: &View<'_>, frame: &Frame<'_>, fields: &[Field], every: usize) {
        (self.step, self.time) = (view.step, view.time);
        (self.drag, self.contact_radius) = (view.drag, view.contact_radius);
        (self.velocity, self.depth) = (view.velocity, view.depth);
        self.energy = frame.energy;
        self.pressure.clear();
        self.pressure.extend_from_slice(view.interface.pressure);
        (self.punch_radius, self.complete) = (view.interface.punch_radius, view.interface.complete);
        frame.fields.surface(&mut self.displacement);
        self.lattice = frame.fields.lattice();
        let samples = self.samples.get_mut().unwrap_or_else(PoisonError::into_inner);
        samples.resize_with(fields.len(), || Sample {
            field: Field::Stress,
            extent: Extent::default(),
            values: Vec::new(),
        });
        for (sample, field) in samples.iter_mut().zip(fields) {
            sample.field = *field;
            sample.extent = frame.fields.sample(*field, every, &mut sample.values);
        }
    }

    /// The frame.
    pub fn view(&self) -> View<'_> {
        View {
            step: self.step,
            time: self.time,
            interface: Interface {
                r0: self.lattice.r0,
                dr: self.lattice.dr,
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
            frame: Some(Frame { energy: self.energy, fields: self }),
        }
    }
}

impl Fields for Snapshot {
    /// Exchanges `values` for the values taken: every field can be asked for once, with the nodes it was taken with.
    fn sample(&self, field: Field, _every: usize, values: &mut Vec<f32>) -> Extent {
        let mut samples = lock(&self.samples);
        let sample = samples.iter_mut().find(|sample| sample.field == field);
        let sample = sample.expect("a snapshot takes every field that is recorded");
        std::mem::swap(&mut sample.values, values);
        sample.extent
    }

    fn surface(&self, values: &mut Vec<f64>) {
        values.clone_from(&self.displacement);
    }

    fn lattice(&self) -> Lattice {
        self.lattice
    }
}
