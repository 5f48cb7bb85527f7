//! The full theory on equal cells, [`crate::model::cell_scheme`], under the engine.

use std::{borrow::Cow, ops::Range};

use super::{
    cells::{BACKING, CellMarch, CellPatch, CellRow, CellWeights, FREE, INTERIOR, MEMBRANE, SURFACE},
    damping,
    dispatch::Instructions,
    domain::{Domain, ShownRow, SurfaceMotion, Theory},
    energy::EnergySum,
    lane::BLOCK,
    levels::Levels,
    runs::Run,
};
use crate::{
    grid::{Back, Grid},
    model::{Field, cell_scheme::CellScheme, scheme, strain::Watched, strength::Strength},
};

/// The scheme of cells, with its weights by layer.
pub struct Full {
    /// The scheme, node by node.
    scheme: CellScheme,
    /// Layers from the surface down.
    layers: Vec<CellWeights>,
}

impl Full {
    /// * `columns`: of the field, whole blocks
    pub fn new(scheme: CellScheme, columns: usize) -> Self {
        let layers = 0..scheme.grid().layers.len();
        Self { layers: layers.map(|layer| CellWeights::new(&scheme, layer, columns)).collect(), scheme }
    }
}

#[expect(unsafe_code, reason = "several threads update the field in place")]
impl Domain<Full> {
    /// A mesh of the full theory at rest.
    pub fn full(scheme: CellScheme, instructions: Instructions) -> Self {
        let grid = scheme.grid().clone();
        let levels = Levels::new(3, Full::FIELDS, grid.nz + 2, grid.nr());
        let theory = Full::new(scheme, levels.columns());
        Self::new(&grid, levels, theory, instructions)
    }

    /// What kernels get to advance rows of a layer to `level`.
    fn patch(&self, level: usize, layer: usize) -> CellPatch<'_> {
        let next = self.levels.origin(level);
        CellPatch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: [next, next.wrapping_add(self.levels.lateral())],
            lateral: self.levels.lateral(),
            stride: self.levels.stride(),
            weights: &self.theory.layers[layer],
        }
    }

    /// Advances row `j` of a layer.
    ///
    /// # Safety
    ///
    /// As [`Domain::advance`]; row and columns lie inside the arrays.
    unsafe fn advance_row<const COUNTS: bool>(
        &self,
        patch: CellPatch<'_>,
        layer: usize,
        j: usize,
        columns: Range<usize>,
        energy: &mut EnergySum,
    ) {
        let (layer, instructions) = (&self.grid.layers[layer], self.instructions);
        // SAFETY: the caller's promise
        unsafe {
            if j == layer.first {
                instructions.run(CellMarch::<SURFACE, COUNTS>::new(patch, j, columns, energy));
            } else if j != layer.last() {
                instructions.run(CellMarch::<INTERIOR, COUNTS>::new(patch, j, columns, energy));
            } else if j == self.grid.nz && self.grid.back == Back::Rigid {
                instructions.run(CellMarch::<BACKING, COUNTS>::new(patch, j, columns, energy));
            } else if self.grid.is_above_free_back(j) {
                instructions.run(CellMarch::<MEMBRANE, COUNTS>::new(patch, j, columns, energy));
            } else {
                instructions.run(CellMarch::<FREE, COUNTS>::new(patch, j, columns, energy));
            }
        }
    }

    /// Both displacements of the surface at `level` if it were free of stress, for the first columns, whole blocks.
    ///
    /// # Safety
    ///
    /// Rows 0 and 1 hold the two levels before, images among them; no other thread touches row 0 or writes to row 1.
    unsafe fn surface_if_free(&self, level: usize, free: &mut [Vec<f64>; 2]) {
        let columns = free[0].len();
        assert!(
            columns <= self.levels.columns() && free[1].len() == columns && columns.is_multiple_of(BLOCK)
        );
        let next = free.each_mut().map(|free| free.as_mut_ptr());
        let patch = CellPatch { next, ..self.patch(level, 0) };
        let none = &mut EnergySum::default();
        // SAFETY: the caller's promise; row 0 is written to `free`, which has as many columns
        let work = unsafe { CellMarch::<SURFACE, false>::new(patch, 0, 0..columns, none) };
        self.instructions.run(work);
    }

    /// Displacements at a level by number, row and column.
    ///
    /// # Safety
    ///
    /// What is asked for holds that level; no other thread writes to it while the function lives.
    unsafe fn at(&self, level: usize) -> impl Fn(usize, usize, isize) -> f64 {
        // SAFETY: the caller's promise
        move |field, j, i| unsafe { self.levels.at(level, j, field * self.levels.lateral(), i) }
    }
}

