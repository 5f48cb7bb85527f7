//! What is read off the run of a case on the way, as [`percuss_table::measures`] defines it, and its row of the summary.
//!
//! The numbers are those that a recording would have, in its units, so `percuss-read summary` measures the same.

use std::{collections::BTreeMap, sync::LazyLock};

use percuss_table::{
    Cell, CellType, Heading,
    measures::{self, Drag, EXTENSION, Measure, Moment, Motion, Observations, RECONTACT, SEPARATION, Story},
};

use super::{journal::Entry, plan::Plan};
use crate::{
    case::{Case, quantity_si},
    geometry::Geometry,
    session::{Flow, Observer, RunError},
    units::Units,
    validity::Validity,
    view::{EventKind, View},
};

/// The measures of a case of which nothing is known.
static NOTHING: LazyLock<Vec<Measure>> = LazyLock::new(|| Observations::default().measures());

/// Names of all measures.
pub fn names() -> Vec<&'static str> {
    NOTHING.iter().map(|measure| measure.name).collect()
}

/// True for the name of a measure.
pub fn is_name(text: &str) -> bool {
    names().contains(&text)
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

    /// What was measured, by name, in the units of the case.
    pub fn measures(&self, validity: &Validity) -> BTreeMap<String, f64> {
        let Units { length, time, .. } = self.units;
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
        };
        let known = |measure: Measure| Some((measure.name.to_owned(), measure.value.filter(|x| x.is_finite())?));
        observations.measures().into_iter().filter_map(known).collect()
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

/// The columns of a summary: number of the case, what varies, how it ended, what was measured.
pub fn headings(plan: &Plan) -> Vec<Heading> {
    let name = |unit: &str| Some(unit.to_owned());
    let Units { length, time, speed, force, energy, .. } = plan.first.units();
    let is_si = plan.first.scales.is_some();
    // dimensionless recordings have units too: those of the theory
    let units = measures::Units {
        time: name(time.name),
        length: name(length.name),
        speed: name(speed.name),
        force: name(force.name),
        energy: name(energy.name),
    };
    let text = |name: &str, kind| Heading { name: name.into(), unit: None, kind };
    let varied = plan.keys().enumerate().map(|(column, key)| match column_unit(plan, column) {
        Some(unit) => Heading { name: key.into(), unit: unit.filter(|_| is_si), kind: CellType::Double },
        None => text(key, CellType::Text),
    });
    let start = [text("case", CellType::UInt)].into_iter();
    let measured = NOTHING.iter().map(|measure| measure.heading(&units));
    start.chain(varied).chain([text("status", CellType::Text)]).chain(measured).collect()
}

/// The row of a case in a summary.
pub fn row(plan: &Plan, headings: &[Heading], number: usize, entry: &Entry) -> Vec<Cell> {
    let geometry = plan.first.geometry;
    let varied = plan.values(number).zip(&headings[1..]).map(|(value, heading)| match heading.kind {
        CellType::Double => number_of(value, geometry).map_or(Cell::Empty, |(number, _)| Cell::Double(number)),
        _ => Cell::Text(value.trim_matches('"').to_owned()),
    });
    let measured = NOTHING.iter().map(|measure| {
        entry.measures.get(measure.name).map_or(Cell::Empty, |value| Cell::Double(*value))
    });
    let start = [Cell::UInt(number as u64)].into_iter();
    start.chain(varied).chain([Cell::Text(entry.state.name().into())]).chain(measured).collect()
}

/// Unit of a column of varied values if all of them are numbers in it; plain ones have none.
fn column_unit(plan: &Plan, column: usize) -> Option<Option<String>> {
    let mut values = plan.column(column).map(|value| number_of(value, plan.first.geometry));
    let (_, unit) = values.next()??;
    values.all(|value| value.is_some_and(|(_, other)| other == unit)).then(|| unit.map(str::to_owned))
}

/// A value of a case file as a number, a quantity in SI with its unit.
fn number_of(value: &str, geometry: Geometry) -> Option<(f64, Option<&'static str>)> {
    let value = value.trim().trim_matches('"');
    match value.parse::<f64>() {
        Ok(number) => Some((number, None)),
        Err(_) => quantity_si(value, geometry).map(|(number, unit)| (number, Some(unit))),
    }
}
