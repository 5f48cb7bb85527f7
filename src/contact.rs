//! Contact between an indenter and the surface: the rules, the active set, the drag.
//!
//! In every step the contact takes the free surface that a model predicts and finds the pressure that satisfies the
//! rule. A node in contact follows the indenter, `u^{k+1} = w^{k+1} − f`, under the pressure
//!
//! ```text
//! p^k = (w^{k+1} − f − u_free^{k+1}) / compliance
//! ```
//!
//! the exact momentum balance of the half cell under the surface. An indenter of finite mass is decelerated in the
//! same step, `w^{k+1} = w_free^{k+1} − (Δt²/M)·F^k` with `F^k = Σ a_i p_i^k`; both are solved together, not lagged.
//! The contact knows nothing of the target's interior.

use std::io;

use serde::{Deserialize, Serialize};

use crate::{
    geometry::Geometry,
    grid::Grid,
    indenter::Indenter,
    shape::Shape,
    state::{StateError, StateReader, StateWriter},
    surface::Surface,
};

mod depth;
pub mod event;
pub mod load;
mod partial;
mod turn;

use load::{Load, Loaded};
pub(crate) use partial::HALF_WIDTH;
use partial::PartialContact;
pub use turn::Turn;

/// k of [`Contact::edge`]. With [`BEYOND`] measured against `a³ = 3Fρ/4E*` of slow balls on half-spaces of c_s/c_p = 0.2 to 0.7: where four
/// nodes and more are in contact the edge is there within 0.015 cells (standard deviation, at most 0.09), on the way in and out.
const PRESSED: f64 = 2.5;

/// δ of [`Contact::edge`], in cells.
const BEYOND: f64 = 0.25;

/// Penetration of two bodies that may be rounding, relative to the displacements that it is the difference of.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// How surface and indenter touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// Contact where the free surface would penetrate the indenter, and only while it pushes; \[KA\] Eqs. 5, 7.
    Unilateral,
    /// A fixed zone, glued: the interface also carries tension.
    Bilateral,
    /// The motion of the whole surface is given; \[KA\] Eq. 10.
    Prescribed,
    /// No indenter: the pressure is given, see [`load`].
    Load,
}

/// Result of one step of contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ContactState {
    /// Drag F^k on the indenter \[πR²γc_p²; plane Rγc_p²\].
    pub drag: f64,
    /// Contact radius r* \[R\], see [`Contact::edge`]. Measured against Hertz (steel ball on a half-space of PMMA, 3 mm, 2 m/s, above a
    /// fifth of the largest force): −0.8 to +9.4 % with 25 nodes across R, +0.3 to +2.6 % with 50, +0.3 to +1.6 % with 100; against
    /// `f⁻¹(w)` of a cone that outruns waves: 0.2 of a cell too small. Up to a cell too small where the pressure at the edge is no larger
    /// than `γc_p·V/2`; exact where the motion is prescribed. On graded meshes within 0.1 of a cell of an edge slower than waves.
    pub contact_radius: f64,
    /// Velocity V^k of the indenter \[c_p\].
    pub velocity: f64,
    /// Displacement w^k of the indenter \[R\].
    pub depth: f64,
    /// Work done during the step by a prescribed motion \[πR³γc_p²; plane R²γc_p²\].
    pub work: f64,
    /// Energy dissipated during the step by the impact of nodes on the indenter \[πR³γc_p²; plane R²γc_p²\].
    pub dissipated: f64,
    /// Node that needs tension: the one under the largest tension (glued), or one that opens in this step.
    pub extended: Option<usize>,
    /// Number of nodes in contact.
    pub nodes: usize,
}

/// The lower face of an indenter that gives.
#[derive(Debug)]
pub struct Nose<'a> {
    /// Its nodes, displacements into the indenter and in a frame that flies on with V0.
    pub surface: &'a mut Surface,
    /// Areas of the nodes \[R²; plane R\].
    pub area: &'a [f64],
    /// Depth of that frame at levels k and k+1 \[R\].
    pub flight: [f64; 2],
}

