//! Is linear theory still valid? The largest strain of a run, and the impact velocity it allows.
//!
//! \[KA\], closing estimate: linear elasticity holds while `ε_zz` stays below a limit. In the simplified theory the
//! strain at the surface is the interface stress, `|∂u/∂z| = |p|` in units of γc_p². (The paper's own numbers are
//! twice what its strains give; this is the estimate without that factor.)

/// Largest axial strain at which linear theory is trusted; \[KA\], end of section 4.
pub const STRAIN_LIMIT: f64 = 0.005;

/// A largest value, with its place and time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Peak {
    /// The value.
    pub value: f64,
    /// Step.
    pub step: u64,
    /// Time \[R/c_p\].
    pub time: f64,
    /// Radius \[R\].
    pub r: f64,
    /// Depth \[R\].
    pub z: f64,
}

/// Largest interface stress and axial strain so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Validity {
    velocity: f64,
    /// Largest |p| on the interface \[γc_p²\].
    pub pressure: Peak,
    /// Largest |∂u_z/∂z| on the two faces of the target.
    pub strain: Peak,
}

impl Validity {
    /// Nothing seen yet.
    ///
    /// * `velocity`: V0 of the impact \[c_p\]
    pub fn new(velocity: f64) -> Self {
        Self { velocity, pressure: Peak::default(), strain: Peak::default() }
    }

    /// Takes note of an interface stress `|p|` at `(r, z)`; in the simplified theory the strain is the same number.
    pub fn observe(&mut self, pressure: f64, step: u64, time: f64, place: (f64, f64)) {
        let peak = Peak { value: pressure, step, time, r: place.0, z: place.1 };
        if pressure > self.pressure.value {
            self.pressure = peak;
        }
        self.observe_strain(pressure, step, time, place);
    }

    /// Takes note of an axial strain at `(r, z)`.
    pub fn observe_strain(&mut self, strain: f64, step: u64, time: f64, place: (f64, f64)) {
        if strain > self.strain.value {
            self.strain = Peak { value: strain, step, time, r: place.0, z: place.1 };
        }
    }

    /// Largest impact velocity \[c_p\] at which the strain stays within [`STRAIN_LIMIT`], if everything scales with
    /// V0; infinite if there was no strain.
    pub fn admissible_velocity(&self) -> f64 {
        STRAIN_LIMIT * self.velocity / self.strain.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_without_its_factor_two() {
        // strains 2.5·V0/c_p and c_p = 5000 m/s: 10 m/s, not 21.1 m/s
        let mut validity = Validity::new(1.0);
        validity.observe(2.5, 3, 0.1, (1.0, 0.0));
        assert!((validity.admissible_velocity() * 5000.0 - 10.0).abs() < 1e-12);
    }
}
