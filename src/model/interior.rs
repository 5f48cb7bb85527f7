//! The interior at work: sweeps that go on while the strip under the surface is already ahead.
//!
//! The thread of the run ends a lag by handing over a sweep, does the first blocks of it itself (the strip needs those
//! rows), and goes on with the strip, the contact and the recording; helpers in the pool take the other blocks, in order,
//! sweep after sweep. So nobody waits for a whole sweep, what one thread has to do alone is done while the others have
//! work, and threads that lose their core for a while seldom hold up the others.
//!
//! How many blocks the thread of the run takes settles by itself: one more in the next sweep when it had to do what helpers
//! had not begun, one less when helpers had nothing else to do. So blocks stay with whom they were with, and with the caches
//! of its core: it can take longer to fetch them from another core than to compute them.

use std::{
    collections::VecDeque,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
};

use ndarray::ArrayView2;

use super::{
    levels::Levels,
    sweep::{Ground, RowPeak, Stage, Sweep, Top, strip_rows, wait_until},
};

/// Nodes in a sweep below which a second thread is not worth waking.
const NODES_PER_THREAD: usize = 100_000;

/// How often a helper looks for work before it goes to sleep.
const PATIENCE: usize = 20_000;

/// Blocks that nobody has begun, in the order in which they must be.
#[derive(Default)]
struct Queue {
    /// Sweeps with the next block of each.
    sweeps: Mutex<VecDeque<(Arc<Sweep>, usize)>>,
    /// Number of blocks.
    waiting: AtomicUsize,
    /// Number of helpers that are awake.
    helpers: AtomicUsize,
    /// True if the next sweep is far: the pool is wanted for other things.
    is_over: AtomicBool,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, VecDeque<(Arc<Sweep>, usize)>> {
        self.sweeps.lock().expect("no thread panics while it holds the lock")
    }

    /// Adds all blocks of a sweep.
    fn add(&self, sweep: &Arc<Sweep>) {
        if sweep.blocks() > 0 {
            self.lock().push_back((Arc::clone(sweep), 0));
            self.waiting.fetch_add(sweep.blocks(), Ordering::SeqCst);
        }
    }

    /// Does the next block; false if there is none.
    fn work(&self) -> bool {
        let sweeps = self.lock();
        if sweeps.is_empty() {
            return false;
        }
        self.take(sweeps, 0);
        true
    }

    /// Does the next block of sweep number `place`. Those that it waits for must be done or in somebody's hands: they are if
    /// that sweep is the first, or if it may begin.
    fn take(&self, mut sweeps: MutexGuard<'_, VecDeque<(Arc<Sweep>, usize)>>, place: usize) {
        let (sweep, next) = &mut sweeps[place];
        let (sweep, block) = (Arc::clone(sweep), *next);
        *next += 1;
        if *next == sweep.blocks() {
            sweeps.remove(place);
        }
        self.waiting.fetch_sub(1, Ordering::SeqCst);
        drop(sweeps);
        sweep.advance(block);
    }

    /// Does the first `share` blocks of the newest sweep, as far as nobody else has begun them, and whatever has to be done
    /// before them.
    ///
    /// Returns the share of the next sweep.
    fn do_share(&self, sweep: &Arc<Sweep>, share: usize) -> usize {
        let share = share.clamp(1, sweep.blocks());
        let (mut own, mut others) = (0, 0);
        loop {
            let sweeps = self.lock();
            let newest = sweeps.back().filter(|(newest, _)| Arc::ptr_eq(newest, sweep));
            let Some(next) = newest.map(|(_, next)| *next).filter(|next| *next < share) else { break };
            if sweep.may_begin(next) {
                own += 1;
                let place = sweeps.len() - 1;
                self.take(sweeps, place);
            } else if sweeps.len() > 1 {
                others += 1;
                self.take(sweeps, 0);
            } else {
                drop(sweeps);
                wait_until(|| sweep.may_begin(next));
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
                // who has come in the meantime found a helper awake and woke none
                if self.waiting.load(Ordering::SeqCst) == 0 {
                    return;
                }
                self.helpers.fetch_add(1, Ordering::SeqCst);
            }
        }
    }
}

/// A field whose interior follows behind its surface.
pub struct Interior {
    ground: Arc<Ground>,
    queue: Arc<Queue>,
    /// Sweeps that may be under way, the oldest first.
    sweeps: VecDeque<Arc<Sweep>>,
    /// Rows that have been written to.
    opened: usize,
    /// Blocks of a sweep that the thread of the run does itself.
    share: usize,
}

