//! How far the arrays of a recording reach: their lengths and positions over all messages.

use std::collections::{BTreeSet, HashMap};

use percuss_picture::Side;

use crate::{
    axis::{Axis, Grid},
    channel::Channel,
    messages::Recording,
    nest::{Counts, Element, Nest},
    recording::{Budget, OpenError},
    table::MAX_COLUMNS,
    wire::{Layout, Values},
};

/// The positions that an array reaches in any message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Least position: half a step before the first element.
    pub low: f64,
    /// Greatest position: half a step beyond the last element.
    pub high: f64,
    /// The elements of the message that reaches farthest.
    pub side: Side,
}

impl Reach {
    fn of(side: Side) -> Option<Self> {
        // NaN compares false
        let is_sound = side.step > 0.0 && side.length > 0 && side.start.is_finite();
        let (low, high) = (side.start - 0.5 * side.step, side.start + (side.length as f64 - 0.5) * side.step);
        (is_sound && high.is_finite()).then_some(Self { low, high, side })
    }

    /// Of positions that are listed, between the least and the greatest of which values are known.
    pub(crate) fn listed(positions: &[f64]) -> Option<Self> {
        let low = positions.iter().copied().reduce(f64::min)?;
        let high = positions.iter().copied().reduce(f64::max)?;
        Some(Self { low, high, side: Side { start: low, step: 0.0, length: positions.len() } })
    }

    fn join(known: Option<Self>, side: Side) -> Option<Self> {
        match (known, Self::of(side)) {
            (Some(known), Some(new)) => {
                let farther = if new.high > known.high { new } else { known };
                Some(Self { low: known.low.min(new.low), ..farther })
            }
            (known, new) => known.or(new),
        }
    }

    /// Number of elements of a message whose axis begins and steps like `side`, if it reached as far.
    pub fn length(&self, side: &Side) -> usize {
        let last = ((self.side.at(self.side.length - 1) - side.start) / side.step).round();
        (last.max(-1.0) as usize).saturating_add(usize::from(last >= 0.0))
    }

    /// True if a position lies inside, up to rounding.
    pub fn holds(&self, position: f64) -> bool {
        let room = 1e-9 * self.side.step;
        position >= self.low - room && position <= self.high + room
    }
}

/// How far an array reaches over all messages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extent {
    /// Greatest number of elements of a list that is in no other; the greatest of all numbers where there was no room for the
    /// places.
    pub length: usize,
    /// Elements of lists inside lists, and entries of maps, one of each on the way, in their order; at most one more than columns are made.
    pub places: BTreeSet<Vec<Element>>,
    /// Along a uniform axis; rows and columns of a matrix.
    pub reaches: Vec<Reach>,
    /// True if a matrix has not the same shape in every message.
    pub varies: bool,
}

/// How far the arrays of some channels reach.
#[derive(Debug, Default)]
pub struct Extents(HashMap<(u16, usize), Extent>);

impl Extents {
    /// Reads all messages of some channels.
    ///
    /// # Errors
    ///
    /// The file cannot be read.
    pub fn read(recording: &Recording, ids: &[u16]) -> Result<Self, OpenError> {
        let mut surveys: HashMap<u16, Survey<'_>> = HashMap::new();
        for &id in ids {
            if let Some(channel) = recording.channels.get(&id)
                && let Some(layout) = channel.layout.as_deref()
            {
                surveys.insert(id, Survey::of(channel, layout));
            }
        }
        let mut messages = recording.messages(ids.iter().copied(), None)?;
        let mut budget = Budget::new(recording.limits().kept());
        messages.for_each(|message| -> Result<(), OpenError> {
            if let Some(survey) = surveys.get_mut(&message.channel) {
                survey.take(message.data, &mut budget);
            }
            Ok(())
        })?;
        let extents = surveys.into_iter().flat_map(|(id, survey)| {
            survey.arrays.into_iter().map(move |array| ((id, array.leaf), array.extent))
        });
        Ok(Self(extents.collect()))
    }

    /// The extent of the array of a leaf.
    pub fn of(&self, id: u16, leaf: usize) -> Extent {
        self.0.get(&(id, leaf)).cloned().unwrap_or_default()
    }
}

/// What is known of an array so far.
struct Array {
    leaf: usize,
    nest: Nest,
    axis: Axis,
    extent: Extent,
    along: [Option<Reach>; 2],
    grid: Option<Grid>,
    /// Memory of the places \[bytes\].
    weight: usize,
}

/// The arrays of a channel, message by message.
struct Survey<'a> {
    layout: &'a Layout,
    values: Values,
    arrays: Vec<Array>,
}

impl<'a> Survey<'a> {
    fn of(channel: &Channel, layout: &'a Layout) -> Self {
        let counts = Counts::of(layout);
        let array = |leaf: usize| Array {
            leaf,
            nest: Nest::of(layout, &counts, leaf),
            axis: Axis::of(leaf, layout, channel),
            extent: Extent::default(),
            along: [None; 2],
            grid: None,
            weight: 0,
        };
        let is_array = |&leaf: &usize| {
            let leaf = &layout.leaves[leaf];
            leaf.lists > 0 && leaf.is_data()
        };
        let arrays = (0..layout.leaves.len()).filter(is_array).map(array);
        Self { layout, values: layout.values(), arrays: arrays.collect() }
    }

    fn take(&mut self, bytes: &[u8], budget: &mut Budget) {
        if self.layout.decode(bytes, &mut self.values).is_ok() {
            self.arrays.iter_mut().for_each(|array| array.take(&self.values, budget));
        }
        self.values.release();
    }
}

impl Array {
    /// Adds the places of a message; where there is no room for them, none are kept.
    fn add_places(&mut self, values: &Values, budget: &mut Budget) {
        if self.extent.length == usize::MAX {
            return;
        }
        let places = &mut self.extent.places;
        let before = places.len();
        self.nest.places(values, MAX_COLUMNS + 1, places);
        if places.len() == before {
            return;
        }
        let weight = places.iter().flatten().map(Element::weight).sum::<usize>();
        let more = weight.saturating_sub(std::mem::replace(&mut self.weight, weight));
        if !budget.spend(more) {
            budget.give_back(weight - more);
            (self.extent.places, self.extent.length) = (BTreeSet::new(), usize::MAX);
        }
    }

    fn take(&mut self, values: &Values, budget: &mut Budget) {
        let length = match self.nest.lists() {
            1 if !self.nest.has_keys() => self.nest.spot(&[None]).length(values),
            _ => {
                self.add_places(values, budget);
                0
            }
        };
        // what never has a value takes no columns
        if !values.lists[self.leaf].is_empty() {
            self.extent.length = self.extent.length.max(length);
        }
        if let Some(grid) = self.axis.grid(values) {
            let size = grid.rows.length.checked_mul(grid.columns.length);
            if size != Some(values.lists[self.leaf].len()) {
                return;
            }
            self.extent.varies |= self.grid.is_some_and(|known| known != grid);
            self.grid = Some(grid);
            self.along = [Reach::join(self.along[0], grid.rows), Reach::join(self.along[1], grid.columns)];
        } else if let Some((start, step)) = self.axis.uniform(values) {
            self.along[0] = Reach::join(self.along[0], Side { start, step, length });
        }
        self.extent.reaches = self.along.into_iter().flatten().collect();
    }
}
