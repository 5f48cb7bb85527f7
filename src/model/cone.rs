//! The light cone: which nodes have moved, and on which of them the surface can still depend.
//!
//! Both the fast engine and the plain stepper leave everything else at rest, so that they give the same bits.
//!
//! *From above.* The scheme passes on one node per step, so nothing has moved beyond that. Along z, at Courant number 1,
//! this is the wave front itself. Along r waves run at λ = c_sΔt/Δr ≤ 1 nodes per step, and ahead of them there is only
//! what the mesh disperses, which falls off faster than exponentially. For a wave `exp(κx)` along r the dispersion
//! relation gives the rate of growth
//!
//! ```text
//! sinh(Ω/2) = λ·sinh(κ/2)
//! ```
//!
//! (with q_z ≠ 0 it is smaller), so of anything that started behind x = 0 no more than `exp(Ω(κ)·t − κ·x)` is at x
//! after t steps, for every κ. The best κ is where Ω' = v = x/t,
//!
//! ```text
//! cosh²(κ/2) = v²(1 − λ²)/(λ²(1 − v²))
//! ```
//!
//! With the mixed-derivative correction the scheme passes on two nodes per step. Along z waves grow at
//!
//! ```text
//! w² − (2 − 4s − (4/3 + σ)C)·w + 1 − σC = 0,   sin²(q_z/2) → −sinh²(κ/2)
//! ```
//!
//! per step, w being the factor. The best bound over κ falls below [`NOTHING`] within 22 rows of the wave front, whatever B, σ and
//! the number of steps are (computed for σ ≤ 4/3, λ ≤ 1 and up to 10⁵ steps), and within 22 columns along r for λ = 1; for smaller
//! λ what the mesh disperses goes farther.
//!
//! The lateral damping of the scheme of cells passes on four columns per step, and lets short waves run ahead of long ones ([`damped_growth`]);
//! the best bound is looked up over some κ.
//!
//! Nodes where this is below [`NOTHING`] are left at rest. Their distance from the front grows as t^⅓: 27 nodes after
//! 100 steps and 111 after 6000 at λ = ½. Weights of axisymmetric meshes only make outgoing waves smaller.
//!
//! *From below.* Where nothing below a depth is recorded, rows that the rest of the run does not depend on are left out ([`Dependence`]).
//! That is exact: it moves no bit of what is above. Columns are never left out so: contact may come to any of them.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::Coverage;
use crate::state::StateError;

/// Columns begin to move by so many: the numbers in the widest vector.
pub const BLOCK: usize = 8;

/// What of a level is to be computed: the rows and columns that may differ from 0 and are needed.
#[derive(Clone, Copy, Debug, Default)]
pub struct ActiveRegion {
    /// Number of rows, by depth: an interface counts once.
    pub rows: usize,
    /// Number of columns, a whole number of blocks.
    pub columns: usize,
}

/// What the first rows of a target depend on until the end of a run: a node depends on those around it in the step before, and on no
/// others. What is left out beyond does not change a bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dependence {
    /// Last step of the run.
    pub last_step: usize,
    /// Number of rows, by depth, that are needed up to the level after it.
    pub depths: usize,
}

impl Dependence {
    /// Number of rows, by depth, that are needed of a level.
    ///
    /// * `reach`: rows around a node that its next level depends on
    pub fn depths_at(&self, level: usize, reach: usize) -> usize {
        self.depths + reach * (self.last_step + 1).saturating_sub(level)
    }

    /// Largest number of rows, by depth, that have moved and are needed at one level, a few more at most.
    ///
    /// * `reach`: rows around a node that its next level depends on
    pub fn deepest(&self, reach: usize) -> usize {
        let ahead = rows_ahead(reach);
        let level = (self.depths + reach * (self.last_step + 1)).saturating_sub(ahead) / (1 + reach);
        level + ahead + 2
    }
}

/// What is left of a wave of height 1 where nodes are taken to be at rest: rounding cannot distinguish it from 0.
const NOTHING: f64 = 1e-20;

