//! What frames show, taken down while the interior passes by: nothing stops for a frame.
//!
//! The interior is never at one level as a whole. But when some nodes go on to level k+1 they are at levels k−1, k and k+1
//! at once, which makes the energy between k−1 and k, and the kinetic energy between k and k+1; it is counted on the way.
//! Just after, level k still stands around them, and a survey takes down its fields, node by node, in memory that is at hand
//! anyway. Who does it when changes no number: fields are taken one by one, and sums over a row go on from tile to tile.

use std::{cell::UnsafeCell, ops::Range};

use super::{
    Extent, Field, Sample, Show, TargetEnergy,
    stencil::Tally,
    sweep::{Ground, Top},
};

/// Numbers that several threads write, each its own part.
struct Parts<T>(Vec<UnsafeCell<T>>);

// SAFETY: numbers are reached through an unsafe method only, whose callers see to it that no two threads reach the same.
#[expect(unsafe_code, reason = "threads share a survey")]
unsafe impl<T: Send> Sync for Parts<T> {}

impl<T: Default> Parts<T> {
    /// `length` numbers, none of them but 0, with room for `most`.
    fn new(length: usize, most: usize) -> Self {
        let mut numbers = Vec::with_capacity(most.max(length));
        numbers.resize_with(length, UnsafeCell::default);
        Self(numbers)
    }

    /// Some of the numbers.
    ///
    /// # Safety
    ///
    /// Nobody else reaches these meanwhile.
    #[expect(unsafe_code, clippy::mut_from_ref, reason = "the caller answers for it")]
    unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        let cells = &self.0[range];
        // SAFETY: an `UnsafeCell<T>` looks like a `T` in memory; the caller answers for the rest
        unsafe { std::slice::from_raw_parts_mut(UnsafeCell::raw_get(cells.as_ptr()), cells.len()) }
    }

    /// All numbers.
    fn into_vec(self) -> Vec<T> {
        let mut cells = std::mem::ManuallyDrop::new(self.0);
        let (first, length, capacity) = (cells.as_mut_ptr(), cells.len(), cells.capacity());
        // SAFETY: an `UnsafeCell<T>` looks like a `T` in memory, and nobody else has the vector
        #[expect(unsafe_code, reason = "the same memory, without the cells")]
        unsafe {
            Vec::from_raw_parts(first.cast(), length, capacity)
        }
    }
}

/// A survey of the field at level k, a frame, on its way to level k+1.
pub struct Survey {
    /// Level k+1, which is about to be reached.
    level: usize,
    /// Energy, row by row.
    tallies: Parts<Tally>,
    /// Fields at level k.
    slices: Vec<(Field, Parts<f32>)>,
    extent: Extent,
    /// Nodes from one that is shown to the next.
    every: usize,
}

/// What a survey has found.
pub struct Found {
    /// Energy between levels k−1 and k.
    pub energy: TargetEnergy,
    /// Kinetic energy between levels k and k+1.
    pub next_kinetic: f64,
    /// Fields at level k.
    pub samples: Vec<Sample>,
}

/// What is taken down before nodes are advanced and needed afterwards: u^{k−1} of those whose velocity is shown.
pub struct Before(Vec<f64>);

/// Rows and columns of a survey that are shown, of some that are given.
struct Shown {
    rows: std::iter::StepBy<Range<usize>>,
    /// Nodes.
    columns: Range<usize>,
    /// Their numbers among those shown.
    places: Range<usize>,
}

impl Survey {
    /// A survey about to begin of a field of rows 0 to the backing.
    ///
    /// * `level`: the one that is about to be reached
    /// * `rows`: rows that may have moved
    /// * `show`: what is shown of the level before, `extent` of it
    pub fn new(level: usize, ground: &Ground, rows: usize, show: &Show, extent: Extent) -> Self {
        let Show { fields, every } = show;
        // as much room for every frame: then the memory of one that is done with fits the next
        let most = ground.levels.rows().div_ceil(*every) * ground.levels.columns().div_ceil(*every);
        let slices = fields.iter().map(|field| (*field, Parts::new(extent.nr * extent.nz, most))).collect();
        Self { level, tallies: Parts::new(rows, 0), slices, extent, every: *every }
    }

    /// What of `rows` and `columns` is shown.
    fn shown(&self, rows: &Range<usize>, columns: &Range<usize>) -> Shown {
        let Self { every, extent, .. } = *self;
        let places = columns.start.div_ceil(every)..columns.end.div_ceil(every).min(extent.nr);
        let nodes = |places: &Range<usize>| places.start * every..(places.end.max(1) - 1) * every + 1;
        let rows = rows.start.div_ceil(every)..rows.end.div_ceil(every).min(extent.nz);
        Shown { rows: nodes(&rows).step_by(every), columns: nodes(&places), places }
    }

    /// Where the energy of `rows` is summed up.
    ///
    /// # Safety
    ///
    /// Nobody else surveys these rows meanwhile.
    #[expect(unsafe_code, clippy::mut_from_ref, reason = "the caller answers for it")]
    pub unsafe fn tallies(&self, rows: Range<usize>) -> &mut [Tally] {
        // SAFETY: handed on to the caller
        unsafe { self.tallies.part(rows) }
    }

