//! Rows of nodes, advanced in place a vector at a time.
//!
//! The operations are those of [`crate::model::scheme`] in the same order, so the bits are the same.
//!
//! Fields are stored row by row, the nodes of one depth in the order of radii. A patch is advanced by marching outwards
//! with some rows side by side, a vector at a time: sums over z are shared by the rows and carried from vector to
//! vector, so every node is loaded once or twice and seven operations and some shuffles do an update.

use std::ops::Range;

use super::{
    corner::{PIECE, add_corner, corner_march, ring_march},
    energy::EnergySum,
    levels::{Around, CornerTerm, Patch, around},
    vector::{Vector, Work},
};
use crate::model::scheme::{self, RadialWeights};

/// Rows that are marched side by side: what two of them carry fits into 16 registers.
const ABREAST: usize = 2;

/// Advances `rows` of `columns`, whole vectors, and adds their energy to `energies` if `COUNTS` says so.
///
/// Always inlined, so that a caller compiled for wider vectors gets them here; which operations are fused and their order are
/// fixed, so the bits are those of any other caller.
///
/// * `area`: cell areas a_i, by column; none if nothing is counted
/// * `energies`: of `rows`; none if nothing is counted
///
/// # Safety
///
/// The machine must have the instructions of `V`. The nodes of the patch and their neighbours, one row above and below (those of
/// [`Patch::around`], if it says so) and one vector on either side, must be numbers that may be read at level k, with the mixed-derivative
/// correction two rows above and below at levels k−1 and k; the nodes of the patch must be numbers that may be read at level k−1 and written at level k+1, which no
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
    // SAFETY, of all below: the caller's promise
    let corner = match (patch.around, patch.corner) {
        (Some(around), _) => {
            assert!(rows.len() <= 2, "at most two rows by themselves");
            return unsafe { by_twos::<V, COUNTS>(patch, around, rows, columns, area, energies) };
        }
        // distances that compilers see in the loop over columns
        (None, None) => {
            let around = around(patch.stride);
            return unsafe { by_twos::<V, COUNTS>(patch, around, rows, columns, area, energies) };
        }
        (None, Some(corner)) => corner,
    };
    for start in columns.clone().step_by(PIECE) {
        let (rows, columns) = (rows.clone(), start..(start + PIECE).min(columns.end));
        if COUNTS || V::REGISTERS > 16 {
            unsafe { by_twos::<V, COUNTS>(patch, around(patch.stride), rows, columns, area, energies) };
        } else {
            unsafe { ring_march::<V>(patch, corner, rows, columns) };
        }
    }
}

/// [`advance`] two rows at a time.
///
/// # Safety
///
/// As that; what is around is only asked for by up to two rows, or where no face is near.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn by_twos<V: Vector, const COUNTS: bool>(
    patch: Patch<'_>,
    around: Around,
    rows: Range<usize>,
    columns: Range<usize>,
    area: &[f64],
    energies: &mut [EnergySum],
) {
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
            while let Some((j, sums)) = next_rows(ABREAST) {
                let (columns, sums) = (columns.clone(), &mut energies[sums]);
                corner_march::<V, ABREAST, COUNTS>(patch, corner, j, columns, around, area, sums);
            }
            while let Some((j, sums)) = next_rows(1) {
                let (columns, sums) = (columns.clone(), &mut energies[sums]);
                corner_march::<V, 1, COUNTS>(patch, corner, j, columns, around, area, sums);
            }
        } else {
            while let Some((j, sums)) = next_rows(ABREAST) {
                march::<V, ABREAST, COUNTS>(patch, j, columns.clone(), around, area, &mut energies[sums]);
            }
            while let Some((j, sums)) = next_rows(1) {
                march::<V, 1, COUNTS>(patch, j, columns.clone(), around, area, &mut energies[sums]);
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
/// * `around`: row j
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn axial_sums<V: Vector, const N: usize>(now: *const f64, around: Around, i: usize) -> [(V, V); N] {
    // SAFETY: rows j − 1 to j + N, or those around row j, are numbers there
    unsafe {
        let first = now.add(i).sub(V::WIDTH);
        let (mut above, mut here) = (V::load(first.offset(around[1])), V::load(first));
        let mut sums = [(above, here); N];
        for (row, sum) in sums.iter_mut().enumerate() {
            let below = V::load(first.offset(around[2 + row]));
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
    around: Around,
    area: &[f64],
    energies: &mut [EnergySum],
) {
    let Patch { before: earlier, now, next, stride, outward, inward, .. } = patch;
    // SAFETY, here and below: the nodes of the patch, a row around them and a vector on either side are numbers, of
    // which those of the patch at level `next` belong to this call alone; the machine has the instructions
    unsafe {
        let (earlier, now, next) = (earlier.add(j * stride), now.add(j * stride), next.add(j * stride));
        let before = axial_sums::<V, N>(now, around, columns.start);
        let mut here = axial_sums::<V, N>(now, around, columns.start + V::WIDTH);
        // 4·U one node inside
        let mut inside = [here[0].1; N];
        for row in 0..N {
            inside[row] = V::seam(before[row].1, here[row].1).1;
        }
        let mut i = columns.start;
        while i < columns.end {
            let after = axial_sums::<V, N>(now, around, i + 2 * V::WIDTH);
            let (out, inw) = (V::load(outward.as_ptr().add(i)), V::load(inward.as_ptr().add(i)));
            for row in 0..N {
                let (ends, four) = here[row];
                let (outside, next_inside) = V::seam(four, after[row].1);
                let node = i + row * stride;
                let before = V::load(earlier.add(node));
                let later = ends.sub(before).add_product(out, outside.sub(four));
                let later = later.sub_product(inw, four.sub(inside[row]));
                later.store(next.add(node));
                inside[row] = next_inside;
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

/// Surface nodes at level k+1 if they were free of stress: [`scheme::interior`] and [`scheme::axis`] with the image of
/// [`scheme::image_row`], column by column.
pub struct FreeSurface<'a> {
    /// u_0 at level k−1.
    pub before: &'a [f64],
    /// u_0 and u_1 at level k, one node more than `free`.
    pub now: [&'a [f64]; 2],
    /// Radial weights, outward and inward; that inward of the first node is 0.
    pub weights: [&'a [f64]; 2],
    /// The mixed-derivative correction, if there is one, with rows as [`add_corner`] reads them.
    pub corner: Option<(CornerTerm<'a>, [[&'a [f64]; 2]; 2])>,
    /// Room for sums over z.
    pub sums: &'a mut Vec<f64>,
    /// The result.
    pub free: &'a mut [f64],
}

impl Work for FreeSurface<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { before, now, weights, corner, sums, free } = self;
        let n = free.len();
        let [top, below] = now;
        sums.clear();
        // what stands inside the first node counts for nothing
        sums.resize(n + 2, 0.0);
        let (top, below) = (&top[..=n], &below[..=n]);
        for (i, sum) in sums[1..].iter_mut().enumerate() {
            *sum = scheme::quadruple_mean(below[i], top[i], below[i]);
        }
        let (inner, here, outer) = (&sums[..n], &sums[1..=n], &sums[2..n + 2]);
        let ([outward, inward], below, before) =
            (weights.map(|weights| &weights[..n]), &below[..n], &before[..n]);
        for i in 0..n {
            let weights = RadialWeights { outward: outward[i], inward: inward[i] };
            free[i] =
                scheme::advanced(below[i] + below[i], before[i], [inner[i], here[i], outer[i]], weights);
        }
        if let Some((corner, rows)) = corner {
            add_corner(rows, corner.share, corner, sums, free);
        }
    }
}
