//! The time step of layers, and their rows.

use super::{LayerSizes, Parameters, Target, TargetLayer};
use crate::{
    grid::{Edge, FEWEST, LayerSteps, Spacing},
    model::{ModelKind, scheme::Order},
};

/// Largest relative change of a wave speed.
pub(super) const LARGEST_CHANGE: f64 = 0.02;
/// Relative change of a wave speed of which `percuss run` and `percuss check` warn.
pub(crate) const NOTED_CHANGE: f64 = 0.005;
/// Largest number of rows of several layers: more of them take long to fit.
pub(super) const MAX_ROWS: f64 = 2e5;
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
    /// Rows of every computed layer.
    pub layers: Vec<LayerSizes>,
}

/// Why layers have no rows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Misfit {
    /// There would be so many.
    TooMany(f64),
    /// A layer, by its number, is thinner than two rows.
    Thin(usize),
    /// The wave speed of a layer, by its number, would change by so much.
    Change(usize, f64),
}

/// What the rows of several layers follow from beside the number of cells.
pub(super) struct Stack<'a> {
    model: ModelKind,
    layers: &'a [TargetLayer],
    /// Radius of the punch \[R\].
    radius: Option<f64>,
    edge: Edge,
}

/// Where the scheme sees the edge of a punch, which only the struck layer feels.
pub(super) fn edge(order: Option<Order>, target: &Target) -> Edge {
    match order {
        Some(Order::Second) => Edge::SECOND,
        Some(Order::Fourth) => Edge::FOURTH,
        None => Edge::elastic(target.material.shear_wave_speed),
    }
}

/// Speed of the fastest waves along r in any layer \[c_p\].
///
/// * `layers`, `rows`: computed layers and their rows
pub(super) fn lateral_speed(model: ModelKind, layers: &[TargetLayer], rows: &[LayerSizes], dt: f64) -> f64 {
    let speeds =
        layers.iter().zip(rows).map(|(layer, rows)| model.lateral_speed(rows.dz / dt, layer.waves.shear));
    speeds.fold(0.0, f64::max)
}

impl<'a> Stack<'a> {
    /// * `layers`: computed ones
    pub fn new(model: ModelKind, layers: &'a [TargetLayer], radius: Option<f64>, edge: Edge) -> Self {
        Self { model, layers, radius, edge }
    }

    /// Rows of a matched mesh with `cells` nodes across the radius.
    ///
    /// ```text
    /// rakhmatulin: Δr ≥ c_s,k·Δt      elastic: Δr ≥ Δz_k = h_k/J_k      in every layer
    /// ```
    pub fn rows(&self, cells: usize) -> Result<Rows, Misfit> {
        let dr = |slip| Spacing::radial(cells, self.radius, self.edge, slip);
        let largest = dr(None) / self.fastest();
        let transits: Vec<f64> = self.finite().map(|(thickness, speed)| thickness / speed).collect();
        let rows = transits.iter().sum::<f64>() / largest;
        if rows > MAX_ROWS {
            return Err(Misfit::TooMany(rows));
        }
        let fit = |largest| {
            let LayerSteps { dt, steps, changes } =
                LayerSteps::fit(&transits, largest).map_err(Misfit::Thin)?;
            let slip = self.model.lateral_speed(1.0, self.layers[0].waves.shear) * dt;
            let finite = self.finite().zip(steps.iter().zip(&changes));
            let mut layers: Vec<LayerSizes> = finite
                .map(|((thickness, _), (&steps, &speed_change))| LayerSizes {
                    steps,
                    dz: thickness / steps as f64,
                    speed_change,
                })
                .collect();
            let half_space = self.layers[layers.len()..].first();
            layers.extend(half_space.map(|layer| LayerSizes {
                steps: FEWEST,
                dz: layer.wave_speed * dt,
                speed_change: 0.0,
            }));
            Ok(Rows { dr: dr(Some(slip)), dt, layers })
        };
        let mut rows = fit(largest)?;
        let is_stable = |rows: &Rows| rows.layers.iter().all(|layer| layer.dz <= rows.dr * (1.0 + ROUNDING));
        if self.model == ModelKind::Elastic && !is_stable(&rows) {
            // waves that are made faster need smaller steps
            rows = fit(largest / (1.0 + LARGEST_CHANGE))?;
        }
        let (number, change) = rows.largest_change();
        if change.abs() > LARGEST_CHANGE { Err(Misfit::Change(number, change)) } else { Ok(rows) }
    }

