//! `/field/…`: a field over the section, at frames.

use super::{Channel, FieldNote, HEAD, Rate};
use crate::{case::Case, message::percuss, model::Field, units::Units};

pub fn channel(case: &Case, field: Field) -> Channel {
    let meaning = match field {
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
        Field::DamageRatio => {
            "largest ratio of a stress to a strength of the layer: von Mises to yield, first principal to tensile"
        }
    };
    let (Units { length, time, .. }, unit) = (case.units(), field.unit(&case.units()));
    let (grid, every, shown) = (case.grid(), case.record.field_every, case.shown_nodes());
    let size = case.frame_size() / case.record.fields.len();
    let is_graded = grid.is_graded();
    let fields = vec![
        FieldNote::new("r0", length.name, "radius of the first column"),
        FieldNote::new("dr", length.name, "distance between columns"),
        FieldNote::new("nr", "1", "number of columns"),
        FieldNote::new("z0", length.name, "depth of the first row"),
        FieldNote::new("dz", length.name, "distance between rows"),
        FieldNote::new("nz", "1", "number of rows"),
        FieldNote::new(
            "z",
            length.name,
            match shown.above {
                0 => "depths of all rows, where the target has more than one layer or the mesh is graded",
                _ => "depths of all rows, in the indenter negative",
            },
        ),
        FieldNote::new("r", length.name, "radii of all columns, where the mesh is graded"),
        FieldNote::new("values", unit.name, format!("{meaning}, row-major [z][r]"))
            .along("z0,dz,nz,z;r0,dr,nr,r"),
    ];
    let mut message = percuss::FieldSlice {
        r0: length.of(grid.r0),
        dr: length.of(every as f64 * grid.dr),
        z0: length.of(shown.z[0]),
        dz: length.of(every as f64 * grid.dz),
        ..percuss::FieldSlice::default()
    };
    if grid.layers.len() > 1 || is_graded {
        message.z.extend(shown.z.iter().map(|z| length.of(*z)));
    }
    if is_graded {
        message.r.extend(shown.r.iter().map(|r| length.of(*r)));
    }
    Channel::new(format!("/field/{}", field.name()), "percuss.FieldSlice", fields, move |view, outlet| {
        let Some(frame) = &view.frame else { return };
        let sample = frame.fields.sample(field).expect("a frame has every field that is recorded");
        (message.step, message.time) = (view.step, time.of(view.time));
        (message.nr, message.nz) = (sample.extent.nr as u32, sample.extent.nz as u32);
        message.values.clear();
        if unit.scale == 1.0 {
            message.values.extend_from_slice(&sample.values);
        } else {
            message.values.extend(sample.values.iter().map(|value| unit.of(f64::from(*value)) as f32));
        }
        outlet.put(&message);
    })
    .emits(Rate::Frame(2 * HEAD + size as u64))
}
