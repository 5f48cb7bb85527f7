//! Order among the tiles of passes: how far tile rows are, and what waits for what.

use std::sync::Arc;

use super::sync::{AtomicUsize, Ordering, spin_loop, yield_now};

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
