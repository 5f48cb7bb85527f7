//! Axes of arrays: positions of their elements, and values between them.

use std::sync::Arc;

use percuss_picture::Side;

use crate::{
    channel::Channel,
    convention,
    wire::{Layout, Leaf, List, Type, Values},
};

/// Distance of positions that counts as rounding, relative to the position.
const ROUNDING: f64 = 1e-12;

/// Positions of the elements of an array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Axis {
    /// Described by leaves of the same message: along one side, or of rows and of columns.
    Described(Vec<Places>),
    /// Listed in the metadata, in any order.
    Listed(Arc<[f64]>),
    /// Not given.
    Unknown,
}

/// The leaves that say where the elements along one side of an array are: at the positions of a list where it has any, else at
/// `start + i·step`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Places {
    start: usize,
    step: usize,
    /// Number of elements, of a side of a matrix.
    length: Option<usize>,
    listed: Option<usize>,
    /// Name of the coordinate: `r0,dr` is `r`.
    coordinate: String,
}

impl Places {
    /// * `names`: of leaves beside that of the array, `z0,dz,nz,z` in a matrix and `s0,ds,s` else; the last may be missing
    fn of(names: &str, is_matrix: bool, path: &str, layout: &Layout) -> Option<Self> {
        let prefix = path.rsplit_once('.').map_or(String::new(), |(prefix, _)| format!("{prefix}."));
        // of a text that is no axis it may have very many
        let names: Vec<&str> = names.split(',').map(str::trim).take(5).collect();
        let find = |place: usize| layout.find(&format!("{prefix}{}", names.get(place)?));
        let number = |place| {
            find(place).filter(|&leaf| layout.leaves[leaf].is_single && layout.leaves[leaf].kind.is_number())
        };
        let list = |place| {
            let is_list = |leaf: &Leaf| leaf.lists == 1 && leaf.kind == Type::Double;
            find(place).filter(|&leaf| is_list(&layout.leaves[leaf]))
        };
        let (length, listed) = if is_matrix { (Some(number(2)?), list(3)) } else { (None, list(2)) };
        let coordinate = names[0].strip_suffix('0').unwrap_or(names[0]).to_owned();
        // a list that is named has to be there
        let is_whole = !is_matrix || names.len() == if listed.is_some() { 4 } else { 3 };
        Some(Self { start: number(0)?, step: number(1)?, length, listed, coordinate }).filter(|_| is_whole)
    }

    /// The positions that a message lists, if it does.
    fn list<'a>(&self, values: &'a Values) -> Option<&'a [f64]> {
        match &values.lists[self.listed?] {
            List::Double(positions) if !positions.is_empty() => Some(positions),
            _ => None,
        }
    }

    /// Number of elements, if it is said; of an array that says none, its own.
    fn length(&self, values: &Values, own: usize) -> Option<usize> {
        self.length.map_or(Some(own), |leaf| Some(values.lists[leaf].number(0)? as usize))
    }

    /// The positions of a message; `None` if it does not say them, or they are not sound.
    ///
    /// * `own`: number of elements, where the message does not say it
    fn side(&self, values: &Values, own: usize) -> Option<Side> {
        let (number, length) = (|leaf: usize| values.lists[leaf].number(0), self.length(values, own)?);
        match self.list(values) {
            Some(positions) => flaw(positions, length).is_none().then(|| Side::Listed(positions.into())),
            None => Some(Side::Even { start: number(self.start)?, step: number(self.step)?, length }),
        }
    }
}

/// What is wrong with listed positions of as many elements, if anything is.
fn flaw(positions: &[f64], length: usize) -> Option<String> {
    let count = positions.len();
    if count != length {
        return Some(format!("{count} positions for {length} elements"));
    }
    if let Some(wild) = positions.iter().find(|position| !position.is_finite()) {
        return Some(format!("the position {wild}"));
    }
    let pair = positions.windows(2).find(|pair| pair[1] < pair[0])?;
    Some(format!("the position {} behind {}", pair[1], pair[0]))
}

