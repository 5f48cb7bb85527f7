//! `/view/profile`: the surface at one time, for x–y plots.

use crate::{
    case::Case,
    channels::{Channel, FieldNote, Outlet},
    message::percuss,
    shape::Shape,
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
        vec![
            FieldNote::new("r", "R", "radii of the points"),
            FieldNote::new("stress", "γc_p²", "interface stress, compression positive"),
            FieldNote::new("displacement", "R", "displacement of the surface into the target"),
            FieldNote::new("indenter", "R", "face of the indenter, w - f(r); 0 beside the indenter"),
        ]
    }

    fn observe(&mut self, view: &View<'_>, outlet: &mut Outlet<'_>) {
        let Some(frame) = &view.frame else { return };
        let displacement = &frame.fields.surface;
        let message = &mut self.message;
        (message.step, message.time) = (view.step, view.time);
        for array in [&mut message.r, &mut message.stress, &mut message.displacement, &mut message.indenter] {
            array.clear();
        }
        let at = |values: &[f64], i: usize| values.get(i).copied().unwrap_or(0.0) as f32;
        for i in (0..self.nodes).step_by(self.every) {
            let r = view.interface.r0 + i as f64 * view.interface.dr;
            let face = view.depth - self.shape.profile(r);
            message.r.push(r as f32);
            message.stress.push(at(&view.interface.pressure, i));
            message.displacement.push(at(displacement, i));
            message.indenter.push(if face.is_finite() { face as f32 } else { 0.0 });
        }
        outlet.put(message);
    }
}
