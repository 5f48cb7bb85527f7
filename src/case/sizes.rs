//! Sizes derived from a sound case: node distances, steps, radius and depth of the mesh.

use super::{
    BodySizes, LayerSizes, Parameters, Sizes, Target,
    keys::BODY,
    rows::{self, LARGEST_CHANGE, NoRows, Rows, Stack},
    values::Values,
};
use crate::{
    contact::HALF_WIDTH,
    grid::{Back, FEWEST, Growth, MeshKind, Spacing, outer_radius},
    model::{Dependence, cone::rows_ahead, elastic::FEWEST_ROWS, strain::NEAR_ROWS},
    units::Dimension,
};

const MAX_STEPS: f64 = 1e8;
const MAX_NODES: f64 = 1e9;
/// Largest number of displacements in memory, 24 GB: three levels of as many nodes, or of half as many in the full theory.
const MAX_NUMBERS: f64 = 3e9;
/// Width of the precursor that runs ahead of a wave on a mesh with dispersion, in nodes per cube root of the number
/// of steps: beyond it the field is below 1e-16 (measured; its head is an Airy function).
const PRECURSOR: f64 = 6.0;
/// Cells of a graded mesh beyond the way of the fastest waves.
const MARGIN: f64 = 8.0;
/// Fewest columns of a body that ends.
const FEWEST_COLUMNS: f64 = 4.5;

impl Parameters {
    /// The target, and an indenter that gives.
    pub(super) fn bodies(&self) -> impl Iterator<Item = &Target> {
        std::iter::once(&self.target).chain(self.indenter.striker.as_ref().map(|striker| &striker.body))
    }

    /// Derives the sizes of a sound case without them, or notes why there are none.
    ///
    /// The mesh is so wide that no wave arrives at its end, whatever is recorded:
    ///
    /// ```text
    /// r_max = r_contact + c·t_end + margin
    /// ```
    ///
    /// with the largest c of waves along r in any layer. The margin is the width of the precursor, on a graded mesh some cells.
    pub(super) fn derive_sizes(&self, values: &Values<'_>) -> Option<Sizes> {
        let (grading, striker) = (self.mesh.grading.as_ref(), self.bodies().nth(1));
        let Rows { dr, dt, speed, mut layers } = match grading {
            Some(grading) => self.graded_step(grading),
            None => self.rows(values)?,
        };
        let steps = self.steps(values, dt)?;
        let contact_reach = self.contact_reach(dr, dt, steps);
        let run = speed * steps * dt;
        let margin = match grading {
            Some(_) => MARGIN * dr,
            None => (PRECURSOR * libm::cbrt(steps) + 2.0).ceil() * dr,
        };
        let outer = self.check_outer_radius(values, contact_reach, contact_reach + run + margin, dr)?;
        let is_bounded = self.target.radius.is_some() || striker.is_some();
        let (widths, [nr, striker_nr]) = match grading {
            Some(grading) => {
                self.check_near_zone(values, grading, outer, dr)?;
                self.columns(outer, &grading.growth(dr))
            }
            None if is_bounded => self.columns(outer, &Growth::none(dr)),
            None => (Vec::new(), [(outer / dr - 1e-9).ceil().max(1.0) as usize, 0]),
        };
        if let Some(grading) = grading {
            let layers_of = |body| self.graded_layers(body, dt, dr, run + margin, grading);
            layers = self.bodies().flat_map(layers_of).collect();
        }
        let mut above = layers.split_off(self.target.computed().len());
        let (has_back, interfaces) = (self.target.thickness.is_some(), layers.len() - 1);
        let corner = self.corner();
        let [mut strained, mut covered] = [0; 2];
        if grading.is_none() {
            let reach = if corner.is_some() { 2 } else { 1 };
            let finite = if has_back { &layers[..] } else { &layers[..interfaces] };
            let finite = finite.iter().map(|layer| layer.steps).sum::<usize>();
            // what strains and tension of interfaces are taken of, and what is recorded, with the row below
            strained = finite.max(NEAR_ROWS) + 2;
            let all = !self.record.frames.is_none();
            let recorded = if all { MAX_STEPS } else { rows::steps_to(&layers, self.record.deepest()) };
            covered = strained.max(recorded.min(MAX_STEPS) as usize + 2);
            // the wave travels one row per step
            let moved = steps as usize + 2 + rows_ahead(reach);
            let needed = Dependence { last_step: steps as usize, depths: covered };
            if !has_back {
                layers[interfaces].steps =
                    needed.deepest(reach).min(moved).saturating_sub(finite).max(FEWEST);
            }
            if let Some(last) =
                above.last_mut().filter(|_| striker.is_some_and(|body| body.thickness.is_none()))
            {
                // waves do not get there
                last.steps = steps as usize + 2;
            }
        }
        let nz = layers.iter().map(|layer| layer.steps).sum::<usize>() + interfaces;
        if grading.is_some() {
            [strained, covered] = [nz + 1; 2];
        }
        let striker = striker.map(|_| BodySizes { nr: striker_nr, layers: above });
        let most = (MAX_NUMBERS / self.model.numbers_per_node(corner.as_ref()) as f64).min(MAX_NODES);
        let nodes = nr as f64 * nz as f64 + striker.as_ref().map_or(0, BodySizes::nodes) as f64;
        if nodes > most {
            let (key, cells) = self.mesh.density();
            let message =
                format!("`{key}` = {cells} makes a mesh of {nodes:.3e} nodes, {nr} along r, {nz} along z");
            let or = match grading {
                Some(_) => "smaller or mesh.grading larger",
                None => "or run.end_time smaller",
            };
            values.problem(key, message, format!("allowed: at most {most:e}; make {key} {or}"))?;
        }
        Some(Sizes {
            dr,
            dz: layers[0].dz,
            dt,
            steps: steps as u64,
            nr,
            nz,
            outer_radius: match (self.target.radius, widths.get(..=nr)) {
                (Some(radius), _) => radius,
                (None, Some(widths)) => outer_radius(widths),
                (None, None) => nr as f64 * dr,
            },
            depth: layers.iter().map(LayerSizes::thickness).sum(),
            contact_reach,
            strained,
            covered,
            has_back,
            layers,
            widths,
            striker,
        })
    }

