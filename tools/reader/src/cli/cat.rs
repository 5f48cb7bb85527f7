//! Arguments of `cat`.

use std::{
    io::{self, BufWriter, Write},
    path::PathBuf,
};

use clap::Args;

use super::{
    outcome::{CliError, Exit, loss, say_parts},
    output::{explain, unless_closed},
};
use crate::{
    command::cat::{Request, cat},
    recording::Limits,
};

const CAT_EXAMPLES: &str = "\
Examples:
  percuss-read cat fig5.mcap --topic '/event,/log'
  percuss-read cat fig5.mcap --topic /drag --from 1 --to 1.1
  percuss-read cat running.mcap.part --topic /drag --every 100 --follow";

#[derive(Debug, Args)]
#[command(after_help = CAT_EXAMPLES)]
pub(super) struct CatArguments {
    /// Recording
    file: PathBuf,
    #[command(flatten)]
    request: Request,
}

impl CatArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
        let mut output = BufWriter::new(io::stdout());
        let result = cat(&self.file, &self.request, limits, &mut output);
        let Some(damages) = unless_closed(result, None)? else { return Ok(Exit::Done) };
        output.flush().map_err(|error| explain(None, error))?;
        Ok(loss(&self.file, &damages))
    }
}
