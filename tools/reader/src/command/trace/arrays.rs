//! Arrays over their axes and time, for archives of NumPy: a matrix of a topic as one array over time, depth and radius.

use std::{
    collections::BTreeMap,
    io::{self, Seek, Write},
    path::Path,
};

use indexmap::IndexSet;
use ndarray::{Array, Array1, Array2, IxDyn};
use ndarray_npy::{NpzWriter, WriteNpzError};
use percuss_picture::Side;

use super::{
    Names,
    request::{Outcome, Request},
};
use crate::{
    axis::Axis,
    channel::Channel,
    extent::{Extent, Extents},
    failure::Failure,
    field::SelectionError,
    format::npy::Text,
    messages::Recording,
    pass::Pass,
    prefix::Prefixed,
    recording::Limits,
    select,
    slice::shown_name,
    units::Units,
    verb::Losses,
    wire::{Layout, Type, Values},
};

struct ArrayField {
    leaf: usize,
    name: String,
    /// The unit, and what leads to it from that which is recorded, if another is chosen.
    unit: Option<String>,
    shown: Option<Prefixed>,
    axis: Axis,
    /// Coordinates and positions along each side behind the time.
    sides: Vec<(String, Side)>,
    /// What stands where a message has no element: what is at rest in a matrix, else NaN.
    rest: f64,
    numbers: Numbers,
}

/// Numbers in the precision in which they are recorded.
enum Numbers {
    Whole(Vec<u64>),
    Single(Vec<f32>),
    Double(Vec<f64>),
}

/// Writes the fields of a topic as arrays: `time`, every field over time and the coordinates of its axes, those coordinates, and `units`, pairs of
/// the name of an array and its unit. A matrix has the shape (times, rows, columns). `None`, and nothing is written, where that is not what is asked for: of several
/// topics or files, at positions, or where no field is an array with an axis, a table has a column for each.
pub(super) fn arrays(
    path: &Path,
    request: &Request,
    limits: Limits,
    output: &mut dyn Write,
) -> Result<Option<Outcome>, Failure> {
    if request.follow || request.stack || !request.selection.at.is_empty() || !request.at_times.is_empty() {
        return Ok(None);
    }
    let mut recording = Recording::open(path, limits)?;
    if request.epoch {
        recording.count_from(0);
    }
    let ids = select::channels_or_default(&recording, &request.topics)?;
    let &[id] = ids.as_slice() else { return Ok(None) };
    let channel = &recording.channels[&id];
    let Some(layout) = channel.layout.as_deref() else { return Ok(None) };
    let Some(leaves) = chosen(channel, layout, &request.selection.fields) else { return Ok(None) };
    request.window.check(channel)?;
    let extents = Extents::read(&recording, &[id])?;
    let field = |&leaf: &usize| ArrayField::of(channel, layout, leaf, &extents.get(id, leaf), &request.units);
    let mut fields = leaves.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    let mut times = Vec::new();
    let no_room = || {
        let text = "the arrays are larger than --max-memory allows; choose --from and --to, or --every";
        Failure::Failed(text.into())
    };
    let half = usize::try_from(limits.memory / 2).unwrap_or(usize::MAX);
    let mut pass = Pass::over(&recording, request.window).keeping(half);
    pass.each(id, |moment, budget| -> Result<(), Failure> {
        times.push(moment.time);
        fields.iter_mut().try_for_each(|field| {
            // a list grows to twice its length
            if !budget.spend(2 * field.bytes()) {
                Err(no_room())
            } else {
                field.take(channel, &moment.values)
            }
        })
    });
    let losses = Losses::of(path, pass.run()?);
    let outcome = Outcome { rows: times.len() as u64, losses, ..Outcome::default() };
    // beside the arrays there is no room for them once more
    let archive = tempfile::tempfile()?;
    let mut archive =
        write(archive, channel, times, fields, &request.units).map_err(|error| match error {
            WriteNpzError::Zip(_) | WriteNpzError::Npy(_) => {
                Failure::Output(io::Error::other(error.to_string()))
            }
        })?;
    archive.rewind()?;
    io::copy(&mut archive, output)?;
    Ok(Some(outcome))
}

