//! Curves of a report: quantities against time, profiles along the surface, events.

use percuss_table::Heading;
use serde_json::{Value, json};

use crate::{
    channel::Channel,
    command::{
        points::{Curve, Points, find, find_leaf},
        view::{Scale, downsampled, thinned},
    },
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

/// What is drawn against time: a chart for each of [`CHARTS`] that the recording has, and what moves with the frames.
pub struct Charts(Vec<Points>);

impl Charts {
    pub(super) fn of(recording: &Recording) -> Self {
        // the indenter in the section takes more fields than the charts
        let fields = |topic: &str, fields: &[&'static str]| match topic {
            DRAG => vec!["force", RADIUS],
            VELOCITY => vec!["velocity", DISPLACEMENT],
            _ => fields.to_vec(),
        };
        Self(
            CHARTS
                .iter()
                .map(|(.., topic, names)| Points::of(recording, topic, &fields(topic, names)))
                .collect(),
        )
    }

    pub(super) fn watch<'a>(&'a mut self, recording: &'a Recording, pass: &mut Pass<'a>) {
        self.0.iter_mut().for_each(|points| points.watch(recording, pass));
    }

    /// What is known of a topic.
    pub(super) fn of_topic(&self, topic: &str) -> Option<&Points> {
        CHARTS.iter().position(|(.., known, _)| *known == topic).map(|place| &self.0[place])
    }

    /// Name and unit of the time, as the first of them has it; nothing without any.
    pub(super) fn clock(&self, recording: &Recording) -> Heading {
        let mut topics = CHARTS
            .iter()
            .zip(&self.0)
            .filter(|((.., fields), points)| fields.iter().any(|field| !points.curves(field).is_empty()));
        let first = topics.find_map(|(&(.., topic, _), _)| find(recording, |known| known == topic));
        let channel = first.map(|id| &recording.channels[&id]);
        channel.map(|channel| Heading::new(channel.time_name(), channel.time_unit())).unwrap_or_default()
    }

    /// All times.
    pub(super) fn times(&self) -> impl Iterator<Item = f64> {
        let curves = CHARTS
            .iter()
            .zip(&self.0)
            .flat_map(|((.., fields), points)| fields.iter().map(|field| points.curves(field)));
        curves.flatten().flatten().map(|point| point.0)
    }

    /// As a page has them.
    ///
    /// * `length`: unit of the radii of probes
    /// * `time`: how times are read
    pub(super) fn json(&self, recording: &Recording, length: Option<&str>, time: &Scale) -> Vec<Value> {
        let chart = |(&(id, title, topic, fields), points): (&Chart, &Points)| {
            let channel = &recording.channels[&find(recording, |known| known == topic)?];
            let curves = |field: &&str| {
                let heading = Heading::new(field, channel.unit(field));
                points.curves(field).iter().map(move |curve| (heading.clone(), curve))
            };
            let curves: Vec<(Heading, &Curve)> = fields.iter().flat_map(curves).collect();
            (!curves.is_empty()).then(|| chart((id, title), &curves, channel, length, time))
        };
        CHARTS.iter().zip(&self.0).filter_map(chart).collect()
    }
}

fn chart(
    (id, title): (&str, &str),
    curves: &[(Heading, &Curve)],
    channel: &Channel,
    length: Option<&str>,
    time: &Scale,
) -> Value {
    // the radii of the probes are the axis of their array
    let radii = channel.metadata.get(&convention::axis("stress")).and_then(|axis| convention::numbers(axis));
    let name = |i: usize, heading: &Heading| match radii.as_ref().and_then(|radii| radii.get(i)) {
        Some(radius) if id == "probes" => format!("r = {}", engineering(*radius, length)),
        _ => heading.name.clone(),
    };
    let headings: Vec<Heading> = curves.iter().map(|(heading, _)| heading.clone()).collect();
    let value = Scale::of_page(&headings, curves.iter().flat_map(|(_, curve)| *curve).map(|point| point.1));
    let curves = curves.iter().enumerate().map(|(i, (heading, curve))| {
        let points = downsampled(curve);
        json!({
            "name": name(i, heading),
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

    /// All times.
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

    /// As a page has them.
    ///
    /// * `time`: how times are read
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
