//! The time step of layers, and their rows.

use super::{LayerSizes, Parameters, Target, TargetLayer};
use crate::{
    grid::{Bond, Edge, FEWEST, LayerSteps, Spacing},
    model::{ModelKind, elastic::FEWEST_SLIDING, scheme::Order},
};

/// Largest relative change of a wave speed.
pub(super) const LARGEST_CHANGE: f64 = 0.02;
/// Relative change of a wave speed of which `percuss run` and `percuss check` warn.
pub(crate) const NOTED_CHANGE: f64 = 0.005;
/// Largest number of rows of several layers: more of them take long to fit.
const MAX_ROWS: f64 = 2e5;
/// Rows of all meshes together that are looked at for a better one.
const SEARCHED_ROWS: f64 = 2e6;
/// Meshes that are looked at for a better one.
const SEARCHED_MESHES: f64 = 2000.0;
/// Slack for a Courant number of 1 but for rounding.
const ROUNDING: f64 = 1e-9;

/// Spacings of a mesh. The rows of a half-space are not counted yet.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// Radial distance of nodes \[R\].
    pub dr: f64,
    /// Time step \[R/c_p\].
    pub dt: f64,
    /// Speed of the fastest waves along r \[c_p\].
    pub speed: f64,
    /// Rows of every computed layer, of the target before those of an indenter that gives.
    pub layers: Vec<LayerSizes>,
}

/// Why layers have no rows: the number of the layer that is at fault, or none if that is the number of cells, what is wrong, and what is allowed.
pub(super) type NoRows = (Option<usize>, String, String);

/// What the rows of several layers follow from beside the number of cells.
pub(super) struct Stack {
    model: ModelKind,
    /// Layers of the target, and of an indenter that gives.
    layers: Vec<TargetLayer>,
    /// How many of them are of the target.
    of_target: usize,
    /// What lies below the last row of each.
    overhangs: Vec<f64>,
    /// Radius of the punch \[R\].
    radius: Option<f64>,
    edge: Edge,
    /// See [`Target::slack`].
    slack: f64,
}

/// Where the scheme sees the edge of a punch, which only the struck layer feels.
pub(super) fn edge(order: Option<Order>, target: &Target) -> Edge {
    match order {
        Some(Order::Second) => Edge::SECOND,
        Some(Order::Fourth) => Edge::FOURTH,
        None if target.computed().len() > 1 => Edge::elastic_on_layers(target.material.shear_wave_speed),
        None => Edge::elastic(target.material.shear_wave_speed),
    }
}

/// Speed of the fastest waves along r in any layer \[c_p\].
///
/// * `layers`, `rows`: computed layers and their rows
pub(super) fn lateral_speed(model: ModelKind, layers: &[TargetLayer], rows: &[LayerSizes], dt: f64) -> f64 {
    let speeds = layers.iter().zip(rows).map(|(layer, rows)| layer.lateral_speed(model, rows.dz / dt));
    speeds.fold(0.0, f64::max)
}

/// The same with the speeds that layers are given.
pub(super) fn fastest<'a>(model: ModelKind, layers: impl IntoIterator<Item = &'a TargetLayer>) -> f64 {
    let speeds = layers.into_iter().map(|layer| layer.lateral_speed(model, layer.wave_speed));
    speeds.fold(0.0, f64::max)
}

impl Stack {
    /// The computed layers of a case.
    pub fn new(case: &Parameters) -> Self {
        let overhangs = case.bodies().flat_map(|body| {
            let last = body.computed().len() - 1;
            let of_last = if body.thickness.is_some() { body.back.overhang() } else { 0.0 };
            (0..=last).map(move |number| if number == last { of_last } else { 0.0 })
        });
        Self {
            model: case.model,
            of_target: case.target.computed().len(),
            overhangs: overhangs.collect(),
            layers: case.bodies().flat_map(Target::computed).collect(),
            radius: case.indenter.radius,
            edge: edge(case.mesh.order, &case.target),
            slack: case.bodies().map(Target::slack).fold(1.0, f64::max),
        }
    }

