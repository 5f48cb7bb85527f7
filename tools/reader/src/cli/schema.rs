//! Arguments of `schema`.

use std::path::PathBuf;

use clap::Args;

use super::{
    outcome::{CliError, Exit, say_parts},
    output::print,
};
use crate::{command::schema::schema, recording::Limits, select::Pattern};

const SCHEMA_EXAMPLES: &str = "\
Examples:
  percuss-read schema fig5.mcap --topic /drag
  percuss-read schema fig5.mcap > messages.proto";

#[derive(Debug, Args)]
#[command(after_help = SCHEMA_EXAMPLES)]
pub(super) struct SchemaArguments {
    /// Recording
    file: PathBuf,
    /// Topics, separated by commas; `*` stands for anything [default: all]
    #[arg(long = "topic", value_name = "TOPIC", value_delimiter = ',')]
    topics: Vec<Pattern>,
}

impl SchemaArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
        print(&schema(&self.file, &self.topics, limits)?)?;
        Ok(Exit::Done)
    }
}
