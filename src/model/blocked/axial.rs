//! The simplified theory, [`crate::model::scheme`], under the engine.

use std::{borrow::Cow, ops::Range};

use super::{
    cells::largest_stretch,
    corner::add_corner,
    dispatch::Instructions,
    domain::{Domain, ShownRow, SurfaceMotion, Theory},
    energy::EnergySum,
    kernel::{Advance, FreeSurface},
    lane::{BLOCK, padded},
    levels::{CornerTerm, Levels, Patch, Radial},
    runs::Run,
};
use crate::{
    grid::{Back, Grid},
    model::{
        Field,
        scheme::{self, Corner, RadialWeights},
    },
};

/// A layer of the scheme with one displacement.
#[derive(Clone, Copy)]
pub struct Plate<'a> {
    /// Impedance Z \[γc_p of the struck layer\].
    pub impedance: f64,
    /// Radial weights, by column.
    pub weights: &'a [RadialWeights],
    /// Those of the mixed-derivative correction; none without it.
    pub corner: &'a [RadialWeights],
}

/// The scheme with one displacement, with its weights.
pub struct Axial {
    /// Cell areas by column, for whole blocks.
    area: Vec<f64>,
    layers: Vec<PlateWeights>,
    /// The mixed-derivative correction, if there is one.
    corner: Option<Corner>,
}

/// Weights of a layer.
struct PlateWeights {
    impedance: f64,
    /// Radial weights of the scheme.
    weights: Weights,
    /// Those of the mixed-derivative correction; none without it.
    corner: Weights,
}

impl Axial {
    /// * `corner`: the mixed-derivative correction, if there is one
    /// * `columns`: of the field, whole blocks
    pub fn new(grid: &Grid, plates: &[Plate<'_>], corner: Option<Corner>, columns: usize) -> Self {
        let weights = |plate: &Plate<'_>| PlateWeights {
            impedance: plate.impedance,
            weights: Weights::new(plate.weights, columns),
            corner: Weights::new(plate.corner, if corner.is_some() { columns } else { 0 }),
        };
        Self {
            area: padded(grid.area.iter().copied(), columns),
            layers: plates.iter().map(weights).collect(),
            corner,
        }
    }

    /// Radial weights of a layer.
    fn radial(&self, layer: usize) -> Radial<'_> {
        self.layers[layer].weights.by_column()
    }

    /// The mixed-derivative correction in a layer, if there is one.
    fn corner(&self, layer: usize) -> Option<CornerTerm<'_>> {
        let radial = self.layers[layer].corner.by_column();
        self.corner.map(|corner| CornerTerm { share: corner.share, radial })
    }
}

/// Radial weights by column, for whole blocks.
struct Weights {
    outward: Vec<f64>,
    inward: Vec<f64>,
}

impl Weights {
    fn new(weights: &[RadialWeights], columns: usize) -> Self {
        Self {
            outward: padded(weights.iter().map(|weights| weights.outward), columns),
            inward: padded(weights.iter().map(|weights| weights.inward), columns),
        }
    }

    fn by_column(&self) -> Radial<'_> {
        Radial { outward: &self.outward, inward: &self.inward }
    }
}

/// How the stress of a row below the surface follows from displacements.
enum StressAt {
    /// From those of two rows, by [`scheme::stress`].
    Row {
        /// The rows.
        around: [usize; 2],
        /// Sign of the second, which is an odd image below the backing.
        sign: f64,
        /// Impedance of the layer \[γc_p\]: over Δt in place of Δz.
        impedance: f64,
    },
    /// From those of both layers: the last two rows of the layer above and the first two of the one below.
    Interface {
        /// The rows.
        rows: [usize; 4],
        /// Impedances of both layers \[γc_p of the struck one\].
        impedances: [f64; 2],
    },
}

impl Domain<Axial> {
    /// A mesh of the simplified theory at rest.
    ///
    /// * `plates`: layers from the surface down
    /// * `corner`: the mixed-derivative correction, if there is one
    pub fn axial(
        grid: &Grid,
        plates: &[Plate<'_>],
        corner: Option<Corner>,
        instructions: Instructions,
    ) -> Self {
        let levels = Levels::new(Corner::levels(corner.as_ref()), Axial::FIELDS, grid.nz + 2, grid.nr());
        let theory = Axial::new(grid, plates, corner, levels.columns());
        Self::new(grid, levels, theory, instructions)
    }

    /// What kernels get to advance rows of a run from row `j` on to `level`.
    fn patch(&self, level: usize, run: &Run, j: usize) -> Patch<'_> {
        Patch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: self.levels.origin(level),
            stride: self.levels.stride(),
            around: run.around(j),
            radial: self.theory.radial(run.layer),
            corner: self.theory.corner(run.layer),
        }
    }

    /// How the stress of row `j`, below the surface, follows from displacements.
    fn stress_at(&self, j: usize) -> StressAt {
        if let Some(interface) = self.grid.interface_of(j) {
            let last = self.grid.layers[interface].last();
            return StressAt::Interface {
                rows: [last - 1, last, last + 1, last + 2],
                impedances: self.impedances(interface),
            };
        }
        // below the backing stands an odd image of the row above, below the last row above a free back an even one of that row
        let (below, sign) = match self.grid.back {
            Back::Rigid if j == self.grid.nz => (j - 1, -1.0),
            Back::Free if j == self.grid.nz => (j, 1.0),
            Back::Rigid | Back::Free => (j + 1, 1.0),
        };
        StressAt::Row {
            around: [j - 1, below],
            sign,
            impedance: self.theory.impedance(self.grid.layer_of(j)),
        }
    }
}

