//! One field of two recordings, compared sample by sample.

use super::{
    NotANumber,
    measure::{Divergence, Measure, Place, Scale},
    shift::Shift,
    sums::{Pairs, Quick},
    tolerance::{Rule, Tolerance},
    tube::TubeState,
};
use crate::wire::List;

/// Compares a field sample by sample.
pub(super) struct Meter {
    pub(super) measure: Measure,
    pub(super) rule: Option<Rule>,
    pub(super) shift: Shift,
    nan: NotANumber,
    /// Both fields are of single precision.
    floats: bool,
    /// Scale of the reference over all samples, if a tolerance needs it.
    known: Option<Scale>,
    tube: Option<TubeState>,
    number_a: Vec<f64>,
    number_b: Vec<f64>,
}

/// One sample of a field in both recordings.
pub(super) struct Sample<'a> {
    pub(super) a: &'a List,
    pub(super) b: &'a List,
    pub(super) place: Place,
    /// Gives the position of an element in words.
    pub(super) position: &'a dyn Fn(usize) -> Option<String>,
}

/// A buffer for the numbers of the next message, if it is a small one: of many fields, each would keep its largest.
fn small(numbers: Vec<f64>) -> Vec<f64> {
    const KEPT: usize = 128;
    if numbers.capacity() > KEPT { Vec::new() } else { numbers }
}

impl Meter {
    pub(super) fn new(rule: Option<Rule>, known: Option<Scale>, nan: NotANumber) -> Self {
        let tube = rule.as_ref().and_then(|rule| rule.tolerance.tube).map(|tube| TubeState::new(tube, nan));
        Self {
            measure: Measure::default(),
            rule,
            shift: Shift::default(),
            nan,
            floats: false,
            known,
            tube,
            number_a: Vec::new(),
            number_b: Vec::new(),
        }
    }

    /// A sample whose messages agree in every byte.
    pub(super) fn take_same(&mut self, a: &List, place: Place) {
        let numbers = match a {
            List::Double(list) => list.as_slice(),
            other => {
                let mut numbers = std::mem::take(&mut self.number_a);
                if other.numbers(&mut numbers) {
                    self.take_same_numbers(&numbers, place);
                } else {
                    self.measure.elements += other.len() as u64;
                }
                self.number_a = small(numbers);
                return;
            }
        };
        self.take_same_numbers(numbers, place);
    }

    fn take_same_numbers(&mut self, numbers: &[f64], place: Place) {
        self.measure.elements += numbers.len() as u64;
        let sums = Quick::of(numbers);
        if sums.is_finite() {
            let all = &mut self.measure.sums;
            all.n += numbers.len() as f64;
            all.a1 += sums.a1;
            all.a += sums.a;
            all.b += sums.a;
            all.aa += sums.aa;
            all.bb += sums.aa;
            all.ab += sums.aa;
            let scale = &mut self.measure.scale;
            scale.peak = scale.peak.max(sums.greatest.abs()).max(sums.least.abs());
            scale.least = scale.least.min(sums.least);
            scale.greatest = scale.greatest.max(sums.greatest);
            self.shift.add(sums.a, sums.a, numbers.len());
        } else {
            self.elements(numbers, numbers, &place, &|_| None);
        }
        if let Some(tube) = &mut self.tube {
            let late = tube.put(numbers, numbers, place);
            self.judge(late);
        }
    }

    /// A sample that may differ.
    pub(super) fn take(&mut self, sample: &Sample<'_>) {
        let (a, b) = (sample.a, sample.b);
        if a.len() != b.len() {
            self.measure.lengths += 1;
            let of = |list: &List| format!("{} elements", list.len());
            let element = a.len().min(b.len());
            let place = Place { element, position: (sample.position)(element), ..sample.place.clone() };
            self.note(Divergence { place, a: of(a), b: of(b) }, true);
        }
        let (mut numbers_a, mut numbers_b) =
            (std::mem::take(&mut self.number_a), std::mem::take(&mut self.number_b));
        if a.numbers(&mut numbers_a) && b.numbers(&mut numbers_b) {
            let length = numbers_a.len().min(numbers_b.len());
            numbers_a.truncate(length);
            numbers_b.truncate(length);
            self.measure.elements += length as u64;
            for i in hidden_differences(a, b) {
                if numbers_a[i].to_bits() == numbers_b[i].to_bits() {
                    numbers_b[i] = f64::from_bits(numbers_a[i].to_bits() ^ 1);
                }
            }
            self.floats = matches!((a, b), (List::Float(_), List::Float(_)));
            self.elements(&numbers_a, &numbers_b, &sample.place, sample.position);
            if self.tube.is_none() {
                self.hold(&numbers_a, &numbers_b, &sample.place, sample.position);
            } else if let Some(tube) = &mut self.tube {
                let late = tube.put(&numbers_a, &numbers_b, sample.place.clone());
                self.judge(late);
            }
        } else {
            self.texts(a, b, sample);
        }
        (self.number_a, self.number_b) = (small(numbers_a), small(numbers_b));
    }

