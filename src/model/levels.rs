//! Two levels of a field in memory that several threads work on.

use std::{cell::UnsafeCell, ops::Range};

use ndarray::{ArrayView2, s};

use super::lanes::PACK;

/// Numbers in a line of the cache.
const LINE: usize = 8;

/// Two levels of a field, row by row. Level k is in the array `k % 2`. Every row has a pack of zeros before its first
/// column and after its last one, and begins at a line of the cache.
///
/// Whoever asks for numbers answers for nobody else writing to them; that is why all access is unsafe.
pub struct Levels {
    arrays: [Box<[UnsafeCell<f64>]>; 2],
    /// Number that each array begins with.
    start: [usize; 2],
    rows: usize,
    columns: usize,
    stride: usize,
}

// SAFETY: numbers are reached through unsafe methods only, whose callers see to it that nobody reads what another one
// writes.
#[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
unsafe impl Sync for Levels {}

#[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
impl Levels {
    /// A field at rest.
    pub fn new(rows: usize, columns: usize) -> Self {
        let columns = columns.next_multiple_of(PACK);
        // rows that are a multiple of 4 KiB apart would share the same sets of the first cache: an odd number of lines
        let lines = (columns + 2 * PACK).div_ceil(LINE) | 1;
        let stride = lines * LINE;
        let array = || {
            // zeros that nobody has touched take no memory
            let numbers = vec![0.0; rows * stride + LINE].into_boxed_slice();
            // SAFETY: an `UnsafeCell<f64>` looks like an `f64` in memory
            unsafe { Box::from_raw(Box::into_raw(numbers) as *mut [UnsafeCell<f64>]) }
        };
        let arrays = [array(), array()];
        let start =
            arrays.each_ref().map(|array| array.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE));
        Self { arrays, start, rows, columns, stride }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns, a whole number of packs.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Distance from a node to the one below it, in numbers.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Node (0, 0) of a level; the zeros before a row belong to what may be read.
    pub fn origin(&self, level: usize) -> *mut f64 {
        let cell = self.arrays[level % 2].as_ptr().wrapping_add(self.start[level % 2] + PACK);
        UnsafeCell::raw_get(cell)
    }

    /// Row `j` at a level, with a zero at its end.
    ///
    /// # Safety
    ///
    /// Nobody writes to the row while it is looked at.
    pub unsafe fn row(&self, level: usize, j: usize) -> &[f64] {
        // SAFETY: handed on to the caller
        unsafe { self.part(level, j, 0..self.columns + 1) }
    }

    /// Some columns of row `j` at a level; after the last one there is a zero.
    ///
    /// # Safety
    ///
    /// Nobody writes to them while they are looked at.
    pub unsafe fn part(&self, level: usize, j: usize, columns: Range<usize>) -> &[f64] {
        assert!(j < self.rows && columns.start <= columns.end && columns.end <= self.columns + 1);
        // SAFETY: columns of a row and the zeros behind it lie inside the array; the caller answers for the rest
        unsafe {
            let first = self.origin(level).add(j * self.stride + columns.start);
            std::slice::from_raw_parts(first, columns.len())
        }
    }

    /// Row `j` at a level, to be changed.
    ///
    /// # Safety
    ///
    /// Nobody else touches the row meanwhile.
    #[expect(clippy::mut_from_ref, reason = "the caller answers for it")]
    pub unsafe fn row_mut(&self, level: usize, j: usize) -> &mut [f64] {
        assert!(j < self.rows, "row {j} of {}", self.rows);
        // SAFETY: a row lies inside the array; the caller answers for the rest
        unsafe { std::slice::from_raw_parts_mut(self.origin(level).add(j * self.stride), self.columns) }
    }

    /// A level, shape `(rows, columns + 1)`: there is a column of zeros at the end.
    ///
    /// # Safety
    ///
    /// Nobody writes to the level while it is looked at.
    pub unsafe fn level(&self, level: usize) -> ArrayView2<'_, f64> {
        // SAFETY: the rows of a level lie inside the array; the caller answers for the rest
        let numbers =
            unsafe { std::slice::from_raw_parts(self.origin(level).sub(PACK), self.rows * self.stride) };
        let whole =
            ArrayView2::from_shape((self.rows, self.stride), numbers).expect("an array is rows of a stride");
        whole.slice_move(s![.., PACK..PACK + self.columns + 1])
    }

    /// Writes zeros to `rows` rows from row `j` on. Memory that is read before it is written to is given out twice by the
    /// system, and the second time all threads stop for it.
    ///
    /// # Safety
    ///
    /// Nobody else touches these rows meanwhile.
    pub unsafe fn open(&self, j: usize, rows: usize) {
        assert!(j + rows <= self.rows, "rows {j} to {} of {}", j + rows, self.rows);
        for level in [0, 1] {
            // SAFETY: the rows lie inside the array; the caller answers for the rest
            unsafe {
                let first = self.origin(level).sub(PACK).add(j * self.stride);
                std::slice::from_raw_parts_mut(first, rows * self.stride).fill(0.0);
            }
        }
    }
}
