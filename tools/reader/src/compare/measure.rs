//! How far two fields are apart: what a comparison reports of a field.

use super::sums::{Scale, Sums};
use crate::instant::Instant;

/// When and where a value stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Location {
    /// Number of the sample among those compared.
    pub sample: u64,
    /// Step, where messages have one.
    pub step: Option<u64>,
    /// Time of the reference.
    pub(crate) time: Instant,
    /// Number of the element.
    pub element: usize,
    /// Position of the element on its axes, in words: `r = 0.5`.
    pub position: Option<String>,
}

/// Two values that differ.
#[derive(Clone, Debug, PartialEq)]
pub struct Divergence {
    pub place: Location,
    /// Values in the reference and in the new recording, as text.
    pub a: String,
    pub b: String,
}

/// How far two fields are apart.
#[derive(Clone, Debug, Default)]
pub struct Measure {
    /// Elements compared.
    pub elements: u64,
    /// Elements that differ at all.
    pub differing: u64,
    /// Elements beyond tolerance.
    pub beyond: u64,
    /// Elements that were left out because one is NaN, if that stands for no value.
    pub skipped: u64,
    /// Samples whose numbers of elements differ.
    pub lengths: u64,
    /// Elements of both recordings without a counterpart, as outside the common range of different axes, or of the new one between
    /// those that were interpolated with: they were not compared.
    pub dropped: u64,
    /// Samples whose arrays have no part of their axes in common: nothing of them was compared.
    pub apart: u64,
    /// Largest absolute difference, and where; infinite where one of the two is no finite number.
    pub max: Option<(f64, Location)>,
    /// Earliest difference.
    pub first: Option<Divergence>,
    /// Earliest difference beyond tolerance.
    pub first_beyond: Option<Divergence>,
    /// Sums over elements that are finite in both.
    pub sums: Sums,
    /// Magnitude of the reference over the samples compared.
    pub scale: Scale,
}

impl Measure {
    /// Takes a difference into account, if it is the largest so far.
    pub(super) fn widen(&mut self, difference: f64, place: impl FnOnce() -> Location) {
        if self.max.as_ref().is_none_or(|(max, _)| difference > *max) {
            self.max = Some((difference, place()));
        }
    }

    /// Largest difference relative to the largest magnitude of the reference.
    pub fn peak_relative(&self) -> Option<f64> {
        let (max, _) = self.max.as_ref()?;
        (self.scale.peak > 0.0).then(|| max / self.scale.peak)
    }

    /// ‖a − b‖₁ / ‖a‖₁.
    pub fn l1_relative(&self) -> Option<f64> {
        (self.sums.a1 > 0.0 && self.sums.a1.is_finite()).then(|| self.sums.d1 / self.sums.a1)
    }

    /// ‖a − b‖₂ / ‖a‖₂.
    pub fn l2_relative(&self) -> Option<f64> {
        self.sums.difference.relative_to(&self.sums.reference)
    }

    /// Sprague and Geers: magnitude √(Σb²/Σa²) − 1, phase acos(Σab/√(Σa²Σb²))/π, and both combined.
    pub fn sprague_geers(&self) -> Option<[f64; 3]> {
        let Sums { aa, bb, ab, .. } = self.sums;
        if aa <= 0.0 || bb <= 0.0 || !self.sums.are_finite() {
            return None;
        }
        let magnitude = (bb / aa).sqrt() - 1.0;
        let phase = if self.sums.difference.is_zero() {
            0.0
        } else {
            (ab / (aa.sqrt() * bb.sqrt())).clamp(-1.0, 1.0).acos() / std::f64::consts::PI
        };
        Some([magnitude, phase, magnitude.hypot(phase)])
    }

    /// Correlation of the two fields. Shown, never a criterion: it does not see a wrong scale.
    pub fn correlation(&self) -> Option<f64> {
        let Sums { n, a, b, aa, bb, ab, .. } = self.sums;
        let (va, vb) = (aa - a * a / n, bb - b * b / n);
        (va > 0.0 && vb > 0.0 && self.sums.are_finite())
            .then(|| ((ab - a * b / n) / (va * vb).sqrt()).clamp(-1.0, 1.0))
    }
}