impl Axis {
    /// The axis of an array, from the metadata of its channel; lists inside lists have none.
    pub(crate) fn of(leaf: usize, layout: &Layout, channel: &Channel) -> Self {
        if layout.leaves[leaf].lists != 1 {
            return Self::Unknown;
        }
        let path = &layout.leaves[leaf].path;
        let Some(text) = channel.metadata.get(&convention::axis(path)) else {
            return Self::Unknown;
        };
        let sides = match text.split_once(';') {
            Some((rows, columns)) => vec![rows, columns],
            None => vec![text.as_str()],
        };
        if let (1, Some(positions)) = (sides.len(), convention::numbers(text)) {
            return Self::Listed(positions.into());
        }
        let places = sides.iter().map(|names| Places::of(names, sides.len() == 2, path, layout));
        places.collect::<Option<_>>().map_or(Self::Unknown, Self::Described)
    }

    /// The arrays of a channel that are matrices.
    pub(crate) fn matrices(channel: &Channel) -> impl Iterator<Item = usize> {
        let layout = channel.layout.as_deref().into_iter();
        let leaves = layout.flat_map(|layout| (0..layout.leaves.len()).map(move |leaf| (leaf, layout)));
        leaves.filter(|(leaf, layout)| Self::of(*leaf, layout, channel).is_matrix()).map(|(leaf, _)| leaf)
    }

    /// True for rows and columns.
    pub(crate) fn is_matrix(&self) -> bool {
        self.places().len() == 2
    }

    /// True if messages may list the positions of its elements.
    pub(crate) fn is_listed(&self) -> bool {
        self.places().iter().any(|places| places.listed.is_some())
    }

    /// What leaves of a message say of places: of rows and columns, or along an array.
    fn places(&self) -> &[Places] {
        match self {
            Self::Described(places) => places,
            Self::Listed(_) | Self::Unknown => &[],
        }
    }

    /// Names of the coordinates: `r0,dr` is `r`, lists of positions are radii; none without an axis.
    pub(crate) fn coordinates(&self) -> Vec<&str> {
        match self {
            Self::Listed(_) => vec!["r"],
            _ => self.places().iter().map(|places| places.coordinate.as_str()).collect(),
        }
    }

    /// Name of the coordinate of an array; lists carry no name, they are radii.
    pub(crate) fn coordinate(&self) -> &str {
        if self.is_matrix() { "index" } else { self.coordinates().first().copied().unwrap_or("index") }
    }

    /// The positions of the `length` elements of an array as they are in a message, or of the rows and of the columns of a matrix;
    /// none if it does not say them, or they are not sound.
    pub(crate) fn sides(&self, values: &Values, length: usize) -> Vec<Side> {
        let sides: Option<Vec<Side>> = match self {
            Self::Described(places) => places.iter().map(|places| places.side(values, length)).collect(),
            Self::Listed(positions) => Some(vec![Side::Listed(positions.clone())]),
            Self::Unknown => None,
        };
        sides.unwrap_or_default()
    }

    /// The positions of the `length` elements of an array that is no matrix, if no two are at the same one for want of a step.
    pub(crate) fn side(&self, values: &Values, length: usize) -> Option<Side> {
        let [side] = <[Side; 1]>::try_from(self.sides(values, length)).ok()?;
        // false for NaN
        let has_step = if let Side::Even { step, .. } = side { step > 0.0 } else { true };
        has_step.then_some(side)
    }

    /// Value of an array at a position of its side, as [`between`] has it; where positions are listed in the metadata, in whatever order,
    /// that of the element at the position, else between two that follow each other.
    pub(crate) fn value(
        &self,
        side: &Side,
        even: bool,
        place: (f64, bool),
        value: impl Fn(usize) -> Option<f64>,
    ) -> Option<f64> {
        let Self::Listed(positions) = self else { return between(side, even, place, value) };
        let (position, _) = place;
        let at = positions.iter().position(|known| *known == position).map(|i| (i, 0.0));
        let inside = || {
            let i = positions.windows(2).position(|pair| pair[0] < position && position < pair[1])?;
            Some((i, (position - positions[i]) / (positions[i + 1] - positions[i])))
        };
        interpolated(at.or_else(inside)?, value)
    }

