//! The rows of interfaces: either one as the face of a layer by itself, joined as [`crate::model::scheme::joined`] says.

use std::{cell::RefCell, ops::Range};

use super::{
    domain::Domain,
    energy::EnergySum,
    interface::{Faces, InterfaceStress, PIECE, StressAt},
    weights::Weighted,
};
use crate::{
    grid::{Back, Bond},
    model::scheme,
};

thread_local! {
    /// Places for both faces, which every call fills in: to clear them each time costs some percent of a run.
    static FACES: RefCell<[Faces; 2]> = const { RefCell::new([[[0.0; PIECE]; 2]; 2]) };
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
        energies: Option<&mut [EnergySum]>,
    ) {
        // SAFETY: the caller's promise
        FACES.with_borrow_mut(|faces| unsafe { self.join(level, interface, columns, faces, energies) });
    }

    /// [`Domain::advance_interface`] with places for both faces.
    ///
    /// # Safety
    ///
    /// As that.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    unsafe fn join(
        &self,
        level: usize,
        interface: usize,
        columns: Range<usize>,
        faces: &mut [Faces; 2],
        mut energies: Option<&mut [EnergySum]>,
    ) {
        let rows = [0, 1].map(|side| self.grid.layers[interface].last() + side);
        let impedances = self.impedances(interface);
        let shares = scheme::shares(impedances);
        let stiffness = scheme::traction_weight(impedances, self.grid.dt());
        let fields = if matches!(self.scheme(), Weighted::Cells(_)) { 2 } else { 1 };
        let is_welded = self.grid.layers[interface + 1].bond == Bond::Welded;
        for start in columns.clone().step_by(PIECE) {
            let columns = start..(start + PIECE).min(columns.end);
            for (face, row) in faces.iter_mut().zip(rows) {
                // SAFETY: the caller's promise; a piece is as long as a face or shorter
                unsafe { self.advance_face(level, row, columns.clone(), face) };
            }
            let of_u = faces.each_ref().map(|face| &face[0][..columns.len()]);
            self.interfaces.look(interface, level - 1, &columns, of_u, stiffness);
            let next = |side: usize, field: usize, place: usize| match field == 0 || is_welded {
                true => scheme::joined(shares, faces.each_ref().map(|face| face[field][place])),
                false => faces[side][field][place],
            };
            if let Some(energies) = &mut energies {
                for ((side, row), energy) in rows.into_iter().enumerate().zip(energies.iter_mut()) {
                    // column by column: the same sum however columns are cut
                    for (place, i) in columns.clone().take_while(|i| *i < self.grid.nr()).enumerate() {
                        for (field, face) in faces[side][..fields].iter().enumerate() {
                            let ends = [face[place], next(side, field, place)];
                            // SAFETY: the caller's promise; the rows are not yet overwritten
                            unsafe { self.add_face_energy(level, [field, row, i], ends, energy) };
                        }
                    }
                }
            }
            for (side, row) in rows.into_iter().enumerate() {
                for field in 0..fields {
                    // SAFETY: the caller's promise
                    let row = unsafe { self.levels.columns_mut(level, row, field, &columns) };
                    row.iter_mut().enumerate().for_each(|(place, u)| *u = next(side, field, place));
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
    /// * `ends`: u^{k+1} if its layer were by itself, and u^{k+1}
    ///
    /// # Safety
    ///
    /// Levels k−1 and k stand at the node, level k, with the mixed-derivative correction both, around it; no other thread writes to them.
    #[expect(unsafe_code, reason = "a field that threads share")]
    unsafe fn add_face_energy(
        &self,
        level: usize,
        [field, j, i]: [usize; 3],
        [face, next]: [f64; 2],
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
