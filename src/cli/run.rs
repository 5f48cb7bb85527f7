//! `percuss run`: compute a case and record it.

use std::{
    fs,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use clap::{Args, ValueEnum};
use indicatif::BinaryBytes;
use percuss_serve::{Address, seconds, speed};

use super::{
    CaseArguments, CliError, Exit,
    output::{OutputArguments, interrupted_by, watch_signals},
    progress::Progress,
};
use crate::{
    case::Case,
    channels::{Catalogue, log_time},
    live::{Live, Pace},
    session::{Session, Source, Status},
    simulation::{Engine, Simulation, SimulationError},
};

const EXAMPLES: &str = "\
Examples:
  percuss run fig8-m5                                        a built-in case, into fig8-m5.mcap
  percuss run my.toml -o runs/first.mcap --threads 2
  percuss run fig5 --set mesh.cells=400 --set run.end_time=12 --force
  percuss run fig5 --live --pace --wait     watch it: connect a viewer to ws://127.0.0.1:8765";

/// Computes a case and records it.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Run {
    #[command(flatten)]
    case: CaseArguments,
    #[command(flatten)]
    output: OutputArguments,
    /// Serve the run to viewers over the Foxglove WebSocket protocol while it is recorded; without ADDR to this machine
    /// only, at 127.0.0.1:8765
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1:8765")]
    live: Option<Address>,
    /// Hold the run back so that a person can watch: log time that passes in a second; 1 without SPEED
    #[arg(long, value_name = "SPEED", num_args = 0..=1, default_missing_value = "1", value_parser = speed)]
    pace: Option<f64>,
    /// Begin when this many viewers have subscribed, and nobody has for 1.5 s: viewers do it panel by panel; 1 without N
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "1", requires = "live")]
    wait: Option<usize>,
    /// When all is recorded, serve those who watch until they have left, so many seconds at most; Ctrl-C ends it
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds, requires = "live")]
    hold: Duration,
    /// What computes: the fast engine, or the plain stepper that it is tested against, slow and simple
    #[arg(long, value_enum, default_value_t)]
    engine: EngineName,
}

/// Engines by name.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum EngineName {
    /// Vectors, tiles, threads
    #[default]
    Blocked,
    /// Every node of every level, one by one, on one thread
    Reference,
}

impl From<EngineName> for Engine {
    fn from(name: EngineName) -> Self {
        match name {
            EngineName::Blocked => Self::Blocked,
            EngineName::Reference => Self::Reference,
        }
    }
}

impl Run {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load()?;
        let simulation = Simulation::with_engine(&case, self.engine.into())?;
        let output = self.output.path(&self.case.case, "")?;
        let pool = self.output.threads.pool()?;
        let signal = watch_signals()?;
        let live = self.live.as_ref().map(|address| self.open(address, &case)).transpose()?;
        let mut session = Session::begin(
            &case,
            Source::Simulation,
            &output,
            self.output.force,
            pool.current_num_threads(),
        )?;
        let progress = Progress::new(case.sizes.steps, case.sizes.dt, self.output.quiet);
        progress.say(&format!("{}: {}", self.case.case, case.title));
        let every = case.record.field_every;
        if every > 1 && every == case.usual_field_every() {
            progress.say(&format!(
                "fields show one node in {every} along r and along z; --set record.field_every=1 shows all"
            ));
        }
        if let Some(live) = &live {
            session.show(live.tap())?;
            live.wait_for(self.wait.unwrap_or(0), || signal.load(Ordering::Relaxed) != 0);
        }
        let pace = self.pace.map(Pace::new);
        let mut run =
            Running { case: &case, simulation, session, progress, signal: Arc::clone(&signal), pace };
        let start = Instant::now();
        let outcome = pool.install(|| run.steps())?;
        let exit = pool.install(|| run.end(outcome, &output, start));
        if let Some(live) = live {
            self.hold(&live, &signal);
        }
        exit
    }

    /// Holds the end for those who watch.
    fn hold(&self, live: &Live, signal: &AtomicUsize) {
        let is_over = || signal.load(Ordering::Relaxed) != 0;
        let viewers = live.viewers();
        if viewers > 0 && !self.hold.is_zero() && !is_over() && !self.output.quiet {
            eprintln!(
                "recorded; open viewers: {viewers}; served until they leave, {} s at most",
                self.hold.as_secs_f64()
            );
        }
        live.hold(self.hold, is_over);
    }

    /// Opens the server of a live run and says where it is.
    fn open(&self, address: &Address, case: &Case) -> Result<Live, CliError> {
        let live = Live::open(address, &case.title, Catalogue::new(case).specs())?;
        if !self.output.quiet {
            eprintln!("live at {} for {}", live.url(), address.reach());
        }
        Ok(live)
    }
}

/// A run under way.
struct Running<'a> {
    case: &'a Case,
    simulation: Simulation,
    session: Session,
    progress: Progress,
    signal: Arc<AtomicUsize>,
    pace: Option<Pace>,
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
                Ok(None) => break,
                Ok(Some(view)) => {
                    for event in &*view.events {
                        self.progress.say(&event.text);
                    }
                    self.session.observe(&view)?;
                    if let Some(pace) = &mut self.pace {
                        let log_time = log_time(view.time, self.case.record.playback_rate);
                        pace.keep(log_time, || self.signal.load(Ordering::Relaxed) != 0);
                    }
                    self.progress.advance(view.step, view.time);
                }
                Err(error) => return Ok(Outcome::Failed(error)),
            }
            if self.signal.load(Ordering::Relaxed) != 0 {
                // what has been computed is recorded
                self.simulation.interrupt();
            }
        }
        Ok(match self.simulation.ending() {
            Some(_) => Outcome::Ended,
            None => Outcome::Interrupted(self.signal.load(Ordering::Relaxed)),
        })
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
