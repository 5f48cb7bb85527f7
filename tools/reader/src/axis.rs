//! Axes of arrays: positions of their elements, and values between them.

use percuss_picture::Side;

use crate::{
    channel::Channel,
    convention,
    wire::{Layout, List, Values},
};

/// Positions of the elements of an array.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Axis {
    /// `start + i·step`, taken from leaves of the same message.
    Uniform { start: usize, step: usize, coordinate: String },
    /// Listed in the metadata.
    Listed(Vec<f64>),
    /// Rows and columns: leaves with start, step and number of each.
    Matrix { rows: [usize; 3], columns: [usize; 3], coordinates: [String; 2] },
    /// Not given.
    Unknown,
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
        let prefix = path.rsplit_once('.').map_or(String::new(), |(prefix, _)| format!("{prefix}."));
        let find = |name: &str| {
            let found = layout.find(&format!("{prefix}{}", name.trim()));
            found.filter(|&leaf| layout.leaves[leaf].is_single && layout.leaves[leaf].kind.is_number())
        };
        let coordinate = |text: &str| {
            let name = text.split(',').next().unwrap_or_default().trim();
            name.strip_suffix('0').unwrap_or(name).to_owned()
        };
        if let Some((rows, columns)) = text.split_once(';') {
            let triple = |text: &str| -> Option<[usize; 3]> {
                text.split(',').map(find).collect::<Option<Vec<_>>>()?.try_into().ok()
            };
            return match (triple(rows), triple(columns)) {
                (Some(r), Some(c)) => {
                    let coordinates = [coordinate(rows), coordinate(columns)];
                    Self::Matrix { rows: r, columns: c, coordinates }
                }
                _ => Self::Unknown,
            };
        }
        if let Some(positions) = convention::numbers(text) {
            return Self::Listed(positions);
        }
        let mut names = text.split(',').map(find);
        match (names.next().flatten(), names.next().flatten()) {
            (Some(start), Some(step)) => Self::Uniform { start, step, coordinate: coordinate(text) },
            _ => Self::Unknown,
        }
    }

    /// The arrays of a channel that are matrices.
    pub(crate) fn matrices(channel: &Channel) -> impl Iterator<Item = usize> {
        let layout = channel.layout.as_deref().into_iter();
        let leaves = layout.flat_map(|layout| (0..layout.leaves.len()).map(move |leaf| (leaf, layout)));
        leaves.filter(|(leaf, layout)| Self::of(*leaf, layout, channel).is_matrix()).map(|(leaf, _)| leaf)
    }

    /// True for rows and columns.
    pub(crate) fn is_matrix(&self) -> bool {
        matches!(self, Self::Matrix { .. })
    }

    /// Names of the coordinates: `r0,dr` is `r`, lists of positions are radii; none without an axis.
    pub(crate) fn coordinates(&self) -> Vec<&str> {
        match self {
            Self::Uniform { coordinate, .. } => vec![coordinate],
            Self::Listed(_) => vec!["r"],
            Self::Matrix { coordinates, .. } => coordinates.iter().map(String::as_str).collect(),
            Self::Unknown => Vec::new(),
        }
    }

    /// Name of the coordinate of an array; lists carry no name, they are radii.
    pub(crate) fn coordinate(&self) -> &str {
        if self.is_matrix() { "index" } else { self.coordinates().first().copied().unwrap_or("index") }
    }

    /// First position and step of a uniform axis as they are in a message.
    pub(crate) fn uniform(&self, values: &Values) -> Option<(f64, f64)> {
        let Self::Uniform { start, step, .. } = self else { return None };
        Some((values.lists[*start].number(0)?, values.lists[*step].number(0)?))
    }

    /// Positions of the elements of an array in a message.
    pub(crate) fn nodes(&self, values: &Values) -> Nodes<'_> {
        match self {
            Self::Uniform { .. } => match self.uniform(values) {
                Some((start, step)) if step > 0.0 => Nodes::Uniform { start, step },
                _ => Nodes::Unknown,
            },
            Self::Listed(positions) => Nodes::Listed(positions),
            Self::Matrix { .. } | Self::Unknown => Nodes::Unknown,
        }
    }

    /// The grid of a matrix as it is in a message.
    pub(crate) fn grid(&self, values: &Values) -> Option<Grid> {
        let Self::Matrix { rows, columns, .. } = self else { return None };
        let side = |leaves: &[usize; 3]| {
            let number = |i: usize| values.lists[leaves[i]].number(0);
            Some(Side { start: number(0)?, step: number(1)?, length: number(2)? as usize })
        };
        Some(Grid { rows: side(rows)?, columns: side(columns)? })
    }
}

/// Rows and columns of a matrix.
#[derive(Clone, Copy, Debug, PartialEq)]
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

impl Nodes<'_> {
    /// Position of an element, if it has one.
    pub(crate) fn position(&self, index: usize) -> Option<f64> {
        match self {
            Self::Uniform { start, step } => Some(start + index as f64 * step),
            Self::Listed(positions) => positions.get(index).copied(),
            Self::Unknown => None,
        }
    }
}

/// Value of an array of `length` elements at a position of its axis.
///
/// Linear between elements. Up to half a step beyond the first and last element their values hold, or, where the
/// array is even about the origin and the position lies between it and the first element, the parabola through the
/// first two. Nothing farther out, and nothing beside an element that is not there.
pub(crate) fn between(
    length: usize,
    nodes: Nodes<'_>,
    even: bool,
    position: f64,
    value: impl Fn(usize) -> Option<f64>,
) -> Option<f64> {
    // the share of the next element, which need not be there if it has none
    let interpolated = |i: usize, share: f64| {
        let from = value(i)?;
        if share == 0.0 { Some(from) } else { Some(from + (value(i + 1)? - from) * share) }
    };
    match nodes {
        Nodes::Uniform { start, step } => {
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
        Nodes::Listed(positions) => {
            if let Some(i) = positions.iter().position(|&p| p == position) {
                return value(i);
            }
            let i = positions.windows(2).position(|pair| pair[0] < position && position < pair[1])?;
            interpolated(i, (position - positions[i]) / (positions[i + 1] - positions[i]))
        }
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
    let (height, width) = (grid.rows.length, grid.columns.length);
    if height.checked_mul(width) != Some(list.len()) {
        return None;
    }
    let nodes = |side: &Side| match side.step > 0.0 {
        true => Nodes::Uniform { start: side.start, step: side.step },
        false => Nodes::Unknown,
    };
    let element = |j: usize, i: usize| {
        if j < height && i < width { list.number(j * width + i) } else { Some(0.0) }
    };
    between(rows.max(height), nodes(&grid.rows), false, row, |j| {
        between(columns.max(width), nodes(&grid.columns), even, column, |i| element(j, i))
    })
}
