//! What frames show of the scheme of cells: fields of strains and stresses, node by node.

use super::{
    super::{domain::Domain, energy::EnergySum, weights::CellLayers},
    Sampler, Shown, SurfaceMotion,
};
use crate::model::{Field, scheme};

impl Sampler {
    /// Energy of both displacements of the surface: that of forces on a free surface, without damping.
    ///
    /// # Safety
    ///
    /// As [`Sampler::before`].
    #[expect(unsafe_code, reason = "a field that threads share")]
    pub(super) unsafe fn cell_surface_energy(
        &self,
        domain: &Domain,
        weights: &CellLayers,
        SurfaceMotion { displacement, lateral, .. }: SurfaceMotion<'_>,
    ) -> EnergySum {
        let levels = &domain.levels;
        let (before, now) = (levels.two_below(self.level), self.level - 1);
        // SAFETY: the caller's promise
        let at = |level: usize, field: usize, j: usize, i: isize| unsafe {
            levels.at(level, j, field * levels.lateral(), i)
        };
        let mut energy = EnergySum::default();
        let row = weights.scheme.at_row(0);
        for i in 0..displacement.len().min(domain.grid.nr()) {
            let forces = row.accelerations(|field, j, i| at(now, field, j, i), i);
            for (field, next) in [displacement[i], lateral[i]].into_iter().enumerate() {
                let [before, now] = [before, now].map(|level| at(level, field, 0, i as isize));
                energy.add_one(i, weights.layers[0].areas[field][i], [before, now, next], forces[field]);
            }
        }
        energy
    }

    /// A field of the scheme of cells at level k in row `j`.
    ///
    /// # Safety
    ///
    /// As [`Sampler::after`].
    #[expect(unsafe_code, clippy::too_many_arguments, reason = "a field that threads share")]
    pub(super) unsafe fn cell_field(
        &self,
        domain: &Domain,
        weights: &CellLayers,
        field: Field,
        j: usize,
        shown: &Shown<'_>,
        motion: Option<SurfaceMotion<'_>>,
        row: &mut [f32],
    ) {
        let levels = &domain.levels;
        // SAFETY: the caller's promise
        let at = |level: usize, field: usize, j: usize, i: isize| unsafe {
            levels.at(level, j, field * levels.lateral(), i)
        };
        let (before, now, next) = (levels.two_below(self.level), self.level - 1, self.level);
        let velocity = |field: usize, i: usize| {
            let [before, next] = [before, next].map(|level| at(level, field, j, i as isize));
            scheme::velocity(before, next, domain.grid.dt())
        };
        let nodes = weights.scheme.at_row(j);
        let stress = |i: usize| {
            let pressure = motion.filter(|_| j == 0).map_or(0.0, |motion| motion.pressure[i]);
            let strain = nodes.strain(|field, j, i| at(now, field, j, i), pressure, i);
            nodes.stress(field, &strain)
        };
        for (value, i) in row.iter_mut().zip(shown.columns.clone().step_by(self.every)) {
            *value = match field {
                Field::Displacement => at(now, 0, j, i as isize),
                Field::DisplacementR => at(now, 1, j, i as isize),
                Field::Velocity => velocity(0, i),
                Field::VelocityR => velocity(1, i),
                _ => stress(i),
            } as f32;
        }
    }
}
