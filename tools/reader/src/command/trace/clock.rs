//! Log times as they stand in the time column.

use clap::ValueEnum;
use percuss_table::{Cell, CellType, Heading};

use crate::instant::Instant;

/// How log times are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum TimeForm {
    /// Seconds: from the start of the recording where log times are dates
    #[default]
    Seconds,
    /// Dates of ISO 8601 in UTC, with nanoseconds
    Iso,
    /// Whole nanoseconds since 1970
    Ns,
}

/// From the times of rows to those of their cells.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    pub(super) form: TimeForm,
    /// Log time of time 0 \[ns\].
    pub(super) origin: u64,
}

impl Clock {
    /// The heading of the time column.
    pub(super) fn heading(self, seconds: Heading) -> Heading {
        let name = "log_time".to_owned();
        match self.form {
            TimeForm::Seconds => seconds,
            TimeForm::Iso => Heading { name, unit: None, kind: CellType::Text },
            TimeForm::Ns => Heading { name, unit: Some("ns".into()), kind: CellType::UInt },
        }
    }

    /// The cell of a time from the origin.
    pub(super) fn cell(self, time: Instant) -> Cell {
        let nanoseconds = || time.nanoseconds().unwrap_or_else(|| (time.number() * 1e9).round() as i128);
        let sum = || nanoseconds().saturating_add(self.origin.into()).clamp(0, u64::MAX.into());
        let log_time = || u64::try_from(sum()).unwrap_or(u64::MAX);
        match self.form {
            TimeForm::Seconds => Cell::Double(time.number()),
            TimeForm::Iso => Cell::Text(iso(log_time())),
            TimeForm::Ns => Cell::UInt(log_time()),
        }
    }
}

/// A log time as a date of ISO 8601 in UTC.
///
/// * `log_time`: since 1970 \[ns\]
pub(crate) fn iso(log_time: u64) -> String {
    const SECOND: u64 = 1_000_000_000;
    const DAY: u64 = 86_400;
    /// Days of 400 years, after which the calendar repeats itself, and from 1 March 0000 to 1 January 1970.
    const CYCLE: u64 = 146_097;
    const BEFORE: u64 = 719_468;
    let (seconds, nanoseconds) = (log_time / SECOND, log_time % SECOND);
    let (days, second) = (seconds / DAY + BEFORE, seconds % DAY);
    let (cycle, day) = (days / CYCLE, days % CYCLE);
    // years begin in March, so that the leap day is their last
    let year = (day - day / 1460 + day / 36_524 - day / (CYCLE - 1)) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = 400 * cycle + year + u64::from(month <= 2);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}.{nanoseconds:09}Z")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        let cases = [
            (0, "1970-01-01T00:00:00.000000000Z"),
            (951_782_400_000_000_001, "2000-02-29T00:00:00.000000001Z"),
            (1_700_000_000_123_456_789, "2023-11-14T22:13:20.123456789Z"),
            (4_107_542_399_000_000_000, "2100-02-28T23:59:59.000000000Z"),
            (4_107_542_400_000_000_000, "2100-03-01T00:00:00.000000000Z"),
            (u64::MAX, "2554-07-21T23:34:33.709551615Z"),
        ];
        for (log_time, date) in cases {
            assert_eq!(iso(log_time), date);
        }
    }
}