/// Writes every so many of some numbers, from the first on.
///
/// * `number`: the i-th of them
fn fill(values: &mut [f32], every: usize, number: impl Fn(usize) -> f64) {
    if every == 1 {
        values.iter_mut().enumerate().for_each(|(i, value)| *value = number(i) as f32);
    } else {
        values.iter_mut().enumerate().for_each(|(i, value)| *value = number(i * every) as f32);
    }
}

/// Stress at an interface, by [`scheme::interface_stress`].
///
/// * `u`: displacements of its rows
fn interface_stress(impedances: [f64; 2], dt: f64, [a, b, c, d]: [f64; 4]) -> f64 {
    let [upper, lower] = impedances;
    let cells = [upper * (a - b) / dt, lower * (c - d) / dt];
    scheme::interface_stress(scheme::shares(impedances), cells)
}

// SAFETY, of all blocks: what the functions of the trait ask of their callers
#[expect(unsafe_code, reason = "several threads update the field in place")]
impl Theory for Axial {
    const FIELDS: usize = 1;
    const KEEPS_EARLIER: bool = false;
    /// Sums over z.
    type Room = Vec<f64>;

    fn impedance(&self, layer: usize) -> f64 {
        self.layers[layer].impedance
    }

    fn reach(&self) -> usize {
        if self.corner.is_some() { 2 } else { 1 }
    }

    fn lateral_reach(&self) -> usize {
        self.reach()
    }

    fn last_row(grid: &Grid) -> usize {
        if grid.back == Back::Rigid { grid.nz - 1 } else { grid.nz }
    }

    fn strains_back(back: Back) -> bool {
        back == Back::Rigid
    }

    unsafe fn advance_run<const COUNTS: bool>(
        domain: &Domain<Self>,
        level: usize,
        run: &Run,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: &mut [EnergySum],
    ) {
        let patch = domain.patch(level, run, rows.start);
        let work = unsafe { Advance::<COUNTS>::new(patch, rows, columns, &domain.theory.area, energies) };
        domain.instructions.run(work);
    }

    unsafe fn reflect(domain: &Domain<Self>, level: usize, rows: &Range<usize>, columns: &Range<usize>) {
        if domain.theory.corner.is_none() {
            return;
        }
        let Domain { levels, grid, .. } = domain;
        unsafe {
            if columns.start == 0 {
                rows.clone().for_each(|j| levels.reflect_axis(level, j, 0, 1.0));
            }
            if rows.contains(&1) && grid.nz > 1 {
                levels.reflect_row(level, 1, -1, 1.0, columns);
            }
            let last = domain.last_row();
            if rows.contains(&last) && grid.back == Back::Rigid {
                levels.reflect_row(level, last, grid.nz as isize + 1, -1.0, columns);
            }
        }
    }

    unsafe fn free_surface(domain: &Domain<Self>, level: usize, sums: &mut Vec<f64>, free: &mut [f64]) {
        let Domain { levels, theory, .. } = domain;
        let line = |level: usize, j: usize| unsafe { levels.part(level, j, 0..levels.columns() + BLOCK) };
        let [earlier, now] = [levels.two_below(level), level - 1];
        domain.instructions.run(FreeSurface {
            before: line(earlier, 0),
            now: [0, 1].map(|j| line(now, j)),
            radial: theory.radial(0),
            corner: theory
                .corner(0)
                .map(|corner| (corner, [earlier, now].map(|level| [0, 2].map(|j| line(level, j))))),
            sums,
            free,
        });
    }

    fn lateral(_: &mut Vec<f64>, _columns: usize) -> &[f64] {
        &[]
    }

    unsafe fn surface_energy(
        domain: &Domain<Self>,
        level: usize,
        columns: &Range<usize>,
        SurfaceMotion { displacement, free, .. }: SurfaceMotion<'_>,
    ) -> EnergySum {
        let line = |level: usize, j: usize, columns: &Range<usize>| unsafe {
            domain.levels.part(level, j, columns.clone())
        };
        let levels = [domain.levels.two_below(level), level - 1];
        let mut free = free.to_vec();
        if let Some(corner) = domain.theory.corner(0).filter(|corner| corner.share > 0.0) {
            let mut damped = vec![0.0; free.len()];
            let wider = 0..free.len() + 2;
            let rows = levels.map(|level| [0, 2].map(|j| line(level, j, &wider)));
            add_corner(rows, 1.0, corner, &mut Vec::new(), &mut damped);
            let undamped = |(free, damped): (&mut f64, f64)| *free = (-corner.share).mul_add(damped, *free);
            free.iter_mut().zip(damped).for_each(undamped);
        }
        let [before, now] = levels.map(|level| line(level, 0, columns));
        EnergySum::of_surface(&domain.theory.area, [before, now, displacement], &free)
    }

