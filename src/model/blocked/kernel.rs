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
    dispatch::Work,
    energy::EnergySum,
    lane::{BLOCK, Lane},
    levels::{Around, CornerTerm, Patch, Radial, around},
};
use crate::model::scheme;

/// Rows that are marched side by side: what two of them carry fits into 16 registers.
const ABREAST: usize = 2;

/// Advances rows of `columns`, whole vectors, and adds their energy to `energies` if `COUNTS` says so.
pub struct Advance<'a, const COUNTS: bool> {
    patch: Patch<'a>,
    rows: Range<usize>,
    columns: Range<usize>,
    area: &'a [f64],
    energies: &'a mut [EnergySum],
}

impl<'a, const COUNTS: bool> Advance<'a, COUNTS> {
    /// * `area`: cell areas a_i, by column; none if nothing is counted
    /// * `energies`: of `rows`; none if nothing is counted
    ///
    /// # Safety
    ///
    /// The nodes of the patch and their neighbours, one row above and below (those of [`Patch::around`], if it says so) and one vector on
    /// either side, must be numbers that may be read at level k, with the mixed-derivative correction two rows above and below at levels
    /// k−1 and k; the nodes of the patch must be numbers that may be read at level k−1 and written at level k+1, which no other thread may
    /// touch until the work is done.
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    pub unsafe fn new(
        patch: Patch<'a>,
        rows: Range<usize>,
        columns: Range<usize>,
        area: &'a [f64],
        energies: &'a mut [EnergySum],
    ) -> Self {
        assert!(patch.radial.has(&columns) && patch.corner.is_none_or(|corner| corner.radial.has(&columns)));
        assert!(
            !COUNTS || (columns.end <= area.len() && rows.len() == energies.len()),
            "an energy for every row"
        );
        assert!(patch.around.is_none() || rows.len() <= 2, "at most two rows by themselves");
        Self { patch, rows, columns, area, energies }
    }

    /// The rows, two at a time.
    ///
    /// # Safety
    ///
    /// The machine has the instructions of `L`; `columns` are among those of the work.
    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    unsafe fn by_twos<L: Lane>(&mut self, around: Around, columns: &Range<usize>) {
        let mut j = self.rows.start;
        while j < self.rows.end {
            // SAFETY: the promise of `new` and the caller's
            unsafe {
                if self.rows.end - j >= ABREAST {
                    self.march::<L, ABREAST>(j, around, columns.clone());
                    j += ABREAST;
                } else {
                    self.march::<L, 1>(j, around, columns.clone());
                    j += 1;
                }
            }
        }
    }

    /// `N` rows from row `j` on.
    ///
    /// # Safety
    ///
    /// As [`Advance::by_twos`].
    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    unsafe fn march<L: Lane, const N: usize>(&mut self, j: usize, around: Around, columns: Range<usize>) {
        let first = j - self.rows.start;
        let energies = if COUNTS { &mut self.energies[first..first + N] } else { &mut [] };
        // SAFETY: the caller's promise; areas, weights and energies have been checked
        unsafe {
            match self.patch.corner {
                Some(corner) => {
                    corner_march::<L, N, COUNTS>(self.patch, corner, j, columns, around, self.area, energies);
                }
                None => march::<L, N, COUNTS>(self.patch, j, columns, around, self.area, energies),
            }
        }
    }
}

impl<const COUNTS: bool> Work for Advance<'_, COUNTS> {
    type Output = ();

    #[inline(always)]
    #[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
    fn run<L: Lane>(mut self, _: L) {
        let columns = self.columns.clone();
        assert!(
            columns.start.is_multiple_of(L::WIDTH) && columns.len().is_multiple_of(L::WIDTH),
            "whole vectors"
        );
        // where no face is near, distances that compilers see in the loop over columns
        let near = around(self.patch.stride);
        // SAFETY, of all below: the machine has the instructions; the pieces are of the columns
        match (self.patch.around, self.patch.corner) {
            (Some(around), _) => unsafe { self.by_twos::<L>(around, &columns) },
            (None, None) => unsafe { self.by_twos::<L>(near, &columns) },
            (None, Some(corner)) => {
                let mut start = columns.start;
                while start < columns.end {
                    let end = (start + PIECE).min(columns.end);
                    // the widest lanes have 32 registers, which is room for two rows
                    if COUNTS || L::WIDTH == BLOCK {
                        unsafe { self.by_twos::<L>(near, &(start..end)) };
                    } else {
                        unsafe { ring_march::<L>(self.patch, corner, self.rows.clone(), start..end) };
                    }
                    start = end;
                }
            }
        }
    }
}

/// Sums `u_{j−1} + u_{j+1}` and `4·U` of `N` rows from row j on, in the vector before column `i`.
///
/// * `now`: column 0 of row j
/// * `around`: row j
///
/// # Safety
///
/// The machine has the instructions of `L`; the lanes are numbers in these rows, the one above and the one below.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn axial_sums<L: Lane, const N: usize>(now: *const f64, around: Around, i: usize) -> [(L, L); N] {
    // SAFETY: rows j − 1 to j + N, or those around row j, are numbers there
    unsafe {
        let first = now.add(i).sub(L::WIDTH);
        let (mut above, mut here) = (L::load(first.offset(around[1])), L::load(first));
        let mut sums = [(above, here); N];
        for (row, sum) in sums.iter_mut().enumerate() {
            let below = L::load(first.offset(around[2 + row]));
            *sum = (above + below, scheme::quadruple_mean(above, here, below));
            (above, here) = (here, below);
        }
        sums
    }
}

