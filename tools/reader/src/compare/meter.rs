//! One field of two recordings, compared sample by sample.

use super::{
    measure::{Divergence, Location, Measure},
    options::NanRule,
    sums::{Block, Scale, Sums},
    tolerance::{Rule, Tolerance},
    tube::TubeState,
    values::{has_large, is_same, number, shorten, show_hidden, text, ulps, whole, within},
};
use crate::wire::List;

/// Compares a field sample by sample.
pub(super) struct Meter {
    pub(super) measure: Measure,
    pub(super) rule: Option<Rule>,
    allowance: Allowance,
    nan: NanRule,
    /// Both fields are of single precision.
    floats: bool,
    tube: Option<TubeState>,
    number_a: Vec<f64>,
    number_b: Vec<f64>,
}

/// By how much single elements may differ.
struct Allowance {
    is_checked: bool,
    is_bitwise: bool,
    /// Relative to the element of the reference.
    rel: f64,
    /// Whatever the element.
    fixed: f64,
    ulp: Option<u64>,
}

impl Allowance {
    fn of(tolerance: &Tolerance, scale: Scale) -> Self {
        let range = tolerance.range_rel.map(|share| scale.share_of_range(share));
        let fixed = [tolerance.abs, tolerance.peak_rel.map(|share| share * scale.peak), range];
        Self {
            // a tube checks them itself
            is_checked: tolerance.holds_elements() && tolerance.tube.is_none(),
            is_bitwise: tolerance.is_bitwise(),
            rel: tolerance.rel.unwrap_or(0.0),
            fixed: fixed.into_iter().flatten().fold(0.0, f64::max),
            ulp: tolerance.ulp,
        }
    }

    /// True if an element that is not the same differs by more than is allowed, units in the last place aside.
    fn is_outside(&self, reference: f64, difference: f64) -> bool {
        let allowed = self.fixed.max(self.rel * reference.abs());
        self.is_bitwise || difference != 0.0 && !within(difference, allowed)
    }

    /// True if so many units in the last place are allowed.
    fn is_near(&self, ulps: impl FnOnce() -> Option<u64>) -> bool {
        self.ulp.is_some_and(|most| ulps().is_some_and(|distance| distance <= most))
    }
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
    /// * `known`: scale of the reference over all samples, if the tolerance needs it
    pub(super) fn new(rule: Option<Rule>, known: Option<Scale>, nan: NanRule) -> Self {
        let tolerance = rule.as_ref().map(|rule| rule.tolerance.clone()).unwrap_or_default();
        Self {
            measure: Measure::default(),
            rule,
            allowance: Allowance::of(&tolerance, known.unwrap_or_default()),
            nan,
            floats: false,
            tube: tolerance.tube.map(|tube| TubeState::new(tube, nan)),
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
            self.floats = matches!((a, b), (List::Float(_), List::Float(_)));
            if has_large(a) || has_large(b) {
                self.each(&numbers_a, &numbers_b, Some([a, b]), sample);
                keep_apart([a, b], &numbers_a, &mut numbers_b);
                self.follow(&numbers_a, &numbers_b, sample);
            } else {
                show_hidden(a, b, &mut numbers_b);
                self.numbers::<false>(&numbers_a, &numbers_b, sample);
            }
        } else {
            self.texts(a, b, sample);
        }
        (self.number_a, self.number_b) = (small(numbers_a), small(numbers_b));
    }

    /// Measures numbers, and checks them against the tolerance.
    fn numbers<const SAME: bool>(&mut self, a: &[f64], b: &[f64], sample: &Sample<'_>) {
        let block = Block::of::<SAME>(a, b);
        if block.sums.are_finite() {
            self.measure.elements += a.len() as u64;
            self.measure.sums.add(&block.sums);
            self.measure.scale.join(&block.scale);
            self.measure.differing += block.differing;
            if block.differing > 0 {
                self.find(a, b, block.max, sample);
            }
        } else {
            self.each(a, b, None, sample);
        }
        self.follow(a, b, sample);
    }

