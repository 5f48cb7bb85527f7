//! Levels of a field in memory that several threads work on, and the part of it that kernels get.
//!
//! Without the mixed-derivative correction a node needs itself at level k−1 and its neighbours at level k, so two levels do: k+1 overwrites
//! k−1. The mixed-derivative correction reads neighbours two rows and columns away at level k−1 too; with it there are three levels. So there are in
//! the full theory, whose damping reads neighbours four columns away.

use std::{cell::UnsafeCell, ops::Range};

use super::lane::{BLOCK, Lane};
use crate::model::scheme::RadialWeights;

/// Numbers in a line of the cache.
const LINE: usize = 8;

/// Images about the axis that schemes read.
pub const IMAGES: usize = 2;

/// Some levels of a field, row by row. Level k is in the array `k % arrays`. Every row has a block before its first column and
/// a block of zeros after its last one, two with cells, and begins at a line of the cache; with cells the same again follows for u_r.
/// A row stands above row 0. The row above, the block before the first column and the row below the backing are zeros, or hold the
/// images that schemes read.
///
/// All access is unsafe: the caller promises that no other thread writes to the numbers it asks for.
pub struct Levels {
    arrays: Vec<Box<[UnsafeCell<f64>]>>,
    /// Number of node (0, 0) in each array.
    origins: Vec<usize>,
    rows: usize,
    columns: usize,
    /// Distance from u_z of a node to u_r of it, in numbers; the whole row where there is none.
    lateral: usize,
    stride: usize,
}

// SAFETY: numbers are reached through unsafe methods only, whose callers promise that no thread reads what another one
// writes.
#[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
unsafe impl Sync for Levels {}

#[expect(unsafe_code, reason = "tiles of one array are updated in place by several threads")]
impl Levels {
    /// A field at rest.
    ///
    /// * `levels`: 2 or 3
    /// * `displacements`: 1 or 2
    /// * `rows`: with the backing and the row below it
    pub fn new(levels: usize, displacements: usize, rows: usize, columns: usize) -> Self {
        let columns = columns.next_multiple_of(BLOCK);
        // rows that are a multiple of 4 KiB apart would share the same sets of the first cache: an odd number of lines
        // kernels of two displacements look two blocks ahead
        let lines = (columns + (1 + displacements) * BLOCK).div_ceil(LINE);
        let lateral = lines * LINE;
        let stride = ((displacements * lines) | 1) * LINE;
        let array = || {
            // untouched zeros take no memory
            let numbers = vec![0.0; (rows + 1) * stride + LINE].into_boxed_slice();
            // SAFETY: an `UnsafeCell<f64>` looks like an `f64` in memory
            unsafe { Box::from_raw(Box::into_raw(numbers) as *mut [UnsafeCell<f64>]) }
        };
        let arrays: Vec<Box<[UnsafeCell<f64>]>> = (0..levels).map(|_| array()).collect();
        let origin = |array: &[UnsafeCell<f64>]| {
            array.as_ptr().align_offset(LINE * size_of::<f64>()).min(LINE) + stride + BLOCK
        };
        Self {
            origins: arrays.iter().map(|array| origin(array)).collect(),
            arrays,
            rows,
            columns,
            lateral,
            stride,
        }
    }

    /// A number that stands for the level two below `level`, also where that is negative: it has the same array.
    pub fn two_below(&self, level: usize) -> usize {
        level + self.arrays.len() - 2
    }

    /// Number of rows, with the one below the backing.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns, a whole number of blocks.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Distance from a node to the one below it, in numbers.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Distance from u_z of a node to u_r of it, in numbers.
    pub fn lateral(&self) -> usize {
        self.lateral
    }

    /// Node (0, 0) of a level; the row above and the blocks before and after a row belong to what may be read.
    pub fn origin(&self, level: usize) -> *mut f64 {
        let number = level % self.arrays.len();
        let cell = self.arrays[number].as_ptr().wrapping_add(self.origins[number]);
        UnsafeCell::raw_get(cell)
    }

    /// Some columns of row `j` at a level; after the last one there is a block of zeros.
    ///
    /// # Safety
    ///
    /// No thread writes to them while the slice lives.
    pub unsafe fn part(&self, level: usize, j: usize, columns: Range<usize>) -> &[f64] {
        assert!(j < self.rows && columns.start <= columns.end && columns.end <= self.columns + BLOCK);
        // SAFETY: columns of a row and the zeros behind it lie inside the array; the caller promises the rest
        unsafe {
            let first = self.origin(level).add(j * self.stride + columns.start);
            std::slice::from_raw_parts(first, columns.len())
        }
    }

    /// The first columns of row `j` at a level, to be changed.
    ///
    /// # Safety
    ///
    /// No other thread touches them while the slice lives, nor is there another slice of them.
    #[expect(clippy::mut_from_ref, reason = "the caller promises that there is no other")]
    pub unsafe fn part_mut(&self, level: usize, j: usize, columns: usize) -> &mut [f64] {
        assert!(j < self.rows && columns <= self.columns);
        // SAFETY: columns of a row lie inside the array; the caller promises the rest
        unsafe { std::slice::from_raw_parts_mut(self.origin(level).add(j * self.stride), columns) }
    }

