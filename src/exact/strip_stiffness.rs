//! Slopes of drag and pressure of a plane flat punch on a layer at long times.
//!
//! The plane counterpart of [`super::disc_stiffness`]: a strip of half-width `a = R/c_s` on a layer that is isotropic in
//! x/c_s, displaced by `V0·t`, free of stress beside the strip, held at the backing. Mirrored in the surface it is a strip
//! between two parallel plates at ±h, whose field is known by conformal mapping, `ζ = tanh(π(x' + iz)/2h)`, `x' = x/c_s`:
//!
//! ```text
//! k = tanh(πa/2h)      k' = √(1 − k²)
//! A_d = (h/a)·K(k)/K(k')
//! A(x) = π/(2K(k'))·√((1 − τ²)/(k² − τ²))      τ = tanh(πx'/2h)
//! ```
//!
//! with the complete elliptic integral `K(k) = π/(2·agm(1, k'))`. For a thin layer `A_d → 1 + (2 ln 2/π)·h/a`.

use std::f64::consts::PI;

use super::{ExactError, positive};

/// A strip on a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripStiffness {
    thickness: f64,
    shear_wave_speed: f64,
    /// k and k'
    modulus: f64,
    complement: f64,
}

impl StripStiffness {
    /// * `thickness`: h of the layer \[R\]
    /// * `shear_wave_speed`: c_s \[c_p\]
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, or `c_s ≥ 1`.
    pub fn new(thickness: f64, shear_wave_speed: f64) -> Result<Self, ExactError> {
        let h = positive("thickness", thickness, f64::INFINITY, "h > 0")?;
        let c_s = positive("shear_wave_speed", shear_wave_speed, 1.0, "0 < c_s < 1")?;
        let x = 0.5 * PI / (c_s * h);
        Ok(Self { thickness: h, shear_wave_speed: c_s, modulus: x.tanh(), complement: 1.0 / x.cosh() })
    }

    /// `A_d` of the drag `F → A_d·V0·t/h`.
    pub fn drag_slope(&self) -> f64 {
        // (h/a)·K(k)/K(k') = (h/a)·agm(1, k)/agm(1, k')
        self.thickness * self.shear_wave_speed * mean(1.0, self.modulus) / mean(1.0, self.complement)
    }

    /// `A(x)` of the pressure `p → A(x)·V0·t/h`.
    ///
    /// # Errors
    ///
    /// `x` is not under the punch, `|x| < 1`.
    pub fn pressure_slope(&self, x: f64) -> Result<f64, ExactError> {
        positive("1 - |x|", 1.0 - x.abs(), f64::INFINITY, "|x| < 1")?;
        let half = 0.5 * PI / (self.shear_wave_speed * self.thickness);
        let tau = (half * x).tanh();
        // k − τ = sinh(half·(1 − x))/(cosh half · cosh half·x)
        let below =
            (half * (1.0 - x)).sinh() * (half * (1.0 + x)).sinh() / (half.cosh() * (half * x).cosh()).powi(2);
        Ok(mean(1.0, self.modulus) * ((1.0 - tau * tau) / below).sqrt())
    }
}

/// The arithmetic-geometric mean; \[AS\] 17.6.1.
fn mean(mut a: f64, mut b: f64) -> f64 {
    // k' underflows for layers so thin that the slope is 1 anyway
    if b == 0.0 {
        return 0.0;
    }
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::quadrature::singular_at_ends;

    #[test]
    fn drag_is_the_integral_of_pressure() {
        for (h, c_s) in [(1.0, 0.5), (0.3, 0.8), (5.0, 0.2)] {
            let strip = StripStiffness::new(h, c_s).expect("parameters");
            let sum = singular_at_ends(1.0, |x, rest| {
                if rest < 1e-13 { 0.0 } else { strip.pressure_slope(x).expect("under the punch") }
            });
            assert!((sum / strip.drag_slope() - 1.0).abs() < 1e-6, "{sum} {}", strip.drag_slope());
        }
    }

    #[test]
    fn limits() {
        // thin layer: 1 + (2 ln 2/π)·h·c_s, and under the middle a column
        let (h, c_s) = (0.2, 0.5);
        let thin = StripStiffness::new(h, c_s).expect("parameters");
        let expected = 1.0 + 2.0 * std::f64::consts::LN_2 / PI * h * c_s;
        assert!((thin.drag_slope() - expected).abs() < 1e-6);
        assert!((thin.pressure_slope(0.0).expect("range") - 1.0).abs() < 1e-6);
        // only h·c_s matters, and the profile is even
        let same = StripStiffness::new(0.125, 0.8).expect("parameters");
        assert!((same.drag_slope() - thin.drag_slope()).abs() < 1e-14);
        assert_eq!(thin.pressure_slope(0.4), thin.pressure_slope(-0.4));
        assert!(thin.pressure_slope(1.0).is_err());
        // physics of Fig. 5's plane case
        let paper = StripStiffness::new(1.0, 0.5).expect("parameters");
        assert!((paper.drag_slope() - 1.22).abs() < 2e-3, "{}", paper.drag_slope());
    }
}
