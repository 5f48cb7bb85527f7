//! Threads that work on the tiles while the near-surface band is already ahead.
//!
//! The thread of the run ends a lag by handing over a pass, does the first tile rows of it itself (the band needs those
//! rows), and goes on with the band, the contact and the recording; helpers in the pool take the other tile rows, in order,
//! pass after pass. So no thread waits for a whole pass, what one thread has to do alone is done while the others have
//! work, and threads that lose their core for a while seldom hold up the others.
//!
//! How many tile rows the thread of the run takes settles by itself: one more in the next pass when it had to do what helpers
//! had not begun, one less when helpers had nothing else to do. So tile rows stay with the same thread, and with the caches
//! of its core: it can take longer to fetch them from another core than to compute them.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use super::{
    cells::CellWeights,
    domain::Domain,
    levels::Levels,
    sampler::SurfaceMotion,
    tiles::{LevelTask, Pass, RowPeak, band_rows, lag, wait_until},
    vector::BLOCK,
};

mod state;

/// Nodes in a pass below which a second thread is not worth waking.
const NODES_PER_THREAD: usize = 100_000;

/// How often a helper looks for work before it goes to sleep.
const PATIENCE: usize = 20_000;

/// Tile rows that no thread has begun, in the order in which they must be.
#[derive(Default)]
struct Queue {
    /// Sweeps with the next tile row of each.
    passes: Mutex<VecDeque<(Arc<Pass>, usize)>>,
    /// Number of tile rows.
    waiting: AtomicUsize,
    /// Number of helpers that are awake.
    helpers: AtomicUsize,
    /// True if the next pass is far: the pool has other work to do.
    is_over: AtomicBool,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, VecDeque<(Arc<Pass>, usize)>> {
        self.passes.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds all tile rows of a pass.
    fn add(&self, pass: &Arc<Pass>) {
        if pass.tile_rows() > 0 {
            self.lock().push_back((Arc::clone(pass), 0));
            self.waiting.fetch_add(pass.tile_rows(), Ordering::SeqCst);
        }
    }

    /// Does the next tile row; false if there is none.
    fn work(&self) -> bool {
        let passes = self.lock();
        if passes.is_empty() {
            return false;
        }
        self.take(passes, 0);
        true
    }

    /// Does the next tile row of pass number `place`. Those that it waits for must be done or begun: they are if that pass is
    /// the first, or if the tile row may begin.
    fn take(&self, mut passes: MutexGuard<'_, VecDeque<(Arc<Pass>, usize)>>, place: usize) {
        let (pass, next) = &mut passes[place];
        let (pass, tile_row) = (Arc::clone(pass), *next);
        *next += 1;
        if *next == pass.tile_rows() {
            passes.remove(place);
        }
        self.waiting.fetch_sub(1, Ordering::SeqCst);
        drop(passes);
        pass.advance(tile_row);
    }

    /// Does the first `share` tile rows of the newest pass, as far as no helper has begun them, and what has to be done
    /// before them.
    ///
    /// Returns the share of the next pass.
    fn do_share(&self, pass: &Arc<Pass>, share: usize) -> usize {
        let share = share.clamp(1, pass.tile_rows());
        let (mut own, mut others) = (0, 0);
        loop {
            let passes = self.lock();
            let newest = passes.back().filter(|(newest, _)| Arc::ptr_eq(newest, pass));
            let Some(next) = newest.map(|(_, next)| *next).filter(|next| *next < share) else { break };
            if pass.may_begin(next) {
                own += 1;
                let place = passes.len() - 1;
                self.take(passes, place);
            } else if passes.len() > 1 {
                others += 1;
                self.take(passes, 0);
            } else {
                drop(passes);
                wait_until(|| pass.may_begin(next));
            }
        }
        if others > 0 {
            share + 1
        } else if own < share {
            share - 1
        } else {
            share
        }
    }

    /// What a helper does until there has been nothing to do for a while.
    fn help(&self) {
        loop {
            while self.work() {}
            let mut patience = PATIENCE;
            while patience > 0 && self.waiting.load(Ordering::SeqCst) == 0 {
                std::hint::spin_loop();
                patience = if self.is_over.load(Ordering::Relaxed) { 0 } else { patience - 1 };
            }
            if patience == 0 {
                self.helpers.fetch_sub(1, Ordering::SeqCst);
                // a pass added in the meantime found a helper awake and woke none
                if self.waiting.load(Ordering::SeqCst) == 0 {
                    return;
                }
                self.helpers.fetch_add(1, Ordering::SeqCst);
            }
        }
    }
}

/// A field whose interior follows behind its surface.
pub struct Workers {
    domain: Arc<Domain>,
    queue: Arc<Queue>,
    /// Passes that may be under way, the oldest first.
    passes: VecDeque<Arc<Pass>>,
    /// Levels that the interior may lag behind the surface.
    lag: usize,
    /// Rows that have been written to.
    opened: usize,
    /// Tile rows of a pass that the thread of the run does itself.
    share: usize,
}

/// A pass that has ended.
pub struct Ended {
    /// Level that the interior has reached. What was computed and sampled on the way to it has happened before.
    pub level: usize,
    /// Peaks of the row before the backing, see [`Pass::peaks`].
    pub peaks: [RowPeak; 2],
}

#[expect(unsafe_code, reason = "passes work on the field in place")]
impl Workers {
    /// A field at rest.
    pub fn new(domain: Domain) -> Self {
        Self {
            lag: lag(domain.backing, domain.reach()),
            domain: Arc::new(domain),
            queue: Arc::default(),
            passes: VecDeque::new(),
            opened: 0,
            share: 1,
        }
    }

