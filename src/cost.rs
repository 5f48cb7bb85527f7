//! What a run will take: memory, bytes, time.
//!
//! The case gives the amount of work ([`Work`]); the machine gives the time of each piece of it, measured once
//! ([`calibration`]); when it stops and how much its messages pack is tried on a coarser mesh ([`trial`]).

use crate::{
    case::{Case, CaseErrors, Sizes},
    channels::{Catalogue, Size},
    model::{Extent, lag},
};

pub mod calibration;
pub mod trial;

use calibration::Rates;
use trial::Trial;

/// Amount of work in a run.
#[derive(Clone, Copy, Debug)]
pub struct Work {
    /// Node updates inside the light cone.
    pub updates: f64,
    /// Columns of the surface inside the light cone, summed over the steps.
    pub columns: f64,
    /// Nodes inside the light cone, summed over the frames.
    pub frame_nodes: f64,
    /// Numbers of fields that may have moved, summed over the frames.
    pub shown: f64,
    /// Numbers of fields that are at rest, summed over the frames: they are recorded as zeros, which take no time to pack.
    pub at_rest: f64,
    /// Messages for viewers.
    pub views: f64,
    /// Messages before compression.
    pub messages: Size,
}

impl Work {
    /// The work of a whole run of `case`, if nothing stops it.
    pub fn of(case: &Case) -> Self {
        Self::up_to(case, 1.0)
    }

    /// The work of a run of `case` that is stopped. It does not know before that it will be: it computes what would have
    /// been seen at the end.
    ///
    /// * `part`: of the steps, at most 1
    pub fn up_to(case: &Case, part: f64) -> Self {
        const SAMPLES: u64 = 1000;
        let Sizes { steps: last_step, nz, .. } = case.sizes;
        let rows = |step: f64| if case.looks_inside() { step } else { step.min(last_step as f64 - step) };
        let case = &case.cut(part);
        let steps = case.sizes.steps;
        let samples = steps.min(SAMPLES);
        let (mut updates, mut columns) = (0.0, 0.0);
        for sample in 0..samples {
            let step = (sample as f64 + 0.5) / samples as f64 * steps as f64;
            columns += case.lit_columns(step);
            updates += case.lit_columns(step) * rows(step).min(nz as f64);
        }
        let each = steps as f64 / samples as f64;
        let frames = case.frames().about();
        let frame_nodes: f64 = frames.iter().map(|step| case.lit_columns(*step) * step.min(nz as f64)).sum();
        let fields = case.record.fields.len() as f64;
        let shown = fields * case.shown_nodes(case.record.field_every);
        let Extent { nr, nz } = case.slice_extent();
        let recorded = fields * (nr * nz) as f64 * frames.len() as f64;
        Self {
            updates: updates * each,
            columns: columns * each,
            frame_nodes,
            shown,
            at_rest: (recorded - shown).max(0.0),
            views: (frames.len() * case.record.views.len()) as f64,
            messages: Catalogue::new(case).size(case),
        }
    }

    /// Messages of numbers before compression, without those that are at rest \[bytes\].
    fn dense_bytes(&self) -> f64 {
        self.messages.numbers as f64 - size_of::<f32>() as f64 * self.at_rest
    }

    /// Time of a run, from the start of the process to its end \[s\].
    ///
    /// The thread that writes works beside those that compute; who is faster waits, or all share the cores.
    pub fn seconds(&self, case: &Case, rates: &Rates) -> f64 {
        let computing = rates.computing(self);
        let writing = rates.writing(self, case.record.compression);
        rates.start + writing.max(computing + writing * held_up(case, computing, rates.cores))
    }
}

/// How long computing is held up while the thread that writes works, relative to that.
///
/// That thread takes the core of one of those that compute. The others go on meanwhile for as long as the surface may be ahead
/// of the interior, and at best make up for it all.
///
/// * `computing`: time of the run without recording \[s\]
/// * `cores`: that computing and writing share
fn held_up(case: &Case, computing: f64, cores: f64) -> f64 {
    /// Time for which a thread loses its core, about \[s\].
    const TURN: f64 = 2e-3;
    let ahead = lag(case.sizes.nz) as f64 * computing / case.sizes.steps as f64;
    1.0 - (1.0 - 1.0 / cores) * (ahead / TURN).min(1.0)
}

/// Frames in memory at once, about, if they come faster than they are written: under way, and in the queue of the recorder.
const FRAMES_IN_MEMORY: u64 = 9;

/// What a run will take.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Memory for the field and for frames on their way to the file \[bytes\].
    pub memory: u64,
    /// The work.
    pub work: Work,
    /// Size of the recording \[bytes\].
    pub file: u64,
    /// Time of the run \[s\], if the machine is known.
    pub seconds: Option<f64>,
    /// Time of the target at which the case's stop condition ends the run \[R/c_p\].
    pub stops_at: Option<f64>,
}

impl Estimate {
    /// Estimates a run of `case`.
    ///
    /// * `coarser`: the case on a mesh of so many cells, with every so many nodes of a field, for the trial
    pub fn new(
        case: &Case,
        rates: Option<&Rates>,
        coarser: impl Fn(usize, usize) -> Result<Case, CaseErrors>,
    ) -> Self {
        let trial = Trial::of(case, &Work::of(case), coarser);
        let work = Work::up_to(case, trial.part);
        Self {
            memory: 2 * 8 * (case.sizes.nr as u64 + 1) * (case.sizes.nz as u64 + 1)
                + FRAMES_IN_MEMORY.min(case.frames().count()) * case.frame_size() as u64,
            file: trial.file_size(work.messages) as u64,
            seconds: rates.map(|rates| work.seconds(case, rates)),
            stops_at: (trial.part < 1.0).then_some(trial.part * case.sizes.steps as f64 * case.sizes.dt),
            work,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_that_stops_has_computed_what_would_have_been_seen_at_its_end() {
        let case = Case::load("fig8-m5", &["record.frames=0".into()]).expect("a built-in case");
        let share = Work::up_to(&case, 0.5).updates / Work::of(&case).updates;
        // rows grow up to the middle of the run and shrink again, columns c(t) grow from n to 3.4·n:
        // ∫_0^½ t·c dt : ∫_½^1 (1 − t)·c dt
        assert!((share - 0.41).abs() < 0.02, "{share}");
        // in a run of half the time they would begin to shrink at a quarter
        assert!(Work::of(&case.cut(0.5)).updates < 0.6 * Work::up_to(&case, 0.5).updates);
    }
}
