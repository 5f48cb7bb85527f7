//! What is read off the messages of a recording.

use percuss_table::{
    Cell,
    measures::{Measure, Observations, Story, TRACTIONS, Units},
};

use crate::{
    channel::Channel,
    convention::{
        DRAG, ENERGY, EVENT, IMPACT_VELOCITY, INTERFACE, LARGEST_STRAIN, MESH_LOSS, VALIDITY, VELOCITY,
    },
    field::cell,
    messages::Recording,
    recording::{Damage, OpenError},
    wire::{Layout, Type, Values},
};

/// What was measured, and what could not be read.
#[derive(Debug, Default)]
pub(in crate::command) struct Reading {
    /// The numbers, in the order of the columns.
    pub(in crate::command) measures: Vec<Measure>,
    /// Their units.
    pub(in crate::command) units: Units,
    /// Damaged parts of the file.
    pub(in crate::command) damages: Vec<Damage>,
    /// Messages that do not fit their schema.
    pub(in crate::command) undecoded: u64,
}

impl Reading {
    /// Reads a recording.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub(in crate::command) fn of(recording: &Recording) -> Result<Self, OpenError> {
        let mut events = [Source::open(recording, EVENT, ["kind", "since"])];
        let mut story = Story::default();
        visit(recording, &mut events, |_, time, [kind, since]| {
            if let Cell::Text(kind) = kind {
                story.take(time, &kind, since.number());
            }
        })?;
        let mut sources = [
            Source::open(recording, DRAG, ["force", "contact_radius"]),
            Source::open(recording, VELOCITY, ["velocity", "displacement"]),
            Source::open(recording, ENERGY, ["kinetic", "strain"]),
            // read once more, so that all damages come out of one pass
            Source::open(recording, EVENT, ["kind", "since"]),
        ];
        let units = units(recording, &sources);
        let mut observed = Observations::after(story);
        let (damages, undecoded) = visit(recording, &mut sources, |source, time, [first, second]| {
            let [first, second] = [first, second].map(|cell| cell.number());
            match source {
                0 => observed.drag.take(time, first, second),
                1 => observed.motion.take(time, first, second),
                2 => observed.energy.take(time, first.zip(second).map(|(kinetic, strain)| kinetic + strain)),
                _ => {}
            }
        })?;
        let said = |key: &str| recording.entries(VALIDITY)?.get(key)?.parse().ok();
        observed.largest_strain =
            ["", ".r", ".z", ".time"].map(|suffix| said(&format!("{LARGEST_STRAIN}{suffix}")));
        (observed.impact_velocity, observed.mesh_loss) = (said(IMPACT_VELOCITY), said(MESH_LOSS));
        let traction = |number: usize, traction: &str| {
            ["", ".r", ".time"].map(|part| said(&format!("interface.{number}.{traction}{part}")))
        };
        let interfaces = (1..).map(|number| TRACTIONS.map(|name| traction(number, name)));
        observed.interfaces = interfaces.take_while(|[tension, _]| tension[0].is_some()).collect();
        let measures = observed.measures();
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

fn units(recording: &Recording, [drag, motion, energy, event]: &[Option<Source<'_>>; 4]) -> Units {
    let interface = recording.channels.values().find(|channel| channel.topic == INTERFACE);
    let of = |source: &Option<Source<'_>>, field| source.as_ref().and_then(|source| source.unit(field));
    let sources = || [drag, motion, energy, event].into_iter().flatten();
    Units {
        time: sources().find_map(|source| source.channel.time_unit().map(str::to_owned)),
        length: of(motion, 1).or_else(|| of(drag, 1)),
        speed: of(motion, 0),
        force: of(drag, 0),
        energy: of(energy, 0),
        stress: interface.and_then(|channel| channel.unit("stress")).map(str::to_owned),
    }
}
