//! How far the arrays of a recording reach: their lengths and positions over all messages.

use std::collections::{BTreeMap, BTreeSet};

use percuss_picture::Side;

use crate::{
    axis::{Axis, between, is_beside_axis, is_near},
    channel::Channel,
    failure::Failure,
    messages::Recording,
    pass::Pass,
    path::{Element, Path},
    recording::Budget,
    select::Window,
    wire::{Layout, List, Values},
};

/// Largest number of columns an array is spread over.
pub const MAX_COLUMNS: usize = 10_000;

/// The positions that an array reaches in any message.
#[derive(Clone, Debug, PartialEq)]
pub struct Reach {
    /// Least position: half a step before the first element; the first that is listed, or the axis beside it.
    pub low: f64,
    /// Greatest position: half a step beyond the last element; the last that is listed.
    pub high: f64,
    /// The elements of the message that reaches farthest.
    pub side: Side,
}

impl Reach {
    /// That of the elements of a message; `None` if they have no positions.
    pub(crate) fn of(side: Side) -> Option<Self> {
        let (low, high) = match &side {
            // NaN compares false
            Side::Even { start, step, length } if *step > 0.0 && *length > 0 && start.is_finite() => {
                (start - 0.5 * step, start + (*length as f64 - 0.5) * step)
            }
            Side::Even { .. } => return None,
            Side::Listed(positions) if is_beside_axis(positions) => {
                (0.0, positions.iter().copied().reduce(f64::max)?)
            }
            Side::Listed(positions) => {
                let positions = positions.iter().copied();
                (positions.clone().reduce(f64::min)?, positions.reduce(f64::max)?)
            }
        };
        high.is_finite().then_some(Self { low, high, side })
    }

    fn join(self, new: Self) -> Self {
        let low = self.low.min(new.low);
        Self { low, ..if new.high > self.high { new } else { self } }
    }

    /// The elements of a message if it reached as far: of one whose axis begins and steps like `side`; those of one that lists its
    /// positions are all.
    pub(crate) fn whole(&self, side: &Side) -> Side {
        let Side::Even { start, step, length } = *side else { return side.clone() };
        let last = ((self.side.at(self.side.length() - 1) - start) / step).round();
        let known = (last.max(-1.0) as usize).saturating_add(usize::from(last >= 0.0));
        Side::Even { start, step, length: length.max(known) }
    }

    /// Distance of positions that is rounding, seen from the distance of elements.
    pub(crate) fn rounding(&self) -> f64 {
        match &self.side {
            Side::Even { step, .. } => 1e-9 * step,
            Side::Listed(_) => 0.0,
        }
    }

    /// True if a position lies inside, up to rounding.
    pub fn holds(&self, position: f64) -> bool {
        let room = self.rounding();
        let is_inside = position >= self.low - room && position <= self.high + room;
        is_inside || is_near(position, self.low) || is_near(position, self.high)
    }
}

/// Value of a matrix at a row and a column position, linear in both as [`between`] has it; at an interface the upper side.
///
/// * `list`: the matrix, row-major; nothing if it has not as many elements as its sides
/// * `whole`: how far rows and columns reach, of which a message may leave out what is at rest; 0 there
/// * `even`: about the origin of the columns
pub(crate) fn at_point(
    list: &List,
    sides: &[Side],
    whole: Option<&[Reach; 2]>,
    even: bool,
    (row, column): (f64, f64),
) -> Option<f64> {
    let [rows, columns] = sides else { return None };
    let (height, width) = (rows.length(), columns.length());
    if height.checked_mul(width) != Some(list.len()) {
        return None;
    }
    let element = |j: usize, i: usize| {
        if j < height && i < width { list.number(j * width + i) } else { Some(0.0) }
    };
    let [down, across] = whole.map_or_else(
        || [rows.clone(), columns.clone()],
        |[down, across]| [down.whole(rows), across.whole(columns)],
    );
    between(&down, false, (row, false), |j| between(&across, even, (column, false), |i| element(j, i)))
}

