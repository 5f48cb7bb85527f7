//! The fast engine: the schemes of [`super::scheme`] and [`super::cells`] in vectors, tiles and threads.
//!
//! Two levels of a displacement are kept, with the mixed-derivative correction and with cells three, rows 0 (the surface) to nz (the backing), in the order of radii; the next level overwrites
//! the oldest. A band near the surface goes step by step; the interior follows behind it in passes over many
//! levels ([`tiles`], [`workers`]). Frames, points and lines are sampled on the way, and the largest strain is taken ([`sampler`], [`gauge`], [`strains`], [`strengths`]), and steps wait in the engine
//! until theirs are complete.
//!
//! Threads share the field through raw parts: a slice never covers a number that another thread may write while it lives, and no
//! kernel loads one. What orders them is a lock and one counter per tile row ([`handover`]); `Arc` counts are never relied on for ordering.
//! `tests/concurrency/run` checks all that: Miri and ThreadSanitizer run the engine on small meshes cut into small tiles, with
//! plain vectors of every width, whose accesses they see; loom tries the orders in which the band and helpers may run.
//!
//! Work is limited to the active region ([`super::cone`]): what has moved and is still needed.

use std::{collections::VecDeque, io, sync::Arc};

use super::{
    CompletedStep, Dependence, FrameFields, GAUGES_UNDER_WAY, GaugePlan, InterfacePeaks, Model, Request,
    Sampling, StrainPeak, Tension, cell_scheme::CellScheme, cone::LightCone, larger_strain, scheme,
    scheme::Corner, strain::Watched, strength::RatioPeaks,
};
use crate::{
    grid::Grid,
    state::{StateError, StateReader, StateWriter},
    surface::Surface,
};

mod axial;
mod cells;
mod corner;
mod damping;
pub(super) mod dispatch;
mod domain;
mod energy;
mod full;
mod gauge;
mod handover;
mod interface;
mod joining;
mod kernel;
pub(super) mod lane;
mod levels;
#[cfg(all(test, loom))]
mod models;
mod parts;
mod runs;
mod sampler;
mod state;
mod strains;
mod strengths;
mod sync;
#[cfg(test)]
mod tests;
mod tiles;
mod workers;

pub use axial::{Axial, Plate};
pub use dispatch::Instructions;
pub use full::Full;

use domain::{Domain, SurfaceMotion, Theory};
use gauge::Gauge;
use sampler::Sampler;
use strains::Strains;
use tiles::{LevelTask, RowPeak, Sizes};
use workers::{Ended, Workers};

/// Memory of frames that are under way \[bytes\]; two may be in any case.
const FRAMES_UNDER_WAY: usize = 64 << 20;

/// A target under the fast engine.
pub struct Engine<T, S: Theory> {
    grid: Grid,
    field: Workers<S>,
    cone: LightCone,
    /// Level k of the surface.
    level: usize,
    /// Levels that no pass over the interior has begun yet.
    behind: Vec<LevelTask>,
    shown: FrameFields,
    /// Rows of which the largest strain is taken.
    strained: Option<Dependence>,
    /// Rows that frames show.
    shown_rows: Arc<[usize]>,
    gauges: Arc<GaugePlan>,
    /// Steps that have not been returned.
    steps: VecDeque<Waiting<T>>,
    /// Level that the interior has reached, passes that are over.
    reached: usize,
    /// Frames that may be under way, and steps with gauges.
    most_frames: usize,
    most_gauges: usize,
    /// Largest peak of the row before the backing so far, and that of the newest level.
    peaks: [RowPeak; 2],
    /// Largest strain of cells so far.
    strains: Arc<Strains>,
    /// What the free surface keeps from step to step.
    room: S::Room,
}

/// A step that has not been returned.
struct Waiting<T> {
    step: T,
    /// The level after it, if tension of interfaces is looked for, or a strength is known.
    watched: Option<usize>,
    /// What samples it, if it is a frame.
    sampler: Option<Arc<Sampler>>,
    /// What records its points and lines, if there are any.
    gauge: Option<Arc<Gauge>>,
}

impl<T> Waiting<T> {
    /// True once the interior has reached what the step waits for.
    fn is_complete(&self, reached: usize) -> bool {
        let sampled = self.sampler.as_ref().map(|sampler| sampler.level());
        let gauged = self.gauge.as_ref().map(|gauge| gauge.level());
        sampled.max(gauged).max(self.watched).is_none_or(|level| level <= reached)
    }
}

