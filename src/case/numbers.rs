//! Numbers of a case: their bounds, the units of quantities, and whether they are dimensionless or physical.
//!
//! In a dimensionless case every number is plain; in a physical one everything that has a dimension is a quantity with its unit,
//! `"10 mm"`, and is divided by the scales of the case. A number without a unit in a physical case, or one with a unit in a dimensionless
//! one, is an error: nothing is guessed. All units are powers of ten of their SI unit: a quantity is read with its exponent moved, so that
//! `"10 mm"` and `"0.01 m"` are the same double.

use std::fmt;

use toml::Value;

use crate::{
    geometry::Geometry,
    units::{
        Dimension::{self, Density, Energy, Force, Frequency, Length, Mass, Speed, Stress, Time},
        Scales, Units,
    },
};

/// Largest dimensionless size or time. Far beyond any use, far from overflow.
pub(super) const HUGE: f64 = 1e6;
/// Smallest dimensionless size, mass or velocity.
pub(super) const TINY: f64 = 1e-6;
/// Largest number of probes or profile points.
pub(super) const MAX_LIST: usize = 100_000;

/// Bounds of a number; never NaN.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    low: f64,
    high: f64,
    low_open: bool,
    high_open: bool,
    or_infinite: bool,
}

impl Bounds {
    /// `low < x ≤ high`
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, high, low_open: true, high_open: false, or_infinite: false }
    }

    /// `low < x < high`
    pub const fn between(low: f64, high: f64) -> Self {
        Self { high_open: true, ..Self::above(low, high) }
    }

    /// `low ≤ x ≤ high`
    pub const fn within(low: f64, high: f64) -> Self {
        Self { low_open: false, ..Self::above(low, high) }
    }

    /// Also infinity.
    pub const fn or_infinite(self) -> Self {
        Self { or_infinite: true, ..self }
    }

    /// The bounds of numbers in a unit.
    ///
    /// * `scale`: value of the unit of these bounds in that unit
    pub fn in_unit(&self, scale: f64, unit: &str) -> String {
        self.text(|x| match format!("{:.4e}", x * scale).replace(".0000e", "e") {
            zero if zero == "0e0" => format!("0 {unit}"),
            text => format!("{} {unit}", text.strip_suffix("e0").unwrap_or(&text)),
        })
    }

    fn text(&self, number: impl Fn(f64) -> String) -> String {
        let (low, high) = (if self.low_open { ">" } else { "≥" }, if self.high_open { "<" } else { "≤" });
        let end = if self.or_infinite { ", or inf" } else { "" };
        format!("{low} {} and {high} {}{end}", number(self.low), number(self.high))
    }

    /// True if `x` is allowed.
    pub fn contain(&self, x: f64) -> bool {
        (self.or_infinite && x == f64::INFINITY)
            || ((if self.low_open { x > self.low } else { x >= self.low })
                && (if self.high_open { x < self.high } else { x <= self.high }))
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |x: f64| if x.abs() < 1e15 { x.to_string() } else { format!("{x:e}") };
        write!(f, "a number {}", self.text(number))
    }
}

/// A dimension in words, with an example, and its units with their powers of ten in SI units, the SI unit first; none if cases have no such
/// quantity.
type Known = (&'static str, &'static str, &'static [(&'static str, i32)]);

fn known(dimension: Dimension, geometry: Geometry) -> Known {
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

fn si_unit(dimension: Dimension, geometry: Geometry) -> &'static str {
    known(dimension, geometry).2.first().map_or("", |(name, _)| name)
}

fn unit_names(dimension: Dimension, geometry: Geometry) -> String {
    let names: Vec<&str> = known(dimension, geometry).2.iter().map(|(name, _)| *name).collect();
    names.join(", ")
}

/// What can be written as a quantity, for messages.
pub(super) fn allowed(dimension: Dimension, geometry: Geometry) -> String {
    let (noun, example, _) = known(dimension, geometry);
    format!("a {noun} such as \"{example}\", in {}", unit_names(dimension, geometry))
}

/// What is wrong with `1,5 mm`.
const COMMA: &str = " has a comma in its number";

/// Reads a quantity, in SI units.
///
/// # Errors
///
/// What is wrong with it, to follow it in a message.
pub(super) fn parse(text: &str, dimension: Dimension, geometry: Geometry) -> Result<f64, String> {
    match split(text.trim()) {
        None => Err(" is no number with a unit".into()),
        Some((_, "")) => Err(" has no unit".into()),
        Some((number, unit)) => with_unit(number, unit, dimension, geometry),
    }
}

