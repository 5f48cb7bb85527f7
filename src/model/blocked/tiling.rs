//! How the interior is cut into tiles.

use std::ops::Range;

use super::lane::BLOCK;
use crate::model::cone::ActiveRegion;

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