    /// Finds the largest and the first difference of elements of which some differ, and those beyond tolerance.
    fn find(&mut self, a: &[f64], b: &[f64], max: f64, sample: &Sample<'_>) {
        let pairs = || a.iter().copied().zip(b.iter().copied());
        let is_largest = |(x, y): (f64, f64)| !is_same(x, y) && (x - y).abs() == max;
        self.measure.widen(max, || sample.at(pairs().position(is_largest).unwrap_or(0)));
        if self.measure.first.is_none() {
            let first = pairs().position(|(x, y)| !is_same(x, y)).unwrap_or(0);
            self.note(self.divergence(sample.at(first), a[first], b[first]), false);
        }
        let allowance = &self.allowance;
        let is_outside = |(x, y): (f64, f64)| !is_same(x, y) && allowance.is_outside(x, (x - y).abs());
        if !allowance.is_checked || !pairs().fold(false, |any, pair| any | is_outside(pair)) {
            return;
        }
        let is_near = |(x, y): (f64, f64)| allowance.is_near(|| ulps(x, y, self.floats));
        let mut beyond = (0..).zip(pairs()).filter(|(_, pair)| is_outside(*pair) && !is_near(*pair));
        let Some((first, (x, y))) = beyond.next() else { return };
        self.measure.beyond += 1 + beyond.count() as u64;
        if self.measure.first_beyond.is_none() {
            self.note(self.divergence(sample.at(first), x, y), true);
        }
    }

    /// Measures and checks elements one by one, where some are not finite, or are whole numbers that are no double-precision numbers:
    /// the difference of two whole numbers is exact.
    ///
    /// * `exact`: the lists, if they hold such whole numbers
    fn each(&mut self, a: &[f64], b: &[f64], exact: Option<[&List; 2]>, sample: &Sample<'_>) {
        self.measure.elements += a.len() as u64;
        self.measure.scale.add(a);
        for (i, (&x, &y)) in a.iter().zip(b).enumerate() {
            let distance = exact.and_then(|[a, b]| Some(whole(a, i)?.abs_diff(whole(b, i)?)));
            let difference = distance.map_or((x - y).abs(), |distance| distance as f64);
            if x.is_finite() && y.is_finite() {
                self.measure.sums.add(&Sums::of(x, y, difference));
            }
            self.measure.skipped += u64::from(self.nan.skips(x, y));
            if distance.map_or(is_same(x, y), |distance| distance == 0) || self.nan.forgives(x, y) {
                continue;
            }
            let in_ulps =
                || distance.map_or_else(|| ulps(x, y, self.floats), |distance| u64::try_from(distance).ok());
            let allowance = &self.allowance;
            let is_outside = allowance.is_checked && allowance.is_outside(x, difference);
            let is_beyond = is_outside && !allowance.is_near(in_ulps);
            self.measure.differing += 1;
            self.measure.beyond += u64::from(is_beyond);
            self.measure.widen(if difference.is_nan() { f64::INFINITY } else { difference }, || sample.at(i));
            if self.measure.first.is_none() || (is_beyond && self.measure.first_beyond.is_none()) {
                let divergence = match exact {
                    Some([a, b]) => Divergence { place: sample.at(i), a: text(a, i), b: text(b, i) },
                    None => self.divergence(sample.at(i), x, y),
                };
                self.note(divergence, is_beyond);
            }
        }
    }

    /// Hands numbers on to the tube, if there is one.
    fn follow(&mut self, a: &[f64], b: &[f64], sample: &Sample<'_>) {
        if let Some(tube) = &mut self.tube {
            let late = tube.put(a, b, sample.place.clone());
            self.judge(late);
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

/// Moves rounded whole numbers so that none is nearer to that of the reference than it is.
fn keep_apart([a, b]: [&List; 2], numbers_a: &[f64], numbers_b: &mut [f64]) {
    for (i, (x, y)) in numbers_a.iter().zip(numbers_b).enumerate() {
        let Some((exact_a, exact_b)) = whole(a, i).zip(whole(b, i)) else { continue };
        if exact_a.abs_diff(exact_b) as f64 > (x - *y).abs() {
            *y = if exact_b > exact_a { y.next_up() } else { y.next_down() };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::instant::Instant;

    #[test]
    fn nan_of_single_precision_is_compared_exactly() {
        // a quiet and a signalling one are the same as doubles
        let [quiet, signalling] = [0x7fc0_0001, 0x7f80_0001].map(f32::from_bits);
        for (other, differing) in [(quiet, 0), (signalling, 1)] {
            let mut meter = Meter::new(None, None, NanRule::SameBits);
            let (a, b) = (List::Float(vec![quiet]), List::Float(vec![other]));
            let place =
                Location { sample: 0, step: None, time: Instant::Number(0.0), element: 0, position: None };
            meter.take(&a, &b, &Sample { place, position: &|_| None });
            assert_eq!((meter.measure.differing, meter.measure.beyond), (differing, differing));
        }
    }
}
