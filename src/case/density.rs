//! The section of recorded fields: how far it reaches, which nodes frames show, and their size.

use super::{BodySizes, Parameters};
use crate::{
    grid::{Grid, place},
    model::FrameFields,
    shape::Shape,
};

/// Default of the estimated nonzero numbers of a field in all frames together: 16 MiB. Recording them takes a small part of any
/// long run; recording all nodes of a fine mesh takes longer than computing them.
const ACTIVE_NODES: f64 = (1 << 22) as f64;
/// Least number of cells that fields show by default.
const SHOWN_CELLS: usize = 50;
/// Frames, at most, that nodes are counted at, and steps: a sweep estimates each of its cases.
const SAMPLES: usize = 200;
const STEP_SAMPLES: usize = 32;
/// Thicknesses of the target beside the contact that fields show by default: waves of the contact that the back and the surface have
/// returned are under it, farther out are those that go along the layer and do not come back.
const SHOWN_THICKNESSES: f64 = 3.0;
/// Part of a column by which a radius may miss it: radii of physical cases are converted.
const ROUNDING: f64 = 1e-6;

/// Nodes that fields show, of an indenter that gives from its rear to its nose before those of the target.
#[derive(Clone, Debug)]
pub struct ShownNodes {
    /// Depths of the rows, in the indenter negative \[R\].
    pub z: Vec<f64>,
    /// Radii of the columns \[R\].
    pub r: Vec<f64>,
    /// Number of rows in the indenter.
    pub above: usize,
}

impl Parameters {
    /// Memory of the fields of a frame, at most \[bytes\].
    pub(crate) fn frame_size(&self) -> usize {
        let ShownNodes { z, r, .. } = self.shown_nodes();
        let values = z.len() * r.len() * self.record.fields.len();
        (size_of::<f32>() * values).max(1)
    }

    pub(crate) fn frame_fields(&self) -> FrameFields {
        FrameFields {
            fields: self.record.fields.clone(),
            every: self.record.field_every,
            columns: self.shown_columns(),
        }
    }

    /// Radius to which fields show the target \[R\]; `None` if that is all of the mesh, or there are no fields.
    #[cfg(feature = "cli")]
    pub(crate) fn shown_radius(&self) -> Option<f64> {
        let has_fields = !self.record.fields.is_empty() && !self.record.frames.is_none();
        (has_fields && self.shown_columns() < self.sizes.nr).then_some(self.record.r_max)
    }

    /// Columns whose cells end within a radius, and the part of the next one.
    pub(crate) fn column(&self, r: f64) -> f64 {
        let widths = &self.sizes.widths;
        if widths.is_empty() {
            return r / self.sizes.dr;
        }
        // cells of nodes end in the middle between them
        let middles = std::iter::once(0.0).chain(widths.windows(2).scan(0.0, |end, pair| {
            *end += 0.5 * (pair[0] + pair[1]);
            Some(*end)
        }));
        place(&middles.collect::<Vec<_>>(), r).min(self.widest() as f64)
    }

    /// Number of columns of the target or of an indenter that gives, whichever has more.
    fn widest(&self) -> usize {
        self.sizes.striker.as_ref().map_or(self.sizes.nr, |striker| striker.nr.max(self.sizes.nr))
    }

    pub(crate) fn shown_nodes(&self) -> ShownNodes {
        let (every, columns, target) = (self.record.field_every, self.shown_columns(), self.grid());
        let rows = |grid: &Grid| grid.shown_rows(every).into_iter().map(|j| grid.z(j)).collect::<Vec<f64>>();
        let striker = self.striker_grid();
        let mut z: Vec<f64> = striker
            .as_ref()
            .map_or_else(Vec::new, |striker| rows(striker).into_iter().rev().map(|z| -z).collect());
        let above = z.len();
        z.extend(rows(&target));
        let widest = striker.filter(|striker| striker.nr() > target.nr()).unwrap_or(target);
        let r = (0..columns.min(widest.nr())).step_by(every).map(|i| widest.r(i)).collect();
        ShownNodes { z, r, above }
    }

