//! The largest strain of the cells of a level, taken while tiles pass them, see [`crate::model::strain`].

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use super::domain::{Domain, Theory};
use crate::model::strain::{CellPeak, Watched};

/// The largest strain of cells, of which all threads take note.
#[derive(Default)]
pub struct Strains(Mutex<CellPeak>);

impl Strains {
    /// That of all levels that have been passed.
    pub fn peak(&self) -> CellPeak {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Records a peak.
    pub fn note(&self, peak: CellPeak) {
        let mut largest = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *largest = largest.larger(peak);
    }

    /// Records the cells below `rows` of `columns` that are watched.
    ///
    /// # Safety
    ///
    /// The nodes, and a row and a column around them, hold `level`; no other thread writes to them at that level.
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn take<S: Theory>(
        &self,
        domain: &Domain<S>,
        level: usize,
        rows: &Range<usize>,
        columns: &Range<usize>,
        watched: Watched,
    ) {
        let rows = rows.start..rows.end.min(watched.rows);
        let columns = columns.start..columns.end.min(watched.columns);
        if rows.is_empty() || columns.is_empty() {
            return;
        }
        let (so_far, mut peak) = (self.peak(), CellPeak::default());
        // no cell lies between the two rows of an interface
        for row in rows.filter(|j| *j < domain.grid.layer(*j).last()) {
            // SAFETY: the caller's promise
            let largest = unsafe { S::largest_strain(domain, level, row, &columns) };
            if largest >= so_far.strain && largest > peak.strain {
                // SAFETY: likewise
                let column = unsafe { domain.column_of_strain(level, row, &columns, largest) };
                let column = column.expect("the strain is that of one of the cells");
                peak = CellPeak { strain: largest, level, row, column };
            }
        }
        if peak.strain > 0.0 {
            self.note(peak);
        }
    }
}
