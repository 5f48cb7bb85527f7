//! Arguments of `verify`.

use std::path::PathBuf;

use clap::Args;

use super::{
    outcome::{CliError, Exit, say_parts},
    output::show,
};
use crate::{command::verify::verify, recording::Limits};

const VERIFY_EXAMPLES: &str = "\
Every checksum, the index against the data, the schemas, every message against its schema, the order of times, the \
counts; of percuss recordings also that everything is there that a run records, or that the closed form knows.

Examples:
  percuss-read verify fig5.mcap
  percuss-read verify --json *.mcap

Exit status: 0 sound, 1 not sound, 2 usage, 3 sound, but messages cannot be decoded, or the run did not come to its planned \
end.";

#[derive(Debug, Args)]
#[command(after_help = VERIFY_EXAMPLES)]
pub(super) struct VerifyArguments {
    /// Recordings
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Print JSON, one document per recording and line
    #[arg(long)]
    json: bool,
}

impl VerifyArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(&self.files);
        let mut exit = Exit::Done;
        for file in &self.files {
            let report = verify(file, limits)?;
            let name = file.to_string_lossy();
            let text = if self.json { format!("{}\n", report.to_json(&name)) } else { report.to_text(&name) };
            show(&text, self.json)?;
            exit =
                match (report.is_sound() || report.is_undecoded_only(), report.partial || !report.is_sound())
                {
                    (false, _) => Exit::No,
                    (true, true) if exit == Exit::Done => Exit::Loss,
                    (true, _) => exit,
                };
        }
        Ok(exit)
    }
}
