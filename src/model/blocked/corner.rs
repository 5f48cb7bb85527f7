//! Rows of nodes with the mixed-derivative correction of the scheme: [`super::kernel`] reaching two rows and columns.
//!
//! The operations are those of [`crate::model::scheme`] in the same order, so the bits are the same. There are two arrangements of them:
//! with many registers two rows side by side, each making the combinations of levels of six rows; with few, which that would spill, row by row
//! with the combinations of the last rows kept in a ring.

use std::{mem::MaybeUninit, ops::Range};

use super::{
    energy::EnergySum,
    levels::{Around, CornerTerm, Patch},
    vector::{BLOCK, Vector},
};
use crate::model::scheme;

/// Columns over which rows are marched down: what the next rows read again stays in the first cache.
pub const PIECE: usize = 24 * BLOCK;

/// What the scheme needs of a vector of a row: sums over z.
#[derive(Clone, Copy)]
struct CornerSums<V> {
    /// `u_{j−1} + u_{j+1}` at level k less `u^{k−1}`.
    axial: V,
    /// `4·U` at level k.
    four: V,
    /// `16·E_z d` of the combination of levels.
    corner: V,
    /// `16·E_z` of `u^k − u^{k−1}`, if energy is counted.
    moved: V,
}

/// A vector of a row at both levels, the combination `u^k − ρ·u^{k−1}` and, if energy is counted, `u^k − u^{k−1}`.
#[derive(Clone, Copy)]
struct Combination<V> {
    before: V,
    now: V,
    both: V,
    moved: V,
}

impl<V: Vector> Combination<V> {
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; the vector is one of numbers at both levels.
    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    unsafe fn load<const COUNTS: bool>(before: *const f64, now: *const f64, share: V) -> Self {
        // SAFETY: the caller's promise
        unsafe {
            let (before, now) = (V::load(before), V::load(now));
            let moved = if COUNTS { now.sub(before) } else { now };
            Self { before, now, both: now.sub_product(share, before), moved }
        }
    }

    /// The two rows above a vector of row j, it, and the row below.
    ///
    /// # Safety
    ///
    /// As [`Combination::load`] for these rows.
    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    unsafe fn first_rows<const COUNTS: bool>(
        before: *const f64,
        now: *const f64,
        [a, b, d, ..]: Around,
        share: V,
    ) -> [Self; 4] {
        // SAFETY: the caller's promise
        unsafe {
            [
                Self::load::<COUNTS>(before.offset(a), now.offset(a), share),
                Self::load::<COUNTS>(before.offset(b), now.offset(b), share),
                Self::load::<COUNTS>(before, now, share),
                Self::load::<COUNTS>(before.offset(d), now.offset(d), share),
            ]
        }
    }
}

/// What stands inside a vector of nodes: `4·U` one node, sums of the mixed-derivative correction two nodes inside.
#[derive(Clone, Copy)]
struct Inside<V> {
    four: V,
    corner: V,
    moved: V,
}

/// Vectors of weights: radial ones and those of the mixed-derivative correction, outward and inward each.
#[derive(Clone, Copy)]
struct Weights<V> {
    radial: [V; 2],
    corner: [V; 2],
}

impl<V: Vector> Weights<V> {
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; there is a vector of weights at `i`.
    #[inline(always)]
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    unsafe fn load(patch: &Patch<'_>, corner: &CornerTerm<'_>, i: usize) -> Self {
        // SAFETY: the caller's promise
        unsafe {
            Self {
                radial: [V::load(patch.outward.as_ptr().add(i)), V::load(patch.inward.as_ptr().add(i))],
                corner: [V::load(corner.outward.as_ptr().add(i)), V::load(corner.inward.as_ptr().add(i))],
            }
        }
    }
}

