//! Slopes of drag and pressure of a plane flat punch on a layer at long times.
//!
//! The plane counterpart of `disc_stiffness`: a strip of half-width `a = R/c_s` on a layer that is isotropic in
//! x/c_s, displaced by `V0·t`, free of stress beside the strip, held at the backing. Mirrored in the surface it is a strip
//! between two parallel plates at ±h, whose field is known by conformal mapping, `ζ = tanh(π(x' + iz)/2h)`, `x' = x/c_s`:
//!
//! ```text
//! k = tanh(πa/2h)      k' = √(1 − k²)
//! A_d = (h/a)·K(k)/K(k')
//! A(x) = π/(2K(k'))·√((1 − τ²)/(k² − τ²))      τ = tanh(πx'/2h)
//! ```
//!
//! with the complete elliptic integral `K(k) = π/(2·agm(1, k'))`. Under a thin layer k' and `k² − τ²` are lost to rounding, so
//! they are not computed as differences: with `x = πa/2h` and `s = πx'/2h`
//!
//! ```text
//! (1 − τ²)/(k² − τ²) = cosh²x/(sinh(x − s)·sinh(x + s)) = (1 + e^{−2x})²/[(1 − e^{−2(x−s)})(1 − e^{−2(x+s)})]
//! K(k) = ln(4/k') for k' → 0,    ln(4/k') = x + ln 2 + ln(1 + e^{−2x})
//! ```
//!
//! and `A_d → 1 + (2 ln 2/π)·h/a`. Both slopes are good to 1e-14 for every thickness.

use std::f64::consts::{LN_2, PI};

/// A strip on a layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripStiffness {
    thickness: f64,
    shear_wave_speed: f64,
    /// `x = πa/2h`
    half_angle: f64,
    /// `agm(1, k)`, that is `π/(2K(k'))`
    mean: f64,
}

/// `x` above which `K(k) = ln(4/k')` to rounding: the error is of the order of `k'²`.
const THIN: f64 = 20.0;

impl StripStiffness {
    /// * `thickness`: h of the layer \[R\]
    /// * `shear_wave_speed`: c_s \[c_p\]
    pub fn new(thickness: f64, shear_wave_speed: f64) -> Self {
        let half_angle = 0.5 * PI / (shear_wave_speed * thickness);
        Self { thickness, shear_wave_speed, half_angle, mean: mean(1.0, half_angle.tanh()) }
    }

    /// `A_d` of the drag `F → A_d·V0·t/h`.
    pub fn drag_slope(&self) -> f64 {
        let x = self.half_angle;
        let width = self.thickness * self.shear_wave_speed;
        if x < THIN {
            // (h/a)·K(k)/K(k') = (h/a)·agm(1, k)/agm(1, k')
            width * self.mean / mean(1.0, 1.0 / x.cosh())
        } else {
            // (h/a)·(2/π)·x = 1
            self.mean * (1.0 + 2.0 / PI * width * (LN_2 + (-2.0 * x).exp().ln_1p()))
        }
    }

    /// `A(x)` of the pressure `p → A(x)·V0·t/h` under the punch, `|x| < 1`.
    pub fn pressure_slope(&self, x: f64) -> f64 {
        let below = |distance: f64| -(-2.0 * self.half_angle * distance).exp_m1();
        let above = 1.0 + (-2.0 * self.half_angle).exp();
        self.mean * above / (below(1.0 - x) * below(1.0 + x)).sqrt()
    }
}

/// The arithmetic-geometric mean; \[AS\] 17.6.1.
fn mean(mut a: f64, mut b: f64) -> f64 {
    while (a - b).abs() > 1e-15 * a {
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;
    use percuss::exact::quadrature::singular_at_ends;

    #[test]
    fn drag_is_the_integral_of_pressure() {
        for (h, c_s) in [(1.0, 0.5), (0.3, 0.8), (5.0, 0.2)] {
            let strip = StripStiffness::new(h, c_s);
            let sum =
                singular_at_ends(1.0, |x, rest| if rest < 1e-13 { 0.0 } else { strip.pressure_slope(x) });
            assert!((sum / strip.drag_slope() - 1.0).abs() < 1e-6, "{sum} {}", strip.drag_slope());
        }
    }

    #[test]
    fn limits() {
        // thin layer: 1 + (2 ln 2/π)·h·c_s, and under the middle a column
        let (h, c_s) = (0.2, 0.5);
        let thin = StripStiffness::new(h, c_s);
        let expected = 1.0 + 2.0 * LN_2 / PI * h * c_s;
        assert!((thin.drag_slope() - expected).abs() < 1e-6);
        assert!((thin.pressure_slope(0.0) - 1.0).abs() < 1e-6);
        // only h·c_s matters, and the profile is even
        let same = StripStiffness::new(0.125, 0.8);
        assert!((same.drag_slope() - thin.drag_slope()).abs() < 1e-14);
        assert_eq!(thin.pressure_slope(0.4), thin.pressure_slope(-0.4));
    }
    #[test]
    fn thin_layers_are_columns_except_at_the_edges() {
        // true to 1e-15: p = 1/√(1 − e^{−πδ/h'}) at the distance δ from the edge, h' = h·c_s, up to e^{−π/h'}
        for (h, c_s, x) in [(0.2, 0.31, 0.9), (0.02, 0.31, 0.99), (1e-3, 0.1, 0.999_9), (1e-6, 0.5, 0.5)] {
            let strip = StripStiffness::new(h, c_s);
            let expected = 1.0 / (1.0 - (-PI * (1.0 - x) / (h * c_s)).exp()).sqrt();
            let slope = strip.pressure_slope(x);
            assert!((slope / expected - 1.0).abs() < 1e-13, "h = {h}, x = {x}: {slope} {expected}");
            assert_eq!(strip.pressure_slope(-x), slope);
        }
        let known = StripStiffness::new(0.2, 0.31).pressure_slope(0.9);
        assert!((known - 1.003_17).abs() < 1e-5, "{known}");
        for (h, c_s) in [(0.02, 0.5), (0.002, 0.5), (1e-9, 0.3), (1e-300, 0.5)] {
            let slope = StripStiffness::new(h, c_s).drag_slope();
            let expected = 1.0 + 2.0 * LN_2 / PI * h * c_s;
            assert!((slope - expected).abs() < 1e-14, "h = {h}: {slope} {expected}");
        }
        // both forms of the drag agree at the limit between them
        let at = |x: f64| StripStiffness::new(0.5 * PI / (0.5 * x), 0.5).drag_slope();
        let (below, above) = (at(THIN * (1.0 - 1e-12)), at(THIN * (1.0 + 1e-12)));
        assert!((below - above).abs() < 1e-13, "{below} {above}");
    }
}
