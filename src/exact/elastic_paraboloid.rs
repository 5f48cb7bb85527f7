//! Pressure on the axis under a paraboloid with prescribed motion, in the full theory of elasticity.
//!
//! \[KA\] Eq. 16: the surface moves with V0 inside `r*² = k·t`, is held outside and free of shear stress everywhere. A wave
//! of speed c that has travelled the distance d contributes, with `Z = d/c`,
//!
//! ```text
//! R = √(k² + 4c²kt + 4c⁴Z²)      q = (R − 2c²Z)/k      T = kt + 2Z²c² − ZR      for t > Z
//! p(z, t) = αV0·[ Σ_P (1 + 8β²T/k²)²·k/R  −  (16β³/(αk²)) Σ_S T·q²·k/R ]
//! ```
//!
//! with c = α in the first sum (longitudinal waves) and c = β in the second (shear waves), over the distances `2mh + z`
//! and `2(m+1)h − z`. \[KA\] prints `(2m+1)h − z`; its Eq. 14 and causality give this. `q = √(1 + 4c²T/k²)` and
//! `1 − 2c²Z/R = qk/R` have been used.

use super::{ExactError, distances, layer, positive};

/// A paraboloid striking a layer or half-space of the full theory with prescribed motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElasticParaboloid {
    velocity: f64,
    curvature: f64,
    longitudinal: f64,
    shear: f64,
    thickness: Option<f64>,
}

impl ElasticParaboloid {
    /// * `velocity`: V0
    /// * `curvature`: k of `r*² = k·t`
    /// * `speeds`: α and β of longitudinal and shear waves
    /// * `thickness`: h of a layer, `None` for a half-space
    ///
    /// Any consistent units; with α = 1 those of the crate.
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, or `β ≥ α·√3/2`, for which there is no material.
    pub fn new(
        velocity: f64,
        curvature: f64,
        speeds: (f64, f64),
        thickness: Option<f64>,
    ) -> Result<Self, ExactError> {
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        positive("curvature", curvature, f64::INFINITY, "k > 0")?;
        let (longitudinal, shear) = speeds;
        positive("alpha", longitudinal, f64::INFINITY, "α > 0")?;
        positive("beta", shear, longitudinal * 0.75_f64.sqrt(), "0 < β < α·√3/2")?;
        layer(thickness)?;
        Ok(Self { velocity, curvature, longitudinal, shear, thickness })
    }

    /// Pressure −σ_zz on the axis at depth `z` and time `t` \[γα²\]; half the jump of a front that arrives
    /// at `t`.
    ///
    /// # Errors
    ///
    /// `t` is negative or not finite, or `z` is not in the target.
    pub fn axis_pressure(&self, z: f64, t: f64) -> Result<f64, ExactError> {
        let (alpha, beta, k) = (self.longitudinal, self.shear, self.curvature);
        let sum = |c: f64, term: &dyn Fn(&Wave) -> f64| -> Result<f64, ExactError> {
            let list = distances(z, self.thickness, c * t)?;
            Ok(list.iter().map(|(d, share)| share * term(&Wave::new(k, c, d / c, t))).sum())
        };
        // (1 + 8β²T/k²)²·k/R
        let longitudinal = sum(alpha, &|wave| {
            let factor = 1.0 + 8.0 * beta * beta * wave.t / (k * k);
            factor * factor * k / wave.root
        })?;
        // T·q²·k/R
        let shear = sum(beta, &|wave| wave.t * wave.q * wave.q * k / wave.root)?;
        let share = 16.0 * beta.powi(3) / (alpha * k * k);
        Ok(alpha * self.velocity * (longitudinal - share * shear))
    }
}

/// R, q and T of one wave.
struct Wave {
    root: f64,
    q: f64,
    t: f64,
}

