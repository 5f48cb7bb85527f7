//! Sizes derived from a sound case: node distances, steps, radius and depth of the mesh.

use super::{
    BodySizes, GradedSizes, LayerSizes, Parameters, Sizes, TargetLayer,
    keys::BODY,
    rows::{self, LARGEST_CHANGE, MAX_ROWS, Rows, RowsError, Stack},
    values::Values,
};
use crate::{
    contact::HALF_WIDTH,
    grid::{Back, FEWEST, Growth, MeshKind, Spacing, outer_radius},
    model::{Dependence, cone::rows_ahead, elastic::FEWEST_ROWS, strain::NEAR_ROWS},
    units::Dimension,
};

/// Largest number of steps of a run.
const MAX_STEPS: f64 = 1e8;
/// Largest number of nodes.
pub(super) const MAX_NODES: f64 = 1e9;
/// Largest number of displacements in memory, 24 GB: three levels of as many nodes, or of half as many in the full theory.
pub(super) const MAX_NUMBERS: f64 = 3e9;
/// Width of the precursor that runs ahead of a wave on a mesh with dispersion, in nodes per cube root of the number
/// of steps: beyond it the field is below 1e-16 (measured; its head is an Airy function).
const PRECURSOR: f64 = 6.0;

/// Fewest columns of a body that ends.
const FEWEST_COLUMNS: f64 = 4.5;

/// Heights of equal rows.
fn equal_heights(layers: &[LayerSizes]) -> Vec<Vec<f64>> {
    layers.iter().map(|layer| vec![layer.dz; layer.steps]).collect()
}

impl Parameters {
    /// Derives the sizes of a sound case without them, or notes why there are none.
    pub(super) fn derive_sizes(&self, values: &Values<'_>) -> Option<Sizes> {
        let computed = self.target.computed();
        if let Some(grading) = &self.mesh.grading {
            return self.graded_sizes(values, grading, &computed);
        }
        let mut rows = self.rows(values, &computed)?;
        let Rows { dr, dt, .. } = rows;
        let steps = self.steps(values, dt)?;
        let contact_reach = self.contact_reach(dr, dt, steps);
        let outer = self.outer_radius(values, &rows, steps, contact_reach)?;
        let is_bounded = self.target.radius.is_some() || self.indenter.striker.is_some();
        let columns = is_bounded.then(|| self.columns(outer, &Growth::none(dr)));
        let nr = match &columns {
            Some((_, [nr, _])) => *nr as f64,
            None => (outer / dr - 1e-9).ceil().max(1.0),
        };
        let corner = self.corner();
        let reach = if corner.is_some() { 2 } else { 1 };
        let mut above = rows.layers.split_off(computed.len());
        let (has_back, interfaces) = (self.target.thickness.is_some(), computed.len() - 1);
        let finite = if has_back { &rows.layers[..] } else { &rows.layers[..interfaces] };
        let finite = finite.iter().map(|layer| layer.steps as f64).sum::<f64>();
        // what strains and tension of interfaces are taken of, and what is recorded, with the row below
        let strained = (finite as usize).max(NEAR_ROWS) + 2;
        let recorded =
            if self.record.frames.is_none() { rows.steps_to(self.record.deepest()) } else { f64::INFINITY };
        let covered = strained.max(recorded.min(MAX_STEPS) as usize + 2);
        // the wave travels one row per step
        let moved = steps as usize + 2 + rows_ahead(reach);
        let needed = Dependence { last_step: steps as usize, depths: covered };
        let deep = needed.deepest(reach).min(moved) as f64;
        let half_space = if has_back { 0.0 } else { (deep - finite).max(FEWEST as f64) };
        let nz = finite + half_space + interfaces as f64;
        let most = (MAX_NUMBERS / self.model.numbers_per_node(corner.as_ref()) as f64).min(MAX_NODES);
        if self.indenter.striker.as_ref().is_some_and(|striker| striker.body.thickness.is_none()) {
            // waves do not get there
            above.last_mut()?.steps = steps as usize + 2;
        }
        let rows_above: usize = above.iter().map(|layer| layer.steps + 1).sum();
        let nodes_above = columns.as_ref().map_or(0.0, |(_, [_, nr])| (nr * rows_above) as f64);
        if nr * nz + nodes_above > most {
            let message = format!(
                "`mesh.cells` = {} makes a mesh of {:.3e} nodes, {nr} along r, {nz} along z",
                self.mesh.cells,
                nr * nz + nodes_above
            );
            let help = format!("allowed: at most {most:e}; make mesh.cells or run.end_time smaller");
            values.problem("mesh.cells", message, help);
            return None;
        }
        if let Some(last) = rows.layers.last_mut().filter(|_| !has_back) {
            last.steps = half_space as usize;
        }
        Some(Sizes {
            dr,
            dz: rows.layers[0].dz,
            dt,
            steps: steps as u64,
            nr: nr as usize,
            nz: nz as usize,
            outer_radius: self.target.radius.unwrap_or_else(|| {
                columns.as_ref().map_or(nr * dr, |(widths, [nr, _])| outer_radius(&widths[..=*nr]))
            }),
            depth: rows.layers.iter().map(|layer| layer.rows() * layer.dz).sum(),
            contact_reach,
            strained,
            covered,
            has_back,
            striker: self.indenter.striker.as_ref().zip(columns.as_ref()).map(|(_, (_, [_, nr]))| {
                BodySizes { nr: *nr, heights: equal_heights(&above), layers: above }
            }),
            graded: columns.map(|(widths, _)| GradedSizes { widths, heights: equal_heights(&rows.layers) }),
            layers: rows.layers,
        })
    }

