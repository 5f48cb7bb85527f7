//! Engineering prefixes: the unit in which numbers of an SI quantity are best read, and tables in such units, SI columns scaled so that
//! their largest number has one to three digits before the point.

use std::{borrow::Cow, collections::HashMap, io, sync::OnceLock};

use percuss_table::{
    Cell, CellType, Heading, Sink,
    units::{
        ENERGY, ENERGY_PER_LENGTH, FORCE, FORCE_PER_LENGTH, LENGTH, PREFIXES, SPEED, STRESS, TIME, Unit,
        prefix,
    },
};

use crate::failure::Failure;

/// A unit with a prefix.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefixed {
    /// Number of this unit in one of the plain unit: 1e6 for µs.
    pub factor: f64,
    /// The unit with its prefix: `µs`, `kN`, `MPa`.
    pub unit: String,
}

/// Units of the SI that may have a prefix: those of what is recorded, and of impulses.
fn known(unit: &str) -> Option<&'static str> {
    QUANTITIES.into_iter().flat_map(|(_, units)| units).copied().find(|known| *known == unit)
}

/// Quantities, and the units of the SI that recordings have them in: the second of a plane case, per length.
pub(crate) const QUANTITIES: [(&str, &[&str]); 7] = [
    (TIME.quantity, &[TIME.si]),
    (LENGTH.quantity, &[LENGTH.si]),
    (SPEED.quantity, &[SPEED.si]),
    (FORCE.quantity, &[FORCE.si, FORCE_PER_LENGTH.si]),
    (STRESS.quantity, &[STRESS.si]),
    (ENERGY.quantity, &[ENERGY.si, ENERGY_PER_LENGTH.si]),
    ("impulse", &["N s", "N s/m"]),
];

