//! Whether a case is dimensionless or physical, and how its numbers are read.
//!
//! In a dimensionless case every number is plain; in a physical one everything that has a dimension is a quantity with its unit, and
//! is divided by the scales of the case. A number without a unit in a physical case, or one with a unit in a dimensionless one, is an
//! error: nothing is guessed.

use std::fmt;

use toml::{Spanned, Value};

use super::{
    bounds::{Bounds, MAX_LIST},
    document::{Given, Section, Span},
    quantity::{self, QuantityError},
};
use crate::{
    geometry::Geometry,
    units::{Dimension, Scales, Units},
};

/// System of the numbers of a case.
#[derive(Clone, Copy, Debug)]
pub(super) enum System {
    /// Plain numbers.
    Dimensionless,
    /// Quantities.
    Physical {
        /// Symmetry, which some units depend on.
        geometry: Geometry,
        /// The scales; `None` if they cannot be read, which is a problem of its own: numbers are placeholders then.
        scales: Option<Scales>,
    },
    /// Not known, which is a problem of its own: plain numbers and quantities are placeholders, and neither is mixed in.
    Unclear {
        /// Symmetry, which some units depend on.
        geometry: Geometry,
    },
}

/// Why a value is refused, and what is allowed.
struct Refusal {
    message: String,
    help: String,
}

impl System {
    /// The scales of a physical case.
    pub fn scales(&self) -> Option<Scales> {
        match self {
            Self::Dimensionless | Self::Unclear { .. } => None,
            Self::Physical { scales, .. } => *scales,
        }
    }

    /// A dimensionless number as if it had been read as a quantity: the case that is written with every default explicit
    /// repeats it to the last bit.
    pub fn default(&self, dimension: Dimension, x: f64) -> f64 {
        self.scales().map_or(x, |scales| scales.reduce(dimension, x * scales.of(dimension)))
    }

    /// A dimensionless length for people.
    pub fn length_text(&self, length: f64) -> String {
        Units::new(Geometry::Axisymmetric, self.scales()).length.full_text(length)
    }

    /// What can be written for a number of a dimension.
    pub fn allowed(&self, dimension: Dimension, bounds: Bounds) -> String {
        match self {
            Self::Dimensionless | Self::Unclear { .. } => bounds.to_string(),
            Self::Physical { geometry, .. } => quantity::allowed(dimension, *geometry),
        }
    }

    /// True if dimensionless numbers can be written as in the case.
    pub fn can_write(&self) -> bool {
        matches!(self, Self::Dimensionless | Self::Physical { scales: Some(_), .. })
    }

    /// A dimensionless number as the case has it.
    pub fn quoted(&self, dimension: Dimension, x: f64) -> String {
        match self {
            Self::Physical { geometry, scales: Some(scales) } => {
                format!("\"{:?} {}\"", scales.expand(dimension, x), quantity::si_unit(dimension, *geometry))
            }
            _ => format!("{x:?}"),
        }
    }

    /// Checks the units in the heading of a table of lengths.
    pub fn check_heading(&self, units: Option<&[String; 2]>) -> Result<(), String> {
        match (self, units) {
            (Self::Dimensionless, Some([unit, _])) => Err(format!(
                "its heading has the unit `{unit}`, but the shear_wave_speed of the target makes the case dimensionless"
            )),
            (Self::Physical { .. }, None) => {
                Err("it has no units, but the material of the target makes the case physical".into())
            }
            (Self::Physical { geometry, .. } | Self::Unclear { geometry }, Some(units)) => {
                let is_known =
                    |unit: &str| quantity::with_unit("0", unit, Dimension::Length, *geometry).is_ok();
                let Some(unit) = units.iter().find(|unit| !is_known(unit)) else { return Ok(()) };
                let names = quantity::unit_names(Dimension::Length, *geometry);
                Err(format!("`{unit}` is no unit of length; allowed: {names}"))
            }
            (_, None) => Ok(()),
        }
    }

    /// The dimensionless length of a number in a table whose heading has been checked.
    pub fn length(&self, number: &str, unit: Option<&str>) -> Result<f64, String> {
        match (self, unit) {
            (Self::Physical { geometry, .. } | Self::Unclear { geometry }, Some(unit)) => {
                let si = quantity::with_unit(number, unit, Dimension::Length, *geometry)
                    .map_err(|_| format!("`{number}` [{unit}] is no length"))?;
                Ok(self.scales().map_or(si, |scales| scales.reduce(Dimension::Length, si)))
            }
            _ => number.parse().map_err(|_| format!("`{number}` is no number")),
        }
    }