    /// Spacings of the mesh.
    ///
    /// * `computed`: layers
    fn rows(&self, values: &Values<'_>, computed: &[TargetLayer]) -> Option<Rows> {
        let cells = self.mesh.cells;
        // a load needs no edge between nodes
        let radius = self.indenter.radius.filter(|_| self.load.is_none());
        let h = self.target.thickness;
        let edge = rows::edge(self.mesh.order, &self.target);
        if computed.len() > 1 || self.indenter.striker.is_some() {
            let stack = Stack::new(self);
            let error = match stack.rows(cells) {
                Ok(rows) => return Some(rows),
                Err(error) => error,
            };
            self.refuse_rows(values, &stack, error);
            return None;
        }
        let speed = computed[0].lateral_speed(self.model, 1.0) * self.target.slack();
        let spacing = match self.mesh.kind {
            MeshKind::Matched => {
                let layer = h.map(|h| (h, self.target.back));
                Some(Spacing::matched(cells, radius, layer, speed, edge))
            }
            MeshKind::Paper => Spacing::paper(cells, h),
        };
        let name = format!("{}.thickness", values.layer_paths("target")[0]);
        if spacing.is_none() {
            let what = format!(
                ": the paper mesh needs a whole number of cells through the layer, not thickness·cells = {}",
                h.unwrap_or_default() * cells as f64
            );
            values.refuse(&name, &what, &format!("change {name} or mesh.cells"));
        }
        let spacing = self.check_rows(values, spacing?, &name)?;
        Some(Rows::single(spacing, self.target.back))
    }

    /// The spacing of a target of one layer, if there are rows enough for the scheme.
    fn check_rows(&self, values: &Values<'_>, spacing: Spacing, name: &str) -> Option<Spacing> {
        let (fewest, reason) = match self.target.back {
            _ if self.model.has_shear() => (FEWEST_ROWS, "model = \"elastic\""),
            Back::Free => (FEWEST, "target.back = \"free\""),
            Back::Rigid => return Some(spacing),
        };
        let Some(rows) = spacing.layer_rows.filter(|rows| *rows < fewest) else { return Some(spacing) };
        let what = format!(": the layer has {rows} rows of cells, too few for {reason}");
        values.refuse(name, &what, &format!("allowed: at least {fewest}; make mesh.cells or {name} larger"));
        None
    }

    /// Notes why several layers have no rows.
    fn refuse_rows(&self, values: &Values<'_>, stack: &Stack, error: RowsError) {
        let cells = self.mesh.cells;
        let finer = || match stack.finer(cells, LARGEST_CHANGE) {
            Some(cells) => format!("mesh.cells = {cells} would do"),
            None => "make mesh.cells larger".into(),
        };
        let of_target = self.target.computed().len();
        let thickness = |number: usize| match &self.indenter.striker {
            Some(striker) if number >= of_target => {
                let paths = values.layer_paths(BODY.path);
                format!("{}.thickness", paths[striker.body.first_of(number - of_target).min(paths.len() - 1)])
            }
            _ => format!("{}.thickness", values.layer_paths("target")[self.target.first_of(number)]),
        };
        match error {
            RowsError::TooMany(rows) => {
                let message = format!("`mesh.cells` = {cells} makes {rows:.3e} rows through the layers");
                let help = format!("allowed: at most {MAX_ROWS:e} rows; make mesh.cells smaller");
                values.problem("mesh.cells", message, help);
            }
            RowsError::Thin(number, fewest) => {
                let what = format!(": with mesh.cells = {cells} the layer is thinner than {fewest} rows");
                values.refuse(&thickness(number), &what, &finer());
            }
            RowsError::Change(number, change) => {
                let what = format!(
                    ": with mesh.cells = {cells} waves cross all layers in whole steps only if the wave speed of this one is changed \
                     by {:.2} %",
                    100.0 * change
                );
                let help = format!("allowed: up to {} %; {}", 100.0 * LARGEST_CHANGE, finer());
                values.refuse(&thickness(number), &what, &help);
            }
        }
    }

