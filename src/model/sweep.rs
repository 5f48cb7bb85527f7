//! The interior behind the surface, advanced many steps at a time.
//!
//! Contact couples the whole surface in every step; the interior is not coupled to anything but its neighbours. So a
//! strip of rows under the surface goes step by step, one row less each time, and the rows below follow later, many
//! levels in one pass through memory. They are cut into blocks of rows and strips of columns; a tile is one block of
//! one strip, and every level of a tile is shifted by one row and one vector of columns towards the origin:
//!
//! ```text
//!  rows of a tile at levels t = 1, 2, 3      level t needs level t−1 one node around it: the shift
//!    ·  ·  3                                 leaves behind just that much of the tile above and of
//!    ·  2  3                                 the tile to the left, and has not touched what the tiles
//!    1  2  3                                 below and to the right still need. Both levels of the
//!    1  2  ·                                 field are therefore updated in place.
//! ```
//!
//! Tile `(p, s)` (block p, strip s) needs `(p', s')` for all `p' ≤ p`, `s' ≤ s`. A thread takes a block, does its strips
//! from left to right, and stays behind the thread of the block above. A sweep may begin while the one before it is under
//! way ([`super::interior`]): blocks are the same rows in both, and a block of the later one begins when the block below
//! it, and so all that are above, is done in the earlier one.
//! The numbers do not depend on who does what: every node is computed once per level, from the same neighbours, by the
//! same operations.

use std::{
    ops::Range,
    sync::{
        Arc, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use super::{
    lanes::{Lanes, PACK},
    levels::Levels,
    stencil::Patch,
    survey::Survey,
};

/// Largest number of levels that the interior may lag behind the surface.
pub const MAX_LAG: usize = 32;

/// Number of levels that the interior may lag behind the surface over `nz` rows: the more, the less often memory is gone
/// through; but the strip under the surface, which one thread does, should stay a small part of the whole.
pub fn lag(nz: usize) -> usize {
    (nz / 16).clamp(8, MAX_LAG)
}

/// Rows of the strip under the surface: rows 0 and 1 must be up to date when the interior lags by `lag`.
pub fn strip_rows(lag: usize) -> usize {
    lag + 2
}

/// Rows and columns of a tile: one level of it is two arrays of 96 KiB that stream from the second cache row after row, and
/// what the next levels add to them fits in there too. Half as many rows or columns cost some percent.
const TILE_ROWS: usize = MAX_LAG;
const TILE_COLUMNS: usize = 48 * PACK;

/// Fewest columns of a tile, where a mesh is so narrow that threads would wait for each other.
const NARROW_COLUMNS: usize = 8 * PACK;

// or blocks would meet those of the sweep before, see `Sweep::tile`
const _: () = assert!(TILE_ROWS >= MAX_LAG);

/// What the levels of a sweep look like.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lit {
    /// Rows that may differ from 0 and are still of use.
    pub rows: usize,
    /// Columns that may differ from 0, a whole number of packs.
    pub columns: usize,
}

/// Largest |u| in the row before the backing, with its level and column: where there are several, the earliest and
/// innermost.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowPeak {
    /// |u| \[R\].
    pub value: f64,
    /// Level.
    pub level: usize,
    /// Column.
    pub column: usize,
}

impl RowPeak {
    /// The larger of two peaks.
    pub fn larger(self, other: Self) -> Self {
        let earlier = (other.level, other.column) < (self.level, self.column);
        if other.value > self.value || (other.value == self.value && earlier) { other } else { self }
    }

    /// The larger of this peak and a value elsewhere.
    pub fn with(self, value: f64, level: usize, column: usize) -> Self {
        self.larger(Self { value: value.abs(), level, column })
    }
}

/// A level of a sweep.
#[derive(Clone, Default)]
pub struct Stage {
    /// What of it is to be computed.
    pub lit: Lit,
    /// What is to be taken down on the way to it.
    pub survey: Option<Arc<Survey>>,
}

/// What the contact has settled for row 0.
#[derive(Clone, Copy)]
pub struct Top<'a> {
    /// Displacement at the level to come, out to the last column that has moved.
    pub displacement: &'a [f64],
    /// What that would be without the contact.
    pub free: &'a [f64],
    /// Pressure on the way to it.
    pub pressure: &'a [f64],
}

/// What all sweeps work on.
pub struct Ground {
    /// The field.
    pub levels: Levels,
    /// Distance of rows \[R\].
    pub dz: f64,
    /// Time of a step \[R/c_p\].
    pub dt: f64,
    /// Cell areas by column, for whole packs.
    pub area: Vec<f64>,
    /// Radial weights times λ²/4 towards larger radii, by column, for whole packs.
    pub outward: Vec<f64>,
    /// Radial weights times λ²/4 towards smaller radii, by column, for whole packs.
    pub inward: Vec<f64>,
    /// Levels that the interior may lag behind the surface.
    pub lag: usize,
    /// Row before the backing.
    pub last_row: usize,
    /// Instructions to use.
    pub lanes: Lanes,
}

