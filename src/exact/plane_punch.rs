//! A plane flat punch at constant velocity, in both theories.
//!
//! As long as the wave of either edge has not reached the other edge, the excess of pressure over V0 is the sum of those of two
//! punches with one edge each, a mixed problem that Wiener and Hopf's method solves. With Q of `surface_impedance` factored
//! as `Q(ζ) = Q₊(s)·Q₊(−s)`, `s = iζ`, Q₊ without zeros and poles for Re s > 0, the pressure under an edge is `Q₊(−s)/Q₊(0)`
//! times that of plane impact; inverted along its cut (Cagniard's method), with the distance d from the edge,
//!
//! ```text
//! p/V0 = 1 + Φ(t/(1 − x)) + Φ(t/(1 + x))         Φ(e) = −(1/π)·∫_1^e J(η)/Q₊(η)·dη/η      (0 for e < 1)
//! F/V0 = 1 + C·t                                 C = Q₊'(0)/Q₊(0) = (1/π)·∫_0^∞ (d ln Q/dζ) dζ/ζ
//! ```
//!
//! On the positive axis Poisson's integral over ζ gives Q₊. With `κ = 2β²(1 − β²)` and `E = Q/√(1 + κ²ζ²)`, which is 1 at
//! both ends,
//!
//! ```text
//! Q₊(s) = √(1 + κs)·exp[ (s/π)·∫_0^∞ ln E(ζ)·dζ/(ζ² + s²) ]
//! ```
//!
//! With ζ = e^u the integrand is analytic for |Im u| < π/2, so the trapezoidal rule converges like `e^{−π²/Δu}`.
//! C < 0 for β < 0.34: drag falls at first. The pressure stays positive, down to 0 at x = 0, t = 2 for β → 0, so a unilateral contact is
//! kept. In an axisymmetric punch the drag begins with the slope 2C·V0.
//!
//! The simplified theory has `Q = √(1 + β²ζ²)`, with the arrival time `X = d/β` of the wave of an edge
//!
//! ```text
//! Φ = (2/π)(√s − arctan √s),  s = (t − X)/X      t > X          C = β/2
//! ```
//!
//! where the pressure is given until the wave of the farther edge arrives, t < (2 − d)/β.

use std::f64::consts::PI;

use super::{
    ExactError, before, layer, positive,
    quadrature::{gauss_legendre, singular_at_ends},
    surface_impedance::SurfaceImpedance,
};
use crate::model::ModelKind;

/// Growth rate C of the drag `F = V0·(1 + C·t)` of the full theory \[c_p/R\].
fn growth_rate(beta: f64) -> Result<f64, ExactError> {
    let impedance = SurfaceImpedance::new(beta)?;
    // ζ = x/(1 − x): the integrand is finite at both ends
    let integral = singular_at_ends(1.0, |x, rest| impedance.logarithmic_slope(x / rest) / (rest * rest));
    Ok(integral / PI)
}

/// Step of `u = ln ζ` in Poisson's integral, and how far beyond the scales of Q it goes, where its terms are e^{−3·13} of
/// the largest.
const STEP: f64 = 0.25;
const REACH: f64 = 13.0;

/// Nodes of the integral Φ on either part of the cut.
const NODES: usize = 48;

/// A plane flat punch of half-width 1 and infinite mass.
#[derive(Clone, Debug)]
pub struct PlanePunch {
    velocity: f64,
    /// Time until which the form holds \[R/c_p\]: a wave has crossed the punch, or the first reflection is back.
    pub end_time: f64,
    growth_rate: f64,
    edge: Edge,
}

/// What an edge adds.
#[derive(Clone, Debug)]
enum Edge {
    /// In the simplified theory, by c_s.
    Simplified(f64),
    /// In the full theory.
    Full(Factor),
}

