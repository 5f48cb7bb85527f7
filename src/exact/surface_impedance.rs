//! Pressure against normal velocity of the free surface of an elastic half-space: the function from which the closed forms
//! of the full theory follow.
//!
//! A surface free of shear stress that moves with `v·e^{sτ + iskx}` needs the pressure `p = Q(k)·v`; with `ζ = k` the wave
//! number per unit of s, b = 1/β, and units of the crate (Lamb 1904; Achenbach, *Wave propagation in elastic solids*,
//! 7.2)
//!
//! ```text
//! Q(ζ) = β⁴·[(2ζ² + b²)² − 4ζ²·√(ζ² + 1)·√(ζ² + b²)] / √(ζ² + 1)        Q(0) = 1      Q → 2β²(1 − β²)·ζ
//! ```
//!
//! The difference loses its digits for large ζ. With `y = β²ζ²` it is
//!
//! ```text
//! β⁴·[…] = N/D      N = 16(1 − β²)y³ + (24 − 16β²)y² + 8y + 1      D = (2y + 1)² + 4y·√(y + β²)·√(y + 1)
//! ```
//!
//! whose terms are positive. On the imaginary axis, `ζ = iη + 0`, η a slowness along the surface, Q is real up to η = 1; beyond, where longitudinal
//! waves arrive, `Im Q = −J`:
//!
//! ```text
//! J(η) = (1 − 2β²η²)²/√(η² − 1)                                            1 < η < b
//! J(η) = [(1 − 2β²η²)² − 4β⁴η²·√(η² − 1)·√(η² − b²)]/√(η² − 1)             η > b
//! ```
//!
//! J changes its sign at the slowness `1/c_R` of Rayleigh waves.

use super::{ExactError, positive, quadrature::bisect};

/// Q of a half-space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceImpedance {
    /// β
    pub(super) beta: f64,
}

impl SurfaceImpedance {
    /// * `beta`: β = c_s/c_p, below √3/2, where the bulk modulus vanishes
    pub fn new(beta: f64) -> Result<Self, ExactError> {
        Ok(Self { beta: positive("beta", beta, 0.75_f64.sqrt(), "0 < β < √3/2")? })
    }

    /// `2β²(1 − β²)`, the factor of ζ for short waves: that of a static half-space.
    pub fn stiffness(&self) -> f64 {
        2.0 * self.beta * self.beta * (1.0 - self.beta) * (1.0 + self.beta)
    }

    /// Speed c_R of Rayleigh waves \[c_p\]: the root `0 < c < β` of
    /// `ξ³ − 8ξ² + (24 − 16β²)ξ − 16(1 − β²) = 0`, `ξ = c²/β²` (Rayleigh 1885).
    pub fn rayleigh_speed(&self) -> f64 {
        let m = self.beta * self.beta;
        let cubic = |x: f64| ((x - 8.0) * x + 24.0 - 16.0 * m) * x - 16.0 * (1.0 - m);
        // −16(1 − β²) at 0 and 1 at 1
        let (low, high) = bisect(1.0, 60, |x| cubic(x) < 0.0);
        self.beta * (0.5 * (low + high)).sqrt()
    }

    /// `Q(ζ)` for real ζ.
    pub fn at(&self, zeta: f64) -> f64 {
        let m = self.beta * self.beta;
        let y = m * zeta * zeta;
        let n = ((16.0 * (1.0 - m) * y + 24.0 - 16.0 * m) * y + 8.0) * y + 1.0;
        let d = (2.0 * y + 1.0).powi(2) + 4.0 * y * ((y + m) * (y + 1.0)).sqrt();
        n / (d * libm::hypot(zeta, 1.0))
    }

    /// `(1/ζ)·d ln Q/dζ` for real ζ: finite at 0, and `1/ζ²` for large ζ.
    pub(super) fn logarithmic_slope(&self, zeta: f64) -> f64 {
        let m = self.beta * self.beta;
        let y = m * zeta * zeta;
        let n = ((16.0 * (1.0 - m) * y + 24.0 - 16.0 * m) * y + 8.0) * y + 1.0;
        let n_slope = (48.0 * (1.0 - m) * y + 48.0 - 32.0 * m) * y + 8.0;
        let root = ((y + m) * (y + 1.0)).sqrt();
        let d = (2.0 * y + 1.0).powi(2) + 4.0 * y * root;
        let d_slope = 8.0 * y + 4.0 + 4.0 * root + 2.0 * y * (2.0 * y + 1.0 + m) / root;
        // y' = 2β²ζ
        2.0 * m * (n_slope / n - d_slope / d) - 1.0 / (zeta * zeta + 1.0)
    }

    /// `Q(iη)` for `0 ≤ η < 1`, its parts that longitudinal and shear waves carry:
    /// `(1 − 2β²η²)²/√(1 − η²)` and `4β³η²·√(1 − β²η²)`.
    pub(super) fn parts(&self, eta: f64) -> (f64, f64) {
        let y = (self.beta * eta).powi(2);
        let longitudinal = (1.0 - 2.0 * y).powi(2) / ((1.0 - eta) * (1.0 + eta)).sqrt();
        (longitudinal, 4.0 * self.beta * y * (1.0 - y).sqrt())
    }

