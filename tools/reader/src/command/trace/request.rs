//! What to trace, how log times stand in the table, and how much there was.

use std::{
    collections::BTreeSet,
    time::{Duration, UNIX_EPOCH},
};

use clap::{Args, ValueEnum};
use percuss_table::{Cell, CellType, Heading};

use crate::{
    field::{Selection, SelectionError},
    instant::Instant,
    measured::Sources,
    select::{Bound, Pattern, Window, finite_time},
    units::Units,
    verb::Losses,
};

/// What to trace.
#[derive(Args, Clone, Debug, Default)]
pub struct Request {
    /// Topics; if none, that of [`select::channels_or_default`](crate::select::channels_or_default).
    #[arg(skip)]
    pub topics: Vec<Pattern>,
    /// Fields and positions.
    #[arg(skip)]
    pub selection: Selection,
    /// Times, in the unit of the time column, and every n-th row.
    #[command(flatten)]
    pub window: Window,
    /// Times: only the messages nearest to them, in the unit that is recorded or with one, 87us
    #[arg(long = "at-time", value_name = "T", value_delimiter = ',', allow_negative_numbers = true, value_parser = finite_time)]
    #[arg(conflicts_with_all = ["from", "to", "every", "follow"])]
    pub at_times: Vec<Bound>,
    /// How several topics or files share rows
    #[arg(long, value_enum, default_value = "exact")]
    pub align: Align,
    /// Files one after the other with their names in the first column, instead of side by side
    #[arg(long)]
    pub stack: bool,
    /// Log times as seconds since 1970, in the table and in --from and --to, instead of from the start of the recording
    #[arg(long, conflicts_with = "time")]
    pub epoch: bool,
    /// Form of log times in the table; --from and --to stay seconds from the start of the recording
    #[arg(long, value_enum, value_name = "FORM", default_value = "seconds")]
    pub time: TimeForm,
    /// Keep reading a recording that is still being written
    #[arg(long)]
    pub follow: bool,
    /// How files are opened: only a picture takes tables.
    #[arg(skip)]
    pub sources: Sources,
    /// When SI columns get prefixes.
    #[arg(skip)]
    pub prefixes: Prefixes,
    /// Units that are chosen, in every format.
    #[command(flatten)]
    pub units: Units,
}

/// When SI columns get prefixes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Prefixes {
    /// Never.
    #[default]
    Never,
    /// If all recordings are of percuss.
    OfPercuss,
    /// Whatever program wrote them.
    Always,
}

/// How much there was.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Rows written.
    pub rows: u64,
    /// What could not be read.
    pub losses: Losses,
    /// Fields of JSON messages that have no column, as neither their schema nor the first messages have them.
    pub hidden: BTreeSet<String>,
    /// Fields that are left out of whole topics, and why.
    pub left_out: Vec<SelectionError>,
    /// Names of columns without a value in any row.
    pub empty: Vec<String>,
}

/// How rows come about where several topics or files are traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Align {
    /// A row for every time; empty cells where a topic has nothing at just that time
    #[default]
    Exact,
    /// Rows at the times of the first topic, the nearest message of the others
    Nearest,
    /// Rows at the times of the first topic, the others interpolated
    Linear,
}

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
    pub(super) fn heading(self, seconds: Heading) -> Heading {
        let name = "log_time".to_owned();
        match self.form {
            TimeForm::Seconds => seconds,
            TimeForm::Iso => Heading { name, unit: None, kind: CellType::Text },
            TimeForm::Ns => Heading { name, unit: Some("ns".into()), kind: CellType::UInt },
        }
    }

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
