//! Pressure on the axis under a paraboloid with prescribed motion.
//!
//! The surface moves with V0 inside `r*² = k·t` and is held outside (\[KA\] Eq. 10, 15). In the simplified theory the
//! Hankel–Laplace image of the pressure in a layer is
//!
//! ```text
//! p = (P/s)·f·cosh P(h − z)/sinh Ph      P = √(s² + c_s²ξ²),  f = V0·(k/2s²)·exp(−ξ²k/4s)
//! cosh P(h − z)/sinh Ph = Σ_d e^{−dP}    d = 2mh + z and 2(m+1)h − z
//! ```
//!
//! whose inversion on the axis, wave by wave as in \[KA\] Eq. 16, gives
//!
//! ```text
//! p(z, t) = V0·Σ_{d<t} T_d      T_d = q²·k/R     on the surface T_0 = √(1 + 4c_s²t/k)
//! R = √(k² + 4c_s²kt + 4c_s⁴d²)     q = (R − 2c_s²d)/k
//! ```

use super::{ExactError, distances, layer, positive};

/// A paraboloid striking a layer or half-space of the simplified theory with prescribed motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paraboloid {
    velocity: f64,
    curvature: f64,
    shear_wave_speed: f64,
    thickness: Option<f64>,
}

impl Paraboloid {
    /// * `velocity`: V0 \[c_p\]
    /// * `curvature`: k of `r*² = k·t` \[R·c_p\]
    /// * `shear_wave_speed`: c_s \[c_p\]
    /// * `thickness`: h of a layer \[R\], `None` for a half-space
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, or `c_s ≥ 1`.
    pub fn new(
        velocity: f64,
        curvature: f64,
        shear_wave_speed: f64,
        thickness: Option<f64>,
    ) -> Result<Self, ExactError> {
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        positive("curvature", curvature, f64::INFINITY, "k > 0")?;
        positive("shear_wave_speed", shear_wave_speed, 1.0, "0 < c_s < 1")?;
        layer(thickness)?;
        Ok(Self { velocity, curvature, shear_wave_speed, thickness })
    }

    /// Pressure −σ_zz on the axis at depth `z` and time `t` \[γc_p²\]; half the jump of a front that arrives at `t`.
    ///
    /// # Errors
    ///
    /// `t` is negative or not finite, or `z` is not in the target.
    pub fn axis_pressure(&self, z: f64, t: f64) -> Result<f64, ExactError> {
        let sum: f64 =
            distances(z, self.thickness, t)?.iter().map(|&(d, share)| share * self.term(t, d)).sum();
        Ok(self.velocity * sum)
    }

    /// `T = q²·k/R` of a wave that has travelled the distance `z`.
    fn term(&self, t: f64, z: f64) -> f64 {
        let (k, c2) = (self.curvature, self.shear_wave_speed * self.shear_wave_speed);
        let root = (k * k + 4.0 * c2 * k * t + 4.0 * c2 * c2 * z * z).sqrt();
        let q = (root - 2.0 * c2 * z) / k;
        q * q * k / root
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits() {
        for (v, k, c, h) in [(0.1, 0.2, 0.5, 1.0), (1.0, 2.5, 0.3, 0.4), (0.7, 1.0, 0.9, 3.0)] {
            let layer = Paraboloid::new(v, k, c, Some(h)).expect("parameters");
            let half_space = Paraboloid::new(v, k, c, None).expect("parameters");
            // t → 0+: plane impact, p = V0
            assert!((layer.axis_pressure(0.0, 1e-12).expect("t") / v - 1.0).abs() < 1e-9);
            // before the first reflection the layer is a half-space: V0·√(1 + 4c_s²t/k)
            let t = 1.9 * h;
            let root = v * (1.0 + 4.0 * c * c * t / k).sqrt();
            assert!((layer.axis_pressure(0.0, t).expect("t") - root).abs() < 1e-14 * root);
            assert_eq!(layer.axis_pressure(0.0, t), half_space.axis_pressure(0.0, t));
            // the first front steps up by 2·V0·T_1(Z)
            let (before, after) = (2.0 * h * (1.0 - 1e-10), 2.0 * h * (1.0 + 1e-10));
            let jump =
                layer.axis_pressure(0.0, after).expect("t") - layer.axis_pressure(0.0, before).expect("t");
            assert!((jump - 2.0 * v * layer.term(2.0 * h, 2.0 * h)).abs() < 1e-9 * v);
        }
    }

    #[test]
    fn without_shear_waves_it_is_a_rod() {
        // c_s → 0: p = V0·(1 + 2·number of reflections)
        let rod = Paraboloid::new(0.5, 1.0, 1e-9, Some(1.0)).expect("parameters");
        for (t, fronts) in [(1.0, 0.0), (3.0, 1.0), (9.5, 4.0)] {
            assert!((rod.axis_pressure(0.0, t).expect("t") - 0.5 * (1.0 + 2.0 * fronts)).abs() < 1e-12);
        }
    }

    #[test]
    fn outside_its_range_it_is_an_error() {
        assert!(Paraboloid::new(1.0, 1.0, 1.0, None).is_err());
        assert!(Paraboloid::new(1.0, f64::NAN, 0.5, None).is_err());
        let valid = Paraboloid::new(1.0, 1.0, 0.5, None).expect("parameters");
        assert!(valid.axis_pressure(0.0, -0.1).is_err());
    }
}