/// Rows and columns ahead of the wave front that the mixed-derivative correction moves.
const CORNER_MARGIN: usize = 24;

/// Rows ahead of the wave front that move.
///
/// * `reach`: rows around a node that its next level depends on
pub fn rows_ahead(reach: usize) -> usize {
    if reach > 1 { CORNER_MARGIN } else { 0 }
}

/// How far the light cone is at its level.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct ConeState {
    /// Columns that the scheme has reached.
    reached: usize,
    /// Column of the wave front.
    front: f64,
    /// Columns ahead of it that are not at rest.
    margin: usize,
}

/// More than the margin ahead of a front ever is: it grows as the cube root of time.
const WIDEST_MARGIN: usize = 1 << 24;

/// The light cone of a surface load, level by level.
#[derive(Clone, Debug)]
pub struct LightCone {
    coverage: Coverage,
    /// Radial Courant number.
    courant: f64,
    /// Rows and columns that the scheme passes on per step, 2 with the mixed-derivative correction.
    reach: usize,
    /// Number of rows that move, by depth, and of columns.
    nz: usize,
    nr: usize,
    state: ConeState,
    /// Pairs of κ and growth per step of waves along r with cells, see [`damped_growth`]; none without.
    growth: Vec<[f64; 2]>,
}

impl LightCone {
    /// A target at rest at level 0.
    ///
    /// * `courant`: radial Courant number λ = c_sΔt/Δr, at most 1
    /// * `reach`: rows and columns that the scheme passes on per step
    /// * `nz`, `nr`: number of rows that move, by depth, and of columns
    pub fn new(coverage: Coverage, courant: f64, reach: usize, nz: usize, nr: usize) -> Self {
        Self { coverage, courant, reach, nz, nr, state: ConeState::default(), growth: Vec::new() }
    }

    /// A target of the scheme of cells at rest at level 0: the scheme passes on one row and four columns per step.
    ///
    /// * `courant`: c, at most 1
    /// * `damping`: lateral damping σ
    /// * `rows`, `nr`: number of rows, of columns
    pub fn damped(coverage: Coverage, courant: f64, damping: f64, rows: usize, nr: usize) -> Self {
        let kappas = (0..GROWTHS).map(|n| LARGEST_KAPPA * libm::pow(0.9, n as f64));
        let growth = kappas.map(|kappa| [kappa, damped_growth(courant, damping, kappa)]);
        Self { growth: growth.collect(), ..Self::new(coverage, courant, 1, rows, nr) }
    }

    /// Continues to `level`, the next one, `loaded` columns of the surface being loaded on the way.
    pub fn advance(&mut self, level: usize, loaded: usize) {
        self.state.front = (self.state.front + self.courant).max(loaded as f64);
        self.state.margin = self.margin(level, self.state.margin);
        let seen = libm::ceil(self.state.front) as usize + self.state.margin.max(self.corner_margin());
        self.state.reached = (self.state.reached + self.lateral_reach()).min(seen).max(loaded).min(self.nr);
    }

    /// Columns ahead of a front that are not at rest after some steps; with cells by the best of the bounds that have been computed.
    ///
    /// * `least`: as many at least
    fn margin(&self, steps: usize, least: usize) -> usize {
        let (t, enough) = (steps as f64, -libm::log(NOTHING));
        if self.growth.is_empty() {
            let is_nothing = |margin: &usize| decay(self.courant, t, *margin as f64) >= enough;
            return (least..).find(is_nothing).unwrap_or(usize::MAX);
        }
        // where κ·(ct + margin) − Ωt is enough
        let farthest = |[kappa, growth]: &[f64; 2]| (growth * t + enough) / kappa - self.courant * t;
        let margin = self.growth.iter().map(farthest).fold(f64::INFINITY, f64::min);
        least.max(libm::ceil(margin).max(0.0) as usize)
    }

    /// Columns that the scheme passes on per step.
    fn lateral_reach(&self) -> usize {
        if self.growth.is_empty() { self.reach } else { 4 }
    }

