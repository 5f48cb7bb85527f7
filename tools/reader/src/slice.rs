//! What a recording holds at one time: arrays over their axis, matrices over their two.

use crate::{
    axis::Axis,
    messages::Recording,
    overview::Channel,
    recording::{Damage, Next, OpenError},
    table::Heading,
    wire::Values,
};

use percuss_picture::Image;
pub use percuss_picture::Side;

/// An array over its axis at one time.
#[derive(Clone, Debug)]
pub struct Profile {
    /// Path of the field.
    pub name: String,
    /// Unit of the field.
    pub unit: Option<String>,
    /// Name of the coordinate, `index` if the array has no axis.
    pub coordinate: String,
    /// Unit of the coordinate.
    pub coordinate_unit: Option<String>,
    /// Time of the message.
    pub time: f64,
    /// Positions and values.
    pub points: Vec<(f64, f64)>,
}

/// A matrix at one time.
#[derive(Clone, Debug)]
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
    /// Names of the coordinates of rows and columns.
    pub coordinates: [String; 2],
    /// Unit of the coordinates of rows and columns.
    pub units: [Option<String>; 2],
    /// Row-major.
    pub values: Vec<f64>,
}

impl Profile {
    /// Name and unit of the field.
    pub fn heading(&self) -> Heading {
        Heading { name: self.name.clone(), unit: self.unit.clone(), ..Heading::default() }
    }

    /// Name and unit of the coordinate.
    pub fn axis_heading(&self) -> Heading {
        Heading { name: self.coordinate.clone(), unit: self.coordinate_unit.clone(), ..Heading::default() }
    }
}

impl Slice {
    /// Topic, unit and time in one line.
    pub fn title(&self) -> String {
        let unit = self.unit.as_ref().map_or(String::new(), |unit| format!(" [{unit}]"));
        format!("{}{unit} at time {}", self.topic, self.time)
    }

    /// The matrix as a picture shows it.
    pub fn image(&self) -> Image {
        let label = |i: usize| match &self.units[i] {
            Some(unit) => format!("{} [{unit}]", self.coordinates[i]),
            None => self.coordinates[i].clone(),
        };
        Image {
            title: self.title(),
            row_label: label(0),
            column_label: label(1),
            rows: self.rows,
            columns: self.columns,
            values: self.values.clone(),
        }
    }
}

/// A message that was taken apart.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Time, of the field `time` or the log time in seconds.
    pub time: f64,
    /// The message.
    pub values: Values,
}

/// The messages of a channel nearest to some times; the last one if no times are given. Of two that are equally near,
/// the earlier.
///
/// # Errors
///
/// The file cannot be read.
pub fn moments(
    recording: &Recording,
    id: u16,
    times: &[f64],
) -> Result<(Vec<Moment>, Vec<Damage>), OpenError> {
    let channel = &recording.channels[&id];
    let Some(layout) = &channel.layout else { return Ok((Vec::new(), Vec::new())) };
    let mut messages = recording.messages([id], None)?;
    let wanted = if times.is_empty() { &[f64::INFINITY][..] } else { times };
    let mut nearest: Vec<Option<(f64, Vec<u8>)>> = vec![None; wanted.len()];
    loop {
        let next = messages.next(|message| {
            let time = channel.time_of(message.data, message.log_time);
            for (slot, &at) in nearest.iter_mut().zip(wanted) {
                let is_nearer = match slot {
                    Some((known, _)) if at.is_infinite() => time >= *known,
                    Some((known, _)) => (time - at).abs() < (*known - at).abs(),
                    None => true,
                };
                if is_nearer {
                    *slot = Some((time, message.data.to_vec()));
                }
            }
        })?;
        if !matches!(next, Next::Record(())) {
            break;
        }
    }
    let decode = |(time, bytes): (f64, Vec<u8>)| {
        let mut values = layout.values();
        layout.decode(&bytes, &mut values).ok().map(|()| Moment { time, values })
    };
    let moments = nearest.into_iter().flatten().filter_map(decode).collect();
    Ok((moments, messages.damages().to_vec()))
}

