//! The mesh: positions, cell areas and face weights of the nodes, and the spacing rules that lead to them.
//!
//! This module knows geometry (axisymmetric or plane) and mesh kind and turns both into plain weights, so that
//! no kernel depends on either. It knows nothing of fields, materials or contact.
//!
//! Nodes stand in rows of constant depth `z_j = j·Δz`; along a row node `i` is the middle of the cell between
//! two faces. Displacements live on nodes, radial fluxes on faces:
//!
//! ```text
//!   matched:  axis|--•--|--•--|--•--|        r_i = (i+½)Δr, faces at iΔr
//!                    0     1     2
//!   paper:        •--|--•--|--•--|           r_i = iΔr, faces at (i+½)Δr; cell 0 is half a cell
//!                 0     1     2
//! ```
//!
//! Along z a mesh has one or more layers of whole numbers of rows, each with its own distance; all rows of nodes are numbered through. The first and
//! the last row belong to a layer: an interface has two rows at one depth, the last of the upper and the first of the lower layer. A free
//! back lies half a row of cells below the last row of nodes, see [`crate::model::scheme`].
//!
//! On a graded mesh ([`Grid::graded`]) cells are equal near the contact and grow outwards and down from there.

use serde::{Deserialize, Serialize};

use crate::{geometry::Geometry, table::table};

mod graded;
mod layers;
mod steps;

use graded::Positions;
pub use graded::{Growth, Rim, outer_radius, place};
pub use layers::{Back, Bond, Layer};
pub use steps::{FEWEST, LayerSteps};

/// Placement of nodes along `r`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MeshKind {
    /// Cell centres, radial Courant number as near to 1 as the geometry allows: dispersion-free along `r` too.
    Matched,
    /// Nodes at `r_i = iΔr` with `Δr = Δz`, as in the paper.
    Paper,
}

/// Node distances of a mesh and the number of steps of size [`Spacing::dz`] through the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// Radial distance Δr of nodes \[R\].
    pub dr: f64,
    /// Axial distance Δz of nodes \[R\]; the time step Δt has the same value \[R/c_p\].
    pub dz: f64,
    /// Number of axial steps J through a layer, `h = JΔz`, over a free back `(J + ½)Δz`; `None` for a half-space.
    pub layer_rows: Option<usize>,
}

/// Tolerance for quotients that are whole numbers within rounding.
const ROUNDING: f64 = 1e-9;

impl Spacing {
    /// Spacing of a matched mesh with `cells` nodes across the radius (or the unit length, if unbounded).
    ///
    /// ```text
    /// bounded: (cells − ½ + offset − slope·(1 − λ))·Δr = R      unbounded: Δr = 1/cells
    /// half-space: Δz = Δr/c, λ = 1                              layer: Δz = h/J, λ = cΔz/Δr, smallest J with λ ≤ 1
    /// over a free back: Δz = h/(J + ½)
    /// ```
    ///
    /// with the speed c of the fastest waves along r.
    ///
    /// * `edge`: where the scheme sees the edge of a punch
    /// * `radius`: radius of the punch \[R\], `None` if unbounded
    /// * `layer`: its thickness h \[R\] and back, `None` for a half-space
    /// * `speed`: c \[c_p\]
    pub fn matched(
        cells: usize,
        radius: Option<f64>,
        layer: Option<(f64, Back)>,
        speed: f64,
        edge: Edge,
    ) -> Self {
        let dr = |slip| Self::radial(cells, radius, edge, slip);
        let Some((h, back)) = layer else {
            let dr = dr(None);
            return Self { dr, dz: dr / speed, layer_rows: None };
        };
        let rows = (speed * h / dr(None) - back.overhang() - ROUNDING).ceil().max(1.0);
        let dz = h / (rows + back.overhang());
        Self { dr: dr(Some(speed * dz)), dz, layer_rows: Some(rows as usize) }
    }

