//! Arguments of `export`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::Args;

use super::{
    outcome::{CliError, Exit, loss, say},
    output::{by_extension, explain, is_same_file, print, refuse_inputs, write},
};
use crate::{
    command::export::{FORMS, attachment, attachments, form, matrix},
    recording::Limits,
    select::{Pattern, finite_time},
};

const EXPORT_EXAMPLES: &str = "\
Examples:
  percuss-read export fig5.mcap --attachment case.toml             to standard output
  percuss-read export fig5.mcap --attachments -o folder            all, into a folder
  percuss-read export fig5.mcap --topic /field/stress --at-time 2.5 -o field.npy
  percuss-read export fig5.mcap --topic /field/stress -o field.vti            the last, for ParaView
  percuss-read export fig5.mcap --topic /field/stress --at-time 1 -o field.png";

#[derive(Debug, Args)]
#[command(after_help = EXPORT_EXAMPLES)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["attachment", "attachments", "topic"])))]
pub(super) struct ExportArguments {
    /// Recording
    file: PathBuf,
    /// Name of an attachment
    #[arg(long, value_name = "NAME")]
    attachment: Option<String>,
    /// All attachments
    #[arg(long)]
    attachments: bool,
    /// Topic of a field with two axes
    #[arg(long, value_name = "TOPIC")]
    topic: Option<Pattern>,
    /// Time of the field; the nearest message is taken [default: the last]
    #[arg(long, value_name = "T", requires = "topic", allow_negative_numbers = true, value_parser = finite_time)]
    at_time: Option<f64>,
    /// Output: a folder with --attachments; .npy, .vti, .png or .svg with --topic
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite existing output files
    #[arg(long)]
    force: bool,
}

impl ExportArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        refuse_inputs(self.output.as_deref(), std::iter::once(&self.file))?;
        if let Some(name) = &self.attachment {
            let (content, others) = attachment(&self.file, name, limits)?;
            if others > 0 {
                say(&format!("{others} more attachments have this name; --attachments writes them all"));
            }
            write(self.output.as_deref(), self.force, &content)?;
            return Ok(Exit::Done);
        }
        let usage = |text: &str| CliError::Usage(text.into());
        let output = self.output.as_deref().ok_or_else(|| usage("name the output with -o"))?;
        if let Some(topic) = &self.topic {
            let kind = by_extension(output, &FORMS, None)?;
            let (slice, damages) = matrix(&self.file, topic, self.at_time, limits)?;
            write(Some(output), self.force, &form(&slice, kind)?)?;
            say(&slice.title());
            return Ok(loss(&self.file, &damages));
        }
        self.all(output, limits)
    }

    /// All attachments into a folder; nothing is written if any of the names is not safe.
    fn all(&self, folder: &Path, limits: Limits) -> Result<Exit, CliError> {
        let damages = attachments(&self.file, limits, |of, name, content| {
            fs::create_dir_all(folder).map_err(|error| explain(Some(folder), error))?;
            let path = folder.join(name);
            if is_same_file(&path, &self.file) {
                return Err(CliError::SameFile(path));
            }
            write(Some(&path), self.force, content)?;
            if name != Path::new(of) {
                say(&format!("another attachment is named `{of}` as well; this one is `{}`", path.display()));
            }
            print(&format!("{}\n", path.display()))
        })?;
        Ok(loss(&self.file, &damages))
    }
}
