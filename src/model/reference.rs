//! The plain stepper: every node of every field, level after level, one loop.
//!
//! It asks a [`Scheme`] for rows, keeps three whole levels and knows nothing of tiles, vectors or threads. What the
//! [`LightCone`] leaves at rest is at rest here, too. New physics starts here: a [`Scheme`] is enough to run whole cases,
//! `percuss run --engine reference`. The fast engine is tested bitwise against it.

use std::{collections::VecDeque, io, ops::Range};

use ndarray::{Array2, ArrayView1};

use super::{
    CompletedStep, Dependence, Extent, Field, Frame, FrameFields, GaugePlan, GaugeValues, InterfacePeaks,
    Model, PointState, Request, Sample, Sampling, StrainPeak, TargetEnergy, Tension, TractionPeak,
    cells::Stress,
    cone::{ConeState, LightCone},
    scheme,
    strain::{self, CellPeak, Watched},
    strength::{RatioPeaks, Strength},
};
use crate::{
    grid::Grid,
    state::{StateError, StateReader, StateWriter},
    surface::Surface,
};

/// The displacements of a level over the whole section, each of shape `(nz + 1, nr)` \[R\]. The first one is u_z.
pub type Level<const FIELDS: usize> = [Array2<f64>; FIELDS];

/// Three consecutive levels, k−1, k and k+1.
pub type Levels<'a, const FIELDS: usize> = [&'a Level<FIELDS>; 3];

/// Advances nodes of the first `rows` and `columns` one by one.
pub fn node_by_node<const FIELDS: usize>(
    next: &mut Level<FIELDS>,
    [rows, columns]: [usize; 2],
    node: impl Fn(usize, usize) -> [f64; FIELDS],
) {
    for j in 0..rows {
        for i in 0..columns {
            for (level, value) in next.iter_mut().zip(node(j, i)) {
                level[[j, i]] = value;
            }
        }
    }
}

/// Displacement or velocity of node (j, i) at level k; `None` for stresses.
pub fn motion<const FIELDS: usize>(
    field: Field,
    [before, now, next]: Levels<'_, FIELDS>,
    dt: f64,
    j: usize,
    i: usize,
) -> Option<f64> {
    let velocity = |field: usize| scheme::velocity(before[field][[j, i]], next[field][[j, i]], dt);
    match field {
        Field::Displacement => Some(now[0][[j, i]]),
        Field::DisplacementR => Some(now[1][[j, i]]),
        Field::Velocity => Some(velocity(0)),
        Field::VelocityR => Some(velocity(1)),
        Field::Stress
        | Field::StressRr
        | Field::StressTt
        | Field::StressRz
        | Field::Pressure
        | Field::VonMises
        | Field::MaxShear
        | Field::DamageRatio => None,
    }
}

/// Interface required by the plain stepper: the update of rows from whole levels, and what is shown of them.
pub trait Scheme<const FIELDS: usize>: Send {
    /// Columns of a level in memory, those of the mesh at least.
    fn stride(&self) -> usize;

    /// Puts the displacements of the first rows and columns at level k+1 into `next`, if the surface were free of stress; others may be put there too.
    ///
    /// * `before`, `now`: levels k−1 and k
    fn advance(
        &self,
        before: &Level<FIELDS>,
        now: &Level<FIELDS>,
        next: &mut Level<FIELDS>,
        part: [usize; 2],
    );

    /// Displacement u_z of surface node `i` per unit of pressure on it \[R/(γc_p²)\].
    fn compliance(&self, i: usize) -> f64;

    /// Stresses −σ_zz and −σ_rz of an interface in column `i` on the way to level k+1, see [`super::scheme::traction_weight`].
    fn traction(&self, before: &Level<FIELDS>, now: &Level<FIELDS>, interface: usize, i: usize) -> [f64; 2];

    /// Energy of every layer between two consecutive levels.
    fn energies(&self, earlier: &Level<FIELDS>, later: &Level<FIELDS>) -> Vec<TargetEnergy>;

    /// Energy between two consecutive levels.
    #[cfg(test)]
    fn energy(&self, earlier: &Level<FIELDS>, later: &Level<FIELDS>) -> TargetEnergy {
        self.energies(earlier, later).into_iter().sum()
    }

    /// Values of fields at node (j, i) and level k; those of stress are all of one tensor.
    ///
    /// * `pressure`: on the surface during the step from k to k+1, shape `(nr,)` \[γc_p²\]
    fn show(
        &self,
        levels: Levels<'_, FIELDS>,
        pressure: &[f64],
        j: usize,
        i: usize,
    ) -> impl FnMut(Field) -> f64;

    /// Largest strain on the surface at column `i`, by magnitude.
    ///
    /// * `pressure`: on the node \[γc_p²\]
    fn surface_strain(&self, now: &Level<FIELDS>, pressure: f64, i: usize) -> f64;