impl<T> Engine<T, Axial> {
    /// A target of the simplified theory at rest.
    ///
    /// * `plates`: layers from the surface down
    /// * `corner`: the mixed-derivative correction, if there is one
    /// * `cone`: of these layers
    /// * `shown`: what is shown
    pub fn new(
        grid: Grid,
        plates: &[Plate<'_>],
        corner: Option<Corner>,
        cone: LightCone,
        shown: Sampling,
        instructions: Instructions,
    ) -> Self {
        let domain = Domain::axial(&grid, plates, corner, instructions);
        Self::of(grid, domain, cone, shown)
    }
}

impl<T> Engine<T, Full> {
    /// A target of the full theory at rest.
    ///
    /// * `cone`: of this target
    /// * `shown`: what is shown
    pub fn with_cells(
        scheme: CellScheme,
        cone: LightCone,
        shown: Sampling,
        instructions: Instructions,
    ) -> Self {
        let grid = scheme.grid().clone();
        Self::of(grid, Domain::full(scheme, instructions), cone, shown)
    }
}

impl<T, S: Theory> Engine<T, S> {
    fn of(grid: Grid, mut domain: Domain<S>, cone: LightCone, shown: Sampling) -> Self {
        let Sampling { frames: shown, gauges, strained, tension, .. } = shown;
        domain.interfaces.limit = tension;
        let gauges = Arc::new(GaugePlan::new(&gauges, &grid));
        let every = shown.every.max(1);
        let shown_rows: Arc<[usize]> = grid.shown_rows(every).into();
        let frame_size = size_of::<f32>()
            * grid.nr().min(shown.columns).div_ceil(every)
            * shown_rows.len()
            * shown.fields.len();
        Self {
            cone,
            field: Workers::new(domain, Sizes::TUNED),
            level: 0,
            behind: Vec::new(),
            steps: VecDeque::new(),
            reached: 0,
            most_frames: (FRAMES_UNDER_WAY / frame_size.max(1)).max(2),
            most_gauges: (GAUGES_UNDER_WAY / gauges.size()).max(2),
            peaks: Default::default(),
            strains: Arc::default(),
            shown,
            strained,
            shown_rows,
            gauges,
            room: S::Room::default(),
            grid,
        }
    }

    /// What there is to do on the way to the newest level.
    ///
    /// * `loaded`: number of surface nodes that have been in contact
    fn task(&self, request: Request, loaded: usize) -> LevelTask {
        let active = self.cone.active(self.level);
        let sampler = || {
            let surface = self.field.row(self.level - 1, 0)[..self.cone.active_columns()].to_vec();
            let shown = (&self.shown, &self.shown_rows);
            Arc::new(Sampler::new(self.level, &self.grid, active.rows, shown, surface))
        };
        let gauge = || Arc::new(Gauge::new(self.level, &self.gauges, request.lines));
        LevelTask {
            active,
            sampler: request.frame.then(sampler),
            gauge: (!self.gauges.is_empty()).then(gauge),
            strains: Arc::clone(&self.strains),
            watched: Watched::at(&self.grid, self.level - 1, loaded, self.strained_rows()),
        }
    }

    /// Rows of cells of which the strain may be taken at the level before the newest.
    fn strained_rows(&self) -> usize {
        self.strained.map_or(usize::MAX, |part| self.cone.needed(self.level, part))
    }

    /// Lets the interior follow up to the level of the surface.
    fn follow(&mut self) {
        if !self.behind.is_empty() {
            let base = self.level - self.behind.len();
            self.field.follow(base, std::mem::take(&mut self.behind));
            self.note_passes();
        }
    }

    /// Brings the interior up to the level of the surface.
    fn catch_up(&mut self) {
        self.follow();
        self.field.settle();
        self.note_passes();
    }

    /// Records passes that have ended.
    fn note_passes(&mut self) {
        while let Some(Ended { level, peaks: [earlier, last] }) = self.field.ended() {
            self.reached = level;
            self.note_peak(earlier);
            self.note_peak(last);
        }
    }

    /// Records a peak of the row before the backing. That of the newest level is counted after the surface
    /// has advanced.
    fn note_peak(&mut self, peak: RowPeak) {
        let [settled, newest] = &mut self.peaks;
        for peak in [std::mem::take(newest), peak] {
            let slot = if peak.level < self.level { &mut *settled } else { &mut *newest };
            *slot = slot.larger(peak);
        }
    }

    /// Records the last row that moves, if the near-surface band of `depths` depths has it and strains there.
    fn note_peak_in_band(&mut self, depths: usize) {
        let domain = self.field.domain();
        if domain.last_depth() >= depths || !domain.strains_back() {
            return;
        }
        let columns = 0..self.cone.active_columns();
        // SAFETY: the band has the back and so the whole layer; no pass is under way there
        #[expect(unsafe_code, reason = "a field that threads share")]
        let (level, back) = unsafe { S::back(domain, self.level, &columns) };
        let start = RowPeak { level, ..RowPeak::default() };
        self.note_peak((0..).zip(back.iter()).fold(start, |peak, (i, value)| peak.with(*value, level, i)));
    }

    /// True if what the next step shows is complete.
    fn is_complete(&self) -> bool {
        self.steps.front().is_some_and(|waiting| waiting.is_complete(self.reached))
    }

