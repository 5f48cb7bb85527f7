//! Units of a run: dimensionless ones, and SI through the scales of a physical case.
//!
//! Everything is computed in units of R, c_p and γ. A physical case knows what these are, so that its recording is in SI; any other
//! is recorded as computed. Force, mass and energy of a plane run are per unit of length along the strip: dimensionless those of
//! the half x ≥ 0, in SI, where masses are weighed and forces measured, of the whole indenter and its whole contact. So the SI value
//! of a dimensionless 1 is
//!
//! | | force | mass | energy |
//! |---|---|---|---|
//! | axisymmetric, in N, kg, J | πR²γc_p² | πγR³ | πR³γc_p² |
//! | plane, in N/m, kg/m, J/m | 2Rγc_p² | 2γR² | 2R²γc_p² |
//!
//! while the name of the unit of a dimensionless plane run is `Rγc_p²`, `γR²`, `R²γc_p²`.

use std::f64::consts::PI;

use percuss_table::units;

use crate::geometry::Geometry;

/// Standard acceleration of free fall g \[m/s²\]: 3rd General Conference on Weights and Measures, 1901.
pub const STANDARD_GRAVITY: f64 = 9.806_65;

/// Physical dimension of a number in a case or recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Length.
    Length,
    /// Time.
    Time,
    /// Frequency.
    Frequency,
    /// Speed.
    Speed,
    /// Density.
    Density,
    /// Stress, elastic modulus.
    Stress,
    /// Force.
    Force,
    /// Mass.
    Mass,
    /// Energy.
    Energy,
}

/// SI values of the units of a physical case.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Symmetry, which force, mass and energy depend on.
    pub geometry: Geometry,
    /// Length R \[m\].
    pub length: f64,
    /// Speed c_p \[m/s\].
    pub speed: f64,
    /// Density γ \[kg/m³\].
    pub density: f64,
}

impl Scales {
    /// SI value of the unit of a dimension.
    ///
    /// ```text
    /// time R/c_p     stress γc_p²     force A·γc_p²     mass A·γR     energy A·γc_p²R
    /// ```
    ///
    /// with the area A = πR² \[m²\], plane A = 2R \[m²/m\], as the dimensionless numbers are those of the half x ≥ 0.
    pub fn of(&self, dimension: Dimension) -> f64 {
        let Self { length, speed, density, .. } = *self;
        let area = match self.geometry {
            Geometry::Axisymmetric => PI * length * length,
            Geometry::Plane => 2.0 * length,
        };
        let stress = density * speed * speed;
        match dimension {
            Dimension::Length => length,
            Dimension::Time => length / speed,
            Dimension::Frequency => speed / length,
            Dimension::Speed => speed,
            Dimension::Density => density,
            Dimension::Stress => stress,
            Dimension::Force => area * stress,
            Dimension::Mass => area * length * density,
            Dimension::Energy => area * stress * length,
        }
    }

    /// The dimensionless number of an SI value.
    pub fn reduce(&self, dimension: Dimension, si: f64) -> f64 {
        si / self.of(dimension)
    }

    /// An SI value whose dimensionless number is `x`: exactly that one, where there is such a value.
    pub fn expand(&self, dimension: Dimension, x: f64) -> f64 {
        let near = x * self.of(dimension);
        let (mut above, mut below) = (near, near);
        for _ in 0..4 {
            for si in [above, below] {
                if self.reduce(dimension, si) == x {
                    return si;
                }
            }
            (above, below) = (above.next_up(), below.next_down());
        }
        near
    }

    /// Names and values of all scales, as in the record of a run.
    pub fn entries(&self) -> [(&'static str, f64); 8] {
        use Dimension::{Density, Energy, Force, Length, Mass, Speed, Stress, Time};
        [Length, Speed, Time, Density, Stress, Force, Mass, Energy]
            .map(|dimension| (unit(dimension, self.geometry).scale, self.of(dimension)))
    }
}

/// Unit of a recorded quantity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Its name: `γc_p²`, `Pa`.
    pub name: &'static str,
    /// Recorded number of a dimensionless 1; exactly 1 in a dimensionless case.
    pub scale: f64,
}

impl Unit {
    /// That of ratios.
    pub const RATIO: Self = Self { name: "1", scale: 1.0 };

    /// The recorded number of a dimensionless one.
    pub fn of(self, x: f64) -> f64 {
        self.scale * x
    }

    /// True if its numbers are those of the computation.
    pub fn is_dimensionless(self) -> bool {
        self == Self::RATIO || units::RECORDED.iter().any(|unit| unit.plain == self.name)
    }

