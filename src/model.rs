//! Models of the target: what lies behind the surface.
//!
//! A model owns the displacement fields and advances them. It meets the contact only through [`Surface`] and shows
//! its fields only through [`Model::frame`]; it knows nothing of indenters, contact rules or recordings.
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
pub mod survey;
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

/// Energy of the target at a half step \[πR³γc_p²; plane R²γc_p²\].
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

/// What frames show of the field.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Show {
    /// The fields.
    pub fields: Vec<Field>,
    /// Nodes from one that is shown to the next, along r and z; the first is always shown.
    pub every: usize,
}

/// A field as a frame shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The field.
    pub field: Field,
    /// Rows and columns.
    pub extent: Extent,
    /// Values, row-major `[[j, i]]`.
    pub values: Vec<f32>,
}

/// What a model shows of a level k that is a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetFrame {
    /// Energy between levels k−1 and k.
    pub energy: TargetEnergy,
    /// Kinetic energy between levels k and k+1.
    pub next_kinetic: f64,
    /// Fields.
    pub samples: Vec<Sample>,
    /// Displacement of the surface, shape `(columns,)`; nodes beyond them are at rest \[R\].
    pub surface: Vec<f64>,
}

/// An elastic target, advanced explicitly in time.
///
/// Levels: before [`Model::advance`] of step k the model stands between levels k−1 and k, after it between k
/// and k+1. A model may run its interior behind the surface; then it shows frames later than it was asked for them.
pub trait Model: Send {
    /// Fills in the surface that would be free of stress during step k, and its compliance.
    fn predict(&mut self, surface: &mut Surface);

    /// Advances from level k to k+1 under the surface motion that the contact has settled.
    ///
    /// * `is_frame`: true if level k shall be shown
    fn advance(&mut self, surface: &Surface, is_frame: bool);

    /// The next frame, if it is there by now. Every frame is shown once, in order.
    ///
    /// * `now`: do what is needed to have it
    fn frame(&mut self, now: bool) -> Option<TargetFrame>;

    /// Largest |∂u_z/∂z| on the backing over all levels before the newest one.
    fn backing_peak(&mut self) -> BackingPeak;

    /// First place `(r, z)` where the displacement is not finite, if any \[R\].
    fn find_non_finite(&mut self) -> Option<(f64, f64)>;
}
