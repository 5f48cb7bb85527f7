//! Arguments of `cat`.

use std::{
    io::{self, BufWriter, Write},
    path::PathBuf,
};

use clap::Args;

use super::{CliError, Exit, loss, output::explain};
use crate::{
    command::cat::{CatError, Request, cat},
    recording::Limits,
    select::{Pattern, Window},
};

const CAT_EXAMPLES: &str = "\
Examples:
  percuss-read cat fig5.mcap --topic '/event,/log'
  percuss-read cat fig5.mcap --topic /drag --from 1 --to 1.1
  percuss-read cat running.mcap --topic /drag --every 100 --follow";

#[derive(Debug, Args)]
#[command(after_help = CAT_EXAMPLES)]
pub(super) struct CatArguments {
    /// Recording
    file: PathBuf,
    /// Topics, separated by commas; `*` stands for anything [default: all]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    topics: Vec<Pattern>,
    #[command(flatten)]
    window: Window,
    /// Keep reading a recording that is still being written, until it is finished
    #[arg(long)]
    follow: bool,
}

impl CatArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        let request = Request { topics: self.topics.clone(), window: self.window, follow: self.follow };
        let mut output = BufWriter::new(io::stdout());
        let result = cat(&self.file, &request, limits, &mut output);
        let damages = match result {
            Err(CatError::Output(error)) if error.kind() == io::ErrorKind::BrokenPipe => {
                return Ok(Exit::Done);
            }
            Err(CatError::Output(error)) => return Err(explain(None, error)),
            other => other?,
        };
        output.flush().map_err(|error| explain(None, error))?;
        let damages: Vec<_> = damages.into_iter().map(|damage| (self.file.clone(), damage)).collect();
        Ok(loss(&damages))
    }
}
