//! What the engine works on: levels of a field, and the weights of the scheme by column.

use std::ops::Range;

use super::{
    cells::{BACKING, CellPatch, CellRow, CellWeights, INTERIOR, SURFACE, largest_stretch},
    damping,
    dispatch::Instructions,
    energy::EnergySum,
    levels::{CornerTerm, Levels, Patch},
    vector::{BLOCK, padded},
};
use crate::{
    grid::Grid,
    model::{
        Lattice,
        cell_scheme::CellScheme,
        scheme::{Corner, RadialWeights},
    },
};

/// What the engine works on.
pub struct Domain {
    /// The field.
    pub levels: Levels,
    /// The nodes of the mesh.
    pub lattice: Lattice,
    /// Time of a step \[R/c_p\].
    pub dt: f64,
    /// Number of columns of the mesh; those that fill the last block have no weight and stay at rest.
    pub nr: usize,
    /// Row of the backing.
    pub backing: usize,
    /// The scheme with its weights.
    scheme: Weighted,
    /// Instructions to use.
    instructions: Instructions,
}

/// A scheme with its weights by column.
pub enum Weighted {
    /// One displacement.
    Axial(AxialWeights),
    /// Two displacements.
    Cells(Box<CellWeights>),
}

/// Weights of the scheme with one displacement.
pub struct AxialWeights {
    /// Cell areas by column, for whole blocks.
    pub area: Vec<f64>,
    /// Radial weights of the scheme.
    weights: Weights,
    /// The mixed-derivative correction with its radial weights, if there is one.
    corner: Option<(Corner, Weights)>,
}

impl AxialWeights {
    /// * `weights`: radial weights of the scheme, by column
    /// * `corner`: the mixed-derivative correction with its radial weights, if there is one
    /// * `columns`: of the field, whole blocks
    fn new(
        grid: &Grid,
        weights: &[RadialWeights],
        corner: Option<(Corner, &[RadialWeights])>,
        columns: usize,
    ) -> Self {
        Self {
            area: padded(grid.area.iter().copied(), columns),
            weights: Weights::new(weights, columns),
            corner: corner.map(|(corner, weights)| (corner, Weights::new(weights, columns))),
        }
    }

    /// Radial weights by column, outward and inward, for whole blocks.
    pub fn radial(&self) -> [&[f64]; 2] {
        [&self.weights.outward, &self.weights.inward]
    }

    /// The mixed-derivative correction, if there is one.
    pub fn corner(&self) -> Option<CornerTerm<'_>> {
        let (corner, Weights { outward, inward }) = self.corner.as_ref()?;
        Some(CornerTerm { share: corner.share, outward, inward })
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
}

impl Domain {
    /// A mesh at rest.
    ///
    /// * `weights`: radial weights of the scheme, by column
    /// * `corner`: the mixed-derivative correction with its radial weights, if there is one
    pub fn new(
        grid: &Grid,
        weights: &[RadialWeights],
        corner: Option<(Corner, &[RadialWeights])>,
        instructions: Instructions,
    ) -> Self {
        let count = Corner::levels(corner.as_ref().map(|(corner, _)| corner));
        let levels = Levels::new(count, 1, grid.nz + 2, grid.nr());
        let weights = AxialWeights::new(grid, weights, corner, levels.columns());
        Self::of(grid, levels, Weighted::Axial(weights), instructions)
    }

    /// A mesh with cells between nodes at rest.
    pub fn with_cells(scheme: CellScheme, instructions: Instructions) -> Self {
        let grid = scheme.grid().clone();
        let levels = Levels::new(3, 2, grid.nz + 2, grid.nr());
        let weights = CellWeights::new(scheme, levels.columns());
        Self::of(&grid, levels, Weighted::Cells(Box::new(weights)), instructions)
    }

    fn of(grid: &Grid, levels: Levels, scheme: Weighted, instructions: Instructions) -> Self {
        Self {
            lattice: Lattice::of(grid),
            dt: grid.dt(),
            nr: grid.nr(),
            backing: grid.nz,
            scheme,
            instructions,
            levels,
        }
    }

    /// The scheme with its weights.
    pub fn scheme(&self) -> &Weighted {
        &self.scheme
    }

