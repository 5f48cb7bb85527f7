//! `percuss run`: compute a case and record it.

use std::{
    io,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use clap::Args;
use percuss_output::{
    file_of,
    number::whole,
    part_of,
    text::{printable, say},
};
use percuss_serve::{Access, Address, AllowedOrigin, Server, VIEWERS, seconds, speed};
use percuss_table::measures::Measure;

use super::{
    CaseArguments, CliError, Exit, bounces,
    output::{OutputArguments, check_room, exit, flow, watch_signals, written},
    progress::{Clock, Progress},
    target,
};
use crate::{
    advice::Advised,
    case::Case,
    channels::{Catalogue, log_time},
    checkpoint::{self, Checkpoints, checkpoint_of},
    live::{self, Pace},
    recording::Destination,
    session::{self, Recording, RunError, Source, Status, recorded_case},
    simulation::{Engine, Simulation},
    units::{Unit, Units},
    view::View,
};

const EXAMPLES: &str = "\
Examples:
  percuss run fig8-m5  # a built-in case, into fig8-m5.mcap
  percuss run my.toml -o runs/first.mcap --threads 2
  percuss run fig5 --set mesh.cells=400 --set run.end_time=12 --force
  # a steel ball of 1 kg falls from half a metre on steel: what force?
  percuss run ball --set 'indenter.diameter=62.4 mm' --set 'impact.drop=0.5 m' \\
      --set target.material=steel --set target.thickness=half-space \\
      --set indenter.body=elastic
  # let it bounce: the table of four impacts
  percuss run ball --set run.bounces=4 --set 'run.end_time=300 us'
  # continue a run that was interrupted or has crashed
  percuss run my.toml --resume
  # watch it: connect a viewer to ws://127.0.0.1:8765
  percuss run fig5 --live --pace --wait
  # with a viewer on a web site
  percuss run fig5 --live --wait --allow-origin https://app.foxglove.dev";

/// Computes a case and records it.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Run {
    #[command(flatten)]
    case: CaseArguments,
    #[command(flatten)]
    output: OutputArguments,
    /// Continue a run that was interrupted or has crashed, with any number of threads, from its checkpoint,
    /// OUT.mcap.checkpoint, and what it has recorded, OUT.mcap.part. The messages are those of a run that was not interrupted.
    /// A checkpoint is written at an interruption and every run.checkpoint_every seconds (default: 600). Where there is none
    /// the run begins anew, and a complete recording of the case is left as it is: one command serves the first start and all others
    #[arg(long)]
    resume: bool,
    /// Serve the run to viewers over the Foxglove WebSocket protocol while it is recorded; without ADDR to this machine
    /// only, at 127.0.0.1:8765
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1:8765")]
    live: Option<Address>,
    /// With --live, let pages of this origin connect, for example `https://app.foxglove.dev`: the site of a viewer in a browser;
    /// * for all sites. Desktop viewers, programs and pages served by this machine need none. Repeatable
    #[arg(long, value_name = "ORIGIN", requires = "live")]
    allow_origin: Vec<AllowedOrigin>,
    /// Slow the run down to so many seconds of log time per second; 1 without SPEED
    #[arg(long, value_name = "SPEED", num_args = 0..=1, default_missing_value = "1", value_parser = speed)]
    pace: Option<f64>,
    /// Begin when this many viewers have subscribed and 1.5 s have passed without a subscription, as viewers subscribe panel by
    /// panel; 1 without N
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "1", requires = "live", value_parser = whole(0..=VIEWERS))]
    wait: Option<usize>,
    /// After the run, serve viewers until they have left, so many seconds at most; Ctrl-C ends it
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds, requires = "live")]
    hold: Duration,
    /// Engine: the fast one, or the plain stepper that it is tested against, slow and simple
    #[arg(long, value_enum, default_value_t)]
    engine: Engine,
}

