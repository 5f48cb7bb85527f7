//! Interfaces of layers: stress, and the first tension, which is noted on the way.

use std::{
    ops::Range,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use super::vector::BLOCK;
use crate::model::{Tension, scheme};

/// How the stress of a row of the simplified theory follows from displacements.
pub enum StressAt {
    /// From those of two rows, by [`scheme::stress`].
    Row {
        /// The rows.
        around: [usize; 2],
        /// Sign of the second, which is an odd image below the backing.
        sign: f64,
        /// Impedance of the layer \[γc_p\]: over Δt in place of Δz.
        impedance: f64,
        /// Δt
        dt: f64,
    },
    /// From those of both layers, by [`scheme::interface_stress`].
    Interface(InterfaceStress),
}

/// Stress at an interface of the simplified theory.
pub struct InterfaceStress {
    /// Rows: the last two of the layer above and the first two of the one below.
    pub rows: [usize; 4],
    /// Impedances of both layers \[γc_p of the struck one\].
    pub impedances: [f64; 2],
    /// Δt
    pub dt: f64,
}

impl InterfaceStress {
    /// * `u`: displacements of the rows
    pub fn stress(&self, [a, b, c, d]: [f64; 4]) -> f64 {
        let [upper, lower] = self.impedances;
        let cells = [upper * (a - b) / self.dt, lower * (c - d) / self.dt];
        scheme::interface_stress(scheme::shares(self.impedances), cells)
    }
}

/// The first tension at every interface, of which all threads take note.
pub struct Interfaces {
    /// Tension that is noted \[γc_p²\]; none is without it.
    pub limit: Option<f64>,
    first: Vec<First>,
}

/// The first tension at an interface so far: of the earliest level, there in the innermost column.
struct First {
    /// Its level; later ones need not be looked at.
    level: AtomicUsize,
    found: Mutex<Option<Tension>>,
}

impl Interfaces {
    /// * `count`: number of interfaces
    pub fn new(count: usize) -> Self {
        let first = || First { level: AtomicUsize::new(usize::MAX), found: Mutex::default() };
        Self { limit: None, first: (0..count).map(|_| first()).collect() }
    }

    /// True if tension is looked for.
    pub fn are_watched(&self) -> bool {
        self.limit.is_some() && !self.first.is_empty()
    }

    /// The first tension at every interface that has had any, from the surface down.
    pub fn tensions(&self) -> Vec<Tension> {
        let found = |first: &First| *first.found.lock().unwrap_or_else(PoisonError::into_inner);
        self.first.iter().filter_map(found).collect()
    }

    /// Notes a tension.
    pub fn note(&self, tension: Tension) {
        let first = &self.first[tension.interface];
        let mut found = first.found.lock().unwrap_or_else(PoisonError::into_inner);
        let place = |tension: &Tension| (tension.level, tension.column);
        if found.is_none_or(|found| place(&tension) < place(&found)) {
            // relaxed: it only saves work; what counts is under the lock
            first.level.store(tension.level, Ordering::Relaxed);
            *found = Some(tension);
        }
    }

    /// Notes the innermost tension beyond the limit in some columns of an interface, if there is any.
    ///
    /// * `faces`: u_z of both faces at the level after `level`
    /// * `stiffness`: stress per difference, see [`scheme::traction_weight`]
    pub fn look(
        &self,
        interface: usize,
        level: usize,
        columns: &Range<usize>,
        faces: [&[f64]; 2],
        stiffness: f64,
    ) {
        let Some(limit) = self.limit else { return };
        if level > self.first[interface].level.load(Ordering::Relaxed) {
            return;
        }
        // in blocks, which compilers turn into vectors
        let mut lowest = [0.0; BLOCK];
        for (upper, lower) in faces[0].chunks(BLOCK).zip(faces[1].chunks(BLOCK)) {
            for (lowest, (upper, lower)) in lowest.iter_mut().zip(upper.iter().zip(lower)) {
                let difference = upper - lower;
                *lowest = if difference < *lowest { difference } else { *lowest };
            }
        }
        if stiffness * lowest.into_iter().fold(0.0, f64::min) >= -limit {
            return;
        }
        let stress = |place: usize| stiffness * (faces[0][place] - faces[1][place]);
        if let Some(place) = (0..columns.len()).position(|place| stress(place) < -limit) {
            self.note(Tension { interface, level, column: columns.start + place, stress: stress(place) });
        }
    }
}
