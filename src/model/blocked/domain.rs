//! What the engine works on: levels of a field, and the weights of the scheme.

use std::ops::Range;

use super::{
    cells::{BACKING, CellPatch, CellRow, FREE, INTERIOR, SURFACE, largest_stretch},
    damping,
    dispatch::Instructions,
    energy::EnergySum,
    interface::{Faces, Interfaces, PIECE},
    levels::{Around, Levels, Patch, around},
    vector::BLOCK,
    weights::{AxialWeights, CellLayers, Plate, Weighted},
};
use crate::{
    grid::{Back, Grid},
    model::{cell_scheme::CellScheme, scheme::Corner},
};

/// What the engine works on.
///
/// Bands, tiles and the light cone are cut by depth, in axial steps, so that both rows of an interface belong to one of them; fields have
/// rows by number.
pub struct Domain {
    /// The field.
    pub levels: Levels,
    /// The mesh. Columns that fill the last block have no weight and stay at rest.
    pub grid: Grid,
    /// What happens at interfaces.
    pub interfaces: Interfaces,
    /// The scheme with its weights.
    scheme: Weighted,
    /// Instructions to use.
    instructions: Instructions,
}

impl Domain {
    /// A mesh at rest.
    ///
    /// * `plates`: layers from the surface down
    /// * `corner`: the mixed-derivative correction, if there is one
    pub fn new(
        grid: &Grid,
        plates: &[Plate<'_>],
        corner: Option<Corner>,
        instructions: Instructions,
    ) -> Self {
        let levels = Levels::new(Corner::levels(corner.as_ref()), 1, grid.nz + 2, grid.nr());
        let weights = AxialWeights::new(grid, plates, corner, levels.columns());
        Self::of(grid, levels, Weighted::Axial(weights), instructions)
    }

    /// A mesh with cells between nodes at rest.
    pub fn with_cells(scheme: CellScheme, instructions: Instructions) -> Self {
        let grid = scheme.grid().clone();
        let levels = Levels::new(3, 2, grid.nz + 2, grid.nr());
        let weights = CellLayers::new(scheme, levels.columns());
        Self::of(&grid, levels, Weighted::Cells(Box::new(weights)), instructions)
    }

    fn of(grid: &Grid, levels: Levels, scheme: Weighted, instructions: Instructions) -> Self {
        let is_plain = grid.layers.len() == 1 && grid.back == Back::Rigid;
        assert!(is_plain || grid.layers.iter().all(|layer| layer.steps >= 2), "a layer of one row of cells");
        let interfaces = Interfaces::new(grid.layers.len() - 1);
        Self { grid: grid.clone(), scheme, instructions, levels, interfaces }
    }

    /// The scheme with its weights.
    pub fn scheme(&self) -> &Weighted {
        &self.scheme
    }

    /// Impedance of a layer \[γc_p of the struck one\].
    pub fn impedance(&self, layer: usize) -> f64 {
        match &self.scheme {
            Weighted::Axial(weights) => weights.impedance(layer),
            Weighted::Cells(weights) => weights.scheme.impedance(layer),
        }
    }

    /// Axial steps around a node that its next level depends on.
    pub fn reach(&self) -> usize {
        match &self.scheme {
            Weighted::Axial(weights) if weights.corner(0).is_some() => 2,
            _ => 1,
        }
    }

    /// Columns around a node that its next level depends on.
    pub fn lateral_reach(&self) -> usize {
        match &self.scheme {
            Weighted::Axial(_) => self.reach(),
            Weighted::Cells(_) => damping::REACH,
        }
    }

    /// Columns by which a tile is shifted from level to level: whole vectors, and no less than the reach.
    pub fn shift(&self) -> usize {
        self.instructions.width().max(self.lateral_reach())
    }

    /// The last row that moves: that before a rigid backing, which in the full theory yields along r itself.
    pub fn last_row(&self) -> usize {
        match &self.scheme {
            Weighted::Axial(_) if self.grid.back == Back::Rigid => self.grid.nz - 1,
            _ => self.grid.nz,
        }
    }

    /// True if there is strain on the back: but for a free one of the simplified theory.
    pub fn strains_back(&self) -> bool {
        matches!(self.scheme, Weighted::Cells(_)) || self.grid.back == Back::Rigid
    }

    /// Depth of the last row that moves, in axial steps.
    pub fn last_depth(&self) -> usize {
        self.grid.depth() - (self.grid.nz - self.last_row())
    }

    /// Advances `rows` of `columns`, whole vectors, to `level`.
    ///
    /// * `energies`: of `rows`, to add theirs to, if it is to be counted
    ///
    /// # Safety
    ///
    /// The nodes hold the two levels before, as do the rows of [`Domain::reach`] axial steps and a vector around them, images among them; no
    /// other thread touches the nodes or writes to those around them; both rows of an interface are among the rows, or none.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn advance(
        &self,
        level: usize,
        rows: Range<usize>,
        columns: Range<usize>,
        mut energies: Option<&mut [EnergySum]>,
    ) {
        assert!(rows.start > 0 && rows.end <= self.last_row() + 1 && columns.end <= self.levels.columns());
        let mut j = rows.start;
        while j < rows.end {
            let end = self.alike(j).min(rows.end);
            let energies = energies.as_mut().map(|energies| &mut energies[j - rows.start..end - rows.start]);
            // SAFETY: the caller's promise; rows and columns lie inside the arrays with a row and a block around them, and with the
            // mixed-derivative correction, which reads two rows, with the images beyond row 0 and the backing
            unsafe {
                match self.interface(j) {
                    Some(interface) => self.advance_interface(level, interface, columns.clone(), energies),
                    None => self.advance_rows(level, j..end, columns.clone(), energies),
                }
            }
            j = end;
        }
    }

