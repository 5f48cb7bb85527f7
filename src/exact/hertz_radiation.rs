//! Impact of a ball on a half-space or a thin plate: the contact of Hertz with the energy that waves carry away.
//!
//! # A half-space
//!
//! A force F on a point of a half-space moves the surface there, beside its static depth, by what waves of low frequency do. From the pressure
//! `Q(ζ)` that a surface moving with `v·e^{sτ + iskx}` needs, `k = ζs` ([`surface_impedance`](super::surface_impedance)), the displacement under a force `F(s)` is
//!
//! ```text
//! u = F/(2π)·∫_0^∞ k dk/(s·Q(k/s)) = static − s·F·D + …      D = (1/2π)·∫_0^∞ [1/S − ζ/Q(ζ)] dζ,  S = lim Q/ζ
//! ```
//!
//! in units of γ and c_p, so the contact of Hertz is pressed in by `w + D·F'` where the ball has moved by w. To first order in D, with `F = k·(w + D·F')^(3/2)`, `k = (4/3)E*√ρ`,
//!
//! ```text
//! M·ẅ = −F      F = k·w^(3/2) + D·(9/4)·k²·w·ẇ
//! ```
//!
//! until F is 0. The energy `D·∫F'² dt` leaves with the waves: S. C. Hunter, J. Mech. Phys. Solids 5 (1957) 162; J. Reed, J. Phys. D 18 (1985) 2329;
//! D for ν = 1/4 is the power that G. F. Miller and H. Pursey, Proc. R. Soc. A 233 (1955) 55, have for a small vibrator. Where the ball is the nose of another
//! half-space, waves run into both: E* is that of both moduli, and D the sum of both ([`force_with_radiation`]).
//!
//! # A thin plate
//!
//! Under a force at a point a thin plate without end moves with `u̇ = F/Z`, `Z = 8√(Bγh)`, `B = E·h³/(12(1 − ν²))`, as bending waves carry the rest
//! away. With the indentation w, `F = k·w^(3/2)`, and the velocity V of the ball
//!
//! ```text
//! M·V̇ = −F      ẇ = V − F/Z
//! ```
//!
//! which in units of the time `T = (M/(k√V0))^(2/5)` and of V0·T is `σ̈ + (1 + λ d/dτ)σ^(3/2) = 0` with the parameter of inelasticity `λ = M/(ZT)`: C. Zener,
//! Phys. Rev. 59 (1941) 669. His λ, `(π^(3/5)/√3)·(ρ/h)²·(V0/v)^(1/5)·(γ_ball/γ)^(3/5)·(E*_ball/(E*_ball + E*_plate))^(2/5)`, `v² = E/(γ(1 − ν²))` of the plate, is this
//! one for whole spheres; there the plate is 2h thick.

use std::f64::consts::PI;

use serde::Serialize;

use super::{ExactError, hertz::Hertz, quadrature::gauss_legendre, surface_impedance::SurfaceImpedance};

/// Points of the rule that integrates D: its error is below 1e-11.
const POINTS: usize = 64;
/// Steps per time of contact without radiation.
const STEPS: usize = 20_000;
/// Times of contact without radiation after which a ball that still touches does not come back.
const LONGEST: usize = 20;

/// What an impact comes to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Impact {
    /// Largest force \[πR²γc_p²\].
    pub force: f64,
    /// Its time \[R/c_p\].
    pub peak_time: f64,
    /// Time of contact \[R/c_p\].
    pub duration: f64,
    /// Largest contact radius, that of the largest force \[R\].
    pub contact_radius: f64,
    /// Velocity after over velocity before.
    pub restitution: f64,
}

/// `D`: velocity of the surface at a point per rate of the rate of a force on it, without its static part \[1/(γc_p³)\].
///
/// * `beta`: c_s/c_p
///
/// # Errors
///
/// `beta` is not in `0 < β < √3/2`.
pub fn radiation(beta: f64) -> Result<f64, ExactError> {
    let surface = SurfaceImpedance::new(beta)?;
    // ζ = x/(1 − x)
    let part = |(x, weight): (f64, f64)| {
        let rest = 1.0 - x;
        weight / (rest * rest) * (1.0 / surface.stiffness() - x / rest / surface.at(x / rest))
    };
    Ok(gauss_legendre(POINTS, 0.0, 1.0).into_iter().map(part).sum::<f64>() / (2.0 * PI))
}

/// Force of the contact of Hertz of bodies that waves leave, `k·w^(3/2) + D·(9/4)·k²·w·ẇ` \[πR²γc_p²\].
///
/// * `stiffness`: k, the force at `w = 1` without waves, see [`Hertz::force`]
/// * `radiation`: D, the sum of those of the bodies \[1/(γc_p³)\]
/// * `depth`, `speed`: w, by which the bodies have come closer, and its rate
pub fn force_with_radiation(stiffness: f64, radiation: f64, depth: f64, speed: f64) -> f64 {
    let depth = depth.max(0.0);
    // in units of the crate a force has the factor 1/π
    let resistance = 2.25 * PI * radiation * stiffness * stiffness * depth;
    (stiffness * depth * depth.sqrt() + resistance * speed).max(0.0)
}

/// Impact of a ball on a half-space of the full theory.
///
/// * `hertz`: the ball, and the contact of both
/// * `beta`: c_s/c_p of the half-space
///
/// # Errors
///
/// `beta` is not in `0 < β < √3/2`.
pub fn on_half_space(hertz: &Hertz, beta: f64) -> Result<Impact, ExactError> {
    let (stiffness, radiation) = (hertz.force(1.0), radiation(beta)?);
    let force = |[depth, speed]: [f64; 2]| force_with_radiation(stiffness, radiation, depth, speed);
    let impact = integrate(hertz, force, |state| [state[1], -force(state) / hertz.mass]);
    Ok(impact.expect("a half-space takes little energy"))
}

