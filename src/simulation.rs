//! The order of one step, and of a run.
//!
//! ```text
//! step k:  model predicts the free surface at level k+1
//!          contact answers with p^k, F^k and moves the indenter to level k+1
//!          model advances to level k+1
//!          the View of step k is shown
//! ```
//!
//! The simulation decides when frames are and when a run ends; it neither writes nor waits. Whoever calls
//! [`Simulation::step`] may stop calling at any time.
//!
//! A model may show a frame some steps later than it was asked for it. Then the simulation goes on computing and holds
//! back the steps from the frame on, so that all are shown in order.

use std::collections::VecDeque;

use crate::{
    case::{Case, FrameSteps, HeadKind, Stop},
    contact::{
        Contact, Touch,
        event::{Event, EventKind, Watch},
    },
    grid::Grid,
    indenter::Indenter,
    model::{Model, ModelKind, Show, TargetEnergy, TargetFrame, cone::Sight, rakhmatulin::Rakhmatulin},
    surface::Surface,
    validity::Validity,
    view::{Energy, Fields, Lattice, Snapshot, View},
};

/// Why a run cannot go on, or not begin.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SimulationError {
    /// The numbers have overflowed.
    #[error("step {step}: {quantity} is not finite{}; is the impact velocity sensible?", describe(.place))]
    NotFinite {
        /// Step at which it was seen.
        step: u64,
        /// What is not finite.
        quantity: &'static str,
        /// Radius and depth, for quantities that have a place \[R\].
        place: Option<(f64, f64)>,
    },
    /// The contact has come to the outer boundary of the mesh, which would hold it back.
    #[error(
        "step {step}: the contact touches the outermost nodes of the mesh, r = {r:.4}; make mesh.outer_radius = {outer_radius} larger"
    )]
    ContactLeavesMesh {
        /// Step at which it was seen.
        step: u64,
        /// Radius of the outermost nodes \[R\].
        r: f64,
        /// Outer radius of the mesh \[R\].
        outer_radius: f64,
    },
    /// There is no solver for this model yet.
    #[error(
        "model = \"elastic\" is not available in `percuss run` of this version; use model = \"rakhmatulin\", or `percuss exact` where there is a closed form"
    )]
    NoSolver,
}

fn describe(place: &Option<(f64, f64)>) -> String {
    place.map_or_else(String::new, |(r, z)| format!(" at r = {r:.4}, z = {z:.4}"))
}

/// How a run has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Ending {
    /// All steps are done.
    Completed,
    /// A condition of the case has stopped it.
    Stopped(String),
}

/// A case being computed.
pub struct Simulation {
    grid: Grid,
    model: Box<dyn Model>,
    surface: Surface,
    contact: Contact,
    indenter: Indenter,
    watch: Watch,
    ledger: Ledger,
    validity: Validity,
    /// Radii of the probes \[R\].
    probes: Vec<f64>,
    layer: bool,
    frames: FrameSteps,
    steps: u64,
    stop: Stop,
    next_step: u64,
    /// Steps that have been computed and not been shown.
    waiting: VecDeque<Step>,
    /// The step that is shown.
    shown: Snapshot,
    /// Frames that may be under way.
    most_frames: usize,
    ending: Option<Ending>,
    failure: Option<SimulationError>,
    is_interrupted: bool,
}

/// Memory of frames that are under way \[bytes\]; two may be in any case.
const FRAMES_UNDER_WAY: usize = 64 << 20;

/// A step that has been computed.
struct Step {
    shown: Snapshot,
    /// Ledger and kinetic energy of the indenter before and after the step, as long as the frame is awaited.
    awaits_frame: Option<[(Ledger, f64); 2]>,
}

