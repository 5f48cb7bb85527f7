//! The field in memory that several threads work on, two levels of it, and the weights of the scheme by column.

use std::{cell::UnsafeCell, ops::Range};

use super::{
    dispatch::Instructions,
    kernel::{EnergySum, Patch},
    vector::BLOCK,
};
use crate::{
    grid::Grid,
    model::{Lattice, scheme::RadialWeights},
};

/// Numbers in a line of the cache.
const LINE: usize = 8;

/// Two levels of a field, row by row. Level k is in the array `k % 2`. Every row has a block of zeros before its first
/// column and after its last one, and begins at a line of the cache.
///
/// All access is unsafe: the caller promises that no other thread writes to the numbers it asks for.
pub struct Levels {
    arrays: [Box<[UnsafeCell<f64>]>; 2],
    /// Number that each array begins with.
    start: [usize; 2],
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
    pub fn new(rows: usize, columns: usize) -> Self {
        let columns = columns.next_multiple_of(BLOCK);
        // rows that are a multiple of 4 KiB apart would share the same sets of the first cache: an odd number of lines
        let lines = (columns + 2 * BLOCK).div_ceil(LINE) | 1;
        let stride = lines * LINE;
        let array = || {
            // untouched zeros take no memory
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

    /// Number of columns, a whole number of blocks.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Distance from a node to the one below it, in numbers.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Node (0, 0) of a level; the zeros before a row belong to what may be read.
    pub fn origin(&self, level: usize) -> *mut f64 {
        let cell = self.arrays[level % 2].as_ptr().wrapping_add(self.start[level % 2] + BLOCK);
        UnsafeCell::raw_get(cell)
    }

    /// Some columns of row `j` at a level; after the last one there is a zero.
    ///
    /// # Safety
    ///
    /// No thread writes to them while the slice lives.
    pub unsafe fn part(&self, level: usize, j: usize, columns: Range<usize>) -> &[f64] {
        assert!(j < self.rows && columns.start <= columns.end && columns.end <= self.columns + 1);
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
        for level in [0, 1] {
            // SAFETY: the rows lie inside the array; the caller promises the rest
            unsafe {
                let first = self.origin(level).sub(BLOCK).add(j * self.stride);
                std::slice::from_raw_parts_mut(first, rows * self.stride).fill(0.0);
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
    /// Radial weights towards larger radii by column, for whole blocks.
    outward: Vec<f64>,
    /// Radial weights towards smaller radii by column, for whole blocks.
    inward: Vec<f64>,
    /// Instructions to use.
    instructions: Instructions,
}

impl Domain {
    /// A mesh at rest.
    ///
    /// * `weights`: radial weights of the scheme, by column
    pub fn new(grid: &Grid, weights: &[RadialWeights], instructions: Instructions) -> Self {
        let levels = Levels::new(grid.nz + 1, grid.nr());
        let padded = |numbers: &mut dyn Iterator<Item = f64>| {
            let mut numbers: Vec<f64> = numbers.collect();
            numbers.resize(levels.columns(), 0.0);
            numbers
        };
        Self {
            lattice: Lattice::of(grid),
            dt: grid.dt(),
            nr: grid.nr(),
            backing: grid.nz,
            area: padded(&mut grid.area.iter().copied()),
            outward: padded(&mut weights.iter().map(|weights| weights.outward)),
            inward: padded(&mut weights.iter().map(|weights| weights.inward)),
            instructions,
            levels,
        }
    }

    /// Cell areas by column, for whole blocks.
    pub fn area(&self) -> &[f64] {
        &self.area
    }

    /// Radial weights by column, outward and inward, for whole blocks.
    pub fn weights(&self) -> [&[f64]; 2] {
        [&self.outward, &self.inward]
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
    /// The nodes hold the two levels before, as do a row and a vector around them; no other thread touches the nodes or
    /// writes to those around them.
    #[expect(unsafe_code, reason = "several threads update the field in place")]
    pub unsafe fn advance(
        &self,
        level: usize,
        rows: Range<usize>,
        columns: Range<usize>,
        energies: Option<&mut [EnergySum]>,
    ) {
        assert!(rows.start > 0 && rows.end < self.levels.rows() && columns.end <= self.levels.columns());
        let patch = Patch {
            now: self.levels.origin(level - 1),
            next: self.levels.origin(level),
            stride: self.levels.stride(),
            outward: &self.outward,
            inward: &self.inward,
        };
        // SAFETY: rows and columns lie inside the arrays with a row and a block around them, as has just been checked; the
        // caller promises the rest
        unsafe {
            match energies {
                Some(energies) => {
                    self.instructions.advance::<true>(patch, rows, columns, &self.area, energies);
                }
                None => self.instructions.advance::<false>(patch, rows, columns, &[], &mut []),
            }
        }
    }
}