// SAFETY, of all blocks: what the functions of the trait ask of their callers
#[expect(unsafe_code, reason = "several threads update the field in place")]
impl Theory for Full {
    const FIELDS: usize = 2;
    const KEEPS_EARLIER: bool = true;
    /// Both displacements of the free surface.
    type Room = [Vec<f64>; 2];

    fn impedance(&self, layer: usize) -> f64 {
        self.scheme.impedance(layer)
    }

    fn reach(&self) -> usize {
        1
    }

    fn lateral_reach(&self) -> usize {
        damping::REACH
    }

    fn last_row(grid: &Grid) -> usize {
        // what lies on a rigid back yields along r
        grid.nz
    }

    fn strains_back(_: Back) -> bool {
        true
    }

    unsafe fn advance_run<const COUNTS: bool>(
        domain: &Domain<Self>,
        level: usize,
        run: &Run,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: &mut [EnergySum],
    ) {
        let (patch, none) = (domain.patch(level, run.layer), &mut EnergySum::default());
        for (number, j) in rows.enumerate() {
            let energy = if COUNTS { &mut energies[number] } else { &mut *none };
            unsafe { domain.advance_row::<COUNTS>(patch, run.layer, j, columns.clone(), energy) };
        }
    }

    fn strengths(&self) -> &[Strength] {
        self.scheme.strengths()
    }

    unsafe fn take_ratios(
        domain: &Domain<Self>,
        level: usize,
        part: (&Range<usize>, &Range<usize>),
        watched: Watched,
        pressure: Option<&[f64]>,
    ) {
        let at = unsafe { domain.at(level) };
        domain.ratios.take(&domain.theory.scheme, &at, level, part, watched, pressure);
    }

    unsafe fn reflect(domain: &Domain<Self>, level: usize, rows: &Range<usize>, columns: &Range<usize>) {
        let levels = &domain.levels;
        for j in rows.clone().filter(|_| columns.start == 0) {
            unsafe {
                levels.reflect_axis(level, j, 0, 1.0);
                levels.reflect_axis(level, j, levels.lateral(), -1.0);
            }
        }
    }

    unsafe fn free_surface(domain: &Domain<Self>, level: usize, room: &mut [Vec<f64>; 2], free: &mut [f64]) {
        let blocks = free.len().next_multiple_of(BLOCK);
        room.iter_mut().for_each(|free| free.resize(blocks, 0.0));
        unsafe { domain.surface_if_free(level, room) }
        free.copy_from_slice(&room[0][..free.len()]);
    }

    fn lateral([_, lateral]: &mut [Vec<f64>; 2], columns: usize) -> &[f64] {
        lateral.resize(columns, 0.0);
        lateral
    }

    unsafe fn surface_energy(
        domain: &Domain<Self>,
        level: usize,
        _: &Range<usize>,
        SurfaceMotion { displacement, lateral, .. }: SurfaceMotion<'_>,
    ) -> EnergySum {
        let (theory, earlier) = (&domain.theory, domain.levels.two_below(level));
        let [before, now] = [earlier, level - 1].map(|level| unsafe { domain.at(level) });
        let mut energy = EnergySum::default();
        let row = theory.scheme.at_row(0);
        for i in 0..displacement.len().min(domain.grid.nr()) {
            let forces = row.accelerations(&now, i);
            for (field, next) in [displacement[i], lateral[i]].into_iter().enumerate() {
                let levels = [before(field, 0, i as isize), now(field, 0, i as isize), next];
                energy.add_one(i, theory.layers[0].areas[field][i], levels, forces[field]);
            }
        }
        energy
    }