    /// Which part of the body a force or energy per length is of, to follow its name; empty for all other units.
    pub fn part(self) -> &'static str {
        match self.name {
            "Rγc_p²" | "R²γc_p²" => ", half x >= 0, per length",
            "N/m" | "J/m" => ", both halves, per length",
            _ => "",
        }
    }

    /// A dimensionless number for people: plain with four decimals, or in SI with its unit.
    pub fn text(self, x: f64) -> String {
        self.text_to(4, x)
    }

    /// A dimensionless number for people: plain with so many decimals, or in SI with four digits and its unit.
    pub fn text_to(self, decimals: usize, x: f64) -> String {
        if self.is_dimensionless() { format!("{x:.decimals$}") } else { engineering(self.of(x), self.name) }
    }

    /// The same with the unit of a plain number, too: `1.250 R/c_p`, `52.31 µs`.
    pub fn text_with_unit(self, decimals: usize, x: f64) -> String {
        let text = self.text_to(decimals, x);
        if self.is_dimensionless() { format!("{text} {}", self.name) } else { text }
    }

    /// The same without zeros at the end: `8 γc_p²`, `150 MPa`.
    pub fn short_with_unit(self, x: f64) -> String {
        if self == Self::RATIO {
            return x.to_string();
        }
        if self.is_dimensionless() { format!("{x} {}", self.name) } else { short(self.of(x), self.name) }
    }

    /// The unit in which numbers are best read: its name, and the number in it of a dimensionless 1.
    ///
    /// * `largest`: the largest dimensionless number
    pub fn for_axis(self, largest: f64) -> (String, f64) {
        if self.is_dimensionless() {
            return (self.name.into(), self.scale);
        }
        let (size, prefix) = prefix(self.of(largest), self.name);
        (format!("{prefix}{}", self.name), self.scale / size)
    }

    /// The same of numbers of any size: a plain one as `1.667e-4 c_p`.
    pub fn short_text(self, x: f64) -> String {
        if self.is_dimensionless() { format!("{x:.3e} {}", self.name) } else { self.text(x) }
    }

    /// The same, with all digits of a plain number.
    pub fn full_text(self, x: f64) -> String {
        if self.is_dimensionless() { x.to_string() } else { self.text(x) }
    }
}

/// Units of everything that a run records.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    /// Lengths.
    pub length: Unit,
    /// Times.
    pub time: Unit,
    /// Frequencies.
    pub frequency: Unit,
    /// Velocities.
    pub speed: Unit,
    /// Stresses.
    pub stress: Unit,
    /// Forces.
    pub force: Unit,
    /// Energies.
    pub energy: Unit,
}

impl Units {
    /// Units of a run: SI where its scales are known.
    pub fn new(geometry: Geometry, scales: Option<Scales>) -> Self {
        let unit = |dimension| Unit {
            name: name(dimension, geometry, scales.is_some()),
            scale: scales.map_or(1.0, |scales| scales.of(dimension)),
        };
        use Dimension::{Energy, Force, Frequency, Length, Speed, Stress, Time};
        let [length, time, frequency] = [Length, Time, Frequency].map(unit);
        let [speed, stress, force, energy] = [Speed, Stress, Force, Energy].map(unit);
        Self { length, time, frequency, speed, stress, force, energy }
    }
}

/// An SI value with four digits and its unit with a prefix: `52.31 µs`, `1.204 kN`; speeds and densities without one.
pub fn engineering(si: f64, unit: &str) -> String {
    let digits = |x: f64| {
        let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
        let whole = if rounded == 0.0 { 1.0 } else { rounded.abs().log10().floor() + 1.0 };
        format!("{rounded:.*}", (4.0 - whole).clamp(0.0, 8.0) as usize)
    };
    // the kilogram has a prefix of its own
    let (si, unit) = match unit.strip_prefix('k') {
        Some(gram) if unit == "kg" || unit == "kg/m" => (1e3 * si, gram),
        _ => (si, unit),
    };
    let (size, prefix) = prefix(si, unit);
    format!("{} {prefix}{unit}", digits(si / size))
}

/// The prefix of the unit of an SI value, and its size.
fn prefix(si: f64, unit: &str) -> (f64, &'static str) {
    // four digits of what is a little less than the next prefix are that prefix
    let (power, prefix) = units::prefix(si, unit, 5e-5);
    (10f64.powi(power), prefix)
}