/// The contact between one shape and the nodes of one surface.
#[derive(Clone, Debug)]
pub struct Contact {
    rule: Rule,
    shape: Shape,
    geometry: Geometry,
    area: Vec<f64>,
    /// Radii of the nodes, and widths of the cells on both sides of them, see [`Grid::width`] \[R\].
    r: Vec<f64>,
    widths: Vec<f64>,
    /// Radius of the narrower body, which contact ends at, infinite without rims \[R\].
    rim: f64,
    /// E* of the contact on a graded mesh \[γc_p²\], see [`Contact::edge`].
    modulus: Option<f64>,
    /// Profile at the nodes, shape `(zone,)`: nodes beyond it are never in contact \[R\].
    profile: Vec<f64>,
    /// Gaps `u + f − w` at levels k−1, k, shape `(zone,)` \[R\].
    gap_before: Vec<f64>,
    gap: Vec<f64>,
    in_contact: Vec<bool>,
    /// Partial contact of the nodes under the punch, or of all whose motion is prescribed.
    partial: Vec<PartialContact>,
    /// Prescribed displacements at levels k−1 and k \[R\].
    prescribed: Vec<(f64, f64)>,
    /// Radial weights of the pass over a prescribed motion, if there is one, see [`smoothed`].
    pass: Option<(Vec<f64>, Vec<f64>)>,
    /// What presses in place of an indenter.
    load: Option<Loaded>,
}

impl Contact {
    /// No contact, but a load.
    ///
    /// * `shape`: a flat face of its radius
    pub fn loaded(load: &Load, shape: Shape, grid: &Grid) -> Self {
        let load = Loaded::new(load, grid);
        let mut contact = Self::new(Rule::Load, shape, grid, 0.0, 1.0);
        contact.profile = vec![0.0; load.nodes()];
        contact.load = Some(load);
        contact
    }

    /// A contact at t = 0: surface at rest, indenter touching it at r = 0 and moving with V0.
    ///
    /// * `velocity`: V0 \[c_p\]
    /// * `wave_speed`: of waves along the surface, c_s \[c_p\]
    pub fn new(rule: Rule, shape: Shape, grid: &Grid, velocity: f64, wave_speed: f64) -> Self {
        let nr = grid.nr();
        let step = velocity * grid.dt();
        let half_width = if rule == Rule::Bilateral { 0.0 } else { HALF_WIDTH * step };
        let slowness = velocity / wave_speed;
        let is_under_punch = |i: &usize| rule == Rule::Prescribed || shape.profile(grid.r(*i)).is_finite();
        let touched = if rule == Rule::Load { 0 } else { nr };
        let partial: Vec<PartialContact> = (0..touched)
            .take_while(is_under_punch)
            .map(|i| PartialContact::new(&shape, grid, i, half_width, slowness))
            .collect();
        let profile: Vec<f64> = partial.iter().map(|node| node.mean).take_while(|f| f.is_finite()).collect();
        Self {
            rule,
            geometry: grid.geometry,
            area: grid.area.clone(),
            r: (0..nr).map(|i| grid.r(i)).collect(),
            widths: (0..=nr).map(|i| grid.width(i)).collect(),
            rim: f64::INFINITY,
            modulus: None,
            // u = 0 and w^{−1} = −V0·Δt, w^0 = 0
            gap_before: profile.iter().map(|f| f + step).collect(),
            gap: profile.clone(),
            in_contact: vec![false; profile.len()],
            profile,
            shape,
            prescribed: vec![(0.0, 0.0); if rule == Rule::Prescribed { nr } else { 0 }],
            partial,
            pass: grid.cells_between_nodes.then(|| grid.radial_weights()),
            load: None,
        }
    }

    /// The same where the indenter has so many nodes.
    ///
    /// * `rim`: radius of the narrower body, infinite if none ends \[R\]
    pub fn limited_to(mut self, nodes: usize, rim: f64) -> Self {
        self.rim = rim;
        self.profile.truncate(nodes);
        self.gap_before.truncate(nodes);
        self.gap.truncate(nodes);
        self.in_contact.truncate(nodes);
        self
    }

