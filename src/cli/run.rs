//! `percuss run`: compute a case and record it.

use std::{
    fs,
    sync::atomic::{AtomicUsize, Ordering},
    time::{Duration, Instant},
};

use clap::{Args, ValueEnum};
use indicatif::BinaryBytes;
use percuss_serve::{Address, seconds, speed};

use super::{
    CaseArguments, CliError, Exit,
    output::{OutputArguments, exit, flow, watch_signals},
    progress::Progress,
};
use crate::{
    case::Case,
    channels::{Catalogue, log_time},
    live::{Live, Pace},
    session::{self, Outcome, Recording, RunError, Source},
    simulation::{Engine, Simulation},
    view::View,
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
        let mut simulation = Simulation::with_engine(&case, self.engine.into()).map_err(RunError::from)?;
        let output = self.output.path(&self.case.case, "")?;
        let pool = self.output.threads.pool()?;
        let signal = watch_signals()?;
        let live = self.live.as_ref().map(|address| self.open(address, &case)).transpose()?;
        let recording =
            pool.install(|| Recording::create(&output, self.output.force, &case, Source::Simulation));
        let mut recording = recording.map_err(RunError::from)?;
        let mut progress = Progress::new(case.sizes.steps, case.sizes.dt, self.output.quiet);
        progress.say(&format!("{}: {}", self.case.case, case.title));
        let every = case.record.field_every;
        if every > 1 && every == case.default_field_every() {
            progress.say(&format!(
                "fields show one node in {every} along r and along z; --set record.field_every=1 shows all"
            ));
        }
        let is_over = || signal.load(Ordering::Relaxed) != 0;
        if let Some(live) = &live {
            recording.tap(live.tap()).map_err(RunError::from)?;
            live.wait_for(self.wait.unwrap_or(0), is_over);
        }
        let mut pace = self.pace.map(Pace::new);
        let start = Instant::now();
        let mut watch = |view: &View<'_>| {
            for event in &*view.events {
                progress.say(&event.text);
            }
            if let Some(pace) = &mut pace {
                pace.keep(log_time(view.time, case.record.playback_rate), is_over);
            }
            progress.advance(view.step, view.time);
            flow(&signal)
        };
        let outcome = pool.install(|| session::run(&mut simulation, &mut [&mut recording, &mut watch]));
        progress.end();
        if let Ok(Outcome { status, .. }) = &outcome {
            let size = fs::metadata(&output).map_or(0, |metadata| metadata.len());
            progress.say(&format!(
                "{}: {}, {} in {:.2} s; {} steps of {:.4e} planned",
                output.display(),
                status.name(),
                BinaryBytes(size),
                start.elapsed().as_secs_f64(),
                case.sizes.steps,
                case.sizes.dt,
            ));
        }
        if let Some(live) = live {
            self.hold(&live, &signal);
        }
        Ok(exit(&outcome?.status, &signal))
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