    /// Number of the interface whose upper row is row `j`, if it is at one.
    fn interface(&self, j: usize) -> Option<usize> {
        self.grid.interface_of(j).filter(|interface| self.grid.layers[*interface].last() == j)
    }

    /// End of the rows from row `j` on that are advanced at once: rows of a layer far from its faces, an interface, or a row by itself.
    fn alike(&self, j: usize) -> usize {
        if self.interface(j).is_some() {
            return j + 2;
        }
        let layer = self.grid.layer(j);
        // the backing is no row of them, whether it moves or not
        let last = layer.last() - usize::from(self.reach() == 2 && !self.has_rigid_back(j));
        if self.around(j).is_some() || j >= last { j + 1 } else { last }
    }

    /// True if the layer of row `j` lies on a rigid back.
    fn has_rigid_back(&self, j: usize) -> bool {
        self.grid.back == Back::Rigid && self.grid.layer(j).last() == self.grid.nz
    }

    /// What is around row `j` of the simplified theory, where it is not what stands there: at free faces of layers and beside them even
    /// images. Those beyond the surface and a rigid backing stand in memory.
    pub fn around(&self, j: usize) -> Option<Around> {
        let (layer, stride) = (self.grid.layer(j), self.levels.stride() as isize);
        let (first, last) = (layer.first, layer.last());
        let [mut a, mut b, mut d, mut e] = around(self.levels.stride());
        if first > 0 && j == first {
            (a, b) = (e, d);
        } else if first > 0 && j == first + 1 {
            a = 0;
        }
        if j == last {
            (d, e) = (b, a);
        } else if j + 1 == last && !self.has_rigid_back(j) {
            e = 0;
        }
        // without the mixed-derivative correction nothing reaches two rows
        let is_near = if self.reach() == 2 { [a, e] } else { [2 * b, 2 * d] };
        (is_near != [-2 * stride, 2 * stride]).then_some([a, b, d, e])
    }

    /// Advances `rows` of a layer that have the same around them.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`].
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    unsafe fn advance_rows(
        &self,
        level: usize,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: Option<&mut [EnergySum]>,
    ) {
        // SAFETY: the caller's promise
        unsafe {
            match &self.scheme {
                Weighted::Axial(weights) => {
                    let patch = self.patch(level, weights, rows.start);
                    match energies {
                        Some(energies) => {
                            self.instructions.advance::<true>(patch, rows, columns, &weights.area, energies);
                        }
                        None => self.instructions.advance::<false>(patch, rows, columns, &[], &mut []),
                    }
                }
                Weighted::Cells(weights) => {
                    let patch = self.cell_patch(level, weights, rows.start);
                    self.advance_cells(patch, rows, columns, energies);
                }
            }
        }
    }

