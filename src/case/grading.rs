//! Graded meshes: when a case has one, and the sizes of its cells.
//!
//! Near the contact cells are alike, so small that `contact_cells` are across the largest contact; beyond the near zone each is by a ratio larger than
//! the one before it, outwards without end, downwards as far as waves of the contact are resolved. A layer has whole rows, stretched a little to its
//! thickness: a row may be higher than waves run in a step, and no wave speed is changed. Where nothing ends the target the mesh does, so far away that no wave
//! gets there, which takes a logarithm of cells.

use super::{
    Body, Grading, LayerSizes, Parameters, Sizes, Target, TargetLayer, keys::GRADED, rows, values::Values,
};
use crate::{
    contact::Rule,
    grid::{Growth, Spacing},
    model::elastic::FEWEST_ROWS,
    shape::{Tip, hertz_duration},
};

/// Default of `mesh.contact_cells`.
const CONTACT_CELLS: i64 = 20;
/// Default of `mesh.grading`.
const RATIO: f64 = 1.05;
/// Near zone by default, in largest contact radii.
const NEAR: f64 = 1.5;
/// Rows that resolve what a contact gives off, in the way of shear waves during it.
const ROWS_PER_CONTACT: f64 = 40.0;
/// Cells that a pulse has to have along r where it is recorded, in the same way: of 14 the peaks of a ball's pulse up to 50° beside it are within
/// 2.5 %, of 7 within 7 % (`experiment-aluminium` on 101.6 mm, beside generalised rays).
const PULSE_CELLS: f64 = 14.0;
/// Default of `mesh.cells`.
const CELLS: i64 = 100;
/// Slack for lengths that are sums of cells but for rounding.
const ROUNDING: f64 = 1e-9;

/// Chooses between a graded mesh and one of equal cells.
pub(super) fn choose(values: &mut Values<'_>, indenter: Option<&Body>) {
    let spreads = indenter.is_some_and(|indenter| indenter.shape().spreads());
    let is_free = values.get("impact.contact") == Some(Rule::Unilateral);
    let is_physical = values.system.scales.is_some();
    let is_elastic = values.model.has_shear();
    let has_size = (spreads && is_free) || values.is_given("load.radius");
    let by_default = is_elastic && is_physical && has_size && !values.is_given("mesh.cells");
    if by_default && !values.is_given("mesh.contact_cells") {
        values.set("mesh.contact_cells", CONTACT_CELLS);
    }
    if values.checked.contains_key("mesh.contact_cells") {
        if values.number("mesh.grading").is_none() {
            values.set("mesh.grading", RATIO);
        }
        if values.is_loaded && !values.is_given("load.radius") {
            let help = "give load.radius, or mesh.cells in place of contact_cells";
            values.refuse("mesh.contact_cells", " needs a load with a radius", help);
        }
        return;
    }
    if !values.is_given("mesh.cells") {
        values.set("mesh.cells", CELLS);
    }
    let given = GRADED.map(|key| format!("mesh.{key}")).into_iter().find(|key| values.is_given(key));
    if let Some(key) = given.filter(|_| is_elastic) {
        let help = "leave the key out, or give mesh.contact_cells in place of mesh.cells";
        values.unwanted(&key, " is of a graded mesh, and this one has equal cells", help);
    }
}

