//! `/view/profile`: the surface at one time, for x–y plots.

use crate::{
    case::Case,
    channels::{Channel, FieldNote, Outlet},
    message::percuss,
    shape::Shape,
    units::Units,
    view::View,
};

/// Largest number of points of a profile: some viewers skip arrays of more than 500 values.
const POINTS: f64 = 400.0;
/// Outer radius of the profile over the radius that contact reaches.
pub const MARGIN: f64 = 2.0;

/// The channel.
pub struct Profile {
    shape: Shape,
    /// Every so many nodes.
    every: usize,
    /// Number of nodes up to the outer radius.
    nodes: usize,
    units: Units,
    message: percuss::SurfaceProfile,
}

impl Profile {
    /// The channel of a case.
    pub fn new(case: &Case) -> Self {
        let sizes = &case.sizes;
        let nodes = (MARGIN * sizes.contact_reach / sizes.dr).ceil().clamp(2.0, sizes.nr.max(2) as f64);
        Self {
            shape: case.shape(),
            every: (nodes / POINTS).ceil() as usize,
            nodes: nodes as usize,
            units: case.units(),
            message: percuss::SurfaceProfile::default(),
        }
    }
}

impl Channel for Profile {
    fn topic(&self) -> &'static str {
        "/view/profile"
    }

    fn schema(&self) -> &'static str {
        "percuss.SurfaceProfile"
    }

    fn fields(&self) -> Vec<FieldNote> {
        let (length, stress) = (self.units.length.name, self.units.stress.name);
        vec![
            FieldNote::new("r", length, "radii of the points"),
            FieldNote::new("stress", stress, "interface stress, compression positive"),
            FieldNote::new("displacement", length, "displacement of the surface into the target"),
            FieldNote::new("indenter", length, "face of the indenter, w - f(r); 0 beside the indenter"),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(frame) = &view.frame else { return };
        let displacement = &frame.fields.surface;
        let Units { length, time, stress, .. } = self.units;
        let message = &mut self.message;
        (message.step, message.time) = (view.step, time.of(view.time));
        for array in [&mut message.r, &mut message.stress, &mut message.displacement, &mut message.indenter] {
            array.clear();
        }
        let at = |values: &[f64], i: usize| values.get(i).copied().unwrap_or(0.0);
        for i in (0..self.nodes).step_by(self.every) {
            let r = view.interface.r0 + i as f64 * view.interface.dr;
            let face = view.depth - self.shape.profile(r);
            message.r.push(length.of(r) as f32);
            message.stress.push(stress.of(at(&view.interface.pressure, i)) as f32);
            message.displacement.push(length.of(at(displacement, i)) as f32);
            message.indenter.push(if face.is_finite() { length.of(face) as f32 } else { 0.0 });
        }
        outlet.put(message);
    }
}
