//! One field of two recordings, compared sample by sample.

use super::{
    measure::{Divergence, Location, Measure},
    options::NanRule,
    sums::{Block, Scale, Sums},
    tolerance::{Rule, Tolerance},
    tube::TubeState,
    values::{has_large, hidden_differences, is_same, number, shorten, text, ulps, whole, within},
};
use crate::wire::List;

/// Compares a field sample by sample.
pub(super) struct Meter {
    pub(super) measure: Measure,
    pub(super) rule: Option<Rule>,
    nan: NanRule,
    /// Both fields are of single precision.
    floats: bool,
    /// Scale of the reference over all samples, if a tolerance needs it.
    known: Option<Scale>,
    tube: Option<TubeState>,
    number_a: Vec<f64>,
    number_b: Vec<f64>,
}

/// When a message is, and where its elements are.
pub(super) struct Sample<'a> {
    pub(super) place: Location,
    /// Gives the position of an element in words.
    pub(super) position: &'a dyn Fn(usize) -> Option<String>,
}

impl Sample<'_> {
    fn at(&self, element: usize) -> Location {
        Location { element, position: (self.position)(element), ..self.place.clone() }
    }
}

/// A buffer for the numbers of the next message, if it is a small one: of many fields, each would keep its largest.
fn small(numbers: Vec<f64>) -> Vec<f64> {
    const KEPT: usize = 128;
    if numbers.capacity() > KEPT { Vec::new() } else { numbers }
}

impl Meter {
    pub(super) fn new(rule: Option<Rule>, known: Option<Scale>, nan: NanRule) -> Self {
        let tube = rule.as_ref().and_then(|rule| rule.tolerance.tube).map(|tube| TubeState::new(tube, nan));
        Self {
            measure: Measure::default(),
            rule,
            nan,
            floats: false,
            known,
            tube,
            number_a: Vec::new(),
            number_b: Vec::new(),
        }
    }

    /// A sample whose messages agree in every byte.
    pub(super) fn take_same(&mut self, a: &List, place: Location) {
        let sample = Sample { place, position: &|_| None };
        if let List::Double(list) = a {
            return self.numbers::<true>(list, list, &sample);
        }
        let mut numbers = std::mem::take(&mut self.number_a);
        if a.numbers(&mut numbers) {
            self.numbers::<true>(&numbers, &numbers, &sample);
        } else {
            self.measure.elements += a.len() as u64;
        }
        self.number_a = small(numbers);
    }

    /// A sample that may differ.
    pub(super) fn take(&mut self, a: &List, b: &List, sample: &Sample<'_>) {
        if a.len() != b.len() {
            self.measure.lengths += 1;
            let of = |list: &List| format!("{} elements", list.len());
            self.note(Divergence { place: sample.at(a.len().min(b.len())), a: of(a), b: of(b) }, true);
        }
        let (mut numbers_a, mut numbers_b) =
            (std::mem::take(&mut self.number_a), std::mem::take(&mut self.number_b));
        if a.numbers(&mut numbers_a) && b.numbers(&mut numbers_b) {
            let length = numbers_a.len().min(numbers_b.len());
            numbers_a.truncate(length);
            numbers_b.truncate(length);
            if has_large(a) || has_large(b) {
                self.exactly([a, b], (&numbers_a, &mut numbers_b), sample);
            } else {
                for i in hidden_differences(a, b) {
                    if is_same(numbers_a[i], numbers_b[i]) {
                        numbers_b[i] = f64::from_bits(numbers_a[i].to_bits() ^ 1);
                    }
                }
                self.floats = matches!((a, b), (List::Float(_), List::Float(_)));
                self.numbers::<false>(&numbers_a, &numbers_b, sample);
            }
        } else {
            self.texts(a, b, sample);
        }
        (self.number_a, self.number_b) = (small(numbers_a), small(numbers_b));
    }

    /// Measures numbers, and checks them against the tolerance.
    fn numbers<const SAME: bool>(&mut self, a: &[f64], b: &[f64], sample: &Sample<'_>) {
        self.measure.elements += a.len() as u64;
        self.elements::<SAME>(a, b, sample);
        if let Some(tube) = &mut self.tube {
            let late = tube.put(a, b, sample.place.clone());
            self.judge(late);
        } else if !SAME {
            self.check(a, b, sample);
        }
    }

