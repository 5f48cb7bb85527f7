//! Log times as they stand in the time column.

use std::time::{Duration, UNIX_EPOCH};

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
    humantime::format_rfc3339_nanos(UNIX_EPOCH + Duration::from_nanos(log_time)).to_string()
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
