//! Rows of nodes, advanced in place a vector at a time, and their energy sums.
//!
//! The operations are those of [`crate::model::scheme`] in the same order, so the bits are the same.
//!
//! Fields are stored row by row, the nodes of one depth in the order of radii. A patch is advanced by marching outwards
//! with some rows side by side, a vector at a time: sums over z are shared by the rows and carried from vector to
//! vector, so every node is loaded once or twice and nine operations do an update.

use std::ops::Range;

use super::vector::{BLOCK, Vector};
use crate::model::scheme::{self, RadialWeights};

/// Part of a field that is advanced in place.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// Node (0, 0) of level k−1.
    pub before: *const f64,
    /// Node (0, 0) of level k.
    pub now: *const f64,
    /// Node (0, 0) of level k+1, which is written; without the corner term it may be level k−1 itself.
    pub next: *mut f64,
    /// Distance from a node to the one below it, in numbers.
    pub stride: usize,
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub outward: &'a [f64],
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub inward: &'a [f64],
    /// The corner term, if there is one.
    pub corner: Option<CornerTerm<'a>>,
}

/// The corner term of the scheme, see [`scheme::Corner`].
#[derive(Clone, Copy)]
pub struct CornerTerm<'a> {
    /// ρ: share of level k−1 in the combination of levels.
    pub share: f64,
    /// Radial weights times α, by column, see [`scheme::corner_weights`].
    pub outward: &'a [f64],
    /// Radial weights times α, by column.
    pub inward: &'a [f64],
}

/// Rows that are marched side by side: what two of them carry fits into 16 registers.
const ABREAST: usize = 2;
/// The same with the corner term, whose sums over z reach two rows up and down.
const CORNER_ABREAST: usize = 2;

/// Advances `rows` of `columns`, whole vectors, and adds their energy to `energies` if `COUNTS` says so.
///
/// Always inlined, so that a caller compiled for wider vectors gets them here; no operation is fused and their order is
/// fixed, so the bits are those of any other caller.
///
/// * `area`: cell areas a_i, by column; none if nothing is counted
/// * `energies`: of `rows`; none if nothing is counted
///
/// # Safety
///
/// The machine must have the instructions of `V`. The nodes of the patch and their neighbours, one row above and below
/// and one vector on either side, must be numbers that may be read at level k, with the corner term two rows above and below
/// at levels k−1 and k; the nodes of the patch must be numbers that may be read at level k−1 and written at level k+1, which no
/// other thread may touch meanwhile.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn advance<V: Vector, const COUNTS: bool>(
    patch: Patch<'_>,
    rows: Range<usize>,
    columns: Range<usize>,
    area: &[f64],
    energies: &mut [EnergySum],
) {
    assert!(columns.end <= patch.outward.len() && columns.end <= patch.inward.len());
    assert!(
        columns.start.is_multiple_of(V::WIDTH) && columns.len().is_multiple_of(V::WIDTH),
        "whole vectors"
    );
    assert!(
        !COUNTS || (columns.end <= area.len() && rows.len() == energies.len()),
        "an energy for every row"
    );
    if let Some(corner) = &patch.corner {
        assert!(columns.end <= corner.outward.len() && columns.end <= corner.inward.len());
    }
    let mut rows_left = rows.clone();
    let mut next_rows = |abreast: usize| {
        let j = rows_left.start;
        (j + abreast <= rows_left.end).then(|| {
            rows_left.start += abreast;
            let energies = if COUNTS { j - rows.start..j - rows.start + abreast } else { 0..0 };
            (j, energies)
        })
    };
    // SAFETY, of all below: the rows belong to the patch; areas, weights and energies have been checked
    unsafe {
        if let Some(corner) = patch.corner {
            while let Some((j, sums)) = next_rows(CORNER_ABREAST) {
                let energies = &mut energies[sums];
                corner_march::<V, CORNER_ABREAST, COUNTS>(patch, corner, j, columns.clone(), area, energies);
            }
            while let Some((j, sums)) = next_rows(1) {
                corner_march::<V, 1, COUNTS>(patch, corner, j, columns.clone(), area, &mut energies[sums]);
            }
        } else {
            while let Some((j, sums)) = next_rows(ABREAST) {
                march::<V, ABREAST, COUNTS>(patch, j, columns.clone(), area, &mut energies[sums]);
            }
            while let Some((j, sums)) = next_rows(1) {
                march::<V, 1, COUNTS>(patch, j, columns.clone(), area, &mut energies[sums]);
            }
        }
    }
}

