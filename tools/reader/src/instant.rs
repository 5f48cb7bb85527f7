//! When a message is: its log time in whole nanoseconds, or a number of its own; and log times in seconds.

use std::cmp::Ordering;

/// When a message is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Instant {
    /// Log time from an origin on \[ns\].
    Log(i128),
    /// Field `time` of the message.
    Number(f64),
}

impl Instant {
    /// * `log_time`, `origin`: \[ns\]
    pub(crate) fn log(log_time: u64, origin: u64) -> Self {
        Self::Log(i128::from(log_time) - i128::from(origin))
    }

    /// The log time from the origin on \[ns\].
    pub(crate) fn nanoseconds(self) -> Option<i128> {
        match self {
            Self::Log(nanoseconds) => Some(nanoseconds),
            Self::Number(_) => None,
        }
    }

    /// As a number; log times in seconds.
    pub(crate) fn number(self) -> f64 {
        match self {
            Self::Number(number) => number,
            Self::Log(nanoseconds) => {
                // two log times are no farther apart
                let distance = seconds(u64::try_from(nanoseconds.unsigned_abs()).unwrap_or(u64::MAX));
                if nanoseconds < 0 { -distance } else { distance }
            }
        }
    }

    /// Time that has passed since another; log times are subtracted as whole numbers.
    pub(crate) fn since(self, other: Self) -> f64 {
        match (self, other) {
            (Self::Log(a), Self::Log(b)) => Self::Log(a - b).number(),
            _ => self.number() - other.number(),
        }
    }

    /// The instant so much later \[s, or the unit of the number\].
    pub(crate) fn later(self, by: f64) -> Self {
        match self {
            Self::Log(nanoseconds) => Self::Log(nanoseconds.saturating_add((by * 1e9).round() as i128)),
            Self::Number(number) => Self::Number(number + by),
        }
    }

    /// An integer that grows with it, among instants of one kind.
    pub(crate) fn key(self) -> i128 {
        match self {
            Self::Log(nanoseconds) => nanoseconds,
            Self::Number(number) => {
                let bits = number.to_bits();
                i128::from(if bits >> 63 == 1 { !bits } else { bits | 1 << 63 })
            }
        }
    }

    pub(crate) fn total_cmp(self, other: Self) -> Ordering {
        match (self, other) {
            (Self::Log(a), Self::Log(b)) => a.cmp(&b),
            _ => self.number().total_cmp(&other.number()),
        }
    }
}

impl PartialEq for Instant {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Log(a), Self::Log(b)) => a == b,
            _ => self.number() == other.number(),
        }
    }
}

impl PartialOrd for Instant {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        match (self, other) {
            (Self::Log(a), Self::Log(b)) => Some(a.cmp(b)),
            _ => self.number().partial_cmp(&other.number()),
        }
    }
}

/// A log time in seconds: the number next to it, so that its shortest text is that of the decimal fraction.
///
/// * `log_time`: \[ns\]
pub(crate) fn seconds(log_time: u64) -> f64 {
    const SECOND: u64 = 1_000_000_000;
    // one rounding: up to here numerator and denominator are exact; beyond, the whole seconds are, and the rounding of
    // the rest is far below a unit in the last place of the sum
    if log_time <= 1 << f64::MANTISSA_DIGITS {
        log_time as f64 / SECOND as f64
    } else {
        (log_time / SECOND) as f64 + (log_time % SECOND) as f64 / SECOND as f64
    }
}

/// Nanoseconds as seconds with all their digits.
pub(crate) fn exact_seconds(nanoseconds: i128) -> String {
    const SECOND: u128 = 1_000_000_000;
    let (sign, size) = (if nanoseconds < 0 { "-" } else { "" }, nanoseconds.unsigned_abs());
    let text = format!("{sign}{}.{:09}", size / SECOND, size % SECOND);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_times_are_the_seconds_next_to_them() {
        let known = [60_000_000, 8_999_640_000, 1_700_000_000_150_000_000, 1 << 53, (1 << 53) + 1, 0];
        // and some that look random
        let many = (0..20_000u64).map(|k| k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (k % 60));
        for log_time in known.into_iter().chain(many) {
            let text = format!("{}.{:09}", log_time / 1_000_000_000, log_time % 1_000_000_000);
            assert_eq!(Ok(seconds(log_time)), text.parse(), "{log_time} ns");
        }
        assert_eq!(seconds(1_700_000_000_150_000_000).to_string(), "1700000000.15");
        assert_eq!(seconds(60_000_000).to_string(), "0.06");
    }

    #[test]
    fn log_times_a_nanosecond_apart_are_two() {
        const DATE: u64 = 1_700_000_000_123_456_789;
        for origin in [0, 1, DATE, u64::MAX] {
            let (a, b) = (Instant::log(DATE, origin), Instant::log(DATE + 1, origin));
            assert!(a < b && a != b && a.key() < b.key() && b.since(a) == 1e-9, "{origin}");
        }
        assert_eq!(exact_seconds(i128::from(DATE)), "1700000000.123456789");
        assert_eq!([0, 3_000_000_000, -1_500_000_000].map(exact_seconds), ["0", "3", "-1.5"]);
    }
}