    /// Sums, largest and first difference of elements.
    fn elements<const SAME: bool>(&mut self, a: &[f64], b: &[f64], sample: &Sample<'_>) {
        let block = Block::of::<SAME>(a, b);
        if !block.sums.are_finite() {
            return self.odd_elements(a, b, sample);
        }
        self.measure.sums.add(&block.sums);
        self.measure.scale.join(&block.scale);
        self.measure.differing += block.differing;
        if block.differing == 0 {
            return;
        }
        let find = |is_wanted: &dyn Fn(f64, f64) -> bool| {
            a.iter().zip(b).position(|(&x, &y)| !is_same(x, y) && is_wanted(x, y)).unwrap_or(0)
        };
        self.measure.widen(block.max, || sample.at(find(&|x, y| (x - y).abs() == block.max)));
        if self.measure.first.is_none() {
            let first = find(&|_, _| true);
            self.note(self.divergence(sample.at(first), a[first], b[first]), false);
        }
    }

    /// The same where some elements are not finite, one by one.
    fn odd_elements(&mut self, a: &[f64], b: &[f64], sample: &Sample<'_>) {
        self.measure.scale.add(a);
        for (i, (&x, &y)) in a.iter().zip(b).enumerate() {
            if x.is_finite() && y.is_finite() {
                self.measure.sums.add(&Sums::of(x, y));
            }
            self.measure.skipped += u64::from(self.nan.skips(x, y));
            if is_same(x, y) || self.nan.forgives(x, y) {
                continue;
            }
            self.measure.differing += 1;
            let difference = (x - y).abs();
            let difference = if difference.is_nan() { f64::INFINITY } else { difference };
            self.measure.widen(difference, || sample.at(i));
            if self.measure.first.is_none() {
                self.note(self.divergence(sample.at(i), x, y), false);
            }
        }
    }

    /// Numbers beside whole ones that are no double-precision numbers, one by one: the difference of two whole numbers is exact.
    ///
    /// * `numbers`: the same as double-precision numbers
    fn exactly(&mut self, [a, b]: [&List; 2], numbers: (&[f64], &mut [f64]), sample: &Sample<'_>) {
        for (i, (&x, y)) in numbers.0.iter().zip(&mut *numbers.1).enumerate() {
            let distance = whole(a, i).zip(whole(b, i)).map(|(x, y)| x.abs_diff(y));
            let difference = distance.map_or((x - *y).abs(), |distance| distance as f64);
            self.measure.elements += 1;
            self.measure.scale.add(&[x]);
            if x.is_finite() && y.is_finite() {
                self.measure.sums.add(&Sums::apart(x, *y, difference));
            }
            self.measure.skipped += u64::from(self.nan.skips(x, *y));
            if distance.map_or(is_same(x, *y), |distance| distance == 0) || self.nan.forgives(x, *y) {
                continue;
            }
            self.measure.differing += 1;
            let finite = if difference.is_nan() { f64::INFINITY } else { difference };
            self.measure.widen(finite, || sample.at(i));
            let ulps = distance.map_or_else(|| ulps(x, *y, false), |distance| u64::try_from(distance).ok());
            let is_beyond = self.tube.is_none() && self.is_beyond(x, difference, ulps);
            self.measure.beyond += u64::from(is_beyond);
            self.note(Divergence { place: sample.at(i), a: text(a, i), b: text(b, i) }, is_beyond);
            // rounded, it is not to be nearer to the reference than it is
            if difference > (x - *y).abs() {
                *y = if whole(b, i) > whole(a, i) { y.next_up() } else { y.next_down() };
            }
        }
        if let Some(tube) = &mut self.tube {
            let late = tube.put(numbers.0, numbers.1, sample.place.clone());
            self.judge(late);
        }
    }

    /// True if a difference of single elements is not allowed.
    fn is_beyond(&self, reference: f64, difference: f64, ulps: Option<u64>) -> bool {
        let default = Tolerance::default();
        let tolerance = self.rule.as_ref().map_or(&default, |rule| &rule.tolerance);
        let is_near = tolerance.ulp.is_some_and(|most| ulps.is_some_and(|distance| distance <= most));
        let is_within = difference == 0.0 || within(difference, self.allowed(reference));
        tolerance.holds_elements() && !is_near && (tolerance.is_bitwise() || !is_within)
    }

    /// By how much an element may differ from that of the reference.
    fn allowed(&self, reference: f64) -> f64 {
        let Some(Rule { tolerance, .. }) = &self.rule else { return 0.0 };
        (tolerance.rel.unwrap_or(0.0) * reference.abs()).max(self.fixed(tolerance))
    }