    fn rows(&self, values: &Values<'_>) -> Option<Rows> {
        let computed = self.target.computed();
        let cells = self.mesh.cells;
        // a load needs no edge between nodes
        let radius = self.indenter.radius.filter(|_| self.load.is_none());
        let h = self.target.thickness;
        let edge = rows::edge(self.mesh.order, &self.target);
        if computed.len() > 1 || self.indenter.striker.is_some() {
            let stack = Stack::new(self);
            let refuse = |why| self.refuse_rows(values, &stack, why);
            return stack.rows(cells).map_err(refuse).ok();
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
        let Spacing { dr, dz, layer_rows } = spacing?;
        let (fewest, reason) = match self.target.back {
            _ if self.model.has_shear() => (FEWEST_ROWS, "model = \"elastic\""),
            Back::Free => (FEWEST, "target.back = \"free\""),
            Back::Rigid => (0, ""),
        };
        if let Some(rows) = layer_rows.filter(|rows| *rows < fewest) {
            let what = format!(": the layer has {rows} rows of cells, too few for {reason}");
            let help = format!("allowed: at least {fewest}; make mesh.cells or {name} larger");
            values.refuse(&name, &what, &help)?;
        }
        let (steps, overhang) = (layer_rows.unwrap_or(0), self.target.back.overhang());
        let layers = vec![LayerSizes { steps, overhang, dz, ..LayerSizes::default() }];
        Some(Rows { dr, dt: dz, speed: rows::lateral_speed(self.model, &computed, &layers, dz), layers })
    }

    /// Notes why several layers have no rows.
    fn refuse_rows(&self, values: &Values<'_>, stack: &Stack, (number, what, allowed): NoRows) -> Option<()> {
        let Some(number) = number else { return values.problem("mesh.cells", what, allowed) };
        let finer = match stack.finer(self.mesh.cells, LARGEST_CHANGE) {
            Some(cells) => format!("mesh.cells = {cells} would do"),
            None => "make mesh.cells larger".into(),
        };
        let of_target = self.target.computed().len();
        let layer = match &self.indenter.striker {
            Some(striker) if number >= of_target => {
                let mut paths = values.layer_paths(BODY.path);
                let last = paths.len() - 1;
                paths.swap_remove(striker.body.first_of(number - of_target).min(last))
            }
            _ => values.layer_paths("target").swap_remove(self.target.first_of(number)),
        };
        values.refuse(&format!("{layer}.thickness"), &what, &(allowed + &finer))
    }

    fn steps(&self, values: &Values<'_>, dt: f64) -> Option<f64> {
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
            values.refuse("run.end_time", &what, &help)?;
        }
        // log times are nanoseconds in 64 bits; half of that range is 292 years
        let rate = self.record.playback_rate;
        let seconds = self.scales.map_or(1.0, |scales| scales.of(Dimension::Time)) * self.run.end_time;
        if 1e9 * rate * seconds > i64::MAX as f64 {
            let what = format!(
                " with `record.playback_rate` = {rate:?} puts the end of the run more than 292 years away"
            );
            values.refuse("run.end_time", &what, "make record.playback_rate or run.end_time smaller")?;
        }
        Some(steps)
    }

    /// Largest radius that contact can reach on a flat surface \[R\]: at the depth to which the last step, K, moves the indenter,
    /// by partial contact, an average over one spacing in r and one step and a half in depth.
    ///
    /// ```text
    /// f(r_contact − Δr) = V0·(K + 1)·Δt + (3/2)V0·Δt       not beyond the radius of a punch
    /// ```
    fn contact_reach(&self, dr: f64, dt: f64, steps: f64) -> f64 {
        if let Some(load) = &self.load {
            return self.within_rims(load.radius.unwrap_or(dr));
        }
        let shape = self.indenter.shape();
        let step = self.impact.velocity * dt;
        self.within_rims((shape.reach(step * (steps + 1.0 + HALF_WIDTH)) + dr).min(shape.radius()))
    }

    /// The outer radius that is given, if it is sound, else one that no wave reaches.
    ///
    /// * `reach`: such a one
    fn check_outer_radius(
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
                values.problem(name, what, format!("make it or {key} larger"))?;
            }
        }
        let apart = self.target.radius.zip(striker).map_or(0.0, |(target, striker)| (target - striker).abs());
        if apart > 0.0 && apart < dr {
            let [step, apart] = [dr, apart].map(|length| self.units().length.text(length));
            let message =
                format!("target and indenter differ by {apart} in radius, and columns of the mesh by {step}");
            values.problem("target.radius", message, "make the radii equal, or the mesh finer")?;
        }
        if let Some(radius) = self.target.radius {
            let what = " is given, but the target ends at target.radius";
            values.unwanted("mesh.outer_radius", what, "leave it out");
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
        let [reach, least] = [contact_reach, 1.001 * least].map(|r| self.units().length.text(r));
        let help = format!(
            "contact reaches r = {reach}; allowed: at least {least}, or leave the key out to have it derived"
        );
        values.refuse("mesh.outer_radius", " leaves no nodes beside the contact", &help)?;
        None
    }
}