    /// Looks at the cells below row `j` in some columns, if there are any: their largest strain by magnitude in the middle, and the stress there where
    /// it is compared with strengths \[γc_p²\].
    ///
    /// * `take`: takes a column and both
    fn look(
        &self,
        now: &Level<FIELDS>,
        j: usize,
        columns: Range<usize>,
        take: impl FnMut(usize, f64, Option<Stress>),
    );

    /// Largest strain at the backing, column `i`.
    fn backing_strain(&self, level: &Level<FIELDS>, i: usize) -> f64;

    /// What its layers bear, from the surface down; none where nothing is known of it.
    fn strengths(&self) -> &[Strength] {
        &[]
    }

    /// Stress on the surface, row 0, or on the backing, at column `i`; `None` where it is not compared with strengths \[γc_p²\].
    ///
    /// * `pressure`: on the node of the surface \[γc_p²\]
    fn face_stress(&self, _now: &Level<FIELDS>, _pressure: f64, _row: usize, _i: usize) -> Option<Stress> {
        None
    }
}

/// A target under the plain stepper.
pub struct Reference<T, S, const FIELDS: usize> {
    grid: Grid,
    scheme: S,
    cone: LightCone,
    shown: FrameFields,
    /// Rows of which the largest strain is taken.
    strained: Option<Dependence>,
    gauges: GaugePlan,
    /// Tension of an interface that is shown.
    tension: Option<f64>,
    /// Largest tractions of interfaces.
    tractions: Vec<InterfacePeaks>,
    /// What the layers bear, and the largest ratios of stresses to it.
    strengths: Vec<Strength>,
    ratios: RatioPeaks,
    /// Interfaces that have been in tension.
    torn: Vec<bool>,
    /// Levels k−1 and k, and a buffer for level k+1.
    before: Level<FIELDS>,
    now: Level<FIELDS>,
    next: Level<FIELDS>,
    level: u64,
    /// Largest strain of cells, and on the backing, which is that of row `nz`.
    peaks: [CellPeak; 2],
    steps: VecDeque<CompletedStep<T>>,
    /// Rows and columns of the newest level that are not left at rest.
    rows: usize,
    columns: usize,
}

impl<T, S: Scheme<FIELDS>, const FIELDS: usize> Reference<T, S, FIELDS> {
    /// A target at rest.
    ///
    /// * `cone`: of this target
    /// * `shown`: what is shown
    pub fn new(grid: Grid, scheme: S, cone: LightCone, shown: impl Into<Sampling>) -> Self {
        let Sampling { frames, gauges, strained, tension } = shown.into();
        let strengths = scheme.strengths().to_vec();
        let rest = || [(); FIELDS].map(|()| Array2::zeros((grid.nz + 1, scheme.stride())));
        Self {
            before: rest(),
            now: rest(),
            next: rest(),
            scheme,
            cone,
            shown: frames,
            strained,
            gauges: GaugePlan::new(&gauges, &grid),
            tension,
            torn: vec![false; grid.layers.len() - 1],
            tractions: vec![InterfacePeaks::default(); tension.map_or(0, |_| grid.layers.len() - 1)],
            ratios: RatioPeaks::new(&strengths),
            strengths,
            level: 0,
            peaks: Default::default(),
            steps: VecDeque::new(),
            rows: 0,
            columns: 0,
            grid,
        }
    }

    /// Rows of a displacement at the newest level and the one before it, for comparisons.
    ///
    /// * `field`: number of the displacement
    pub fn row(&self, field: usize, j: usize) -> [ArrayView1<'_, f64>; 2] {
        [self.now[field].row(j), self.before[field].row(j)]
    }

    /// Notes the strains of cells and on the backing at level k, and how the stresses compare with strengths: in these cells, and on both faces.
    ///
    /// * `loaded`: number of surface nodes that have been in contact
    /// * `pressure`: on the surface \[γc_p²\]
    fn note_strains(&mut self, loaded: usize, pressure: &[f64]) {
        let (grid, level) = (&self.grid, self.level as usize);
        let strained = self.strained.map_or(usize::MAX, |part| self.cone.needed(level + 1, part));
        let Watched { rows, columns } = Watched::at(grid, level, loaded, strained);
        let columns = columns.min(self.columns);
        let known = |row: usize| self.strengths.get(grid.layer_of(row)).filter(|layer| layer.is_known());
        let [cells, backing] = &mut self.peaks;
        for row in 0..rows.min(self.rows) {
            let strength = known(row);
            self.scheme.look(&self.now, row, 0..columns, |column, strain, stress| {
                *cells = cells.larger(CellPeak { strain, level, row, column });
                if let (Some(strength), Some(stress)) = (strength, stress) {
                    self.ratios.take(strength, &stress, self.level, || strain::middle(grid, row, column));
                }
            });
        }
        let backed = if grid.has_back { grid.nr() } else { 0 };
        for column in 0..backed {
            let strain = self.scheme.backing_strain(&self.now, column).abs();
            *backing = backing.larger(CellPeak { strain, level, row: grid.nz, column });
        }
        for row in [Some(0), grid.has_back.then_some(grid.nz)].into_iter().flatten() {
            let Some(strength) = known(row) else { continue };
            // beyond the light cone there is no stress
            for (column, pressure) in pressure.iter().enumerate().take(self.columns) {
                let Some(stress) = self.scheme.face_stress(&self.now, *pressure, row, column) else {
                    continue;
                };
                self.ratios.take(strength, &stress, self.level, || (grid.r(column), grid.z(row)));
            }
        }
    }