    /// Columns of the mesh that fields, and lines along r, show: those whose cells begin within `record.r_max`, two at least.
    pub(super) fn shown_columns(&self) -> usize {
        let columns = (self.column(self.record.r_max) + ROUNDING).floor() + 1.0;
        columns.clamp(2.0, self.widest().max(2) as f64) as usize
    }

    /// Default of `record.r_max` \[R\]: the largest contact radius, and beside it as much again or [`SHOWN_THICKNESSES`], whichever is more, within
    /// the mesh. In a half-space waves go as far down as outwards, and the section is that of the mesh.
    ///
    /// ```text
    /// r_max = r_contact + max(r_contact, 3h)
    /// ```
    pub(crate) fn default_r_max(&self) -> f64 {
        let (reach, outer) = (self.sizes.contact_reach, self.sizes.outer_radius);
        let beside = self.target.thickness.map(|thickness| reach.max(SHOWN_THICKNESSES * thickness));
        beside.map_or(outer, |beside| outer.min(reach + beside))
    }

    /// Default of `record.field_every`: as small as [`ACTIVE_NODES`] allows, and not above what leaves [`SHOWN_CELLS`].
    pub(crate) fn default_field_every(&self) -> usize {
        if self.record.fields.is_empty() {
            return 1;
        }
        // the nodes of a graded mesh are few, and each says much
        let most = if self.mesh.grading.is_some() { 4.0 * ACTIVE_NODES } else { ACTIVE_NODES };
        let every = (self.estimated_nodes(1) / most).sqrt().ceil() as usize;
        every.min(self.mesh.cells / SHOWN_CELLS).max(1)
    }

    /// Estimated nonzero numbers of a field of every `every`-th node along r and z, in all frames together.
    fn estimated_nodes(&self, every: usize) -> f64 {
        let shown = |nodes: f64| (nodes / every as f64).ceil();
        let c_s = self.target.fastest_shear();
        let widest = self.shown_columns() as f64;
        let nodes = |[rows, columns]: [f64; 2]| shown(rows) * shown(columns.min(widest));
        let frames = self.frames().0;
        let samples = frames.iter().step_by(frames.len().div_ceil(SAMPLES).max(1));
        let each = frames.len() as f64 / samples.len().max(1) as f64;
        let shape = self.shape();
        each * samples.map(|step| nodes(self.active_region(&shape, c_s, *step as f64))).sum::<f64>()
    }

    /// Estimated node updates of a run. Without frames only what the surface can still feel is computed.
    pub(crate) fn node_updates(&self) -> f64 {
        let (steps, shape, speed) = (self.sizes.steps as f64, self.shape(), self.wave_speed());
        if !self.is_tiled() {
            let striker = self.sizes.striker.as_ref().map_or(0, BodySizes::nodes);
            return steps * (self.sizes.nr as f64 * (self.sizes.nz + 1) as f64 + striker as f64);
        }
        let nodes = |sample: usize| {
            let step = steps * (sample as f64 + 0.5) / STEP_SAMPLES as f64;
            let [rows, columns] = self.active_region(&shape, speed, step);
            columns * if self.record.frames.is_none() { rows.min(steps - step) } else { rows }
        };
        steps / STEP_SAMPLES as f64 * (0..STEP_SAMPLES).map(nodes).sum::<f64>()
    }

    /// Estimated rows and columns inside the light cone of the contact at a step.
    fn active_region(&self, shape: &Shape, speed: f64, step: f64) -> [f64; 2] {
        [(step + 1.0).min(self.sizes.nz as f64 + 1.0), self.active_columns(shape, speed, step)]
    }

