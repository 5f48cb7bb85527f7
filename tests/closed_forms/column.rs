//! A layer without shear waves, c_s → 0, under a flat body of finite mass: Saint-Venant's problem of a bar struck at its
//! end.
//!
//! The wave that the body emits returns unchanged from the backing, so with V the velocity of the body
//!
//! ```text
//! p(t) = V(t) + 2·Σ_{m≥1} V(t − 2mh)      M·V' = −p,  V(0) = V0
//! ```
//!
//! In images, with `E = e^{−2hs}` and `μ = 1/M`, `V = V0·(1 − E)·Σ_n E^n·(s − μ)^n/(s + μ)^{n+1}`, whose terms are those of
//! Laguerre polynomials,
//!
//! ```text
//! ℓ_n(t) = e^{−μt}·L_n(2μt) for t > 0
//! V(t) = V0·Σ_n [ℓ_n(t − 2nh) − ℓ_n(t − 2(n+1)h)]      p(t) = V0·Σ_n [ℓ_n(t − 2nh) + ℓ_n(t − 2(n+1)h)]
//! ```
//!
//! A body of infinite mass, μ = 0, gives the steps `p = V0·(1 + 2·⌊t/2h⌋)`. The body sticks to the layer: the form
//! holds for a unilateral contact until p first falls to 0.

/// A layer that carries axial waves alone, and the body on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    velocity: f64,
    inverse_mass: f64,
    thickness: f64,
}

impl Column {
    /// * `velocity`: V0 \[c_p\]
    /// * `mass`: M \[πγR³\], infinite for constant velocity
    /// * `thickness`: h \[R\], infinite for a half-space
    pub fn new(velocity: f64, mass: f64, thickness: f64) -> Self {
        Self { velocity, inverse_mass: 1.0 / mass, thickness }
    }

    /// Velocity V of the body at time `t > 0` \[c_p\].
    pub fn body_velocity(&self, t: f64) -> f64 {
        self.sum(t, -1.0)
    }

    /// Pressure p at time `t > 0` \[γc_p²\], and drag F \[πR²γc_p²\]; at the arrival of a front its value just before.
    pub fn pressure(&self, t: f64) -> f64 {
        self.sum(t, 1.0)
    }

    /// `V0·Σ_n [ℓ_n(t − 2nh) + sign·ℓ_n(t − 2(n+1)h)]`
    fn sum(&self, t: f64, sign: f64) -> f64 {
        let way = 2.0 * self.thickness;
        let mut sum = 0.0;
        for n in 0_u32.. {
            let since = if n == 0 { t } else { t - f64::from(n) * way };
            if since <= 0.0 {
                break;
            }
            sum += self.wave(n, since) + sign * self.wave(n, since - way);
        }
        self.velocity * sum
    }

    /// `ℓ_n(t)`, with the recurrence \[AS\] 22.7.12 of Laguerre polynomials.
    fn wave(&self, n: u32, t: f64) -> f64 {
        if t <= 0.0 {
            return 0.0;
        }
        let x = 2.0 * self.inverse_mass * t;
        let (mut value, mut before) = (1.0, 0.0);
        for m in 0..n {
            let m = f64::from(m);
            (value, before) = (((2.0 * m + 1.0 - x) * value - m * before) / (m + 1.0), value);
        }
        (-self.inverse_mass * t).exp() * value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinite_mass_gives_steps() {
        let column = Column::new(0.7, f64::INFINITY, 0.5);
        for (t, steps) in [(0.3, 0.0), (1.2, 1.0), (4.9, 4.0)] {
            assert!((column.pressure(t) - 0.7 * (1.0 + 2.0 * steps)).abs() < 1e-13);
            assert!((column.body_velocity(t) - 0.7).abs() < 1e-13);
        }
    }

    #[test]
    fn equation_of_motion_and_reflections() {
        for (mass, h) in [(2.0, 0.5), (0.3, 1.0), (9.0, 0.2)] {
            let column = Column::new(1.0, mass, h);
            let v = |t: f64| if t > 0.0 { column.body_velocity(t) } else { 0.0 };
            for t in [0.13, 0.77, 1.61, 3.3] {
                let p = column.pressure(t);
                let waves: f64 = (1..20).map(|m| v(t - 2.0 * f64::from(m) * h)).sum();
                assert!((p - v(t) - 2.0 * waves).abs() < 1e-12, "M={mass} t={t}");
                let slope = (v(t + 1e-6) - v(t - 1e-6)) / 2e-6;
                assert!((mass * slope + p).abs() < 1e-7, "M={mass} t={t}: {slope} {p}");
            }
        }
    }

    #[test]
    fn half_space_is_a_dashpot() {
        // V = V0·e^{−t/M}
        let column = Column::new(2.0, 1.5, f64::INFINITY);
        let expected = 2.0 * (-0.9_f64 / 1.5).exp();
        assert!((column.body_velocity(0.9) - expected).abs() < 1e-14);
        assert!((column.pressure(0.9) - expected).abs() < 1e-14);
    }
}
