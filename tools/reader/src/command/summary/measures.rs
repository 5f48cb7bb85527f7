//! What is read off the messages of a recording.

use crate::{
    channel::Channel,
    convention::{DRAG, ENERGY, EVENT, EXTENSION, LARGEST_STRAIN, RECONTACT, SEPARATION, VALIDITY, VELOCITY},
    field::cell,
    messages::Recording,
    recording::{Damage, OpenError},
    table::Cell,
    wire::{Layout, Type, Values},
};

/// Units of what was measured, from the metadata of the channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Units {
    /// Of times.
    time: Option<String>,
    /// Of lengths.
    length: Option<String>,
    /// Of velocities.
    speed: Option<String>,
    /// Of forces.
    force: Option<String>,
    /// Of energies.
    energy: Option<String>,
}

/// What a column is, and with it the unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Quantity {
    Number,
    Time,
    Length,
    Speed,
    Force,
    Impulse,
    Energy,
}

impl Quantity {
    /// Units whose product is that of the quantity; `None` if one of them is not known.
    pub(super) fn factors(self, units: &Units) -> Option<Vec<&str>> {
        let factors = match self {
            Self::Number => vec![],
            Self::Time => vec![&units.time],
            Self::Length => vec![&units.length],
            Self::Speed => vec![&units.speed],
            Self::Force => vec![&units.force],
            Self::Impulse => vec![&units.force, &units.time],
            Self::Energy => vec![&units.energy],
        };
        factors.into_iter().map(Option::as_deref).collect()
    }

    pub(super) fn unit(self, units: &Units) -> Option<String> {
        let factors = self.factors(units)?;
        match factors.as_slice() {
            [] => None,
            ["N", "s"] => Some("N s".into()),
            ["N/m", "s"] => Some("N s/m".into()),
            factors => Some(factors.join("·")),
        }
    }
}

/// A column: its name, what it is, and its value if the recording says it.
pub(super) type Measure = (&'static str, Quantity, Option<f64>);

/// What was measured, and what could not be read.
#[derive(Debug, Default)]
pub(super) struct Reading {
    /// The numbers, in the order of the columns.
    pub(super) measures: Vec<Measure>,
    /// Their units.
    pub(super) units: Units,
    /// Damaged parts of the file.
    pub(super) damages: Vec<Damage>,
    /// Messages that do not fit their schema.
    pub(super) undecoded: u64,
}

impl Reading {
    /// Reads a recording.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub(super) fn of(recording: &Recording) -> Result<Self, OpenError> {
        let mut events = [Source::open(recording, EVENT, ["kind", "since"])];
        let mut story = Story::default();
        visit(recording, &mut events, |_, time, [kind, since]| {
            story.take(time, kind, since.number());
        })?;
        let mut sources = [
            Source::open(recording, DRAG, ["force", "contact_radius"]),
            Source::open(recording, VELOCITY, ["velocity", "displacement"]),
            Source::open(recording, ENERGY, ["kinetic", "strain"]),
            // read once more, so that all damages come out of one pass
            Source::open(recording, EVENT, ["kind", "since"]),
        ];
        let units = units(&sources);
        let (mut drag, mut motion) = (Drag::default(), Motion::at(story.separation));
        let mut left = Moment { at: story.separation, ..Moment::default() };
        let (damages, undecoded) = visit(recording, &mut sources, |source, time, [first, second]| {
            let [first, second] =
                [first, second].map(|cell| cell.number().filter(|number| number.is_finite()));
            match source {
                0 => drag.take(time, first, second),
                1 => motion.take(time, first, second),
                2 => left.take(time, first.zip(second).map(|(kinetic, strain)| kinetic + strain)),
                _ => {}
            }
        })?;
        let rebound =
            motion.separation.value.filter(|rebound| motion.first.is_some_and(|v0| rebound * v0 < 0.0));
        let strain = |suffix: &str| {
            recording.entries(VALIDITY)?.get(&format!("{LARGEST_STRAIN}{suffix}"))?.parse().ok()
        };
        let (peak_force, peak_time) = drag.peak.unzip();
        let measures = vec![
            ("peak_force", Quantity::Force, peak_force),
            ("peak_time", Quantity::Time, peak_time),
            ("impulse", Quantity::Impulse, drag.impulse),
            ("contact_duration", Quantity::Time, drag.contact.map(|(first, last)| last - first)),
            ("contact_radius", Quantity::Length, drag.radius),
            ("depth", Quantity::Length, motion.depth),
            ("rebound_velocity", Quantity::Speed, rebound),
            ("restitution", Quantity::Number, rebound.zip(motion.first).map(|(last, first)| -last / first)),
            ("t_ext", Quantity::Time, story.extension),
            ("energy_left", Quantity::Energy, left.value),
            ("largest_strain", Quantity::Number, strain("")),
            ("largest_strain_r", Quantity::Length, strain(".r")),
            ("largest_strain_z", Quantity::Length, strain(".z")),
            ("largest_strain_time", Quantity::Time, strain(".time")),
        ];
        Ok(Self { measures, units, damages, undecoded })
    }
}

