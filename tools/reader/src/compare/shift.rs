//! Whether one recording runs ahead of the other.

use std::collections::VecDeque;

/// Samples before and after that are tried for a shift in time.
pub const MAX_SHIFT: usize = 16;

/// Share of the difference that a shift in time may leave and still be worth telling.
const CREDIBLE: f64 = 0.5;

/// Whether one recording runs ahead of the other: the sum of squared differences for every shift by up to
/// [`MAX_SHIFT`] samples, over the samples from the first difference on. Arrays take part with their mean.
#[derive(Clone, Debug, Default)]
pub(super) struct Shift {
    recent: VecDeque<(f64, f64)>,
    costs: Option<Box<[f64; 2 * MAX_SHIFT + 1]>>,
    /// Samples until the first that differs is in the middle of the recent ones.
    ahead: usize,
}

impl Shift {
    pub(super) fn add(&mut self, sum_a: f64, sum_b: f64, length: usize) {
        let scale = 1.0 / length.max(1) as f64;
        if self.recent.len() == 2 * MAX_SHIFT + 1 {
            self.recent.pop_front();
        }
        self.recent.push_back((sum_a * scale, sum_b * scale));
        if self.costs.is_none() && sum_a != sum_b {
            self.costs = Some(Box::new([0.0; 2 * MAX_SHIFT + 1]));
            self.ahead = MAX_SHIFT;
        } else if self.ahead > 0 {
            self.ahead -= 1;
        }
        if self.ahead > 0 {
            return;
        }
        if let Some(costs) = self.costs.as_mut().filter(|_| self.recent.len() == 2 * MAX_SHIFT + 1) {
            let centre = self.recent[MAX_SHIFT].0;
            for (cost, (_, b)) in costs.iter_mut().zip(&self.recent) {
                *cost += (centre - b) * (centre - b);
            }
        }
    }

    /// Samples by which the new recording is later than the reference, and by how much that shift lowers the root mean
    /// square difference; `None` if no shift within the range explains most of it.
    pub(super) fn best(&self) -> Option<(i64, f64)> {
        let costs = self.costs.as_ref()?;
        let still = costs[MAX_SHIFT];
        let (best, &cost) = costs.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
        let samples = best as i64 - MAX_SHIFT as i64;
        let left = (cost / still).sqrt();
        // at the end of the range the best shift is not inside it; and a shift that explains little is none
        (left < CREDIBLE && samples.unsigned_abs() < MAX_SHIFT as u64).then_some((samples, left))
    }
}
