//! A run between two steps as a stream of bytes, and back.
//!
//! Only what changes from step to step is written: the rest follows from the case.

use std::io;

use super::Simulation;
use crate::state::{SaveState, StateError, StateReader, StateWriter};

impl SaveState for Simulation {
    /// Writes the state before the next step. The run can continue afterwards.
    ///
    /// # Panics
    ///
    /// If computed steps have not been returned yet, see [`Steps::interrupt`](super::Steps::interrupt).
    fn save(&mut self, out: &mut StateWriter<'_>) -> io::Result<()> {
        out.put(&(self.next_step, self.balance, &self.validity))?;
        self.indenter.save(out)?;
        self.watch.save(out)?;
        self.contact.save(out)?;
        self.surface.save(out)?;
        self.motion.iter().try_for_each(|level| out.numbers(level))?;
        self.striker.iter_mut().try_for_each(|striker| striker.save(out))?;
        self.model.save(out)
    }
}

impl Simulation {
    /// Number of the next step to be computed.
    pub fn next_step(&self) -> u64 {
        self.next_step
    }

    /// Restores what [`SaveState::save`] has written, in place of the beginning of the run, with any number of threads.
    ///
    /// # Errors
    ///
    /// The stream cannot be read, or is that of another case.
    pub fn load(&mut self, from: &mut StateReader<'_>) -> Result<(), StateError> {
        (self.next_step, self.balance, self.validity) = from.get()?;
        StateError::unless(
            self.next_step <= self.case.sizes.steps,
            "number of the next step",
            self.next_step,
        )?;
        self.indenter.load(from)?;
        self.watch.load(from)?;
        self.contact.load(from)?;
        self.surface.load(from)?;
        self.motion.iter_mut().try_for_each(|level| from.numbers(level))?;
        self.striker.iter_mut().try_for_each(|striker| striker.load(self.next_step, from))?;
        self.model.load(self.next_step, from)?;
        from.end()
    }
}

#[cfg(test)]
mod tests;
