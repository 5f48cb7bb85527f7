//! What all verbs of the program share: how they are run, how they end, and what goes to standard error.

mod arguments;
mod output;

use std::{
    collections::BTreeSet,
    io::{self, IsTerminal},
    path::{Path, PathBuf},
    process::ExitCode,
};

use percuss_output::text::{self, printable};

use crate::{
    failure::Failure,
    messages::Seen,
    recording::{Damage, Limits, is_part},
};

pub use arguments::Chosen;
pub(crate) use arguments::{TableFormat, UnitChoice};
pub use output::Write;
pub(crate) use output::{
    by_extension, commit, if_read, print, print_document, print_painted, refuse_inputs, same_file, show,
    write,
};

/// A verb of the program: its arguments, and what it does.
pub trait Verb: clap::Args {
    /// Does it within the memory that reading may take.
    ///
    /// # Errors
    ///
    /// What is asked for cannot be had; the status of the program is that of the failure.
    fn run(&self, limits: Limits) -> Result<Exit, Failure>;
}

/// How a verb has ended without an error; its number is the exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done = 0,
    /// Done, and the answer is no: recordings differ, a recording is not sound.
    No = 1,
    /// There is no answer: what was asked for is not in what was read.
    NoAnswer = 2,
    /// Done with loss: the file is damaged or cut off.
    Loss = 3,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit as u8)
    }
}

/// Files that a verb reads.
pub(crate) trait Files {
    /// Says which of them are recordings that are not complete.
    fn note_parts(&self);
}

impl Files for PathBuf {
    fn note_parts(&self) {
        if is_part(self) && self.is_file() {
            say(&format!(
                "note: `{}` is a recording that is not complete: still being written, or interrupted",
                self.display()
            ));
        }
    }
}

impl Files for Vec<PathBuf> {
    fn note_parts(&self) {
        self.iter().collect::<BTreeSet<_>>().into_iter().for_each(Files::note_parts);
    }
}

/// Says why a verb has failed, and gives its exit status.
pub fn report(failure: &Failure) -> ExitCode {
    let status = failure.status();
    if status != 0 {
        say(&format!("error: {failure}"));
    }
    ExitCode::from(status)
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

/// What of several files could not be read.
#[derive(Clone, Debug, Default)]
pub struct Losses {
    /// What is damaged, by file.
    pub damages: Vec<(PathBuf, Damage)>,
    /// Messages that could not be decoded.
    pub undecoded: u64,
}

impl Losses {
    pub(crate) fn of(path: &Path, seen: Seen) -> Self {
        let mut losses = Self::default();
        losses.add(path, seen);
        losses
    }

    pub(crate) fn add(&mut self, path: &Path, Seen { damages, undecoded }: Seen) {
        self.damages.extend(damages.into_iter().map(|damage| (path.to_owned(), damage)));
        self.undecoded += undecoded;
    }

    pub(crate) fn report(&self) -> Exit {
        if self.undecoded > 0 {
            say(&format!(
                "warning: {} messages do not fit their schema, or unpack to more than --max-memory allows, and are left out",
                self.undecoded
            ));
        }
        for (file, damage) in &self.damages {
            loss(file, std::slice::from_ref(damage));
        }
        if self.damages.is_empty() && self.undecoded == 0 { Exit::Done } else { Exit::Loss }
    }
}
