//! The largest strain of the cells of a level, taken while tiles pass them, see [`crate::model::strain`].

use std::{
    ops::Range,
    sync::{Mutex, PoisonError},
};

use super::{domain::Domain, vector::BLOCK};
use crate::model::{
    cells,
    strain::{CellPeak, Watched},
};

/// The largest strain of cells, of which all threads take note.
#[derive(Default)]
pub struct Strains(Mutex<CellPeak>);

impl Strains {
    /// That of all levels that have been passed.
    pub fn peak(&self) -> CellPeak {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes note of a peak.
    pub fn note(&self, peak: CellPeak) {
        let mut largest = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *largest = largest.larger(peak);
    }

    /// Takes note of the cells below `rows` of `columns` that are watched.
    ///
    /// # Safety
    ///
    /// The nodes, and a row and a column around them, hold `level`; no other thread writes to them at that level.
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn take(
        &self,
        domain: &Domain,
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
        for row in rows {
            // SAFETY: the caller's promise
            let largest = unsafe { domain.largest_strain(level, row, &columns) };
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

/// Two rows of nodes of the full theory with the cells between them.
#[derive(Clone, Copy)]
pub struct CellRow<'a> {
    /// u and v, each of the upper and the lower row, from the column before the first cell on.
    pub displacements: [[&'a [f64]; 2]; 2],
    /// q' and q, and the shares of the hoop strain, cell by cell.
    pub weights: [[&'a [f64]; 2]; 2],
    /// c
    pub courant: f64,
}

impl CellRow<'_> {
    /// The largest of [`cells::largest_strain`]: the same bits, however the compiler makes vectors of it.
    #[inline(always)]
    pub fn largest_strain(self) -> f64 {
        let [u, v] = self.displacements;
        let [lateral, hoop] = self.weights;
        let count = lateral[0].len();
        let mut largest = [0.0; BLOCK];
        let mut i = 0;
        while let (Some(u), Some(v), Some(lateral), Some(hoop)) =
            (nodes(u, i), nodes(v, i), blocks(lateral, i), blocks(hoop, i))
        {
            let ([u0, u1], [v0, v1]) = (u, v);
            let ([inner, outer], [inner_hoop, outer_hoop]) = (lateral, hoop);
            let mut strains = [0.0; BLOCK];
            for n in 0..BLOCK {
                strains[n] = cells::largest_strain(
                    [[u0[n], u1[n]], [u0[n + 1], u1[n + 1]]],
                    [[v0[n], v1[n]], [v0[n + 1], v1[n + 1]]],
                    [inner[n], outer[n]],
                    [inner_hoop[n], outer_hoop[n]],
                    self.courant,
                );
            }
            for (largest, strain) in largest.iter_mut().zip(strains) {
                *largest = if strain > *largest { strain } else { *largest };
            }
            i += BLOCK;
        }
        for i in i..count {
            let cell = |rows: [&[f64]; 2]| [i, i + 1].map(|i| rows.map(|row| row[i]));
            let (lateral, hoop) = (lateral.map(|weights| weights[i]), hoop.map(|weights| weights[i]));
            let strain = cells::largest_strain(cell(u), cell(v), lateral, hoop, self.courant);
            largest[0] = if strain > largest[0] { strain } else { largest[0] };
        }
        largest.into_iter().fold(0.0, f64::max)
    }
}

/// A block of both, and the column after it, from column `i` on.
#[inline(always)]
fn nodes(rows: [&[f64]; 2], i: usize) -> Option<[&[f64; BLOCK + 1]; 2]> {
    Some([rows[0].get(i..)?.first_chunk()?, rows[1].get(i..)?.first_chunk()?])
}

/// A block of both from column `i` on.
#[inline(always)]
fn blocks(rows: [&[f64]; 2], i: usize) -> Option<[&[f64; BLOCK]; 2]> {
    Some([rows[0].get(i..)?.first_chunk()?, rows[1].get(i..)?.first_chunk()?])
}

/// The largest difference of two rows by magnitude.
pub fn largest_stretch(upper: &[f64], lower: &[f64]) -> f64 {
    let mut largest = [0.0; BLOCK];
    for (upper, lower) in upper.chunks(BLOCK).zip(lower.chunks(BLOCK)) {
        for (largest, (upper, lower)) in largest.iter_mut().zip(upper.iter().zip(lower)) {
            let stretch = (lower - upper).abs();
            *largest = if stretch > *largest { stretch } else { *largest };
        }
    }
    largest.into_iter().fold(0.0, f64::max)
}
