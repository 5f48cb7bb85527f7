//! Tables of measured numbers.

/// Value at `x`, linear between the entries of a table, and beyond its ends that of the end.
///
/// * `places`: of the entries, rising, two at least
/// * `value`: of an entry
pub fn table(places: &[f64], x: f64, value: impl Fn(usize) -> f64) -> f64 {
    let i = places.partition_point(|&place| place < x).clamp(1, places.len() - 1);
    let share = ((x - places[i - 1]) / (places[i] - places[i - 1])).clamp(0.0, 1.0);
    value(i - 1) + share * (value(i) - value(i - 1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_interpolated() {
        let at = |x| table(&[1.0, 2.0, 4.0], x, |i| [10.0, 20.0, 0.0][i]);
        assert_eq!([0.0, 1.0, 1.5, 2.0, 3.0, 9.0].map(at), [10.0, 10.0, 15.0, 20.0, 10.0, 0.0]);
    }
}
