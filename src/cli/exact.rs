//! `percuss exact`: the closed form that answers a case, recorded like a run.

use std::{fs, sync::atomic::Ordering};

use clap::Args;
use indicatif::BinaryBytes;

use super::{
    CaseArguments, CliError, Exit,
    output::{OutputArguments, interrupted_by, watch_signals},
    progress::Progress,
};
use crate::{
    case::{Case, HeadKind},
    exact::closed_form::ClosedForm,
    session::{Session, Source, Status},
    validity::Validity,
};

const EXAMPLES: &str = "\
Examples:
  percuss exact fig2-prescribed                              into fig2-prescribed-exact.mcap
  percuss run fig2-prescribed && percuss-read diff fig2-prescribed-exact.mcap fig2-prescribed.mcap --l2-rel 0.01
  percuss exact fig3 --set record.probes=[0.0,0.5]           until the wave of the edge arrives

Which closed form answers a case, and until when, `percuss cases` says. Where a form knows no value the recording has
not-a-number; `percuss-read diff --skip-nan` leaves those out.";

/// Records the closed form that answers a case, on the channels of a run that it knows.
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
        let case = self.case.load()?;
        let mut form = ClosedForm::for_case(&case)?;
        let path = self.output.path(&self.case.case, "-exact")?;
        let pool = self.output.threads.pool()?;
        let source = Source::Exact { form: form.name(), knows_drag: form.has_drag() };
        let signal = watch_signals()?;
        let mut session =
            Session::begin(&case, source, &path, self.output.force, pool.current_num_threads())?;
        let last = form.last_step();
        let mut progress = Progress::new(last, case.sizes.dt, self.output.quiet);
        progress.say(&format!("{}: {form}", self.case.case));

        let mut validity = Validity::new(case.impact.velocity, case.indenter.head == HeadKind::Flat);
        let mut status = ending(&case, &form);
        for step in 0..=last {
            let view = pool.install(|| form.evaluate(step));
            for (i, p) in view.interface.pressure.iter().enumerate() {
                let place = (view.interface.r0 + i as f64 * view.interface.dr, 0.0);
                validity.observe(p.abs(), view.step, view.time, place);
            }
            for &r in &case.record.probes {
                validity.observe_probe(view.interface.stress_at(r).abs(), view.step, view.time, r);
            }
            session.observe(&view)?;
            progress.advance(view.step, view.time);
            let seen = signal.load(Ordering::Relaxed);
            if seen != 0 && step < last {
                status = Status::Interrupted(interrupted_by(seen));
                break;
            }
        }
        progress.end();
        session.end(&status, &validity)?;
        let size = fs::metadata(&path).map_or(0, |metadata| metadata.len());
        progress.say(&format!("{}: {}, {}", path.display(), status.name(), BinaryBytes(size)));
        Ok(match status {
            Status::Interrupted(_) => Exit::Interrupted(signal.load(Ordering::Relaxed) as u8),
            _ => Exit::Done,
        })
    }
}

fn ending(case: &Case, form: &ClosedForm) -> Status {
    if form.last_step() == case.sizes.steps {
        return Status::Completed;
    }
    Status::Stopped(format!("the closed form holds until t = {}", form.end_time()))
}