    /// Sums, largest and first difference of elements.
    fn elements(&mut self, a: &[f64], b: &[f64], place: &Place, position: &dyn Fn(usize) -> Option<String>) {
        let quick = Pairs::of(a, b);
        if !quick.is_finite() {
            self.odd_elements(a, b, place, position);
            return;
        }
        let sums = &mut self.measure.sums;
        sums.n += a.len() as f64;
        sums.a1 += quick.a1;
        sums.a += quick.a;
        sums.b += quick.b;
        sums.aa += quick.aa;
        sums.bb += quick.bb;
        sums.ab += quick.ab;
        sums.d1 += quick.d1;
        sums.d2 += quick.d2;
        self.measure.scale.peak = self.measure.scale.peak.max(quick.least.abs()).max(quick.greatest.abs());
        self.measure.scale.least = self.measure.scale.least.min(quick.least);
        self.measure.scale.greatest = self.measure.scale.greatest.max(quick.greatest);
        self.shift.add(quick.a, quick.b, a.len());
        self.measure.differing += quick.differing;
        if quick.differing == 0 {
            return;
        }
        let at = |element: usize| Place { element, position: position(element), ..place.clone() };
        if self.measure.max.as_ref().is_none_or(|(max, _)| quick.max > *max) {
            let largest = a.iter().zip(b).position(|(&x, &y)| !is_same(x, y) && (x - y).abs() == quick.max);
            self.measure.max = Some((quick.max, at(largest.unwrap_or(0))));
        }
        if self.measure.first.is_none()
            && let Some(i) = a.iter().zip(b).position(|(&x, &y)| !is_same(x, y))
        {
            let divergence = self.divergence(at(i), a[i], b[i]);
            self.note(divergence, false);
        }
    }

    /// The same where some elements are not finite, one by one.
    fn odd_elements(
        &mut self,
        a: &[f64],
        b: &[f64],
        place: &Place,
        position: &dyn Fn(usize) -> Option<String>,
    ) {
        let (mut sum_a, mut sum_b) = (0.0, 0.0);
        self.measure.scale.add(a);
        for (i, (&x, &y)) in a.iter().zip(b).enumerate() {
            let sums = &mut self.measure.sums;
            let difference = (x - y).abs();
            if x.is_finite() && y.is_finite() {
                sums.n += 1.0;
                sums.a1 += x.abs();
                sums.a += x;
                sums.b += y;
                sums.aa += x * x;
                sums.bb += y * y;
                sums.ab += x * y;
                sums.d1 += difference;
                sums.d2 += difference * difference;
                sum_a += x;
                sum_b += y;
            }
            self.measure.skipped += u64::from(self.nan.skips(x, y));
            if is_same(x, y) || self.nan.forgives(x, y) {
                continue;
            }
            self.measure.differing += 1;
            let difference = if difference.is_nan() { f64::INFINITY } else { difference };
            let is_larger = self.measure.max.as_ref().is_none_or(|(max, _)| difference > *max);
            if is_larger || self.measure.first.is_none() {
                let place = Place { element: i, position: position(i), ..place.clone() };
                if is_larger {
                    self.measure.max = Some((difference, place.clone()));
                }
                let divergence = self.divergence(place, x, y);
                self.note(divergence, false);
            }
        }
        self.shift.add(sum_a, sum_b, a.len());
    }

