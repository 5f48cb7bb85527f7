//! Frames: steps that show fields and energy.

/// Frames as a case gives them.
#[derive(Clone, Debug, PartialEq)]
pub enum Frames {
    /// So many, spread evenly over the run, first and last step included.
    Spread(usize),
    /// At the steps nearest to these times, and at the last step \[R/c_p\].
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

    /// The steps of a run. Frame m of several that are spread falls on step `round(m·steps/(frames − 1))`, a single one on the
    /// last step.
    ///
    /// * `steps`: number of the last step
    /// * `dt`: time step \[R/c_p\]
    pub fn of(&self, steps: u64, dt: f64) -> FrameSteps {
        let mut list: Vec<u64> = match self {
            Self::Spread(0) => Vec::new(),
            Self::Spread(1) => vec![steps],
            Self::Spread(frames) => {
                let gaps = *frames as u64 - 1;
                (0..=gaps).map(|m| (2 * m * steps + gaps) / (2 * gaps)).collect()
            }
            Self::At(times) if times.is_empty() => Vec::new(),
            Self::At(times) => {
                let nearest = times.iter().map(|time| ((time / dt).round() as u64).min(steps));
                // what a run ends with is always shown
                nearest.chain([steps]).collect()
            }
        };
        list.sort_unstable();
        list.dedup();
        FrameSteps(list)
    }
}

/// The steps that are frames, in rising order. A run that a condition of the case stops earlier has its last frame there.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSteps(pub(super) Vec<u64>);

impl FrameSteps {
    /// Number of frames.
    pub fn count(&self) -> u64 {
        self.0.len() as u64
    }

    /// True if step `step` is a frame.
    pub fn contain(&self, step: u64) -> bool {
        self.0.binary_search(&step).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps that are frames.
    fn hits(frames: &Frames, steps: u64) -> Vec<u64> {
        let chosen = frames.of(steps, 0.1);
        let hits: Vec<u64> = (0..=steps).filter(|&k| chosen.contain(k)).collect();
        assert_eq!(chosen.count(), hits.len() as u64);
        hits
    }

    #[test]
    fn frames_are_as_many_as_given() {
        for (steps, frames) in [(300, 200), (1000, 200), (199, 200), (7, 3), (10, 1), (5, 2), (1_000_003, 17)]
        {
            let hits = hits(&Frames::Spread(frames), steps);
            assert_eq!((hits.len(), hits.last()), (frames, Some(&steps)), "{steps} steps");
            assert!(frames == 1 || hits[0] == 0);
        }
        assert_eq!(hits(&Frames::Spread(200), 50).len(), 51);
        assert_eq!(hits(&Frames::Spread(0), 10), [0; 0]);
    }

    #[test]
    fn frames_are_at_the_steps_nearest_to_given_times() {
        for times in [vec![2.0, 0.05, 1.02, 2.001], vec![0.05, 1.02]] {
            // 0.05 is halfway: the later one; the last step is always among them
            assert_eq!(hits(&Frames::At(times), 20), [1, 10, 20]);
        }
        assert_eq!(hits(&Frames::At(Vec::new()), 20), [0; 0]);
    }
}
