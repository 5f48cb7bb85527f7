//! Units in which quantities are shown: chosen with `--unit`, else with the prefix that fits.

use std::str::FromStr;

use clap::Args;

use percuss_table::units::PREFIXES;

use crate::{
    failure::Failure,
    prefix::{self, Prefixed, QUANTITIES, plain},
};

/// The unit of a quantity, as it is typed: `force=kN`.
#[derive(Clone, Debug, PartialEq)]
pub struct ChosenUnit {
    /// Unit without prefix.
    base: &'static str,
    shown: Prefixed,
}

impl FromStr for ChosenUnit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, unit) = text.split_once('=').ok_or("write a quantity and its unit, as in force=kN")?;
        let bases = QUANTITIES.into_iter().find(|(known, _)| *known == name.trim()).map(|(_, bases)| bases);
        let bases = bases.ok_or_else(|| {
            let names = QUANTITIES.map(|(name, _)| name).join(", ");
            format!("`{}` is no quantity; known are {names}", name.trim())
        })?;
        let unit = unit.trim().replace(['u', 'μ'], "µ");
        let found = plain(&unit).filter(|(_, base)| bases.contains(base));
        let (power, base) = found.ok_or_else(|| {
            let prefixes = PREFIXES.map(|(_, prefix)| prefix).join(" ");
            let bases = bases.join(" or ");
            format!(
                "`{unit}` is no unit of {}; known is {bases}, with one of the prefixes {}",
                name.trim(),
                prefixes.trim()
            )
        })?;
        Ok(Self { base, shown: Prefixed { factor: 10f64.powi(-power), unit } })
    }
}

/// Shows quantities in the units that `PERCUSS_UNITS` has, `force=N,time=ms`, where none is asked for.
///
/// # Errors
///
/// They are no units.
pub(crate) fn prefer() -> Result<(), Failure> {
    let Some(text) = std::env::var_os("PERCUSS_UNITS") else { return Ok(()) };
    let text = text.to_string_lossy();
    let units = text.split(',').filter(|unit| !unit.trim().is_empty());
    let chosen = units
        .map(|unit| unit.parse().map(|ChosenUnit { base, shown }| (base, shown)))
        .collect::<Result<_, _>>()
        .map_err(|error| Failure::Usage(format!("the environment's PERCUSS_UNITS: {error}")))?;
    prefix::prefer(chosen);
    Ok(())
}

/// The units that are chosen.
#[derive(Args, Clone, Debug, Default, PartialEq)]
pub struct Units {
    /// Unit in which an SI quantity is shown, instead of that with the prefix that fits: time=ms, length=mm, velocity, force=kN,
    /// stress=MPa, energy, impulse; may be repeated. PERCUSS_UNITS=force=N,time=ms in the environment does it for all
    #[arg(long = "unit", value_name = "QUANTITY=UNIT")]
    chosen: Vec<ChosenUnit>,
}

impl Units {
    /// True if none is chosen.
    pub(crate) fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    /// The unit that is chosen for numbers in an SI unit, the last if there are several.
    pub(crate) fn of(&self, unit: &str) -> Option<Prefixed> {
        self.chosen.iter().rev().find(|chosen| chosen.base == unit).map(|chosen| chosen.shown.clone())
    }

    /// The unit that is chosen, else that in which the largest number is best read.
    ///
    /// * `largest`: largest number by magnitude, in the plain unit
    pub(crate) fn choose(&self, unit: &str, largest: f64) -> Option<Prefixed> {
        self.of(unit).or_else(|| Prefixed::choose(unit, largest))
    }

    /// The unit that is chosen, and where prefixes are wanted, else that in which the largest number is best read.
    pub(crate) fn shown(&self, unit: &str, largest: f64, prefixed: bool) -> Option<Prefixed> {
        if prefixed { self.choose(unit, largest) } else { self.of(unit) }
    }
}
