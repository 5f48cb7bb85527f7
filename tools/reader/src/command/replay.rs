//! `replay`: a recording served to viewers in its own time, with play, pause and seek.

use std::{
    collections::HashMap,
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use clap::Args;
use percuss_serve::{Access, Address, AllowedOrigin, Channel, Playback, Playing, Server, speed};

use crate::{
    command::recover::recover,
    convention,
    failure::Failure,
    instant::seconds,
    messages::Recording,
    recording::{Damage, Limits, open_file},
    select::{Bound, Window},
    timeline::{Event, Timeline},
    verb::{Exit, Verb, loss, say},
};

const REPLAY_EXAMPLES: &str = "\
Viewers that speak the Foxglove WebSocket protocol connect to the address that is printed; those that have playback \
control (subprotocol foxglove.sdk.v1) play, pause, go to times and change the speed. It begins 1.5 s after the last subscription, since viewers subscribe panel by \
panel; a viewer that comes later gets what has been played so far. Interrupt it with Ctrl-C.

Examples:
  # at ws://127.0.0.1:8765, a unit of time per second
  percuss-read replay fig5.mcap
  percuss-read replay fig5.mcap --speed 0.25 --loop
  percuss-read replay fig5.mcap --from 1 --to 3 --addr 0.0.0.0:9000
  # for the viewer of that site
  percuss-read replay fig5.mcap --allow-origin https://app.foxglove.dev";

/// A recording served to viewers in its own time, with play, pause and seek
#[derive(Debug, Args)]
#[command(after_help = REPLAY_EXAMPLES)]
pub struct Replay {
    /// Recording, any MCAP file
    pub(crate) file: PathBuf,
    /// Where to serve: HOST:PORT, HOST or PORT; port 0 for any that is free [default: 127.0.0.1:8765, this machine only]
    #[arg(long = "addr", value_name = "ADDR")]
    address: Option<Address>,
    /// Let pages of this origin connect, for example `https://app.foxglove.dev`: the site of a viewer in a browser; * for all
    /// sites. Desktop viewers, programs and pages served by this machine need none. Repeatable
    #[arg(long, value_name = "ORIGIN")]
    allow_origin: Vec<AllowedOrigin>,
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
    #[arg(long, value_name = "SECONDS", default_value = "60", value_parser = percuss_serve::seconds, requires = "once")]
    hold: Duration,
    /// First time, in the unit of the time of messages or with one, 32us; else in seconds of log time
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    from: Option<Bound>,
    /// Last time, like the first
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    to: Option<Bound>,
}

impl Verb for Replay {
    /// Serves a recording until the end if that is asked for, else for good.
    fn run(&self, limits: Limits) -> Result<Exit, Failure> {
        let path = self.file.as_path();
        let recording = Recording::open(path, limits)?;
        let window = Window { from: self.from, to: self.to, every: 1 };
        let mut timed = recording.channels.values().filter(|channel| channel.has_time());
        timed.try_for_each(|channel| window.check(channel))?;
        let (mut timeline, opened) = open(path, limits)?;
        let span = timeline.span().and_then(|(first, last)| {
            let (low, high) = log_times(&recording, window);
            let span = (first.max(low), last.min(high));
            (span.0 <= span.1).then_some(span)
        });
        let Some(span) = span else {
            let (from, to) = (self.from.map(Bound::number), self.to.map(Bound::number));
            let (from, to) = (from.unwrap_or(0.0), to.unwrap_or(f64::INFINITY));
            return Err(Failure::Usage(format!("no messages from {from} to {to}")));
        };
        // a file of which nothing can be played is refused before viewers are awaited
        timeline.go_to(span.0);
        let first = timeline.next_event()?;
        let begun = loss(path, timeline.damages());
        if first.is_none() {
            return Err(nothing());
        }
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let channels: Vec<Channel> = timeline.channels().values().cloned().collect();
        let numbers = timeline.channels().keys().enumerate().map(|(number, id)| (*id, number)).collect();
        let address = self.address.clone().unwrap_or_default();
        let access = Access { origins: self.allow_origin.clone(), report: Arc::new(say) };
        let server = Server::open(&address, &name, &channels, Some(span), access)?;
        say(&format!(
            "{name}: at {} for {}; plays when viewers have subscribed",
            server.url(),
            server.reach()
        ));
        let mut player = Player {
            server,
            path,
            said: timeline.damages().len(),
            exit: if begun == Exit::Loss { begun } else { opened },
            timeline,
            numbers,
            span,
            speed: self.speed,
            state: Playing::Playing,
            is_waiting: true,
            head: None,
            clock: (Instant::now(), span.0),
        };
        player.run(self.once, self.repeat)?;
        player.server.hold(self.hold, || false);
        Ok(player.exit)
    }
}

/// Longest wait between two checks of what viewers want.
const NAP: Duration = Duration::from_millis(50);

fn nothing() -> Failure {
    Failure::Usage("nothing can be replayed: no message of it can be read".into())
}

/// First and last log time that are asked for \[ns\].
fn log_times(recording: &Recording, window: Window) -> (u64, u64) {
    match recording.entries(convention::RUN).and_then(convention::playback_rate) {
        Some(rate) => {
            // as percuss rounds the log times of messages
            let log_time = |time: Bound| (1e9 * rate * time.number()).round() as u64;
            (window.from.map_or(0, log_time), window.to.map_or(u64::MAX, log_time))
        }
        None => window.log_times(0),
    }
}

/// The recording by log time; one without a sound index is made whole in a temporary file first, and what is lost of it reported.
fn open(path: &Path, limits: Limits) -> Result<(Timeline, Exit), Failure> {
    if let Some(timeline) = Timeline::open(Box::new(open_file(path)?), path, limits)? {
        return Ok((timeline, Exit::Done));
    }
    say("it has no sound index: reading all of it first");
    let failed = |error| Failure::Failed(format!("cannot create a temporary file: {error}"));
    let temporary = tempfile::tempfile().map_err(failed)?;
    let copy = temporary.try_clone().map_err(failed)?;
    let lost: Vec<Damage> = recover(path, copy, limits)?.lost.into_iter().map(Damage::refusal).collect();
    let exit = loss(path, &lost);
    Ok((Timeline::open(Box::new(temporary), path, limits)?.ok_or_else(nothing)?, exit))
}

struct Player<'a> {
    server: Server,
    path: &'a Path,
    timeline: Timeline,
    /// Damages of it that have been reported.
    said: usize,
    exit: Exit,
    /// Numbers of channels at the server by their ids.
    numbers: HashMap<u16, usize>,
    span: (u64, u64),
    speed: f64,
    state: Playing,
    /// It begins when viewers have subscribed to all they want.
    is_waiting: bool,
    head: Option<Event>,
    /// A moment and the log time at it, if it plays.
    clock: (Instant, u64),
}

