//! What is measured of an impact, from its numbers in the order of time.
//!
//! Every number is optional: what is not said stays open, and is never 0. Numbers that are not finite count as not said.

use std::{
    borrow::Cow,
    collections::{BTreeSet, VecDeque},
};

use serde::{Deserialize, Serialize};

use crate::{CellType, Heading};

/// Kinds of events: the interface first needs tension.
pub const EXTENSION: &str = "EXTENSION";
/// Contact has ended.
pub const SEPARATION: &str = "SEPARATION";
/// Contact has come back after its end.
pub const RECONTACT: &str = "RECONTACT";

/// Tractions of an interface of layers, of which the largest is measured, and the ratio of both to the strength of its bond.
pub const TRACTIONS: [&str; 3] = ["tension", "shear", RATIO];
/// The last of them.
pub const RATIO: &str = "ratio";

/// What the names of interfaces begin with: of those of the target, and of an indenter that gives.
pub const BODIES: [&str; 2] = ["", "indenter."];

/// Ratios of stresses to strengths: of von Mises to the yield strength, and of the first principal stress to the tensile strength.
pub const RATIOS: [&str; 2] = ["yield_ratio", "tensile_ratio"];

/// Units of what is measured; `None` for those that are not known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Units {
    /// Of times.
    pub time: Option<String>,
    /// Of lengths.
    pub length: Option<String>,
    /// Of velocities.
    pub speed: Option<String>,
    /// Of forces.
    pub force: Option<String>,
    /// Of energies.
    pub energy: Option<String>,
    /// Of stresses.
    pub stress: Option<String>,
}

/// What a column is, and with it the unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quantity {
    /// A plain number.
    Number,
    /// A time.
    Time,
    /// A length.
    Length,
    /// A velocity.
    Speed,
    /// A force.
    Force,
    /// A force over a time.
    Impulse,
    /// An energy.
    Energy,
    /// A stress.
    Stress,
}

impl Quantity {
    /// Units whose product is that of the quantity; `None` if one of them is not known.
    pub fn factors(self, units: &Units) -> Option<Vec<&str>> {
        let factors = match self {
            Self::Number => vec![],
            Self::Time => vec![&units.time],
            Self::Length => vec![&units.length],
            Self::Speed => vec![&units.speed],
            Self::Force => vec![&units.force],
            Self::Impulse => vec![&units.force, &units.time],
            Self::Energy => vec![&units.energy],
            Self::Stress => vec![&units.stress],
        };
        factors.into_iter().map(Option::as_deref).collect()
    }

    /// The unit; `None` for plain numbers, and if it is not known.
    pub fn unit(self, units: &Units) -> Option<String> {
        let factors = self.factors(units)?;
        match factors.as_slice() {
            [] => None,
            ["N", "s"] => Some("N s".into()),
            ["N/m", "s"] => Some("N s/m".into()),
            factors => Some(factors.join("·")),
        }
    }
}

/// What was measured: a cell of a table and its column.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// Name of the column.
    pub name: Cow<'static, str>,
    /// What it is.
    pub quantity: Quantity,
    /// The number, if there is one \[unit of the quantity\].
    pub value: Option<f64>,
}

impl Measure {
    /// The column.
    pub fn heading(&self, units: &Units) -> Heading {
        Heading {
            name: self.name.clone().into_owned(),
            unit: self.quantity.unit(units),
            kind: CellType::Double,
        }
    }
}

/// What was seen of an impact, step by step. Those of nothing have all columns, without a value. Written and read again, they go on as
/// if nothing had been.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Observations {
    extension: Option<f64>,
    drag: Drag,
    /// The first velocity, and the largest depth.
    first: Option<f64>,
    depth: Option<f64>,
    /// Velocity of the indenter, and kinetic and strain energy of the target, when contact ended for good.
    velocity: AtEnd,
    energy: AtEnd,
    warnings: BTreeSet<String>,
}

