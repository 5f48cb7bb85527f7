//! How to compare.

use clap::Args;

use super::{mode::Mode, tolerance::Rules};
use crate::{
    convention,
    failure::Failure,
    select::{Pattern, Window},
};

/// How to compare.
#[derive(Args, Clone, Debug, Default)]
pub struct Options {
    /// Topics, separated by commas; `*` stands for anything [default: all but those derived from others]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    pub topics: Vec<Pattern>,
    /// Fields, separated by commas; `*` stands for anything [default: all]
    #[arg(long = "field", value_name = "NAME", value_delimiter = ',')]
    pub fields: Vec<Pattern>,
    /// Times compared, and every n-th sample of a channel.
    #[command(flatten)]
    pub window: Window,
    /// How messages are aligned; chosen by looking at them if none.
    #[arg(skip)]
    pub mode: Option<Mode>,
    /// Times count from the start of each recording. Without a mode, also where the recordings have no time in common.
    #[arg(skip)]
    pub relative: bool,
    /// What is allowed.
    #[arg(skip)]
    pub rules: Rules,
    /// What NaN is equal to.
    #[arg(skip)]
    pub nan: NanRule,
    /// Only what both recordings have: messages without a counterpart, as before the start or after the end of the other, and
    /// elements beyond the axes of the other or between those interpolated, are counted and are no difference
    #[arg(long)]
    pub common: bool,
    /// Time that is added to those of the new recording, in the unit of the reference; `fit`: that with the least squares of the
    /// difference, which is reported
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub time_offset: Option<Offset>,
    /// Match topics and fields by their names alone: encodings, message types, numbers and numeric types of fields may differ, and
    /// metadata that only one recording has says nothing
    #[arg(long)]
    pub by_name: bool,
    /// Messages in the order of the file; without it in that of their log times and sequence numbers
    #[arg(long)]
    pub file_order: bool,
    /// Stop at the first difference beyond tolerance
    #[arg(long)]
    pub fail_fast: bool,
}

/// What is added to the times of the new recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Offset {
    /// A time, in the unit of the reference.
    Time(f64),
    /// That of the least squares.
    Fit,
}

impl std::str::FromStr for Offset {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse::<f64>()) {
            ("fit", _) => Ok(Self::Fit),
            (_, Ok(time)) if time.is_finite() => Ok(Self::Time(time)),
            _ => Err("neither a finite number nor `fit`".into()),
        }
    }
}

/// What NaN is equal to, besides the same bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NanRule {
    /// Nothing.
    #[default]
    SameBits,
    /// Any other.
    EqualsItself,
    /// Anything: it stands for no value, and what has none is not compared.
    Skipped,
}

impl NanRule {
    /// True if `x` and `y` count as equal because of NaN.
    pub(super) fn forgives(self, x: f64, y: f64) -> bool {
        match self {
            Self::SameBits => false,
            Self::EqualsItself => x.is_nan() && y.is_nan(),
            Self::Skipped => self.skips(x, y),
        }
    }

    /// True if `x` and `y` are not compared because one is NaN.
    pub(super) fn skips(self, x: f64, y: f64) -> bool {
        self == Self::Skipped && (x.is_nan() || y.is_nan())
    }
}

/// Messages of both recordings that belong together, as they stand in the files.
pub struct Matched<'a> {
    /// Channel of the reference.
    pub channel: u16,
    /// Log time of the reference \[ns\].
    pub log_time: u64,
    /// Message of the reference.
    pub a: &'a [u8],
    /// Message of the new recording.
    pub b: &'a [u8],
}

/// Sees every two messages that are compared as they are, not interpolated.
pub type Watch<'a> = &'a mut dyn FnMut(&Matched<'_>) -> Result<(), Failure>;

impl Options {
    /// True if the numbers of a field take part.
    pub(super) fn compares(&self, topic: &str, field: &str) -> bool {
        self.chooses(topic, field) && !self.leaves_out_residual(topic, field)
    }

    /// True if a field takes part: that it is there, its type, its unit.
    pub(super) fn chooses(&self, topic: &str, field: &str) -> bool {
        let chosen = self.fields.is_empty() || self.fields.iter().any(|pattern| pattern.fits(field));
        chosen && !self.rules.ignores(topic, Some(field))
    }

    /// True for a residual of rounding, which neither `--field` nor a tolerance of its own asks for.
    pub(super) fn leaves_out_residual(&self, topic: &str, field: &str) -> bool {
        let is_residual = (topic, field) == (convention::ENERGY, convention::RESIDUAL);
        is_residual && self.fields.is_empty() && !self.rules.name(topic, field)
    }
}
