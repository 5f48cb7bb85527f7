//! Time-skewed tiling behind the near-surface band: the interior, many steps in one pass.
//!
//! Contact couples the whole surface in every step; the interior is coupled to nothing but its neighbours. So a
//! near-surface band of rows goes step by step, one row less each time, and the rows below follow later, many
//! levels in one pass through memory. They are cut into tile rows and column bands; a tile is one tile row of
//! one band, and every level of a tile is shifted by one row and one vector of columns towards the origin (with the corner
//! term, which reaches farther, by two rows and one vector: [`Theory::reach`]; with cells, whose damping
//! reaches four columns, by one row and four columns at least: [`Domain::shift`]):
//!
//! ```text
//!  rows of a tile at levels t = 1, 2, 3      level t needs level t−1 one node around it: the shift
//!    ·  ·  3                                 leaves behind just that much of the tile above and of
//!    ·  2  3                                 the tile to the left, and has not touched what the tiles
//!    1  2  3                                 below and to the right still need. Both levels of the
//!    1  2  ·                                 field are therefore updated in place, or with three
//!                                            levels over the one that nothing needs any more.
//! ```
//!
//! Tile `(p, s)` (tile row p, band s) needs `(p', s')` for all `p' ≤ p`, `s' ≤ s`. A thread takes a tile row, does its bands
//! from left to right, and stays behind the thread of the tile row above. A pass may begin while the one before it is under
//! way ([`super::handover`]): tile rows are the same rows in both, and a tile row of the later one begins when the one below
//! it, and so all that are above, is done in the earlier one.
//! The numbers do not depend on which thread does what: every node is computed once per level, from the same neighbours, by
//! the same operations.

use std::{
    ops::Range,
    sync::{Arc, Mutex, PoisonError},
};

use serde::{Deserialize, Serialize};

use super::{
    domain::{Domain, SurfaceMotion, Theory},
    gauge::Gauge,
    handover::{Order, TileRows},
    lane::BLOCK,
    sampler::Sampler,
    strains::Strains,
};
use crate::model::{cone::ActiveRegion, strain::Watched};

/// Sizes of what threads are given to do.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Fewest and most rows of the near-surface band that levels behind it may take.
    pub lag_rows: [usize; 2],
    /// Rows of a tile, no fewer than the most rows of the lag.
    pub tile_rows: usize,
    /// Fewest and most columns of a tile, whole blocks; fewer where a mesh is so narrow that threads would wait for each other.
    pub tile_columns: [usize; 2],
    /// Nodes in a pass up to which a second thread is not worth waking.
    pub nodes_for_one: usize,
}

impl Sizes {
    /// What has been found to be fast: one level of a tile is two arrays of 96 KiB that stream from the second cache row after row,
    /// and what the next levels add to them fits in there too. Half or twice as many columns cost some percent at most with 1 MiB of that cache.
    pub const TUNED: Self = Self {
        lag_rows: [8, 32],
        tile_rows: 32,
        tile_columns: [8 * BLOCK, 48 * BLOCK],
        nodes_for_one: 100_000,
    };

    /// Sizes at which a mesh of some hundred nodes has tiles, passes and helpers as a large one has them.
    #[cfg(test)]
    pub const SMALL: Self =
        Self { lag_rows: [4, 4], tile_rows: 4, tile_columns: [BLOCK, 2 * BLOCK], nodes_for_one: 0 };

    /// Number of levels that the interior may lag behind the surface over `nz` rows: the more, the less often memory is gone
    /// through; but the near-surface band, which one thread does, should stay a small part of the whole.
    ///
    /// * `reach`: rows around a node that its next level depends on
    pub fn lag(&self, nz: usize, reach: usize) -> usize {
        let [least, most] = self.lag_rows;
        (nz / 16).clamp(least, most) / reach
    }
}

/// The tiles of a pass.
#[derive(Clone, Copy, Debug)]
pub struct Tiling {
    /// Levels that the interior may lag behind the surface.
    lag: usize,
    /// Rows around a node that its next level depends on.
    reach: usize,
    /// Columns by which a tile is shifted from level to level.
    shift: usize,
    /// Rows and columns of a tile.
    rows: usize,
    columns: usize,
}

impl Tiling {
    /// Tiles of a pass over at most `columns` columns, that many threads will work on.
    ///
    /// * `lag`: of the interior, the same in all passes
    /// * `reach`: rows around a node that its next level depends on
    /// * `shift`: columns by which a tile is shifted from level to level, no fewer than a level depends on
    pub fn new(
        sizes: &Sizes,
        lag: usize,
        reach: usize,
        shift: usize,
        columns: usize,
        threads: usize,
    ) -> Self {
        // or tile rows would touch those of the pass before, see `Pass::tile`
        assert!(lag * reach <= sizes.tile_rows, "the near-surface band is not deep enough");
        let [fewest, most] = sizes.tile_columns;
        // a band for every thread at least
        let columns = columns.div_ceil(threads).next_multiple_of(BLOCK).clamp(fewest, most);
        Self { lag, reach, shift, rows: sizes.tile_rows, columns }
    }

