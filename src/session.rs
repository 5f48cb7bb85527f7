//! A session: the loop over the steps of a run, and its observers.
//!
//! [`run`] is the only loop over steps. Their source is a computed case ([`Simulation`](crate::simulation::Simulation)) or a closed form ([`ExactSteps`]);
//! recording, progress, pace and the collecting of studies are [`Observer`]s.

use std::error::Error;

pub use crate::simulation::{Status, Steps};
use crate::{
    recording::RecordingError, simulation::SimulationError, state::SaveState, validity::Validity, view::View,
};

mod exact_steps;
mod recording;

pub use exact_steps::ExactSteps;
pub use recording::{Recorded, Recording, Source, recorded_case};

/// What observes a run. Functions of a [`View`] that return nothing or a [`Flow`] are observers.
pub trait Observer {
    /// Observes a step.
    ///
    /// # Errors
    ///
    /// The observer has failed: it is not called again, and the run fails.
    fn observe(&mut self, view: &View<'_>) -> Result<Flow, RunError>;

    /// Writes the state of a computation of which every step has been observed.
    ///
    /// # Errors
    ///
    /// The observer has failed: it is not called again, and the run fails.
    fn write_checkpoint(&mut self, _state: &mut dyn SaveState) -> Result<(), RunError> {
        Ok(())
    }

    /// Records the end of the run, however it has ended.
    ///
    /// # Errors
    ///
    /// The observer has failed, and the run fails.
    fn end(&mut self, _status: &Status, _validity: &Validity) -> Result<(), RunError> {
        Ok(())
    }
}

impl<F: FnMut(&View<'_>) -> T, T: Into<Flow>> Observer for F {
    fn observe(&mut self, view: &View<'_>) -> Result<Flow, RunError> {
        Ok(self(view).into())
    }
}

/// Whether a run continues after a step.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Flow {
    /// The run continues.
    #[default]
    Continue,
    /// The run continues, after observers have written its state.
    Checkpoint,
    /// No further step is computed, for this reason.
    Interrupt(String),
}

impl From<()> for Flow {
    fn from((): ()) -> Self {
        Self::Continue
    }
}

/// The end of a run that has not failed.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// How the run has ended.
    pub status: Status,
    /// Number of the last step observed.
    pub last_step: u64,
    /// Largest pressure and strain.
    pub validity: Validity,
}

/// Why a run has failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The computation failed.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// The recording failed.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// Another observer failed.
    #[error("{0}")]
    Observer(Box<dyn Error + Send + Sync>),
}

/// Passes each step to every observer, in order, until the run ends, an observer interrupts it, or source or observer fail.
///
/// [`Observer::end`] is called on every path, except for an observer that has failed. After an interruption, or the failure of
/// an observer, the steps that are already computed are passed to the others. When an observer asks for a checkpoint, and at an
/// interruption, no further step is computed until the computed ones have been observed and observers have written the state.
///
/// # Errors
///
/// The first error of the computation or of an observer.
pub fn run(steps: &mut impl Steps, observers: &mut [&mut dyn Observer]) -> Result<Outcome, RunError> {
    let mut observers: Vec<_> = observers.iter_mut().map(|observer| &mut **observer).collect();
    let (mut failure, mut interruption, mut last_step) = (None, None, 0);
    let mut pauses = false;
    loop {
        match steps.step() {
            Ok(None) => {
                if failure.is_none()
                    && let Some(state) = steps.drained()
                {
                    notify(&mut observers, &mut failure, |observer| observer.write_checkpoint(state));
                }
                if !pauses || failure.is_some() || interruption.is_some() || steps.ending().is_some() {
                    break;
                }
                pauses = false;
                steps.resume();
            }
            Ok(Some(view)) => {
                last_step = view.step;
                notify(&mut observers, &mut failure, |observer| {
                    match observer.observe(&view)? {
                        Flow::Continue => {}
                        Flow::Checkpoint => pauses = true,
                        Flow::Interrupt(reason) => drop(interruption.get_or_insert(reason)),
                    }
                    Ok(())
                });
            }
            Err(error) => {
                failure.get_or_insert(error.into());
                break;
            }
        }
        if pauses || interruption.is_some() || failure.is_some() {
            steps.interrupt();
        }
    }
    let status = match (&failure, steps.ending()) {
        (Some(error), _) => Status::Failed(error.to_string()),
        (None, Some(ending)) => ending,
        (None, None) => Status::Interrupted(interruption.unwrap_or_else(|| "interrupted".into())),
    };
    let validity = steps.validity();
    for observer in observers {
        if let Err(error) = observer.end(&status, &validity) {
            failure.get_or_insert(error);
        }
    }
    failure.map_or(Ok(Outcome { status, last_step, validity }), Err)
}

/// Calls `f` on all observers; those that fail are not called again.
fn notify<'a>(
    observers: &mut Vec<&mut (dyn Observer + 'a)>,
    failure: &mut Option<RunError>,
    mut f: impl FnMut(&mut (dyn Observer + 'a)) -> Result<(), RunError>,
) {
    observers.retain_mut(|observer| match f(*observer) {
        Ok(()) => true,
        Err(error) => {
            failure.get_or_insert(error);
            false
        }
    });
}

#[cfg(test)]
mod tests {
    use percuss_output::part_of;

    use super::*;
    use crate::{
        case::Case,
        recording::{Destination, copy::metadata},
        simulation::Simulation,
    };

    /// Error of an unchecked case, and the last step in the status of its recording.
    fn failure(case: &Case) -> (SimulationError, String) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.mcap");
        let destination = Destination::new(&path);
        let mut recording = Recording::create(&destination, case, Source::Simulation).expect("a file");
        let mut simulation = Simulation::new(case);
        let Err(RunError::Simulation(error)) = run(&mut simulation, &mut [&mut recording]) else {
            panic!("the run fails");
        };
        let [status] = metadata(&part_of(&path), ["percuss.status"]).expect("a status");
        assert_eq!(status["status"], "failed");
        assert_eq!(status["message"], error.to_string());
        (error, status["last_step"].clone())
    }

    #[test]
    fn numbers_that_overflow_end_the_run_with_a_status() {
        let case = Case::sound("fig5", &["mesh.cells=20", "record.frames=0"]);
        let (error, _) = failure(&case.unchecked(|case| case.impact.velocity = f64::MAX));
        let SimulationError::NotFinite { quantity: "interface stress", place: Some(_), .. } = error else {
            panic!("{error}");
        };
    }

    #[test]
    fn a_contact_that_outgrows_its_mesh_ends_the_run_with_a_status() {
        // with c_s = 0.2 and 20 cells a step is 0.25 long, in which the contact spreads by 5
        let case = Case::sound(
            "fig6a",
            &[
                "indenter.slope=0.05",
                "impact.contact=unilateral",
                "target.shear_wave_speed=0.2",
                "mesh.cells=20",
                "run.end_time=1",
                "record.frames=0",
            ],
        );
        // partial contact reaches one step and a half ahead
        let (error, last_step) = failure(&case.unchecked(|case| case.sizes.nr = 420));
        assert!(matches!(error, SimulationError::ContactLeavesMesh { step: 2 | 3, .. }), "{error}");
        assert!(error.to_string().contains("mesh.outer_radius"), "{error}");
        assert!(matches!(last_step.as_str(), "1" | "2"), "{last_step}");
    }
}
