//! What a recording holds at one time: arrays over their axis, matrices over their two.

use std::collections::{BTreeMap, BTreeSet};

use percuss_table::Heading;

use crate::{
    axis::{Axis, between},
    channel::Channel,
    convention,
    extent::{Extent, Extents},
    failure::Failure,
    instant::Instant,
    messages::{Decoder, Kept, Message, Recording},
    pass::{Moment, Pass},
    path::Path,
    recording::{Budget, Damage, Limits},
    select::{Bound, Window},
    wire::DecodeError,
};

use percuss_picture::{Colours, Image};
pub use percuss_picture::{Layer, Side};

/// An array over its axis at one time.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Path and unit of the field.
    pub field: Heading,
    /// Name and unit of the coordinate, `index` if the array has no axis.
    pub axis: Heading,
    /// Time of the message.
    pub time: f64,
    /// Positions and values.
    pub points: Vec<(f64, f64)>,
}

/// A matrix at one time.
#[derive(Clone, Debug, Default)]
pub struct Slice {
    /// Path of the field.
    pub name: String,
    /// Topic it is from.
    pub topic: String,
    /// Unit of the field.
    pub unit: Option<String>,
    /// Time of the message.
    pub time: f64,
    /// Rows, from the first value on.
    pub rows: Side,
    /// Columns.
    pub columns: Side,
    /// Names and units of the coordinates of rows and columns.
    pub axes: [Heading; 2],
    /// True if the columns are even about their origin.
    pub even: bool,
    /// Row-major.
    pub values: Vec<f64>,
    /// Layers of the target, where its rows are depths: none until they are asked for.
    pub layers: Vec<Layer>,
}

impl Slice {
    /// Name and unit of the field; `values` say no more than their topic does.
    pub fn heading(&self) -> Heading {
        Heading::new(shown_name(&self.topic, &self.name), self.unit.as_deref())
    }

    /// Topic and time in one line.
    pub fn title(&self) -> String {
        format!("{} at time {}", self.topic, self.time)
    }

    /// The matrix as a picture shows it.
    pub fn image(&self) -> Image {
        let [rows, columns] = &self.axes;
        Image {
            title: self.title(),
            value_label: self.heading().with_unit(),
            row_label: rows.with_unit(),
            column_label: columns.with_unit(),
            rows: self.rows.clone(),
            columns: self.columns.clone(),
            values: self.values.clone(),
            is_equal: rows.unit == columns.unit,
            colours: Colours::Diverging,
            layers: self.layers.clone(),
            ..Image::default()
        }
    }
}

/// The times of the messages of a channel at both ends: the first two, and the last two as negative numbers.
#[derive(Default)]
struct Span([[Option<f64>; 2]; 2]);

impl Span {
    fn add(&mut self, time: f64) {
        let finite = [time, -time].into_iter().filter(|time| time.is_finite());
        for ([first, second], time) in self.0.iter_mut().zip(finite) {
            match *first {
                Some(known) if time > known => *second = Some(second.map_or(time, |t| t.min(time))),
                Some(known) if time == known => {}
                known => (*first, *second) = (Some(time), known.or(*second)),
            }
        }
    }

    /// The first and last time if `time` lies outside: no message would be there, even if they went on.
    fn excludes(&self, time: f64) -> Option<(f64, f64)> {
        let [[first, second], late] = self.0;
        let [last, before] = late.map(|time| time.map(|time| -time));
        let (first, last) = (first?, last?);
        // what is typed is rarely the last digit of what is recorded
        let room = 1e-9 * first.abs().max(last.abs());
        let early = room + second.map_or(0.0, |second| second - first);
        let late = room + before.map_or(0.0, |before| last - before);
        (time < first - early || time > last + late).then_some((first, last))
    }
}

/// Messages with their times.
type Timed = Vec<(f64, Kept)>;