    /// Radial distance Δr of nodes of a matched mesh \[R\], `(cells − ½ + offset − slope)·Δr + slope·c·Δt = R`.
    ///
    /// * `edge`: where the scheme sees the edge of a punch
    /// * `radius`: radius of the punch \[R\], `None` if unbounded
    /// * `slip`: way c·Δt of waves along r in a step \[R\]; `None` if it is Δr
    pub fn radial(cells: usize, radius: Option<f64>, edge: Edge, slip: Option<f64>) -> f64 {
        let (cells, Edge { offset, slope }) = (cells as f64, edge);
        match (radius, slip) {
            (None, _) => 1.0 / cells,
            (Some(radius), None) => radius / (cells - 0.5 + offset),
            (Some(radius), Some(slip)) => (radius - slope * slip) / (cells - 0.5 + offset - slope),
        }
    }

    /// Spacing of the paper's mesh, `Δr = Δz = 1/cells`; `None` if the layer is not a whole number of cells.
    ///
    /// * `thickness`: layer thickness h \[R\], `None` for a half-space
    pub fn paper(cells: usize, thickness: Option<f64>) -> Option<Self> {
        let step = 1.0 / cells as f64;
        let rows = thickness.map(|h| (h * cells as f64, (h * cells as f64).round()));
        let is_whole = |(rows, whole): (f64, f64)| whole >= 1.0 && (rows - whole).abs() <= ROUNDING * whole;
        let layer_rows = rows.map(|(_, whole)| whole as usize);
        rows.is_none_or(is_whole).then_some(Self { dr: step, dz: step, layer_rows })
    }
}

/// Part of the surface, with weights, that a node represents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Support {
    /// One point \[R\].
    Point(f64),
    /// `inner < r < outer`, with uniform weight.
    Cell {
        /// Inner face \[R\].
        inner: f64,
        /// Outer face \[R\].
        outer: f64,
    },
    /// Hat function `1 − |r − middle|/width`, 0 beyond; its part at r < 0 is folded over.
    Hat {
        /// Centre \[R\].
        middle: f64,
        /// Half-width \[R\].
        width: f64,
    },
}

impl Support {
    /// Smallest and largest radius \[R\].
    pub fn ends(&self) -> (f64, f64) {
        match *self {
            Self::Point(r) => (r, r),
            Self::Cell { inner, outer } => (inner, outer),
            Self::Hat { middle, width } => ((middle - width).max(0.0), middle + width),
        }
    }

    /// Radii between the ends where the weight has a kink \[R\].
    pub fn kinks(&self) -> Vec<f64> {
        match *self {
            Self::Point(_) | Self::Cell { .. } => Vec::new(),
            Self::Hat { middle, width } if width > middle => vec![width - middle, middle],
            Self::Hat { middle, .. } => vec![middle],
        }
    }

    /// Weight of radius `r`, up to a factor.
    pub fn weight(&self, r: f64) -> f64 {
        match *self {
            Self::Point(_) | Self::Cell { .. } => 1.0,
            Self::Hat { middle, width } => {
                let hat = |r: f64| (1.0 - (r - middle).abs() / width).max(0.0);
                hat(r) + hat(-r)
            }
        }
    }
}

/// Positions and weights of the nodes along `r`, and the size of the mesh.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Symmetry.
    pub geometry: Geometry,
    /// Radius of node 0 \[R\].
    pub r0: f64,
    /// Radial distance of nodes \[R\], near the contact.
    pub dr: f64,
    /// Axial distance of nodes \[R\], in the first of several layers, near the surface.
    pub dz: f64,
    /// Number of the last row: the backing, which stays at rest, if it is rigid; half a row of cells above the back if that is free.
    pub nz: usize,
    /// Layers from the surface down.
    pub layers: Vec<Layer>,
    /// Far side of the last layer.
    pub back: Back,
    /// Cell areas a_i, shape `(nr,)`: `2∫r dr` over the cell \[R²\], plane `∫dx` \[R\].
    pub area: Vec<f64>,
    /// Weight of the face between nodes i and i+1, shape `(nr,)`: `2 r_{i+½}`, plane 1; the last one is 0, no flux
    /// crosses the outer boundary.
    pub face: Vec<f64>,
    /// True if the backing is that of a layer; on a half-space the mesh only ends there.
    pub has_back: bool,
    /// True if the scheme has cells between nodes, in which displacements along r alternate freely.
    pub cells_between_nodes: bool,
    /// What holds the rim, on which the last nodes stand, if the target ends.
    pub rim: Option<Rim>,
    half_cell_start: bool,
    dt: f64,
    /// Where nodes are, if not at equal distances.
    positions: Option<Positions>,
}

