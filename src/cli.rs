//! The command line: arguments, commands, exit status.
//!
//! Data is written to stdout, remarks to stderr. Errors are printed once, by [`report`].
//!
//! Exit statuses are in the guide, `tools/guide/src/commands.md`.

use std::{
    ffi::OsString,
    fmt::Display,
    io::{self, IsTerminal, Write},
    path::{Path, PathBuf},
    process::ExitCode,
    sync::LazyLock,
};

use clap::{Args, Parser, Subcommand};
use miette::{GraphicalReportHandler, GraphicalTheme};
use percuss_output::{
    OutputError,
    text::{document, lines, printable},
};
use percuss_serve::ServeError;

use crate::{
    advice::admissible::SearchError,
    case::{Case, CaseErrors},
    checkpoint::CheckpointError,
    exact::closed_form::NoClosedForm,
    fit::FitError,
    model::Instructions,
    recording::{FORMAT_VERSION, NUMERICS},
    session::RunError,
    sweep::{SweepError, plan::WrongCases},
};

mod bounces;
mod cases;
mod check;
mod exact;
mod fit;
mod layout;
mod manual;
mod materials;
mod output;
mod progress;
mod run;
mod study;
mod sweep;
mod target;

/// Computes the impact of a rigid indenter on an elastic layer, laminate or half-space and records it as MCAP.
#[derive(Debug, Parser)]
#[command(version, long_version = VERSION.as_str(), about, long_about = None, arg_required_else_help = true, after_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

/// What is built: version, numerics and format, and the commit if it is known; and what instructions it computes with here.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let commit = percuss_output::COMMIT.map_or(String::new(), |commit| format!(", commit {commit}"));
    let version = env!("CARGO_PKG_VERSION");
    let instructions = Instructions::detect();
    format!(
        "{version}\nnumerics {NUMERICS}, recording format {FORMAT_VERSION}{commit}\ncomputes with {instructions}"
    )
});

const EXAMPLES: &str = "\
Examples:
  percuss run fig5               # compute Fig. 5 of the paper into fig5.mcap
  percuss run fig5 --set mesh.cells=400 -o fine.mcap
  # watch it in a viewer while it is computed
  percuss run fig5 --live --pace --wait
  percuss exact fig2-prescribed  # the closed form of a case, to compare with
  # the case with every default written out
  percuss check my.toml --resolved > full.toml
  # a parametric study on all cores
  percuss sweep fig8-m5 --vary indenter.mass=0.1:100:31:log -o masses
  percuss-read trace fig5.mcap   # the drag against time

Exit status: 0 done, 1 failed, 2 usage or invalid case; 130, 143 or 129 interrupted by SIGINT, SIGTERM or SIGHUP, \
with a valid partial recording, NAME.mcap.part.";

#[derive(Debug, Subcommand)]
enum Command {
    /// Compute a case and record it
    Run(run::Run),
    /// Record the closed form for a case
    Exact(exact::Exact),
    /// Run a case on refined meshes; orders, extrapolated values, error bars
    Study(study::StudyArguments),
    /// Find values of keys with which a case gives what was measured
    Fit(fit::FitArguments),
    /// Compute a case with keys that vary: thousands of cases, restartable, alone or in shards
    Sweep(Box<sweep::SweepArguments>),
    /// Validate a case; print its sizes and estimates of memory, file size and run time
    Check(check::Check),
    /// Print or write the layout of a viewer for a case
    Layout(layout::Layout),
    /// List the built-in cases and their closed forms
    Cases(cases::Cases),
    /// List the materials that cases can name
    Materials(materials::Materials),
    /// Print completions for a shell
    Completions(manual::Completions),
    /// Print the page of the manual, or write those of all commands
    Man(manual::Manual),
}

#[derive(Debug, Args)]
struct CaseArguments {
    /// Name of a built-in case (see `percuss cases`) or path of a TOML file
    case: String,
    /// Change a key of the case, for example --set mesh.cells=400
    #[arg(long = "set", value_name = "KEY=VALUE")]
    overrides: Vec<String>,
}

/// What cases of several impacts are told by commands that compute one.
const SINGLE: &str = "`run.bounces` is larger than 1, and several impacts are of `percuss run` alone; add --set run.bounces=1 for the first one";

impl CaseArguments {
    fn load(&self) -> Result<Case, CliError> {
        Ok(Case::load(&self.case, &self.overrides)?)
    }

    /// The case of a command that computes one impact.
    fn load_single(&self) -> Result<Case, CliError> {
        let case = self.load()?;
        match case.run.bounces {
            1 => Ok(case),
            _ => Err(CliError::Usage(SINGLE.into())),
        }
    }
}

/// How a command ends without an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done.
    Done,
    /// Interrupted by this signal, with a valid recording of the steps before.
    Interrupted(u8),
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        match exit {
            Exit::Done => ExitCode::SUCCESS,
            Exit::Interrupted(signal) => ExitCode::from(128 + signal),
        }
    }
}

