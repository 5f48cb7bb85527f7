//! Numbers of one recording in the units of another, where one is dimensionless and the other carries its scales.

use std::collections::BTreeMap;

use percuss_table::units::{RECORDED, Unit};

use crate::{convention::RUN, messages::Recording};

/// How numbers of one unit become numbers of another: by one operation with the scale as it is recorded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Conversion {
    /// Into SI.
    Multiply(f64),
    /// Out of SI.
    Divide(f64),
}

impl Conversion {
    /// The number in the other unit.
    pub fn apply(self, number: f64) -> f64 {
        match self {
            Self::Multiply(scale) => number * scale,
            Self::Divide(scale) => number / scale,
        }
    }
}

/// What leads from the units of one recording to those of another.
#[derive(Clone, Debug, Default)]
pub struct Scales {
    from: BTreeMap<String, String>,
    to: BTreeMap<String, String>,
}

impl Scales {
    /// Between two recordings, by the scales of both.
    pub fn between(from: &Recording, to: &Recording) -> Self {
        let scales = |recording: &Recording| {
            let run = recording.entries(RUN).into_iter().flatten();
            let scales = run.filter(|(key, _)| RECORDED.iter().any(|unit| unit.scale == key.as_str()));
            scales.map(|(key, value)| (key.clone(), value.clone())).collect()
        };
        Self { from: scales(from), to: scales(to) }
    }

    /// The conversion from a unit of the first recording to one of the second; `None` if they are not the same quantity, one
    /// dimensionless and one in SI, or if the recording in SI does not carry the scale.
    pub fn conversion(&self, from: &str, to: &str) -> Option<Conversion> {
        let scale = |scales: &BTreeMap<String, String>, key: &str| {
            let scale = scales.get(key)?.parse::<f64>().ok()?;
            (scale.is_finite() && scale > 0.0).then_some(scale)
        };
        RECORDED.iter().find_map(|&Unit { plain, si, scale: key, .. }| match (from, to) {
            _ if (from, to) == (si, plain) => scale(&self.from, key).map(Conversion::Divide),
            _ if (from, to) == (plain, si) => scale(&self.to, key).map(Conversion::Multiply),
            _ => None,
        })
    }
}
