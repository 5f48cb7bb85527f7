//! Rows of nodes of the scheme of cells, a vector at a time.
//!
//! The operators are those of [`crate::model::cells`]. A row is marched outwards:
//! columns of a vector are made of the rows above and below, cells of two vectors of columns, nodes of two vectors of cells; each is
//! made once and carried to the next vector.

use std::ops::Range;

use super::{
    damping::Moves,
    dispatch::Work,
    energy::EnergySum,
    lane::{BLOCK, Lane, padded},
};
use crate::model::{
    cell_scheme::CellScheme,
    cells::{self, Cell, Column, ColumnWeights, Constants, Medium, Parts, Row},
    scheme::RadialWeights,
};

/// Cells before the first one that have a weight, 0: those that a vector before the first one asks for.
const BEFORE: usize = BLOCK - 1;

/// Weights of a layer by column, for whole blocks.
pub struct CellWeights {
    /// Constants of the material.
    pub medium: Medium,
    /// q' of cells, from cell −[`BEFORE`] on, and q, with a block more.
    inner: Vec<f64>,
    outer: Vec<f64>,
    /// See [`ColumnWeights::hoop`].
    hoop: [Vec<f64>; 2],
    /// Shares of nodes, see [`ColumnWeights`].
    axial: [Vec<f64>; 2],
    slip: [Vec<f64>; 2],
    radial: Vec<f64>,
    /// Lateral damping of u and v, outward and inward, with a block more; 0 without it.
    damping: [[Vec<f64>; 2]; 2],
    /// True if there is any.
    is_damped: bool,
    /// Masses of u and v per depth.
    pub areas: [Vec<f64>; 2],
}

impl CellWeights {
    /// * `layer`: its number
    /// * `columns`: of the field, whole blocks
    pub fn new(scheme: &CellScheme, layer: usize, columns: usize) -> Self {
        let (grid, damping) = (scheme.grid(), scheme.damping());
        let (medium, weights) = scheme.layer_weights(layer);
        let column =
            |weight: fn(&ColumnWeights) -> f64, length: usize| padded(weights.iter().map(weight), length);
        let damped = |field: usize| {
            let weights = damping.map_or(&[][..], |weights| &weights[field]);
            let sides: [fn(&RadialWeights) -> f64; 2] = [|weights| weights.outward, |weights| weights.inward];
            sides.map(|side| padded(weights.iter().map(side), columns + BLOCK))
        };
        let lateral_areas = (0..grid.nr()).filter_map(|i| cells::lateral_area(grid, i));
        let inner = [0.0; BEFORE].into_iter().chain(weights.iter().map(|weights| weights.inner));
        Self {
            inner: padded(inner, BEFORE + columns + BLOCK + 1),
            outer: column(|weights| weights.outer, columns + BLOCK),
            hoop: [column(|weights| weights.hoop[0], columns), column(|weights| weights.hoop[1], columns)],
            axial: [column(|weights| weights.axial[0], columns), column(|weights| weights.axial[1], columns)],
            slip: [column(|weights| weights.slip[0], columns), column(|weights| weights.slip[1], columns)],
            radial: column(|weights| weights.radial, columns),
            damping: [damped(0), damped(1)],
            is_damped: damping.is_some(),
            areas: [padded(grid.area.iter().copied(), columns), padded(lateral_areas, columns)],
            medium: *medium,
        }
    }

    /// Weights of the strains of cells at the inner sides of columns: q' and q, [`ColumnWeights::hoop`].
    pub fn strains(&self, columns: &Range<usize>) -> [[&[f64]; 2]; 2] {
        let [lateral, hoop] = [[&self.inner[BEFORE..], &self.outer], [&self.hoop[0], &self.hoop[1]]];
        [lateral, hoop].map(|pair| pair.map(|weights| &weights[columns.clone()]))
    }

    /// Panics if there are fewer columns.
    fn check(&self, columns: &Range<usize>) {
        let nodes = [&self.axial, &self.slip, &self.areas];
        let nodes = nodes.into_iter().flatten().chain([&self.radial]);
        assert!(nodes.into_iter().all(|weights| columns.end <= weights.len()));
        let cells = self.damping.iter().flatten().chain([&self.outer]);
        assert!(cells.into_iter().all(|weights| columns.end + BLOCK <= weights.len()));
        assert!(BEFORE + columns.end + BLOCK < self.inner.len());
    }
}