    /// What is wrong with the positions that a message lists for the elements of an array, in words behind its name, if anything is:
    /// they are too many or too few, no numbers, or not in their order.
    pub(crate) fn flaw(&self, leaf: usize, values: &Values) -> Option<String> {
        self.places().iter().find_map(|places| {
            let length = places.length(values, values.lists[leaf].len())?;
            let found = flaw(places.list(values)?, length)?;
            Some(format!("lists {found} along {}", places.coordinate))
        })
    }
}

/// True if positions are equal up to rounding.
pub(crate) fn is_near(x: f64, y: f64) -> bool {
    x == y || (x - y).abs() <= ROUNDING * x.abs().max(y.abs())
}

/// True if the first of listed positions is half a step from an axis, as the first column of a graded mesh: between both it is the value there.
pub(crate) fn is_beside_axis(positions: &[f64]) -> bool {
    matches!(positions, [first, second, ..] if (second - 3.0 * first).abs() <= 1e-9 * second.abs())
}

/// The element of a side at or before a position, and the share of the next: never of two on both sides of an interface.
///
/// Up to half a step beyond the first and last element there is nothing but these; of listed positions nothing but what is beside the axis.
///
/// * `is_lower`: of two elements at this position, on the two sides of an interface, the second is meant
pub(crate) fn find(side: &Side, (position, is_lower): (f64, bool)) -> Option<(usize, f64)> {
    match side {
        Side::Even { start, step, length } => {
            let (x, last) = ((position - start) / step, length.checked_sub(1)? as f64);
            // half a step, and some room for rounding
            let reach = 0.5 + 1e-9;
            let is_inside = *step > 0.0 && x >= -reach && x <= last + reach;
            let x = x.clamp(0.0, last);
            is_inside.then_some((x as usize, x - x.floor()))
        }
        Side::Listed(positions) => {
            let is_before = |known: &f64| *known < position && !is_near(*known, position);
            let first = positions.partition_point(is_before);
            let next = positions.partition_point(|known| *known < position || is_near(*known, position));
            if first < next {
                return Some((if is_lower { next - 1 } else { first }, 0.0));
            }
            let Some(before) = next.checked_sub(1) else {
                return (is_beside_axis(positions) && position >= 0.0).then_some((0, 0.0));
            };
            let (from, to) = (positions[before], *positions.get(next)?);
            Some((before, (position - from) / (to - from)))
        }
    }
}

/// Value of an array at a position of one of its sides.
///
/// Linear between elements. Up to half a step beyond the first and last element their values hold, or, where the
/// array is even about the origin and the position lies between it and the first element, the parabola through the
/// first two. Nothing farther out, and nothing beside an element that is not there. Of listed positions nothing beyond the
/// last; at one that stands twice, an interface, the value of the side that is meant, and none between both.
pub(crate) fn between(
    side: &Side,
    even: bool,
    place: (f64, bool),
    value: impl Fn(usize) -> Option<f64>,
) -> Option<f64> {
    let (i, share) = find(side, place)?;
    let first = match side {
        Side::Even { start, step, length } => (*length > 1).then_some((*start, start + step)),
        Side::Listed(positions) => positions.first().copied().zip(positions.get(1).copied()),
    };
    match first {
        Some((r0, r1)) if even && place.0 < r0 => {
            let (p0, p1) = (value(0)?, value(1)?);
            Some(p0 + (p1 - p0) * (place.0 * place.0 - r0 * r0) / (r1 * r1 - r0 * r0))
        }
        _ => interpolated((i, share), value),
    }
}

/// Value between an element and the next, which need not be there if it has no share.
pub(crate) fn interpolated((i, share): (usize, f64), value: impl Fn(usize) -> Option<f64>) -> Option<f64> {
    let from = value(i)?;
    if share == 0.0 { Some(from) } else { Some(from + (value(i + 1)? - from) * share) }
}

/// Value of a curve at a time, linear between its points; `None` outside of them.
pub(crate) fn linear(curve: &[(f64, f64)], at: f64) -> Option<f64> {
    let next = curve.partition_point(|(time, _)| *time < at);
    let (end, last) = *curve.get(next)?;
    if end == at {
        return Some(last);
    }
    let (start, first) = *curve.get(next.checked_sub(1)?)?;
    Some(first + (last - first) * (at - start) / (end - start))
}
