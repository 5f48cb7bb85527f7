//! Graded meshes: when a case has one, and the sizes of its cells.
//!
//! Near the contact cells are alike, so small that `contact_cells` are across the largest contact; beyond the near zone each is by a ratio larger than
//! the one before it, outwards without end, downwards as far as waves of the contact are resolved. A layer has whole rows, stretched a little to its
//! thickness: a row may be higher than waves run in a step, and no wave speed is changed. Where nothing ends the target the mesh does, so far away that no wave
//! gets there, which takes a logarithm of cells.

use super::{
    Body, GradedSizes, Grading, LayerSizes, Parameters, Sizes, TargetLayer, keys::GRADED, sizes::MAX_NODES, values::Values,
};
use crate::{
    contact::Rule,
    grid::{Growth, Spacing},
    model::{ModelKind, elastic::FEWEST_ROWS},
    shape::{Head, hertz_duration},
};

/// Default of `mesh.contact_cells`.
const CONTACT_CELLS: i64 = 20;
/// Default of `mesh.grading`.
const RATIO: f64 = 1.05;
/// Near zone by default, in largest contact radii.
const NEAR: f64 = 1.5;
/// Rows that resolve what a contact gives off, in the way of shear waves during it.
const ROWS_PER_CONTACT: f64 = 40.0;
/// Cells beyond the way of the fastest waves.
const MARGIN: f64 = 8.0;
/// Default of `mesh.cells`.
const CELLS: i64 = 100;
/// Slack for lengths that are sums of cells but for rounding.
const ROUNDING: f64 = 1e-9;


pub(super) const GRADED: [&str; 5] =
    ["contact_cells", "grading", "near_radius", "near_depth", "largest_cell"];

/// Chooses between a graded mesh and one of equal cells.
pub(super) fn choose(values: &mut Values<'_>, indenter: Option<&Body>) {
    let spreads = indenter.is_some_and(|indenter| indenter.shape().spreads());
    let is_free = values.get("impact.contact") == Some(Rule::Unilateral);
    let is_physical = values.system.scales.is_some();
    let is_elastic = values.model == ModelKind::Elastic;
    let by_default = is_elastic && is_physical && spreads && is_free && !values.is_given("mesh.cells");
    if by_default && !values.is_given("mesh.contact_cells") {
        values.set("mesh.contact_cells", CONTACT_CELLS);
    }
    if values.checked.contains_key("mesh.contact_cells") {
        if values.number("mesh.grading").is_none() {
            values.set("mesh.grading", RATIO);
        }
        return;
    }
    if !values.is_given("mesh.cells") {
        values.set("mesh.cells", CELLS);
    }
    let given = GRADED.map(|key| format!("mesh.{key}")).into_iter().find(|key| values.is_given(key));
    if let Some(key) = given.filter(|_| is_elastic) {
        let message = format!("`{key}` is of a graded mesh, and this one has equal cells");
        values.problem(&key, message, "leave the key out, or give mesh.contact_cells in place of mesh.cells");
    }
}

/// What a graded mesh does.
#[derive(Clone, Copy, Debug)]
pub struct GradingFacts {
    /// How it is made.
    pub grading: Grading,
    /// Wavelengths that ten rows are across, at the surface, in the middle of the target's depth and at its back \[R\].
    pub wavelengths: [f64; 3],
    /// Nodes relative to those of equal cells of the smallest size.
    pub work: f64,
}

impl Parameters {
    /// What the graded mesh does, if it is one.
    pub fn grading_facts(&self) -> Option<GradingFacts> {
        let grading = self.mesh.grading?;
        let Sizes { dr, dz, nr, nz, outer_radius, depth, ref graded, .. } = self.sizes;
        let heights: Vec<f64> = graded.as_ref()?.heights.concat();
        let mut end = 0.0;
        let middle = heights.iter().find(|height| {
            end += *height;
            end >= 0.5 * depth
        });
        let last = heights[heights.len() - 1];
        let wavelengths = [dz, *middle.unwrap_or(&last), last].map(|height| 10.0 * height);
        let alike = (outer_radius / dr) * (depth / dz);
        Some(GradingFacts { grading, wavelengths, work: nr as f64 * (nz + 1) as f64 / alike })
    }

