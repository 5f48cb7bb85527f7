//! Arguments that choose fields, times and messages, the same for every verb.

use clap::Args;

use crate::{
    field::{Positions, Selection},
    select::Pattern,
};

/// Which fields of which topics.
#[derive(Clone, Debug, Args)]
pub(super) struct Chosen {
    /// Topics, separated by commas; `*` stands for anything [default: /drag; plot --at-time: /interface/stress]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    pub(super) topics: Vec<Pattern>,
    /// Fields, separated by commas: name, a.b.c, name[3], name@r=0.5 [default: all]
    #[arg(long = "field", value_name = "NAME", value_delimiter = ',')]
    fields: Vec<String>,
    /// Positions on the axis of arrays, for example r=0,0.5,0.9, interpolated; plot --at-time: z=0.1 of matrices too
    #[arg(long, value_name = "R=LIST")]
    at: Option<Positions>,
}

impl Chosen {
    /// Fields and positions.
    pub(super) fn selection(&self) -> Selection {
        Selection { fields: self.fields.clone(), at: self.at.clone() }
    }
}

/// Which times, and which of many messages.
#[derive(Clone, Debug, Args)]
pub(super) struct Window {
    /// First time, in the unit of the time column
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub(super) from: Option<f64>,
    /// Last time, in the unit of the time column
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub(super) to: Option<f64>,
    /// Every n-th message of that time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub(super) every: u64,
}