/// What is said of an impact at its end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// The largest strain, its radius, depth and time.
    pub largest_strain: [Option<f64>; 4],
    /// The largest of [`RATIOS`], each with radius, depth and time.
    pub ratios: [[Option<f64>; 4]; 2],
    /// V0 of the impact, if it is said; else it is the first velocity.
    pub impact_velocity: Option<f64>,
    /// The largest of [`TRACTIONS`] of the interfaces of layers, each with radius and time: of [`BODIES`], from where they meet on.
    pub interfaces: [Vec<[[Option<f64>; 3]; 3]>; 2],
    /// Energy lost by the mesh, as a share of ½M·V0².
    pub mesh_loss: Option<f64>,
}

impl Observations {
    /// Takes a step of the contact: its time, the force and the contact radius \[time, force, length\].
    pub fn take_drag(&mut self, time: f64, force: Option<f64>, radius: Option<f64>) {
        if self.drag.take(time, force, radius) {
            self.velocity.touch(time);
            self.energy.touch(time);
        }
    }

    /// Takes a step of the indenter: its time, the velocity and the displacement into the target \[time, speed, length\].
    pub fn take_motion(&mut self, time: f64, velocity: Option<f64>, displacement: Option<f64>) {
        self.first = self.first.or(finite(velocity));
        self.depth = larger(self.depth, finite(displacement));
        self.velocity.take(time, velocity);
    }

    /// Takes the kinetic and the strain energy of the target at a time.
    pub fn take_energy(&mut self, time: f64, kinetic: Option<f64>, strain: Option<f64>) {
        self.energy.take(time, kinetic.zip(strain).map(|(kinetic, strain)| kinetic + strain));
    }

    /// Takes an event.
    ///
    /// * `time`: when it is known \[time\]
    /// * `kind`: its name, [`EXTENSION`], [`SEPARATION`], [`RECONTACT`] or another, which says nothing here
    /// * `since`: when it was, if that was before it was known \[time\]
    pub fn take_event(&mut self, time: f64, kind: &str, since: Option<f64>) {
        let at = since.unwrap_or(time);
        let end = match kind {
            EXTENSION => return self.extension = self.extension.or(Some(at)),
            SEPARATION => Some(at),
            RECONTACT => None,
            _ => return,
        };
        self.velocity.end(end);
        self.energy.end(end);
    }

    /// Takes a warning by its subject.
    pub fn take_warning(&mut self, subject: &str) {
        self.warnings.insert(subject.to_owned());
    }

    /// Subjects of the warnings, each once.
    pub fn warnings(&self) -> &BTreeSet<String> {
        &self.warnings
    }

