//! `animate`: the section, the profile of the interface stress and the drag of a recording, moving side by side on fixed scales.
//!
//! The scales come from a first reading of the whole recording: the colours are those of the viewers, if it has them, the section is
//! the part of it in which anything is seen in any frame.

use std::{ops::Range, path::Path};

use clap::Args;
use percuss_output::number::whole;
use percuss_picture::{Colours, Diagram, Film, Image, Moment as Shown, Raster, Section, Side, Stage};
use percuss_table::Heading;

use crate::{
    axis::Axis,
    command::{
        plot::axes::prefixed,
        report::{
            animation::Bounds,
            body::{Body, body},
            curves::downsampled,
            find, main_field,
        },
    },
    convention::{self, DRAG, INTERFACE},
    messages::Recording,
    prefix::{UnitError, short},
    recording::{Damage, Limits, OpenError},
    select::{self, Bound, Pattern, Window},
    slice::{Slice, nearest, profile, shown_name, slice, visit},
    units::Units,
};

/// What is shown, and how.
#[derive(Args, Clone, Debug)]
pub struct Request {
    /// Topic of the section, a field with two axes [default: /field/stress, else the first field]
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<Pattern>,
    /// First time, in the unit that is recorded or with one, 32us
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub from: Option<Bound>,
    /// Last time, like the first
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub to: Option<Bound>,
    /// Frames at most, evenly over what is recorded
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = whole(2_u32..=10_000))]
    pub frames: u32,
    /// Frames a second
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole(1_u16..=50))]
    pub fps: u16,
    /// Width of the picture, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = 960, value_parser = whole(320_u32..=3840))]
    pub width: u32,
    /// The colours end at this value and its negative, in the unit of the recording [default: as in viewers]
    #[arg(long, value_name = "X", value_parser = positive)]
    pub range: Option<f64>,
    /// Units that are chosen.
    #[command(flatten)]
    pub units: Units,
}

/// A finite number above 0.
fn positive(text: &str) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|_| format!("`{text}` is not a number"))?;
    if number > 0.0 && number.is_finite() { Ok(number) } else { Err(format!("`{text}` is not above 0")) }
}

/// Why there is no film.
#[derive(Debug, thiserror::Error)]
pub enum AnimateError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A unit was typed where there is none.
    #[error(transparent)]
    Unit(#[from] UnitError),
    /// There is nothing that moves.
    #[error("{0}")]
    Nothing(String),
    /// A frame cannot be drawn.
    #[error("cannot draw: {0}")]
    Draw(String),
    /// A frame cannot be written.
    #[error("cannot write the film: {0}")]
    Write(String),
}

/// Points of a profile in a frame, about.
const PROFILE_POINTS: usize = 500;
/// Share of a profile that its axis shows: a stress that is infinite at an edge would flatten all else.
const SHOWN: f64 = 0.97;
/// Room above the largest number of an axis, relative to it.
const ROOM: f64 = 1.06;
/// Room for a body above the section, relative to the depth of the section.
const HEADROOM: f64 = 0.4;

/// Depth of a body in the section, at most, relative to the depth of the section.
const DEEPEST: f64 = 0.02;

/// A section that moves: its channel, and what it is drawn with.
struct Moving {
    id: u16,
    leaf: usize,
    /// Rows and columns that are shown.
    part: [Range<usize>; 2],
    section: Section,
    /// How deep the body is drawn at most: in the linear theory a displacement may be any multiple of what is small.
    deepest: f64,
    /// Factors of lengths and values.
    factors: [f64; 2],
}

/// A film of a recording, ready to be drawn.
pub struct Animation {
    recording: Recording,
    moving: Option<Moving>,
    film: Film,
    times: Vec<f64>,
    /// The times in words.
    labels: Vec<String>,
    body: Body,
    /// The profile of every frame, as it is drawn.
    profiles: Vec<Vec<(f64, f64)>>,
    /// The drag, as it is drawn.
    drag: Vec<(f64, f64)>,
    /// Factors of times and lengths.
    factors: [f64; 2],
    damages: Vec<Damage>,
}

