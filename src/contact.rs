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
    /// Drag F^k on the indenter \[πR²γc_p²\].
    pub drag: f64,
    /// Contact radius r* \[R\].
    pub contact_radius: f64,
    /// Velocity V^k of the indenter \[c_p\].
    pub velocity: f64,
    /// Displacement w^k of the indenter \[R\].
    pub depth: f64,
    /// Work done during the step by a prescribed motion \[πR³γc_p²\].
    pub work: f64,
    /// Energy lost during the step to nodes that struck the indenter \[πR³γc_p²\].
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
    supports: Vec<(f64, f64)>,
    /// Profile at the nodes, shape `(zone,)`: nodes beyond it can never touch.
    profile: Vec<f64>,
    /// Gaps `u + f − w` at levels k−1, k.
    gap_before: Vec<f64>,
    gap: Vec<f64>,
    touching: Vec<bool>,
    prescribed: Vec<PrescribedCell>,
    reached: usize,
}

/// State of one cell of a prescribed surface.
#[derive(Clone, Copy, Debug)]
struct PrescribedCell {
    /// Smallest profile depth in the cell \[R\].
    foremost: f64,
    /// Mean profile depth, known once the cell is wholly wetted \[R\].
    mean: Option<f64>,
    /// Mean displacement at levels k−1 and k \[R\].
    before: f64,
    now: f64,
    /// Wetted share at level k.
    fraction: f64,
}

impl PrescribedCell {
    fn new(shape: &Shape, cell: (f64, f64), geometry: Geometry) -> Self {
        let fraction = shape.wetted(0.0, cell.0, cell.1, geometry).fraction;
        Self { foremost: shape.foremost(cell.0, cell.1), mean: None, before: 0.0, now: 0.0, fraction }
    }

    /// What an indenter at `depth` has wetted; the integral is taken only while the contact edge is in the cell.
    fn at(&mut self, depth: f64, shape: &Shape, cell: (f64, f64), geometry: Geometry) -> Wetted {
        if depth < self.foremost {
            return Wetted { penetration: 0.0, fraction: 0.0 };
        }
        if let Some(mean) = self.mean {
            return Wetted { penetration: depth - mean, fraction: 1.0 };
        }
        let wetted = shape.wetted(depth, cell.0, cell.1, geometry);
        if wetted.fraction == 1.0 {
            self.mean = Some(depth - wetted.penetration);
        }
        wetted
    }
}

/// Bound on the iterations for the active set. Each one shrinks the set, and in practice a few are enough.
const MAX_ITERATIONS: usize = 10_000;

impl Contact {
    /// A contact about to begin: surface at rest, indenter touching it at r = 0 and moving with V0.
    ///
    /// * `velocity`: V0 \[c_p\]
    pub fn new(rule: Rule, shape: Shape, geometry: Geometry, grid: &Grid, velocity: f64) -> Self {
        let nr = grid.nr();
        let profile: Vec<f64> =
            (0..nr).map(|i| shape.profile(grid.r(i))).take_while(|f| f.is_finite()).collect();
        let cells: Vec<(f64, f64)> = (0..nr).map(|i| grid.cell(i)).collect();
        let supports: Vec<(f64, f64)> = (0..nr).map(|i| grid.support(i)).collect();
        let prescribed = match rule {
            Rule::Prescribed => {
                supports.iter().map(|&cell| PrescribedCell::new(&shape, cell, geometry)).collect()
            }
            Rule::Unilateral | Rule::Bilateral => Vec::new(),
        };
        Self {
            rule,
            geometry,
            area: grid.area.clone(),
            cells,
            supports,
            // u = 0 and w^{−1} = −V0·Δt, w^0 = 0
            gap_before: profile.iter().map(|f| f + velocity * grid.dt()).collect(),
            gap: profile.clone(),
            touching: vec![false; profile.len()],
            profile,
            shape,
            prescribed,
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
            let next_gap = if touches {
                surface.displacement[i] = next_depth - self.profile[i];
                touch.touching += 1;
                outermost = Some(i);
                0.0
            } else {
                surface.displacement[i] + self.profile[i] - next_depth
            };
            // ½ p (g^{k−1} − g^{k+1}): what the half cell loses when it strikes the indenter and sticks
            touch.dissipated += 0.5 * self.area[i] * pressure * self.gap_before[i];
            if pressure < tension {
                tension = pressure;
                touch.extended = Some(i);
            }
            if self.touching[i] && !touches && touch.extended.is_none() {
                touch.extended = Some(i);
            }
            self.touching[i] = touches;
            self.gap_before[i] = self.gap[i];
            self.gap[i] = next_gap;
        }
        if indenter.is_driven() {
            // F^k (w^{k+1} − w^{k−1})/2 at constant velocity: work of whatever keeps it constant
            touch.work = drag * (next_depth - depth);
        }
        if let Some(i) = outermost {
            touch.contact_radius = self.cells[i].1.min(self.shape.radius());
            self.reached = self.reached.max(i + 1);
            surface.loaded = surface.loaded.max(i + 1);
        }
        touch
    }