/// Part of a field of both displacements that is advanced.
#[derive(Clone, Copy)]
pub struct CellPatch<'a> {
    /// u of node (0, 0) at level k−1.
    pub before: *const f64,
    /// The same at level k.
    pub now: *const f64,
    /// u and v of node (0, 0) at level k+1, which are written.
    pub next: [*mut f64; 2],
    /// Distance from u of a node to v of it, in numbers.
    pub lateral: usize,
    /// Distance from a node to the one below it, in numbers.
    pub stride: usize,
    /// Weights of the layer.
    pub weights: &'a CellWeights,
}

/// Kinds of rows, for constant parameters.
pub const SURFACE: usize = 0;
/// See [`SURFACE`].
pub const INTERIOR: usize = 1;
/// See [`SURFACE`].
pub const BACKING: usize = 2;
/// A lower face that is free, see [`SURFACE`].
pub const FREE: usize = 3;
/// See [`SURFACE`].
pub const MEMBRANE: usize = 4;

/// [`Row`] of a kind.
const fn kind(row: usize) -> Row {
    match row {
        SURFACE => Row::Surface,
        INTERIOR => Row::Interior,
        MEMBRANE => Row::Membrane,
        _ => Row::Backing,
    }
}

/// The lanes at `i` of weights.
///
/// # Safety
///
/// The machine has the instructions of `L`; there are lanes at `i`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn at<L: Lane>(weights: &[f64], i: usize) -> L {
    // SAFETY: the caller's promise
    unsafe { L::load(weights.as_ptr().add(i)) }
}

/// Lanes above, here and below of what `row` has.
///
/// # Safety
///
/// The machine has the instructions of `L`; the lanes are numbers in this row, and in the rows above and below that `row` has.
#[inline(always)]
#[expect(unsafe_code, reason = "a field that threads share")]
unsafe fn rows<L: Lane>(row: Row, at: *const f64, stride: usize) -> [L; 3] {
    // SAFETY: the caller's promise
    unsafe {
        let here = L::load(at);
        let above = if matches!(row, Row::Surface) { here } else { L::load(at.sub(stride)) };
        let has_below = !matches!(row, Row::Backing | Row::Membrane);
        let below = if has_below { L::load(at.add(stride)) } else { here };
        [above, here, below]
    }
}

/// A row of nodes, and what is around it in memory.
#[derive(Clone, Copy)]
struct Nodes<L> {
    row: Row,
    lateral: usize,
    stride: usize,
    constants: Constants<L>,
}

#[expect(unsafe_code, reason = "a field that threads share")]
impl<L: Lane> Nodes<L> {
    /// The columns in the lanes at `u`, that of u in this row.
    ///
    /// # Safety
    ///
    /// As [`rows`] for both displacements.
    #[inline(always)]
    unsafe fn parts(&self, u: *const f64) -> Parts<L> {
        let Self { row, lateral, stride, constants } = *self;
        // SAFETY: the caller's promise
        let [u, v] = unsafe { [rows(row, u, stride), rows(row, u.add(lateral), stride)] };
        Column::new(row, u, v, &constants).parts(&constants)
    }
}

/// Cells at the inner sides of lanes of columns.
///
/// * `outer`: what these columns contribute as outer ones
/// * `before`, `here`: what the lanes of columns before and they contribute as inner ones
#[inline(always)]
fn cells_of<L: Lane>(outer: &Cell<L>, before: &Cell<L>, here: &Cell<L>) -> Cell<L> {
    let inner = Cell {
        to_inner: L::seam(before.to_inner, here.to_inner).1,
        to_outer: L::seam(before.to_outer, here.to_outer).1,
        slip: L::seam(before.slip, here.slip).1,
        radial: L::seam(before.radial, here.radial).1,
    };
    Cell::of(outer, &inner)
}

/// Cells at the outer sides of columns, from those at the inner sides of them and of the next ones.
#[inline(always)]
fn outside<L: Lane>(here: &Cell<L>, next: &Cell<L>) -> Cell<L> {
    Cell {
        to_inner: L::seam(here.to_inner, next.to_inner).0,
        to_outer: here.to_outer,
        slip: L::seam(here.slip, next.slip).0,
        radial: L::seam(here.radial, next.radial).0,
    }
}

