//! The interior behind the surface, advanced many steps at a time.
//!
//! Contact couples the whole surface in every step; the interior is not coupled to anything but its neighbours. So a
//! strip of rows under the surface goes step by step, one row less each time, and the rows below follow later, many
//! levels in one pass through memory. They are cut into blocks of rows and strips of columns; a tile is one block of
//! one strip, and every level of a tile is shifted by one row and one column towards the origin:
//!
//! ```text
//!  rows of a tile at levels t = 1, 2, 3      level t needs level t−1 one node around it: the shift
//!    ·  ·  3                                 leaves behind just that much of the tile above and of
//!    ·  2  3                                 the tile to the left, and has not touched what the tiles
//!    1  2  3                                 below and to the right still need. Both levels of the
//!    1  2  ·                                 field are therefore updated in place.
//! ```
//!
//! Tile `(p, s)` (block p, strip s) needs `(p', s')` for all `p' ≤ p`, `s' ≤ s`. One thread does the strips of a block
//! from left to right, and stays behind the thread of the block above. The numbers do not depend on who does what:
//! every node is computed once per level, from the same neighbours, by the same operations.

use std::{
    ops::Range,
    sync::{
        Mutex,
        atomic::{AtomicUsize, Ordering},
    },
};

use ndarray::Array2;

use super::stencil::{Patch, Top, advance};

/// Number of levels that the interior may lag behind the surface.
pub const LAG: usize = 16;

/// Rows of the strip under the surface: rows 0 and 1 must be up to date when the interior lags by [`LAG`].
pub const STRIP: usize = LAG + 2;

/// Rows and columns of a tile: with its shift, `(64 + 16)·(16 + 16)` nodes on two levels fill 40 KiB of the second
/// cache, and one level of it half of the first. Between 32 and 128 rows, 16 and 32 columns little changes.
const TILE_ROWS: usize = 64;
const TILE_COLUMNS: usize = 16;

/// Nodes in a sweep below which a second thread is not worth waking.
const NODES_PER_THREAD: usize = 100_000;

/// Two levels of a field, column by column in the order of depth. Level k is in the array `k % 2`. A column of zeros
/// stands before the first one and after the last one.
pub struct Levels {
    arrays: [Array2<f64>; 2],
}

impl Levels {
    /// A field at rest.
    pub fn new(rows: usize, columns: usize) -> Self {
        // columns that are a multiple of 4 KiB apart would share the same sets of the first cache
        let stride = rows.next_multiple_of(8);
        let stride = if stride.is_multiple_of(64) { stride + 8 } else { stride };
        Self { arrays: [Array2::zeros((columns + 2, stride)), Array2::zeros((columns + 2, stride))] }
    }

    /// Column `i` at a level.
    pub fn column(&self, level: usize, i: usize) -> &[f64] {
        self.arrays[level % 2].row(i + 1).to_slice().expect("columns are contiguous")
    }

    /// Column `i` at a level, to be changed.
    pub fn column_mut(&mut self, level: usize, i: usize) -> &mut [f64] {
        self.arrays[level % 2].row_mut(i + 1).into_slice().expect("columns are contiguous")
    }

    /// Rows 0 and 1 of the column before column `i`.
    pub fn top_before(&self, level: usize, i: usize) -> Top {
        let array = &self.arrays[level % 2];
        Top { surface: array[[i, 0]], below: array[[i, 1]] }
    }

    /// Distance from a node to its outer neighbour, in numbers.
    fn stride(&self) -> usize {
        self.arrays[0].ncols()
    }

    /// Nodes (0, 0) of level `level`, and of the level after or before it.
    fn origins(&mut self, level: usize) -> [*mut f64; 2] {
        let stride = self.stride();
        // a column of zeros comes first
        let [even, odd] = self.arrays.each_mut().map(|array| array.as_mut_ptr().wrapping_add(stride));
        if level.is_multiple_of(2) { [even, odd] } else { [odd, even] }
    }
}

/// What the levels of a sweep look like.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lit {
    /// Rows that may differ from 0 and are still of use.
    pub rows: usize,
    /// Columns that may differ from 0.
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

/// Instructions that the machine has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lanes {
    /// What every x86-64 or other machine has.
    Baseline,
    /// 256-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Lanes {
    /// The best this machine has.
    pub fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            return Self::Avx2;
        }
        Self::Baseline
    }
}

