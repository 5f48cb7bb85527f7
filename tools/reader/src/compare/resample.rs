//! Samples brought to common places: the new recording between its messages, arrays between their elements.

use percuss_picture::Side;
use prost_reflect::Kind;

use super::{
    measure::Place,
    meter::{Meter, Sample},
};
use crate::{
    axis::{self, Axis, Grid, at},
    convention,
    wire::{Layout, Leaf, List, Type, Values},
};

/// The fields of a pair of channels.
pub(super) struct Field {
    pub(super) path: String,
    pub(super) leaf: Leaf,
    pub(super) unit: Option<String>,
    pub(super) leaf_a: usize,
    pub(super) leaf_b: usize,
    pub(super) axis_a: Axis,
    pub(super) axis_b: Axis,
    pub(super) even: bool,
    pub(super) ignored: bool,
    /// It only says where the others are.
    pub(super) is_place: bool,
    /// It only says when or in which message the others are.
    pub(super) is_key: bool,
    pub(super) meter: Meter,
}

/// Fields that say which message it is, and when: `step`, `time`, and those of type `google.protobuf.Timestamp`.
pub(super) fn is_key(layout: &Layout, leaf: usize) -> bool {
    let leaf = &layout.leaves[leaf];
    if matches!(leaf.path.as_str(), convention::STEP | convention::TIME) {
        return true;
    }
    let mut message = layout.descriptor().clone();
    let Some((_, parents)) = leaf.numbers.split_last() else { return false };
    for number in parents {
        match message.get_field(*number).map(|field| field.kind()) {
            Some(Kind::Message(inner)) => message = inner,
            _ => return false,
        }
    }
    leaf.lists == 0 && message.full_name() == "google.protobuf.Timestamp"
}

/// Numbers interpolated between points of time; of what is no number, that of the nearest point.
pub(super) fn mix(points: &[(f64, Values)], time: f64, layout: &Layout, into: &mut Values) {
    let nearest = points.iter().min_by(|x, y| (x.0 - time).abs().total_cmp(&(y.0 - time).abs()));
    let Some((_, nearest)) = nearest else { return };
    // Lagrange: w_i = Π_{j≠i} (t − t_j)/(t_i − t_j)
    let weight = |i: usize| -> f64 {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, other)| (time - other.0) / (points[i].0 - other.0)).product()
    };
    let weights: Vec<f64> = (0..points.len()).map(weight).collect();
    for (leaf, list) in into.lists.iter_mut().enumerate() {
        let is_float = matches!(layout.leaves[leaf].kind, Type::Double | Type::Float);
        let length = points.iter().map(|(_, values)| values.lists[leaf].len()).min().unwrap_or(0);
        if !is_float || points.len() == 1 {
            *list = nearest.lists[leaf].clone();
            continue;
        }
        let value = |i: usize| -> f64 {
            let terms = points.iter().zip(&weights);
            terms.map(|((_, values), weight)| weight * values.lists[leaf].number(i).unwrap_or(0.0)).sum()
        };
        *list = match list {
            List::Float(_) => List::Float((0..length).map(|i| value(i) as f32).collect()),
            _ => List::Double((0..length).map(value).collect()),
        };
    }
}