/// Why a command fails.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The case is invalid.
    #[error(transparent)]
    Case(#[from] CaseErrors),
    /// The arguments are invalid.
    #[error("{0}")]
    Usage(String),
    /// It cannot be done as it is asked for, or the system refuses.
    #[error("{0}")]
    Failed(String),
    /// The output exists, or cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The case has no closed form.
    #[error(transparent)]
    NoClosedForm(#[from] NoClosedForm),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A checkpoint cannot be restored.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
    /// No admissible velocity is found.
    #[error(transparent)]
    Search(#[from] SearchError),
    /// There is no fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The sweep is wrong, or has failed.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// Viewers cannot be served.
    #[error(transparent)]
    Serve(#[from] ServeError),
}

impl CliError {
    fn system(what: impl Display, error: impl Display) -> Self {
        Self::Failed(format!("{what}: {error}"))
    }
}

impl Arguments {
    /// Runs the command.
    ///
    /// # Errors
    ///
    /// The reason, for [`report`].
    pub fn run(&self) -> Result<Exit, CliError> {
        match &self.command {
            Command::Run(run) => run.run(),
            Command::Exact(exact) => exact.run(),
            Command::Study(study) => study.run(),
            Command::Fit(fit) => fit.run(),
            Command::Sweep(sweep) => sweep.run(),
            Command::Check(check) => check.run(),
            Command::Layout(layout) => layout.run(),
            Command::Cases(cases) => cases.run(),
            Command::Materials(materials) => materials.run(),
            Command::Completions(completions) => completions.run(),
            Command::Man(manual) => manual.run(),
        }
    }
}

/// Prints an error to stderr and returns its exit status: 2 for usage and invalid cases, 1 for the rest.
pub fn report(error: &CliError) -> ExitCode {
    let (text, status) = match error {
        CliError::Case(errors)
        | CliError::Search(SearchError::Case(errors))
        | CliError::Fit(FitError::Case(errors))
        | CliError::Sweep(SweepError::Case(errors)) => (render(errors), 2),
        CliError::Sweep(SweepError::Cases(wrong)) => (render_cases(wrong), 2),
        CliError::Usage(_) | CliError::NoClosedForm(_) | CliError::Sweep(SweepError::Usage(_)) => {
            (on_a_line(error), 2)
        }
        _ => (on_a_line(error), 1),
    };
    // if stderr is closed, ignore the failure
    drop(io::stderr().write_all(text.as_bytes()));
    ExitCode::from(status)
}

fn on_a_line(error: &CliError) -> String {
    format!("error: {}\n", printable(&error.to_string()))
}

/// Renders the problems of a case with their places: colours on a terminal, plain text elsewhere.
fn render(errors: &CaseErrors) -> String {
    let terminal = io::stderr().is_terminal();
    let colours = terminal && std::env::var_os("NO_COLOR").is_none();
    let theme = match (terminal, colours) {
        (true, true) => GraphicalTheme::unicode(),
        (true, false) => GraphicalTheme::unicode_nocolor(),
        (false, _) => GraphicalTheme::none(),
    };
    let handler = GraphicalReportHandler::new_themed(theme).with_links(false).with_width(110);
    let mut text = format!("error: {errors}\n");
    for problem in &errors.problems {
        handler.render_report(&mut text, problem).expect("a String grows");
    }
    if errors.more > 0 {
        text += &format!("and {} more problems\n", errors.more);
    }
    text
}

/// Groups of wrong cases that are shown.
const GROUPS: usize = 10;

/// Renders the problems of the cases of a sweep, the same ones once.
fn render_cases(wrong: &WrongCases) -> String {
    let mut text = format!("error: {wrong}; none has been run\n");
    for (number, count, errors) in wrong.groups.iter().take(GROUPS) {
        let others = if *count > 1 { format!(" and {} others", count - 1) } else { String::new() };
        text += &format!("\ncase {number}{others}: {}", render(errors));
    }
    if wrong.groups.len() > GROUPS {
        text += &format!("\nand {} other kinds of problems\n", wrong.groups.len() - GROUPS);
    }
    text
}

/// Writes a text to stdout, with which a command is done, without what a file could command a terminal in it.
fn print(text: &str) -> Result<Exit, CliError> {
    print_escaped(&lines(text))
}

/// Writes a JSON document to stdout.
fn print_document(json: &str) -> Result<Exit, CliError> {
    print_escaped(&document(json))
}

/// A closed pipe is no error.
fn print_escaped(text: &str) -> Result<Exit, CliError> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(CliError::system("stdout", error)),
        _ => Ok(Exit::Done),
    }
}

/// Default output of a case: its name and an end, in the current folder.
fn default_output(case: &str, end: &str) -> PathBuf {
    let mut name = stem(case);
    name.push(end);
    name.into()
}

/// Name of a case, of a file without folder and extension.
fn stem(case: &str) -> OsString {
    let path = Path::new(case);
    let is_file = path.extension().is_some_and(|extension| extension == "toml");
    let stem = if is_file { path.file_stem() } else { path.file_name() };
    stem.unwrap_or(path.as_os_str()).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_consistent() {
        use clap::CommandFactory;
        Arguments::command().debug_assert();
    }

    #[test]
    fn outputs_are_named_after_cases() {
        assert_eq!(default_output("fig8-m2.5", ".mcap"), PathBuf::from("fig8-m2.5.mcap"));
        assert_eq!(default_output("cases/my.toml", "-exact.mcap"), PathBuf::from("my-exact.mcap"));
    }
}