    /// What is measured, in the order of the columns.
    ///
    /// ```text
    /// restitution e = −V/V₀   V: velocity when contact ended for good, if the indenter moves back then; V₀: that of the impact
    /// restitution_mesh_corrected = √(e² + mesh_loss)
    /// ```
    pub fn measures(&self, said: &Said) -> Vec<Measure> {
        let Self { drag, velocity, energy, .. } = self;
        let Said { largest_strain, ratios, impact_velocity, interfaces, mesh_loss } = said;
        let [strain, strain_r, strain_z, strain_time] = largest_strain;
        let v0 = impact_velocity.or(self.first);
        let rebound = velocity.value.filter(|rebound| v0.is_some_and(|v0| rebound * v0 < 0.0));
        let restitution = rebound.zip(v0).map(|(rebound, v0)| -rebound / v0);
        let corrected = restitution.zip(*mesh_loss).map(|(e, loss)| (e * e + loss).sqrt());
        let (peak_force, peak_time) = drag.peak.unzip();
        let measures = [
            ("peak_force", Quantity::Force, peak_force),
            ("peak_time", Quantity::Time, peak_time),
            ("impulse", Quantity::Impulse, drag.impulse),
            ("contact_duration", Quantity::Time, drag.contact.map(|(first, last)| last - first)),
            ("contact_radius", Quantity::Length, drag.radius),
            ("depth", Quantity::Length, self.depth),
            ("rebound_velocity", Quantity::Speed, rebound),
            ("restitution", Quantity::Number, restitution),
            ("restitution_mesh_corrected", Quantity::Number, corrected),
            ("t_ext", Quantity::Time, self.extension),
            ("energy_left", Quantity::Energy, energy.value),
            ("largest_strain", Quantity::Number, *strain),
            ("largest_strain_r", Quantity::Length, *strain_r),
            ("largest_strain_z", Quantity::Length, *strain_z),
            ("largest_strain_time", Quantity::Time, *strain_time),
        ];
        let single = measures.map(|(name, quantity, value)| Measure { name: name.into(), quantity, value });
        let ratios = RATIOS.into_iter().zip(ratios).flat_map(|(name, peak)| {
            let parts = ["", "_r", "_z", "_time"].into_iter();
            let quantities = [Quantity::Number, Quantity::Length, Quantity::Length, Quantity::Time];
            parts.zip(quantities).zip(peak).map(move |((part, quantity), value)| Measure {
                name: format!("{name}{part}").into(),
                quantity,
                value: *value,
            })
        });
        let interfaces = BODIES.into_iter().zip(interfaces);
        let interfaces =
            interfaces.flat_map(|(body, interfaces)| (1..).zip(interfaces).map(move |of| (body, of)));
        let interfaces = interfaces.flat_map(|(body, (number, peaks))| {
            TRACTIONS.into_iter().zip(peaks).flat_map(move |(traction, peak)| {
                let quantity = if traction == RATIO { Quantity::Number } else { Quantity::Stress };
                let parts = [("", quantity), ("_r", Quantity::Length), ("_time", Quantity::Time)];
                parts.into_iter().zip(peak).map(move |((part, quantity), value)| {
                    let name = format!("{body}interface.{number}.{traction}{part}").into();
                    Measure { name, quantity, value: *value }
                })
            })
        });
        single.into_iter().chain(ratios).chain(interfaces).collect()
    }
}

/// The force of the indenter on the target, and where they touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Drag {
    peak: Option<(f64, f64)>,
    impulse: Option<f64>,
    before: Option<(f64, f64)>,
    contact: Option<(f64, f64)>,
    radius: Option<f64>,
}

impl Drag {
    /// Takes a step; true if they touch.
    ///
    /// ```text
    /// impulse = Σ ½·(F_n + F_{n−1})·(t_n − t_{n−1})
    /// ```
    fn take(&mut self, time: f64, force: Option<f64>, radius: Option<f64>) -> bool {
        let [force, radius] = [force, radius].map(finite);
        if let Some(force) = force {
            if self.peak.is_none_or(|(peak, _)| force > peak) {
                self.peak = Some((force, time));
            }
            if let Some((last, before)) = self.before.replace((time, force)) {
                *self.impulse.get_or_insert(0.0) += 0.5 * (force + before) * (time - last);
            }
        }
        self.radius = larger(self.radius, radius);
        let touches = force.is_some_and(|force| force != 0.0) || radius.is_some_and(|radius| radius > 0.0);
        if touches {
            let (first, _) = self.contact.unwrap_or((time, time));
            self.contact = Some((first, time));
        }
        touches
    }
}

/// The number, if it is one.
fn finite(number: Option<f64>) -> Option<f64> {
    number.filter(|number| number.is_finite())
}

fn larger(known: Option<f64>, new: Option<f64>) -> Option<f64> {
    match (known, new) {
        (Some(known), Some(new)) => Some(known.max(new)),
        (known, new) => known.or(new),
    }
}

/// A quantity at the end of contact, linear between the times it is known at. The end is known later than it was: what is since the last
/// contact is kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct AtEnd {
    at: Option<f64>,
    value: Option<f64>,
    recent: VecDeque<(f64, f64)>,
}