    /// Holds elements against the tolerance.
    fn hold(&mut self, a: &[f64], b: &[f64], at: &Place, position: &dyn Fn(usize) -> Option<String>) {
        let default = Tolerance::default();
        let tolerance = self.rule.as_ref().map_or(&default, |rule| &rule.tolerance);
        if !tolerance.holds_elements() {
            return;
        }
        let scale = self.known.unwrap_or_default();
        let fixed = tolerance.abs.unwrap_or(0.0);
        let fixed = fixed.max(tolerance.peak_rel.map_or(0.0, |share| share * scale.peak));
        let fixed = fixed.max(tolerance.range_rel.map_or(0.0, |share| share * scale.range()));
        let (rel, ulp, nan, floats) = (tolerance.rel.unwrap_or(0.0), tolerance.ulp, self.nan, self.floats);
        // equal elements, infinities too, are within any tolerance; what is not a number is beyond all, but for the
        // same bits
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
        let beyond = if ulp.is_none() && nan == NotANumber::SameBits {
            count
        } else {
            pairs().filter(|&(&x, &y)| stands(x, y)).count()
        };
        self.measure.beyond += beyond as u64;
        if self.measure.first_beyond.is_none()
            && let Some(i) = pairs().position(|(&x, &y)| stands(x, y))
        {
            let place = Place { element: i, position: position(i), ..at.clone() };
            let divergence = self.divergence(place, a[i], b[i]);
            self.note(divergence, true);
        }
    }

    /// Two numbers that differ, each as the shortest text that reads back as the number of the field's type.
    fn divergence(&self, place: Place, a: f64, b: f64) -> Divergence {
        let is_payload = a.is_nan() && b.is_nan();
        let show = |number: f64| match (is_payload, self.floats) {
            (true, _) => format!("NaN with bits {:016x}", number.to_bits()),
            (false, true) => format!("{:?}", number as f32),
            (false, false) => format!("{number:?}"),
        };
        Divergence { place, a: show(a), b: show(b) }
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
                let place = Place { element: i, position: None, ..sample.place.clone() };
                self.note(Divergence { place, a: shorten(x), b: shorten(y) }, true);
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
            // of numbers so large that their squares are not finite, nothing is known
            let norm = self.measure.sums.d2.sqrt();
            finite && norm.is_finite() && norm <= limit * self.measure.sums.aa.sqrt()
        });
        by_norm && self.measure.beyond == 0 && self.measure.lengths == 0
    }
}

/// False for what is not a number, and for infinite differences: relative to an infinity all others would be within.
fn within(difference: f64, allowed: f64) -> bool {
    difference.is_finite() && difference <= allowed
}

/// The same bits: −0 is not +0, not-a-number is itself.
pub(super) fn is_same(x: f64, y: f64) -> bool {
    x.to_bits() == y.to_bits()
}

/// Distance of two numbers of the same type in units in the last place.
fn ulps(x: f64, y: f64, floats: bool) -> Option<u64> {
    if x.is_nan() || y.is_nan() {
        return None;
    }
    // the bits of a float as an integer that grows with it
    let order64 = |bits: i64| if bits < 0 { i64::MIN.wrapping_sub(bits) } else { bits };
    let order32 = |bits: i32| if bits < 0 { i32::MIN.wrapping_sub(bits) } else { bits };
    Some(if floats {
        let of = |value: f64| i64::from(order32((value as f32).to_bits() as i32));
        of(x).abs_diff(of(y))
    } else {
        let of = |value: f64| order64(value.to_bits() as i64);
        of(x).abs_diff(of(y))
    })
}

/// Elements that differ though they may be the same as doubles: integers beyond 2^53, and floats that are not a
/// number, whose signalling bit is lost.
fn hidden_differences(a: &List, b: &List) -> Vec<usize> {
    fn places<T: Copy>(a: &[T], b: &[T], differ: impl Fn(T, T) -> bool) -> Vec<usize> {
        a.iter().zip(b).enumerate().filter(|(_, (x, y))| differ(**x, **y)).map(|(i, _)| i).collect()
    }
    match (a, b) {
        (List::Int(a), List::Int(b)) => places(a, b, |x, y| x != y),
        (List::UInt(a), List::UInt(b)) => places(a, b, |x, y| x != y),
        (List::Float(a), List::Float(b)) => {
            places(a, b, |x, y| x.is_nan() && y.is_nan() && x.to_bits() != y.to_bits())
        }
        _ => Vec::new(),
    }
}

