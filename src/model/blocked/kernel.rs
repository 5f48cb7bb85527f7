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

/// Part of a field that is advanced in place, at two levels.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// Node (0, 0) of the level that is read.
    pub now: *const f64,
    /// Node (0, 0) of the level that is written; before, it holds the level before the one that is read.
    pub next: *mut f64,
    /// Distance from a node to the one below it, in numbers.
    pub stride: usize,
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub outward: &'a [f64],
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub inward: &'a [f64],
}

/// Rows that are marched side by side: what two of them carry fits into 16 registers.
const ABREAST: usize = 2;

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
/// and one vector on either side, must be numbers that may be read at level `now`; the nodes of the patch must be numbers
/// that may be read and written at level `next`, which no other thread may touch meanwhile.
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
    let mut j = rows.start;
    while j + ABREAST <= rows.end {
        let energies = if COUNTS { &mut energies[j - rows.start..][..ABREAST] } else { &mut [] };
        // SAFETY: rows j and j + 1 belong to the patch; areas and energies have been checked
        unsafe { march::<V, ABREAST, COUNTS>(patch, j, columns.clone(), area, energies) };
        j += ABREAST;
    }
    while j < rows.end {
        let energies = if COUNTS { &mut energies[j - rows.start..][..1] } else { &mut [] };
        // SAFETY: row j belongs to the patch; areas and energies have been checked
        unsafe { march::<V, 1, COUNTS>(patch, j, columns.clone(), area, energies) };
        j += 1;
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
    let Patch { now, next, stride, outward, inward } = patch;
    // SAFETY, here and below: the nodes of the patch, a row around them and a vector on either side are numbers, of
    // which those of the patch at level `next` belong to this call alone; the machine has the instructions
    unsafe {
        let (now, next) = (now.add(j * stride), next.add(j * stride));
        let before = axial_sums::<V, N>(now, stride, columns.start);
        let mut here = axial_sums::<V, N>(now, stride, columns.start + V::WIDTH);
        let mut inner = [here[0].1; N];
        for row in 0..N {
            inner[row] = V::seam(before[row].1, here[row].1).1;
        }
        let mut i = columns.start;
        while i < columns.end {
            let after = axial_sums::<V, N>(now, stride, i + 2 * V::WIDTH);
            let (out, inw) = (V::load(outward.as_ptr().add(i)), V::load(inward.as_ptr().add(i)));
            for row in 0..N {
                let (ends, four) = here[row];
                let (outer, next_inner) = V::seam(four, after[row].1);
                let node = next.add(i + row * stride);
                let earlier = V::load(node);
                let axial = ends.sub(earlier);
                let radial = out.mul(outer.sub(four)).sub(inw.mul(four.sub(inner[row])));
                let later = axial.add(radial);
                later.store(node);
                inner[row] = next_inner;
                if COUNTS {
                    let middle = V::load(now.add(i + row * stride));
                    let area = V::load(area.as_ptr().add(i));
                    energies.get_unchecked_mut(row).add(i, area, [earlier, middle, later]);
                }
            }
            here = after;
            i += V::WIDTH;
        }
    }
}

/// Surface nodes at level k+1 if they were free of stress: [`scheme::interior`] and [`scheme::axis`] with the image of
/// [`scheme::surface`], column by column.
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
/// the forces at level k on the displacement at the other level, and forces are what accelerates, `u^{k+1} − 2u^k + u^{k−1}`:
/// no row needs another one, and nothing is assumed about the balance of energies.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowEnergy {
    /// `Σ_i a_i (u^k − u^{k−1})²` and `Σ_i a_i (u^{k+1} − u^k)²`
    pub kinetic: [f64; 2],
    /// `−Σ_i a_i u^{k−1} (u^{k+1} − 2u^k + u^{k−1})` and `−Σ_i a_i u^{k+1} (u^{k+1} − 2u^k + u^{k−1})`
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
    ///
    /// # Safety
    ///
    /// The machine must have the instructions of `V`.
    #[inline(always)]
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    unsafe fn add<V: Vector>(&mut self, i: usize, area: V, levels: [V; 3]) {
        let [before, now, next] = levels;
        // SAFETY: a vector from a multiple of WIDTH below BLOCK on lies within BLOCK numbers
        unsafe {
            let (moved, next_moved) = (now.sub(before), next.sub(now));
            let force = next_moved.sub(moved);
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
    /// * `free`: u_0 at level k+1 without the contact, see [`free_surface`]
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
