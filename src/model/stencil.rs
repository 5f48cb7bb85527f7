//! Stencils of the MDM scheme: free functions over columns of numbers.
//!
//! At Courant number 1 along z the scheme of \[KA\] Eq. 21 (misprints corrected) loses its middle term,
//!
//! ```text
//! u^{k+1} = u_{j+1} + u_{j−1} − u^{k−1} + λ²·Λ_r U      U_j = (u_{j+1} + 2u_j + u_{j−1})/4,  λ = c_s·Δt/Δr
//! Λ_r U at i = outward_i·(U_{i+1} − U_i) − inward_i·(U_i − U_{i−1})
//! ```
//!
//! and obeys (plane waves, wave numbers q per node)
//!
//! ```text
//! sin²(ω/2) = sin²(q_z/2) + λ²·cos²(q_z/2)·sin²(q_r/2)
//! ```
//!
//! so nothing is dispersed along z, and for λ = 1 nothing along r either.
//!
//! Fields are stored row by row, the nodes of one depth in the order of radii. A patch is advanced by marching outwards
//! with some rows side by side, a vector at a time: sums over z are shared by the rows and carried from vector to
//! vector, so every node is loaded once or twice and nine operations do an update.

use std::ops::Range;

use super::lanes::{PACK, Vector};

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

/// Advances `rows` of `columns`, whole vectors, and adds their energy to their tallies if `COUNTS` says so.
///
/// Always inlined, so that a caller compiled for wider vectors gets them here; no operation is fused and their order is
/// fixed, so the bits are those of any other caller.
///
/// * `area`: cell areas a_i, by column; none if nothing is counted
/// * `tallies`: of `rows`; none if nothing is counted
///
/// # Safety
///
/// The machine must have the instructions of `V`. The nodes of the patch and their neighbours, one row above and below
/// and one vector on either side, must be numbers that may be read at level `now`; the nodes of the patch must be numbers
/// that may be read and written at level `next`, and nobody else may touch them meanwhile.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn advance<V: Vector, const COUNTS: bool>(
    patch: Patch<'_>,
    rows: Range<usize>,
    columns: Range<usize>,
    area: &[f64],
    tallies: &mut [Tally],
) {
    assert!(columns.end <= patch.outward.len() && columns.end <= patch.inward.len());
    assert!(
        columns.start.is_multiple_of(V::WIDTH) && columns.len().is_multiple_of(V::WIDTH),
        "whole vectors"
    );
    assert!(!COUNTS || (columns.end <= area.len() && rows.len() == tallies.len()), "a tally for every row");
    let mut j = rows.start;
    while j + ABREAST <= rows.end {
        let tallies = if COUNTS { &mut tallies[j - rows.start..][..ABREAST] } else { &mut [] };
        // SAFETY: rows j and j + 1 belong to the patch; areas and tallies have been checked
        unsafe { march::<V, ABREAST, COUNTS>(patch, j, columns.clone(), area, tallies) };
        j += ABREAST;
    }
    while j < rows.end {
        let tallies = if COUNTS { &mut tallies[j - rows.start..][..1] } else { &mut [] };
        // SAFETY: row j belongs to the patch; areas and tallies have been checked
        unsafe { march::<V, 1, COUNTS>(patch, j, columns.clone(), area, tallies) };
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
unsafe fn sums<V: Vector, const N: usize>(now: *const f64, stride: usize, i: usize) -> [(V, V); N] {
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

/// Advances `N` rows from row `j` on, vector by vector outwards.
///
/// # Safety
///
/// As [`advance`] for these rows; if `COUNTS`, there is an area for every column and a tally for every row.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn march<V: Vector, const N: usize, const COUNTS: bool>(
    patch: Patch<'_>,
    j: usize,
    columns: Range<usize>,
    area: &[f64],
    tallies: &mut [Tally],
) {
    let Patch { now, next, stride, outward, inward } = patch;
    // SAFETY, here and below: the nodes of the patch, a row around them and a vector on either side are numbers, of
    // which those of the patch at level `next` are nobody else's; the machine has the instructions
    unsafe {
        let (now, next) = (now.add(j * stride), next.add(j * stride));
        let before = sums::<V, N>(now, stride, columns.start);
        let mut here = sums::<V, N>(now, stride, columns.start + V::WIDTH);
        let mut inner = [here[0].1; N];
        for row in 0..N {
            inner[row] = V::seam(before[row].1, here[row].1).1;
        }
        let mut i = columns.start;
        while i < columns.end {
            let after = sums::<V, N>(now, stride, i + 2 * V::WIDTH);
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
                    tallies.get_unchecked_mut(row).add(i, area, [earlier, middle, later]);
                }
            }
            here = after;
            i += V::WIDTH;
        }
    }
}

