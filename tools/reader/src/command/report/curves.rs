//! Curves of a report: quantities against time, profiles along the surface, events.

use percuss_table::Heading;
use serde_json::{Value, json};

use crate::{
    channel::Channel,
    command::view::{Curve, Points, Scale, downsampled, find, find_leaf, thinned},
    convention::{self, CHARTS, Chart, DISPLACEMENT, DRAG, EVENT, INTERFACE, RADIUS, VELOCITY, WARNING},
    messages::Recording,
    pass::Pass,
    prefix::engineering,
    slice::profile,
    wire::List,
};

/// Events that are listed, and characters of each, at most.
const EVENTS: usize = 1000;
const CHARACTERS: usize = 1000;
/// Profiles, at most.
const PROFILES: u64 = 200;
/// Points of a profile, at most.
const PROFILE_POINTS: usize = 300;

/// What is drawn against time: a chart for each of [`CHARTS`] that the recording has, with its channel, and what moves with the frames.
pub struct Charts<'a>(Vec<(&'static Chart, &'a Channel, Points)>);

impl<'a> Charts<'a> {
    pub(super) fn of(recording: &'a Recording) -> Self {
        let chart = |chart: &'static Chart| {
            let &(.., topic, fields) = chart;
            // the indenter in the section takes more fields than the charts
            let fields = match topic {
                DRAG => &["force", RADIUS],
                VELOCITY => &["velocity", DISPLACEMENT],
                _ => fields,
            };
            let channel = &recording.channels[&find(recording, |known| known == topic)?];
            Some((chart, channel, Points::of(recording, topic, fields)))
        };
        Self(CHARTS.iter().filter_map(chart).collect())
    }

    pub(super) fn watch<'b>(&'b mut self, recording: &'b Recording, pass: &mut Pass<'b>) {
        self.0.iter_mut().for_each(|(.., points)| points.watch(recording, pass));
    }

    pub(super) fn of_topic(&self, topic: &str) -> Option<&Points> {
        self.0.iter().find(|((.., known, _), ..)| *known == topic).map(|(.., points)| points)
    }

    /// The curves of every chart, with the names of their fields.
    fn curves(&self) -> impl Iterator<Item = (&'static Chart, &'a Channel, Vec<(&'static str, &Curve)>)> {
        self.0.iter().map(|(chart, channel, points)| {
            let (.., fields) = **chart;
            let curves = |field: &&'static str| {
                points.curves(field).iter().map(|curve| (*field, curve)).collect::<Vec<_>>()
            };
            (*chart, *channel, fields.iter().flat_map(curves).collect())
        })
    }

    /// Name and unit of the time, as the first of them has it; nothing without any.
    pub(super) fn clock(&self) -> Heading {
        let first = self.curves().find(|(.., curves)| !curves.is_empty());
        first.map_or_else(Heading::default, |(_, channel, _)| {
            Heading::new(channel.time_name(), channel.time_unit())
        })
    }

    pub(super) fn times(&self) -> impl Iterator<Item = f64> {
        self.curves().flat_map(|(.., curves)| curves).flat_map(|(_, curve)| curve).map(|point| point.0)
    }

    /// * `length`: unit of the radii of probes
    pub(super) fn json(&self, length: Option<&str>, time: &Scale) -> Vec<Value> {
        let drawn = self.curves().filter(|(.., curves)| !curves.is_empty());
        drawn.map(|(of, channel, curves)| chart(of, channel, &curves, length, time)).collect()
    }
}

fn chart(
    &(id, title, ..): &Chart,
    channel: &Channel,
    curves: &[(&str, &Curve)],
    length: Option<&str>,
    time: &Scale,
) -> Value {
    // the radii of the probes are the axis of their array
    let radii = channel.metadata.get(&convention::axis("stress")).and_then(|axis| convention::numbers(axis));
    let name = |i: usize, field: &str| match radii.as_ref().and_then(|radii| radii.get(i)) {
        Some(radius) if id == "probes" => format!("r = {}", engineering(*radius, length)),
        _ => field.to_owned(),
    };
    let heading = |(field, _): &(&str, &Curve)| Heading::new(field, channel.unit(field));
    let headings: Vec<Heading> = curves.iter().map(heading).collect();
    let value = Scale::of_page(&headings, curves.iter().flat_map(|(_, curve)| *curve).map(|point| point.1));
    let curves = curves.iter().enumerate().map(|(i, (field, curve))| {
        let points = downsampled(curve);
        json!({
            "name": name(i, field),
            "x": time.numbers(points.iter().map(|point| point.0)),
            "y": value.numbers(points.iter().map(|point| point.1)),
        })
    });
    json!({
        "id": id,
        "title": title,
        "x": time.label,
        "y": value.label,
        "unit": value.name(),
        "curves": curves.collect::<Vec<_>>(),
    })
}

