//! Progress of a run: a bar on a terminal, a line every few seconds elsewhere, nothing with `--quiet`.

use std::{
    io::{self, IsTerminal},
    sync::Arc,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use percuss_output::text::say;

use crate::{case::Case, units::Unit};

/// Shows the progress of a run.
pub(super) enum Progress {
    Bar(ProgressBar, Clock),
    Lines(Lines),
    Quiet,
}

/// Time between lines where stderr is no terminal, by default \[s\].
pub(super) const LINE_INTERVAL: f64 = 5.0;

pub(super) struct Lines {
    clock: Clock,
    interval: Duration,
    start: Instant,
    last: Instant,
}

/// Steps as times of the target.
#[derive(Clone, Copy)]
pub(super) struct Clock {
    /// Number of the last step.
    steps: u64,
    /// Time step \[R/c_p\].
    dt: f64,
    unit: Unit,
}

impl Clock {
    /// Time of a step and the end.
    fn text(&self, step: u64) -> String {
        let [time, end] = [step, self.steps].map(|step| self.unit.text(step as f64 * self.dt));
        format!("t = {time} of {end}")
    }
}

impl Progress {
    /// * `steps`: number of the last step
    /// * `interval`: time between lines \[s\]
    pub(super) fn new(case: &Case, steps: u64, quiet: bool, interval: f64) -> Self {
        let clock = Clock { steps, dt: case.sizes.dt, unit: case.units().time };
        if quiet {
            return Self::Quiet;
        }
        if !io::stderr().is_terminal() {
            let now = Instant::now();
            let interval = Duration::from_secs_f64(interval);
            return Self::Lines(Lines { clock, interval, start: now, last: now });
        }
        let template = "{wide_bar} {msg}, {rate}, ETA {eta}";
        let rate = |state: &ProgressState, output: &mut dyn std::fmt::Write| {
            write!(output, "{:.0} steps/s", state.per_sec()).expect("a bar is drawn into a String");
        };
        let style = ProgressStyle::with_template(template).expect("the template is a constant");
        let style = style.with_key("rate", rate);
        let bar = ProgressBar::new(steps + 1).with_style(style);
        bar.set_message(clock.text(0));
        Self::Bar(bar, clock)
    }

    /// A step is done.
    pub(super) fn advance(&mut self, step: u64) {
        match self {
            Self::Bar(bar, clock) => {
                bar.set_position(step + 1);
                // formatting every message takes longer than some steps
                if step.is_multiple_of(64) {
                    bar.set_message(clock.text(step));
                }
            }
            Self::Lines(lines) => {
                // the clock is not read at every step
                if step.is_multiple_of(16) && lines.last.elapsed() >= lines.interval {
                    lines.last = Instant::now();
                    lines.print(step);
                }
            }
            Self::Quiet => {}
        }
    }

    /// Prints a line above the bar.
    pub(super) fn say(&self, text: &str) {
        match self {
            Self::Bar(bar, _) => bar.suspend(|| say(text)),
            Self::Lines(_) => say(text),
            Self::Quiet => {}
        }
    }

    /// Prints lines above the bar from any thread.
    pub(super) fn speaker(&self) -> Arc<dyn Fn(&str) + Send + Sync> {
        match self {
            Self::Bar(bar, _) => {
                let bar = bar.clone();
                Arc::new(move |text| bar.suspend(|| say(text)))
            }
            Self::Lines(_) => Arc::new(say),
            Self::Quiet => Arc::new(|_| {}),
        }
    }

    /// Removes the bar.
    pub(super) fn end(&self) {
        if let Self::Bar(bar, _) = self {
            bar.finish_and_clear();
        }
    }
}

impl Lines {
    fn print(&self, step: u64) {
        let elapsed = self.start.elapsed().as_secs_f64();
        let rate = (step + 1) as f64 / elapsed;
        let (time, steps) = (self.clock.text(step), self.clock.steps);
        let eta = (steps - step) as f64 / rate;
        say(&format!("{time}, step {step} of {steps}, {rate:.0} steps/s, ETA {eta:.0} s"));
    }
}
