//! Arguments of `replay`.

use std::{path::PathBuf, time::Duration};

use clap::Args;
use percuss_serve::{Address, seconds, speed};

use super::{CliError, Exit, loss, say};
use crate::{
    command::replay::{Request, replay},
    recording::Limits,
};

const REPLAY_EXAMPLES: &str = "\
Viewers that speak the Foxglove WebSocket protocol connect to the address that is printed; those that have playback control
play, pause and go to times. It begins when nobody has subscribed for 1.5 s, since viewers do that panel by panel; who
comes later gets what has been played so far. Interrupt it with Ctrl-C.

Examples:
  percuss-read replay fig5.mcap                       at ws://127.0.0.1:8765, a unit of time per second
  percuss-read replay fig5.mcap --speed 0.25 --loop
  percuss-read replay fig5.mcap --from 1 --to 3 --addr 0.0.0.0:9000";

#[derive(Debug, Args)]
#[command(after_help = REPLAY_EXAMPLES)]
pub(super) struct ReplayArguments {
    /// Recording, any MCAP file
    file: PathBuf,
    /// Where to serve: HOST:PORT, HOST or PORT; port 0 for any that is free [default: 127.0.0.1:8765, this machine only]
    #[arg(long, value_name = "ADDR")]
    addr: Option<Address>,
    /// Log time that passes in a second
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Begin again at the end
    #[arg(long = "loop", conflicts_with = "once")]
    repeat: bool,
    /// End after the last message, when viewers have left, instead of waiting for viewers that go back
    #[arg(long)]
    once: bool,
    /// With --once, wait for viewers to leave so many seconds at most
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = seconds, requires = "once")]
    hold: Duration,
    /// First time, in the unit of the time column
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Last time, in the unit of the time column
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    to: Option<f64>,
}

impl ReplayArguments {
    pub(super) fn run(&self, limits: Limits) -> Result<Exit, CliError> {
        let request = Request {
            address: self.addr.clone().unwrap_or_default(),
            speed: self.speed,
            from: self.from,
            to: self.to,
            repeat: self.repeat,
            once: self.once,
            hold: self.hold,
        };
        let damages = replay(&self.file, &request, limits, &mut say)?;
        let damages: Vec<_> = damages.into_iter().map(|damage| (self.file.clone(), damage)).collect();
        Ok(loss(&damages))
    }
}
