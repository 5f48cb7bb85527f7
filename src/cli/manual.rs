//! `percuss completions`, `percuss man`.

use std::path::PathBuf;

use clap::{Args, CommandFactory};
use percuss_output::manual::{Shell, completions, page, write_pages};

use super::{Arguments, CliError, Exit, print};

const COMPLETIONS: &str = "\
Examples:
  percuss completions bash > \\
      ~/.local/share/bash-completion/completions/percuss
  percuss completions zsh > ~/.zfunc/_percuss
  percuss completions fish > ~/.config/fish/completions/percuss.fish";

/// Prints what a shell needs to complete command lines.
#[derive(Debug, Args)]
#[command(after_help = COMPLETIONS)]
pub(super) struct Completions {
    /// Shell
    shell: Shell,
}

impl Completions {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        print(&completions(Arguments::command(), self.shell))
    }
}

const MANUAL: &str = "\
Examples:
  percuss man | man -l -
  percuss man -o ~/.local/share/man/man1";

/// Prints the page of the manual, or writes those of all commands.
#[derive(Debug, Args)]
#[command(after_help = MANUAL)]
pub(super) struct Manual {
    /// Folder to write the pages of all commands to, in place of older ones
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

impl Manual {
    pub(super) fn run(&self) -> Result<Exit, CliError> {
        let Some(folder) = &self.output else { return print(&page(Arguments::command())) };
        write_pages(Arguments::command(), folder)?;
        Ok(Exit::Done)
    }
}
