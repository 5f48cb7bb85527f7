//! What is measured of a recording: as the run has recorded it, or read off the messages.

use std::{cell::RefCell, collections::BTreeMap};

use percuss_table::{
    Cell,
    measures::{BODIES, Measure, Observations, RATIOS, Said, TRACTIONS, Units},
};

use crate::{
    channel::Channel,
    convention::{
        DISPLACEMENT, DRAG, ENERGY, EVENT, IMPACT_VELOCITY, INTERFACE, LARGEST_STRAIN, MEASURES, MESH_LOSS,
        RADIUS, RECOVERED, STATUS, VALIDITY, VELOCITY,
    },
    failure::Failure,
    field::cell,
    messages::Recording,
    pass::{Pass, Seen},
    select::Window,
    wire::{Layout, Type, Values},
};

#[derive(Debug, Default)]
pub(in crate::command) struct Reading {
    /// The numbers, in the order of the columns.
    pub(in crate::command) measures: Vec<Measure>,
    pub(in crate::command) units: Units,
    pub(in crate::command) seen: Seen,
}

impl Reading {
    /// What the run has recorded, and else what the messages say.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub(in crate::command) fn of(recording: &Recording) -> Result<Self, Failure> {
        if let Some(recorded) = Self::recorded(recording) {
            return Ok(recorded);
        }
        let observed = RefCell::default();
        let mut pass = Pass::over(recording, Window::default());
        watch(recording, &observed, &mut pass);
        let seen = pass.run()?;
        Ok(Self { seen, ..Self::from(recording, &observed.into_inner()) })
    }

    /// What the run has recorded, if the recording is all of a run that was finished. No message is read.
    pub(in crate::command) fn recorded(recording: &Recording) -> Option<Self> {
        let recorded = recording.entries(MEASURES).filter(|_| is_whole(recording))?;
        let mut reading = Self::from(recording, &Observations::default());
        for Measure { name, value, .. } in &mut reading.measures {
            *value = recorded.get(&**name).and_then(|number| number.parse().ok());
        }
        Some(reading)
    }

    /// What is measured of what was seen, and of what the recording says of it.
    pub(in crate::command) fn from(recording: &Recording, observed: &Observations) -> Self {
        let measures = measures(observed, recording.entries(VALIDITY));
        Self { measures, units: units(recording), seen: Seen::default() }
    }
}

pub(in crate::command) fn watch<'a>(
    recording: &'a Recording,
    observed: &'a RefCell<Observations>,
    pass: &mut Pass<'a>,
) {
    for (topic, ..) in SOURCES {
        let Some((id, channel, source)) = Source::open(recording, topic) else { continue };
        pass.each(id, move |moment, _| {
            source.show(channel, moment.time, &moment.values, &mut observed.borrow_mut());
            Ok(())
        });
    }
}

/// True for the recording of a run that was finished, of which nothing is known to be damaged, lost or cut out.
fn is_whole(recording: &Recording) -> bool {
    let last = recording.entries(STATUS).and_then(|status| status.get("last_step")?.parse().ok());
    let steps = last.and_then(|last: u64| last.checked_add(1));
    let every_step =
        recording.channels.values().filter(|channel| [DRAG, VELOCITY].contains(&channel.topic.as_str()));
    let has_all = every_step.map(|channel| Some(channel.count)).all(|count| count == steps);
    let is_lossy = recording.entries(RECOVERED).is_some() || !recording.damages.is_empty();
    has_all && !is_lossy && !recording.is_partial()
}

