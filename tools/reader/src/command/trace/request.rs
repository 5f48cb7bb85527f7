//! What to trace, how much there was, and why a trace failed.

use std::{collections::BTreeSet, path::PathBuf};

use clap::Args;

use super::{clock::TimeForm, join::Align};
use crate::{
    field::{Selection, SelectionError},
    measured::Sources,
    recording::Damage,
    select::{Bound, Pattern, Window, finite_time},
    units::Units,
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
    /// What is damaged, by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Messages that could not be decoded.
    pub undecoded: u64,
    /// Fields of JSON messages that have no column, as neither their schema nor the first messages have them.
    pub hidden: BTreeSet<String>,
    /// Bytes of the files that were read, summaries left aside.
    pub bytes_read: u64,
    /// Fields that are left out of whole topics, and why.
    pub left_out: Vec<SelectionError>,
    /// Names of columns without a value in any row.
    pub empty: Vec<String>,
}