/// Measures every field of a sample; true if the axes of any array differ.
///
/// * `interpolated`: `b` stands between two messages
/// * `without_keys`: fields that say which message it is are not compared
pub(super) fn measure(
    fields: &mut [Field],
    a: &Values,
    b: &Values,
    place: &Place,
    interpolated: bool,
    without_keys: bool,
) -> bool {
    let mut axes_differ = false;
    for field in fields.iter_mut().filter(|field| !field.ignored) {
        let (list_a, list_b) = (&a.lists[field.leaf_a], &b.lists[field.leaf_b]);
        if without_keys && field.is_key {
            // their scale is still wanted
            field.meter.take_same(list_a, place.clone());
            continue;
        }
        let (place_a, place_b) = (field.axis_a.place(a), field.axis_b.place(b));
        let (grid_a, grid_b) = (field.axis_a.grid(a), field.axis_b.grid(b));
        let axis_a = &field.axis_a;
        let position = |index: usize| match (axis_a, &grid_a) {
            (Axis::Matrix { coordinates: [row, column], .. }, Some(grid)) => {
                let width = grid.columns.length.max(1);
                let (z, r) = (grid.rows.at(index / width), grid.columns.at(index % width));
                Some(format!("{row} = {z}, {column} = {r}"))
            }
            _ => place_a.position(index).map(|position| format!("{} = {position}", axis_a.coordinate())),
        };
        let sample = |a, b, position| Sample { a, b, place: place.clone(), position };
        if let (Some(grid_a), Some(grid_b)) = (grid_a, grid_b) {
            if grid_a != grid_b {
                axes_differ |= !same_spacing(&grid_a, &grid_b);
                let (common_a, common_b, chosen) = on_common_grid(list_a, &grid_a, list_b, &grid_b);
                if has_nothing_of(&common_a, list_a, list_b) {
                    field.meter.measure.apart += 1;
                    continue;
                }
                let at = |i: usize| chosen.get(i).and_then(|&i| position(i));
                field.meter.take(&sample(&common_a, &common_b, &at));
                continue;
            }
        } else if let Some((common_a, common_b, first)) =
            on_common_axis(field.even, list_a, place_a, list_b, place_b)
        {
            axes_differ = true;
            if has_nothing_of(&common_a, list_a, list_b) {
                field.meter.measure.apart += 1;
                continue;
            }
            field.meter.take(&sample(&common_a, &common_b, &|i| position(first + i)));
            continue;
        }
        // in between messages, lists end where the shorter of them does
        if interpolated && list_a.len() != list_b.len() && !matches!(field.axis_a, Axis::Unknown) {
            let shorter = list_a.len().min(list_b.len());
            if shorter == 0 {
                field.meter.measure.apart += 1;
                continue;
            }
            field.meter.take(&sample(&head(list_a, shorter), &head(list_b, shorter), &position));
            continue;
        }
        field.meter.take(&sample(list_a, list_b, &position));
    }
    axes_differ
}

/// True if arrays that are not both empty have nothing in common.
fn has_nothing_of(common: &List, a: &List, b: &List) -> bool {
    common.is_empty() && !(a.is_empty() && b.is_empty())
}

fn head(list: &List, length: usize) -> List {
    List::Double((0..length).filter_map(|i| list.number(i)).collect())
}

/// Equal up to rounding, seen from the far end of an axis.
fn near(x: f64, y: f64, step: f64) -> bool {
    x == y || (x - y).abs() <= 1e-9 * step.abs()
}

/// Arrays on different axes: the reference on the common range, the new one interpolated there, and the number of the
/// first element. `None` if the axes are the same.
fn on_common_axis(
    even: bool,
    a: &List,
    place_a: axis::Place<'_>,
    b: &List,
    place_b: axis::Place<'_>,
) -> Option<(List, List, usize)> {
    if let (axis::Place::Uniform { start, step }, axis::Place::Uniform { start: s, step: d }) =
        (place_a, place_b)
        && near(start, s, step)
        && near(step * a.len().max(1) as f64, d * a.len().max(1) as f64, step)
    {
        return None;
    }
    if place_a == place_b || place_a == axis::Place::Unknown || place_b == axis::Place::Unknown {
        return None;
    }
    let (mut common_a, mut common_b, mut first) = (Vec::new(), Vec::new(), None);
    for i in 0..a.len() {
        let found = place_a.position(i).and_then(|position| at(b, place_b, even, position));
        if let (Some(x), Some(y)) = (a.number(i), found) {
            first.get_or_insert(i);
            common_a.push(x);
            common_b.push(y);
        } else if first.is_some() {
            break;
        }
    }
    Some((List::Double(common_a), List::Double(common_b), first.unwrap_or(0)))
}

fn same_spacing(a: &Grid, b: &Grid) -> bool {
    let same = |a: &Side, b: &Side| {
        let length = a.length.max(1) as f64;
        near(a.start, b.start, a.step) && near(a.step * length, b.step * length, a.step)
    };
    same(&a.rows, &b.rows) && same(&a.columns, &b.columns)
}

