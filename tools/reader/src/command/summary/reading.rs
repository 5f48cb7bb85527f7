//! What is read off the messages of a recording.

use std::cell::RefCell;

use percuss_table::{
    Cell,
    measures::{Measure, Observations, Said, TRACTIONS, Units},
};

use crate::{
    channel::Channel,
    convention::{
        DISPLACEMENT, DRAG, ENERGY, EVENT, IMPACT_VELOCITY, INTERFACE, LARGEST_STRAIN, MESH_LOSS, RADIUS,
        VALIDITY, VELOCITY,
    },
    failure::Failure,
    field::cell,
    messages::Recording,
    pass::{Moment, Pass, Seen},
    select::Window,
    wire::{Layout, Type},
};

/// What was measured, and what could not be read.
#[derive(Debug, Default)]
pub(in crate::command) struct Reading {
    /// The numbers, in the order of the columns.
    pub(in crate::command) measures: Vec<Measure>,
    /// Their units.
    pub(in crate::command) units: Units,
    /// How it was read.
    pub(in crate::command) seen: Seen,
}

impl Reading {
    /// Reads a recording.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub(in crate::command) fn of(recording: &Recording) -> Result<Self, Failure> {
        let observed = RefCell::default();
        let mut pass = Pass::over(recording, Window::default());
        watch(recording, &observed, &mut pass);
        let seen = pass.run()?;
        Ok(Self { seen, ..Self::from(recording, &observed.into_inner()) })
    }

    /// What is measured of what was seen, and of what the recording says of it.
    pub(in crate::command) fn from(recording: &Recording, observed: &Observations) -> Self {
        let said = |key: &str| recording.entries(VALIDITY)?.get(key)?.parse().ok();
        let traction = |number: usize, traction: &str| {
            ["", ".r", ".time"].map(|part| said(&format!("interface.{number}.{traction}{part}")))
        };
        let interfaces = (1..).map(|number| TRACTIONS.map(|name| traction(number, name)));
        let said = Said {
            largest_strain: ["", ".r", ".z", ".time"]
                .map(|suffix| said(&format!("{LARGEST_STRAIN}{suffix}"))),
            impact_velocity: said(IMPACT_VELOCITY),
            mesh_loss: said(MESH_LOSS),
            interfaces: interfaces.take_while(|[tension, _]| tension[0].is_some()).collect(),
        };
        Self { measures: observed.measures(&said), units: units(recording), seen: Seen::default() }
    }
}

/// Observes the impact of a recording.
pub(in crate::command) fn watch<'a>(
    recording: &'a Recording,
    observed: &'a RefCell<Observations>,
    pass: &mut Pass<'a>,
) {
    type Take = fn(&mut Observations, f64, [Cell; 2]);
    let takes: [(&str, [&str; 2], Take); 4] = [
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
    for (topic, fields, take) in takes {
        let Some(source) = Source::open(recording, topic, fields) else { continue };
        pass.each(source.id, move |moment, _| {
            let cells = [0, 1].map(|field| source.cell(moment, field));
            take(&mut observed.borrow_mut(), moment.time, cells);
            Ok(())
        });
    }
}

/// A channel, and two of its fields where it has them.
struct Source<'a> {
    id: u16,
    channel: &'a Channel,
    layout: &'a Layout,
    fields: [Option<usize>; 2],
}

impl<'a> Source<'a> {
    fn open(recording: &'a Recording, topic: &str, fields: [&str; 2]) -> Option<Self> {
        let (&id, channel) = recording.channels.iter().find(|(_, channel)| channel.topic == topic)?;
        let layout = channel.layout.as_deref()?;
        let fields = fields.map(|field| layout.find(field));
        fields.iter().flatten().next()?;
        Some(Self { id, channel, layout, fields })
    }

    fn unit(&self, field: usize) -> Option<String> {
        self.channel.unit(&self.layout.leaves[self.fields[field]?].path).map(str::to_owned)
    }

    fn cell(&self, moment: &Moment, field: usize) -> Cell {
        let Some(leaf) = self.fields[field] else { return Cell::Empty };
        let names = if let Type::Enum(names) = &self.layout.leaves[leaf].kind { Some(names) } else { None };
        cell(&moment.values.lists[leaf], 0, names)
    }
}

fn units(recording: &Recording) -> Units {
    let open = |topic, fields| Source::open(recording, topic, fields);
    let drag = open(DRAG, ["force", RADIUS]);
    let motion = open(VELOCITY, ["velocity", DISPLACEMENT]);
    let energy = open(ENERGY, ["kinetic", "strain"]);
    let event = open(EVENT, ["kind", "since"]);
    let interface = recording.channels.values().find(|channel| channel.topic == INTERFACE);
    let of = |source: &Option<Source<'_>>, field| source.as_ref().and_then(|source| source.unit(field));
    let mut sources = [&drag, &motion, &energy, &event].into_iter().flatten();
    Units {
        time: sources.find_map(|source| source.channel.time_unit().map(str::to_owned)),
        length: of(&motion, 1).or_else(|| of(&drag, 1)),
        speed: of(&motion, 0),
        force: of(&drag, 0),
        energy: of(&energy, 0),
        stress: interface.and_then(|channel| channel.unit("stress")).map(str::to_owned),
    }
}
