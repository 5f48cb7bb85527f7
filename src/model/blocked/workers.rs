//! Threads that work on the tiles while the near-surface band is already ahead.
//!
//! Who does what, and in which order, is settled in [`super::handover`]; this module knows the field, and which rows of it may be
//! looked at while passes are under way.

use std::sync::Arc;

use super::{
    domain::{Domain, SurfaceMotion, Theory},
    handover::HandOver,
    lane::BLOCK,
    levels::Levels,
    tiles::{LevelTask, Pass, RowPeak, Sizes, Tiling},
};

mod state;

/// A field whose interior follows behind its surface.
pub struct Workers<S> {
    domain: Arc<Domain<S>>,
    passes: HandOver<Pass<S>>,
    sizes: Sizes,
    /// Levels that the interior may lag behind the surface.
    lag: usize,
    /// Rows that have been written to.
    opened: usize,
}

/// A pass that has ended.
pub struct Ended {
    /// Level that the interior has reached. What was computed and sampled on the way to it has happened before.
    pub level: usize,
    /// Peaks of the row before the backing, see [`Pass::peaks`].
    pub peaks: [RowPeak; 2],
}

#[expect(unsafe_code, reason = "passes work on the field in place")]
impl<S: Theory> Workers<S> {
    /// A field at rest.
    pub fn new(domain: Domain<S>, sizes: Sizes) -> Self {
        Self {
            lag: sizes.lag(domain.grid.depth(), domain.theory.reach()),
            domain: Arc::new(domain),
            passes: HandOver::new(),
            sizes,
            opened: 0,
        }
    }

    /// The same field, at rest, cut to other sizes.
    #[cfg(test)]
    pub fn cut(&mut self, sizes: Sizes) {
        assert_eq!(self.opened, 0, "a field that has moved");
        (self.lag, self.sizes) = (sizes.lag(self.domain.grid.depth(), self.domain.theory.reach()), sizes);
    }

    /// What the field consists of.
    pub fn domain(&self) -> &Domain<S> {
        &self.domain
    }

    /// Number of passes that are kept, because they are under way or have not been asked for.
    #[cfg(test)]
    pub fn passes(&self) -> usize {
        self.passes.len()
    }

    /// Levels that the interior may lag behind the surface.
    pub fn lag(&self) -> usize {
        self.lag
    }

    /// Depths of the near-surface band just after the interior has followed.
    pub fn band_rows(&self) -> usize {
        Tiling::band_rows(self.lag, self.domain.theory.reach())
    }

    fn levels(&self) -> &Levels {
        &self.domain.levels
    }

    /// Panics if a pass may be writing to row `j`.
    fn check(&self, j: usize) {
        assert!(
            self.passes.is_empty() || j < self.domain.grid.rows_at(0..self.band_rows() - 1).end,
            "row {j} while the interior is being advanced"
        );
    }

    /// Row `j` at a level, with zeros at its end; one of the near-surface band, if passes may be under way.
    pub fn row(&self, level: usize, j: usize) -> &[f64] {
        self.check(j);
        // SAFETY: passes are begun by `&mut self`; those under way do not come up to the band
        unsafe { self.levels().part(level, j, 0..self.levels().columns() + BLOCK) }
    }

    /// Displacement u_z of the surface at `level` if it were free of stress, see [`Theory::free_surface`].
    pub fn free_surface(&self, level: usize, room: &mut S::Room, free: &mut [f64]) {
        self.check(self.domain.theory.reach());
        // SAFETY: passes under way do not come up to these rows, and no thread writes to them meanwhile
        unsafe { S::free_surface(&self.domain, level, room, free) }
    }

    /// Largest strain on the surface at a level in column `i`.
    ///
    /// * `pressure`: there
    pub fn surface_strain(&self, level: usize, pressure: f64, i: usize) -> f64 {
        self.check(0);
        let levels = self.levels();
        let at = |field: usize, j: usize, i: isize| {
            // SAFETY: as for row 0 in `row`
            unsafe { levels.at(level, j, field * levels.lateral(), i) }
        };
        self.domain.theory.surface_strain(at, pressure, i)
    }

    /// Row `j` of a displacement at a level.
    ///
    /// * `field`: 0 for u_z, 1 for u_r
    pub fn displacement(&self, level: usize, field: usize, j: usize) -> &[f64] {
        match field {
            0 => self.row(level, j),
            _ => {
                self.check(j);
                // SAFETY: as in `row`
                unsafe { self.levels().lateral_part(level, j) }
            }
        }
    }

    /// Makes sure that the rows at `depths` depths are memory.
    pub fn open(&mut self, depths: usize) {
        self.open_rows(self.domain.grid.rows_at(0..depths).end);
    }

    /// Makes sure that `rows` rows are memory.
    fn open_rows(&mut self, rows: usize) {
        let rows = rows.min(self.levels().rows());
        if rows > self.opened {
            // SAFETY: passes under way know of no row that has not been opened before they began
            unsafe { self.levels().open(self.opened, rows - self.opened) };
            self.opened = rows;
        }
    }

    /// Advances the near-surface band to `level`: row 0 as the contact has settled it, and as many rows as are not left to
    /// the passes.
    ///
    /// * `depths`: of the band, with row 0
    pub fn advance_band(&mut self, level: usize, depths: usize, task: &LevelTask, motion: SurfaceMotion<'_>) {
        self.check(self.domain.grid.rows_at(0..depths).end.saturating_sub(1));
        let rows = 0..depths.min(task.active.rows);
        // SAFETY: passes under way stay below the band, and `&mut self` excludes that a row is borrowed
        unsafe { task.advance(&self.domain, level, rows, 0..task.active.columns, Some(motion)) };
    }

    /// Begins a pass over `tasks.len()` levels from level `base` on. When this returns the near-surface band can go on.
    pub fn follow(&mut self, base: usize, tasks: Vec<LevelTask>) {
        let nodes: usize = tasks.iter().map(|LevelTask { active, .. }| active.rows * active.columns).sum();
        let threads = if nodes > self.sizes.nodes_for_one { rayon::current_num_threads() } else { 1 };
        let (domain, cut) = (Arc::clone(&self.domain), (&self.sizes, self.lag));
        let pass = Pass::new(domain, base, tasks, cut, threads, self.passes.newest());
        self.passes.follow(pass, threads, |helper| rayon::spawn(|| helper.help()));
    }

    /// Waits until all passes are over.
    pub fn settle(&mut self) {
        self.passes.settle();
    }

    /// The next pass that has ended, in order, if it has.
    pub fn ended(&mut self) -> Option<Ended> {
        let pass = self.passes.ended()?;
        Some(Ended { level: pass.last_level(), peaks: pass.peaks() })
    }
}
