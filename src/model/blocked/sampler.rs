//! What a frame shows, sampled while tiles pass it, without draining the pipeline.
//!
//! The interior is never at one level as a whole. But when some nodes go on to level k+1 they are at levels k−1, k and k+1
//! at once, which makes the energies between k−1 and k and between k and k+1; they are summed up on the way. Just after,
//! level k still stands around them, and the sampler takes its fields node by node, from memory that is at hand anyway. Which
//! thread does it when changes no number: fields are taken one by one, and sums over a row go on from tile to tile.

use std::{ops::Range, sync::Arc};

use super::{
    domain::{Domain, ShownRow, SurfaceMotion, Theory},
    energy::EnergySum,
    parts::Parts,
};
use crate::{
    grid::Grid,
    model::{Extent, Field, Frame, FrameFields, Sample, TargetEnergy},
};

/// A sampler of the field at level k, a frame, on its way to level k+1.
pub struct Sampler {
    /// Level k+1, which is about to be reached.
    level: usize,
    /// Energy, row by row.
    energies: Parts<EnergySum>,
    /// Fields at level k.
    fields: Vec<(Field, Parts<f32>)>,
    /// Size of the fields.
    extent: Extent,
    /// Columns of the fields that have moved.
    moved: usize,
    /// Nodes from one that is shown to the next along r.
    every: usize,
    /// Rows that are shown.
    rows: Arc<[usize]>,
    /// Displacement of the surface at level k.
    surface: Vec<f64>,
}

/// What is sampled before nodes are advanced and needed afterwards: u^{k−1} of those whose velocity is shown.
pub struct Before(Vec<f64>);

/// Rows and columns of a sampler that are shown, of some that are given.
struct Shown<'a> {
    rows: &'a [usize],
    /// Number of the first row among those shown.
    first: usize,
    /// Nodes.
    columns: Range<usize>,
    /// Their numbers among those shown.
    places: Range<usize>,
}

impl Sampler {
    /// A sampler about to begin.
    ///
    /// * `level`: the one that is about to be reached
    /// * `depths`: number of depths that may have moved
    /// * `rows`: that are shown, [`crate::grid::Grid::shown_rows`]
    /// * `surface`: displacement of the surface at the level before, out to the last column that has moved
    pub fn new(
        level: usize,
        grid: &Grid,
        depths: usize,
        (shown, rows): (&FrameFields, &Arc<[usize]>),
        surface: Vec<f64>,
    ) -> Self {
        let FrameFields { fields, every, columns } = shown;
        let shown = |nodes: usize| nodes.min(*columns).div_ceil(*every);
        let extent = Extent { nr: shown(grid.nr()), nz: rows.len() };
        let fields = fields.iter().map(|field| (*field, Parts::new(extent.nr * extent.nz)));
        Self {
            level,
            energies: Parts::new(grid.rows_at(0..depths).end),
            fields: fields.collect(),
            extent,
            moved: shown(surface.len().max(1)),
            every: *every,
            rows: Arc::clone(rows),
            surface,
        }
    }

    /// Level k+1: once all nodes have reached it the sampler has seen everything.
    pub fn level(&self) -> usize {
        self.level
    }