/// Impact of a ball on a thin plate without end; `None` if the plate takes so much that the ball hardly comes back.
///
/// * `hertz`: the ball, and the contact of both
/// * `impedance`: Z of the plate at a point \[πR²γc_p\]
pub fn on_plate(hertz: &Hertz, impedance: f64) -> Option<Impact> {
    let force = |[depth, _]: [f64; 2]| hertz.force(depth.max(0.0));
    integrate(hertz, force, |state| [state[1] - force(state) / impedance, -force(state) / hertz.mass])
}

/// Zener's λ of a ball on a thin plate.
///
/// * `impedance`: Z of the plate at a point \[πR²γc_p\]
pub fn inelasticity(hertz: &Hertz, impedance: f64) -> f64 {
    let time = libm::pow(hertz.mass / (hertz.force(1.0) * hertz.velocity.sqrt()), 0.4);
    hertz.mass / (impedance * time)
}

/// Integrates indentation and velocity of the ball until there is no force, by the method of Runge and Kutta.
fn integrate(
    hertz: &Hertz,
    force: impl Fn([f64; 2]) -> f64,
    slope: impl Fn([f64; 2]) -> [f64; 2],
) -> Option<Impact> {
    let dt = hertz.duration() / STEPS as f64;
    let (mut state, mut peak, mut peak_time) = ([0.0, hertz.velocity], 0.0, 0.0);
    for step in 1..=LONGEST * STEPS {
        let after = |step: f64, slope: [f64; 2]| [0, 1].map(|i| state[i] + step * slope[i]);
        let k1 = slope(state);
        let k2 = slope(after(0.5 * dt, k1));
        let k3 = slope(after(0.5 * dt, k2));
        let k4 = slope(after(dt, k3));
        state = after(dt, [0, 1].map(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0));
        let (time, now) = (step as f64 * dt, force(state));
        if now > peak {
            (peak, peak_time) = (now, time);
        }
        if now <= 0.0 {
            let depth = (peak / hertz.force(1.0)).cbrt().powi(2);
            return Some(Impact {
                force: peak,
                peak_time,
                duration: time,
                contact_radius: hertz.contact_radius(depth),
                restitution: -state[1] / hertz.velocity,
            });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radiated_power_is_that_of_miller_and_pursey() {
        // ν = 1/4: 4.836 in units of π³f²a⁴p²/(γc_p³), of a disc of radius a with the pressure p·cos 2πft; (2πf)²·D·(πa²p)²/2
        let power = 2.0 * PI * radiation(3.0_f64.sqrt().recip()).expect("a material");
        assert!((power / 4.836 - 1.0).abs() < 2e-4, "{power}");
    }

    #[test]
    fn a_slow_impact_is_that_of_hertz_and_loses_what_its_force_radiates() {
        let (rho, mass, beta) = (1.5, 4.0, 0.45);
        let mut errors = Vec::new();
        for velocity in [1e-3, 1e-5] {
            let hertz = Hertz::new(velocity, rho, mass, beta).expect("parameters");
            let found = on_half_space(&hertz, beta).expect("parameters");
            // π·D·∫F'² dt of the motion without radiation
            let n = 4000;
            let dt = hertz.duration() / f64::from(n);
            let force = |k: i32| {
                hertz.force(
                    hertz.motion(f64::from(k).min(f64::from(n) - 1e-9) * dt).expect("in contact").depth,
                )
            };
            let squares: f64 = (0..n).map(|k| (force(k + 1) - force(k)).powi(2) / dt).sum();
            let loss = PI * radiation(beta).expect("a material") * squares;
            let lost = 0.5 * mass * velocity * velocity * (1.0 - found.restitution.powi(2));
            errors.push([
                found.force / hertz.largest_force() - 1.0,
                found.duration / hertz.duration() - 1.0,
                found.contact_radius / hertz.largest_radius() - 1.0,
                lost / loss - 1.0,
            ]);
        }
        // all of them are as V0^(3/5), which is 1/16 from one velocity to the other
        for (fast, slow) in errors[0].iter().zip(&errors[1]) {
            assert!(fast.abs() < 0.1 && slow.abs() < 0.07 * fast.abs() + 1e-4, "{errors:?}");
        }
    }

    /// A small λ takes what a force of the time course of Hertz does in a plate, `∫F² dt/Z`; a large one stops the ball.
    #[test]
    fn a_plate_takes_the_work_of_the_force_on_it() {
        let (mass, velocity) = (4.0, 0.02);
        let hertz = Hertz::new(velocity, 1.5, mass, 0.45).expect("parameters");
        let n = 4000;
        let dt = hertz.duration() / f64::from(n);
        let force = |k: i32| hertz.force(hertz.motion(f64::from(k) * dt).expect("in contact").depth);
        let squares: f64 = (0..n).map(|k| force(k).powi(2) * dt).sum();
        let impedance = 1e4 * mass / hertz.duration();
        let found = on_plate(&hertz, impedance).expect("a rebound");
        let lost = 0.5 * mass * velocity * velocity * (1.0 - found.restitution.powi(2));
        assert!((lost * impedance / squares - 1.0).abs() < 1e-3, "{lost} {}", squares / impedance);
        assert!((found.force / hertz.largest_force() - 1.0).abs() < 1e-3, "{found:?}");
        assert_eq!(on_plate(&hertz, 1e-6 * impedance), None);
    }
}
