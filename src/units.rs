//! Names of the units of a run, and scales that turn its dimensionless numbers into SI units.
//!
//! Inside and in recordings everything is dimensionless; the scales are stored beside it where they are known. Force, mass and
//! energy of a plane run are those of the half x ≥ 0, per unit of length along the strip:
//!
//! | | force | mass | energy |
//! |---|---|---|---|
//! | axisymmetric | πR²γc_p² | πγR³ | πR³γc_p² |
//! | plane | Rγc_p² | γR² | R²γc_p² |

use std::f64::consts::PI;

use crate::grid::Geometry;

/// Unit of force: of drag.
pub fn force(geometry: Geometry) -> &'static str {
    match geometry {
        Geometry::Axisymmetric => "πR²γc_p²",
        Geometry::Plane => "Rγc_p²",
    }
}

/// Unit of energy.
pub fn energy(geometry: Geometry) -> &'static str {
    match geometry {
        Geometry::Axisymmetric => "πR³γc_p²",
        Geometry::Plane => "R²γc_p²",
    }
}

/// SI values of the units of a run; `None` where the case does not state them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Symmetry, which force, mass and energy depend on.
    pub geometry: Geometry,
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

    /// Area that stress acts on to give the unit of force: πR² \[m²\], plane R \[m²/m\].
    fn area(&self) -> Option<f64> {
        let length = self.length?;
        Some(match self.geometry {
            Geometry::Axisymmetric => PI * length * length,
            Geometry::Plane => length,
        })
    }

    /// Force πR²γc_p² \[N\], plane Rγc_p² \[N/m\].
    pub fn force(&self) -> Option<f64> {
        Some(self.area()? * self.stress()?)
    }

    /// Mass πγR³ \[kg\], plane γR² \[kg/m\].
    pub fn mass(&self) -> Option<f64> {
        Some(self.area()? * self.length? * self.density?)
    }

    /// Energy πR³γc_p² \[J\], plane R²γc_p² \[J/m\].
    pub fn energy(&self) -> Option<f64> {
        Some(self.force()? * self.length?)
    }

    /// Names and values of all scales that are known, with their SI unit.
    pub fn known(&self) -> Vec<(&'static str, f64)> {
        let [force, mass, energy] = match self.geometry {
            Geometry::Axisymmetric => ["scale.force_n", "scale.mass_kg", "scale.energy_j"],
            Geometry::Plane => ["scale.force_n_per_m", "scale.mass_kg_per_m", "scale.energy_j_per_m"],
        };
        let all = [
            ("scale.length_m", self.length),
            ("scale.speed_m_per_s", self.speed),
            ("scale.time_s", self.time()),
            ("scale.density_kg_per_m3", self.density),
            ("scale.stress_pa", self.stress()),
            (force, self.force()),
            (mass, self.mass()),
            (energy, self.energy()),
        ];
        all.into_iter().filter_map(|(name, value)| Some((name, value?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derived_scales_need_their_parts() {
        let geometry = Geometry::Axisymmetric;
        let steel = Scales { geometry, length: Some(0.01), speed: Some(5000.0), density: Some(8000.0) };
        assert_eq!(steel.time(), Some(2e-6));
        assert_eq!(steel.stress(), Some(2e11));
        assert_eq!(steel.known().len(), 8);
        assert_eq!(Scales { length: None, ..steel }.known().len(), 3);
    }

    #[test]
    fn plane_runs_are_per_length() {
        let scales =
            |geometry| Scales { geometry, length: Some(0.01), speed: Some(5000.0), density: Some(8000.0) };
        let value = |geometry, name| {
            let known = scales(geometry).known();
            known.into_iter().find(|(known, _)| *known == name).map(|(_, value)| value)
        };
        for (round, plane, expected) in [
            ("scale.force_n", "scale.force_n_per_m", 2e9),
            ("scale.mass_kg", "scale.mass_kg_per_m", 0.8),
            ("scale.energy_j", "scale.energy_j_per_m", 2e7),
        ] {
            let per_length = value(Geometry::Plane, plane).expect("a scale");
            assert!((per_length / expected - 1.0).abs() < 1e-14, "{plane} = {per_length}");
            let whole = value(Geometry::Axisymmetric, round).expect("a scale");
            assert!((whole / (PI * 0.01 * expected) - 1.0).abs() < 1e-14, "{round} = {whole}");
            assert_eq!((value(Geometry::Plane, round), value(Geometry::Axisymmetric, plane)), (None, None));
        }
    }
}
