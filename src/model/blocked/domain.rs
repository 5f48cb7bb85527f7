//! What the engine works on: levels of a field, and a theory: its scheme with the weights of layers and columns, row by row, and what is shown of it.
//!
//! [`super::axial`] has one displacement, [`super::full`] two.

use std::{borrow::Cow, ops::Range};

use super::{
    dispatch::Instructions,
    energy::EnergySum,
    interface::Interfaces,
    levels::Levels,
    runs::{Run, Runs},
    strengths::Ratios,
};
use crate::{
    grid::{Back, Grid},
    model::{Field, strain::Watched, strength::Strength},
};

/// What the contact has settled for row 0.
#[derive(Clone, Copy)]
pub struct SurfaceMotion<'a> {
    /// Displacement at the level to come, out to the last column that has moved.
    pub displacement: &'a [f64],
    /// What that would be without the contact.
    pub free: &'a [f64],
    /// Displacement u_r at the level to come, with cells.
    pub lateral: &'a [f64],
    /// Pressure on the way to it.
    pub pressure: &'a [f64],
}

/// A row of nodes that a frame shows.
pub struct ShownRow<'a> {
    /// Number of the row.
    pub j: usize,
    /// Columns, of which every so many are shown, from the first on.
    pub columns: Range<usize>,
    /// See `columns`.
    pub every: usize,
    /// u^{k−1} of the nodes that are shown, if it is gone and asked for.
    pub before: &'a [f64],
    /// Pressure on the surface, by column, if this is its row.
    pub pressure: Option<&'a [f64]>,
}

