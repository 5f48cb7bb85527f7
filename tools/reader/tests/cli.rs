//! Help and refusals of both programs: lines that fit, and words of the command line.

use std::collections::BTreeSet;

use clap::{CommandFactory, error::ErrorKind};

/// Both programs, whose commands have their full names.
fn programs() -> [clap::Command; 2] {
    let mut programs = [percuss::cli::Arguments::command(), percuss_reader::cli::Arguments::command()];
    programs.iter_mut().for_each(clap::Command::build);
    programs
}

/// Help of both programs at 80 columns: no line is longer, every verb has examples, and no line of them is broken.
#[test]
fn help_fits_80_columns() {
    let shown = |command: &clap::Command| {
        let mut command = command.clone().term_width(80);
        let texts = [command.render_help().to_string(), command.render_long_help().to_string()];
        for line in texts.iter().flat_map(|text| text.lines()) {
            assert!(line.chars().count() <= 80, "{line}\n{}", texts[1]);
        }
        texts
    };
    for program in programs() {
        shown(&program);
        for verb in program.get_subcommands() {
            let [_, shown] = shown(verb);
            if verb.get_name() == "help" {
                continue;
            }
            let all = verb.get_after_help().map(ToString::to_string).unwrap_or_default();
            let examples =
                all.split_once("Examples:\n").map(|(_, rest)| rest.split("\n\n").next().unwrap_or(rest));
            let examples = examples.unwrap_or_else(|| panic!("`{}` has no examples", verb.get_name()));
            for line in examples.lines() {
                assert!(shown.lines().any(|shown| shown == line), "{line}\n{shown}");
            }
        }
    }
}

/// What is wrong with a number is said in words of the command line, not in those of the programming language.
#[test]
fn refused_numbers_say_what_is_expected() {
    const FOREIGN: [&str; 12] = [
        "digit",
        "float",
        "literal",
        "parse",
        "integer",
        "target type",
        "..",
        "u16",
        "u32",
        "u64",
        "f64",
        "usize",
    ];
    let refusal = |program: &clap::Command, verb: &clap::Command, option: &str, value: &str| {
        let words = [program.get_name(), verb.get_name(), &format!("--{option}={value}")].map(str::to_owned);
        let error = program.clone().try_get_matches_from(words).err();
        error.filter(|error| error.kind() == ErrorKind::ValueValidation).map(|error| error.to_string())
    };
    let programs = programs();
    let mut refused = BTreeSet::new();
    for program in &programs {
        for verb in program.get_subcommands() {
            let options = verb.get_arguments().filter(|argument| argument.get_action().takes_values());
            for option in options.filter_map(clap::Arg::get_long) {
                // beyond the largest whole number, below 0, no whole number, no number
                for value in ["x", "", "-1", "1.5", "1e400", "99999999999999999999"] {
                    if let Some(text) = refusal(program, verb, option, value) {
                        let text = text.lines().next().unwrap_or_default().replace(value, "");
                        assert!(
                            !FOREIGN.iter().any(|word| text.contains(word)),
                            "{} {text}",
                            verb.get_name()
                        );
                        refused.insert(option);
                    }
                }
            }
        }
    }
    for option in ["threads", "every", "refine", "lhs", "seed", "max-memory", "abs", "ulp", "wait", "speed"] {
        assert!(refused.contains(option), "{option}: {refused:?}");
    }
    let run = programs[0].find_subcommand("run").expect("a verb");
    let text = refusal(&programs[0], run, "threads", "x").expect("a refusal");
    assert!(text.starts_with(
        "error: invalid value 'x' for '--threads <N>': a whole number from 1 to 1024 is expected\n"
    ));
}