/// What is shown in place of a unit of the SI, for as long as the program runs.
static PREFERRED: OnceLock<Vec<(&'static str, Prefixed)>> = OnceLock::new();

/// Shows units of the SI as these where none is asked for; of several for one unit the last. Only the first call counts.
pub(crate) fn prefer(units: Vec<(&'static str, Prefixed)>) {
    let _ = PREFERRED.set(units);
}

impl Prefixed {
    /// The unit that is preferred, else that in which the largest number is from 1 to 1000; `None` if the unit takes no prefix.
    ///
    /// Speeds stay in m/s, as mm/s and km/s are read less easily.
    ///
    /// * `largest`: largest number by magnitude, in the plain unit
    pub fn choose(unit: &str, largest: f64) -> Option<Self> {
        let preferred = PREFERRED.get().and_then(|all| all.iter().rev().find(|(base, _)| *base == unit));
        preferred.map(|(_, shown)| shown.clone()).or_else(|| Self::fitting(unit, largest))
    }

    /// As [`Prefixed::choose`], whatever is preferred: for names, as those of columns, which are the same for every reader.
    pub fn fitting(unit: &str, largest: f64) -> Option<Self> {
        let unit = known(unit)?;
        let (power, letter) = prefix(largest, unit, 1e-12);
        Some(Self { factor: 10f64.powi(-power), unit: format!("{letter}{unit}") })
    }

    /// A number of the plain unit in this one, rounded once: powers of ten are exact only upwards.
    pub fn apply(&self, number: f64) -> f64 {
        if self.factor < 1.0 { number / (1.0 / self.factor).round() } else { number * self.factor }
    }
}

/// A unit of the SI with a prefix as power of ten and unit: `kN` is 10³ N. `None` for others.
pub(crate) fn plain(unit: &str) -> Option<(i32, &'static str)> {
    let unit = unit.replace(['u', 'μ'], "µ");
    let of = |&(power, prefix): &(i32, &str)| {
        let rest = unit.strip_prefix(prefix)?;
        Some((power, known(rest)?))
    };
    // `m` and `m/s` are themselves
    PREFIXES.iter().filter(|(power, _)| *power == 0).chain(&PREFIXES).find_map(of)
}

/// A time or length as it is typed, with or without a unit: `32us` is `32e-6` and true, `0.5` is itself. Only the exponent is changed, so that the
/// number is rounded once.
///
/// # Errors
///
/// It is no number, or its unit is not of the quantity.
pub(crate) fn typed<'a>(
    text: &'a str,
    Unit { quantity, si: base, .. }: Unit,
) -> Result<(Cow<'a, str>, bool), String> {
    let text = text.trim();
    let is_number = |text: &str| text.parse::<f64>().is_ok_and(|number| !number.is_nan());
    if is_number(text) {
        return Ok((text.into(), false));
    }
    let ends = (1..text.len()).rev().filter(|end| text.is_char_boundary(*end));
    let end = ends.into_iter().find(|end| is_number(text[..*end].trim()));
    let (number, unit) = text.split_at(end.ok_or_else(|| format!("`{text}` is not a number"))?);
    let (number, unit) = (number.trim(), unit.trim());
    let prefixes = PREFIXES.into_iter().filter(|(power, _)| *power <= 0);
    let prefixes = prefixes.chain((base == LENGTH.si).then_some((-2, "c")));
    let known: Vec<(i32, String)> =
        prefixes.map(|(power, prefix)| (power, format!("{prefix}{base}"))).collect();
    let name = unit.replace(['u', 'μ'], "µ");
    let Some((power, _)) = known.iter().find(|(_, known)| *known == name) else {
        let known = known.into_iter().map(|(_, known)| known).collect::<Vec<_>>().join(", ");
        return Err(format!("`{unit}` is no unit of {quantity}; known are {known} (u stands for µ)"));
    };
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let exponent = exponent.parse::<i32>().ok().and_then(|exponent| exponent.checked_add(*power));
    let number = exponent.map(|exponent| format!("{mantissa}e{exponent}")).filter(|text| is_number(text));
    Ok((number.ok_or_else(|| format!("`{text}` is not a number"))?.into(), true))
}

/// A unit was typed where numbers that are recorded have another, or none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}; write numbers without a unit")]
pub struct UnitError(String);

impl From<UnitError> for Failure {
    fn from(error: UnitError) -> Self {
        Self::Usage(error.to_string())
    }
}

impl UnitError {
    /// Refuses typed units for numbers that are not recorded in their base unit.
    ///
    /// * `what`: has the numbers, times or a coordinate
    pub(crate) fn check(
        is_typed: bool,
        Unit { si: base, .. }: Unit,
        topic: &str,
        what: &str,
        recorded: Option<&str>,
    ) -> Result<(), Self> {
        if !is_typed || recorded == Some(base) {
            return Ok(());
        }
        let recorded = match recorded {
            Some(unit) if Prefixed::choose(unit, 1.0).is_none() => {
                format!("are in {unit}, the recording has no units of the SI")
            }
            Some(unit) => format!("are in {unit}"),
            None => "are recorded without a unit".into(),
        };
        Err(Self(format!("{what} of `{topic}` {recorded}")))
    }
}

/// A number as people read it: five digits, without zeros at its end.
pub(crate) fn short(number: f64) -> String {
    let rounded = format!("{number:.4e}").parse::<f64>().unwrap_or(number);
    let text = format!("{rounded:?}");
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// A number for people: four digits and its unit, with a prefix where it takes one, `52.31 µs`, `1.204 kN`, `0.3155 R`.
pub fn engineering(number: f64, unit: Option<&str>) -> String {
    let prefixed = unit.and_then(|unit| Prefixed::choose(unit, number));
    let (number, unit) = match &prefixed {
        // four digits of what is a little less than the next prefix are that prefix
        Some(chosen) if chosen.apply(number).abs() >= 999.95 => {
            let chosen =
                Prefixed::choose(unit.unwrap_or_default(), 1.0001 * number).unwrap_or_else(|| chosen.clone());
            (chosen.apply(number), chosen.unit)
        }
        Some(chosen) => (chosen.apply(number), chosen.unit.clone()),
        None => (number, unit.unwrap_or_default().to_owned()),
    };
    let rounded: f64 = format!("{number:.3e}").parse().unwrap_or(number);
    let whole = if rounded == 0.0 { 4.0 } else { rounded.abs().log10().floor() + 1.0 };
    let text = if (-3.0..=6.0).contains(&whole) {
        format!("{rounded:.*}", (4.0 - whole).max(0.0) as usize)
    } else {
        format!("{rounded:.3e}")
    };
    format!("{text} {unit}").trim_end().to_owned()
}

/// The largest magnitude of every column of a table; takes no memory for its rows.
#[derive(Debug, Default)]
pub struct Largest {
    columns: Vec<f64>,
}

impl Sink for Largest {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        self.columns = vec![0.0; headings.len()];
        Ok(())
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        for (largest, cell) in self.columns.iter_mut().zip(cells) {
            let number = cell.number().map(f64::abs).filter(|number| number.is_finite());
            *largest = largest.max(number.unwrap_or(0.0));
        }
        Ok(())
    }
}

impl Largest {
    /// The unit of every column; `None` where it stays as it is.
    ///
    /// * `groups`: columns of the same group and unit share a prefix
    /// * `choose`: the unit for a plain unit and the largest number in it
    pub fn units(
        &self,
        headings: &[Heading],
        groups: &[String],
        choose: impl Fn(&str, f64) -> Option<Prefixed>,
    ) -> Vec<Option<Prefixed>> {
        let mut largest: HashMap<_, f64> = HashMap::new();
        for ((heading, group), number) in headings.iter().zip(groups).zip(&self.columns) {
            let largest = largest.entry((group, &heading.unit)).or_default();
            *largest = largest.max(*number);
        }
        let unit = |(heading, group): (&Heading, &String)| {
            let unit = heading.unit.as_deref().filter(|_| takes_prefix(heading))?;
            let largest = largest.get(&(group, &heading.unit)).copied().unwrap_or_default();
            choose(unit, largest).filter(|chosen| chosen.factor != 1.0)
        };
        headings.iter().zip(groups).map(unit).collect()
    }
}

/// True for columns whose unit can have a prefix.
pub fn takes_prefix(heading: &Heading) -> bool {
    let is_scalable = matches!(heading.kind, CellType::Double | CellType::Float);
    is_scalable && heading.unit.as_deref().is_some_and(|unit| Prefixed::choose(unit, 1.0).is_some())
}

/// Hands a table on in other units.
pub struct InUnits<'a> {
    sink: &'a mut dyn Sink,
    units: Vec<Option<Prefixed>>,
    cells: Vec<Cell>,
}

