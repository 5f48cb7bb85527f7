//! How messages are aligned, and how that is chosen.

use std::collections::{HashMap, HashSet};

use super::measure::Location;
use crate::instant::Instant;

/// How messages are aligned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Messages of the same step
    Step,
    /// Messages of exactly the same time
    Time,
    /// The new message nearest in time
    Nearest,
    /// The new recording interpolated linearly at the times of the reference
    Linear,
    /// The new recording interpolated by cubics at the times of the reference
    Cubic,
}

impl Mode {
    /// True if messages of other times are compared, not only those that belong together one by one.
    pub fn is_between(self) -> bool {
        matches!(self, Self::Nearest | Self::Linear | Self::Cubic)
    }
}

/// First messages of each recording that the choice of a mode depends on.
pub(super) const LOOKED_AT: usize = 16;

/// When a message is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pub(super) step: Option<u64>,
    pub(super) time: Instant,
}

impl Moment {
    /// The place of a sample at this time.
    pub(super) fn place(self, sample: u64) -> Location {
        Location { sample, step: self.step, time: self.time, element: 0, position: None }
    }
}

/// True if a step is in both.
pub(super) fn have_common_step([a, b]: [&[Moment]; 2]) -> bool {
    let steps: HashSet<u64> = b.iter().filter_map(|b| b.step).collect();
    a.iter().any(|a| a.step.is_some_and(|step| steps.contains(&step)))
}

/// The mode that fits the first messages of both recordings.
///
/// * `is_decoded`: false for messages that are compared as bytes, with nothing in between
pub(super) fn choose([a, b]: [&[Moment]; 2], is_decoded: bool) -> Mode {
    if a.is_empty() || b.is_empty() {
        let have_steps = a.iter().chain(b).all(|moment| moment.step.is_some());
        return if have_steps { Mode::Step } else { Mode::Time };
    }
    // equal steps mean the same only if they are at the same time: within a thousandth of a step
    let spacing = |moments: &[Moment]| match moments {
        [first, .., last] => last.time.since(first.time).abs() / (moments.len() - 1) as f64,
        // of one message nothing but its step is known
        _ => f64::INFINITY,
    };
    let near = 1e-3 * spacing(a).min(spacing(b));
    let times: HashMap<u64, Instant> = b.iter().filter_map(|b| Some((b.step?, b.time))).collect();
    let common = a.iter().filter_map(|a| Some((a.time, *times.get(&a.step?)?)));
    let agrees = |(x, y): (Instant, Instant)| x == y || x.since(y).abs() <= near;
    let (agreeing, others): (Vec<bool>, Vec<bool>) = common.map(agrees).partition(|agrees| *agrees);
    if !agreeing.is_empty() && agreeing.len() >= others.len() {
        return Mode::Step;
    }
    let times: HashSet<i128> = b.iter().map(|b| b.time.key()).collect();
    let equal = a.iter().filter(|a| times.contains(&a.time.key())).count();
    if 2 * equal > a.len() && 2 * equal > b.len() {
        return Mode::Time;
    }
    // a handful of messages is no series to interpolate in
    if a.len().min(b.len()) < 4 || !is_decoded { Mode::Time } else { Mode::Linear }
}
