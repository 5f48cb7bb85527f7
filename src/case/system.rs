//! Whether a case is dimensionless or physical, and how its numbers are read.
//!
//! In a dimensionless case every number is plain; in a physical one everything that has a dimension is a quantity with its unit, and
//! is divided by the scales of the case. A number without a unit in a physical case, or one with a unit in a dimensionless one, is an
//! error: nothing is guessed.

use toml::Value;

use super::{
    bounds::Bounds,
    document::{Given, Section},
    quantity::{self, QuantityError},
    read::{MAX_LIST, Span},
};
use crate::{
    grid::Geometry,
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
            Self::Dimensionless => None,
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
            Self::Dimensionless => bounds.to_string(),
            Self::Physical { geometry, .. } => quantity::allowed(dimension, *geometry),
        }
    }

    /// The dimensionless length of a number in a table whose heading may have a unit.
    pub fn length(&self, number: &str, unit: Option<&str>) -> Result<f64, String> {
        match (self, unit) {
            (Self::Dimensionless, None) => number.parse().map_err(|_| format!("`{number}` is no number")),
            (Self::Dimensionless, Some(unit)) => {
                Err(format!("the heading has the unit `{unit}`, but the case is dimensionless"))
            }
            (Self::Physical { geometry, .. }, None) => {
                let (_, example) = quantity::example(Dimension::Length, *geometry);
                let unit = example.rsplit(' ').next().unwrap_or_default();
                Err(format!(
                    "no unit, but target.material makes the case physical: write the heading as r [{unit}],f [{unit}]"
                ))
            }
            (Self::Physical { geometry, scales }, Some(unit)) => {
                let si = quantity::with_unit(number, unit, Dimension::Length, *geometry)
                    .map_err(|_| format!("`{number}` [{unit}] is no length"))?;
                Ok(scales.map_or(1.0, |scales| scales.reduce(Dimension::Length, si)))
            }
        }
    }

    /// The dimensionless number of a value.
    ///
    /// * `name`: full name of its key
    fn read(&self, name: &str, value: &Value, dimension: Dimension, bounds: Bounds) -> Result<f64, Refusal> {
        let number = match value {
            Value::Integer(value) => Some(*value as f64),
            Value::Float(value) => Some(*value),
            _ => None,
        };
        let impossible = |help: String| {
            let value = number.map_or_else(|| value.to_string(), |number| format!("{number:?}"));
            Refusal { message: format!("`{name}` = {value} is not possible"), help }
        };
        match (self, value, number) {
            (Self::Dimensionless, _, Some(x)) if bounds.contain(x) => Ok(x),
            (Self::Dimensionless, _, Some(_)) => Err(impossible(format!("allowed: {bounds}"))),
            (Self::Dimensionless, Value::String(text), None) => Err(mixed_in(name, text, bounds)),
            (Self::Physical { .. }, _, Some(x)) if x.is_infinite() && bounds.contain(x) => Ok(x),
            (Self::Physical { geometry, .. }, _, Some(x)) => {
                let (noun, example) = quantity::example(dimension, *geometry);
                Err(Refusal {
                    message: format!(
                        "`{name}` = {x:?} has no unit, but target.material makes the case physical"
                    ),
                    help: format!("write a {noun} with its unit, such as \"{example}\""),
                })
            }
            (Self::Physical { geometry, scales }, Value::String(text), None) => {
                let si = quantity::parse(text, dimension, *geometry)
                    .map_err(|error| unreadable(name, text, &error, dimension, *geometry))?;
                let Some(scales) = scales else { return Ok(1.0) };
                let x = scales.reduce(dimension, si);
                if bounds.contain(x) {
                    return Ok(x);
                }
                let unit = quantity::si_unit(dimension, *geometry);
                Err(impossible(format!("allowed: {}", bounds.in_unit(scales.of(dimension), unit))))
            }
            (_, _, None) => Err(Refusal {
                message: format!("`{name}` = {value} is not possible"),
                help: format!("allowed: {}", self.allowed(dimension, bounds)),
            }),
        }
    }
}

/// A quantity in a dimensionless case, or no number at all.
fn mixed_in(name: &str, text: &str, bounds: Bounds) -> Refusal {
    let message = if text.starts_with(|first: char| first.is_ascii_digit() || "+-.".contains(first)) {
        format!("`{name}` = \"{text}\" has a unit, but target.shear_wave_speed makes the case dimensionless")
    } else {
        format!("`{name}` = \"{text}\" is no number")
    };
    let help = format!("allowed: {bounds}; or give target.material, and every quantity with its unit");
    Refusal { message, help }
}

fn unreadable(
    name: &str,
    text: &str,
    error: &QuantityError,
    dimension: Dimension,
    geometry: Geometry,
) -> Refusal {
    let (noun, _) = quantity::example(dimension, geometry);
    let message = match error {
        QuantityError::NoNumberWithUnit => format!("`{name}` = \"{text}\" is no number with a unit"),
        QuantityError::Unit(unit) => format!("`{name}` = \"{text}\": `{unit}` is no unit of {noun}"),
    };
    Refusal { message, help: format!("allowed: {}", quantity::allowed(dimension, geometry)) }
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
        let Given { value, span } = self.get::<Value>(key, "")?;
        match system.read(&self.name(key), &value, dimension, bounds) {
            Ok(value) => Some(Given { value, span }),
            Err(refusal) => self.refuse_quantity(key, span, refusal),
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
        let given = self.get::<Vec<Value>>(key, &allowed)?;
        self.check_length(key, noun, given.value.len(), &given.span)?;
        self.read_list(key, &given.value, &given.span, (dimension, bounds), system)
            .map(|value| Given { value, span: given.span })
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
        let Given { value, span } = self.get::<Vec<Vec<Value>>>(key, &allowed)?;
        self.check_length(key, noun, value.len(), &span)?;
        if let Some(bad) = value.iter().find(|pair| pair.len() != 2) {
            let message = format!("`{}` has {} numbers instead of a pair", self.name(key), bad.len());
            return self.refuse(key, span, message, &allowed);
        }
        let list: Vec<Value> = value.into_iter().flatten().collect();
        let numbers = self.read_list(key, &list, &span, (Dimension::Length, bounds), system)?;
        let pairs = numbers.as_chunks::<2>().0.to_vec();
        Some(Given { value: pairs, span })
    }

    /// Reads the elements of a list; the first that is refused is noted.
    pub fn read_list(
        &mut self,
        key: &'static str,
        list: &[Value],
        span: &Span,
        (dimension, bounds): (Dimension, Bounds),
        system: &System,
    ) -> Option<Vec<f64>> {
        let name = self.name(key);
        let read = |(i, value)| system.read(&format!("{name}[{i}]"), value, dimension, bounds);
        match list.iter().enumerate().map(read).collect::<Result<Vec<f64>, _>>() {
            Ok(numbers) => Some(numbers),
            Err(refusal) => self.refuse_quantity(key, span.clone(), refusal),
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