/// The messages of a channel nearest to some times; the last one if no times are given. Of two that are equally near,
/// the earlier. Times up to one message interval outside are accepted; none are given if the channel has no messages.
struct Nearest<'a> {
    recording: &'a Recording,
    channel: &'a Channel,
    /// As messages have them.
    times: Vec<Bound>,
    /// Log time that passes in a unit of the time of steps \[s\]; 1 where messages say their time.
    rate: f64,
    nearest: Vec<Option<(Instant, Kept)>>,
    span: Span,
}

impl<'a> Nearest<'a> {
    fn new(recording: &'a Recording, id: u16, times: &[Bound]) -> Result<Self, Failure> {
        let channel = &recording.channels[&id];
        let clock = recording.step_clock(channel);
        let time = |time: &Bound| match clock {
            Some(clock) => time.of_step(&channel.topic, clock),
            None => time.check(channel).map(|()| *time),
        };
        let times = times.iter().map(time).collect::<Result<Vec<_>, _>>()?;
        let nearest = vec![None; times.len().max(1)];
        let rate = clock.map_or(1.0, |(rate, _)| rate);
        Ok(Self { recording, channel, times, rate, nearest, span: Span::default() })
    }

    fn take(&mut self, message: Message<'_>, time: Instant, budget: &mut Budget) -> Result<(), Failure> {
        self.span.add(time.number());
        for (i, slot) in self.nearest.iter_mut().enumerate() {
            let is_nearer = match (slot.as_ref(), self.times.get(i)) {
                (Some((known, ..)), Some(at)) => at.is_nearer(time, *known),
                (Some((known, ..)), None) => time >= *known,
                (None, _) => true,
            };
            if is_nearer {
                budget.give_back(slot.take().map_or(0, |(_, kept)| kept.data.len()));
                if !budget.spend(message.data.len()) {
                    return Err(self.recording.no_room(AT_TIMES));
                }
                *slot = Some((time, Kept::from(&message)));
            }
        }
        Ok(())
    }

    /// The messages as they stand in the file, with their times, once all have been looked at. A time outside of them is refused.
    fn kept(self) -> Result<Timed, Failure> {
        let Self { recording, channel, times, rate, nearest, span } = self;
        let mut times = times.iter().map(|time| time.number());
        if let Some((time, (first, last))) = times.find_map(|time| Some((time, span.excludes(time)?))) {
            let (file, topic) = (recording.path.display(), &channel.topic);
            let [time, first, last] = [time, first, last].map(|time| time / rate);
            return Err(Failure::Usage(format!(
                "time {time} lies outside the recording: `{topic}` of `{file}` has messages from time {first} to {last}"
            )));
        }
        Ok(nearest.into_iter().flatten().map(|(instant, kept)| (instant.number() / rate, kept)).collect())
    }
}

/// The messages of some channels nearest to some times, and what of the file is damaged.
fn nearest_of(
    recording: &Recording,
    ids: &[u16],
    times: &[Bound],
    extents: &mut Extents,
) -> Result<(Timed, Vec<Damage>), Failure> {
    let nearest = ids.iter().map(|&id| Ok((id, Nearest::new(recording, id, times)?)));
    let mut nearest = nearest.collect::<Result<BTreeMap<_, _>, Failure>>()?;
    let mut pass = Pass::over(recording, Window::default());
    for (&id, nearest) in &mut nearest {
        pass.bytes(id, |message, time, budget| nearest.take(message, time, budget));
    }
    extents.watch(&mut pass);
    let damages = pass.run()?.damages;
    let kept = nearest.into_values().map(Nearest::kept).collect::<Result<Vec<_>, _>>()?;
    Ok((kept.into_iter().flatten().collect(), damages))
}

/// What takes the memory of messages at some times.
const AT_TIMES: &str = "the messages at these times";

