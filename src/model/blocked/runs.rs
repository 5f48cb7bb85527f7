//! Rows that kernels advance at once: the inner rows of a layer, and at its faces two rows that have images around them.

use std::ops::Range;

use super::levels::Around;
use crate::grid::{Back, Grid};

/// Rows of a layer that are advanced at once.
pub struct Run {
    /// The rows.
    pub rows: Range<usize>,
    /// Number of their layer.
    pub layer: usize,
    /// Number of the interface whose upper row is the last of them.
    pub upper_face_of: Option<usize>,
    /// Number of the interface whose lower row is the first of them.
    pub lower_face_of: Option<usize>,
    /// What is around the first row, where it is not what stands there: at free faces of layers and beside them even images, about the row at an
    /// interface and about half a row below the last one above a free back. Those beyond the surface and a rigid backing stand in memory.
    around: Option<Around>,
}

impl Run {
    /// What is around row `j` of the rows, where it is not what stands there.
    pub fn around(&self, j: usize) -> Option<Around> {
        // the same rows, counted from the second
        let second = |[_, b, d, e, f]: Around| [b, 0, e, f, f].map(|row| row - d);
        self.around.map(|around| if j == self.rows.start { around } else { second(around) })
    }
}

/// All rows but the surface, cut into what is advanced at once.
pub struct Runs(Vec<Run>);

impl Runs {
    /// * `stride`: distance from a node to the one below it, in numbers
    pub fn new(grid: &Grid, stride: usize) -> Self {
        let mut runs = Vec::new();
        for (number, layer) in grid.layers.iter().enumerate() {
            let (first, last) = (layer.first, layer.last());
            let lower_face_of = number.checked_sub(1);
            let upper_face_of = (number + 1 < grid.layers.len()).then_some(number);
            let (has_top, has_bottom) = (number > 0, upper_face_of.is_some() || grid.back == Back::Free);
            // from the last row to the images that stand one and two rows below it
            let [one, two] = if upper_face_of.is_some() { [-1, -2] } else { [0, -1] };
            let run = |rows: Range<usize>, around: Option<Around>| {
                let around = around.map(|rows| rows.map(|row| row * stride as isize));
                let upper_face_of = upper_face_of.filter(|_| rows.end == last + 1);
                let lower_face_of = lower_face_of.filter(|_| rows.start == first);
                Run { rows, layer: number, upper_face_of, lower_face_of, around }
            };
            let is_thin = layer.steps == 2;
            if has_top {
                let below = if is_thin && has_bottom { 2 + one } else { 3 };
                runs.push(run(first..first + 2, Some([2, 1, 1, 2, below])));
            }
            let start = if has_top { first + 2 } else { 1 };
            let end = if has_bottom { last - 1 } else { last + 1 };
            if start < end {
                runs.push(run(start..end, None));
            }
            match has_bottom {
                true if is_thin && has_top => runs.push(run(last..last + 1, Some([-2, -1, one, two, 0]))),
                true => runs.push(run(last - 1..last + 1, Some([-2, -1, 1, 1 + one, 1 + two]))),
                false => {}
            }
        }
        Self(runs)
    }

    /// What is around row `j`, where it is not what stands there.
    pub fn around(&self, j: usize) -> Option<Around> {
        self.among(&(j..j + 1)).next().and_then(|(run, _)| run.around(j))
    }

    /// The runs that have some of `rows`, each with the part of `rows` that it covers.
    pub fn among(&self, rows: &Range<usize>) -> impl Iterator<Item = (&Run, Range<usize>)> {
        let Range { start, end } = *rows;
        let first = self.0.partition_point(|run| run.rows.end <= start);
        let runs = self.0[first..].iter().take_while(move |run| run.rows.start < end);
        runs.map(move |run| (run, run.rows.start.max(start)..run.rows.end.min(end)))
    }
}
