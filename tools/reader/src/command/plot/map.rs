//! An array over its axis and over time, as an image.

use std::path::PathBuf;

use percuss_picture::{Colours, Image, Medium, Side, draw_image};
use percuss_table::Heading;

use super::{
    Drawn, Request,
    axes::{cut, labelled},
    frames::too_large,
};
use crate::{
    axis::Axis,
    channel::Channel,
    command::view::nearest_point,
    convention,
    extent::{Extent, Extents, Reach},
    failure::Failure,
    field::{Positions, SelectionError},
    messages::Recording,
    pass::{Moment, Pass, Seen},
    recording::{Budget, Limits},
    select::Window,
    slice::{coordinate, mismatch, profile, shown_name, slice},
    verb::Losses,
    wire::Layout,
};

/// Places and times of a map at most.
const MAX_CELLS: (usize, usize) = (220, 320);

/// An array over place and time.
///
/// Nearest-neighbour in both, none is averaged; missing elements are 0.
pub(super) fn over_time(
    paths: &[PathBuf],
    request: &Request,
    limits: Limits,
    medium: Medium,
) -> Result<Drawn, Failure> {
    let [path] = paths else {
        return Err(Failure::Usage("--map draws one recording; give one file".into()));
    };
    if request.log != (false, false) || request.x_range.is_some() {
        let text = "--log and --x-range are for curves; --from and --to choose the times of a map";
        return Err(Failure::Usage(text.into()));
    }
    let (recording, ids) = request.open_arrays(path, limits)?;
    let [id] = ids[..] else {
        return Err(Failure::Usage("--map draws one topic; choose it with --topic".into()));
    };
    let (extents, known) = read(&recording, id, request.window)?;
    let array = Array::choose(&recording, id, &extents, request)?;
    let times = array.times(known)?;
    let room = array.places.length().saturating_mul(times.len()).saturating_mul(size_of::<f64>());
    if !Budget::new(limits.kept()).spend(room) {
        return Err(too_large());
    }
    let (columns, seen) = array.take(&times)?;
    let (image, range) = array.image(&times, columns, request)?;
    let picture = draw_image(&image, range, medium).map_err(Failure::drawing)?;
    Ok(Drawn { picture, losses: Losses::of(path, seen), ..Drawn::default() })
}

/// How far the arrays of a channel reach, and the times of its messages in a window with their numbers.
fn read(recording: &Recording, id: u16, window: Window) -> Result<(Extents, Vec<(f64, u64)>), Failure> {
    window.check(&recording.channels[&id])?;
    let (mut known, mut number) = (Vec::new(), 0);
    let mut extents = Extents::of(recording, &[id]);
    let mut pass = Pass::over(recording, Window::default());
    extents.watch(&mut pass);
    pass.bytes(id, |_, instant, budget| {
        let time = instant.number();
        if window.holds(instant) && time.is_finite() {
            // a list grows to twice its length
            if !budget.spend(2 * size_of::<(f64, u64)>()) {
                return Err(recording.no_room("the times of the messages"));
            }
            known.push((time, number));
        }
        number += 1;
        Ok(())
    });
    pass.run()?;
    Ok((extents, known))
}

/// The values of an array at its places at one time, if there is a message.
type Column = Option<Vec<f64>>;

struct Array<'a> {
    recording: &'a Recording,
    id: u16,
    leaf: usize,
    axis: Axis,
    extent: Extent,
    /// The line through a matrix: its coordinate and the position on that.
    line: Option<(String, f64)>,
    coordinate: String,
    /// Where it is drawn.
    places: Side,
}