/// Adds widths from a radius on whose last node stands on a rim.
fn to_rim(widths: &mut Vec<f64>, growth: &Growth, start: f64, radius: f64) {
    let (before, length) = (widths[widths.len() - 1], radius - start);
    if growth.ratio > 1.0 && length > (FEWEST_ROWS + 1) as f64 * before {
        let columns = Rows { growth: *growth, top: start - 0.5 * growth.first, before, overhang: 0.0 };
        widths.extend(columns.through(length));
    } else {
        // alike, and a wider one
        let cells = (length / before + ROUNDING).floor().max(1.0) as usize;
        widths.extend(std::iter::repeat_n(before, cells));
    }
    let last = widths.len() - 1;
    // nodes are at sums of widths
    let before = widths[1..last].iter().fold(0.5 * widths[0], |r, width| r + width);
    let width = radius - before;
    widths[last] = if before + width > radius { width.next_down() } else { width };
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
        let Sizes { dr, dz, nr, nz, outer_radius, depth, ref layers, .. } = self.sizes;
        let heights: Vec<f64> = layers.iter().flat_map(LayerSizes::heights).collect();
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

    /// Of the points and sensors the one with the widest cell, if that is too wide for what the contact gives off: place, width and the widest that is
    /// not \[R\].
    ///
    /// Along r all layers have waves as long as the struck one, by the law of refraction; rows are as high as the pulse of their layer allows.
    pub fn coarse_point(&self) -> Option<([f64; 2], f64, f64)> {
        self.mesh.grading?;
        let grid = self.grid();
        let allowed = self.target.computed()[0].waves.shear * self.contact_time()? / PULSE_CELLS;
        let width = |r: f64| grid.width((grid.place(r).ceil().max(0.0) as usize).min(grid.nr()));
        let seen = self.gauges().points.into_iter().map(|point| (point, width(point[0])));
        let (point, width) = seen.max_by(|a, b| a.1.total_cmp(&b.1))?;
        (width > allowed).then_some((point, width, allowed))
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
            values.refuse("mesh.contact_cells", what, "give mesh.cells in its place")?;
        }
        self.mesh.grading = Some(Grading { contact_cells, ratio, near, largest });
        self.mesh.cells = (1.0 / self.smallest_cell(contact_cells)).round().max(1.0) as usize;
        Some(())
    }

    /// Puts what a graded mesh was made of into the values.
    pub(super) fn complete_grading(&self, values: &mut Values<'_>) {
        let Some(Grading { near: [radius, depth], .. }) = self.mesh.grading else { return };
        // no further than the target, beyond which none can be given
        values.set("mesh.near_radius", radius.min(self.sizes.outer_radius));
        values.set("mesh.near_depth", depth.min(self.target.thickness.unwrap_or(f64::INFINITY)));
    }

    /// Size of the cells near the contact \[R\].
    fn smallest_cell(&self, contact_cells: usize) -> f64 {
        match self.indenter.radius {
            Some(radius) if self.indenter.head.is_flat() => {
                let edge = rows::edge(self.mesh.order, &self.target);
                Spacing::radial(contact_cells / 2, Some(radius), edge, None)
            }
            _ => 2.0 * self.likely_radius() / contact_cells as f64,
        }
    }

    /// Time of contact by Hertz, if there is an estimate, or of the pulse of a load \[R/c_p\].
    fn contact_time(&self) -> Option<f64> {
        if let Some(load) = &self.load {
            return Some(load.force.duration()).filter(|duration| *duration > 0.0);
        }
        let Tip::Round(nose_radius) = self.indenter.head.tip() else { return None };
        let depth = self.likely_radius().powi(2) / nose_radius;
        self.indenter.mass.is_finite().then(|| hertz_duration(depth, self.impact.velocity))
    }

    /// Size of the cells near the contact, time step and fastest waves of a graded mesh, whose rows are not known yet.
    pub(super) fn graded_step(&self, grading: &Grading) -> rows::Rows {
        let dr = self.smallest_cell(grading.contact_cells);
        let layers: Vec<_> = self.bodies().flat_map(Target::computed).collect();
        let speed = rows::fastest(self.model, &layers);
        let slack = self.bodies().map(Target::slack).fold(1.0, f64::max);
        // a layer has rows enough, however thin it is
        let thinnest = layers.iter().filter_map(|layer| Some(layer.thickness? / layer.wave_speed));
        let dt =
            thinnest.map(|transit| transit / (FEWEST_ROWS as f64 + 0.5)).fold(dr / (speed * slack), f64::min);
        rows::Rows { dr, dt, speed, layers: Vec::new() }
    }

    /// Notes a near zone that is larger than the mesh, or has too many nodes.
    ///
    /// * `outer`: where the mesh of the target ends \[R\]
    /// * `first`: size of the cells near the contact \[R\]
    pub(super) fn check_near_zone(
        &self,
        values: &Values<'_>,
        &Grading { near: [radius, depth], .. }: &Grading,
        outer: f64,
        first: f64,
    ) -> Option<()> {
        let place = if radius > outer {
            Some(("mesh.near_radius", " is beyond the mesh"))
        } else {
            let is_below = self.target.thickness.is_some_and(|thickness| depth > thickness);
            is_below.then_some(("mesh.near_depth", " is below the target"))
        };
        if let Some((key, what)) = place.filter(|(key, _)| values.is_given(key)) {
            values.refuse(key, what, "make it smaller, or leave it out")?;
        }
        let nodes = (radius / first) * (depth / first);
        if nodes > NEAR_NODES {
            let message = format!("the near zone has {nodes:.3e} nodes");
            let help = format!(
                "allowed: {NEAR_NODES:e}; make mesh.contact_cells, mesh.near_radius or mesh.near_depth smaller"
            );
            values.problem("mesh.contact_cells", message, help)?;
        }
        Some(())
    }

    /// Widths of the columns of target and indenter, and numbers of their nodes: a node stands on every rim.
    ///
    /// * `outer`: where the mesh of the target ends \[R\]
    pub(super) fn columns(&self, outer: f64, growth: &Growth) -> (Vec<f64>, [usize; 2]) {
        let striker = self.indenter.rim();
        // the first width is that of a cell about the axis, half of which is on either side
        let (mut widths, mut nodes) = (vec![growth.first], [0; 2]);
        let mut ends = [(self.target.radius, 0), (striker, 1)];
        ends.sort_by(|a, b| a.0.unwrap_or(f64::INFINITY).total_cmp(&b.0.unwrap_or(f64::INFINITY)));
        let mut start = 0.5 * growth.first;
        for (radius, body) in ends {
            let Some(radius) = radius else { continue };
            if radius > start * (1.0 + ROUNDING) {
                to_rim(&mut widths, growth, start, radius);
                start = radius;
            }
            nodes[body] = widths.len();
        }
        if self.target.radius.is_none() {
            let before = widths[widths.len() - 1];
            let columns = Rows { growth: *growth, top: start - 0.5 * growth.first, before, overhang: 0.0 };
            // some cells beside the indenter, if it is as wide
            let end = ((outer - start) * (1.0 - ROUNDING)).max(2.0 * before);
            widths.extend(columns.sizes(growth.ratio, |_, length| length < end));
            nodes[0] = widths.len() - 1;
        } else {
            // beyond the last node there is no cell
            widths.push(widths[widths.len() - 1]);
        }
        (widths, nodes)
    }

    /// Rows of every layer of a body.
    ///
    /// * `first`: height of a row near the contact
    /// * `deepest`: to which a half-space is computed
    pub(super) fn graded_layers(
        &self,
        body: &Target,
        dt: f64,
        first: f64,
        deepest: f64,
        grading: &Grading,
    ) -> Vec<LayerSizes> {
        let (mut top, mut size, computed) = (0.0, first, body.computed());
        let rows = |(number, layer): (usize, &TargetLayer)| {
            let least = layer.wave_speed * dt;
            let by_pulse =
                self.contact_time().map_or(f64::INFINITY, |time| layer.waves.shear * time / ROWS_PER_CONTACT);
            let largest = grading.largest.unwrap_or(by_pulse).max(first).max(least);
            let near = grading.near[1];
            let rows = Rows {
                growth: Growth { first: first.max(least), near, ratio: grading.ratio, largest },
                top,
                before: size.min(largest).max(least),
                overhang: if number + 1 == computed.len() { body.back.overhang() } else { 0.0 },
            };
            let heights = match layer.thickness {
                Some(thickness) => rows.through(thickness),
                None => rows.sizes(grading.ratio, |_, depth| depth < deepest),
            };
            size = heights[heights.len() - 1];
            top += layer.thickness.unwrap_or_default();
            let (steps, dz, overhang) = (heights.len(), heights[0], rows.overhang);
            LayerSizes { steps, overhang, dz, speed_change: 0.0, heights }
        };
        computed.iter().enumerate().map(rows).collect()
    }
}