impl Wave {
    fn new(k: f64, c: f64, delay: f64, time: f64) -> Self {
        let c2 = c * c;
        let root = (k * k + 4.0 * c2 * k * time + 4.0 * c2 * c2 * delay * delay).sqrt();
        let q = (root - 2.0 * c2 * delay) / k;
        // T = kt + 2Z²c² − ZR, without its cancellation: q² = 1 + 4c²T/k²
        Self { root, q, t: k * k * (q - 1.0) * (q + 1.0) / (4.0 * c2) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_worked_out_independently() {
        let layer = ElasticParaboloid::new(0.1, 0.2, (1.0, 0.5), Some(1.0)).expect("parameters");
        let table = [
            (0.5, 0.15003, 5e-6),
            (1.9, 0.2484, 5e-5),
            (2.1, 0.2699, 5e-5),
            (3.0, 0.3277, 5e-5),
            (5.0, 0.4666, 5e-5),
        ];
        for (t, expected, digits) in table {
            let p = layer.axis_pressure(0.0, t).expect("range");
            assert!((p - expected).abs() <= digits, "t = {t}: {p}");
        }
    }

    #[test]
    fn limits() {
        for (v, k, alpha, beta, h) in [(0.1, 0.2, 1.0, 0.5, 1.0), (2.0, 1.3, 1.7, 0.4, 0.6)] {
            let layer = ElasticParaboloid::new(v, k, (alpha, beta), Some(h)).expect("parameters");
            let space = ElasticParaboloid::new(v, k, (alpha, beta), None).expect("parameters");
            // t → 0+: plane impact, p = αV0
            let p = layer.axis_pressure(0.0, 1e-12).expect("range");
            assert!((p / (alpha * v) - 1.0).abs() < 1e-9);
            // nothing at depth z before z/α; before the first reflection a layer is a half-space
            let z = 0.3 * h;
            assert_eq!(layer.axis_pressure(z, 0.999 * z / alpha), Ok(0.0));
            assert!(layer.axis_pressure(z, 1.001 * z / alpha).expect("range") > 0.0);
            let t = 1.99 * h / alpha;
            assert_eq!(layer.axis_pressure(0.0, t), space.axis_pressure(0.0, t));
            assert_ne!(layer.axis_pressure(0.0, 1.01 * t), space.axis_pressure(0.0, 1.01 * t));
        }
    }

    #[test]
    fn without_shear_stiffness_it_is_a_liquid() {
        // β → 0: p = αV0·Σ k/R, a liquid of sound speed α
        let (v, k, alpha, h) = (0.5, 0.7, 1.2, 0.9);
        let layer = ElasticParaboloid::new(v, k, (alpha, 1e-6), Some(h)).expect("parameters");
        let t: f64 = 2.0;
        let term = |d: f64| k / (k * k + 4.0 * alpha * alpha * k * t + 4.0 * alpha * alpha * d * d).sqrt();
        let expected = alpha * v * (term(0.0) + 2.0 * term(2.0 * h));
        let p = layer.axis_pressure(0.0, t).expect("range");
        assert!((p / expected - 1.0).abs() < 1e-9, "{p} {expected}");
    }

    #[test]
    fn scaling() {
        // lengths by 3 at fixed speeds: times by 3, k by 3, the same pressure
        let a = ElasticParaboloid::new(0.4, 0.5, (1.0, 0.6), Some(1.0)).expect("parameters");
        let b = ElasticParaboloid::new(0.4, 1.5, (1.0, 0.6), Some(3.0)).expect("parameters");
        for (z, t) in [(0.0, 0.7), (0.25, 2.9), (1.0, 4.4)] {
            let (a, b) =
                (a.axis_pressure(z, t).expect("range"), b.axis_pressure(3.0 * z, 3.0 * t).expect("range"));
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
    }

    #[test]
    fn continuous_at_shear_fronts() {
        // the shear terms vanish at their front as T does: p is continuous there
        let space = ElasticParaboloid::new(1.0, 0.4, (1.0, 0.5), None).expect("parameters");
        let (z, arrival) = (0.3, 0.6);
        let [before, after] =
            [-1e-9, 1e-9].map(|step| space.axis_pressure(z, arrival + step).expect("range"));
        assert!((before - after).abs() < 1e-7);
    }

    #[test]
    fn outside_its_range_it_is_an_error() {
        assert!(ElasticParaboloid::new(1.0, 1.0, (1.0, 0.9), None).is_err(), "no such material");
        assert!(ElasticParaboloid::new(1.0, 0.0, (1.0, 0.5), None).is_err());
        let valid = ElasticParaboloid::new(1.0, 1.0, (1.0, 0.5), Some(1.0)).expect("parameters");
        assert!(valid.axis_pressure(0.0, -1.0).is_err());
        assert!(valid.axis_pressure(1.1, 1.0).is_err());
    }
}