impl Animation {
    /// Reads a recording once for its scales.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or has nothing that moves.
    pub fn new(path: &Path, request: &Request, limits: Limits) -> Result<Self, AnimateError> {
        let recording = Recording::open(path, limits)?;
        let mut damages = recording.damages.clone();
        let field = field(&recording, request)?;
        let clock = field.map(|(id, _)| id).or_else(|| find(&recording, |topic| topic == INTERFACE));
        let clock = clock.ok_or_else(|| {
            let what = "it has no field and no profile; choose a field with two axes with --topic";
            AnimateError::Nothing(format!("nothing to animate in `{}`: {what}", path.display()))
        })?;
        let channel = &recording.channels[&clock];
        let window = Window { from: request.from, to: request.to, every: 1 };
        window.check(channel)?;
        let mut bounds = Bounds::default();
        let mut times = Vec::new();
        damages.extend(visit(&recording, clock, 1, |moment| {
            if !holds(window, moment.time) {
                return;
            }
            let Some((_, leaf)) = field else { return times.push(moment.time) };
            if let Some(slice) = slice(channel, leaf, &moment) {
                times.push(moment.time);
                bounds.take(slice);
            }
        })?);
        times.sort_by(f64::total_cmp);
        times.dedup();
        let times = evenly(&times, request.frames as usize);
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else {
            return Err(AnimateError::Nothing(format!("`{}` has no frames in this time", channel.topic)));
        };
        let body = body(&recording, &times, &mut damages)?;
        let time = Heading::new(channel.time_name(), channel.time_unit());
        let (time, per_time) = prefixed(&time, last.abs(), &request.units);
        let unit = time.unit.as_deref().unwrap_or_default();
        let label = |at: &f64| format!("{} {unit}", short(at * per_time)).trim_end().to_owned();
        let labels = times.iter().map(|at| format!("t = {}", label(at))).collect();
        let moving = match field {
            Some(field) => Moving::of(&recording, field, &mut bounds, &body, request)?,
            None => None,
        };
        let (profile, profiles, per_length) = profiles(&recording, &times, request, &mut damages)?;
        let (drag, points) = drag(&recording, window, (&time, per_time), request, &mut damages)?;
        let run = recording.entries(convention::RUN);
        let title = run.and_then(|run| run.get("title")).cloned();
        let stage = Stage {
            title: title
                .unwrap_or_else(|| path.file_name().unwrap_or_default().to_string_lossy().into_owned()),
            section: moving.as_ref().map(|moving| moving.section.clone()),
            diagrams: [profile, drag.map(|drag| within(drag, (first * per_time, last * per_time)))]
                .into_iter()
                .flatten()
                .collect(),
            width: request.width,
        };
        let film = Film::new(&stage).map_err(AnimateError::Draw)?;
        let per_length = moving.as_ref().map_or(per_length, |moving| moving.factors[0]);
        let factors = [per_time, per_length];
        Ok(Self { recording, moving, film, times, labels, body, profiles, drag: points, factors, damages })
    }

    /// Columns and rows of its frames \[pixels\].
    pub fn size(&self) -> (u32, u32) {
        self.film.size()
    }

    /// Number of its frames.
    pub fn length(&self) -> usize {
        self.times.len()
    }

