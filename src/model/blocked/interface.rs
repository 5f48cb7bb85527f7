//! Interfaces of layers: both rows of one are advanced together, and what happens there is noted on the way.
//!
//! Kernels advance either row as the face of a layer by itself, into a place of its own; the faces are then joined as
//! [`crate::model::scheme::joined`] says.

use std::{
    ops::Range,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
};

use super::{domain::Domain, energy::EnergySum, weights::Weighted};
use crate::{
    grid::{Back, Bond},
    model::{Tension, scheme},
};

/// Columns of an interface that are advanced at a time.
pub const PIECE: usize = 256;

/// Displacements of a face at the level to come, first column first: u_z and u_r.
pub type Faces = [[f64; PIECE]; 2];

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
    /// There is none.
    FreeFace,
}

/// Stress at an interface of the simplified theory.
pub struct InterfaceStress {
    /// Rows: the last two of the layer above and the first two of the one below.
    pub rows: [usize; 4],
    impedances: [f64; 2],
    dt: f64,
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
    fn look(
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
        let stress = |place: usize| stiffness * (faces[0][place] - faces[1][place]);
        let lowest = (0..columns.len()).map(stress).fold(0.0, |a, b| if b < a { b } else { a });
        if lowest < -limit
            && let Some(place) = (0..columns.len()).position(|place| stress(place) < -limit)
        {
            self.note(Tension { interface, level, column: columns.start + place, stress: stress(place) });
        }
    }
}

impl Domain {
    /// Advances both rows of an interface to `level`.
    ///
    /// * `energies`: of both rows, to add theirs to, if it is to be counted
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`] for both rows.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn advance_interface(
        &self,
        level: usize,
        interface: usize,
        columns: Range<usize>,
        mut energies: Option<&mut [EnergySum]>,
    ) {
        let rows = [0, 1].map(|side| self.grid.layers[interface].last() + side);
        let [mut upper, mut lower]: [Faces; 2] = [[[0.0; PIECE]; 2]; 2];
        let impedances = self.impedances(interface);
        let shares = scheme::shares(impedances);
        let fields = if matches!(self.scheme(), Weighted::Cells(_)) { 2 } else { 1 };
        let is_welded = self.grid.layers[interface + 1].bond == Bond::Welded;
        for start in columns.clone().step_by(PIECE) {
            let columns = start..(start + PIECE).min(columns.end);
            // SAFETY: the caller's promise; a piece is as long as a face or shorter
            unsafe {
                self.advance_face(level, rows[0], columns.clone(), &mut upper);
                self.advance_face(level, rows[1], columns.clone(), &mut lower);
            }
            let faces = [&upper[0][..columns.len()], &lower[0][..columns.len()]];
            let stiffness = scheme::traction_weight(impedances, self.grid.dt());
            self.interfaces.look(interface, level - 1, &columns, faces, stiffness);
            for field in 0..fields {
                let faces = [&upper[field], &lower[field]];
                let next = |side: usize, place: usize| match field == 0 || is_welded {
                    true => scheme::joined(shares, faces.map(|face| face[place])),
                    false => faces[side][place],
                };
                for (side, row) in rows.into_iter().enumerate() {
                    if let Some(energies) = &mut energies {
                        let energy = &mut energies[side];
                        for (place, i) in columns.clone().take_while(|i| *i < self.grid.nr()).enumerate() {
                            // SAFETY: the caller's promise; the row is not yet overwritten
                            unsafe {
                                let face = faces[side][place];
                                self.add_face_energy(level, [field, row, i], face, next(side, place), energy);
                            }
                        }
                    }
                }
                for (side, row) in rows.into_iter().enumerate() {
                    // SAFETY: the caller's promise
                    let row = unsafe { self.levels.columns_mut(level, row, field, &columns) };
                    row.iter_mut().enumerate().for_each(|(place, u)| *u = next(side, place));
                }
            }
        }
    }

    /// How the stress of row `j` of the simplified theory, below the surface, follows from displacements.
    pub fn stress_at(&self, j: usize) -> StressAt {
        if let Some(interface) = self.grid.interface_of(j) {
            let last = self.grid.layers[interface].last();
            return StressAt::Interface(InterfaceStress {
                rows: [last - 1, last, last + 1, last + 2],
                impedances: self.impedances(interface),
                dt: self.grid.dt(),
            });
        }
        let (is_back, layer) = (j == self.grid.nz, self.grid.layer_of(j));
        if is_back && self.grid.back == Back::Free {
            return StressAt::FreeFace;
        }
        StressAt::Row {
            // the odd image stands below the backing
            around: [j - 1, if is_back { j - 1 } else { j + 1 }],
            sign: if is_back { -1.0 } else { 1.0 },
            impedance: self.impedance(layer),
            dt: self.grid.dt(),
        }
    }

    /// Impedances of the layers above and below an interface.
    pub fn impedances(&self, interface: usize) -> [f64; 2] {
        [interface, interface + 1].map(|layer| self.impedance(layer))
    }

    /// Adds the energy of a displacement of a node of an interface: forces are those of its own layer.
    ///
    /// * `node`: number of the displacement, row, column
    /// * `face`: u^{k+1} if its layer were by itself
    /// * `next`: u^{k+1}
    ///
    /// # Safety
    ///
    /// Levels k−1 and k stand at the node, level k, with the mixed-derivative correction both, around it; no other thread writes to them.
    #[expect(unsafe_code, reason = "a field that threads share")]
    unsafe fn add_face_energy(
        &self,
        level: usize,
        [field, j, i]: [usize; 3],
        face: f64,
        next: f64,
        energy: &mut EnergySum,
    ) {
        let (levels, column) = (&self.levels, i as isize);
        // SAFETY: the caller's promise
        let at = |level: usize, field: usize, j: usize, i: isize| unsafe {
            levels.at(level, j, field * levels.lateral(), i)
        };
        let (earlier, now) = (levels.two_below(level), level - 1);
        let [before, here] = [earlier, now].map(|level| at(level, field, j, column));
        let (area, force) = match self.scheme() {
            Weighted::Axial(weights) => {
                let damped = weights.corner(self.grid.layer_of(j)).map_or(0.0, |corner| {
                    let [a, .., e] = self.around(j).unwrap_or_default();
                    let row = |distance: isize| j.wrapping_add_signed(distance / levels.stride() as isize);
                    let moved = |dj: isize, di: isize| {
                        let j = match dj {
                            0 => j,
                            dj if dj < 0 => row(a),
                            _ => row(e),
                        };
                        at(now, 0, j, column + di) - at(earlier, 0, j, column + di)
                    };
                    corner.share * scheme::corner(moved, corner.column(i))
                });
                (weights.area[i], (face - here) - (here - before) - damped)
            }
            Weighted::Cells(weights) => {
                let row = weights.scheme.at_row(j);
                let forces = row.accelerations(|field, j, i| at(now, field, j, i), i);
                (weights.layers[self.grid.layer_of(j)].areas[field][i], forces[field])
            }
        };
        energy.add_one(i, area, [before, here, next], force);
    }
}
