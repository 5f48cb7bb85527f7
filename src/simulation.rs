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

use crate::{
    case::{Case, FrameSteps, Stop},
    contact::{
        Contact, Touch,
        event::{Event, EventKind, Watch},
    },
    grid::Grid,
    indenter::Indenter,
    model::{Extent, Field, Model, ModelKind, TargetEnergy, cone::Sight, rakhmatulin::Rakhmatulin},
    surface::Surface,
    validity::Validity,
    view::{Energy, Fields, Frame, Interface, Lattice, View},
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
    layer: bool,
    frames: FrameSteps,
    steps: u64,
    stop: Stop,
    next_step: u64,
    events: Vec<Event>,
    ending: Option<Ending>,
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
                Box::new(Rakhmatulin::new(grid.clone(), case.target.material.shear_wave_speed, sight))
            }
            ModelKind::Elastic => return Err(SimulationError::NoSolver),
        };
        let velocity = case.impact.velocity;
        let indenter = Indenter::new(case.indenter.mass, velocity, grid.dt());
        Ok(Self {
            surface: Surface::new(grid.nr()),
            contact: Contact::new(case.impact.contact, case.shape(), case.geometry, &grid, velocity),
            watch: Watch::default(),
            ledger: Ledger { initial: indenter.kinetic_energy(), ..Ledger::default() },
            validity: Validity::new(velocity),
            indenter,
            model,
            layer: sizes.layer,
            frames: case.frames(),
            steps: sizes.steps,
            stop: case.run.stop,
            next_step: 0,
            events: Vec::new(),
            ending: None,
            grid,
        })
    }

    /// Computes the next step and shows it; `None` when the run has ended.
    ///
    /// # Errors
    ///
    /// [`SimulationError::NotFinite`] if the numbers have overflowed.
    pub fn step(&mut self) -> Result<Option<View<'_>>, SimulationError> {
        if self.ending.is_some() {
            return Ok(None);
        }
        let step = self.next_step;
        let time = step as f64 * self.grid.dt();
        let is_frame = self.frames.contain(step);

        let before = (self.ledger, self.indenter.kinetic_energy());
        self.model.predict(&mut self.surface);
        let touch = self.contact.step(&mut self.surface, &mut self.indenter);
        self.ledger.add(&touch);
        self.model.advance(&self.surface);
        let energy = is_frame.then(|| {
            let after = (self.ledger, self.indenter.kinetic_energy());
            let [target_before, target_after] = self.model.energies(&self.surface);
            mean(before.0.entry(target_before, before.1), after.0.entry(target_after, after.1))
        });

        self.check_finite(step, &touch, energy.as_ref())?;
        self.observe_strain(step, time);
        let grid = &self.grid;
        self.events = self.watch.observe(&touch, time, |i| grid.r(i));
        self.next_step += 1;
        self.ending = self.find_ending(step, time);
        Ok(Some(self.view(step, time, touch, energy)))
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

    fn view(&self, step: u64, time: f64, touch: Touch, energy: Option<Energy>) -> View<'_> {
        let reached = self.contact.reached();
        View {
            step,
            time,
            interface: Interface {
                r0: self.grid.r0,
                dr: self.grid.dr,
                pressure: &self.surface.pressure[..reached],
                punch_radius: self.contact.punch_radius(),
                complete: reached == self.contact.profile().len(),
                exact: None,
            },
            drag: touch.drag,
            contact_radius: touch.contact_radius,
            velocity: touch.velocity,
            depth: touch.depth,
            events: &self.events,
            frame: energy.map(|energy| Frame { energy, fields: self }),
        }
    }

    fn check_finite(
        &mut self,
        step: u64,
        touch: &Touch,
        energy: Option<&Energy>,
    ) -> Result<(), SimulationError> {
        let fine =
            touch.drag.is_finite() && energy.is_none_or(|e| e.kinetic.is_finite() && e.strain.is_finite());
        if fine {
            return Ok(());
        }
        let bad = self.surface.pressure.iter().position(|p| !p.is_finite());
        let (quantity, place) = match (bad, self.model.find_non_finite()) {
            (Some(i), _) => ("interface stress", Some((self.grid.r(i), 0.0))),
            (None, Some(place)) => ("displacement", Some(place)),
            (None, None) => ("energy", None),
        };
        Err(SimulationError::NotFinite { step, quantity, place })
    }

    fn observe_strain(&mut self, step: u64, time: f64) {
        let pressure = &self.surface.pressure[..self.contact.reached()];
        for (i, p) in pressure.iter().enumerate() {
            self.validity.observe(p.abs(), step, time, (self.grid.r(i), 0.0));
        }
    }

    fn find_ending(&mut self, step: u64, time: f64) -> Option<Ending> {
        let awaited = match self.stop {
            Stop::Never => None,
            Stop::Extension => Some((EventKind::Extension, "extension")),
            Stop::Separation => Some((EventKind::Separation, "separation")),
        };
        if let Some((kind, name)) = awaited
            && self.events.iter().any(|event| event.kind == kind)
        {
            let text = format!("stopped at {name}, t = {time:.4}, as run.stop asks");
            self.events.push(Event { kind: EventKind::Stopped, text: text.clone(), r: None });
            return Some(Ending::Stopped(text));
        }
        (step == self.steps).then_some(Ending::Completed)
    }
}

impl Fields for Simulation {
    fn sample(&self, field: Field, every: usize, values: &mut Vec<f32>) -> Extent {
        self.model.sample(field, every, &self.surface, values)
    }

    fn surface(&self, values: &mut Vec<f64>) {
        self.model.surface(values);
    }

    fn lattice(&self) -> Lattice {
        Lattice { r0: self.grid.r0, dr: self.grid.dr, dz: self.grid.dz }
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
