//! Models of the target: what lies behind the surface.
//!
//! A model owns the displacement fields and advances them. It meets the contact only through [`Surface`] and shows
//! its fields only through [`Model::sample`]; it knows nothing of indenters, contact rules or recordings.
//!
//! | Model | Unknowns | File |
//! |---|---|---|
//! | `rakhmatulin` | `u_z` (\[KA\] Eq. 18) | [`rakhmatulin`] |

use serde::{Deserialize, Serialize};

use crate::surface::Surface;

pub mod cone;
pub mod interior;
pub mod lanes;
pub mod levels;
pub mod rakhmatulin;
pub mod stencil;
pub mod sweep;

/// Theory of the target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// Simplified theory with one displacement; \[KA\] Eq. 18.
    Rakhmatulin,
    /// Linear theory of elasticity; \[KA\] Eqs. 2, 3, 6.
    Elastic,
}

/// A field that a model can show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Field {
    /// Displacement u_z into the target \[R\].
    Displacement,
    /// Velocity ∂u_z/∂t \[c_p\].
    Velocity,
    /// Axial stress −σ_zz, compression positive like the interface stress \[γc_p²\].
    Stress,
}

impl Field {
    /// Its name in case files and topics.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Stress => "stress",
        }
    }
}

/// Energy of the target at a half step \[πR³γc_p²\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TargetEnergy {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Strain energy.
    pub strain: f64,
}

/// Largest axial strain on the backing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BackingPeak {
    /// |∂u_z/∂z|.
    pub strain: f64,
    /// Radius \[R\].
    pub r: f64,
    /// Step.
    pub step: u64,
}

/// Extent of a sampled field: rows and columns beyond it are at rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extent {
    /// Number of columns (radial nodes).
    pub nr: usize,
    /// Number of rows.
    pub nz: usize,
}

/// An elastic target, advanced explicitly in time.
///
/// Levels: before [`Model::advance`] of step k the model stands between levels k−1 and k, after it between k
/// and k+1.
pub trait Model: Send {
    /// Fills in the surface that would be free of stress during step k, and its compliance.
    fn predict(&mut self, surface: &mut Surface);

    /// Advances from level k to k+1 under the surface motion that the contact has settled.
    fn advance(&mut self, surface: &Surface);

    /// Energies between levels k−1 and k and between levels k and k+1, after [`Model::advance`] of step k. A model that
    /// runs its interior behind the surface brings it up to date here.
    fn energies(&mut self, surface: &Surface) -> [TargetEnergy; 2];

    /// Largest |∂u_z/∂z| on the backing over all levels before the newest one.
    fn backing_peak(&mut self) -> BackingPeak;

    /// Writes a field at level k, row-major `[[j, i]]`, after [`Model::advance`] and [`Model::energies`] of step k.
    ///
    /// * `every`: nodes from one that is shown to the next, along r and z
    fn sample(&self, field: Field, every: usize, surface: &Surface, values: &mut Vec<f32>) -> Extent;

    /// Writes the displacement of the surface at level k into `values`, after [`Model::advance`] of step k; nodes beyond
    /// them are at rest.
    fn surface(&self, values: &mut Vec<f64>);

    /// First place `(r, z)` where the displacement is not finite, if any \[R\].
    fn find_non_finite(&mut self) -> Option<(f64, f64)>;
}
