//! Pressure on the axis under a paraboloid with prescribed motion, in both theories.
//!
//! The surface moves with V0 inside `r*² = k·t`, is held outside (\[KA\] Eq. 10, 15), and in the full theory is free of shear stress. A wave
//! of speed c along the surface that has been under way for the time Z contributes
//!
//! ```text
//! R = √(k² + 4c²kt + 4c⁴Z²)      q = (R − 2c²Z)/k      T = kt + 2Z²c² − ZR      for t > Z
//! ```
//!
//! In the full theory, with c = 1 for longitudinal waves and c = β for shear waves, `Z = d/c` over the distances d, `2mh + z` and `2(m+1)h − z`,
//! \[KA\] Eq. 16 is
//!
//! ```text
//! p(z, t) = V0·[ Σ_P (1 + 8β²T/k²)²·k/R  −  (16β³/k²) Σ_S T·q²·k/R ]
//! ```
//!
//! \[KA\] prints `(2m+1)h − z`; its Eq. 14 and causality give this. `q = √(1 + 4c²T/k²)` and `1 − 2c²Z/R = qk/R` have been used. In
//! the simplified theory the Hankel–Laplace image of the pressure is
//!
//! ```text
//! p = (P/s)·f·cosh P(h − z)/sinh Ph      P = √(s² + β²ξ²),  f = V0·(k/2s²)·exp(−ξ²k/4s)
//! cosh P(h − z)/sinh Ph = Σ_d e^{−dP}
//! ```
//!
//! whose inversion on the axis, wave by wave, with c = β and Z = d, is
//!
//! ```text
//! p(z, t) = V0·Σ q²·k/R     on the surface of a half-space V0·√(1 + 4β²t/k)
//! ```

use super::{ExactError, layer, positive, stack::Stack};
use crate::model::ModelKind;

/// A paraboloid striking a layer or half-space with prescribed motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paraboloid {
    model: ModelKind,
    velocity: f64,
    curvature: f64,
    beta: f64,
    thickness: Option<f64>,
}

impl Paraboloid {
    /// * `velocity`: V0 \[c_p\]
    /// * `curvature`: k of `r*² = k·t` \[R·c_p\]
    /// * `beta`: β = c_s/c_p
    /// * `thickness`: h of a layer \[R\], `None` for a half-space
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, `β ≥ 1`, or in the full theory `β ≥ √3/2`, for which there is no material.
    pub fn new(
        model: ModelKind,
        velocity: f64,
        curvature: f64,
        beta: f64,
        thickness: Option<f64>,
    ) -> Result<Self, ExactError> {
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        positive("curvature", curvature, f64::INFINITY, "k > 0")?;
        match model {
            ModelKind::Rakhmatulin => positive("shear_wave_speed", beta, 1.0, "0 < c_s < 1")?,
            ModelKind::Elastic => positive("beta", beta, 0.75_f64.sqrt(), "0 < β < √3/2")?,
        };
        layer(thickness)?;
        Ok(Self { model, velocity, curvature, beta, thickness })
    }

