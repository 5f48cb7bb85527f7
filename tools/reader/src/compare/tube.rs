//! Samples checked against a tube around the reference.

use std::collections::VecDeque;

use super::{
    measure::{Divergence, Location},
    options::NanRule,
    tolerance::Tube,
    values::is_same,
};

/// Samples of a field that wait until the tube around them is known.
pub(super) struct TubeState {
    tube: Tube,
    nan: NanRule,
    reference: VecDeque<(f64, Vec<f64>)>,
    waiting: VecDeque<(Location, Vec<f64>)>,
}

impl TubeState {
    pub(super) fn new(tube: Tube, nan: NanRule) -> Self {
        Self { tube, nan, reference: VecDeque::new(), waiting: VecDeque::new() }
    }

    pub(super) fn put(&mut self, a: &[f64], b: &[f64], place: Location) -> Vec<Divergence> {
        let time = place.time.number();
        self.reference.push_back((time, a.to_vec()));
        self.waiting.push_back((place, b.to_vec()));
        let mut late = Vec::new();
        while self.waiting.front().is_some_and(|(place, _)| place.time.number() + self.tube.time < time) {
            self.judge(&mut late);
        }
        late
    }

    pub(super) fn finish(&mut self) -> Vec<Divergence> {
        let mut late = Vec::new();
        while !self.waiting.is_empty() {
            self.judge(&mut late);
        }
        late
    }

    /// Judges the sample that has waited longest.
    fn judge(&mut self, late: &mut Vec<Divergence>) {
        let Some((place, b)) = self.waiting.pop_front() else { return };
        let at = place.time.number();
        let (from, to) = (at - self.tube.time, at + self.tube.time);
        // one sample before the window is needed for the value at its edge
        while self.reference.get(1).is_some_and(|next| next.0 <= from) {
            self.reference.pop_front();
        }
        for (i, &value) in b.iter().enumerate() {
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut widen = |x: f64| (low, high) = (low.min(x), high.max(x));
            let mut before: Option<(f64, f64)> = None;
            let mut centre = f64::NAN;
            for (time, a) in &self.reference {
                let Some(&x) = a.get(i) else { continue };
                if *time == at {
                    centre = x;
                }
                // no tube leads through a number that is not finite
                if !x.is_finite() {
                    before = None;
                    continue;
                }
                if let Some((t0, x0)) = before {
                    for edge in [from, to].into_iter().filter(|edge| t0 < *edge && edge < time) {
                        widen(x0 + (x - x0) * (edge - t0) / (time - t0));
                    }
                }
                if (from..=to).contains(time) {
                    widen(x);
                }
                before = Some((*time, x));
                if *time > to {
                    break;
                }
            }
            let inside =
                centre.is_finite() && low - self.tube.value <= value && value <= high + self.tube.value;
            if !inside && !is_same(centre, value) && centre != value && !self.nan.forgives(centre, value) {
                let place = Location { element: i, ..place.clone() };
                late.push(Divergence { place, a: format!("{low:?} to {high:?}"), b: format!("{value:?}") });
            }
        }
    }
}