impl Run {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load()?;
        let destination = self.output.destination(&self.case.case, &case, "")?;
        let signal = watch_signals()?;
        match case.run.bounces {
            1 => self.record(&case, destination, &signal),
            _ if self.live.is_some() => {
                Err(CliError::Usage("--live is of one impact; leave it out, or set run.bounces = 1".into()))
            }
            _ => {
                let compute = |case: &Case, destination| self.record(case, destination, &signal);
                bounces::run(&case, &destination, self.resume, compute, |text| self.remark(text))
            }
        }
    }

    /// Computes a case and records it, or what is left of it.
    ///
    /// * `signal`: 0 until a signal is caught
    fn record(&self, case: &Case, destination: Destination, signal: &AtomicUsize) -> Result<Exit, CliError> {
        let mut simulation = Simulation::with_engine(case, self.engine);
        let file = file_of(&destination.path).map_err(|error| {
            CliError::system(format!("cannot write `{}`", destination.path.display()), error)
        })?;
        let checkpoint = file.as_deref().map(checkpoint_of);
        checkpoint.as_deref().map_or(Ok(()), check_name)?;
        let resumes = self.resume && self.can_resume(file.as_deref(), case)?;
        if self.resume && is_whole(file.as_deref()) {
            // of a run that was killed at its very end
            checkpoint.as_deref().map_or(Ok(()), checkpoint::remove)?;
            self.remark(&format!("`{}` is complete: nothing is left to resume", destination.path.display()));
            return Ok(Exit::Done);
        }
        // a part without a checkpoint is begun anew
        let is_anew = self.resume && !resumes && !destination.path.exists();
        let destination = Destination { overwrite: destination.overwrite || is_anew, ..destination };
        check_room(&destination.path, case)?;
        let pool = self.output.threads.pool()?;
        let is_over = || signal.load(Ordering::Relaxed) != 0;
        let mut progress =
            Progress::of_run(case, case.sizes.steps, self.output.quiet, self.output.progress.every);
        let live = self.live.as_ref().map(|address| self.open(address, case, &progress)).transpose()?;
        let mut recording = match &checkpoint {
            Some(checkpoint) if resumes => {
                let recorded = checkpoint::load(checkpoint, case, self.engine, &mut simulation)?;
                pool.install(|| Recording::resume(&destination, case, &recorded)).map_err(RunError::from)?
            }
            _ => {
                let recording = pool.install(|| Recording::create(&destination, case, Source::Simulation));
                let recording = recording.map_err(RunError::from)?;
                // of an earlier run
                checkpoint.as_deref().map_or(Ok(()), checkpoint::remove)?;
                recording
            }
        };
        progress.say(&self.heading(case));
        if resumes {
            progress.say(&format!("continues at step {} of {}", simulation.next_step(), case.sizes.steps));
        }
        if let Some(live) = &live {
            recording.tap(Box::new(Arc::clone(live))).map_err(RunError::from)?;
            live::wait_for(live, self.wait.unwrap_or(0), is_over);
        }
        let mut pace = self.pace.map(Pace::new);
        let start = Instant::now();
        let say = progress.speaker();
        let mut recording =
            Checkpoints::new(recording, case, self.engine, checkpoint.clone(), move |text| say(text));
        let mut has_excess = false;
        let mut watch = |view: &View<'_>| {
            if !has_excess && view.frame.as_ref().is_some_and(|frame| frame.energy.exceeds()) {
                has_excess = true;
                let time = case.units().time.text(view.time);
                progress.say(&format!(
                    "warning: at t = {time} the target has more energy than was brought in: the numerics are unstable, do not use what follows"
                ));
            }
            for event in &*view.events {
                progress.say(&event.text);
            }
            if let Some(pace) = &mut pace {
                pace.keep(log_time(case.units().time.of(view.time), case.record.playback_rate), is_over);
            }
            progress.advance(view.step);
            flow(signal)
        };
        let mut steps = Advised::new(case, simulation);
        let outcome = pool.install(|| session::run(&mut steps, &mut [&mut recording, &mut watch]));
        progress.end();
        if let Ok(outcome) = &outcome {
            let measures = recording.recording.measures(&outcome.validity);
            answer(case, &measures).iter().for_each(|text| progress.say(text));
            let (seconds, sizes) = (start.elapsed().as_secs_f64(), &case.sizes);
            let dt = match case.scales {
                Some(_) => case.units().time.text(sizes.dt),
                None => format!("{:.4e}", sizes.dt),
            };
            let planned = format!("{} steps of {dt} planned", sizes.steps);
            let written = written(&destination.path, &outcome.status);
            progress.say(&format!("{written} in {seconds:.2} s; {planned}"));
            if matches!(outcome.status, Status::Interrupted(_))
                && checkpoint.is_some_and(|checkpoint| checkpoint.exists())
            {
                progress.say("the same command with --resume continues the run");
            }
        }
        if let Some(live) = live {
            self.hold(&live, signal);
        }
        Ok(exit(&outcome?.status, signal))
    }

    /// True if an earlier run has left something to continue. What it has recorded is that of this case, or cannot be identified.
    ///
    /// * `file`: the recording
    fn can_resume(&self, file: Option<&Path>, case: &Case) -> Result<bool, CliError> {
        let Some(file) = file else {
            return Err(CliError::Usage("a recording that goes to a device has no checkpoint".into()));
        };
        let part = part_of(file);
        let is_left = part.exists() && checkpoint_of(file).exists();
        let left = match (part.exists(), file.exists()) {
            (true, _) => &*part,
            (false, true) => file,
            (false, false) => return Ok(false),
        };
        let differences = match recorded_case(left).map(|recorded| checkpoint::differences(&recorded, case)) {
            Some(Ok(None)) => return Ok(is_left),
            Some(Ok(Some(differences))) => differences,
            // killed before its case was written; if there is a checkpoint, its messages are compared
            Some(Err(_)) | None if part.exists() => return Ok(is_left),
            Some(Err(_)) | None => "it has none that can be read".to_owned(),
        };
        Err(CliError::Failed(format!(
            "`{}` is not the recording of this case: {differences}; choose another output with -o, or begin the run anew with --force in \
             place of --resume",
            left.display()
        )))
    }

    fn remark(&self, text: &str) {
        if !self.output.quiet {
            say(&printable(text));
        }
    }

    /// The case, and how dense its fields are and how far they reach unless it says so itself.
    fn heading(&self, case: &Case) -> String {
        let mut text = format!("{}: {}", printable(&self.case.case), printable(&case.title));
        for (key, row) in target::rows(case) {
            text += &format!("\n{key:<10} {row}");
        }
        let every = case.record.field_every;
        if every > 1 && every == case.default_field_every() {
            text += &format!(
                "\nfields show one node in {every} along r and along z; --set record.field_every=1 shows all"
            );
        }
        if let Some(radius) = case.shown_radius().filter(|radius| *radius == case.default_r_max()) {
            let radius = case.units().length.text(radius);
            text += &format!("\nfields reach to r = {radius}; --set record.r_max=inf shows all");
        }
        text
    }

    fn hold(&self, live: &Server, signal: &AtomicUsize) {
        let is_over = || signal.load(Ordering::Relaxed) != 0;
        let viewers = live.viewers();
        if viewers > 0 && !self.hold.is_zero() && !is_over() && !self.output.quiet {
            say(&format!(
                "recorded; open viewers: {viewers}; served until they leave, {} s at most",
                self.hold.as_secs_f64()
            ));
        }
        live.hold(self.hold, is_over);
    }

    /// Opens the server of a live run and prints its address.
    fn open(
        &self,
        address: &Address,
        case: &Case,
        progress: &Progress<Clock>,
    ) -> Result<Arc<Server>, CliError> {
        let access = Access { origins: self.allow_origin.clone(), report: progress.speaker() };
        let live = live::open(address, &case.title, Catalogue::new(case).specs(), access)?;
        progress.say(&format!("live at {} for {}", live.url(), live.reach()));
        Ok(live)
    }
}