impl<'a> Array<'a> {
    fn choose(
        recording: &'a Recording,
        id: u16,
        extents: &Extents,
        request: &Request,
    ) -> Result<Self, Failure> {
        let channel = &recording.channels[&id];
        let layout = channel.layout.as_deref().ok_or_else(|| SelectionError::not_decoded(channel))?;
        let leaf = leaf(channel, layout, &request.selection.fields)?;
        let axis = Axis::of(leaf, layout, channel);
        let extent = extents.get(id, leaf);
        let name = &layout.leaves[leaf].path;
        let (line, along, coordinate) = match request.selection.at.as_slice() {
            at if axis.is_matrix() => {
                let coordinates = axis.coordinates();
                let (line, across) = line(name, &coordinates, at)?;
                at.iter().try_for_each(|at| at.check_units(channel))?;
                if let Some(reach) = extent.reaches.get(across) {
                    SelectionError::check(reach, &channel.topic, name, &line.0, &[line.1])?;
                }
                (Some(line), 1 - across, coordinates[1 - across].to_owned())
            }
            [] => (None, 0, axis.coordinate().to_owned()),
            [at, ..] => {
                let text =
                    format!("`{name}` is drawn over its whole axis; leave out --at {at}, or leave out --map");
                return Err(Failure::Usage(text));
            }
        };
        let reach = match &axis {
            Axis::Listed(positions) => Reach::of(Side::Listed(positions.clone())),
            _ => extent.reaches.get(along).cloned(),
        };
        let places = reach.and_then(|reach| match (&axis, &reach.side) {
            // radii in any order, and few
            (Axis::Listed(_), _) | (_, Side::Even { .. }) => evenly(&reach),
            (_, Side::Listed(positions)) => Some(downsampled(positions)),
        });
        let places = places.ok_or_else(|| {
            Failure::nothing(format!("`{name}` of `{}` has no places along its axis", channel.topic))
        })?;
        Ok(Self { recording, id, leaf, axis, extent, line, coordinate, places })
    }

    /// What its places are called: those of a line in a target by the coordinate along it.
    fn label(&self) -> &str {
        self.channel().along(&self.coordinate)
    }

    /// True if its places are depths: they go down, as in a section.
    fn goes_down(&self) -> bool {
        let is_row = self.axis.is_matrix() && self.axis.coordinates()[0] == self.coordinate;
        is_row
            || (self.channel().metadata.contains_key(convention::LINE) && self.label() == convention::DEPTH)
    }

