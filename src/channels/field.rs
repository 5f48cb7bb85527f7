//! `/field/…`: a field over the section, at frames.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, model::Field, view::View};

/// The channel of one field.
pub struct FieldSlice {
    field: Field,
    /// Every so many nodes are recorded.
    every: usize,
    message: percuss::FieldSlice,
}

impl FieldSlice {
    /// The channel of `field`, with the nodes that `case` records.
    pub fn new(case: &Case, field: Field) -> Self {
        Self { field, every: case.record.field_every, message: percuss::FieldSlice::default() }
    }
}

impl Channel for FieldSlice {
    fn topic(&self) -> &'static str {
        match self.field {
            Field::Displacement => "/field/displacement",
            Field::DisplacementR => "/field/displacement_r",
            Field::Velocity => "/field/velocity",
            Field::VelocityR => "/field/velocity_r",
            Field::Stress => "/field/stress",
            Field::StressRr => "/field/stress_rr",
            Field::StressTt => "/field/stress_tt",
            Field::StressRz => "/field/stress_rz",
            Field::Pressure => "/field/pressure",
            Field::VonMises => "/field/von_mises",
            Field::MaxShear => "/field/max_shear",
        }
    }

    fn schema(&self) -> &'static str {
        "percuss.FieldSlice"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let (unit, meaning) = match self.field {
            Field::Displacement => ("R", "displacement u_z into the target, row-major [z][r]"),
            Field::DisplacementR => ("R", "displacement u_r outwards, row-major [z][r]"),
            Field::Velocity => ("c_p", "velocity of u_z into the target, row-major [z][r]"),
            Field::VelocityR => ("c_p", "velocity of u_r outwards, row-major [z][r]"),
            Field::Stress => (
                "γc_p²",
                "stress -sigma_zz, compression positive like the interface stress, row-major [z][r]",
            ),
            Field::StressRr => ("γc_p²", "stress -sigma_rr, compression positive, row-major [z][r]"),
            Field::StressTt => (
                "γc_p²",
                "hoop stress -sigma_tt (plane: out of the plane), compression positive, row-major [z][r]",
            ),
            Field::StressRz => {
                ("γc_p²", "shear stress -sigma_rz, with the sign of the other components, row-major [z][r]")
            }
            Field::Pressure => {
                ("γc_p²", "mean pressure -(sigma_zz + sigma_rr + sigma_tt)/3, row-major [z][r]")
            }
            Field::VonMises => ("γc_p²", "stress of von Mises, row-major [z][r]"),
            Field::MaxShear => ("γc_p²", "largest shear stress, half of sigma_1 - sigma_3, row-major [z][r]"),
        };
        vec![
            FieldNote::new("r0", "R", "radius of the first column"),
            FieldNote::new("dr", "R", "distance between columns"),
            FieldNote::new("nr", "1", "number of columns"),
            FieldNote::new("z0", "R", "depth of the first row"),
            FieldNote::new("dz", "R", "distance between rows"),
            FieldNote::new("nz", "1", "number of rows"),
            FieldNote::new("values", unit, meaning).along("z0,dz,nz;r0,dr,nr"),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(frame) = &view.frame else { return };
        let sample = frame.fields.sample(self.field).expect("a frame has every field that is recorded");
        let (lattice, every) = (frame.fields.lattice, self.every as f64);
        let message = &mut self.message;
        (message.step, message.time) = (view.step, view.time);
        (message.r0, message.dr, message.nr) = (lattice.r0, every * lattice.dr, sample.extent.nr as u32);
        (message.z0, message.dz, message.nz) = (0.0, every * lattice.dz, sample.extent.nz as u32);
        message.values.clear();
        message.values.extend_from_slice(&sample.values);
        outlet.put(message);
    }
}
