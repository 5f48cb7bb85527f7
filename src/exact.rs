//! Closed forms that computed answers are checked against: one file each, independent of the solver.
//!
//! | Closed form | Of what |
//! |---|---|
//! | [`paraboloid`] | pressure on the axis under a paraboloid with prescribed motion, half-space or layer |
//! | [`plane_punch`] | pressure and drag of a plane flat punch before the waves of its edges meet |
//! | [`disc_stiffness`] | slope of the drag of a flat punch on a layer at long times |
//!
//! All belong to model `rakhmatulin`. Each checks its parameters and the range in which it holds; outside it the
//! answer is an error, not a number.

pub mod disc_stiffness;
pub mod paraboloid;
pub mod plane_punch;

/// Why a closed form has no answer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExactError {
    /// A parameter is out of range.
    #[error("{name} = {value} is out of range: {bound}")]
    Parameter {
        /// Name.
        name: &'static str,
        /// Value.
        value: f64,
        /// What is allowed.
        bound: &'static str,
    },
    /// The answer asked for lies outside the range in which the form holds.
    #[error("{name} = {value} is outside the range of this closed form: {bound}")]
    OutsideRange {
        /// Name.
        name: &'static str,
        /// Value.
        value: f64,
        /// Where it holds.
        bound: String,
    },
}

/// Checks `0 < value < high`.
fn positive(name: &'static str, value: f64, high: f64, bound: &'static str) -> Result<f64, ExactError> {
    if value > 0.0 && value < high { Ok(value) } else { Err(ExactError::Parameter { name, value, bound }) }
}
