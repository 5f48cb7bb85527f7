//! Sides of matrices: where rows and columns are, and which of them pixels show.

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

    /// The element whose cell the middle of every pixel is in; none beside the cells.
    ///
    /// * `from`, `to`: positions of the ends of all pixels
    /// * `count`: number of pixels
    pub fn pixels(&self, (from, to): (f64, f64), count: usize) -> Vec<Option<usize>> {
        let first = self.edge(0);
        let position = |pixel: usize| from + (pixel as f64 + 0.5) / count as f64 * (to - from);
        let element = |position: f64| self.cell(position).filter(|_| position >= first);
        (0..count).map(position).map(element).collect()
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
    fn pixels_keep_to_one_side_of_an_interface() {
        let side = layered();
        let shown = side.pixels((-1.0, 3.5), 9);
        let expected = [None, Some(0), Some(0), Some(1), Some(1), Some(2), Some(3), Some(4), Some(5)];
        assert_eq!(shown, expected);
        assert_eq!(side.pixels((3.0, 4.0), 2), [Some(5), None]);
    }
}