    /// True if more frames or gauges are under way than memory is meant for.
    fn is_crowded(&self) -> bool {
        let has_gauges = !self.gauges.is_empty();
        let frames = || self.steps.iter().filter(|waiting| waiting.sampler.is_some()).count();
        (has_gauges && self.steps.len() > self.most_gauges) || frames() > self.most_frames
    }
}

impl<T: Send, S: Theory> Model<T> for Engine<T, S> {
    fn predict(&mut self, surface: &mut Surface) {
        // what is beyond is at rest, and free
        let free = &mut surface.free[..self.cone.next_columns()];
        self.field.free_surface(self.level + 1, &mut self.room, free);
        surface.compliance.fill(scheme::compliance(self.grid.dt(), self.grid.dt()));
    }

    fn advance(&mut self, surface: &Surface, step: T, request: Request) {
        let lag = self.field.lag();
        if self.behind.len() == lag {
            self.follow();
        }
        self.level += 1;
        self.cone.advance(self.level, surface.loaded);
        let task = self.task(request, surface.loaded);
        self.steps.push_back(Waiting {
            step,
            watched: self.field.domain().notes_events().then_some(self.level),
            sampler: task.sampler.clone(),
            gauge: task.gauge.clone(),
        });
        let (reach, band_rows) = (self.field.domain().theory.reach(), self.field.band_rows());
        // the rows below the lowest one are read
        self.field.open(task.active.rows.max(band_rows) + reach);

        let rows = band_rows - reach * (self.behind.len() + 1);
        let columns = self.cone.active_columns();
        let motion = SurfaceMotion {
            displacement: &surface.displacement[..columns],
            free: &surface.free[..columns],
            lateral: S::lateral(&mut self.room, task.active.columns),
            pressure: &surface.pressure,
        };
        self.field.advance_band(self.level, rows, &task, motion);
        let rows = rows.min(task.active.rows);
        self.behind.push(task);
        self.note_peak_in_band(rows);
    }

    fn next(&mut self, finish: bool) -> Option<CompletedStep<T>> {
        if !self.is_complete() {
            self.note_passes();
        }
        if !self.is_complete() && (finish || self.is_crowded()) {
            self.catch_up();
        }
        if !self.is_complete() {
            return None;
        }
        let Waiting { step, watched, sampler, gauge } = self.steps.pop_front()?;
        #[expect(unsafe_code, reason = "a sampler that threads have shared")]
        // SAFETY, here and below: the level of sampler and gauge has been reached: the near-surface band was advanced by this thread, and the passes
        // up to that level are over, which their threads have said with a release that `Pass::is_over` has acquired; both
        // leave the queue once
        let frame = sampler.map(|sampler| unsafe { sampler.finish(self.field.domain()) });
        #[expect(unsafe_code, reason = "a recorder that threads have shared")]
        let gauges = gauge.map(|gauge| unsafe { gauge.finish() });
        let (mut tensions, mut failures) = (Vec::new(), Vec::new());
        if let Some(level) = watched {
            // that level has been reached everywhere: what is known of the one before is all there is
            tensions = self.field.domain().interfaces.tensions();
            tensions.retain(|tension: &Tension| tension.level + 1 == level);
            failures = self.field.domain().ratios.failures(level - 1);
        }
        Some(CompletedStep { step, frame, gauges, tensions, failures })
    }

    fn surface_strain(&self, pressure: &[f64]) -> (f64, usize) {
        let columns = (self.cone.active_columns() + 1).max(pressure.len()).min(self.grid.nr());
        let at = |i: usize| (self.strain_at(pressure.get(i).copied().unwrap_or_default(), i), i);
        (0..columns).map(at).fold((0.0, 0), larger_strain)
    }

    fn strain_at(&self, pressure: f64, i: usize) -> f64 {
        self.field.surface_strain(self.level, pressure, i)
    }

    fn strain_peak(&mut self) -> StrainPeak {
        self.catch_up();
        self.note_peak(RowPeak::default());
        let RowPeak { value, level, column } = self.peaks[0];
        let strain = S::back_strain(&self.grid, value);
        let backing = StrainPeak::on_backing(&self.grid, strain, level, column);
        StrainPeak::largest(&self.grid, self.strains.peak(), backing)
    }

    fn interface_peaks(&mut self) -> Vec<InterfacePeaks> {
        self.catch_up();
        self.field.domain().interfaces.peaks()
    }

    fn strength_peaks(&mut self) -> RatioPeaks {
        self.catch_up();
        self.field.domain().ratios.found().largest
    }

    fn find_non_finite(&mut self) -> Option<(f64, f64)> {
        self.catch_up();
        let rows = self.grid.rows_at(0..self.cone.active(self.level).rows.max(1)).end;
        (0..S::FIELDS).flat_map(|field| (0..rows).map(move |j| (field, j))).find_map(|(field, j)| {
            let row = &self.field.displacement(self.level, field, j)[..self.cone.active_columns()];
            let bad = row.iter().position(|u| !u.is_finite())?;
            Some((self.grid.r(bad), self.grid.z(j)))
        })
    }

    fn save(&mut self, out: &mut StateWriter<'_>) -> io::Result<()> {
        self.write_state(out)
    }

    fn load(&mut self, step: u64, from: &mut StateReader<'_>) -> Result<(), StateError> {
        self.read_state(step as usize, from)
    }
}
