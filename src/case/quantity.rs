//! Quantities: numbers with a unit, as physical cases have them.
//!
//! A quantity is written as a number and a unit, `"10 mm"`. All units are powers of ten of their SI unit: the number is read with its
//! exponent moved, so that `"10 mm"` and `"0.01 m"` are the same double.

use crate::{
    geometry::Geometry,
    units::Dimension::{self, Density, Energy, Force, Frequency, Length, Mass, Speed, Stress, Time},
};

/// Units with their powers of ten in SI units.
pub(super) type Units = &'static [(&'static str, i32)];

/// A dimension in words, with an example, and the units in which it is given, the SI unit first; none if cases have no such quantity.
pub(super) fn known(dimension: Dimension, geometry: Geometry) -> (&'static str, &'static str, Units) {
    let is_plane = geometry == Geometry::Plane;
    match dimension {
        Length => (
            "length",
            "10 mm",
            &[("m", 0), ("cm", -2), ("mm", -3), ("µm", -6), ("um", -6), ("nm", -9), ("km", 3)],
        ),
        Time => ("time", "250 us", &[("s", 0), ("ms", -3), ("µs", -6), ("us", -6), ("ns", -9)]),
        Frequency => ("frequency", "20 kHz", &[("Hz", 0), ("kHz", 3), ("MHz", 6), ("GHz", 9)]),
        Speed => (
            "speed",
            "5 m/s",
            &[("m/s", 0), ("km/s", 3), ("mm/s", -3), ("cm/s", -2), ("mm/µs", 3), ("mm/us", 3)],
        ),
        Density => (
            "density",
            "7.85 g/cm3",
            &[("kg/m³", 0), ("kg/m3", 0), ("g/cm³", 3), ("g/cm3", 3), ("t/m³", 3), ("t/m3", 3)],
        ),
        Stress => (
            "stress",
            "210 GPa",
            &[("Pa", 0), ("kPa", 3), ("MPa", 6), ("GPa", 9), ("N/mm²", 6), ("N/mm2", 6), ("bar", 5)],
        ),
        Force if is_plane => {
            ("force per length", "2 kN/m", &[("N/m", 0), ("kN/m", 3), ("N/mm", 3), ("MN/m", 6)])
        }
        Force => ("force", "30 N", &[("N", 0), ("mN", -3), ("µN", -6), ("uN", -6), ("kN", 3), ("MN", 6)]),
        Mass if is_plane => {
            ("mass per length", "2 kg/m", &[("kg/m", 0), ("g/m", -3), ("g/mm", 0), ("g/cm", -1)])
        }
        Mass => ("mass", "32.7 g", &[("kg", 0), ("g", -3), ("mg", -6), ("t", 3)]),
        Energy => ("energy", "1 J", &[]),
    }
}

/// The SI unit, and what can be written, for messages.
pub(super) fn allowed(dimension: Dimension, geometry: Geometry) -> String {
    let (noun, example, _) = known(dimension, geometry);
    format!("a {noun} such as \"{example}\", in {}", unit_names(dimension, geometry))
}

/// Names of the units of a dimension, for messages.
pub(super) fn unit_names(dimension: Dimension, geometry: Geometry) -> String {
    let names: Vec<&str> = known(dimension, geometry).2.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// The SI unit of a dimension.
pub(super) fn si_unit(dimension: Dimension, geometry: Geometry) -> &'static str {
    known(dimension, geometry).2.first().map_or("", |(name, _)| name)
}

/// Why a text is no quantity.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum QuantityError {
    /// The text does not begin with a number.
    NoNumber,
    /// Nothing stands behind the number.
    NoUnit,
    /// No double is as large.
    TooLarge,
    /// The unit is not one of the dimension.
    Unit(String),
}

/// Reads a quantity, in SI units.
pub(super) fn parse(text: &str, dimension: Dimension, geometry: Geometry) -> Result<f64, QuantityError> {
    let (number, unit) = split(text.trim()).ok_or(QuantityError::NoNumber)?;
    if unit.is_empty() {
        return Err(QuantityError::NoUnit);
    }
    with_unit(number, unit, dimension, geometry)
}

/// Reads a quantity of whatever dimension its unit has: in SI units, and the SI unit.
pub fn quantity_si(text: &str, geometry: Geometry) -> Option<(f64, &'static str)> {
    [Length, Time, Frequency, Speed, Density, Stress, Mass, Force]
        .into_iter()
        .find_map(|dimension| Some((parse(text, dimension, geometry).ok()?, si_unit(dimension, geometry))))
}

/// The SI value of a number in a unit.
pub(super) fn with_unit(
    number: &str,
    unit: &str,
    dimension: Dimension,
    geometry: Geometry,
) -> Result<f64, QuantityError> {
    // the micro sign and the Greek letter look alike
    let unit = unit.trim().replace('μ', "µ");
    let known = known(dimension, geometry).2.iter().find(|(name, _)| *name == unit);
    let Some((_, power)) = known else { return Err(QuantityError::Unit(unit)) };
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let exponent: i32 = exponent.parse().map_err(|_| QuantityError::TooLarge)?;
    format!("{mantissa}e{}", exponent.saturating_add(*power))
        .parse()
        .ok()
        .filter(|si: &f64| si.is_finite())
        .ok_or(QuantityError::TooLarge)
}

/// The number at the beginning of a text, and the rest.
pub fn split(text: &str) -> Option<(&str, &str)> {
    let is_part = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let longest = text.find(|c| !is_part(c)).unwrap_or(text.len());
    let end = (1..=longest).rev().find(|end| text[..*end].parse::<f64>().is_ok())?;
    Some((&text[..end], &text[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, dimension: Dimension) -> Result<f64, QuantityError> {
        parse(text, dimension, Geometry::Axisymmetric)
    }

    #[test]
    fn quantities_are_read_in_their_units() {
        for (text, dimension, si) in [
            ("10 mm", Length, 0.01),
            ("10mm", Length, 0.01),
            (" 1e1 mm ", Length, 0.01),
            ("-2.5e-3 km", Length, -2.5),
            ("7.85 g/cm3", Density, 7850.0),
            ("7.85 g/cm³", Density, 7850.0),
            ("210 GPa", Stress, 210e9),
            ("250 us", Time, 250e-6),
            ("250 µs", Time, 250e-6),
            ("250 μs", Time, 250e-6),
            ("32.7 g", Mass, 0.0327),
            ("5 m/s", Speed, 5.0),
            ("1.5 mm/us", Speed, 1500.0),
        ] {
            assert_eq!(read(text, dimension), Ok(si), "{text}");
        }
        assert_eq!(parse("3 kg/m", Mass, Geometry::Plane), Ok(3.0));
    }

    #[test]
    fn other_texts_are_refused() {
        for text in ["", "mm", "10", "ten mm", "inf mm", "nan mm", "1e999 m", "1e m", "1e308 km"] {
            assert!(read(text, Length).is_err(), "{text}");
        }
        assert_eq!(read("10", Length), Err(QuantityError::NoUnit));
        for text in ["", "mm", "inf mm", "nan mm"] {
            assert_eq!(read(text, Length), Err(QuantityError::NoNumber), "{text}");
        }
        for text in ["1e999 m", "1e99999999999 m", "1e308 km"] {
            assert_eq!(read(text, Length), Err(QuantityError::TooLarge), "{text}");
        }
        for text in ["10 inch", "10 MM", "10 m/s", "10 m m", "10 µ", "1 é"] {
            assert!(matches!(read(text, Length), Err(QuantityError::Unit(_))), "{text}");
        }
        assert!(parse("3 kg", Mass, Geometry::Plane).is_err());
    }
}
