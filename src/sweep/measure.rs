//! What was measured of the cases of a sweep, in a journal and in the columns of a summary.
//!
//! The numbers are those that recordings have, in their units, so `percuss-read summary` says the same.

use std::{borrow::Cow, collections::BTreeMap, sync::LazyLock};

use percuss_table::measures::{Measure, Observations, Said};
use serde::{Deserialize, Serialize};

/// The measures of a case of a target with so many interfaces of which nothing is known.
pub fn nothing(interfaces: usize) -> Vec<Measure> {
    let said = Said { interfaces: vec![Default::default(); interfaces], ..Said::default() };
    Observations::default().measures(&said)
}

/// Measures of a target of one layer, and those that each interface adds.
static SINGLE: LazyLock<usize> = LazyLock::new(|| nothing(0).len());
static EACH: LazyLock<usize> = LazyLock::new(|| nothing(1).len() - *SINGLE);

/// Largest number of an interface that a name may have.
const MOST: usize = 1000;

/// Number of the interface in the name of a measure.
fn interface_of(name: &str) -> Option<usize> {
    name.strip_prefix("interface.")?.split('.').next()?.parse().ok().filter(|number| *number <= MOST)
}

/// True for the name of a measure.
pub fn is_name(text: &str) -> bool {
    names(interface_of(text).unwrap_or(0)).iter().any(|name| name == text)
}

/// Names of all measures.
pub fn names(interfaces: usize) -> Vec<Cow<'static, str>> {
    nothing(interfaces).into_iter().map(|measure| measure.name).collect()
}

/// What was measured of a case, in the order of the columns; in a journal by name, where only known numbers stand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "BTreeMap<String, f64>", into = "BTreeMap<String, f64>")]
pub struct Measures(Box<[Option<f64>]>);

impl Measures {
    /// A number by its name.
    pub fn get(&self, name: &str) -> Option<f64> {
        let place = names(self.interfaces()).iter().position(|known| known == name)?;
        self.0.get(place).copied().flatten()
    }

    /// The numbers in the order of the columns.
    pub fn values(&self) -> impl Iterator<Item = Option<f64>> {
        self.0.iter().copied()
    }

    /// Number of interfaces of which there are numbers.
    pub fn interfaces(&self) -> usize {
        self.0.len().saturating_sub(*SINGLE) / *EACH
    }
}

impl From<Vec<Measure>> for Measures {
    fn from(measures: Vec<Measure>) -> Self {
        Self(measures.into_iter().map(|measure| measure.value.filter(|x| x.is_finite())).collect())
    }
}

impl From<BTreeMap<String, f64>> for Measures {
    fn from(known: BTreeMap<String, f64>) -> Self {
        let interfaces = known.keys().filter_map(|name| interface_of(name)).max().unwrap_or(0);
        Self(names(interfaces).iter().map(|name| known.get(&**name).copied()).collect())
    }
}

impl From<Measures> for BTreeMap<String, f64> {
    fn from(measures: Measures) -> Self {
        let names = names(measures.interfaces()).into_iter().zip(&measures.0);
        names.filter_map(|(name, value)| Some((name.into_owned(), (*value)?))).collect()
    }
}
