//! `percuss run`: compute a case and record it.

use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::Instant,
};

use clap::Args;
use indicatif::BinaryBytes;
use signal_hook::{
    consts::{SIGINT, SIGTERM},
    flag,
};

use super::{CaseArguments, CliError, Exit, default_output, progress::Progress};
use crate::{
    case::Case,
    session::{Session, Status},
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
    /// Recording to write [default: the name of the case with .mcap]
    #[arg(short, long, value_name = "OUT.mcap")]
    output: Option<PathBuf>,
    /// Number of threads [default: all cores]; the recording does not depend on it
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Overwrite an existing recording
    #[arg(long)]
    force: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    quiet: bool,
}

/// Largest number of threads that makes sense to ask for.
const MAX_THREADS: usize = 1024;

impl Run {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load()?;
        let simulation = Simulation::new(&case)?;
        let output = self.output.clone().unwrap_or_else(|| default_output(&self.case.case));
        if is_same_file(&output, Path::new(&self.case.case)) {
            let text =
                format!("`{}` is the case file itself; choose another output with -o", output.display());
            return Err(CliError::Usage(text));
        }
        let threads = self.threads.map_or_else(rayon::current_num_threads, NonZeroUsize::get);
        if threads > MAX_THREADS {
            return Err(CliError::Usage(format!("--threads {threads}: at most {MAX_THREADS}")));
        }
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| CliError::system(format!("cannot start {threads} threads"), error))?;
        let signal = watch_signals()?;
        let session = Session::begin(&case, &output, self.force, threads)?;
        let progress = Progress::new(case.sizes.steps, case.sizes.dt, self.quiet);
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
            (Outcome::Interrupted(signal), _) => {
                let name = if *signal == SIGINT as usize { "SIGINT" } else { "SIGTERM" };
                Status::Interrupted(format!("interrupted by {name}"))
            }
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

/// Remembers SIGINT and SIGTERM instead of dying; a second one kills at once.
fn watch_signals() -> Result<Arc<AtomicUsize>, CliError> {
    let seen = Arc::new(AtomicUsize::new(0));
    let armed = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        let fail = |error| CliError::system("cannot watch for signals", error);
        flag::register_conditional_default(signal, armed.clone()).map_err(fail)?;
        flag::register(signal, armed.clone()).map_err(fail)?;
        flag::register_usize(signal, seen.clone(), signal as usize).map_err(fail)?;
    }
    Ok(seen)
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    match (fs::canonicalize(a), fs::canonicalize(b)) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}
