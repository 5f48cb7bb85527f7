//! Contact between a rigid indenter and the surface: the rules, the active set, the drag.
//!
//! In every step the contact takes the free surface a model predicts and finds the pressure that keeps the rule.
//! For a node in contact the surface must follow the indenter, `u^{k+1} = w^{k+1} − f`, and the pressure is what
//! was needed to put it there,
//!
//! ```text
//! p^k = (w^{k+1} − f − u_free^{k+1}) / compliance
//! ```
//!
//! the exact momentum balance of the half cell under the surface. An indenter of finite mass gives way at the same
//! time, `w^{k+1} = w_free^{k+1} − (Δt²/M)·F^k` with `F^k = Σ a_i p_i^k`; both are solved together, not lagged.
//! The contact knows nothing of what lies behind the surface.

use serde::{Deserialize, Serialize};

use crate::{
    grid::{Geometry, Grid},
    indenter::Indenter,
    shape::{Shape, Wetted},
    surface::Surface,
};

pub mod event;
mod meeting;

use meeting::{Meeting, closing};

/// How surface and indenter touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Contact where the free surface would penetrate the indenter, and only while it pushes; \[KA\] Eqs. 5, 7.
    Unilateral,
    /// A fixed zone, glued: the indenter can also pull.
    Bilateral,
    /// The motion of the whole surface is given; \[KA\] Eq. 10.
    Prescribed,
}

/// What one step of contact amounts to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Drag F^k on the indenter \[πR²γc_p²; plane Rγc_p²\].
    pub drag: f64,
    /// Contact radius r* \[R\].
    pub contact_radius: f64,
    /// Velocity V^k of the indenter \[c_p\].
    pub velocity: f64,
    /// Displacement w^k of the indenter \[R\].
    pub depth: f64,
    /// Work done during the step by a prescribed motion \[πR³γc_p²; plane R²γc_p²\].
    pub work: f64,
    /// Energy lost during the step to nodes that struck the indenter \[πR³γc_p²; plane R²γc_p²\].
    pub dissipated: f64,
    /// Node that needs tension: the one under the largest tension (glued), or one that has just opened.
    pub extended: Option<usize>,
    /// Number of nodes in contact.
    pub touching: usize,
}

/// The contact between one shape and the nodes of one surface.
#[derive(Clone, Debug)]
pub struct Contact {
    rule: Rule,
    shape: Shape,
    geometry: Geometry,
    area: Vec<f64>,
    cells: Vec<(f64, f64)>,
    /// Profile at the nodes, shape `(zone,)`: nodes beyond it can never touch.
    profile: Vec<f64>,
    /// Gaps `u + f − w` at levels k−1, k.
    gap_before: Vec<f64>,
    gap: Vec<f64>,
    touching: Vec<bool>,
    meetings: Vec<Meeting>,
    /// True for nodes that are wholly in contact or not at all, shape `(zone,)`.
    is_plain: Vec<bool>,
    /// Displacements a prescribed motion gives at levels k−1 and k \[R\].
    given: Vec<(f64, f64)>,
    reached: usize,
}

/// Bound on the iterations for the active set. Each one shrinks the set, and in practice a few are enough.
const MAX_ITERATIONS: usize = 10_000;

/// The same where nodes are only being met.
const MAX_MEETING_ITERATIONS: usize = 50;

impl Contact {
    /// A contact about to begin: surface at rest, indenter touching it at r = 0 and moving with V0.
    ///
    /// * `velocity`: V0 \[c_p\]
    pub fn new(rule: Rule, shape: Shape, geometry: Geometry, grid: &Grid, velocity: f64) -> Self {
        let nr = grid.nr();
        let meeting = |i: usize| Meeting::new(&shape, grid, i, geometry, velocity * grid.dt());
        // all nodes have a given motion; a body meets those under it
        let meetings: Vec<Meeting> = match rule {
            Rule::Prescribed => (0..nr).map(meeting).collect(),
            Rule::Unilateral | Rule::Bilateral => {
                (0..nr).take_while(|&i| shape.profile(grid.r(i)).is_finite()).map(meeting).collect()
            }
        };
        let is_plain = |meeting: &Meeting| {
            rule == Rule::Bilateral || meeting.blur == 0.0 || meeting.hindmost.is_infinite()
        };
        let profile: Vec<f64> = meetings.iter().map(|m| m.mean).take_while(|f| f.is_finite()).collect();
        let cells: Vec<(f64, f64)> = (0..nr).map(|i| grid.cell(i)).collect();
        Self {
            rule,
            geometry,
            area: grid.area.clone(),
            cells,
            // u = 0 and w^{−1} = −V0·Δt, w^0 = 0
            gap_before: profile.iter().map(|f| f + velocity * grid.dt()).collect(),
            gap: profile.clone(),
            touching: vec![false; profile.len()],
            is_plain: meetings[..profile.len()].iter().map(is_plain).collect(),
            profile,
            shape,
            given: vec![(0.0, 0.0); if rule == Rule::Prescribed { nr } else { 0 }],
            meetings,
            reached: 0,
        }
    }