impl Grid {
    /// Builds the mesh.
    ///
    /// * `nr`: number of nodes along r, at least 1
    /// * `nz`: number of axial steps
    pub fn new(geometry: Geometry, kind: MeshKind, spacing: Spacing, nr: usize, nz: usize) -> Self {
        assert!(nr >= 1 && nz >= 1, "a mesh has nodes");
        let dr = spacing.dr;
        let half_cell_start = kind == MeshKind::Paper;
        let r0 = if half_cell_start { 0.0 } else { 0.5 * dr };
        let mut grid = Self {
            geometry,
            r0,
            dr,
            dz: spacing.dz,
            nz,
            layers: Vec::new(),
            back: Back::Rigid,
            dt: spacing.dz,
            area: Vec::new(),
            face: Vec::new(),
            has_back: spacing.layer_rows.is_some(),
            cells_between_nodes: false,
            rim: None,
            half_cell_start,
            positions: None,
        };
        for i in 0..nr {
            let (inner, outer) = grid.cell(i);
            let (area, face) = match geometry {
                // 2∫r dr = (r₊ + r₋)(r₊ − r₋)
                Geometry::Axisymmetric => ((outer + inner) * (outer - inner), 2.0 * outer),
                Geometry::Plane => (outer - inner, 1.0),
            };
            grid.area.push(area);
            grid.face.push(if i + 1 == nr { 0.0 } else { face });
        }
        grid.with_layers(spacing.dz, &[(nz, spacing.dz, Bond::Welded)], Back::Rigid)
    }

    /// The same matched mesh for cells between nodes, half of each at either of its columns: node 0 of an axisymmetric mesh has
    /// 5/4 of its own cell, Δr²/4 + ½·2Δr².
    ///
    /// # Panics
    ///
    /// On the paper's mesh.
    pub fn with_cells_between_nodes(mut self) -> Self {
        assert!(!self.half_cell_start, "cells between nodes need the matched mesh");
        if self.geometry == Geometry::Axisymmetric {
            self.area[0] = 1.25 * self.dr * self.dr;
        }
        self.cells_between_nodes = true;
        self
    }

    /// Number of nodes along r.
    pub fn nr(&self) -> usize {
        self.area.len()
    }

    /// Time step Δt = Δz/c_p of every layer: Courant number 1 along z \[R/c_p\].
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Radius of node `i` \[R\].
    pub fn r(&self, i: usize) -> f64 {
        match &self.positions {
            None => self.r0 + i as f64 * self.dr,
            Some(positions) => positions.radii[i],
        }
    }

    /// Inner and outer face of cell `i` \[R\].
    pub fn cell(&self, i: usize) -> (f64, f64) {
        let i = i as f64;
        if self.half_cell_start {
            (((i - 0.5) * self.dr).max(0.0), (i + 0.5) * self.dr)
        } else {
            (i * self.dr, (i + 1.0) * self.dr)
        }
    }

    /// Support of node `i` in partial contact and under a prescribed motion: a hat out to the neighbouring nodes, or on the
    /// paper's mesh the node itself.
    pub fn support(&self, i: usize) -> Support {
        let middle = self.r(i);
        if self.half_cell_start {
            Support::Point(middle)
        } else {
            Support::Hat { middle, width: self.width(i) }
        }
    }