    /// How far the cone is.
    pub fn state(&self) -> ConeState {
        self.state
    }

    /// Puts the cone to where another one of this target stood at `level`.
    ///
    /// # Errors
    ///
    /// No cone of this target is there at that level.
    pub fn set(&mut self, level: usize, state: ConeState) -> Result<(), StateError> {
        let ConeState { reached, front, margin } = state;
        StateError::unless(reached <= self.nr, "number of columns reached", reached)?;
        StateError::unless((0.0..=(self.nr + level) as f64).contains(&front), "wave front", front)?;
        StateError::unless(margin <= WIDEST_MARGIN, "margin of the wave front", margin)?;
        self.state = state;
        Ok(())
    }

    fn corner_margin(&self) -> usize {
        rows_ahead(self.reach)
    }

    /// Number of columns that have moved, never fewer than at a level before.
    pub fn active_columns(&self) -> usize {
        if self.coverage == Coverage::Everything { self.nr } else { self.state.reached }
    }

    /// Number of columns of the surface that may be moved on the way to the next level, and by nothing but what has moved already.
    pub fn next_columns(&self) -> usize {
        (self.active_columns() + self.lateral_reach()).min(self.nr)
    }

    /// Rows that a part of them depends on at `level`.
    pub fn needed(&self, level: usize, part: Dependence) -> usize {
        part.depths_at(level, self.reach)
    }

    /// What is to be computed of `level`, the one the cone stands at.
    pub fn active(&self, level: usize) -> ActiveRegion {
        let moved = (self.reach * level).min(level + self.corner_margin());
        let rows = match self.coverage {
            Coverage::Field => moved,
            Coverage::Rows(rows) => moved.min(self.needed(level, rows)),
            Coverage::Everything => self.nz,
        };
        ActiveRegion { rows: rows.min(self.nz), columns: self.active_columns().next_multiple_of(BLOCK) }
    }
}

/// Number and largest of the κ for which growth under lateral damping is computed, each nine tenths of the one before.
const GROWTHS: u32 = 80;
const LARGEST_KAPPA: f64 = 3.0;

/// Growth Ω per step of waves `exp((κ + iq)x)` along r with cells, the largest over all q: `e^Ω` is the larger root w, by magnitude, of
///
/// ```text
/// w² − (2 − 4c²y − D)·w + 1 − D = 0,   y = sin²((q + iκ)/2),   D = 4σ(y(1 − y))²
/// ```
///
/// Without damping it is that of q = 0; with it short waves, as an edge starts them, run ahead of the long ones.
fn damped_growth(courant: f64, damping: f64, kappa: f64) -> f64 {
    const SAMPLES: u32 = 64;
    let (grow, turn) = (libm::cosh(kappa), libm::sinh(kappa));
    let size = |sample: u32| {
        let q = PI * f64::from(sample) / f64::from(SAMPLES);
        let y = [0.5 * (1.0 - libm::cos(q) * grow), 0.5 * libm::sin(q) * turn];
        let once = times(y, [1.0 - y[0], -y[1]]);
        let damped = times(once, once).map(|part| 4.0 * damping * part);
        let half = [
            1.0 - 2.0 * courant * courant * y[0] - 0.5 * damped[0],
            -2.0 * courant * courant * y[1] - 0.5 * damped[1],
        ];
        let square = times(half, half);
        let root = root([square[0] - 1.0 + damped[0], square[1] + damped[1]]);
        let size = |sign: f64| libm::hypot(half[0] + sign * root[0], half[1] + sign * root[1]);
        size(1.0).max(size(-1.0))
    };
    libm::log((0..=SAMPLES).map(size).fold(0.0, f64::max))
}

/// Product of complex numbers.
fn times([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a * c - b * d, a * d + b * c]
}

/// A square root of a complex number.
fn root([a, b]: [f64; 2]) -> [f64; 2] {
    let size = libm::hypot(a, b);
    [libm::sqrt((0.5 * (size + a)).max(0.0)), libm::copysign(libm::sqrt((0.5 * (size - a)).max(0.0)), b)]
}