    /// What the field consists of.
    pub fn domain(&self) -> &Domain {
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

    /// Rows of the near-surface band just after the interior has followed.
    pub fn band_rows(&self) -> usize {
        band_rows(self.lag, self.domain.reach())
    }

    fn levels(&self) -> &Levels {
        &self.domain.levels
    }

    /// Panics if a pass may be writing to row `j`.
    fn check(&self, j: usize) {
        assert!(
            self.passes.is_empty() || j + 1 < self.band_rows(),
            "row {j} while the interior is being advanced"
        );
    }

    /// Row `j` at a level, with zeros at its end; one of the near-surface band, if passes may be under way.
    pub fn row(&self, level: usize, j: usize) -> &[f64] {
        self.check(j);
        // SAFETY: passes are begun by `&mut self`; those under way do not come up to the band
        unsafe { self.levels().part(level, j, 0..self.levels().columns() + BLOCK) }
    }

    /// Both displacements of the surface at `level` if it were free of stress, see [`Domain::free_surface`].
    pub fn free_surface(&self, level: usize, weights: &CellWeights, free: &mut [Vec<f64>; 2]) {
        self.check(1);
        // SAFETY: passes under way do not come up to rows 0 and 1, and nobody writes to them meanwhile
        unsafe { self.domain.free_surface(level, weights, free) }
    }

    /// Largest strain on the surface at a level in column `i`.
    ///
    /// * `pressure`: there
    pub fn surface_strain(&self, level: usize, weights: &CellWeights, pressure: f64, i: usize) -> f64 {
        self.check(0);
        let levels = self.levels();
        let at = |field: usize, j: usize, i: isize| {
            // SAFETY: as for row 0 in `row`
            unsafe { levels.at(level, j, field * levels.lateral(), i) }
        };
        weights.theory.strain(at, pressure, 0, i).largest_on_face()
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

    /// Makes sure that `rows` rows are memory.
    pub fn open(&mut self, rows: usize) {
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
    /// * `rows`: of the band, with row 0
    pub fn advance_band(&mut self, level: usize, rows: usize, task: &LevelTask, motion: SurfaceMotion<'_>) {
        self.check(rows.saturating_sub(1));
        let rows = 0..rows.min(task.active.rows);
        // SAFETY: passes under way stay below the band, and `&mut self` excludes that a row is borrowed
        unsafe { task.advance(&self.domain, level, rows, 0..task.active.columns, Some(motion)) }
    }

    /// Begins a pass over `tasks.len()` levels from level `base` on. When this returns the near-surface band can go on.
    pub fn follow(&mut self, base: usize, tasks: Vec<LevelTask>) {
        let nodes: usize = tasks.iter().map(|LevelTask { active, .. }| active.rows * active.columns).sum();
        let threads = if nodes > NODES_PER_THREAD { rayon::current_num_threads() } else { 1 };
        let earlier = self.passes.back().map(|pass| &**pass);
        let pass = Arc::new(Pass::new(Arc::clone(&self.domain), base, tasks, self.lag, threads, earlier));
        self.queue.is_over.store(false, Ordering::Relaxed);
        self.queue.add(&pass);
        while self.queue.helpers.load(Ordering::SeqCst) + 1 < threads {
            self.queue.helpers.fetch_add(1, Ordering::SeqCst);
            let queue = Arc::clone(&self.queue);
            rayon::spawn(move || queue.help());
        }
        if threads > 1 && pass.tile_rows() > 0 {
            self.share = self.queue.do_share(&pass, self.share);
        } else {
            while self.queue.work() {}
        }
        wait_until(|| pass.is_done(0));
        self.passes.push_back(pass);
    }

    /// Waits until all passes are over.
    pub fn settle(&mut self) {
        self.queue.is_over.store(true, Ordering::Relaxed);
        while self.queue.work() {}
        for pass in &self.passes {
            wait_until(|| pass.is_over());
        }
    }

    /// The next pass that has ended, in order, if it has.
    pub fn ended(&mut self) -> Option<Ended> {
        self.passes.front().filter(|pass| pass.is_over())?;
        let pass = self.passes.pop_front()?;
        Some(Ended { level: pass.last_level(), peaks: pass.peaks() })
    }
}