/// Leaves of the numbers that are asked for by their names, or of all; `None` if none of them is an array with an axis, or a name is that of
/// an element.
fn chosen(channel: &Channel, layout: &Layout, names: &[String]) -> Option<Vec<usize>> {
    let (hidden, time) = (channel.axis_parts(), channel.time_leaf());
    // lists of positions are points, of which each has a name
    let is_array = |leaf: usize| matches!(Axis::of(leaf, layout, channel), Axis::Described(_));
    let is_number = |leaf: usize| layout.leaves[leaf].kind.is_number() && layout.leaves[leaf].is_data();
    let is_sound = |leaf: &usize| layout.leaves[*leaf].lists == 0 || is_array(*leaf);
    let leaves: IndexSet<usize> = match names {
        [] => {
            let is_shown = |leaf: &usize| !hidden.contains(&*layout.leaves[*leaf].path) && is_number(*leaf);
            (0..layout.leaves.len()).filter(is_shown).filter(is_sound).collect()
        }
        names => {
            let leaf = |name: &String| layout.find(name).filter(|leaf| is_number(*leaf));
            names.iter().map(leaf).collect::<Option<_>>()?
        }
    };
    let leaves: Vec<usize> = leaves.into_iter().filter(|leaf| Some(*leaf) != time).collect();
    (leaves.iter().any(|leaf| is_array(*leaf)) && leaves.iter().all(is_sound)).then_some(leaves)
}

impl ArrayField {
    fn of(
        channel: &Channel,
        layout: &Layout,
        leaf: usize,
        extent: &Extent,
        units: &Units,
    ) -> Result<Self, Failure> {
        let path = &layout.leaves[leaf].path;
        let misplaced = |flaw: &str| SelectionError::misplaced(&channel.topic, path, flaw);
        if let Some(flaw) = &extent.flaw {
            return Err(misplaced(flaw).into());
        }
        let axis = Axis::of(leaf, layout, channel);
        let names = axis.coordinates();
        let reached = names.iter().zip(&extent.reaches);
        let sides: Vec<(String, Side)> =
            reached.map(|(name, reach)| (channel.along(name).to_owned(), reach.side.clone())).collect();
        if sides.len() != names.len() {
            return Err(misplaced("has no places along its axis in any message").into());
        }
        let numbers = match layout.leaves[leaf].kind {
            Type::UInt => Numbers::Whole(Vec::new()),
            Type::Float => Numbers::Single(Vec::new()),
            _ => Numbers::Double(Vec::new()),
        };
        let rest = if axis.is_matrix() { 0.0 } else { f64::NAN };
        let shown = channel.unit(path).and_then(|unit| units.of(unit));
        let unit = shown.as_ref().map(|shown| shown.unit.as_str()).or(channel.unit(path)).map(str::to_owned);
        let name = shown_name(&channel.topic, path).to_owned();
        Ok(Self { leaf, name, unit, shown, axis, sides, rest, numbers })
    }

    /// Memory of the numbers of a message \[bytes\].
    fn bytes(&self) -> usize {
        let size = if let Numbers::Single(_) = self.numbers { size_of::<f32>() } else { size_of::<f64>() };
        self.sides.iter().fold(size, |size, (_, side)| size.saturating_mul(side.length()))
    }

