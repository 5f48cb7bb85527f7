//! Quasistatic impact of a rigid ball on a half-space: the contact of Hertz.
//!
//! Waves are left out: at every moment the contact is that of a ball at rest. So it is in slow impacts, whose contact lasts many
//! times as long as a wave takes across it, and as long as the contact is small against the ball, whose surface is taken as a
//! paraboloid. With the contact modulus of the half-space, `E* = E/(1 − ν²) = 4c_s²(1 − c_s²)` in units of γc_p²,
//!
//! ```text
//! a² = ρw      F = (4/3π)·E*·√ρ·w^(3/2)      p = (2E*/πρ)·√(a² − r²)
//! ```
//!
//! and `M·ẅ = −F` conserves the energy. With the largest depth w_m and φ of `w = w_m·(sin φ)^(4/5)`
//!
//! ```text
//! ½MV0² = (8/15π)·E*·√ρ·w_m^(5/2)      ẇ = V0·cos φ
//! t = (w_m/V0)·∫_0^v (φ/sin φ)^(1/5) dv      φ = v^(5/4)
//! ```
//!
//! until φ = π/2, and the same way back: the contact lasts 2.9433·w_m/V0. K. L. Johnson, *Contact mechanics* (1985), Eq. 4.22 to
//! 4.24, 11.20 to 11.24.

use std::f64::consts::{FRAC_PI_2, PI};

use super::{ExactError, outside, positive, quadrature::gauss_legendre};
use crate::{
    case::Case,
    contact::Rule,
    geometry::Geometry,
    shape::{Tip, hertz_depth},
};

/// Points of the rule that integrates the time: its error is below 1e-11.
const POINTS: usize = 40;

/// A ball of finite mass striking a half-space of the full theory.
#[derive(Clone, Debug, PartialEq)]
pub struct Hertz {
    /// V0 \[c_p\]
    pub velocity: f64,
    /// ρ \[R\]
    pub nose_radius: f64,
    /// M \[πγR³\]
    pub mass: f64,
    modulus: f64,
    /// Largest depth w_m, half-way through \[R\].
    pub largest_depth: f64,
    /// Abscissae and weights on (0, 1).
    rule: Vec<(f64, f64)>,
    /// Half of the time of contact \[w_m/V0\].
    half_time: f64,
}

/// The ball at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motion {
    /// w \[R\]
    pub depth: f64,
    /// ẇ \[c_p\]
    pub velocity: f64,
}

impl Hertz {
    /// * `velocity`: V0 \[c_p\]
    /// * `nose_radius`: ρ \[R\]
    /// * `mass`: M \[πγR³\]
    /// * `beta`: c_s/c_p
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, or `β ≥ √3/2`, for which there is no material.
    pub fn new(velocity: f64, nose_radius: f64, mass: f64, beta: f64) -> Result<Self, ExactError> {
        positive("beta", beta, 0.75_f64.sqrt(), "0 < c_s/c_p < √3/2")?;
        // µ = c_s², ν = (1 − 2c_s²)/(2 − 2c_s²), E* = 2µ/(1 − ν)
        let modulus = 4.0 * beta * beta * (1.0 - beta * beta);
        Self::with_modulus(velocity, nose_radius, mass, modulus)
    }

    /// The same of other bodies.
    ///
    /// * `modulus`: E* of the contact, `1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂` of both \[γc_p²\]
    fn with_modulus(velocity: f64, nose_radius: f64, mass: f64, modulus: f64) -> Result<Self, ExactError> {
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        positive("nose_radius", nose_radius, f64::INFINITY, "ρ > 0")?;
        positive("mass", mass, f64::INFINITY, "M > 0 and finite")?;
        positive("modulus", modulus, f64::INFINITY, "E* > 0")?;
        let largest_depth = hertz_depth(0.5 * mass * velocity * velocity, nose_radius, modulus);
        let rule = gauss_legendre(POINTS, 0.0, 1.0);
        let mut hertz = Self { velocity, nose_radius, mass, modulus, largest_depth, rule, half_time: 0.0 };
        hertz.half_time = hertz.clock(libm::pow(FRAC_PI_2, 0.8));
        Ok(hertz)
    }

    /// The ball of a case, rigid or not, on a half-space of the struck layer; `None` without a ball of finite mass in the full theory, or if its
    /// contact would be wider than the indenter.
    pub fn of(case: &Case) -> Option<Self> {
        Self::of_modulus(case, case.modulus())
    }

    /// The same with another modulus of the contact \[γc_p²\].
    pub(crate) fn of_modulus(case: &Case, modulus: f64) -> Option<Self> {
        let Tip::Round(nose_radius) = case.indenter.head.tip() else { return None };
        let is_free = case.geometry == Geometry::Axisymmetric && case.impact.contact == Rule::Unilateral;
        if !case.model.has_shear() || !is_free {
            return None;
        }
        let (velocity, mass) = (case.impact.velocity, case.indenter.mass);
        let hertz = Self::with_modulus(velocity, nose_radius, mass, modulus).ok()?;
        (hertz.largest_radius() <= case.shape().radius()).then_some(hertz)
    }

    /// Largest force, half-way through \[πR²γc_p²\].
    pub fn largest_force(&self) -> f64 {
        self.force(self.largest_depth)
    }

    /// Time of contact \[R/c_p\].
    pub fn duration(&self) -> f64 {
        2.0 * self.half_time * self.largest_depth / self.velocity
    }

    /// Largest contact radius, half-way through \[R\].
    pub fn largest_radius(&self) -> f64 {
        (self.nose_radius * self.largest_depth).sqrt()
    }

