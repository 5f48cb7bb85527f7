//! Single values: equal bits, distances, and how they are shown.

use crate::wire::List;

/// False for NaN and for infinite differences: relative to an infinity all others would be within.
pub(super) fn within(difference: f64, allowed: f64) -> bool {
    difference.is_finite() && difference <= allowed
}

/// The same bits: −0 is not +0, NaN is itself.
pub(super) fn is_same(x: f64, y: f64) -> bool {
    x.to_bits() == y.to_bits()
}

/// Distance of two numbers of the same type in units in the last place; an infinity is at none from another number.
pub(super) fn ulps(x: f64, y: f64, floats: bool) -> Option<u64> {
    if !x.is_finite() || !y.is_finite() {
        return (x == y).then_some(0);
    }
    // an integer that grows with the number
    let order = |number: f64| {
        let bits =
            if floats { (number as f32).abs().to_bits().into() } else { number.abs().to_bits() as i64 };
        if number.is_sign_negative() { -bits } else { bits }
    };
    Some(order(x).abs_diff(order(y)))
}

/// Makes doubles differ of floats that do though they are the same as doubles: NaN, whose signalling bit is lost.
///
/// * `numbers`: those of `b`
pub(super) fn show_hidden(a: &List, b: &List, numbers: &mut [f64]) {
    let (List::Float(a), List::Float(b)) = (a, b) else { return };
    for ((x, y), number) in a.iter().zip(b).zip(numbers) {
        let is_hidden = x.is_nan() && y.is_nan() && x.to_bits() != y.to_bits();
        if is_hidden && is_same(f64::from(*x), *number) {
            *number = f64::from_bits(number.to_bits() ^ 1);
        }
    }
}

/// True for whole numbers of which one may be no double-precision number.
pub(super) fn has_large(list: &List) -> bool {
    /// Up to here all whole numbers are double-precision numbers.
    const EXACT: u64 = 1 << f64::MANTISSA_DIGITS;
    match list {
        List::Int(list) => list.iter().any(|value| value.unsigned_abs() > EXACT),
        List::UInt(list) => list.iter().any(|&value| value > EXACT),
        _ => false,
    }
}

/// Value `index` of a list of numbers where it is a whole number, as −0 is not.
pub(super) fn whole(list: &List, index: usize) -> Option<i128> {
    let is_whole = |x: &f64| x.fract() == 0.0 && x.abs() < 1e30 && !is_same(*x, -0.0);
    match list {
        List::Int(list) => list.get(index).map(|&value| value.into()),
        List::UInt(list) => list.get(index).map(|&value| value.into()),
        numbers => numbers.number(index).filter(is_whole).map(|value| value as i128),
    }
}

/// Value `index` of a list as text.
pub(super) fn text(list: &List, index: usize) -> String {
    match list {
        List::Bool(list) => list[index].to_string(),
        List::Enum(list) => list[index].to_string(),
        List::Text(list) => list[index].clone(),
        List::Bytes(list) => {
            let hex = list[index].iter().map(|byte| format!("{byte:02x}"));
            format!("{} bytes {}", list[index].len(), hex.collect::<String>())
        }
        List::Int(list) => list[index].to_string(),
        List::UInt(list) => list[index].to_string(),
        numbers => numbers.number(index).map_or_else(String::new, |number| format!("{number:?}")),
    }
}

/// A text short enough for a report.
pub(crate) fn shorten(text: &str) -> String {
    const LENGTH: usize = 60;
    match text.char_indices().nth(LENGTH) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_owned(),
    }
}

/// The shortest text that reads back as the number; the bits of NaN where both values are.
///
/// * `is_float`: the number is of single precision
pub(super) fn number(value: f64, is_float: bool, are_nan: bool) -> String {
    match (are_nan, is_float) {
        (true, _) => format!("NaN with bits {:016x}", value.to_bits()),
        (false, true) => format!("{:?}", value as f32),
        (false, false) => format!("{value:?}"),
    }
}