    /// Rows around a node that its next level depends on.
    pub fn reach(&self) -> usize {
        match &self.scheme {
            Weighted::Axial(weights) if weights.corner.is_some() => 2,
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

    /// The last row that moves: that before the backing, or the backing, which yields along r.
    pub fn last_row(&self) -> usize {
        match &self.scheme {
            Weighted::Axial(_) => self.backing - 1,
            Weighted::Cells(_) => self.backing,
        }
    }

    /// Advances `rows` of `columns`, whole vectors, to `level`.
    ///
    /// * `energies`: of `rows`, to add theirs to, if it is to be counted
    ///
    /// # Safety
    ///
    /// The nodes hold the two levels before, as do [`Domain::reach`] rows and a vector around them, images among them; no other
    /// thread touches the nodes or writes to those around them.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn advance(
        &self,
        level: usize,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: Option<&mut [EnergySum]>,
    ) {
        assert!(rows.start > 0 && rows.end <= self.last_row() + 1 && columns.end <= self.levels.columns());
        let weights = match &self.scheme {
            Weighted::Axial(weights) => weights,
            // SAFETY: the caller's promise; rows and columns lie inside the arrays with a row and a block around them
            Weighted::Cells(weights) => unsafe {
                let patch = self.cell_patch(level, weights);
                return self.advance_cells(patch, rows, columns, energies);
            },
        };
        let [outward, inward] = weights.radial();
        let patch = Patch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: self.levels.origin(level),
            stride: self.levels.stride(),
            outward,
            inward,
            corner: weights.corner(),
        };
        // SAFETY: rows and columns lie inside the arrays with a row and a block around them, and with the mixed-derivative correction, which
        // reads two rows, with the images beyond row 0 and the backing, as has just been checked; the caller promises the rest
        unsafe {
            match energies {
                Some(energies) => {
                    self.instructions.advance::<true>(patch, rows, columns, &weights.area, energies);
                }
                None => self.instructions.advance::<false>(patch, rows, columns, &[], &mut []),
            }
        }
    }

    /// What the kernels of the scheme of cells get to advance to `level`.
    fn cell_patch<'a>(&self, level: usize, weights: &'a CellWeights) -> CellPatch<'a> {
        let next = self.levels.origin(level);
        CellPatch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: [next, next.wrapping_add(self.levels.lateral())],
            lateral: self.levels.lateral(),
            stride: self.levels.stride(),
            weights,
        }
    }

    /// [`Domain::advance`] with cells.
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
            let energy = energies.as_mut().map(|energies| &mut energies[number]);
            let columns = columns.clone();
            // SAFETY: the caller's promise
            unsafe {
                match (energy, j == self.backing) {
                    (Some(energy), false) => {
                        self.instructions.advance_cells::<INTERIOR, true>(patch, j, columns, energy);
                    }
                    (Some(energy), true) => {
                        self.instructions.advance_cells::<BACKING, true>(patch, j, columns, energy);
                    }
                    (None, false) => {
                        let none = &mut EnergySum::default();
                        self.instructions.advance_cells::<INTERIOR, false>(patch, j, columns, none);
                    }
                    (None, true) => {
                        let none = &mut EnergySum::default();
                        self.instructions.advance_cells::<BACKING, false>(patch, j, columns, none);
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
    pub unsafe fn free_surface(&self, level: usize, weights: &CellWeights, free: &mut [Vec<f64>; 2]) {
        let columns = free[0].len();
        assert!(
            columns <= self.levels.columns() && free[1].len() == columns && columns.is_multiple_of(BLOCK)
        );
        let next = free.each_mut().map(|free| free.as_mut_ptr());
        let patch = CellPatch { next, ..self.cell_patch(level, weights) };
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
        weights: &CellWeights,
        level: usize,
        columns: &Range<usize>,
    ) -> Vec<f64> {
        // SAFETY: the caller's promise
        let at = |field: usize, j: usize, i: isize| unsafe {
            self.levels.at(level, j, field * self.levels.lateral(), i)
        };
        let backing = weights.scheme.at_row(self.backing);
        let strain = |i: usize| match i < self.nr {
            true => backing.strain(at, 0.0, i).largest_on_face(),
            false => 0.0,
        };
        columns.clone().map(strain).collect()
    }

    /// Largest strain of the cells below row `j` of `columns` at a level.
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
                largest_stretch(upper, lower) / self.lattice.dz
            }
            Weighted::Cells(weights) => {
                let (lateral, courant) = (self.levels.lateral(), weights.scheme.medium().courant);
                let row = CellRow {
                    displacements: [cells(0), cells(lateral)],
                    weights: weights.strains(columns),
                    courant,
                };
                self.instructions.largest_strain(row) / (2.0 * self.lattice.dz)
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
                    (at(0, j + 1, i as isize) - at(0, j, i as isize)).abs() / self.lattice.dz
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
            Weighted::Axial(weights) if weights.corner.is_none() => return,
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
            if rows.contains(&1) && self.backing > 1 {
                self.levels.reflect_row(level, 1, -1, 1.0, columns);
            }
            if rows.contains(&self.last_row()) {
                self.levels.reflect_row(level, self.last_row(), self.backing as isize + 1, -1.0, columns);
            }
        }
    }
}
