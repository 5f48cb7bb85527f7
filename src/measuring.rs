//! What is measured of a run on the way, as [`percuss_table::measures`] defines it.
//!
//! The numbers are those of the messages of a recording, in its units and in their order, so a reader of the messages measures the same,
//! bit for bit.

use percuss_table::measures::{self, EXTENSION, Measure, Observations, RECONTACT, SEPARATION, Said};

use crate::{
    units::Units,
    validity::{InterfacePeaks, Peak, Validity},
    view::{EventKind, View},
};

pub fn units(units: Units) -> measures::Units {
    let Units { length, time, speed, force, energy, stress, .. } = units;
    let [time, length, speed, force, energy, stress] =
        [time, length, speed, force, energy, stress].map(|unit| Some(unit.name.to_owned()));
    measures::Units { time, length, speed, force, energy, stress }
}

/// The measures of a case of which nothing is known.
///
/// * `interfaces`: their numbers in target and indenter
#[cfg(feature = "cli")]
pub fn nothing(interfaces: [usize; 2]) -> Vec<Measure> {
    let interfaces = interfaces.map(|count| vec![Default::default(); count]);
    Observations::default().measures(&Said { interfaces, ..Said::default() })
}

/// Measures of a run that is under way.
pub struct Measuring {
    units: Units,
    knows_drag: bool,
    /// What was seen so far.
    pub seen: Observations,
}

impl Measuring {
    /// Measures a run from its first step on.
    ///
    /// * `units`: of the recording
    /// * `knows_drag`: false for closed forms without it
    pub fn new(units: Units, knows_drag: bool) -> Self {
        Self { units, knows_drag, seen: Observations::default() }
    }

    pub fn take(&mut self, view: &View<'_>) {
        let Units { length, time, speed, force, energy, .. } = self.units;
        // a message has no −0
        let [time_of, length_of, speed_of, force_of, energy_of] =
            [time, length, speed, force, energy].map(|unit| move |x: f64| unit.of(x) + 0.0);
        let now = time_of(view.time);
        if self.knows_drag {
            let (force, radius) = (force_of(view.drag), length_of(view.contact_radius));
            self.seen.take_drag(now, Some(force), Some(radius));
        }
        self.seen.take_motion(now, Some(speed_of(view.velocity)), Some(length_of(view.depth)));
        if let Some(frame) = &view.frame {
            let [kinetic, strain] =
                [frame.energy.kinetic, frame.energy.strain].map(|part| Some(energy_of(part)));
            self.seen.take_energy(now, kinetic, strain);
        }
        for event in &*view.events {
            let kind = match event.kind {
                EventKind::Extension => EXTENSION,
                EventKind::Separation => SEPARATION,
                EventKind::Recontact => RECONTACT,
                EventKind::Warning(about) => {
                    self.seen.take_warning(about);
                    continue;
                }
                _ => continue,
            };
            self.seen.take_event(now, kind, event.since.map(|since| time.of(since)));
        }
    }

    pub fn measures(&self, validity: &Validity) -> Vec<Measure> {
        let Units { length, time, speed, stress, .. } = self.units;
        let placed = |peak: Option<Peak>| {
            peak.map_or([None; 4], |peak| {
                [peak.value, length.of(peak.r), length.of(peak.z), time.of(peak.time)].map(Some)
            })
        };
        let traction = |peak: Option<Peak>, value: &dyn Fn(f64) -> f64| {
            peak.map_or([None; 3], |peak| {
                [value(peak.value), length.of(peak.r), time.of(peak.time)].map(Some)
            })
        };
        let pressure = |value| stress.of(value);
        self.seen.measures(&Said {
            largest_strain: placed(Some(validity.strain)),
            ratios: [validity.yield_ratio, validity.tensile_ratio].map(placed),
            impact_velocity: Some(speed.of(validity.velocity)).filter(|velocity| *velocity > 0.0),
            mesh_loss: validity.mesh_loss,
            interfaces: validity.interfaces.each_ref().map(|interfaces| {
                let of = |peaks: &InterfacePeaks| {
                    let [tension, shear] =
                        [Some(peaks.tension), peaks.shear].map(|peak| traction(peak, &pressure));
                    [tension, shear, traction(peaks.ratio, &|ratio| ratio)]
                };
                interfaces.iter().map(of).collect()
            }),
        })
    }
}
