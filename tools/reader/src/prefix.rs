//! Engineering prefixes: the unit in which numbers of an SI quantity are best read.

/// A unit with a prefix.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefixed {
    /// Number of this unit in one of the plain unit: 1e6 for µs.
    pub factor: f64,
    /// The unit with its prefix: `µs`, `kN`, `MPa`.
    pub unit: String,
}

/// Units that take a prefix: one symbol of the SI, alone or over another.
const UNITS: [&str; 10] = ["s", "m", "N", "N/m", "Pa", "m/s", "J", "J/m", "N s", "N s/m"];

/// Prefixes with their powers of ten.
const PREFIXES: [(i32, &str); 9] =
    [(-12, "p"), (-9, "n"), (-6, "µ"), (-3, "m"), (0, ""), (3, "k"), (6, "M"), (9, "G"), (12, "T")];

impl Prefixed {
    /// The unit in which the largest number is from 1 to 1000; `None` if the unit takes no prefix.
    ///
    /// Speeds stay in m/s, as mm/s and km/s are read less easily.
    ///
    /// * `largest`: largest number by magnitude, in the plain unit
    pub fn choose(unit: &str, largest: f64) -> Option<Self> {
        let unit = UNITS.into_iter().find(|known| *known == unit)?;
        let largest = largest.abs();
        if unit == "m/s" || largest == 0.0 || !largest.is_finite() {
            return Some(Self { factor: 1.0, unit: unit.into() });
        }
        // 1000 is the next prefix, also where the logarithm rounds; long times stay in seconds
        let fits = |&&(power, _): &&(i32, &str)| {
            largest >= 10f64.powi(power) * (1.0 - 1e-12) && (unit != "s" || power <= 0)
        };
        let (power, prefix) = PREFIXES.iter().rev().find(fits).unwrap_or(&PREFIXES[0]);
        Some(Self { factor: 10f64.powi(-power), unit: format!("{prefix}{unit}") })
    }

    /// A number of the plain unit in this one, rounded once: powers of ten are exact only upwards.
    pub fn apply(&self, number: f64) -> f64 {
        if self.factor < 1.0 { number / (1.0 / self.factor).round() } else { number * self.factor }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_once() {
        for (unit, largest, number, expected) in
            [("N", 5e3, 300.0, 0.3), ("m", 1e-2, 7e-3, 7.0), ("Pa", 2e9, 1.1e8, 0.11), ("s", 1.0, 0.1, 0.1)]
        {
            assert_eq!(Prefixed::choose(unit, largest).expect("a prefix").apply(number), expected);
        }
    }

    #[test]
    fn the_largest_number_has_one_to_three_digits() {
        for (unit, largest, factor, expected) in [
            ("s", 2.5e-4, 1e6, "µs"),
            ("s", 3600.0, 1.0, "s"),
            ("N", 1234.0, 1e-3, "kN"),
            ("N", 1000.0, 1e-3, "kN"),
            ("N", 999.0, 1.0, "N"),
            ("Pa", -3.2e8, 1e-6, "MPa"),
            ("m", 1e-2, 1e3, "mm"),
            ("m", 1e-20, 1e12, "pm"),
            ("N/m", 5e4, 1e-3, "kN/m"),
            ("m/s", 2500.0, 1.0, "m/s"),
            ("J", 0.0, 1.0, "J"),
        ] {
            let got = Prefixed::choose(unit, largest).expect("a prefix");
            assert_eq!(got.unit, expected);
            assert!((got.factor / factor - 1.0).abs() < 1e-12, "{got:?}");
        }
        for unit in ["R", "γc_p²", "rad", "1", ""] {
            assert_eq!(Prefixed::choose(unit, 5.0), None);
        }
    }
}
