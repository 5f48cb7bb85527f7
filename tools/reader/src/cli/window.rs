//! Arguments that choose times and messages, the same for every verb.

use clap::Args;

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
