//! What is read off the messages of a recording.

use percuss_table::{
    Cell,
    measures::{Measure, Observations, Story, TRACTIONS, Units},
};

use crate::{
    channel::Channel,
    convention::{
        DISPLACEMENT, DRAG, ENERGY, EVENT, IMPACT_VELOCITY, INTERFACE, LARGEST_STRAIN, MESH_LOSS, RADIUS,
        VALIDITY, VELOCITY,
    },
    field::cell,
    messages::Recording,
    pass::{Moment, Pass, Seen},
    recording::OpenError,
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
    pub(in crate::command) fn of(recording: &Recording) -> Result<Self, OpenError> {
        let mut story = Story::default();
        let mut pass = Pass::<OpenError>::over(recording, Window::default());
        tell(recording, &mut story, &mut pass);
        pass.run()?;
        let mut observed = Observations::after(story);
        let mut pass = Pass::<OpenError>::over(recording, Window::default());
        if let Some(source) = Source::open(recording, DRAG, ["force", RADIUS]) {
            let drag = &mut observed.drag;
            source.watch(&mut pass, move |time, [force, radius]| drag.take(time, force, radius));
        }
        if let Some(source) = Source::open(recording, VELOCITY, ["velocity", DISPLACEMENT]) {
            let motion = &mut observed.motion;
            source.watch(&mut pass, move |time, [velocity, depth]| motion.take(time, velocity, depth));
        }
        if let Some(source) = Source::open(recording, ENERGY, ["kinetic", "strain"]) {
            let energy = &mut observed.energy;
            source.watch(&mut pass, move |time, [kinetic, strain]| {
                energy.take(time, kinetic.zip(strain).map(|(kinetic, strain)| kinetic + strain));
            });
        }
        // once more, so that all damages come out of one pass
        if let Some(source) = Source::open(recording, EVENT, ["kind", "since"]) {
            source.watch(&mut pass, |_, _| {});
        }
        let seen = pass.run()?;
        Ok(Self { seen, ..Self::from(recording, observed) })
    }

    /// What is measured of what was seen, and of what the recording says of it.
    pub(in crate::command) fn from(recording: &Recording, mut observed: Observations) -> Self {
        let said = |key: &str| recording.entries(VALIDITY)?.get(key)?.parse().ok();
        observed.largest_strain =
            ["", ".r", ".z", ".time"].map(|suffix| said(&format!("{LARGEST_STRAIN}{suffix}")));
        (observed.impact_velocity, observed.mesh_loss) = (said(IMPACT_VELOCITY), said(MESH_LOSS));
        let traction = |number: usize, traction: &str| {
            ["", ".r", ".time"].map(|part| said(&format!("interface.{number}.{traction}{part}")))
        };
        let interfaces = (1..).map(|number| TRACTIONS.map(|name| traction(number, name)));
        observed.interfaces = interfaces.take_while(|[tension, _]| tension[0].is_some()).collect();
        Self { measures: observed.measures(), units: units(recording), seen: Seen::default() }
    }
}

/// Looks at the events of a recording.
pub(in crate::command) fn tell<'a>(
    recording: &'a Recording,
    story: &'a mut Story,
    pass: &mut Pass<'a, OpenError>,
) {
    let Some(source) = Source::open(recording, EVENT, ["kind", "since"]) else { return };
    pass.each(source.id, move |moment, _| {
        if let Cell::Text(kind) = source.cell(moment, 0) {
            story.take(moment.time, &kind, source.cell(moment, 1).number());
        }
        Ok(())
    });
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

    /// Hands the time and the numbers of every message to `take`.
    fn watch(self, pass: &mut Pass<'a, OpenError>, mut take: impl FnMut(f64, [Option<f64>; 2]) + 'a) {
        pass.each(self.id, move |moment, _| {
            take(moment.time, [0, 1].map(|field| self.cell(moment, field).number()));
            Ok(())
        });
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