/// A theory under the fast engine.
///
/// # Safety
///
/// Of all functions: the field holds what they read, and no other thread writes to it or touches what they write. They read a row, columns or a node at level k, as many
/// rows and columns around as [`Theory::reach`] and [`Theory::lateral_reach`] say, and level k−1 of what they advance.
#[expect(unsafe_code, reason = "several threads update the field in place")]
pub trait Theory: Send + Sync + Sized + 'static {
    /// Number of displacements.
    const FIELDS: usize;
    /// True if level k−1 still stands when k+1 has been written.
    const KEEPS_EARLIER: bool;
    /// Room that the free surface takes from step to step.
    type Room: Default + Send;

    /// Impedance of a layer \[γc_p of the struck one\].
    fn impedance(&self, layer: usize) -> f64;

    /// Axial steps around a node that its next level depends on.
    fn reach(&self) -> usize;

    /// Columns around a node that its next level depends on.
    fn lateral_reach(&self) -> usize;

    /// The last row that moves.
    fn last_row(grid: &Grid) -> usize;

    /// True if there is strain on such a back.
    fn strains_back(back: Back) -> bool;

    /// Advances rows of a run; faces at interfaces as if their layer were by itself.
    ///
    /// * `energies`: of the rows, to add theirs to, if `COUNTS` says so; else none
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`].
    unsafe fn advance_run<const COUNTS: bool>(
        domain: &Domain<Self>,
        level: usize,
        run: &Run,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: &mut [EnergySum],
    );

    /// What the layers bear, from the surface down, if stresses are compared with it.
    fn strengths(&self) -> &[Strength] {
        &[]
    }

    /// Records how stresses at a level compare with strengths, see [`super::strengths::Ratios::take`].
    ///
    /// # Safety
    ///
    /// The nodes, and a row and a column around them, hold that level.
    unsafe fn take_ratios(
        _domain: &Domain<Self>,
        _level: usize,
        _part: (&Range<usize>, &Range<usize>),
        _watched: Watched,
        _pressure: Option<&[f64]>,
    ) {
    }

    /// Writes the images of `rows` and `columns`, some of them, that have just been advanced to `level`.
    ///
    /// # Safety
    ///
    /// No other thread touches these columns of the rows and their images meanwhile.
    unsafe fn reflect(domain: &Domain<Self>, level: usize, rows: &Range<usize>, columns: &Range<usize>);

    /// Displacement u_z of the surface at `level`, if it were free of stress, in the first columns.
    ///
    /// # Safety
    ///
    /// The surface and [`Theory::reach`] rows below it hold the two levels before.
    unsafe fn free_surface(domain: &Domain<Self>, level: usize, room: &mut Self::Room, free: &mut [f64]);

    /// Displacement u_r of the free surface in so many columns, if there is one.
    fn lateral(room: &mut Self::Room, columns: usize) -> &[f64];

    /// Energy of the surface on the way to `level`: that of forces on a free surface, without damping.
    ///
    /// # Safety
    ///
    /// The surface and what is around it hold the two levels before.
    unsafe fn surface_energy(
        domain: &Domain<Self>,
        level: usize,
        columns: &Range<usize>,
        motion: SurfaceMotion<'_>,
    ) -> EnergySum;

    /// Area of a node at an interface and the force on it by its own layer.
    ///
    /// * `node`: number of the displacement, row, column
    /// * `ends`: u^{k−1}, and u^{k+1} if its layer were by itself
    ///
    /// # Safety
    ///
    /// The node and what is around it hold the level before, with the mixed-derivative correction that before it too.
    unsafe fn face_force(domain: &Domain<Self>, level: usize, node: [usize; 3], ends: [f64; 2])
    -> (f64, f64);

    /// Shows a field in a row that has been advanced to `level`, as it was at the level before.
    ///
    /// # Safety
    ///
    /// The row holds both levels, and what is around it the one before.
    unsafe fn show(domain: &Domain<Self>, level: usize, field: Field, row: &ShownRow<'_>, values: &mut [f32]);

    /// Stress −σ_zz of a node, row and column, at `level`.
    ///
    /// * `pressure`: on it, if it is on the surface
    ///
    /// # Safety
    ///
    /// The node and what is around it hold the level.
    unsafe fn stress(domain: &Domain<Self>, level: usize, node: [usize; 2], pressure: Option<f64>) -> f64;

    /// Largest strain on the surface at column `i`, by magnitude.
    ///
    /// * `at`: displacements by number, row and column
    /// * `pressure`: there
    fn surface_strain(&self, at: impl Fn(usize, usize, isize) -> f64, pressure: f64, i: usize) -> f64;

    /// Largest strain of the cells below row `j`, which is not the last of its layer, of `columns` at a level.
    ///
    /// # Safety
    ///
    /// Both rows hold that level in `columns` and the column before.
    unsafe fn largest_strain(domain: &Domain<Self>, level: usize, j: usize, columns: &Range<usize>) -> f64;

    /// Strain of the cell below row `j` at column `i`, as above.
    ///
    /// * `at`: displacements by number, row and column
    fn cell_strain(&self, grid: &Grid, at: impl Fn(usize, usize, isize) -> f64, j: usize, i: usize) -> f64;

    /// What tells the strain on the back, by column, and the level of it: `level`, or the one before where it needs neighbours.
    ///
    /// # Safety
    ///
    /// The last row that moves holds these levels in `columns`, and what is around it the one before.
    unsafe fn back<'a>(
        domain: &'a Domain<Self>,
        level: usize,
        columns: &Range<usize>,
    ) -> (usize, Cow<'a, [f64]>);

    /// Strain on the back by what tells it.
    fn back_strain(grid: &Grid, value: f64) -> f64;
}

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

impl<S: Theory> Domain<S> {
    /// A mesh at rest.
    pub fn new(grid: &Grid, levels: Levels, theory: S, instructions: Instructions) -> Self {
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
                    None => S::advance_run::<false>(self, level, run, rows_of_run, columns.clone(), &mut []),
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

    /// Advances rows of a run and adds their energies, but not those of faces at interfaces.
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
        if run.around(rows.start).is_none() {
            // none of them is at an interface
            return unsafe { S::advance_run::<true>(self, level, run, rows, columns, energies) };
        }
        for (j, energy) in rows.zip(energies) {
            let (row, columns, energy) = (j..j + 1, columns.clone(), std::slice::from_mut(energy));
            match self.grid.interface_of(j) {
                Some(_) => unsafe { S::advance_run::<false>(self, level, run, row, columns, &mut []) },
                None => unsafe { S::advance_run::<true>(self, level, run, row, columns, energy) },
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
