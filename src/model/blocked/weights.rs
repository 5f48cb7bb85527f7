//! A scheme with its weights by layer and column, as kernels read them.

use super::{
    cells::CellWeights,
    lane::padded,
    levels::{CornerTerm, Radial},
};
use crate::{
    grid::Grid,
    model::{
        cell_scheme::CellScheme,
        scheme::{Corner, RadialWeights},
    },
};

/// A scheme with its weights.
pub enum Weighted {
    /// One displacement.
    Axial(AxialWeights),
    /// Two displacements.
    Cells(Box<CellLayers>),
}

/// A layer of the scheme with one displacement.
#[derive(Clone, Copy)]
pub struct Plate<'a> {
    /// Impedance Z \[γc_p of the struck layer\].
    pub impedance: f64,
    /// Radial weights, by column.
    pub weights: &'a [RadialWeights],
    /// Those of the mixed-derivative correction; none without it.
    pub corner: &'a [RadialWeights],
}

/// Weights of the scheme with one displacement.
pub struct AxialWeights {
    /// Cell areas by column, for whole blocks.
    pub area: Vec<f64>,
    layers: Vec<PlateWeights>,
    /// The mixed-derivative correction, if there is one.
    corner: Option<Corner>,
}

/// Weights of a layer.
struct PlateWeights {
    impedance: f64,
    /// Radial weights of the scheme.
    weights: Weights,
    /// Those of the mixed-derivative correction; none without it.
    corner: Weights,
}

impl AxialWeights {
    /// * `corner`: the mixed-derivative correction, if there is one
    /// * `columns`: of the field, whole blocks
    pub fn new(grid: &Grid, plates: &[Plate<'_>], corner: Option<Corner>, columns: usize) -> Self {
        let weights = |plate: &Plate<'_>| PlateWeights {
            impedance: plate.impedance,
            weights: Weights::new(plate.weights, columns),
            corner: Weights::new(plate.corner, if corner.is_some() { columns } else { 0 }),
        };
        Self {
            area: padded(grid.area.iter().copied(), columns),
            layers: plates.iter().map(weights).collect(),
            corner,
        }
    }

    /// Impedance of a layer \[γc_p of the struck one\].
    pub fn impedance(&self, layer: usize) -> f64 {
        self.layers[layer].impedance
    }

    /// Radial weights of a layer.
    pub fn radial(&self, layer: usize) -> Radial<'_> {
        self.layers[layer].weights.by_column()
    }

    /// The mixed-derivative correction in a layer, if there is one.
    pub fn corner(&self, layer: usize) -> Option<CornerTerm<'_>> {
        let radial = self.layers[layer].corner.by_column();
        self.corner.map(|corner| CornerTerm { share: corner.share, radial })
    }
}

/// Radial weights by column, for whole blocks.
struct Weights {
    outward: Vec<f64>,
    inward: Vec<f64>,
}

impl Weights {
    fn new(weights: &[RadialWeights], columns: usize) -> Self {
        Self {
            outward: padded(weights.iter().map(|weights| weights.outward), columns),
            inward: padded(weights.iter().map(|weights| weights.inward), columns),
        }
    }

    fn by_column(&self) -> Radial<'_> {
        Radial { outward: &self.outward, inward: &self.inward }
    }
}

/// The scheme of cells with its weights by layer.
pub struct CellLayers {
    /// The scheme, node by node.
    pub scheme: CellScheme,
    /// Layers from the surface down.
    pub layers: Vec<CellWeights>,
}

impl CellLayers {
    /// * `columns`: of the field, whole blocks
    pub fn new(scheme: CellScheme, columns: usize) -> Self {
        let layers = 0..scheme.grid().layers.len();
        Self { layers: layers.map(|layer| CellWeights::new(&scheme, layer, columns)).collect(), scheme }
    }
}
