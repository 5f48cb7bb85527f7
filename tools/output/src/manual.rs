//! A command line, and what it says of itself: completions of shells, pages of the manual.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use clap::{
    Command, Error, Parser,
    error::{ContextKind, ContextValue, ErrorKind},
};
pub use clap_complete::Shell;
use clap_mangen::Man;

use crate::{OutputError, write};

/// Reads the arguments of a program, or ends it with what is wrong.
pub fn parse<T: Parser>() -> T {
    let arguments: Vec<OsString> = std::env::args_os().collect();
    read(&arguments).unwrap_or_else(|error| error.exit())
}

/// Reads arguments. A value that begins with a dash is taken for an option: what is said of it is a way that works.
fn read<T: Parser>(arguments: &[OsString]) -> Result<T, Error> {
    T::try_parse_from(arguments).map_err(|mut error| {
        let is_value = |argument: &OsString| match error.get(ContextKind::InvalidArg) {
            Some(ContextValue::String(unknown)) => {
                argument.as_encoded_bytes().starts_with(unknown.as_bytes())
            }
            _ => false,
        };
        let place = arguments.iter().skip(1).position(is_value).map(|place| place + 1);
        if error.kind() == ErrorKind::UnknownArgument && error.remove(ContextKind::Suggested).is_some() {
            let tip = place.and_then(|place| tip::<T>(arguments, place));
            let tips = tip.map(|tip| ContextValue::StyledStrs(vec![tip.into()]));
            tips.map(|tips| error.insert(ContextKind::Suggested, tips));
        }
        error
    })
}

/// How to pass the argument at a place as a value.
fn tip<T: Parser>(arguments: &[OsString], place: usize) -> Option<String> {
    let (before, value, after) = (&arguments[..place], &arguments[place], &arguments[place + 1..]);
    let joined =
        |option: &OsString| [option.clone(), "=".into(), value.clone()].into_iter().collect::<OsString>();
    let (option, others) = before.split_last()?;
    let of_option = [others, &[joined(option)], after].concat();
    let at_end = [before, after, &["--".into(), value.clone()]].concat();
    let ways = [(of_option, joined(option)), (at_end, ["-- ".into(), value.clone()].into_iter().collect())];
    let way = ways.into_iter().find(|(arguments, _)| T::try_parse_from(arguments).is_ok())?.1;
    Some(format!("to pass '{}' as a value, write '{}'", value.to_string_lossy(), way.to_string_lossy()))
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Parser)]
    struct Arguments {
        case: String,
        #[arg(short, long)]
        output: Option<String>,
        #[arg(long)]
        force: bool,
    }

    fn refusal(arguments: &[&str]) -> String {
        let arguments: Vec<OsString> = ["program"].iter().chain(arguments).map(Into::into).collect();
        read::<Arguments>(&arguments).expect_err("they are wrong").to_string()
    }

    #[test]
    fn a_tip_is_one_that_works() {
        let text = refusal(&["fig5", "-o", "-dash.mcap", "--force"]);
        assert!(text.contains("to pass '-dash.mcap' as a value, write '-o=-dash.mcap'"), "{text}");
        let text = refusal(&["fig5", "--output", "-dash"]);
        assert!(text.contains("write '--output=-dash'"), "{text}");
        let text = refusal(&["--force", "-case"]);
        assert!(text.contains("to pass '-case' as a value, write '-- -case'"), "{text}");
        let text = refusal(&["fig5", "--force", "-x"]);
        assert!(text.contains("'-x'") && !text.contains("tip"), "{text}");
        // those for other mistakes stay
        assert!(refusal(&["fig5", "--ouput", "a"]).contains("similar argument exists: '--output'"));
    }
}