    /// Depth and velocity of the ball at time `t`.
    ///
    /// # Errors
    ///
    /// `t` is negative or later than the contact lasts.
    pub fn motion(&self, t: f64) -> Result<Motion, ExactError> {
        if !(t >= 0.0 && t <= self.duration()) {
            return outside("t", t, format!("0 ≤ t ≤ {}", self.duration()));
        }
        let time = t * self.velocity / self.largest_depth;
        let phase = self.phase(time.min(2.0 * self.half_time - time));
        let (sin, cos) = libm::sincos(phase);
        let depth = self.largest_depth * libm::pow(sin, 0.8);
        Ok(Motion { depth, velocity: if time > self.half_time { -cos } else { cos } * self.velocity })
    }

    /// Contact radius of a depth, `√(ρw)` \[R\].
    pub fn contact_radius(&self, depth: f64) -> f64 {
        (self.nose_radius * depth).sqrt()
    }

    /// Force of a depth \[πR²γc_p²\].
    pub fn force(&self, depth: f64) -> f64 {
        4.0 / (3.0 * PI) * self.modulus * self.nose_radius.sqrt() * depth * depth.sqrt()
    }

    /// Pressure at radius `r` under a depth \[γc_p²\].
    pub fn pressure(&self, r: f64, depth: f64) -> f64 {
        let rest = self.nose_radius * depth - r * r;
        if rest <= 0.0 { 0.0 } else { 2.0 * self.modulus / (PI * self.nose_radius) * rest.sqrt() }
    }

    /// Time at `v = φ^(4/5)` on the way in \[w_m/V0\].
    fn clock(&self, v: f64) -> f64 {
        self.rule.iter().map(|(x, weight)| v * weight * slowness(v * x)).sum()
    }

    /// φ at a time on the way in \[w_m/V0\], by Newton's method: the time is convex in v, so from above it falls to the root.
    fn phase(&self, time: f64) -> f64 {
        // slowness ≥ 1
        let mut v = time.min(libm::pow(FRAC_PI_2, 0.8));
        for _ in 0..30 {
            let step = (self.clock(v) - time) / slowness(v);
            v -= step;
            if step.abs() <= 1e-15 * v {
                break;
            }
        }
        libm::pow(v, 1.25).min(FRAC_PI_2)
    }
}

/// `dt/dv = (φ/sin φ)^(1/5)`, φ = v^(5/4).
fn slowness(v: f64) -> f64 {
    let phase = libm::pow(v, 1.25);
    if phase < 1e-8 { 1.0 } else { libm::pow(phase / libm::sin(phase), 0.2) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball() -> Hertz {
        Hertz::new(0.02, 1.5, 4.0, 0.45).expect("parameters")
    }

    #[test]
    fn the_contact_lasts_as_long_as_johnson_has_it() {
        // ∫_0^1 dx/√(1 − x^(5/2)) = (2/5)·B(2/5, 1/2)
        let beta = 0.4 * libm::tgamma(0.4) * libm::tgamma(0.5) / libm::tgamma(0.9);
        for hertz in [ball(), Hertz::new(1e-4, 0.3, 700.0, 0.6).expect("parameters")] {
            assert!((hertz.half_time / beta - 1.0).abs() < 1e-11, "{}", hertz.half_time);
            assert!((2.0 * hertz.half_time - 2.9433).abs() < 1e-4);
        }
    }

    #[test]
    fn energy_and_momentum_are_those_of_the_ball() {
        let (hertz, mass) = (ball(), 4.0);
        let (mut impulse, n) = (0.0, 4000);
        let dt = hertz.duration() / f64::from(n);
        for k in 0..=n {
            let t = (f64::from(k) * dt).min(hertz.duration());
            let Motion { depth, velocity } = hertz.motion(t).expect("in contact");
            // work of the force from the surface to the depth
            let work = 0.4 * hertz.force(depth) * depth;
            let energy = 0.5 * mass * velocity * velocity + work;
            assert!((energy / (0.5 * mass * 4e-4) - 1.0).abs() < 1e-9, "t = {t}: {energy}");
            impulse += dt * hertz.force(depth);
            // the sum ends half a step later
            let change = mass * (0.02 - velocity) + 0.5 * dt * hertz.force(depth);
            assert!((impulse - change).abs() < 1e-6 * mass * 0.02, "t = {t}: {impulse}, {change}");
        }
        assert!((impulse / (2.0 * mass * 0.02) - 1.0).abs() < 1e-6, "{impulse}");
        assert!(hertz.motion(1.001 * hertz.duration()).is_err());
    }

    #[test]
    fn the_pressure_carries_the_force() {
        let hertz = ball();
        let depth = 0.3 * hertz.largest_depth;
        let (a, n) = (hertz.contact_radius(depth), 20_000);
        let ring = |i: i32| {
            let r = a * (f64::from(i) + 0.5) / f64::from(n);
            2.0 * r * hertz.pressure(r, depth) * a / f64::from(n)
        };
        let carried: f64 = (0..n).map(ring).sum();
        assert!((carried / hertz.force(depth) - 1.0).abs() < 1e-5, "{carried}");
        assert_eq!(hertz.pressure(1.01 * a, depth), 0.0);
    }

    #[test]
    fn parameters_are_checked() {
        assert!(Hertz::new(0.0, 1.0, 1.0, 0.5).is_err());
        assert!(Hertz::new(0.1, 1.0, f64::INFINITY, 0.5).is_err());
        assert!(Hertz::new(0.1, 1.0, 1.0, 0.9).is_err());
    }
}