/// Sums `u_{j−1} + u_{j+1}` and `4·U` of `N` rows from row j on, in the vector before column `i`.
///
/// A function, because closures are not inlined for certain into one that is compiled for wider vectors.
///
/// # Safety
///
/// The machine must have the instructions of `V`; the vector is one of numbers in these rows, the one above and the one
/// below.
///
/// * `now`: column 0 of row j
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn axial_sums<V: Vector, const N: usize>(now: *const f64, stride: usize, i: usize) -> [(V, V); N] {
    // SAFETY: rows j − 1 to j + N are numbers there
    unsafe {
        let first = now.add(i).sub(V::WIDTH + stride);
        let (mut above, mut here) = (V::load(first), V::load(first.add(stride)));
        let mut sums = [(above, here); N];
        for (row, sum) in sums.iter_mut().enumerate() {
            let below = V::load(first.add((row + 2) * stride));
            let ends = above.add(below);
            *sum = (ends, ends.add_twice(here));
            (above, here) = (here, below);
        }
        sums
    }
}

/// Advances `N` rows from row `j` on, vector by vector outwards: [`scheme::advanced`] on vectors.
///
/// # Safety
///
/// As [`advance`] for these rows; if `COUNTS`, there is an area for every column and a sum for every row.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn march<V: Vector, const N: usize, const COUNTS: bool>(
    patch: Patch<'_>,
    j: usize,
    columns: Range<usize>,
    area: &[f64],
    energies: &mut [EnergySum],
) {
    let Patch { before: earlier, now, next, stride, outward, inward, corner: _ } = patch;
    // SAFETY, here and below: the nodes of the patch, a row around them and a vector on either side are numbers, of
    // which those of the patch at level `next` belong to this call alone; the machine has the instructions
    unsafe {
        let (earlier, now, next) = (earlier.add(j * stride), now.add(j * stride), next.add(j * stride));
        let before = axial_sums::<V, N>(now, stride, columns.start);
        let mut here = axial_sums::<V, N>(now, stride, columns.start + V::WIDTH);
        // differences of 4·U to the next column, in the vector before
        let mut inner = [here[0].1; N];
        for row in 0..N {
            inner[row] = V::seam(before[row].1, here[row].1).0.sub(before[row].1);
        }
        let mut i = columns.start;
        while i < columns.end {
            let after = axial_sums::<V, N>(now, stride, i + 2 * V::WIDTH);
            let (out, inw) = (V::load(outward.as_ptr().add(i)), V::load(inward.as_ptr().add(i)));
            for row in 0..N {
                let (ends, four) = here[row];
                let slope = V::seam(four, after[row].1).0.sub(four);
                let node = i + row * stride;
                let before = V::load(earlier.add(node));
                let axial = ends.sub(before);
                let radial = out.mul(slope).sub(inw.mul(V::seam(inner[row], slope).1));
                let later = axial.add(radial);
                later.store(next.add(node));
                inner[row] = slope;
                if COUNTS {
                    let middle = V::load(now.add(node));
                    let area = V::load(area.as_ptr().add(i));
                    let force = later.sub(middle).sub(middle.sub(before));
                    energies.get_unchecked_mut(row).add(i, area, [before, middle, later], force);
                }
            }
            here = after;
            i += V::WIDTH;
        }
    }
}

/// What the corner term needs of a vector of a row: sums over z.
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
}

