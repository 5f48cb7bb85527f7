//! A file that is traced: its channels, their columns and their samples.

use std::{
    collections::{BTreeSet, HashMap, HashSet},
    ops::Range,
    path::Path,
    slice, thread,
};

use percuss_table::Cell;

use super::request::Request;
use crate::{
    channel::Channel,
    extent::{Extent, Extents},
    failure::Failure,
    field::{Column, Columns, MAX_TABLE, Positions, Selection, SelectionError, columns},
    instant::Instant,
    messages::{Messages, POLL, Recording},
    recording::Limits,
    select,
    slice::kept_at,
    wire::{List, Values},
};

pub(super) struct Traced {
    pub(super) recording: Recording,
    pub(super) name: String,
    pub(super) slots: Vec<Slot>,
}

/// A channel that is traced; its columns without the time.
pub(super) struct Slot {
    pub(super) id: u16,
    pub(super) topic: String,
    pub(super) time: Column,
    pub(super) columns: Vec<Column>,
    /// Log times and sequence numbers of its messages, if only some are traced.
    chosen: Option<HashSet<(u64, u32)>>,
}

impl Traced {
    /// * `origin`: log time that counts as 0, if it is not the start of the recording \[ns\]
    pub(super) fn open(
        path: &Path,
        name: String,
        request: &Request,
        origin: Option<u64>,
        limits: Limits,
        all_left_out: &mut Vec<SelectionError>,
    ) -> Result<Self, Failure> {
        let mut recording = request.sources.open(path, limits)?;
        // of a file that is being written, the topics may still be to come
        while request.follow && select::channels_or_default(&recording, &request.topics).is_err() {
            thread::sleep(POLL);
            recording = request.sources.open(path, limits)?;
        }
        if let Some(origin) = origin {
            recording.count_from(origin);
        }
        let ids = select::channels_or_default(&recording, &request.topics)?;
        let many = ids.len() > 1;
        let (mut slots, mut width, mut weight) = (Vec::new(), 0, 0);
        let mut extents: Option<Result<Extents, Failure>> = None;
        let mut unused = request.selection.clone();
        for &id in &ids {
            let channel = &recording.channels[&id];
            let mut extent = |leaf: usize| {
                let extents = extents.get_or_insert_with(|| Extents::read(&recording, &ids));
                let extent = extents.as_ref().map_or_else(|_| Extent::default(), |known| known.get(id, leaf));
                // what is still to be written may reach farther
                if request.follow { Extent { reaches: Vec::new(), ..extent } } else { extent }
            };
            let selection = match many {
                true => fitting(channel, &request.selection, &mut unused),
                false => Some(request.selection.clone()),
            };
            let Some(selection) = selection else { continue };
            request.window.check(channel)?;
            let Columns { time, fields, left_out } = columns(channel, &selection, &mut extent)?;
            all_left_out.extend(left_out);
            width += fields.len();
            weight += fields.iter().map(Column::weight).sum::<usize>();
            if width > MAX_TABLE || weight > 2 * limits.kept() {
                return Err(SelectionError::too_wide(&channel.topic, width).into());
            }
            slots.push(Slot { id, topic: channel.topic.clone(), time, columns: fields, chosen: None });
        }
        if let Some(Err(error)) = extents {
            return Err(error);
        }
        if !request.at_times.is_empty() {
            let (kept, _) = kept_at(&recording, &ids, &request.at_times)?;
            for slot in &mut slots {
                let own = kept.iter().filter(|kept| kept.channel == slot.id);
                slot.chosen = Some(own.map(|kept| (kept.log_time, kept.sequence)).collect());
            }
        }
        // several channels of a topic are told apart by their ids
        let mut of_topic = HashMap::<String, usize>::new();
        slots.iter().for_each(|slot| *of_topic.entry(slot.topic.clone()).or_default() += 1);
        for slot in slots.iter_mut().filter(|slot| of_topic[&slot.topic] > 1) {
            slot.topic = format!("{}#{}", slot.topic, slot.id);
        }
        if many {
            let channels: Vec<&Channel> = ids.iter().map(|id| &recording.channels[id]).collect();
            unused.refuse_rest(&channels)?;
        }
        Ok(Self { recording, name, slots })
    }

    /// Leaves out a field that is the time column already, where no other topic has one.
    pub(super) fn leave_out_second_times(&mut self) {
        if let [slot] = self.slots.as_mut_slice() {
            let time = slot.time.leaf;
            slot.columns.retain(|column| time.is_none() || column.leaf != time);
        }
    }

    /// Log time that counts as 0 \[ns\].
    pub(super) fn origin(&self) -> u64 {
        self.slots.iter().map(|slot| self.recording.channels[&slot.id].origin).max().unwrap_or(0)
    }

