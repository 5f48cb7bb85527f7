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
//! Fields are stored column by column, the nodes of one radius in the order of depth. A patch is advanced by marching
//! outwards with some rows side by side: sums over z and differences of U are carried from column to column, so every
//! node is loaded once and nine operations do an update.

use std::ops::Range;

/// Part of a field that is advanced in place, at two levels.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// Node (0, 0) of the level that is read.
    pub now: *const f64,
    /// Node (0, 0) of the level that is written; before, it holds the level before the one that is read.
    pub next: *mut f64,
    /// Distance from a node to its outer neighbour, in numbers.
    pub stride: usize,
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub outward: &'a [f64],
    /// Radial weights times `λ²/4`, by column. 0 where there is no neighbour.
    pub inward: &'a [f64],
}

/// Advances `rows` of `columns`.
///
/// Always inlined, so that a caller compiled for wider vectors gets them here; no operation is fused and their order is
/// fixed, so the bits are those of any other caller.
///
/// # Safety
///
/// The nodes of the patch and their neighbours on all eight sides must be numbers that may be read at level `now`; the
/// nodes of the patch must be numbers that may be read and written at level `next`, and nobody else may touch them
/// meanwhile.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
pub unsafe fn advance(patch: Patch<'_>, rows: Range<usize>, columns: Range<usize>) {
    assert!(columns.end <= patch.outward.len() && columns.end <= patch.inward.len());
    let mut j = rows.start;
    // eight rows side by side: what is carried fits into the registers of 256 bits; what did not would go through a
    // stack that may lie across a page, where it is several times slower
    macro_rules! march {
        ($n:literal) => {
            while rows.end.saturating_sub(j) >= $n {
                // SAFETY: rows j to j + n − 1 belong to the patch
                unsafe { march::<$n>(patch, j, columns.clone()) };
                j += $n;
            }
        };
    }
    march!(8);
    march!(4);
    march!(2);
    march!(1);
}

/// Advances `N` rows from row `j` on, column by column outwards.
///
/// # Safety
///
/// As [`advance`] for these rows.
#[inline(always)]
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn march<const N: usize>(patch: Patch<'_>, j: usize, columns: Range<usize>) {
    let Patch { now, next, stride, outward, inward } = patch;
    // sums u_{j−1} + u_{j+1} and 4·U, counting columns from the one before column 0
    let sums = |i: usize| {
        // SAFETY: the patch has a column before its first one, and a row above and below; see `advance`
        let column = unsafe { std::slice::from_raw_parts(now.add(i * stride + j).sub(stride + 1), N + 2) };
        let (mut ends, mut four) = ([0.0; N], [0.0; N]);
        for l in 0..N {
            ends[l] = column[l] + column[l + 2];
            four[l] = ends[l] + 2.0 * column[l + 1];
        }
        (ends, four)
    };
    let (_, before) = sums(columns.start);
    let (mut ends, mut four) = sums(columns.start + 1);
    let mut inner = [0.0; N];
    for l in 0..N {
        inner[l] = four[l] - before[l];
    }
    for i in columns {
        let (next_ends, next_four) = sums(i + 2);
        // SAFETY: column i of the patch, which nobody else touches; see `advance`
        let row = unsafe { std::slice::from_raw_parts_mut(next.add(i * stride + j), N) };
        let (out, inw) = (outward[i], inward[i]);
        for l in 0..N {
            let outer = next_four[l] - four[l];
            row[l] = (ends[l] - row[l]) + (out * outer - inw * inner[l]);
            inner[l] = outer;
        }
        (ends, four) = (next_ends, next_four);
    }
}

/// Rows 0 and 1 of a column, as the surface sees them.
#[derive(Clone, Copy)]
pub struct Top {
    /// u_0.
    pub surface: f64,
    /// u_1.
    pub below: f64,
}

/// Surface node at level k+1 if it were free of stress: the scheme with the mirror image u_{−1} = u_1 (\[KA\] Eq. 19).
///
/// ```text
/// u_free = 2u_1 − u_0^{k−1} + λ²·Λ_r U_0       U_0 = (u_0 + u_1)/2
/// ```
///
/// * `before`: u_0 at level k−1
/// * `around`: the inner neighbour, the column itself, the outer neighbour, at level k
/// * `outward`, `inward`: radial weights times `λ²/4`
pub fn free_surface(before: f64, around: [Top; 3], outward: f64, inward: f64) -> f64 {
    let ends = around.map(|top| top.below + top.below);
    let four = [0, 1, 2].map(|m| ends[m] + 2.0 * around[m].surface);
    (ends[1] - before) + (outward * (four[2] - four[1]) - inward * (four[1] - four[0]))
}