    /// `∫_1^end J(η)·weight dη`, the weight given η and `η² − 1`.
    ///
    /// * `integrate`: `∫_0^c f(v) dv` of a function that is smooth inside; `η = e^{v²}` and `η = b·e^{v²}` take the square
    ///   roots at 1 and b away
    pub(super) fn along_cut(
        &self,
        end: f64,
        integrate: impl Fn(f64, &dyn Fn(f64) -> f64) -> f64,
        weight: impl Fn(f64, f64) -> f64,
    ) -> f64 {
        let (m, b) = (self.beta * self.beta, 1.0 / self.beta);
        let longitudinal = |v: f64| {
            let (eta, gap) = (libm::exp(v * v), libm::expm1(2.0 * v * v));
            // J dη/dv
            (1.0 - 2.0 * m * eta * eta).powi(2) / gap.sqrt() * 2.0 * v * eta * weight(eta, gap)
        };
        let shear = |v: f64| {
            let (eta, over) = (b * libm::exp(v * v), libm::expm1(2.0 * v * v));
            // y = β²η², over = y − 1; −N(−y)/D without the cancellation of large y
            let y = over + 1.0;
            let n = ((16.0 * (m - 1.0) * y + 24.0 - 16.0 * m) * y - 8.0) * y + 1.0;
            let d = (2.0 * y - 1.0).powi(2) + 4.0 * y * ((y - m) * over).sqrt();
            let gap = eta * eta - 1.0;
            n / (d * gap.sqrt()) * 2.0 * v * eta * weight(eta, gap)
        };
        let mut sum = integrate(libm::log(end.min(b)).max(0.0).sqrt(), &longitudinal);
        if end > b {
            sum += integrate(libm::log(end / b).sqrt(), &shear);
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::quadrature::singular_at_ends;

    const BETAS: [f64; 6] = [0.1, 0.3, 0.5, 0.577, 0.707, 0.85];

    #[test]
    fn rayleigh_waves_of_known_materials() {
        // ν = 1/4: ξ = 2 − 2/√3; ν = 0: ξ = 3 − √5; ν = 1/2: c_R/c_s = 0.955313
        let speed = |beta| SurfaceImpedance::new(beta).expect("a material").rayleigh_speed() / beta;
        assert!((speed(3.0_f64.sqrt().recip()) - (2.0 - 2.0 / 3.0_f64.sqrt()).sqrt()).abs() < 1e-15);
        assert!((speed(0.5_f64.sqrt()) - (3.0 - 5.0_f64.sqrt()).sqrt()).abs() < 1e-15);
        assert!((speed(1e-6) - 0.955_312_5).abs() < 1e-6);
        assert!([0.0, 0.9, f64::NAN].iter().all(|beta| SurfaceImpedance::new(*beta).is_err()));
    }

    #[test]
    fn stable_forms_are_those_of_the_text() {
        for beta in BETAS {
            let q = SurfaceImpedance::new(beta).expect("a material");
            let b2 = 1.0 / (beta * beta);
            for zeta in [0.0_f64, 0.2, 1.0, 3.0, 10.0] {
                let z2 = zeta * zeta;
                let bracket = (2.0 * z2 + b2).powi(2) - 4.0 * z2 * ((z2 + 1.0) * (z2 + b2)).sqrt();
                let direct = beta.powi(4) * bracket / (z2 + 1.0).sqrt();
                assert!((q.at(zeta) / direct - 1.0).abs() < 1e-10, "{beta} {zeta}");
                if zeta > 0.0 {
                    let step = 1e-5 * zeta;
                    let slope = (q.at(zeta + step) / q.at(zeta - step)).ln() / (2.0 * step * zeta);
                    assert!((q.logarithmic_slope(zeta) - slope).abs() < 1e-7, "{beta} {zeta}");
                }
            }
            assert!((q.at(1e8) / (1e8 * q.stiffness()) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn values_on_both_axes_belong_to_one_function() {
        // (Q − 1)/ζ² vanishes at infinity, so by Cauchy Q(ζ) = 1 − (2ζ²/π)·∫_1^∞ J(η) dη/(η·(η² + ζ²))
        for beta in BETAS {
            let q = SurfaceImpedance::new(beta).expect("a material");
            let integrate = |c: f64, f: &dyn Fn(f64) -> f64| singular_at_ends(c, |v, _| f(v));
            for zeta in [0.4_f64, 1.0, 4.0] {
                let integral = q.along_cut(1e12, integrate, |eta, _| 1.0 / (eta * (eta * eta + zeta * zeta)));
                let expected = 1.0 - 2.0 * zeta * zeta / std::f64::consts::PI * integral;
                assert!((q.at(zeta) - expected).abs() < 1e-9, "{beta} {zeta}: {} {expected}", q.at(zeta));
            }
            for eta in [0.3_f64, 0.8] {
                let (longitudinal, shear) = q.parts(eta);
                let integral = q.along_cut(1e12, integrate, |x, _| 1.0 / (x * (x * x - eta * eta)));
                let expected = 1.0 + 2.0 * eta * eta / std::f64::consts::PI * integral;
                assert!((longitudinal + shear - expected).abs() < 1e-9, "{beta} {eta}");
            }
        }
    }
}