impl Grading {
    pub(super) fn growth(&self, first: f64) -> Growth {
        let largest = self.largest.unwrap_or(f64::INFINITY).max(first);
        Growth { first, near: self.near[0], ratio: self.ratio, largest }
    }
}

struct Rows {
    growth: Growth,
    /// Depth of its upper face \[R\].
    top: f64,
    /// Height of the row above it, as far as the layer can have it \[R\].
    before: f64,
    /// What lies below the last row, in rows.
    overhang: f64,
}

impl Rows {
    /// Heights with a ratio.
    ///
    /// * `goes_on`: below so many rows, so deep in the layer
    fn sizes(&self, ratio: f64, goes_on: impl Fn(usize, f64) -> bool) -> Vec<f64> {
        let growth = Growth { ratio, ..self.growth };
        let (mut heights, mut depth, mut size) = (Vec::new(), 0.0, self.before);
        while goes_on(heights.len(), depth) {
            size = growth.size(self.top + depth, size);
            heights.push(size);
            depth += size;
        }
        heights
    }

    /// Thickness of so many rows.
    fn thickness(&self, heights: &[f64]) -> f64 {
        heights.iter().sum::<f64>() + self.overhang * heights[heights.len() - 1]
    }

    /// Heights that are a thickness together: of the least number of rows that reach it, with a ratio that is a little smaller, so that those near the
    /// contact are what they would be; where that is not enough, of one row less, stretched.
    fn through(&self, thickness: f64) -> Vec<f64> {
        let needed = thickness * (1.0 - ROUNDING);
        let with = |ratio: f64, count: usize| self.sizes(ratio, |rows, _| rows < count);
        let mut count = self.sizes(self.growth.ratio, |_, depth| depth < needed).len().max(FEWEST_ROWS);
        while count > FEWEST_ROWS && self.thickness(&with(self.growth.ratio, count - 1)) >= needed {
            count -= 1;
        }
        if self.thickness(&with(1.0, count)) < needed {
            let [mut low, mut high] = [1.0, self.growth.ratio];
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                let end = if self.thickness(&with(middle, count)) < thickness { &mut low } else { &mut high };
                *end = middle;
            }
            return with(high, count);
        }
        let fits = self.thickness(&with(1.0, count)) <= thickness * (1.0 + ROUNDING);
        let count = if fits || count == FEWEST_ROWS { count } else { count - 1 };
        let mut heights = with(1.0, count);
        let stretch = thickness / self.thickness(&heights);
        heights.iter_mut().for_each(|height| *height *= stretch);
        heights
    }
}