    fn take(&mut self, channel: &Channel, values: &Values) -> Result<(), Failure> {
        let list = &values.lists[self.leaf];
        let sides = self.axis.sides(values, list.len());
        let lengths: Vec<usize> = sides.iter().map(Side::length).collect();
        let mut pairs = sides.iter().zip(&self.sides);
        let is_whole = lengths.len() == self.sides.len()
            && pairs.all(|(side, (_, whole))| begins(whole, side))
            && (self.sides.is_empty() || lengths.iter().product::<usize>() == list.len());
        if !is_whole {
            let flaw = "has its elements at other places in some messages; choose positions with --at";
            return Err(SelectionError::misplaced(&channel.topic, &self.name, flaw).into());
        }
        let (rows, columns) = match self.sides.as_slice() {
            [(_, rows), (_, columns)] => (rows.length(), columns.length()),
            [(_, side)] => (1, side.length()),
            _ => (1, 1),
        };
        let width = lengths.last().copied().unwrap_or(1);
        let number = |j: usize, i: usize| {
            let element = if i < width { list.number(j * width + i) } else { None };
            let number = element.unwrap_or(self.rest);
            self.shown.as_ref().map_or(number, |shown| shown.apply(number))
        };
        let all = (0..rows).flat_map(|j| (0..columns).map(move |i| (j, i))).map(|(j, i)| number(j, i));
        match &mut self.numbers {
            Numbers::Whole(numbers) => numbers.extend(all.map(|number| number as u64)),
            Numbers::Single(numbers) => numbers.extend(all.map(|number| number as f32)),
            Numbers::Double(numbers) => numbers.extend(all),
        }
        Ok(())
    }
}

/// True if a side has the first positions of another.
fn begins(whole: &Side, side: &Side) -> bool {
    let Some(last) = side.length().checked_sub(1) else { return true };
    let room = 1e-9 * (whole.at(1) - whole.at(0)).abs();
    side.length() <= whole.length()
        && [0, last].iter().all(|&i| (whole.at(i) - side.at(i)).abs() <= room.max(0.0))
}

fn write<W: Write + Seek>(
    file: W,
    channel: &Channel,
    times: Vec<f64>,
    fields: Vec<ArrayField>,
    chosen: &Units,
) -> Result<W, WriteNpzError> {
    let mut archive = NpzWriter::new(file);
    // positions and times are few, in the units that are chosen
    let list = |numbers: Vec<f64>, unit: Option<&str>| match unit.and_then(|unit| chosen.of(unit)) {
        Some(shown) => (numbers.into_iter().map(|number| shown.apply(number)).collect(), Some(shown.unit)),
        None => (Array1::from(numbers), unit.map(str::to_owned)),
    };
    let count = times.len();
    let (times, unit) = list(times, channel.time_unit());
    archive.add_array("time", &times)?;
    let mut units = vec![("time".to_owned(), unit)];
    let mut known: BTreeMap<String, Side> = BTreeMap::new();
    let mut names = Names::default();
    for name in ["time", "units"] {
        names.take("", name);
    }
    for ArrayField { name, unit, axis, sides, numbers, .. } in fields {
        let name = names.take(&channel.topic, &name);
        for ((label, side), coordinate_name) in sides.iter().zip(axis.coordinates()) {
            // another field may have other places
            let label = match known.get(label) {
                Some(other) if other == side => continue,
                Some(_) => format!("{name}.{label}"),
                None => label.clone(),
            };
            let positions = (0..side.length()).map(|i| side.at(i)).collect();
            let (positions, unit) = list(positions, channel.coordinate_unit(coordinate_name));
            let array = names.take(&channel.topic, &label);
            archive.add_array(array.as_str(), &positions)?;
            units.push((array, unit));
            known.insert(label, side.clone());
        }
        let shape: Vec<usize> =
            [count].into_iter().chain(sides.iter().map(|(_, side)| side.length())).collect();
        let shape = IxDyn(&shape);
        let whole = "as many numbers as the sides say";
        match numbers {
            Numbers::Whole(numbers) => {
                archive.add_array(name.as_str(), &Array::from_shape_vec(shape, numbers).expect(whole))?;
            }
            Numbers::Single(numbers) => {
                archive.add_array(name.as_str(), &Array::from_shape_vec(shape, numbers).expect(whole))?;
            }
            Numbers::Double(numbers) => {
                archive.add_array(name.as_str(), &Array::from_shape_vec(shape, numbers).expect(whole))?;
            }
        }
        units.push((name, unit));
    }
    let text = |(i, j): (usize, usize)| match (&units[i], j) {
        ((name, _), 0) => Text::of(name),
        ((_, unit), _) => Text::of(unit.as_deref().unwrap_or_default()),
    };
    archive.add_array("units", &Array2::from_shape_fn((units.len(), 2), text))?;
    archive.finish()
}