    /// Pressure −σ_zz on the axis at depth `z` and time `t` \[γc_p²\]; half the jump of a front that arrives at `t`.
    ///
    /// # Errors
    ///
    /// `t` is negative or not finite, or `z` is not in the target.
    pub fn axis_pressure(&self, z: f64, t: f64) -> Result<f64, ExactError> {
        let Self { beta, curvature: k, .. } = *self;
        let stack = Stack::single(beta, self.thickness)?;
        // over waves of the speed c that are this much faster through the target than along its surface
        let sum = |c: f64, depth: f64, term: &dyn Fn(&Wave) -> f64| -> Result<f64, ExactError> {
            let paths = stack.arrived(z, depth * t)?.into_iter();
            Ok(paths.map(|(d, share)| share * term(&Wave::new(k, c, d / depth, t))).sum())
        };
        // q²·k/R
        let simplified = |wave: &Wave| wave.q * wave.q * k / wave.root;
        Ok(self.velocity
            * match self.model {
                ModelKind::Rakhmatulin => sum(beta, 1.0, &simplified)?,
                ModelKind::Elastic => {
                    // (1 + 8β²T/k²)²·k/R
                    let longitudinal = sum(1.0, 1.0, &|wave| {
                        let factor = 1.0 + 8.0 * beta * beta * wave.t / (k * k);
                        factor * factor * k / wave.root
                    })?;
                    let shear = sum(beta, beta, &|wave| wave.t * wave.q * wave.q * k / wave.root)?;
                    longitudinal - 16.0 * beta.powi(3) / (k * k) * shear
                }
            })
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
    use crate::model::ModelKind::{Elastic, Rakhmatulin};

    /// Pressures on the axis at places and times.
    fn pressures<const N: usize>(
        (model, v, k, beta, h): (ModelKind, f64, f64, f64, Option<f64>),
        at: [(f64, f64); N],
    ) -> [f64; N] {
        let form = Paraboloid::new(model, v, k, beta, h).expect("parameters");
        at.map(|(z, t)| form.axis_pressure(z, t).expect("range"))
    }

    #[test]
    fn values_worked_out_independently() {
        let table = [(0.5, 0.15003), (1.9, 0.2484), (2.1, 0.2699), (3.0, 0.3277), (5.0, 0.4666)];
        let found = pressures((Elastic, 0.1, 0.2, 0.5, Some(1.0)), table.map(|(t, _)| (0.0, t)));
        for ((t, expected), p) in table.into_iter().zip(found) {
            assert!((p - expected).abs() <= if t < 1.0 { 5e-6 } else { 5e-5 }, "t = {t}: {p}");
        }
    }

    #[test]
    fn limits() {
        for model in [Rakhmatulin, Elastic] {
            for (v, k, beta, h) in [(0.1, 0.2, 0.5, 1.0), (1.0, 2.5, 0.3, 0.4), (0.7, 1.0, 0.8, 3.0)] {
                let (z, t) = (0.3 * h, 1.99 * h);
                let at = [(0.0, 1e-12), (z, 0.999 * z), (z, 1.001 * z), (0.0, t), (0.0, 1.01 * t)];
                let [first, ahead, behind, early, late] = pressures((model, v, k, beta, Some(h)), at);
                let space = pressures((model, v, k, beta, None), at);
                // t → 0+: plane impact, p = V0; nothing at depth z before its time
                assert!((first / v - 1.0).abs() < 1e-9 && ahead == 0.0 && behind > 0.0);
                // before the first reflection a layer is a half-space
                assert!(early == space[3] && late != space[4]);
                // lengths by 3 at fixed speeds: times by 3, k by 3, the same pressure
                let three =
                    pressures((model, v, 3.0 * k, beta, Some(3.0 * h)), at.map(|(z, t)| (3.0 * z, 3.0 * t)));
                assert!((three[4] - late).abs() < 1e-13 && (three[2] - behind).abs() < 1e-9);
                if model == Rakhmatulin {
                    let root = v * (1.0 + 4.0 * beta * beta * t / k).sqrt();
                    assert!((early - root).abs() < 1e-14 * root);
                    // the first front steps up by 2·V0·q²·k/R
                    let front = [2.0 * h * (1.0 - 1e-10), 2.0 * h * (1.0 + 1e-10)].map(|t| (0.0, t));
                    let [before, after] = pressures((model, v, k, beta, Some(h)), front);
                    let wave = Wave::new(k, beta, 2.0 * h, 2.0 * h);
                    let jump = 2.0 * v * wave.q * wave.q * k / wave.root;
                    assert!((after - before - jump).abs() < 1e-9 * v);
                }
            }
        }
    }

    #[test]
    fn without_shear_stiffness_it_is_a_rod_or_a_liquid() {
        // simplified: p = V0·(1 + 2·number of reflections)
        let rod = pressures((Rakhmatulin, 0.5, 1.0, 1e-9, Some(1.0)), [(0.0, 1.0), (0.0, 3.0), (0.0, 9.5)]);
        assert!(rod.iter().zip([0.5, 1.5, 4.5]).all(|(p, expected)| (p - expected).abs() < 1e-12), "{rod:?}");
        // full: p = V0·Σ k/R, a liquid
        let (v, k, h, t) = (0.5, 0.7, 0.9, 2.0);
        let [p] = pressures((Elastic, v, k, 1e-6, Some(h)), [(0.0, t)]);
        let term = |d: f64| k / (k * k + 4.0 * k * t + 4.0 * d * d).sqrt();
        let expected = v * (term(0.0) + 2.0 * term(2.0 * h));
        assert!((p / expected - 1.0).abs() < 1e-9, "{p} {expected}");
    }

    #[test]
    fn continuous_at_shear_fronts() {
        // the shear terms vanish at their front as T does: p is continuous there
        let at = [-1e-9, 1e-9].map(|step| (0.3, 0.6 + step));
        let [before, after] = pressures((Elastic, 1.0, 0.4, 0.5, None), at);
        assert!((before - after).abs() < 1e-7);
    }

    #[test]
    fn outside_its_range_it_is_an_error() {
        assert!(Paraboloid::new(Rakhmatulin, 1.0, 1.0, 1.0, None).is_err());
        assert!(Paraboloid::new(Rakhmatulin, 1.0, f64::NAN, 0.5, None).is_err());
        assert!(Paraboloid::new(Elastic, 1.0, 1.0, 0.9, None).is_err(), "no such material");
        assert!(Paraboloid::new(Elastic, 1.0, 0.0, 0.5, None).is_err());
        let valid = Paraboloid::new(Elastic, 1.0, 1.0, 0.5, Some(1.0)).expect("parameters");
        assert!(valid.axis_pressure(0.0, -1.0).is_err() && valid.axis_pressure(1.1, 1.0).is_err());
    }
}
