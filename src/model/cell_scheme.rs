//! The scheme of [`super::cells`] on a mesh: weights by layer and column, and operators node by node, for the plain stepper and for
//! what the fast engine shows.

use super::{
    Field,
    cells::{self, Cell, CellStrains, Column, ColumnWeights, Medium, Parts, Row, Strain, Stress},
    reference::Level,
    scheme::{self, RadialWeights},
    strength::Strength,
};
use crate::{
    geometry::Geometry,
    grid::{Bond, Grid, Layer},
    material::{Stiffness, Waves},
};

/// The scheme of cells on a mesh.
#[derive(Clone, Debug)]
pub struct CellScheme {
    pub(super) grid: Grid,
    /// Layers from the surface down.
    pub(super) layers: Vec<CellLayer>,
    /// What they bear.
    strengths: Vec<Strength>,
    /// Lateral damping σ.
    damping_number: f64,
    /// Weights of the lateral damping, if there is any.
    damping: Option<[Vec<RadialWeights>; 2]>,
}

/// A layer by itself.
#[derive(Clone, Debug)]
pub(super) struct CellLayer {
    pub(super) waves: Waves,
    pub(super) medium: Medium,
    pub(super) weights: Vec<ColumnWeights>,
    /// Distance of rows \[R\].
    dz: f64,
    /// Unit of its stresses, Z·c_p \[γc_p² of the struck layer\].
    stress: f64,
}

impl CellScheme {
    /// The scheme on a mesh, see [`Grid::with_cells_between_nodes`].
    ///
    /// * `layers`: as many as the mesh has
    /// * `damping`: σ of the lateral damping
    pub(super) fn new(grid: Grid, layers: &[Waves], damping: f64) -> Self {
        assert_eq!(layers.len(), grid.layers.len(), "layers of the mesh");
        let layer = |(waves, layer): (&Waves, &Layer)| {
            let c_p = layer.dz / grid.dt();
            let medium = Medium::new(layer.dz / grid.dr, &Stiffness::isotropic(waves.shear / c_p));
            let weights = cells::column_weights(&grid, &medium);
            CellLayer { waves: *waves, medium, weights, dz: layer.dz, stress: waves.impedance * c_p }
        };
        let layers: Vec<_> = layers.iter().zip(&grid.layers).map(layer).collect();
        let strengths = vec![Strength::default(); layers.len()];
        let damping_number = damping;
        let damping = (damping > 0.0).then(|| cells::damping_weights(&grid, damping));
        Self { layers, strengths, grid, damping_number, damping }
    }

    /// The same with what is known of the strengths of its layers.
    pub fn with_strengths(self, strengths: Vec<Strength>) -> Self {
        assert_eq!(strengths.len(), self.layers.len(), "layers of the mesh");
        Self { strengths, ..self }
    }

    /// What its layers bear, from the surface down.
    pub fn strengths(&self) -> &[Strength] {
        &self.strengths
    }

