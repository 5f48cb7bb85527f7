//! Arguments of `export`.

use std::{
    fs,
    path::{Path, PathBuf},
};

use clap::Args;
use percuss_output::{OutputError, is_same_file, synchronise_all, text::printable, write_later};

use super::{
    outcome::{CliError, Exit, loss, say, say_parts},
    output::{by_extension, explain, print, refuse_inputs, write},
};
use crate::{
    command::export::{Camera, FORMS, attachment, attachments, form, matrix, series},
    recording::Limits,
    select::{Bound, Pattern, finite_time},
};

/// A line for each of what can be exported: together they are too long for one.
const EXPORT_USAGE: &str = "\
percuss-read export [OPTIONS] --topic <TOPIC> <FILE>
       percuss-read export [OPTIONS] --attachment <NAME> <FILE>
       percuss-read export [OPTIONS] --attachments <FILE>";

const EXPORT_EXAMPLES: &str = "\
Examples:
  percuss-read export fig5.mcap --attachment case.toml   # to standard output
  percuss-read export fig5.mcap --attachments -o folder  # all, into a folder
  percuss-read export fig5.mcap --topic /field/stress --at-time 2.5 \\
      -o field.npy
  # the last, for ParaView
  percuss-read export fig5.mcap --topic /field/stress -o field.vti
  # all, for ParaView
  percuss-read export fig5.mcap --topic /field/stress -o series.pvd
  percuss-read export fig5.mcap --topic /field/stress --at-time 1 \\
      -o field.png
  # an image, 2.5 s after the start
  percuss-read export robot.mcap --topic /camera --at-time 2.5 -o image.jpg
  # all images, named by log time
  percuss-read export robot.mcap --topic /camera -o images/";

#[derive(Debug, Args)]
#[command(after_help = EXPORT_EXAMPLES, override_usage = EXPORT_USAGE)]
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
    /// Topic of a field with two axes, or of images
    #[arg(long, value_name = "TOPIC")]
    topic: Option<Pattern>,
    /// Time of the field, in the unit that is recorded or with one, 87us; the nearest message is taken [default: the last]
    #[arg(long, value_name = "T", requires = "topic", allow_negative_numbers = true, value_parser = finite_time)]
    at_time: Option<Bound>,
    /// Output: a folder with --attachments; .npy, .npz (with positions), .vti, .vtr (also of layers), .png or .svg with --topic, or .pvd for all times; of
    /// images .png, .jpg or .webp as they are recorded, or a folder, with a slash at the end if it is new, for
    /// all of them
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite existing output files
    #[arg(long)]
    force: bool,
}

impl ExportArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
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
            if let Some(camera) = Camera::find(&self.file, topic, limits)? {
                let is_folder = output.is_dir() || output.as_os_str().as_encoded_bytes().ends_with(b"/");
                return if is_folder { self.images(&camera, output) } else { self.image(&camera, output) };
            }
            // a file of one time, or the time series
            let mut forms = FORMS.map(|(extension, form)| (extension, Some(form))).to_vec();
            forms.push(("pvd", None));
            let Some(kind) = by_extension(output, &forms, None)? else {
                return self.series(topic, output, limits);
            };
            let (slice, damages) = matrix(&self.file, topic, self.at_time, limits)?;
            write(Some(output), self.force, &form(&slice, kind)?)?;
            say(&slice.title());
            return Ok(loss(&self.file, &damages));
        }
        self.all(output, limits)
    }

    /// A time series: its frames into a folder of its name, and after them the file that names them.
    fn series(&self, topic: &Pattern, output: &Path, limits: Limits) -> Result<Exit, CliError> {
        if self.at_time.is_some() {
            return Err(CliError::Usage(
                "a .pvd is of all times; leave out --at-time, or write a .vti".into(),
            ));
        }
        OutputError::refuse_existing(Some(output), self.force)?;
        let folder = output.with_extension("");
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let mut count = 0;
        let (text, damages) = series(&self.file, topic, &name, limits, |file, bytes| {
            count += 1;
            fs::create_dir_all(&folder).map_err(|error| explain(Some(&folder), error))?;
            Ok::<_, CliError>(write_later(&folder.join(file), bytes, self.force)?)
        })?;
        synchronise_all(&folder).map_err(|error| explain(Some(&folder), error))?;
        write(Some(output), self.force, text.as_bytes())?;
        say(&format!("{}: {count} frames in {}", output.display(), folder.display()));
        Ok(loss(&self.file, &damages))
    }

    /// One image.
    fn image(&self, camera: &Camera, output: &Path) -> Result<Exit, CliError> {
        const EXTENSIONS: [(&str, &str); 4] =
            [("png", "png"), ("jpg", "jpg"), ("jpeg", "jpg"), ("webp", "webp")];
        let named = by_extension(output, &EXTENSIONS, None)?;
        let (moment, damages) = camera.moment(self.at_time)?;
        let image = camera.read(&moment.values)?;
        if image.extension != named {
            let (path, extension) = (output.display(), image.extension);
            let text = format!("`{path}`: the image is a .{extension}; name the output like that");
            return Err(CliError::Usage(text));
        }
        write(Some(output), self.force, image.bytes)?;
        say(&format!("image at {}", moment.time));
        Ok(loss(&self.file, &damages))
    }

    /// All images into a folder, named by their log times, padded so that names are in the order of times.
    fn images(&self, camera: &Camera, folder: &Path) -> Result<Exit, CliError> {
        if self.at_time.is_some() {
            return Err(CliError::Usage(
                "name a file with -o for the image of one time, not a folder".into(),
            ));
        }
        fs::create_dir_all(folder).map_err(|error| explain(Some(folder), error))?;
        let mut last = None;
        let damages = camera.images(|log_time, image| {
            // several at a time are numbered
            let number = match last {
                Some((time, number)) if time == log_time => number + 1,
                _ => 1_u64,
            };
            last = Some((log_time, number));
            let number = if number > 1 { format!(".{number}") } else { String::new() };
            let path = folder.join(format!("{log_time:019}{number}.{}", image.extension));
            write_later(&path, image.bytes, self.force)?;
            print(&format!("{}\n", printable(&path.to_string_lossy())))
        })?;
        synchronise_all(folder).map_err(|error| explain(Some(folder), error))?;
        Ok(loss(&self.file, &damages))
    }

    /// All attachments into a folder, but for those whose names would lead out of it.
    fn all(&self, folder: &Path, limits: Limits) -> Result<Exit, CliError> {
        let (mut skipped, mut is_new) = (0, true);
        let damages = attachments(&self.file, limits, |of, name, content| {
            let Some(name) = name else {
                skipped += 1;
                say(&format!(
                    "warning: the attachment `{of}` is not written: its name is a path; --attachment names it"
                ));
                return Ok(());
            };
            if std::mem::take(&mut is_new) {
                fs::create_dir_all(folder).map_err(|error| explain(Some(folder), error))?;
            }
            let path = folder.join(name);
            if is_same_file(&path, &self.file) {
                return Err(CliError::SameFile(path));
            }
            write_later(&path, content, self.force)?;
            if name != Path::new(of) {
                say(&format!("another attachment is named `{of}` as well; this one is `{}`", path.display()));
            }
            print(&format!("{}\n", printable(&path.to_string_lossy())))
        })?;
        if !is_new {
            synchronise_all(folder).map_err(|error| explain(Some(folder), error))?;
        }
        let exit = loss(&self.file, &damages);
        Ok(if skipped > 0 { Exit::Loss } else { exit })
    }
}
