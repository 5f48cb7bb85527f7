//! Geometry: rotational symmetry or plane strain.

use serde::{Deserialize, Serialize};

/// Symmetry of the problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// Rotational symmetry about `r = 0`.
    Axisymmetric,
    /// Plane strain strip symmetric about `r = 0` (there `r` is the paper's `x`).
    Plane,
}

impl Geometry {
    /// Area of a face \[πR²; plane, of the half x ≥ 0, R\].
    pub fn area(self, radius: f64) -> f64 {
        match self {
            Self::Axisymmetric => radius * radius,
            Self::Plane => radius,
        }
    }
}