    /// Weights of the conservative radial operator, shape `(nr,)` each, dimensionless:
    ///
    /// ```text
    /// Λ_r U at i = outward_i·(U_{i+1} − U_i) − inward_i·(U_i − U_{i−1})
    /// axisymmetric: outward_i = r_{i+½}/r_i, inward_i = r_{i−½}/r_i;  plane: 1
    /// ```
    ///
    /// \[KA\] Eq. 21, corrected: averaged `U` in every radial term. At the axis the inner face has no area, so
    /// `inward_0 = 0` (matched) and on the paper's mesh `Λ_r U = 4(U_1 − U_0)`, plane `2(U_1 − U_0)`.
    pub fn radial_weights(&self) -> (Vec<f64>, Vec<f64>) {
        let outward = |i: usize| self.dr * self.face[i] / self.area[i];
        let inward = |i: usize| if i == 0 { 0.0 } else { self.dr * self.face[i - 1] / self.area[i] };
        ((0..self.nr()).map(outward).collect(), (0..self.nr()).map(inward).collect())
    }
}

/// Where a matched mesh sees a sharp punch edge, in cells past the last contact node: at `offset − slope·(1 − λ)`, with the radial
/// Courant number λ. With the edge there stresses converge at second order, and the drag of a plane flat punch is exact (order 2)
/// or within 1e-6 (order 4; full theory, 200 cells: 2e-5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Offset for λ = 1.
    pub offset: f64,
    /// How it falls with λ.
    pub slope: f64,
}

/// β = c_s/c_p, and offsets there. Measured on the plane punch with 60 cells, whose drag is known; the kink is where the stiffness k of the
/// cells reaches its limit. Lateral damping adds less than 0.001 for β ≥ 0.3, 0.009 at 0.2.
const OFFSET_RATIOS: [f64; 20] = [
    0.10, 0.15, 0.20, 0.25, 0.30, 0.35, 0.40, 0.45, 0.50, 0.505, 0.52, 0.55, 0.577, 0.60, 0.65, 0.70, 0.75,
    0.80, 0.83, 0.86,
];
const OFFSETS: [f64; 20] = [
    0.2403, 0.2453, 0.2466, 0.2502, 0.2538, 0.2586, 0.2659, 0.2749, 0.2861, 0.2873, 0.2858, 0.2810, 0.2784,
    0.2776, 0.2804, 0.2905, 0.3088, 0.3389, 0.3662, 0.4048,
];

/// β, and slopes there where other layers have faster waves, so that rows of the struck one are closer than columns. Measured likewise,
/// against the drag with Δz = Δr: means of Δz = Δr/2 and Δr/4, which are within 0.003 of them. A single layer has λ near 1 and does without.
const SLOPE_RATIOS: [f64; 8] = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8];
const SLOPES: [f64; 8] = [0.0469, 0.0479, 0.0502, 0.0543, 0.0615, 0.0642, 0.0734, 0.0954];

impl Edge {
    /// The scheme of second order: a quarter cell.
    pub const SECOND: Self = Self { offset: 0.25, slope: 0.0 };
    /// The scheme of fourth order; measured on the plane punch, the same for any number of cells and any damping.
    pub const FOURTH: Self = Self { offset: 0.2613, slope: 0.0173 };

    /// The scheme of the full theory, linear between measured values.
    ///
    /// * `c_s`: shear wave speed \[c_p\]
    pub fn elastic(c_s: f64) -> Self {
        Self { offset: table(&OFFSET_RATIOS, c_s, |i| OFFSETS[i]), slope: 0.0 }
    }