#[expect(unsafe_code, reason = "vectors of a field that threads share")]
impl<V: Vector> CornerSums<V> {
    /// Of a row from what stands in it and in the two rows above and below.
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    unsafe fn of<const COUNTS: bool>(rows: [Combination<V>; 5]) -> Self {
        let [a, b, c, d, e] = rows;
        // SAFETY: the caller's promise
        unsafe {
            let ends = b.now.add(d.now);
            Self {
                axial: ends.sub(c.before),
                four: ends.add_twice(c.now),
                corner: c.both.twice_less(a.both.add(e.both)),
                moved: if COUNTS { c.moved.twice_less(a.moved.add(e.moved)) } else { ends },
            }
        }
    }

    /// Of `N` rows from row j on, in the vector at column `i`.
    ///
    /// * `levels`: column 0 of row j at levels k−1 and k
    /// * `around`: row j
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; the vector is one of numbers in these rows and two above and below.
    #[inline(always)]
    unsafe fn load<const N: usize, const COUNTS: bool>(
        levels: [*const f64; 2],
        around: Around,
        i: isize,
        share: V,
    ) -> [Self; N] {
        // SAFETY: rows j − 2 to j + N + 1, or those around row j, are numbers there
        unsafe {
            let (before, now) = (levels[0].offset(i), levels[1].offset(i));
            let [mut a, mut b, mut c, mut d] = Combination::first_rows::<COUNTS>(before, now, around, share);
            let mut sums = [Self { axial: share, four: share, corner: share, moved: share }; N];
            for (row, sum) in sums.iter_mut().enumerate() {
                let below = around[3 + row];
                let e = Combination::load::<COUNTS>(before.offset(below), now.offset(below), share);
                *sum = Self::of::<COUNTS>([a, b, c, d, e]);
                (a, b, c, d) = (b, c, d, e);
            }
            sums
        }
    }

    /// What stands inside the vector of nodes after `self`.
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    unsafe fn before<const COUNTS: bool>(&self, here: &Self) -> Inside<V> {
        // SAFETY: the caller's promise
        unsafe {
            Inside {
                four: V::seam(self.four, here.four).1,
                corner: V::wide_seam(self.corner, here.corner).1,
                moved: if COUNTS { V::wide_seam(self.moved, here.moved).1 } else { here.four },
            }
        }
    }

    /// The vector of nodes at level k+1, [`scheme::advanced`] and [`scheme::corrected`], and what damping adds to them, `−C(u^k − u^{k−1})` up to a
    /// factor, if energy is counted. `inside` goes on to the next vector.
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    unsafe fn advanced<const COUNTS: bool>(
        &self,
        inside: &mut Inside<V>,
        after: &Self,
        weights: &Weights<V>,
    ) -> [V; 2] {
        // SAFETY: the caller's promise
        unsafe {
            let (outside, next_inside) = V::seam(self.four, after.four);
            let later = self.axial.add_product(weights.radial[0], outside.sub(self.four));
            let later = later.sub_product(weights.radial[1], self.four.sub(inside.four));
            inside.four = next_inside;
            let (outside, next_inside) = V::wide_seam(self.corner, after.corner);
            let later = later.add_product(weights.corner[0], outside.sub(self.corner));
            let later = later.sub_product(weights.corner[1], self.corner.sub(inside.corner));
            inside.corner = next_inside;
            if !COUNTS {
                return [later; 2];
            }
            let (outside, next_inside) = V::wide_seam(self.moved, after.moved);
            let damped = weights.corner[0].mul(outside.sub(self.moved));
            let damped = damped.sub_product(weights.corner[1], self.moved.sub(inside.moved));
            inside.moved = next_inside;
            [later, damped]
        }
    }
}