    /// Number of leading nodes out to the outermost one that has ever been in contact.
    pub fn reached(&self) -> usize {
        self.reached
    }

    /// Radius of the punch \[R\], infinite if unbounded.
    pub fn punch_radius(&self) -> f64 {
        self.shape.radius()
    }

    /// Profile of the indenter at the surface nodes it can touch, shape `(zone,)` \[R\].
    pub fn profile(&self) -> &[f64] {
        &self.profile
    }

    /// Finds the pressure of step k, moves the indenter to level k+1 and the surface with it.
    pub fn step(&mut self, surface: &mut Surface, indenter: &mut Indenter) -> Touch {
        match self.rule {
            Rule::Unilateral | Rule::Bilateral => self.step_body(surface, indenter),
            Rule::Prescribed => self.step_prescribed(surface, indenter),
        }
    }

    fn step_body(&mut self, surface: &mut Surface, indenter: &mut Indenter) -> Touch {
        let next_depth = self.solve_depth(surface, indenter);
        let mut drag = 0.0;
        for i in 0..self.profile.len() {
            let pressure = self.pressure_at(i, next_depth, surface);
            surface.pressure[i] = pressure;
            drag += self.area[i] * pressure;
        }
        let depth = indenter.depth();
        let velocity = indenter.advance(drag);
        let next_depth = indenter.depth();

        let mut touch = Touch {
            drag,
            contact_radius: 0.0,
            velocity,
            depth,
            work: 0.0,
            dissipated: 0.0,
            extended: None,
            touching: 0,
        };
        surface.displacement.copy_from_slice(&surface.free);
        let (mut tension, mut outermost) = (0.0, None);
        for i in 0..self.profile.len() {
            let pressure = surface.pressure[i];
            let touches = self.rule == Rule::Bilateral || pressure > 0.0;
            let (level, whole) = self.level(i, next_depth, &surface.free);
            let next_gap = if touches {
                surface.displacement[i] = level.penetration;
                touch.touching += 1;
                self.reached = self.reached.max(i + 1);
                surface.loaded = surface.loaded.max(i + 1);
                if whole || next_depth - self.profile[i] >= surface.free[i] {
                    outermost = Some(i);
                }
                if whole { 0.0 } else { level.penetration + self.profile[i] - next_depth }
            } else {
                surface.displacement[i] + self.profile[i] - next_depth
            };
            // ½ p (g^{k−1} − g^{k+1}): what the half cell loses when it strikes the indenter and sticks
            touch.dissipated += 0.5 * self.area[i] * pressure * (self.gap_before[i] - next_gap);
            if pressure < tension {
                tension = pressure;
                touch.extended = Some(i);
            }
            if self.touching[i] && !touches && touch.extended.is_none() {
                touch.extended = Some(i);
            }
            // what is only being met can still come free without tension
            self.touching[i] = touches && (whole || self.touching[i]);
            self.gap_before[i] = self.gap[i];
            self.gap[i] = next_gap;
        }
        if indenter.is_driven() {
            // F^k (w^{k+1} − w^{k−1})/2 at constant velocity: work of whatever keeps it constant
            touch.work = drag * (next_depth - depth);
        }
        if let Some(i) = outermost {
            touch.contact_radius = self.cells[i].1.min(self.shape.radius());
        }
        touch
    }

    /// Displacement of node `i` if it follows an indenter at `depth`, its derivative, and whether the node is wholly in
    /// contact: then it is `w − f`.
    ///
    /// The gap of a node that is being met never grows while it is pressed, or the contact would give energy back: what
    /// leaves the indenter leaves it as a node.
    #[inline]
    fn level(&self, i: usize, depth: f64, free: &[f64]) -> (Wetted, bool) {
        let plain = Wetted { penetration: depth - self.profile[i], fraction: 1.0 };
        if self.is_plain[i] || self.gap_before[i] <= 0.0 {
            (plain, true)
        } else {
            self.meet(i, plain, depth, free)
        }
    }

