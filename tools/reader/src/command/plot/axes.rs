//! Axes of pictures: which curves share one, and in which unit its numbers are best read.

use percuss_picture::{Curve, Image, Panel, Side};
use percuss_table::Heading;

use super::request::Request;
use crate::{
    command::view::{self, Scale, prefixed},
    field::place_and_field,
    prefix::short,
    units::Units,
};

/// A curve, and what its values are.
pub(super) struct Line {
    pub(super) curve: Curve,
    pub(super) heading: Heading,
}

/// The largest magnitude among numbers that can be drawn, or of the ends of an axis.
fn largest(ends: Option<(f64, f64)>, numbers: impl Iterator<Item = f64>) -> f64 {
    ends.map_or_else(|| view::largest(numbers), |(low, high)| low.abs().max(high.abs()))
}

/// Both ends of an axis in its unit.
fn scaled(ends: Option<(f64, f64)>, factor: f64) -> Option<(f64, f64)> {
    ends.map(|(low, high)| (low * factor, high * factor))
}

/// A diagram of curves over an axis, each axis with the prefix that fits its largest number.
///
/// * `left`: curves of one unit; with several, the numbers stay as they are
/// * `right`: curves on an axis at the right
pub(super) fn panel(x: &Heading, left: Vec<Line>, right: Vec<Line>, request: &Request) -> Panel {
    let points = || left.iter().chain(&right).flat_map(|line| &line.curve.points);
    let (x, x_factor) = prefixed(x, largest(request.x_range, points().map(|point| point.0)), &request.units);
    let is_shown = |x: f64| request.x_range.is_none_or(|(low, high)| (low..=high).contains(&x));
    let side = |lines: Vec<Line>, ends: Option<(f64, f64)>| {
        let shown = lines.iter().flat_map(|line| &line.curve.points).filter(|point| is_shown(point.0));
        let largest = largest(ends, shown.map(|point| point.1));
        let headings: Vec<Heading> = lines.iter().map(|line| line.heading.clone()).collect();
        let scale = Scale::of(&headings, largest, &request.units);
        let y_factor = scale.unit.as_ref().map_or(1.0, |unit| unit.factor);
        let mut curves: Vec<Curve> = lines.into_iter().map(|line| line.curve).collect();
        for point in curves.iter_mut().flat_map(|curve| &mut curve.points) {
            *point = (point.0 * x_factor, point.1 * y_factor);
        }
        (curves, scale.label, scaled(ends, y_factor))
    };
    let ((curves, y_label, y_range), (right, right_label, _)) =
        (side(left, request.range), side(right, None));
    Panel {
        title: String::new(),
        x_label: x.with_unit(),
        y_label,
        curves,
        right_label,
        right,
        log_x: request.log.0,
        log_y: request.log.1,
        x_range: scaled(request.x_range, x_factor),
        y_range,
    }
}

/// Units of curves in the order of their first appearance.
pub(super) fn units(lines: &[Line]) -> Vec<Option<String>> {
    let mut units: Vec<Option<String>> = Vec::new();
    for line in lines {
        if !units.contains(&line.heading.unit) {
            units.push(line.heading.unit.clone());
        }
    }
    units
}

/// Leaves of every topic of every file the curves that have the unit of its first.
pub(super) fn keep_first_units(lines: &mut Vec<Line>) {
    let mut first: Vec<(String, Option<String>)> = Vec::new();
    lines.retain(|line| {
        let (place, _) = place_and_field(&line.heading.name);
        match first.iter().find(|(known, _)| known == place) {
            Some((_, unit)) => *unit == line.heading.unit,
            None => {
                first.push((place.to_owned(), line.heading.unit.clone()));
                true
            }
        }
    });
}

/// An image and the ends of its colours with labels and with the prefixes that fit, rows and columns of one unit with the
/// same.
pub(super) fn labelled(
    image: Image,
    [rows, columns, values]: &[Heading; 3],
    Request { range, units, .. }: &Request,
) -> (Image, Option<(f64, f64)>) {
    let reach =
        |side: &Side| largest(None, [side.at(0), side.at(side.length().saturating_sub(1))].into_iter());
    let (mut down, mut along) = (reach(&image.rows), reach(&image.columns));
    if rows.unit == columns.unit {
        (down, along) = (down.max(along), down.max(along));
    }
    let ((rows, down), (columns, along)) = (prefixed(rows, down, units), prefixed(columns, along, units));
    let (values, factor) = prefixed(values, largest(*range, image.values.iter().copied()), units);
    let image = Image {
        row_label: rows.with_unit(),
        column_label: columns.with_unit(),
        value_label: values.with_unit(),
        rows: image.rows.scaled(down),
        columns: image.columns.scaled(along),
        layers: image.layers.into_iter().map(|layer| layer.scaled(down)).collect(),
        values: image.values.into_iter().map(|value| value * factor).collect(),
        ..image
    };
    (image, scaled(*range, factor))
}

/// A time in words: `time 0.5`, or with the prefix that fits it, `time 12.5 µs`.
pub(super) fn time_label(time: f64, unit: Option<&str>, units: &Units) -> String {
    let prefixed = unit.and_then(|unit| units.choose(unit, time));
    let number = short(prefixed.as_ref().map_or(time, |prefixed| prefixed.apply(time)));
    prefixed.map_or_else(|| format!("time {number}"), |prefixed| format!("time {number} {}", prefixed.unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(name: &str, unit: &str, points: &[(f64, f64)]) -> Line {
        let heading = Heading::new(name, Some(unit));
        Line { curve: Curve { name: name.into(), points: points.to_vec(), ..Curve::default() }, heading }
    }

    #[test]
    fn a_topic_shows_the_unit_of_its_first_field() {
        let mut lines = vec![
            line("/drag.force", "N", &[]),
            line("/drag.contact_radius", "m", &[]),
            line("/velocity.velocity", "m/s", &[]),
            line("/drag.friction", "N", &[]),
        ];
        keep_first_units(&mut lines);
        let names: Vec<&str> = lines.iter().map(|line| line.heading.name.as_str()).collect();
        assert_eq!(names, ["/drag.force", "/velocity.velocity", "/drag.friction"]);
    }

    #[test]
    fn axes_have_the_prefix_of_what_they_show() {
        let time = Heading::new("time", Some("s"));
        let left = || vec![line("force", "N", &[(0.0, 0.0), (2e-6, 4000.0), (5e-6, 3e9)])];
        let right = vec![line("velocity", "m/s", &[(0.0, 2500.0)])];
        let request = Request { x_range: Some((0.0, 3e-6)), ..Request::default() };
        let panel = panel(&time, left(), right, &request);
        assert_eq!((panel.x_label.as_str(), panel.y_label.as_str()), ("time [µs]", "force [kN]"));
        assert_eq!((panel.right_label.as_str(), panel.right[0].points[0].1), ("velocity [m/s]", 2500.0));
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        let (x, y) = panel.curves[0].points[1];
        assert!(close(x, 2.0) && close(y, 4.0) && close(panel.x_range.expect("ends").1, 3.0));
        let request = Request { range: Some((0.0, 2e6)), ..Request::default() };
        let panel = super::panel(&time, left(), Vec::new(), &request);
        assert_eq!((panel.y_label.as_str(), panel.y_range), ("force [MN]", Some((0.0, 2.0))));
        assert_eq!(time_label(1.25e-5, Some("s"), &Units::default()), "time 12.5 µs");
        assert_eq!(time_label(3.2165977e-5, Some("s"), &Units::default()), "time 32.166 µs");
        assert_eq!(time_label(2.5, Some("R/c_p"), &Units::default()), "time 2.5");
    }
}