impl Simulation {
    /// Sets up a case.
    ///
    /// # Errors
    ///
    /// [`SimulationError::NoSolver`] for model `elastic`.
    pub fn new(case: &Case) -> Result<Self, SimulationError> {
        let sight = if case.looks_inside() {
            Sight::Field
        } else {
            Sight::Surface { last_step: case.sizes.steps as usize }
        };
        Self::with_sight(case, sight)
    }

    /// Sets up a case of which more is computed than is looked at, for comparisons.
    ///
    /// # Errors
    ///
    /// As [`Simulation::new`].
    pub fn with_sight(case: &Case, sight: Sight) -> Result<Self, SimulationError> {
        let sizes = &case.sizes;
        let grid = case.grid();
        let model: Box<dyn Model> = match case.model {
            ModelKind::Rakhmatulin => {
                let show = Show { fields: case.record.fields.clone(), every: case.record.field_every };
                let c_s = case.target.material.shear_wave_speed;
                Box::new(Rakhmatulin::new(grid.clone(), c_s, sight, show))
            }
            ModelKind::Elastic => return Err(SimulationError::NoSolver),
        };
        let velocity = case.impact.velocity;
        let indenter = Indenter::new(case.indenter.mass, velocity, grid.dt());
        Ok(Self {
            surface: Surface::new(grid.nr()),
            contact: Contact::new(case.impact.contact, case.shape(), case.geometry, &grid, velocity),
            watch: Watch::new(grid.dr / case.target.material.shear_wave_speed),
            ledger: Ledger { initial: indenter.kinetic_energy(), ..Ledger::default() },
            validity: Validity::new(velocity, case.indenter.head == HeadKind::Flat),
            probes: case.record.probes.clone(),
            indenter,
            model,
            layer: sizes.layer,
            frames: case.frames(),
            steps: sizes.steps,
            stop: case.run.stop,
            next_step: 0,
            waiting: VecDeque::new(),
            shown: Snapshot::default(),
            most_frames: (FRAMES_UNDER_WAY / case.frame_size()).max(2),
            ending: None,
            failure: None,
            is_interrupted: false,
            grid,
        })
    }