    /// The smallest number of cells found, larger than `cells`, that changes no wave speed by more than `change`.
    pub fn finer(&self, cells: usize, change: f64) -> Option<usize> {
        let thinnest =
            self.finite().map(|(thickness, speed)| thickness / speed).fold(f64::INFINITY, f64::min);
        // two of the smallest steps
        let coarsest = self.radius.unwrap_or(1.0) / (0.75 * thinnest * self.fastest());
        let first = (coarsest as usize).saturating_sub(1).max(cells) + 1;
        let rows = self.finite().map(|(thickness, speed)| thickness / speed).sum::<f64>()
            * self.fastest()
            * first as f64
            / self.radius.unwrap_or(1.0);
        let meshes = (SEARCHED_ROWS / (rows * self.layers.len() as f64)).clamp(1.0, SEARCHED_MESHES);
        (first..)
            .take(meshes as usize)
            .find(|cells| self.rows(*cells).is_ok_and(|rows| rows.largest_change().1.abs() <= change))
    }

    /// Thickness and wave speed of the layers above a half-space.
    fn finite(&self) -> impl Iterator<Item = (f64, f64)> {
        self.layers.iter().filter_map(|layer| Some((layer.thickness?, layer.wave_speed)))
    }

    /// Speed of the fastest waves along r \[c_p\].
    fn fastest(&self) -> f64 {
        let speeds =
            self.layers.iter().map(|layer| self.model.lateral_speed(layer.wave_speed, layer.waves.shear));
        speeds.fold(0.0, f64::max)
    }
}

impl Parameters {
    /// The smallest number of cells found, larger than that of the case, with which no wave speed changes notably.
    pub(crate) fn finer_cells(&self) -> Option<usize> {
        let computed = self.target.computed();
        let edge = edge(self.mesh.order, &self.target);
        let stack = Stack::new(self.model, &computed, self.indenter.radius, edge);
        stack.finer(self.mesh.cells, NOTED_CHANGE)
    }
}

impl Rows {
    /// Spacings of a target of one layer.
    pub fn single(Spacing { dr, dz, layer_rows }: Spacing) -> Self {
        let layer = LayerSizes { steps: layer_rows.unwrap_or(0), dz, speed_change: 0.0 };
        Self { dr, dt: dz, layers: vec![layer] }
    }

    /// The largest change of a wave speed by magnitude, with the number of its layer.
    fn largest_change(&self) -> (usize, f64) {
        let changes = self.layers.iter().map(|layer| layer.speed_change).enumerate();
        changes.fold(
            (0, 0.0),
            |largest, change| if change.1.abs() > f64::abs(largest.1) { change } else { largest },
        )
    }

    /// Steps down to a depth, in whole rows of every layer.
    ///
    /// * `z`: depth \[R\]
    pub fn steps_to(&self, z: f64) -> f64 {
        let mut top = 0.0;
        let last = self.layers.len() - 1;
        let steps = |(number, layer): (usize, &LayerSizes)| {
            let most = if number == last { f64::INFINITY } else { layer.steps as f64 };
            let steps = ((z - top) / layer.dz).ceil().clamp(0.0, most);
            top += layer.steps as f64 * layer.dz;
            steps
        };
        self.layers.iter().enumerate().map(steps).sum()
    }
}