    /// Level k as a frame shows it, with k+1 computed.
    fn frame(&self, pressure: &[f64]) -> Frame {
        let levels = [&self.before, &self.now, &self.next];
        let every = self.shown.every;
        let rows = self.grid.shown_rows(every);
        let at_rest = |&field: &Field| Sample::at_rest(field, &self.grid, &self.shown);
        let mut samples: Vec<Sample> = self.shown.fields.iter().map(at_rest).collect();
        if let Some(Extent { nr, .. }) = samples.first().map(|sample| sample.extent) {
            for place in 0..rows.len() * nr {
                let mut value = self.scheme.show(levels, pressure, rows[place / nr], place % nr * every);
                for sample in &mut samples {
                    sample.values[place] = value(sample.field) as f32;
                }
            }
        }
        let energies = [[&self.before, &self.now], [&self.now, &self.next]]
            .map(|[earlier, later]| self.scheme.energies(earlier, later));
        let layers = (0..self.grid.layers.len()).map(|n| energies.each_ref().map(|layers| layers[n]));
        Frame {
            energy: energies.each_ref().map(|layers| layers.iter().copied().sum()),
            layers: layers.collect(),
            samples,
            surface: self.now[0].row(0).iter().take(self.grid.nr()).copied().collect(),
        }
    }

    /// Notes the tractions of interfaces at level k; those that are in tension for the first time.
    fn note_tractions(&mut self) -> Vec<Tension> {
        let Some(limit) = self.tension else { return Vec::new() };
        let level = self.level as usize;
        let mut first = Vec::new();
        // beyond the light cone nothing moves
        let reached = self.grid.layers.iter().take_while(|layer| layer.last() < self.rows).count();
        for (interface, peaks) in self.tractions.iter_mut().enumerate().take(reached) {
            for column in 0..self.columns {
                let [stress, shear] = self.scheme.traction(&self.before, &self.now, interface, column);
                if let Some(below) = self.strengths.get(interface + 1) {
                    let place = || (self.grid.r(column), self.grid.bottom(&self.grid.layers[interface]));
                    self.ratios.take_traction(interface, below, [stress, shear], self.level, place);
                }
                let InterfacePeaks { tension, shear: largest_shear } = peaks;
                *tension = tension.larger(TractionPeak { stress: -stress, level, column });
                *largest_shear = largest_shear.larger(TractionPeak { stress: shear.abs(), level, column });
                if stress < -limit && !self.torn[interface] {
                    self.torn[interface] = true;
                    first.push(Tension { interface, level, column, stress });
                }
            }
        }
        first
    }

    /// What the gauges show of level k, with k+1 computed, if there are any.
    fn gauge(&self, pressure: &[f64], shows_lines: bool) -> Option<GaugeValues> {
        let GaugePlan { point_nodes, line_nodes, .. } = &self.gauges;
        let levels = [&self.before, &self.now, &self.next];
        let all = (0..self.grid.nz + 1, 0..self.columns);
        let show = |j: usize, i: usize| self.scheme.show(levels, pressure, j, i);
        let mut points = vec![PointState::default(); point_nodes.len()];
        for (j, numbers) in point_nodes.within(all.0.clone(), all.1.clone()) {
            for (state, &i) in points[numbers.clone()].iter_mut().zip(point_nodes.columns(&numbers)) {
                let mut value = show(j, i);
                *state = PointState {
                    displacement: value(Field::Displacement),
                    velocity: value(Field::Velocity),
                    stress: value(Field::Stress),
                };
            }
        }
        let lines = shows_lines.then(|| {
            let mut lines = vec![0.0; line_nodes.len()];
            for (j, numbers) in line_nodes.within(all.0, all.1) {
                for (stress, &i) in lines[numbers.clone()].iter_mut().zip(line_nodes.columns(&numbers)) {
                    *stress = show(j, i)(Field::Stress);
                }
            }
            lines
        });
        (!self.gauges.is_empty()).then(|| self.gauges.values(&points, lines.as_deref()))
    }
}