impl Ground {
    /// The step to `level`.
    fn patch(&self, level: usize) -> Patch<'_> {
        Patch {
            now: self.levels.origin(level - 1),
            next: self.levels.origin(level),
            stride: self.levels.stride(),
            outward: &self.outward,
            inward: &self.inward,
        }
    }

    /// Advances `rows` of `columns`, whole vectors, to `level`.
    ///
    /// * `survey`: what is taken down on the way
    /// * `top`: row 0, if it is among the rows
    ///
    /// # Safety
    ///
    /// The nodes hold the two levels before, as does a row and a vector around them; nobody else touches the nodes or
    /// writes to those around them.
    #[expect(unsafe_code, reason = "one way for strip and interior")]
    pub unsafe fn advance(
        &self,
        level: usize,
        rows: Range<usize>,
        columns: Range<usize>,
        survey: Option<&Survey>,
        top: Option<Top<'_>>,
    ) {
        assert!(rows.end < self.levels.rows() && columns.end <= self.levels.columns());
        // SAFETY: rows and columns lie inside the arrays with a row and a pack around them, as has just been checked; the
        // caller answers for the rest
        unsafe {
            let before = survey.map(|survey| survey.before(self, rows.clone(), columns.clone(), top));
            let mut inner = rows.clone();
            if let Some(Top { displacement, .. }) = top {
                self.levels.row_mut(level, 0)[..displacement.len()].copy_from_slice(displacement);
                inner.start = 1;
            }
            let patch = self.patch(level);
            if let (Some(survey), Some(before)) = (survey, before) {
                let tallies = survey.tallies(inner.clone());
                self.lanes.advance_and_count(patch, inner, columns.clone(), &self.area, tallies);
                survey.after(self, rows, columns, before, top);
            } else {
                self.lanes.advance(patch, inner, columns);
            }
        }
    }
}

/// How far the blocks of a sweep are: the number of strips that each has done.
struct Progress {
    strips: usize,
    done: Vec<AtomicUsize>,
}

impl Progress {
    /// True if all strips of a block are done.
    fn is_done(&self, block: usize) -> bool {
        self.done.get(block).is_none_or(|done| done.load(Ordering::Acquire) == self.strips)
    }
}

/// Waits for something another thread is about to do: it needs microseconds; but it may have lost its core.
pub fn wait_until(happened: impl Fn() -> bool) {
    let mut patience = 0;
    while !happened() {
        patience += 1;
        if patience < 1000 { std::hint::spin_loop() } else { std::thread::yield_now() }
    }
}

/// One pass over the interior.
pub struct Sweep {
    ground: Arc<Ground>,
    /// Level of the interior.
    base: usize,
    /// Levels to do, from `base + 1` on.
    stages: Vec<Stage>,
    /// Columns of a tile.
    tile_columns: usize,
    progress: Arc<Progress>,
    /// The sweep before this one.
    earlier: Option<Arc<Progress>>,
    /// Peaks of the row before the backing: of all levels but the last, and of the last.
    peaks: Mutex<[RowPeak; 2]>,
}

impl Sweep {
    /// A sweep from level `base` over `stages.len()` levels, at most `lag`, that many threads will work on.
    ///
    /// When a block is begun, the strip under the surface must be up to date.
    ///
    /// * `earlier`: the sweep before, if it may still be under way
    pub fn new(
        ground: Arc<Ground>,
        base: usize,
        stages: Vec<Stage>,
        threads: usize,
        earlier: Option<&Self>,
    ) -> Self {
        let lag = stages.len();
        assert!(lag <= ground.lag, "the strip is not deep enough");
        let rows = stages.iter().map(|stage| stage.lit.rows).max().unwrap_or(0);
        let columns = stages.iter().map(|stage| stage.lit.columns).max().unwrap_or(0);
        assert!(rows < ground.levels.rows() && columns <= ground.levels.columns());
        let blocks = (rows + lag).saturating_sub(strip_rows(ground.lag)).div_ceil(TILE_ROWS);
        // a strip for every thread at least
        let tile_columns =
            columns.div_ceil(threads).next_multiple_of(PACK).clamp(NARROW_COLUMNS, TILE_COLUMNS);
        let strips = (columns + lag.saturating_sub(1) * ground.lanes.width()).div_ceil(tile_columns);
        let done = (0..blocks).map(|_| AtomicUsize::new(0)).collect();
        Self {
            ground,
            base,
            stages,
            tile_columns,
            progress: Arc::new(Progress { strips, done }),
            earlier: earlier.map(|sweep| Arc::clone(&sweep.progress)),
            peaks: Mutex::default(),
        }
    }

