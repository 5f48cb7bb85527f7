//! Samples at common places: the new recording between its messages, arrays between their elements.

use std::cell::Cell;

use percuss_picture::Side;

use super::values::is_same;
use crate::{
    axis::{Axis, find, interpolated, is_near},
    wire::{COUNT, Layout, Leaf, List, Type, Values},
};

/// What stands between messages.
pub(super) struct Between {
    pub(super) values: Values,
    /// Number of the nearest point: what is no number is that of it alone.
    pub(super) nearest: usize,
    /// For every leaf, elements of the longest list beyond the end of the shortest.
    pub(super) cut: Vec<usize>,
}

/// Numbers interpolated between points of time; of what is no number, and where lists of messages or keys of maps differ, that of
/// the nearest point. `None` if there is no point.
pub(super) fn interpolate(points: &[(f64, Values)], time: f64, layout: &Layout) -> Option<Between> {
    let distance = |i: &usize| (points[*i].0 - time).abs();
    let nearest = (0..points.len()).min_by(|i, j| distance(i).total_cmp(&distance(j)))?;
    let lists = &points[nearest].1.lists;
    // Lagrange: w_i = Π_{j≠i} (t − t_j)/(t_i − t_j)
    let weight = |i: usize| -> f64 {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, other)| (time - other.0) / (points[i].0 - other.0)).product()
    };
    let weights: Vec<f64> = (0..points.len()).map(weight).collect();
    let is_other = |leaf: &usize| points.iter().any(|(_, values)| values.lists[*leaf] != lists[*leaf]);
    let keys = (0..lists.len()).filter(|&leaf| layout.leaves[leaf].is_key).filter(is_other);
    let unlike: Vec<&str> = keys.map(|leaf| parent(&layout.leaves[leaf].path)).collect();
    let mut cut = vec![0; lists.len()];
    let list = |(leaf, (list, cut)): (usize, (&List, &mut usize))| {
        let Leaf { kind, path, .. } = &layout.leaves[leaf];
        let is_float = matches!(kind, Type::Double | Type::Float);
        let is_unlike = || unlike.iter().any(|parent| path.starts_with(parent));
        if !is_float || points.len() == 1 || is_unlike() {
            return list.clone();
        }
        let lengths = || points.iter().map(|(_, values)| values.lists[leaf].len());
        let length = lengths().min().unwrap_or(0);
        *cut = lengths().max().unwrap_or(0) - length;
        let value = |i: usize| -> f64 {
            let terms = points.iter().zip(&weights);
            terms.map(|((_, values), weight)| weight * values.lists[leaf].number(i).unwrap_or(0.0)).sum()
        };
        match list {
            List::Float(_) => List::Float((0..length).map(|i| value(i) as f32).collect()),
            _ => List::Double((0..length).map(value).collect()),
        }
    };
    let values = Values { lists: lists.iter().zip(&mut cut).enumerate().map(list).collect() };
    Some(Between { values, nearest, cut })
}

/// The path that leads to a count or to the keys of a map.
fn parent(path: &str) -> &str {
    path.strip_suffix(COUNT).unwrap_or_else(|| &path[..path.rfind('.').map_or(0, |dot| dot + 1)])
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
    /// * `unused`: elements of the new list that nothing is compared with, once all `elements` are there
    fn of(
        length: usize,
        elements: impl Iterator<Item = (usize, f64, f64)>,
        unused: impl FnOnce() -> usize,
        axes_differ: bool,
    ) -> Self {
        let (chosen, (a, b)): (Vec<usize>, (Vec<f64>, Vec<f64>)) =
            elements.map(|(i, x, y)| (i, (x, y))).unzip();
        let dropped = unused() + length - chosen.len();
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
    is_cut.then(|| Common::of(list_a.len(), elements, || list_b.len().saturating_sub(list_a.len()), false))
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

/// Elements of the new list that nothing was interpolated with.
fn count_unused(used: &[Cell<bool>]) -> usize {
    used.iter().filter(|used| !used.get()).count()
}

/// Arrays on different axes: the reference on the common range, the new one interpolated there.
fn on_common_axis(
    even: bool,
    (a, side_a): (&List, &Side),
    (b, side_b, axis_b): (&List, &Side, &Axis),
) -> Common {
    let position = |side: &Side, i: usize| Some(side.at(i)).filter(|position| position.is_finite());
    let used = vec![Cell::new(false); b.len()];
    let element = |i: usize| {
        let value_a = a.number(i)?;
        let Some(at) = position(side_a, i) else {
            // nothing but its number says where it belongs
            let value = b.number(i)?;
            used[i].set(true);
            return Some((i, value_a, value));
        };
        // the last two that were asked for
        let asked = Cell::new([None; 2]);
        let number = |i| b.number(i).inspect(|_| asked.set([asked.get()[1], Some(i)]));
        let value = axis_b.value(side_b, even, place(side_a, i), number)?;
        let asked = asked.get();
        // beside one of them the other has no share, but for rounding
        let step = match asked {
            [Some(i), Some(j)] => side_b.at(i) - side_b.at(j),
            _ => 0.0,
        };
        let is_at = |i: &usize| near(side_b.at(*i), at, step);
        let beside = asked.into_iter().flatten().find(is_at);
        let taken = beside.map_or(asked, |i| [Some(i), None]);
        taken.into_iter().flatten().for_each(|i| used[i].set(true));
        Some((i, value_a, value))
    };
    Common::of(a.len(), (0..a.len()).filter_map(element), || count_unused(&used), true)
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
    let used = &vec![Cell::new(false); b.len()];
    let elements = (0..rows).flat_map(|j| {
        let down = split(rows_b, place(rows_a, j));
        let element = move |(i, across): (usize, &Option<(usize, f64)>)| {
            let (down, across) = (down?, (*across)?);
            let along = |row: usize| interpolated(across, |column| b.number(row * width + column));
            let found = (j * columns + i, a.number(j * columns + i)?, interpolated(down, along)?);
            let both = |(i, share): (usize, f64)| i..=i + usize::from(share > 0.0);
            let taken = both(down).flat_map(|row| both(across).map(move |column| row * width + column));
            taken.for_each(|i| used[i].set(true));
            Some(found)
        };
        across.iter().enumerate().filter_map(element)
    });
    let axes_differ = !(are_same(rows_a, rows_b) && are_same(columns_a, columns_b));
    Common::of(a.len(), elements, || count_unused(used), axes_differ)
}
