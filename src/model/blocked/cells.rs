//! Rows of nodes of the scheme of cells, a vector at a time.
//!
//! The operations are those of [`crate::model::cells`] in the same order, so the bits are the same. A row is marched outwards:
//! columns of a vector are made of the rows above and below, cells of two vectors of columns, nodes of two vectors of cells; each is
//! made once and carried to the next vector.

use std::ops::Range;

use super::{
    damping::Moves,
    energy::EnergySum,
    vector::{BLOCK, Vector, Work, padded},
};
use crate::model::{
    cell_scheme::CellScheme,
    cells::{self, ColumnWeights, Medium, Row},
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

/// The vector at `i` of weights.
///
/// # Safety
///
/// The machine must have the instructions of `V`; there is a vector at `i`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn at<V: Vector>(weights: &[f64], i: usize) -> V {
    // SAFETY: the caller's promise
    unsafe { V::load(weights.as_ptr().add(i)) }
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

/// [`cells::Column`] on vectors, as cells want it.
#[derive(Clone, Copy)]
struct Column<V> {
    /// `Δ(u_{j+1} − u_j)`
    stretch: V,
    /// k times that.
    bend: V,
    /// λ times the sum of `u_{j+1} − u_j`.
    normal: V,
    sink: [V; 2],
    tilt: [V; 2],
    /// λ times the difference of `v_j + v_{j+1}`.
    spread: V,
    flow: V,
}

/// [`cells::Cell`] on vectors: of cells, or what a column contributes to them.
#[derive(Clone, Copy)]
struct Cell<V> {
    to_inner: V,
    to_outer: V,
    slip: V,
    radial: V,
}

/// Difference and sum over both rows of cells, of differences and of sums of a displacement: [`cells::Column::new`].
///
/// # Safety
///
/// The machine must have the instructions of `V`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn pairs<V: Vector>(row: Row, [above, here, below]: [V; 3]) -> [[V; 2]; 2] {
    // SAFETY: the caller's promise
    unsafe {
        match row {
            Row::Interior => {
                let (ends, across) = (above.add(below), below.sub(above));
                [[ends.sub(here.add(here)), across], [across, ends.add(here.add(here))]]
            }
            Row::Surface => {
                let (difference, sum) = (below.sub(here), here.add(below));
                let (difference, sum) = (difference.add(difference), sum.add(sum));
                [[difference; 2], [sum; 2]]
            }
            Row::Backing => {
                let (difference, sum) = (here.sub(above), above.add(here));
                let (difference, sum) = (difference.add(difference), sum.add(sum));
                let zero = V::splat(0.0);
                [[zero.sub(difference), difference], [zero.sub(sum), sum]]
            }
            Row::Membrane => {
                let (difference, sum) = (here.sub(above), above.add(here));
                let zero = V::splat(0.0);
                [[zero.sub(difference), difference], [zero.sub(sum), sum]]
            }
        }
    }
}

/// Vectors above, here and below of what `row` has.
///
/// # Safety
///
/// As [`Column::load`].
#[inline(always)]
#[expect(unsafe_code, reason = "vectors of a field that threads share")]
unsafe fn rows<V: Vector>(row: Row, at: *const f64, stride: usize) -> [V; 3] {
    // SAFETY: the caller's promise
    unsafe {
        let here = V::load(at);
        let above = if matches!(row, Row::Surface) { here } else { V::load(at.sub(stride)) };
        let has_below = !matches!(row, Row::Backing | Row::Membrane);
        let below = if has_below { V::load(at.add(stride)) } else { here };
        [above, here, below]
    }
}

/// Vectors of the material.
#[derive(Clone, Copy)]
struct Constants<V> {
    lame: V,
    hourglass: V,
    courant: V,
    /// `courant·shear`
    shear: V,
    membrane: V,
}