    /// Notes how the mesh is graded, if it is.
    pub(super) fn grade(&mut self, values: &mut Values<'_>) -> Option<()> {
        let Some(contact_cells) = values.get::<usize>("mesh.contact_cells") else { return Some(()) };
        let radius = self.likely_radius();
        let near =
            ["mesh.near_radius", "mesh.near_depth"].map(|key| values.number(key).unwrap_or(NEAR * radius));
        let largest = values.number("mesh.largest_cell");
        let ratio = values.number("mesh.grading")?;
        if radius <= 0.0 {
            let what = " needs a contact that has a radius, and the estimated one is 0";
            values.refuse("mesh.contact_cells", what, "give mesh.cells in its place");
            return None;
        }
        self.mesh.grading = Some(Grading { contact_cells, ratio, near, largest });
        self.mesh.cells = (1.0 / self.smallest_cell(contact_cells)).round().max(1.0) as usize;
        Some(())
    }

    /// Puts what a graded mesh was made of into the values.
    pub(super) fn complete_grading(&self, values: &mut Values<'_>) {
        let Some(Grading { near: [radius, depth], .. }) = self.mesh.grading else { return };
        values.set("mesh.near_radius", radius);
        values.set("mesh.near_depth", depth);
    }

    /// Size of the cells near the contact \[R\].
    fn smallest_cell(&self, contact_cells: usize) -> f64 {
        match (&self.indenter.head, self.indenter.radius) {
            (Head::Flat { edge_radius: 0.0 }, Some(radius)) => {
                let edge = super::rows::edge(self.mesh.order, &self.target);
                Spacing::radial(contact_cells / 2, Some(radius), edge, None)
            }
            _ => 2.0 * self.likely_radius() / contact_cells as f64,
        }
    }

    /// Time of contact by Hertz, if there is an estimate \[R/c_p\].
    fn contact_time(&self) -> Option<f64> {
        let (Head::Sphere { nose_radius } | Head::Paraboloid { nose_radius }) = self.indenter.head else {
            return None;
        };
        let depth = self.likely_radius().powi(2) / nose_radius;
        self.indenter.mass.is_finite().then(|| hertz_duration(depth, self.impact.velocity))
    }

    /// Derives the sizes of a graded mesh, or notes why there are none.
    pub(super) fn graded_sizes(
        &self,
        values: &Values<'_>,
        grading: &Grading,
        computed: &[TargetLayer],
    ) -> Option<Sizes> {
        let &Grading { contact_cells, ratio, near: [near_radius, near_depth], largest } = grading;
        let first = self.smallest_cell(contact_cells);
        let fastest = computed.iter().map(|layer| layer.wave_speed).fold(0.0, f64::max);
        // a layer has rows enough, however thin it is
        let thinnest = computed.iter().filter_map(|layer| Some(layer.thickness? / layer.wave_speed));
        let dt = thinnest.map(|transit| transit / (FEWEST_ROWS as f64 + 0.5)).fold(first / fastest, f64::min);
        let steps = self.steps(values, dt)?;
        let contact_reach = self.contact_reach(first, dt, steps);
        let run = fastest * steps * dt;
        let reach = contact_reach + run + MARGIN * first;
        let outer = self.check_outer_radius(values, contact_reach, reach, first)?;
        let limit = largest.unwrap_or(f64::INFINITY);
        let columns = Growth { first, near: near_radius, ratio, largest: limit.max(first) };
        if near_radius > outer || self.target.thickness.is_some_and(|thickness| near_depth > thickness) {
            let (key, what) = match near_radius > outer {
                true => ("mesh.near_radius", " is beyond the mesh"),
                false => ("mesh.near_depth", " is below the target"),
            };
            if values.is_given(key) {
                values.refuse(key, what, "make it smaller, or leave it out");
                return None;
            }
        }
        let near_nodes = (near_radius / first) * (near_depth / first);
        if near_nodes > NEAR_NODES {
            let message = format!("the near zone has {near_nodes:.3e} nodes");
            let help = format!(
                "allowed: {NEAR_NODES:e}; make mesh.contact_cells, mesh.near_radius or mesh.near_depth smaller"
            );
            values.problem("mesh.contact_cells", message, help);
            return None;
        }
        // the first width is that of a cell about the axis, half of which is on either side
        let mut widths = vec![first];
        widths.extend(columns.sizes((outer - 0.5 * first) * (1.0 - ROUNDING)));
        let nr = widths.len() - 1;
        let heights = self.heights(computed, dt, first, run, grading);
        let rows: usize = heights.iter().map(|heights| heights.len() + 1).sum();
        let most = (MAX_NODES).min(3e9 / 6.0);
        if (nr * rows) as f64 > most {
            let message = format!(
                "`mesh.contact_cells` = {contact_cells} makes a mesh of {:.3e} nodes, {nr} along r, {rows} along z",
                (nr * rows) as f64
            );
            let help =
                format!("allowed: at most {most:e}; make mesh.contact_cells smaller or mesh.grading larger");
            values.problem("mesh.contact_cells", message, help);
            return None;
        }
        let layer = self.target.thickness.is_some();
        let overhang =
            |number: usize| if number + 1 == computed.len() { self.target.back.overhang() } else { 0.0 };
        let layers: Vec<LayerSizes> = heights
            .iter()
            .enumerate()
            .map(|(number, heights)| LayerSizes {
                steps: heights.len(),
                overhang: overhang(number),
                dz: heights[0],
                speed_change: 0.0,
            })
            .collect();
        let depth = heights
            .iter()
            .zip(&layers)
            .map(|(heights, layer)| heights.iter().sum::<f64>() + layer.overhang * heights[heights.len() - 1])
            .sum();
        Some(Sizes {
            dr: first,
            dz: heights[0][0],
            dt,
            steps: steps as u64,
            nr,
            nz: rows - 1,
            outer_radius: widths[..nr].iter().sum::<f64>() - 0.5 * first,
            depth,
            contact_reach,
            strained: rows,
            covered: rows,
            layer,
            layers,
            graded: Some(GradedSizes { widths, heights }),
        })
    }