    /// Rows of a matched mesh with `cells` nodes across the radius.
    ///
    /// ```text
    /// rakhmatulin: Δr ≥ c_s,k·Δt      elastic: Δr ≥ Δz_k = h_k/N_k      in every layer of N_k rows of cells
    /// ```
    pub fn rows(&self, cells: usize) -> Result<Rows, NoRows> {
        let dr = |slip| Spacing::radial(cells, self.radius, self.edge, slip);
        let largest = dr(None) / self.fastest();
        let transits: Vec<(f64, f64)> = self.finite().map(|layer| (layer.0 / layer.1, layer.2)).collect();
        let rows = transits.iter().map(|layer| layer.0).sum::<f64>() / largest;
        if rows > MAX_ROWS {
            let message = format!("`mesh.cells` = {cells} makes {rows:.3e} rows through the layers");
            let help = format!("allowed: at most {MAX_ROWS:e} rows; make mesh.cells smaller");
            return Err((None, message, help));
        }
        let thin = |number, fewest| {
            let what = format!(": with mesh.cells = {cells} the layer is thinner than {fewest} rows");
            (Some(number), what, String::new())
        };
        let fit = |largest| {
            let LayerSteps { dt, steps, changes } =
                LayerSteps::fit(&transits, largest).map_err(|number| thin(self.number(number), FEWEST))?;
            let slip = self.layers[0].lateral_speed(self.model, 1.0) * self.slack * dt;
            let mut finite = steps.into_iter().zip(changes);
            let sizes = |(layer, overhang): (&TargetLayer, &f64)| {
                let fitted = layer.thickness.and_then(|_| finite.next());
                let (steps, speed_change) = fitted.unwrap_or((FEWEST, 0.0));
                let mut sizes =
                    LayerSizes { steps, overhang: *overhang, speed_change, ..LayerSizes::default() };
                sizes.dz =
                    layer.thickness.map_or(layer.wave_speed * dt, |thickness| thickness / sizes.rows());
                sizes
            };
            let layers: Vec<_> = self.layers.iter().zip(&self.overhangs).map(sizes).collect();
            let speed = lateral_speed(self.model, &self.layers[..self.of_target], &layers, dt);
            Ok(Rows { dr: dr(Some(slip)), dt, speed, layers })
        };
        let mut rows = fit(largest)?;
        let is_stable = |rows: &Rows| {
            let run = lateral_speed(self.model, &self.layers, &rows.layers, rows.dt) * self.slack * rows.dt;
            run <= rows.dr * (1.0 + ROUNDING)
        };
        if !is_stable(&rows) {
            // waves that are made faster need smaller steps
            rows = fit(largest / (1.0 + LARGEST_CHANGE))?;
        }
        if let Some(number) = self.thin_beside_sliding(&rows) {
            return Err(thin(number, FEWEST_SLIDING));
        }
        let (number, change) = rows.largest_change();
        if change.abs() <= LARGEST_CHANGE {
            return Ok(rows);
        }
        let what = format!(
            ": with mesh.cells = {cells} waves cross all layers in whole steps only if the wave speed of this one is changed by {:.2} %",
            100.0 * change
        );
        Err((Some(number), what, format!("allowed: up to {} %; ", 100.0 * LARGEST_CHANGE)))
    }

    /// The first layer with fewer rows than are stable beside a sliding interface.
    fn thin_beside_sliding(&self, rows: &Rows) -> Option<usize> {
        let slides = |number: usize| self.layers.get(number).is_some_and(|layer| layer.bond == Bond::Sliding);
        let is_thin = |number: &usize| {
            let is_finite = self.layers[*number].thickness.is_some();
            is_finite
                && rows.layers[*number].steps < FEWEST_SLIDING
                && (slides(*number) || slides(number + 1))
        };
        (0..self.layers.len()).find(is_thin)
    }