    /// The same on a graded mesh, if `grid` is one.
    ///
    /// * `modulus`: E* of target and indenter \[γc_p²\]
    pub fn graded(mut self, grid: &Grid, modulus: f64) -> Self {
        self.modulus = grid.is_graded().then_some(modulus);
        self
    }

    /// Radius of the punch \[R\], infinite if unbounded.
    pub fn punch_radius(&self) -> f64 {
        self.shape.radius()
    }

    /// How the contact turns back, if it is that of a head which spreads and only pushes.
    pub fn turn(&self) -> Option<Turn> {
        (self.rule == Rule::Unilateral && self.shape.spreads())
            .then(|| Turn { cell: self.widths[0], edge: self.shape.radius() })
    }

    /// Profile of the indenter at the surface nodes it can reach, shape `(zone,)` \[R\].
    pub fn profile(&self) -> &[f64] {
        &self.profile
    }

    /// Finds the pressure of step k, moves the indenter to level k+1 and the surface with it.
    ///
    /// * `time`: t^k \[R/c_p\]
    pub fn step(&mut self, surface: &mut Surface, indenter: &mut Indenter, time: f64) -> ContactState {
        match (self.rule, &mut self.load) {
            (_, Some(load)) => load.step(surface, &self.area, time),
            (Rule::Prescribed, None) => self.step_prescribed(surface, indenter),
            (_, None) => self.step_body(surface, indenter),
        }
    }

    /// Writes what changes from step to step.
    ///
    /// # Errors
    ///
    /// The stream cannot be written.
    pub fn save(&self, out: &mut StateWriter<'_>) -> io::Result<()> {
        let in_contact: Vec<f64> = self.in_contact.iter().map(|is| f64::from(u8::from(*is))).collect();
        let [before, now]: [Vec<f64>; 2] = self.prescribed.iter().copied().unzip().into();
        if let Some(load) = &self.load {
            out.put(&load.motion)?;
        }
        [&self.gap_before, &self.gap, &in_contact, &before, &now]
            .into_iter()
            .try_for_each(|array| out.numbers(array))
    }

    /// Restores the state written by [`Contact::save`].
    ///
    /// # Errors
    ///
    /// The stream cannot be read, or is that of another contact.
    pub fn load(&mut self, from: &mut StateReader<'_>) -> Result<(), StateError> {
        if let Some(load) = &mut self.load {
            load.motion = from.get()?;
        }
        let mut in_contact = vec![0.0; self.in_contact.len()];
        let [mut before, mut now] = [(); 2].map(|()| vec![0.0; self.prescribed.len()]);
        for array in [&mut self.gap_before, &mut self.gap, &mut in_contact, &mut before, &mut now] {
            from.numbers(array)?;
        }
        self.in_contact = in_contact.into_iter().map(|is| is != 0.0).collect();
        self.prescribed = before.into_iter().zip(now).collect();
        Ok(())
    }

    fn step_body(&mut self, surface: &mut Surface, indenter: &mut Indenter) -> ContactState {
        let next_depth = self.solve_depth(surface, indenter);
        let mut state = ContactState { depth: indenter.depth(), ..ContactState::default() };
        for i in 0..self.profile.len() {
            let pressure = self.pressure_at(i, next_depth, surface);
            surface.pressure[i] = pressure;
            state.drag += self.area[i] * pressure;
        }
        state.velocity = indenter.advance(state.drag);
        let next_depth = indenter.depth();
        if indenter.is_driven() {
            // F^k (w^{k+1} − w^k): work of the force that keeps the velocity constant
            state.work = state.drag * (next_depth - state.depth);
        }
        state.extended = self.extended(&surface.pressure);
        self.displace(next_depth, surface, &mut state);
        state
    }

