//! The largest ratios of stresses to strengths, taken while tiles pass a level, see [`crate::model::strength`].

use std::{
    ops::Range,
    sync::{Mutex, MutexGuard, PoisonError},
};

use serde::{Deserialize, Serialize};

use crate::{
    grid::Grid,
    model::{
        cell_scheme::CellScheme,
        strain::{self, Watched},
        strength::{Failure, RatioPeaks, Strength},
    },
};

/// Ratios of stresses to strengths, of which all threads take note.
pub struct Ratios {
    /// What the layers bear, from the surface down.
    strengths: Vec<Strength>,
    found: Mutex<FoundRatios>,
}

/// Ratios of all levels that have been passed.
#[derive(Clone, Serialize, Deserialize)]
pub struct FoundRatios {
    /// The largest ones.
    pub largest: RatioPeaks,
    /// The largest of the first level in which they pass 1; 0 of those that have not.
    pub first: RatioPeaks,
}

impl Ratios {
    /// Those of a target at rest.
    ///
    /// * `strengths`: of its layers
    pub fn new(strengths: &[Strength]) -> Self {
        let rest = RatioPeaks::new(strengths);
        Self {
            found: Mutex::new(FoundRatios { largest: rest.clone(), first: rest }),
            strengths: strengths.to_vec(),
        }
    }

    /// True if a strength is known.
    pub fn are_watched(&self) -> bool {
        self.strengths.iter().any(|layer| layer.is_known() || layer.bond.is_some())
    }

    fn lock(&self) -> MutexGuard<'_, FoundRatios> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What has been found.
    pub fn found(&self) -> FoundRatios {
        self.lock().clone()
    }

    /// Restores what was found before.
    pub fn set(&self, found: FoundRatios) {
        *self.lock() = found;
    }

    /// Strengths that are first passed at a level which has been reached everywhere.
    pub fn failures(&self, level: usize) -> Vec<Failure> {
        self.lock().first.beyond(|peak| peak.step == level as u64)
    }

    /// Records ratios of one level.
    fn note(&self, ratios: &RatioPeaks) {
        if ratios.all().all(|peak| peak.ratio == 0.0) {
            return;
        }
        let FoundRatios { largest, first } = &mut *self.lock();
        largest.merge(ratios, |a, b| a.larger(b));
        first.merge(ratios, |a, b| a.earlier(b));
    }

    /// Records the cells below `rows` of `columns` that are watched, and faces among the rows.
    ///
    /// * `at`: displacements at the level, see [`CellScheme::cell_stress`]
    /// * `pressure`: on the surface, if it is among the rows
    pub fn take(
        &self,
        scheme: &CellScheme,
        at: impl Fn(usize, usize, isize) -> f64 + Copy,
        level: usize,
        (rows, columns): (&Range<usize>, &Range<usize>),
        watched: Watched,
        pressure: Option<&[f64]>,
    ) {
        if !self.strengths.iter().any(Strength::is_known) {
            return;
        }
        let (grid, step) = (scheme.grid(), level as u64);
        let known = |row: usize| Some(&self.strengths[grid.layer_of(row)]).filter(|layer| layer.is_known());
        let mut ratios = RatioPeaks::within(&self.strengths);
        // no cell lies between the two rows of an interface
        for row in (rows.start..rows.end.min(watched.rows)).filter(|j| *j < grid.layer(*j).last()) {
            let Some(strength) = known(row) else { continue };
            for column in columns.start..columns.end.min(watched.columns) {
                let stress = scheme.cell_stress(at, row, column);
                ratios.take(strength, &stress, step, || strain::middle(grid, row, column));
            }
        }
        let columns = columns.start..columns.end.min(grid.nr());
        let faces = [Some(0), grid.has_back.then_some(grid.nz)].into_iter().flatten();
        for row in faces.filter(|row| rows.contains(row)) {
            let Some(strength) = known(row) else { continue };
            for column in columns.clone() {
                let pressure = pressure.map_or(0.0, |pressure| pressure[column]);
                let stress = scheme.face_stress(at, pressure, row, column);
                ratios.take(strength, &stress, step, || (grid.r(column), grid.z(row)));
            }
        }
        self.note(&ratios);
    }

    /// Records the tractions of an interface in some columns.
    ///
    /// * `traction`: −σ_n and τ in a column \[γc_p²\]
    pub fn take_tractions(
        &self,
        grid: &Grid,
        interface: usize,
        level: usize,
        columns: &Range<usize>,
        traction: impl Fn(usize) -> [f64; 2],
    ) {
        let Some(below) = self.strengths.get(interface + 1).filter(|below| below.bond.is_some()) else {
            return;
        };
        let mut ratios = RatioPeaks::of_bonds(&self.strengths);
        for column in columns.clone() {
            let place = || (grid.r(column), grid.bottom(&grid.layers[interface]));
            ratios.take_traction(interface, below, traction(column), level as u64, place);
        }
        self.note(&ratios);
    }
}