    /// The smallest number of cells found, larger than `cells`, that changes no wave speed by more than `change`.
    pub fn finer(&self, cells: usize, change: f64) -> Option<usize> {
        let thinnest = self.finite().map(|layer| layer.0 / layer.1).fold(f64::INFINITY, f64::min);
        // two of the smallest steps
        let coarsest = self.radius.unwrap_or(1.0) / (0.75 * thinnest * self.fastest());
        let first = (coarsest as usize).saturating_sub(1).max(cells) + 1;
        let rows = self.finite().map(|layer| layer.0 / layer.1).sum::<f64>() * self.fastest() * first as f64
            / self.radius.unwrap_or(1.0);
        let meshes = (SEARCHED_ROWS / (rows * self.layers.len() as f64)).clamp(1.0, SEARCHED_MESHES);
        (first..)
            .take(meshes as usize)
            .find(|cells| self.rows(*cells).is_ok_and(|rows| rows.largest_change().1.abs() <= change))
    }

    /// Thickness, wave speed and overhang of the layers that are no half-spaces.
    fn finite(&self) -> impl Iterator<Item = (f64, f64, f64)> {
        let layers = self.layers.iter().zip(&self.overhangs);
        layers.filter_map(|(layer, overhang)| Some((layer.thickness?, layer.wave_speed, *overhang)))
    }

    /// Number among all layers of one that is no half-space.
    fn number(&self, finite: usize) -> usize {
        let numbers = (0..self.layers.len()).filter(|number| self.layers[*number].thickness.is_some());
        numbers.take(finite + 1).last().unwrap_or_default()
    }

    /// Speed of the fastest waves along r \[c_p\].
    fn fastest(&self) -> f64 {
        fastest(self.model, &self.layers) * self.slack
    }
}

impl Parameters {
    /// The smallest number of cells found, larger than that of the case, with which no wave speed changes notably.
    pub(crate) fn finer_cells(&self) -> Option<usize> {
        Stack::new(self).finer(self.mesh.cells, NOTED_CHANGE)
    }
}

impl Rows {
    /// The largest change of a wave speed by magnitude, with the number of its layer.
    fn largest_change(&self) -> (usize, f64) {
        let changes = self.layers.iter().map(|layer| layer.speed_change).enumerate();
        changes.fold(
            (0, 0.0),
            |largest, change| if change.1.abs() > f64::abs(largest.1) { change } else { largest },
        )
    }
}