/// Points that are kept of a quantity, at least and at most.
const KEPT: (usize, usize) = (64, 1 << 20);

impl AtEnd {
    /// Contact has ended at a time, or come back.
    fn end(&mut self, at: Option<f64>) {
        (self.at, self.value) = (at, None);
        self.settle();
    }

    /// Contact ends later than that.
    fn touch(&mut self, time: f64) {
        while self.recent.len() > KEPT.0 && self.recent[1].0 <= time {
            self.recent.pop_front();
        }
    }

    /// Takes the quantity at a time.
    fn take(&mut self, time: f64, value: Option<f64>) {
        let Some(value) = finite(value) else { return };
        if self.value.is_some() || self.recent.len() >= KEPT.1 {
            self.recent.pop_front();
        }
        self.recent.push_back((time, value));
        self.settle();
    }

    fn settle(&mut self) {
        let (Some(at), None) = (self.at, self.value) else { return };
        let Some(next) = self.recent.iter().position(|(time, _)| *time >= at) else { return };
        let (time, value) = self.recent[next];
        let before = next.checked_sub(1).map(|before| self.recent[before]);
        self.value = match before {
            _ if time == at => Some(value),
            Some((start, first)) => Some(first + (value - first) * (at - start) / (time - start)),
            None => None,
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_lies_between_messages() {
        let points = [(0.0, 1.0), (1.0, 3.0), (2.0, 3.5)];
        // whether it is known before, between or after them
        for known in 0..=points.len() {
            let value = |at| {
                let mut end = AtEnd::default();
                points[..known].iter().for_each(|&(time, value)| end.take(time, Some(value)));
                end.end(at);
                points[known..].iter().for_each(|&(time, value)| end.take(time, Some(value)));
                end.value
            };
            assert_eq!(value(Some(0.5)), Some(2.0));
            assert_eq!(value(Some(1.0)), Some(3.0));
            assert_eq!([Some(2.5), Some(-0.5), None].map(value), [None; 3]);
        }
    }

    #[test]
    fn what_is_kept_reaches_back_to_the_last_contact() {
        let mut end = AtEnd::default();
        for step in 0..10_000 {
            end.take(f64::from(step), Some(f64::from(step * step)));
            if step < 9000 {
                end.touch(f64::from(step));
            }
        }
        assert!((1000..1100).contains(&end.recent.len()), "{}", end.recent.len());
        end.end(Some(9000.5));
        assert_eq!(end.value, Some(0.5 * (9000.0 * 9000.0 + 9001.0 * 9001.0)));
    }

    #[test]
    fn contact_that_comes_back_has_not_ended() {
        let mut seen = Observations::default();
        let mut take = |time, kind: &str, since| {
            seen.take_energy(time, Some(time), Some(0.0));
            seen.take_event(time, kind, since);
            seen.energy.value
        };
        assert_eq!(take(0.5, EXTENSION, None), None);
        assert_eq!(take(1.0, SEPARATION, Some(0.9)), Some(0.9));
        assert_eq!(take(2.0, RECONTACT, None), None);
        assert_eq!(take(3.0, SEPARATION, None), Some(3.0));
        assert_eq!(seen.extension, Some(0.5));
    }

    #[test]
    fn a_gap_in_the_contact_counts() {
        let mut drag = Drag::default();
        for (time, force, radius) in
            [(0.0, 0.0, 0.0), (1.0, 2.0, 1.0), (2.0, 0.0, 0.0), (3.0, 1.0, 0.5), (4.0, 0.0, 0.0)]
        {
            drag.take(time, Some(force), Some(radius));
        }
        assert_eq!((drag.contact, drag.radius), (Some((1.0, 3.0)), Some(1.0)));
        assert_eq!((drag.peak, drag.impulse), (Some((2.0, 1.0)), Some(3.0)));
    }
}
