//! Samples at common places: the new recording between its messages, arrays between their elements.

use percuss_picture::Side;

use super::values::is_same;
use crate::{
    axis::{Axis, Grid, Nodes, Spot, between, find, is_near},
    wire::{Layout, List, Type, Values},
};

/// Numbers interpolated between points of time; of what is no number, that of the nearest point.
pub(super) fn interpolate(points: &[(f64, Values)], time: f64, layout: &Layout, into: &mut Values) {
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

/// Elements of two arrays on the common part of their axes.
pub(super) struct Common {
    pub(super) a: Vec<f64>,
    pub(super) b: Vec<f64>,
    /// Numbers of the elements of the reference.
    pub(super) chosen: Vec<usize>,
    /// Elements of both that are not compared.
    pub(super) dropped: usize,
    pub(super) axes_differ: bool,
}

impl Common {
    /// * `unused`: elements of the new list that nothing is compared with
    fn of(
        length: usize,
        unused: usize,
        elements: impl Iterator<Item = (usize, f64, f64)>,
        axes_differ: bool,
    ) -> Self {
        let (mut a, mut b, mut chosen) = (Vec::new(), Vec::new(), Vec::new());
        for (i, x, y) in elements {
            a.push(x);
            b.push(y);
            chosen.push(i);
        }
        let dropped = unused + length - chosen.len();
        Self { a, b, chosen, dropped, axes_differ }
    }
}

/// The common part of two arrays on different axes; `None` if they are compared element by element.
///
/// * `even`: the arrays are even about the origin
/// * `interpolated`: the second stands between two messages
pub(super) fn common(
    [(list_a, axis_a, a), (list_b, axis_b, b)]: [(&List, &Axis, &Values); 2],
    even: bool,
    interpolated: bool,
) -> Option<Common> {
    match (axis_a.grid(a), axis_b.grid(b)) {
        (Some(a), Some(b)) if a != b && has_places(&a) && has_places(&b) => {
            return Some(on_common_grid((list_a, &a), (list_b, &b)));
        }
        (Some(_), Some(_)) => {}
        _ => {
            let common = on_common_axis(even, (list_a, axis_a.nodes(a)), (list_b, axis_b.nodes(b)));
            if common.is_some() {
                return common;
            }
        }
    }
    // in between messages, lists end where the shorter of them does
    let is_cut = interpolated && list_a.len() != list_b.len() && !matches!(axis_a, Axis::Unknown);
    let elements = (0..list_a.len()).map_while(|i| Some((i, list_a.number(i)?, list_b.number(i)?)));
    is_cut.then(|| Common::of(list_a.len(), list_b.len().saturating_sub(list_a.len()), elements, false))
}

/// True if every element of a grid has a place.
fn has_places(grid: &Grid) -> bool {
    let has_places = |side: &Side| match side {
        Side::Even { start, step, .. } => start.is_finite() && step.is_finite() && *step > 0.0,
        Side::Listed(_) => true,
    };
    has_places(&grid.rows) && has_places(&grid.columns)
}

/// Equal up to rounding, seen from the far end of an axis.
fn near(x: f64, y: f64, step: f64) -> bool {
    x == y || is_same(x, y) || (x - y).abs() <= 1e-9 * step.abs()
}

/// True if two uniform axes are the same over `length` elements, up to rounding.
fn are_near((start_a, step_a): (f64, f64), (start_b, step_b): (f64, f64), length: usize) -> bool {
    let length = length.max(1) as f64;
    near(start_a, start_b, step_a) && near(step_a * length, step_b * length, step_a)
}

/// True if listed positions are the same, up to rounding.
fn are_same_places(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(x, y)| is_near(*x, *y))
}

/// Arrays on different axes: the reference on the common range, the new one interpolated there. `None` if the axes are
/// the same.
fn on_common_axis(
    even: bool,
    (a, nodes_a): (&List, Nodes<'_>),
    (b, nodes_b): (&List, Nodes<'_>),
) -> Option<Common> {
    let are_same = match (nodes_a, nodes_b) {
        (Nodes::Uniform { start, step }, Nodes::Uniform { start: s, step: d }) => {
            are_near((start, step), (s, d), a.len())
        }
        (Nodes::Unknown, _) | (_, Nodes::Unknown) => true,
        (Nodes::Listed(a), Nodes::Listed(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(x, y)| x == y || is_same(*x, *y))
        }
        (Nodes::Sorted(a), Nodes::Sorted(b)) => are_same_places(a, b),
        _ => false,
    };
    if are_same {
        return None;
    }
    let place = |nodes: Nodes<'_>, i: usize| nodes.position(i).filter(|position| position.is_finite());
    let element = |i: usize| match nodes_a.spot(i).filter(|spot| spot.position.is_finite()) {
        Some(spot) => Some((i, a.number(i)?, between(b.len(), nodes_b, even, spot, |i| b.number(i))?)),
        // nothing but its number says where it belongs
        None => Some((i, a.number(i)?, b.number(i)?)),
    };
    let elements: Vec<_> = (0..a.len()).filter_map(element).collect();
    let used = elements.iter().filter_map(|&(i, ..)| place(nodes_a, i));
    let (from, to) = used.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), x| (from.min(x), to.max(x)));
    // what lies on the far side of a neighbour that is no part of the common range is not used
    let is_unused = |i: usize| match place(nodes_b, i) {
        None => place(nodes_a, i).is_some() || a.number(i).is_none(),
        Some(x) => {
            let next = (i + 1 < b.len()).then(|| place(nodes_b, i + 1)).flatten();
            let before = i.checked_sub(1).and_then(|i| place(nodes_b, i));
            from > to
                || (x < from && next.is_some_and(|next| next <= from))
                || (x > to && before.is_some_and(|before| before >= to))
        }
    };
    let unused = (0..b.len()).filter(|&i| is_unused(i)).count();
    Some(Common::of(a.len(), unused, elements.into_iter(), true))
}