/// The factor Q₊, and what Φ is integrated with.
#[derive(Clone, Debug)]
struct Factor {
    impedance: SurfaceImpedance,
    /// ζ² and `ζ·ln E·Δu/π` of Poisson's integral.
    poisson: Vec<(f64, f64)>,
    /// Rule on (0, 1) for Φ.
    rule: Vec<(f64, f64)>,
}

impl PlanePunch {
    /// * `velocity`: V0 \[c_p\]
    /// * `beta`: c_s/c_p
    /// * `thickness`: h of a layer \[R\], `None` for a half-space
    ///
    /// # Errors
    ///
    /// A parameter that is not positive, `β ≥ 1`, or in the full theory `β ≥ √3/2`, for which there is no material.
    pub fn new(
        model: ModelKind,
        velocity: f64,
        beta: f64,
        thickness: Option<f64>,
    ) -> Result<Self, ExactError> {
        positive("velocity", velocity, f64::INFINITY, "V0 > 0")?;
        layer(thickness)?;
        let (crossing, growth_rate, edge) = match model {
            ModelKind::Rakhmatulin => {
                let c_s = positive("shear_wave_speed", beta, 1.0, "0 < c_s < 1")?;
                (2.0 / c_s, 0.5 * c_s, Edge::Simplified(c_s))
            }
            ModelKind::Elastic => (2.0, growth_rate(beta)?, Edge::Full(Factor::new(beta, (STEP, NODES))?)),
        };
        let end_time = thickness.map_or(crossing, |h| crossing.min(2.0 * h));
        Ok(Self { velocity, end_time, growth_rate, edge })
    }

    /// Drag F at time `t` \[Rγc_p² per unit length of half the punch\].
    ///
    /// # Errors
    ///
    /// `t` is not positive, a wave has crossed the punch, or a reflection has arrived.
    pub fn drag(&self, t: f64) -> Result<f64, ExactError> {
        before(self.end_time, t)?;
        Ok(self.velocity * (1.0 + self.growth_rate * t))
    }

    /// Pressure at `x`, `|x| < 1`, at time `t` \[γc_p²\].
    ///
    /// # Errors
    ///
    /// `x` is not under the punch, or `t` is outside the range of the form.
    pub fn pressure(&self, x: f64, t: f64) -> Result<f64, ExactError> {
        let distance = positive("1 - |x|", 1.0 - x.abs(), f64::INFINITY, "|x| < 1")?;
        let excess = match &self.edge {
            Edge::Simplified(c_s) => {
                let arrival = distance / c_s;
                before((2.0 / c_s - arrival).min(self.end_time), t)?;
                let root = ((t - arrival).max(0.0) / arrival).sqrt();
                2.0 / PI * (root - libm::atan(root))
            }
            Edge::Full(factor) => {
                before(self.end_time, t)?;
                factor.edge(t / distance) + factor.edge(t / (2.0 - distance))
            }
        };
        Ok(self.velocity * (1.0 + excess))
    }
}

impl Factor {
    fn new(beta: f64, (step, nodes): (f64, usize)) -> Result<Self, ExactError> {
        let impedance = SurfaceImpedance::new(beta)?;
        let stiffness = impedance.stiffness();
        let terms = ((2.0 * REACH - libm::log(stiffness)) / step).ceil() as usize;
        let term = |m: usize| {
            let zeta = libm::exp(m as f64 * step - REACH);
            let excess = impedance.at(zeta) / libm::hypot(stiffness * zeta, 1.0);
            (zeta * zeta, zeta * libm::log(excess) * step / PI)
        };
        let poisson = (0..=terms).map(term).collect();
        Ok(Self { impedance, poisson, rule: gauss_legendre(nodes, 0.0, 1.0) })
    }

    /// `Φ(e)`, what one edge adds where its wave has gone on for `e = t/d`.
    fn edge(&self, e: f64) -> f64 {
        if e <= 1.0 {
            return 0.0;
        }
        let integrate =
            |c: f64, f: &dyn Fn(f64) -> f64| self.rule.iter().map(|(x, w)| c * w * f(c * x)).sum();
        -self.impedance.along_cut(e, integrate, |eta, _| 1.0 / (eta * self.at(eta))) / PI
    }

