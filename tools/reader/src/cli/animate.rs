//! Arguments of `animate`.

use std::{
    fs,
    io::{self, IsTerminal, Write},
    path::PathBuf,
    process::{Child, Command, Stdio},
};

use clap::Args;
use percuss_output::OutputError;
use percuss_picture::Moving;

use super::{
    outcome::{CliError, Exit, loss, say, say_parts},
    output::{by_extension, refuse_inputs, write},
};
use crate::{
    command::animate::{AnimateError, Animation, Request},
    recording::Limits,
};

const ANIMATE_EXAMPLES: &str = "\
Examples:
  percuss-read animate ball.mcap -o ball.gif
  percuss-read animate ball.mcap -o ball.mp4 --fps 30 --width 1920
  percuss-read animate fig5.mcap --from 1 --to 3 --range 1.5 -o fig5.gif

All frames have the same scales. The section is shown as far as it moves. MP4 needs ffmpeg on the PATH.";

#[derive(Debug, Args)]
#[command(after_help = ANIMATE_EXAMPLES)]
pub(super) struct AnimateArguments {
    /// Recording
    file: PathBuf,
    #[command(flatten)]
    request: Request,
    /// Output: .gif or .mp4
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Overwrite an existing output file
    #[arg(long)]
    force: bool,
}

/// Forms by the extensions of files.
const FORMS: [(&str, Form); 2] = [("gif", Form::Gif), ("mp4", Form::Mp4)];

#[derive(Clone, Copy)]
enum Form {
    Gif,
    Mp4,
}

impl AnimateArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
        refuse_inputs(Some(&self.output), std::iter::once(&self.file))?;
        let form = by_extension(&self.output, &FORMS, None)?;
        OutputError::refuse_existing(Some(&self.output), self.force)?;
        let animation = Animation::new(&self.file, &self.request, limits)?;
        let (frames, size) = (animation.length(), animation.size());
        let (mut bytes, mut count) = (Vec::new(), Count::of(frames));
        let damages = match form {
            Form::Gif => {
                // a hundredth of a second is the unit
                let delay = (100 + self.request.fps / 2) / self.request.fps;
                let mut moving = Moving::new(&mut bytes, size, delay).map_err(AnimateError::Write)?;
                let damages = animation.draw(|raster| {
                    count.next();
                    moving.add(&raster)
                })?;
                moving.finish().map_err(AnimateError::Write)?;
                damages
            }
            Form::Mp4 => {
                let film = Mp4::begin(size, self.request.fps)?;
                let mut input = film.child.stdin.as_ref();
                let drawn = animation.draw(|raster| {
                    count.next();
                    input
                        .as_mut()
                        .map_or(Ok(()), |input| input.write_all(&raster.rgba))
                        .map_err(|error| error.to_string())
                });
                // a codec that fails says more than a pipe that is closed
                bytes = film.finish()?;
                drawn?
            }
        };
        write(Some(&self.output), self.force, &bytes)?;
        let size = bytes.len() as f64 * 1e-6;
        say(&format!("{}: {frames} frames, {size:.1} MB", self.output.display()));
        Ok(loss(&self.file, &damages))
    }
}

/// Says at a terminal how many frames are drawn.
struct Count {
    done: usize,
    all: usize,
    is_shown: bool,
}

impl Count {
    fn of(all: usize) -> Self {
        Self { done: 0, all, is_shown: io::stderr().is_terminal() }
    }

    fn next(&mut self) {
        self.done += 1;
        if self.is_shown {
            let end = if self.done == self.all { "\n" } else { "" };
            eprint!("\rframe {} of {}{end}", self.done, self.all);
        }
    }
}

/// A film that ffmpeg writes, into a file of its own until it is whole.
struct Mp4 {
    child: Child,
    folder: tempfile::TempDir,
}

impl Mp4 {
    fn begin((width, height): (u32, u32), fps: u16) -> Result<Self, CliError> {
        let failed = |error: io::Error| AnimateError::Write(error.to_string());
        let folder = tempfile::tempdir().map_err(failed)?;
        let (size, rate) = (format!("{width}x{height}"), fps.to_string());
        let child = Command::new("ffmpeg")
            .args([
                "-loglevel",
                "error",
                "-f",
                "rawvideo",
                "-pix_fmt",
                "rgba",
                "-s",
                &size,
                "-r",
                &rate,
                "-i",
                "-",
            ])
            .args(["-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-flags:v", "+bitexact"])
            .args(["-movflags", "+faststart"])
            .arg(folder.path().join("film.mp4"))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        match child {
            Ok(child) => Ok(Self { child, folder }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let text = "MP4 needs ffmpeg, which is not on the PATH; install it, or write a .gif";
                Err(CliError::Usage(text.into()))
            }
            Err(error) => Err(failed(error).into()),
        }
    }

    fn finish(self) -> Result<Vec<u8>, CliError> {
        let failed = |error: io::Error| CliError::from(AnimateError::Write(error.to_string()));
        // closes its input, which ends the film
        let done = self.child.wait_with_output().map_err(failed)?;
        if !done.status.success() {
            let text = String::from_utf8_lossy(&done.stderr).trim().to_owned();
            return Err(AnimateError::Write(format!("ffmpeg: {text}")).into());
        }
        fs::read(self.folder.path().join("film.mp4")).map_err(failed)
    }
}
