//! `/field/…`: a field over the section, at frames.

use super::{Channel, FieldNote, Outlet};
use crate::{case::Case, message::percuss, model::Field, units::Units, view::View};

/// The channel of one field.
pub struct FieldSlice {
    field: Field,
    /// Every so many nodes are recorded.
    every: usize,
    units: Units,
    message: percuss::FieldSlice,
}

impl FieldSlice {
    /// The channel of `field`, with the nodes that `case` records.
    pub fn new(case: &Case, field: Field) -> Self {
        Self {
            field,
            every: case.record.field_every,
            units: case.units(),
            message: percuss::FieldSlice::default(),
        }
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
        let meaning = match self.field {
            Field::Displacement => "displacement u_z into the target",
            Field::DisplacementR => "displacement u_r outwards",
            Field::Velocity => "velocity of u_z into the target",
            Field::VelocityR => "velocity of u_r outwards",
            Field::Stress => "stress -sigma_zz, compression positive like the interface stress",
            Field::StressRr => "stress -sigma_rr, compression positive",
            Field::StressTt => "hoop stress -sigma_tt (plane: out of the plane), compression positive",
            Field::StressRz => "shear stress -sigma_rz, with the sign of the other components",
            Field::Pressure => "mean pressure -(sigma_zz + sigma_rr + sigma_tt)/3",
            Field::VonMises => "stress of von Mises",
            Field::MaxShear => "largest shear stress, half of sigma_1 - sigma_3",
        };
        let (length, unit) = (self.units.length.name, self.field.unit(&self.units).name);
        vec![
            FieldNote::new("r0", length, "radius of the first column"),
            FieldNote::new("dr", length, "distance between columns"),
            FieldNote::new("nr", "1", "number of columns"),
            FieldNote::new("z0", length, "depth of the first row"),
            FieldNote::new("dz", length, "distance between rows"),
            FieldNote::new("nz", "1", "number of rows"),
            FieldNote::new("values", unit, format!("{meaning}, row-major [z][r]")).along("z0,dz,nz;r0,dr,nr"),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(frame) = &view.frame else { return };
        let sample = frame.fields.sample(self.field).expect("a frame has every field that is recorded");
        let (lattice, every) = (frame.fields.lattice, self.every as f64);
        let message = &mut self.message;
        let Units { length, time, .. } = self.units;
        (message.step, message.time) = (view.step, time.of(view.time));
        (message.r0, message.dr) = (length.of(lattice.r0), length.of(every * lattice.dr));
        (message.z0, message.dz) = (0.0, length.of(every * lattice.dz));
        (message.nr, message.nz) = (sample.extent.nr as u32, sample.extent.nz as u32);
        let unit = self.field.unit(&self.units);
        message.values.clear();
        if unit.scale == 1.0 {
            message.values.extend_from_slice(&sample.values);
        } else {
            message.values.extend(sample.values.iter().map(|value| unit.of(f64::from(*value)) as f32));
        }
        outlet.put(message);
    }
}
