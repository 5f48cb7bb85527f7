//! A point force on a half-space of the full theory with ν = 1/4: displacement of the surface. C. L. Pekeris, *The seismic surface pulse*,
//! Proc. Natl. Acad. Sci. 41 (1955); in the form of H. M. Mooney, Bull. Seismol. Soc. Am. 64 (1974).
//!
//! Under a force P that sets in at t = 0 the displacement into the half-space is, with `τ = c_s·t/r`,
//!
//! ```text
//! w = P/(πµr)·g(τ)        32g = 6 − √3/√(τ² − ¼) − √(3√3+5)/√(γ² − τ²) + √(3√3−5)/√(τ² − δ²)        1/√3 < τ < 1
//!                         16g = 6 − √(3√3+5)/√(γ² − τ²)                                            1 < τ < γ
//!                          8g = 3                                                                 γ < τ
//! ```
//!
//! where `γ² = (3 + √3)/4` is of the Rayleigh wave and `δ² = (3 − √3)/4`.

use std::f64::consts::PI;

/// Ratio of wave speeds c_s/c_p of ν = 1/4.
pub const SPEED_RATIO: f64 = 0.577_350_269_189_625_8;

/// γ and δ.
fn roots() -> [f64; 2] {
    let third = 3f64.sqrt();
    [(0.25 * (3.0 + third)).sqrt(), (0.25 * (3.0 - third)).sqrt()]
}

/// √(3√3+5) and √(3√3−5).
fn factors() -> [f64; 2] {
    let third = 27f64.sqrt();
    [(third + 5.0).sqrt(), (third - 5.0).sqrt()]
}

/// g(τ).
pub fn step(tau: f64) -> f64 {
    let ([gamma, delta], [plus, minus]) = (roots(), factors());
    let rayleigh = |tau: f64| plus / (gamma * gamma - tau * tau).sqrt();
    match tau {
        tau if tau < SPEED_RATIO => 0.0,
        tau if tau < 1.0 => {
            let body = 3f64.sqrt() / (tau * tau - 0.25).sqrt() - minus / (tau * tau - delta * delta).sqrt();
            (6.0 - body - rayleigh(tau)) / 32.0
        }
        tau if tau < gamma => (6.0 - rayleigh(tau)) / 16.0,
        _ => 0.375,
    }
}

/// ∫g dτ from 0 on.
fn integral(tau: f64) -> f64 {
    let ([gamma, delta], [plus, minus]) = (roots(), factors());
    let rayleigh = |tau: f64| 6.0 * tau - plus * (tau / gamma).min(1.0).asin();
    let body = |tau: f64| 3f64.sqrt() * (2.0 * tau).acosh() - minus * (tau / delta).acosh();
    let first = |tau: f64| (rayleigh(tau) - body(tau)) / 32.0;
    let second = |tau: f64| rayleigh(tau) / 16.0;
    match tau {
        tau if tau < SPEED_RATIO => 0.0,
        tau if tau < 1.0 => first(tau) - first(SPEED_RATIO),
        tau if tau < gamma => integral(1.0f64.next_down()) + second(tau) - second(1.0),
        _ => integral(gamma.next_down()) + 0.375 * (tau - gamma),
    }
}

/// Displacement under the pulse `(F/2)(1 − cos 2πt/T)`, `w = ∫F''(s)·∫G dt ds`, in units of R, with c_p = γ = 1 and F per πR²γc_p².
///
/// * `peak`: F
/// * `duration`: T
pub fn cosine(peak: f64, duration: f64, r: f64, t: f64) -> f64 {
    const PARTS: usize = 4000;
    let c_s = SPEED_RATIO;
    let omega = 2.0 * PI / duration;
    let integrated = |t: f64| integral(c_s * t / r) / (c_s * c_s * c_s);
    let end = t.min(duration);
    let part = end / PARTS as f64;
    let of = |i: usize| {
        let s = i as f64 * part;
        let weight = if i == 0 || i == PARTS { 0.5 } else { 1.0 };
        weight * 0.5 * peak * omega * omega * (omega * s).cos() * integrated(t - s)
    };
    (0..=PARTS).map(of).sum::<f64>() * part
}

#[test]
fn the_step_is_that_of_the_tables() {
    let table = [
        (0.58, -0.00576),
        (0.70, -0.00958),
        (0.80, -0.01023),
        (0.90, -0.02850),
        (0.99, -0.08037),
        (1.01, -0.11945),
        (1.05, -0.32834),
        (1.08, -1.17338),
        (1.09, 0.375),
    ];
    for (tau, g) in table {
        assert!((step(tau) - g).abs() < 1e-4 * f64::max(1.0, g.abs()), "{tau}: {}", step(tau));
        let h = 1e-5;
        let slope = (integral(tau + h) - integral(tau - h)) / (2.0 * h);
        assert!((slope - step(tau)).abs() < 1e-5, "{tau}: {slope}");
    }
}
