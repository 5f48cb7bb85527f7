//! Rows of nodes of the scheme of cells, a vector at a time.
//!
//! The operations are those of [`crate::model::cells`] in the same order, so the bits are the same. A row is marched outwards:
//! columns of a vector are made of the rows above and below, cells of two vectors of columns, nodes of two vectors of cells; each is
//! made once and carried to the next vector.

use std::ops::Range;

use super::{
    damping::{Moves, at},
    energy::EnergySum,
    vector::{BLOCK, Vector, padded},
};
use crate::model::{
    cell_scheme::CellScheme,
    cells::{self, ColumnWeights, Medium, Row},
    scheme::RadialWeights,
};

/// Weights of a layer by column, for whole blocks.
pub struct CellWeights {
    /// Constants of the material.
    pub medium: Medium,
    /// q' and q of cells, with a block more.
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
        Self {
            inner: column(|weights| weights.inner, columns + BLOCK),
            outer: column(|weights| weights.outer, columns + BLOCK),
            hoop: [column(|weights| weights.hoop[0], columns), column(|weights| weights.hoop[1], columns)],
            axial: [column(|weights| weights.axial[0], columns), column(|weights| weights.axial[1], columns)],
            slip: [column(|weights| weights.slip[0], columns), column(|weights| weights.slip[1], columns)],
            radial: column(|weights| weights.radial, columns),
            damping: [damped(0), damped(1)],
            areas: [padded(grid.area.iter().copied(), columns), padded(lateral_areas, columns)],
            medium: *medium,
        }
    }

    /// Weights of the strains of cells at the inner sides of columns: q' and q, [`ColumnWeights::hoop`].
    pub fn strains(&self, columns: &Range<usize>) -> [[&[f64]; 2]; 2] {
        [[&self.inner, &self.outer], [&self.hoop[0], &self.hoop[1]]]
            .map(|pair| pair.map(|weights| &weights[columns.clone()]))
    }

    /// Panics if there are fewer columns.
    fn check(&self, columns: &Range<usize>) {
        let nodes = [&self.axial, &self.slip, &self.areas];
        let nodes = nodes.into_iter().flatten().chain([&self.radial]);
        assert!(nodes.into_iter().all(|weights| columns.end <= weights.len()));
        let cells = self.damping.iter().flatten().chain([&self.inner, &self.outer]);
        assert!(cells.into_iter().all(|weights| columns.end + BLOCK <= weights.len()));
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

/// [`Row`] of a kind.
const fn kind(row: usize) -> Row {
    match row {
        SURFACE => Row::Surface,
        INTERIOR => Row::Interior,
        _ => Row::Backing,
    }
}

/// [`cells::Column`] on vectors, with both flows that a cell takes of it in one.
#[derive(Clone, Copy)]
struct Column<V> {
    stretch: [V; 2],
    sink: [V; 2],
    tilt: [V; 2],
    spread: V,
    flow: V,
}

/// [`cells::Cell`] on vectors, as nodes want it: `normal + lean`, `normal − lean`, `slip`, `radial`.
#[derive(Clone, Copy)]
struct Cell<V> {
    inside: V,
    outside: V,
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
        let below = if matches!(row, Row::Backing) { here } else { V::load(at.add(stride)) };
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
    unsafe fn load(row: Row, u: *const f64, v: *const f64, stride: usize, hourglass: V) -> Self {
        // SAFETY: the caller's promise
        unsafe {
            let [stretch, sink] = pairs(row, rows(row, u, stride));
            let [tilt, spread] = pairs(row, rows(row, v, stride));
            Self { stretch, sink, tilt, spread: spread[0], flow: spread[1].sub(hourglass.mul(tilt[0])) }
        }
    }

    /// The columns one node inside those of `self`, `before` being the vector before.
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    unsafe fn inside(&self, before: &Self) -> Self {
        // SAFETY: the caller's promise
        unsafe {
            Self {
                stretch: [
                    V::seam(before.stretch[0], self.stretch[0]).1,
                    V::seam(before.stretch[1], self.stretch[1]).1,
                ],
                sink: [V::seam(before.sink[0], self.sink[0]).1, V::seam(before.sink[1], self.sink[1]).1],
                tilt: [V::seam(before.tilt[0], self.tilt[0]).1, V::seam(before.tilt[1], self.tilt[1]).1],
                spread: V::seam(before.spread, self.spread).1,
                flow: V::seam(before.flow, self.flow).1,
            }
        }
    }

    /// The cells at the inner side of these columns: [`cells::Cell::new`].
    ///
    /// * `weights`: q' and q of column 0
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; there is a vector of weights at `i`.
    #[inline(always)]
    unsafe fn cells(
        &self,
        before: &Self,
        weights: [&[f64]; 2],
        i: usize,
        constants: &Constants<V>,
    ) -> Cell<V> {
        // SAFETY: the caller's promise
        unsafe {
            let (inner, outer) = (self.inside(before), self);
            let (from_inner, from_outer) = (at::<V>(weights[0], i), at::<V>(weights[1], i));
            let Constants { lame, hourglass, courant, shear } = *constants;
            let dilation = from_outer.mul(outer.spread).sub(from_inner.mul(inner.spread));
            let shift = courant.mul(outer.sink[1].sub(inner.sink[1])).add(inner.tilt[1].add(outer.tilt[1]));
            let bend = outer.stretch[0].sub(inner.stretch[0]);
            let normal = inner.stretch[0].add(outer.stretch[0]).add(lame.mul(dilation));
            let lean = hourglass.mul(bend).sub(shear.mul(shift));
            let flow = from_outer.mul(outer.flow).sub(from_inner.mul(inner.flow));
            Cell {
                inside: normal.add(lean),
                outside: normal.sub(lean),
                slip: courant.mul(outer.sink[0].sub(inner.sink[0])).add(inner.tilt[0].add(outer.tilt[0])),
                radial: lame.mul(inner.stretch[1].add(outer.stretch[1])).add(flow),
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
    let Medium { shear, lame, hourglass, courant } = weights.medium;
    // SAFETY, of all below: the caller's promise; weights have been checked
    unsafe {
        let constants = Constants {
            lame: V::splat(lame),
            hourglass: V::splat(hourglass),
            courant: V::splat(courant),
            shear: V::splat(courant * shear),
        };
        let (before, now) = (before.add(j * stride), now.add(j * stride));
        let q = [&weights.inner[..], &weights.outer[..]];
        let mut i = columns.start;
        let first = now.add(i).sub(V::WIDTH);
        let inside = Column::<V>::load(kind(ROW), first, first.add(lateral), stride, constants.hourglass);
        let first = now.add(i);
        let mut here = Column::<V>::load(kind(ROW), first, first.add(lateral), stride, constants.hourglass);
        let mut cell = here.cells(&inside, q, i, &constants);
        let [mut u_moves, mut v_moves] = [0, 1]
            .map(|field| Moves::<V>::new(before, now, field * lateral, i, &weights.damping[field], field));
        while i < columns.end {
            let u = now.add(i + V::WIDTH);
            let after = Column::<V>::load(kind(ROW), u, u.add(lateral), stride, constants.hourglass);
            let next_cell = after.cells(&here, q, i + V::WIDTH, &constants);
            let outside = V::seam(cell.outside, next_cell.outside).0;
            let slip = V::seam(cell.slip, next_cell.slip).0;
            let radial = V::seam(cell.radial, next_cell.radial).0.sub(cell.radial);
            let sheared =
                at::<V>(&weights.slip[0], i).mul(cell.slip).add(at::<V>(&weights.slip[1], i).mul(slip));
            let accelerations = [
                at::<V>(&weights.axial[0], i)
                    .mul(cell.inside)
                    .add(at::<V>(&weights.axial[1], i).mul(outside)),
                sheared.add(at::<V>(&weights.radial, i).mul(radial)),
            ];
            let added = [
                u_moves.damped(before, now, [i, columns.end], &weights.damping[0]),
                v_moves.damped(before.add(lateral), now.add(lateral), [i, columns.end], &weights.damping[1]),
            ];
            for field in 0..2 {
                if ROW == BACKING && field == 0 {
                    continue;
                }
                let offset = i + field * lateral;
                let (u, earlier) = (V::load(now.add(offset)), V::load(before.add(offset)));
                let later = u.twice_less(earlier).add(accelerations[field]).sub(added[field]);
                later.store(next[field].add(i + j * stride));
                if COUNTS {
                    energy.add(
                        i,
                        at::<V>(&weights.areas[field], i),
                        [earlier, u, later],
                        accelerations[field],
                    );
                }
            }
            (here, cell) = (after, next_cell);
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

impl CellRow<'_> {
    /// The largest of [`cells::largest_strain`]: the same bits, however the compiler makes vectors of it.
    #[inline(always)]
    pub fn largest_strain(self) -> f64 {
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