    /// Draws the frames one after the other; answers what of the recording is damaged.
    ///
    /// # Errors
    ///
    /// The file cannot be read, a frame cannot be drawn, or `take` has failed.
    pub fn draw(
        mut self,
        mut take: impl FnMut(Raster) -> Result<(), String>,
    ) -> Result<Vec<Damage>, AnimateError> {
        let mut damages = std::mem::take(&mut self.damages);
        let Some(moving) = &self.moving else {
            for i in 0..self.times.len() {
                self.frame(i, &[], &mut take)?;
            }
            return Ok(damages);
        };
        let channel = &self.recording.channels[&moving.id];
        let (mut next, mut failed) = (0, None);
        damages.extend(visit(&self.recording, moving.id, 1, |moment| {
            let is_next = self.times.get(next).is_some_and(|time| *time == moment.time) && failed.is_none();
            if let Some(slice) = slice(channel, moving.leaf, &moment).filter(|_| is_next) {
                failed = self.frame(next, &moving.values(&slice), &mut take).err();
                next += 1;
            }
        })?);
        failed.map_or(Ok(damages), Err)
    }

    fn frame(
        &self,
        i: usize,
        values: &[f64],
        take: &mut impl FnMut(Raster) -> Result<(), String>,
    ) -> Result<(), AnimateError> {
        let [per_time, per_length] = self.factors;
        let now = self.times[i] * per_time;
        let depth = self.body.depths.get(i).copied().filter(|depth| depth.is_finite());
        let deepest = self.moving.as_ref().map_or(0.0, |moving| moving.deepest);
        let outline = |depth: f64| -> Vec<(f64, f64)> {
            let tip = (depth * per_length).min(deepest);
            self.body.outline.iter().map(|[r, f]| (r * per_length, tip - f * per_length)).collect()
        };
        let contact = self.body.radii.get(i).copied().unwrap_or(0.0) * per_length;
        let passed = self.drag.partition_point(|(time, _)| *time <= now);
        let profile = self.profiles.get(i).cloned();
        let drag = (!self.drag.is_empty()).then(|| self.drag[..passed].to_vec());
        let curves: Vec<Vec<(f64, f64)>> = profile.into_iter().chain(drag).collect();
        let body = depth.map(outline).unwrap_or_default();
        let shown = Shown { time: &self.labels[i], values, body: &body, contact, curves: &curves };
        take(self.film.frame(&shown).map_err(AnimateError::Draw)?).map_err(AnimateError::Write)
    }
}

impl Moving {
    /// The section of a field; `None` if it never has a value.
    fn of(
        recording: &Recording,
        (id, leaf): (u16, usize),
        bounds: &mut Bounds,
        body: &Body,
        request: &Request,
    ) -> Result<Option<Self>, AnimateError> {
        let channel = &recording.channels[&id];
        let range = request.range.or(recording.colour_range(&channel.topic)).or_else(|| bounds.quantile());
        let (Some(range), Some([rows, columns])) = (range, bounds.sides.clone()) else { return Ok(None) };
        let part = bounds.part(range);
        let count = |side: &Side, reach: Option<f64>| {
            let reach = reach.unwrap_or(f64::INFINITY);
            (0..side.length()).take_while(|i| side.at(*i) <= reach).count().max(2).min(side.length())
        };
        let part =
            [0..count(&rows, part.map(|part| part.depth)), 0..count(&columns, part.map(|part| part.width))];
        let (rows, columns) = (rows.part(part[0].clone()), columns.part(part[1].clone()));
        let largest = |side: &Side| side.at(side.length() - 1).abs();
        let length = Heading::new("r", bounds.length_unit.as_deref());
        let (length, per_length) = prefixed(&length, largest(&rows).max(largest(&columns)), &request.units);
        let path = channel.layout.as_ref().map_or("", |layout| &layout.leaves[leaf].path);
        let value = Heading::new(shown_name(&channel.topic, path), bounds.unit.as_deref());
        let (value, per_value) = prefixed(&value, range, &request.units);
        let row = bounds.coordinate.clone().unwrap_or_default();
        let layers = recording.layers(&row).into_iter();
        let scaled = rows.scaled(per_length);
        let depth = scaled.at(scaled.length() - 1);
        let tall = body.outline.last().map_or(0.0, |[_, f]| f * per_length);
        let image = Image {
            title: channel.topic.clone(),
            value_label: value.with_unit(),
            row_label: Heading { name: row, ..length.clone() }.with_unit(),
            column_label: length.with_unit(),
            rows: scaled,
            columns: columns.scaled(per_length),
            is_equal: true,
            colours: Colours::Diverging,
            layers: layers.map(|layer| layer.scaled(per_length)).collect(),
            ..Image::default()
        };
        let headroom =
            if body.outline.is_empty() { 0.0 } else { (HEADROOM * depth).min(tall.max(0.15 * depth)) };
        let section = Section { image, range: range * per_value, headroom };
        Ok(Some(Self { id, leaf, part, section, deepest: DEEPEST * depth, factors: [per_length, per_value] }))
    }