/// The messages of a channel nearest to some times, and how far its arrays reach in all messages if that is wanted.
///
/// # Errors
///
/// The file cannot be read, a time has another unit than the messages or lies outside of them, or the nearest does not fit its
/// schema or takes too much memory.
pub fn moments(
    recording: &Recording,
    id: u16,
    times: &[Bound],
    wants_extents: bool,
) -> Result<(Vec<Moment>, Extents, Vec<Damage>), Failure> {
    let ids = [id];
    let mut extents = Extents::of(recording, if wants_extents { &ids } else { &[] });
    let (kept, damages) = nearest_of(recording, &ids, times, &mut extents)?;
    let (channel, mut budget) = (&recording.channels[&id], Budget::new(recording.limits().values()));
    let mut moments = Vec::new();
    let Some(mut decoder) = Decoder::of(channel) else { return Ok((moments, extents, damages)) };
    for (time, Kept { log_time, data, .. }) in kept {
        match decoder.take(&data) {
            Ok(values) if budget.spend(values.weight()) => {
                moments.push(Moment { time, log_time, number: 0, values });
            }
            Ok(_) | Err(DecodeError::Memory) => return Err(recording.no_room(AT_TIMES)),
            Err(DecodeError::SchemaMismatch) => {
                let topic = &channel.topic;
                let text = format!("the message of `{topic}` at time {time} does not fit its schema");
                return Err(Failure::Failed(text));
            }
        }
    }
    Ok((moments, extents, damages))
}

/// The messages of some channels nearest to some times, as they stand in the file, by channel and in the order of their log times.
pub(crate) fn kept_at(
    recording: &Recording,
    ids: &[u16],
    times: &[Bound],
) -> Result<(Vec<Kept>, Vec<Damage>), Failure> {
    let (kept, damages) = nearest_of(recording, ids, times, &mut Extents::of(recording, &[]))?;
    let mut kept: Vec<Kept> = kept.into_iter().map(|(_, kept)| kept).collect();
    let place = |kept: &Kept| (kept.log_time, kept.channel, kept.sequence);
    kept.sort_by_key(place);
    kept.dedup_by_key(|kept| place(kept));
    Ok((kept, damages))
}

/// Name and unit of a coordinate: the unit of the field that holds the first position is that of all.
pub(crate) fn coordinate(channel: &Channel, name: &str) -> Heading {
    Heading::new(name, channel.unit(&format!("{name}0")).or_else(|| channel.unit(name)))
}

/// What a field is called where it is drawn: `values` says no more than the topic does.
pub(crate) fn shown_name<'a>(topic: &'a str, path: &'a str) -> &'a str {
    topic.rsplit('/').next().filter(|_| path == "values").unwrap_or(path)
}

/// Elements that are drawn of an array inside lists.
const MAX_POINTS: usize = 1 << 20;

/// An array of a message over its axis; `None` for matrices and what is no array of numbers. An element that holds no
/// value keeps its place.
pub fn profile(channel: &Channel, leaf: usize, moment: &Moment) -> Option<Profile> {
    let layout = channel.layout.as_ref()?;
    let field = &layout.leaves[leaf];
    let axis = Axis::of(leaf, layout, channel);
    if field.lists == 0 || !field.kind.is_number() || axis.is_matrix() {
        return None;
    }
    let list = &moment.values.lists[leaf];
    let path = Path::of(layout, leaf);
    let side = axis.side(&moment.values, path.length(&moment.values));
    let position = |i: usize| match &side {
        Some(side) if i < side.length() => side.at(i),
        _ => i as f64,
    };
    let points = if field.lists == 1 {
        let point = |i: usize| Some((position(i), list.number(path.rank(&moment.values, i)?)?));
        (0..path.length(&moment.values)).filter_map(point).collect()
    } else {
        let mut places = BTreeSet::new();
        path.places(&moment.values, MAX_POINTS, &mut places);
        let value = |place| list.number(path.at(place).rank(&moment.values, 0)?);
        let places = places.into_iter().enumerate();
        places.filter_map(|(i, place)| Some((position(i), value(place)?))).collect()
    };
    let (field, axis) =
        (Heading::new(&field.path, channel.unit(&field.path)), coordinate(channel, axis.coordinate()));
    Some(Profile { field, axis, time: moment.time, points })
}

