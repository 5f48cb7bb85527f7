//! Arguments that choose units, the same for every verb.

use clap::ValueEnum;

/// Units of SI columns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum UnitChoice {
    /// With the prefix that suits the largest number of a column: µs, kN, MPa
    #[default]
    Prefixed,
    /// As they are recorded: s, N, Pa
    Base,
}