impl<V: Vector> Combination<V> {
    /// Rows j − 2 to j + 1, of a vector of row j.
    ///
    /// # Safety
    ///
    /// As [`Combination::load`] for these rows.
    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    unsafe fn first_rows<const COUNTS: bool>(
        before: *const f64,
        now: *const f64,
        stride: usize,
        share: V,
    ) -> [Self; 4] {
        // SAFETY: the caller's promise
        unsafe {
            let (before, now) = (before.sub(2 * stride), now.sub(2 * stride));
            [
                Self::load::<COUNTS>(before, now, share),
                Self::load::<COUNTS>(before.add(stride), now.add(stride), share),
                Self::load::<COUNTS>(before.add(2 * stride), now.add(2 * stride), share),
                Self::load::<COUNTS>(before.add(3 * stride), now.add(3 * stride), share),
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
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`; the vector is one of numbers in these rows and two above and below.
    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    unsafe fn load<const N: usize, const COUNTS: bool>(
        levels: [*const f64; 2],
        stride: usize,
        i: usize,
        share: V,
    ) -> [Self; N] {
        // SAFETY: rows j − 2 to j + N + 1 are numbers there
        unsafe {
            let (before, now) = (levels[0].add(i).sub(V::WIDTH), levels[1].add(i).sub(V::WIDTH));
            let [mut a, mut b, mut c, mut d] = Combination::first_rows::<COUNTS>(before, now, stride, share);
            let mut sums = [Self { ends: share, four: share, axial: share, moved: share }; N];
            for (row, sum) in sums.iter_mut().enumerate() {
                let below = (row + 2) * stride;
                let e = Combination::load::<COUNTS>(before.add(below), now.add(below), share);
                *sum = Self::of::<COUNTS>([a, b, c, d, e]);
                (a, b, c, d) = (b, c, d, e);
            }
            sums
        }
    }

    /// Differences of `4·U` to the next column, and of the sums of the corner term to the second next, in the vector before
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

/// Advances `N` rows from row `j` on with the corner term, vector by vector outwards: [`scheme::advanced`] and
/// [`scheme::corner_radial`] on vectors.
///
/// # Safety
///
/// As [`advance`] for these rows; if `COUNTS`, there is an area for every column and a sum for every row.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn corner_march<V: Vector, const N: usize, const COUNTS: bool>(
    patch: Patch<'_>,
    corner: CornerTerm<'_>,
    j: usize,
    columns: Range<usize>,
    area: &[f64],
    energies: &mut [EnergySum],
) {
    let Patch { before: earlier, now, next, stride, outward, inward, corner: _ } = patch;
    // SAFETY, here and below: the nodes of the patch, two rows around them and a vector on either side are numbers at levels
    // k−1 and k, and those of the patch at level k+1 belong to this call alone; the machine has the instructions
    unsafe {
        let share = V::splat(corner.share);
        let levels = [earlier.add(j * stride), now.add(j * stride)];
        let next = next.add(j * stride);
        let before = CornerSums::<V>::load::<N, COUNTS>(levels, stride, columns.start, share);
        let mut here = CornerSums::<V>::load::<N, COUNTS>(levels, stride, columns.start + V::WIDTH, share);
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
            let [mut a, mut b, mut c, mut d] = Combination::first_rows::<COUNTS>(before, now, stride, share);
            let (mut old, mut new) = (levels[0].add(i), next.add(i));
            for row in 0..N {
                let below = (row + 2) * stride;
                let e = Combination::load::<COUNTS>(before.add(below), now.add(below), share);
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

/// Adds the corner term to surface nodes at level k+1: [`scheme::corner`] with the images of [`scheme::image_row`] and
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
        let weights = RadialWeights { outward: corner.outward[i], inward: corner.inward[i] };
        *free += scheme::corner_radial([axial[i], axial[i + 2], axial[i + 4]], weights);
    }
}

/// Surface nodes at level k+1 if they were free of stress: [`scheme::interior`] and [`scheme::axis`] with the image of
/// [`scheme::image_row`], column by column.
///
/// * `before`: u_0 at level k−1
/// * `top`, `below`: u_0 and u_1 at level k, one node more than `free`
/// * `weights`: radial weights, outward and inward; that inward of the first node is 0
/// * `means`: room for means over z
/// * `free`: the result
pub fn free_surface(
    before: &[f64],
    top: &[f64],
    below: &[f64],
    weights: [&[f64]; 2],
    means: &mut Vec<f64>,
    free: &mut [f64],
) {
    let n = free.len();
    means.clear();
    // what stands inside the first node counts for nothing
    means.push(0.0);
    let columns = top[..=n].iter().zip(&below[..=n]);
    means.extend(columns.map(|(top, below)| scheme::quadruple_mean(*below, *top, *below)));
    let (inner, here, outer) = (&means[..n], &means[1..=n], &means[2..n + 2]);
    let ([outward, inward], below, before) =
        (weights.map(|weights| &weights[..n]), &below[..n], &before[..n]);
    for i in 0..n {
        let weights = RadialWeights { outward: outward[i], inward: inward[i] };
        free[i] = scheme::advanced(below[i] + below[i], before[i], [inner[i], here[i], outer[i]], weights);
    }
}

/// Energy of a row as the leapfrog scheme conserves it, each up to a factor of the mesh: between levels k−1 and k, and
/// between levels k and k+1.
///
/// Strain energy between two levels is a product of strains at both. Summed by parts over the whole field it is the work of
/// the forces at level k on the displacement at the other level, and forces are what accelerates, but for damping,
/// `f^k = u^{k+1} − 2u^k + u^{k−1} + σC(u^k − u^{k−1})`: no row needs another one, and nothing is assumed about the balance of
/// energies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowEnergy {
    /// `Σ_i a_i (u^k − u^{k−1})²` and `Σ_i a_i (u^{k+1} − u^k)²`
    pub kinetic: [f64; 2],
    /// `−Σ_i a_i u^{k−1} f^k` and `−Σ_i a_i u^{k+1} f^k`
    pub strain: [f64; 2],
}

/// A sum over columns in [`BLOCK`] interleaved sums: column i adds to sum `i mod BLOCK`. So it is the same with any
/// instructions, and however the columns are cut.
type Interleaved = [f64; BLOCK];

/// A [`RowEnergy`] that is being summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergySum {
    /// Kinetic energies, strain energies but for their sign.
    sums: [Interleaved; 4],
}

impl EnergySum {
    /// Adds a vector of columns from number `i` on, a whole number of vectors.
    ///
    /// * `area`: cell areas
    /// * `levels`: u^{k−1}, u^k, u^{k+1}
    /// * `force`: f^k
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    unsafe fn add<V: Vector>(&mut self, i: usize, area: V, levels: [V; 3], force: V) {
        let [before, now, next] = levels;
        // SAFETY: a vector from a multiple of WIDTH below BLOCK on lies within BLOCK numbers
        unsafe {
            let (moved, next_moved) = (now.sub(before), next.sub(now));
            let terms = [moved.mul(moved), next_moved.mul(next_moved), before.mul(force), next.mul(force)];
            for (sum, term) in self.sums.iter_mut().zip(terms) {
                let place = sum.as_mut_ptr().add(i % BLOCK);
                V::load(place).add(area.mul(term)).store(place);
            }
        }
    }

    /// The energy of the surface. What the contact does to it is not strain, so forces are those on a free surface.
    ///
    /// * `area`: cell areas
    /// * `levels`: u_0 at levels k−1, k, k+1, as many nodes
    /// * `free`: u_0 at level k+1 without contact and damping, see [`free_surface`]
    pub fn of_surface(area: &[f64], levels: [&[f64]; 3], free: &[f64]) -> Self {
        let [before, now, next] = levels;
        let mut energy = Self::default();
        for i in 0..next.len() {
            let (moved, next_moved) = (now[i] - before[i], next[i] - now[i]);
            let force = (free[i] - now[i]) - moved;
            let terms = [moved * moved, next_moved * next_moved, before[i] * force, next[i] * force];
            for (sum, term) in energy.sums.iter_mut().zip(terms) {
                sum[i % BLOCK] += area[i] * term;
            }
        }
        energy
    }

    /// The sums.
    pub fn total(&self) -> RowEnergy {
        let [before, after, strain_before, strain_after] = self.sums.map(|sums| sums.iter().sum::<f64>());
        RowEnergy { kinetic: [before, after], strain: [-strain_before, -strain_after] }
    }
}
