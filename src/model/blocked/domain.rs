//! What the engine works on: levels of a field, and the weights of the scheme.

use std::ops::Range;

use super::{
    axial::{Axial, Plate},
    dispatch::Instructions,
    energy::EnergySum,
    full::Full,
    interface::Interfaces,
    levels::Levels,
    runs::Runs,
    strengths::Ratios,
    theory::Theory,
};
use crate::{
    grid::{Back, Grid},
    model::{cell_scheme::CellScheme, scheme::Corner},
};

/// What the engine works on.
///
/// Bands, tiles and the light cone are cut by depth, in axial steps, so that both rows of an interface belong to one of them; fields have
/// rows by number.
pub struct Domain<S> {
    /// The field.
    pub levels: Levels,
    /// The mesh. Columns that fill the last block have no weight and stay at rest.
    pub grid: Grid,
    /// What happens at interfaces.
    pub interfaces: Interfaces,
    /// How stresses compare with strengths.
    pub ratios: Ratios,
    /// Rows that are advanced at once.
    pub runs: Runs,
    /// The theory: its scheme with the weights.
    pub theory: S,
    /// Instructions to use.
    pub instructions: Instructions,
}

impl Domain<Axial> {
    /// A mesh of the simplified theory at rest.
    ///
    /// * `plates`: layers from the surface down
    /// * `corner`: the mixed-derivative correction, if there is one
    pub fn axial(
        grid: &Grid,
        plates: &[Plate<'_>],
        corner: Option<Corner>,
        instructions: Instructions,
    ) -> Self {
        let levels = Levels::new(Corner::levels(corner.as_ref()), Axial::FIELDS, grid.nz + 2, grid.nr());
        let theory = Axial::new(grid, plates, corner, levels.columns());
        Self::new(grid, levels, theory, instructions)
    }
}

impl Domain<Full> {
    /// A mesh of the full theory at rest.
    pub fn full(scheme: CellScheme, instructions: Instructions) -> Self {
        let grid = scheme.grid().clone();
        let levels = Levels::new(3, Full::FIELDS, grid.nz + 2, grid.nr());
        let theory = Full::new(scheme, levels.columns());
        Self::new(&grid, levels, theory, instructions)
    }
}

impl<S: Theory> Domain<S> {
    fn new(grid: &Grid, levels: Levels, theory: S, instructions: Instructions) -> Self {
        let is_plain = grid.layers.len() == 1 && grid.back == Back::Rigid;
        assert!(is_plain || grid.layers.iter().all(|layer| layer.steps >= 2), "a layer of one row of cells");
        let interfaces = Interfaces::new(grid.layers.len() - 1);
        let runs = Runs::new(grid, levels.stride());
        let ratios = Ratios::new(theory.strengths());
        Self { grid: grid.clone(), theory, instructions, levels, interfaces, ratios, runs }
    }

    /// True if what happens first at a level is told.
    pub fn notes_events(&self) -> bool {
        self.interfaces.are_watched() || self.ratios.are_watched()
    }

    /// Columns by which a tile is shifted from level to level: whole vectors, and no less than the reach.
    pub fn shift(&self) -> usize {
        self.instructions.width().max(self.theory.lateral_reach())
    }

    /// The last row that moves.
    pub fn last_row(&self) -> usize {
        S::last_row(&self.grid)
    }

    /// True if there is strain on the back.
    pub fn strains_back(&self) -> bool {
        S::strains_back(self.grid.back)
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
    /// The nodes hold the two levels before, as do the rows of [`Theory::reach`] axial steps and a vector around them, images among them; no
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
                    None => S::advance_run(self, level, run, rows_of_run, columns.clone()),
                    Some(energies) => {
                        let own = &mut energies[number..number + rows_of_run.len()];
                        S::advance_and_count(self, level, run, rows_of_run, columns.clone(), own);
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

    /// The first of `columns` whose cell below row `j` has a strain.
    ///
    /// # Safety
    ///
    /// As [`Theory::largest_strain`].
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
        columns.clone().find(|&i| self.theory.cell_strain(&self.grid, at, j, i) == strain)
    }

    /// Writes the images of `rows` and `columns` that have just been advanced to `level`, which the schemes read.
    ///
    /// # Safety
    ///
    /// No other thread touches these columns of the rows and their images meanwhile.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn reflect(&self, level: usize, rows: &Range<usize>, columns: &Range<usize>) {
        if !columns.is_empty() {
            // SAFETY: the caller's promise
            unsafe { S::reflect(self, level, rows, columns) }
        }
    }
}