    /// What the kernels of the simplified theory get to advance rows from row `j` on to `level`.
    fn patch<'a>(&self, level: usize, weights: &'a AxialWeights, j: usize) -> Patch<'a> {
        let layer = self.grid.layer_of(j);
        let [outward, inward] = weights.radial(layer);
        Patch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: self.levels.origin(level),
            stride: self.levels.stride(),
            around: self.around(j),
            outward,
            inward,
            corner: weights.corner(layer),
        }
    }

    /// What the kernels of the scheme of cells get to advance rows of the layer of row `j` to `level`.
    fn cell_patch<'a>(&self, level: usize, weights: &'a CellLayers, j: usize) -> CellPatch<'a> {
        let next = self.levels.origin(level);
        CellPatch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: [next, next.wrapping_add(self.levels.lateral())],
            lateral: self.levels.lateral(),
            stride: self.levels.stride(),
            weights: &weights.layers[self.grid.layer_of(j)],
        }
    }

    /// [`Domain::advance_rows`] with cells.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`]; rows and columns lie inside the arrays.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    unsafe fn advance_cells(
        &self,
        patch: CellPatch<'_>,
        rows: Range<usize>,
        columns: Range<usize>,
        mut energies: Option<&mut [EnergySum]>,
    ) {
        for (number, j) in rows.enumerate() {
            let (columns, none) = (columns.clone(), &mut EnergySum::default());
            let instructions = self.instructions;
            // SAFETY: the caller's promise
            unsafe {
                match (energies.as_mut().map(|energies| &mut energies[number]), j == self.grid.nz) {
                    (Some(energy), false) => {
                        instructions.advance_cells::<INTERIOR, true>(patch, j, columns, energy);
                    }
                    (None, false) => instructions.advance_cells::<INTERIOR, false>(patch, j, columns, none),
                    (Some(energy), true) if self.grid.back == Back::Free => {
                        instructions.advance_cells::<FREE, true>(patch, j, columns, energy);
                    }
                    (Some(energy), true) => {
                        instructions.advance_cells::<BACKING, true>(patch, j, columns, energy);
                    }
                    (None, true) if self.grid.back == Back::Free => {
                        instructions.advance_cells::<FREE, false>(patch, j, columns, none);
                    }
                    (None, true) => instructions.advance_cells::<BACKING, false>(patch, j, columns, none),
                }
            }
        }
    }

    /// Advances row `j`, at a face of its layer, as if its layer were by itself, and writes the result, first column first, to `faces` by
    /// displacement.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`], of levels before alone; there is room for the columns.
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn advance_face(&self, level: usize, j: usize, columns: Range<usize>, faces: &mut Faces) {
        assert!(columns.len() <= PIECE);
        let first = j * self.levels.stride() + columns.start;
        let [u, v] = faces.each_mut().map(|face| face.as_mut_ptr().wrapping_sub(first));
        // SAFETY: the caller's promise; columns of row j stand at the face
        unsafe {
            match &self.scheme {
                Weighted::Axial(weights) => {
                    let patch = Patch { next: u, ..self.patch(level, weights, j) };
                    self.instructions.advance::<false>(patch, j..j + 1, columns, &[], &mut []);
                }
                Weighted::Cells(weights) => {
                    let patch = CellPatch { next: [u, v], ..self.cell_patch(level, weights, j) };
                    let none = &mut EnergySum::default();
                    if j == self.grid.layer(j).first {
                        self.instructions.advance_cells::<SURFACE, false>(patch, j, columns, none);
                    } else {
                        self.instructions.advance_cells::<FREE, false>(patch, j, columns, none);
                    }
                }
            }
        }
    }

    /// Both displacements of the surface at `level` if it were free of stress, for the first columns, whole blocks.
    ///
    /// # Safety
    ///
    /// Rows 0 and 1 hold the two levels before, images among them; no other thread touches row 0 or writes to row 1.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn free_surface(&self, level: usize, weights: &CellLayers, free: &mut [Vec<f64>; 2]) {
        let columns = free[0].len();
        assert!(
            columns <= self.levels.columns() && free[1].len() == columns && columns.is_multiple_of(BLOCK)
        );
        let next = free.each_mut().map(|free| free.as_mut_ptr());
        let patch = CellPatch { next, ..self.cell_patch(level, weights, 0) };
        let none = &mut EnergySum::default();
        // SAFETY: the caller's promise; row 0 is written to `free`, which has as many columns
        unsafe { self.instructions.advance_cells::<SURFACE, false>(patch, 0, 0..columns, none) };
    }

    /// Largest principal strains on the backing at a level, column by column.
    ///
    /// # Safety
    ///
    /// Backing and row before it hold that level in `columns` and a column around them; no other thread writes to them.
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn backing_strains(
        &self,
        weights: &CellLayers,
        level: usize,
        columns: &Range<usize>,
    ) -> Vec<f64> {
        // SAFETY: the caller's promise
        let at = |field: usize, j: usize, i: isize| unsafe {
            self.levels.at(level, j, field * self.levels.lateral(), i)
        };
        let backing = weights.scheme.at_row(self.grid.nz);
        let strain = |i: usize| match i < self.grid.nr() {
            true => backing.strain(at, 0.0, i).largest_on_face(),
            false => 0.0,
        };
        columns.clone().map(strain).collect()
    }

    /// Largest strain of the cells below row `j`, which is not the last of its layer, of `columns` at a level.
    ///
    /// # Safety
    ///
    /// Both rows hold that level in `columns` and the column before; no other thread writes to them.
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn largest_strain(&self, level: usize, j: usize, columns: &Range<usize>) -> f64 {
        let cells = |offset: usize| {
            // SAFETY: the caller's promise
            [j, j + 1].map(|j| unsafe { self.levels.cells(level, j, offset, columns) })
        };
        match &self.scheme {
            Weighted::Axial(_) => {
                let [upper, lower] = cells(0).map(|row| &row[1..]);
                largest_stretch(upper, lower) / self.grid.layer(j).dz
            }
            Weighted::Cells(weights) => {
                let lateral = self.levels.lateral();
                let weights = &weights.layers[self.grid.layer_of(j)];
                let row = CellRow {
                    displacements: [cells(0), cells(lateral)],
                    weights: weights.strains(columns),
                    courant: weights.medium.courant,
                };
                self.instructions.largest_strain(row) / (2.0 * self.grid.layer(j).dz)
            }
        }
    }

    /// The first of `columns` whose cell below row `j` has a strain.
    ///
    /// # Safety
    ///
    /// As [`Domain::largest_strain`].
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn column_of_strain(
        &self,
        level: usize,
        j: usize,
        columns: &Range<usize>,
        strain: f64,
    ) -> Option<usize> {
        // SAFETY: the caller's promise
        let at = |field: usize, j: usize, i: isize| unsafe {
            self.levels.at(level, j, field * self.levels.lateral(), i)
        };
        columns.clone().find(|&i| {
            let found = match &self.scheme {
                Weighted::Axial(_) => {
                    (at(0, j + 1, i as isize) - at(0, j, i as isize)).abs() / self.grid.layer(j).dz
                }
                Weighted::Cells(weights) => weights.scheme.largest_strain(at, j, i),
            };
            found == strain
        })
    }

    /// Writes the images of `rows` and `columns` that have just been advanced to `level`, which the schemes read.
    ///
    /// # Safety
    ///
    /// No other thread touches these columns of the rows and their images meanwhile.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn reflect(&self, level: usize, rows: &Range<usize>, columns: &Range<usize>) {
        if columns.is_empty() {
            return;
        }
        match &self.scheme {
            Weighted::Axial(weights) if weights.corner(0).is_none() => return,
            Weighted::Axial(_) => {}
            Weighted::Cells(_) => {
                let lateral = self.levels.lateral();
                for j in rows.clone().filter(|_| columns.start == 0) {
                    // SAFETY: the caller's promise
                    unsafe {
                        self.levels.reflect_axis(level, j, 0, 1.0);
                        self.levels.reflect_axis(level, j, lateral, -1.0);
                    }
                }
                return;
            }
        }
        // SAFETY, of all below: the caller's promise
        unsafe {
            if columns.start == 0 {
                rows.clone().for_each(|j| self.levels.reflect_axis(level, j, 0, 1.0));
            }
            if rows.contains(&1) && self.grid.nz > 1 {
                self.levels.reflect_row(level, 1, -1, 1.0, columns);
            }
            let last = self.last_row();
            if rows.contains(&last) && self.grid.back == Back::Rigid {
                self.levels.reflect_row(level, last, self.grid.nz as isize + 1, -1.0, columns);
            }
        }
    }
}