    /// Node that needs tension under the pressure of this step: the one under the largest tension, if the interface
    /// carries it, else the first that loses contact.
    fn extended(&self, pressure: &[f64]) -> Option<usize> {
        let mut nodes = 0..self.profile.len();
        if self.rule == Rule::Bilateral {
            nodes.filter(|&i| pressure[i] < 0.0).min_by(|&a, &b| pressure[a].total_cmp(&pressure[b]))
        } else {
            nodes.find(|&i| self.in_contact[i] && pressure[i] <= 0.0)
        }
    }

    /// Moves the surface to level k+1 under its pressure, the indenter being at `next_depth`.
    fn displace(&mut self, next_depth: f64, surface: &mut Surface, state: &mut ContactState) {
        surface.displacement.copy_from_slice(&surface.free);
        state.contact_radius = self.edge(|_| state.depth, surface);
        for i in 0..self.profile.len() {
            let in_contact = self.is_loaded(surface.pressure[i]);
            let (imposed, is_full) = self.imposed(i, |_| next_depth, &surface.free);
            if in_contact {
                surface.displacement[i] = imposed.penetration;
            }
            let next_gap = surface.displacement[i] + self.profile[i] - next_depth;
            self.touch(i, in_contact, is_full, next_gap, surface, state);
        }
    }

    /// True if a node under a pressure is in contact.
    fn is_loaded(&self, pressure: f64) -> bool {
        self.rule == Rule::Bilateral || pressure > 0.0
    }

    /// Notes what became of node `i` in a step.
    ///
    /// * `next_gap`: at level k+1, but for rounding where the contact is full
    fn touch(
        &mut self,
        i: usize,
        in_contact: bool,
        is_full: bool,
        next_gap: f64,
        surface: &mut Surface,
        state: &mut ContactState,
    ) {
        if in_contact {
            state.nodes += 1;
            surface.loaded = surface.loaded.max(i + 1);
        }
        let next_gap = if in_contact && is_full { 0.0 } else { next_gap };
        // ½ p (g^{k−1} − g^{k+1}): energy that the half cell loses when it hits the indenter and sticks to it
        state.dissipated += 0.5 * self.area[i] * surface.pressure[i] * (self.gap_before[i] - next_gap);
        // partial contact can still open without tension
        self.in_contact[i] = in_contact && (is_full || self.in_contact[i]);
        self.gap_before[i] = self.gap[i];
        self.gap[i] = next_gap;
    }

    /// [`Contact::step`] with an indenter that gives, whose nodes stand on the same radii.
    ///
    /// ```text
    /// pen_i = w_flight − s_i − f(r_i) − u_i        F_i = pen_i/(C_t,i/a_t,i + C_s,i/a_s,i)        of free surfaces at level k+1
    /// ```
    ///
    /// with the compliances C per pressure and the areas a of both surfaces' nodes, whose forces are in balance, not pressures: areas differ at a rim. It
    /// stays local, as no node's force moves another one in a step. In partial contact the penetration is an average as under a rigid indenter.
    ///
    /// * `nose`: lower face of the indenter, its displacements into it and in a frame that flies on with V0
    /// * `flight`: that frame, [`Indenter::free_depth`] of one without drag
    /// * `indenter`: centre of mass
    pub fn step_elastic(
        &mut self,
        surface: &mut Surface,
        nose: &mut Nose<'_>,
        indenter: &mut Indenter,
    ) -> ContactState {
        let Nose { surface: striker, area, flight: [flight, next_flight] } = nose;
        let mut state = ContactState { depth: indenter.depth(), ..ContactState::default() };
        let zone = 0..self.profile.len();
        striker.displacement.copy_from_slice(&striker.free);
        let mut full = vec![false; zone.len()];
        for i in zone.clone() {
            let (imposed, is_full) = self.imposed(i, |i| *next_flight - striker.free[i], &surface.free);
            full[i] = is_full;
            let penetration = imposed.penetration - surface.free[i];
            let compliance = surface.compliance[i] / self.area[i] + striker.compliance[i] / area[i];
            let force = penetration / compliance;
            // faces that rest at one velocity touch by rounding alone
            let rounding = ROUNDING * next_flight.abs().max(striker.free[i].abs()).max(surface.free[i].abs());
            // NaN stays NaN, to be reported
            let force = if self.rule == Rule::Unilateral && penetration <= rounding { 0.0 } else { force };
            surface.pressure[i] = force / self.area[i];
            striker.pressure[i] = force / area[i];
            state.drag += force;
        }
        state.velocity = indenter.advance(state.drag);
        if indenter.is_driven() {
            state.work = state.drag * (*next_flight - *flight);
        }
        state.extended = self.extended(&surface.pressure);
        surface.displacement.copy_from_slice(&surface.free);
        state.contact_radius = self.edge(|i| *flight - striker.free[i], surface);
        for i in zone {
            let in_contact = self.is_loaded(surface.pressure[i]);
            surface.displacement[i] += surface.compliance[i] * surface.pressure[i];
            striker.displacement[i] += striker.compliance[i] * striker.pressure[i];
            let next_depth = *next_flight - striker.displacement[i];
            let next_gap = surface.displacement[i] + self.profile[i] - next_depth;
            self.touch(i, in_contact, full[i], next_gap, surface, &mut state);
        }
        striker.loaded = surface.loaded;
        state
    }