    /// Some columns of a displacement of row `j` at a level, to be changed.
    ///
    /// # Safety
    ///
    /// As [`Levels::part_mut`].
    #[expect(clippy::mut_from_ref, reason = "the caller promises that there is no other")]
    pub unsafe fn columns_mut(
        &self,
        level: usize,
        j: usize,
        field: usize,
        columns: &Range<usize>,
    ) -> &mut [f64] {
        let offset = field * self.lateral;
        assert!(j < self.rows && columns.start <= columns.end && columns.end <= self.columns);
        assert!(offset + self.columns + BLOCK <= self.stride);
        // SAFETY: columns of a row lie inside the array; the caller promises the rest
        unsafe {
            let first = self.origin(level).add(j * self.stride + offset + columns.start);
            std::slice::from_raw_parts_mut(first, columns.len())
        }
    }

    /// Writes zeros to `rows` rows from row `j` on. Reading an untouched page maps the shared zero page and faults again
    /// on the first write; writing zeros first avoids the second fault.
    ///
    /// # Safety
    ///
    /// No other thread touches these rows meanwhile.
    pub unsafe fn open(&self, j: usize, rows: usize) {
        assert!(j + rows <= self.rows, "rows {j} to {} of {}", j + rows, self.rows);
        for level in 0..self.arrays.len() {
            // SAFETY: the rows lie inside the array; the caller promises the rest
            unsafe {
                let first = self.origin(level).sub(BLOCK).add(j * self.stride);
                std::slice::from_raw_parts_mut(first, rows * self.stride).fill(0.0);
            }
        }
    }

    /// Writes the images of two columns about the axis, `u_{−1−i} = ±u_i`, in row `j` at a level.
    ///
    /// * `offset`: of the displacement, 0 or [`Levels::lateral`]
    ///
    /// # Safety
    ///
    /// No other thread touches the row's first columns meanwhile.
    pub unsafe fn reflect_axis(&self, level: usize, j: usize, offset: usize, sign: f64) {
        assert!(j < self.rows && offset + self.columns + BLOCK <= self.stride);
        // SAFETY: a block lies before the first column, and the row has a block at least
        unsafe {
            let first = self.origin(level).add(j * self.stride + offset);
            *first.sub(1) = sign * *first;
            *first.sub(2) = sign * *first.add(1);
        }
    }

    /// u_r in row `j` at a level.
    ///
    /// # Safety
    ///
    /// As [`Levels::part`].
    pub unsafe fn lateral_part(&self, level: usize, j: usize) -> &[f64] {
        assert!(self.lateral < self.stride - self.columns && j < self.rows);
        // SAFETY: columns of a row lie inside the array; the caller promises the rest
        unsafe {
            let first = self.origin(level).add(j * self.stride + self.lateral);
            std::slice::from_raw_parts(first, self.columns)
        }
    }

    /// The first columns of u_r in row `j` at a level, to be changed.
    ///
    /// # Safety
    ///
    /// As [`Levels::part_mut`].
    #[expect(clippy::mut_from_ref, reason = "the caller promises that there is no other")]
    pub unsafe fn lateral_mut(&self, level: usize, j: usize, columns: usize) -> &mut [f64] {
        assert!(self.lateral < self.stride - self.columns && j < self.rows && columns <= self.columns);
        // SAFETY: columns of a row lie inside the array; the caller promises the rest
        unsafe {
            let first = self.origin(level).add(j * self.stride + self.lateral);
            std::slice::from_raw_parts_mut(first, columns)
        }
    }

    /// Some columns of row `j` at a level and the one before them, which may be an image about the axis.
    ///
    /// * `offset`: of the displacement, 0 or [`Levels::lateral`]
    ///
    /// # Safety
    ///
    /// As [`Levels::part`].
    pub unsafe fn cells(&self, level: usize, j: usize, offset: usize, columns: &Range<usize>) -> &[f64] {
        assert!(j < self.rows && columns.start <= columns.end && columns.end <= self.columns);
        assert!(offset + self.columns + BLOCK <= self.stride);
        // SAFETY: a block lies before the first column, and columns of a row inside the array; the caller promises the rest
        unsafe {
            let first = self.origin(level).add(j * self.stride + offset + columns.start).sub(1);
            std::slice::from_raw_parts(first, columns.len() + 1)
        }
    }

    /// Number at column `i` of row `j` at a level, images about the axis and the zeros behind the last column among them.
    ///
    /// * `offset`: of the displacement, 0 or [`Levels::lateral`]
    ///
    /// # Safety
    ///
    /// No thread writes to it meanwhile.
    pub unsafe fn at(&self, level: usize, j: usize, offset: usize, i: isize) -> f64 {
        debug_assert!(j < self.rows && (-2..(self.columns + BLOCK) as isize).contains(&i));
        // SAFETY: two images before the first column and a block after the last one lie inside the array; the caller promises the
        // rest
        unsafe { *self.origin(level).add(j * self.stride + offset).offset(i) }
    }

