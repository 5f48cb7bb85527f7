//! The scheme of [`super::cells`] on a mesh: weights by column, and operators node by node, for the plain stepper and for what
//! the fast engine shows.

use super::{
    Field,
    cells::{self, Cell, CellStrains, Column, ColumnWeights, Medium, Row, Strain},
    reference::Level,
    scheme::{self, RadialWeights},
};
use crate::{geometry::Geometry, grid::Grid};

/// The scheme of cells on a mesh.
#[derive(Clone, Debug)]
pub struct CellScheme {
    pub(super) grid: Grid,
    pub(super) medium: Medium,
    pub(super) weights: Vec<ColumnWeights>,
    /// Lateral damping σ.
    damping_number: f64,
    /// Weights of the lateral damping, if there is any.
    damping: Option<[Vec<RadialWeights>; 2]>,
}

impl CellScheme {
    /// The scheme on a mesh, see [`Grid::with_cells_between_nodes`].
    ///
    /// * `c_s`: shear wave speed \[c_p\]
    /// * `damping`: σ of the lateral damping
    pub(super) fn new(grid: Grid, c_s: f64, damping: f64) -> Self {
        let medium = Medium::new(&grid, c_s);
        let weights = cells::column_weights(&grid, &medium);
        let damping_number = damping;
        let damping = (damping > 0.0).then(|| cells::damping_weights(&grid, damping));
        Self { grid, medium, weights, damping_number, damping }
    }

    /// Where row `j` is.
    fn row(&self, j: usize) -> Row {
        match j {
            0 => Row::Surface,
            j if j == self.grid.nz => Row::Backing,
            _ => Row::Interior,
        }
    }

    /// Displacement number `field` in column `i`, which may be an image about the axis or at rest beyond the mesh.
    pub(super) fn at(&self, level: &Level<2>, field: usize, j: usize, i: isize) -> f64 {
        let (column, sign) = image(field, i);
        if column < self.grid.nr() { sign * level[field][[j, column]] } else { 0.0 }
    }

    /// Columns i−1, i, i+1 around row `j`, and the weights of the cells between them.
    ///
    /// * `at`: displacements by their number, row and column; that of images about the axis and of nodes beyond the mesh, too
    fn columns(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        j: usize,
        i: usize,
    ) -> ([Column; 3], [&ColumnWeights; 2]) {
        let rows = [j.saturating_sub(1), j, (j + 1).min(self.grid.nz)];
        let columns = [-1, 0, 1].map(|di| {
            let [u, v] = [0, 1].map(|field| rows.map(|j| at(field, j, i as isize + di)));
            Column::new(self.row(j), u, v)
        });
        (columns, [&self.weights[i], &self.weights[i + 1]])
    }

    /// `Δt²` times the accelerations of node (j, i) but for damping.
    ///
    /// * `at`: displacements, see [`CellScheme::columns`]
    pub(super) fn accelerations(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        j: usize,
        i: usize,
    ) -> [f64; 2] {
        let (columns, weights) = self.columns(at, j, i);
        let [inner, outer] =
            [0, 1].map(|cell| Cell::new(&columns[cell], &columns[cell + 1], weights[cell], &self.medium));
        cells::accelerations(&inner, &outer, weights[0])
    }

    /// What lateral damping adds to displacement number `field` of node (j, i).
    pub(super) fn damped(
        &self,
        before: &Level<2>,
        now: &Level<2>,
        field: usize,
        j: usize,
        i: usize,
    ) -> Option<f64> {
        let weights = &self.damping.as_ref()?[field];
        let moved = |i: isize| self.at(now, field, j, i) - self.at(before, field, j, i);
        // −√(4σ)·E_r of it, which has the images that it has
        let once = |i: isize| {
            let (column, sign) = image(field, i);
            let Some(weights) = weights.get(column) else { return 0.0 };
            let i = column as isize;
            sign * scheme::double_radial([moved(i - 2), moved(i), moved(i + 2)], *weights)
        };
        let i = i as isize;
        Some(-scheme::double_radial([once(i - 2), once(i), once(i + 2)], weights[i as usize]))
    }

