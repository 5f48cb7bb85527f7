//! Samples at common places: the new recording between its messages, arrays between their elements.

use percuss_picture::Side;

use super::values::is_same;
use crate::{
    axis::{Axis, find, interpolated, is_near},
    wire::{Layout, List, Type, Values},
};

/// Numbers interpolated between points of time; of what is no number, that of the nearest point. `None` if there is no point.
pub(super) fn interpolate(points: &[(f64, Values)], time: f64, layout: &Layout) -> Option<Values> {
    let (_, nearest) = points.iter().min_by(|x, y| (x.0 - time).abs().total_cmp(&(y.0 - time).abs()))?;
    // Lagrange: w_i = Π_{j≠i} (t − t_j)/(t_i − t_j)
    let weight = |i: usize| -> f64 {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, other)| (time - other.0) / (points[i].0 - other.0)).product()
    };
    let weights: Vec<f64> = (0..points.len()).map(weight).collect();
    let list = |(leaf, list): (usize, &List)| {
        let is_float = matches!(layout.leaves[leaf].kind, Type::Double | Type::Float);
        if !is_float || points.len() == 1 {
            return list.clone();
        }
        let length = points.iter().map(|(_, values)| values.lists[leaf].len()).min().unwrap_or(0);
        let value = |i: usize| -> f64 {
            let terms = points.iter().zip(&weights);
            terms.map(|((_, values), weight)| weight * values.lists[leaf].number(i).unwrap_or(0.0)).sum()
        };
        match list {
            List::Float(_) => List::Float((0..length).map(|i| value(i) as f32).collect()),
            _ => List::Double((0..length).map(value).collect()),
        }
    };
    Some(Values { lists: nearest.lists.iter().enumerate().map(list).collect() })
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
    let (sides_a, sides_b) = (axis_a.sides(a, list_a.len()), axis_b.sides(b, list_b.len()));
    let are_sound = sides_a.iter().chain(&sides_b).all(has_places);
    match (sides_a.as_slice(), sides_b.as_slice()) {
        ([side_a], [side_b]) if are_sound && !are_same(side_a, side_b) => {
            return Some(on_common_axis(even, (list_a, side_a), (list_b, side_b, axis_b)));
        }
        ([rows_a, columns_a], [rows_b, columns_b]) if are_sound && sides_a != sides_b => {
            return Some(on_common_grid((list_a, [rows_a, columns_a]), (list_b, [rows_b, columns_b])));
        }
        _ => {}
    }
    // in between messages, lists end where the shorter of them does
    let is_cut = interpolated && list_a.len() != list_b.len() && !matches!(axis_a, Axis::Unknown);
    let elements = (0..list_a.len()).map_while(|i| Some((i, list_a.number(i)?, list_b.number(i)?)));
    is_cut.then(|| Common::of(list_a.len(), list_b.len().saturating_sub(list_a.len()), elements, false))
}

/// True if every element has a place.
fn has_places(side: &Side) -> bool {
    match side {
        Side::Even { start, step, .. } => start.is_finite() && step.is_finite() && *step > 0.0,
        Side::Listed(_) => true,
    }
}

/// Equal up to rounding, seen from the far end of an axis.
fn near(x: f64, y: f64, step: f64) -> bool {
    x == y || is_same(x, y) || (x - y).abs() <= 1e-9 * step.abs()
}

/// True if the elements of two sides are at the same places, up to rounding.
fn are_same(a: &Side, b: &Side) -> bool {
    match (a, b) {
        (Side::Even { start, step, length }, Side::Even { start: s, step: d, .. }) => {
            let length = (*length).max(1) as f64;
            near(*start, *s, *step) && near(step * length, d * length, *step)
        }
        (Side::Listed(a), Side::Listed(b)) => {
            a.len() == b.len() && a.iter().zip(&**b).all(|(x, y)| is_near(*x, *y) || is_same(*x, *y))
        }
        _ => false,
    }
}

/// Where an element is, and whether it is the lower of two.
fn place(side: &Side, index: usize) -> (f64, bool) {
    (side.at(index), side.is_below_interface(index))
}

/// Arrays on different axes: the reference on the common range, the new one interpolated there.
fn on_common_axis(
    even: bool,
    (a, side_a): (&List, &Side),
    (b, side_b, axis_b): (&List, &Side, &Axis),
) -> Common {
    let position = |side: &Side, i: usize| Some(side.at(i)).filter(|position| position.is_finite());
    let element = |i: usize| {
        let value = match position(side_a, i) {
            Some(_) => axis_b.value(side_b, even, place(side_a, i), |i| b.number(i))?,
            // nothing but its number says where it belongs
            None => b.number(i)?,
        };
        Some((i, a.number(i)?, value))
    };
    let elements: Vec<_> = (0..a.len()).filter_map(element).collect();
    let used = elements.iter().filter_map(|&(i, ..)| position(side_a, i));
    let (from, to) = used.fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), x| (from.min(x), to.max(x)));
    // what lies on the far side of a neighbour that is no part of the common range is not used
    let is_unused = |i: usize| match position(side_b, i) {
        None => position(side_a, i).is_some() || a.number(i).is_none(),
        Some(x) => {
            let next = (i + 1 < b.len()).then(|| position(side_b, i + 1)).flatten();
            let before = i.checked_sub(1).and_then(|i| position(side_b, i));
            from > to
                || (x < from && next.is_some_and(|next| next <= from))
                || (x > to && before.is_some_and(|before| before >= to))
        }
    };
    let unused = (0..b.len()).filter(|&i| is_unused(i)).count();
    Common::of(a.len(), unused, elements.into_iter(), true)
}

/// Matrices on different grids: elements of the reference inside the other grid, the other interpolated there. Never between
/// the two sides of an interface: each is compared with the same side.
fn on_common_grid(
    (a, [rows_a, columns_a]): (&List, [&Side; 2]),
    (b, [rows_b, columns_b]): (&List, [&Side; 2]),
) -> Common {
    let width = columns_b.length();
    // a rounding error is no distance
    let split = |side: &Side, place: (f64, bool)| match find(side, place)? {
        (i, share) if share < 1e-9 => Some((i, 0.0)),
        (i, share) if share > 1.0 - 1e-9 => Some((i + 1, 0.0)),
        found => Some(found),
    };
    let columns = columns_a.length();
    // a message may claim more rows and columns than it has
    let rows = rows_a.length().min(a.len().div_ceil(columns.max(1)));
    let there = 0..columns.min(a.len());
    let across: Vec<_> = there.map(|i| split(columns_b, place(columns_a, i))).collect();
    let elements = (0..rows).flat_map(|j| {
        let down = split(rows_b, place(rows_a, j));
        let element = move |(i, across): (usize, &Option<(usize, f64)>)| {
            let (down, across) = (down?, (*across)?);
            let along = |row: usize| interpolated(across, |column| b.number(row * width + column));
            Some((j * columns + i, a.number(j * columns + i)?, interpolated(down, along)?))
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
        let height = rows_b.length().min(b.len().div_ceil(width.max(1)));
        let used_rows = used(rows_b, height, rows_a);
        let used_columns = used(columns_b, width.min(b.len()), columns_a);
        b.len().saturating_sub(used_rows * used_columns)
    };
    Common::of(a.len(), unused, elements, !(are_same(rows_a, rows_b) && are_same(columns_a, columns_b)))
}
