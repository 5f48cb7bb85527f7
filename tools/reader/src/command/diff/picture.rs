//! The fields that differ most: both curves, and their difference below.

use std::path::{Path, PathBuf};

use percuss_picture::{Curve, Medium, Panel, draw};

use crate::{
    axis::linear,
    command::plot::{Request, traces},
    compare::{ChannelReport, Comparison, FieldReport},
    failure::Failure,
    field::Selection,
    measured::Sources,
    recording::Limits,
};

/// Fields that are drawn at most.
const MAX_FIELDS: usize = 4;

/// Draws the fields that differ most relative to their peaks, arrays at the element where they do; `None` if nothing
/// differs.
pub(super) fn picture(
    a: &Path,
    b: &Path,
    comparison: &Comparison,
    limits: Limits,
    sources: &Sources,
    medium: Medium,
) -> Result<Option<Vec<u8>>, Failure> {
    let mut worst: Vec<(f64, &ChannelReport, &FieldReport)> = Vec::new();
    for channel in &comparison.channels {
        for field in channel.fields.iter().filter(|field| !field.ignored && field.measure.differing > 0) {
            // beyond tolerance comes before within
            let rank = field.measure.peak_relative().unwrap_or(0.0) + if field.within { 0.0 } else { 1e300 };
            worst.push((rank, channel, field));
        }
    }
    worst.sort_by(|x, y| y.0.total_cmp(&x.0));
    let mut panels = Vec::new();
    for (_, channel, field) in worst.into_iter().take(MAX_FIELDS) {
        panels.extend(field_panels([a, b], channel, field, (limits, sources))?);
    }
    if panels.is_empty() {
        return Ok(None);
    }
    draw(&panels, medium).map(Some).map_err(Failure::drawing)
}

fn field_panels(
    [a, b]: [&Path; 2],
    channel: &ChannelReport,
    field: &FieldReport,
    (limits, sources): (Limits, &Sources),
) -> Result<Vec<Panel>, Failure> {
    let topic = &channel.topic;
    let [start_a, start_b] = channel.starts.unwrap_or_default();
    let Some((_, place)) = &field.measure.max else { return Ok(Vec::new()) };
    let element = field.leaf.element(place.element);
    let curve = |path: &Path, start: f64| curve(path, topic, &element, start, (limits, sources));
    let (Some((mut panel, curve_a)), Some((_, curve_b))) = (curve(a, start_a)?, curve(b, start_b)?) else {
        return Ok(Vec::new());
    };
    let difference = Curve {
        name: "difference".into(),
        points: subtract(&curve_b.points, &curve_a.points),
        dashed: false,
        colour: None,
    };
    let position = place.position.as_ref().map_or(String::new(), |position| format!(" ({position})"));
    panel.title = format!("{topic}.{element}{position}");
    let below = Panel {
        x_label: panel.x_label.clone(),
        y_label: "new - reference".into(),
        curves: vec![difference],
        ..Panel::default()
    };
    panel.curves = vec![
        Curve { name: format!("reference {}", a.display()), ..curve_a },
        Curve { name: format!("new {}", b.display()), dashed: true, ..curve_b },
    ];
    Ok(vec![panel, below])
}

/// An element against time from a start, with the panel it is drawn in; `None` for a field that was renamed, or that holds
/// no numbers.
fn curve(
    path: &Path,
    topic: &str,
    element: &str,
    start: f64,
    (limits, sources): (Limits, &Sources),
) -> Result<Option<(Panel, Curve)>, Failure> {
    let request = Request {
        topics: vec![topic.parse().map_err(Failure::nothing)?],
        selection: Selection { fields: vec![element.to_owned()], ..Selection::default() },
        epoch: true,
        sources: sources.clone(),
        ..Request::default()
    };
    match traces(&[PathBuf::from(path)], &request, limits) {
        Ok(mut panel) => {
            let curve = panel.curves.pop().map(|mut curve| {
                curve.points.iter_mut().for_each(|point| point.0 -= start);
                curve
            });
            Ok(curve.map(|curve| (panel, curve)))
        }
        Err(Failure::Usage(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

/// b − a at the times of a, b interpolated linearly.
fn subtract(b: &[(f64, f64)], a: &[(f64, f64)]) -> Vec<(f64, f64)> {
    a.iter().filter_map(|&(time, value)| Some((time, linear(b, time)? - value))).collect()
}
