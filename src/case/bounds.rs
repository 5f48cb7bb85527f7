//! Bounds of the numbers in a case.

use std::fmt;

/// Largest dimensionless size or time. Far beyond any use, far from overflow.
pub(super) const HUGE: f64 = 1e6;
/// Smallest dimensionless size, mass or velocity.
pub(super) const TINY: f64 = 1e-6;
/// Largest number of probes or profile points.
pub(super) const MAX_LIST: usize = 100_000;

/// Bounds of a number; never NaN.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    low: f64,
    high: f64,
    low_open: bool,
    high_open: bool,
    or_infinite: bool,
}

impl Bounds {
    /// `low < x ≤ high`
    pub const fn above(low: f64, high: f64) -> Self {
        Self { low, high, low_open: true, high_open: false, or_infinite: false }
    }

    /// `low < x < high`
    pub const fn between(low: f64, high: f64) -> Self {
        Self { high_open: true, ..Self::above(low, high) }
    }

    /// `low ≤ x ≤ high`
    pub const fn within(low: f64, high: f64) -> Self {
        Self { low_open: false, ..Self::above(low, high) }
    }

    /// Also infinity.
    pub const fn or_infinite(self) -> Self {
        Self { or_infinite: true, ..self }
    }

    /// The bounds of numbers in a unit.
    ///
    /// * `scale`: value of the unit of these bounds in that unit
    pub fn in_unit(&self, scale: f64, unit: &str) -> String {
        self.text(|x| match format!("{:.4e}", x * scale).replace(".0000e", "e") {
            zero if zero == "0e0" => format!("0 {unit}"),
            text => format!("{} {unit}", text.strip_suffix("e0").unwrap_or(&text)),
        })
    }

    fn text(&self, number: impl Fn(f64) -> String) -> String {
        let (low, high) = (if self.low_open { ">" } else { "≥" }, if self.high_open { "<" } else { "≤" });
        let end = if self.or_infinite { ", or inf" } else { "" };
        format!("{low} {} and {high} {}{end}", number(self.low), number(self.high))
    }

    /// True if `x` is allowed.
    pub fn contain(&self, x: f64) -> bool {
        (self.or_infinite && x == f64::INFINITY)
            || ((if self.low_open { x > self.low } else { x >= self.low })
                && (if self.high_open { x < self.high } else { x <= self.high }))
    }
}

impl fmt::Display for Bounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = |x: f64| if x.abs() < 1e15 { x.to_string() } else { format!("{x:e}") };
        write!(f, "a number {}", self.text(number))
    }
}
