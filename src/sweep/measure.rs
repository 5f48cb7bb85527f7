//! What was measured of the cases of a sweep, in a journal and in the columns of a summary.
//!
//! The numbers are those that recordings have, in their units, so `percuss-read summary` says the same.

use std::{borrow::Cow, collections::BTreeMap, sync::LazyLock};

use percuss_table::measures::{BODIES, Measure};
use serde::{Deserialize, Serialize};

use crate::measuring::nothing;

/// Measures of bodies of one layer, and those that each interface adds.
static SINGLE: LazyLock<usize> = LazyLock::new(|| nothing([0; 2]).len());
static EACH: LazyLock<usize> = LazyLock::new(|| nothing([1, 0]).len() - *SINGLE);

/// Largest number of an interface that a name may have.
const MOST: usize = 1000;

/// Largest numbers of interfaces of either body in names of measures.
fn interfaces<'a>(names: impl Iterator<Item = &'a str> + Clone) -> [usize; 2] {
    BODIES.map(|body| {
        let number = |name: &str| {
            let name = name.strip_prefix(body)?.strip_prefix("interface.")?;
            name.split('.').next()?.parse().ok().filter(|number| *number <= MOST)
        };
        names.clone().filter_map(number).max().unwrap_or(0)
    })
}

pub fn is_name(text: &str) -> bool {
    names(interfaces([text].into_iter())).iter().any(|name| name == text)
}

/// Names of all measures.
///
/// * `interfaces`: their numbers in target and indenter
pub fn names(interfaces: [usize; 2]) -> Vec<Cow<'static, str>> {
    nothing(interfaces).into_iter().map(|measure| measure.name).collect()
}

/// What was measured of a case, in the order of the columns; in a journal by name, where only known numbers stand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
pub struct Measures {
    numbers: Box<[Option<f64>]>,
    /// Numbers of interfaces of target and indenter of which there are numbers.
    pub interfaces: [usize; 2],
}

impl Measures {
    pub fn get(&self, name: &str) -> Option<f64> {
        let place = names(self.interfaces).iter().position(|known| known == name)?;
        self.numbers.get(place).copied().flatten()
    }

    /// The numbers in the order of the columns of cases with so many interfaces, at least as many as there are numbers of.
    pub fn values(&self, interfaces: [usize; 2]) -> impl Iterator<Item = Option<f64>> {
        let (single, layered) = self.numbers.split_at(self.numbers.len().min(*SINGLE));
        let (target, indenter) = layered.split_at(self.interfaces[0] * *EACH);
        let counts = [*SINGLE, interfaces[0] * *EACH, interfaces[1] * *EACH];
        let parts = [single, target, indenter].into_iter().zip(counts);
        parts.flat_map(|(part, count)| (0..count).map(|place| part.get(place).copied().flatten()))
    }
}

impl From<Vec<Measure>> for Measures {
    fn from(measures: Vec<Measure>) -> Self {
        let interfaces = interfaces(measures.iter().map(|measure| &*measure.name));
        let numbers = measures.into_iter().map(|measure| measure.value.filter(|x| x.is_finite()));
        Self { numbers: numbers.collect(), interfaces }
    }
}

impl From<BTreeMap<String, f64>> for Measures {
    fn from(known: BTreeMap<String, f64>) -> Self {
        let interfaces = interfaces(known.keys().map(String::as_str));
        let numbers = names(interfaces).iter().map(|name| known.get(&**name).copied()).collect();
        Self { numbers, interfaces }
    }
}

impl From<Measures> for BTreeMap<String, f64> {
    fn from(measures: Measures) -> Self {
        let names = names(measures.interfaces).into_iter().zip(&measures.numbers);
        names.filter_map(|(name, value)| Some((name.into_owned(), (*value)?))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_in_the_columns_of_cases_with_more_interfaces() {
        let known =
            [("peak_force", 1.0), ("interface.1.shear", 2.0), ("indenter.interface.2.tension_r", 3.0)];
        let known = BTreeMap::from(known.map(|(name, value)| (name.to_owned(), value)));
        let measures = Measures::from(known.clone());
        assert_eq!((measures.interfaces, measures.get("interface.1.shear")), ([1, 2], Some(2.0)));
        for interfaces in [[1, 2], [3, 2], [2, 4]] {
            let (names, values) = (names(interfaces), measures.values(interfaces));
            let columns: Vec<_> = names.iter().zip(values).collect();
            assert_eq!(columns.len(), names.len());
            let seen = columns.into_iter().filter_map(|(name, value)| Some((name.to_string(), value?)));
            assert_eq!(BTreeMap::from_iter(seen), known, "{interfaces:?}");
        }
        assert_eq!(BTreeMap::from(measures), known);
        assert!(Measures::default().values([1, 1]).all(|value| value.is_none()));
        assert!(is_name("indenter.interface.3.ratio") && !is_name("indenter.peak_force"));
    }
}