impl<'a> InUnits<'a> {
    /// * `units`: unit of every column; `None` for those that stay
    pub fn new(sink: &'a mut dyn Sink, units: Vec<Option<Prefixed>>) -> Self {
        Self { sink, units, cells: Vec::new() }
    }
}

impl Sink for InUnits<'_> {
    fn begin(&mut self, headings: &[Heading]) -> io::Result<()> {
        let mut headings = headings.to_vec();
        for (heading, unit) in headings.iter_mut().zip(&self.units) {
            if let Some(chosen) = unit {
                heading.unit = Some(chosen.unit.clone());
            }
        }
        self.sink.begin(&headings)
    }

    fn row(&mut self, cells: &[Cell]) -> io::Result<()> {
        self.cells.clear();
        let scaled = |(cell, unit): (&Cell, &Option<Prefixed>)| match (cell, unit) {
            (Cell::Double(number), Some(unit)) => Cell::Double(unit.apply(*number)),
            (Cell::Float(number), Some(unit)) => Cell::Float(unit.apply(f64::from(*number)) as f32),
            (cell, _) => cell.clone(),
        };
        self.cells.extend(cells.iter().zip(&self.units).map(scaled));
        self.sink.row(&self.cells)
    }

    fn group(&mut self) -> io::Result<()> {
        self.sink.group()
    }

    fn end(&mut self) -> io::Result<()> {
        self.sink.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_for_people_have_four_digits() {
        for (number, unit, expected) in [
            (527_438_295.3, Some("Pa"), "527.4 MPa"),
            (0.000_100_466, Some("m"), "100.5 µm"),
            (0.000_999_99, Some("s"), "1.000 ms"),
            (-3457.69, Some("N"), "-3.458 kN"),
            (0.0, Some("m"), "0 m"),
            (2680.0, Some("m/s"), "2680 m/s"),
            (0.315_51, Some("R"), "0.3155 R"),
            (0.082_026, None, "0.08203"),
            (3e-13, None, "3.000e-13"),
            (f64::NAN, None, "NaN"),
        ] {
            assert_eq!(engineering(number, unit), expected);
        }
    }
}
