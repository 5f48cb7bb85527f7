//! How `diff` aligns messages: the modes of a comparison, or one by itself with relative times.

use clap::{ValueEnum, builder::PossibleValue};

use crate::compare::Mode;

/// Value of `--align`.
#[derive(Clone, Copy, Debug)]
pub(super) enum Align {
    Mode(Mode),
    Relative,
}

impl ValueEnum for Align {
    fn value_variants<'a>() -> &'a [Self] {
        &[
            Self::Mode(Mode::Step),
            Self::Mode(Mode::Time),
            Self::Mode(Mode::Order),
            Self::Mode(Mode::Nearest),
            Self::Mode(Mode::Linear),
            Self::Mode(Mode::Cubic),
            Self::Relative,
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Mode(mode) => mode.to_possible_value(),
            Self::Relative => Some(
                PossibleValue::new("relative")
                    .help("Times count from the start of each recording; then by step, exact time or linear"),
            ),
        }
    }
}
