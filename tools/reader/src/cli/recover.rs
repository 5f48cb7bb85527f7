//! Arguments of `recover`.

use std::path::PathBuf;

use clap::Args;
use mcap::McapError;
use percuss_output::{Output, text::printable};
use serde_json::json;

use super::{
    outcome::{CliError, Exit, say_parts},
    output::{by_extension, explain, print, print_document, refuse_inputs},
};
use crate::{
    command::recover::{RecoverError, recover},
    recording::{Limits, Scan},
};

const RECOVER_EXAMPLES: &str = "\
Copies every sound message, attachment and metadata record into a new, finished file, and lists what was lost; the \
new file lists it too, in the metadata record `percuss.recovered`. The damaged file is left as it is.

Examples:
  percuss-read recover damaged.mcap -o recovered.mcap

Exit status: 0 nothing was lost, 1 failed, 2 usage, 3 something was lost.";

#[derive(Debug, Args)]
#[command(after_help = RECOVER_EXAMPLES)]
pub(super) struct RecoverArguments {
    /// Damaged recording
    file: PathBuf,
    /// New recording
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Overwrite an existing output file
    #[arg(long)]
    force: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Version of the JSON form of `recover`.
const RECOVER_VERSION: u32 = 1;

impl RecoverArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
        refuse_inputs(Some(&self.output), std::iter::once(&self.file))?;
        by_extension(&self.output, &[("mcap", ())], Some(()))?;
        // what is no recording leaves no new file
        drop(Scan::open(&self.file, limits)?);
        let fail = |error| explain(Some(&self.output), error);
        let mut output = Output::create(&self.output, self.force).map_err(fail)?;
        let recovered = recover(&self.file, &mut output, limits).map_err(|error| match error {
            RecoverError::Write(McapError::Io(error)) => fail(error),
            error => error.into(),
        })?;
        output.commit().map_err(fail)?;
        if self.json {
            let document = json!({
                "version": RECOVER_VERSION,
                "file": self.file.to_string_lossy(),
                "output": self.output.to_string_lossy(),
                "messages": recovered.messages,
                "chunks": recovered.chunks,
                "lost": recovered.lost,
            });
            print_document(&format!("{document:#}\n"))?;
        } else {
            let [file, output] =
                [&self.file, &self.output].map(|path| printable(&path.to_string_lossy()).into_owned());
            let (messages, extras) = (recovered.messages, recovered.extras);
            let mut text = format!(
                "{file} -> {output}: {messages} messages, {extras} attachments and metadata records kept\n"
            );
            if recovered.lost.is_empty() {
                text.push_str("  nothing was lost\n");
            }
            for lost in &recovered.lost {
                text.push_str(&format!("  lost: {lost}\n"));
            }
            print(&text)?;
        }
        Ok(if recovered.lost.is_empty() { Exit::Done } else { Exit::Loss })
    }
}
