//! A recording with checkpoints: an observer that asks for them from time to time.
//!
//! Nothing of the clock reaches the recording but where chunks end: at a checkpoint the open one is closed.

use std::{
    path::PathBuf,
    time::{Duration, Instant},
};

use super::{Head, remove, write};
use crate::{
    case::Case,
    session::{Flow, Observer, Recording, RunError, Status},
    simulation::Engine,
    state::SaveState,
    validity::Validity,
    view::View,
};

/// Wall time from one checkpoint to the next, unless the case says otherwise.
const DEFAULT_INTERVAL: Duration = Duration::from_secs(600);

/// Memory of a field from which on writing it is announced \[bytes\].
const LARGE: u64 = 256 << 20;

/// Records a run with checkpoints: one every now and then, one at an interruption. Only the newest is kept, and none once the
/// recording is whole.
pub struct Checkpoints<'a> {
    pub(crate) recording: Recording,
    case: &'a Case,
    engine: Engine,
    /// None for a recording that goes to a device.
    path: Option<PathBuf>,
    /// Wall time from one to the next; none if there are only those of interruptions.
    every: Option<Duration>,
    last: Instant,
    /// Takes what there is to say.
    say: Box<dyn Fn(&str) + Send + 'a>,
}

impl<'a> Checkpoints<'a> {
    /// A recording of `case` with checkpoints at `path`.
    ///
    /// * `path`: none for a recording that goes to a device, which has none
    /// * `say`: takes what there is to say to the user
    pub fn new(
        recording: Recording,
        case: &'a Case,
        engine: Engine,
        path: Option<PathBuf>,
        say: impl Fn(&str) + Send + 'a,
    ) -> Self {
        let every = case.run.checkpoint_every.map_or(DEFAULT_INTERVAL, Duration::from_secs_f64);
        let is_off = case.run.checkpoint_every == Some(0.0);
        Self {
            recording,
            case,
            engine,
            every: (!is_off && path.is_some()).then_some(every),
            path,
            last: Instant::now(),
            say: Box::new(say),
        }
    }
}

impl Observer for Checkpoints<'_> {
    fn observe(&mut self, view: &View<'_>) -> Result<Flow, RunError> {
        let flow = self.recording.observe(view)?;
        let is_due = self.every.is_some_and(|every| self.last.elapsed() >= every);
        Ok(if is_due && flow == Flow::Continue { Flow::Checkpoint } else { flow })
    }

    /// Brings the messages onto the disk, then the state. A state that cannot be written ends no run: the checkpoint before it stays.
    fn write_checkpoint(&mut self, state: &mut dyn SaveState) -> Result<(), RunError> {
        let Some(path) = &self.path else { return Ok(()) };
        let size = self.case.field_memory();
        if size >= LARGE {
            (self.say)(&format!("writing a checkpoint of up to {} MB", size / 1_000_000));
        }
        let head = Head::new(self.case, self.engine, self.recording.seal()?);
        if let Err(error) = write(path, &head, state) {
            (self.say)(&format!("warning: {error}; the run continues without it"));
        }
        self.last = Instant::now();
        Ok(())
    }

    fn end(&mut self, status: &Status, validity: &Validity) -> Result<(), RunError> {
        self.recording.end(status, validity)?;
        if status.is_finished()
            && let Some(Err(error)) = self.path.as_deref().map(remove)
        {
            (self.say)(&format!("warning: {error}"));
        }
        Ok(())
    }
}