/// Matrices on different grids: elements of the reference inside the other grid, the other interpolated there, and the
/// numbers of those elements.
fn on_common_grid(a: &List, grid_a: &Grid, b: &List, grid_b: &Grid) -> (List, List, Vec<usize>) {
    let (mut common_a, mut common_b, mut chosen) = (Vec::new(), Vec::new(), Vec::new());
    let width = grid_b.columns.length;
    // the element before a position and the share of the next; a rounding error is no distance
    let split = |side: &Side, position: f64| {
        let x = (position - side.start) / side.step;
        let x = if (x - x.round()).abs() < 1e-9 { x.round() } else { x };
        let last = side.length.checked_sub(1)? as f64;
        if !(0.0..=last).contains(&x) {
            return None;
        }
        let i = (x as usize).min(side.length.saturating_sub(2));
        Some((i, x - i as f64))
    };
    for j in 0..grid_a.rows.length {
        let Some((row, down)) = split(&grid_b.rows, grid_a.rows.at(j)) else { continue };
        for i in 0..grid_a.columns.length {
            let Some((column, right)) = split(&grid_b.columns, grid_a.columns.at(i)) else { continue };
            let index = j * grid_a.columns.length + i;
            let value = |row: usize, column: usize| b.number(row * width + column);
            let along = |row: usize| {
                let near = value(row, column)?;
                if right == 0.0 { Some(near) } else { Some(near + (value(row, column + 1)? - near) * right) }
            };
            let mixed = || {
                let near = along(row)?;
                if down == 0.0 { Some(near) } else { Some(near + (along(row + 1)? - near) * down) }
            };
            if let (Some(x), Some(y)) = (a.number(index), mixed()) {
                common_a.push(x);
                common_b.push(y);
                chosen.push(index);
            }
        }
    }
    (List::Double(common_a), List::Double(common_b), chosen)
}

#[cfg(test)]
mod tests {
    use prost_reflect::{
        DescriptorPool,
        prost_types::{
            DescriptorProto, FieldDescriptorProto, FileDescriptorProto,
            field_descriptor_proto::{Label, Type as Wire},
        },
    };

    use super::*;

    #[test]
    fn fields_that_say_when_are_known_by_name_and_type() {
        let field = |name: &str, number, label: Label, kind: Wire, of: &str| FieldDescriptorProto {
            name: Some(name.into()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(kind.into()),
            type_name: (!of.is_empty()).then(|| of.into()),
            ..Default::default()
        };
        let (one, many) = (Label::Optional, Label::Repeated);
        let stamp = ".google.protobuf.Timestamp";
        let message =
            |name: &str, field| DescriptorProto { name: Some(name.into()), field, ..Default::default() };
        let file = FileDescriptorProto {
            name: Some("robot.proto".into()),
            package: Some("lab".into()),
            syntax: Some("proto3".into()),
            dependency: vec!["google/protobuf/timestamp.proto".into()],
            message_type: vec![
                message(
                    "Header",
                    vec![
                        field("stamp", 1, one, Wire::Message, stamp),
                        field("seconds", 2, one, Wire::Double, ""),
                    ],
                ),
                message(
                    "Pose",
                    vec![
                        field("time", 1, one, Wire::Double, ""),
                        field("header", 2, one, Wire::Message, ".lab.Header"),
                        field("history", 3, many, Wire::Message, stamp),
                        field("timestamp", 4, one, Wire::Message, stamp),
                        field("x", 5, one, Wire::Double, ""),
                    ],
                ),
            ],
            ..Default::default()
        };
        let mut pool = DescriptorPool::global();
        pool.add_file_descriptor_proto(file).expect("a sound schema");
        let layout = Layout::of(&pool.get_message_by_name("lab.Pose").expect("the message"));
        let keys = (0..layout.leaves.len()).filter(|&leaf| is_key(&layout, leaf));
        let keys: Vec<&str> = keys.map(|leaf| layout.leaves[leaf].path.as_str()).collect();
        let expected =
            ["time", "header.stamp.seconds", "header.stamp.nanos", "timestamp.seconds", "timestamp.nanos"];
        assert_eq!(keys, expected);
    }
}
