//! Axes of arrays: positions of their elements, and values between them.

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
    /// Described by leaves of the same message.
    Described(Places),
    /// Listed in the metadata.
    Listed(Vec<f64>),
    /// Rows and columns, both described by leaves of the same message.
    Matrix([Places; 2]),
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
        let names: Vec<&str> = names.split(',').map(str::trim).collect();
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

    /// The positions of a message; `None` if it does not say them, or they are not sound.
    ///
    /// * `length`: number of elements, where the message does not say it
    fn side(&self, values: &Values, length: usize) -> Option<Side> {
        let number = |leaf: usize| values.lists[leaf].number(0);
        let length = self.length.map_or(Some(length), |leaf| Some(number(leaf)? as usize))?;
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
        if let Some((rows, columns)) = text.split_once(';') {
            let [rows, columns] = [rows, columns].map(|names| Places::of(names, true, path, layout));
            return rows.zip(columns).map_or(Self::Unknown, |(rows, columns)| Self::Matrix([rows, columns]));
        }
        if let Some(positions) = convention::numbers(text) {
            return Self::Listed(positions);
        }
        Places::of(text, false, path, layout).map_or(Self::Unknown, Self::Described)
    }

    /// The arrays of a channel that are matrices.
    pub(crate) fn matrices(channel: &Channel) -> impl Iterator<Item = usize> {
        let layout = channel.layout.as_deref().into_iter();
        let leaves = layout.flat_map(|layout| (0..layout.leaves.len()).map(move |leaf| (leaf, layout)));
        leaves.filter(|(leaf, layout)| Self::of(*leaf, layout, channel).is_matrix()).map(|(leaf, _)| leaf)
    }

    /// True for rows and columns.
    pub(crate) fn is_matrix(&self) -> bool {
        matches!(self, Self::Matrix(_))
    }

    /// True if messages may list the positions of its elements.
    pub(crate) fn is_listed(&self) -> bool {
        self.places().iter().any(|places| places.listed.is_some())
    }

    /// What leaves of a message say of places: of rows and columns, or along an array.
    fn places(&self) -> &[Places] {
        match self {
            Self::Described(places) => std::slice::from_ref(places),
            Self::Matrix(places) => places,
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

    /// The positions of the `length` elements of an array as they are in a message.
    pub(crate) fn side(&self, values: &Values, length: usize) -> Option<Side> {
        let Self::Described(places) = self else { return None };
        places.side(values, length)
    }

    /// Positions of the elements of an array in a message.
    pub(crate) fn nodes<'a>(&'a self, values: &'a Values) -> Nodes<'a> {
        match self {
            Self::Described(places) => match places.list(values) {
                Some(positions) if flaw(positions, positions.len()).is_none() => Nodes::Listed(positions),
                Some(_) => Nodes::Unknown,
                None => {
                    let number = |leaf: usize| values.lists[leaf].number(0);
                    let steps = number(places.start).zip(number(places.step));
                    steps.map_or(Nodes::Unknown, |(start, step)| Nodes::even(start, step))
                }
            },
            Self::Listed(positions) => Nodes::Listed(positions),
            Self::Matrix(_) | Self::Unknown => Nodes::Unknown,
        }
    }

    /// The grid of a matrix as it is in a message.
    pub(crate) fn grid(&self, values: &Values) -> Option<Grid> {
        let Self::Matrix([rows, columns]) = self else { return None };
        Some(Grid { rows: rows.side(values, 0)?, columns: columns.side(values, 0)? })
    }

    /// What is wrong with the positions that a message lists for the elements of an array, in words behind its name, if anything is:
    /// they are too many or too few, no numbers, or not in their order.
    pub(crate) fn flaw(&self, leaf: usize, values: &Values) -> Option<String> {
        self.places().iter().find_map(|places| {
            let number = |leaf: usize| values.lists[leaf].number(0).map(|number| number as usize);
            let length = places.length.map_or(Some(values.lists[leaf].len()), number)?;
            let found = flaw(places.list(values)?, length)?;
            Some(format!("lists {found} along {}", places.coordinate))
        })
    }
}

/// Rows and columns of a matrix.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Grid {
    pub(crate) rows: Side,
    pub(crate) columns: Side,
}

/// The positions of the elements of an array in a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Nodes<'a> {
    Uniform { start: f64, step: f64 },
    Listed(&'a [f64]),
    Unknown,
}

impl<'a> Nodes<'a> {
    pub(crate) fn of(side: &'a Side) -> Self {
        match side {
            Side::Even { start, step, .. } => Self::even(*start, *step),
            Side::Listed(positions) => Self::Listed(positions),
        }
    }

