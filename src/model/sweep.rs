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
//! Tile `(p, s)` (block p, strip s) needs `(p', s')` for all `p' ≤ p`, `s' ≤ s`. A thread takes a group of blocks, does
//! its strips from left to right and the blocks of a strip downwards, and stays behind the thread of the group above.
//! The numbers do not depend on who does what: every node is computed once per level, from the same neighbours, by the
//! same operations.

use std::{
    ops::Range,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use ndarray::{ArrayView2, s};

use super::{
    lanes::{Lanes, PACK},
    stencil::Patch,
};

/// Largest number of levels that the interior may lag behind the surface.
pub const MAX_LAG: usize = 24;

/// Number of levels that the interior may lag behind the surface over `nz` rows: the more, the less often memory is gone
/// through; but the strip under the surface, which one thread does, should stay a small part of the whole.
pub fn lag(nz: usize) -> usize {
    (nz / 20).clamp(8, MAX_LAG)
}

/// Rows of the strip under the surface: rows 0 and 1 must be up to date when the interior lags by `lag`.
pub fn strip_rows(lag: usize) -> usize {
    lag + 2
}

/// Rows and columns of a tile: one level of it, `16·256` nodes at two levels, is 64 KiB that stream from the second cache
/// row after row. Tiles of 8 to 24 rows and 128 to 512 columns are within some percent of each other.
const TILE_ROWS: usize = 16;
const TILE_COLUMNS: usize = 32 * PACK;

/// Fewest columns of a tile, where a mesh is so narrow that threads would wait for each other.
const NARROW_COLUMNS: usize = 8 * PACK;

/// Strips that a mesh should have for every thread.
const STRIPS_PER_THREAD: usize = 8;

/// Blocks of a group, about: with its shift, one strip of it fits into the second cache. What a thread takes up after
/// another one comes from farther away.
const GROUP_BLOCKS: usize = 4;

/// Nodes in a sweep below which a second thread is not worth waking.
const NODES_PER_THREAD: usize = 100_000;

/// Numbers in a line of the cache.
const LINE: usize = 8;

/// Two levels of a field, row by row. Level k is in the array `k % 2`. Every row has a pack of zeros before its first
/// column and after its last one, and begins at a line of the cache.
pub struct Levels {
    arrays: [Vec<f64>; 2],
    /// Number that each array begins with.
    start: [usize; 2],
    rows: usize,
    columns: usize,
    stride: usize,
    /// Rows that have been written to.
    opened: usize,
}

impl Levels {
    /// A field at rest.
    pub fn new(rows: usize, columns: usize) -> Self {
        let columns = columns.next_multiple_of(PACK);
        // rows that are a multiple of 4 KiB apart would share the same sets of the first cache: an odd number of lines
        let lines = (columns + 2 * PACK).div_ceil(LINE) | 1;
        let stride = lines * LINE;
        // zeros that nobody has touched take no memory
        let arrays = [vec![0.0; rows * stride + LINE], vec![0.0; rows * stride + LINE]];
        let start =
            arrays.each_ref().map(|array| array.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE));
        Self { arrays, start, rows, columns, stride, opened: 0 }
    }

    /// Writes zeros to `rows` rows, if nobody has done so yet. Memory that is read before it is written to is given out
    /// twice by the system, and the second time all threads stop for it.
    pub fn open(&mut self, rows: usize) {
        let rows = rows.min(self.rows);
        if rows > self.opened {
            for (array, start) in self.arrays.iter_mut().zip(self.start) {
                array[start + self.opened * self.stride..][..(rows - self.opened) * self.stride].fill(0.0);
            }
            self.opened = rows;
        }
    }

    /// Number of columns, a whole number of packs.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// A level, shape `(rows, columns + 1)`: there is a column of zeros at the end.
    pub fn level(&self, level: usize) -> ArrayView2<'_, f64> {
        let array = &self.arrays[level % 2][self.start[level % 2]..][..self.rows * self.stride];
        let whole =
            ArrayView2::from_shape((self.rows, self.stride), array).expect("an array is rows of a stride");
        whole.slice_move(s![.., PACK..PACK + self.columns + 1])
    }

    /// Row `j` at a level, with a zero at its end.
    pub fn row(&self, level: usize, j: usize) -> &[f64] {
        &self.arrays[level % 2][self.index(level, j)..][..self.columns + 1]
    }

    /// Row `j` at a level, to be changed.
    pub fn row_mut(&mut self, level: usize, j: usize) -> &mut [f64] {
        let index = self.index(level, j);
        &mut self.arrays[level % 2][index..][..self.columns]
    }

    /// Where row `j` begins.
    fn index(&self, level: usize, j: usize) -> usize {
        assert!(j < self.rows, "row {j} of {}", self.rows);
        self.start[level % 2] + j * self.stride + PACK
    }

    /// Nodes (0, 0) of level `level`, and of the level after or before it.
    fn origins(&mut self, level: usize) -> [*mut f64; 2] {
        let starts = [self.index(0, 0), self.index(1, 0)];
        // pointers into the whole arrays: the zeros before a row belong to what may be read
        let mut origin = |level: usize| self.arrays[level].as_mut_ptr().wrapping_add(starts[level]);
        let [even, odd] = [origin(0), origin(1)];
        if level.is_multiple_of(2) { [even, odd] } else { [odd, even] }
    }
}

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

