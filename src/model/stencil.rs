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

/// Advances `rows` of `columns`, whole vectors.
///
/// Always inlined, so that a caller compiled for wider vectors gets them here; no operation is fused and their order is
/// fixed, so the bits are those of any other caller.
///
/// # Safety
///
/// The machine must have the instructions of `V`. The nodes of the patch and their neighbours, one row above and below
/// and one vector on either side, must be numbers that may be read at level `now`; the nodes of the patch must be numbers
/// that may be read and written at level `next`, and nobody else may touch them meanwhile.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn advance<V: Vector>(patch: Patch<'_>, rows: Range<usize>, columns: Range<usize>) {
    assert!(columns.end <= patch.outward.len() && columns.end <= patch.inward.len());
    assert!(columns.len().is_multiple_of(V::WIDTH), "columns come in whole vectors");
    let mut j = rows.start;
    while j + ABREAST <= rows.end {
        // SAFETY: rows j and j + 1 belong to the patch
        unsafe { march::<V, ABREAST>(patch, j, columns.clone()) };
        j += ABREAST;
    }
    while j < rows.end {
        // SAFETY: row j belongs to the patch
        unsafe { march::<V, 1>(patch, j, columns.clone()) };
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
/// As [`advance`] for these rows.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn march<V: Vector, const N: usize>(patch: Patch<'_>, j: usize, columns: Range<usize>) {
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
                let axial = ends.sub(V::load(node));
                let radial = out.mul(outer.sub(four)).sub(inw.mul(four.sub(inner[row])));
                axial.add(radial).store(node);
                inner[row] = next_inner;
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

/// Some columns of two neighbouring rows at two levels, and some more.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    /// Rows j and j+1 at level k.
    pub earlier: [&'a [f64]; 2],
    /// Rows j and j+1 at level k+1.
    pub later: [&'a [f64]; 2],
}

/// Energy of row j and of what lies between it and row j+1, each up to a factor of the mesh, between two levels as the
/// leapfrog scheme conserves it: strains are products of two levels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowEnergy {
    /// `Σ_i a_i (u^{k+1} − u^k)²`
    pub kinetic: f64,
    /// `Σ_i a_i (δ_z u^k)(δ_z u^{k+1})`
    pub axial: f64,
    /// `Σ_i f_{i+½} (δ_r ū^k)(δ_r ū^{k+1})` with `ū = u_j + u_{j+1}`, twice the mean
    pub shear: f64,
}

/// A sum over columns that is being made, in [`PACK`] interleaved sums: column i adds to sum `i mod PACK`. So it is the same
/// whatever the machine, and however the columns are cut.
pub type Interleaved = [f64; PACK];

/// A [`RowEnergy`] that is being summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tally {
    /// Kinetic, axial, shear.
    sums: [Interleaved; 3],
}

impl Tally {
    /// The sums.
    pub fn total(&self) -> RowEnergy {
        let [kinetic, axial, shear] = self.sums.map(|sums| sums.iter().sum());
        RowEnergy { kinetic, axial, shear }
    }
}

/// Reads interleaved sums into vectors: the first one is that of column `first`, a whole number of vectors.
///
/// # Safety
///
/// The machine must have the instructions of `V`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn begin<V: Vector>(sums: &Interleaved, first: usize) -> [V; PACK] {
    // SAFETY: a vector from a multiple of WIDTH below PACK on lies within PACK numbers
    unsafe {
        let mut vectors = [V::load(sums.as_ptr()); PACK];
        for (part, vector) in vectors.iter_mut().enumerate().take(PACK / V::WIDTH) {
            *vector = V::load(sums.as_ptr().add((first + part * V::WIDTH) % PACK));
        }
        vectors
    }
}

/// Writes what [`begin`] has read.
///
/// # Safety
///
/// As [`begin`].
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn end<V: Vector>(vectors: [V; PACK], sums: &mut Interleaved, first: usize) {
    for (part, vector) in vectors.into_iter().enumerate().take(PACK / V::WIDTH) {
        // SAFETY: as above
        unsafe { vector.store(sums.as_mut_ptr().add((first + part * V::WIDTH) % PACK)) };
    }
}