/// What is measured of what was seen.
///
/// * `validity`: entries of the record [`VALIDITY`]
pub(in crate::command) fn measures(
    observed: &Observations,
    validity: Option<&BTreeMap<String, String>>,
) -> Vec<Measure> {
    let said = |key: &str| validity?.get(key)?.parse().ok();
    let traction = |interface: &str, traction: &str| {
        ["", ".r", ".time"].map(|part| said(&format!("{interface}.{traction}{part}")))
    };
    let interfaces = |body: &str| {
        let names = (1..).map(|number| format!("{body}interface.{number}"));
        let peaks = names.map(|interface| TRACTIONS.map(|name| traction(&interface, name)));
        peaks.take_while(|[tension, ..]| tension[0].is_some()).collect()
    };
    let placed = |name: &str| ["", ".r", ".z", ".time"].map(|suffix| said(&format!("{name}{suffix}")));
    observed.measures(&Said {
        largest_strain: placed(LARGEST_STRAIN),
        ratios: RATIOS.map(placed),
        impact_velocity: said(IMPACT_VELOCITY),
        mesh_loss: said(MESH_LOSS),
        interfaces: BODIES.map(interfaces),
    })
}

type Take = fn(&mut Observations, f64, [Cell; 2]);

/// What says something of the impact: topics, fields and what takes them.
const SOURCES: [(&str, [&str; 2], Take); 4] = [
    (DRAG, ["force", RADIUS], |seen, time, [force, radius]| {
        seen.take_drag(time, force.number(), radius.number());
    }),
    (VELOCITY, ["velocity", DISPLACEMENT], |seen, time, [velocity, depth]| {
        seen.take_motion(time, velocity.number(), depth.number());
    }),
    (ENERGY, ["kinetic", "strain"], |seen, time, [kinetic, strain]| {
        seen.take_energy(time, kinetic.number(), strain.number());
    }),
    (EVENT, ["kind", "since"], |seen, time, [kind, since]| {
        if let Cell::Text(kind) = kind {
            seen.take_event(time, &kind, since.number());
        }
    }),
];

/// Two fields of a channel, where it has them, and what takes them.
#[derive(Clone, Copy, Debug)]
pub(in crate::command) struct Source {
    fields: [Option<usize>; 2],
    take: Take,
}

impl Source {
    /// What a channel says of the impact; `None` if nothing.
    pub(in crate::command) fn of(channel: &Channel) -> Option<Self> {
        let (_, fields, take) = SOURCES.into_iter().find(|(topic, ..)| *topic == channel.topic)?;
        let layout = channel.layout.as_deref()?;
        let fields = fields.map(|field| layout.find(field));
        fields.iter().flatten().next()?;
        Some(Self { fields, take })
    }

    fn open<'a>(recording: &'a Recording, topic: &str) -> Option<(u16, &'a Channel, Self)> {
        let (&id, channel) = recording.channels.iter().find(|(_, channel)| channel.topic == topic)?;
        Some((id, channel, Self::of(channel)?))
    }

    pub(in crate::command) fn show(
        &self,
        channel: &Channel,
        time: f64,
        values: &Values,
        seen: &mut Observations,
    ) {
        let Some(layout) = channel.layout.as_deref() else { return };
        (self.take)(
            seen,
            time,
            self.fields.map(|leaf| leaf.map_or(Cell::Empty, |leaf| value(layout, leaf, values))),
        );
    }
}

/// The only value of a leaf.
fn value(layout: &Layout, leaf: usize, values: &Values) -> Cell {
    let names = if let Type::Enum(names) = &layout.leaves[leaf].kind { Some(names) } else { None };
    cell(&values.lists[leaf], 0, names)
}

fn units(recording: &Recording) -> Units {
    let [drag, motion, energy, event] = SOURCES.map(|(topic, ..)| Source::open(recording, topic));
    let interface = recording.channels.values().find(|channel| channel.topic == INTERFACE);
    let of = |source: &Option<(u16, &Channel, Source)>, field: usize| {
        let (_, channel, source) = source.as_ref()?;
        let leaf = &channel.layout.as_deref()?.leaves[source.fields[field]?];
        channel.unit(&leaf.path).map(str::to_owned)
    };
    let mut sources = [&drag, &motion, &energy, &event].into_iter().flatten();
    Units {
        time: sources.find_map(|(_, channel, _)| channel.time_unit().map(str::to_owned)),
        length: of(&motion, 1).or_else(|| of(&drag, 1)),
        speed: of(&motion, 0),
        force: of(&drag, 0),
        energy: of(&energy, 0),
        stress: interface.and_then(|channel| channel.unit("stress")).map(str::to_owned),
    }
}
