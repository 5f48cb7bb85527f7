//! Impact of a rigid ball on a half-space: the contact of Hertz with the energy that waves carry away.
//!
//! A force F on a point of a half-space moves the surface there, beside its static depth, by what waves of low frequency do. From the pressure
//! `Q(ζ)` that a surface moving with `v·e^{sτ + iskx}` needs, `k = ζs` (`surface_impedance`), the displacement under a force `F(s)` is
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
//! D for ν = 1/4 is the power that G. F. Miller and H. Pursey, Proc. R. Soc. A 233 (1955) 55, have for a small vibrator.

use std::f64::consts::PI;

use percuss::exact::{
    ExactError, hertz::Hertz, quadrature::gauss_legendre_on, surface_impedance::SurfaceImpedance,
};

/// Points of the rule that integrates D: its error is below 1e-11.
const POINTS: usize = 64;

/// Steps per time of contact without radiation.
const STEPS: usize = 20_000;

/// What an impact comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Largest force \[πR²γc_p²\].
    pub force: f64,
    /// Time of contact \[R/c_p\].
    pub duration: f64,
    /// Largest contact radius, that of the largest force \[R\].
    pub contact_radius: f64,
    /// Velocity after over velocity before.
    pub restitution: f64,
}

/// `D`: velocity of the surface at a point per rate of the rate of a force on it, without its static part \[1/(γc_p³)\].
pub fn radiation(beta: f64) -> Result<f64, ExactError> {
    let surface = SurfaceImpedance::new(beta)?;
    // ζ = x/(1 − x)
    let part = |(x, weight): (f64, f64)| {
        let rest = 1.0 - x;
        weight / (rest * rest) * (1.0 / surface.stiffness() - x / rest / surface.at(x / rest))
    };
    Ok(gauss_legendre_on(POINTS, 0.0, 1.0).into_iter().map(part).sum::<f64>() / (2.0 * PI))
}

/// Impact of a ball on a half-space of the full theory, by the method of Runge and Kutta.
///
/// * `velocity`: V0 \[c_p\]
/// * `nose_radius`: ρ \[R\]
/// * `mass`: M \[πγR³\]
/// * `beta`: c_s/c_p
pub fn impact(velocity: f64, nose_radius: f64, mass: f64, beta: f64) -> Result<Impact, ExactError> {
    let hertz = Hertz::new(velocity, nose_radius, mass, beta)?;
    // in units of the crate a force has the factor 1/π
    let (stiffness, radiation) = (hertz.force(1.0), PI * radiation(beta)?);
    let force = |depth: f64, speed: f64| {
        let depth = depth.max(0.0);
        let resistance = 2.25 * radiation * stiffness * stiffness * depth;
        (stiffness * depth * depth.sqrt() + resistance * speed).max(0.0)
    };
    let slope = |[depth, speed]: [f64; 2]| [speed, -force(depth, speed) / mass];
    let dt = hertz.duration() / STEPS as f64;
    let (mut state, mut time, mut peak) = ([0.0, velocity], 0.0, 0.0_f64);
    loop {
        let after = |step: f64, slope: [f64; 2]| [state[0] + step * slope[0], state[1] + step * slope[1]];
        let k1 = slope(state);
        let k2 = slope(after(0.5 * dt, k1));
        let k3 = slope(after(0.5 * dt, k2));
        let k4 = slope(after(dt, k3));
        let mean = [0, 1].map(|i| (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]) / 6.0);
        state = after(dt, mean);
        time += dt;
        let now = force(state[0], state[1]);
        peak = peak.max(now);
        if now <= 0.0 {
            let depth = (peak / stiffness).cbrt().powi(2);
            let contact_radius = hertz.contact_radius(depth);
            return Ok(Impact {
                force: peak,
                duration: time,
                contact_radius,
                restitution: -state[1] / velocity,
            });
        }
    }
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
            let found = impact(velocity, rho, mass, beta).expect("parameters");
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
        println!("{errors:?}");
        // all of them are as V0^(3/5), which is 1/16 from one velocity to the other
        for (fast, slow) in errors[0].iter().zip(&errors[1]) {
            assert!(fast.abs() < 0.1 && slow.abs() < 0.07 * fast.abs() + 1e-4, "{errors:?}");
        }
    }
}