    /// Rows of the near-surface band: rows 0 to `reach` must be up to date when the interior lags by `lag`.
    pub fn band_rows(lag: usize, reach: usize) -> usize {
        lag * reach + reach + 1
    }

    /// Number of tile rows and of column bands that it takes to advance `rows` and `columns` over some levels.
    pub fn count(&self, rows: usize, columns: usize, levels: usize) -> [usize; 2] {
        let below = (rows + self.reach * levels).saturating_sub(Self::band_rows(self.lag, self.reach));
        let shifted = columns + levels.saturating_sub(1) * self.shift;
        [below.div_ceil(self.rows), shifted.div_ceil(self.columns)]
    }

    /// Rows and columns of a tile at level number `t` of the pass, from 1 on.
    ///
    /// * `active`: what of the level is to be computed
    pub fn tile(
        &self,
        tile_row: usize,
        band: usize,
        t: usize,
        active: ActiveRegion,
    ) -> (Range<usize>, Range<usize>) {
        let first = Self::band_rows(self.lag, self.reach) + tile_row * self.rows - self.reach * t;
        let [start, end] = self.columns(band, t);
        (first..(first + self.rows).min(active.rows), start..end.min(active.columns))
    }

    /// First column of a band at that level, and first one of the next band.
    fn columns(&self, band: usize, t: usize) -> [usize; 2] {
        let shift = (t - 1) * self.shift;
        [band, band + 1].map(|band| (band * self.columns).saturating_sub(shift))
    }
}

/// The largest of what tells the strain on the back ([`Theory::back`]), with its level and column: where
/// there are several, the earliest and innermost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RowPeak {
    /// By magnitude.
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

/// What is to be done on the way to a level.
#[derive(Clone, Default)]
pub struct LevelTask {
    /// What of it is to be computed.
    pub active: ActiveRegion,
    /// What samples the level before, if that is a frame.
    pub sampler: Option<Arc<Sampler>>,
    /// What records points and lines at the level before, if there are any.
    pub gauge: Option<Arc<Gauge>>,
    /// What takes the largest strain at the level before, and of which cells.
    pub strains: Arc<Strains>,
    /// See `strains`.
    pub watched: Watched,
}

impl LevelTask {
    /// Advances the rows at `depths` of `columns`, whole vectors, to `level`, and samples them, points and lines among them.
    ///
    /// * `motion`: of row 0, if it is among the rows
    ///
    /// # Safety
    ///
    /// The nodes hold the two levels before, as do [`Theory::reach`] depths and a vector around them; no other thread touches the
    /// nodes, writes to those around them or samples these rows.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn advance<S: Theory>(
        &self,
        domain: &Domain<S>,
        level: usize,
        depths: Range<usize>,
        columns: Range<usize>,
        motion: Option<SurfaceMotion<'_>>,
    ) {
        let rows = domain.grid.rows_at(depths);
        let inner = rows.start.max(1)..rows.end.max(1);
        // SAFETY, of all below: the caller's promise
        unsafe {
            let sampler = self.sampler.as_deref();
            let before = sampler.map(|sampler| sampler.before(domain, &rows, &columns, motion));
            let gauge = self.gauge.as_deref();
            if let Some(gauge) = gauge {
                gauge.before(domain, &rows, &columns);
            }
            if let Some(SurfaceMotion { displacement, lateral, .. }) = motion {
                domain.levels.part_mut(level, 0, displacement.len()).copy_from_slice(displacement);
                if !lateral.is_empty() {
                    domain.levels.lateral_mut(level, 0, lateral.len()).copy_from_slice(lateral);
                }
            }
            let energies = sampler.map(|sampler| sampler.energies(inner.clone()));
            domain.advance(level, inner, columns.clone(), energies);
            domain.reflect(level, &rows, &columns);
            if let (Some(sampler), Some(before)) = (sampler, before) {
                sampler.after(domain, &rows, &columns, &before, motion);
            }
            if let Some(gauge) = gauge {
                gauge.after(domain, &rows, &columns, motion);
            }
            self.strains.take(domain, level - 1, &rows, &columns, self.watched);
            let pressure = motion.map(|motion| motion.pressure);
            S::take_ratios(domain, level - 1, (&rows, &columns), self.watched, pressure);
        }
    }
}

/// One pass over the interior.
pub struct Pass<S> {
    domain: Arc<Domain<S>>,
    /// Level of the interior.
    base: usize,
    /// Levels to do, from `base + 1` on.
    tasks: Vec<LevelTask>,
    tiling: Tiling,
    order: Order,
    /// Peaks of the row before the backing: of all levels but the last, and of the last.
    peaks: Mutex<[RowPeak; 2]>,
}

