//! What the engine asks of a theory: its scheme with the weights of layers and columns, row by row, and what is shown of it.
//!
//! [`super::axial`] has one displacement, [`super::full`] two.

use std::ops::Range;

use super::{domain::Domain, energy::EnergySum, runs::Run, sampler::SurfaceMotion, workers::Workers};
use crate::{
    grid::{Back, Grid},
    model::{Field, strain::Watched, strength::Strength},
};

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

impl ShownRow<'_> {
    /// Writes what is shown.
    ///
    /// * `number`: of the node in the i-th of the columns
    pub fn fill(&self, values: &mut [f32], number: impl Fn(usize) -> f64) {
        if self.every == 1 {
            values.iter_mut().enumerate().for_each(|(i, value)| *value = number(i) as f32);
        } else {
            values.iter_mut().enumerate().for_each(|(i, value)| *value = number(i * self.every) as f32);
        }
    }
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
    /// # Safety
    ///
    /// As [`Domain::advance`].
    unsafe fn advance_run(
        domain: &Domain<Self>,
        level: usize,
        run: &Run,
        rows: Range<usize>,
        columns: Range<usize>,
    );

    /// The same with energies, but not those of faces at interfaces.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`].
    unsafe fn advance_and_count(
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
    fn free_surface(field: &Workers<Self>, level: usize, room: &mut Self::Room, free: &mut [f64]);

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
    unsafe fn back(domain: &Domain<Self>, level: usize, columns: &Range<usize>) -> (usize, Vec<f64>);

    /// Strain on the back by what tells it.
    fn back_strain(grid: &Grid, value: f64) -> f64;
}