impl<T: Send, S: Scheme<FIELDS>, const FIELDS: usize> Model<T> for Reference<T, S, FIELDS> {
    fn predict(&mut self, surface: &mut Surface) {
        // what is beyond is at rest, and free
        let columns = self.cone.next_columns();
        self.scheme.advance(&self.before, &self.now, &mut self.next, [1, columns]);
        for i in 0..columns {
            surface.free[i] = self.next[0][[0, i]];
        }
        for i in 0..self.grid.nr() {
            surface.compliance[i] = self.scheme.compliance(i);
        }
    }

    fn advance(&mut self, surface: &Surface, step: T, request: Request) {
        let level = self.level as usize + 1;
        self.cone.advance(level, surface.loaded);
        let (active, moved) = (self.cone.active(level), self.cone.active_columns().min(self.grid.nr()));
        self.rows = self.grid.rows_at(0..active.rows).end;
        self.columns = active.columns.min(self.grid.nr());
        // the free surface was put there, beyond the cone too
        self.next.iter_mut().for_each(|level| level.row_mut(0).fill(0.0));
        self.scheme.advance(&self.before, &self.now, &mut self.next, [self.rows, self.columns]);
        for i in 0..self.columns {
            self.next[0][[0, i]] = if i < moved { surface.displacement[i] } else { 0.0 };
        }
        let frame = request.frame.then(|| self.frame(&surface.pressure));
        let gauges = self.gauge(&surface.pressure, request.lines);
        let before = self.ratios.clone();
        self.note_strains(surface.loaded, &surface.pressure);
        let tensions = self.note_tractions();
        let failures = self.ratios.passed(&before);
        self.steps.push_back(CompletedStep { step, frame, gauges, tensions, failures });
        std::mem::swap(&mut self.before, &mut self.now);
        std::mem::swap(&mut self.now, &mut self.next);
        self.level += 1;
    }

    fn next(&mut self, _finish: bool) -> Option<CompletedStep<T>> {
        self.steps.pop_front()
    }

    fn surface_strain(&self, pressure: &[f64]) -> (f64, usize) {
        let at = |i: usize| (self.strain_at(pressure.get(i).copied().unwrap_or_default(), i), i);
        (0..self.grid.nr()).map(at).fold((0.0, 0), super::larger_strain)
    }

    fn strain_at(&self, pressure: f64, i: usize) -> f64 {
        self.scheme.surface_strain(&self.now, pressure, i)
    }

    fn strain_peak(&mut self) -> StrainPeak {
        let [cells, CellPeak { strain, level, column, .. }] = self.peaks;
        let backing = StrainPeak::on_backing(&self.grid, strain, level, column);
        StrainPeak::largest(&self.grid, cells, backing)
    }

    fn interface_peaks(&mut self) -> Vec<InterfacePeaks> {
        self.tractions.clone()
    }

    fn strength_peaks(&mut self) -> RatioPeaks {
        self.ratios.clone()
    }

    fn find_non_finite(&mut self) -> Option<(f64, f64)> {
        let find = |level: &Array2<f64>| {
            let bad = level.indexed_iter().find(|(_, u)| !u.is_finite());
            bad.map(|((j, i), _)| (self.grid.r(i), self.grid.z(j)))
        };
        self.now.iter().find_map(find)
    }

    fn save(&mut self, out: &mut StateWriter<'_>) -> io::Result<()> {
        assert!(self.steps.is_empty(), "{} steps have not been returned", self.steps.len());
        out.put(&(self.cone.state(), self.peaks, &self.torn, &self.tractions, &self.ratios))?;
        for level in [&self.before, &self.now] {
            level
                .iter()
                .flat_map(|field| field.rows())
                .try_for_each(|row| out.numbers(row.as_slice().expect("a row is contiguous")))?;
        }
        Ok(())
    }

    fn load(&mut self, step: u64, from: &mut StateReader<'_>) -> Result<(), StateError> {
        let cone: ConeState;
        let shown = self.tractions.len();
        let known = self.ratios.bonds.len();
        (self.level, (cone, self.peaks, self.torn, self.tractions, self.ratios)) = (step, from.get()?);
        StateError::unless(self.ratios.bonds.len() == known, "number of bonds", self.ratios.bonds.len())?;
        StateError::unless(self.tractions.len() == shown, "number of interfaces", self.tractions.len())?;
        self.cone.set(step as usize, cone)?;
        StateError::unless(
            self.torn.len() + 1 == self.grid.layers.len(),
            "number of interfaces",
            self.torn.len(),
        )?;
        for level in [&mut self.before, &mut self.now] {
            for mut row in level.iter_mut().flat_map(|field| field.rows_mut()) {
                from.numbers(row.as_slice_mut().expect("a row is contiguous"))?;
            }
        }
        Ok(())
    }
}
