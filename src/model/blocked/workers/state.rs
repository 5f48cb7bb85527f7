//! A field as a stream of bytes: all rows that have been written to, of all levels that are kept, with their images.
//!
//! Levels that the next step overwrites are among them: where less and less of the depth is computed, nodes beyond keep what they
//! had, and some of it is read.

use std::io;

use super::Workers;
use crate::{
    model::blocked::domain::Theory,
    state::{StateError, StateReader, StateWriter},
};

#[expect(unsafe_code, reason = "a field that no pass works on")]
impl<S: Theory> Workers<S> {
    /// Calls `f` on every row of every level that has been written to.
    ///
    /// * `columns`: those that have moved
    fn each_row<E>(
        &mut self,
        columns: usize,
        mut f: impl FnMut(&mut [f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        assert!(self.passes.is_empty(), "passes are under way");
        for level in 0..self.levels().count() {
            for j in -1..self.opened as isize {
                for field in 0..S::FIELDS {
                    let offset = field * self.levels().lateral();
                    // SAFETY: no pass is under way, and `&mut self` excludes that a row is borrowed
                    f(unsafe { self.levels().with_images(level, j, offset, columns) })?;
                }
            }
        }
        Ok(())
    }

    /// Writes the field.
    ///
    /// * `columns`: those that have moved
    ///
    /// # Panics
    ///
    /// If a pass is under way.
    pub fn save(&mut self, columns: usize, out: &mut StateWriter<'_>) -> io::Result<()> {
        out.put(&self.opened)?;
        self.each_row(columns, |row| out.numbers(row))
    }

    /// Restores the field written by [`Workers::save`], in place of one at rest.
    ///
    /// * `columns`: those that have moved
    pub fn load(&mut self, columns: usize, from: &mut StateReader<'_>) -> Result<(), StateError> {
        let opened = from.get()?;
        StateError::unless(opened <= self.levels().rows(), "number of rows", opened)?;
        self.open_rows(opened);
        self.each_row(columns, |row| from.numbers(row))
    }
}
