//! Depth of the indenter at level k+1: the displacement it imposes on each node, and Newton's method for `w^{k+1}`.

use super::{Contact, Rule, partial::half_hat};
use crate::{indenter::Indenter, shape::Average, surface::Surface};

/// Bound on the iterations for the active set. Each one shrinks the set, and in practice a few are enough.
const MAX_ITERATIONS: usize = 10_000;

/// The same with nodes in partial contact.
const MAX_PARTIAL_ITERATIONS: usize = 50;

/// Relative change of the depth that may be rounding.
const ROUNDING: f64 = 1e-15;

/// Drag on an indenter as a function of its depth, `F(w) = stiffness·w − offset`, linear while the active set lasts.
#[derive(Clone, Copy, Default)]
struct LinearDrag {
    stiffness: f64,
    offset: f64,
    /// Number of nodes in contact.
    active: usize,
    /// True if some of them are in partial contact: then this is the tangent.
    is_partial: bool,
}

impl Contact {
    /// Displacement w^{k+1} of the indenter under the drag of this step.
    ///
    /// `w + (Δt²/M)·F(w) = w_free` with F increasing and convex: Newton's method from `w_free`, where the contact is
    /// largest, decreases monotonically and ends when the active set repeats, F being linear between such sets. With
    /// partial contact F is not piecewise linear and the method ends when the depth no longer changes; the balance of
    /// momentum, which moves the indenter by the drag at this depth, accounts for the remainder.
    pub(super) fn solve_depth(&self, surface: &Surface, indenter: &Indenter) -> f64 {
        let free_depth = indenter.free_depth();
        if indenter.is_driven() {
            return free_depth;
        }
        let compliance = indenter.compliance();
        let mut depth = free_depth;
        let mut last_active = usize::MAX;
        for iteration in 0..MAX_ITERATIONS {
            let drag = self.linear_drag(depth, surface);
            let before = depth;
            depth = (free_depth + compliance * drag.offset) / (1.0 + compliance * drag.stiffness);
            let is_settled = if drag.is_partial {
                (before - depth).abs() <= ROUNDING * depth.abs() || iteration >= MAX_PARTIAL_ITERATIONS
            } else {
                drag.active == last_active
            };
            if is_settled || self.rule == Rule::Bilateral {
                return depth;
            }
            last_active = drag.active;
        }
        unreachable!("the active set shrinks in every iteration");
    }

    /// Drag on an indenter near `depth`.
    fn linear_drag(&self, depth: f64, surface: &Surface) -> LinearDrag {
        let mut drag = LinearDrag::default();
        for i in 0..self.profile.len() {
            let weight = self.area[i] / surface.compliance[i];
            let (imposed, is_full) = self.imposed(i, |_| depth, &surface.free);
            if is_full {
                let level = self.profile[i] + surface.free[i];
                if self.rule == Rule::Bilateral || depth > level {
                    drag.stiffness += weight;
                    drag.offset += weight * level;
                    drag.active += 1;
                }
            } else if imposed.penetration > surface.free[i] {
                let Average { penetration, fraction } = imposed;
                drag.stiffness += weight * fraction;
                drag.offset += weight * (fraction * depth - (penetration - surface.free[i]));
                drag.active += 1;
                drag.is_partial = true;
            }
        }
        drag
    }

    /// Pressure at node `i` if the indenter moves to `next_depth`.
    pub(super) fn pressure_at(&self, i: usize, next_depth: f64, surface: &Surface) -> f64 {
        let (imposed, _) = self.imposed(i, |_| next_depth, &surface.free);
        let pressure = (imposed.penetration - surface.free[i]) / surface.compliance[i];
        // NaN stays NaN, to be reported
        if self.rule == Rule::Unilateral && pressure <= 0.0 { 0.0 } else { pressure }
    }

    /// Displacement that an indenter imposes on node `i`, its derivative, and whether the node is in full
    /// contact: then it is `w − f`.
    ///
    /// * `depth`: of the indenter over each node; everywhere the same if it is rigid
    #[inline]
    pub(super) fn imposed(&self, i: usize, depth: impl Fn(usize) -> f64, free: &[f64]) -> (Average, bool) {
        let full = Average { penetration: depth(i) - self.profile[i], fraction: 1.0 };
        if self.gap_before[i] <= 0.0 || self.partial[i].is_pointwise() {
            (full, true)
        } else {
            self.imposed_partial(i, full, depth, free)
        }
    }

    /// [`Contact::imposed`] of a node that can be in partial contact.
    ///
    /// The gap of a loaded node never grows, or the contact would return energy: contact is lost node by node.
    fn imposed_partial(
        &self,
        i: usize,
        full: Average,
        depth: impl Fn(usize) -> f64,
        free: &[f64],
    ) -> (Average, bool) {
        let node = &self.partial[i];
        let average = if free[i] >= 0.0 && !node.is_full(depth(i)) {
            // the average is that of a surface at rest, which one that has risen is not
            node.average(depth(i), &self.shape, self.geometry)
        } else {
            let penetration = |i: usize| self.profile.get(i).map(|f| depth(i) - f - free[i]);
            let here = full.penetration - free[i];
            // the surface is even about the axis, and constant beyond the last node
            let inner = if i == 0 { here } else { penetration(i - 1).unwrap_or(here) };
            let outer = penetration(i + 1).unwrap_or(here);
            if (here >= 0.0) == (inner >= 0.0) && (here >= 0.0) == (outer >= 0.0) {
                return (full, true);
            }
            let (inner, outer) = (half_hat(here, inner), half_hat(here, outer));
            Average {
                penetration: free[i] + inner.penetration + outer.penetration,
                fraction: inner.fraction + outer.fraction,
            }
        };
        if average.penetration < full.penetration {
            return (full, true);
        }
        let most = full.penetration + self.gap_before[i];
        if average.penetration <= most {
            (average, false)
        } else {
            (Average { penetration: most, ..full }, false)
        }
    }
}
