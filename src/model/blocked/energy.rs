//! Energy of rows, summed the same way with any instructions.

use super::lane::{BLOCK, Lane};

/// Energy of a row as the leapfrog scheme conserves it, each up to a factor of the mesh: between levels k−1 and k, and
/// between levels k and k+1.
///
/// Strain energy between two levels is a product of strains at both. Summed by parts over the whole field it is the work of
/// the forces at level k on the displacement at the other level, and forces are what accelerates, but for damping,
/// `f^k = u^{k+1} − 2u^k + u^{k−1} + σC(u^k − u^{k−1})`. Each row's energy is computed independently, without using
/// conservation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowEnergy {
    /// `Σ_i a_i (u^k − u^{k−1})²` and `Σ_i a_i (u^{k+1} − u^k)²`
    pub kinetic: [f64; 2],
    /// `−Σ_i a_i u^{k−1} f^k` and `−Σ_i a_i u^{k+1} f^k`
    pub strain: [f64; 2],
}

/// A sum over columns in [`BLOCK`] interleaved sums: column i adds to sum `i mod BLOCK`. So it is the same with any
/// instructions, and however the columns are cut.
type Interleaved = [f64; BLOCK];

/// A [`RowEnergy`] that is being summed up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergySum {
    /// Kinetic energies, strain energies but for their sign.
    sums: [Interleaved; 4],
}

impl EnergySum {
    /// Adds a vector of columns from number `i` on, a whole number of vectors.
    ///
    /// * `area`: cell areas
    /// * `levels`: u^{k−1}, u^k, u^{k+1}
    /// * `force`: f^k
    ///
    #[inline(always)]
    #[expect(unsafe_code, reason = "sums in memory")]
    pub fn add<L: Lane>(&mut self, i: usize, area: L, levels: [L; 3], force: L) {
        let [before, now, next] = levels;
        let (moved, next_moved) = (now - before, next - now);
        let terms = [moved * moved, next_moved * next_moved, before * force, next * force];
        for (sum, term) in self.sums.iter_mut().zip(terms) {
            // SAFETY: lanes from a multiple of WIDTH below BLOCK on lie within BLOCK numbers
            unsafe {
                let place = sum.as_mut_ptr().add(i / L::WIDTH * L::WIDTH % BLOCK);
                L::load(place).add_product(area, term).store(place);
            }
        }
    }

    /// Adds column `i` alone.
    ///
    /// * `area`: of its cell
    /// * `levels`: u^{k−1}, u^k, u^{k+1}
    /// * `force`: f^k
    pub fn add_one(&mut self, i: usize, area: f64, levels: [f64; 3], force: f64) {
        let [before, now, next] = levels;
        let (moved, next_moved) = (now - before, next - now);
        let terms = [moved * moved, next_moved * next_moved, before * force, next * force];
        for (sum, term) in self.sums.iter_mut().zip(terms) {
            let sum = &mut sum[i % BLOCK];
            *sum = area.mul_add(term, *sum);
        }
    }

    /// The energy of the surface. What the contact does to it is not strain, so forces are those on a free surface.
    ///
    /// * `area`: cell areas
    /// * `levels`: u_0 at levels k−1, k, k+1, as many nodes
    /// * `free`: u_0 at level k+1 without contact and damping, see [`super::kernel::FreeSurface`]
    pub fn of_surface(area: &[f64], levels: [&[f64]; 3], free: &[f64]) -> Self {
        let [before, now, next] = levels;
        let mut energy = Self::default();
        for i in 0..next.len() {
            let force = (free[i] - now[i]) - (now[i] - before[i]);
            energy.add_one(i, area[i], [before[i], now[i], next[i]], force);
        }
        energy
    }

    /// The sums.
    pub fn total(&self) -> RowEnergy {
        let [before, after, strain_before, strain_after] = self.sums.map(|sums| sums.iter().sum::<f64>());
        RowEnergy { kinetic: [before, after], strain: [-strain_before, -strain_after] }
    }
}
