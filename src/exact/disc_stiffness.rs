//! Slope of the drag of an axisymmetric flat punch on a layer at long times.
//!
//! When the waves have spread, the displacement under a punch moving with V0 is that of a static disc pressed in by
//! `V0·t`, and the drag grows as `F = A_d·V0·t/h`. `A_d` is the stiffness of a rigid disc on a layer free of stress
//! around it, relative to that of the column under it. With `a = R/c_s` (the layer becomes isotropic in r/c_s), the
//! dual integral equations lead to a Fredholm equation of the second kind on `0 ≤ t ≤ a`,
//!
//! ```text
//! f(t) − (1/π) ∫_0^a [g(t−s) + g(t+s)] f(s) ds = 2/π        g(y) = ∫_0^∞ (1 − tanh ξh) cos ξy dξ
//! A_d = (2h/a²) ∫_0^a f(t) dt
//! ```
//!
//! The kernel is smooth, so Gauss–Legendre quadrature (Nyström's method) converges exponentially. Its integral is
//! expanded as `1 − tanh x = 2 Σ_{n≥1} (−1)^{n+1} e^{−2nx}`, hence
//!
//! ```text
//! g(y) = 2 Σ_{n≥1} (−1)^{n+1}·2nh/(4n²h² + y²)
//! ```
//!
//! an alternating series that repeated averaging of its partial sums (Euler's transformation) sums to rounding.

use super::{ExactError, positive};

/// Nodes of the quadrature; 40 give all digits for `a/h` up to 20.
const NODES: usize = 80;

/// Relative drag slope `A_d` of a flat punch of radius 1 on a layer.
///
/// * `thickness`: h \[R\]
/// * `shear_wave_speed`: c_s \[c_p\]
///
/// # Errors
///
/// A parameter that is not positive, `c_s ≥ 1`, or a layer so thin, `h·c_s < 0.02`, that the quadrature does not
/// resolve the kernel.
pub fn disc_stiffness(thickness: f64, shear_wave_speed: f64) -> Result<f64, ExactError> {
    let h = positive("thickness", thickness, f64::INFINITY, "h > 0")?;
    let c_s = positive("shear_wave_speed", shear_wave_speed, 1.0, "0 < c_s < 1")?;
    let a = 1.0 / c_s;
    if h < 0.02 * a {
        let bound = "thickness·c_s ≥ 0.02".to_owned();
        return Err(ExactError::OutsideRange { name: "thickness", value: h, bound });
    }
    let (nodes, weights): (Vec<f64>, Vec<f64>) =
        gauss_legendre(NODES).into_iter().map(|(x, w)| (0.5 * a * (x + 1.0), 0.5 * a * w)).unzip();
    let mut matrix = vec![vec![0.0; NODES]; NODES];
    for (row, &t) in matrix.iter_mut().zip(&nodes) {
        for ((entry, &s), &w) in row.iter_mut().zip(&nodes).zip(&weights) {
            *entry = -w / std::f64::consts::PI * (kernel(t - s, h) + kernel(t + s, h));
        }
    }
    for (i, row) in matrix.iter_mut().enumerate() {
        row[i] += 1.0;
    }
    let f = solve(matrix, vec![2.0 / std::f64::consts::PI; NODES]);
    let integral: f64 = f.iter().zip(&weights).map(|(f, w)| f * w).sum();
    Ok(2.0 * h / (a * a) * integral)
}

/// `g(y) = ∫_0^∞ (1 − tanh ξh) cos ξy dξ`
fn kernel(y: f64, h: f64) -> f64 {
    // sum the first terms as they are, until 2nh is well beyond y, then average the partial sums of the rest
    const AVERAGED: usize = 40;
    let term = |n: usize| {
        let p = 2.0 * n as f64 * h;
        let sign = if n % 2 == 1 { 2.0 } else { -2.0 };
        sign * p / (p * p + y * y)
    };
    let direct = (y.abs() / h).ceil() as usize + 10;
    let mut sum: f64 = (1..=direct).map(term).sum();
    let mut partial: Vec<f64> = (0..AVERAGED)
        .map(|m| {
            sum += term(direct + 1 + m);
            sum
        })
        .collect();
    while partial.len() > 1 {
        partial = partial.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    }
    partial[0]
}

/// Nodes and weights of the Gauss–Legendre rule with `n` points on (−1, 1), by Newton's method on the Legendre
/// polynomial; \[AS\] 25.4.29.
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let rule = |i: usize| {
        let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut p, mut before) = (x, 1.0);
            for m in 2..=n {
                let m = m as f64;
                (p, before) = (((2.0 * m - 1.0) * x * p - (m - 1.0) * before) / m, p);
            }
            slope = n as f64 * (x * p - before) / (x * x - 1.0);
            x -= p / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(rule).collect()
}

/// Solves a linear system by Gaussian elimination with row pivoting.
fn solve(mut matrix: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for column in 0..n {
        let larger = |&a: &usize, &b: &usize| matrix[a][column].abs().total_cmp(&matrix[b][column].abs());
        let pivot = (column..n).max_by(larger).expect("there are rows left");
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..n {
            let factor = matrix[row][column] / matrix[column][column];
            let (above, below) = matrix.split_at_mut(row);
            for (entry, pivot) in below[0].iter_mut().zip(&above[column]).skip(column) {
                *entry -= factor * pivot;
            }
            right[row] -= factor * right[column];
        }
    }
    for row in (0..n).rev() {
        let known: f64 = (row + 1..n).map(|k| matrix[row][k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_rule_is_exact_on_polynomials() {
        let rule = gauss_legendre(12);
        for degree in 0..24 {
            let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(degree)).sum();
            let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
            assert!((sum - exact).abs() < 1e-14, "degree {degree}");
        }
    }

    #[test]
    fn kernel_is_its_integral() {
        // g(0) = ln 2/h, and the integral by a fine trapezoidal sum elsewhere
        for h in [0.3, 1.0, 2.0] {
            assert!((kernel(0.0, h) - std::f64::consts::LN_2 / h).abs() < 1e-14 / h);
            for y in [0.4, 1.7, 4.0] {
                let step = 1e-3 / h;
                let sum: f64 = (1..30_000)
                    .map(|m| m as f64 * step)
                    .map(|xi| (1.0 - (xi * h).tanh()) * (xi * y).cos())
                    .sum();
                assert!((kernel(y, h) - step * (sum + 0.5)).abs() < 1e-6, "{h} {y}");
            }
        }
    }

    #[test]
    fn known_value_and_limits() {
        // the paper reads about 1.5
        let value = disc_stiffness(1.0, 0.5).expect("parameters");
        assert!((value - 1.483_765_2).abs() < 1e-7, "{value}");
        // thick layer: a disc on a half-space, F = (4/π)(h/a)·V0·t/h
        let (h, c_s) = (2000.0, 0.4);
        let thick = disc_stiffness(h, c_s).expect("parameters");
        assert!((thick / (4.0 / std::f64::consts::PI * h * c_s) - 1.0).abs() < 1e-3);
        // without shear stiffness only the column under the disc resists
        let column = disc_stiffness(1.0, 0.021).expect("parameters");
        assert!((column - 1.0).abs() < 0.03, "{column}");
        // only h·c_s matters
        let same =
            disc_stiffness(0.5, 0.8).expect("parameters") - disc_stiffness(1.0, 0.4).expect("parameters");
        assert!(same.abs() < 1e-12);
        assert!(disc_stiffness(0.001, 0.5).is_err());
    }
}