    unsafe fn face_force(
        domain: &Domain<Self>,
        level: usize,
        [_, j, i]: [usize; 3],
        [before, face]: [f64; 2],
    ) -> (f64, f64) {
        let Domain { levels, theory, .. } = domain;
        let (earlier, now, column) = (levels.two_below(level), level - 1, i as isize);
        let at = |level: usize, j: usize, i: isize| unsafe { levels.at(level, j, 0, i) };
        let here = at(now, j, column);
        let force = (face - here) - (here - before);
        let force = theory.corner(domain.grid.layer_of(j)).map_or(force, |corner| {
            let [a, _, _, e, _] = domain.runs.around(j).unwrap_or_default();
            let row = |distance: isize| j.wrapping_add_signed(distance / levels.stride() as isize);
            let moved = |dj: isize, di: isize| {
                let j = match dj {
                    0 => j,
                    dj if dj < 0 => row(a),
                    _ => row(e),
                };
                at(now, j, column + di) - at(earlier, j, column + di)
            };
            (-corner.share).mul_add(scheme::corner(moved, corner.radial.column(i)), force)
        });
        (theory.area[i], force)
    }

    unsafe fn show(
        domain: &Domain<Self>,
        level: usize,
        field: Field,
        row: &ShownRow<'_>,
        values: &mut [f32],
    ) {
        let line = |level: usize, j: usize| unsafe { domain.levels.part(level, j, row.columns.clone()) };
        let (now, dt) = (level - 1, domain.grid.dt());
        match (field, row.pressure) {
            (Field::Displacement, _) => {
                let here = line(now, row.j);
                fill(values, row.every, |i| here[i]);
            }
            (Field::Velocity, _) => {
                let next = line(level, row.j).iter().step_by(row.every);
                for ((value, next), before) in values.iter_mut().zip(next).zip(row.before) {
                    *value = scheme::velocity(*before, *next, dt) as f32;
                }
            }
            (Field::Stress, Some(pressure)) => {
                let pressure = &pressure[row.columns.clone()];
                fill(values, row.every, |i| pressure[i]);
            }
            (Field::Stress, None) => match domain.stress_at(row.j) {
                StressAt::Row { around, sign, impedance } => {
                    let [above, below] = around.map(|j| line(now, j));
                    fill(values, row.every, |i| impedance * scheme::stress(above[i], sign * below[i], dt));
                }
                StressAt::Interface { rows, impedances } => {
                    let lines = rows.map(|j| line(now, j));
                    fill(values, row.every, |i| interface_stress(impedances, dt, lines.map(|line| line[i])));
                }
            },
            (other, _) => unreachable!("a case of this model does not show {other:?}"),
        }
    }

    unsafe fn stress(domain: &Domain<Self>, level: usize, [j, i]: [usize; 2], pressure: Option<f64>) -> f64 {
        let u = |j: usize| unsafe { domain.levels.at(level, j, 0, i as isize) };
        let dt = domain.grid.dt();
        pressure.unwrap_or_else(|| match domain.stress_at(j) {
            StressAt::Row { around: [above, below], sign, impedance } => {
                impedance * scheme::stress(u(above), sign * u(below), dt)
            }
            StressAt::Interface { rows, impedances } => interface_stress(impedances, dt, rows.map(u)),
        })
    }

    fn surface_strain(&self, _: impl Fn(usize, usize, isize) -> f64, pressure: f64, _: usize) -> f64 {
        pressure.abs()
    }

    unsafe fn largest_strain(domain: &Domain<Self>, level: usize, j: usize, columns: &Range<usize>) -> f64 {
        let [upper, lower] = [j, j + 1].map(|j| unsafe { &domain.levels.cells(level, j, 0, columns)[1..] });
        largest_stretch(upper, lower) / domain.grid.layer(j).dz
    }

    fn cell_strain(&self, grid: &Grid, at: impl Fn(usize, usize, isize) -> f64, j: usize, i: usize) -> f64 {
        (at(0, j + 1, i as isize) - at(0, j, i as isize)).abs() / grid.layer(j).dz
    }

    unsafe fn back<'a>(
        domain: &'a Domain<Self>,
        level: usize,
        columns: &Range<usize>,
    ) -> (usize, Cow<'a, [f64]>) {
        (level, unsafe { domain.levels.part(level, domain.last_row(), columns.clone()) }.into())
    }

    fn back_strain(grid: &Grid, value: f64) -> f64 {
        // odd image beyond the backing: ∂u/∂z = −u_{nz−1}/Δz
        value / grid.layer(grid.nz).dz
    }
}
