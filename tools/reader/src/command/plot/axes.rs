//! Axes of pictures: which curves share one, in which unit its numbers are best read, and which part of an image is shown.

use std::{collections::HashMap, ops::Range};

use percuss_picture::{Curve, Image, Panel, Side};
use percuss_table::Heading;

use super::Request;
use crate::{
    command::view::{self, Peaks, Scale, prefixed},
    failure::Failure,
    field::place_and_field,
    prefix::short,
    units::Units,
};

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

/// Leaves of every topic of every file the curves that have the unit of its first.
pub(super) fn keep_first_units(lines: &mut Vec<Line>) {
    let mut first = HashMap::<String, Option<String>>::new();
    lines.retain(|Line { heading, .. }| {
        let (place, _) = place_and_field(&heading.name);
        *first.entry(place.to_owned()).or_insert_with(|| heading.unit.clone()) == heading.unit
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

/// The part of an image within ranges of its coordinates, in recorded units.
pub(super) fn cut(
    image: Image,
    columns: Option<(f64, f64)>,
    rows: Option<(f64, f64)>,
) -> Result<Image, Failure> {
    let across = within(&image.columns, columns, "--x-range")?;
    let down = within(&image.rows, rows, "--y-range")?;
    Ok(part(image, [down, across]))
}

/// Share of the largest value below which a value has the colour of 0, or nearly.
const VISIBLE: f64 = 1.0 / 256.0;

/// Rows and columns of an image in which something can be seen, and as much again around them, if they are less than half of its rows or
/// columns: a field of which little has moved would be a point in an empty picture.
///
/// * `range`: ends of the colours
pub(super) fn visible(image: &Image, range: Option<(f64, f64)>) -> Option<[Range<usize>; 2]> {
    let (low, high) = range.unwrap_or_else(|| image.range());
    let [height, width] = [image.rows.length(), image.columns.length()];
    let mut peaks = Peaks::default();
    peaks.take(&image.values, width);
    let [rows, columns] = peaks.above(VISIBLE * low.abs().max(high.abs()));
    if rows.is_empty() || (2 * rows.len() > height && 2 * columns.len() > width) {
        return None;
    }
    // as far to all sides as it is wide or high, whatever is more
    let more = (rows.len().max(columns.len()) / 2).max(2);
    let wider =
        |seen: Range<usize>, length: usize| seen.start.saturating_sub(more)..(seen.end + more).min(length);
    Some([wider(rows, height), wider(columns, width)])
}

/// The part of an image that has some rows and columns.
pub(super) fn part(image: Image, [down, across]: [Range<usize>; 2]) -> Image {
    let width = image.columns.length();
    let row = |j: usize| &image.values[j * width + across.start..j * width + across.end];
    let values = down.clone().flat_map(|j| row(j).iter().copied()).collect();
    Image { rows: image.rows.part(down), columns: image.columns.part(across), values, ..image }
}

/// Numbers of the elements of a side whose positions lie within a range.
fn within(side: &Side, range: Option<(f64, f64)>, option: &str) -> Result<Range<usize>, Failure> {
    let Some((low, high)) = range else { return Ok(0..side.length()) };
    let is_inside = |i: &usize| (low..=high).contains(&side.at(*i));
    let mut inside = (0..side.length()).filter(is_inside);
    match (inside.next(), inside.next_back()) {
        (Some(first), Some(last)) => Ok(first..last + 1),
        _ => {
            let (first, last) = (side.at(0), side.at(side.length().saturating_sub(1)));
            let text =
                format!("{option} {low},{high} has fewer than two elements; they lie from {first} to {last}");
            Err(Failure::Usage(text))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_keeps_its_places() {
        let side = |length| Side::Even { start: 0.5, step: 1.0, length };
        let values = (0..12).map(f64::from).collect();
        let image = Image { rows: side(3), columns: side(4), values, ..Image::default() };
        let part = cut(image.clone(), Some((1.0, 2.6)), Some((1.5, 9.0))).expect("a part");
        assert_eq!(part.values, [5.0, 6.0, 9.0, 10.0]);
        assert_eq!((part.columns.at(0), part.rows.at(0)), (1.5, 1.5));
        // little of a large field has moved
        let mut values = vec![0.0; 100 * 40];
        (values[0], values[1], values[40]) = (-8.0, 4.0, 0.5);
        values[9 * 40 + 3] = 0.01;
        let field = Image { rows: side(100), columns: side(40), values, ..Image::default() };
        assert_eq!(visible(&field, None), Some([0..4, 0..4]));
        assert_eq!(visible(&field, Some((-0.1, 0.1))), Some([0..15, 0..9]));
        assert_eq!(visible(&image, None), None);
        assert_eq!(visible(&Image { values: vec![0.0; 12], ..image.clone() }, None), None);
        assert_eq!(cut(image.clone(), None, None).expect("all of it").values.len(), 12);
        let error = cut(image, Some((10.0, 20.0)), None).expect_err("nothing there").to_string();
        assert!(error.contains("--x-range 10,20") && error.contains("0.5 to 3.5"), "{error}");
    }

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