    /// The same on the struck one of several layers.
    ///
    /// * `c_s`: shear wave speed \[c_p\]
    pub fn elastic_on_layers(c_s: f64) -> Self {
        Self { slope: table(&SLOPE_RATIOS, c_s, |i| SLOPES[i]), ..Self::elastic(c_s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(geometry: Geometry, kind: MeshKind) -> Grid {
        Grid::new(geometry, kind, Spacing { dr: 0.1, dz: 0.2, layer_rows: None }, 20, 5)
    }

    #[test]
    fn matched_spacing_puts_the_edge_where_the_scheme_sees_it() {
        let fourth = Spacing::matched(100, Some(1.0), Some((0.97, Back::Rigid)), 0.5, Edge::FOURTH);
        let lambda = 0.5 * fourth.dz / fourth.dr;
        assert!(lambda < 0.9999);
        assert!((fourth.dr * (99.5 + 0.2613 - 0.0173 * (1.0 - lambda)) - 1.0).abs() < 1e-14);
        let spacing = Spacing::matched(100, Some(1.0), Some((1.0, Back::Rigid)), 0.5, Edge::SECOND);
        assert!((99.5 * spacing.dr + 0.25 * spacing.dr - 1.0).abs() < 1e-15);
        assert_eq!(spacing.layer_rows, Some(50));
        assert!(0.5 * spacing.dz <= spacing.dr * (1.0 + 1e-12));
    }

    #[test]
    fn layer_takes_the_smallest_number_of_rows_with_courant_at_most_one() {
        for (cells, h, c_s) in [(50, 1.0, 0.3), (33, 0.7, 0.8), (64, 2.5, 0.41)] {
            for back in [Back::Rigid, Back::Free] {
                let s = Spacing::matched(cells, Some(1.0), Some((h, back)), c_s, Edge::FOURTH);
                let steps = s.layer_rows.expect("a layer");
                let rows = steps as f64 + if back == Back::Free { 0.5 } else { 0.0 };
                assert!((s.dz * rows / h - 1.0).abs() < 1e-15 && c_s * s.dz <= s.dr * (1.0 + 1e-8));
                assert!(steps == 1 || c_s * h / (rows - 1.0) > s.dr);
            }
        }
    }

    #[test]
    fn paper_spacing_needs_whole_cells() {
        assert_eq!(Spacing::paper(50, Some(1.5)).and_then(|s| s.layer_rows), Some(75));
        assert!(Spacing::paper(75, Some(0.5)).is_none());
    }

    #[test]
    fn areas_fill_the_disc() {
        for kind in [MeshKind::Matched, MeshKind::Paper] {
            let g = grid(Geometry::Axisymmetric, kind);
            let (_, outer) = g.cell(19);
            assert!((g.area.iter().sum::<f64>() - outer * outer).abs() < 1e-13);
        }
    }

    #[test]
    fn radial_operator_is_exact_on_r_squared() {
        // (u_rr + u_r/r) of r² is 4, plane: 2; the mesh operator reproduces it at every node but the last.
        for (geometry, exact) in [(Geometry::Axisymmetric, 4.0), (Geometry::Plane, 2.0)] {
            for kind in [MeshKind::Matched, MeshKind::Paper] {
                let g = grid(geometry, kind);
                let (outward, inward) = g.radial_weights();
                let u: Vec<f64> = (0..g.nr()).map(|i| g.r(i) * g.r(i)).collect();
                for i in 0..g.nr() - 1 {
                    let flux_in = if i == 0 { 0.0 } else { inward[i] * (u[i] - u[i - 1]) };
                    let value = (outward[i] * (u[i + 1] - u[i]) - flux_in) / (g.dr * g.dr);
                    assert!((value - exact).abs() < 1e-11, "{geometry:?} {kind:?} node {i}: {value}");
                }
            }
        }
    }

    #[test]
    fn the_full_theory_has_measured_offsets() {
        let edge = |c_s| Edge::elastic(c_s).offset;
        assert_eq!((edge(0.5), edge(0.05), edge(0.865)), (0.2861, 0.2403, 0.4048));
        assert!((edge(0.275) - 0.2520).abs() < 1e-12);
    }
}