    /// Number of the last step.
    pub(super) fn steps(&self, values: &Values<'_>, dt: f64) -> Option<f64> {
        let steps = (self.run.end_time / dt).round();
        if !(1.0..=MAX_STEPS).contains(&steps) {
            let [step, least, most] =
                [dt, 0.501 * dt, 0.999 * MAX_STEPS * dt].map(|time| match self.scales {
                    None => format!("{time:.4e}"),
                    Some(_) => self.units().time.text(time),
                });
            let what = match steps < 1.0 {
                true => format!(" is shorter than half a step of {step}"),
                false => format!(" takes {steps:.4e} steps of {step}"),
            };
            let help = format!(
                "allowed: 1 to {MAX_STEPS:e} steps, from {least} to {most}; mesh.cells changes the step"
            );
            values.refuse("run.end_time", &what, &help);
            return None;
        }
        // log times are nanoseconds in 64 bits; half of that range is 292 years
        let rate = self.record.playback_rate;
        let seconds = self.scales.map_or(1.0, |scales| scales.of(Dimension::Time)) * self.run.end_time;
        if 1e9 * rate * seconds > i64::MAX as f64 {
            let what = format!(
                " with `record.playback_rate` = {rate:?} puts the end of the run more than 292 years away"
            );
            values.refuse("run.end_time", &what, "make record.playback_rate or run.end_time smaller");
            return None;
        }
        Some(steps)
    }

    /// Largest radius that contact can reach on a flat surface \[R\]: at the depth to which the last step, K, moves the indenter,
    /// by partial contact, an average over one spacing in r and one step and a half in depth.
    ///
    /// ```text
    /// f(r_contact − Δr) = V0·(K + 1)·Δt + (3/2)V0·Δt       not beyond the radius of a punch
    /// ```
    pub(super) fn contact_reach(&self, dr: f64, dt: f64, steps: f64) -> f64 {
        if let Some(load) = &self.load {
            return self.within_rims(load.radius.unwrap_or(dr));
        }
        let shape = self.indenter.shape();
        let step = self.impact.velocity * dt;
        self.within_rims((shape.reach(step * (steps + 1.0 + HALF_WIDTH)) + dr).min(shape.radius()))
    }

    /// Outer radius of the mesh \[R\]: so large that no wave arrives there, whatever is recorded.
    ///
    /// ```text
    /// r_max = r_contact + c·t_end + margin
    /// ```
    ///
    /// with the largest `c = c_s` (model `elastic`: c_p) of all layers and the width of the precursor as margin.
    fn outer_radius(&self, values: &Values<'_>, rows: &Rows, steps: f64, contact_reach: f64) -> Option<f64> {
        let computed = self.target.computed();
        let run = rows::lateral_speed(self.model, &computed, &rows.layers, rows.dt) * steps * rows.dt;
        let margin = (PRECURSOR * libm::cbrt(steps) + 2.0).ceil() * rows.dr;
        self.check_outer_radius(values, contact_reach, contact_reach + run + margin, rows.dr)
    }

    /// The outer radius that is given, if it is sound, else one that no wave reaches.
    ///
    /// * `reach`: such a one
    pub(super) fn check_outer_radius(
        &self,
        values: &Values<'_>,
        contact_reach: f64,
        reach: f64,
        dr: f64,
    ) -> Option<f64> {
        let striker = self.indenter.rim();
        let bodies = [("target.radius", self.target.radius), ("indenter.body.radius", striker)];
        for (name, radius) in bodies {
            if radius.is_some_and(|radius| radius < FEWEST_COLUMNS * dr) {
                let (key, _) = self.mesh.density();
                let name =
                    if values.is_given(name) || name == "target.radius" { name } else { "indenter.radius" };
                let what = format!("`{name}` is less than five columns of the mesh");
                values.problem(name, what, format!("make it or {key} larger"));
                return None;
            }
        }
        let apart = self.target.radius.zip(striker).map_or(0.0, |(target, striker)| (target - striker).abs());
        if apart > 0.0 && apart < dr {
            let [step, apart] = [dr, apart].map(|length| self.units().length.text(length));
            let message =
                format!("target and indenter differ by {apart} in radius, and columns of the mesh by {step}");
            values.problem("target.radius", message, "make the radii equal, or the mesh finer");
            return None;
        }
        if let Some(radius) = self.target.radius {
            if values.is_given("mesh.outer_radius") {
                let what = " is given, but the target ends at target.radius";
                values.problem("mesh.outer_radius", format!("`mesh.outer_radius`{what}"), "leave it out");
            }
            self.record.check_radii(values, radius, reach)?;
            return Some(radius);
        }
        let Some(given) = values.number("mesh.outer_radius") else { return Some(reach) };
        // nodes beside the contact on any mesh
        let least = contact_reach + 2.0 * dr;
        if given >= least {
            self.record.check_radii(values, given, reach)?;
            return Some(given);
        }
        // no number that is refused is offered
        let [reach, least] = [contact_reach, 1.001 * least].map(|r| match self.scales {
            None => format!("{r:.4}"),
            Some(_) => self.units().length.text(r),
        });
        let help = format!(
            "contact reaches r = {reach}; allowed: at least {least}, or leave the key out to have it derived"
        );
        values.refuse("mesh.outer_radius", " leaves no nodes beside the contact", &help);
        None
    }
}
