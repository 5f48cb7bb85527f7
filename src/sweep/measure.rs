//! What is read off the run of a case on the way, as [`percuss_table::measures`] defines it.
//!
//! The numbers are those that a recording would have, in its units, so `percuss-read summary` measures the same.

use std::{borrow::Cow, collections::BTreeMap, sync::LazyLock};

use percuss_table::measures::{EXTENSION, Measure, Observations, RECONTACT, SEPARATION, Said};

use serde::{Deserialize, Serialize};

use crate::{
    case::Case,
    session::{Flow, Observer, RunError},
    units::Units,
    validity::{Peak, Validity},
    view::{EventKind, View},
};

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

/// Measures a run that it observes.
pub struct Measuring {
    units: Units,
    seen: Observations,
}

impl Measuring {
    /// Measures a run of `case`.
    pub fn new(case: &Case) -> Self {
        Self { units: case.units(), seen: Observations::default() }
    }

    /// What was measured, in the units of the case.
    pub fn measures(&self, validity: &Validity) -> Measures {
        let Units { length, time, speed, stress, .. } = self.units;
        let traction = |peak: Option<Peak>| {
            peak.map_or([None; 3], |peak| {
                [stress.of(peak.value), length.of(peak.r), time.of(peak.time)].map(Some)
            })
        };
        let strain = &validity.strain;
        let place = [length.of(strain.r), length.of(strain.z), time.of(strain.time)].map(Some);
        let [r, z, when] = place;
        let said = Said {
            largest_strain: [Some(strain.value), r, z, when],
            impact_velocity: Some(speed.of(validity.impact_velocity())),
            mesh_loss: validity.mesh_loss,
            interfaces: validity
                .interfaces
                .iter()
                .map(|peaks| [Some(peaks.tension), peaks.shear].map(traction))
                .collect(),
        };
        let values = self.seen.measures(&said).into_iter().map(|measure| measure.value);
        Measures(values.map(|value| value.filter(|x| x.is_finite())).collect())
    }
}

impl Observer for Measuring {
    fn observe(&mut self, view: &View<'_>) -> Result<Flow, RunError> {
        let Units { length, time, speed, force, energy, .. } = self.units;
        let now = time.of(view.time);
        self.seen.take_drag(now, Some(force.of(view.drag)), Some(length.of(view.contact_radius)));
        self.seen.take_motion(now, Some(speed.of(view.velocity)), Some(length.of(view.depth)));
        if let Some(frame) = &view.frame {
            let [kinetic, strain] =
                [frame.energy.kinetic, frame.energy.strain].map(|part| Some(energy.of(part)));
            self.seen.take_energy(now, kinetic, strain);
        }
        for event in &*view.events {
            let kind = match event.kind {
                EventKind::Extension => EXTENSION,
                EventKind::Separation => SEPARATION,
                EventKind::Recontact => RECONTACT,
                _ => continue,
            };
            self.seen.take_event(now, kind, event.since.map(|since| time.of(since)));
        }
        Ok(Flow::Continue)
    }
}
