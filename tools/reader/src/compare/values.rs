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

/// Elements that differ though they may be the same as doubles: integers beyond 2^53, and floats that are
/// NaN, whose signalling bit is lost.
pub(super) fn hidden_differences(a: &List, b: &List) -> Vec<usize> {
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
        numbers => numbers.number(index).map_or_else(String::new, |number| format!("{number:?}")),
    }
}

/// A text short enough for a report.
pub(super) fn shorten(text: String) -> String {
    const LENGTH: usize = 60;
    match text.char_indices().nth(LENGTH) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text,
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