    /// `Q₊(s)`
    fn at(&self, s: f64) -> f64 {
        let sum: f64 = self.poisson.iter().map(|(zeta2, term)| term / (zeta2 + s * s)).sum();
        (1.0 + self.impedance.stiffness() * s).sqrt() * libm::exp(s * sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::ModelKind::{Elastic, Rakhmatulin};

    const BETAS: [f64; 8] = [0.05, 0.1, 0.3, 0.5, 0.6, 0.7, 0.707, 0.85];

    fn half_space(model: ModelKind, beta: f64) -> PlanePunch {
        PlanePunch::new(model, 1.0, beta, None).expect("parameters")
    }

    fn factor(beta: f64, rule: (f64, usize)) -> Factor {
        Factor::new(beta, rule).expect("a material")
    }

    #[test]
    fn growth_rates_worked_out_independently() {
        let table = [
            (0.1, -0.33750, 5e-6),
            (0.2, -0.18478, 5e-6),
            (0.3, -0.047_675, 5e-7),
            (0.4, 0.068_870, 5e-7),
            (0.5, 0.159_664, 6e-7),
            (3.0_f64.sqrt().recip(), 0.208_228, 5e-7),
            (0.6, 0.218_268, 5e-7),
            (0.7, 0.235_400, 6e-7),
        ];
        for (beta, expected, digits) in table {
            let rate = growth_rate(beta).expect("a material");
            assert!((rate - expected).abs() <= digits, "β = {beta}: {rate}");
        }
        // a liquid, Q = 1/√(1 + ζ²)
        assert!((growth_rate(1e-7).expect("a material") + 0.5).abs() < 1e-6);
        assert!(growth_rate(0.0).is_err() && growth_rate(0.87).is_err() && growth_rate(f64::NAN).is_err());
    }

    /// `∫_1^b θ·weight dη`, θ the phase `arctan[4η²√(η² − 1)√(b² − η²)/(b² − 2η²)²]` of Q between 1 and b.
    fn over_phase(beta: f64, weight: impl Fn(f64) -> f64) -> f64 {
        let b = 1.0 / beta;
        singular_at_ends(b - 1.0, |over, rest| {
            let eta = 1.0 + over;
            let roots = (over * (eta + 1.0) * rest * (b + eta)).sqrt();
            (4.0 * eta * eta * roots).atan2((b * b - 2.0 * eta * eta).powi(2)) * weight(eta)
        })
    }

    #[test]
    fn the_same_on_the_other_axis() {
        // the zero of Q at 1/c_R, its branch point at 1 and its phase up to b, instead of its values for real ζ:
        // Q₊ = (1 + c_R·s)/√(1 + s)·exp[(1/π)·∫ θ·(1/η − 1/(η + s)) dη], C its logarithmic slope at 0
        for beta in BETAS {
            let factor = factor(beta, (STEP, NODES));
            let c_r = factor.impedance.rayleigh_speed();
            let expected = c_r - 0.5 + over_phase(beta, |eta| 1.0 / (eta * eta)) / PI;
            let rate = growth_rate(beta).expect("a material");
            assert!((rate - expected).abs() < 1e-10, "β = {beta}: {rate} {expected}");
            for s in [0.7, 1.0, 3.0, 40.0] {
                let phase = over_phase(beta, |eta| s / (eta * (eta + s)));
                let expected = (1.0 + c_r * s) / (1.0 + s).sqrt() * (phase / PI).exp();
                assert!((factor.at(s) / expected - 1.0).abs() < 1e-9, "β = {beta}, s = {s}");
            }
        }
    }

    #[test]
    fn drag_is_the_integral_of_pressure() {
        for beta in BETAS {
            let full = half_space(Elastic, beta);
            for t in [0.4, 1.0, 1.9] {
                check(&full, t, &[t, beta * t, 2.0 - t]);
            }
            // until the wave of the farther edge arrives in the middle
            check(&half_space(Rakhmatulin, beta), 0.9 / beta, &[0.9]);
        }

        /// * `kinks`: distances from the edge at which a wave has just arrived
        fn check(punch: &PlanePunch, t: f64, kinks: &[f64]) {
            // d = y² takes the singularity of the edge away
            let mut ends: Vec<f64> =
                kinks.iter().chain(&[0.0, 1.0]).map(|d| d.clamp(0.0, 1.0).sqrt()).collect();
            ends.sort_by(f64::total_cmp);
            let piece = |ends: &[f64]| -> f64 {
                singular_at_ends(ends[1] - ends[0], |more, _| {
                    let y = (ends[0] + more).max(1e-9);
                    2.0 * y * punch.pressure(1.0 - y * y, t).unwrap_or(1.0)
                })
            };
            let sum: f64 = ends.windows(2).filter(|ends| ends[1] > ends[0]).map(piece).sum();
            let drag = punch.drag(t).expect("range");
            assert!((sum - drag).abs() < 1e-6, "{:?}, t = {t}: {sum} {drag}", punch.edge);
        }
    }

    #[test]
    fn finer_rules_change_nothing() {
        for beta in BETAS {
            let [coarse, fine] = [(STEP, NODES), (0.5 * STEP, 3 * NODES)].map(|rule| factor(beta, rule));
            for e in [1.001, 1.3, 1.0 / beta, 3.0 / beta, 1e3, 1e7] {
                let [coarse, fine] = [&coarse, &fine].map(|factor| factor.edge(e));
                assert!(
                    (coarse - fine).abs() < 1e-10 * (1.0 + fine.abs()),
                    "β = {beta}, {e}: {coarse} {fine}"
                );
            }
        }
    }

    #[test]
    fn the_contact_is_kept() {
        for beta in BETAS {
            let punch = half_space(Elastic, beta);
            for (x, t) in (0..400).map(|i| (f64::from(i % 20) / 20.0, 0.1 * f64::from(i / 20 + 1) - 1e-6)) {
                let p = punch.pressure(x, t).expect("range");
                assert!(p > 0.0, "β = {beta}, x = {x}, t = {t}: {p}");
            }
        }
    }

    #[test]
    fn nothing_before_the_edge_wave_arrives() {
        for (model, arrival) in [(Elastic, 0.5), (Rakhmatulin, 1.0)] {
            let punch = PlanePunch::new(model, 0.7, 0.5, None).expect("parameters");
            assert_eq!(punch.pressure(0.5, 0.999 * arrival), Ok(0.7));
            assert_ne!(punch.pressure(0.5, 1.2 * arrival), Ok(0.7));
            let [right, left] = [0.3, -0.3].map(|x| punch.pressure(x, 1.5).expect("range"));
            assert!(right == left && (right < 0.7) == (model == Elastic), "longitudinal waves relieve");
            assert!(punch.pressure(0.99, 1.0).expect("range") > 1.4, "the edge is singular");
        }
    }

    #[test]
    fn outside_its_range_it_is_an_error() {
        for (model, beta, end) in [(Elastic, 0.5, 2.0), (Rakhmatulin, 0.5, 4.0)] {
            let punch = PlanePunch::new(model, 1.0, beta, Some(0.75)).expect("parameters");
            assert!(punch.drag(1.499).is_ok() && punch.drag(1.5).is_err(), "the first reflection is back");
            assert!(punch.pressure(1.0, 1.0).is_err() && punch.pressure(0.2, 0.0).is_err());
            assert!(half_space(model, beta).drag(end).is_err(), "the wave of the other edge is there");
            assert!(PlanePunch::new(model, 0.0, 0.5, None).is_err());
        }
        assert!(
            half_space(Rakhmatulin, 0.5).pressure(0.5, 3.1).is_err(),
            "the wave of the other edge is there"
        );
        assert!(PlanePunch::new(Elastic, 1.0, 0.9, None).is_err());
    }
}