/// Advances the strip under the surface to `level`, `rows` of it from row 1 on.
pub fn advance_strip(
    levels: &mut Levels,
    level: usize,
    weights: Weights<'_>,
    rows: usize,
    lit: Lit,
    lanes: Lanes,
) {
    let stride = levels.stride;
    let rows = 1..rows.min(lit.rows);
    assert!(rows.end < levels.rows && lit.columns <= levels.columns);
    let [next, now] = levels.origins(level);
    let patch = Patch { now, next, stride, outward: weights.outward, inward: weights.inward };
    // SAFETY: rows and columns lie inside the arrays with a row and a pack around them, as has just been checked; the
    // arrays are borrowed for this call alone
    #[expect(unsafe_code, reason = "one kernel for strip and interior")]
    unsafe {
        lanes.advance(patch, rows, 0..lit.columns);
    }
}

/// Radial weights times λ²/4, by column, for whole packs.
#[derive(Clone, Copy)]
pub struct Weights<'a> {
    /// Towards larger radii.
    pub outward: &'a [f64],
    /// Towards smaller radii.
    pub inward: &'a [f64],
}

/// One pass over the interior.
pub struct Sweep<'a> {
    /// The field: all rows at levels `base − 1` and `base`, those of the strip up to date.
    pub levels: &'a mut Levels,
    /// Radial weights.
    pub weights: Weights<'a>,
    /// Level of the interior.
    pub base: usize,
    /// Levels to do, from `base + 1` on; at most `lag`.
    pub lit: &'a [Lit],
    /// Levels that the interior may lag behind the surface.
    pub lag: usize,
    /// Row before the backing.
    pub last_row: usize,
    /// Instructions to use.
    pub lanes: Lanes,
}

/// A sweep as its threads see it.
struct Shared<'a> {
    /// Nodes (0, 0) of levels `base` and `base + 1`.
    origins: [*mut f64; 2],
    stride: usize,
    weights: Weights<'a>,
    base: usize,
    lit: &'a [Lit],
    last_row: usize,
    lanes: Lanes,
    /// Rows of the strip under the surface at the first level.
    strip_rows: usize,
    /// Columns of a tile.
    tile_columns: usize,
    strips: usize,
    blocks: usize,
    groups: usize,
    /// Number of strips of each group that are done.
    progress: Vec<AtomicUsize>,
    /// Peaks of the row before the backing: of all levels but the last, and of the last.
    peaks: Mutex<[RowPeak; 2]>,
}

// SAFETY: the arrays are only touched in `tile`, whose proof says why no two threads meet there.
#[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
unsafe impl Sync for Shared<'_> {}