impl<S: Theory> Pass<S> {
    /// A pass from level `base` over `tasks.len()` levels, at most `lag`, that many threads will work on.
    ///
    /// When a tile row is begun, the near-surface band must be up to date.
    ///
    /// * `lag`: of the interior, the same in all passes
    /// * `earlier`: the pass before, if it may still be under way
    pub fn new(
        domain: Arc<Domain<S>>,
        base: usize,
        tasks: Vec<LevelTask>,
        (sizes, lag): (&Sizes, usize),
        threads: usize,
        earlier: Option<&Self>,
    ) -> Self {
        assert!(tasks.len() <= lag, "the near-surface band is not deep enough");
        let rows = tasks.iter().map(|task| task.active.rows).max().unwrap_or(0);
        let columns = tasks.iter().map(|task| task.active.columns).max().unwrap_or(0);
        assert!(rows < domain.levels.rows() && columns <= domain.levels.columns());
        let tiling = Tiling::new(sizes, lag, domain.theory.reach(), domain.shift(), columns, threads);
        let [tile_rows, bands] = tiling.count(rows, columns, tasks.len());
        let order = Order::new(tile_rows, bands, earlier.map(|pass| &pass.order));
        Self { domain, base, tasks, tiling, order, peaks: Mutex::default() }
    }

    /// Level that the interior has reached when the pass is over.
    pub fn last_level(&self) -> usize {
        self.base + self.tasks.len()
    }

    /// Peaks of the row before the backing, of all levels but the last one, and of the last one, once the pass is over.
    pub fn peaks(&self) -> [RowPeak; 2] {
        *self.peaks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All levels of a tile.
    fn tile(&self, tile_row: usize, band: usize) {
        let domain = &*self.domain;
        for (t, task) in (1..).zip(&self.tasks) {
            let (rows, columns) = self.tiling.tile(tile_row, band, t, task.active);
            if rows.is_empty() || columns.is_empty() {
                continue;
            }
            let has_last = domain.strains_back() && rows.contains(&domain.last_depth());
            // SAFETY: rows, counted by depth, lie between the surface and the backing and columns in 0 ≤ i < nr (the active region stays below both), so with a
            // block and `reach` rows or images around them they are inside the arrays. No other thread writes to what is
            // read here or touches what is written here. Let R be the reach, 1 or 2, and T the rows of a tile; images belong
            // to the row they are of:
            // - in this pass, the nodes of a tile at level t are read by tiles to the right and below at levels t + 1 and (where
            //   there are three levels) t + 2, which start after this one has ended; those of earlier levels around this tile
            //   were written by tiles above and to the left, which have ended, and are overwritten at level t + 1 (three
            //   levels: t + 2) only by tiles that are shifted R rows and [`Domain::shift`] columns farther per level, which is
            //   past them;
            // - a sampler, a gauge and what takes strains and stresses read what the step reads, of level t − 1, and the nodes themselves; and all tiles that sample a
            //   row at one level belong to one tile row;
            // - in the pass before, this tile row, those above and the one below are done. If that one's rows end at row f
            //   before any shift, this tile row writes up to row f − R − 1 and reads up to f − 1; what is farther down
            //   begins at f + T and is shifted up by R·lag ≤ T at most: it writes from f on and reads from f − R on;
            // - the near-surface band continues when the first tile row is done. It has B = R·lag + R + 1 rows, R less in every
            //   level, so it writes up to row B − R − 1 and reads up to B − 1; the second tile row begins at row
            //   B + T before any shift, so it writes from B on and reads from B − R on.
            #[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
            unsafe {
                task.advance(domain, self.base + t, rows, columns.clone(), None);
                if has_last {
                    let (level, back) = S::back(domain, self.base + t, &columns);
                    self.note_peak(&back, level, columns.start);
                }
            }
        }
    }

    /// Records what tells the strain on the back at a level, from column `first` on.
    fn note_peak(&self, row: &[f64], level: usize, first: usize) {
        let largest = row.chunks(BLOCK).fold([0.0; BLOCK], |mut largest: [f64; BLOCK], block| {
            for (a, b) in largest.iter_mut().zip(block) {
                *a = if b.abs() > *a { b.abs() } else { *a };
            }
            largest
        });
        let largest = largest.into_iter().fold(0.0, f64::max);
        let mut peaks = self.peaks.lock().unwrap_or_else(PoisonError::into_inner);
        let peak = &mut peaks[usize::from(level == self.last_level())];
        if largest >= peak.value
            && let Some(place) = row.iter().position(|u| u.abs() == largest)
        {
            *peak = peak.with(largest, level, first + place);
        }
    }
}

impl<S: Theory> TileRows for Pass<S> {
    fn order(&self) -> &Order {
        &self.order
    }

    fn advance(&self, tile_row: usize) {
        self.order.advance(tile_row, |band| self.tile(tile_row, band));
    }
}