    /// The values of a frame that are shown: 0 where it has none, which is at rest.
    fn values(&self, slice: &Slice) -> Vec<f64> {
        let [rows, columns] = &self.part;
        let (height, width) = (slice.rows.length(), slice.columns.length());
        let mut values = Vec::new();
        for j in rows.clone() {
            let value = |i: usize| {
                let is_known = j < height && i < width;
                if is_known { slice.values[j * width + i] * self.factors[1] } else { 0.0 }
            };
            values.extend(columns.clone().map(value));
        }
        values
    }
}

/// Channel and leaf of the field that is asked for, else of the stress or the first field; `None` without any.
fn field(recording: &Recording, request: &Request) -> Result<Option<(u16, usize)>, AnimateError> {
    let matrix = |id: u16| Axis::matrices(&recording.channels[&id]).next().map(|leaf| (id, leaf));
    if let Some(topic) = &request.topic {
        let ids = select::channels(recording, std::slice::from_ref(topic))?;
        let found = ids.into_iter().find_map(matrix);
        let none = || AnimateError::Nothing(format!("`{}` is no field with two axes", topic.text()));
        return found.map(Some).ok_or_else(none);
    }
    Ok(main_field(recording).and_then(matrix))
}

fn holds(window: Window, time: f64) -> bool {
    let (from, to) = window.numbers();
    from.is_none_or(|from| time >= from) && to.is_none_or(|to| time <= to)
}

/// As many of some times as there may be, evenly, the first and the last among them.
fn evenly(times: &[f64], most: usize) -> Vec<f64> {
    let count = times.len().min(most);
    (0..count).map(|i| times[i * (times.len() - 1) / (count - 1).max(1)]).collect()
}

/// A curve.
type Points = Vec<(f64, f64)>;

/// Curves of several frames, the diagram around them, and the factor of lengths.
type Curves = (Option<Diagram>, Vec<Points>, f64);

/// The profile of the interface stress nearest to every time, its diagram, and the factor of lengths.
fn profiles(
    recording: &Recording,
    times: &[f64],
    request: &Request,
    damages: &mut Vec<Damage>,
) -> Result<Curves, AnimateError> {
    let none = (None, Vec::new(), 1.0);
    let Some(id) = find(recording, |topic| topic == INTERFACE) else { return Ok(none) };
    let channel = &recording.channels[&id];
    let Some(leaf) = channel.layout.as_ref().and_then(|layout| layout.find("stress")) else {
        return Ok(none);
    };
    let mut headings = None;
    let (profiles, damaged) = nearest(recording, id, times, |moment| {
        let profile = profile(channel, leaf, moment)?;
        headings = Some([profile.axis, profile.field]);
        let step = profile.points.len().div_ceil(PROFILE_POINTS).max(1);
        Some(profile.points.into_iter().step_by(step).collect::<Points>())
    })?;
    damages.extend(damaged);
    let Some([axis, stress]) = headings else { return Ok(none) };
    let mut profiles: Vec<Points> = profiles.into_iter().map(Option::unwrap_or_default).collect();
    let reach = profiles.iter().flatten().map(|point| point.0).fold(0.0, f64::max);
    let (low, high) = profiles
        .iter()
        .map(|points| shown(points))
        .fold((0.0, 0.0), |a: (f64, f64), b| (a.0.min(b.0), a.1.max(b.1)));
    let (axis, per_length) = prefixed(&axis, reach, &request.units);
    let (stress, per_stress) = prefixed(&stress, high.max(-low), &request.units);
    for point in profiles.iter_mut().flatten() {
        *point = (point.0 * per_length, point.1 * per_stress);
    }
    let diagram = Diagram {
        labels: [axis.with_unit(), stress.with_unit()],
        ends: [(0.0, reach * per_length * ROOM), span(low * per_stress, high * per_stress)],
        rest: Vec::new(),
    };
    Ok((Some(diagram), profiles, per_length))
}