    /// Radius r* at which the contact ends: where the penetration of the free surface, `w^k − f − u_free^{k+1}`, linear between the
    /// last node in contact and the one beyond it, is 0.
    ///
    /// In contact the penetration is the pressure times the compliance, less what the indenter moves in a step; beside it, minus the
    /// gap. Over a surface at rest it is `w − f`, whose zero is the edge of a contact that outruns waves.
    ///
    /// Inside a slower edge the pressure falls as `K·√(a − r)`, beyond it the gap opens as `(4K/3E*)·(r − a)^(3/2)`, whatever the bodies
    /// are. So where it is between two nodes depends on the ratio of `p·h/E*` at the inner one and the gap g at the outer one alone, and
    /// on a graded mesh, with constants of the scheme, [`PRESSED`] and [`BEYOND`], it is found from them; i is the last node in contact,
    /// and those beyond it are in partial contact:
    ///
    /// ```text
    /// r* = r_i + Σ_{j ≥ i} h_{j+1}·q_j/(1 + q_j) − δ·h_{i+1}      q_j = k·p_j·h_{j+1}/(E*·g_{j+1})
    /// ```
    ///
    /// * `depth`: w^k of the indenter over each node \[R\]
    fn edge(&self, depth: impl Fn(usize) -> f64, surface: &Surface) -> f64 {
        let nodes = self.profile.len();
        let limit = self.shape.radius().min(self.rim);
        let outermost = |i: usize| (self.r[i] + 0.5 * self.widths[i + 1]).min(limit);
        if self.rule == Rule::Bilateral {
            return outermost(nodes - 1);
        }
        let penetration = |i: usize| depth(i) - self.profile[i] - surface.free[i];
        let is_in_contact =
            |&i: &usize| surface.pressure[i] > 0.0 && (self.in_contact[i] || penetration(i) >= 0.0);
        let Some(last) = (0..nodes).rev().find(is_in_contact) else { return 0.0 };
        if last + 1 == nodes {
            return outermost(last);
        }
        let width = self.widths[last + 1];
        let beside = match self.modulus {
            Some(modulus) if !self.partial[last].outruns => {
                let share = |j: usize| {
                    let width = self.widths[j + 1];
                    let pressed = PRESSED * width * surface.pressure[j] / modulus;
                    width * pressed / (pressed + self.gap[j + 1].max(0.0))
                };
                let loaded = (last..nodes - 1).take_while(|&j| surface.pressure[j] > 0.0);
                loaded.map(share).sum::<f64>() - BEYOND * width
            }
            _ => {
                let (inside, outside) = (penetration(last).max(0.0), penetration(last + 1).min(0.0));
                let share = if inside > 0.0 { inside / (inside - outside) } else { 0.0 };
                share * width
            }
        };
        (self.r[last] + beside).min(limit)
    }