/// A matrix of a message; `None` if the field is none, or the message has not as many elements as rows and columns say, or rows or
/// columns at places that are not sound.
pub fn slice(channel: &Channel, leaf: usize, moment: &Moment) -> Option<Slice> {
    let layout = channel.layout.as_ref()?;
    let axis = Axis::of(leaf, layout, channel);
    let [rows, columns] = <[Side; 2]>::try_from(axis.sides(&moment.values, 0)).ok()?;
    let axes = <[&str; 2]>::try_from(axis.coordinates()).ok()?;
    let mut values = Vec::new();
    let is_whole = moment.values.lists[leaf].numbers(&mut values)
        && rows.length().checked_mul(columns.length()) == Some(values.len());
    let name = layout.leaves[leaf].path.clone();
    is_whole.then(|| Slice {
        unit: channel.unit(&name).map(str::to_owned),
        topic: channel.topic.clone(),
        time: moment.time,
        rows,
        columns,
        axes: axes.map(|name| coordinate(channel, name)),
        even: convention::is_even(&channel.metadata, &name),
        name,
        values,
        layers: Vec::new(),
    })
}

/// Why [`slice()`] finds no matrix in a message.
pub(crate) fn mismatch(channel: &Channel, leaf: usize, moment: &Moment) -> String {
    let axis = channel.layout.as_ref().map(|layout| Axis::of(leaf, layout, channel));
    let flaw = axis.and_then(|axis| axis.flaw(leaf, &moment.values));
    let flaw = flaw.unwrap_or_else(|| "has not as many elements as its rows and columns say".into());
    format!("`{}` at time {} {flaw}", channel.topic, moment.time)
}

impl Slice {
    /// The matrix with the rows and columns that other messages of its channel have and this one leaves out: zeros, what
    /// is at rest. `None` if it would be larger than a record may be.
    pub fn whole(self, extent: &Extent, limits: Limits) -> Option<Self> {
        let [down, across] = extent.reaches.as_slice() else { return Some(self) };
        let known = (self.rows.length(), self.columns.length());
        let (rows, columns) = (down.whole(&self.rows), across.whole(&self.columns));
        let (height, width) = (rows.length(), columns.length());
        if (height, width) == known {
            return Some(self);
        }
        let size = height.checked_mul(width).filter(|size| *size <= limits.record() / size_of::<f64>())?;
        let mut values = vec![0.0; size];
        if known.1 > 0 {
            for (row, known) in values.chunks_exact_mut(width).zip(self.values.chunks_exact(known.1)) {
                row[..known.len()].copy_from_slice(known);
            }
        }
        Some(Self { rows, columns, values, ..self })
    }

    /// The matrix at a position of one of its coordinates, over the other; `None` for other coordinates and outside. At an interface it is
    /// the upper side; over depths the values of both sides of an interface follow each other at one position.
    pub fn line(&self, coordinate: &str, position: f64) -> Option<Profile> {
        let along = self.axes.iter().position(|axis| axis.name == coordinate)?;
        let width = self.columns.length();
        let (across, over, even) = match along {
            0 => (&self.rows, &self.columns, false),
            _ => (&self.columns, &self.rows, self.even),
        };
        let point = |i: usize| {
            let value = |k: usize| {
                let (row, column) = if along == 0 { (k, i) } else { (i, k) };
                self.values.get(row * width + column).copied()
            };
            Some((over.at(i), between(across, even, (position, false), value)?))
        };
        let points: Vec<(f64, f64)> = (0..over.length()).filter_map(point).collect();
        (!points.is_empty()).then(|| Profile {
            field: Heading::new(&format!("{}@{coordinate}={position}", self.name), self.unit.as_deref()),
            axis: self.axes[1 - along].clone(),
            time: self.time,
            points,
        })
    }
}