/// Advances `N` rows from row `j` on with the mixed-derivative correction, vector by vector outwards.
///
/// # Safety
///
/// As [`super::kernel::advance`] for these rows; if `COUNTS`, there is an area for every column and a sum for every row.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn corner_march<V: Vector, const N: usize, const COUNTS: bool>(
    patch: Patch<'_>,
    corner: CornerTerm<'_>,
    j: usize,
    columns: Range<usize>,
    around: Around,
    area: &[f64],
    energies: &mut [EnergySum],
) {
    let stride = patch.stride;
    // SAFETY, here and below: the nodes of the patch, two rows around them and a vector on either side are numbers at levels
    // k−1 and k, and those of the patch at level k+1 belong to this call alone; the machine has the instructions
    unsafe {
        let share = V::splat(corner.share);
        let levels = [patch.before.add(j * stride), patch.now.add(j * stride)];
        let next = patch.next.add(j * stride);
        let (mut i, width) = (columns.start, V::WIDTH as isize);
        let before = CornerSums::<V>::load::<N, COUNTS>(levels, around, i as isize - width, share);
        let mut here = CornerSums::<V>::load::<N, COUNTS>(levels, around, i as isize, share);
        let mut inside = [Inside { four: share, corner: share, moved: share }; N];
        for row in 0..N {
            inside[row] = before[row].before::<COUNTS>(&here[row]);
        }
        while i < columns.end {
            let weights = Weights::load(&patch, &corner, i);
            let ahead = i + V::WIDTH;
            let (before, now) = (levels[0].add(ahead), levels[1].add(ahead));
            let [mut a, mut b, mut c, mut d] = Combination::first_rows::<COUNTS>(before, now, around, share);
            for row in 0..N {
                let below = around[3 + row];
                let e = Combination::load::<COUNTS>(before.offset(below), now.offset(below), share);
                let after = CornerSums::of::<COUNTS>([a, b, c, d, e]);
                (a, b, c, d) = (b, c, d, e);
                let [later, damped] = here[row].advanced::<COUNTS>(&mut inside[row], &after, &weights);
                let node = i + row * stride;
                later.store(next.add(node));
                if COUNTS {
                    let (before, middle) = (V::load(levels[0].add(node)), V::load(levels[1].add(node)));
                    let area = V::load(area.as_ptr().add(i));
                    // what damping takes is not strain
                    let force = later.sub(middle).sub(middle.sub(before)).sub_product(share, damped);
                    energies.get_unchecked_mut(row).add(i, area, [before, middle, later], force);
                }
                here[row] = after;
            }
            i = ahead;
        }
    }
}

/// Rows of a ring: the two above a row, it, and the two below.
const RING: usize = 5;

/// Combinations of levels of the last rows, with a block on either side of the columns of a piece.
#[repr(align(64))]
struct Ring([[MaybeUninit<f64>; PIECE + 2 * BLOCK]; RING]);

/// A row that is advanced with a ring.
struct RingRow {
    /// The first column of the row at levels k−1 and k.
    levels: [*const f64; 2],
    stride: isize,
    /// The same column of its rows in the ring, the last of which is to be made.
    ring: [*mut f64; RING],
}

#[expect(unsafe_code, reason = "vectors of a field that threads share")]
impl RingRow {
    /// Makes the combinations of the vector at column `i` two rows below.
    ///
    /// # Safety
    ///
    /// As [`CornerSums::load`]; the ring has room.
    #[inline(always)]
    unsafe fn combine<V: Vector>(&self, i: isize, share: V) -> V {
        let below = i + 2 * self.stride;
        // SAFETY: the caller's promise
        unsafe {
            let before = V::load(self.levels[0].offset(below));
            let both = V::load(self.levels[1].offset(below)).sub_product(share, before);
            both.store(self.ring[RING - 1].offset(i));
            both
        }
    }

    /// The sums of the vector at column `i`.
    ///
    /// # Safety
    ///
    /// As [`RingRow::combine`]; the ring has the combinations of the row and of that two above.
    #[inline(always)]
    unsafe fn sums<V: Vector>(&self, i: isize, share: V) -> CornerSums<V> {
        // SAFETY: the caller's promise
        unsafe {
            let e = self.combine(i, share);
            let now = self.levels[1].offset(i);
            let ends = V::load(now.offset(-self.stride)).add(V::load(now.offset(self.stride)));
            CornerSums {
                axial: ends.sub(V::load(self.levels[0].offset(i))),
                four: ends.add_twice(V::load(now)),
                corner: V::load(self.ring[2].offset(i)).twice_less(V::load(self.ring[0].offset(i)).add(e)),
                moved: ends,
            }
        }
    }