/// Advances `N` rows from row `j` on, vector by vector outwards: [`scheme::advanced`] on lanes.
///
/// # Safety
///
/// As [`Advance::new`] for these rows; if `COUNTS`, there is an area for every column and a sum for every row.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn march<L: Lane, const N: usize, const COUNTS: bool>(
    patch: Patch<'_>,
    j: usize,
    columns: Range<usize>,
    around: Around,
    area: &[f64],
    energies: &mut [EnergySum],
) {
    let Patch { before: earlier, now, next, stride, radial, .. } = patch;
    // SAFETY, here and below: the nodes of the patch, a row around them and a vector on either side are numbers, of
    // which those of the patch at level `next` belong to this call alone; the machine has the instructions
    unsafe {
        let (earlier, now, next) = (earlier.add(j * stride), now.add(j * stride), next.add(j * stride));
        let before = axial_sums::<L, N>(now, around, columns.start);
        let mut here = axial_sums::<L, N>(now, around, columns.start + L::WIDTH);
        // 4·U one node inside
        let mut inside = [here[0].1; N];
        for row in 0..N {
            inside[row] = L::seam(before[row].1, here[row].1).1;
        }
        let mut i = columns.start;
        while i < columns.end {
            let after = axial_sums::<L, N>(now, around, i + 2 * L::WIDTH);
            let weights = radial.at(i);
            for row in 0..N {
                let (ends, four) = here[row];
                let (outside, next_inside) = L::seam(four, after[row].1);
                let node = i + row * stride;
                let before = L::load(earlier.add(node));
                let later = scheme::advanced(ends, before, [inside[row], four, outside], weights);
                later.store(next.add(node));
                inside[row] = next_inside;
                if COUNTS {
                    let middle = L::load(now.add(node));
                    let area = L::load(area.as_ptr().add(i));
                    let force = (later - middle) - (middle - before);
                    energies.get_unchecked_mut(row).add(i, area, [before, middle, later], force);
                }
            }
            here = after;
            i += L::WIDTH;
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
    /// Radial weights; that inward of the first node is 0.
    pub radial: Radial<'a>,
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
    fn run<L: Lane>(self, _: L) {
        let Self { before, now, radial, corner, sums, free } = self;
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
        let Radial { outward, inward } = radial;
        let radial = Radial { outward: &outward[..n], inward: &inward[..n] };
        let (below, before) = (&below[..n], &before[..n]);
        for i in 0..n {
            let means = [inner[i], here[i], outer[i]];
            free[i] = scheme::advanced(below[i] + below[i], before[i], means, radial.column(i));
        }
        if let Some((corner, rows)) = corner {
            add_corner(rows, corner.share, corner, sums, free);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::{dispatch::Instructions, energy::RowEnergy},
        *,
    };

    #[test]
    fn the_energy_of_a_row_is_the_plain_sum_with_any_instructions_and_cuts() {
        let columns = 9 * BLOCK;
        let stride = columns + 2 * BLOCK;
        let noise = |seed: usize, length: usize| -> Vec<f64> {
            (0..length).map(|i| ((i * 7 + seed * 13) % 31) as f64 / 31.0 - 0.4).collect()
        };
        // two rows abreast and one alone, with a row and a block around them
        let [before, now] = [0, 1].map(|seed| noise(seed, 5 * stride));
        let [outward, inward, area] = [2, 3, 4].map(|seed| noise(seed, columns));
        let advanced = |instructions: Instructions, cuts: &[usize]| {
            let (mut next, mut sums) = (before.clone(), [EnergySum::default(); 3]);
            let (read, write) = (now[BLOCK..].as_ptr(), next[BLOCK..].as_mut_ptr());
            let patch = Patch {
                before: write,
                now: read,
                next: write,
                stride,
                around: None,
                radial: Radial { outward: &outward, inward: &inward },
                corner: None,
            };
            for cut in cuts.windows(2) {
                // SAFETY: a row and a block are left on all sides
                #[expect(unsafe_code, reason = "the function under test")]
                let work = unsafe { Advance::<true>::new(patch, 1..4, cut[0]..cut[1], &area, &mut sums) };
                instructions.run(work);
            }
            (next, sums.map(|sum| sum.total()))
        };
        let baseline = advanced(Instructions::BASELINE, &[0, columns]);
        let (next, energies) = &baseline;
        for (j, energy) in (1..).zip(energies) {
            let row = |level: &[f64]| level[j * stride + BLOCK..][..columns].to_vec();
            let [before, now, next] = [&before, &now, next].map(|level| row(level));
            let mut plain = RowEnergy::default();
            for i in 0..columns {
                let force = next[i] - 2.0 * now[i] + before[i];
                let moved = [now[i] - before[i], next[i] - now[i]];
                for (place, ends) in [before[i], next[i]].into_iter().enumerate() {
                    plain.kinetic[place] += area[i] * moved[place].powi(2);
                    plain.strain[place] -= area[i] * ends * force;
                }
            }
            let numbers = |energy: &RowEnergy| [energy.kinetic, energy.strain].concat();
            let pairs: Vec<_> = numbers(energy).into_iter().zip(numbers(&plain)).collect();
            assert!(pairs.iter().all(|(a, b)| (a - b).abs() < 1e-13), "{energy:?} {plain:?}");
            let surface = EnergySum::of_surface(&area, [&before, &now, &next], &next).total();
            assert_eq!(*energy, surface);
        }
        for instructions in Instructions::all().into_iter().chain(Instructions::PLAIN) {
            let w = instructions.width();
            for cuts in [vec![0, columns], vec![0, w, columns], vec![0, 3 * w, 4 * w, columns - w, columns]] {
                assert_eq!(advanced(instructions, &cuts), baseline, "{instructions:?}, {cuts:?}");
            }
        }
    }
}