    /// Heights of the rows of every layer.
    ///
    /// * `first`: of a row near the contact
    /// * `run`: way of the fastest waves
    fn heights(
        &self,
        computed: &[TargetLayer],
        dt: f64,
        first: f64,
        run: f64,
        grading: &Grading,
    ) -> Vec<Vec<f64>> {
        let (mut all, mut top, mut size) = (Vec::new(), 0.0, first);
        for (number, layer) in computed.iter().enumerate() {
            let least = layer.wave_speed * dt;
            let by_pulse =
                self.contact_time().map_or(f64::INFINITY, |time| layer.waves.shear * time / ROWS_PER_CONTACT);
            let largest = grading.largest.unwrap_or(by_pulse).max(first).max(least);
            let growth = Growth { first, near: grading.near[1], ratio: grading.ratio, largest };
            size = size.min(largest).max(least);
            let is_last = number + 1 == computed.len();
            let overhang = if is_last { self.target.back.overhang() } else { 0.0 };
            let mut heights = Vec::new();
            let mut depth = 0.0;
            let thickness = layer.thickness.unwrap_or(run + MARGIN * first);
            while depth < thickness * (1.0 - ROUNDING) {
                size = growth.size(top + depth, size).max(least);
                heights.push(size);
                depth += size;
            }
            if let Some(thickness) = layer.thickness {
                // one row less, stretched; rows enough for the scheme
                let rows = (heights.len() - 1).max(FEWEST_ROWS);
                let is_thin = heights.len() <= FEWEST_ROWS;
                if is_thin {
                    heights = vec![thickness / (rows as f64 + overhang); rows];
                } else {
                    heights.truncate(rows);
                    let length: f64 = heights.iter().sum::<f64>() + overhang * heights[rows - 1];
                    let stretch = thickness / length;
                    // over a free back half a row may be missing
                    let stretch = if stretch * heights.iter().fold(f64::INFINITY, |a, b| a.min(*b)) < least {
                        heights.pop();
                        let rows = heights.len();
                        thickness / (heights.iter().sum::<f64>() + overhang * heights[rows - 1])
                    } else {
                        stretch
                    };
                    heights.iter_mut().for_each(|height| *height *= stretch);
                }
                size = heights[heights.len() - 1];
                top += thickness;
            }
            all.push(heights);
        }
        all
    }
}

/// Largest number of nodes of the near zone.
const NEAR_NODES: f64 = 1e7;
