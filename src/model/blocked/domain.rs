//! The field in memory that several threads work on, two or three levels of it, and the weights of the scheme by column.
//!
//! Without the corner term a node needs itself at level k−1 and its neighbours at level k, so two levels do: k+1 overwrites
//! k−1. The corner term reads neighbours two rows and columns away at level k−1 too; with it there are three levels.

use std::{cell::UnsafeCell, ops::Range};

use super::{
    dispatch::Instructions,
    energy::EnergySum,
    patch::{CornerTerm, Patch},
    vector::BLOCK,
};
use crate::{
    grid::Grid,
    model::{
        Lattice,
        scheme::{Corner, RadialWeights},
    },
};

/// Numbers in a line of the cache.
const LINE: usize = 8;

/// Some levels of a field, row by row. Level k is in the array `k % arrays`. Every row has a block before its first column and
/// a block of zeros after its last one, and begins at a line of the cache. A row stands above row 0. The row above, the block
/// before the first column and the row below the backing are zeros, or hold the images that the corner term reads.
///
/// All access is unsafe: the caller promises that no other thread writes to the numbers it asks for.
pub struct Levels {
    arrays: Vec<Box<[UnsafeCell<f64>]>>,
    /// Number of node (0, 0) in each array.
    origins: Vec<usize>,
    rows: usize,
    columns: usize,
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
    /// * `rows`: with the backing and the row below it
    pub fn new(levels: usize, rows: usize, columns: usize) -> Self {
        let columns = columns.next_multiple_of(BLOCK);
        // rows that are a multiple of 4 KiB apart would share the same sets of the first cache: an odd number of lines
        let lines = (columns + 2 * BLOCK).div_ceil(LINE) | 1;
        let stride = lines * LINE;
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
        Self { origins: arrays.iter().map(|array| origin(array)).collect(), arrays, rows, columns, stride }
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

    /// Writes zeros to `rows` rows from row `j` on. The system gives memory out twice if it is read before it is written to,
    /// and the second time all threads stop for it.
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

    /// Writes the images of two columns about the axis, `u_{−1−i} = u_i`, in row `j` at a level.
    ///
    /// # Safety
    ///
    /// No other thread touches the row's first columns meanwhile.
    unsafe fn reflect_axis(&self, level: usize, j: usize) {
        assert!(j < self.rows);
        // SAFETY: a block lies before the first column, and the row has a block at least
        unsafe {
            let first = self.origin(level).add(j * self.stride);
            *first.sub(1) = *first;
            *first.sub(2) = *first.add(1);
        }
    }

    /// Writes `columns` of row `j` at a level, with the images about the axis, times `sign` to row `to`.
    ///
    /// # Safety
    ///
    /// No other thread touches these columns of either row meanwhile.
    unsafe fn reflect_row(&self, level: usize, j: usize, to: isize, sign: f64, columns: &Range<usize>) {
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
}

/// What the engine works on.
pub struct Domain {
    /// The field.
    pub levels: Levels,
    /// The nodes of the mesh.
    pub lattice: Lattice,
    /// Time of a step \[R/c_p\].
    pub dt: f64,
    /// Number of columns of the mesh; those that fill the last block have no weight and stay at rest.
    pub nr: usize,
    /// Row of the backing.
    pub backing: usize,
    /// Cell areas by column, for whole blocks.
    area: Vec<f64>,
    /// Radial weights of the scheme.
    weights: Weights,
    /// The corner term with its radial weights, if there is one.
    corner: Option<(Corner, Weights)>,
    /// Instructions to use.
    instructions: Instructions,
}

/// Radial weights by column, for whole blocks.
struct Weights {
    outward: Vec<f64>,
    inward: Vec<f64>,
}

impl Weights {
    fn new(weights: &[RadialWeights], columns: usize) -> Self {
        Self {
            outward: padded(weights.iter().map(|weights| weights.outward), columns),
            inward: padded(weights.iter().map(|weights| weights.inward), columns),
        }
    }
}

/// Numbers by column, with zeros for the columns that fill the last block.
fn padded(numbers: impl Iterator<Item = f64>, columns: usize) -> Vec<f64> {
    let mut numbers: Vec<f64> = numbers.collect();
    numbers.resize(columns, 0.0);
    numbers
}

impl Domain {
    /// A mesh at rest.
    ///
    /// * `weights`: radial weights of the scheme, by column
    /// * `corner`: the corner term with its radial weights, if there is one
    pub fn new(
        grid: &Grid,
        weights: &[RadialWeights],
        corner: Option<(Corner, &[RadialWeights])>,
        instructions: Instructions,
    ) -> Self {
        let count = Corner::levels(corner.as_ref().map(|(corner, _)| corner));
        let levels = Levels::new(count, grid.nz + 2, grid.nr());
        let columns = levels.columns();
        Self {
            lattice: Lattice::of(grid),
            dt: grid.dt(),
            nr: grid.nr(),
            backing: grid.nz,
            area: padded(grid.area.iter().copied(), columns),
            weights: Weights::new(weights, columns),
            corner: corner.map(|(corner, weights)| (corner, Weights::new(weights, columns))),
            instructions,
            levels,
        }
    }

    /// Rows and columns, and levels less one, around a node that its next level depends on.
    pub fn reach(&self) -> usize {
        if self.corner.is_some() { 2 } else { 1 }
    }

    /// Cell areas by column, for whole blocks.
    pub fn area(&self) -> &[f64] {
        &self.area
    }

    /// Radial weights by column, outward and inward, for whole blocks.
    pub fn weights(&self) -> [&[f64]; 2] {
        [&self.weights.outward, &self.weights.inward]
    }

    /// The corner term, if there is one.
    pub fn corner(&self) -> Option<CornerTerm<'_>> {
        let (corner, Weights { outward, inward }) = self.corner.as_ref()?;
        Some(CornerTerm { share: corner.share, outward, inward })
    }

    /// Numbers in a vector.
    pub fn width(&self) -> usize {
        self.instructions.width()
    }

    /// Row before the backing.
    pub fn last_row(&self) -> usize {
        self.backing - 1
    }

    /// Advances `rows` of `columns`, whole vectors, to `level`.
    ///
    /// * `energies`: of `rows`, to add theirs to, if it is to be counted
    ///
    /// # Safety
    ///
    /// The nodes hold the two levels before, as do [`Domain::reach`] rows and a vector around them, images among them; no other
    /// thread touches the nodes or writes to those around them.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn advance(
        &self,
        level: usize,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: Option<&mut [EnergySum]>,
    ) {
        assert!(rows.start > 0 && rows.end <= self.backing && columns.end <= self.levels.columns());
        let patch = Patch {
            before: self.levels.origin(self.levels.two_below(level)),
            now: self.levels.origin(level - 1),
            next: self.levels.origin(level),
            stride: self.levels.stride(),
            outward: &self.weights.outward,
            inward: &self.weights.inward,
            corner: self.corner(),
        };
        // SAFETY: rows and columns lie inside the arrays with a row and a block around them, and with the corner term, which
        // reads two rows, with the images beyond row 0 and the backing, as has just been checked; the caller promises the rest
        unsafe {
            match energies {
                Some(energies) => {
                    self.instructions.advance::<true>(patch, rows, columns, &self.area, energies);
                }
                None => self.instructions.advance::<false>(patch, rows, columns, &[], &mut []),
            }
        }
    }

    /// Writes the images of `rows` and `columns` that have just been advanced to `level`, which the corner term reads.
    ///
    /// # Safety
    ///
    /// No other thread touches these columns of the rows and their images meanwhile.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn reflect(&self, level: usize, rows: &Range<usize>, columns: &Range<usize>) {
        if self.corner.is_none() || columns.is_empty() {
            return;
        }
        // SAFETY, of all below: the caller's promise
        unsafe {
            if columns.start == 0 {
                rows.clone().for_each(|j| self.levels.reflect_axis(level, j));
            }
            if rows.contains(&1) && self.backing > 1 {
                self.levels.reflect_row(level, 1, -1, 1.0, columns);
            }
            if rows.contains(&self.last_row()) {
                self.levels.reflect_row(level, self.last_row(), self.backing as isize + 1, -1.0, columns);
            }
        }
    }
}
