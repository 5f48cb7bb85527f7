//! How passes are handed over between the thread of the run and its helpers.
//!
//! The thread of the run ends a lag by handing over a pass, does the first tile rows of it itself (the band needs those
//! rows), and continues with the band, the contact and the recording; helpers in the pool take the other tile rows, in order,
//! pass after pass. So no thread waits for a whole pass, what one thread has to do alone is done while the others have
//! work, and threads that lose their core for a while seldom hold up the others.
//!
//! How many tile rows the thread of the run takes settles by itself: one more in the next pass when it had to do what helpers
//! had not begun, one less when helpers had nothing else to do. So tile rows stay with the same thread, and with the caches
//! of its core: it can take longer to fetch them from another core than to compute them.
//!
//! What is begun by whom, and which helpers are awake, is decided under one lock; that a tile is done is said by a release in
//! [`Order`]. Nothing else carries an order between threads.

use std::{collections::VecDeque, sync::Arc};

use super::sync::{AtomicBool, AtomicUsize, Mutex, MutexGuard, Ordering, PoisonError, spin_loop, yield_now};

/// How far the tile rows of a pass are: the number of column bands that each has done.
struct Progress {
    bands: usize,
    done: Vec<AtomicUsize>,
}

impl Progress {
    /// Number of bands that a tile row has done; what was done in them has happened before.
    fn bands_done(&self, tile_row: usize) -> usize {
        // with the release in `Order::advance`: all that was written to a band is visible to every thread that sees the band done
        self.done[tile_row].load(Ordering::Acquire)
    }

    /// True if all bands of a tile row are done, or there is no such tile row.
    fn is_done(&self, tile_row: usize) -> bool {
        tile_row >= self.done.len() || self.bands_done(tile_row) == self.bands
    }
}

/// Waits for something another thread is about to do: it needs microseconds, unless it has lost its core.
pub fn wait_until(happened: impl Fn() -> bool) {
    // an interpreter runs one thread at a time
    let mut patience = if cfg!(miri) { 1 } else { 1000 };
    while !happened() {
        if patience > 0 {
            patience -= 1;
            spin_loop();
        } else {
            yield_now();
        }
    }
}

/// The order of the tiles of a pass: behind the tiles above and to the left, and behind the pass before.
pub struct Order {
    progress: Arc<Progress>,
    /// The pass before, if it may still be under way.
    earlier: Option<Arc<Progress>>,
}

impl Order {
    /// A pass that has not begun.
    ///
    /// * `bands`: of every tile row
    /// * `earlier`: the pass before, if it may still be under way
    pub fn new(tile_rows: usize, bands: usize, earlier: Option<&Self>) -> Self {
        let done = (0..tile_rows).map(|_| AtomicUsize::new(0)).collect();
        Self {
            progress: Arc::new(Progress { bands, done }),
            earlier: earlier.map(|earlier| Arc::clone(&earlier.progress)),
        }
    }

    /// Number of tile rows; they must be begun in order, by any threads.
    pub fn tile_rows(&self) -> usize {
        self.progress.done.len()
    }

    /// True if a tile row is done, or there is none; what was done has happened before.
    pub fn is_done(&self, tile_row: usize) -> bool {
        self.progress.is_done(tile_row)
    }

    /// True if all tile rows are done; all that was computed and sampled has happened before.
    pub fn is_over(&self) -> bool {
        (0..self.tile_rows()).all(|tile_row| self.is_done(tile_row))
    }

    /// True if the pass before is past a tile row: done with it and the one below.
    pub fn may_begin(&self, tile_row: usize) -> bool {
        self.earlier.as_ref().is_none_or(|earlier| {
            let below = (tile_row + 1).min(earlier.done.len().saturating_sub(1));
            earlier.is_done(below)
        })
    }

    /// Does the bands of a tile row from left to right, behind the pass before and the tile row above.
    ///
    /// * `tile`: does the tile of a band
    pub fn advance(&self, tile_row: usize, tile: impl Fn(usize)) {
        let progress = &*self.progress;
        wait_until(|| self.may_begin(tile_row));
        for band in 0..progress.bands {
            if let Some(above) = tile_row.checked_sub(1) {
                wait_until(|| progress.bands_done(above) > band);
            }
            tile(band);
            progress.done[tile_row].store(band + 1, Ordering::Release);
        }
    }
}

/// How often a helper looks for work before it goes to sleep. Interpreters and models look at every pause.
const PATIENCE: usize = if cfg!(loom) {
    1
} else if cfg!(miri) {
    20
} else {
    20_000
};

/// Work that is done tile row by tile row.
pub trait TileRows: Send + Sync + 'static {
    /// The order of its tiles.
    fn order(&self) -> &Order;

    /// Does a tile row. Those above have been begun, and so have all of the pass before, or it may begin.
    fn advance(&self, tile_row: usize);
}

/// Tile rows that no thread has begun, and who may begin them.
struct State<P> {
    /// Passes with the next tile row of each, in the order in which they must be begun.
    passes: VecDeque<(Arc<P>, usize)>,
    /// Number of helpers that are awake: each looks at `passes` once more before it goes to sleep.
    helpers: usize,
}

/// What the thread of the run and its helpers share.
struct Queue<P> {
    state: Mutex<State<P>>,
    /// Number of tile rows that no thread has begun. A hint, for helpers that look for work without the lock; written under it.
    waiting: AtomicUsize,
    /// True if the next pass is far: the pool has other work to do. A hint.
    is_resting: AtomicBool,
}