    fn step_prescribed(&mut self, surface: &mut Surface, indenter: &mut Indenter) -> ContactState {
        let depth = indenter.depth();
        let next_depth = indenter.free_depth();
        let contact_radius = self.shape.reach(depth);
        let mut state = ContactState { depth, contact_radius, ..ContactState::default() };
        let average =
            |node: &PartialContact| node.average(next_depth, &self.shape, self.geometry).penetration;
        let motion: Vec<f64> = self.partial.iter().map(average).collect();
        let motion = match &self.pass {
            Some(weights) => smoothed(&motion, weights),
            None => motion,
        };
        for (i, &next) in motion.iter().enumerate() {
            let node = &self.partial[i];
            let fraction = node.fraction(depth, &self.shape, self.geometry);
            let (before, now) = self.prescribed[i];
            let pressure = (next - surface.free[i]) / surface.compliance[i];
            surface.pressure[i] = pressure;
            surface.displacement[i] = next;
            state.drag += self.area[i] * node.drag_share(fraction) * pressure;
            state.work += 0.5 * self.area[i] * pressure * (next - before);
            if fraction > 0.0 {
                state.nodes += 1;
            }
            if fraction == 1.0 && pressure < 0.0 {
                state.extended.get_or_insert(i);
            }
            if next > 0.0 {
                // as a node that comes into contact during the step
                surface.loaded = surface.loaded.max(i + 1);
            }
            self.prescribed[i] = (now, next);
        }
        state.velocity = indenter.advance(state.drag);
        state
    }
}