#[expect(unsafe_code, reason = "sweeps work on the field in place")]
impl Interior {
    /// A field at rest.
    pub fn new(ground: Ground) -> Self {
        Self { ground: Arc::new(ground), queue: Arc::default(), sweeps: VecDeque::new(), opened: 0, share: 1 }
    }

    /// What the field consists of.
    pub fn ground(&self) -> &Ground {
        &self.ground
    }

    fn levels(&self) -> &Levels {
        &self.ground.levels
    }

    /// True if no sweep is under way.
    pub fn is_settled(&self) -> bool {
        self.sweeps.is_empty()
    }

    /// Panics if a sweep may be writing to row `j`.
    fn check(&self, j: usize) {
        assert!(
            self.is_settled() || j + 1 < strip_rows(self.ground.lag),
            "row {j} while the interior is being advanced"
        );
    }

    /// Row `j` at a level, with a zero at its end; one of the strip, if the interior is not settled.
    pub fn row(&self, level: usize, j: usize) -> &[f64] {
        self.check(j);
        // SAFETY: sweeps are begun by `&mut self`; those under way do not come up to the strip
        unsafe { self.levels().row(level, j) }
    }

    /// A level, shape `(rows, columns + 1)`, of a settled interior.
    pub fn level(&self, level: usize) -> ArrayView2<'_, f64> {
        assert!(self.is_settled(), "a level while the interior is being advanced");
        // SAFETY: sweeps are begun by `&mut self`, and none is under way
        unsafe { self.levels().level(level) }
    }

    /// Makes sure that `rows` rows are memory.
    pub fn open(&mut self, rows: usize) {
        let rows = rows.min(self.levels().rows());
        if rows > self.opened {
            // SAFETY: sweeps under way know of no row that has not been opened before they began
            unsafe { self.levels().open(self.opened, rows - self.opened) };
            self.opened = rows;
        }
    }

    /// Advances the surface and the strip under it to `level`: row 0 as the contact has settled it, and as many rows as are
    /// not left to the sweeps.
    ///
    /// * `rows`: of the strip, with row 0
    pub fn advance_strip(&mut self, level: usize, rows: usize, stage: &Stage, top: Top<'_>) {
        self.check(rows.saturating_sub(1));
        let Stage { lit, survey } = stage;
        // SAFETY: sweeps under way stay below the strip, and nobody else holds a row
        unsafe {
            self.ground.advance(level, 0..rows.min(lit.rows), 0..lit.columns, survey.as_deref(), Some(top))
        }
    }

    /// Begins a sweep over `stages.len()` levels from level `base` on. When this returns the strip can go on.
    ///
    /// Returns peaks of the row before the backing of sweeps that have ended, see [`Sweep::peaks`].
    pub fn follow(&mut self, base: usize, stages: Vec<Stage>) -> Vec<[RowPeak; 2]> {
        let nodes: usize = stages.iter().map(|Stage { lit, .. }| lit.rows * lit.columns).sum();
        let threads = if nodes > NODES_PER_THREAD { rayon::current_num_threads() } else { 1 };
        let earlier = self.sweeps.back().map(|sweep| &**sweep);
        let sweep = Arc::new(Sweep::new(Arc::clone(&self.ground), base, stages, threads, earlier));
        self.queue.is_over.store(false, Ordering::Relaxed);
        self.queue.add(&sweep);
        while self.queue.helpers.load(Ordering::SeqCst) + 1 < threads {
            self.queue.helpers.fetch_add(1, Ordering::SeqCst);
            let queue = Arc::clone(&self.queue);
            rayon::spawn(move || queue.help());
        }
        if threads > 1 && sweep.blocks() > 0 {
            self.share = self.queue.do_share(&sweep, self.share);
        } else {
            while self.queue.work() {}
        }
        wait_until(|| sweep.is_done(0));
        self.sweeps.push_back(sweep);
        self.retire()
    }

    /// Ends all sweeps; returns peaks as [`Interior::follow`] does.
    pub fn settle(&mut self) -> Vec<[RowPeak; 2]> {
        self.queue.is_over.store(true, Ordering::Relaxed);
        while self.queue.work() {}
        for sweep in &self.sweeps {
            wait_until(|| sweep.is_over());
        }
        self.retire()
    }

    /// Lets go of sweeps that have ended.
    fn retire(&mut self) -> Vec<[RowPeak; 2]> {
        let mut peaks = Vec::new();
        while let Some(sweep) = self.sweeps.front()
            && sweep.is_over()
        {
            peaks.push(sweep.peaks());
            self.sweeps.pop_front();
        }
        peaks
    }
}