/// Surface nodes at level k+1 if they were free of stress: the scheme with the mirror image u_{−1} = u_1 (\[KA\] Eq. 19).
///
/// ```text
/// u_free = 2u_1 − u_0^{k−1} + λ²·Λ_r U_0       U_0 = (u_0 + u_1)/2
/// ```
///
/// * `before`: u_0 at level k−1
/// * `top`, `below`: u_0 and u_1 at level k, one node more than `free`
/// * `weights`: radial weights times `λ²/4`, outward and inward; that inward of the first node is 0
/// * `four`: room for sums
/// * `free`: the result
pub fn free_surface(
    before: &[f64],
    top: &[f64],
    below: &[f64],
    weights: [&[f64]; 2],
    four: &mut Vec<f64>,
    free: &mut [f64],
) {
    let n = free.len();
    four.clear();
    // what is inside the first node counts for nothing
    four.push(0.0);
    four.extend(top[..=n].iter().zip(&below[..=n]).map(|(top, below)| (below + below) + 2.0 * top));
    let (inner, here, outer) = (&four[..n], &four[1..=n], &four[2..n + 2]);
    let ([outward, inward], below, before) =
        (weights.map(|weights| &weights[..n]), &below[..n], &before[..n]);
    for i in 0..n {
        let radial = outward[i] * (outer[i] - here[i]) - inward[i] * (here[i] - inner[i]);
        free[i] = ((below[i] + below[i]) - before[i]) + radial;
    }
}

/// Energy of a row as the leapfrog scheme conserves it, each up to a factor of the mesh: between levels k−1 and k, and one
/// step later.
///
/// Strain energy between two levels is a product of strains at both. Summed by parts over the whole field it is the work of
/// the forces at level k on the displacement at level k−1, and forces are what accelerates: no row needs another one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowEnergy {
    /// `Σ_i a_i (u^k − u^{k−1})²`
    pub kinetic: f64,
    /// `−Σ_i a_i u^{k−1} (u^{k+1} − 2u^k + u^{k−1})`
    pub strain: f64,
    /// `Σ_i a_i (u^{k+1} − u^k)²`
    pub next_kinetic: f64,
}

/// A sum over columns that is being made, in [`PACK`] interleaved sums: column i adds to sum `i mod PACK`. So it is the same
/// whatever the machine, and however the columns are cut.
type Interleaved = [f64; PACK];

/// A [`RowEnergy`] that is being summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Kinetic energy, strain energy but for its sign, kinetic energy one step later.
    sums: [Interleaved; 3],
}

