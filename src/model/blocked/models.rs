//! Models of the hand-over between the near-surface band and the tiles: every order in which threads may run, as far as a few
//! preemptions make it differ, under the memory model. They run with `tests/concurrency/run loom`.
//!
//! The order of tiles, the queue and the tiling are those of the engine. A field is modelled by what stands in it: each place knows
//! its level. A place is a node along z and a block of columns along r; advancing it reads what the kernels read, whole vectors on
//! either side among it. That a place is read or written while another thread writes to it, or without having seen what was
//! written before, is found by loom; that it holds another level than needed, by the assertions.

use std::{cell::RefCell, ops::Range, sync::Arc};

use loom::{
    cell::UnsafeCell,
    model::Builder,
    thread::{self, JoinHandle},
};

use super::{
    handover::{HandOver, Helper, Order, TileRows, wait_until},
    lane::BLOCK,
    parts::Parts,
    tiles::{Sizes, Tiling},
};
use crate::model::cone::ActiveRegion;

/// Tries all orders of threads.
///
/// * `preemptions`: number of them up to which it does, if the environment says nothing else
fn check_up_to(preemptions: usize, model: impl Fn() + Sync + Send + 'static) {
    let mut builder = Builder::new();
    builder.preemption_bound.get_or_insert(preemptions);
    builder.max_branches = 100_000;
    builder.check(model);
}

/// The same with two threads.
fn check(model: impl Fn() + Sync + Send + 'static) {
    check_up_to(3, model);
}

/// How a scheme reaches around a node.
#[derive(Clone, Copy)]
struct Kind {
    /// Levels in memory.
    levels: usize,
    /// Rows around a node, and levels that the interior may lag behind.
    reach: usize,
    lag: usize,
}

/// One displacement, without the mixed-derivative correction and with it.
const PLAIN: Kind = Kind { levels: 2, reach: 1, lag: 2 };
const CORNER: Kind = Kind { levels: 3, reach: 2, lag: 1 };

const SIZES: Sizes = Sizes { lag_rows: [2, 2], tile_rows: 2, tile_columns: [BLOCK, BLOCK], nodes_for_one: 0 };

/// Levels of a field, place by place.
struct Displacement {
    kind: Kind,
    active: ActiveRegion,
    places: Vec<UnsafeCell<isize>>,
}

// `loom` checks who reaches the places when
#[expect(unsafe_code, reason = "the field of the engine is shared the same way")]
unsafe impl Sync for Displacement {}
#[expect(unsafe_code, reason = "the field of the engine is shared the same way")]
unsafe impl Send for Displacement {}

impl Displacement {
    /// A field with so many tile rows and blocks of columns.
    fn new(kind: Kind, tile_rows: usize, blocks: usize) -> Arc<Self> {
        let below = tile_rows * SIZES.tile_rows - kind.reach * kind.lag;
        let active =
            ActiveRegion { rows: Tiling::band_rows(kind.lag, kind.reach) + below, columns: blocks * BLOCK };
        let levels = kind.levels as isize;
        // the levels before 0 are at rest
        let first = (0..levels).map(|array| if array == 0 { 0 } else { array - levels });
        let places = first.flat_map(|level| vec![level; active.rows * blocks]).map(UnsafeCell::new);
        Arc::new(Self { kind, active, places: places.collect() })
    }

    /// The place of a block of row `j` in the array of a level.
    fn place(&self, level: isize, j: usize, block: usize) -> &UnsafeCell<isize> {
        let blocks = self.active.columns / BLOCK;
        let array = level.rem_euclid(self.kind.levels as isize) as usize;
        &self.places[(array * self.active.rows + j) * blocks + block]
    }

    /// Panics if a place does not hold a level.
    fn read(&self, level: isize, j: usize, block: usize) {
        // SAFETY: loom stops the model if another thread writes to it
        #[expect(unsafe_code, reason = "the field of the engine is shared the same way")]
        let found = self.place(level, j, block).with(|found| unsafe { *found });
        assert_eq!(found, level, "row {j}, block {block}");
    }

    /// Advances rows and columns to a level, as the kernels do.
    fn advance(&self, level: usize, rows: Range<usize>, columns: Range<usize>) {
        let Kind { levels, reach, .. } = self.kind;
        let level = level as isize;
        let around = |range: &Range<usize>, by: usize, end: usize| {
            range.start.saturating_sub(by)..(range.end + by).min(end)
        };
        let blocks = columns.start / BLOCK..columns.end / BLOCK;
        for j in rows {
            for block in blocks.clone() {
                for row in around(&(j..j + 1), reach, self.active.rows) {
                    for near in around(&(block..block + 1), 1, self.active.columns / BLOCK) {
                        self.read(level - 1, row, near);
                        // without the mixed-derivative correction a node needs itself alone at the level before
                        if levels > 2 || (row, near) == (j, block) {
                            self.read(level - 2, row, near);
                        }
                    }
                }
                // SAFETY: loom stops the model if another thread touches it
                #[expect(unsafe_code, reason = "the field of the engine is shared the same way")]
                self.place(level, j, block).with_mut(|place| unsafe { *place = level });
            }
        }
    }