    /// The dimensionless number of a value.
    ///
    /// * `name`: full name of its key
    fn read(&self, name: &str, value: &Value, dimension: Dimension, bounds: Bounds) -> Result<f64, Refusal> {
        let impossible = |value: &dyn fmt::Display| {
            let message = format!("`{name}` = {value} is not possible");
            Refusal { message, help: format!("allowed: {}", self.allowed(dimension, bounds)) }
        };
        let number = match value {
            Value::Integer(value) => *value as f64,
            Value::Float(value) => *value,
            Value::String(text) => return self.read_text(name, text, dimension, bounds),
            _ => return Err(impossible(value)),
        };
        match self {
            Self::Physical { geometry, .. } if number.is_finite() => {
                let (noun, example) = quantity::example(dimension, *geometry);
                Err(Refusal {
                    message: format!(
                        "`{name}` = {number:?} has no unit, but the material of the target makes the case physical"
                    ),
                    help: format!("write a {noun} with its unit, such as \"{example}\""),
                })
            }
            _ if bounds.contain(number) => Ok(number),
            _ => Err(impossible(&format!("{number:?}"))),
        }
    }

    /// The dimensionless number of a text.
    fn read_text(
        &self,
        name: &str,
        text: &str,
        dimension: Dimension,
        bounds: Bounds,
    ) -> Result<f64, Refusal> {
        let (geometry, scales) = match self {
            Self::Dimensionless => return Err(mixed_in(name, text, bounds)),
            Self::Physical { geometry, scales } => (*geometry, *scales),
            Self::Unclear { geometry } => (*geometry, None),
        };
        let si = quantity::parse(text, dimension, geometry)
            .map_err(|error| unreadable(name, text, &error, (dimension, bounds), geometry))?;
        let allowed = match scales {
            Some(scales) if bounds.contain(scales.reduce(dimension, si)) => {
                return Ok(scales.reduce(dimension, si));
            }
            Some(scales) => bounds.in_unit(scales.of(dimension), quantity::si_unit(dimension, geometry)),
            // without scales only the sign is known to be wrong
            None if bounds.contain(if si == 0.0 { 0.0 } else { si.signum() }) => return Ok(si),
            None => format!("{}, > 0", quantity::allowed(dimension, geometry)),
        };
        let message = format!("`{name}` = \"{text}\" is not possible");
        Err(Refusal { message, help: format!("allowed: {allowed}") })
    }
}

/// A quantity in a dimensionless case, or no number at all.
fn mixed_in(name: &str, text: &str, bounds: Bounds) -> Refusal {
    if text.trim().parse::<f64>().is_ok() {
        let message = format!("`{name}` = \"{text}\" is a text");
        return Refusal { message, help: format!("write {}, without quotes", text.trim()) };
    }
    let message = if text.trim().starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first)) {
        format!(
            "`{name}` = \"{text}\" has a unit, but the shear_wave_speed of the target makes the case dimensionless"
        )
    } else {
        format!("`{name}` = \"{text}\" is no number")
    };
    let help = format!(
        "a physical case has a material of the target, and every quantity with its unit; allowed here: {bounds}"
    );
    Refusal { message, help }
}

fn unreadable(
    name: &str,
    text: &str,
    error: &QuantityError,
    (dimension, bounds): (Dimension, Bounds),
    geometry: Geometry,
) -> Refusal {
    let (noun, _) = quantity::example(dimension, geometry);
    let given = format!("`{name}` = \"{text}\"");
    let allowed = format!("allowed: {}", quantity::allowed(dimension, geometry));
    let (message, help) = match error {
        QuantityError::NoNumber if text.trim() == "inf" && bounds.contain(f64::INFINITY) => {
            (format!("{given} is a text"), "write inf, without quotes".into())
        }
        QuantityError::NoNumber => (format!("{given} is no number with a unit"), allowed),
        QuantityError::NoUnit => (format!("{given} has no unit"), allowed),
        QuantityError::TooLarge => (format!("{given} is too large for a number"), allowed),
        QuantityError::Unit(unit) if unit.starts_with(',') => {
            (format!("{given} has a comma in its number"), format!("write a decimal point; {allowed}"))
        }
        QuantityError::Unit(unit) => (format!("{given}: `{unit}` is no unit of {noun}"), allowed),
    };
    Refusal { message, help }
}

