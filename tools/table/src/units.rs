//! Units of percuss and the prefixes that suit them: one table for the solver and the reader.

/// A unit of percuss.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unit {
    /// Name of the quantity, as it is chosen on the command line.
    pub quantity: &'static str,
    /// Unit of dimensionless numbers.
    pub plain: &'static str,
    /// Unit of the same in SI.
    pub si: &'static str,
    /// Key of the scale in the metadata record of a run, which leads from the first to the second.
    pub scale: &'static str,
}

const fn unit(quantity: &'static str, plain: &'static str, si: &'static str, scale: &'static str) -> Unit {
    Unit { quantity, plain, si, scale }
}

/// Length.
pub const LENGTH: Unit = unit("length", "R", "m", "scale.length_m");
/// Time.
pub const TIME: Unit = unit("time", "R/c_p", "s", "scale.time_s");
/// Frequency.
pub const FREQUENCY: Unit = unit("frequency", "c_p/R", "Hz", "scale.frequency_hz");
/// Speed.
pub const SPEED: Unit = unit("velocity", "c_p", "m/s", "scale.speed_m_per_s");
/// Stress.
pub const STRESS: Unit = unit("stress", "γc_p²", "Pa", "scale.stress_pa");
/// Force.
pub const FORCE: Unit = unit("force", "πR²γc_p²", "N", "scale.force_n");
/// Force per length, of plane cases.
pub const FORCE_PER_LENGTH: Unit = unit("force", "Rγc_p²", "N/m", "scale.force_n_per_m");
/// Energy.
pub const ENERGY: Unit = unit("energy", "πR³γc_p²", "J", "scale.energy_j");
/// Energy per length, of plane cases.
pub const ENERGY_PER_LENGTH: Unit = unit("energy", "R²γc_p²", "J/m", "scale.energy_j_per_m");
/// Density.
pub const DENSITY: Unit = unit("density", "γ", "kg/m³", "scale.density_kg_per_m3");
/// Mass.
pub const MASS: Unit = unit("mass", "πγR³", "kg", "scale.mass_kg");
/// Mass per length, of plane cases.
pub const MASS_PER_LENGTH: Unit = unit("mass", "γR²", "kg/m", "scale.mass_kg_per_m");

/// Units of what is recorded.
pub const RECORDED: [Unit; 8] =
    [LENGTH, TIME, SPEED, STRESS, FORCE, FORCE_PER_LENGTH, ENERGY, ENERGY_PER_LENGTH];

/// Prefixes with their powers of ten.
pub const PREFIXES: [(i32, &str); 9] =
    [(-12, "p"), (-9, "n"), (-6, "µ"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G"), (12, "T")];

/// The prefix with which a number in an SI unit has one to three digits before the point: its power of ten and its letter. Speeds
/// and densities have none, as mm/s and km/s are read less easily, and long times stay in seconds.
///
/// * `rounding`: what a number may be less than the next prefix to be that, relative to it
pub fn prefix(number: f64, unit: &str, rounding: f64) -> (i32, &'static str) {
    let is_bare = unit == SPEED.si || unit == DENSITY.si || number == 0.0 || !number.is_finite();
    let fits = |&&(power, _): &&(i32, &str)| {
        number.abs() >= 10f64.powi(power) * (1.0 - rounding) && (unit != TIME.si || power <= 0)
    };
    if is_bare { (0, "") } else { PREFIXES.iter().rev().find(fits).copied().unwrap_or(PREFIXES[0]) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_one_to_three_digits_before_the_point() {
        for (number, unit, found) in [
            (1.5e-5, "s", (-6, "µ")),
            (1e3 * (1.0 - 1e-15), "N", (3, "k")),
            (5e3, "s", (0, "")),
            (-2e6, "Pa", (6, "M")),
            (2e-15, "m", (-12, "p")),
            (5e4, "m/s", (0, "")),
            (0.0, "m", (0, "")),
            (f64::NAN, "m", (0, "")),
        ] {
            assert_eq!(prefix(number, unit, 1e-12), found, "{number} {unit}");
        }
        assert_eq!(prefix(999.96, "N", 5e-5), (3, "k"));
    }
}