impl<P: TileRows> Queue<P> {
    fn new() -> Self {
        Self {
            state: Mutex::new(State { passes: VecDeque::new(), helpers: 0 }),
            waiting: AtomicUsize::new(0),
            is_resting: AtomicBool::new(false),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State<P>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds all tile rows of a pass, for `threads` threads. Returns the number of helpers to be woken for it, which count as awake.
    fn add(&self, pass: &Arc<P>, threads: usize) -> usize {
        let tile_rows = pass.order().tile_rows();
        if tile_rows == 0 {
            return 0;
        }
        let mut state = self.lock();
        state.passes.push_back((Arc::clone(pass), 0));
        // relaxed, here and below: a helper that misses it sees the pass under the lock before it goes to sleep
        self.waiting.fetch_add(tile_rows, Ordering::Relaxed);
        let missing = threads.saturating_sub(1 + state.helpers);
        state.helpers += missing;
        missing
    }

    /// Does the next tile row; false if there is none.
    fn work(&self) -> bool {
        let state = self.lock();
        if state.passes.is_empty() {
            return false;
        }
        self.take(state, 0);
        true
    }

    /// Does the next tile row of pass number `place`. Those that it waits for must be done or begun: they are if that pass is
    /// the first, or if the tile row may begin.
    fn take(&self, mut state: MutexGuard<'_, State<P>>, place: usize) {
        let (pass, next) = &mut state.passes[place];
        let (pass, tile_row) = (Arc::clone(pass), *next);
        *next += 1;
        if *next == pass.order().tile_rows() {
            state.passes.remove(place);
        }
        self.waiting.fetch_sub(1, Ordering::Relaxed);
        drop(state);
        pass.advance(tile_row);
    }

    /// Does the first `share` tile rows of the newest pass, as far as no helper has begun them, and what has to be done
    /// before them.
    ///
    /// Returns the share of the next pass.
    fn do_share(&self, pass: &Arc<P>, share: usize) -> usize {
        let share = share.clamp(1, pass.order().tile_rows());
        let (mut own, mut others) = (0, 0);
        loop {
            let state = self.lock();
            let newest = state.passes.back().filter(|(newest, _)| Arc::ptr_eq(newest, pass));
            let Some(next) = newest.map(|(_, next)| *next).filter(|next| *next < share) else { break };
            if pass.order().may_begin(next) {
                own += 1;
                let place = state.passes.len() - 1;
                self.take(state, place);
            } else if state.passes.len() > 1 {
                others += 1;
                self.take(state, 0);
            } else {
                drop(state);
                wait_until(|| pass.order().may_begin(next));
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
            while patience > 0 && self.waiting.load(Ordering::Relaxed) == 0 {
                spin_loop();
                // relaxed: it only says whether to look again, before the look under the lock
                patience = if self.is_resting.load(Ordering::Relaxed) { 0 } else { patience - 1 };
            }
            if patience == 0 {
                // a pass is either added before this, and found, or after it, and wakes a helper
                let mut state = self.lock();
                if state.passes.is_empty() {
                    state.helpers -= 1;
                    return;
                }
            }
        }
    }
}

/// A helper that is to be woken: it counts as awake, so it must run.
pub struct Helper<P>(Arc<Queue<P>>);

impl<P: TileRows> Helper<P> {
    /// Takes part in passes until there has been nothing to do for a while.
    pub fn help(self) {
        self.0.help();
    }
}

/// Passes that follow each other, handed over to helpers.
pub struct HandOver<P> {
    queue: Arc<Queue<P>>,
    /// Passes that may be under way, the oldest first.
    passes: VecDeque<Arc<P>>,
    /// Tile rows of a pass that the thread of the run does itself.
    share: usize,
}

impl<P: TileRows> HandOver<P> {
    /// Nothing is under way.
    pub fn new() -> Self {
        Self { queue: Arc::new(Queue::new()), passes: VecDeque::new(), share: 1 }
    }

    /// The newest pass, if any is kept.
    pub fn newest(&self) -> Option<&P> {
        self.passes.back().map(|pass| &**pass)
    }

    /// True if no pass is under way.
    pub fn is_empty(&self) -> bool {
        self.passes.is_empty()
    }

    /// Number of passes that are kept, because they are under way or have not been asked for.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.passes.len()
    }

    /// Begins a pass, which knows [`HandOver::newest`] as the one before. When this returns its first tile row is done.
    ///
    /// * `threads`: that are to work on it, this one among them
    /// * `wake`: makes a thread do [`Helper::help`]
    pub fn follow(&mut self, pass: P, threads: usize, wake: impl Fn(Helper<P>)) {
        let pass = Arc::new(pass);
        // relaxed: a hint
        self.queue.is_resting.store(false, Ordering::Relaxed);
        for _ in 0..self.queue.add(&pass, threads) {
            wake(Helper(Arc::clone(&self.queue)));
        }
        if threads > 1 && pass.order().tile_rows() > 0 {
            self.share = self.queue.do_share(&pass, self.share);
        } else {
            while self.queue.work() {}
        }
        wait_until(|| pass.order().is_done(0));
        self.passes.push_back(pass);
    }

    /// Waits until all passes are over.
    pub fn settle(&mut self) {
        // relaxed: a hint
        self.queue.is_resting.store(true, Ordering::Relaxed);
        while self.queue.work() {}
        for pass in &self.passes {
            wait_until(|| pass.order().is_over());
        }
    }

    /// The next pass that has ended, in order, if it has; all that was done in it has happened before.
    pub fn ended(&mut self) -> Option<Arc<P>> {
        self.passes.front().filter(|pass| pass.order().is_over())?;
        self.passes.pop_front()
    }
}