    /// [`Contact::level`] of a node that is being met, if it is not wholly in contact.
    fn meet(&self, i: usize, plain: Wetted, depth: f64, free: &[f64]) -> (Wetted, bool) {
        let meeting = &self.meetings[i];
        let met = if free[i] >= 0.0 && !meeting.is_whole(depth) {
            // a surface that has risen is not one at rest
            meeting.at(depth, &self.shape, self.geometry)
        } else {
            let penetration = |i: usize| self.profile.get(i).map(|f| depth - f - free[i]);
            let here = depth - self.profile[i] - free[i];
            // at the axis the surface is even; beyond the last node nothing is known
            let inner = if i == 0 { here } else { penetration(i - 1).unwrap_or(here) };
            let outer = penetration(i + 1).unwrap_or(here);
            if (here >= 0.0) == (inner >= 0.0) && (here >= 0.0) == (outer >= 0.0) {
                return (plain, true);
            }
            let (inner, outer) = (closing(here, inner), closing(here, outer));
            Wetted {
                penetration: free[i] + inner.penetration + outer.penetration,
                fraction: inner.fraction + outer.fraction,
            }
        };
        if met.penetration < plain.penetration {
            return (plain, true);
        }
        let most = plain.penetration + self.gap_before[i];
        if met.penetration <= most { (met, false) } else { (Wetted { penetration: most, ..plain }, false) }
    }

    /// Pressure at node `i` if the indenter goes to `next_depth`.
    fn pressure_at(&self, i: usize, next_depth: f64, surface: &Surface) -> f64 {
        let (level, _) = self.level(i, next_depth, &surface.free);
        let pressure = (level.penetration - surface.free[i]) / surface.compliance[i];
        // a pressure that is not a number must stay one, to be found
        if self.rule == Rule::Unilateral && pressure <= 0.0 { 0.0 } else { pressure }
    }

    /// Displacement w^{k+1} of the indenter under the drag it meets on its way.
    ///
    /// `w + (Δt²/M)·F(w) = w_free` with F rising and convex: Newton's method from `w_free`, where the contact is
    /// largest, comes down monotonically and ends when the active set repeats, F being linear between such sets; where
    /// nodes are only being met it is not, and the method ends when it no longer moves. What is left then is made up by
    /// the balance of momentum, which moves the indenter by the drag it has met.
    fn solve_depth(&self, surface: &Surface, indenter: &Indenter) -> f64 {
        const ROUNDING: f64 = 1e-15;
        let free_depth = indenter.free_depth();
        if indenter.is_driven() {
            return free_depth;
        }
        let mut depth = free_depth;
        let mut last_active = usize::MAX;
        for iteration in 0..MAX_ITERATIONS {
            // F(w) = stiffness·w − offset over the active set
            let (mut stiffness, mut offset, mut active, mut partial) = (0.0, 0.0, 0, false);
            for i in 0..self.profile.len() {
                let weight = self.area[i] / surface.compliance[i];
                let (level, whole) = self.level(i, depth, &surface.free);
                if whole {
                    let level = self.profile[i] + surface.free[i];
                    if self.rule == Rule::Bilateral || depth > level {
                        stiffness += weight;
                        offset += weight * level;
                        active += 1;
                    }
                } else if level.penetration > surface.free[i] {
                    stiffness += weight * level.fraction;
                    offset += weight * (level.fraction * depth - (level.penetration - surface.free[i]));
                    active += 1;
                    partial = true;
                }
            }
            let compliance = indenter.compliance();
            let before = depth;
            depth = (free_depth + compliance * offset) / (1.0 + compliance * stiffness);
            let settled = !partial
                || (before - depth).abs() <= ROUNDING * depth.abs()
                || iteration >= MAX_MEETING_ITERATIONS;
            if (settled && (partial || active == last_active)) || self.rule == Rule::Bilateral {
                return depth;
            }
            last_active = active;
        }
        unreachable!("the active set shrinks in every iteration");
    }