/// Profiles of the stress along the surface, evenly over the run.
#[derive(Default)]
pub struct Profiles {
    frames: Vec<(f64, Curve)>,
    headings: Option<[Heading; 2]>,
}

impl Profiles {
    pub(super) fn watch<'a>(&'a mut self, recording: &'a Recording, pass: &mut Pass<'a>) {
        let Some((id, leaf)) = find_leaf(recording, INTERFACE, "stress") else { return };
        let channel = &recording.channels[&id];
        pass.every(id, channel.count.div_ceil(PROFILES), move |moment, budget| {
            let Some(profile) = profile(channel, leaf, moment) else { return Ok(()) };
            let points = thinned(&profile.points, PROFILE_POINTS);
            if !budget.spend(2 * size_of::<(f64, f64)>() * points.len()) {
                return Err(recording.no_room("the profiles"));
            }
            self.frames.push((moment.time, points));
            self.headings = Some([profile.axis, profile.field]);
            Ok(())
        });
    }

    pub(super) fn times(&self) -> impl Iterator<Item = f64> {
        self.frames.iter().map(|(time, _)| *time)
    }

    /// As a page has them; `null` without the channel.
    ///
    /// * `time`: how times are read
    pub(super) fn json(self, recording: &Recording, time: &Scale) -> Value {
        if find(recording, |topic| topic == INTERFACE).is_none() {
            return Value::Null;
        }
        let points = || self.frames.iter().flat_map(|(_, points)| points);
        let [axis, stress] = self.headings.unwrap_or_default();
        let x = Scale::of_page(&[axis], points().map(|point| point.0));
        let y = Scale::of_page(&[stress], points().map(|point| point.1));
        let frames = self.frames.iter().map(|(at, points)| {
            json!({
                "time": time.number(*at),
                "x": x.numbers(points.iter().map(|point| point.0)),
                "y": y.numbers(points.iter().map(|point| point.1)),
            })
        });
        let frames = frames.collect::<Vec<_>>();
        // without a frame there are no names
        let [x_label, y_label] = [&x.label, &y.label].map(|label| Some(label).filter(|_| !frames.is_empty()));
        json!({ "frames": frames, "x": x_label, "y": y_label, "unit": y.name() })
    }
}

/// What happened, in words.
#[derive(Default)]
pub struct Events {
    listed: Vec<(f64, Value)>,
    count: usize,
    next: f64,
}

impl Events {
    pub(super) fn watch<'a>(&'a mut self, recording: &'a Recording, pass: &mut Pass<'a>) {
        let Some((id, leaf)) = find_leaf(recording, EVENT, "text") else { return };
        pass.each(id, move |moment, _| {
            let List::Text(list) = &moment.values.lists[leaf] else { return Ok(()) };
            self.count += 1;
            if self.count <= EVENTS {
                let text = list.first().map(|text| text.chars().take(CHARACTERS).collect::<String>());
                let warns = text.as_ref().is_some_and(|text| text.starts_with(WARNING));
                self.listed.push((moment.time, json!({ "text": text, "warns": warns })));
            } else if self.count == EVENTS + 1 {
                self.next = moment.time;
            }
            Ok(())
        });
    }

    pub(super) fn json(mut self, time: &Scale) -> Vec<Value> {
        if let Some(more) = self.count.checked_sub(EVENTS + 1) {
            let text = format!("this and {more} more are not listed");
            self.listed.push((self.next, json!({ "text": text })));
        }
        let event = |(at, mut event): (f64, Value)| {
            event["time"] = time.number(at);
            event
        };
        self.listed.into_iter().map(event).collect()
    }
}