    fn even(start: f64, step: f64) -> Self {
        if step > 0.0 { Self::Uniform { start, step } } else { Self::Unknown }
    }

    /// Position of an element, if it has one.
    pub(crate) fn position(&self, index: usize) -> Option<f64> {
        match self {
            Self::Uniform { start, step } => Some(start + index as f64 * step),
            Self::Listed(positions) => positions.get(index).copied(),
            Self::Unknown => None,
        }
    }

    /// Where an element is among others.
    pub(crate) fn spot(&self, index: usize) -> Option<Spot> {
        let is_lower = matches!(self, Self::Listed(positions)
            if index > 0 && positions.get(index - 1..=index).is_some_and(|pair| pair[0] == pair[1]));
        Some(Spot { position: self.position(index)?, is_lower })
    }
}

/// A position on an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spot {
    pub(crate) position: f64,
    /// Of two elements at this position, on the two sides of an interface, the second is meant.
    pub(crate) is_lower: bool,
}

impl From<f64> for Spot {
    /// At an interface the upper side.
    fn from(position: f64) -> Self {
        Self { position, is_lower: false }
    }
}

/// True if positions are equal up to rounding.
pub(crate) fn is_near(x: f64, y: f64) -> bool {
    x == y || (x - y).abs() <= ROUNDING * x.abs().max(y.abs())
}

/// The element of listed positions at or before a spot, and the share of the next: never of two on both sides of an interface.
pub(crate) fn find(positions: &[f64], spot: Spot) -> Option<(usize, f64)> {
    let position = spot.position;
    let mut at = (0..positions.len()).filter(|&i| is_near(positions[i], position));
    let found = if spot.is_lower { at.next_back() } else { at.next() };
    if let Some(i) = found {
        return Some((i, 0.0));
    }
    let i = positions.windows(2).position(|pair| pair[0] < position && position < pair[1])?;
    Some((i, (position - positions[i]) / (positions[i + 1] - positions[i])))
}

/// Value of an array of `length` elements at a position of its axis.
///
/// Linear between elements. Up to half a step beyond the first and last element their values hold, or, where the
/// array is even about the origin and the position lies between it and the first element, the parabola through the
/// first two. Nothing farther out, and nothing beside an element that is not there. Of listed positions nothing beyond the first and
/// last; at one that stands twice, an interface, the value of the side that the spot names, and none between both.
pub(crate) fn between(
    length: usize,
    nodes: Nodes<'_>,
    even: bool,
    spot: impl Into<Spot>,
    value: impl Fn(usize) -> Option<f64>,
) -> Option<f64> {
    let spot = spot.into();
    // the share of the next element, which need not be there if it has none
    let interpolated = |i: usize, share: f64| {
        let from = value(i)?;
        if share == 0.0 { Some(from) } else { Some(from + (value(i + 1)? - from) * share) }
    };
    match nodes {
        Nodes::Uniform { start, step } => {
            let position = spot.position;
            let x = (position - start) / step;
            let last = length.checked_sub(1)? as f64;
            // half a step, and some room for rounding
            let reach = 0.5 + 1e-9;
            if x < -reach || x > last + reach {
                None
            } else if x < 0.0 && even && length > 1 {
                let (r0, r1) = (start, start + step);
                let (p0, p1) = (value(0)?, value(1)?);
                Some(p0 + (p1 - p0) * (position * position - r0 * r0) / (r1 * r1 - r0 * r0))
            } else {
                let x = x.clamp(0.0, last);
                interpolated(x as usize, x - x.floor())
            }
        }
        Nodes::Listed(positions) => find(positions, spot).and_then(|(i, share)| interpolated(i, share)),
        Nodes::Unknown => None,
    }
}

/// Value of a matrix at a row and a column position, linear in both as [`between`] has it.
///
/// * `list`: the matrix, row-major; nothing if it has not as many elements as the grid
/// * `rows`, `columns`: of the whole matrix, of which a message may leave out what is at rest; 0 there
/// * `even`: about the origin of the columns
pub(crate) fn at_point(
    list: &List,
    grid: &Grid,
    (rows, columns): (usize, usize),
    even: bool,
    (row, column): (f64, f64),
) -> Option<f64> {
    let (height, width) = (grid.rows.length(), grid.columns.length());
    if height.checked_mul(width) != Some(list.len()) {
        return None;
    }
    let element = |j: usize, i: usize| {
        if j < height && i < width { list.number(j * width + i) } else { Some(0.0) }
    };
    between(rows.max(height), Nodes::of(&grid.rows), false, row, |j| {
        between(columns.max(width), Nodes::of(&grid.columns), even, column, |i| element(j, i))
    })
}