    /// Strains of the cell between rows j and j+1 at the inner side of column `i`.
    pub(super) fn cell_strains(&self, level: &Level<2>, j: usize, i: usize) -> CellStrains {
        let [u, v] = [0, 1].map(|field| {
            [i as isize - 1, i as isize].map(|i| [j, j + 1].map(|j| self.at(level, field, j, i)))
        });
        cells::cell_strains(u, v, &self.weights[i], &self.medium)
    }

    /// Strains at node (j, i).
    ///
    /// * `at`: displacements, see [`CellScheme::columns`]
    /// * `pressure`: on the surface at this node
    pub(super) fn strain(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        pressure: f64,
        j: usize,
        i: usize,
    ) -> Strain {
        let hoop = match self.grid.geometry {
            Geometry::Axisymmetric => at(1, j, i as isize) / self.grid.r(i),
            Geometry::Plane => 0.0,
        };
        if j == 0 {
            let v = [-1, 0, 1].map(|di| at(1, 0, i as isize + di));
            let weights = [&self.weights[i], &self.weights[i + 1]];
            return Strain::on_surface(v, weights, &self.medium, self.grid.dz, hoop, pressure);
        }
        let (columns, weights) = self.columns(at, j, i);
        let [inner, here, outer] = &columns;
        let mean = Strain::mean([inner, here, outer], weights, &self.medium, self.grid.dz, hoop);
        // the backing is smooth
        if j == self.grid.nz { Strain { shear: 0.0, ..mean } } else { mean }
    }

    /// The largest principal strain by magnitude in the middle of the cell between rows j and j+1 at the inner side of column `i`.
    ///
    /// * `at`: displacements, see [`CellScheme::columns`]
    pub(super) fn largest_strain(&self, at: impl Fn(usize, usize, isize) -> f64, j: usize, i: usize) -> f64 {
        let [u, v] = [0, 1]
            .map(|field| [i as isize - 1, i as isize].map(|column| [j, j + 1].map(|j| at(field, j, column))));
        let ColumnWeights { inner, outer, hoop, .. } = self.weights[i];
        cells::largest_strain(u, v, [inner, outer], hoop, self.medium.courant) / (2.0 * self.grid.dz)
    }

    /// What a field of stress shows.
    ///
    /// # Panics
    ///
    /// If the field is none of stress.
    pub(super) fn stress(&self, field: Field, strain: &Strain) -> f64 {
        let stress = strain.stress(&self.medium);
        match field {
            Field::Stress => -stress.zz,
            Field::StressRr => -stress.rr,
            Field::StressTt => -stress.tt,
            Field::StressRz => -stress.rz,
            Field::Pressure => stress.pressure(),
            Field::VonMises => stress.von_mises(),
            Field::MaxShear => stress.max_shear(),
            Field::Displacement | Field::DisplacementR | Field::Velocity | Field::VelocityR => {
                unreachable!("{field:?} is no stress")
            }
        }
    }

    /// Displacements of a level as the operators read them.
    pub(super) fn reading<'a>(&'a self, level: &'a Level<2>) -> impl Fn(usize, usize, isize) -> f64 + 'a {
        |field, j, i| self.at(level, field, j, i)
    }

    /// The mesh.
    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Constants of the material.
    pub(super) fn medium(&self) -> &Medium {
        &self.medium
    }

    /// Weights by column, shape `(nr + 1,)`.
    pub(super) fn weights(&self) -> &[ColumnWeights] {
        &self.weights
    }

    /// Lateral damping σ.
    pub(super) fn damping_number(&self) -> f64 {
        self.damping_number
    }

    /// Weights of the lateral damping by column, if there is any.
    pub(super) fn damping(&self) -> Option<&[Vec<RadialWeights>; 2]> {
        self.damping.as_ref()
    }

    /// Share of a row's cells in the mass of its nodes.
    pub(super) fn depth(&self, j: usize) -> f64 {
        if j == 0 || j == self.grid.nz { 0.5 * self.grid.dz } else { self.grid.dz }
    }
}

/// Column that stands at column `i` of displacement number `field`, and its sign: u is even about the axis, v odd.
fn image(field: usize, i: isize) -> (usize, f64) {
    (scheme::image_column(i), if i < 0 && field == 1 { -1.0 } else { 1.0 })
}
