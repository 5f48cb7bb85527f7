//! What is read off the run of a case on the way, as [`percuss_table::measures`] defines it.
//!
//! The numbers are those that a recording would have, in its units, so `percuss-read summary` measures the same.

use std::{collections::BTreeMap, sync::LazyLock};

use percuss_table::measures::{
    Drag, EXTENSION, Measure, Moment, Motion, Observations, RECONTACT, SEPARATION, Story,
};

use serde::{Deserialize, Serialize};

use crate::{
    case::Case,
    session::{Flow, Observer, RunError},
    units::Units,
    validity::Validity,
    view::{EventKind, View},
};

/// The measures of a case of which nothing is known.
pub static NOTHING: LazyLock<Vec<Measure>> = LazyLock::new(|| Observations::default().measures());

/// Names of all measures.
pub fn names() -> Vec<&'static str> {
    NOTHING.iter().map(|measure| measure.name).collect()
}

/// True for the name of a measure.
pub fn is_name(text: &str) -> bool {
    names().contains(&text)
}

/// What was measured of a case, in the order of the columns; in a journal by name, where only known numbers stand.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(from = "BTreeMap<String, f64>", into = "BTreeMap<&'static str, f64>")]
pub struct Measures(Box<[Option<f64>]>);

impl Measures {
    /// A number by its name.
    pub fn get(&self, name: &str) -> Option<f64> {
        let place = NOTHING.iter().position(|measure| measure.name == name)?;
        self.0.get(place).copied().flatten()
    }
}

impl From<BTreeMap<String, f64>> for Measures {
    fn from(known: BTreeMap<String, f64>) -> Self {
        Self(NOTHING.iter().map(|measure| known.get(measure.name).copied()).collect())
    }
}

impl From<Measures> for BTreeMap<&'static str, f64> {
    fn from(measures: Measures) -> Self {
        let names = NOTHING.iter().map(|measure| measure.name);
        names.zip(&measures.0).filter_map(|(name, value)| Some((name, (*value)?))).collect()
    }
}

/// Measures a run that it observes.
pub struct Measuring {
    units: Units,
    story: Story,
    drag: Drag,
    /// Time, velocity and displacement of every step: what counts is where contact ends, which is known only later.
    motion: Vec<[f64; 3]>,
    /// Time and energy of the target at every frame.
    energy: Vec<[f64; 2]>,
}

impl Measuring {
    /// Measures a run of `case`.
    pub fn new(case: &Case) -> Self {
        let (motion, energy) = (Vec::new(), Vec::new());
        Self { units: case.units(), story: Story::default(), drag: Drag::default(), motion, energy }
    }

    /// What was measured, in the units of the case.
    pub fn measures(&self, validity: &Validity) -> Measures {
        let Units { length, time, speed, .. } = self.units;
        let (mut motion, mut energy) =
            (Motion::at(self.story.separation()), Moment::at(self.story.separation()));
        for &[time, velocity, depth] in &self.motion {
            motion.take(time, Some(velocity), Some(depth));
        }
        self.energy.iter().for_each(|&[time, target]| energy.take(time, Some(target)));
        let strain = &validity.strain;
        let place = [length.of(strain.r), length.of(strain.z), time.of(strain.time)].map(Some);
        let [r, z, when] = place;
        let observations = Observations {
            story: self.story,
            drag: self.drag,
            motion,
            energy,
            largest_strain: [Some(strain.value), r, z, when],
            impact_velocity: Some(speed.of(validity.impact_velocity())),
            mesh_loss: validity.mesh_loss,
        };
        let values = observations.measures().into_iter().map(|measure| measure.value);
        Measures(values.map(|value| value.filter(|x| x.is_finite())).collect())
    }
}

impl Observer for Measuring {
    fn observe(&mut self, view: &View<'_>) -> Result<Flow, RunError> {
        let Units { length, time, speed, force, energy, .. } = self.units;
        let now = time.of(view.time);
        self.drag.take(now, Some(force.of(view.drag)), Some(length.of(view.contact_radius)));
        self.motion.push([now, speed.of(view.velocity), length.of(view.depth)]);
        if let Some(frame) = &view.frame {
            self.energy.push([now, energy.of(frame.energy.kinetic) + energy.of(frame.energy.strain)]);
        }
        for event in &*view.events {
            let kind = match event.kind {
                EventKind::Extension => EXTENSION,
                EventKind::Separation => SEPARATION,
                EventKind::Recontact => RECONTACT,
                _ => continue,
            };
            self.story.take(now, kind, event.since.map(|since| time.of(since)));
        }
        Ok(Flow::Continue)
    }
}
