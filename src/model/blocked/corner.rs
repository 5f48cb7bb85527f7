//! Rows of nodes with the mixed-derivative correction of the scheme: [`super::kernel`] reaching two rows and columns.
//!
//! Where energy is counted or a face is near, and for lanes with 32 registers, two rows go side by side, each making the combinations of levels of six
//! rows. Elsewhere a row at a time makes those two rows below and keeps the last five rows of them in a ring, in the first cache.

use std::{mem::MaybeUninit, ops::Range};

use super::{
    energy::EnergySum,
    lane::{BLOCK, Lane},
    levels::{Around, CornerTerm, Patch},
};
use crate::model::scheme::{self, RadialWeights};

/// Columns over which rows are marched down: what the next rows read again stays in the first cache.
pub const PIECE: usize = 24 * BLOCK;

/// What the scheme needs of a vector of a row: sums over z.
#[derive(Clone, Copy)]
struct CornerSums<L> {
    /// `u_{j−1} + u_{j+1}` at level k less `u^{k−1}`.
    axial: L,
    /// `4·U` at level k.
    four: L,
    /// `16·E_z d` of the combination of levels.
    corner: L,
    /// `16·E_z` of `u^k − u^{k−1}`, if energy is counted.
    moved: L,
}

/// A vector of a row at both levels, the combination `u^k − ρ·u^{k−1}` and, if energy is counted, `u^k − u^{k−1}`.
#[derive(Clone, Copy)]
struct Combination<L> {
    before: L,
    now: L,
    both: L,
    moved: L,
}

#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
impl<L: Lane> Combination<L> {
    /// # Safety
    ///
    /// The machine has the instructions of `L`; the lanes are numbers at both levels.
    #[inline(always)]
    unsafe fn load<const COUNTS: bool>(before: *const f64, now: *const f64, share: L) -> Self {
        // SAFETY: the caller's promise
        let (before, now) = unsafe { (L::load(before), L::load(now)) };
        let moved = if COUNTS { now - before } else { now };
        Self { before, now, both: scheme::combined(share, before, now), moved }
    }