    fn step_prescribed(&mut self, surface: &mut Surface, indenter: &mut Indenter) -> Touch {
        let depth = indenter.depth();
        let next_depth = indenter.free_depth();
        let mut touch = Touch {
            drag: 0.0,
            contact_radius: self.shape.reach(depth),
            velocity: 0.0,
            depth,
            work: 0.0,
            dissipated: 0.0,
            extended: None,
            touching: 0,
        };
        for (i, meeting) in self.meetings.iter().enumerate() {
            let next = meeting.at(next_depth, &self.shape, self.geometry);
            let share = meeting.share(depth, &self.shape, self.geometry);
            let (before, now) = self.given[i];
            let pressure = (next.penetration - surface.free[i]) / surface.compliance[i];
            surface.pressure[i] = pressure;
            surface.displacement[i] = next.penetration;
            touch.drag += self.area[i] * share * pressure;
            touch.work += 0.5 * self.area[i] * pressure * (next.penetration - before);
            if share > 0.0 {
                touch.touching += 1;
                if share == 1.0 && pressure < 0.0 && touch.extended.is_none() {
                    touch.extended = Some(i);
                }
            }
            if next.penetration > 0.0 {
                // like a node that is struck during the step
                self.reached = self.reached.max(i + 1);
                surface.loaded = surface.loaded.max(i + 1);
            }
            self.given[i] = (now, next.penetration);
        }
        touch.velocity = indenter.advance(touch.drag);
        touch
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{MeshKind, Spacing},
        shape::Head,
    };

    const DT: f64 = 0.1;

    /// A mesh of 10 nodes on a flat surface at rest that yields as the scheme's does.
    fn parts(rule: Rule, head: Head, radius: Option<f64>, mass: f64) -> (Contact, Surface, Indenter) {
        let spacing = Spacing { dr: 0.1, dz: DT, layer_rows: Some(10) };
        let grid = Grid::new(Geometry::Axisymmetric, MeshKind::Matched, spacing, 10, 10);
        let mut surface = Surface::new(10);
        surface.compliance.fill(2.0 * DT);
        let contact = Contact::new(rule, Shape::new(head, radius), Geometry::Axisymmetric, &grid, 1.0);
        (contact, surface, Indenter::new(mass, 1.0, DT))
    }

    #[test]
    fn the_first_step_carries_half_the_jump() {
        let (mut contact, mut surface, mut indenter) =
            parts(Rule::Unilateral, Head::Flat, Some(0.575), f64::INFINITY);
        let touch = contact.step(&mut surface, &mut indenter);
        assert_eq!(touch.touching, 6);
        assert_eq!(touch.contact_radius, 0.575);
        assert!((surface.pressure[0] - 0.5).abs() < 1e-15 && surface.pressure[6] == 0.0);
        // area of six whole cells
        assert!((touch.drag - 0.5 * 0.36).abs() < 1e-15);
    }

    #[test]
    fn a_body_of_finite_mass_gives_way_in_the_same_step() {
        for rule in [Rule::Unilateral, Rule::Bilateral] {
            let mass = 0.01;
            let (mut contact, mut surface, mut indenter) = parts(rule, Head::Flat, Some(0.575), mass);
            let touch = contact.step(&mut surface, &mut indenter);
            // w¹ = V0·Δt − (Δt²/M)·F⁰ and p⁰ = w¹/(2Δt) at once
            let depth = DT - DT * DT / mass * touch.drag;
            assert!((indenter.depth() - depth).abs() < 1e-15);
            assert!((surface.pressure[0] - depth / (2.0 * DT)).abs() < 1e-14);
        }
    }

    #[test]
    fn only_what_the_head_reaches_is_touched() {
        let cone = Head::Cone { slope: 0.5 };
        let (mut contact, mut surface, mut indenter) = parts(Rule::Unilateral, cone, None, f64::INFINITY);
        for nodes in [2, 4, 6] {
            // w grows by 0.1 per step and the profile by 0.05 per node, the first at 0.025
            let touch = contact.step(&mut surface, &mut indenter);
            assert!((touch.contact_radius - 0.1 * f64::from(nodes)).abs() < 1e-12);
            // nodes are being met up to one step, and half a hat, before they are reached
            assert!(touch.touching >= nodes as usize && touch.touching <= nodes as usize + 3, "{touch:?}");
            assert!(surface.pressure.iter().all(|&p| p >= 0.0));
            surface.free.copy_from_slice(&surface.displacement);
        }
    }

    #[test]
    fn what_is_not_a_number_is_not_hidden() {
        let (mut contact, mut surface, mut indenter) =
            parts(Rule::Unilateral, Head::Flat, Some(0.575), f64::INFINITY);
        surface.free[3] = f64::NAN;
        assert!(contact.step(&mut surface, &mut indenter).drag.is_nan());
    }
}
