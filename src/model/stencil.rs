//! Stencils of the MDM scheme: free functions over rows of numbers.
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

/// Number of columns whose means are kept on the stack at a time.
const TILE: usize = 128;

/// Advances one row in place: `row` holds u^{k−1} and receives u^{k+1}.
///
/// All slices but `row` hold one more node than `row` has, the outer neighbour of its last one.
///
/// * `above`, `here`, `below`: rows j−1, j, j+1 at level k. On a surface free of stress `above` is `below`: the
///   mirror image u_{−1} = u_1 (\[KA\] Eq. 19).
/// * `outward`, `inward`: radial weights times `λ²/4`, shape of `row`
pub fn advance_row(
    row: &mut [f64],
    above: &[f64],
    here: &[f64],
    below: &[f64],
    outward: &[f64],
    inward: &[f64],
) {
    let n = row.len();
    let (above, here, below) = (&above[..=n], &here[..=n], &below[..=n]);
    let (outward, inward) = (&outward[..n], &inward[..n]);
    // mean[m] = 4·U at column start + m − 1; inward_0 = 0 makes the column before the first one irrelevant
    let mut mean = [0.0; TILE + 2];
    mean[1] = above[0] + 2.0 * here[0] + below[0];
    let mut start = 0;
    while start < n {
        let len = TILE.min(n - start);
        let ahead = start + 1..start + 1 + len;
        for (m, ((a, h), b)) in mean[2..2 + len]
            .iter_mut()
            .zip(above[ahead.clone()].iter().zip(&here[ahead.clone()]).zip(&below[ahead.clone()]))
        {
            *m = a + 2.0 * h + b;
        }
        let tile = start..start + len;
        let (row, above, below) = (&mut row[tile.clone()], &above[tile.clone()], &below[tile.clone()]);
        let (outward, inward) = (&outward[tile.clone()], &inward[tile]);
        for m in 0..len {
            let radial = outward[m] * (mean[m + 2] - mean[m + 1]) - inward[m] * (mean[m + 1] - mean[m]);
            row[m] = ((above[m] + below[m]) - row[m]) + radial;
        }
        (mean[0], mean[1]) = (mean[len], mean[len + 1]);
        start += len;
    }
}

/// Kinetic energy per axial step of one row between two levels, `½ Σ a_i ((u_i^{k+1} − u_i^k)/Δt)²`.
pub fn row_kinetic(area: &[f64], earlier: &[f64], later: &[f64], dt: f64) -> f64 {
    let sum: f64 = area.iter().zip(earlier.iter().zip(later)).map(|(a, (e, l))| a * (l - e) * (l - e)).sum();
    0.5 * sum / (dt * dt)
}

/// Two neighbouring rows j, j+1 at one level.
#[derive(Clone, Copy)]
pub struct RowPair<'a> {
    /// Row j, with the outer neighbour of its last node.
    pub upper: &'a [f64],
    /// Row j+1, likewise.
    pub lower: &'a [f64],
}

/// Strain energy between two rows as the leapfrog scheme conserves it, a product of two levels:
///
/// ```text
/// ½ Σ_i [ a_i (δ_z u^k)(δ_z u^{k+1})/Δz + face_i·c_s²·(Δz/Δr)·(δ_r ū^k)(δ_r ū^{k+1}) ]     ū = (u_j + u_{j+1})/2
/// ```
///
/// * `area`, `face`: weights of the columns, shape `(n,)`
/// * `shear`: c_s²·Δz/Δr
pub fn rows_strain(area: &[f64], face: &[f64], earlier: RowPair, later: RowPair, dz: f64, shear: f64) -> f64 {
    let n = area.len();
    let (mut axial, mut radial) = (0.0, 0.0);
    let mean = |rows: RowPair, i: usize| 0.5 * (rows.upper[i] + rows.lower[i]);
    for i in 0..n {
        axial += area[i] * (earlier.lower[i] - earlier.upper[i]) * (later.lower[i] - later.upper[i]);
        radial += face[i] * (mean(earlier, i + 1) - mean(earlier, i)) * (mean(later, i + 1) - mean(later, i));
    }
    0.5 * (axial / dz + shear * radial)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One step of the plane scheme on a standing wave in the middle of an unbounded mesh.
    fn advance_wave(q_z: f64, q_r: f64, lambda: f64, phase: f64) -> (f64, f64) {
        let omega = dispersion(q_z, q_r, lambda);
        let n = 300;
        let wave = |j: f64, i: f64, k: f64| (q_z * j + q_r * i - omega * k + phase).cos();
        let row = |j: f64, k: f64| (0..=n).map(|i| wave(j, i as f64, k)).collect::<Vec<f64>>();
        let mut next: Vec<f64> = row(0.0, -1.0)[..n].to_vec();
        let weights = vec![0.25 * lambda * lambda; n];
        advance_row(&mut next, &row(-1.0, 0.0), &row(0.0, 0.0), &row(1.0, 0.0), &weights, &weights);
        let worst = (1..n).map(|i| (next[i] - wave(0.0, i as f64, 1.0)).abs()).fold(0.0, f64::max);
        (worst, omega)
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
    fn tiles_do_not_show() {
        // The value of a node must not depend on where the row is cut: compare with rows of one node.
        let n = 3 * TILE + 5;
        let noise = |seed: usize| {
            (0..=n).map(|i| ((i * 7919 + seed * 104_729) % 1009) as f64 / 1009.0 - 0.5).collect::<Vec<f64>>()
        };
        let (above, here, below, out, inw) = (noise(1), noise(2), noise(3), noise(4), noise(5));
        let mut inw = inw;
        inw[0] = 0.0;
        let mut whole = noise(6)[..n].to_vec();
        advance_row(&mut whole, &above, &here, &below, &out[..n], &inw[..n]);
        for i in 1..n {
            let four = |i: usize| above[i] + 2.0 * here[i] + below[i];
            let radial = out[i] * (four(i + 1) - four(i)) - inw[i] * (four(i) - four(i - 1));
            assert_eq!(whole[i], ((above[i] + below[i]) - noise(6)[i]) + radial, "column {i}");
        }
    }
}
