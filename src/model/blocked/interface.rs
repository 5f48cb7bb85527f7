//! Interfaces of layers: stress, and the first tension and the largest tractions, which are noted on the way.

use std::{
    ops::Range,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, AtomicUsize, Ordering},
    },
};

use super::lane::BLOCK;
use crate::model::{InterfacePeaks, Tension, TractionPeak};

/// Tractions of every interface, of which all threads take note: the first tension beyond a limit, and the largest.
pub struct Interfaces {
    /// Tension that is noted as the first \[γc_p²\]; nothing is looked at without it.
    pub limit: Option<f64>,
    first: Vec<First>,
    largest: Vec<[Largest; 2]>,
}

/// The first tension at an interface so far: of the earliest level, there in the innermost column.
struct First {
    /// Its level; later ones need not be looked at.
    level: AtomicUsize,
    found: Mutex<Option<Tension>>,
}

/// The largest traction of one kind.
#[derive(Default)]
struct Largest {
    /// Bits of its stress, which is not negative; smaller ones need not be looked at.
    stress: AtomicU64,
    found: Mutex<TractionPeak>,
}

impl Largest {
    fn get(&self) -> TractionPeak {
        *self.found.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, peak: TractionPeak) {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        *found = found.larger(peak);
        // relaxed: it only saves work; what counts is under the lock
        self.stress.store(found.stress.to_bits(), Ordering::Relaxed);
    }
}

/// A component of the traction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Traction {
    /// Tension.
    Normal,
    /// Shear of either sign.
    Shear,
}

impl Traction {
    /// What counts of a difference of displacements.
    #[inline]
    fn of(self, difference: f64) -> f64 {
        match self {
            Self::Normal => -difference,
            Self::Shear => difference.abs(),
        }
    }
}

impl Interfaces {
    /// * `count`: number of interfaces
    pub fn new(count: usize) -> Self {
        let first = || First { level: AtomicUsize::new(usize::MAX), found: Mutex::default() };
        Self {
            limit: None,
            first: (0..count).map(|_| first()).collect(),
            largest: (0..count).map(|_| Default::default()).collect(),
        }
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

    /// The largest tractions of every interface, from the surface down; none if they are not looked at.
    pub fn peaks(&self) -> Vec<InterfacePeaks> {
        let peaks = self.largest.iter().filter(|_| self.are_watched()).map(|largest| {
            let [tension, shear] = largest.each_ref().map(Largest::get);
            InterfacePeaks { tension, shear }
        });
        peaks.collect()
    }

    /// Notes a tension.
    pub fn note(&self, tension: Tension) {
        let first = &self.first[tension.interface];
        let mut found = first.found.lock().unwrap_or_else(PoisonError::into_inner);
        let place = |tension: &Tension| (tension.level, tension.column);
        if found.is_none_or(|found| place(&tension) < place(&found)) {
            // relaxed, as above
            first.level.store(tension.level, Ordering::Relaxed);
            *found = Some(tension);
        }
    }

    /// Notes the largest tractions of an interface.
    pub fn note_peaks(&self, interface: usize, InterfacePeaks { tension, shear }: InterfacePeaks) {
        let [normal, tangential] = &self.largest[interface];
        normal.note(tension);
        tangential.note(shear);
    }

    /// Notes the innermost tension beyond the limit in some columns of an interface, if there is any, and the largest traction if it is larger
    /// than what is known.
    ///
    /// * `faces`: displacement of both faces at the level after `level`, along z or r as is `traction`
    /// * `stiffness`: stress per difference, see [`crate::model::scheme::traction_weight`]
    pub fn look(
        &self,
        (interface, traction): (usize, Traction),
        level: usize,
        columns: &Range<usize>,
        faces: [&[f64]; 2],
        stiffness: f64,
    ) {
        let Some(limit) = self.limit else { return };
        // in blocks, which compilers turn into vectors
        let mut largest = [0.0; BLOCK];
        for (upper, lower) in faces[0].chunks(BLOCK).zip(faces[1].chunks(BLOCK)) {
            for (largest, (upper, lower)) in largest.iter_mut().zip(upper.iter().zip(lower)) {
                let size = traction.of(upper - lower);
                *largest = if size > *largest { size } else { *largest };
            }
        }
        let largest = stiffness * largest.into_iter().fold(0.0, f64::max);
        let stress = |place: usize| stiffness * traction.of(faces[0][place] - faces[1][place]);
        let known = &self.largest[interface][traction as usize];
        if largest > 0.0
            && largest >= f64::from_bits(known.stress.load(Ordering::Relaxed))
            && let Some(place) = (0..columns.len()).find(|place| stress(*place) == largest)
        {
            known.note(TractionPeak { stress: largest, level, column: columns.start + place });
        }
        let is_first = || level <= self.first[interface].level.load(Ordering::Relaxed);
        if traction == Traction::Normal
            && largest > limit
            && is_first()
            && let Some(place) = (0..columns.len()).find(|place| stress(*place) > limit)
        {
            let column = columns.start + place;
            self.note(Tension { interface, level, column, stress: -stress(place) });
        }
    }
}
