//! Sides of matrices: where rows and columns are, and how they are gathered into the cells of a picture.

use std::{ops::Range, sync::Arc};

use crate::LARGEST;

/// One side of a matrix: the positions of its rows or columns.
#[derive(Clone, Debug, PartialEq)]
pub enum Side {
    /// Positions `start + i·step`.
    Even {
        /// First position.
        start: f64,
        /// Distance of positions.
        step: f64,
        /// Number of positions.
        length: usize,
    },
    /// Positions in a list, none less than the one before it. One that stands twice is an interface: the cells on both sides of
    /// it end there.
    Listed(Arc<[f64]>),
}

impl Default for Side {
    fn default() -> Self {
        Self::Even { start: 0.0, step: 0.0, length: 0 }
    }
}

impl Side {
    /// Number of positions.
    pub fn length(&self) -> usize {
        match self {
            Self::Even { length, .. } => *length,
            Self::Listed(positions) => positions.len(),
        }
    }

    /// Position of an element; NaN beyond the end of a list.
    pub fn at(&self, index: usize) -> f64 {
        match self {
            Self::Even { start, step, .. } => start + index as f64 * step,
            Self::Listed(positions) => positions.get(index).copied().unwrap_or(f64::NAN),
        }
    }

    /// The positions of some elements.
    pub fn part(&self, range: Range<usize>) -> Self {
        match self {
            Self::Even { step, .. } => {
                Self::Even { start: self.at(range.start), step: *step, length: range.len() }
            }
            Self::Listed(positions) => Self::Listed(positions[range].into()),
        }
    }

    /// The positions times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        match self {
            Self::Even { start, step, length } => {
                Self::Even { start: start * factor, step: step * factor, length: *length }
            }
            Self::Listed(positions) => positions.iter().map(|position| position * factor).collect(),
        }
    }

    /// True if an element is the second at its position: the first below an interface.
    pub fn is_below_interface(&self, index: usize) -> bool {
        match self {
            Self::Even { .. } => false,
            Self::Listed(positions) => {
                index > 0 && positions.get(index - 1..=index).is_some_and(|pair| pair[0] == pair[1])
            }
        }
    }

    /// The end of the cell of an element towards the one before it: halfway, at the first as far as at the next.
    fn edge(&self, index: usize) -> f64 {
        match self {
            Self::Even { start, step, .. } => start + (index as f64 - 0.5) * step,
            Self::Listed(positions) => match (index.checked_sub(1), positions.get(index)) {
                (Some(before), Some(position)) => 0.5 * (positions[before] + position),
                (None, Some(first)) => first - 0.5 * (self.at(1) - first),
                (_, None) => {
                    let [last, before] = [1, 2].map(|back| self.at(positions.len().wrapping_sub(back)));
                    last + 0.5 * (last - before)
                }
            },
        }
    }

    /// Ends of the cells.
    pub(crate) fn ends(&self) -> (f64, f64) {
        (self.edge(0), self.edge(self.length()))
    }

    /// The element whose cell a position is in; at an interface the one above.
    pub fn cell(&self, position: f64) -> Option<usize> {
        let found = match self {
            Self::Even { start, step, .. } => ((position - start) / step).round().max(0.0) as usize,
            Self::Listed(positions) => {
                let next = positions.partition_point(|known| *known < position);
                next - usize::from(next > 0 && position <= self.edge(next) && self.at(next) != position)
            }
        };
        (found < self.length()).then_some(found)
    }

    /// True if the positions are finite and increase.
    pub(crate) fn increases(&self) -> bool {
        match self {
            // false for NaN
            Self::Even { start, step, length } => {
                let far = self.at(*length).abs();
                start.abs() < LARGEST && far < LARGEST && *step > 0.0 && far - start > 0.0
            }
            Self::Listed(positions) => {
                let (low, high) = self.ends();
                positions.is_sorted() && low.abs() < LARGEST && high.abs() < LARGEST && low < high
            }
        }
    }
}

impl FromIterator<f64> for Side {
    fn from_iter<T: IntoIterator<Item = f64>>(positions: T) -> Self {
        Self::Listed(positions.into_iter().collect())
    }
}

