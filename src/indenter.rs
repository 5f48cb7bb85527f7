//! The rigid body, or the centre of mass of one that gives: mass, displacement and velocity. It knows nothing of shapes, contact or the target.

use std::io;

use serde::{Deserialize, Serialize};

use crate::state::{StateError, StateReader, StateWriter};

/// A rigid indenter moving along z, advanced with the drag on it by the leapfrog scheme
///
/// ```text
/// v^{k+½} = v^{k−½} − Δt·F^k/M        w^{k+1} = w^k + Δt·v^{k+½}
/// ```
///
/// which is \[KA\] Eq. 20 (misprints corrected) in central differences, `w^{−1} = −V0·Δt`.
#[derive(Clone, Debug)]
pub struct Indenter {
    mass: f64,
    initial_velocity: f64,
    dt: f64,
    motion: Motion,
}

/// What changes from step to step.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Motion {
    step: u64,
    depth: f64,
    half_velocity: f64,
}

impl Indenter {
    /// An indenter at the surface, moving into it.
    ///
    /// * `mass`: M \[πγR³; plane γR²\], infinite for constant velocity
    /// * `velocity`: V0 \[c_p\]
    /// * `dt`: time step \[R/c_p\]
    pub fn new(mass: f64, velocity: f64, dt: f64) -> Self {
        let motion = Motion { step: 0, depth: 0.0, half_velocity: velocity };
        Self { mass, initial_velocity: velocity, dt, motion }
    }

    /// Displacement w^k \[R\].
    pub fn depth(&self) -> f64 {
        self.motion.depth
    }

    /// Displacement w^{k+1} \[R\] if no force acted during this step.
    pub fn free_depth(&self) -> f64 {
        if self.is_driven() {
            // without the rounding of a sum: V0·(k+1)·Δt
            self.initial_velocity * ((self.motion.step + 1) as f64 * self.dt)
        } else {
            self.motion.depth + self.dt * self.motion.half_velocity
        }
    }

    /// Decrease of w^{k+1} per unit of drag F^k: `Δt²/M`.
    pub fn compliance(&self) -> f64 {
        self.dt * self.dt / self.mass
    }

    /// True if the velocity is constant at any drag (infinite mass).
    pub fn is_driven(&self) -> bool {
        self.mass.is_infinite()
    }

    /// Advances by one step under the drag F^k \[πR²γc_p²; plane Rγc_p²\] and returns the velocity V^k, the mean of
    /// the velocities before and after it \[c_p\].
    pub fn advance(&mut self, drag: f64) -> f64 {
        let before = self.motion.half_velocity;
        self.motion.depth = if self.is_driven() {
            self.free_depth()
        } else {
            self.motion.half_velocity -= self.dt * drag / self.mass;
            self.motion.depth + self.dt * self.motion.half_velocity
        };
        self.motion.step += 1;
        0.5 * (before + self.motion.half_velocity)
    }

    /// Velocity at the current half step \[c_p\].
    pub fn half_velocity(&self) -> f64 {
        self.motion.half_velocity
    }

    /// Writes what changes from step to step.
    ///
    /// # Errors
    ///
    /// The stream cannot be written.
    pub fn save(&self, out: &mut StateWriter<'_>) -> io::Result<()> {
        out.put(&self.motion)
    }

    /// Restores the state written by [`Indenter::save`].
    ///
    /// # Errors
    ///
    /// The stream cannot be read.
    pub fn load(&mut self, from: &mut StateReader<'_>) -> Result<(), StateError> {
        self.motion = from.get()?;
        Ok(())
    }

    /// Kinetic energy ½M v² at the current half step \[πR³γc_p²; plane R²γc_p²\]; 0 for a driven indenter, whose
    /// energy is constant.
    pub fn kinetic_energy(&self) -> f64 {
        if self.is_driven() {
            0.0
        } else {
            0.5 * self.mass * self.motion.half_velocity * self.motion.half_velocity
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn constant_force_gives_a_parabola() {
        let (mass, v0, force, dt) = (2.0, 0.5, 0.3, 0.01);
        let mut body = Indenter::new(mass, v0, dt);
        for k in 0..100 {
            let t = k as f64 * dt;
            // the sum of the half-step velocities: w^k = V0·t − ½(F/M)·t(t + Δt)
            assert!((body.depth() - (v0 * t - 0.5 * force / mass * t * (t + dt))).abs() < 1e-14);
            let v = body.advance(force);
            assert!((v - (v0 - force / mass * (t + 0.5 * dt))).abs() < 1e-14);
        }
    }

    #[test]
    fn momentum_is_the_impulse() {
        let mut body = Indenter::new(3.0, 1.0, 0.1);
        let impulse: f64 = [0.5, 0.2, -0.1].iter().map(|&f| (body.advance(f), 0.1 * f).1).sum();
        assert!((3.0 * (1.0 - body.motion.half_velocity) - impulse).abs() < 1e-15);
    }
}