impl Section<'_> {
    /// A number of a dimension within dimensionless bounds, if the key is there.
    pub fn quantity(
        &mut self,
        key: &'static str,
        dimension: Dimension,
        bounds: Bounds,
        system: &System,
    ) -> Option<Given<f64>> {
        self.quantity_or(key, (dimension, bounds), "", system)
    }

    /// A number of a dimension within dimensionless bounds, if the key is there.
    ///
    /// * `other`: what else is allowed, for the message
    pub fn quantity_or(
        &mut self,
        key: &'static str,
        (dimension, bounds): (Dimension, Bounds),
        other: &str,
        system: &System,
    ) -> Option<Given<f64>> {
        let Given { value, span } = self.get::<Value>(key, "")?;
        match system.read(&self.name(key), &value, dimension, bounds) {
            Ok(value) => Some(Given { value, span }),
            Err(Refusal { message, help }) => {
                self.refuse_quantity(key, span, Refusal { message, help: help + other })
            }
        }
    }

    /// A required number of a dimension within dimensionless bounds.
    pub fn require_quantity(
        &mut self,
        key: &'static str,
        dimension: Dimension,
        bounds: Bounds,
        system: &System,
    ) -> Option<Given<f64>> {
        let given = self.quantity(key, dimension, bounds, system);
        self.need(key, given.is_some(), &system.allowed(dimension, bounds));
        given
    }

    /// A list of numbers of a dimension within dimensionless bounds, if the key is there.
    ///
    /// * `noun`: for its elements
    pub fn quantities(
        &mut self,
        key: &'static str,
        noun: &str,
        (dimension, bounds): (Dimension, Bounds),
        system: &System,
    ) -> Option<Given<Vec<f64>>> {
        let allowed = format!("a list of {noun}, each {}", system.allowed(dimension, bounds));
        let Given { value, span } = self.get::<Vec<Spanned<Value>>>(key, &allowed)?;
        self.check_length(key, noun, value.len(), &span)?;
        let name = self.name(key);
        let named = value.iter().enumerate().map(|(i, value)| (format!("{name}[{i}]"), value));
        self.read_list(key, named, (dimension, bounds), system).map(|value| Given { value, span })
    }

    /// A list of pairs of lengths within dimensionless bounds, if the key is there.
    pub fn places(
        &mut self,
        key: &'static str,
        noun: &str,
        bounds: Bounds,
        system: &System,
    ) -> Option<Given<Vec<[f64; 2]>>> {
        let allowed =
            format!("a list of pairs, [[…, …], …], each {}", system.allowed(Dimension::Length, bounds));
        let Given { value, span } = self.get::<Vec<Spanned<Vec<Spanned<Value>>>>>(key, &allowed)?;
        self.check_length(key, noun, value.len(), &span)?;
        let name = self.name(key);
        if let Some((i, pair)) = value.iter().enumerate().find(|(_, pair)| pair.get_ref().len() != 2) {
            let message = format!("`{name}[{i}]` has {} elements instead of 2", pair.get_ref().len());
            return self.refuse(key, pair.span(), message, &allowed);
        }
        let places = value.iter().enumerate().flat_map(|(i, pair)| {
            let named = move |(j, value)| (i, j, value);
            pair.get_ref().iter().enumerate().map(named)
        });
        let named = places.map(|(i, j, value)| (format!("{name}[{i}][{j}]"), value));
        let numbers = self.read_list(key, named, (Dimension::Length, bounds), system)?;
        let pairs = numbers.as_chunks::<2>().0.to_vec();
        Some(Given { value: pairs, span })
    }

    /// Reads the elements of a list, with their names; the first that is refused is noted.
    pub fn read_list<'v>(
        &mut self,
        key: &'static str,
        list: impl Iterator<Item = (String, &'v Spanned<Value>)>,
        (dimension, bounds): (Dimension, Bounds),
        system: &System,
    ) -> Option<Vec<f64>> {
        let read = |(name, value): (String, &Spanned<Value>)| {
            let number = system.read(&name, value.get_ref(), dimension, bounds);
            number.map_err(|refusal| (value.span(), refusal))
        };
        match list.map(read).collect::<Result<Vec<f64>, _>>() {
            Ok(numbers) => Some(numbers),
            Err((span, refusal)) => self.refuse_quantity(key, span, refusal),
        }
    }

    fn check_length(&mut self, key: &'static str, noun: &str, length: usize, span: &Span) -> Option<()> {
        if length <= MAX_LIST {
            return Some(());
        }
        let message = format!("`{}` has {length} {noun}", self.name(key));
        self.refuse(key, span.clone(), message, &format!("at most {MAX_LIST}"))
    }

    fn refuse_quantity<T>(&mut self, key: &'static str, span: Span, refusal: Refusal) -> Option<T> {
        self.mark_refused(key);
        self.problem(span, refusal.message, refusal.help);
        None
    }
}