fn text(list: &List, index: usize) -> String {
    match list {
        List::Bool(list) => list[index].to_string(),
        List::Enum(list) => list[index].to_string(),
        List::Text(list) => list[index].clone(),
        List::Bytes(list) => {
            let hex = list[index].iter().map(|byte| format!("{byte:02x}"));
            format!("{} bytes {}", list[index].len(), hex.collect::<String>())
        }
        numbers => numbers.number(index).map_or_else(String::new, |number| format!("{number:?}")),
    }
}

/// A text short enough for a report.
fn shorten(text: String) -> String {
    const LENGTH: usize = 60;
    match text.char_indices().nth(LENGTH) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn meter(rule: &str) -> Meter {
        let rule = (!rule.is_empty()).then(|| rule.parse().expect("a rule"));
        Meter::new(rule, None, NotANumber::SameBits)
    }

    fn put(meter: &mut Meter, k: u64, a: &[f64], b: &[f64]) {
        let place = Place { sample: k, step: Some(k), time: k as f64 * 0.1, ..Place::default() };
        let (a, b) = (List::Double(a.to_vec()), List::Double(b.to_vec()));
        meter.take(&Sample { a: &a, b: &b, place, position: &|_| None });
    }

    #[test]
    fn zeros_infinities_and_not_a_number() {
        let other = f64::from_bits(f64::NAN.to_bits() ^ 1);
        // a pair of values; whether it differs at all; whether it is beyond no tolerance, and beyond some
        for (a, b, differs, bitwise, tolerant) in [
            (f64::NAN, f64::NAN, false, false, false),
            (f64::INFINITY, f64::INFINITY, false, false, false),
            (-0.0, -0.0, false, false, false),
            (0.0, -0.0, true, true, false),
            (f64::NAN, other, true, true, true),
            (f64::NAN, -f64::NAN, true, true, true),
            (f64::NAN, 1.0, true, true, true),
            (1.0, f64::NAN, true, true, true),
            (f64::INFINITY, f64::NEG_INFINITY, true, true, true),
            (f64::INFINITY, f64::MAX, true, true, true),
        ] {
            // alone, and beside another that is not finite
            for with in [&[1.5][..], &[f64::INFINITY]] {
                let (a, b) = ([with, &[a][..]].concat(), [with, &[b][..]].concat());
                for (rule, beyond) in [("", bitwise), ("bitwise", bitwise), ("abs=9,rel=9", tolerant)] {
                    let mut meter = meter(rule);
                    put(&mut meter, 0, &a, &b);
                    let counts = (meter.measure.differing, meter.measure.beyond);
                    assert_eq!(counts, (u64::from(differs), u64::from(beyond)), "{a:?}, {b:?}, {rule}");
                    let first = meter.measure.first.as_ref().map(|first| first.place.element);
                    assert_eq!(first, differs.then_some(1), "{a:?}, {b:?}, {rule}");
                    assert_eq!(meter.measure.max.as_ref().map(|(_, place)| place.element), first);
                }
            }
        }
        for rule in ["ulp=0", "tube=0:0"] {
            let mut meter = meter(rule);
            put(&mut meter, 0, &[f64::NAN, 0.0], &[f64::NAN, -0.0]);
            meter.finish();
            assert_eq!(meter.measure.beyond, 0, "{rule}");
        }
        let mut nan_equal =
            Meter::new(Some("abs=9".parse().expect("a rule")), None, NotANumber::EqualsItself);
        put(&mut nan_equal, 0, &[f64::NAN, 1.0], &[f64::NAN, f64::NAN]);
        assert_eq!((nan_equal.measure.differing, nan_equal.measure.beyond), (1, 1));
        assert!(!nan_equal.is_within());
        put(&mut nan_equal, 1, &[f64::NAN], &[other]);
        assert_eq!((nan_equal.measure.differing, nan_equal.measure.beyond), (1, 1), "whatever their bits");
        let mut skipping = Meter::new(None, None, NotANumber::Skipped);
        put(&mut skipping, 0, &[f64::NAN, 1.0, 2.0], &[3.0, f64::NAN, 2.0]);
        let measure = &skipping.measure;
        assert_eq!((measure.differing, measure.beyond, measure.elements, measure.skipped), (0, 0, 3, 2));
    }

    #[test]
    fn floats_that_are_not_a_number_are_compared_exactly() {
        // a quiet and a signalling one are the same as doubles
        let [quiet, signalling] = [0x7fc0_0001, 0x7f80_0001].map(f32::from_bits);
        for (other, differing) in [(quiet, 0), (signalling, 1)] {
            let mut meter = meter("");
            let (a, b) = (List::Float(vec![quiet]), List::Float(vec![other]));
            meter.take(&Sample { a: &a, b: &b, place: Place::default(), position: &|_| None });
            assert_eq!((meter.measure.differing, meter.measure.beyond), (differing, differing));
        }
    }

    #[test]
    fn a_norm_that_is_not_finite_is_no_proof() {
        let mut meter = meter("l2_rel=0.1");
        put(&mut meter, 0, &[1e200], &[-3e200]);
        assert!(!meter.is_within());
    }

    #[test]
    fn one_unit_in_the_last_place() {
        let x = 1.0f64;
        for (rule, beyond) in [("", 1), ("ulp=1", 0), ("abs=1e-15", 0), ("rel=1e-17", 1)] {
            let mut meter = meter(rule);
            put(&mut meter, 0, &[x], &[x.next_up()]);
            assert_eq!((meter.measure.differing, meter.measure.beyond), (1, beyond), "{rule}");
        }
        assert_eq!(ulps(-0.0, 0.0, false), Some(0));
        assert_eq!(ulps(-f64::from_bits(1), f64::from_bits(1), false), Some(2));
        assert_eq!(ulps(1.0, f64::from(1f32.next_up()), true), Some(1));
        assert_eq!(ulps(f64::MAX, f64::INFINITY, false), Some(1));
    }

    #[test]
    fn norms_and_sprague_geers_of_a_scaled_series() {
        let mut meter = meter("l2_rel=0.2");
        for k in 0..100 {
            let a = (f64::from(k) * 0.1).sin();
            put(&mut meter, k as u64, &[a], &[1.1 * a]);
        }
        let near = |value: Option<f64>, to: f64| (value.expect("a number") - to).abs() < 1e-12;
        assert!(near(meter.measure.l1_relative(), 0.1) && near(meter.measure.l2_relative(), 0.1));
        let [magnitude, phase, combined] = meter.measure.sprague_geers().expect("numbers");
        assert!((magnitude - 0.1).abs() < 1e-12 && phase < 1e-7 && (combined - 0.1).abs() < 1e-12);
        assert!(near(meter.measure.correlation(), 1.0));
        assert!(meter.is_within(), "elements are free where only the norm is asked for");
        meter.rule = Some("l2_rel=0.05".parse().expect("a rule"));
        assert!(!meter.is_within());
    }

    #[test]
    fn a_shift_by_three_samples_is_found() {
        let mut meter = meter("");
        let f = |k: i32| (f64::from(k) * 0.2).sin();
        for k in 0..200 {
            put(&mut meter, k as u64, &[f(k)], &[if k < 40 { f(k) } else { f(k - 3) }]);
        }
        let (samples, left) = meter.shift.best().expect("a shift");
        assert_eq!(samples, 3);
        assert!(left < 0.3, "{left}");
    }

    #[test]
    fn a_tube_forgives_a_jump_that_comes_a_step_early() {
        let jump = |k: u64, at: u64| if k < at { 0.0 } else { 1.0 };
        for (rule, beyond) in [("tube=0.11:1e-9", 0), ("tube=0.05:1e-9", 1), ("tube=0.05:1.0", 0)] {
            let mut meter = meter(rule);
            for k in 0..20 {
                put(&mut meter, k, &[jump(k, 10)], &[jump(k, 9)]);
            }
            meter.finish();
            assert_eq!(meter.measure.beyond, beyond, "{rule}");
        }
    }

    #[test]
    fn large_integers_are_compared_exactly() {
        let mut meter = meter("");
        let (a, b) = (List::UInt(vec![u64::MAX]), List::UInt(vec![u64::MAX - 1]));
        meter.take(&Sample { a: &a, b: &b, place: Place::default(), position: &|_| None });
        assert_eq!(meter.measure.beyond, 1);
    }
}
