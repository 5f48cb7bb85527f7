//! How a command has ended: its exit status, errors, and what goes to standard error.

use std::{
    collections::BTreeSet,
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    process::ExitCode,
};

use percuss_output::{
    OutputError,
    text::{self, printable},
};

use crate::{
    command::{
        animate::AnimateError, cat::CatError, export::ExportError, plot::PlotError, recover::RecoverError,
        replay::ReplayError, report::ReportError, summary::SummaryError, trace::TraceError,
    },
    compare::CompareError,
    field::SelectionError,
    recording::{Damage, OpenError, is_part},
    slice::MomentError,
    tabular::TableError,
};

/// How a command has ended without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done,
    /// Done, and the answer is no: recordings differ, a recording is not sound.
    No,
    /// Done with loss: the file is damaged or cut off.
    Loss,
    /// There is no answer: what was asked for is not in what was read.
    NoAnswer,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Done => Self::SUCCESS,
            Exit::No => Self::from(1),
            Exit::Loss => Self::from(3),
            Exit::NoAnswer => Self::from(2),
        }
    }
}

/// Why a command has failed.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The file cannot be read.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// Tracing failed.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// No film.
    #[error(transparent)]
    Animate(#[from] AnimateError),
    /// No picture.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// Nothing recovered.
    #[error(transparent)]
    Recover(#[from] RecoverError),
    /// Nothing replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// No report.
    #[error(transparent)]
    Report(#[from] ReportError),
    /// No summary.
    #[error(transparent)]
    Summary(#[from] SummaryError),
    /// Nothing exported.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// No messages shown.
    #[error(transparent)]
    Cat(#[from] CatError),
    /// A comparison could not be made.
    #[error(transparent)]
    Compare(#[from] CompareError),
    /// Why there is no comparison.
    #[error(transparent)]
    NotCompared(Box<CliError>),
    /// The command line asks for something that does not go together.
    #[error("{0}")]
    Usage(String),
    /// Output would go where the input is.
    #[error("`{}` is the recording itself; choose another output with -o", .0.display())]
    SameFile(PathBuf),
    /// Signals cannot be watched for.
    #[error("cannot watch for signals: {0}")]
    Signals(io::Error),
    /// The output exists, or cannot be created or written.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Prints an error to stderr and returns its exit status.
pub fn report(error: &CliError) -> ExitCode {
    say(&format!("error: {error}"));
    let is_usage = |error: &TraceError| {
        matches!(
            error,
            TraceError::Open(OpenError::UnknownTopic { .. } | OpenError::NothingDecoded { .. })
                | TraceError::Table(TableError::Unfit { .. })
                | TraceError::Moment(MomentError::Outside { .. } | MomentError::Unit(_))
                | TraceError::Selection(_)
                | TraceError::Columns { .. }
                | TraceError::TimeUnits { .. }
                | TraceError::OwnTime(_)
        )
    };
    let status = match error {
        CliError::Trace(error) | CliError::Plot(PlotError::Trace(error)) if is_usage(error) => 2,
        CliError::Plot(
            PlotError::Nothing(_)
            | PlotError::Unfit(_)
            | PlotError::Table(TableError::NoColumn { .. } | TableError::Unfit { .. })
            | PlotError::Moment(MomentError::Outside { .. } | MomentError::Unit(_)),
        )
        | CliError::Export(
            ExportError::Open(OpenError::UnknownTopic { .. })
            | ExportError::NoAttachment { .. }
            | ExportError::NoMatrix(_)
            | ExportError::Several { .. }
            | ExportError::Uneven { .. }
            | ExportError::Moment(MomentError::Outside { .. } | MomentError::Unit(_)),
        )
        | CliError::Cat(
            CatError::Open(OpenError::UnknownTopic { .. })
            | CatError::Unit(_)
            | CatError::Moment(MomentError::Outside { .. } | MomentError::Unit(_)),
        )
        | CliError::Open(OpenError::UnknownTopic { .. })
        | CliError::Replay(ReplayError::Empty { .. } | ReplayError::Nothing | ReplayError::Unit(_))
        | CliError::Report(ReportError::NotPercuss(_) | ReportError::NotSweep(_))
        | CliError::Summary(SummaryError::NotPercuss(_) | SummaryError::Units { .. })
        | CliError::SameFile(_)
        | CliError::Usage(_)
        | CliError::NotCompared(_) => 2,
        _ => 1,
    };
    ExitCode::from(status)
}

/// Shows which fields of whole topics are left out.
pub(super) fn say_left_out(left_out: &[SelectionError]) {
    for error in left_out {
        say(&format!("note: left out: {error}"));
    }
}

/// Says once of every recording that is not complete that it is not.
pub(super) fn say_parts(files: &[PathBuf]) {
    for file in files.iter().filter(|file| is_part(file) && file.is_file()).collect::<BTreeSet<_>>() {
        say(&format!(
            "note: `{}` is a recording that is not complete: still being written, or interrupted",
            file.display()
        ));
    }
}

/// Shows a line on standard error: a name in it, of a file or in one, stays on that line.
pub(super) fn say(line: &str) {
    text::say(&printable(line));
}

/// True if standard output is a terminal that wants colours.
pub(super) fn has_colour() -> bool {
    let unwanted = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !unwanted
}

/// Reports the damages of a file.
pub(super) fn loss(file: &Path, damages: &[Damage]) -> Exit {
    for Damage { offset, bytes, reason } in damages {
        say(&format!("warning: `{}`: {reason} (at byte {offset}, {bytes} bytes lost)", file.display()));
    }
    if damages.is_empty() { Exit::Done } else { Exit::Loss }
}

/// Reports the damages of several files.
pub(super) fn losses(damages: &[(PathBuf, Damage)]) -> Exit {
    for (file, damage) in damages {
        loss(file, std::slice::from_ref(damage));
    }
    if damages.is_empty() { Exit::Done } else { Exit::Loss }
}