    /// Shows the next step; `None` when the run has ended.
    ///
    /// # Errors
    ///
    /// [`SimulationError::NotFinite`] if the numbers have overflowed, [`SimulationError::ContactLeavesMesh`] if the mesh is too
    /// narrow; the steps before have been shown.
    pub fn step(&mut self) -> Result<Option<View<'_>>, SimulationError> {
        loop {
            let is_over = self.ending.is_some() || self.failure.is_some() || self.is_interrupted;
            self.take_frame(is_over)?;
            if self.waiting.front().is_some_and(|step| step.awaits_frame.is_none())
                && let Some(step) = self.waiting.pop_front()
            {
                self.shown = step.shown;
                return Ok(Some(self.shown.view()));
            }
            if is_over && self.waiting.is_empty() {
                return self.failure.take().map_or(Ok(None), Err);
            }
            if !is_over && let Err(error) = self.compute() {
                self.failure = Some(error);
            }
        }
    }

    /// Computes no further step; those that have been computed are still shown.
    pub fn interrupt(&mut self) {
        self.is_interrupted = true;
    }

    /// Computes the next step.
    fn compute(&mut self) -> Result<(), SimulationError> {
        let step = self.next_step;
        let time = step as f64 * self.grid.dt();
        let is_frame = self.frames.contain(step);

        let before = (self.ledger, self.indenter.kinetic_energy());
        self.model.predict(&mut self.surface);
        let touch = self.contact.step(&mut self.surface, &mut self.indenter);
        self.ledger.add(&touch);
        self.model.advance(&self.surface, is_frame);
        if !touch.drag.is_finite() {
            return Err(self.not_finite(step));
        }
        let nr = self.grid.nr();
        if self.contact.reached() == nr {
            let outer_radius = nr as f64 * self.grid.dr;
            return Err(SimulationError::ContactLeavesMesh { step, r: self.grid.r(nr - 1), outer_radius });
        }
        let after = (self.ledger, self.indenter.kinetic_energy());

        self.observe_strain(step, time);
        let grid = &self.grid;
        let mut events = self.watch.observe(&touch, time, |i| grid.r(i));
        self.next_step += 1;
        self.ending = self.find_ending(step, time, &mut events);
        let reached = self.contact.reached();
        // the memory of the step that is shown is wanted no more
        let mut pressure = std::mem::take(&mut self.shown.pressure);
        pressure.clear();
        pressure.extend_from_slice(&self.surface.pressure[..reached]);
        let shown = Snapshot {
            step,
            time,
            r0: self.grid.r0,
            dr: self.grid.dr,
            pressure,
            punch_radius: self.contact.punch_radius(),
            complete: reached == self.contact.profile().len(),
            drag: touch.drag,
            contact_radius: touch.contact_radius,
            velocity: touch.velocity,
            depth: touch.depth,
            events,
            frame: None,
        };
        for &r in &self.probes {
            let pressure = shown.view().interface.stress_at(r);
            self.validity.observe_probe(pressure.abs(), step, time, r);
        }
        self.waiting.push_back(Step { shown, awaits_frame: is_frame.then_some([before, after]) });
        Ok(())
    }

    /// Gives the first step that waits its frame, if it awaits one and the model has it.
    ///
    /// * `now`: the model shall have it
    fn take_frame(&mut self, now: bool) -> Result<(), SimulationError> {
        let Some(Step { shown, awaits_frame: Some([before, after]) }) = self.waiting.front() else {
            return Ok(());
        };
        let under_way = self.waiting.iter().filter(|step| step.awaits_frame.is_some()).count();
        let Some(TargetFrame { energy, next_kinetic, samples, surface }) =
            self.model.frame(now || under_way > self.most_frames)
        else {
            return Ok(());
        };
        if !(energy.kinetic + energy.strain + next_kinetic).is_finite() {
            let step = shown.step;
            self.waiting.clear();
            self.is_interrupted = true;
            return Err(self.not_finite(step));
        }
        let [(earlier, indenter), (later, next_indenter)] = [before, after];
        let before = earlier.entry(energy, *indenter);
        let after = later.entry_after(&before, next_kinetic, *next_indenter);
        let lattice = Lattice { r0: self.grid.r0, dr: self.grid.dr, dz: self.grid.dz };
        if let Some(first) = self.waiting.front_mut() {
            first.awaits_frame = None;
            first.shown.frame = Some((mean(before, after), Fields::new(lattice, surface, samples)));
        }
        Ok(())
    }

    /// How the run has ended; `None` while it has not.
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// Largest pressure and strain so far.
    pub fn validity(&mut self) -> Validity {
        let mut validity = self.validity;
        if self.layer {
            let peak = self.model.backing_peak();
            let place = (peak.r, self.grid.nz as f64 * self.grid.dz);
            validity.observe_strain(peak.strain, peak.step, peak.step as f64 * self.grid.dt(), place);
        }
        validity
    }

    /// What is not finite, seen at a step.
    fn not_finite(&mut self, step: u64) -> SimulationError {
        let bad = self.surface.pressure.iter().position(|p| !p.is_finite());
        let (quantity, place) = match (bad, self.model.find_non_finite()) {
            (Some(i), _) => ("interface stress", Some((self.grid.r(i), 0.0))),
            (None, Some(place)) => ("displacement", Some(place)),
            (None, None) => ("energy", None),
        };
        SimulationError::NotFinite { step, quantity, place }
    }

    fn observe_strain(&mut self, step: u64, time: f64) {
        let pressure = &self.surface.pressure[..self.contact.reached()];
        for (i, p) in pressure.iter().enumerate() {
            self.validity.observe(p.abs(), step, time, (self.grid.r(i), 0.0));
        }
    }

    fn find_ending(&self, step: u64, time: f64, events: &mut Vec<Event>) -> Option<Ending> {
        let awaited = match self.stop {
            Stop::Never => None,
            Stop::Extension => Some((EventKind::Extension, "extension")),
            Stop::Separation => Some((EventKind::Separation, "separation")),
        };
        if let Some((kind, name)) = awaited
            && let Some(event) = events.iter().find(|event| event.kind == kind)
        {
            let text = format!("stopped at {name}, t = {:.4}, as run.stop asks", event.since.unwrap_or(time));
            events.push(Event { kind: EventKind::Stopped, text: text.clone(), r: None, since: None });
            return Some(Ending::Stopped(text));
        }
        (step == self.steps).then_some(Ending::Completed)
    }
}

