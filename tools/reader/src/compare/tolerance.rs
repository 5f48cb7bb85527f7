//! What differences are allowed, field by field.

use clap::Args;
use percuss_output::number::{finite, whole};
use serde::Deserialize;

use crate::{convention, select::Pattern};

/// What is allowed of some fields.
///
#[doc = include_str!("tolerance.md")]
#[derive(Args, Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    /// Pattern of `topic.field`, or of a topic, then for all of its fields; `time` is for times and steps of all topics.
    #[arg(skip)]
    pub field: String,
    /// Absolute tolerance of all other fields
    #[arg(long, value_name = "X", value_parser = finite(0.0..))]
    pub abs: Option<f64>,
    /// Tolerance relative to the reference value, of all other fields
    #[arg(long, value_name = "X", value_parser = finite(0.0..))]
    pub rel: Option<f64>,
    /// Tolerance relative to the peak of the field, of all other fields
    #[arg(long, value_name = "X", value_parser = finite(0.0..))]
    pub peak_rel: Option<f64>,
    /// Tolerance relative to the range of the field, of all other fields
    #[arg(long, value_name = "X", value_parser = finite(0.0..))]
    pub range_rel: Option<f64>,
    /// Tolerance in units in the last place, of all other fields
    #[arg(long, value_name = "N", value_parser = whole(0_u64..))]
    pub ulp: Option<u64>,
    /// Tolerance in the relative L2 norm, of all other fields
    #[arg(long, value_name = "X", value_parser = finite(0.0..))]
    pub l2_rel: Option<f64>,
    /// Around the reference in time and value.
    #[arg(skip)]
    pub tube: Option<Tube>,
    /// Not compared at all.
    #[arg(skip)]
    #[serde(default)]
    pub ignore: bool,
}

/// A tube around the reference: b(t) must lie between the least and greatest a(t'), |t' − t| ≤ `time`, widened by
/// `value`.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields, expecting = "a table, { time = 0.1, value = 1e-3 }")]
pub struct Tube {
    /// Half-width in time.
    pub time: f64,
    /// Half-width in value.
    pub value: f64,
}

impl Tolerance {
    /// True if single elements are checked.
    pub fn holds_elements(&self) -> bool {
        self.l2_rel.is_none() || !Self { l2_rel: None, ..self.clone() }.is_bitwise()
    }

    /// True if nothing but the same bits is allowed.
    pub fn is_bitwise(&self) -> bool {
        self.ulp.is_none() && self.tube.is_none() && self.numbers().next().is_none()
    }

    /// True if the reference has to be read before it is compared.
    pub fn needs_scale(&self) -> bool {
        self.peak_rel.is_some() || self.range_rel.is_some()
    }

    /// The plain numbers that are given, by their names.
    fn numbers(&self) -> impl Iterator<Item = (&'static str, f64)> + use<> {
        let named = [
            ("abs", self.abs),
            ("rel", self.rel),
            ("peak_rel", self.peak_rel),
            ("range_rel", self.range_rel),
            ("l2_rel", self.l2_rel),
        ];
        named.into_iter().filter_map(|(name, value)| Some((name, value?)))
    }

    fn check(&self) -> Result<(), String> {
        let tube = self.tube.map(|tube| [("tube.time", tube.time), ("tube.value", tube.value)]);
        let mut numbers = self.numbers().chain(tube.into_iter().flatten());
        match numbers.find(|(_, value)| !(*value >= 0.0 && value.is_finite())) {
            None => Ok(()),
            Some((name, value)) => {
                Err(format!("`{name}` = {value} is not possible: a number >= 0 is needed"))
            }
        }
    }
}

impl std::fmt::Display for Tolerance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut parts: Vec<String> = Vec::new();
        parts.extend(self.numbers().map(|(name, value)| format!("{name}={value:e}")));
        parts.extend(self.ulp.map(|ulp| format!("ulp={ulp}")));
        parts.extend(self.tube.map(|tube| format!("tube={:e}:{:e}", tube.time, tube.value)));
        match (self.ignore, parts.is_empty()) {
            (true, _) => f.write_str("ignore"),
            (false, true) => f.write_str("bitwise"),
            (false, false) => f.write_str(&parts.join(",")),
        }
    }
}

/// A tolerance and the fields it is for.
#[derive(Clone, Debug)]
pub struct Rule {
    /// The pattern of the tolerance.
    pub fields: Pattern,
    /// What is allowed.
    pub tolerance: Tolerance,
    /// Where it was given: `flag` or the file and number.
    pub origin: String,
}