    /// Writes `columns` of row `j` at a level, with the images about the axis, times `sign` to row `to`.
    ///
    /// # Safety
    ///
    /// No other thread touches these columns of either row meanwhile.
    pub unsafe fn reflect_row(&self, level: usize, j: usize, to: isize, sign: f64, columns: &Range<usize>) {
        assert!(j < self.rows && (-1..self.rows as isize).contains(&to) && columns.end <= self.columns);
        let images = if columns.start == 0 { 2 } else { 0 };
        // SAFETY: the columns and those images lie inside the array, in both rows
        unsafe {
            let from = self.origin(level).add(j * self.stride + columns.start).sub(images);
            let to = self.origin(level).offset(to * self.stride as isize).add(columns.start).sub(images);
            for i in 0..columns.len() + images {
                *to.add(i) = sign * *from.add(i);
            }
        }
    }

    /// Number of levels that are kept.
    pub fn count(&self) -> usize {
        self.arrays.len()
    }

    /// A row at a level with the images before its first column, of which schemes read [`IMAGES`].
    ///
    /// * `j`: −1 is the row above the surface, which holds images
    /// * `offset`: of the displacement, 0 or [`Levels::lateral`]
    ///
    /// # Safety
    ///
    /// As [`Levels::part_mut`].
    #[expect(clippy::mut_from_ref, reason = "the caller promises that there is no other")]
    pub unsafe fn with_images(&self, level: usize, j: isize, offset: usize, columns: usize) -> &mut [f64] {
        assert!((-1..self.rows as isize).contains(&j) && columns <= self.columns);
        assert!(offset + self.columns + BLOCK <= self.stride);
        // SAFETY: a row stands above row 0 and a block before the first column; the caller promises the rest
        unsafe {
            let first = self.origin(level).offset(j * self.stride as isize).add(offset).sub(IMAGES);
            std::slice::from_raw_parts_mut(first, IMAGES + columns)
        }
    }
}

/// Distances, in numbers, from a row to the rows that stand two above, above, below, two and three below it for the scheme; the last is what
/// stands two below the next row. At faces of layers and beside them these are images.
pub type Around = [isize; 5];

/// Where no face is near.
pub fn around(stride: usize) -> Around {
    [-2, -1, 1, 2, 3].map(|rows| rows * stride as isize)
}

/// Part of a field that is advanced in place.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// Node (0, 0) of level k−1.
    pub before: *const f64,
    /// Node (0, 0) of level k.
    pub now: *const f64,
    /// Node (0, 0) of level k+1, which is written; without the mixed-derivative correction it may be level k−1 itself.
    pub next: *mut f64,
    /// Distance from a node to the one below it, in numbers.
    pub stride: usize,
    /// What is around one or two rows by themselves, if not what stands there.
    pub around: Option<Around>,
    /// Radial weights times `λ²/4`. 0 where there is no neighbour.
    pub radial: Radial<'a>,
    /// The mixed-derivative correction, if there is one.
    pub corner: Option<CornerTerm<'a>>,
}

/// The mixed-derivative correction of the scheme, see [`crate::model::scheme::Corner`].
#[derive(Clone, Copy)]
pub struct CornerTerm<'a> {
    /// ρ: share of level k−1 in the combination of levels.
    pub share: f64,
    /// Radial weights times α, see [`crate::model::scheme::corner_weights`].
    pub radial: Radial<'a>,
}

/// Radial weights by column, for whole blocks.
#[derive(Clone, Copy)]
pub struct Radial<'a> {
    /// Of the faces at larger radius.
    pub outward: &'a [f64],
    /// Of the faces at smaller radius.
    pub inward: &'a [f64],
}

impl Radial<'_> {
    /// Weights of a column.
    pub fn column(&self, i: usize) -> RadialWeights {
        RadialWeights { outward: self.outward[i], inward: self.inward[i] }
    }

    /// Those of the lanes from column `i` on.
    ///
    /// # Safety
    ///
    /// The machine has the instructions of `L`; there are lanes at `i`.
    #[inline(always)]
    #[expect(unsafe_code, reason = "instructions that not every machine has")]
    pub unsafe fn at<L: Lane>(&self, i: usize) -> RadialWeights<L> {
        // SAFETY: the caller's promise
        unsafe {
            let (outward, inward) = (self.outward.as_ptr(), self.inward.as_ptr());
            RadialWeights { outward: L::load(outward.add(i)), inward: L::load(inward.add(i)) }
        }
    }

    /// True if it has these columns.
    pub fn has(&self, columns: &Range<usize>) -> bool {
        columns.end <= self.outward.len() && columns.end <= self.inward.len()
    }
}
