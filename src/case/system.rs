//! Whether a case is dimensionless or physical, and how its numbers are read and written.
//!
//! In a dimensionless case every number is plain; in a physical one everything that has a dimension is a quantity with its unit, and
//! is divided by the scales of the case. A number without a unit in a physical case, or one with a unit in a dimensionless one, is an
//! error: nothing is guessed.

use toml::Value;

use super::{
    bounds::Bounds,
    quantity::{self, QuantityError},
};
use crate::{
    geometry::Geometry,
    units::{Dimension, Scales, Units},
};

/// What the numbers of a case are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    /// Plain.
    Dimensionless,
    /// Quantities.
    Physical,
    /// Not known, which is a problem of its own: plain numbers and quantities are placeholders, and neither is mixed in.
    Unclear,
}

/// System of the numbers of a case.
#[derive(Clone, Copy, Debug)]
pub(super) struct System {
    pub numbers: Numbers,
    /// Symmetry, which some units depend on.
    pub geometry: Geometry,
    /// The scales of a physical case; `None` if they cannot be read, which is a problem of its own: numbers are placeholders then.
    pub scales: Option<Scales>,
}

/// Why a value is refused, and what is allowed.
pub(super) type Refusal = (String, String);

impl System {
    /// Plain numbers.
    pub fn dimensionless() -> Self {
        Self { numbers: Numbers::Dimensionless, geometry: Geometry::Axisymmetric, scales: None }
    }

    /// Quantities in SI units.
    pub fn si() -> Self {
        let geometry = Geometry::Plane;
        let scales = Scales { geometry, length: 1.0, speed: 1.0, density: 1.0 };
        Self { numbers: Numbers::Physical, geometry, scales: Some(scales) }
    }

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
            Numbers::Physical => quantity::allowed(dimension, self.geometry),
        }
    }

    /// A dimensionless number as case files have it: plain, or as a quantity.
    pub fn written(&self, dimension: Dimension, x: f64) -> Value {
        match self.scales {
            Some(scales) if x.is_finite() => {
                let unit = quantity::si_unit(dimension, self.geometry);
                Value::String(format!("{:?} {unit}", scales.expand(dimension, x)))
            }
            _ => Value::Float(x),
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
            (_, Some(units)) => {
                let is_unknown = |(unit, dimension): &(&String, Dimension)| {
                    quantity::with_unit("0", unit, *dimension, self.geometry).is_err()
                };
                let Some((unit, dimension)) = units.iter().zip(of).find(is_unknown) else { return Ok(()) };
                let names = quantity::unit_names(dimension, self.geometry);
                let (noun, ..) = quantity::known(dimension, self.geometry);
                Err(format!("`{unit}` is no unit of {noun}; allowed: {names}"))
            }
            (_, None) => Ok(()),
        }
    }

    /// The dimensionless number of one in a table whose heading has been checked.
    pub fn number(&self, number: &str, unit: Option<&str>, dimension: Dimension) -> Result<f64, String> {
        let Some(unit) = unit else { return number.parse().map_err(|_| format!("`{number}` is no number")) };
        let si = quantity::with_unit(number, unit, dimension, self.geometry).map_err(|_| {
            let (noun, ..) = quantity::known(dimension, self.geometry);
            format!("`{number}` [{unit}] is no {noun}")
        })?;
        Ok(self.scales.map_or(si, |scales| scales.reduce(dimension, si)))
    }

    /// The dimensionless number of a value.
    ///
    /// * `given`: name of its key and its text, for messages
    pub fn read(
        &self,
        given: &str,
        value: &Value,
        dimension: Dimension,
        bounds: Bounds,
    ) -> Result<f64, Refusal> {
        let impossible =
            || (format!("{given} is not possible"), format!("allowed: {}", self.allowed(dimension, bounds)));
        let number = match value {
            Value::Integer(value) => *value as f64,
            Value::Float(value) => *value,
            Value::String(text) => return self.read_text(given, text, dimension, bounds),
            _ => return Err(impossible()),
        };
        if self.numbers == Numbers::Physical && number.is_finite() {
            let (noun, example, _) = quantity::known(dimension, self.geometry);
            return Err((
                format!("{given} has no unit, but the material of the target makes the case physical"),
                format!("write a {noun} with its unit, such as \"{example}\""),
            ));
        }
        if bounds.contain(number) { Ok(number) } else { Err(impossible()) }
    }

    /// The dimensionless number of a text.
    fn read_text(
        &self,
        given: &str,
        text: &str,
        dimension: Dimension,
        bounds: Bounds,
    ) -> Result<f64, Refusal> {
        if self.numbers == Numbers::Dimensionless {
            return Err(mixed_in(given, text, bounds));
        }
        let si = quantity::parse(text, dimension, self.geometry).map_err(|error| {
            let (noun, ..) = quantity::known(dimension, self.geometry);
            let allowed = format!("allowed: {}", quantity::allowed(dimension, self.geometry));
            match error {
                QuantityError::NoNumber if text.trim() == "inf" && bounds.contain(f64::INFINITY) => {
                    (format!("{given} is a text"), "write inf, without quotes".into())
                }
                QuantityError::NoNumber => (format!("{given} is no number with a unit"), allowed),
                QuantityError::NoUnit => (format!("{given} has no unit"), allowed),
                QuantityError::TooLarge => (format!("{given} is too large for a number"), allowed),
                QuantityError::Unit(unit) if unit.starts_with(',') => (
                    format!("{given} has a comma in its number"),
                    format!("write a decimal point; {allowed}"),
                ),
                QuantityError::Unit(unit) => (format!("{given}: `{unit}` is no unit of {noun}"), allowed),
            }
        })?;
        let allowed = match self.scales {
            Some(scales) if bounds.contain(scales.reduce(dimension, si)) => {
                return Ok(scales.reduce(dimension, si));
            }
            Some(scales) => bounds.in_unit(scales.of(dimension), quantity::si_unit(dimension, self.geometry)),
            // without scales only the sign is known to be wrong
            None if bounds.contain(if si == 0.0 { 0.0 } else { si.signum() }) => return Ok(si),
            None => format!("{}, > 0", quantity::allowed(dimension, self.geometry)),
        };
        Err((format!("{given} is not possible"), format!("allowed: {allowed}")))
    }
}

/// A quantity in a dimensionless case, or no number at all.
fn mixed_in(given: &str, text: &str, bounds: Bounds) -> Refusal {
    let text = text.trim();
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