fn with_unit(number: &str, unit: &str, dimension: Dimension, geometry: Geometry) -> Result<f64, String> {
    // the micro sign and the Greek letter look alike
    let unit = unit.trim().replace('μ', "µ");
    let (noun, _, units) = known(dimension, geometry);
    let Some((_, power)) = units.iter().find(|(name, _)| *name == unit) else {
        let is_comma = unit.starts_with(',');
        return Err(if is_comma { COMMA.into() } else { format!(": `{unit}` is no unit of {noun}") });
    };
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let moved = exponent.parse().map(|exponent: i32| exponent.saturating_add(*power));
    let si = moved.ok().and_then(|exponent| format!("{mantissa}e{exponent}").parse().ok());
    si.filter(|si: &f64| si.is_finite()).ok_or_else(|| " is too large for a number".into())
}

/// Reads a quantity of whatever dimension its unit has: in SI units, and the SI unit.
pub fn quantity_si(text: &str, geometry: Geometry) -> Option<(f64, &'static str)> {
    [Length, Time, Frequency, Speed, Density, Stress, Mass, Force]
        .into_iter()
        .find_map(|dimension| Some((parse(text, dimension, geometry).ok()?, si_unit(dimension, geometry))))
}

/// The number at the beginning of a text, and the rest.
pub fn split(text: &str) -> Option<(&str, &str)> {
    let is_part = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let longest = text.find(|c| !is_part(c)).unwrap_or(text.len());
    let end = (1..=longest).rev().find(|end| text[..*end].parse::<f64>().is_ok())?;
    Some((&text[..end], &text[end..]))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    /// Plain.
    Dimensionless,
    /// Quantities.
    Physical,
    /// Not known, which is a problem of its own: plain numbers and quantities are placeholders, and neither is mixed in.
    Unclear,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct System {
    pub numbers: Numbers,
    /// Symmetry, which some units depend on.
    pub geometry: Geometry,
    /// The scales of a physical case; `None` if they cannot be read, which is a problem of its own: numbers are placeholders then.
    pub scales: Option<Scales>,
}

/// Why a value is refused, and what is allowed.
type Refusal = (String, String);

impl System {
    /// Plain numbers.
    pub const PLAIN: Self =
        Self { numbers: Numbers::Dimensionless, geometry: Geometry::Axisymmetric, scales: None };

    /// Quantities in SI units.
    pub const SI: Self = Self {
        numbers: Numbers::Physical,
        geometry: Geometry::Plane,
        scales: Some(Scales { geometry: Geometry::Plane, length: 1.0, speed: 1.0, density: 1.0 }),
    };

    /// A dimensionless number as if it had been read as a quantity: the case that is written with every default explicit
    /// repeats it to the last bit.
    pub fn default(&self, dimension: Dimension, x: f64) -> f64 {
        self.scales.map_or(x, |scales| scales.reduce(dimension, x * scales.of(dimension)))
    }

    /// A dimensionless length for people.
    pub fn length_text(&self, length: f64) -> String {
        Units::new(Geometry::Axisymmetric, self.scales).length.full_text(length)
    }

    /// What can be written for a number of a dimension.
    pub fn allowed(&self, dimension: Dimension, bounds: Bounds) -> String {
        match self.numbers {
            Numbers::Dimensionless | Numbers::Unclear => bounds.to_string(),
            Numbers::Physical => allowed(dimension, self.geometry),
        }
    }

    /// A dimensionless number as case files have it: plain, or as a quantity.
    pub fn written(&self, dimension: Dimension, x: f64) -> Value {
        match self.scales.filter(|_| x.is_finite()) {
            Some(scales) => {
                let unit = si_unit(dimension, self.geometry);
                Value::String(format!("{:?} {unit}", scales.expand(dimension, x)))
            }
            None => Value::Float(x),
        }
    }

    /// Checks the units in the heading of a table of two columns.
    ///
    /// * `of`: their dimensions
    pub fn check_heading(&self, units: Option<&[String; 2]>, of: [Dimension; 2]) -> Result<(), String> {
        match (self.numbers, units) {
            (Numbers::Dimensionless, Some([unit, _])) => Err(format!(
                "its heading has the unit `{unit}`, but the shear_wave_speed of the target makes the case dimensionless"
            )),
            (Numbers::Physical, None) => {
                Err("it has no units, but the material of the target makes the case physical".into())
            }
            (_, None) => Ok(()),
            (_, Some(units)) => {
                let names = |dimension| unit_names(dimension, self.geometry);
                let check = |(unit, dimension): (&String, Dimension)| {
                    with_unit("0", unit, dimension, self.geometry).map_err(|_| {
                        let (noun, ..) = known(dimension, self.geometry);
                        format!("`{unit}` is no unit of {noun}; allowed: {}", names(dimension))
                    })
                };
                units.iter().zip(of).try_for_each(|column| check(column).map(drop))
            }
        }
    }

    /// The dimensionless number of one in a table whose heading has been checked.
    pub fn number(&self, number: &str, unit: Option<&str>, dimension: Dimension) -> Result<f64, String> {
        let Some(unit) = unit else { return number.parse().map_err(|_| format!("`{number}` is no number")) };
        let si = with_unit(number, unit, dimension, self.geometry)
            .map_err(|_| format!("`{number}` [{unit}] is no {}", known(dimension, self.geometry).0))?;
        Ok(self.scales.map_or(si, |scales| scales.reduce(dimension, si)))
    }

    /// The dimensionless number of a value.
    ///
    /// * `given`: name of its key and its text, for messages
    pub fn read(&self, given: &str, value: &Value, of: Dimension, bounds: Bounds) -> Result<f64, Refusal> {
        let number = match value {
            Value::Integer(value) => *value as f64,
            Value::Float(value) => *value,
            Value::String(text) => return self.read_text(given, text, of, bounds),
            _ => f64::NAN,
        };
        if self.numbers == Numbers::Physical && number.is_finite() {
            let (noun, example, _) = known(of, self.geometry);
            return Err((
                format!("{given} has no unit, but the material of the target makes the case physical"),
                format!("write a {noun} with its unit, such as \"{example}\""),
            ));
        }
        let refusal =
            || (format!("{given} is not possible"), format!("allowed: {}", self.allowed(of, bounds)));
        bounds.contain(number).then_some(number).ok_or_else(refusal)
    }

    fn read_text(&self, given: &str, text: &str, of: Dimension, bounds: Bounds) -> Result<f64, Refusal> {
        let trimmed = text.trim();
        if self.numbers == Numbers::Dimensionless {
            return Err(mixed_in(given, trimmed, bounds));
        }
        if trimmed == "inf" && bounds.contain(f64::INFINITY) {
            return Err((format!("{given} is a text"), "write inf, without quotes".into()));
        }
        let allowed = allowed(of, self.geometry);
        let si = parse(text, of, self.geometry).map_err(|what| {
            let decimal = if what == COMMA { "write a decimal point; " } else { "" };
            (format!("{given}{what}"), format!("{decimal}allowed: {allowed}"))
        })?;
        let allowed = match self.scales {
            Some(scales) if bounds.contain(scales.reduce(of, si)) => return Ok(scales.reduce(of, si)),
            Some(scales) => bounds.in_unit(scales.of(of), si_unit(of, self.geometry)),
            // without scales only the sign is known to be wrong
            None if bounds.contain(if si == 0.0 { 0.0 } else { si.signum() }) => return Ok(si),
            None => format!("{allowed}, > 0"),
        };
        Err((format!("{given} is not possible"), format!("allowed: {allowed}")))
    }
}

/// A quantity in a dimensionless case, or no number at all.
fn mixed_in(given: &str, text: &str, bounds: Bounds) -> Refusal {
    if text.parse::<f64>().is_ok() {
        return (format!("{given} is a text"), format!("write {text}, without quotes"));
    }
    let message = if text.starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first)) {
        format!("{given} has a unit, but the shear_wave_speed of the target makes the case dimensionless")
    } else {
        format!("{given} is no number")
    };
    let help = format!(
        "a physical case has a material of the target, and every quantity with its unit; allowed here: {bounds}"
    );
    (message, help)
}

#[cfg(test)]
mod tests {
    use super::*;

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
            assert_eq!(parse(text, dimension, Geometry::Axisymmetric), Ok(si), "{text}");
        }
        assert_eq!(parse("3 kg/m", Mass, Geometry::Plane), Ok(3.0));
        assert!(parse("3 kg", Mass, Geometry::Plane).is_err());
    }

    #[test]
    fn other_texts_are_refused() {
        for (texts, what) in [
            (&["", "mm", "ten mm", "inf mm", "nan mm"][..], " is no number with a unit"),
            (&["10"], " has no unit"),
            (&["1e999 m", "1e99999999999 m", "1e308 km"], " is too large for a number"),
            (&["10 inch", "10 MM", "10 m/s", "10 m m", "10 µ", "1 é", "1e m"], " is no unit of length"),
            (&["1,5 mm"], COMMA),
        ] {
            for text in texts {
                let error = parse(text, Length, Geometry::Axisymmetric).expect_err(text);
                assert!(error.ends_with(what), "{text}: {error}");
            }
        }
    }
}
