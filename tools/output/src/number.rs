//! Numbers of a command line: parsers for clap, whose errors say in words what is expected.

use std::{
    fmt::Display,
    ops::{Bound, RangeBounds},
    str::FromStr,
};

/// A parser of whole numbers in a range.
///
/// ```
/// let threads = percuss_output::number::whole(1_usize..=1024);
/// assert_eq!(threads("2"), Ok(2));
/// assert_eq!(threads("0").unwrap_err(), "a whole number from 1 to 1024 is expected");
/// ```
pub fn whole<T, R>(range: R) -> impl Fn(&str) -> Result<T, String> + Clone + use<T, R>
where
    T: Display + FromStr + PartialOrd,
    R: RangeBounds<T> + Clone,
{
    move |text| {
        let number = text.parse().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| format!("a whole number{} is expected", bounds(&range)))
    }
}

/// A parser of finite numbers in a range.
///
/// ```
/// let tolerance = percuss_output::number::finite(0.0..);
/// assert_eq!(tolerance("1e-9"), Ok(1e-9));
/// assert_eq!(tolerance("inf").unwrap_err(), "a number from 0 on is expected");
/// ```
pub fn finite<R: RangeBounds<f64> + Clone>(
    range: R,
) -> impl Fn(&str) -> Result<f64, String> + Clone + use<R> {
    move |text| {
        let number = text.parse().ok().filter(|number: &f64| number.is_finite() && range.contains(number));
        number.ok_or_else(|| format!("a number{} is expected", bounds(&range)))
    }
}

/// ` from 1 on`, ` above 0`, ` from 1 to 1024`.
fn bounds<T: Display>(range: &impl RangeBounds<T>) -> String {
    let low = match range.start_bound() {
        Bound::Included(least) => format!(" from {least}"),
        Bound::Excluded(limit) => format!(" above {limit}"),
        Bound::Unbounded => String::new(),
    };
    match (range.end_bound(), range.start_bound()) {
        (Bound::Included(most), _) => format!("{low} to {most}"),
        (Bound::Excluded(limit), _) => format!("{low} below {limit}"),
        (Bound::Unbounded, Bound::Included(_)) => format!("{low} on"),
        (Bound::Unbounded, _) => low,
    }
}