    fn channel(&self) -> &'a Channel {
        &self.recording.channels[&self.id]
    }

    /// Numbers of the messages nearest to times evenly between the first and the last, and those times.
    ///
    /// * `known`: times of the messages and their numbers
    fn times(&self, mut known: Vec<(f64, u64)>) -> Result<Vec<(u64, f64)>, Failure> {
        let channel = self.channel();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (Some(first), Some(last)) = (known.first(), known.last()) else {
            let text = format!("`{}` has no messages in this time", channel.topic);
            return Err(Failure::nothing(text));
        };
        let count = known.len().min(MAX_CELLS.1);
        let step = (last.0 - first.0) / (count.max(2) - 1) as f64;
        if step <= 0.0 {
            let text = format!("`{}` has messages at one time only; draw them with --at-time", channel.topic);
            return Err(Failure::Usage(text));
        }
        let nearest = |i: usize| {
            let time = first.0 + i as f64 * step;
            nearest_point(&known, (time, false)).map(|(_, number)| (number, time))
        };
        Ok((0..count).filter_map(nearest).collect())
    }

    /// The columns of a map, one for every time: messages by their numbers.
    fn take(&self, times: &[(u64, f64)]) -> Result<(Vec<Column>, Seen), Failure> {
        let mut columns = vec![None; times.len()];
        let mut pass = Pass::over(self.recording, Window::default());
        let numbers = times.iter().map(|(number, _)| *number).collect();
        pass.numbers(self.id, numbers, |moment, _| -> Result<(), Failure> {
            let column = self.column(moment)?;
            let wanted = times.iter().zip(&mut columns).filter(|((number, _), _)| *number == moment.number);
            wanted.for_each(|(_, place)| *place = Some(column.clone()));
            Ok(())
        });
        let seen = pass.run()?;
        Ok((columns, seen))
    }

    fn column(&self, moment: &Moment) -> Result<Vec<f64>, Failure> {
        let channel = self.channel();
        let mismatch = || Failure::Usage(mismatch(channel, self.leaf, moment));
        if self.axis.flaw(self.leaf, &moment.values).is_some() {
            return Err(mismatch());
        }
        let points = match &self.line {
            None => profile(channel, self.leaf, moment).map(|profile| profile.points),
            Some((name, position)) => {
                let slice = slice(channel, self.leaf, moment).ok_or_else(mismatch)?;
                let whole = slice.whole(&self.extent, self.recording.limits()).ok_or_else(too_large)?;
                whole.line(name, *position).map(|line| line.points)
            }
        };
        let points = points.unwrap_or_default();
        let step = match (points.as_slice(), &self.places) {
            // of listed positions the outermost hold up to the ends
            (_, Side::Listed(_)) => f64::INFINITY,
            _ if matches!(self.axis, Axis::Listed(_)) => f64::INFINITY,
            ([first, second, ..], _) => second.0 - first.0,
            (_, Side::Even { step, .. }) => *step,
        };
        let value = |i: usize| {
            let place = (self.places.at(i), self.places.is_below_interface(i));
            nearest(&points, place, 0.5 * step * (1.0 + 1e-9))
        };
        Ok((0..self.places.length()).map(value).collect())
    }

    fn image(
        &self,
        times: &[(u64, f64)],
        columns: Vec<Column>,
        request: &Request,
    ) -> Result<(Image, Option<(f64, f64)>), Failure> {
        let (channel, count) = (self.channel(), times.len());
        let start = times.first().map_or(0.0, |(_, time)| *time);
        let step = times.last().map_or(1.0, |(_, last)| (last - start) / (count.max(2) - 1) as f64);
        let mut values = vec![f64::NAN; self.places.length() * count];
        for (i, column) in columns.into_iter().enumerate() {
            for (j, value) in column.into_iter().flatten().enumerate() {
                values[j * count + i] = value;
            }
        }
        let path = channel.layout.as_deref().map_or("", |layout| &layout.leaves[self.leaf].path);
        let place =
            self.line.as_ref().map_or(String::new(), |(name, position)| format!(" at {name}={position}"));
        let quantities = [
            Heading { name: self.label().into(), ..coordinate(channel, &self.coordinate) },
            Heading::new(channel.time_name(), channel.time_unit()),
            Heading::new(shown_name(&channel.topic, path), channel.unit(path)),
        ];
        let image = Image {
            title: request.title.clone().unwrap_or_else(|| format!("{}{place}", channel.topic)),
            rows: self.places.clone(),
            columns: Side::Even { start, step, length: count },
            values,
            // as in a section, its rows go down
            upward: !self.goes_down(),
            colours: Colours::Diverging,
            layers: self.recording.layers(self.label()),
            ..Image::default()
        };
        Ok(labelled(cut(image, None, request.y_range)?, &quantities, request))
    }
}

/// The array of a channel that is drawn: the one that is named, or the first with an axis.
fn leaf(channel: &Channel, layout: &Layout, fields: &[String]) -> Result<usize, Failure> {
    let has_axis = |leaf: &usize| {
        let field = &layout.leaves[*leaf];
        field.is_data() && field.kind.is_number() && Axis::of(*leaf, layout, channel) != Axis::Unknown
    };
    let topic = &channel.topic;
    match fields {
        [] => (0..layout.leaves.len()).find(has_axis).ok_or_else(|| {
            Failure::nothing(format!(
                "`{topic}` has no array with an axis; choose another topic with --topic"
            ))
        }),
        [name] => {
            let leaf = layout.find(name).filter(|&leaf| layout.leaves[leaf].is_data());
            let leaf = leaf.ok_or_else(|| SelectionError::unknown_field(channel, name))?;
            Some(leaf).filter(has_axis).ok_or_else(|| {
                Failure::Usage(format!(
                    "`{name}` of `{topic}` is no array with an axis; draw it without --map"
                ))
            })
        }
        _ => Err(Failure::Usage("--map draws one array; name one with --field".into())),
    }
}