impl Rule {
    /// A rule, if its numbers are possible.
    ///
    /// # Errors
    ///
    /// The pattern or a number is not possible.
    pub fn new(tolerance: Tolerance, origin: String) -> Result<Self, String> {
        tolerance.check()?;
        Ok(Self { fields: tolerance.field.parse()?, tolerance, origin })
    }

    /// True if it is for a field of a topic.
    pub(super) fn fits(&self, topic: &str, field: &str) -> bool {
        let fits = |name: &str| self.fields.fits(name);
        self.fits_time(field) || fits(&format!("{topic}.{field}")) || fits(topic)
    }

    /// True if it is the rule `time`, and a field says which message it is.
    pub(super) fn fits_time(&self, field: &str) -> bool {
        self.fields.text() == convention::TIME && matches!(field, convention::TIME | convention::STEP)
    }
}

impl std::str::FromStr for Rule {
    type Err = String;

    /// `PATTERN:abs=1e-9,peak_rel=1e-6`, `PATTERN:tube=TIME:VALUE`, `PATTERN:ignore`, or without the pattern for all.
    fn from_str(text: &str) -> Result<Self, String> {
        let (pattern, settings) = match text.find(':') {
            Some(at) if !text[..at].contains('=') => (&text[..at], &text[at + 1..]),
            _ => ("*", text),
        };
        let mut tolerance = Tolerance { field: pattern.into(), ..Tolerance::default() };
        for setting in settings.split(',').map(str::trim).filter(|setting| *setting != "bitwise") {
            let (name, value) = setting.split_once('=').unwrap_or((setting, ""));
            let number = |text: &str| {
                text.parse::<f64>().map_err(|_| format!("`{text}` in `{setting}` is not a number"))
            };
            match name {
                "abs" => tolerance.abs = Some(number(value)?),
                "rel" => tolerance.rel = Some(number(value)?),
                "peak_rel" => tolerance.peak_rel = Some(number(value)?),
                "range_rel" => tolerance.range_rel = Some(number(value)?),
                "l2_rel" => tolerance.l2_rel = Some(number(value)?),
                "ulp" => {
                    tolerance.ulp = Some(value.parse().map_err(|_| format!("`{value}` is not a count"))?)
                }
                "tube" => {
                    let (time, value) = value.split_once(':').ok_or("write a tube as tube=TIME:VALUE")?;
                    tolerance.tube = Some(Tube { time: number(time)?, value: number(value)? });
                }
                "ignore" if value.is_empty() => tolerance.ignore = true,
                _ => {
                    let known = "abs, rel, peak_rel, range_rel, ulp, l2_rel, tube, ignore, bitwise";
                    return Err(format!("`{name}` is no tolerance; there are {known}"));
                }
            }
        }
        Self::new(tolerance, format!("--tol {text}"))
    }
}

/// All tolerances; the first that fits a field counts.
#[derive(Clone, Debug, Default)]
pub struct Rules {
    /// In order.
    pub rules: Vec<Rule>,
}

/// A tolerance file: a list of `[[tolerance]]` tables.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    #[serde(default)]
    tolerance: Vec<Tolerance>,
}

impl Rules {
    /// Adds the rules of a TOML file, after those that are there.
    ///
    /// # Errors
    ///
    /// The text is no list of tolerances.
    pub fn add_file(&mut self, name: &str, text: &str) -> Result<(), String> {
        let document: Document = toml::from_str(text).map_err(|error| {
            // types in words of TOML
            let error = error.to_string().replace("expected f64", "expected a number");
            format!("`{name}`: {}", error.replace("expected u64", "expected a whole number from 0 on"))
        })?;
        for (i, tolerance) in document.tolerance.into_iter().enumerate() {
            let origin = format!("{name}, tolerance {}", i + 1);
            let rule = Rule::new(tolerance, origin.clone());
            self.rules.push(rule.map_err(|error| format!("{origin}: {error}"))?);
        }
        Ok(())
    }

    /// The rule for a field; `None` is bitwise.
    pub fn of(&self, topic: &str, field: &str) -> Option<&Rule> {
        self.rules.iter().find(|rule| rule.fits(topic, field))
    }

    /// True if a rule is for this field, and not for all fields of topics.
    pub(super) fn name(&self, topic: &str, field: &str) -> bool {
        let name = format!("{topic}.{field}");
        self.rules.iter().any(|rule| rule.fields.text().ends_with(field) && rule.fields.fits(&name))
    }

    /// True if a topic, or a field, is to be left out.
    pub fn ignores(&self, topic: &str, field: Option<&str>) -> bool {
        let rule = match field {
            Some(field) => self.of(topic, field),
            None => self.rules.iter().find(|rule| rule.fields.fits(topic)),
        };
        rule.is_some_and(|rule| rule.tolerance.ignore)
    }
}
