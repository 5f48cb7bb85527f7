//! Curves of a report: quantities against time, profiles along the surface, events.

use percuss_table::Heading;
use serde_json::{Value, json};

use crate::{
    channel::Channel,
    command::{
        plot::axes::common_label,
        points::{Curve, Points, downsampled, find, find_leaf},
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

    /// As a page has them.
    ///
    /// * `length`: unit of the radii of probes
    pub(super) fn json(&self, recording: &Recording, length: Option<&str>) -> Vec<Value> {
        let chart = |(&(id, title, topic, fields), points): (&Chart, &Points)| {
            let channel = &recording.channels[&find(recording, |known| known == topic)?];
            let curves = |field: &&str| {
                let heading = Heading::new(field, channel.unit(field));
                points.curves(field).iter().map(move |curve| (heading.clone(), curve))
            };
            let curves: Vec<(Heading, &Curve)> = fields.iter().flat_map(curves).collect();
            (!curves.is_empty()).then(|| chart((id, title), &curves, channel, length))
        };
        CHARTS.iter().zip(&self.0).filter_map(chart).collect()
    }
}

fn chart(
    (id, title): (&str, &str),
    curves: &[(Heading, &Curve)],
    channel: &Channel,
    length: Option<&str>,
) -> Value {
    // the radii of the probes are the axis of their array
    let radii = channel.metadata.get(&convention::axis("stress")).and_then(|axis| convention::numbers(axis));
    let name = |i: usize, heading: &Heading| match radii.as_ref().and_then(|radii| radii.get(i)) {
        Some(radius) if id == "probes" => format!("r = {}", engineering(*radius, length)),
        _ => heading.name.clone(),
    };
    let headings: Vec<Heading> = curves.iter().map(|(heading, _)| heading.clone()).collect();
    let curves = curves.iter().enumerate().map(|(i, (heading, curve))| {
        let points = downsampled(curve);
        json!({
            "name": name(i, heading),
            "x": points.iter().map(|point| number(point.0)).collect::<Vec<_>>(),
            "y": points.iter().map(|point| number(point.1)).collect::<Vec<_>>(),
        })
    });
    json!({
        "id": id,
        "title": title,
        "x": Heading::new(channel.time_name(), channel.time_unit()).with_unit(),
        "y": common_label(&headings),
        "curves": curves.collect::<Vec<_>>(),
    })
}

/// The last number of a curve of a chart.
pub fn last(curve: &Value) -> Option<f64> {
    curve["y"].as_array()?.iter().rev().find_map(Value::as_f64)
}

/// A number as short as six digits allow; `null` if it is none.
pub fn number(value: f64) -> Value {
    format!("{value:.5e}").parse::<f64>().ok().filter(|value| value.is_finite()).into()
}

/// Profiles of the stress along the surface, evenly over the run.
#[derive(Default)]
pub struct Profiles {
    frames: Vec<Value>,
    labels: Option<[String; 2]>,
}

impl Profiles {
    pub(super) fn watch<'a>(&'a mut self, recording: &'a Recording, pass: &mut Pass<'a>) {
        let Some((id, leaf)) = find_leaf(recording, INTERFACE, "stress") else { return };
        let channel = &recording.channels[&id];
        pass.every(id, channel.count.div_ceil(PROFILES), move |moment, budget| {
            let Some(profile) = profile(channel, leaf, moment) else { return Ok(()) };
            let step = profile.points.len().div_ceil(PROFILE_POINTS).max(1);
            // the edge is where the stress is highest: the last point stays
            let last = profile.points.len().saturating_sub(1);
            let points = profile.points.iter().enumerate().filter(|(i, _)| i % step == 0 || *i == last);
            let points: Vec<&(f64, f64)> = points.map(|(_, point)| point).collect();
            if !budget.spend(2 * points.len() * size_of::<Value>()) {
                return Err(recording.no_room("the profiles"));
            }
            self.frames.push(json!({
                "time": moment.time,
                "x": points.iter().map(|point| number(point.0)).collect::<Vec<_>>(),
                "y": points.iter().map(|point| number(point.1)).collect::<Vec<_>>(),
            }));
            self.labels = Some([profile.axis.with_unit(), profile.field.with_unit()]);
            Ok(())
        });
    }

    /// As a page has them; `null` without the channel.
    pub(super) fn json(self, recording: &Recording) -> Value {
        if find(recording, |topic| topic == INTERFACE).is_none() {
            return Value::Null;
        }
        let [x, y] = self.labels.map_or([None, None], |labels| labels.map(Some));
        json!({ "frames": self.frames, "x": x, "y": y })
    }
}

/// What happened, in words.
#[derive(Default)]
pub struct Events {
    listed: Vec<Value>,
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
                self.listed.push(json!({ "time": moment.time, "text": text, "warns": warns }));
            } else if self.count == EVENTS + 1 {
                self.next = moment.time;
            }
            Ok(())
        });
    }

    /// As a page has them.
    pub(super) fn json(mut self) -> Vec<Value> {
        if let Some(more) = self.count.checked_sub(EVENTS + 1) {
            let text = format!("this and {more} more are not listed");
            self.listed.push(json!({ "time": self.next, "text": text }));
        }
        self.listed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(number(0.123_456_789).to_string(), "0.123457");
        assert_eq!(number(f64::NAN), Value::Null);
    }
}