/// The same without the zeros at the end of its digits: `10 µs`, `4.5 mm`.
pub fn short(si: f64, unit: &str) -> String {
    let text = engineering(si, unit);
    match text.split_once(' ') {
        Some((digits, unit)) if digits.contains('.') => {
            format!("{} {unit}", digits.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text,
    }
}

/// Unit of a dimension.
fn unit(dimension: Dimension, geometry: Geometry) -> units::Unit {
    match (dimension, geometry) {
        (Dimension::Length, _) => units::LENGTH,
        (Dimension::Time, _) => units::TIME,
        (Dimension::Frequency, _) => units::FREQUENCY,
        (Dimension::Speed, _) => units::SPEED,
        (Dimension::Density, _) => units::DENSITY,
        (Dimension::Stress, _) => units::STRESS,
        (Dimension::Force, Geometry::Axisymmetric) => units::FORCE,
        (Dimension::Force, Geometry::Plane) => units::FORCE_PER_LENGTH,
        (Dimension::Mass, Geometry::Axisymmetric) => units::MASS,
        (Dimension::Mass, Geometry::Plane) => units::MASS_PER_LENGTH,
        (Dimension::Energy, Geometry::Axisymmetric) => units::ENERGY,
        (Dimension::Energy, Geometry::Plane) => units::ENERGY_PER_LENGTH,
    }
}

/// Name of the unit of a dimension.
pub fn name(dimension: Dimension, geometry: Geometry, is_si: bool) -> &'static str {
    let unit = unit(dimension, geometry);
    if is_si { unit.si } else { unit.plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steel(geometry: Geometry) -> Scales {
        Scales { geometry, length: 0.01, speed: 5000.0, density: 8000.0 }
    }

    #[test]
    fn scales_are_those_of_their_units() {
        for (dimension, round, plane) in [
            (Dimension::Time, 2e-6, 2e-6),
            (Dimension::Stress, 2e11, 2e11),
            (Dimension::Force, PI * 2e7, 4e9),
            (Dimension::Mass, PI * 8e-3, 1.6),
            (Dimension::Energy, PI * 2e5, 4e7),
        ] {
            for (geometry, expected) in [(Geometry::Axisymmetric, round), (Geometry::Plane, plane)] {
                let scale = steel(geometry).of(dimension);
                assert!((scale / expected - 1.0).abs() < 1e-14, "{dimension:?} {geometry:?}: {scale}");
            }
        }
    }

    #[test]
    fn a_reduced_value_is_found_again() {
        let scales =
            Scales { geometry: Geometry::Axisymmetric, length: 0.0127, speed: 2693.7, density: 1183.0 };
        for dimension in [Dimension::Length, Dimension::Time, Dimension::Mass, Dimension::Speed] {
            for i in 1..2000 {
                let x = scales.reduce(dimension, f64::from(i) * 1e-3);
                assert_eq!(scales.reduce(dimension, scales.expand(dimension, x)), x);
            }
        }
    }

    #[test]
    fn numbers_for_people_have_four_digits() {
        for (si, unit, text) in [
            (5.231e-5, "s", "52.31 µs"),
            (1204.0, "N", "1.204 kN"),
            (999.96, "N", "1.000 kN"),
            (999.9, "N", "999.9 N"),
            (0.0328, "kg", "32.80 g"),
            (2.0, "kg/m", "2.000 kg/m"),
            (2680.0, "m/s", "2680 m/s"),
            (-3.4e8, "Pa", "-340.0 MPa"),
            (0.0, "J", "0.000 J"),
        ] {
            assert_eq!(engineering(si, unit), text);
        }
        for (si, unit, text) in
            [(1e-5, "s", "10 µs"), (4.5e-3, "m", "4.5 mm"), (0.0, "m", "0 m"), (2680.0, "m/s", "2680 m/s")]
        {
            assert_eq!(short(si, unit), text);
        }
        let units = Units::new(Geometry::Axisymmetric, None);
        assert_eq!((units.time.text(1.25), units.force.text_to(3, 0.5)), ("1.2500".into(), "0.500".into()));
        assert_eq!(units.time.text_with_unit(3, 1.25), "1.250 R/c_p");
        assert_eq!(units.length.for_axis(40.0), ("R".into(), 1.0));
        let units = Units::new(Geometry::Axisymmetric, Some(steel(Geometry::Axisymmetric)));
        assert_eq!(units.length.for_axis(2.0), ("mm".into(), 10.0));
        assert_eq!(units.speed.for_axis(1e-9), ("m/s".into(), 5000.0));
    }

    #[test]
    fn dimensionless_numbers_are_recorded_as_they_are() {
        let units = Units::new(Geometry::Plane, None);
        assert_eq!((units.force.name, units.force.of(0.1 + 0.2)), ("Rγc_p²", 0.1 + 0.2));
        assert!(units.energy.part().contains("half x >= 0"));
        let units = Units::new(Geometry::Plane, Some(steel(Geometry::Plane)));
        assert_eq!((units.force.name, units.energy.name, units.time.name), ("N/m", "J/m", "s"));
        assert!(units.energy.part().contains("both halves") && units.time.part().is_empty());
    }
}
