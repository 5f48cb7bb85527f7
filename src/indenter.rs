//! The rigid body: mass, displacement and velocity. It knows nothing of shapes, contact or the target.

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
        Self { mass, initial_velocity: velocity, dt, step: 0, depth: 0.0, half_velocity: velocity }
    }

    /// Displacement w^k \[R\].
    pub fn depth(&self) -> f64 {
        self.depth
    }

    /// Displacement w^{k+1} \[R\] if no force acted during this step.
    pub fn free_depth(&self) -> f64 {
        if self.is_driven() {
            // without the rounding of a sum: V0·(k+1)·Δt
            self.initial_velocity * ((self.step + 1) as f64 * self.dt)
        } else {
            self.depth + self.dt * self.half_velocity
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
        let before = self.half_velocity;
        self.depth = if self.is_driven() {
            self.free_depth()
        } else {
            self.half_velocity -= self.dt * drag / self.mass;
            self.depth + self.dt * self.half_velocity
        };
        self.step += 1;
        0.5 * (before + self.half_velocity)
    }

    /// Kinetic energy ½M v² at the current half step \[πR³γc_p²; plane R²γc_p²\]; 0 for a driven indenter, whose
    /// energy is constant.
    pub fn kinetic_energy(&self) -> f64 {
        if self.is_driven() { 0.0 } else { 0.5 * self.mass * self.half_velocity * self.half_velocity }
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
        assert!((3.0 * (1.0 - body.half_velocity) - impulse).abs() < 1e-15);
    }
}
