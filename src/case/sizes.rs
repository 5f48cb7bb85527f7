//! Sizes derived from a sound case: node distances, steps, radius and depth of the mesh.

use super::{
    Body, Impact, Record, Run, Sizes, Target,
    document::{Document, Given, Span},
};
use crate::{
    contact::HALF_WIDTH,
    grid::{Edge, MeshKind, Spacing},
    model::{
        CORNER_MARGIN, ModelKind,
        elastic::FEWEST_ROWS,
        scheme::{Corner, Order},
    },
    units::{Dimension, Scales, Units},
};

/// Largest number of steps of a run.
const MAX_STEPS: f64 = 1e8;
/// Largest number of nodes.
const MAX_NODES: f64 = 1e9;
/// Largest number of displacements in memory, 24 GB: three levels of as many nodes, or of half as many in the full theory.
const MAX_NUMBERS: f64 = 3e9;
/// Width of the precursor that runs ahead of a wave on a mesh with dispersion, in nodes per cube root of the number
/// of steps: beyond it the field is below 1e-16 (measured; its head is an Airy function).
const PRECURSOR: f64 = 6.0;

/// The `[mesh]` section.
pub(super) struct GivenMesh {
    pub kind: MeshKind,
    pub cells: Given<u64>,
    pub outer_radius: Option<Given<f64>>,
    pub order: Option<Order>,
    pub damping: f64,
}

/// A sound case without its sizes.
pub(super) struct Plan<'a> {
    pub model: ModelKind,
    pub scales: Option<Scales>,
    pub target: &'a Target,
    pub indenter: &'a Body,
    pub impact: Impact,
    pub run: Run,
    pub record: &'a Record,
}

