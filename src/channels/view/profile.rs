//! `/view/profile`: the surface at one time, for x–y plots.

use crate::{
    case::{Case, Sizes},
    channels::{Channel, FieldNote, Rate},
    message::percuss,
    units::Units,
};

/// Largest number of points of a profile: some viewers skip arrays of more than 500 values.
const POINTS: f64 = 400.0;
/// Outer radius of the profile over the radius that contact reaches.
pub const MARGIN: f64 = 2.0;

pub fn channel(case: &Case) -> Channel {
    let Units { length, time, stress, .. } = case.units();
    let fields = vec![
        FieldNote::new("r", length.name, "radii of the points"),
        FieldNote::new("stress", stress.name, "interface stress, compression positive"),
        FieldNote::new("displacement", length.name, "displacement of the surface into the target"),
        FieldNote::new(
            "indenter",
            length.name,
            "face of the indenter, w - f(r), where it gives as deformed; NaN beside the indenter",
        ),
    ];
    let &Sizes { contact_reach, nr, .. } = &case.sizes;
    // up to the outer radius
    let nodes = case.column(MARGIN * contact_reach).ceil().clamp(2.0, nr.max(2) as f64);
    let every = (nodes / POINTS).ceil() as usize;
    let (shape, is_loaded) = (case.shape(), case.load.is_some());
    let mut message = percuss::SurfaceProfile::default();
    Channel::new("/view/profile", "percuss.SurfaceProfile", fields, move |view, outlet| {
        let Some(frame) = &view.frame else { return };
        let displacement = &frame.fields.surface;
        (message.step, message.time) = (view.step, time.of(view.time));
        for array in [&mut message.r, &mut message.stress, &mut message.displacement, &mut message.indenter] {
            array.clear();
        }
        let at = |values: &[f64], i: usize| values.get(i).copied().unwrap_or(0.0);
        for i in (0..nodes as usize).step_by(every) {
            let r = view.interface.r(i);
            let face = if is_loaded { f64::NAN } else { view.face(i) - shape.profile(r) };
            message.r.push(length.of(r) as f32);
            message.stress.push(stress.of(at(&view.interface.pressure, i)) as f32);
            message.displacement.push(length.of(at(displacement, i)) as f32);
            message.indenter.push(if face.is_finite() { length.of(face) as f32 } else { f32::NAN });
        }
        outlet.put(&message);
    })
    .emits(Rate::Frame(6 << 10))
}