/// A column at two levels.
#[derive(Clone, Copy)]
pub struct Column<'a> {
    /// Level k.
    pub earlier: &'a [f64],
    /// Level k+1.
    pub later: &'a [f64],
}

/// Kinetic energy of a column between two levels over `½a·Δz`, the surface with half a cell:
/// `Σ_j κ_j ((u^{k+1} − u^k)/Δt)²`, κ_0 = ½.
pub fn column_kinetic(column: Column<'_>, dt: f64) -> f64 {
    let squares = column.earlier.iter().zip(column.later).map(|(e, l)| (l - e) * (l - e));
    let first = column.later[0] - column.earlier[0];
    (squares.sum::<f64>() - 0.5 * first * first) / (dt * dt)
}

/// Axial strain energy of a column over `½a/Δz` as the leapfrog scheme conserves it, a product of two levels:
/// `Σ_j (δ_z u^k)(δ_z u^{k+1})`.
pub fn column_axial(column: Column<'_>) -> f64 {
    let steps = column.earlier.windows(2).zip(column.later.windows(2));
    steps.map(|(e, l)| (e[1] - e[0]) * (l[1] - l[0])).sum()
}

/// Shear strain energy between two columns over `½·face·c_s²·Δz/Δr`, likewise a product of two levels:
/// `Σ_j (δ_r ū^k)(δ_r ū^{k+1})` with `ū = (u_j + u_{j+1})/2`.
pub fn columns_shear(inner: Column<'_>, outer: Column<'_>) -> f64 {
    let slope = |inner: &[f64], outer: &[f64]| 0.5 * (outer[0] + outer[1]) - 0.5 * (inner[0] + inner[1]);
    let earlier = inner.earlier.windows(2).zip(outer.earlier.windows(2));
    let later = inner.later.windows(2).zip(outer.later.windows(2));
    earlier.zip(later).map(|(e, l)| slope(e.0, e.1) * slope(l.0, l.1)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One step of the plane scheme on a standing wave in the middle of an unbounded mesh.
    fn advance_wave(q_z: f64, q_r: f64, lambda: f64, phase: f64) -> (f64, f64) {
        let omega = dispersion(q_z, q_r, lambda);
        let (rows, columns) = (40, 20);
        let wave = |k: f64| {
            let node = |m: usize| q_z * (m % rows) as f64 + q_r * (m / rows) as f64 - omega * k + phase;
            (0..rows * columns).map(|m| node(m).cos()).collect::<Vec<f64>>()
        };
        let (mut next, now) = (wave(-1.0), wave(0.0));
        let weights = vec![0.25 * lambda * lambda; columns];
        let (read, write) = (now.as_ptr(), next.as_mut_ptr());
        let patch = Patch { now: read, next: write, stride: rows, outward: &weights, inward: &weights };
        // SAFETY: one node is left on all sides
        #[expect(unsafe_code, reason = "the function under test")]
        unsafe {
            advance(patch, 1..rows - 1, 1..columns - 1);
        }
        let inside =
            |m: &usize| (1..rows - 1).contains(&(m % rows)) && (1..columns - 1).contains(&(m / rows));
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
                    let (error, omega) = advance_wave(q_z, q_r, lambda, 0.7);
                    assert!(error < 1e-12, "λ={lambda} q=({q_z}, {q_r}): {error:e}");
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
        // rows −1, 0, 1 of three columns, row −1 the image of row 1
        let tops = [(0.3, -0.2), (0.7, 0.4), (-0.1, 0.9)].map(|(surface, below)| Top { surface, below });
        let now: Vec<f64> = tops.iter().flat_map(|top| [top.below, top.surface, top.below]).collect();
        let mut next = vec![0.0, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0];
        let (outward, inward) = ([0.0, 0.11, 0.0], [0.0, 0.07, 0.0]);
        let (read, write) = (now.as_ptr(), next.as_mut_ptr());
        let patch = Patch { now: read, next: write, stride: 3, outward: &outward, inward: &inward };
        // SAFETY: the only node of the patch has all its neighbours
        #[expect(unsafe_code, reason = "the function under test")]
        unsafe {
            advance(patch, 1..2, 1..2);
        }
        assert_eq!(next[4], free_surface(0.25, tops, 0.11, 0.07));
    }
}
