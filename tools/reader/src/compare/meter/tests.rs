//! Values and tolerances of all kinds, one sample or a series.

use super::*;

fn meter(rule: &str) -> Meter {
    let rule = (!rule.is_empty()).then(|| rule.parse().expect("a rule"));
    Meter::new(rule, None, NanRule::SameBits)
}

fn put(meter: &mut Meter, k: u64, a: &[f64], b: &[f64]) {
    let place = Location { sample: k, step: Some(k), time: k as f64 * 0.1, ..Location::default() };
    let (a, b) = (List::Double(a.to_vec()), List::Double(b.to_vec()));
    meter.take(&a, &b, &Sample { place, position: &|_| None });
}

#[test]
fn zeros_infinities_and_nan() {
    let other = f64::from_bits(f64::NAN.to_bits() ^ 1);
    // a pair of values; whether it differs at all; whether it is beyond without a tolerance, and with a large one
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
        // by itself, and beside another that is not finite
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
    let mut nan_equal = Meter::new(Some("abs=9".parse().expect("a rule")), None, NanRule::EqualsItself);
    put(&mut nan_equal, 0, &[f64::NAN, 1.0], &[f64::NAN, f64::NAN]);
    assert_eq!((nan_equal.measure.differing, nan_equal.measure.beyond), (1, 1));
    assert!(!nan_equal.is_within());
    put(&mut nan_equal, 1, &[f64::NAN], &[other]);
    assert_eq!((nan_equal.measure.differing, nan_equal.measure.beyond), (1, 1), "whatever their bits");
    let mut skipping = Meter::new(None, None, NanRule::Skipped);
    put(&mut skipping, 0, &[f64::NAN, 1.0, 2.0], &[3.0, f64::NAN, 2.0]);
    let measure = &skipping.measure;
    assert_eq!((measure.differing, measure.beyond, measure.elements, measure.skipped), (0, 0, 3, 2));
}

#[test]
fn nan_of_single_precision_is_compared_exactly() {
    // a quiet and a signalling one are the same as doubles
    let [quiet, signalling] = [0x7fc0_0001, 0x7f80_0001].map(f32::from_bits);
    for (other, differing) in [(quiet, 0), (signalling, 1)] {
        let mut meter = meter("");
        let (a, b) = (List::Float(vec![quiet]), List::Float(vec![other]));
        meter.take(&a, &b, &Sample { place: Location::default(), position: &|_| None });
        assert_eq!((meter.measure.differing, meter.measure.beyond), (differing, differing));
    }
}

#[test]
fn norms_neither_overflow_nor_underflow() {
    let tiny = f64::from_bits(1);
    for (a, b, norm) in [
        (&[1e-200, -1e-200][..], &[2e-200, -2e-200][..], 1.0),
        (&[tiny, 0.0], &[2.0 * tiny, 0.0], 1.0),
        (&[1e200, 1e-200], &[1.25e200, 1e-200], 0.25),
        (&[1.0, 1e-200], &[1.0, 2e-200], 1e-200),
        (&[1e308, -1e308], &[0.75e308, -0.75e308], 0.25),
        (&[3.0, 4.0], &[3.0, 4.5], 0.1),
    ] {
        // alone, and in a message beside one that is not finite
        for with in [&[][..], &[f64::INFINITY]] {
            let (a, b) = ([with, a].concat(), [with, b].concat());
            for (factor, within) in [(0.999, false), (1.001, true), (0.0, false)] {
                let mut meter = meter(&format!("l2_rel={:e}", factor * norm));
                put(&mut meter, 0, &a, &b);
                assert_eq!(meter.is_within(), within, "{a:?}, {b:?}, {factor} of {norm}");
                let found = meter.measure.l2_relative().expect("a norm");
                assert!((found / norm - 1.0).abs() < 1e-12, "{a:?}, {b:?}: {found}");
            }
        }
    }
    // a difference too large for a number is beyond all
    let mut meter = meter("l2_rel=9");
    put(&mut meter, 0, &[1e308, 1.0], &[-1e308, 1.0]);
    assert!(!meter.is_within());
}

#[test]
fn a_range_may_be_too_large_for_a_number() {
    let (a, b) = ([1e308, -1e308], [0.9e308, -0.9e308]);
    let mut scale = Scale::default();
    scale.add(&a);
    for (rule, beyond) in [("range_rel=0.001", 2), ("range_rel=0.049", 2), ("range_rel=0.051", 0)] {
        let mut meter = Meter::new(Some(rule.parse().expect("a rule")), Some(scale), NanRule::SameBits);
        put(&mut meter, 0, &a, &b);
        assert_eq!(meter.measure.beyond, beyond, "{rule}");
    }
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
    assert_eq!(ulps(f64::MAX, f64::INFINITY, false), None);
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
fn a_tube_holds_no_number_that_is_not_finite() {
    for odd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        // beyond: only at the sample itself, whichever recording has it, and not if both have it
        for (in_a, in_b, beyond) in [(true, false, 1), (false, true, 1), (true, true, 0)] {
            let mut meter = meter("tube=0.11:0.5");
            for k in 0..20 {
                let value = |is_odd: bool| if k == 9 && is_odd { odd } else { 1.0 };
                put(&mut meter, k, &[value(in_a)], &[value(in_b)]);
            }
            meter.finish();
            assert_eq!(meter.measure.beyond, beyond, "{odd}: {in_a}, {in_b}");
        }
        // its neighbours are not allowed everything by it
        let mut meter = meter("tube=0.11:0.5");
        for k in 0..20 {
            put(
                &mut meter,
                k,
                &[if k == 9 { odd } else { 1.0 }],
                &[if k == 9 {
                    odd
                } else if k == 10 {
                    7.0
                } else {
                    1.0
                }],
            );
        }
        meter.finish();
        assert_eq!(meter.measure.beyond, 1, "{odd}");
    }
}

#[test]
fn large_integers_are_compared_exactly() {
    let mut meter = meter("");
    let (a, b) = (List::UInt(vec![u64::MAX]), List::UInt(vec![u64::MAX - 1]));
    meter.take(&a, &b, &Sample { place: Location::default(), position: &|_| None });
    assert_eq!(meter.measure.beyond, 1);
}
