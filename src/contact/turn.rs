//! Turn of a contact that spreads: the time at which its radius is largest.
//!
//! Under a rounded head the target leaves the indenter from the edge inwards, once the contact has spread as far as it does. The
//! first node that leaves is a number of the mesh: the edge rests between two nodes the longer, the larger cells are, and chatters.
//! The radius of the contact, which is found between nodes, turns with the physics. Its top is flat, and a few thousandths of it
//! are noise of the mesh; so the time is the centre of mass of what stands out over 99.5 % of the largest radius,
//!
//! ```text
//! t = Σ (r_k − r_0)₊ t_k / Σ (r_k − r_0)₊,   r_0 = 0.995·max r_k
//! ```
//!
//! The turn is known when the radius has fallen by a twentieth, and by half a cell: less is noise, or a reflection that stops the
//! contact for a moment. A contact as wide as the punch turns when it leaves the edge of the punch for good.

use std::collections::VecDeque;

use serde::{Deserialize, Serialize};

/// Share of the largest radius above which steps count.
const TOP: f64 = 0.995;

/// Fall of the radius that makes a turn: as a share of the largest radius, and in cells.
const FALL: (f64, f64) = (0.05, 0.5);

/// Number of steps that are kept; of more, every second, fourth … counts.
const KEPT: usize = 1024;

/// Finds the turn of a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Distance of nodes \[R\].
    pub cell: f64,
    /// Radius of the punch \[R\], infinite if unbounded.
    pub edge: f64,
}

/// The largest radius so far, and the steps near it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Top {
    largest: f64,
    /// Times and radii above [`TOP`] of the largest \[R/c_p, R\].
    steps: VecDeque<(f64, f64)>,
    /// Of so many steps one is kept, and so many have passed since; binary logarithm of the first.
    thinning: u32,
    passed: u64,
}

impl Turn {
    /// Takes a step; time and radius of the turn once the radius has fallen enough.
    pub(super) fn observe(self, top: &mut Top, time: f64, radius: f64) -> Option<(f64, f64)> {
        let (share, cells) = FALL;
        if radius >= self.edge {
            *top = Top::default();
        }
        top.largest = top.largest.max(radius);
        let level = TOP * top.largest;
        while top.steps.front().is_some_and(|&(_, radius)| radius <= level) {
            top.steps.pop_front();
        }
        if radius > level {
            top.passed += 1;
            if radius == top.largest || top.passed >> top.thinning > 0 {
                top.passed = 0;
                top.steps.push_back((time, radius));
            }
            if top.steps.len() > KEPT {
                let mut number = 0;
                top.steps.retain(|_| {
                    number += 1;
                    number % 2 == 1
                });
                top.thinning += 1;
            }
        }
        if top.largest - radius <= (share * top.largest).max(cells * self.cell) {
            return None;
        }
        let above = top.steps.iter().map(|&(time, radius)| (time, (radius - level).max(0.0)));
        let (moment, weight) = above.fold((0.0, 0.0), |(m, w), (time, above)| (m + above * time, w + above));
        Some((moment / weight, top.largest))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Turn of a contact, and the time at which it is known; the step is 1/4096.
    fn turn(edge: f64, radius: impl Fn(f64) -> f64) -> Option<(f64, f64, f64)> {
        let (turn, mut top) = (Turn { cell: 0.01, edge }, Top::default());
        (0..40_000).map(|step| f64::from(step) / 4096.0).find_map(|time| {
            let (at, largest) = turn.observe(&mut top, time, radius(time).min(edge))?;
            Some((at, largest, time))
        })
    }

    #[test]
    fn a_turn_is_found_through_noise_and_thinning() {
        let smooth = |t: f64| (1.0 - (t / 3.0 - 1.0).powi(2)).max(0.0);
        let noisy = |t: f64| smooth(t) + 0.001 * (97.0 * t).sin();
        for radius in [&smooth as &dyn Fn(f64) -> f64, &noisy] {
            let (at, largest, known) = turn(f64::INFINITY, radius).expect("it turns");
            assert!((at - 3.0).abs() < 0.03 && (largest - 1.0).abs() < 0.0011, "{at} {largest}");
            assert!((known - 3.0 - 3.0 * 0.05_f64.sqrt()).abs() < 0.02, "{known}");
        }
    }

    #[test]
    fn a_short_stop_is_no_turn() {
        let stops = |t: f64| {
            (1.0 - (t / 3.0 - 1.0).powi(2)).max(0.0) - if t < 2.0 { 0.004 * (9.0 * t).sin() } else { 0.0 }
        };
        let (at, ..) = turn(f64::INFINITY, stops).expect("it turns");
        assert!((at - 3.0).abs() < 0.01, "{at}");
        assert_eq!(turn(f64::INFINITY, |t| t.min(3.0)), None);
    }

    #[test]
    fn a_contact_as_wide_as_the_punch_turns_at_its_edge() {
        // it fills the punch up to t = 4.5
        let (at, largest, _) =
            turn(0.75, |t: f64| (1.0 - (t / 3.0 - 1.0).powi(2)).max(0.0)).expect("it turns");
        assert!((at - 4.5).abs() < 0.01 && largest == 0.75, "{at} {largest}");
    }
}