const NEAR_NODES: f64 = 1e7;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    const BALL: &str = "model = \"elastic\"\n[target]\nthickness = \"20 mm\"\nmaterial = \"glass\"\n[indenter]\n\
        shape = \"sphere\"\nnose_radius = \"5 mm\"\nmaterial = \"steel\"\n[impact]\nvelocity = \"1 m/s\"\n\
        [run]\nend_time = \"45 us\"\n";

    #[test]
    fn layers_have_their_thickness_and_cells_are_what_is_asked_for() {
        let armour = |settings: &[&str]| Case::sound("laminate-armour", settings);
        let cases = [
            Case::sound(BALL, &[]),
            Case::sound(BALL, &["target.back=free"]),
            Case::sound(BALL, &["target.thickness=\"1.1 mm\"", "target.back=free", "mesh.contact_cells=9"]),
            Case::sound(BALL, &["mesh.grading=1.5", "mesh.near_depth=\"0.1 mm\""]),
            Case::sound(BALL, &["mesh.grading=1.0", "target.thickness=\"2 mm\"", "run.end_time=\"1 us\""]),
            armour(&[]),
            armour(&["target.layer.2.thickness=\"0.01 mm\"", "mesh.contact_cells=8"]),
        ];
        for case in cases {
            let (grading, sizes) = (case.mesh.grading.expect("a graded mesh"), &case.sizes);
            for (layer, rows) in case.target.computed().iter().zip(&sizes.layers) {
                let (thickness, heights) = (rows.thickness(), &rows.heights);
                let given = layer.thickness.expect("a layer");
                assert!((thickness / given - 1.0).abs() < 1e-9, "{thickness} {given}");
                assert!(heights.len() >= FEWEST_ROWS);
                let least = layer.wave_speed * sizes.dt * (1.0 - ROUNDING);
                assert!(heights.iter().all(|height| *height >= least), "{heights:?}");
                let grows = |pair: &[f64]| pair[1] <= pair[0] * grading.ratio * (1.0 + ROUNDING);
                assert!(heights.windows(2).all(grows), "{heights:?}");
            }
            let contact = 2.0 * case.likely_radius() / grading.contact_cells as f64;
            let widths = &sizes.widths;
            assert!(widths[0] == sizes.dr && (widths[0] / contact - 1.0).abs() < 1e-12);
            assert!(widths.windows(2).all(|pair| pair[1] <= pair[0] * grading.ratio * (1.0 + ROUNDING)));
            // a complete case has the same mesh
            let again = Case::sound(&case.resolved_toml(), &[]);
            assert_eq!(again.sizes, case.sizes);
        }
    }

    #[test]
    fn each_way_to_say_how_fine_a_mesh_is_takes_the_place_of_the_other() {
        let density = |text: &str, settings: &[&str]| Case::sound(text, settings).mesh.density();
        assert_eq!(density(BALL, &[]), ("mesh.contact_cells", 20));
        assert_eq!(density(BALL, &["mesh.cells=30"]), ("mesh.cells", 30));
        let complete = Case::sound(BALL, &[]).resolved_toml();
        assert_eq!(density(&complete, &["mesh.cells=30"]), ("mesh.cells", 30));
        let equal = format!("{BALL}[mesh]\ncells = 40\n");
        assert_eq!(density(&equal, &[]), ("mesh.cells", 40));
        assert_eq!(density(&equal, &["mesh.contact_cells=12"]), ("mesh.contact_cells", 12));
        // what has fronts, and the simplified theory, have equal cells unless they are asked
        let flat = ["indenter.shape=flat", "indenter.radius=\"5 mm\"", "indenter.mass=\"5 g\""];
        for case in ["fig5", "elastic-fig5", "elastic-fig2-prescribed"] {
            assert_eq!(density(case, &[]).0, "mesh.cells", "{case}");
        }
        let text = BALL.replace("nose_radius = \"5 mm\"\nmaterial = \"steel\"\n", "");
        assert_eq!(density(&text, &flat).0, "mesh.cells");
    }
}