    /// Row `j`.
    pub(super) fn at_row(&self, j: usize) -> NodeRow<'_> {
        let rows = self.grid.layer(j);
        let row = match j {
            j if j == rows.first => Row::Surface,
            j if self.grid.is_above_free_back(j) => Row::Membrane,
            j if j == rows.last() => Row::Backing,
            _ => Row::Interior,
        };
        let number = self.grid.layer_of(j);
        let (layer, strength) = (&self.layers[number], &self.strengths[number]);
        NodeRow { scheme: self, layer, strength, interface: self.grid.interface_of(j), j, row }
    }

    /// The layer of row `j`.
    pub(super) fn layer(&self, j: usize) -> &CellLayer {
        &self.layers[self.grid.layer_of(j)]
    }

    /// Displacement number `field` in column `i`, which may be an image about the axis or at rest beyond the mesh.
    pub(super) fn at(&self, level: &Level<2>, field: usize, j: usize, i: isize) -> f64 {
        let (column, sign) = image(field, i);
        if column < self.grid.nr() { sign * level[field][[j, column]] } else { 0.0 }
    }

    /// Displacement number `field` of node (j, i) at level k+1 with lateral damping.
    ///
    /// * `free`: without it
    pub(super) fn damped(
        &self,
        free: f64,
        [before, now]: [&Level<2>; 2],
        field: usize,
        j: usize,
        i: usize,
    ) -> f64 {
        let Some(weights) = &self.damping else { return free };
        let weights = &weights[field];
        let moved = |i: isize| self.at(now, field, j, i) - self.at(before, field, j, i);
        // −√(4σ)·E_r of it, which has the images that it has
        let once = |i: isize| {
            let (column, sign) = image(field, i);
            let Some(weights) = weights.get(column) else { return 0.0 };
            let i = column as isize;
            sign * scheme::double_radial([moved(i - 2), moved(i), moved(i + 2)], *weights)
        };
        let column = i as isize;
        scheme::take_radial(free, [once(column - 2), once(column), once(column + 2)], weights[i])
    }

    /// Strains of the cell between rows j and j+1 at the inner side of column `i`.
    pub(super) fn cell_strains(&self, level: &Level<2>, j: usize, i: usize) -> CellStrains {
        let [u, v] = [0, 1].map(|field| {
            [i as isize - 1, i as isize].map(|i| [j, j + 1].map(|j| self.at(level, field, j, i)))
        });
        let CellLayer { weights, medium, .. } = self.layer(j);
        cells::cell_strains(u, v, &weights[i], medium)
    }

    /// D of the cell at the inner side of column `i` in row `j`.
    pub(super) fn spread(&self, level: &Level<2>, j: usize, i: usize) -> f64 {
        let ColumnWeights { inner, outer, .. } = self.layer(j).weights[i];
        outer * self.at(level, 1, j, i as isize) - inner * self.at(level, 1, j, i as isize - 1)
    }

    /// −σ_zz and σ_rz at an interface in column `i` \[γc_p²\], see [`scheme::interface_stress`].
    fn interface_stress(
        &self,
        at: &dyn Fn(usize, usize, isize) -> f64,
        interface: usize,
        i: usize,
    ) -> [f64; 2] {
        let last = self.grid.layers[interface].last();
        let [upper, lower] = [last, last + 1].map(|j| {
            let row = self.at_row(j);
            let CellLayer { medium, stress, .. } = row.layer;
            // neither component has the hoop strain
            let Stress { zz, rz, .. } = row.mean_strain(at, i, 0.0).stress(medium);
            [-stress * zz, stress * rz]
        });
        let shares = scheme::shares(self.impedances(interface));
        let joined = [0, 1].map(|part| scheme::interface_stress(shares, [upper[part], lower[part]]));
        match self.grid.layers[interface + 1].bond {
            Bond::Welded => joined,
            Bond::Sliding => [joined[0], 0.0],
        }
    }

    /// Impedances of the layers above and below an interface.
    pub(super) fn impedances(&self, interface: usize) -> [f64; 2] {
        [interface, interface + 1].map(|layer| self.impedance(layer))
    }

    /// Impedance of a layer \[γc_p of the struck one\].
    pub(super) fn impedance(&self, layer: usize) -> f64 {
        self.layers[layer].waves.impedance
    }

    /// Displacements of node (j, i) at level k+1 if its layer were by itself.
    pub(super) fn by_itself(&self, before: &Level<2>, now: &Level<2>, j: usize, i: usize) -> [f64; 2] {
        let accelerations = self.at_row(j).accelerations(self.reading(now), i);
        [0, 1].map(|field| {
            let free = cells::advanced(before[field][[j, i]], now[field][[j, i]], accelerations[field]);
            self.damped(free, [before, now], field, j, i)
        })
    }

    /// [`CellScheme::by_itself`] of a node of an interface, of either layer.
    pub(super) fn faces(
        &self,
        before: &Level<2>,
        now: &Level<2>,
        interface: usize,
        i: usize,
    ) -> [[f64; 2]; 2] {
        let last = self.grid.layers[interface].last();
        [last, last + 1].map(|j| self.by_itself(before, now, j, i))
    }

    /// The largest principal strain by magnitude in the middle of the cell between rows j and j+1 at the inner side of column `i`.
    ///
    /// * `at`: displacements, see [`NodeRow::columns`]
    pub(super) fn largest_strain(&self, at: impl Fn(usize, usize, isize) -> f64, j: usize, i: usize) -> f64 {
        let [u, v] = [0, 1]
            .map(|field| [i as isize - 1, i as isize].map(|column| [j, j + 1].map(|j| at(field, j, column))));
        let CellLayer { weights, medium, dz, .. } = self.layer(j);
        let ColumnWeights { inner, outer, hoop, .. } = weights[i];
        cells::largest_strain(u, v, [inner, outer], hoop, medium.courant) / (2.0 * dz)
    }

    /// Stress in the middle of that cell \[γc_p²\].
    ///
    /// * `at`: displacements, see [`NodeRow::columns`]
    pub(super) fn cell_stress(&self, at: impl Fn(usize, usize, isize) -> f64, j: usize, i: usize) -> Stress {
        let [u, v] = [0, 1]
            .map(|field| [i as isize - 1, i as isize].map(|column| [j, j + 1].map(|j| at(field, j, column))));
        let CellLayer { weights, medium, dz, stress, .. } = self.layer(j);
        let [axial, lateral, shear, ..] = cells::cell_strains(u, v, &weights[i], medium).map(|x| x / dz);
        let [inner, outer] = [0, 1].map(|side| weights[i].hoop[side] * (v[side][0] + v[side][1]));
        let hoop = 0.5 * (inner + outer) / dz;
        Strain { axial, lateral, hoop, shear }.stress(medium).times(*stress)
    }

    /// Stress on the surface, row 0, or on the backing, at column `i` \[γc_p²\].
    ///
    /// * `at`: displacements, see [`NodeRow::columns`]
    /// * `pressure`: on the node of the surface
    pub(super) fn face_stress(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        pressure: f64,
        row: usize,
        i: usize,
    ) -> Stress {
        let (nodes, CellLayer { medium, stress, .. }) = (self.at_row(row), self.layer(row));
        let strain = if row == 0 { nodes.strain(at, pressure, i) } else { nodes.back_strain(at, i) };
        strain.stress(medium).times(*stress)
    }

    /// Displacements of a level as the operators read them.
    pub(super) fn reading<'a>(&'a self, level: &'a Level<2>) -> impl Fn(usize, usize, isize) -> f64 + 'a {
        |field, j, i| self.at(level, field, j, i)
    }

    /// The mesh.
    pub(super) fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Constants of the material of a layer, and its weights by column, shape `(nr + 1,)`.
    pub(super) fn layer_weights(&self, layer: usize) -> (&Medium, &[ColumnWeights]) {
        let CellLayer { medium, weights, .. } = &self.layers[layer];
        (medium, weights)
    }

    /// The largest of the Courant numbers of its layers.
    pub(super) fn courant(&self) -> f64 {
        self.layers.iter().fold(0.0, |largest, layer| layer.medium.courant.max(largest))
    }

    /// Lateral damping σ.
    pub(super) fn damping_number(&self) -> f64 {
        self.damping_number
    }

    /// Weights of the lateral damping by column, if there is any.
    pub(super) fn damping(&self) -> Option<&[Vec<RadialWeights>; 2]> {
        self.damping.as_ref()
    }

    /// Share of a row's cells of its layer in the mass of its nodes, per area.
    pub(super) fn depth(&self, j: usize) -> f64 {
        self.grid.cell_rows(j) * (self.layer(j).waves.impedance * self.grid.dt())
    }
}

