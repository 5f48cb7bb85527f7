//! What the engine works on: levels of a field, and the weights of the scheme.

use std::ops::Range;

use super::{
    cells::{BACKING, CellMarch, CellPatch, CellRow, FREE, INTERIOR, MEMBRANE, SURFACE, largest_stretch},
    damping,
    dispatch::Instructions,
    energy::EnergySum,
    interface::Interfaces,
    kernel::Advance,
    lane::BLOCK,
    levels::{Levels, Patch},
    runs::{Run, Runs},
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
    /// Rows that are advanced at once.
    pub runs: Runs,
    /// The scheme with its weights.
    scheme: Weighted,
    /// Instructions to use.
    pub instructions: Instructions,
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
        let runs = Runs::new(grid, levels.stride());
        Self { grid: grid.clone(), scheme, instructions, levels, interfaces, runs }
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
        let mut kept = None;
        for (run, rows_of_run) in self.runs.among(&rows) {
            let number = rows_of_run.start - rows.start;
            let energies = energies.as_deref_mut();
            // SAFETY, of all below: the caller's promise; rows and columns lie inside the arrays with a row and a block around them, and with
            // the mixed-derivative correction, which reads two rows, with the images beyond row 0 and the backing
            unsafe {
                let is_upper = run.upper_face_of.filter(|_| rows_of_run.end == run.rows.end);
                if let (Some(interface), true) = (is_upper, energies.is_some()) {
                    kept = Some(self.keep(level, interface, columns.clone()));
                }
                let joins = run.lower_face_of.filter(|_| rows_of_run.start == run.rows.start);
                match energies {
                    None => self.advance_run(level, run, rows_of_run, columns.clone()),
                    Some(energies) => {
                        let own = &mut energies[number..number + rows_of_run.len()];
                        self.advance_and_count(level, run, rows_of_run, columns.clone(), own);
                        if let (Some(interface), Some(kept)) = (joins, &kept) {
                            let both = &mut energies[number - 1..=number];
                            self.count_faces(level, interface, columns.clone(), kept, both);
                        }
                    }
                }
                if let Some(interface) = joins {
                    self.join(level, interface, columns.clone());
                }
            }
        }
    }

    /// Advances rows of a run; faces at interfaces as if their layer were by itself.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`].
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    unsafe fn advance_run(&self, level: usize, run: &Run, rows: Range<usize>, columns: Range<usize>) {
        // SAFETY: the caller's promise
        unsafe {
            match &self.scheme {
                Weighted::Axial(weights) => {
                    let patch = self.patch(level, weights, run, rows.start);
                    self.instructions.run(Advance::<false>::new(patch, rows, columns, &[], &mut []));
                }
                Weighted::Cells(weights) => {
                    let patch = self.cell_patch(level, weights, run.layer);
                    let none = &mut EnergySum::default();
                    for j in rows {
                        self.advance_cells::<false>(patch, run.layer, j, columns.clone(), none);
                    }
                }
            }
        }
    }

    /// [`Domain::advance_run`] that adds energies, but not those of faces at interfaces.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`].
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    unsafe fn advance_and_count(
        &self,
        level: usize,
        run: &Run,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: &mut [EnergySum],
    ) {
        // SAFETY, of all below: the caller's promise
        if let (Weighted::Axial(weights), None) = (&self.scheme, run.around(rows.start)) {
            let patch = self.patch(level, weights, run, rows.start);
            let work = unsafe { Advance::<true>::new(patch, rows, columns, &weights.area, energies) };
            self.instructions.run(work);
            return;
        }
        for (j, energy) in rows.zip(energies) {
            let columns = columns.clone();
            match &self.scheme {
                _ if self.grid.interface_of(j).is_some() => unsafe {
                    self.advance_run(level, run, j..j + 1, columns);
                },
                Weighted::Axial(weights) => unsafe {
                    let (patch, energy) = (self.patch(level, weights, run, j), std::slice::from_mut(energy));
                    self.instructions.run(Advance::<true>::new(
                        patch,
                        j..j + 1,
                        columns,
                        &weights.area,
                        energy,
                    ));
                },
                Weighted::Cells(weights) => unsafe {
                    let patch = self.cell_patch(level, weights, run.layer);
                    self.advance_cells::<true>(patch, run.layer, j, columns, energy);
                },
            }
        }
    }

    /// What the kernels of the simplified theory get to advance rows of a run from row `j` on to `level`.
    fn patch<'a>(&self, level: usize, weights: &'a AxialWeights, run: &Run, j: usize) -> Patch<'a> {
        Patch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: self.levels.origin(level),
            stride: self.levels.stride(),
            around: run.around(j),
            radial: weights.radial(run.layer),
            corner: weights.corner(run.layer),
        }
    }

    /// What the kernels of the scheme of cells get to advance rows of a layer to `level`.
    fn cell_patch<'a>(&self, level: usize, weights: &'a CellLayers, layer: usize) -> CellPatch<'a> {
        let next = self.levels.origin(level);
        CellPatch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: [next, next.wrapping_add(self.levels.lateral())],
            lateral: self.levels.lateral(),
            stride: self.levels.stride(),
            weights: &weights.layers[layer],
        }
    }

    /// Advances row `j` of a layer of the scheme of cells.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`]; row and columns lie inside the arrays.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    unsafe fn advance_cells<const COUNTS: bool>(
        &self,
        patch: CellPatch<'_>,
        layer: usize,
        j: usize,
        columns: Range<usize>,
        energy: &mut EnergySum,
    ) {
        let (layer, instructions) = (&self.grid.layers[layer], self.instructions);
        // SAFETY: the caller's promise
        unsafe {
            if j == layer.first {
                instructions.run(CellMarch::<SURFACE, COUNTS>::new(patch, j, columns, energy));
            } else if j != layer.last() {
                instructions.run(CellMarch::<INTERIOR, COUNTS>::new(patch, j, columns, energy));
            } else if j == self.grid.nz && self.grid.back == Back::Rigid {
                instructions.run(CellMarch::<BACKING, COUNTS>::new(patch, j, columns, energy));
            } else if self.grid.is_above_free_back(j) {
                instructions.run(CellMarch::<MEMBRANE, COUNTS>::new(patch, j, columns, energy));
            } else {
                instructions.run(CellMarch::<FREE, COUNTS>::new(patch, j, columns, energy));
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
        let work = unsafe { CellMarch::<SURFACE, false>::new(patch, 0, 0..columns, none) };
        self.instructions.run(work);
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
            true => backing.back_strain(at, i).largest_on_face(),
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
                self.instructions.run(row) / (2.0 * self.grid.layer(j).dz)
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
