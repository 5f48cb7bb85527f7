//! Exchange of a model and the contact on z = 0.
//!
//! In step k the model predicts the displacement of its surface nodes at level k+1 without pressure, and the compliance of
//! each; the contact returns the pressure and the resulting displacement.

use std::io;

use crate::state::{StateError, StateReader, StateWriter};

/// The surface nodes during one step. All arrays have the shape `(nr,)`.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Displacement u_free^{k+1} of the surface if it were free of stress during step k \[R\].
    pub free: Vec<f64>,
    /// Displacement per unit of pressure, `∂u^{k+1}/∂p^k` \[R/(γc_p²)\].
    pub compliance: Vec<f64>,
    /// Pressure p^k on the surface, compression positive \[γc_p²\].
    pub pressure: Vec<f64>,
    /// Displacement u^{k+1} of the surface under that pressure \[R\].
    pub displacement: Vec<f64>,
    /// Number of leading nodes that have been loaded so far; pressure beyond them has always been 0.
    pub loaded: usize,
}

impl Surface {
    /// A surface of `nr` nodes at rest.
    pub fn new(nr: usize) -> Self {
        let zeros = || vec![0.0; nr];
        Self { free: zeros(), compliance: zeros(), pressure: zeros(), displacement: zeros(), loaded: 0 }
    }

    /// Work of the pressure during a step, `½ Σ a_i p_i (u_i^{k+1} − u_i^{k−1})` \[πR³γc_p²; plane R²γc_p²\].
    ///
    /// * `area`: a_i \[R²; plane R\]
    /// * `motion`: displacements at levels k−1 and k, which become those at k and k+1 \[R\]
    pub fn work(&self, area: &[f64], motion: &mut [Vec<f64>; 2]) -> f64 {
        let [before, now] = motion;
        let Self { pressure, displacement, loaded, .. } = self;
        let nodes = area.iter().zip(pressure).zip(displacement.iter().zip(before.iter()));
        let work =
            nodes.take(*loaded).map(|((area, p), (next, before))| 0.5 * area * p * (next - before)).sum();
        before.copy_from_slice(displacement);
        std::mem::swap(before, now);
        work
    }

    /// Writes the surface.
    ///
    /// # Errors
    ///
    /// The stream cannot be written.
    pub fn save(&self, out: &mut StateWriter<'_>) -> io::Result<()> {
        let Self { free, compliance, pressure, displacement, loaded } = self;
        out.put(loaded)?;
        [free, compliance, pressure, displacement].into_iter().try_for_each(|array| out.numbers(array))
    }

    /// Restores the state written by [`Surface::save`].
    ///
    /// # Errors
    ///
    /// The stream cannot be read, or is that of another surface.
    pub fn load(&mut self, from: &mut StateReader<'_>) -> Result<(), StateError> {
        let Self { free, compliance, pressure, displacement, loaded } = self;
        *loaded = from.get()?;
        StateError::unless(*loaded <= free.len(), "number of loaded nodes", *loaded)?;
        [free, compliance, pressure, displacement].into_iter().try_for_each(|array| from.numbers(array))
    }
}
