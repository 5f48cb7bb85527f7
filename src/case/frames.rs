//! Frames: steps that show fields and energy.

/// Frames as a case gives them.
#[derive(Clone, Debug, PartialEq)]
pub enum Frames {
    /// So many, spread evenly over the run, first and last step included.
    Spread(usize),
    /// At the steps nearest to these times \[R/c_p\].
    At(Vec<f64>),
}

impl Frames {
    /// True if there are none.
    pub fn is_none(&self) -> bool {
        match self {
            Self::Spread(frames) => *frames == 0,
            Self::At(times) => times.is_empty(),
        }
    }

    /// The steps of a run.
    ///
    /// * `steps`: number of the last step
    /// * `dt`: time step \[R/c_p\]
    pub fn of(&self, steps: u64, dt: f64) -> FrameSteps {
        match self {
            Self::Spread(frames) => FrameSteps::Spread { frames: *frames as u64, steps },
            Self::At(times) => {
                let mut list: Vec<u64> =
                    times.iter().map(|time| ((time / dt).round() as u64).min(steps)).collect();
                list.sort_unstable();
                list.dedup();
                FrameSteps::List(list)
            }
        }
    }
}

/// The steps that are frames.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameSteps {
    /// Frame m falls on step `round(m·steps/(frames − 1))`, a single one on the last step.
    Spread {
        /// Number of frames given.
        frames: u64,
        /// Number of the last step.
        steps: u64,
    },
    /// These, in rising order.
    List(Vec<u64>),
}

impl FrameSteps {
    /// Number of frames.
    pub fn count(&self) -> u64 {
        match self {
            Self::Spread { frames, steps } => (*frames).min(steps + 1),
            Self::List(list) => list.len() as u64,
        }
    }

    /// True if step `step` is a frame.
    pub fn contain(&self, step: u64) -> bool {
        match self {
            Self::Spread { frames: 0, .. } => false,
            Self::Spread { frames: 1, steps } => step == *steps,
            Self::Spread { frames, steps } => {
                // is any m mapped to this step?
                let gaps = frames - 1;
                let at =
                    |m: u64| ((2 * m as u128 * *steps as u128 + gaps as u128) / (2 * gaps as u128)) as u64;
                let m = (step as u128 * gaps as u128 / (*steps as u128).max(1)) as u64;
                (m.saturating_sub(1)..=m + 1).any(|m| m <= gaps && at(m) == step)
            }
            Self::List(list) => list.binary_search(&step).is_ok(),
        }
    }

    /// The steps, without rounding where they are spread.
    pub(super) fn estimated_steps(&self) -> Vec<f64> {
        match self {
            Self::Spread { steps, .. } => {
                let gaps = self.count().saturating_sub(1).max(1) as f64;
                (0..self.count()).map(|m| *steps as f64 * m as f64 / gaps).collect()
            }
            Self::List(list) => list.iter().map(|&step| step as f64).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_as_many_as_given() {
        for (steps, frames) in [(300, 200), (1000, 200), (199, 200), (7, 3), (10, 1), (5, 2), (1_000_003, 17)]
        {
            let chosen = Frames::Spread(frames).of(steps, 0.1);
            let hits: Vec<u64> = (0..=steps).filter(|&k| chosen.contain(k)).collect();
            assert_eq!(hits.len(), frames, "{steps} steps");
            assert_eq!(hits.last(), Some(&steps));
            assert!(frames == 1 || hits[0] == 0);
        }
        let many = Frames::Spread(200).of(50, 0.1);
        assert_eq!((0..=50).filter(|&k| many.contain(k)).count(), 51);
        assert!(!Frames::Spread(0).of(10, 0.1).contain(0));
    }

    #[test]
    fn frames_are_at_the_steps_nearest_to_given_times() {
        let chosen = Frames::At(vec![2.0, 0.05, 1.02, 2.001]).of(20, 0.1);
        let hits: Vec<u64> = (0..=20).filter(|&k| chosen.contain(k)).collect();
        // 0.05 is halfway: the later one
        assert_eq!(hits, [1, 10, 20]);
        assert_eq!(chosen.count(), 3);
    }
}