/// A [`Tally`] in vectors, and what is carried from one to the next.
#[derive(Clone, Copy)]
struct Count<V> {
    /// Kinetic, axial, shear, every part of a pack.
    sums: [[V; PACK]; 3],
    /// `u_j + u_{j+1}` of the vector that comes next, at both levels.
    pairs: [V; 2],
}

/// Adds the energy of some columns of a row to its tally, columns in order.
///
/// * `rows`: the columns, and a vector more
/// * `area`, `face`: their cell areas a_i and face weights, as many as there are columns, a whole number of vectors
/// * `first`: number of the first column, a whole number of vectors
///
/// # Safety
///
/// The machine must have the instructions of `V`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
pub unsafe fn add_energy<V: Vector>(
    rows: Rows<'_>,
    area: &[f64],
    face: &[f64],
    first: usize,
    tally: &mut Tally,
) {
    let n = area.len();
    let Rows { earlier: [e, e_below], later: [l, l_below] } = rows;
    let shortest = e.len().min(e_below.len()).min(l.len()).min(l_below.len());
    assert!(n.is_multiple_of(V::WIDTH) && first.is_multiple_of(V::WIDTH), "columns come in whole vectors");
    assert!(face.len() >= n && shortest >= n + V::WIDTH, "a vector more than there are columns");
    let parts = PACK / V::WIDTH;
    // SAFETY: i + WIDTH ≤ n in all calls, and vectors from columns i and i + WIDTH on lie within n + WIDTH numbers, as has
    // been checked; the machine has the instructions
    unsafe {
        let pairs = [
            V::load(e.as_ptr()).add(V::load(e_below.as_ptr())),
            V::load(l.as_ptr()).add(V::load(l_below.as_ptr())),
        ];
        let mut count = Count { sums: [[pairs[0]; PACK]; 3], pairs };
        for (vectors, sums) in count.sums.iter_mut().zip(&tally.sums) {
            *vectors = begin(sums, first);
        }
        let mut i = 0;
        while i + PACK <= n {
            for part in 0..parts {
                count = add_vector(rows, area, face, i + part * V::WIDTH, count, part);
            }
            i += PACK;
        }
        for part in 0..parts {
            if i < n {
                count = add_vector(rows, area, face, i, count, part);
                i += V::WIDTH;
            }
        }
        for (vectors, sums) in count.sums.into_iter().zip(&mut tally.sums) {
            end(vectors, sums, first);
        }
    }
}

/// Adds the energy of a vector of columns from number `i` on to part `part` of the sums.
///
/// # Safety
///
/// The machine must have the instructions of `V`; there are two vectors of columns from `i` on.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
unsafe fn add_vector<V: Vector>(
    rows: Rows<'_>,
    area: &[f64],
    face: &[f64],
    i: usize,
    mut count: Count<V>,
    part: usize,
) -> Count<V> {
    let Rows { earlier: [e, e_below], later: [l, l_below] } = rows;
    // SAFETY: handed on to the caller
    unsafe {
        let (area, face) = (V::load(area.as_ptr().add(i)), V::load(face.as_ptr().add(i)));
        let (e, e_below) = (e.as_ptr().add(i), e_below.as_ptr().add(i));
        let (l, l_below) = (l.as_ptr().add(i), l_below.as_ptr().add(i));
        let (e0, e1, l0, l1) = (V::load(e), V::load(e_below), V::load(l), V::load(l_below));
        let w = V::WIDTH;
        let e_next = V::load(e.add(w)).add(V::load(e_below.add(w)));
        let l_next = V::load(l.add(w)).add(V::load(l_below.add(w)));
        let e_slope = V::seam(count.pairs[0], e_next).0.sub(count.pairs[0]);
        let l_slope = V::seam(count.pairs[1], l_next).0.sub(count.pairs[1]);
        let moved = l0.sub(e0);
        let [kinetic, axial, shear] = &mut count.sums;
        kinetic[part] = kinetic[part].add(area.mul(moved.mul(moved)));
        axial[part] = axial[part].add(area.mul(e1.sub(e0).mul(l1.sub(l0))));
        shear[part] = shear[part].add(face.mul(e_slope.mul(l_slope)));
        count.pairs = [e_next, l_next];
    }
    count
}

