//! Arguments of `completions` and `man`.

use std::path::PathBuf;

use clap::{Args, CommandFactory};
use percuss_output::manual::{Shell, completions, page, write_pages};

use super::Arguments;
use crate::{
    failure::Failure,
    recording::Limits,
    verb::{Exit, Verb, print},
};

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  percuss-read completions bash > \\
      ~/.local/share/bash-completion/completions/percuss-read
  percuss-read completions zsh > ~/.zfunc/_percuss-read
  percuss-read completions fish > \\
      ~/.config/fish/completions/percuss-read.fish";

/// Completions for a shell
#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS_EXAMPLES)]
pub(super) struct Completions {
    /// Shell
    shell: Shell,
}

impl Verb for Completions {
    fn run(&self, _: Limits) -> Result<Exit, Failure> {
        print(&completions(Arguments::command(), self.shell))?;
        Ok(Exit::Done)
    }
}

const MANUAL_EXAMPLES: &str = "\
Examples:
  percuss-read man | man -l -
  percuss-read man -o ~/.local/share/man/man1";

/// The page of the manual, or those of all commands
#[derive(Debug, Args)]
#[command(after_help = MANUAL_EXAMPLES)]
pub(super) struct Manual {
    /// Folder to write the pages of all commands to, in place of older ones
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

impl Verb for Manual {
    fn run(&self, _: Limits) -> Result<Exit, Failure> {
        match &self.output {
            None => print(&page(Arguments::command()))?,
            Some(folder) => drop(write_pages(Arguments::command(), folder)?),
        }
        Ok(Exit::Done)
    }
}
