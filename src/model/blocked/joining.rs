//! The rows of interfaces: either one as the face of a layer by itself, joined as [`crate::model::scheme::joined`] says.

use std::ops::Range;

use super::{
    domain::{Domain, Theory},
    energy::EnergySum,
    interface::Traction,
};
use crate::{grid::Bond, model::scheme};

/// Displacements of both rows of an interface, of each u_z and u_r if there is one.
pub type Kept = [Vec<Vec<f64>>; 2];

impl<S: Theory> Domain<S> {
    /// Rows of an interface.
    fn rows_of(&self, interface: usize) -> [usize; 2] {
        [0, 1].map(|side| self.grid.layers[interface].last() + side)
    }

    /// True if layers share a displacement at an interface.
    fn shares(&self, interface: usize, field: usize) -> bool {
        field == 0 || self.grid.layers[interface + 1].bond == Bond::Welded
    }

    /// Joins both rows of an interface, which hold at `level` what they would if their layer were by itself.
    ///
    /// # Safety
    ///
    /// No other thread touches these columns of the rows meanwhile.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn join(&self, level: usize, interface: usize, columns: Range<usize>) {
        let impedances = self.impedances(interface);
        let shares = scheme::shares(impedances);
        let stiffness = scheme::traction_weight(impedances, self.grid.dt());
        self.ratios.take_tractions(&self.grid, interface, level - 1, &columns, |i| {
            [0, 1].map(|field| match self.shares(interface, field) {
                true => {
                    // SAFETY: the caller's promise; no slice of the rows lives
                    let [upper, lower] = self.rows_of(interface).map(|row| unsafe {
                        self.levels.at(level, row, field * self.levels.lateral(), i as isize)
                    });
                    stiffness * (upper - lower)
                }
                false => 0.0,
            })
        });
        for field in (0..S::FIELDS).filter(|field| self.shares(interface, *field)) {
            // SAFETY: the caller's promise; they are two rows
            let [upper, lower] = self
                .rows_of(interface)
                .map(|row| unsafe { self.levels.columns_mut(level, row, field, &columns) });
            let traction = if field == 0 { Traction::Normal } else { Traction::Shear };
            self.interfaces.look((interface, traction), level - 1, &columns, [upper, lower], stiffness);
            for (upper, lower) in upper.iter_mut().zip(lower) {
                let joined = scheme::joined(shares, [*upper, *lower]);
                (*upper, *lower) = (joined, joined);
            }
        }
    }

    /// What both rows of an interface hold two levels below `level`, which may be overwritten by it.
    ///
    /// # Safety
    ///
    /// No other thread writes to these columns of the rows.
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn keep(&self, level: usize, interface: usize, columns: Range<usize>) -> Kept {
        self.rows_of(interface).map(|row| {
            // SAFETY: the caller's promise
            let field =
                |field: usize| unsafe { self.field(self.levels.two_below(level), row, field, &columns) };
            (0..S::FIELDS).map(field).collect()
        })
    }

    /// Some columns of a displacement of row `j` at a level.
    ///
    /// # Safety
    ///
    /// No other thread writes to them.
    #[expect(unsafe_code, reason = "a field that threads share")]
    unsafe fn field(&self, level: usize, j: usize, field: usize, columns: &Range<usize>) -> Vec<f64> {
        // SAFETY: the caller's promise
        unsafe { self.levels.cells(level, j, field * self.levels.lateral(), columns)[1..].to_vec() }
    }

    /// Adds the energies of both rows of an interface before they are joined.
    ///
    /// * `before`: u^{k−1}
    /// * `energies`: of both rows
    ///
    /// # Safety
    ///
    /// The rows hold at `level` what they would if their layer were by itself, and they and what is around them level k, with the
    /// mixed-derivative correction k−1 too; no other thread writes to them.
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub unsafe fn count_faces(
        &self,
        level: usize,
        interface: usize,
        columns: Range<usize>,
        before: &Kept,
        energies: &mut [EnergySum],
    ) {
        let (rows, shares) = (self.rows_of(interface), scheme::shares(self.impedances(interface)));
        // SAFETY: the caller's promise
        let face = |row: usize, field: usize| unsafe { self.field(level, row, field, &columns) };
        let faces = rows.map(|row| (0..S::FIELDS).map(|field| face(row, field)).collect::<Vec<_>>());
        let next = |side: usize, field: usize, place: usize| match self.shares(interface, field) {
            true => scheme::joined(shares, faces.each_ref().map(|face| face[field][place])),
            false => faces[side][field][place],
        };
        for (side, energy) in energies.iter_mut().enumerate() {
            // column by column: the same sum however columns are cut
            for (place, i) in columns.clone().take_while(|i| *i < self.grid.nr()).enumerate() {
                for (field, (before, face)) in before[side].iter().zip(&faces[side]).enumerate() {
                    let ends = [before[place], face[place], next(side, field, place)];
                    // SAFETY: the caller's promise
                    unsafe { self.add_face_energy(level, [field, rows[side], i], ends, energy) };
                }
            }
        }
    }

    /// Impedances of the layers above and below an interface.
    pub fn impedances(&self, interface: usize) -> [f64; 2] {
        [interface, interface + 1].map(|layer| self.theory.impedance(layer))
    }

    /// Adds the energy of a displacement of a node of an interface: forces are those of its own layer.
    ///
    /// * `node`: number of the displacement, row, column
    /// * `ends`: u^{k−1}, u^{k+1} if its layer were by itself, and u^{k+1}
    ///
    /// # Safety
    ///
    /// Level k stands at the node and around it, with the mixed-derivative correction k−1 too; no other thread writes to them.
    #[expect(unsafe_code, reason = "a field that threads share")]
    unsafe fn add_face_energy(
        &self,
        level: usize,
        [field, j, i]: [usize; 3],
        [before, face, next]: [f64; 3],
        energy: &mut EnergySum,
    ) {
        let levels = &self.levels;
        // SAFETY: the caller's promise
        let (area, force, now) = unsafe {
            let (area, force) = S::face_force(self, level, [field, j, i], [before, face]);
            (area, force, levels.at(level - 1, j, field * levels.lateral(), i as isize))
        };
        energy.add_one(i, area, [before, now, next], force);
    }
}
