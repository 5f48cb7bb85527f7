//! Rows of nodes with the mixed-derivative correction of the scheme: [`super::kernel`] reaching two rows and columns.
//!
//! The operations are those of [`crate::model::scheme`] in the same order, so the bits are the same.

use std::ops::Range;

use super::{
    energy::EnergySum,
    levels::{Around, CornerTerm, Patch},
    vector::Vector,
};
use crate::model::scheme;

/// What the mixed-derivative correction needs of a vector of a row: sums over z.
#[derive(Clone, Copy)]
struct CornerSums<V> {
    /// `u_{j−1} + u_{j+1}` at level k.
    ends: V,
    /// `4·U` at level k.
    four: V,
    /// `16·E_z d` of the combination of levels.
    axial: V,
    /// `16·E_z` of `u^k − u^{k−1}`, if energy is counted.
    moved: V,
}

/// A vector of a row at both levels: u^k, the combination `u^k − ρ·u^{k−1}` and, if energy is counted, `u^k − u^{k−1}`.
#[derive(Clone, Copy)]
struct Combination<V> {
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
            Self { now, both: now.sub(share.mul(before)), moved }
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

impl<V: Vector> CornerSums<V> {
    /// Of a row from what stands in it and in the two rows above and below.
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    unsafe fn of<const COUNTS: bool>(rows: [Combination<V>; 5]) -> Self {
        let [a, b, c, d, e] = rows;
        // SAFETY: the caller's promise
        unsafe {
            let ends = b.now.add(d.now);
            Self {
                ends,
                four: ends.add_twice(c.now),
                axial: c.both.twice_less(a.both.add(e.both)),
                moved: if COUNTS { c.moved.twice_less(a.moved.add(e.moved)) } else { ends },
            }
        }
    }

    /// Of `N` rows from row j on, in the vector before column `i`.
    ///
    /// * `levels`: column 0 of row j at levels k−1 and k
    /// * `around`: row j
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; the vector is one of numbers in these rows and two above and below.
    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    unsafe fn load<const N: usize, const COUNTS: bool>(
        levels: [*const f64; 2],
        around: Around,
        i: usize,
        share: V,
    ) -> [Self; N] {
        // SAFETY: rows j − 2 to j + N + 1, or those around row j, are numbers there
        unsafe {
            let (before, now) = (levels[0].add(i).sub(V::WIDTH), levels[1].add(i).sub(V::WIDTH));
            let [mut a, mut b, mut c, mut d] = Combination::first_rows::<COUNTS>(before, now, around, share);
            let mut sums = [Self { ends: share, four: share, axial: share, moved: share }; N];
            for (row, sum) in sums.iter_mut().enumerate() {
                let below = around[3 + row];
                let e = Combination::load::<COUNTS>(before.offset(below), now.offset(below), share);
                *sum = Self::of::<COUNTS>([a, b, c, d, e]);
                (a, b, c, d) = (b, c, d, e);
            }
            sums
        }
    }

    /// Differences of `4·U` to the next column, and of the sums of the mixed-derivative correction to the second next, in the vector before
    /// `after`.
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    unsafe fn slopes<const COUNTS: bool>(self, after: Self) -> [V; 3] {
        // SAFETY: the caller's promise
        unsafe {
            let four = V::seam(self.four, after.four).0.sub(self.four);
            let axial = V::wide_seam(self.axial, after.axial).0.sub(self.axial);
            let moved = if COUNTS { V::wide_seam(self.moved, after.moved).0.sub(self.moved) } else { axial };
            [four, axial, moved]
        }
    }
}

/// Advances `N` rows from row `j` on with the mixed-derivative correction, vector by vector outwards: [`scheme::advanced`] and
/// [`scheme::double_radial`] on vectors.
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
    let Patch { before: earlier, now, next, stride, outward, inward, .. } = patch;
    // SAFETY, here and below: the nodes of the patch, two rows around them and a vector on either side are numbers at levels
    // k−1 and k, and those of the patch at level k+1 belong to this call alone; the machine has the instructions
    unsafe {
        let share = V::splat(corner.share);
        let levels = [earlier.add(j * stride), now.add(j * stride)];
        let next = next.add(j * stride);
        let before = CornerSums::<V>::load::<N, COUNTS>(levels, around, columns.start, share);
        let mut here = CornerSums::<V>::load::<N, COUNTS>(levels, around, columns.start + V::WIDTH, share);
        // slopes in the vector before
        let mut inner = [[share; 3]; N];
        for row in 0..N {
            inner[row] = before[row].slopes::<COUNTS>(here[row]);
        }
        let mut i = columns.start;
        while i < columns.end {
            let (out, inw) = (V::load(outward.as_ptr().add(i)), V::load(inward.as_ptr().add(i)));
            let corner_out = V::load(corner.outward.as_ptr().add(i));
            let corner_in = V::load(corner.inward.as_ptr().add(i));
            let ahead = i + V::WIDTH;
            let (before, now) = (levels[0].add(ahead), levels[1].add(ahead));
            let [mut a, mut b, mut c, mut d] = Combination::first_rows::<COUNTS>(before, now, around, share);
            let (mut old, mut new) = (levels[0].add(i), next.add(i));
            for row in 0..N {
                let below = around[3 + row];
                let e = Combination::load::<COUNTS>(before.offset(below), now.offset(below), share);
                let after = CornerSums::of::<COUNTS>([a, b, c, d, e]);
                (a, b, c, d) = (b, c, d, e);
                let sums = here[row];
                let slopes = sums.slopes::<COUNTS>(after);
                let radial = out.mul(slopes[0]).sub(inw.mul(V::seam(inner[row][0], slopes[0]).1));
                let added =
                    corner_out.mul(slopes[1]).sub(corner_in.mul(V::wide_seam(inner[row][1], slopes[1]).1));
                let before = V::load(old);
                let later = sums.ends.sub(before).add(radial).add(added);
                later.store(new);
                if COUNTS {
                    let damped = corner_out
                        .mul(slopes[2])
                        .sub(corner_in.mul(V::wide_seam(inner[row][2], slopes[2]).1));
                    let middle = V::load(levels[1].add(i + row * stride));
                    let area = V::load(area.as_ptr().add(i));
                    // what damping takes is not strain
                    let force = later.sub(middle).sub(middle.sub(before)).sub(share.mul(damped));
                    energies.get_unchecked_mut(row).add(i, area, [before, middle, later], force);
                }
                inner[row] = slopes;
                here[row] = after;
                (old, new) = (old.add(stride), new.add(stride));
            }
            i += V::WIDTH;
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
    axial.extend([0.0; 2]);
    axial.extend((0..n + 2).map(|i| {
        let [top, below] = [0, 1].map(|row| now[row][i] - share * before[row][i]);
        scheme::corner_axial(below, top, below)
    }));
    // the images about the axis
    (axial[0], axial[1]) = (axial[3], axial[2]);
    for (i, free) in free.iter_mut().enumerate() {
        *free += scheme::double_radial([axial[i], axial[i + 2], axial[i + 4]], corner.column(i));
    }
}
