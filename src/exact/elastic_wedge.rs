//! A plane wedge whose contact outruns all waves, in the full theory of elasticity.
//!
//! The surface moves with V0 inside `|x| < V*·t`, V* > 1, is at rest outside, and free of shear stress. Its velocity is
//! `V0·2σ/(σ² + ζ²)/s²` in the transforms of `surface_impedance`, σ = 1/V*; times Q, inverted by Cagniard's method, the
//! pole iσ gives the pressure of a plane front and the cut what waves from the apex change:
//!
//! ```text
//! p/V0 = (1 − 2β²σ²)²/√(1 − σ²) + 4β³σ²√(1 − β²σ²)  −  (2σ/π)·∫_1^{t/|x|} J(η) dη/(η² − σ²)
//! ```
//!
//! without the integral for |x| > t. A smooth rigid backing reflects as a mirror: longitudinal and shear waves remain what they
//! are, and each part of the front's pressure returns doubled. Its n-th reflection, `2nh·√(c⁻² − σ²)` after the
//! contact, is seen at `|x| ≥ 2nh·σ/√(c⁻² − σ²)`, for waves of speed c. Waves from the apex return at `t = √(x² + 4h²)`, until
//! when the form holds.
//!
//! Displacement integrated over x obeys the wave equation in z, whatever shear does, so the force on half the wedge is
//!
//! ```text
//! F = V0·V*·[ t + 2·Σ_{m≥1} (t − 2mh) ]        terms with t > 2mh
//! ```

use std::f64::consts::PI;

use super::{
    ExactError, layer, outside, positive, quadrature::singular_at_ends, surface_impedance::SurfaceImpedance,
};

/// A wedge striking an elastic layer or half-space, its contact faster than longitudinal waves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticWedge {
    velocity: f64,
    spread_rate: f64,
    impedance: SurfaceImpedance,
    thickness: Option<f64>,
}

impl ElasticWedge {
    /// * `velocity`: V0 \[c_p\]
    /// * `spread_rate`: V* of `r* = V*·t` \[c_p\]
    /// * `beta`: c_s/c_p
    /// * `thickness`: h of a layer \[R\], `None` for a half-space
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, `V* ≤ 1`, or `β ≥ √3/2`, for which there is no material.
    pub fn new(
        velocity: f64,
        spread_rate: f64,
        beta: f64,
        thickness: Option<f64>,
    ) -> Result<Self, ExactError> {
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        if !(spread_rate > 1.0 && spread_rate.is_finite()) {
            return Err(ExactError::Parameter {
                name: "spread_rate",
                value: spread_rate,
                bound: "V* > 1: the contact must outrun longitudinal waves",
            });
        }
        layer(thickness)?;
        Ok(Self { velocity, spread_rate, impedance: SurfaceImpedance::new(beta)?, thickness })
    }

    /// Pressure at `x` on the surface at time `t` \[γc_p²\]: 0 ahead of the contact, half the jump of a front that
    /// arrives at `t`.
    ///
    /// # Errors
    ///
    /// `t` is negative or not finite, `x` is the tip, where the pressure is infinite, or a wave from the apex
    /// has been reflected to `x`.
    pub fn pressure(&self, x: f64, t: f64) -> Result<f64, ExactError> {
        let x = x.abs();
        if !(t >= 0.0 && t.is_finite()) {
            return outside("t", t, "t ≥ 0");
        }
        if !(x > 0.0 && x.is_finite()) {
            let bound = "|x| > 0: pressure grows without bound towards the tip of a wedge";
            return outside("x", x, bound);
        }
        let depth = self.thickness.map_or(f64::INFINITY, |h| 2.0 * h);
        let end = libm::hypot(x, depth);
        if t >= end {
            return outside("t", t, format!("t < {end} at x = {x}"));
        }
        let slowness = 1.0 / self.spread_rate;
        let (longitudinal, shear) = self.impedance.parts(slowness);
        let mut sum = (longitudinal + shear) * arrived(t, slowness * x);
        for (part, c) in [(longitudinal, 1.0), (shear, self.impedance.beta)] {
            let root = ((1.0 / c - slowness) * (1.0 / c + slowness)).sqrt();
            let mut way = depth;
            // the n-th reflection is seen at x ≥ way·σ/root, at σx + way·root
            while way * slowness <= x * root && arrived(t, slowness * x + way * root) > 0.0 {
                sum += 2.0 * part * arrived(t, slowness * x + way * root);
                way += depth;
            }
        }
        if t > x {
            let gap_ahead = (1.0 - slowness) * (1.0 + slowness);
            let integrate = |c: f64, f: &dyn Fn(f64) -> f64| singular_at_ends(c, |v, _| f(v));
            // η² − σ² = (η² − 1) + (1 − σ²)
            let integral = self.impedance.along_cut(t / x, integrate, |_, gap| 1.0 / (gap + gap_ahead));
            sum -= 2.0 * slowness / PI * integral;
        }
        Ok(self.velocity * sum)
    }