/// How far a wave has fallen off `ahead` nodes ahead of its front after t steps: the logarithm of what is left, with the
/// sign changed. Beyond the cone of the scheme nothing is left at all.
///
/// ```text
/// max over κ of  κ·(λt + ahead) − Ω(κ)·t
/// ```
fn decay(courant: f64, t: f64, ahead: f64) -> f64 {
    let v = courant + ahead / t;
    if v >= 1.0 {
        return f64::INFINITY;
    }
    if ahead <= 0.0 || courant == 0.0 {
        return 0.0;
    }
    // cosh²(κ/2)
    let squared = v * v * (1.0 - courant * courant) / (courant * courant * (1.0 - v * v));
    let kappa = 2.0 * libm::acosh(libm::sqrt(squared.max(1.0)));
    let omega = 2.0 * libm::asinh(courant * libm::sqrt((squared - 1.0).max(0.0)));
    kappa * v * t - omega * t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_margin_is_the_best_of_the_bounds() {
        for (courant, t, ahead) in
            [(0.5, 6000.0, 40.0), (0.5, 100.0, 9.0), (0.93, 800.0, 6.0), (0.05, 50.0, 3.0)]
        {
            let bound = |kappa: f64| {
                kappa * (courant * t + ahead) - 2.0 * (courant * (kappa / 2.0).sinh()).asinh() * t
            };
            let best = (1..200_000).map(|k| bound(k as f64 * 1e-4)).fold(0.0, f64::max);
            let here = decay(courant, t, ahead);
            assert!((here - best).abs() < 1e-5 * best, "λ = {courant}, t = {t}: {here} {best}");
        }
    }

    #[test]
    fn the_margin_grows_as_the_cube_root_of_time() {
        let mut cone = LightCone::new(Coverage::Field, 0.5, 1, 1000, 100_000);
        let mut margins = Vec::new();
        for step in 1..=8000 {
            cone.advance(step, 10);
            if [1000, 8000].contains(&step) {
                margins.push(cone.state.margin as f64);
            }
        }
        assert!((margins[1] / margins[0] - 2.0).abs() < 0.1, "{margins:?}");
    }

    #[test]
    fn without_dispersion_the_cone_is_that_of_the_scheme() {
        let mut cone = LightCone::new(Coverage::Field, 1.0, 1, 50, 400);
        for step in 1..=300 {
            cone.advance(step, 20);
            assert_eq!(cone.active_columns(), 20 + step - 1);
            assert_eq!(cone.active(step).rows, step.min(50));
        }
    }

    #[test]
    fn the_surface_depends_on_less_and_less_of_the_depth() {
        for reach in [1, 2] {
            let part = Dependence { last_step: 99, depths: 3 };
            let mut cone = LightCone::new(Coverage::Rows(part), 1.0, reach, 500, 400);
            let rows: Vec<usize> = (1..=100)
                .map(|level| {
                    cone.advance(level, 20);
                    cone.active(level).rows
                })
                .collect();
            assert_eq!(rows[..20], (1..=20).map(|level| reach * level).collect::<Vec<_>>());
            assert_eq!(rows[98..], [3 + reach, 3]);
            let deepest = rows.iter().max().expect("levels");
            assert!((*deepest..deepest + 4).contains(&part.deepest(reach)), "{deepest}");
        }
    }

    #[test]
    fn damped_short_waves_run_farther_ahead_than_long_ones() {
        for (courant, kappa) in [(0.8, 0.5), (1.0, 1.5)] {
            let [plain, damped] = [0.0, 0.5].map(|damping| damped_growth(courant, damping, kappa));
            let bound = 2.0 * libm::asinh(courant * libm::sinh(0.5 * kappa));
            assert!((plain - bound).abs() < 1e-12, "without damping they are the same: {plain} {bound}");
            assert!(damped > plain);
        }
        let [re, im] = root([-3.0, 4.0]);
        assert_eq!(times([re, im], [re, im]), [-3.0, 4.0]);
    }
}