/// One conservative pass of (1 2 1)/4 along r, `u + ¼Λ_r u`: an edge that runs at v = ω/q excites waves of grid length where
/// displacements along r may alternate freely, and this has its zero there.
///
/// * `weights`: of Λ_r, outward and inward
fn smoothed(motion: &[f64], (outward, inward): &(Vec<f64>, Vec<f64>)) -> Vec<f64> {
    let at = |i: usize| motion.get(i).copied().unwrap_or_default();
    let pass = |i: usize| {
        let (here, inner) = (motion[i], if i == 0 { motion[0] } else { motion[i - 1] });
        here + 0.25 * (outward[i] * (at(i + 1) - here) - inward[i] * (here - inner))
    };
    (0..motion.len()).map(pass).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        grid::{Back, Bond, MeshKind, Spacing},
        shape::{Head, Profile},
    };

    const DT: f64 = 0.1;

    /// A mesh of 10 nodes on a flat surface at rest with the compliance of the scheme.
    fn parts(rule: Rule, head: Head, radius: Option<f64>, mass: f64) -> (Contact, Surface, Indenter) {
        let spacing = Spacing { dr: 0.1, dz: DT, layer_rows: Some(10) };
        let grid = Grid::new(Geometry::Axisymmetric, MeshKind::Matched, spacing, 10, 10);
        let mut surface = Surface::new(10);
        surface.compliance.fill(2.0 * DT);
        let contact = Contact::new(rule, Shape::new(head, radius), &grid, 1.0, 0.5);
        (contact, surface, Indenter::new(mass, 1.0, DT))
    }

    const FLAT: Head = Head::Flat { edge_radius: 0.0 };

    #[test]
    fn first_step_has_half_the_jump_of_pressure() {
        let (mut contact, mut surface, mut indenter) =
            parts(Rule::Unilateral, FLAT, Some(0.575), f64::INFINITY);
        let state = contact.step(&mut surface, &mut indenter, 0.0);
        assert_eq!(state.nodes, 6);
        assert_eq!(state.contact_radius, 0.575);
        assert!((surface.pressure[0] - 0.5).abs() < 1e-15 && surface.pressure[6] == 0.0);
        // area of six whole cells
        assert!((state.drag - 0.5 * 0.36).abs() < 1e-15);
    }

    #[test]
    fn finite_mass_is_decelerated_in_the_same_step() {
        for rule in [Rule::Unilateral, Rule::Bilateral] {
            let mass = 0.01;
            let (mut contact, mut surface, mut indenter) = parts(rule, FLAT, Some(0.575), mass);
            let state = contact.step(&mut surface, &mut indenter, 0.0);
            // w¹ = V0·Δt − (Δt²/M)·F⁰ and p⁰ = w¹/(2Δt) hold together
            let depth = DT - DT * DT / mass * state.drag;
            assert!((indenter.depth() - depth).abs() < 1e-15);
            assert!((surface.pressure[0] - depth / (2.0 * DT)).abs() < 1e-14);
        }
    }

    #[test]
    fn contact_spreads_with_the_depth() {
        let cone = Head::Cone { slope: 0.5 };
        let (mut contact, mut surface, mut indenter) = parts(Rule::Unilateral, cone, None, f64::INFINITY);
        for nodes in [2, 4, 6] {
            // w grows by 0.1 per step and the profile by 0.05 per node, the first at 0.025
            let state = contact.step(&mut surface, &mut indenter, 0.0);
            // the profile of a node is its mean over a hat
            assert!((state.contact_radius - 2.0 * state.depth).abs() < 0.02, "{state:?}");
            // partial contact begins up to one step and a half, and half a hat, before the node is reached
            assert!(state.nodes >= nodes as usize && state.nodes <= nodes as usize + 4, "{state:?}");
            // the surface stays at rest
            assert!(surface.pressure.iter().all(|&p| p >= 0.0));
        }
    }

    #[test]
    fn an_edge_where_cells_have_grown_is_found_with_their_width() {
        let widths: Vec<f64> = (0..12).map(|i| 0.05 * 1.3_f64.powi(i)).collect();
        let rows = [(vec![DT; 4], Bond::Welded)];
        let grid = Grid::graded(Geometry::Axisymmetric, widths.clone(), DT, &rows, Back::Rigid, false, None);
        let cone = Shape::new(Head::Cone { slope: 0.5 }, None);
        let contact = Contact::new(Rule::Unilateral, cone, &grid, 1.0, 0.5);
        let (mut contact, mut indenter) = (contact.graded(&grid, 1.0), Indenter::new(f64::INFINITY, 1.0, DT));
        let mut surface = Surface::new(grid.nr());
        surface.compliance.fill(2.0 * DT);
        for _ in 0..8 {
            // it outruns waves: the surface stays at rest
            let state = contact.step(&mut surface, &mut indenter, 0.0);
            let (expected, width) =
                (2.0 * state.depth, widths[grid.place(2.0 * state.depth).max(0.0) as usize + 1]);
            assert!((state.contact_radius - expected).abs() < 0.1 * width, "{state:?}, {width}");
        }
    }

    #[test]
    fn a_flat_ring_touches_as_a_flat_face_does() {
        let profile =
            Profile::new(&[[0.0, 0.0], [0.2, 0.0], [0.201, 0.25], [1.0, 0.25]]).expect("valid points");
        let (mut contact, mut surface, mut indenter) =
            parts(Rule::Unilateral, Head::Profile(profile), None, f64::INFINITY);
        let mut ring = || {
            contact.step(&mut surface, &mut indenter, 0.0);
            surface.free.copy_from_slice(&surface.displacement);
            surface.pressure[3..9].to_vec()
        };
        // the ring is touched half-way through the third step, at w = 0.25, with half of V0 in that step and all of it in the next
        for pressure in [0.0, 0.0, 0.25, 0.5] {
            let found = ring();
            assert!(found.iter().all(|p| (p - pressure).abs() < 1e-12), "{pressure}: {found:?}");
        }
    }

    #[test]
    fn nan_reaches_the_drag() {
        let (mut contact, mut surface, mut indenter) =
            parts(Rule::Unilateral, FLAT, Some(0.575), f64::INFINITY);
        surface.free[3] = f64::NAN;
        assert!(contact.step(&mut surface, &mut indenter, 0.0).drag.is_nan());
    }
}