    /// The part of it that does not depend on the element.
    fn fixed(&self, tolerance: &Tolerance) -> f64 {
        let scale = self.known.unwrap_or_default();
        let fixed = tolerance.abs.unwrap_or(0.0);
        let fixed = fixed.max(tolerance.peak_rel.map_or(0.0, |share| share * scale.peak));
        fixed.max(tolerance.range_rel.map_or(0.0, |share| scale.share_of_range(share)))
    }

    /// Checks elements against the tolerance.
    fn check(&mut self, a: &[f64], b: &[f64], sample: &Sample<'_>) {
        let default = Tolerance::default();
        let tolerance = self.rule.as_ref().map_or(&default, |rule| &rule.tolerance);
        if !tolerance.holds_elements() {
            return;
        }
        let fixed = self.fixed(tolerance);
        let (rel, ulp, nan, floats) = (tolerance.rel.unwrap_or(0.0), tolerance.ulp, self.nan, self.floats);
        // equal elements, infinities too, are within any tolerance; NaN is beyond all, but for the same bits
        let is_bitwise = tolerance.is_bitwise();
        let is_beyond = |x: f64, y: f64| {
            !is_same(x, y) && (is_bitwise || x != y && !within((x - y).abs(), fixed.max(rel * x.abs())))
        };
        let count = a.iter().zip(b).filter(|&(&x, &y)| is_beyond(x, y)).count();
        if count == 0 {
            return;
        }
        let forgiven = |x: f64, y: f64| {
            nan.forgives(x, y)
                || ulp.is_some_and(|ulp| ulps(x, y, floats).is_some_and(|distance| distance <= ulp))
        };
        let stands = |x: f64, y: f64| is_beyond(x, y) && !forgiven(x, y);
        let pairs = || a.iter().zip(b);
        let beyond = if ulp.is_none() && nan == NanRule::SameBits {
            count
        } else {
            pairs().filter(|&(&x, &y)| stands(x, y)).count()
        };
        self.measure.beyond += beyond as u64;
        if self.measure.first_beyond.is_none()
            && let Some(i) = pairs().position(|(&x, &y)| stands(x, y))
        {
            self.note(self.divergence(sample.at(i), a[i], b[i]), true);
        }
    }

    /// Two numbers that differ, each as the shortest text that reads back as the number of the field's type.
    fn divergence(&self, place: Location, a: f64, b: f64) -> Divergence {
        let are_nan = a.is_nan() && b.is_nan();
        let [a, b] = [a, b].map(|value| number(value, self.floats, are_nan));
        Divergence { place, a, b }
    }

    fn texts(&mut self, a: &List, b: &List, sample: &Sample<'_>) {
        for i in 0..a.len().min(b.len()) {
            self.measure.elements += 1;
            let (x, y) = (text(a, i), text(b, i));
            if x == y {
                continue;
            }
            self.measure.differing += 1;
            self.measure.beyond += 1;
            if self.measure.first_beyond.is_none() {
                let place = Location { element: i, position: None, ..sample.place.clone() };
                self.note(Divergence { place, a: shorten(&x), b: shorten(&y) }, true);
            }
        }
    }

    fn note(&mut self, divergence: Divergence, is_beyond: bool) {
        if is_beyond && self.measure.first_beyond.is_none() {
            self.measure.first_beyond = Some(divergence.clone());
        }
        if self.measure.first.is_none() {
            self.measure.first = Some(divergence);
        }
    }

    fn judge(&mut self, late: Vec<Divergence>) {
        self.measure.beyond += late.len() as u64;
        for divergence in late {
            self.note(divergence, true);
        }
    }

    /// Ends the comparison.
    pub(super) fn finish(&mut self) {
        if let Some(tube) = &mut self.tube {
            let late = tube.finish();
            self.judge(late);
        }
    }

    /// True if the field as a whole is within its tolerance.
    pub(super) fn is_within(&self) -> bool {
        let limit = self.rule.as_ref().and_then(|rule| rule.tolerance.l2_rel);
        let by_norm = limit.is_none_or(|limit| {
            let finite = self.measure.max.as_ref().is_none_or(|(max, _)| max.is_finite());
            let sums = &self.measure.sums;
            // a ratio too small for a number is not 0
            let ratio = sums.difference.relative_to(&sums.reference).filter(|_| limit > 0.0);
            finite && ratio.map_or(sums.difference.is_zero(), |ratio| ratio <= limit)
        });
        by_norm && self.measure.beyond == 0 && self.measure.lengths == 0
    }
}

#[cfg(test)]
mod tests;