    /// What of `rows` and `columns` is shown.
    fn shown(&self, rows: &Range<usize>, columns: &Range<usize>) -> Shown<'_> {
        let Self { every, moved, .. } = *self;
        let places = columns.start.div_ceil(every)..columns.end.div_ceil(every).min(moved);
        let nodes = |places: &Range<usize>| places.start * every..(places.end.max(1) - 1) * every + 1;
        let [first, end] = [rows.start, rows.end].map(|end| self.rows.partition_point(|j| *j < end));
        Shown { rows: &self.rows[first..end], first, columns: nodes(&places), places }
    }

    /// Where the energy of `rows` is summed up.
    ///
    /// # Safety
    ///
    /// No other thread samples these rows while the slice lives, nor is there another slice of them.
    #[expect(unsafe_code, clippy::mut_from_ref, reason = "the caller promises that there is no other")]
    pub unsafe fn energies(&self, rows: Range<usize>) -> &mut [EnergySum] {
        // SAFETY: the caller's promise
        unsafe { self.energies.part(rows) }
    }

    /// Samples what of `rows` and `columns`, whole vectors, is gone once they are advanced.
    ///
    /// * `motion`: of row 0, if it is among the rows; then the columns are all there are
    ///
    /// # Safety
    ///
    /// The nodes hold levels k−1 and k. No other thread writes to them meanwhile, or samples these rows.
    #[expect(unsafe_code, reason = "a field and a sampler that threads share")]
    pub unsafe fn before<S: Theory>(
        &self,
        domain: &Domain<S>,
        rows: &Range<usize>,
        columns: &Range<usize>,
        motion: Option<SurfaceMotion<'_>>,
    ) -> Before {
        // SAFETY, here and below: the caller promises that these numbers can be read, and that no other thread samples the
        // rows; a slice of the energies ends before the next one begins
        let line = |level: usize, j: usize, columns: &Range<usize>| unsafe {
            domain.levels.part(level, j, columns.clone())
        };
        let earlier = domain.levels.two_below(self.level);
        if let Some(motion) = motion {
            // SAFETY: as above
            let energy = unsafe { S::surface_energy(domain, self.level, columns, motion) };
            let energies = unsafe { self.energies.part(0..1) };
            energies[0] = energy;
        }
        let mut before = Vec::new();
        if S::KEEPS_EARLIER {
            return Before(before);
        }
        let shown = self.shown(rows, columns);
        let shows_velocity = self.fields.iter().any(|(field, _)| *field == Field::Velocity);
        if shows_velocity && !shown.places.is_empty() {
            for &j in shown.rows {
                before.extend(line(earlier, j, &shown.columns).iter().step_by(self.every));
            }
        }
        Before(before)
    }

    /// Samples what `rows` and `columns`, whole vectors, show now that they have been advanced.
    ///
    /// * `before`: what [`Sampler::before`] has sampled of them
    /// * `motion`: of row 0, if it is among the rows
    ///
    /// # Safety
    ///
    /// The nodes hold levels k and k+1, and the rows above and below level k. No other thread writes to them meanwhile, or
    /// samples these rows.
    #[expect(unsafe_code, reason = "a field and a sampler that threads share")]
    pub unsafe fn after<S: Theory>(
        &self,
        domain: &Domain<S>,
        rows: &Range<usize>,
        columns: &Range<usize>,
        before: &Before,
        motion: Option<SurfaceMotion<'_>>,
    ) {
        let shown = self.shown(rows, columns);
        if shown.places.is_empty() {
            return;
        }
        let nodes = |j: usize, before| ShownRow {
            j,
            columns: shown.columns.clone(),
            every: self.every,
            before,
            pressure: motion.filter(|_| j == 0).map(|motion| motion.pressure),
        };
        for (field, values) in &self.fields {
            for (number, &j) in shown.rows.iter().enumerate() {
                let before = before.0.get(number * shown.places.len()..).unwrap_or_default();
                // SAFETY: the caller's promise; places of different nodes are different
                unsafe {
                    let row = values.part(self.place(shown.first + number, &shown));
                    S::show(domain, self.level, *field, &nodes(j, before), row);
                }
            }
            let backing = domain.grid.nz;
            if *field == Field::Stress
                && domain.last_row() < backing
                && self.rows.last() == Some(&backing)
                && rows.contains(&domain.last_row())
            {
                // SAFETY: the thread that has the row before the backing has the backing too
                unsafe {
                    let row = values.part(self.place(self.rows.len() - 1, &shown));
                    S::show(domain, self.level, *field, &nodes(backing, &[]), row);
                }
            }
        }
    }

    /// Where the shown columns of a shown row are among the values.
    fn place(&self, number: usize, shown: &Shown<'_>) -> Range<usize> {
        let row = number * self.extent.nr;
        row + shown.places.start..row + shown.places.end
    }

    /// What has been sampled.
    ///
    /// # Safety
    ///
    /// All nodes have reached the level of the sampler, and their sampling has happened before.
    #[expect(unsafe_code, reason = "a sampler that threads have shared")]
    pub unsafe fn finish<S: Theory>(&self, domain: &Domain<S>) -> Frame {
        let (grid, dt) = (&domain.grid, domain.grid.dt());
        let mut energy = [TargetEnergy::default(); 2];
        let mut layers = vec![energy; grid.layers.len()];
        // SAFETY, here and below: the caller's promise
        let energies = unsafe { self.energies.take() };
        // in the order of rows: the same sum on any number of threads
        for (j, row) in energies.into_iter().enumerate() {
            let row = row.total();
            let layer = grid.layer_of(j);
            let mass = 0.5 * (domain.theory.impedance(layer) * dt) * grid.cell_rows(j) / (dt * dt);
            for energy in [&mut energy, &mut layers[layer]] {
                for (energy, (kinetic, strain)) in
                    energy.iter_mut().zip(row.kinetic.into_iter().zip(row.strain))
                {
                    energy.kinetic += mass * kinetic;
                    energy.strain += mass * strain;
                }
            }
        }
        let sample = |(field, values): &(Field, Parts<f32>)| Sample {
            field: *field,
            extent: self.extent,
            values: unsafe { values.take() },
        };
        Frame {
            energy,
            layers,
            samples: self.fields.iter().map(sample).collect(),
            surface: self.surface.clone(),
        }
    }
}