/// Steps down to a depth, in whole rows of every layer.
///
/// * `z`: depth \[R\]
pub(super) fn steps_to(layers: &[LayerSizes], z: f64) -> f64 {
    let mut top = 0.0;
    let steps = |(number, layer): (usize, &LayerSizes)| {
        let most = if number + 1 == layers.len() { f64::INFINITY } else { layer.steps as f64 };
        let steps = ((z - top) / layer.dz).ceil().clamp(0.0, most);
        top += layer.steps as f64 * layer.dz;
        steps
    };
    layers.iter().enumerate().map(steps).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    /// Settings of layers, each with its thickness and wave speed.
    fn stack(model: &str, cells: usize, layers: &[(f64, f64)]) -> Result<Case, String> {
        let layer = |(i, (thickness, speed)): (usize, &(f64, f64))| {
            let own = match i {
                0 => "shear_wave_speed = 0.5".to_owned(),
                _ => format!("wave_speed = {speed:?}, density = 2.0"),
            };
            format!("{{ thickness = {thickness:?}, {own} }}")
        };
        let layers: Vec<String> = layers.iter().enumerate().map(layer).collect();
        let text = format!(
            "model = \"{model}\"\n[target]\nlayer = [{}]\n[indenter]\nshape = \"flat\"\nradius = 1.0\n[mesh]\ncells = {cells}\n\
             [run]\nend_time = 2.0\n[record]\nframes = 0\n",
            layers.join(", ")
        );
        Case::parse("stack", &text, &[], "".as_ref()).map_err(|errors| format!("{:?}", errors.problems))
    }

    const STACKS: [&[(f64, f64)]; 4] = [
        &[(1.0, 1.0), (0.1, 0.8), (2.0, 1.7)],
        &[(0.3, 1.0), (0.31, 1.3)],
        &[(0.5, 1.0), (0.5, 2.0), (0.5, 1.1), (0.5, 0.9)],
        &[(1.0, 1.0), (0.5, 3.0)],
    ];

    #[test]
    fn layers_are_crossed_in_whole_steps_on_a_stable_mesh() {
        for model in ["rakhmatulin", "elastic"] {
            for layers in STACKS {
                for cells in [60, 77, 130] {
                    let case = stack(model, cells, layers).expect("a case");
                    let sizes = &case.sizes;
                    let mut rows = 0;
                    for (layer, (thickness, speed)) in sizes.layers.iter().zip(layers) {
                        let changed = speed * (1.0 + layer.speed_change);
                        assert!((layer.steps as f64 * layer.dz / thickness - 1.0).abs() < 1e-14);
                        assert!((layer.dz / (changed * sizes.dt) - 1.0).abs() < 1e-14, "{layers:?}, {cells}");
                        assert!(layer.steps >= FEWEST && layer.speed_change.abs() <= LARGEST_CHANGE);
                        assert!(model == "rakhmatulin" || layer.dz <= sizes.dr * (1.0 + ROUNDING));
                        rows += layer.steps + 1;
                    }
                    assert!(case.wave_speed() * sizes.dt <= sizes.dr * (1.0 + ROUNDING));
                    assert_eq!((sizes.nz, case.grid().nz), (rows - 1, rows - 1));
                    assert!((sizes.depth / case.target.thickness.expect("layers") - 1.0).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn cells_that_are_offered_do() {
        for (layers, cells) in [(&[(1.0, 1.0), (0.011, 0.9)], 20), (&[(1.0, 1.0), (0.0347, 1.0)], 36)] {
            let error = stack("elastic", cells, &layers[..]).expect_err("a thin layer");
            let offered = error.split("mesh.cells = ").last().and_then(|text| text.split(' ').next());
            let offered: usize = offered.and_then(|text| text.parse().ok()).expect("a number");
            assert!(stack("elastic", offered, &layers[..]).is_ok(), "{error}");
            assert!(stack("elastic", offered - 1, &layers[..]).is_err(), "{error}");
        }
    }

    #[test]
    fn equal_welded_layers_are_one() {
        for model in ["rakhmatulin", "elastic"] {
            let of = |layers: &[(f64, f64)]| stack(model, 40, layers).expect("a case");
            let (one, two) = (of(&[(0.75, 1.0)]), of(&[(0.5, 1.0), (0.25, 1.0)]));
            // the second has another density
            assert_eq!((two.sizes.layers.len(), two.target.layers.len()), (2, 2));
            let keys = |case: &Case| case.vary().set("target.layer.2.density", 1.0).build().expect("a case");
            let two = keys(&two);
            assert_eq!((&two.sizes, two.target.layers.len()), (&one.sizes, 2));
            assert_eq!(
                (two.waves(), two.target.computed()[0].name.as_str()),
                (one.waves(), "layer 1 + layer 2")
            );
        }
    }

    #[test]
    fn a_half_space_is_as_deep_as_waves_get() {
        let settings = |more: &[&str]| {
            let settings = [&["record.frames=0", "record.fields=[]", "record.lines=[]"][..], more].concat();
            Case::sound("coating", &settings).sizes.clone()
        };
        let steps =
            |sizes: &crate::case::Sizes| sizes.layers.iter().map(|layer| layer.steps as u64).sum::<u64>();
        let (half, point) = (settings(&[]), settings(&["record.points=[[\"0 mm\", \"3 mm\"]]"]));
        let whole = settings(&["record.frames=2"]);
        // half of the steps go down and half of them back up, from the rows that are looked at and the one below
        let deepest = |sizes: &crate::case::Sizes, looked_at: u64| (sizes.steps + looked_at + 3) / 2 + 2;
        assert_eq!((steps(&half), steps(&whole)), (deepest(&half, 5), whole.steps + 2));
        let to_point = 5.0 + ((3.0 - 0.2) / (2.0 * point.layers[1].dz)).ceil();
        assert_eq!(steps(&point), deepest(&point, to_point as u64));
        // a thick layer leaves two rows
        assert_eq!(settings(&["target.layer.1.thickness=40 mm"]).layers[1].steps, FEWEST);
    }
}
