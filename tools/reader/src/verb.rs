//! What all verbs of the program share: how they are run, how they end, and what goes to standard error.

mod chosen;
mod output;
mod table;

use std::{
    collections::BTreeSet,
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    process::ExitCode,
};

use percuss_output::text::{self, printable};

use crate::{
    failure::Failure,
    field::SelectionError,
    recording::{Damage, Limits, is_part},
};

pub use chosen::Chosen;
pub use output::Write;
pub(crate) use output::{
    by_extension, commit, if_read, print, print_document, print_painted, refuse_inputs, same_file, show,
    write,
};
pub(crate) use table::{TableFormat, UnitChoice};

/// A verb of the program: its arguments, and what it does.
pub trait Verb: clap::Args {
    /// Recordings that it reads.
    fn files(&self) -> &[PathBuf] {
        &[]
    }

    /// Does it within the memory that reading may take.
    ///
    /// # Errors
    ///
    /// What is asked for cannot be had; the status of the program is that of the failure.
    fn run(&self, limits: Limits) -> Result<Exit, Failure>;
}

/// How a verb has ended without an error.
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

/// Runs a verb, once it has said which of its recordings are not complete.
pub(crate) fn run(verb: &impl Verb, limits: Limits) -> Result<Exit, Failure> {
    for file in verb.files().iter().filter(|file| is_part(file) && file.is_file()).collect::<BTreeSet<_>>() {
        say(&format!(
            "note: `{}` is a recording that is not complete: still being written, or interrupted",
            file.display()
        ));
    }
    verb.run(limits)
}

/// Says why a verb has failed, and gives its exit status.
pub fn report(failure: &Failure) -> ExitCode {
    let status = failure.status();
    if status != 0 {
        say(&format!("error: {failure}"));
    }
    ExitCode::from(status)
}

/// Shows which fields of whole topics are left out.
pub(crate) fn say_left_out(left_out: &[SelectionError]) {
    for error in left_out {
        say(&format!("note: left out: {error}"));
    }
}

/// Shows a line on standard error: a name in it, of a file or in one, stays on that line.
pub(crate) fn say(line: &str) {
    text::say(&printable(line));
}

/// True if standard output is a terminal that wants colours.
pub(crate) fn has_colour() -> bool {
    let unwanted = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    io::stdout().is_terminal() && !unwanted
}

/// Reports the damages of a file.
pub(crate) fn loss(file: &Path, damages: &[Damage]) -> Exit {
    for Damage { offset, bytes, reason } in damages {
        let file = file.display();
        match (offset, bytes) {
            // of no place in the file
            (0, 0) => say(&format!("warning: `{file}`: {reason}")),
            _ => say(&format!("warning: `{file}`: {reason} (at byte {offset}, {bytes} bytes lost)")),
        }
    }
    if damages.is_empty() { Exit::Done } else { Exit::Loss }
}

/// Reports the damages of several files, and how many messages were left out.
pub(crate) fn losses(damages: &[(PathBuf, Damage)], undecoded: u64) -> Exit {
    if undecoded > 0 {
        say(&format!(
            "warning: {undecoded} messages do not fit their schema, or unpack to more than --max-memory allows, and are \
             left out"
        ));
    }
    for (file, damage) in damages {
        loss(file, std::slice::from_ref(damage));
    }
    if damages.is_empty() && undecoded == 0 { Exit::Done } else { Exit::Loss }
}