    /// Advances the near-surface band, `behind` levels having been left to the interior.
    fn advance_band(&self, level: usize, behind: usize) {
        let Kind { lag, reach, .. } = self.kind;
        let rows = Tiling::band_rows(lag, reach) - reach * (behind + 1);
        self.advance(level, 0..rows.min(self.active.rows), 0..self.active.columns);
    }
}

/// A pass over the levels of a lag.
struct Pass {
    field: Arc<Displacement>,
    tiling: Tiling,
    order: Order,
    base: usize,
}

impl Pass {
    fn new(field: &Arc<Displacement>, base: usize, earlier: Option<&Self>) -> Self {
        let (Kind { lag, reach, .. }, ActiveRegion { rows, columns, .. }) = (field.kind, field.active);
        let tiling = Tiling::new(&SIZES, lag, reach, BLOCK, columns, 2);
        let [tile_rows, bands] = tiling.count(rows, columns, lag);
        let order = Order::new(tile_rows, bands, earlier.map(|pass| &pass.order));
        Self { field: Arc::clone(field), tiling, order, base }
    }
}

impl TileRows for Pass {
    fn order(&self) -> &Order {
        &self.order
    }

    fn advance(&self, tile_row: usize) {
        self.order.advance(tile_row, |band| {
            for t in 1..=self.field.kind.lag {
                let (rows, columns) = self.tiling.tile(tile_row, band, t, self.field.active);
                if !rows.is_empty() && !columns.is_empty() {
                    self.field.advance(self.base + t, rows, columns);
                }
            }
        });
    }
}

/// The thread of the run with its helpers.
struct Run<P> {
    passes: HandOver<P>,
    helpers: RefCell<Vec<JoinHandle<()>>>,
}

impl<P: TileRows> Run<P> {
    fn new() -> Self {
        Self { passes: HandOver::new(), helpers: RefCell::default() }
    }

    fn follow(&mut self, pass: P, threads: usize) {
        let helpers = &self.helpers;
        let wake = |helper: Helper<P>| helpers.borrow_mut().push(thread::spawn(|| helper.help()));
        self.passes.follow(pass, threads, wake);
    }

    /// Waits until all helpers have gone to sleep; returns how many there were.
    fn join(&self) -> usize {
        let helpers = self.helpers.take();
        let count = helpers.len();
        helpers.into_iter().for_each(|helper| helper.join().expect("a helper"));
        count
    }
}

/// Brings the band of a lag up to date.
fn advance_bands(field: &Displacement, base: usize) {
    (0..field.kind.lag).for_each(|behind| field.advance_band(base + behind + 1, behind));
}

fn tiles_see_what_is_above_and_to_the_left(kind: Kind) {
    check(move || {
        let field = Displacement::new(kind, 2, 2);
        advance_bands(&field, 0);
        let pass = Arc::new(Pass::new(&field, 0, None));
        assert_eq!(pass.order.tile_rows(), 2);
        let other = Arc::clone(&pass);
        let below = thread::spawn(move || other.advance(1));
        pass.advance(0);
        // the band continues as soon as the first tile row is done
        advance_bands(&field, kind.lag);
        wait_until(|| pass.order.is_over());
        (0..field.active.rows).for_each(|j| {
            let is_band = j < Tiling::band_rows(kind.lag, kind.reach) - kind.reach;
            if !is_band {
                field.read(kind.lag as isize, j, 0);
            }
        });
        below.join().expect("a thread");
    });
}

#[test]
fn loom_tiles_see_what_is_above_and_to_the_left() {
    tiles_see_what_is_above_and_to_the_left(PLAIN);
}

#[test]
fn loom_tiles_with_the_corner_term_see_what_is_above_and_to_the_left() {
    tiles_see_what_is_above_and_to_the_left(CORNER);
}

fn a_pass_stays_behind_the_one_before(kind: Kind) {
    check(move || {
        let field = Displacement::new(kind, 3, 1);
        advance_bands(&field, 0);
        let first = Arc::new(Pass::new(&field, 0, None));
        let second = Arc::new(Pass::new(&field, kind.lag, Some(&first)));
        let others = [Arc::clone(&first), Arc::clone(&second)];
        let below = thread::spawn(move || {
            let [first, second] = others;
            [1, 2].into_iter().for_each(|tile_row| first.advance(tile_row));
            [1, 2].into_iter().for_each(|tile_row| second.advance(tile_row));
        });
        first.advance(0);
        advance_bands(&field, kind.lag);
        // waits for the two upper tile rows, and may overtake the third
        second.advance(0);
        advance_bands(&field, 2 * kind.lag);
        wait_until(|| second.order.is_over());
        assert!(first.order.is_over());
        below.join().expect("a thread");
    });
}

