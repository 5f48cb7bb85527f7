//! `percuss exact`: the closed form for a case, recorded like a run.

use clap::Args;
use percuss_output::text::printable;

use super::{
    CaseArguments, CliError, Exit,
    output::{OutputArguments, check_room, exit, flow, watch_signals, written},
    progress::Progress,
};
use crate::{
    session::{self, ExactSteps, Recording, RunError},
    view::View,
};

const EXAMPLES: &str = "\
Examples:
  percuss exact fig2-prescribed  # into fig2-prescribed-exact.mcap
  percuss run fig2-prescribed && percuss-read diff \\
      fig2-prescribed-exact.mcap fig2-prescribed.mcap --l2-rel 0.01
  # until the wave of the edge arrives
  percuss exact fig3 --set record.probes=[0.0,0.5]
  # the contact of Hertz, without waves
  percuss exact ball --set 'target.thickness=\"half-space\"'

`percuss cases` lists each form and its valid time. Where a form has no value the recording has NaN; `percuss-read \
diff --skip-nan` leaves those out.";

/// Records the closed form for a case, on those channels of a run that it has values of.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Exact {
    #[command(flatten)]
    case: CaseArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Exact {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let case = self.case.load_single()?;
        let mut steps = ExactSteps::new(&case)?;
        let destination = self.output.destination(&self.case.case, &case, "-exact")?;
        check_room(&destination.path, &case)?;
        let pool = self.output.threads.pool()?;
        let signal = watch_signals()?;
        let source = steps.source();
        let recording = pool.install(|| Recording::create(&destination, &case, source));
        let mut recording = recording.map_err(RunError::from)?;
        let mut progress =
            Progress::of_run(&case, steps.form().last_step(), self.output.quiet, self.output.progress.every);
        progress.say(&format!("{}: {}", printable(&self.case.case), steps.form()));
        if !(case.record.points.is_empty() && case.record.lines.is_empty() && case.record.sensors.is_empty())
        {
            progress.say("record.points, record.lines and record.sensor are left out: a closed form is that of the interface");
        }
        let mut watch = |view: &View<'_>| {
            progress.advance(view.step);
            flow(&signal)
        };
        let outcome = pool.install(|| session::run(&mut steps, &mut [&mut recording, &mut watch]));
        progress.end();
        let status = outcome?.status;
        progress.say(&written(&destination.path, &status));
        Ok(exit(&status, &signal))
    }
}