/// Advances `columns`, whole vectors, of row `j`, and adds their energy to `energy` if `COUNTS` says so: [`cells::accelerations`],
/// [`cells::advanced`] and [`crate::model::scheme::double_radial`] on lanes.
///
/// * `ROW`: kind of the row; the surface as if it were free, on the backing, which is rigid, v alone
pub struct CellMarch<'a, const ROW: usize, const COUNTS: bool> {
    patch: CellPatch<'a>,
    j: usize,
    columns: Range<usize>,
    energy: &'a mut EnergySum,
}

impl<'a, const ROW: usize, const COUNTS: bool> CellMarch<'a, ROW, COUNTS> {
    /// # Safety
    ///
    /// The nodes of the row, a vector on either side of them (two of two numbers, one at the axis) and a vector on either side in the rows
    /// above and below that it has must be numbers that may be read at levels k−1 and k; those of the row may be written at level k+1 and
    /// belong to this work alone until it is done.
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    pub unsafe fn new(
        patch: CellPatch<'a>,
        j: usize,
        columns: Range<usize>,
        energy: &'a mut EnergySum,
    ) -> Self {
        Self { patch, j, columns, energy }
    }
}

impl<const ROW: usize, const COUNTS: bool> Work for CellMarch<'_, ROW, COUNTS> {
    type Output = ();

    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    fn run<L: Lane>(self, _: L) {
        let Self { patch: CellPatch { before, now, next, lateral, stride, weights }, j, columns, energy } =
            self;
        weights.check(&columns);
        assert!(
            columns.start.is_multiple_of(L::WIDTH) && columns.len().is_multiple_of(L::WIDTH),
            "whole vectors"
        );
        // SAFETY, of all below: the promise of `CellMarch::new`; weights have been checked
        unsafe {
            let [earlier, now] = [before.add(j * stride), now.add(j * stride)];
            let next = [next[0].add(j * stride), next[1].add(j * stride)];
            let constants = weights.medium.constants(L::load(now.add(columns.start)));
            let nodes = Nodes { row: kind(ROW), lateral, stride, constants };
            let mut i = columns.start;
            let parts = nodes.parts(now.add(i).sub(L::WIDTH));
            // q' of the cells at the outer sides of these columns
            let before = parts.as_inner(at(&weights.inner, BEFORE + 1 + i - L::WIDTH), &constants);
            let parts = nodes.parts(now.add(i));
            let outer = parts.as_outer(at(&weights.outer, i), &constants);
            let mut inner = parts.as_inner(at(&weights.inner, BEFORE + 1 + i), &constants);
            let mut cell = cells_of(&outer, &before, &inner);
            while i < columns.end {
                let ahead = i + L::WIDTH;
                let parts = nodes.parts(now.add(ahead));
                let outer = parts.as_outer(at(&weights.outer, ahead), &constants);
                let next_inner = parts.as_inner(at(&weights.inner, BEFORE + 1 + ahead), &constants);
                let next_cell = cells_of(&outer, &inner, &next_inner);
                let CellWeights { axial, slip, radial, .. } = weights;
                let accelerations = cells::accelerations(
                    [&cell, &outside(&cell, &next_cell)],
                    [at(&axial[0], i), at(&axial[1], i)],
                    [at(&slip[0], i), at(&slip[1], i)],
                    at::<L>(radial, i),
                );
                (cell, inner) = (next_cell, next_inner);
                for field in 0..2 {
                    if ROW == BACKING && field == 0 {
                        continue;
                    }
                    let offset = i + field * lateral;
                    let levels = [L::load(earlier.add(offset)), L::load(now.add(offset))];
                    cells::advanced(levels[0], levels[1], accelerations[field]).store(next[field].add(i));
                }
                i = ahead;
            }
            if COUNTS || weights.is_damped {
                damping_march::<L, ROW, COUNTS>([earlier, now], next, lateral, weights, columns, energy);
            }
        }
    }
}

