//! Arguments of `info`.

use std::path::PathBuf;

use clap::Args;

use super::{
    outcome::{CliError, Exit, loss, say_parts},
    output::show,
};
use crate::{command::info::info, recording::Limits};

const INFO_EXAMPLES: &str = "\
Examples:
  percuss-read info fig5.mcap
  percuss-read info fig5.mcap --json
  percuss-read info fig5.mcap.part  # of a run in progress";

#[derive(Debug, Args)]
#[command(after_help = INFO_EXAMPLES)]
pub(super) struct InfoArguments {
    /// Recording
    file: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

impl InfoArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
        let (text, recording) = info(&self.file, self.json, limits)?;
        show(&text, self.json)?;
        Ok(loss(&self.file, &recording.damages))
    }
}