    /// * `base`: number of its first slot among those of all files
    /// * `by_log_time`: all channels of all files are timed by their log times
    pub(super) fn stream(
        &self,
        request: &Request,
        base: usize,
        by_log_time: bool,
    ) -> Result<Stream<'_>, Failure> {
        let ids = || self.slots.iter().map(|slot| slot.id);
        let window = request.window.log_times_of(&self.recording, ids());
        let is_joined = by_log_time && self.slots.len() > 1 && !request.follow;
        // without an index all of the file would wait
        let mut messages = if is_joined && self.recording.has_index() {
            let what = "the rows of topics whose messages are far from the order of their times";
            let refusal = self.recording.no_room(what).to_string();
            self.recording.messages_in_turn(ids(), window, refusal)?
        } else {
            self.recording.messages(ids(), window)?
        };
        if request.follow {
            messages.follow();
        }
        let (time, hidden) = (Instant::Number(f64::NEG_INFINITY), BTreeSet::new());
        Ok(Stream { file: self, messages, base, by_log_time, time, hidden, done: false })
    }
}

/// Names of fields that are listed, at most.
const MAX_HIDDEN: usize = 20;

/// The fields of a JSON message that have no column: neither the schema nor the first messages have them.
fn unknown_names(topic: &str, values: &Values) -> Vec<String> {
    let Some(List::Bytes(unknown)) = values.lists.last() else { return Vec::new() };
    let name = |field: &Vec<u8>| {
        let mut texts = serde_json::Deserializer::from_slice(field).into_iter::<String>();
        Some(format!("{topic}.{}", texts.next()?.ok()?))
    };
    unknown.iter().filter_map(name).collect()
}

/// What of a selection a channel has, where several are traced; `None` if it has nothing of it. What is there is taken out of
/// `unused`.
fn fitting(channel: &Channel, selection: &Selection, unused: &mut Selection) -> Option<Selection> {
    let for_curves = selection.for_curves;
    let fits = |fields: &[String], at: &[Positions]| {
        let selection = Selection { fields: fields.to_vec(), at: at.to_vec(), for_curves };
        match columns(channel, &selection, &mut |_| Extent::default()) {
            Ok(_) => true,
            Err(SelectionError::Absent(_)) => false,
            // there, but refused: that is reported
            Err(error) => !matches!(error, SelectionError::NotDecoded(_)),
        }
    };
    let mut fields = selection.fields.clone();
    fields.retain(|field| fits(slice::from_ref(field), &[]));
    unused.fields.retain(|field| !fields.contains(field));
    if !selection.fields.is_empty() && fields.is_empty() {
        return None;
    }
    let mut at = selection.at.clone();
    at.retain(|positions| fits(&fields, slice::from_ref(positions)));
    unused.at.retain(|positions| !at.contains(positions));
    fits(&fields, &at).then_some(Selection { fields, at, for_curves })
}

pub(super) struct Stream<'a> {
    pub(super) file: &'a Traced,
    pub(super) messages: Messages<'a>,
    /// Number of its first slot among those of all files.
    base: usize,
    by_log_time: bool,
    pub(super) time: Instant,
    /// Fields of JSON messages that have no column.
    pub(super) hidden: BTreeSet<String>,
    pub(super) done: bool,
}

impl Stream<'_> {
    pub(super) fn slots(&self) -> Range<usize> {
        self.base..self.base + self.file.slots.len()
    }

    /// The next sample; none for now, or for good if it is done then.
    pub(super) fn next(&mut self, request: &Request) -> Result<Option<(usize, Instant, Vec<Cell>)>, Failure> {
        loop {
            let (file, hidden, by_log_time) = (self.file, &mut self.hidden, self.by_log_time);
            let next = self.messages.next(|next| {
                let (message, channel) = (next.message, next.channel);
                let index = file.slots.iter().position(|slot| slot.id == message.channel)?;
                let slot = &file.slots[index];
                let stamp = (message.log_time, message.sequence);
                if slot.chosen.as_ref().is_some_and(|chosen| !chosen.contains(&stamp)) {
                    return None;
                }
                let values = next.values()?;
                if hidden.len() < MAX_HIDDEN && channel.layout.as_ref().is_some_and(|layout| layout.is_json())
                {
                    hidden.extend(unknown_names(&slot.topic, values));
                }
                let number = slot.time.cell(values, message.log_time).number().unwrap_or(f64::NAN);
                let instant = match slot.time.leaf {
                    Some(_) => Instant::Number(number),
                    None => Instant::log(message.log_time, channel.origin),
                };
                // those of channels with times of their own are compared with these
                let time = if by_log_time { instant } else { Instant::Number(number) };
                let cell = |column: &Column| column.cell(values, message.log_time);
                request.window.holds(instant).then(|| {
                    let cells: Vec<Cell> = slot.columns.iter().map(cell).collect();
                    (index, time, cells)
                })
            })?;
            match next {
                Some(Some((slot, time, cells))) => {
                    self.time = time;
                    return Ok(Some((self.base + slot, time, cells)));
                }
                Some(None) => {}
                None => {
                    self.done = self.messages.is_over();
                    return Ok(None);
                }
            }
        }
    }
}
