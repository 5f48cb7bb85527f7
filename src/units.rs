//! Scales that turn the dimensionless numbers of a run into SI units.
//!
//! Inside and in recordings everything is dimensionless; the scales are stored beside it where they are known.

/// SI values of the units of a run; what the case does not say is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scales {
    /// Length R \[m\].
    pub length: Option<f64>,
    /// Speed c_p \[m/s\].
    pub speed: Option<f64>,
    /// Density γ \[kg/m³\].
    pub density: Option<f64>,
}

impl Scales {
    /// Time R/c_p \[s\].
    pub fn time(&self) -> Option<f64> {
        Some(self.length? / self.speed?)
    }

    /// Stress γc_p² \[Pa\].
    pub fn stress(&self) -> Option<f64> {
        Some(self.density? * self.speed? * self.speed?)
    }

    /// Force πR²γc_p² \[N\].
    pub fn force(&self) -> Option<f64> {
        Some(std::f64::consts::PI * self.length? * self.length? * self.stress()?)
    }

    /// Mass πγR³ \[kg\].
    pub fn mass(&self) -> Option<f64> {
        Some(std::f64::consts::PI * self.density? * self.length?.powi(3))
    }

    /// Names and values of all scales that are known, with their SI unit.
    pub fn known(&self) -> Vec<(&'static str, f64)> {
        let all = [
            ("scale.length_m", self.length),
            ("scale.speed_m_per_s", self.speed),
            ("scale.time_s", self.time()),
            ("scale.density_kg_per_m3", self.density),
            ("scale.stress_pa", self.stress()),
            ("scale.force_n", self.force()),
            ("scale.mass_kg", self.mass()),
        ];
        all.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derived_scales_need_their_parts() {
        let steel = Scales { length: Some(0.01), speed: Some(5000.0), density: Some(8000.0) };
        assert_eq!(steel.time(), Some(2e-6));
        assert_eq!(steel.stress(), Some(2e11));
        assert_eq!(steel.known().len(), 7);
        assert_eq!(Scales { length: None, ..steel }.known().len(), 3);
    }
}