/// Neighbours that a picture shows as one.
pub(super) struct Block {
    pub(super) elements: Range<usize>,
    /// Where it begins and ends on the picture.
    pub(super) from: f64,
    pub(super) to: f64,
}

/// A side as blocks of a picture: single elements, or, if there are more than `most`, of so many blocks. None lies on both sides of
/// an interface, unless what is between interfaces is thinner than can be seen.
///
/// * `whole`: length of the side on the picture
pub(super) fn blocks(side: &Side, most: usize, whole: f64) -> Vec<Block> {
    /// Share of a picture that cannot be seen.
    const THIN: f64 = 1e-3;
    let length = side.length();
    if let Side::Even { .. } = side {
        let per_block = length.div_ceil(most);
        // the last block may have fewer
        let size = per_block as f64 / length as f64 * whole;
        let block = |j: usize| Block {
            elements: j * per_block..((j + 1) * per_block).min(length),
            from: j as f64 * size,
            to: ((j + 1) as f64 * size).min(whole),
        };
        return (0..length.div_ceil(per_block)).map(block).collect();
    }
    let (low, high) = side.ends();
    let place = |index: usize| (side.edge(index) - low) / (high - low) * whole;
    let (mut blocks, mut first) = (Vec::new(), 0);
    for end in 1..=length {
        let size = (place(end) - place(first)) / whole;
        let is_full = length <= most || size * most as f64 >= 1.0;
        if end == length || is_full || (side.is_below_interface(end) && size >= THIN) {
            blocks.push(Block { elements: first..end, from: place(first), to: place(end) });
            first = end;
        }
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two layers, of which the lower has rows half as far apart.
    fn layered() -> Side {
        [0.0, 1.0, 2.0, 2.0, 2.5, 3.0].into_iter().collect()
    }

    #[test]
    fn cells_end_at_interfaces() {
        let side = layered();
        assert_eq!(side.ends(), (-0.5, 3.25));
        let edges: Vec<f64> = (0..=6).map(|i| side.edge(i)).collect();
        assert_eq!(edges, [-0.5, 0.5, 1.5, 2.0, 2.25, 2.75, 3.25]);
        for (position, cell) in
            [(-0.4, 0), (0.0, 0), (0.6, 1), (1.9, 2), (2.0, 2), (2.1, 3), (2.3, 4), (2.5, 4), (3.0, 5)]
        {
            assert_eq!(side.cell(position), Some(cell), "{position}");
        }
        assert_eq!((side.cell(3.3), side.part(2..5).at(1)), (None, 2.0));
        assert_eq!(side.scaled(10.0).at(4), 25.0);
        assert!(side.is_below_interface(3) && !side.is_below_interface(2) && !side.is_below_interface(9));
    }

    #[test]
    fn lists_that_cannot_be_drawn_do_not_increase() {
        assert!(layered().increases());
        let bad: [&[f64]; 6] =
            [&[], &[1.0], &[1.0, 1.0], &[0.0, 2.0, 1.0], &[0.0, f64::NAN, 1.0], &[0.0, 1e300]];
        for positions in bad {
            assert!(!positions.iter().copied().collect::<Side>().increases(), "{positions:?}");
        }
    }

    #[test]
    fn blocks_keep_to_one_side_of_an_interface() {
        let fine = |from: f64, to: f64, rows: usize| {
            (0..=rows).map(move |i| from + (to - from) * i as f64 / rows as f64)
        };
        let side: Side = fine(0.0, 1.0, 400).chain(fine(1.0, 1.1, 7)).chain(fine(1.1, 3.0, 900)).collect();
        let blocks = blocks(&side, 100, 600.0);
        assert!(blocks.len() <= 103, "{}", blocks.len());
        assert!(blocks.windows(2).all(|pair| pair[0].to == pair[1].from));
        for interface in [401, 409] {
            assert!(blocks.iter().any(|block| block.elements.start == interface));
        }
        // interfaces closer than can be seen do not make blocks
        let wild: Side = (0..100_000).map(|i| f64::from(i / 2)).collect();
        assert!(super::blocks(&wild, 220, 600.0).len() <= 1000);
    }
}
