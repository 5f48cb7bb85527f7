//! Points and lines of a level, recorded while tiles pass their nodes, as the sampler takes frames.
//!
//! They are recorded at every level, so only the nodes that they need are looked at: sorted by rows, a tile finds its own at once.

use std::{ops::Range, sync::Arc};

use super::{
    domain::{Domain, SurfaceMotion, Theory},
    parts::Parts,
};
use crate::model::{
    gauge::{GaugePlan, GaugeValues, PointState},
    scheme,
};

/// A recorder of points and lines at level k, on its way to level k+1.
pub struct Gauge {
    /// Level k+1, which is about to be reached.
    level: usize,
    plan: Arc<GaugePlan>,
    /// Nodes of points. Between [`Gauge::before`] and [`Gauge::after`] the velocity of a node is u^{k−1}.
    points: Parts<PointState>,
    /// Stress at nodes of lines, if the level shows them.
    lines: Option<Parts<f64>>,
}

#[expect(unsafe_code, reason = "a field and a recorder that threads share")]
impl Gauge {
    /// A recorder about to begin.
    ///
    /// * `level`: the one that is about to be reached
    /// * `shows_lines`: true if lines are recorded too
    pub fn new(level: usize, plan: &Arc<GaugePlan>, shows_lines: bool) -> Self {
        Self {
            level,
            points: Parts::new(plan.point_nodes.len()),
            lines: shows_lines.then(|| Parts::new(plan.line_nodes.len())),
            plan: Arc::clone(plan),
        }
    }

    /// Level k+1: once all nodes have reached it everything is recorded.
    pub fn level(&self) -> usize {
        self.level
    }

    /// `rows` with the backing, if the last row that moves is among them.
    fn with_backing<S: Theory>(domain: &Domain<S>, rows: &Range<usize>) -> Range<usize> {
        let end = if rows.contains(&domain.last_row()) { domain.grid.nz + 1 } else { rows.end };
        rows.start..end
    }

    /// Records what of `rows` and `columns` is gone once they are advanced.
    ///
    /// # Safety
    ///
    /// The nodes hold levels k−1 and k. No other thread writes to them meanwhile, or records these nodes.
    pub unsafe fn before<S: Theory>(&self, domain: &Domain<S>, rows: &Range<usize>, columns: &Range<usize>) {
        if S::KEEPS_EARLIER {
            return;
        }
        let (nodes, earlier) = (&self.plan.point_nodes, domain.levels.two_below(self.level));
        for (j, numbers) in nodes.within(rows.clone(), columns.clone()) {
            // SAFETY: the caller's promise; numbers of different nodes are different
            let states = unsafe { self.points.part(numbers.clone()) };
            for (state, i) in states.iter_mut().zip(nodes.columns(&numbers)) {
                // SAFETY: the caller's promise
                state.velocity = unsafe { domain.levels.at(earlier, j, 0, *i as isize) };
            }
        }
    }

    /// Records `rows` and `columns` now that they have been advanced.
    ///
    /// * `motion`: of row 0, if it is among the rows
    ///
    /// # Safety
    ///
    /// The nodes hold levels k and k+1, and the rows and columns around them level k. No other thread writes to them meanwhile, or
    /// records these nodes.
    pub unsafe fn after<S: Theory>(
        &self,
        domain: &Domain<S>,
        rows: &Range<usize>,
        columns: &Range<usize>,
        motion: Option<SurfaceMotion<'_>>,
    ) {
        let rows = Self::with_backing(domain, rows);
        let at = |level: usize, j: usize, i: usize| {
            // SAFETY: the caller's promise
            unsafe { domain.levels.at(level, j, 0, i as isize) }
        };
        let earlier = domain.levels.two_below(self.level);
        let nodes = &self.plan.point_nodes;
        for (j, numbers) in nodes.within(rows.clone(), columns.clone()) {
            // SAFETY: the caller's promise; numbers of different nodes are different
            let states = unsafe { self.points.part(numbers.clone()) };
            for (state, &i) in states.iter_mut().zip(nodes.columns(&numbers)) {
                let before = if S::KEEPS_EARLIER { at(earlier, j, i) } else { state.velocity };
                *state = PointState {
                    displacement: at(self.level - 1, j, i),
                    velocity: scheme::velocity(before, at(self.level, j, i), domain.grid.dt()),
                    // SAFETY: the caller's promise
                    stress: unsafe { self.stress(domain, motion, j, i) },
                };
            }
        }
        let (Some(lines), nodes) = (&self.lines, &self.plan.line_nodes) else { return };
        for (j, numbers) in nodes.within(rows, columns.clone()) {
            // SAFETY: as above
            let stresses = unsafe { lines.part(numbers.clone()) };
            for (stress, &i) in stresses.iter_mut().zip(nodes.columns(&numbers)) {
                // SAFETY: the caller's promise
                *stress = unsafe { self.stress(domain, motion, j, i) };
            }
        }
    }

    /// Stress at level k at node (j, i).
    ///
    /// # Safety
    ///
    /// As [`Gauge::after`].
    unsafe fn stress<S: Theory>(
        &self,
        domain: &Domain<S>,
        motion: Option<SurfaceMotion<'_>>,
        j: usize,
        i: usize,
    ) -> f64 {
        let pressure = motion.filter(|_| j == 0).map(|motion| motion.pressure[i]);
        // SAFETY: the caller's promise
        unsafe { S::stress(domain, self.level - 1, [j, i], pressure) }
    }

    /// What has been recorded.
    ///
    /// # Safety
    ///
    /// All nodes have reached level k+1, and their recording has happened before.
    pub unsafe fn finish(&self) -> GaugeValues {
        // SAFETY: the caller's promise
        let (points, lines) = unsafe { (self.points.take(), self.lines.as_ref().map(|lines| lines.take())) };
        self.plan.values(&points, lines.as_deref())
    }
}