impl Player<'_> {
    fn run(&mut self, once: bool, repeat: bool) -> Result<(), Failure> {
        loop {
            self.report_damages();
            // requests do not keep it from playing, however many there are
            if let Some(asked) = self.server.request(self.wait()) {
                self.obey(asked)?;
            }
            if self.is_waiting {
                if self.server.is_ready(1) {
                    self.start()?;
                }
            } else if self.state == Playing::Playing {
                self.play()?;
                if self.head.is_none() {
                    if once {
                        self.report_damages();
                        return Ok(());
                    }
                    self.end(repeat)?;
                }
            } else if self.state == Playing::Ended && self.server.viewers() == 0 {
                // the next viewer sees it from the beginning
                self.server.reset();
                (self.state, self.is_waiting) = (Playing::Playing, true);
                self.clock = (Instant::now(), self.span.0);
            }
        }
    }

    /// Reports what has been found to be lost since the last time.
    fn report_damages(&mut self) {
        let damages = self.timeline.damages();
        if loss(self.path, &damages[self.said..]) == Exit::Loss {
            self.exit = Exit::Loss;
        }
        self.said = damages.len();
    }

    /// Time until there is something to do, unless a viewer asks for something.
    fn wait(&self) -> Duration {
        match &self.head {
            Some(head) if self.state == Playing::Playing && !self.is_waiting => {
                self.until(head.log_time).min(NAP)
            }
            _ => NAP,
        }
    }

    fn start(&mut self) -> Result<(), Failure> {
        self.is_waiting = false;
        self.server.reset();
        self.go_to(self.span.0)?;
        self.server.send_playback(self.playback(), true, None);
        Ok(())
    }

    fn end(&mut self, repeat: bool) -> Result<(), Failure> {
        if repeat {
            return self.start();
        }
        self.state = Playing::Ended;
        self.clock = (Instant::now(), self.span.1);
        self.server.send_playback(self.playback(), false, None);
        Ok(())
    }

    fn go_to(&mut self, time: u64) -> Result<(), Failure> {
        self.timeline.go_to(time);
        self.head = self.next()?;
        self.clock = (Instant::now(), time);
        Ok(())
    }

    fn next(&mut self) -> Result<Option<Event>, Failure> {
        let next = self.timeline.next_event()?;
        Ok(next.filter(|event| event.log_time <= self.span.1))
    }

    fn obey(&mut self, asked: percuss_serve::Request) -> Result<(), Failure> {
        self.clock = (Instant::now(), self.time());
        self.speed = asked.speed.unwrap_or(self.speed);
        self.state = if asked.play { Playing::Playing } else { Playing::Paused };
        let Some(time) = asked.seek else {
            self.server.send_playback(self.playback(), false, Some(asked.answer));
            return Ok(());
        };
        let time = time.clamp(self.span.0, self.span.1);
        self.is_waiting = false;
        self.server.reset();
        self.go_to(time)?;
        self.server.send_playback(self.playback(), true, Some(asked.answer));
        // what a picture of that time is made of
        for event in self.timeline.latest_before(time.saturating_add(1))? {
            self.send(&event);
        }
        self.server.send_time(time);
        Ok(())
    }

    fn play(&mut self) -> Result<(), Failure> {
        let now = self.time();
        while let Some(event) = self.head.take_if(|event| event.log_time <= now) {
            self.send(&event);
            self.head = self.next()?;
        }
        self.server.send_time(now.min(self.span.1));
        Ok(())
    }

    fn send(&self, event: &Event) {
        if let Some(number) = self.numbers.get(&event.channel) {
            self.server.send(*number, event.log_time, &event.data);
        }
    }

    fn time(&self) -> u64 {
        let (moment, time) = self.clock;
        match self.state {
            Playing::Playing if !self.is_waiting => {
                time.saturating_add((moment.elapsed().as_secs_f64() * self.speed * 1e9) as u64)
            }
            _ => time,
        }
    }

    fn until(&self, log_time: u64) -> Duration {
        let rest = seconds(log_time.saturating_sub(self.time())) / self.speed;
        Duration::try_from_secs_f64(rest).unwrap_or(Duration::MAX)
    }

    fn playback(&self) -> Playback {
        Playback { state: self.state, time: self.time().min(self.span.1), speed: self.speed }
    }
}