/// Adds the kinetic energy of some columns of a row, as in [`RowEnergy`], to its sum, columns in order.
///
/// * `earlier`, `later`: the columns at levels k and k+1
/// * `area`: their cell areas a_i, a whole number of vectors
/// * `first`: number of the first column, a whole number of vectors
///
/// # Safety
///
/// The machine must have the instructions of `V`.
#[inline(always)]
#[expect(unsafe_code, reason = "instructions that not every machine has")]
pub unsafe fn add_kinetic<V: Vector>(
    earlier: &[f64],
    later: &[f64],
    area: &[f64],
    first: usize,
    sum: &mut Interleaved,
) {
    let n = area.len();
    assert!(n.is_multiple_of(V::WIDTH) && first.is_multiple_of(V::WIDTH), "columns come in whole vectors");
    assert!(earlier.len() >= n && later.len() >= n, "as many columns at both levels");
    let parts = PACK / V::WIDTH;
    // SAFETY: a vector from column i on lies within n numbers, as has been checked; the machine has the instructions
    unsafe {
        let mut sums = begin::<V>(sum, first);
        let mut i = 0;
        while i < n {
            for (part, sum) in sums.iter_mut().enumerate().take(parts) {
                let i = i + part * V::WIDTH;
                if i < n {
                    let moved = V::load(later.as_ptr().add(i)).sub(V::load(earlier.as_ptr().add(i)));
                    *sum = sum.add(V::load(area.as_ptr().add(i)).mul(moved.mul(moved)));
                }
            }
            i += PACK;
        }
        end(sums, sum, first);
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
        let n = 9 * PACK;
        let line = |seed: usize| -> Vec<f64> {
            (0..n + PACK).map(|i| ((i * 7 + seed * 13) % 31) as f64 / 31.0 - 0.4).collect()
        };
        let [e0, e1, l0, l1, area, face] = [0, 1, 2, 3, 4, 5].map(line);
        let mut plain = RowEnergy::default();
        for i in 0..n {
            let slope = |a: &[f64], b: &[f64]| (a[i + 1] + b[i + 1]) - (a[i] + b[i]);
            plain.kinetic += area[i] * (l0[i] - e0[i]).powi(2);
            plain.axial += area[i] * (e1[i] - e0[i]) * (l1[i] - l0[i]);
            plain.shear += face[i] * slope(&e0, &e1) * slope(&l0, &l1);
        }
        let sum = |lanes: Lanes, cuts: &[usize]| {
            let (mut tally, mut kinetic) = (Tally::default(), Interleaved::default());
            for cut in cuts.windows(2) {
                let (part, longer) = (cut[0]..cut[1], cut[0]..cut[1] + lanes.width());
                let rows = Rows {
                    earlier: [&e0[longer.clone()], &e1[longer.clone()]],
                    later: [&l0[longer.clone()], &l1[longer.clone()]],
                };
                lanes.add_energy(rows, &area[part.clone()], &face[part.clone()], cut[0], &mut tally);
                lanes.add_kinetic(&e0[part.clone()], &l0[part.clone()], &area[part], cut[0], &mut kinetic);
            }
            assert_eq!(kinetic, tally.sums[0]);
            tally.total()
        };
        let baseline = sum(Lanes::BASELINE, &[0, n]);
        let pairs =
            [(baseline.kinetic, plain.kinetic), (baseline.axial, plain.axial), (baseline.shear, plain.shear)];
        assert!(pairs.iter().all(|(a, b)| (a - b).abs() < 1e-13), "{baseline:?} {plain:?}");
        for lanes in Lanes::all() {
            let w = lanes.width();
            for cuts in [vec![0, n], vec![0, w, n], vec![0, 3 * w, 3 * w, 4 * w, n - w, n]] {
                assert_eq!(sum(lanes, &cuts), baseline, "{lanes:?}, {cuts:?}");
            }
        }
    }
}