#[expect(unsafe_code, reason = "vectors of a field that threads share")]
impl<V: Vector> Column<V> {
    /// The vector of columns at `u`, with v at `v`.
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; the vector is one of numbers in this row, and in the rows above and below that
    /// `row` has.
    #[inline(always)]
    unsafe fn load(row: Row, u: *const f64, v: *const f64, stride: usize, constants: &Constants<V>) -> Self {
        let Constants { lame, hourglass, membrane, .. } = *constants;
        // SAFETY: the caller's promise
        unsafe {
            let [stretch, sink] = pairs(row, rows(row, u, stride));
            let v: [V; 3] = rows(row, v, stride);
            let [tilt, mut spread] = pairs(row, v);
            if matches!(row, Row::Membrane) {
                spread[1] = spread[1].add_product(membrane, v[1].add(v[1]));
            }
            Self {
                stretch: stretch[0],
                bend: hourglass.mul(stretch[0]),
                normal: lame.mul(stretch[1]),
                sink,
                tilt,
                spread: lame.mul(spread[0]),
                flow: spread[1].sub_product(hourglass, tilt[0]),
            }
        }
    }

    /// What it contributes to the cell at its inner side, as the outer column of that.
    ///
    /// * `q`: of the cell
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    unsafe fn as_outer(&self, q: V, constants: &Constants<V>) -> Cell<V> {
        let Constants { courant, shear, .. } = *constants;
        // SAFETY: the caller's promise
        unsafe {
            let normal = self.stretch.add_product(q, self.spread);
            let lean = self.bend.sub_product(shear, self.tilt[1].add_product(courant, self.sink[1]));
            Cell {
                to_inner: normal.sub(lean),
                to_outer: normal.add(lean),
                slip: self.tilt[0].add_product(courant, self.sink[0]),
                radial: self.normal.add_product(q, self.flow),
            }
        }
    }

    /// What it contributes to the cell at its outer side, as the inner column of that: signs of q', c and k are turned.
    ///
    /// * `q`: q' of the cell
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    unsafe fn as_inner(&self, q: V, constants: &Constants<V>) -> Cell<V> {
        let Constants { courant, shear, .. } = *constants;
        // SAFETY: the caller's promise
        unsafe {
            let normal = self.stretch.sub_product(q, self.spread);
            // −lean
            let lean = self.bend.add_product(shear, self.tilt[1].sub_product(courant, self.sink[1]));
            Cell {
                to_inner: normal.add(lean),
                to_outer: normal.sub(lean),
                slip: self.tilt[0].sub_product(courant, self.sink[0]),
                radial: self.normal.sub_product(q, self.flow),
            }
        }
    }
}

#[expect(unsafe_code, reason = "instructions that not every machine has")]
impl<V: Vector> Cell<V> {
    /// The cells at the inner sides of a vector of columns: [`cells::Cell::new`].
    ///
    /// * `outer`: what these columns contribute as outer ones
    /// * `before`, `here`: what the vector of columns before and they contribute as inner ones
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    unsafe fn of(outer: &Self, before: &Self, here: &Self) -> Self {
        // SAFETY: the caller's promise
        unsafe {
            Self {
                to_inner: outer.to_inner.add(V::seam(before.to_inner, here.to_inner).1),
                to_outer: outer.to_outer.add(V::seam(before.to_outer, here.to_outer).1),
                slip: outer.slip.add(V::seam(before.slip, here.slip).1),
                radial: outer.radial.add(V::seam(before.radial, here.radial).1),
            }
        }
    }
}