/// Smallest and largest stress of a profile but for the outermost ones.
fn shown(points: &[(f64, f64)]) -> (f64, f64) {
    let mut values: Vec<f64> = points.iter().map(|point| point.1).filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values.get((values.len().saturating_sub(1) as f64 * share) as usize).copied();
    (at(1.0 - SHOWN).unwrap_or(0.0), at(SHOWN).unwrap_or(0.0))
}

/// Ends of an axis with some room beyond.
fn span(low: f64, high: f64) -> (f64, f64) {
    if high > low { (low * ROOM, high * ROOM) } else { (low, low + 1.0) }
}

/// The drag and its diagram.
fn drag(
    recording: &Recording,
    window: Window,
    (time, per_time): (&Heading, f64),
    request: &Request,
    damages: &mut Vec<Damage>,
) -> Result<(Option<Diagram>, Points), AnimateError> {
    let Some(id) = find(recording, |topic| topic == DRAG) else { return Ok((None, Vec::new())) };
    let channel = &recording.channels[&id];
    let leaf = channel.layout.as_ref().and_then(|layout| layout.find("force"));
    let Some(leaf) = leaf else { return Ok((None, Vec::new())) };
    let mut points = Vec::new();
    damages.extend(visit(recording, id, 1, |moment| {
        let mut values = Vec::new();
        moment.values.lists[leaf].numbers(&mut values);
        points
            .extend(values.first().filter(|_| holds(window, moment.time)).map(|force| (moment.time, *force)));
    })?);
    let mut points = downsampled(&points);
    let ends =
        points.iter().map(|point| point.1).fold((0.0, 0.0), |a: (f64, f64), b| (a.0.min(b), a.1.max(b)));
    let force = Heading::new("drag", channel.unit("force"));
    let (force, per_force) = prefixed(&force, ends.1.max(-ends.0), &request.units);
    for point in &mut points {
        *point = (point.0 * per_time, point.1 * per_force);
    }
    let diagram = Diagram {
        labels: [time.with_unit(), force.with_unit()],
        ends: [(0.0, 1.0), span(ends.0 * per_force, ends.1 * per_force)],
        rest: points.clone(),
    };
    Ok((Some(diagram).filter(|_| !points.is_empty()), points))
}

/// A diagram over some times.
fn within(diagram: Diagram, (first, last): (f64, f64)) -> Diagram {
    let end = if last > first { last } else { first + 1.0 };
    Diagram { ends: [(first, end), diagram.ends[1]], ..diagram }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_even_and_hold_both_ends() {
        let times: Vec<f64> = (0..101).map(f64::from).collect();
        assert_eq!(evenly(&times, 5), [0.0, 25.0, 50.0, 75.0, 100.0]);
        assert_eq!(evenly(&times[..3], 5), [0.0, 1.0, 2.0]);
        assert_eq!((evenly(&times[..1], 5), evenly(&[], 5)), (vec![0.0], Vec::new()));
    }

    #[test]
    fn an_infinite_edge_does_not_flatten_a_profile() {
        let mut points: Vec<(f64, f64)> = (0..100).map(|i| (f64::from(i), 1.0)).collect();
        points[99].1 = 1e6;
        assert_eq!(shown(&points), (1.0, 1.0));
        assert_eq!((shown(&[]), span(0.0, 0.0)), ((0.0, 0.0), (0.0, 1.0)));
    }
}