/// Running sums of the energy ledger.
#[derive(Clone, Copy, Debug, Default)]
struct Ledger {
    initial: f64,
    work: f64,
    dissipated: f64,
}

impl Ledger {
    fn add(&mut self, touch: &Touch) {
        self.work += touch.work;
        self.dissipated += touch.dissipated;
    }

    /// The ledger at a half step.
    ///
    /// * `indenter`: kinetic energy of the indenter
    fn entry(&self, target: TargetEnergy, indenter: f64) -> Energy {
        let TargetEnergy { kinetic, strain } = target;
        let (work, dissipated) = (self.work, self.dissipated);
        let residual = self.initial + work - (kinetic + strain + indenter + dissipated);
        Energy { kinetic, strain, indenter, dissipated, work, residual }
    }

    /// The ledger at a half step, one step after that of another entry: the scheme leaves the sum as it was, so what is
    /// not anything else is strain.
    ///
    /// * `kinetic`: kinetic energy of the target
    /// * `indenter`: kinetic energy of the indenter
    fn entry_after(&self, before: &Energy, kinetic: f64, indenter: f64) -> Energy {
        let (work, dissipated, residual) = (self.work, self.dissipated, before.residual);
        let strain = self.initial + work - (kinetic + indenter + dissipated + residual);
        Energy { kinetic, strain, indenter, dissipated, work, residual }
    }
}

/// Mean of the ledgers before and after a step: the ledger at its level.
fn mean(a: Energy, b: Energy) -> Energy {
    let half = |a: f64, b: f64| 0.5 * (a + b);
    Energy {
        kinetic: half(a.kinetic, b.kinetic),
        strain: half(a.strain, b.strain),
        indenter: half(a.indenter, b.indenter),
        dissipated: half(a.dissipated, b.dissipated),
        work: half(a.work, b.work),
        residual: half(a.residual, b.residual),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ledger_after_a_step_is_that_before_the_next_one() {
        // a light punch, which rebounds
        let settings = ["mesh.cells=20", "indenter.mass=0.5", "run.end_time=3.0", "record.frames=100000"];
        let case = Case::load("fig5", &settings.map(String::from)).expect("a built-in case");
        let mut simulation = Simulation::new(&case).expect("a case with a solver");
        let mut last: Option<Energy> = None;
        while simulation.ending.is_none() {
            simulation.compute().expect("a sound case");
            let frame = simulation.model.frame(true).expect("every step is a frame");
            let step = simulation.waiting.pop_back().expect("a step");
            let [(ledger, indenter), (next_ledger, next_indenter)] = step.awaits_frame.expect("a frame");
            let before = ledger.entry(frame.energy, indenter);
            if let Some(Energy { kinetic, strain, .. }) = last {
                let pairs = [(kinetic, before.kinetic), (strain, before.strain)];
                assert!(pairs.iter().all(|(a, b)| (a - b).abs() < 1e-13), "{last:?} {before:?}");
            }
            last = Some(next_ledger.entry_after(&before, frame.next_kinetic, next_indenter));
        }
        let last = last.expect("steps");
        assert!(last.indenter < 0.5 * simulation.ledger.initial && last.strain > 0.0, "{last:?}");
    }
}
