//! `percuss run`: compute a case and record it.

use std::{
    fs,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::Instant,
};

use clap::Args;
use indicatif::BinaryBytes;

use super::{
    CaseArguments, CliError, Exit,
    output::{OutputArguments, interrupted_by, watch_signals},
    progress::Progress,
};
use crate::{
    case::Case,
    session::{Session, Source, Status},
    simulation::{Simulation, SimulationError},
};

const EXAMPLES: &str = "\
Examples:
  percuss run fig8-m5                                        a built-in case, into fig8-m5.mcap
  percuss run my.toml -o runs/first.mcap --threads 2
  percuss run fig5 --set mesh.cells=400 --set run.end_time=12 --force";

/// Computes a case and records it.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Run {
    #[command(flatten)]
    case: CaseArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Run {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load()?;
        let simulation = Simulation::new(&case)?;
        let output = self.output.path(&self.case.case, "")?;
        let pool = self.output.threads.pool()?;
        let signal = watch_signals()?;
        let session = Session::begin(
            &case,
            Source::Simulation,
            &output,
            self.output.force,
            pool.current_num_threads(),
        )?;
        let progress = Progress::new(case.sizes.steps, case.sizes.dt, self.output.quiet);
        progress.say(&format!("{}: {}", self.case.case, case.title));
        let mut run = Running { case: &case, simulation, session, progress, signal };
        let start = Instant::now();
        let outcome = pool.install(|| run.steps())?;
        run.end(outcome, &output, start)
    }
}

/// A run under way.
struct Running<'a> {
    case: &'a Case,
    simulation: Simulation,
    session: Session,
    progress: Progress,
    signal: Arc<AtomicUsize>,
}

/// How the loop over steps has ended.
enum Outcome {
    Ended,
    Interrupted(usize),
    Failed(SimulationError),
}

impl Running<'_> {
    fn steps(&mut self) -> Result<Outcome, CliError> {
        loop {
            match self.simulation.step() {
                Ok(None) => return Ok(Outcome::Ended),
                Ok(Some(view)) => {
                    for event in view.events {
                        self.progress.say(&event.text);
                    }
                    self.session.observe(&view)?;
                    self.progress.advance(view.step, view.time);
                }
                Err(error) => return Ok(Outcome::Failed(error)),
            }
            let signal = self.signal.load(Ordering::Relaxed);
            if signal != 0 && self.simulation.ending().is_none() {
                return Ok(Outcome::Interrupted(signal));
            }
        }
    }

    fn end(mut self, outcome: Outcome, output: &Path, start: Instant) -> Result<Exit, CliError> {
        let status = match (&outcome, self.simulation.ending()) {
            (Outcome::Interrupted(signal), _) => Status::Interrupted(interrupted_by(*signal)),
            (Outcome::Failed(error), _) => Status::Failed(error.to_string()),
            (Outcome::Ended, Some(ending)) => ending.into(),
            (Outcome::Ended, None) => unreachable!("a simulation ends with an ending"),
        };
        self.progress.end();
        self.session.end(&status, &self.simulation.validity())?;
        if let Outcome::Failed(error) = outcome {
            return Err(error.into());
        }
        let size = fs::metadata(output).map_or(0, |metadata| metadata.len());
        self.progress.say(&format!(
            "{}: {}, {} in {:.2} s; {} steps of {:.4e} planned",
            output.display(),
            status.name(),
            BinaryBytes(size),
            start.elapsed().as_secs_f64(),
            self.case.sizes.steps,
            self.case.sizes.dt,
        ));
        match outcome {
            Outcome::Interrupted(signal) => Ok(Exit::Interrupted(signal as u8)),
            _ => Ok(Exit::Done),
        }
    }
}