impl Plan<'_> {
    /// Derives the sizes, or notes why there are none.
    ///
    /// * `thickness`, `end_time`: places of these keys
    pub(super) fn sizes(
        &self,
        doc: &Document,
        mesh: &GivenMesh,
        thickness: Span,
        end_time: Span,
    ) -> Option<Sizes> {
        let spacing = self.spacing(doc, mesh, thickness)?;
        let dt = spacing.dz;
        let steps = self.steps(doc, dt, end_time)?;
        let contact_reach = self.contact_reach(spacing, steps);
        let outer = self.outer_radius(doc, mesh, spacing, steps, contact_reach)?;
        let nr = (outer / spacing.dr - 1e-9).ceil().max(1.0);
        // rows that the scheme moves ahead of a wave
        let corner = mesh.order.and_then(|order| Corner::new(order, mesh.damping));
        let ahead = corner.map_or(2.0, |_| CORNER_MARGIN as f64);
        let nz = match spacing.layer_rows {
            Some(rows) => rows as f64,
            // the wave travels one row per step; where only the surface is observed, half as deep is enough, and for points the
            // mean of both
            None if !self.record.frames.is_none() => steps + ahead,
            None => ((steps + self.record.deepest(spacing.dz)) / 2.0).ceil().min(steps) + ahead,
        };
        let most = (MAX_NUMBERS / self.model.numbers_per_node(corner.as_ref()) as f64).min(MAX_NODES);
        if nr * nz > most {
            let message = format!(
                "`mesh.cells` = {} makes a mesh of {:.3e} nodes, {nr} along r, {nz} along z",
                mesh.cells.value,
                nr * nz
            );
            let help = format!("allowed: at most {most:e}; make mesh.cells or run.end_time smaller");
            doc.problem(mesh.cells.span.clone(), message, help);
            return None;
        }
        Some(Sizes {
            dr: spacing.dr,
            dz: spacing.dz,
            dt,
            steps: steps as u64,
            nr: nr as usize,
            nz: nz as usize,
            outer_radius: nr * spacing.dr,
            depth: nz * spacing.dz,
            contact_reach,
            layer: spacing.layer_rows.is_some(),
        })
    }

    /// Units of a physical case.
    fn units(&self) -> Option<Units> {
        self.scales.map(|scales| Units::new(scales.geometry, Some(scales)))
    }

    fn spacing(&self, doc: &Document, mesh: &GivenMesh, thickness: Span) -> Option<Spacing> {
        let cells = mesh.cells.value as usize;
        let c_s = self.target.material.shear_wave_speed;
        let spacing = match mesh.kind {
            MeshKind::Matched => {
                let edge = match mesh.order {
                    Some(Order::Second) => Edge::SECOND,
                    Some(Order::Fourth) => Edge::FOURTH,
                    None => Edge::elastic(c_s),
                };
                let (radius, h) = (self.indenter.radius, self.target.thickness);
                let speed = self.model.lateral_speed(c_s);
                let spacing = Spacing::matched(cells, radius, h, speed, edge);
                return self.check_rows(doc, spacing, thickness);
            }
            MeshKind::Paper => Spacing::paper(cells, self.target.thickness),
        };
        if spacing.is_none() {
            let message = format!(
                "`target.thickness` = {}: the paper mesh needs a whole number of cells through the layer, not thickness·cells = {}",
                doc.written(&thickness),
                self.target.thickness.unwrap_or_default() * cells as f64
            );
            doc.problem(thickness, message, "change target.thickness or mesh.cells");
        }
        spacing
    }

    /// The spacing, if there are rows enough for the scheme.
    ///
    /// * `thickness`: its place
    fn check_rows(&self, doc: &Document, spacing: Spacing, thickness: Span) -> Option<Spacing> {
        match spacing.layer_rows {
            Some(rows) if self.model == ModelKind::Elastic && rows < FEWEST_ROWS => {
                let message = format!(
                    "`target.thickness` = {}: the layer has {rows} rows of cells, too few for model = \"elastic\"",
                    doc.written(&thickness)
                );
                let help =
                    format!("allowed: at least {FEWEST_ROWS}; make mesh.cells or target.thickness larger");
                doc.problem(thickness, message, help);
                None
            }
            _ => Some(spacing),
        }
    }

    /// Number of the last step.
    fn steps(&self, doc: &Document, dt: f64, end_time: Span) -> Option<f64> {
        let steps = (self.run.end_time / dt).round();
        if !(1.0..=MAX_STEPS).contains(&steps) {
            let units = self.units();
            let [step, least, most] = [dt, 0.501 * dt, 0.999 * MAX_STEPS * dt]
                .map(|time| units.map_or_else(|| format!("{time:.4e}"), |units| units.time.text(time)));
            let given = doc.written(&end_time);
            let message = if steps < 1.0 {
                format!("`run.end_time` = {given} is shorter than half a step of {step}")
            } else {
                format!("`run.end_time` = {given} takes {steps:.4e} steps of {step}")
            };
            let help = format!(
                "allowed: 1 to {MAX_STEPS:e} steps, from {least} to {most}; mesh.cells changes the step"
            );
            doc.problem(end_time, message, help);
            return None;
        }
        // log times are nanoseconds in 64 bits; half of that range is 292 years
        let rate = self.record.playback_rate;
        let seconds = self.scales.map_or(1.0, |scales| scales.of(Dimension::Time)) * self.run.end_time;
        if 1e9 * rate * seconds > i64::MAX as f64 {
            let message = format!(
                "`run.end_time` = {} with `record.playback_rate` = {rate:?} puts the end of the run more than 292 years away",
                doc.written(&end_time)
            );
            doc.problem(end_time, message, "make record.playback_rate or run.end_time smaller");
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
    fn contact_reach(&self, spacing: Spacing, steps: f64) -> f64 {
        let shape = self.indenter.shape();
        let step = self.impact.velocity * spacing.dz;
        (shape.reach(step * (steps + 1.0 + HALF_WIDTH)) + spacing.dr).min(shape.radius())
    }

    /// Outer radius of the mesh \[R\]: so large that no wave returns from it to the contact and to what is recorded at a radius
    /// beyond it, or, where fields or lines along r are recorded, that no wave arrives there.
    ///
    /// ```text
    /// r_max = r_contact + c·t_end/2 + margin      with fields: r_contact + c·t_end + margin
    ///                                             with points: r_contact + (c·t_end + r_point − r_contact)/2 + margin
    /// ```
    ///
    /// with `c = c_s` (model `elastic`: 1) and the width of the precursor as margin.
    fn outer_radius(
        &self,
        doc: &Document,
        mesh: &GivenMesh,
        spacing: Spacing,
        steps: f64,
        contact_reach: f64,
    ) -> Option<f64> {
        let speed = self.model.lateral_speed(self.target.material.shear_wave_speed);
        let run = speed * steps * spacing.dz;
        let margin = (PRECURSOR * steps.cbrt() + 2.0).ceil() * spacing.dr;
        if let Some(given) = &mesh.outer_radius {
            // nodes beside the contact on any mesh
            let least = contact_reach + 2.0 * spacing.dr;
            if given.value >= least {
                let reach = contact_reach + run + margin;
                self.record.check_radii(doc, given, reach)?;
                return Some(given.value);
            }
            let message = format!(
                "`mesh.outer_radius` = {} leaves no nodes beside the contact",
                doc.written(&given.span)
            );
            let units = self.units();
            // no number that is refused is offered
            let [reach, least] = [contact_reach, 1.001 * least]
                .map(|r| units.map_or_else(|| format!("{r:.4}"), |units| units.length.text(r)));
            let help = format!(
                "contact reaches r = {reach}; allowed: at least {least}, or leave the key out to have it derived"
            );
            doc.problem(given.span.clone(), message, help);
            return None;
        }
        let fields = !self.record.frames.is_none() && !self.record.fields.is_empty();
        let widest = if fields { f64::INFINITY } else { self.record.widest() };
        let beside = (widest - contact_reach).clamp(0.0, run);
        Some(contact_reach + 0.5 * (run + beside) + margin)
    }
}