/// A row of nodes with its layer.
#[derive(Clone, Copy)]
pub(super) struct NodeRow<'a> {
    scheme: &'a CellScheme,
    layer: &'a CellLayer,
    strength: &'a Strength,
    /// Number of the interface it is at, if it is at one.
    interface: Option<usize>,
    j: usize,
    /// Where it is in its layer.
    row: Row,
}

impl NodeRow<'_> {
    /// Columns i−1, i, i+1 around the row, and the weights of the cells between them.
    ///
    /// * `at`: displacements by their number, row and column; that of images about the axis and of nodes beyond the mesh, too
    #[inline(always)]
    fn columns(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        i: usize,
    ) -> ([Column; 3], [&ColumnWeights; 2]) {
        let (weights, i) = (&self.layer.weights, i as isize);
        let columns = [self.column(&at, i - 1), self.column(&at, i), self.column(&at, i + 1)];
        (columns, [&weights[i as usize], &weights[i as usize + 1]])
    }

    /// Column i around the row. A function: closures and maps of arrays may not be inlined.
    #[inline(always)]
    fn column(&self, at: &impl Fn(usize, usize, isize) -> f64, i: isize) -> Column {
        let [above, here, below] = [self.j.saturating_sub(1), self.j, (self.j + 1).min(self.scheme.grid.nz)];
        let u = [at(0, above, i), at(0, here, i), at(0, below, i)];
        let v = [at(1, above, i), at(1, here, i), at(1, below, i)];
        Column::new(self.row, u, v, &self.layer.medium.constants(0.0))
    }

    /// `Δt²` times the accelerations of node i but for damping, if its layer were by itself.
    ///
    /// * `at`: displacements, see [`NodeRow::columns`]
    pub(super) fn accelerations(&self, at: impl Fn(usize, usize, isize) -> f64, i: usize) -> [f64; 2] {
        let (columns, weights) = self.columns(at, i);
        let constants = self.layer.medium.constants(0.0);
        let [first, here, last] = columns.map(|column| column.parts(&constants));
        let cell = |inner: &Parts<f64>, outer: &Parts<f64>, weights: &ColumnWeights| {
            Cell::of(&outer.as_outer(weights.outer, &constants), &inner.as_inner(weights.inner, &constants))
        };
        let [inner, outer] = [cell(&first, &here, weights[0]), cell(&here, &last, weights[1])];
        let ColumnWeights { axial, slip, radial, .. } = *weights[0];
        cells::accelerations([&inner, &outer], axial, slip, radial)
    }

    /// Strains at node i.
    ///
    /// * `at`: displacements, see [`NodeRow::columns`]
    /// * `pressure`: on the surface at this node
    #[inline(always)]
    pub(super) fn strain(&self, at: impl Fn(usize, usize, isize) -> f64, pressure: f64, i: usize) -> Strain {
        let Self { scheme, interface, j, row, .. } = *self;
        let hoop = self.hoop(&at, i);
        let stresses = match (interface, row) {
            _ if j == 0 => [pressure, 0.0],
            (Some(interface), _) => scheme.interface_stress(&at, interface, i),
            (None, Row::Membrane) => {
                // in the middle between the cells above and the back
                let above = Self { row: Row::Backing, ..*self }.mean_strain(&at, i, hoop);
                return above.between(&self.back_strain(at, i), 0.5);
            }
            (None, row) => {
                let mean = self.mean_strain(at, i, hoop);
                // the backing is smooth
                return if row == Row::Backing { Strain { shear: 0.0, ..mean } } else { mean };
            }
        };
        self.strain_on_face(at, stresses, i, hoop)
    }

    /// Strains at the back under node i of the last row.
    ///
    /// * `at`: displacements, see [`NodeRow::columns`]
    pub(super) fn back_strain(&self, at: impl Fn(usize, usize, isize) -> f64, i: usize) -> Strain {
        match self.row {
            Row::Membrane => self.strain_on_face(&at, [0.0; 2], i, self.hoop(&at, i)),
            Row::Surface | Row::Interior | Row::Backing => self.strain(at, 0.0, i),
        }
    }

    /// v/r at node i, plane 0.
    #[inline(always)]
    fn hoop(&self, at: &impl Fn(usize, usize, isize) -> f64, i: usize) -> f64 {
        match self.scheme.grid.geometry {
            Geometry::Axisymmetric => at(1, self.j, i as isize) / self.scheme.grid.r(i),
            Geometry::Plane => 0.0,
        }
    }

    /// Strains at node i of a face whose stresses are known.
    ///
    /// * `at`: displacements, see [`NodeRow::columns`]
    /// * `stresses`: −σ_zz and σ_rz \[γc_p²\]
    fn strain_on_face(
        &self,
        at: impl Fn(usize, usize, isize) -> f64,
        [pressure, shear]: [f64; 2],
        i: usize,
        hoop: f64,
    ) -> Strain {
        let v = [-1, 0, 1].map(|di| at(1, self.j, i as isize + di));
        let CellLayer { weights, medium, dz, stress, .. } = self.layer;
        let weights = [&weights[i], &weights[i + 1]];
        let strain = Strain::on_surface(v, weights, medium, *dz, hoop, pressure / stress);
        Strain { shear: shear / (stress * medium.shear), ..strain }
    }

    /// Mean strains of the cells around node i in its layer.
    #[inline(always)]
    fn mean_strain(&self, at: impl Fn(usize, usize, isize) -> f64, i: usize, hoop: f64) -> Strain {
        let CellLayer { medium, dz, .. } = self.layer;
        let (columns, weights) = self.columns(at, i);
        let [inner, here, outer] = &columns;
        Strain::mean([inner, here, outer], weights, medium, *dz, hoop)
    }

    /// What a field of stress shows in the row.
    ///
    /// # Panics
    ///
    /// If the field is none of stress.
    #[inline]
    pub(super) fn stress(&self, field: Field, strain: &Strain) -> f64 {
        let CellLayer { medium, stress: unit, .. } = self.layer;
        self.strength.shown(field, &strain.stress(medium), *unit)
    }
}

/// Column that stands at column `i` of displacement number `field`, and its sign: u is even about the axis, v odd.
fn image(field: usize, i: isize) -> (usize, f64) {
    (scheme::image_column(i), if i < 0 && field == 1 { -1.0 } else { 1.0 })
}
