//! Progress of a run: a bar on a terminal, a line every few seconds elsewhere, nothing with `--quiet`.

use std::{
    io::{self, IsTerminal, Write},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressState, ProgressStyle};

/// Shows the progress of a run.
pub(super) enum Progress {
    Bar(ProgressBar),
    Lines(Lines),
    Quiet,
}

/// Time between lines where stderr is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

pub(super) struct Lines {
    steps: u64,
    dt: f64,
    start: Instant,
    last: Instant,
}

impl Progress {
    /// * `steps`: number of the last step
    /// * `dt`: time step \[R/c_p\]
    pub(super) fn new(steps: u64, dt: f64, quiet: bool) -> Self {
        if quiet {
            return Self::Quiet;
        }
        if !io::stderr().is_terminal() {
            let now = Instant::now();
            return Self::Lines(Lines { steps, dt, start: now, last: now });
        }
        let template = "{wide_bar} {msg}, {rate}, ETA {eta}";
        let rate = |state: &ProgressState, output: &mut dyn std::fmt::Write| {
            write!(output, "{:.0} steps/s", state.per_sec()).expect("a bar is drawn into a String");
        };
        let style = ProgressStyle::with_template(template).expect("the template is a constant");
        let style = style.with_key("rate", rate);
        let bar = ProgressBar::new(steps + 1).with_style(style);
        bar.set_message(format!("t = 0 of {:.4}", steps as f64 * dt));
        Self::Bar(bar)
    }

    /// Step `step` at `time` \[R/c_p\] is done.
    pub(super) fn advance(&mut self, step: u64, time: f64) {
        match self {
            Self::Bar(bar) => {
                bar.set_position(step + 1);
                // formatting every message takes longer than some steps
                if step.is_multiple_of(64) {
                    let end = bar.length().map_or(time, |n| (n - 1) as f64 * time / (step.max(1)) as f64);
                    bar.set_message(format!("t = {time:.3} of {end:.3}"));
                }
            }
            Self::Lines(lines) => {
                // the clock is not read at every step
                if step.is_multiple_of(16) && lines.last.elapsed() >= LINE_INTERVAL {
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
            Self::Bar(bar) => bar.suspend(|| say(text)),
            Self::Lines(_) => say(text),
            Self::Quiet => {}
        }
    }

    /// Removes the bar.
    pub(super) fn end(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

impl Lines {
    fn print(&self, step: u64) {
        let elapsed = self.start.elapsed().as_secs_f64();
        let rate = (step + 1) as f64 / elapsed;
        let (time, end) = (step as f64 * self.dt, self.steps as f64 * self.dt);
        let eta = (self.steps - step) as f64 / rate;
        say(&format!(
            "t = {time:.3} of {end:.3}, step {step} of {}, {rate:.0} steps/s, ETA {eta:.0} s",
            self.steps
        ));
    }
}

fn say(text: &str) {
    // a closed stderr must not end a run
    drop(writeln!(io::stderr(), "{text}"));
}