/// Matrices on different grids: elements of the reference inside the other grid, the other interpolated there. Never between
/// the two sides of an interface: each is compared with the same side.
fn on_common_grid((a, grid_a): (&List, &Grid), (b, grid_b): (&List, &Grid)) -> Common {
    let width = grid_b.columns.length();
    // between the values of an element and the next, which need not be there if it has no share
    let weighted = |i: usize, share: f64, value: &dyn Fn(usize) -> Option<f64>| {
        let near = value(i)?;
        if share == 0.0 { Some(near) } else { Some(near + (value(i + 1)? - near) * share) }
    };
    let columns = grid_a.columns.length();
    // a message may claim more rows and columns than it has
    let rows = grid_a.rows.length().min(a.len().div_ceil(columns.max(1)));
    let there = 0..columns.min(a.len());
    let across: Vec<_> = there.map(|i| split(&grid_b.columns, spot(&grid_a.columns, i))).collect();
    let elements = (0..rows).flat_map(|j| {
        let down = split(&grid_b.rows, spot(&grid_a.rows, j));
        let element = move |(i, across): (usize, &Option<(usize, f64)>)| {
            let ((row, down), (column, right)) = (down?, (*across)?);
            let along = |row: usize| weighted(column, right, &|column| b.number(row * width + column));
            Some((j * columns + i, a.number(j * columns + i)?, weighted(row, down, &along)?))
        };
        across.iter().enumerate().filter_map(element)
    });
    // rows and columns of the other, as far as it has them, that are not beside those used
    let used = |side: &Side, length: usize, reference: &Side| {
        let (first, last) = (reference.at(0), reference.at(reference.length().saturating_sub(1)));
        let is_unused = |i: &usize| {
            // NaN beyond the end of a list
            let next = side.at(i + 1);
            side.at(*i) < first && (next.is_nan() || next <= first)
                || side.at(*i) > last && i.checked_sub(1).is_some_and(|before| side.at(before) >= last)
        };
        length - (0..length).filter(is_unused).count()
    };
    let unused = {
        let rows_b = grid_b.rows.length().min(b.len().div_ceil(width.max(1)));
        let used_rows = used(&grid_b.rows, rows_b, &grid_a.rows);
        let used_columns = used(&grid_b.columns, width.min(b.len()), &grid_a.columns);
        b.len().saturating_sub(used_rows * used_columns)
    };
    let same = |a: &Side, b: &Side| match (a, b) {
        (Side::Even { start, step, length }, Side::Even { start: s, step: d, .. }) => {
            are_near((*start, *step), (*s, *d), *length)
        }
        (Side::Listed(a), Side::Listed(b)) => are_same_places(a, b),
        _ => false,
    };
    let are_same = same(&grid_a.rows, &grid_b.rows) && same(&grid_a.columns, &grid_b.columns);
    Common::of(a.len(), unused, elements, !are_same)
}

/// Where an element of a side is.
fn spot(side: &Side, index: usize) -> Spot {
    Spot { position: side.at(index), is_lower: side.is_below_interface(index) }
}

/// The element of a side before a spot and the share of the next, if it lies inside; a rounding error is no distance.
fn split(side: &Side, spot: Spot) -> Option<(usize, f64)> {
    let (start, step, length) = match side {
        Side::Even { start, step, length } => (start, step, length),
        Side::Listed(positions) => return find(positions, spot),
    };
    let x = (spot.position - start) / step;
    let x = if (x - x.round()).abs() < 1e-9 { x.round() } else { x };
    let last = length.checked_sub(1)? as f64;
    // half a step beyond the first and last their values hold, as in an array
    if x.is_nan() || !(-0.5 - 1e-9..=last + 0.5 + 1e-9).contains(&x) {
        return None;
    }
    let x = x.clamp(0.0, last);
    let i = (x as usize).min(length.saturating_sub(2));
    Some((i, x - i as f64))
}