    /// Pressure at node `i` if the indenter goes to `next_depth`.
    fn pressure_at(&self, i: usize, next_depth: f64, surface: &Surface) -> f64 {
        let pressure = (next_depth - self.profile[i] - surface.free[i]) / surface.compliance[i];
        // a pressure that is not a number must stay one, to be found
        if self.rule == Rule::Unilateral && pressure <= 0.0 { 0.0 } else { pressure }
    }

    /// Displacement w^{k+1} of the indenter under the drag it meets on its way.
    ///
    /// `w + (Δt²/M)·F(w) = w_free` with F piecewise linear, rising and convex: Newton's method from `w_free`, where
    /// the contact is largest, comes down monotonically and ends when the active set repeats.
    fn solve_depth(&self, surface: &Surface, indenter: &Indenter) -> f64 {
        let free_depth = indenter.free_depth();
        if indenter.is_driven() {
            return free_depth;
        }
        let mut depth = free_depth;
        let mut last_active = usize::MAX;
        for _ in 0..MAX_ITERATIONS {
            // F(w) = stiffness·w − offset over the active set
            let (mut stiffness, mut offset, mut active) = (0.0, 0.0, 0);
            for i in 0..self.profile.len() {
                let level = self.profile[i] + surface.free[i];
                if self.rule == Rule::Bilateral || depth > level {
                    let weight = self.area[i] / surface.compliance[i];
                    stiffness += weight;
                    offset += weight * level;
                    active += 1;
                }
            }
            let yielding = indenter.yielding();
            depth = (free_depth + yielding * offset) / (1.0 + yielding * stiffness);
            if active == last_active || self.rule == Rule::Bilateral {
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
        for (i, cell) in self.prescribed.iter_mut().enumerate() {
            let next = cell.at(next_depth, &self.shape, self.supports[i], self.geometry);
            let pressure = (next.penetration - surface.free[i]) / surface.compliance[i];
            surface.pressure[i] = pressure;
            surface.displacement[i] = next.penetration;
            touch.drag += self.area[i] * cell.fraction * pressure;
            touch.work += 0.5 * self.area[i] * pressure * (next.penetration - cell.before);
            if cell.fraction > 0.0 {
                touch.touching += 1;
                self.reached = self.reached.max(i + 1);
                if cell.fraction == 1.0 && pressure < 0.0 && touch.extended.is_none() {
                    touch.extended = Some(i);
                }
            }
            if next.fraction > 0.0 {
                surface.loaded = surface.loaded.max(i + 1);
            }
            (cell.before, cell.now, cell.fraction) = (cell.now, next.penetration, next.fraction);
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
        for touching in [2, 4, 6] {
            // w grows by 0.1 per step and the profile by 0.05 per node, the first at 0.025
            let touch = contact.step(&mut surface, &mut indenter);
            assert_eq!(touch.touching, touching);
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