/// A channel, and two of its fields where it has them.
struct Source<'a> {
    id: u16,
    channel: &'a Channel,
    layout: &'a Layout,
    values: Values,
    fields: [Option<usize>; 2],
}

impl<'a> Source<'a> {
    fn open(recording: &'a Recording, topic: &str, fields: [&str; 2]) -> Option<Self> {
        let (&id, channel) = recording.channels.iter().find(|(_, channel)| channel.topic == topic)?;
        let layout = channel.layout.as_deref()?;
        let fields = fields.map(|field| layout.find(field));
        fields.iter().flatten().next()?;
        Some(Self { id, channel, layout, values: layout.values(), fields })
    }

    fn unit(&self, field: usize) -> Option<String> {
        self.channel.unit(&self.layout.leaves[self.fields[field]?].path).map(str::to_owned)
    }

    fn cell(&self, field: usize) -> Cell {
        let Some(leaf) = self.fields[field] else { return Cell::Empty };
        let names = if let Type::Enum(names) = &self.layout.leaves[leaf].kind { Some(names) } else { None };
        cell(&self.values.lists[leaf], 0, names)
    }
}

/// Hands the messages of channels to `take`: number of the channel, time, cells of its fields.
fn visit(
    recording: &Recording,
    sources: &mut [Option<Source<'_>>],
    mut take: impl FnMut(usize, f64, [Cell; 2]),
) -> Result<(Vec<Damage>, u64), OpenError> {
    let ids: Vec<u16> = sources.iter().flatten().map(|source| source.id).collect();
    let mut messages = recording.messages(ids, None)?;
    let mut undecoded = 0;
    messages.for_each(|message| -> Result<(), OpenError> {
        let fits =
            |source: &Option<Source<'_>>| source.as_ref().is_some_and(|source| source.id == message.channel);
        let Some(index) = sources.iter().position(fits) else { return Ok(()) };
        let Some(source) = &mut sources[index] else { return Ok(()) };
        if source.layout.decode(message.data, &mut source.values).is_err() {
            undecoded += 1;
            return Ok(());
        }
        let cells = [0, 1].map(|field| source.cell(field));
        let time = source.channel.instant(message.data, message.log_time, source.channel.origin).number();
        source.values.release();
        take(index, time, cells);
        Ok(())
    })?;
    Ok((messages.damages().to_vec(), undecoded))
}

fn units([drag, motion, energy, event]: &[Option<Source<'_>>; 4]) -> Units {
    let of = |source: &Option<Source<'_>>, field| source.as_ref().and_then(|source| source.unit(field));
    let sources = || [drag, motion, energy, event].into_iter().flatten();
    Units {
        time: sources().find_map(|source| source.channel.time_unit().map(str::to_owned)),
        length: of(motion, 1).or_else(|| of(drag, 1)),
        speed: of(motion, 0),
        force: of(drag, 0),
        energy: of(energy, 0),
    }
}

/// What happened.
#[derive(Default)]
struct Story {
    extension: Option<f64>,
    /// When contact ended for good.
    separation: Option<f64>,
}

impl Story {
    fn take(&mut self, time: f64, kind: Cell, since: Option<f64>) {
        let Cell::Text(kind) = kind else { return };
        match kind.as_str() {
            EXTENSION => self.extension = self.extension.or(Some(time)),
            SEPARATION => self.separation = Some(since.unwrap_or(time)),
            RECONTACT => self.separation = None,
            _ => {}
        }
    }
}

#[derive(Default)]
struct Drag {
    peak: Option<(f64, f64)>,
    impulse: Option<f64>,
    before: Option<(f64, f64)>,
    contact: Option<(f64, f64)>,
    radius: Option<f64>,
}

impl Drag {
    fn take(&mut self, time: f64, force: Option<f64>, radius: Option<f64>) {
        if let Some(force) = force {
            if self.peak.is_none_or(|(peak, _)| force > peak) {
                self.peak = Some((force, time));
            }
            if let Some((last, before)) = self.before.replace((time, force)) {
                *self.impulse.get_or_insert(0.0) += 0.5 * (force + before) * (time - last);
            }
        }
        self.radius = larger(self.radius, radius);
        if force.is_some_and(|force| force != 0.0) || radius.is_some_and(|radius| radius > 0.0) {
            let (first, _) = self.contact.unwrap_or((time, time));
            self.contact = Some((first, time));
        }
    }
}

fn larger(known: Option<f64>, new: Option<f64>) -> Option<f64> {
    match (known, new) {
        (Some(known), Some(new)) => Some(known.max(new)),
        (known, new) => known.or(new),
    }
}

#[derive(Default)]
struct Motion {
    first: Option<f64>,
    depth: Option<f64>,
    separation: Moment,
}

impl Motion {
    fn at(separation: Option<f64>) -> Self {
        Self { separation: Moment { at: separation, ..Moment::default() }, ..Self::default() }
    }

    fn take(&mut self, time: f64, velocity: Option<f64>, displacement: Option<f64>) {
        self.first = self.first.or(velocity);
        self.depth = larger(self.depth, displacement);
        self.separation.take(time, velocity);
    }
}

/// A quantity at one time, linear between its messages.
#[derive(Default)]
struct Moment {
    at: Option<f64>,
    before: Option<(f64, f64)>,
    value: Option<f64>,
}

impl Moment {
    fn take(&mut self, time: f64, value: Option<f64>) {
        let (Some(at), Some(value), None) = (self.at, value, self.value) else { return };
        if time < at {
            self.before = Some((time, value));
        } else if time == at {
            self.value = Some(value);
        } else if let Some((start, first)) = self.before {
            self.value = Some(first + (value - first) * (at - start) / (time - start));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_lies_between_messages() {
        let value = |at, points: &[(f64, f64)]| {
            let mut moment = Moment { at, ..Moment::default() };
            points.iter().for_each(|&(time, value)| moment.take(time, Some(value)));
            moment.value
        };
        let points = [(0.0, 1.0), (1.0, 3.0), (2.0, 3.5)];
        assert_eq!(value(Some(0.5), &points), Some(2.0));
        assert_eq!(value(Some(1.0), &points), Some(3.0));
        assert_eq!(value(Some(2.5), &points), None);
        assert_eq!(value(Some(-0.5), &points), None);
        assert_eq!(value(None, &points), None);
    }

    #[test]
    fn contact_that_comes_back_has_not_ended() {
        let mut story = Story::default();
        let mut take = |time, kind: &str, since| {
            story.take(time, Cell::Text(kind.into()), since);
            story.separation
        };
        assert_eq!(take(1.0, SEPARATION, Some(0.9)), Some(0.9));
        assert_eq!(take(2.0, RECONTACT, None), None);
        assert_eq!(take(3.0, SEPARATION, None), Some(3.0));
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
