//! Lamb's problem: displacement of the surface of an elastic half-space under a line load.
//!
//! A pressure `p = P(t)·δ(x)` on the surface, which is free of shear stress, moves it normally by (Lamb 1904; Cagniard's method,
//! with the contour of the inversion along the cut of Q of `surface_impedance`)
//!
//! ```text
//! u_z(x, 0, t) = (1/πx)·∫_0^t P(t − τ)·Im g(τ/x + i0) dτ
//! g(η) = 1/Q = √(1 − η²)/(β⁴·[(b² − 2η²)² + 4η²·√(1 − η²)·√(b² − η²)])          b = 1/β
//! ```
//!
//! g is real below η = 1, the arrival of longitudinal waves, and has a pole at `1/c_R`, Rayleigh waves, where the integral is a principal
//! value. P is a polynomial while it lasts, so P·g is analytic above the real axis, and a half circle from one end
//! of the pulse to the other gives the same without a singularity.
//!
//! Cancellation in the bracket costs `(t/x)²` in relative accuracy, which is 1e-13 where they are comparable.

use std::f64::consts::PI;

use percuss::exact::quadrature::singular_at_ends;

use super::complex::Complex;

/// Coefficients of a smooth pulse of height 1, `256·s⁴(1 − s)⁴`, s = t/T.
pub const SMOOTH_PULSE: [f64; 9] = [0.0, 0.0, 0.0, 0.0, 256.0, -1024.0, 1536.0, -1024.0, 256.0];

/// A pulse on a line of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamb {
    beta: f64,
    duration: f64,
    pulse: Vec<f64>,
}

impl Lamb {
    /// * `beta`: c_s/c_p
    /// * `duration`: T \[R/c_p\]
    /// * `pulse`: coefficients c_n of the force per length `P = Σ c_n·(t/T)^n`, `0 < t < T` \[Rγc_p²\], 0 later. The
    ///   displacement is continuous if P vanishes at both ends.
    pub fn new(beta: f64, duration: f64, pulse: &[f64]) -> Self {
        Self { beta, duration, pulse: pulse.to_vec() }
    }

    /// Displacement u_z of the surface, along the load positive, at `x ≠ 0` and time `t` \[R\].
    pub fn displacement(&self, x: f64, t: f64) -> f64 {
        let x = x.abs();
        if t <= x { 0.0 } else { self.along_ellipse(x, t, 1.0) }
    }

    /// The integral over half an ellipse; its `height` is that of a circle times this, and the result does not depend on it.
    fn along_ellipse(&self, x: f64, t: f64, height: f64) -> f64 {
        // g is real on the part of the way before x, where the pulse may as well begin
        let first = (t - self.duration).max(0.0);
        let (middle, radius) = (0.5 * (t + first), 0.5 * (t - first));
        let integral = singular_at_ends(PI, |phi, rest| {
            let (sin, cos) = if phi < rest { phi.sin_cos() } else { (rest.sin(), -rest.cos()) };
            // τ = middle − radius·cos φ + i·height·radius·sin φ; t − τ without its cancellation at φ = π
            let to_end = if phi < rest { 1.0 + cos } else { 2.0 * (0.5 * rest).sin().powi(2) };
            let since = Complex { re: radius * to_end, im: -height * radius * sin };
            let tau = Complex { re: middle - radius * cos, im: height * radius * sin };
            let slope = Complex { re: radius * sin, im: height * radius * cos };
            (self.force(since) * self.response(tau * (1.0 / x)) * slope).im
        });
        integral / (PI * x)
    }

    /// `P(t)`
    fn force(&self, t: Complex) -> Complex {
        let s = t * (1.0 / self.duration);
        self.pulse.iter().rev().fold(Complex::from(0.0), |sum, &c| sum * s + c)
    }