impl Sweep<'_> {
    /// Brings the interior up to the last level; returns the peaks of the row before the backing, of all levels but the
    /// last one, and of the last one.
    pub fn run(self) -> [RowPeak; 2] {
        let lag = self.lit.len();
        assert!(lag <= self.lag, "the strip is not deep enough");
        let strip_rows = strip_rows(self.lag);
        let rows = self.lit.iter().map(|lit| lit.rows).max().unwrap_or(0);
        let columns = self.lit.iter().map(|lit| lit.columns).max().unwrap_or(0);
        let blocks = (rows + lag).saturating_sub(strip_rows).div_ceil(TILE_ROWS);
        let threads = if rows * columns * lag > NODES_PER_THREAD { rayon::current_num_threads() } else { 1 };
        // as many groups for one thread as for the other
        let groups = (blocks.div_ceil(GROUP_BLOCKS * threads) * threads).min(blocks);
        let tile_columns = if threads > 1 {
            columns
                .div_ceil(STRIPS_PER_THREAD * threads)
                .next_multiple_of(PACK)
                .clamp(NARROW_COLUMNS, TILE_COLUMNS)
        } else {
            TILE_COLUMNS
        };
        let strips = (columns + lag.saturating_sub(1) * self.lanes.width()).div_ceil(tile_columns);
        let stride = self.levels.stride;
        assert!(rows < self.levels.rows && columns <= self.levels.columns);
        let shared = Shared {
            origins: self.levels.origins(self.base),
            stride,
            weights: self.weights,
            base: self.base,
            lit: self.lit,
            last_row: self.last_row,
            lanes: self.lanes,
            strip_rows,
            tile_columns,
            strips,
            blocks,
            groups,
            progress: (0..groups).map(|_| AtomicUsize::new(0)).collect(),
            peaks: Mutex::default(),
        };
        let next = AtomicUsize::new(0);
        let work = || {
            // groups are taken in order, so the group above is done or in somebody's hands
            loop {
                let group = next.fetch_add(1, Ordering::Relaxed);
                if group >= groups {
                    return;
                }
                shared.group(group);
            }
        };
        if groups > 1 && threads > 1 {
            rayon::broadcast(|_| work());
        } else {
            work();
        }
        shared.peaks.into_inner().expect("no thread panics while it holds the lock")
    }
}

impl Shared<'_> {
    /// Does the strips of a group from left to right, behind the group above.
    fn group(&self, group: usize) {
        for strip in 0..self.strips {
            if let Some(above) = group.checked_sub(1) {
                let mut patience = 0;
                while self.progress[above].load(Ordering::Acquire) <= strip {
                    // the other thread needs microseconds; but it may have lost its core
                    patience += 1;
                    if patience < 1000 { std::hint::spin_loop() } else { std::thread::yield_now() }
                }
            }
            for block in group * self.blocks / self.groups..(group + 1) * self.blocks / self.groups {
                self.tile(block, strip);
            }
            self.progress[group].store(strip + 1, Ordering::Release);
        }
    }

    /// All levels of a tile.
    fn tile(&self, block: usize, strip: usize) {
        for (t, lit) in (1..).zip(self.lit) {
            let first = self.strip_rows + block * TILE_ROWS - t;
            let rows = first..(first + TILE_ROWS).min(lit.rows);
            let shift = (t - 1) * self.lanes.width();
            let columns = (strip * self.tile_columns).saturating_sub(shift)
                ..((strip + 1) * self.tile_columns).saturating_sub(shift).min(lit.columns);
            if rows.is_empty() || columns.is_empty() {
                continue;
            }
            let (now, next) = (self.origins[(t - 1) % 2], self.origins[t % 2]);
            let Weights { outward, inward } = self.weights;
            let patch = Patch { now, next, stride: self.stride, outward, inward };
            let has_last = rows.contains(&self.last_row);
            // SAFETY: rows lie in 1 ≤ j ≤ nz − 1 and columns in 0 ≤ i < nr (`lit` stays below both), so with a row and
            // a pack around them they are inside the arrays. No other thread writes to what is read here or touches
            // what is written here: the nodes of a tile at level t are read by tiles to the right and below at level
            // t + 1, which start after this one has ended; those of level t − 1 around this tile were written by tiles
            // above and to the left, which have ended, and are overwritten at level t + 1 only by tiles that are
            // shifted one row and one vector farther, which is past them.
            #[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
            unsafe {
                self.lanes.advance(patch, rows, columns.clone());
            }
            if has_last {
                self.note_peak(next, t, columns);
            }
        }
    }

    /// Takes note of the row before the backing, `columns` of which have just been advanced to level t.
    fn note_peak(&self, next: *mut f64, t: usize, columns: Range<usize>) {
        let mut peaks = self.peaks.lock().expect("no thread panics while it holds the lock");
        let peak = &mut peaks[usize::from(t == self.lit.len())];
        for i in columns {
            // SAFETY: a node of the tile this thread is working on
            #[expect(unsafe_code, reason = "as in the tile")]
            let value = unsafe { *next.add(self.last_row * self.stride + i) };
            *peak = peak.with(value, self.base + t, i);
        }
    }
}