#[test]
fn loom_a_pass_stays_behind_the_one_before() {
    a_pass_stays_behind_the_one_before(PLAIN);
}

#[test]
fn loom_a_pass_with_the_corner_term_stays_behind_the_one_before() {
    a_pass_stays_behind_the_one_before(CORNER);
}

/// A run with one helper.
fn the_band_goes_on_while_helpers_work(kind: Kind, blocks: usize) {
    check(move || {
        let field = Displacement::new(kind, 2, blocks);
        let mut run = Run::new();
        for number in 0..2 {
            let base = number * kind.lag;
            advance_bands(&field, base);
            let pass = Pass::new(&field, base, run.passes.newest());
            run.follow(pass, 2);
        }
        advance_bands(&field, 2 * kind.lag);
        run.passes.settle();
        let last = field.active.rows - 1;
        (0..blocks).for_each(|block| field.read(2 * kind.lag as isize, last, block));
        assert!(run.passes.ended().is_some_and(|pass| pass.base == 0));
        assert!(run.passes.ended().is_some_and(|pass| pass.base == kind.lag));
        assert!(run.passes.is_empty());
        run.join();
    });
}

#[test]
fn loom_the_band_goes_on_while_helpers_work() {
    the_band_goes_on_while_helpers_work(PLAIN, 1);
}

#[test]
fn loom_the_band_with_the_corner_term_goes_on_while_helpers_work() {
    the_band_goes_on_while_helpers_work(CORNER, 1);
}

/// A pass of one band whose tile rows count themselves, each in its own part.
struct Count {
    order: Order,
    parts: Parts<Tracked>,
}

/// A number of which loom knows who reaches it when.
struct Tracked(UnsafeCell<usize>);

impl Default for Tracked {
    fn default() -> Self {
        Self(UnsafeCell::new(0))
    }
}

impl Clone for Tracked {
    fn clone(&self) -> Self {
        Self(UnsafeCell::new(self.get()))
    }
}

#[expect(unsafe_code, reason = "loom stops the model if another thread reaches it")]
impl Tracked {
    fn get(&self) -> usize {
        // SAFETY: see above
        self.0.with(|number| unsafe { *number })
    }

    fn add(&mut self) {
        // SAFETY: see above
        self.0.with_mut(|number| unsafe { *number += 1 });
    }
}

impl Count {
    fn new(tile_rows: usize, earlier: Option<&Self>) -> Self {
        let order = Order::new(tile_rows, 1, earlier.map(|pass| &pass.order));
        Self { order, parts: Parts::new(tile_rows) }
    }
}

impl TileRows for Count {
    fn order(&self) -> &Order {
        &self.order
    }

    fn advance(&self, tile_row: usize) {
        self.order.advance(tile_row, |_| {
            // SAFETY: one thread does the tile row, or loom stops the model
            #[expect(unsafe_code, reason = "parts that several threads write")]
            let part = unsafe { self.parts.part(tile_row..tile_row + 1) };
            part[0].add();
        });
    }
}

/// Panics unless every tile row of a pass that is over was done once, as the thread of the run sees it.
fn check_count(pass: &Count) {
    // SAFETY: the pass is over
    #[expect(unsafe_code, reason = "parts that several threads have written")]
    let counts = unsafe { pass.parts.take() };
    assert!(counts.iter().all(|count| count.get() == 1));
}

/// Helpers go to sleep while passes are added. Once all sleep nothing is left, though the thread of the run has done no more than
/// its share.
fn no_pass_is_left_to_sleeping_helpers(preemptions: usize, threads: usize, passes: usize) {
    check_up_to(preemptions, move || {
        let mut run = Run::new();
        for _ in 0..passes {
            let pass = Count::new(2, run.passes.newest());
            run.follow(pass, threads);
        }
        let woken = run.join();
        assert!((1..=passes * (threads - 1)).contains(&woken), "{woken} helpers");
        for _ in 0..passes {
            let pass = run.passes.ended().expect("a pass that is over");
            check_count(&pass);
        }
        assert!(run.passes.is_empty());
    });
}

#[test]
fn loom_no_pass_is_left_to_a_sleeping_helper() {
    no_pass_is_left_to_sleeping_helpers(3, 2, 3);
}

#[test]
fn loom_no_pass_is_left_to_two_sleeping_helpers() {
    no_pass_is_left_to_sleeping_helpers(1, 3, 2);
}

#[test]
fn loom_what_is_taken_out_of_an_ended_pass_is_complete() {
    check(|| {
        let mut run = Run::new();
        run.follow(Count::new(3, None), 2);
        let mut pass = run.passes.ended();
        if pass.is_none() {
            run.passes.settle();
            pass = run.passes.ended();
        }
        check_count(&pass.expect("a pass that is over"));
        run.join();
    });
}