    /// Drag F at time `t` \[Rγc_p² per unit length of half the wedge\].
    ///
    /// # Errors
    ///
    /// `t` is negative or not finite.
    pub fn drag(&self, t: f64) -> Result<f64, ExactError> {
        if !(t >= 0.0 && t.is_finite()) {
            return outside("t", t, "t ≥ 0");
        }
        let way = self.thickness.map_or(f64::INFINITY, |h| 2.0 * h);
        // the number of terms with t > 2mh, and their sum
        let m = (t / way).floor();
        let reflected = m * t - 0.5 * m * (m + 1.0) * if m > 0.0 { way } else { 0.0 };
        Ok(self.velocity * self.spread_rate * (t + 2.0 * reflected))
    }
}

/// Share of a front arriving at `arrival` that is there at `t`: 0, ½ or 1.
fn arrived(t: f64, arrival: f64) -> f64 {
    if (t - arrival).abs() <= 1e-12 * t {
        0.5
    } else if t > arrival {
        1.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASES: [(f64, f64); 7] =
        [(0.3, 2.0), (0.1, 1.3), (0.5, 1.05), (0.577, 1.001), (0.7, 4.0), (0.85, 1.5), (0.5, 30.0)];

    fn half_space(beta: f64, spread_rate: f64) -> ElasticWedge {
        ElasticWedge::new(1.0, spread_rate, beta, None).expect("parameters")
    }

    impl ElasticWedge {
        /// Pressure behind the front, before any other wave arrives.
        fn front_pressure(&self) -> f64 {
            let (longitudinal, shear) = self.impedance.parts(1.0 / self.spread_rate);
            self.velocity * (longitudinal + shear)
        }
    }

    #[test]
    fn front() {
        let p = half_space(0.3, 2.0).front_pressure();
        assert!((p - 1.079_81).abs() < 5e-6, "{p}");
        // a normal impact is plane; a liquid has the Mach factor 1/√(1 − σ²)
        assert!((half_space(0.4, 1e5).front_pressure() - 1.0).abs() < 1e-9);
        assert!((half_space(1e-6, 2.0).front_pressure() - 0.75_f64.sqrt().recip()).abs() < 1e-11);
        let wedge = ElasticWedge::new(0.2, 2.0, 0.3, None).expect("parameters");
        assert_eq!(wedge.pressure(1.0, 0.999), Ok(wedge.front_pressure()));
        assert_eq!(wedge.pressure(-1.0, 0.499), Ok(0.0));
        assert_eq!(wedge.pressure(1.0, 0.5), Ok(0.5 * wedge.front_pressure()));
        // waves from the apex relieve at once
        assert!(wedge.pressure(1.0, 1.01).expect("range") < wedge.front_pressure() - 1e-4);
    }

    #[test]
    fn drag_is_the_integral_of_pressure() {
        // ∫_0^t p dx, with the logarithm at the tip and kinks where S waves arrive, and V0·Q between t and V*·t
        for (beta, spread_rate) in CASES {
            let (wedge, t) = (half_space(beta, spread_rate), 0.7);
            let piece = |from: f64, to: f64| {
                singular_at_ends(to - from, |more, _| wedge.pressure(from + more, t).expect("range"))
            };
            let inner = piece(0.0, beta * t) + piece(beta * t, t);
            let sum = inner + wedge.front_pressure() * (spread_rate - 1.0) * t;
            let drag = wedge.drag(t).expect("range");
            assert!((sum - drag).abs() < 1e-8 * drag, "β = {beta}, V* = {spread_rate}: {sum} {drag}");
        }
    }

    #[test]
    fn the_contact_is_kept() {
        for (beta, spread_rate) in CASES {
            let wedge = half_space(beta, spread_rate);
            for t in (0..120).map(|i| 1.05_f64.powi(i)) {
                let p = wedge.pressure(1.0, t).expect("range");
                assert!(p > 0.0, "β = {beta}, V* = {spread_rate}, t/x = {t}: {p}");
            }
        }
    }

    #[test]
    fn a_layer_reflects_each_part_by_itself() {
        let (beta, spread_rate, h) = (0.4, 1.25, 0.1);
        let layer = ElasticWedge::new(1.0, spread_rate, beta, Some(h)).expect("parameters");
        let (x, slowness) = (5.0, 0.8_f64);
        let (longitudinal, shear) = layer.impedance.parts(slowness);
        let (p, s) = (0.2 * 0.6, 0.2 * (6.25 - 0.64_f64).sqrt());
        for (after, waves) in [(0.5 * p, (0.0, 0.0)), (1.5 * p, (1.0, 0.0)), (s + 0.1 * p, (4.0, 1.0))] {
            let got = layer.pressure(x, slowness * x + after).expect("range");
            let expected = longitudinal * (1.0 + 2.0 * waves.0) + shear * (1.0 + 2.0 * waves.1);
            assert!((got - expected).abs() < 1e-12, "{after}: {got} {expected}");
        }
        // after many of them p grows by twice each part in the time between two of its reflections
        let late = layer.pressure(50.0, 40.0 + 9.0).expect("range");
        let column = longitudinal * 2.0 * 9.0 / p + shear * 2.0 * 9.0 / s;
        assert!((late / column - 1.0).abs() < 0.02, "{late} {column}");
        assert!(layer.pressure(1.0, 1.0198).is_ok() && layer.pressure(1.0, 1.02).is_err());
        // before a reflection, a half-space
        let space = half_space(beta, spread_rate);
        assert_eq!(layer.pressure(0.05, 0.19), space.pressure(0.05, 0.19));
    }

    #[test]
    fn drag_of_a_layer() {
        let layer = ElasticWedge::new(0.5, 2.0, 0.3, Some(0.25)).expect("parameters");
        for (t, expected) in [(0.4, 0.4), (0.5, 0.5), (0.75, 1.25), (1.25, 1.25 + 2.0 * (0.75 + 0.25))] {
            assert!((layer.drag(t).expect("range") - expected).abs() < 1e-14, "{t}");
        }
        let space = ElasticWedge::new(0.5, 2.0, 0.3, None).expect("parameters");
        assert_eq!(space.drag(3.0), Ok(3.0));
    }

    #[test]
    fn outside_its_range_it_is_an_error() {
        assert!(ElasticWedge::new(1.0, 1.0, 0.5, None).is_err(), "as fast as longitudinal waves");
        assert!(ElasticWedge::new(1.0, f64::INFINITY, 0.5, None).is_err());
        assert!(
            ElasticWedge::new(1.0, 2.0, 0.9, None).is_err()
                && ElasticWedge::new(1.0, 2.0, 0.5, Some(0.0)).is_err()
        );
        let wedge = half_space(0.5, 2.0);
        assert!(wedge.pressure(0.0, 1.0).is_err() && wedge.pressure(1.0, -1.0).is_err());
        assert!(wedge.pressure(f64::NAN, 1.0).is_err() && wedge.drag(f64::NAN).is_err());
    }
}
