//! Arguments of `report`.

use std::path::PathBuf;

use clap::Args;

use super::{
    outcome::{CliError, Exit, loss, say, say_parts},
    output::{by_extension, refuse_inputs, write},
};
use crate::{
    command::report::{name, report, sweep},
    recording::{Limits, without_part},
};

const REPORT_EXAMPLES: &str = "\
The page needs nothing else and fetches nothing: it can be mailed, opened by any browser, and printed. The section \
is cropped to where the field is above 1 % of its range; a button shows all of it. Arrow keys step through the \
frames, space plays.

Examples:
  percuss-read report fig5.mcap  # into fig5.html
  percuss-read report fig5.mcap -o for-the-paper.html --force
  # a sweep, into masses.html: table, plots, links to its recordings
  percuss-read report masses";

#[derive(Debug, Args)]
#[command(after_help = REPORT_EXAMPLES)]
pub(super) struct ReportArguments {
    /// Recording of a run, or the directory of a sweep
    file: PathBuf,
    /// Page to write [default: the name of the recording or sweep with .html]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite an existing page
    #[arg(long)]
    force: bool,
}

impl ReportArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
        let is_sweep = self.file.is_dir();
        let default = || match is_sweep {
            true => PathBuf::from(name(&self.file) + ".html"),
            false => without_part(&self.file).with_extension("html").file_name().unwrap_or_default().into(),
        };
        let output = self.output.clone().unwrap_or_else(default);
        refuse_inputs(Some(&output), std::iter::once(&self.file))?;
        by_extension(&output, &[("html", ()), ("htm", ())], Some(()))?;
        let (page, damages) = match is_sweep {
            true => (sweep(&self.file, &output, limits)?, Vec::new()),
            false => report(&self.file, limits)?,
        };
        write(Some(&output), self.force, page.as_bytes())?;
        say(&format!("{}: {:.1} MB", output.display(), page.len() as f64 * 1e-6));
        Ok(loss(&self.file, &damages))
    }
}