/// Hands every n-th message of a channel to `take`, decoded.
///
/// # Errors
///
/// The file cannot be read.
pub fn visit(
    recording: &Recording,
    id: u16,
    every: u64,
    mut take: impl FnMut(Moment),
) -> Result<Vec<Damage>, OpenError> {
    let channel = &recording.channels[&id];
    let Some(layout) = &channel.layout else { return Ok(Vec::new()) };
    let mut messages = recording.messages([id], None)?;
    let mut count = 0_u64;
    loop {
        let next = messages.next(|message| {
            count += 1;
            let mut values = layout.values();
            if (count - 1).is_multiple_of(every) && layout.decode(message.data, &mut values).is_ok() {
                take(Moment { time: channel.time_of(message.data, message.log_time), values });
            }
        })?;
        if !matches!(next, Next::Record(())) {
            return Ok(messages.damages().to_vec());
        }
    }
}

fn unit_of_coordinate(channel: &Channel, axis: &str) -> Option<String> {
    // the unit of the field that holds the first position is that of all
    channel.unit(&format!("{axis}0")).or_else(|| channel.unit(axis)).map(str::to_owned)
}

/// An array of a message over its axis; `None` for matrices and what is no array of numbers.
pub fn profile(channel: &Channel, leaf: usize, moment: &Moment) -> Option<Profile> {
    let layout = channel.layout.as_ref()?;
    let field = &layout.leaves[leaf];
    let axis = Axis::of(leaf, layout, channel);
    if field.lists == 0 || !field.kind.is_number() || matches!(axis, Axis::Matrix { .. }) {
        return None;
    }
    let place = axis.place(&moment.values);
    let list = &moment.values.lists[leaf];
    let point = |i: usize| Some((place.position(i).unwrap_or(i as f64), list.number(i)?));
    let coordinate = axis.coordinate().to_owned();
    Some(Profile {
        name: field.path.clone(),
        unit: channel.unit(&field.path).map(str::to_owned),
        coordinate_unit: unit_of_coordinate(channel, &coordinate),
        coordinate,
        time: moment.time,
        points: (0..list.len()).filter_map(point).collect(),
    })
}

/// A matrix of a message; `None` if the field is none.
pub fn slice(channel: &Channel, leaf: usize, moment: &Moment) -> Option<Slice> {
    let layout = channel.layout.as_ref()?;
    let axis = Axis::of(leaf, layout, channel);
    let grid = axis.grid(&moment.values)?;
    let Axis::Matrix { coordinates, .. } = axis else { return None };
    let mut values = Vec::new();
    let is_whole = moment.values.lists[leaf].numbers(&mut values)
        && grid.rows.length.checked_mul(grid.columns.length) == Some(values.len());
    let name = layout.leaves[leaf].path.clone();
    is_whole.then(|| Slice {
        unit: channel.unit(&name).map(str::to_owned),
        topic: channel.topic.clone(),
        name,
        time: moment.time,
        rows: grid.rows,
        columns: grid.columns,
        units: [0, 1].map(|i: usize| unit_of_coordinate(channel, &coordinates[i])),
        coordinates,
        values,
    })
}

/// The row of a matrix at a position of its first coordinate, interpolated between rows; `None` outside.
pub fn row(slice: &Slice, position: f64) -> Option<Profile> {
    let x = (position - slice.rows.start) / slice.rows.step;
    let last = slice.rows.length.checked_sub(1)? as f64;
    // half a row beyond the first and last their values hold
    if !(-0.5..=last + 0.5).contains(&x) {
        return None;
    }
    let x = x.clamp(0.0, last);
    let j = (x as usize).min(slice.rows.length.saturating_sub(2));
    let (share, width) = (x - j as f64, slice.columns.length);
    let value = |j: usize, i: usize| slice.values.get(j * width + i).copied();
    let point = |i: usize| {
        let near = value(j, i)?;
        let far = value(j + 1, i).unwrap_or(near);
        Some((slice.columns.at(i), near + (far - near) * share))
    };
    Some(Profile {
        name: format!("{}@{}={position}", slice.name, slice.coordinates[0]),
        unit: slice.unit.clone(),
        coordinate: slice.coordinates[1].clone(),
        coordinate_unit: slice.units[1].clone(),
        time: slice.time,
        points: (0..width).filter_map(point).collect(),
    })
}