/// The one line through a matrix that is drawn, and the number of the coordinate that it fixes.
fn line(name: &str, coordinates: &[&str], at: &[Positions]) -> Result<((String, f64), usize), Failure> {
    if let [Positions { coordinates: chosen, .. }] = at
        && let [(coordinate, positions)] = chosen.as_slice()
        && let ([position], Some(across)) =
            (positions.as_slice(), coordinates.iter().position(|known| known == coordinate))
    {
        return Ok(((coordinate.clone(), *position), across));
    }
    Err(Failure::Usage(format!(
        "`{name}` is a matrix; choose one line of it, as in --at {}=0 or --at {}=0.5",
        coordinates[1], coordinates[0]
    )))
}

/// The places where an array is drawn: all of its elements, or fewer evenly over its reach.
fn evenly(reach: &Reach) -> Option<Side> {
    let length = reach.side.length().min(MAX_CELLS.0);
    let step = (reach.high - reach.low) / length as f64;
    let is_sound = length > 0 && step > 0.0 && step.is_finite();
    is_sound.then_some(Side::Even { start: reach.low + 0.5 * step, step, length })
}

/// The places where an array at listed positions is drawn: all, or, of too many, some of every layer and both sides of every interface.
fn downsampled(positions: &[f64]) -> Side {
    let every = positions.len().div_ceil(MAX_CELLS.0);
    let layers = positions.chunk_by(|a, b| a != b);
    let some = |layer: &[f64]| -> Vec<f64> {
        let kept = |i: &usize| i.is_multiple_of(every) || i + 1 == layer.len();
        (0..layer.len()).filter(kept).map(|i| layer[i]).collect()
    };
    layers.flat_map(some).collect()
}

/// The value of the point nearest to a place; 0 if none is within reach.
fn nearest(points: &[(f64, f64)], place: (f64, bool), reach: f64) -> f64 {
    let found = nearest_point(points, place).filter(|point| (point.0 - place.0).abs() <= reach);
    found.map_or(0.0, |point| point.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_those_of_the_elements_unless_there_are_too_many() {
        let side = |length| Side::Even { start: 0.05, step: 0.1, length };
        let reach = |length: usize| Reach { low: 0.0, high: 0.1 * length as f64, side: side(length) };
        let all = evenly(&reach(10)).expect("places");
        assert!((all.at(9) - side(10).at(9)).abs() < 1e-12 && all.length() == 10);
        let some = evenly(&reach(1000)).expect("places");
        assert_eq!(some.length(), MAX_CELLS.0);
        assert!((some.at(MAX_CELLS.0) - 50.0 / 220.0 - 100.0).abs() < 1e-9);
        assert_eq!(evenly(&reach(0)), None);
    }

    #[test]
    fn downsampled_positions_keep_interfaces() {
        let layer = |from: f64, rows: u32| (0..=rows).map(move |i| from + f64::from(i) * 0.01);
        let positions: Vec<f64> = layer(0.0, 500).chain(layer(5.0, 3)).chain(layer(5.03, 600)).collect();
        let places = downsampled(&positions);
        assert!((180..=226).contains(&places.length()), "{}", places.length());
        assert_eq!((places.at(0), places.at(places.length() - 1)), (0.0, positions[positions.len() - 1]));
        let doubled = (0..places.length()).filter(|&i| places.is_below_interface(i));
        assert_eq!(doubled.map(|i| places.at(i)).collect::<Vec<_>>(), [5.0, 5.03]);
        assert_eq!(downsampled(&positions[..100]).length(), 100);
    }

    #[test]
    fn the_nearest_point_counts_and_none_is_zero() {
        let points = [(0.5, 1.0), (1.5, 2.0), (2.5, 3.0)];
        for (place, value) in [(0.0, 1.0), (0.9, 1.0), (1.1, 2.0), (3.0, 3.0), (3.1, 0.0), (-0.1, 0.0)] {
            assert_eq!(nearest(&points, (place, false), 0.5), value, "{place}");
        }
        assert_eq!(nearest(&[], (1.0, false), 0.5), 0.0);
        let interface = [(0.0, 1.0), (1.0, 2.0), (1.0, 3.0), (1.5, 4.0)];
        let at = |is_lower| nearest(&interface, (1.0, is_lower), 0.5);
        assert_eq!((at(false), at(true)), (2.0, 3.0));
    }
}