/// [`advance`] with the given instructions.
///
/// # Safety
///
/// As [`advance`].
#[expect(unsafe_code, reason = "patches of one array are updated in place by several threads")]
unsafe fn advance_on(lanes: Lanes, patch: Patch<'_>, rows: Range<usize>, columns: Range<usize>) {
    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    unsafe fn avx2(patch: Patch<'_>, rows: Range<usize>, columns: Range<usize>) {
        // SAFETY: handed on to the caller
        unsafe { advance(patch, rows, columns) }
    }
    match lanes {
        // SAFETY: handed on to the caller
        Lanes::Baseline => unsafe { advance(patch, rows, columns) },
        // SAFETY: handed on to the caller; this variant is only made where the instructions were detected
        #[cfg(target_arch = "x86_64")]
        Lanes::Avx2 => unsafe { avx2(patch, rows, columns) },
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
    let stride = levels.stride();
    let rows = 1..rows.min(lit.rows);
    assert!(rows.end < stride && lit.columns + 2 <= levels.arrays[0].nrows());
    let [next, now] = levels.origins(level);
    let patch = Patch { now, next, stride, outward: weights.outward, inward: weights.inward };
    // SAFETY: rows and columns lie inside the arrays with one node around them, as has just been checked; the arrays are
    // borrowed for this call alone
    #[expect(unsafe_code, reason = "one kernel for strip and interior")]
    unsafe {
        advance_on(lanes, patch, rows, 0..lit.columns);
    }
}

/// Radial weights times λ²/4, by column.
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
    /// Levels to do, from `base + 1` on; at most [`LAG`].
    pub lit: &'a [Lit],
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
    strips: usize,
    /// Number of strips of each block that are done.
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
        assert!(lag <= LAG, "the strip is not deep enough");
        let rows = self.lit.iter().map(|lit| lit.rows).max().unwrap_or(0);
        let columns = self.lit.iter().map(|lit| lit.columns).max().unwrap_or(0);
        let blocks = (rows + lag).saturating_sub(STRIP).div_ceil(TILE_ROWS);
        let strips = (columns + lag).saturating_sub(1).div_ceil(TILE_COLUMNS);
        let stride = self.levels.stride();
        assert!(rows < stride && columns + 2 <= self.levels.arrays[0].nrows());
        let shared = Shared {
            origins: self.levels.origins(self.base),
            stride,
            weights: self.weights,
            base: self.base,
            lit: self.lit,
            last_row: self.last_row,
            lanes: self.lanes,
            strips,
            progress: (0..blocks).map(|_| AtomicUsize::new(0)).collect(),
            peaks: Mutex::default(),
        };
        let next = AtomicUsize::new(0);
        let work = || {
            // blocks are taken in order, so the block above is done or in somebody's hands
            loop {
                let block = next.fetch_add(1, Ordering::Relaxed);
                if block >= blocks {
                    return;
                }
                shared.block(block);
            }
        };
        if blocks > 1 && rows * columns * lag > NODES_PER_THREAD && rayon::current_num_threads() > 1 {
            rayon::broadcast(|_| work());
        } else {
            work();
        }
        shared.peaks.into_inner().expect("no thread panics while it holds the lock")
    }
}

impl Shared<'_> {
    /// Does the strips of a block from left to right, behind the block above.
    fn block(&self, block: usize) {
        for strip in 0..self.strips {
            if let Some(above) = block.checked_sub(1) {
                let mut patience = 0;
                while self.progress[above].load(Ordering::Acquire) <= strip {
                    // the other thread needs microseconds; but it may have lost its core
                    patience += 1;
                    if patience < 1000 { std::hint::spin_loop() } else { std::thread::yield_now() }
                }
            }
            self.tile(block, strip);
            self.progress[block].store(strip + 1, Ordering::Release);
        }
    }

    /// All levels of a tile.
    fn tile(&self, block: usize, strip: usize) {
        for (t, lit) in (1..).zip(self.lit) {
            let rows = STRIP + block * TILE_ROWS - t..(STRIP + (block + 1) * TILE_ROWS - t).min(lit.rows);
            let columns = (strip * TILE_COLUMNS).saturating_sub(t - 1)
                ..((strip + 1) * TILE_COLUMNS).saturating_sub(t - 1).min(lit.columns);
            if rows.is_empty() || columns.is_empty() {
                continue;
            }
            let (now, next) = (self.origins[(t - 1) % 2], self.origins[t % 2]);
            let Weights { outward, inward } = self.weights;
            let patch = Patch { now, next, stride: self.stride, outward, inward };
            let has_last = rows.contains(&self.last_row);
            // SAFETY: rows lie in 1 ≤ j ≤ nz − 1 and columns in 0 ≤ i < nr (`lit` stays below both), so with one node
            // around them they are inside the arrays. No other thread writes to what is read here or touches what is
            // written here: the nodes of a tile at level t are read by tiles to the right and below at level t + 1,
            // which start after this one has ended; those of level t − 1 around this tile were written by tiles above
            // and to the left, which have ended, and are overwritten at level t + 1 only by tiles that are shifted one
            // node farther, which is past them.
            #[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
            unsafe {
                advance_on(self.lanes, patch, rows, columns.clone());
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
            let value = unsafe { *next.add(i * self.stride + self.last_row) };
            *peak = peak.with(value, self.base + t, i);
        }
    }
}