    /// Number of blocks; they must be begun in order, by whoever.
    pub fn blocks(&self) -> usize {
        self.progress.done.len()
    }

    /// True if a block is done, or there is none.
    pub fn is_done(&self, block: usize) -> bool {
        self.progress.is_done(block)
    }

    /// True if all blocks are done.
    pub fn is_over(&self) -> bool {
        (0..self.blocks()).all(|block| self.is_done(block))
    }

    /// True if the sweep before is past a block.
    pub fn may_begin(&self, block: usize) -> bool {
        self.earlier.as_ref().is_none_or(|earlier| {
            let below = (block + 1).min(earlier.done.len().saturating_sub(1));
            earlier.is_done(below)
        })
    }

    /// Peaks of the row before the backing, of all levels but the last one, and of the last one, once all blocks are done.
    pub fn peaks(&self) -> [RowPeak; 2] {
        *self.peaks.lock().expect("no thread panics while it holds the lock")
    }

    /// Does the strips of a block from left to right, behind the block above.
    pub fn advance(&self, block: usize) {
        let Progress { strips, done } = &*self.progress;
        wait_until(|| self.may_begin(block));
        for strip in 0..*strips {
            if let Some(above) = block.checked_sub(1) {
                wait_until(|| done[above].load(Ordering::Acquire) > strip);
            }
            self.tile(block, strip);
            done[block].store(strip + 1, Ordering::Release);
        }
    }

    /// All levels of a tile.
    fn tile(&self, block: usize, strip: usize) {
        let ground = &*self.ground;
        for (t, Stage { lit, survey }) in (1..).zip(&self.stages) {
            let first = strip_rows(ground.lag) + block * TILE_ROWS - t;
            let rows = first..(first + TILE_ROWS).min(lit.rows);
            let shift = (t - 1) * ground.lanes.width();
            let columns = (strip * self.tile_columns).saturating_sub(shift)
                ..((strip + 1) * self.tile_columns).saturating_sub(shift).min(lit.columns);
            if rows.is_empty() || columns.is_empty() {
                continue;
            }
            let has_last = rows.contains(&ground.last_row);
            // SAFETY: rows lie in 1 ≤ j ≤ nz − 1 and columns in 0 ≤ i < nr (`lit` stays below both), so with a row and
            // a pack around them they are inside the arrays. No other thread writes to what is read here or touches
            // what is written here:
            // - in this sweep, the nodes of a tile at level t are read by tiles to the right and below at level t + 1,
            //   which start after this one has ended; those of level t − 1 around this tile were written by tiles above
            //   and to the left, which have ended, and are overwritten at level t + 1 only by tiles that are shifted
            //   one row and one vector farther, which is past them;
            // - a survey reads what the step reads, of level t − 1, and the nodes themselves; and all tiles that survey a
            //   row at one level belong to one block;
            // - in the sweep before, this block, those above and the one below are done. If that one's rows begin at
            //   row f before any shift, this block writes up to row f − 2 and reads up to f − 1; what is farther down
            //   begins TILE_ROWS ≥ lag rows below f and is shifted up by a lag at most: it writes from f on and reads
            //   from f − 1 on;
            // - the strip under the surface goes on when the first block is done, writes up to row `lag` and reads one
            //   row more; the second block begins at row `lag + 2 + TILE_ROWS` before any shift, so it writes from
            //   `lag + 2` on and reads from `lag + 1` on.
            #[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
            unsafe {
                ground.advance(self.base + t, rows, columns.clone(), survey.as_deref(), None);
                if has_last {
                    let row = &ground.levels.row(self.base + t, ground.last_row)[columns.clone()];
                    self.note_peak(row, t, columns.start);
                }
            }
        }
    }

    /// Takes note of the row before the backing, part of which from column `first` on has just been advanced to level t.
    fn note_peak(&self, row: &[f64], t: usize, first: usize) {
        let largest = row.chunks_exact(PACK).fold([0.0; PACK], |mut largest: [f64; PACK], pack| {
            for (a, b) in largest.iter_mut().zip(pack) {
                *a = if b.abs() > *a { b.abs() } else { *a };
            }
            largest
        });
        let largest = largest.into_iter().fold(0.0, f64::max);
        let mut peaks = self.peaks.lock().expect("no thread panics while it holds the lock");
        let peak = &mut peaks[usize::from(t == self.stages.len())];
        if largest >= peak.value
            && let Some(place) = row.iter().position(|u| u.abs() == largest)
        {
            *peak = peak.with(largest, self.base + t, first + place);
        }
    }
}