/// What an impact came to, in a line; none of a run without a force.
fn answer(case: &Case, measures: &[Measure]) -> Option<String> {
    let of = |name: &str| measures.iter().find(|measure| measure.name == name)?.value;
    let Units { length, time, force, .. } = case.units();
    let text = |unit: Unit, x: f64| unit.text_with_unit(4, x / unit.scale);
    let (peak, at) = of("peak_force").zip(of("peak_time"))?;
    // a flat face meets all nodes at once: what that takes would be waves, not rebound
    let corrected = of("restitution_mesh_corrected").filter(|_| !case.indenter.head.is_flat());
    let restitution = corrected.or(of("restitution"));
    let more = [
        of("contact_duration").map(|x| format!(", contact {}", text(time, x))),
        of("contact_radius").map(|x| format!(", contact radius {}", text(length, x))),
        restitution.map(|e| format!(", restitution {e:.4}")),
    ];
    let more: String = more.into_iter().flatten().collect();
    Some(format!("peak force {} at t = {}{more}", text(force, peak), text(time, at)))
}

/// Refuses a name that is too long for the files that a run writes beside its recording.
///
/// * `checkpoint`: whose part has the longest of them
fn check_name(checkpoint: &Path) -> Result<(), CliError> {
    let longest = part_of(checkpoint);
    match longest.symlink_metadata() {
        Err(error) if error.kind() == io::ErrorKind::InvalidFilename => Err(CliError::Usage(format!(
            "`{}` is too long a name, and a run needs it beside its recording; choose a shorter output with -o",
            longest.display()
        ))),
        _ => Ok(()),
    }
}

/// True if a recording has its name and nothing is left that could continue.
fn is_whole(file: Option<&Path>) -> bool {
    file.is_some_and(|file| file.exists() && !part_of(file).exists())
}