/// Advances `columns`, whole vectors, of row `j`, and adds their energy to `energy` if `COUNTS` says so: [`cells::accelerations`],
/// [`cells::advanced`] and [`crate::model::scheme::double_radial`] on vectors.
///
/// Always inlined, so that a caller compiled for wider vectors gets them here.
///
/// * `ROW`: kind of the row; the surface as if it were free, on the backing, which is rigid, v alone
///
/// # Safety
///
/// The machine must have the instructions of `V`. The nodes of the row, a vector on either side of them (two of two numbers, one at
/// the axis) and a vector on either side in the rows above and below that it has must be numbers that may be read at
/// levels k−1 and k; those of the row may be written at level k+1 and belong to this call alone.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn cell_march<V: Vector, const ROW: usize, const COUNTS: bool>(
    patch: CellPatch<'_>,
    j: usize,
    columns: Range<usize>,
    energy: &mut EnergySum,
) {
    let CellPatch { before, now, next, lateral, stride, weights } = patch;
    weights.check(&columns);
    assert!(
        columns.start.is_multiple_of(V::WIDTH) && columns.len().is_multiple_of(V::WIDTH),
        "whole vectors"
    );
    let Medium { shear, lame, hourglass, courant, membrane } = weights.medium;
    // SAFETY, of all below: the caller's promise; weights have been checked
    unsafe {
        let constants = Constants {
            lame: V::splat(lame),
            hourglass: V::splat(hourglass),
            courant: V::splat(courant),
            shear: V::splat(courant * shear),
            membrane: V::splat(membrane),
        };
        let (before, now) = (before.add(j * stride), now.add(j * stride));
        let mut i = columns.start;
        let first = now.add(i).sub(V::WIDTH);
        let column = Column::<V>::load(kind(ROW), first, first.add(lateral), stride, &constants);
        // q' of the cells at the outer sides of these columns
        let inner = column.as_inner(at(&weights.inner, BEFORE + 1 + i - V::WIDTH), &constants);
        let first = now.add(i);
        let column = Column::<V>::load(kind(ROW), first, first.add(lateral), stride, &constants);
        let outer = column.as_outer(at(&weights.outer, i), &constants);
        let mut as_inner = column.as_inner(at(&weights.inner, BEFORE + 1 + i), &constants);
        let mut cell = Cell::of(&outer, &inner, &as_inner);
        while i < columns.end {
            let ahead = i + V::WIDTH;
            let u = now.add(ahead);
            let column = Column::<V>::load(kind(ROW), u, u.add(lateral), stride, &constants);
            let outer = column.as_outer(at(&weights.outer, ahead), &constants);
            let next_inner = column.as_inner(at(&weights.inner, BEFORE + 1 + ahead), &constants);
            let next_cell = Cell::of(&outer, &as_inner, &next_inner);
            // of the cells at the inner and at the outer side
            let axial = [cell.to_outer, V::seam(cell.to_inner, next_cell.to_inner).0];
            let slip = [cell.slip, V::seam(cell.slip, next_cell.slip).0];
            let radial = [cell.radial, V::seam(cell.radial, next_cell.radial).0];
            let sheared = at::<V>(&weights.slip[0], i).mul(slip[0]);
            let sheared = sheared.add_product(at(&weights.slip[1], i), slip[1]);
            let accelerations = [
                at::<V>(&weights.axial[0], i).mul(axial[0]).add_product(at(&weights.axial[1], i), axial[1]),
                sheared.add_product(at(&weights.radial, i), radial[1].sub(radial[0])),
            ];
            (cell, as_inner) = (next_cell, next_inner);
            for field in 0..2 {
                if ROW == BACKING && field == 0 {
                    continue;
                }
                let offset = i + field * lateral;
                let free = V::load(now.add(offset)).twice_less(V::load(before.add(offset)));
                free.add(accelerations[field]).store(next[field].add(i + j * stride));
            }
            i = ahead;
        }
        if COUNTS || weights.is_damped {
            let next = next.map(|next| next.add(j * stride));
            damping_march::<V, ROW, COUNTS>([before, now], next, lateral, weights, columns, energy);
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
/// As [`cell_march`].
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn damping_march<V: Vector, const ROW: usize, const COUNTS: bool>(
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
            Moves::<V>::new(levels[0], columns.start, damping[0], false),
            Moves::<V>::new(levels[1], columns.start, damping[1], true),
        ];
        let mut i = columns.start;
        while i < columns.end {
            for field in 0..2 {
                if ROW == BACKING && field == 0 {
                    continue;
                }
                let free = V::load(next[field].add(i));
                let later = moves[field].damped(free, levels[field], [i, columns.end], damping[field]);
                later.store(next[field].add(i));
                if COUNTS {
                    let (earlier, u) = (V::load(levels[field][0].add(i)), V::load(levels[field][1].add(i)));
                    let force = free.sub(u).sub(u.sub(earlier));
                    energy.add(i, at::<V>(&weights.areas[field], i), [earlier, u, later], force);
                }
            }
            i += V::WIDTH;
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
    fn run(self) -> f64 {
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