    /// The two rows above a vector of row j, it, and the row below.
    ///
    /// # Safety
    ///
    /// As [`Combination::load`] for these rows.
    #[inline(always)]
    unsafe fn first_rows<const COUNTS: bool>(
        before: *const f64,
        now: *const f64,
        [a, b, d, ..]: Around,
        share: L,
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
struct Inside<L> {
    four: L,
    corner: L,
    moved: L,
}

impl<L: Lane> CornerSums<L> {
    /// Of a row from what stands in it and in the two rows above and below.
    #[inline(always)]
    fn of<const COUNTS: bool>([a, b, c, d, e]: [Combination<L>; 5]) -> Self {
        Self {
            axial: (b.now + d.now) - c.before,
            four: scheme::quadruple_mean(b.now, c.now, d.now),
            corner: scheme::corner_axial(a.both, c.both, e.both),
            moved: if COUNTS { scheme::corner_axial(a.moved, c.moved, e.moved) } else { c.now },
        }
    }

    /// Of `N` rows from row j on, in the vector at column `i`.
    ///
    /// * `levels`: column 0 of row j at levels k−1 and k
    /// * `around`: row j
    ///
    /// # Safety
    ///
    /// The machine has the instructions of `L`; the lanes are numbers in these rows and two above and below.
    #[inline(always)]
    #[expect(unsafe_code, reason = "a field that threads share")]
    unsafe fn load<const N: usize, const COUNTS: bool>(
        levels: [*const f64; 2],
        around: Around,
        i: isize,
        share: L,
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
    #[inline(always)]
    fn inside<const COUNTS: bool>(&self, here: &Self) -> Inside<L> {
        Inside {
            four: L::seam(self.four, here.four).1,
            corner: L::wide_seam(self.corner, here.corner).1,
            moved: if COUNTS { L::wide_seam(self.moved, here.moved).1 } else { here.four },
        }
    }

    /// The vector of nodes at level k+1, [`scheme::advanced`] with the correction, and what damping adds to them, `−C(u^k − u^{k−1})` up to a
    /// factor, if energy is counted. `inside` goes on to the next vector.
    ///
    /// * `radial`, `corner`: weights of the scheme and of the correction
    #[inline(always)]
    fn advanced<const COUNTS: bool>(
        &self,
        inside: &mut Inside<L>,
        after: &Self,
        radial: RadialWeights<L>,
        corner: RadialWeights<L>,
    ) -> [L; 2] {
        let (outside, next_four) = L::seam(self.four, after.four);
        let later = scheme::add_radial(self.axial, [inside.four, self.four, outside], radial);
        let (outside, next_corner) = L::wide_seam(self.corner, after.corner);
        let later = scheme::add_radial(later, [inside.corner, self.corner, outside], corner);
        let inner = std::mem::replace(&mut inside.moved, self.moved);
        (inside.four, inside.corner) = (next_four, next_corner);
        if !COUNTS {
            return [later; 2];
        }
        let (outside, next_moved) = L::wide_seam(self.moved, after.moved);
        inside.moved = next_moved;
        [later, scheme::double_radial([inner, self.moved, outside], corner)]
    }
}

/// Advances `N` rows from row `j` on with the mixed-derivative correction, vector by vector outwards.
///
/// # Safety
///
/// As [`super::kernel::Advance::new`] for these rows; if `COUNTS`, there is an area for every column and a sum for every row.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn corner_march<L: Lane, const N: usize, const COUNTS: bool>(
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
        let share = L::load(patch.now.add(j * stride + columns.start)).splat(corner.share);
        let levels = [patch.before.add(j * stride), patch.now.add(j * stride)];
        let next = patch.next.add(j * stride);
        let (mut i, width) = (columns.start, L::WIDTH as isize);
        let before = CornerSums::<L>::load::<N, COUNTS>(levels, around, i as isize - width, share);
        let mut here = CornerSums::<L>::load::<N, COUNTS>(levels, around, i as isize, share);
        let mut inside = [Inside { four: share, corner: share, moved: share }; N];
        for row in 0..N {
            inside[row] = before[row].inside::<COUNTS>(&here[row]);
        }
        while i < columns.end {
            let radial = patch.radial.at(i);
            let damped = corner.radial.at(i);
            let ahead = i + L::WIDTH;
            let (before, now) = (levels[0].add(ahead), levels[1].add(ahead));
            let [mut a, mut b, mut c, mut d] = Combination::first_rows::<COUNTS>(before, now, around, share);
            for row in 0..N {
                let below = around[3 + row];
                let e = Combination::load::<COUNTS>(before.offset(below), now.offset(below), share);
                let after = CornerSums::of::<COUNTS>([a, b, c, d, e]);
                (a, b, c, d) = (b, c, d, e);
                let [later, damped] = here[row].advanced::<COUNTS>(&mut inside[row], &after, radial, damped);
                let node = i + row * stride;
                later.store(next.add(node));
                if COUNTS {
                    let (before, middle) = (L::load(levels[0].add(node)), L::load(levels[1].add(node)));
                    let area = L::load(area.as_ptr().add(i));
                    // what damping takes is not strain
                    let force = ((later - middle) - (middle - before)).sub_product(share, damped);
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

#[expect(unsafe_code, reason = "a field that threads share")]
impl RingRow {
    /// Makes the combinations of the vector at column `i` two rows below.
    ///
    /// # Safety
    ///
    /// As [`CornerSums::load`]; the ring has room.
    #[inline(always)]
    unsafe fn combine<L: Lane>(&self, i: isize, share: L) -> L {
        let below = i + 2 * self.stride;
        // SAFETY: the caller's promise
        unsafe {
            let (before, now) =
                (L::load(self.levels[0].offset(below)), L::load(self.levels[1].offset(below)));
            let both = scheme::combined(share, before, now);
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
    unsafe fn sums<L: Lane>(&self, i: isize, share: L) -> CornerSums<L> {
        // SAFETY: the caller's promise
        unsafe {
            let e = self.combine(i, share);
            let now = self.levels[1].offset(i);
            let (above, here, below) =
                (L::load(now.offset(-self.stride)), L::load(now), L::load(now.offset(self.stride)));
            CornerSums {
                axial: (above + below) - L::load(self.levels[0].offset(i)),
                four: scheme::quadruple_mean(above, here, below),
                corner: scheme::corner_axial(
                    L::load(self.ring[0].offset(i)),
                    L::load(self.ring[2].offset(i)),
                    e,
                ),
                moved: here,
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
/// As [`super::kernel::Advance::new`].
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn ring_march<L: Lane>(
    patch: Patch<'_>,
    corner: CornerTerm<'_>,
    rows: Range<usize>,
    columns: Range<usize>,
) {
    assert!(columns.len() <= PIECE, "{} columns of a ring of {PIECE}", columns.len());
    let mut ring = Ring([[MaybeUninit::uninit(); PIECE + 2 * BLOCK]; RING]);
    let (width, length) = (L::WIDTH as isize, columns.len() as isize);
    // SAFETY, here and below: as for `corner_march`; the ring has a block on either side of a piece
    unsafe {
        let first = rows.start * patch.stride + columns.start;
        let share = L::load(patch.now.add(first)).splat(corner.share);
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
                row.combine::<L>(i, share);
                i += width;
            }
            row.step();
        }
        for _ in rows {
            let before = row.sums::<L>(-width, share);
            let mut here = row.sums(0, share);
            let mut inside = before.inside::<false>(&here);
            let mut i = 0;
            while i < length {
                let column = columns.start + i as usize;
                let after = row.sums(i + width, share);
                let weights = [patch.radial.at(column), corner.radial.at(column)];
                let [later, _] = here.advanced::<false>(&mut inside, &after, weights[0], weights[1]);
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
        *free = scheme::add_radial(*free, [axial[i], axial[i + 2], axial[i + 4]], corner.radial.column(i));
    }
}
