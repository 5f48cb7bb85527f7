//! Closed forms that computed results are checked against: one file each, independent of the solver.
//!
//! | Closed form | Theory | Result |
//! |---|---|---|
//! | [`paraboloid`] | either | pressure on the axis under a paraboloid with prescribed motion |
//! | [`plane_punch`] | either | pressure and drag of a plane flat punch before a wave has crossed it |
//! | [`spreading`] | simplified | pressure and drag under a spreading cone or paraboloid, at any place, on layers of one shear wave speed too |
//! | [`stack`] | simplified | plane waves in layers |
//! | [`elastic_wedge`] | full | pressure and drag of a plane wedge that outruns all waves |
//! | [`hertz`] | full | pressure, drag and motion of a slow ball on a half-space, without waves: an approximation |
//! | [`hertz_radiation`] | full | force, time and restitution of a slow ball on a half-space, and on a thin plate, with the energy that waves carry away |
//! | [`surface_impedance`] | full | speed of Rayleigh waves |
//!
//! Each checks its parameters and the range in which it holds, and returns
//! an error outside it. [`closed_form`] finds the form for a case and evaluates it step by step. Forms that only tests use are in
//! `tests/closed_forms`.
//!
//! # Accuracy
//!
//! Tests compare with closed forms and published numbers (`tests/verification`; layered targets under the plain stepper in
//! `src/exact/tests`). The errors that they assert, within a factor of 1.5, are in the guide, `tools/guide/src/theory.md`; in the full theory
//! bounds are 1.2 to 3 times these errors, that of the energy six times.
//!
//! `tests/golden` has digests of the recordings of eight small cases, to the last bit; `PERCUSS_BLESS=1 cargo test golden`
//! rewrites them after an intended change, which needs another revision of the numerics, [`crate::recording::NUMERICS`].

pub mod closed_form;
pub mod elastic_wedge;
pub mod hertz;
pub mod hertz_radiation;
pub mod paraboloid;
pub mod plane_punch;
pub mod quadrature;
pub mod spreading;
pub mod stack;
pub mod surface_impedance;

/// Why a closed form has no value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExactError {
    /// A parameter is out of range.
    #[error("{name} = {value} is out of range: {bound}")]
    Parameter {
        /// Name.
        name: &'static str,
        /// Value.
        value: f64,
        /// Allowed range.
        bound: &'static str,
    },
    /// The point lies outside the range in which the form holds.
    #[error("{name} = {value} is outside the range of this closed form: {bound}")]
    OutsideRange {
        /// Name.
        name: &'static str,
        /// Value.
        value: f64,
        /// Range of the form.
        bound: String,
    },
}

/// The error of an argument.
fn outside<T>(name: &'static str, value: f64, bound: impl Into<String>) -> Result<T, ExactError> {
    Err(ExactError::OutsideRange { name, value, bound: bound.into() })
}

/// Checks that a time is in `0 < t < end`.
fn before(end: f64, t: f64) -> Result<(), ExactError> {
    if t > 0.0 && t < end { Ok(()) } else { outside("t", t, format!("0 < t < {end}")) }
}

/// Checks the thickness of a layer, if the target is one.
fn layer(thickness: Option<f64>) -> Result<(), ExactError> {
    thickness.map_or(Ok(()), |h| positive("thickness", h, f64::INFINITY, "h > 0").map(drop))
}

/// Checks `0 < value < high`.
fn positive(name: &'static str, value: f64, high: f64, bound: &'static str) -> Result<f64, ExactError> {
    if value > 0.0 && value < high { Ok(value) } else { Err(ExactError::Parameter { name, value, bound }) }
}

#[cfg(test)]
mod tests;
