//! Arguments of `replay`.

use std::{path::PathBuf, sync::Arc};

use clap::Args;

use super::outcome::{CliError, Exit, loss, say, say_parts};
use crate::{
    command::replay::{News, Request, replay},
    recording::Limits,
};

const REPLAY_EXAMPLES: &str = "\
Viewers that speak the Foxglove WebSocket protocol connect to the address that is printed; those that have playback \
control play, pause and go to times. It begins 1.5 s after the last subscription, since viewers subscribe panel by \
panel; a viewer that comes later gets what has been played so far. Interrupt it with Ctrl-C.

Examples:
  # at ws://127.0.0.1:8765, a unit of time per second
  percuss-read replay fig5.mcap
  percuss-read replay fig5.mcap --speed 0.25 --loop
  percuss-read replay fig5.mcap --from 1 --to 3 --addr 0.0.0.0:9000
  # for the viewer of that site
  percuss-read replay fig5.mcap --allow-origin https://app.foxglove.dev";

#[derive(Debug, Args)]
#[command(after_help = REPLAY_EXAMPLES)]
pub(super) struct ReplayArguments {
    /// Recording, any MCAP file
    file: PathBuf,
    #[command(flatten)]
    request: Request,
}

impl ReplayArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        say_parts(std::slice::from_ref(&self.file));
        let mut exit = Exit::Done;
        let mut report = |news: News<'_>| match news {
            News::Line(line) => say(line),
            News::Loss(damage) => exit = loss(&self.file, std::slice::from_ref(damage)),
        };
        replay(&self.file, &self.request, limits, Arc::new(say), &mut report)?;
        Ok(exit)
    }
}