    unsafe fn face_force(
        domain: &Domain<Self>,
        level: usize,
        [field, j, i]: [usize; 3],
        _: [f64; 2],
    ) -> (f64, f64) {
        let theory = &domain.theory;
        let forces = theory.scheme.at_row(j).accelerations(unsafe { domain.at(level - 1) }, i);
        (theory.layers[domain.grid.layer_of(j)].areas[field][i], forces[field])
    }

    unsafe fn show(
        domain: &Domain<Self>,
        level: usize,
        field: Field,
        row: &ShownRow<'_>,
        values: &mut [f32],
    ) {
        let earlier = domain.levels.two_below(level);
        let [before, now, next] = [earlier, level - 1, level].map(|level| unsafe { domain.at(level) });
        let (j, nodes) = (row.j, domain.theory.scheme.at_row(row.j));
        let velocity = |field: usize, i: usize| {
            let [before, next] = [&before, &next].map(|at| at(field, j, i as isize));
            scheme::velocity(before, next, domain.grid.dt())
        };
        let stress = |i: usize| {
            let pressure = row.pressure.map_or(0.0, |pressure| pressure[i]);
            nodes.stress(field, &nodes.strain(&now, pressure, i))
        };
        for (value, i) in values.iter_mut().zip(row.columns.clone().step_by(row.every)) {
            *value = match field {
                Field::Displacement => now(0, j, i as isize),
                Field::DisplacementR => now(1, j, i as isize),
                Field::Velocity => velocity(0, i),
                Field::VelocityR => velocity(1, i),
                _ => stress(i),
            } as f32;
        }
    }

    unsafe fn stress(domain: &Domain<Self>, level: usize, [j, i]: [usize; 2], pressure: Option<f64>) -> f64 {
        let row = domain.theory.scheme.at_row(j);
        let at = unsafe { domain.at(level) };
        row.stress(Field::Stress, &row.strain(at, pressure.unwrap_or_default(), i))
    }

    fn surface_strain(&self, at: impl Fn(usize, usize, isize) -> f64, pressure: f64, i: usize) -> f64 {
        self.scheme.at_row(0).strain(at, pressure, i).largest_on_face()
    }

    unsafe fn largest_strain(domain: &Domain<Self>, level: usize, j: usize, columns: &Range<usize>) -> f64 {
        let Domain { levels, grid, .. } = domain;
        let cells = |offset: usize| [j, j + 1].map(|j| unsafe { levels.cells(level, j, offset, columns) });
        let weights = &domain.theory.layers[grid.layer_of(j)];
        let row = CellRow {
            displacements: [cells(0), cells(levels.lateral())],
            weights: weights.strains(columns),
            courant: weights.medium.courant,
        };
        domain.instructions.run(row) / (2.0 * grid.layer(j).dz)
    }

    fn cell_strain(&self, _: &Grid, at: impl Fn(usize, usize, isize) -> f64, j: usize, i: usize) -> f64 {
        self.scheme.largest_strain(at, j, i)
    }

    unsafe fn back<'a>(
        domain: &'a Domain<Self>,
        level: usize,
        columns: &Range<usize>,
    ) -> (usize, Cow<'a, [f64]>) {
        // strains need neighbours, which stand at the level before
        let at = unsafe { domain.at(level - 1) };
        let backing = domain.theory.scheme.at_row(domain.grid.nz);
        let strain = |i: usize| match i < domain.grid.nr() {
            true => backing.back_strain(&at, i).largest_on_face(),
            false => 0.0,
        };
        (level - 1, columns.clone().map(strain).collect())
    }

    fn back_strain(_: &Grid, value: f64) -> f64 {
        value
    }
}
