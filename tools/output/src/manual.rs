//! What a command line says of itself: completions of shells, pages of the manual.

use std::path::{Path, PathBuf};

use clap::Command;
pub use clap_complete::Shell;
use clap_mangen::Man;

use crate::{OutputError, write};

/// What a shell needs to complete a command line.
pub fn completions(mut command: Command, shell: Shell) -> String {
    let (name, mut text) = (command.get_name().to_owned(), Vec::new());
    clap_complete::generate(shell, &mut command, name, &mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// The page of the manual of a program, as troff.
pub fn page(command: Command) -> String {
    let mut text = Vec::new();
    Man::new(command).render(&mut text).expect("a Vec grows");
    String::from_utf8_lossy(&text).into_owned()
}

/// Writes the pages of a program and of each of its commands, `NAME.1` and `NAME-COMMAND.1`, in place of older ones.
///
/// # Errors
///
/// The folder or a page cannot be written.
pub fn write_pages(mut command: Command, folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let fail = |error| OutputError::System { path: folder.into(), error };
    std::fs::create_dir_all(folder).map_err(fail)?;
    // names of commands with that of the program
    command.build();
    let commands = command.get_subcommands().filter(|command| command.get_name() != "help").cloned();
    let mut pages = Vec::new();
    for command in std::iter::once(command.clone()).chain(commands) {
        let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
        let path = folder.join(format!("{name}.1"));
        write(&path, page(command).as_bytes(), true)?;
        pages.push(path);
    }
    Ok(pages)
}