    /// Takes down what of `rows` and `columns`, whole vectors, is gone once they are advanced.
    ///
    /// * `top`: row 0, if it is among the rows; then the columns are all there are
    ///
    /// # Safety
    ///
    /// The nodes hold levels k−1 and k. Nobody writes to any of them meanwhile, or surveys these rows.
    #[expect(unsafe_code, reason = "a field and a survey that threads share")]
    pub unsafe fn before(
        &self,
        ground: &Ground,
        rows: Range<usize>,
        columns: Range<usize>,
        top: Option<Top<'_>>,
    ) -> Before {
        // SAFETY, here and below: the caller says that these numbers can be read, and that nobody else surveys the rows
        let line = |level: usize, j: usize, columns: &Range<usize>| unsafe {
            ground.levels.part(level, j, columns.clone())
        };
        if let Some(Top { displacement, free, .. }) = top {
            let [before, now] = [self.level, self.level - 1].map(|level| line(level, 0, &columns));
            let tally = unsafe { self.tallies.part(0..1) };
            tally[0] = Tally::of_surface(&ground.area, [before, now, displacement], free);
        }
        let mut before = Vec::new();
        let shown = self.shown(&rows, &columns);
        let shows_velocity = self.slices.iter().any(|(field, _)| *field == Field::Velocity);
        if shows_velocity && !shown.places.is_empty() {
            for j in shown.rows {
                before.extend(line(self.level, j, &shown.columns).iter().step_by(self.every));
            }
        }
        Before(before)
    }

    /// Takes down what `rows` and `columns`, whole vectors, show now that they have been advanced.
    ///
    /// * `before`: what [`Survey::before`] said of them
    /// * `top`: row 0, if it is among the rows
    ///
    /// # Safety
    ///
    /// The nodes hold levels k and k+1, and the rows above and below level k. Nobody writes to any of them meanwhile, or
    /// surveys these rows.
    #[expect(unsafe_code, reason = "a field and a survey that threads share")]
    pub unsafe fn after(
        &self,
        ground: &Ground,
        rows: Range<usize>,
        columns: Range<usize>,
        before: Before,
        top: Option<Top<'_>>,
    ) {
        let now = self.level - 1;
        let shown = self.shown(&rows, &columns);
        if shown.places.is_empty() {
            return;
        }
        // SAFETY, here and below: the caller says that these numbers can be read, and that nobody else surveys the rows
        let line = |level: usize, j: usize| unsafe { ground.levels.part(level, j, shown.columns.clone()) };
        for (field, values) in &self.slices {
            let place = |j: usize| unsafe { values.part(self.place(j, &shown)) };
            for (number, j) in shown.rows.clone().enumerate() {
                match field {
                    Field::Displacement => {
                        let here = line(now, j);
                        fill(place(j), self.every, |i| here[i]);
                    }
                    Field::Velocity => {
                        // (u^{k+1} − u^{k−1})/(2Δt)
                        let before = &before.0[number * shown.places.len()..];
                        let next = line(self.level, j).iter().step_by(self.every);
                        for ((value, next), before) in place(j).iter_mut().zip(next).zip(before) {
                            *value = ((next - before) / (2.0 * ground.dt)) as f32;
                        }
                    }
                    Field::Stress => match top {
                        Some(Top { pressure, .. }) if j == 0 => {
                            let pressure = &pressure[shown.columns.clone()];
                            fill(place(j), self.every, |i| pressure[i]);
                        }
                        _ => {
                            // −∂u/∂z
                            let (above, below) = (line(now, j - 1), line(now, j + 1));
                            fill(place(j), self.every, |i| (above[i] - below[i]) / (2.0 * ground.dz));
                        }
                    },
                }
            }
            // on the backing, with the odd image u_{nz+1} = −u_{nz−1}
            let backing = ground.last_row + 1;
            let is_shown = backing.is_multiple_of(self.every) && backing / self.every < self.extent.nz;
            if *field == Field::Stress && is_shown && rows.contains(&ground.last_row) {
                let above = line(now, ground.last_row);
                fill(place(backing), self.every, |i| above[i] / ground.dz);
            }
        }
    }

    /// Where the shown columns of row `j` are among the values.
    fn place(&self, j: usize, shown: &Shown) -> Range<usize> {
        let row = j / self.every * self.extent.nr;
        row + shown.places.start..row + shown.places.end
    }

    /// What has been found, once all nodes have been passed.
    pub fn end(self, ground: &Ground) -> Found {
        let (dz, dt) = (ground.dz, ground.dt);
        let mut energy = TargetEnergy::default();
        let mut next_kinetic = 0.0;
        // in the order of rows: the same sum on any number of threads
        for (j, tally) in self.tallies.into_vec().into_iter().enumerate() {
            let row = tally.total();
            // the surface has half a cell of mass
            let mass = 0.5 * dz * if j == 0 { 0.5 } else { 1.0 } / (dt * dt);
            energy.kinetic += mass * row.kinetic;
            energy.strain += mass * row.strain;
            next_kinetic += mass * row.next_kinetic;
        }
        let sample = |(field, values): (Field, Parts<f32>)| Sample {
            field,
            extent: self.extent,
            values: values.into_vec(),
        };
        Found { energy, next_kinetic, samples: self.slices.into_iter().map(sample).collect() }
    }
}

/// Writes every so many of some numbers, from the first on.
///
/// * `number`: the i-th of them
fn fill(values: &mut [f32], every: usize, number: impl Fn(usize) -> f64) {
    if every == 1 {
        values.iter_mut().enumerate().for_each(|(i, value)| *value = number(i) as f32);
    } else {
        values.iter_mut().enumerate().for_each(|(i, value)| *value = number(i * every) as f32);
    }
}
