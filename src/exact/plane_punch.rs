//! A plane flat punch at constant velocity, until the waves of its edges meet.
//!
//! Each edge radiates into a field that the wave of the other edge has not reached, so the pressure is that of a half-plane
//! punch: with the distance `1 − |x|` of the nearer edge and `X = (1 − |x|)/c_s` its arrival time,
//!
//! ```text
//! p = V0                                        t < X
//! p = V0·[1 + (2/π)(√s − arctan √s)]            t > X,  s = (t − X)/X
//! F = V0·(1 + c_s·t/2)                          t < 2/c_s
//! ```
//!
//! The first holds until the other edge's wave arrives, `t < 2/c_s − X`, and both until the first reflection,
//! `t < 2h`.

use super::{ExactError, before, layer, positive};

/// A plane flat punch of half-width 1 and infinite mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanePunch {
    velocity: f64,
    shear_wave_speed: f64,
    thickness: f64,
}

impl PlanePunch {
    /// * `velocity`: V0 \[c_p\]
    /// * `shear_wave_speed`: c_s \[c_p\]
    /// * `thickness`: h of a layer \[R\], infinite for a half-space
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, or `c_s ≥ 1`.
    pub fn new(velocity: f64, shear_wave_speed: f64, thickness: f64) -> Result<Self, ExactError> {
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        positive("shear_wave_speed", shear_wave_speed, 1.0, "0 < c_s < 1")?;
        layer(Some(thickness).filter(|h| *h != f64::INFINITY))?;
        Ok(Self { velocity, shear_wave_speed, thickness })
    }

    /// Drag F at time `t` \[Rγc_p² per unit length of half the punch\].
    ///
    /// # Errors
    ///
    /// `t` is not in `0 < t < 2/c_s`, or a reflection has arrived.
    pub fn drag(&self, t: f64) -> Result<f64, ExactError> {
        before((2.0 / self.shear_wave_speed).min(2.0 * self.thickness), t)?;
        Ok(self.velocity * (1.0 + 0.5 * self.shear_wave_speed * t))
    }

    /// Pressure at `x`, `|x| < 1`, at time `t` \[γc_p²\].
    ///
    /// # Errors
    ///
    /// `x` is not under the punch, or `t` is outside the range of the form.
    pub fn pressure(&self, x: f64, t: f64) -> Result<f64, ExactError> {
        let distance = positive("1 - |x|", 1.0 - x.abs(), f64::INFINITY, "|x| < 1")?;
        let arrival = distance / self.shear_wave_speed;
        before((2.0 / self.shear_wave_speed - arrival).min(2.0 * self.thickness), t)?;
        if t <= arrival {
            return Ok(self.velocity);
        }
        let root = ((t - arrival) / arrival).sqrt();
        Ok(self.velocity * (1.0 + 2.0 / std::f64::consts::PI * (root - libm::atan(root))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drag_is_the_integral_of_pressure() {
        for (v, c_s, t) in [(1.0, 0.5, 0.9), (0.3, 0.8, 0.5), (2.0, 0.25, 1.7)] {
            let punch = PlanePunch::new(v, c_s, f64::INFINITY).expect("parameters");
            // ∫_0^1 p dx with 1 − x = c_s·t·y², which takes the square root at the edge away
            let (n, mut sum) = (20_000, 0.0);
            for m in 0..n {
                let y = (m as f64 + 0.5) / n as f64;
                let depth = c_s * t * y * y;
                sum += punch.pressure(1.0 - depth, t).expect("range") * 2.0 * c_s * t * y / n as f64;
            }
            let drag = sum + v * (1.0 - c_s * t);
            assert!((drag - punch.drag(t).expect("range")).abs() < 1e-6 * v, "{drag}");
        }
    }

    #[test]
    fn nothing_before_the_edge_wave_arrives() {
        let punch = PlanePunch::new(0.7, 0.5, f64::INFINITY).expect("parameters");
        assert_eq!(punch.pressure(0.5, 0.999), Ok(0.7));
        assert!(punch.pressure(0.5, 1.2).expect("range") > 0.7);
    }

    #[test]
    fn outside_its_range_it_is_an_error() {
        let punch = PlanePunch::new(1.0, 0.5, 1.0).expect("parameters");
        assert!(punch.drag(2.0).is_err(), "the first reflection is back");
        assert!(punch.pressure(1.0, 1.0).is_err());
        let deep = PlanePunch::new(1.0, 0.5, f64::INFINITY).expect("parameters");
        assert!(deep.pressure(0.5, 3.1).is_err(), "the wave of the other edge is there");
        assert!(deep.drag(4.0).is_err());
    }
}
