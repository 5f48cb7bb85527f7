//! Progress: a bar on a terminal, a line every few seconds elsewhere, nothing with `--quiet`.

use std::{
    fmt::Write,
    io::{self, IsTerminal},
    sync::Arc,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use percuss_output::text::say;

use crate::{case::Case, units::Unit};

/// Time between lines where stderr is no terminal, by default \[s\].
pub(super) const LINE_INTERVAL: f64 = 5.0;
/// Time between changes of a bar.
const REFRESH: Duration = Duration::from_millis(100);

/// Shows how far `of` is.
pub(super) struct Progress<T> {
    pub(super) of: T,
    pub(super) start: Instant,
    bar: Option<ProgressBar>,
    is_quiet: bool,
    interval: Duration,
    last: Instant,
}

impl<T> Progress<T> {
    /// * `template`: of the bar
    /// * `interval`: time between lines \[s\]
    pub(super) fn new(of: T, length: u64, template: &str, is_quiet: bool, interval: f64) -> Self {
        let bar = (!is_quiet && io::stderr().is_terminal()).then(|| {
            let rate = |state: &ProgressState, output: &mut dyn Write| {
                write!(output, "{:.0} steps/s", state.per_sec()).expect("a bar is drawn into a String");
            };
            let style = ProgressStyle::with_template(template).expect("the template is a constant");
            ProgressBar::new(length).with_style(style.with_key("rate", rate))
        });
        let now = Instant::now();
        Self { of, start: now, bar, is_quiet, interval: Duration::from_secs_f64(interval), last: now }
    }

    /// True if it is time to show more.
    pub(super) fn is_due(&mut self) -> bool {
        let interval = if self.bar.is_some() { REFRESH.min(self.interval) } else { self.interval };
        let is_due = !self.is_quiet && self.last.elapsed() >= interval;
        if is_due {
            self.last = Instant::now();
        }
        is_due
    }

    /// Moves the bar, or prints a line.
    pub(super) fn show(&self, position: u64, message: String, line: &str) {
        match &self.bar {
            Some(bar) => {
                bar.set_position(position);
                bar.set_message(message);
            }
            None => self.say(line),
        }
    }

    /// Prints a line above the bar.
    pub(super) fn say(&self, text: &str) {
        self.speaker()(text);
    }

    /// Prints lines above the bar from any thread.
    pub(super) fn speaker(&self) -> Arc<dyn Fn(&str) + Send + Sync> {
        match self.bar.clone() {
            Some(bar) => Arc::new(move |text| bar.suspend(|| say(text))),
            None if self.is_quiet => Arc::new(|_| {}),
            None => Arc::new(say),
        }
    }

    pub(super) fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// Steps as times of the target.
pub(super) struct Clock {
    /// Number of the last step.
    steps: u64,
    /// Time step \[R/c_p\].
    dt: f64,
    unit: Unit,
}

impl Clock {
    fn text(&self, step: u64) -> String {
        let [time, end] = [step, self.steps].map(|step| self.unit.text(step as f64 * self.dt));
        format!("t = {time} of {end}")
    }
}

impl Progress<Clock> {
    /// Progress of a run.
    ///
    /// * `steps`: number of the last step
    /// * `interval`: time between lines \[s\]
    pub(super) fn of_run(case: &Case, steps: u64, is_quiet: bool, interval: f64) -> Self {
        let clock = Clock { steps, dt: case.sizes.dt, unit: case.units().time };
        let start = clock.text(0);
        let progress = Self::new(clock, steps + 1, "{wide_bar} {msg}, {rate}, ETA {eta}", is_quiet, interval);
        if let Some(bar) = &progress.bar {
            bar.set_message(start);
        }
        progress
    }

    pub(super) fn advance(&mut self, step: u64) {
        // without a bar the clock is not read at every step
        if (self.bar.is_none() && !step.is_multiple_of(16)) || !self.is_due() {
            return;
        }
        let (time, steps) = (self.of.text(step), self.of.steps);
        let rate = (step + 1) as f64 / self.start.elapsed().as_secs_f64();
        let eta = (steps - step) as f64 / rate;
        let line = format!("{time}, step {step} of {steps}, {rate:.0} steps/s, ETA {eta:.0} s");
        self.show(step + 1, time, &line);
    }
}
