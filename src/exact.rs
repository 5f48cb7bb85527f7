//! Closed forms that computed results are checked against: one file each, independent of the solver.
//!
//! | Closed form | Result |
//! |---|---|
//! | [`paraboloid`] | pressure on the axis under a paraboloid with prescribed motion |
//! | [`spreading`] | pressure and drag under a spreading cone or paraboloid, at any place, on layers of one shear wave speed too |
//! | [`stack`] | plane waves in layers |
//! | [`plane_punch`] | pressure and drag of a plane flat punch before the waves of its edges meet |
//!
//! These belong to model `rakhmatulin`; those of the full theory of elasticity, model `elastic`, are
//!
//! | Closed form | Result |
//! |---|---|
//! | [`elastic_paraboloid`] | pressure on the axis under a paraboloid with prescribed motion |
//! | [`elastic_plane_punch`] | pressure and drag of a plane flat punch before a wave has crossed it |
//! | [`elastic_wedge`] | pressure and drag of a plane wedge that outruns all waves |
//! | [`hertz`] | pressure, drag and motion of a slow ball on a half-space, without waves: an approximation |
//! | [`hertz_radiation`] | force, time and restitution of a slow ball on a half-space, and on a thin plate, with the energy that waves carry away |
//! | [`surface_impedance`] | speed of Rayleigh waves |
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
pub mod elastic_paraboloid;
pub mod elastic_plane_punch;
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

/// Distances travelled by the waves that have reached depth `z` at time `t`, each with its weight: `2mh + z` and
/// `2(m+1)h − z`; \[KA\] Eq. 16, misprint corrected (it prints `(2m+1)h − z`, which Eq. 14 and causality exclude). A wave
/// whose front arrives at `t` has the weight ½, others 1.
fn distances(z: f64, thickness: Option<f64>, t: f64) -> Result<Vec<(f64, f64)>, ExactError> {
    let depth = thickness.unwrap_or(f64::INFINITY);
    if !(z >= 0.0 && z <= depth) {
        return outside("z", z, format!("0 ≤ z ≤ {depth}"));
    }
    if !(t >= 0.0 && t.is_finite()) {
        return outside("t", t, "t ≥ 0");
    }
    let rounding = 1e-12 * t;
    let mut list = Vec::new();
    let mut add = |d: f64| {
        if d <= t + rounding {
            list.push((d, if (d - t).abs() <= rounding { 0.5 } else { 1.0 }));
        }
    };
    add(z);
    let mut way = 2.0 * depth;
    while way - z <= t + rounding {
        add(way - z);
        add(way + z);
        way += 2.0 * depth;
    }
    Ok(list)
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