    /// `g(η)` for Im η ≥ 0, continued from real η < 1.
    fn response(&self, eta: Complex) -> Complex {
        let beta = self.beta;
        // √(c² − η²) = √(c − η)·√(c + η): principal values, continuous above the real axis
        let root = |c: f64| (-eta + c).sqrt() * (eta + c).sqrt();
        let (y, longitudinal) = (eta * eta * (beta * beta), root(1.0));
        let factor = y * -2.0 + 1.0;
        // β⁴·[…], with β²b² = 1
        let bracket = factor * factor + y * 4.0 * longitudinal * root(1.0 / beta) * (beta * beta);
        longitudinal / bracket
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use percuss::exact::surface_impedance::SurfaceImpedance;

    const BETAS: [f64; 4] = [0.2, 0.5, 0.577_350_269_189_625_8, 0.8];

    /// Of Rayleigh waves.
    fn speed(lamb: &Lamb) -> f64 {
        SurfaceImpedance::new(lamb.beta).expect("a material").rayleigh_speed()
    }

    fn pulse(beta: f64, duration: f64) -> Lamb {
        Lamb::new(beta, duration, &SMOOTH_PULSE)
    }

    #[test]
    fn the_contour_does_not_matter() {
        for beta in BETAS {
            let lamb = pulse(beta, 0.4);
            let rayleigh = 1.0 / speed(&lamb);
            for t in [1.01, 1.2, 1.0 / beta, rayleigh - 0.1, rayleigh, rayleigh + 0.2, rayleigh + 0.4, 8.0] {
                let values = [0.5, 1.0, 2.0].map(|height| lamb.along_ellipse(1.0, t, height));
                for value in values {
                    assert!((value - values[1]).abs() < 1e-10, "β = {beta}, t = {t}: {values:?}");
                }
            }
        }
    }

    #[test]
    fn before_rayleigh_waves_it_is_the_integral_along_the_axis() {
        for beta in BETAS {
            let lamb = pulse(beta, 0.7);
            let b = 1.0 / beta;
            let rayleigh = 1.0 / speed(&lamb);
            for t in [1.1, 0.5 * (1.0 + b), 0.5 * (b + rayleigh)] {
                // Im g between 1 and t, with a kink at b
                let first = (t - 0.7_f64).max(1.0);
                let piece = |from: f64, to: f64| {
                    singular_at_ends(to - from, |more, _| {
                        let tau = from + more;
                        let force = lamb.force(Complex::from(t - tau)).re;
                        force * lamb.response(Complex { re: tau, im: 0.0 }).im
                    })
                };
                let kink = b.clamp(first, t);
                let expected = (piece(first, kink) + piece(kink, t)) / PI;
                let got = lamb.displacement(1.0, t);
                assert!((got - expected).abs() < 1e-9, "β = {beta}, t = {t}: {got} {expected}");
            }
        }
    }

    #[test]
    fn the_surface_moves_as_much_as_it_is_pushed() {
        // u_z integrated over x obeys the wave equation in z: ∫u dx = ∫P dt, for all x; both halves are equal
        for beta in BETAS {
            let (lamb, t, area) = (pulse(beta, 0.5), 0.8, 0.5 * 256.0 / 630.0);
            // kinks of the fronts of beginning and end of the pulse
            let c_r = speed(&lamb);
            let mut ends: Vec<f64> =
                [1.0, beta, c_r].iter().flat_map(|c| [c * t, c * (t - 0.5)]).chain([1e-7]).collect();
            ends.sort_by(f64::total_cmp);
            let piece = |ends: &[f64]| {
                singular_at_ends(ends[1] - ends[0], |more, _| lamb.displacement(ends[0] + more, t))
            };
            let sum: f64 = ends.windows(2).map(piece).sum();
            assert!((2.0 * sum / area - 1.0).abs() < 2e-5, "β = {beta}: {} {area}", 2.0 * sum);
        }
    }

    #[test]
    fn arrivals() {
        let lamb = pulse(0.5, 0.1);
        assert_eq!(lamb.displacement(2.0, 2.0), 0.0);
        // longitudinal waves lift the surface, as a liquid pressed down rises beside
        assert!(lamb.displacement(2.0, 2.05) < 0.0);
        // Rayleigh waves carry the same pulse to any distance, at c_R; no other wave does
        let c_r = speed(&lamb);
        let at = |x: f64, since: f64| lamb.displacement(x, x / c_r + since);
        for since in [0.02, 0.035, 0.09, 0.12] {
            let (near, far) = (at(300.0, since), at(600.0, since));
            assert!((near / far - 1.0).abs() < 0.01 && far.abs() > 0.05, "{since}: {near} {far}");
        }
        // that pulse is the Hilbert transform of P, odd about its middle
        assert!((at(600.0, 0.03) + at(600.0, 0.07)).abs() < 1e-3 && at(600.0, 0.05).abs() < 1e-3);
        let at = |x: f64| lamb.displacement(x, x + 0.05);
        assert!((at(100.0) / at(10.0)).abs() < 0.1);
    }

    #[test]
    fn scaling_and_symmetry() {
        // no length but those of place and pulse, and a force per length needs none
        let (a, b) = (pulse(0.5, 0.4), pulse(0.5, 1.2));
        for t in [1.3, 2.2, 4.0] {
            let (a, b) = (a.displacement(1.0, t), b.displacement(-3.0, 3.0 * t));
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
        let double: Vec<f64> = SMOOTH_PULSE.iter().map(|c| 2.0 * c).collect();
        let twice = Lamb::new(0.5, 0.4, &double).displacement(1.0, 2.2);
        assert!((twice - 2.0 * a.displacement(1.0, 2.2)).abs() < 1e-13);
    }
}