/// How far an array reaches over all messages.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Extent {
    /// Greatest number of elements of a list that is in no other; the greatest of all numbers where there was no room for the
    /// places.
    pub length: usize,
    /// Elements of lists inside lists, and entries of maps, one of each on the way, in their order; at most one more than columns are made.
    pub places: BTreeSet<Vec<Element>>,
    /// Along an axis that messages describe; rows and columns of a matrix.
    pub reaches: Vec<Reach>,
    /// What is wrong with the places of a message, if anything is: the first that was found.
    pub flaw: Option<String>,
    /// True if it has not the same shape in every message.
    pub varies: bool,
}

/// How far the arrays of some channels reach, by channel and leaf, in all messages that were watched.
pub struct Extents(BTreeMap<(u16, usize), Array>);

impl Extents {
    pub(crate) fn of(recording: &Recording, ids: &[u16]) -> Self {
        let arrays = |&id: &u16| {
            let channel = recording.channels.get(&id)?;
            let arrays = Array::all(channel, channel.layout.as_deref()?).into_iter();
            Some(arrays.map(move |array| ((id, array.leaf), array)))
        };
        Self(ids.iter().filter_map(arrays).flatten().collect())
    }

    /// Reads all messages of some channels.
    pub fn read(recording: &Recording, ids: &[u16]) -> Result<Self, Failure> {
        let mut extents = Self::of(recording, ids);
        let mut pass = Pass::over(recording, Window::default());
        extents.watch(&mut pass);
        pass.run()?;
        Ok(extents)
    }

    pub(crate) fn watch<'a>(&'a mut self, pass: &mut Pass<'a>) {
        for ((id, _), array) in &mut self.0 {
            pass.each(*id, |moment, budget| {
                array.take(&moment.values, budget);
                Ok(())
            });
        }
    }

    pub fn get(&self, id: u16, leaf: usize) -> Extent {
        self.0.get(&(id, leaf)).map(|array| array.extent.clone()).unwrap_or_default()
    }
}

struct Array {
    leaf: usize,
    path: Path,
    axis: Axis,
    extent: Extent,
    /// Those of the last message.
    sides: Vec<Side>,
    /// Memory of the places \[bytes\].
    weight: usize,
}

impl Array {
    fn all(channel: &Channel, layout: &Layout) -> Vec<Self> {
        let array = |leaf: usize| Self {
            leaf,
            path: Path::of(layout, leaf),
            axis: Axis::of(leaf, layout, channel),
            extent: Extent::default(),
            sides: Vec::new(),
            weight: 0,
        };
        let is_array = |&leaf: &usize| {
            let leaf = &layout.leaves[leaf];
            leaf.lists > 0 && leaf.is_data()
        };
        (0..layout.leaves.len()).filter(is_array).map(array).collect()
    }

    /// Adds the places of a message; where there is no room for them, none are kept.
    fn add_places(&mut self, values: &Values, budget: &mut Budget) {
        if self.extent.length == usize::MAX {
            return;
        }
        let places = &mut self.extent.places;
        let before = places.len();
        self.path.places(values, MAX_COLUMNS + 1, places);
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
        let length = match self.path.lists() {
            1 if !self.path.has_keys() => self.path.length(values),
            _ => {
                self.add_places(values, budget);
                0
            }
        };
        // what never has a value takes no columns
        if !values.lists[self.leaf].is_empty() {
            self.extent.length = self.extent.length.max(length);
        }
        if self.extent.flaw.is_none() {
            self.extent.flaw = self.axis.flaw(self.leaf, values);
        }
        if matches!(self.axis, Axis::Listed(_)) {
            return;
        }
        let sides = self.axis.sides(values, length);
        let size = sides.iter().try_fold(1_usize, |size, side| size.checked_mul(side.length()));
        if sides.is_empty() || (self.axis.is_matrix() && size != Some(values.lists[self.leaf].len())) {
            return;
        }
        self.extent.varies |= !self.sides.is_empty() && self.sides != sides;
        self.sides.clone_from(&sides);
        let Some(new) = sides.into_iter().map(Reach::of).collect::<Option<Vec<_>>>() else { return };
        let known = std::mem::take(&mut self.extent.reaches);
        self.extent.reaches = match known.len() {
            0 => new,
            _ => known.into_iter().zip(new).map(|(known, new)| known.join(new)).collect(),
        };
    }
}