impl Tally {
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
        // SAFETY: a vector from a multiple of WIDTH below PACK on lies within PACK numbers
        unsafe {
            let (moved, next_moved) = (now.sub(before), next.sub(now));
            let force = next_moved.sub(moved);
            let terms = [moved.mul(moved), before.mul(force), next_moved.mul(next_moved)];
            for (sum, term) in self.sums.iter_mut().zip(terms) {
                let place = sum.as_mut_ptr().add(i % PACK);
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
        let mut tally = Self::default();
        for i in 0..next.len() {
            let (moved, next_moved) = (now[i] - before[i], next[i] - now[i]);
            let force = (free[i] - now[i]) - moved;
            for (sum, term) in
                tally.sums.iter_mut().zip([moved * moved, before[i] * force, next_moved * next_moved])
            {
                sum[i % PACK] += area[i] * term;
            }
        }
        tally
    }

    /// The sums.
    pub fn total(&self) -> RowEnergy {
        let [kinetic, strain, next_kinetic] = self.sums.map(|sums| sums.iter().sum());
        RowEnergy { kinetic, strain: -strain, next_kinetic }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::lanes::Lanes;

    /// One step of the plane scheme on a standing wave in the middle of an unbounded mesh.
    fn advance_wave(lanes: Lanes, q_z: f64, q_r: f64, lambda: f64, phase: f64) -> (f64, f64) {
        let omega = dispersion(q_z, q_r, lambda);
        let (rows, columns) = (20, 40);
        let wave = |k: f64| {
            let node = |m: usize| q_z * (m / columns) as f64 + q_r * (m % columns) as f64 - omega * k + phase;
            (0..rows * columns).map(|m| node(m).cos()).collect::<Vec<f64>>()
        };
        let (mut next, now) = (wave(-1.0), wave(0.0));
        let weights = vec![0.25 * lambda * lambda; columns];
        let (read, write) = (now.as_ptr(), next.as_mut_ptr());
        let patch = Patch { now: read, next: write, stride: columns, outward: &weights, inward: &weights };
        // SAFETY: a pack is left on all sides
        #[expect(unsafe_code, reason = "the function under test")]
        unsafe {
            lanes.advance(patch, 1..rows - 1, PACK..columns - PACK);
        }
        let inside = |m: &usize| {
            (1..rows - 1).contains(&(m / columns)) && (PACK..columns - PACK).contains(&(m % columns))
        };
        let exact = wave(1.0);
        let error = |m: usize| (next[m] - exact[m]).abs();
        ((0..rows * columns).filter(inside).map(error).fold(0.0, f64::max), omega)
    }

    fn dispersion(q_z: f64, q_r: f64, lambda: f64) -> f64 {
        let (s, c, r) = ((q_z / 2.0).sin(), (q_z / 2.0).cos(), (q_r / 2.0).sin());
        2.0 * (s * s + lambda * lambda * c * c * r * r).sqrt().asin()
    }

    #[test]
    fn plane_wave_obeys_the_dispersion_relation() {
        for lambda in [0.3, 0.5, 0.97, 1.0] {
            for q_z in [0.0, 0.4, 1.7, 3.0] {
                for q_r in [0.0, 0.6, 2.2, 3.1] {
                    let mut omega = 0.0;
                    for lanes in Lanes::all() {
                        let error;
                        (error, omega) = advance_wave(lanes, q_z, q_r, lambda, 0.7);
                        assert!(error < 1e-12, "{lanes:?} λ={lambda} q=({q_z}, {q_r}): {error:e}");
                    }
                    if lambda == 1.0 {
                        // cos ω/2 = cos q_z/2 · cos q_r/2: no dispersion along either axis
                        let product = (q_z / 2.0).cos() * (q_r / 2.0).cos();
                        assert!(((omega / 2.0).cos().powi(2) - product * product).abs() < 1e-14);
                    }
                }
            }
        }
    }

    #[test]
    fn the_free_surface_is_the_mirrored_interior() {
        // rows −1, 0, 1 of three columns, row −1 the image of row 1; what lies around them is at rest
        let (top, below) = ([0.3, 0.7, -0.1, 0.0], [-0.2, 0.4, 0.9, 0.0]);
        let stride = 3 * PACK;
        let (mut now, mut next) = (vec![0.0; 3 * stride], vec![0.0; 3 * stride]);
        for (j, row) in [below, top, below].iter().enumerate() {
            now[j * stride + PACK..][..row.len()].copy_from_slice(row);
        }
        let before = [0.25, -0.4, 0.6];
        next[stride + PACK..][..3].copy_from_slice(&before);
        let (mut outward, mut inward) = (vec![0.0; stride], vec![0.0; stride]);
        outward[PACK..][..3].copy_from_slice(&[0.25, 0.11, 0.05]);
        inward[PACK..][..3].copy_from_slice(&[0.0, 0.07, 0.03]);
        let (read, write) = (now.as_ptr(), next.as_mut_ptr());
        let patch = Patch { now: read, next: write, stride, outward: &outward, inward: &inward };
        // SAFETY: a row and a pack are left on all sides
        #[expect(unsafe_code, reason = "the function under test")]
        unsafe {
            Lanes::BASELINE.advance(patch, 1..2, PACK..2 * PACK);
        }
        let mut free = [0.0; 3];
        let weights = [&outward[PACK..][..3], &inward[PACK..][..3]];
        free_surface(&before, &top, &below, weights, &mut Vec::new(), &mut free);
        assert_eq!(next[stride + PACK..][..3], free);
    }

    #[test]
    fn the_energy_of_a_row_is_the_plain_sum_with_any_instructions_and_cuts() {
        let columns = 9 * PACK;
        let stride = columns + 2 * PACK;
        let noise = |seed: usize, length: usize| -> Vec<f64> {
            (0..length).map(|i| ((i * 7 + seed * 13) % 31) as f64 / 31.0 - 0.4).collect()
        };
        // two rows abreast and one alone, with a row and a pack around them
        let [before, now] = [0, 1].map(|seed| noise(seed, 5 * stride));
        let [outward, inward, area] = [2, 3, 4].map(|seed| noise(seed, columns));
        let advanced = |lanes: Lanes, cuts: &[usize]| {
            let (mut next, mut tallies) = (before.clone(), [Tally::default(); 3]);
            let (read, write) = (now[PACK..].as_ptr(), next[PACK..].as_mut_ptr());
            let patch = Patch { now: read, next: write, stride, outward: &outward, inward: &inward };
            for cut in cuts.windows(2) {
                // SAFETY: a row and a pack are left on all sides
                #[expect(unsafe_code, reason = "the function under test")]
                unsafe {
                    lanes.advance_and_count(patch, 1..4, cut[0]..cut[1], &area, &mut tallies);
                }
            }
            (next, tallies.map(|tally| tally.total()))
        };
        let baseline = advanced(Lanes::BASELINE, &[0, columns]);
        let (next, energies) = &baseline;
        for (j, energy) in (1..).zip(energies) {
            let row = |level: &[f64]| level[j * stride + PACK..][..columns].to_vec();
            let [before, now, next] = [&before, &now, next].map(|level| row(level));
            let mut plain = RowEnergy::default();
            for i in 0..columns {
                plain.kinetic += area[i] * (now[i] - before[i]).powi(2);
                plain.strain -= area[i] * before[i] * (next[i] - 2.0 * now[i] + before[i]);
                plain.next_kinetic += area[i] * (next[i] - now[i]).powi(2);
            }
            let pairs = [
                (energy.kinetic, plain.kinetic),
                (energy.strain, plain.strain),
                (energy.next_kinetic, plain.next_kinetic),
            ];
            assert!(pairs.iter().all(|(a, b)| (a - b).abs() < 1e-13), "{energy:?} {plain:?}");
            let surface = Tally::of_surface(&area, [&before, &now, &next], &next).total();
            let pairs = [
                (energy.kinetic, surface.kinetic),
                (energy.strain, surface.strain),
                (energy.next_kinetic, surface.next_kinetic),
            ];
            assert!(pairs.iter().all(|(a, b)| a == b), "{energy:?} {surface:?}");
        }
        for lanes in Lanes::all() {
            let w = lanes.width();
            for cuts in [vec![0, columns], vec![0, w, columns], vec![0, 3 * w, 4 * w, columns - w, columns]] {
                assert_eq!(advanced(lanes, &cuts), baseline, "{lanes:?}, {cuts:?}");
            }
        }
    }
}
