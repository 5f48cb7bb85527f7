//! Curves of a report: quantities against time, profiles along the surface, events.

use std::path::Path;

use percuss_picture::{Curve, Panel};
use serde_json::{Value, json};

use crate::{
    channel::Channel,
    command::plot::{PlotError, Request, traces},
    convention::{self, CHARTS, EVENT, WARNING},
    field::Selection,
    messages::Recording,
    prefix::engineering,
    recording::{Damage, Limits, OpenError},
    slice::{Moment, profile, visit},
};

/// Points of a curve against time, at most; longer ones keep the extremes of every stretch.
const POINTS: usize = 1200;
/// Events that are listed, and characters of each, at most.
const EVENTS: usize = 1000;
const CHARACTERS: usize = 1000;
/// Profiles, at most.
const PROFILES: u64 = 200;
/// Points of a profile, at most.
const PROFILE_POINTS: usize = 300;

/// The charts against time of what the recording has.
///
/// * `length`: unit of the radii of probes
pub fn charts(
    path: &Path,
    recording: &Recording,
    length: Option<&str>,
    limits: Limits,
) -> Result<Vec<Value>, PlotError> {
    let mut charts = Vec::new();
    for (id, title, topic, fields) in CHARTS {
        let Some(id_of_channel) = super::find(recording, |known| known == topic) else { continue };
        let channel = &recording.channels[&id_of_channel];
        let leaves = || channel.layout.iter().flat_map(|layout| &layout.leaves);
        // recordings of earlier versions have fewer fields
        let fields = fields.iter().filter(|field| leaves().any(|leaf| leaf.path == **field));
        let request = Request {
            topics: vec![topic.parse().expect("a plain topic")],
            selection: Selection {
                fields: fields.map(|&field| field.to_owned()).collect(),
                ..Selection::default()
            },
            ..Request::default()
        };
        let panel = traces(&[path.to_owned()], &request, limits)?;
        charts.push(chart(id, title, &panel, channel, length));
    }
    Ok(charts)
}

fn chart(id: &str, title: &str, panel: &Panel, channel: &Channel, length: Option<&str>) -> Value {
    // the radii of the probes are the axis of their array
    let radii = channel.metadata.get(&convention::axis("stress")).and_then(|axis| convention::numbers(axis));
    let name = |(i, curve): (usize, &Curve)| match radii.as_ref().and_then(|radii| radii.get(i)) {
        Some(radius) if id == "probes" => format!("r = {}", engineering(*radius, length)),
        _ => curve.name.rsplit(['/', '.', ':']).next().unwrap_or_default().to_owned(),
    };
    let curves = panel.curves.iter().enumerate().map(|(i, curve)| {
        let points = downsampled(&curve.points);
        json!({
            "name": name((i, curve)),
            "x": points.iter().map(|point| number(point.0)).collect::<Vec<_>>(),
            "y": points.iter().map(|point| number(point.1)).collect::<Vec<_>>(),
        })
    });
    json!({
        "id": id,
        "title": title,
        "x": panel.x_label,
        "y": panel.y_label,
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

/// The smallest and the largest point of every stretch, in their order.
pub(in crate::command) fn downsampled(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(POINTS / 2);
    let extremes = |points: &[(f64, f64)]| {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (low, high) = (points.iter().min_by(by_value), points.iter().max_by(by_value));
        let mut pair: Vec<(f64, f64)> = low.into_iter().chain(high).copied().collect();
        pair.sort_by(|a, b| a.0.total_cmp(&b.0));
        pair.dedup();
        pair
    };
    points.chunks(stretch).flat_map(extremes).collect()
}

/// Profiles of the stress along the surface, evenly over the run.
pub fn profiles(recording: &Recording, id: u16, damages: &mut Vec<Damage>) -> Result<Value, OpenError> {
    let channel = &recording.channels[&id];
    let Some(leaf) = channel.layout.as_ref().and_then(|layout| layout.find("stress")) else {
        return Ok(Value::Null);
    };
    let every = channel.count.div_ceil(PROFILES).max(1);
    let (mut frames, mut labels) = (Vec::new(), Value::Null);
    damages.extend(visit(recording, id, every, |moment| {
        let Some(profile) = profile(channel, leaf, &moment) else { return };
        let step = profile.points.len().div_ceil(PROFILE_POINTS).max(1);
        // the edge is where the stress is highest: the last point stays
        let last = profile.points.len().saturating_sub(1);
        let points: Vec<&(f64, f64)> = profile
            .points
            .iter()
            .enumerate()
            .filter(|(i, _)| i % step == 0 || *i == last)
            .map(|(_, point)| point)
            .collect();
        frames.push(json!({
            "time": moment.time,
            "x": points.iter().map(|point| number(point.0)).collect::<Vec<_>>(),
            "y": points.iter().map(|point| number(point.1)).collect::<Vec<_>>(),
        }));
        labels = json!([profile.axis.with_unit(), profile.field.with_unit()]);
    })?);
    Ok(json!({ "frames": frames, "x": labels[0], "y": labels[1] }))
}

/// What happened, in words.
pub fn events(recording: &Recording, damages: &mut Vec<Damage>) -> Result<Vec<Value>, OpenError> {
    let Some(id) = super::find(recording, |topic| topic == EVENT) else { return Ok(Vec::new()) };
    let channel = &recording.channels[&id];
    let text = channel.layout.as_ref().and_then(|layout| layout.find("text"));
    let (mut events, mut count, mut next) = (Vec::new(), 0, f64::NAN);
    damages.extend(visit(recording, id, 1, |moment: Moment| {
        if let Some(crate::wire::List::Text(list)) = text.map(|leaf| &moment.values.lists[leaf]) {
            count += 1;
            if count <= EVENTS {
                let text = list.first().map(|text| text.chars().take(CHARACTERS).collect::<String>());
                let warns = text.as_ref().is_some_and(|text| text.starts_with(WARNING));
                events.push(json!({ "time": moment.time, "text": text, "warns": warns }));
            } else if count == EVENTS + 1 {
                next = moment.time;
            }
        }
    })?);
    if count > EVENTS {
        events.push(
            json!({ "time": next, "text": format!("this and {} more are not listed", count - EVENTS - 1) }),
        );
    }
    Ok(events)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn downsampling_keeps_the_extremes() {
        let mut points: Vec<(f64, f64)> = (0..100_000).map(|i| (f64::from(i), 0.0)).collect();
        points[77_777].1 = 5.0;
        points[33_333].1 = -5.0;
        let fewer = downsampled(&points);
        assert!(fewer.len() <= POINTS + 2);
        assert!(fewer.contains(&(77_777.0, 5.0)) && fewer.contains(&(33_333.0, -5.0)));
        assert!(fewer.windows(2).all(|pair| pair[0].0 < pair[1].0));
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!(number(0.123_456_789).to_string(), "0.123457");
        assert_eq!(number(f64::NAN), Value::Null);
    }
}