    /// Goes on to the row below.
    #[inline(always)]
    fn step(&mut self) {
        self.levels = self.levels.map(|level| level.wrapping_offset(self.stride));
        self.ring.rotate_left(1);
    }
}

/// Advances `rows` of `columns`, no more than a piece, with the mixed-derivative correction, where no face is near.
///
/// # Safety
///
/// As [`super::kernel::advance`].
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn ring_march<V: Vector>(
    patch: Patch<'_>,
    corner: CornerTerm<'_>,
    rows: Range<usize>,
    columns: Range<usize>,
) {
    assert!(columns.len() <= PIECE, "{} columns of a ring of {PIECE}", columns.len());
    let mut ring = Ring([[MaybeUninit::uninit(); PIECE + 2 * BLOCK]; RING]);
    let (width, length) = (V::WIDTH as isize, columns.len() as isize);
    // SAFETY, here and below: as for `corner_march`; the ring has a block on either side of a piece
    unsafe {
        let share = V::splat(corner.share);
        let first = rows.start * patch.stride + columns.start;
        let mut next = patch.next.add(first);
        let mut row = RingRow {
            levels: [patch.before.add(first), patch.now.add(first)],
            stride: patch.stride as isize,
            ring: ring.0.each_mut().map(|row| row[BLOCK..].as_mut_ptr().cast()),
        };
        // as if the four rows above had been advanced
        row.levels = row.levels.map(|level| level.wrapping_offset(-4 * row.stride));
        for _ in 0..4 {
            let mut i = -width;
            while i < length + width {
                row.combine::<V>(i, share);
                i += width;
            }
            row.step();
        }
        for _ in rows {
            let before = row.sums::<V>(-width, share);
            let mut here = row.sums(0, share);
            let mut inside = before.before::<false>(&here);
            let mut i = 0;
            while i < length {
                let weights = Weights::load(&patch, &corner, columns.start + i as usize);
                let after = row.sums(i + width, share);
                let [later, _] = here.advanced::<false>(&mut inside, &after, &weights);
                later.store(next.offset(i));
                here = after;
                i += width;
            }
            row.step();
            next = next.wrapping_offset(row.stride);
        }
    }
}

/// Adds the mixed-derivative correction to surface nodes at level k+1: [`scheme::corner`] with the images of [`scheme::image_row`] and
/// [`scheme::image_column`], column by column.
///
/// * `rows`: u_0 and u_2 at level k−1, then at level k, two nodes more than `free`
/// * `share`: ρ, of the level before in the combination
/// * `axial`: room for sums over z
/// * `free`: what it is added to
#[inline(always)]
pub fn add_corner(
    rows: [[&[f64]; 2]; 2],
    share: f64,
    corner: CornerTerm<'_>,
    axial: &mut Vec<f64>,
    free: &mut [f64],
) {
    let n = free.len();
    let [before, now] = rows.map(|rows| rows.map(|row| &row[..n + 2]));
    axial.clear();
    axial.resize(n + 4, 0.0);
    // loops and no closures, which would not be compiled for the instructions of the caller
    for i in 0..n + 2 {
        let top = scheme::combined(share, before[0][i], now[0][i]);
        let below = scheme::combined(share, before[1][i], now[1][i]);
        axial[i + 2] = scheme::corner_axial(below, top, below);
    }
    // the images about the axis
    (axial[0], axial[1]) = (axial[3], axial[2]);
    for (i, free) in free.iter_mut().enumerate() {
        *free = scheme::add_radial(*free, [axial[i], axial[i + 2], axial[i + 4]], corner.column(i));
    }
}
