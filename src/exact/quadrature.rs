//! Integrals and roots for the closed forms.

use std::f64::consts::PI;

/// Nodes and weights of the Gauss–Legendre rule with `n` points on (a, b), by Newton's method on the Legendre
/// polynomial; \[AS\] 25.4.29.
pub fn gauss_legendre(n: usize, a: f64, b: f64) -> Vec<(f64, f64)> {
    let (middle, half) = (0.5 * (a + b), 0.5 * (b - a));
    let rule = |i: usize| {
        let mut x = libm::cos(PI * (i as f64 + 0.75) / (n as f64 + 0.5));
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
        (middle + half * x, half * (2.0 / ((1.0 - x * x) * slope * slope)))
    };
    (0..n).map(rule).collect()
}

/// Halves the interval from 0 to `high`, with `is_low` true up to a point in it, so many times.
pub(super) fn bisect(mut high: f64, halvings: u32, is_low: impl Fn(f64) -> bool) -> (f64, f64) {
    let mut low = 0.0;
    for _ in 0..halvings {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        *(if is_low(middle) { &mut low } else { &mut high }) = middle;
    }
    (low, high)
}

/// `∫_0^1 f dx` by the trapezoidal rule, refined by two until the relative change is below 1e-11, or there are `most` steps.
///
/// * `ends`: what both ends add to the sum of `n` steps
fn refined((mut n, most): (usize, usize), ends: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let mut sum = ends + (1..n).map(|m| f(m as f64 / n as f64)).sum::<f64>();
    loop {
        let before = sum / n as f64;
        sum += (0..n).map(|m| f((m as f64 + 0.5) / n as f64)).sum::<f64>();
        n *= 2;
        let now = sum / n as f64;
        if (now - before).abs() <= 1e-11 * now.abs() || n >= most {
            return now;
        }
    }
}

/// `∫_0^π f dφ` of a function that is even in φ and has the period 2π: the trapezoidal rule, which converges faster
/// than any power, refined by two until it no longer changes.
///
/// * `stretch`: how much larger than elsewhere f is at φ = π. The substitution `tan φ/2 = √stretch·tan ψ/2`, which keeps the
///   period, makes a pole beside π, `1/(1 + a cos φ)`, as smooth as it can be. f is also given `π − φ`.
pub(super) fn over_half_circle(stretch: f64, mut f: impl FnMut(f64, f64) -> f64) -> f64 {
    let b = stretch.sqrt();
    let mut f = |psi: f64| {
        let (sin, cos) = libm::sincos(0.5 * psi);
        let (phi, rest) = (2.0 * libm::atan2(b * sin, cos), 2.0 * libm::atan2(cos, b * sin));
        f(phi, rest) * b / (cos * cos + b * b * sin * sin)
    };
    PI * refined((8, 1 << 13), 0.5 * (f(0.0) + f(PI)), |x| f(PI * x))
}

/// `∫_0^b f dx` of a function that may be singular at either end, by the substitution `x/b = e^u/(e^u + e^−u)`,
/// `u = (π/2) sinh v` (Takahasi and Mori), with steps refined by two until it no longer changes. `f` is also given
/// `b − x`, without cancellation.
pub fn singular_at_ends(b: f64, mut f: impl FnMut(f64, f64) -> f64) -> f64 {
    const REACH: f64 = 3.6;
    let mut at = |v: f64| {
        let u = 0.5 * PI * libm::sinh(v);
        let (left, right) = (1.0 / (1.0 + libm::exp(-2.0 * u)), 1.0 / (1.0 + libm::exp(2.0 * u)));
        // dx/dv = b·left·right·2·du/dv
        f(b * left, b * right) * b * left * right * PI * libm::cosh(v)
    };
    2.0 * REACH * refined((16, 1 << 11), at(-REACH) + at(REACH), |x| at(REACH * (2.0 * x - 1.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_rule_is_exact_on_polynomials() {
        let rule = gauss_legendre(12, -1.0, 1.0);
        for degree in 0..24 {
            let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(degree)).sum();
            let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
            assert!((sum - exact).abs() < 1e-14, "degree {degree}");
        }
    }

    #[test]
    fn half_circle() {
        // ∫_0^π dφ/(1 + a cos φ) = π/√(1 − a²)
        for a in [0.1, 0.9, 0.999_999] {
            let got = over_half_circle((1.0 + a) / (1.0 - a), |phi, _| 1.0 / (1.0 + a * phi.cos()));
            assert!((got / (PI / (1.0 - a * a).sqrt()) - 1.0).abs() < 1e-10, "{a}");
        }
    }

    #[test]
    fn singular_ends() {
        let root = singular_at_ends(2.0, |x, rest| 1.0 / (x * rest).sqrt());
        assert!((root - PI).abs() < 1e-6, "{root}");
        let log = singular_at_ends(3.0, |x, _| x.ln());
        assert!((log - 3.0 * (3.0_f64.ln() - 1.0)).abs() < 1e-10, "{log}");
    }
}