/// Damps `columns` of both displacements of a row, which hold them at level k+1 without damping, and adds their energy to `energy` if `COUNTS`
/// says so.
///
/// * `levels`: u in column 0 at levels k−1 and k
/// * `next`: u and v in column 0 at level k+1
/// * `lateral`: distance from u to v
///
/// # Safety
///
/// As [`CellMarch::new`].
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn damping_march<L: Lane, const ROW: usize, const COUNTS: bool>(
    [before, now]: [*const f64; 2],
    next: [*mut f64; 2],
    lateral: usize,
    weights: &CellWeights,
    columns: Range<usize>,
    energy: &mut EnergySum,
) {
    let damping = weights.damping.each_ref().map(|sides| sides.each_ref().map(|weights| weights.as_ptr()));
    // SAFETY: the caller's promise
    unsafe {
        // not by a closure, which would not be compiled for these instructions
        let levels = [[before, now], [before.add(lateral), now.add(lateral)]];
        let mut moves = [
            Moves::<L>::new(levels[0], columns.start, damping[0], false),
            Moves::<L>::new(levels[1], columns.start, damping[1], true),
        ];
        let mut i = columns.start;
        while i < columns.end {
            for field in 0..2 {
                if ROW == BACKING && field == 0 {
                    continue;
                }
                let free = L::load(next[field].add(i));
                let later = moves[field].damped(free, levels[field], [i, columns.end], damping[field]);
                later.store(next[field].add(i));
                if COUNTS {
                    let (earlier, u) = (L::load(levels[field][0].add(i)), L::load(levels[field][1].add(i)));
                    let force = (free - u) - (u - earlier);
                    energy.add(i, at::<L>(&weights.areas[field], i), [earlier, u, later], force);
                }
            }
            i += L::WIDTH;
        }
    }
}

/// Cells of a row whose strains are taken together.
const PIECE: usize = 64;

/// Two rows of nodes of the scheme of cells with the cells between them.
#[derive(Clone, Copy)]
pub struct CellRow<'a> {
    /// u and v, each of the upper and the lower row, from the column before the first cell on.
    pub displacements: [[&'a [f64]; 2]; 2],
    /// q' and q, and the shares of the hoop strain, cell by cell.
    pub weights: [[&'a [f64]; 2]; 2],
    /// c
    pub courant: f64,
}

impl Work for CellRow<'_> {
    /// The largest of [`cells::largest_strain`].
    type Output = f64;

    #[inline(always)]
    fn run<L: Lane>(self, _: L) -> f64 {
        let count = self.weights[0][0].len();
        let mut largest = [0.0; BLOCK];
        for start in (0..count).step_by(PIECE) {
            let mut strains = [0.0; PIECE];
            let strains = &mut strains[..PIECE.min(count - start)];
            self.strains(start, strains);
            for block in strains.chunks(BLOCK) {
                for (largest, strain) in largest.iter_mut().zip(block) {
                    *largest = if *strain > *largest { *strain } else { *largest };
                }
            }
        }
        largest.into_iter().fold(0.0, f64::max)
    }
}

impl CellRow<'_> {
    /// Strains of the cells from `start` on: a loop without branches over slices of one length, which compilers turn into vectors.
    #[inline(always)]
    fn strains(self, start: usize, strains: &mut [f64]) {
        let n = strains.len();
        let [[u0, u1], [v0, v1]] =
            self.displacements.map(|rows| rows.map(|row| [&row[start..][..n], &row[start + 1..][..n]]));
        let [[inner, outer], [inner_hoop, outer_hoop]] =
            self.weights.map(|pair| pair.map(|weights| &weights[start..][..n]));
        for (i, strain) in strains.iter_mut().enumerate() {
            *strain = cells::largest_strain(
                [[u0[0][i], u1[0][i]], [u0[1][i], u1[1][i]]],
                [[v0[0][i], v1[0][i]], [v0[1][i], v1[1][i]]],
                [inner[i], outer[i]],
                [inner_hoop[i], outer_hoop[i]],
                self.courant,
            );
        }
    }
}

/// The largest difference of two rows by magnitude.
pub fn largest_stretch(upper: &[f64], lower: &[f64]) -> f64 {
    let mut largest = [0.0; BLOCK];
    for (upper, lower) in upper.chunks(BLOCK).zip(lower.chunks(BLOCK)) {
        for (largest, (upper, lower)) in largest.iter_mut().zip(upper.iter().zip(lower)) {
            let stretch = (lower - upper).abs();
            *largest = if stretch > *largest { stretch } else { *largest };
        }
    }
    largest.into_iter().fold(0.0, f64::max)
}