    /// Estimated number of columns inside the light cone of the contact at a step.
    ///
    /// ```text
    /// max over earlier steps s of  r_contact(s)/Δr + λ·(step − s),   λ = cΔt/Δr
    /// ```
    fn active_columns(&self, shape: &Shape, speed: f64, step: f64) -> f64 {
        const SAMPLES: u32 = 16;
        if !self.is_tiled() {
            return self.sizes.nr as f64;
        }
        let courant = speed * self.sizes.dt / self.sizes.dr;
        let columns = |part: u32| {
            let earlier = step * f64::from(part) / f64::from(SAMPLES);
            let contact = shape.reach(self.impact.velocity * earlier * self.sizes.dt) / self.sizes.dr;
            contact + courant * (step - earlier)
        };
        (0..=SAMPLES).map(columns).fold(1.0, f64::max).min(self.sizes.nr as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{case::Case, model::GaugePlan};

    fn fine(settings: &[&str]) -> Case {
        let shared = ["mesh.kind=\"paper\"", "mesh.cells=1000", "mesh.outer_radius=4"];
        Case::sound("fig5", &[&shared, settings].concat())
    }

    #[test]
    fn default_density_keeps_the_number_of_nodes() {
        let case = fine(&[]);
        let every = case.record.field_every;
        assert!(every > 1 && case.estimated_nodes(every - 1) > ACTIVE_NODES);
        // the numbers of shown rows and columns are rounded up
        assert!(case.estimated_nodes(every) < 1.05 * ACTIVE_NODES);
        let few = ["record.frame_times=[1.0]", "run.end_time=2.5"];
        for settings in [&few[..], &["record.field_every=1"], &["record.frames=0"], &["record.fields=[]"]] {
            assert_eq!(fine(settings).record.field_every, 1, "{settings:?}");
        }
        // a small case; one on a coarse mesh that is wide and deep
        for name in ["fig5", "fig9-m5"] {
            assert_eq!(Case::sound(name, &[]).record.field_every, 1);
        }
        assert_eq!(Case::sound(&case.resolved_toml(), &[]).record, case.record);
    }

    #[test]
    fn fields_end_where_nothing_comes_back() {
        let load = Case::sound;
        let radii = |case: &Case| (case.sizes.contact_reach, case.record.r_max, case.sizes.outer_radius);
        // a punch of radius 1 on a layer of thickness 1: wave fronts are at r = 4 at the end
        let (reach, r_max, outer) = radii(&load("fig5", &[]));
        assert!(reach == 1.0 && r_max == 4.0 && outer > 4.0, "{r_max} {outer}");
        // a thin layer: as much again as the contact
        assert_eq!(load("fig5", &["target.thickness=0.1"]).record.r_max, 2.0);
        // not beyond the mesh; a half-space is shown whole
        let (_, r_max, outer) = radii(&load("fig5", &["mesh.outer_radius=2.5"]));
        assert_eq!(r_max, outer);
        let (_, r_max, outer) = radii(&load("fig8-m5", &[]));
        assert_eq!(r_max, outer);
        let ball = load("ball", &[]);
        let (reach, r_max, outer) = radii(&ball);
        assert!(r_max == reach + 3.0 * ball.target.thickness.expect("a layer") && r_max < 0.2 * outer);
        // both columns that there are at least, and all of them
        let columns = |settings: &[&str]| load("fig5", settings).frame_fields().columns;
        let radii = ["record.r_max=1e-3", "record.r_max=inf", "record.r_max=1000"];
        let nr = load("fig5", &[]).sizes.nr;
        assert_eq!(radii.map(|radius| columns(&[radius])), [2, nr, nr]);
        // lines along r end there too
        let gauges = load("fig5", &["record.lines=[{ z = 0.5 }]"]).gauges();
        let shown = GaugePlan::new(&gauges, &load("fig5", &[]).grid()).values(&[], Some(&[0.0; 10_000]));
        assert_eq!(shown.lines[0].len(), columns(&[]));
        #[cfg(feature = "cli")]
        assert_eq!(load("fig5", &["record.r_max=inf"]).shown_radius(), None);
        for case in [&ball, &load("ball", &["record.r_max=inf"]), &load("ball", &["record.r_max=\"30 mm\""])]
        {
            let again = Case::sound(&case.resolved_toml(), &[]);
            assert_eq!(again.resolved_toml(), case.resolved_toml());
            assert_eq!(again.frame_fields(), case.frame_fields());
        }
    }

    #[test]
    fn many_frames_are_estimated_from_some() {
        let few = fine(&["record.frames=200"]).estimated_nodes(4) / 200.0;
        let many = fine(&["record.frames=5001"]).estimated_nodes(4) / 5001.0;
        assert!((many / few - 1.0).abs() < 0.01, "{few} {many}");
    }
}
