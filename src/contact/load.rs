//! A load that is given, in place of an indenter: a force over time, spread over a disc.
//!
//! ```text
//! p_i^k = F(t_k)·s_i/a_i        Σ s_i = 1
//! ```
//!
//! with the shares s_i of the force on the cells of the nodes, by the integral of the pressure over each, and their areas a_i: the force on the
//! surface is F to rounding on any mesh.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::ContactState;
use crate::{geometry::Geometry, grid::Grid, surface::Surface};

/// How the pressure is spread over the disc, of radius a; in the plane over a strip.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// The same everywhere.
    Uniform,
    /// As under a ball, `p ~ √(1 − r²/a²)`.
    Hertz,
}

/// Forms of a pulse of peak F and duration T.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pulse {
    /// `F·sin^{3/2}(πt/T)`, nearly that of a ball in the theory of Hertz.
    Hertz,
    /// `(F/2)(1 − cos 2πt/T)`.
    Cosine,
    /// `F(1 − 2s²)e^{−s²}` with `s = π·(3/T)(t − T/2)`: of Ricker, its middle frequency 3/T.
    Ricker,
    /// F for good, after a rise like half a cosine of duration T.
    Step,
}

/// Share of the largest force of points from which on a force is notable.
const NOTABLE: f64 = 0.001;

/// The force over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Force {
    /// A pulse.
    Pulse {
        /// Its form.
        form: Pulse,
        /// F \[πR²γc_p²; plane Rγc_p²\].
        peak: f64,
        /// T \[R/c_p\].
        duration: f64,
    },
    /// Pairs of time and force, linear between them and 0 beside them.
    Points(Vec<[f64; 2]>),
}

impl Force {
    /// The force at a time \[πR²γc_p²; plane Rγc_p²\].
    pub fn at(&self, time: f64) -> f64 {
        match self {
            Self::Pulse { form, peak, duration } => peak * form.at(time, *duration),
            Self::Points(points) => {
                let after = points.partition_point(|[t, _]| *t < time);
                match (after.checked_sub(1).and_then(|before| points.get(before)), points.get(after)) {
                    (Some([t0, f0]), Some([t1, f1])) => f0 + (f1 - f0) * (time - t0) / (t1 - t0),
                    (None, Some([t, f])) if *t == time => *f,
                    _ => 0.0,
                }
            }
        }
    }

    /// Largest force by magnitude \[πR²γc_p²; plane Rγc_p²\].
    pub fn largest(&self) -> f64 {
        match self {
            Self::Pulse { peak, .. } => peak.abs(),
            Self::Points(points) => points.iter().map(|[_, force]| force.abs()).fold(0.0, f64::max),
        }
    }

    /// Time that it lasts, or in which it rises for good; of points that from before the first notable force until after the last \[R/c_p\].
    pub fn duration(&self) -> f64 {
        match self {
            Self::Pulse { duration, .. } => *duration,
            Self::Points(points) => {
                let largest = self.largest();
                let is_notable = |[_, force]: &[f64; 2]| force.abs() > NOTABLE * largest;
                let ends = points.iter().position(is_notable).zip(points.iter().rposition(is_notable));
                // the force is linear between points
                let time = |i: usize| points[i.min(points.len() - 1)][0];
                ends.map_or(0.0, |(first, last)| time(last + 1) - time(first.saturating_sub(1)))
            }
        }
    }
}

impl Pulse {
    /// F(t)/F.
    fn at(self, time: f64, duration: f64) -> f64 {
        let phase = time / duration;
        let is_during = (0.0..1.0).contains(&phase);
        match self {
            Self::Hertz | Self::Cosine | Self::Ricker if !is_during => 0.0,
            Self::Hertz => libm::pow(libm::sin(PI * phase), 1.5),
            Self::Cosine => 0.5 * (1.0 - libm::cos(2.0 * PI * phase)),
            Self::Ricker => {
                let s = 3.0 * PI * (phase - 0.5);
                (1.0 - 2.0 * s * s) * libm::exp(-s * s)
            }
            // a jump has half its height in the first step
            Self::Step if time == 0.0 && duration == 0.0 => 0.5,
            Self::Step if is_during => 0.5 * (1.0 - libm::cos(PI * phase)),
            Self::Step => 1.0,
        }
    }
}

/// A load on the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Load {
    /// Radius a of the disc; without one the force is on the cell of the innermost node \[R\].
    pub radius: Option<f64>,
    /// How the pressure is spread.
    pub distribution: Distribution,
    /// The force over time.
    pub force: Force,
}

impl Load {
    /// Shares of the force on the cells of the nodes, as far as the disc reaches, shape `(zone,)`.
    pub fn shares(&self, grid: &Grid) -> Vec<f64> {
        let Some(radius) = self.radius else { return vec![1.0] };
        // 2∫r dr over the cells that are inside is the square of their outer radius; in the plane ∫dx
        let ends = grid.area.iter().scan(0.0, |sum, area| {
            *sum += area;
            Some(match grid.geometry {
                Geometry::Axisymmetric => sum.sqrt(),
                Geometry::Plane => *sum,
            })
        });
        let inside = ends.map(|r| self.distribution.inside(grid.geometry, (r / radius).min(1.0)));
        let mut shares = Vec::new();
        let mut before = 0.0;
        for share in inside {
            shares.push(share - before);
            before = share;
            if share >= 1.0 {
                break;
            }
        }
        let sum: f64 = shares.iter().sum();
        shares.iter_mut().for_each(|share| *share /= sum);
        shares
    }
}

impl Distribution {
    /// Share of the force within a radius \[a\].
    ///
    /// ```text
    /// uniform: r²         Hertz: 1 − (1 − r²)^{3/2}         plane: x and (2/π)(x√(1 − x²) + arcsin x)
    /// ```
    fn inside(self, geometry: Geometry, r: f64) -> f64 {
        match (self, geometry) {
            (Self::Uniform, Geometry::Axisymmetric) => r * r,
            (Self::Uniform, Geometry::Plane) => r,
            (Self::Hertz, Geometry::Axisymmetric) => 1.0 - libm::pow(1.0 - r * r, 1.5),
            (Self::Hertz, Geometry::Plane) => 2.0 / PI * (r * (1.0 - r * r).sqrt() + libm::asin(r)),
        }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Loaded {
    force: Force,
    /// Shares of the force on the cells of the nodes.
    shares: Vec<f64>,
    /// Radius of what is loaded \[R\].
    radius: f64,
    /// Mean displacements of what is loaded, weighted by the pressure, at levels k−1 and k \[R\].
    pub motion: [f64; 2],
    dt: f64,
}

impl Loaded {
    pub fn new(load: &Load, grid: &Grid) -> Self {
        let radius = load.radius.unwrap_or(0.5 * grid.width(0));
        Self { force: load.force.clone(), shares: load.shares(grid), radius, motion: [0.0; 2], dt: grid.dt() }
    }

    pub fn nodes(&self) -> usize {
        self.shares.len()
    }

    /// A step: the surface under the pressure of a time, and with `u_k = Σ s_i u_i^k` the work `½F(u_{k+1} − u_{k−1})`.
    pub fn step(&mut self, surface: &mut Surface, area: &[f64], time: f64) -> ContactState {
        let force = self.force.at(time);
        surface.displacement.copy_from_slice(&surface.free);
        let mut next = 0.0;
        for (i, share) in self.shares.iter().enumerate() {
            surface.pressure[i] = force * share / area[i];
            surface.displacement[i] += surface.compliance[i] * surface.pressure[i];
            next += share * surface.displacement[i];
        }
        surface.loaded = self.shares.len();
        let [before, now] = self.motion;
        self.motion = [now, next];
        ContactState {
            drag: force,
            contact_radius: if force == 0.0 { 0.0 } else { self.radius },
            velocity: (next - before) / (2.0 * self.dt),
            depth: now,
            work: 0.5 * force * (next - before),
            nodes: if force == 0.0 { 0 } else { self.shares.len() },
            ..ContactState::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{MeshKind, Spacing};

    #[test]
    fn all_of_the_force_is_on_the_nodes() {
        let spacing = Spacing { dr: 0.1, dz: 0.1, layer_rows: Some(10) };
        for geometry in [Geometry::Axisymmetric, Geometry::Plane] {
            let grid = Grid::new(geometry, MeshKind::Matched, spacing, 20, 10);
            for distribution in [Distribution::Uniform, Distribution::Hertz] {
                for radius in [0.02, 0.1, 0.55, 1.0] {
                    let load = Load { radius: Some(radius), distribution, force: Force::Points(Vec::new()) };
                    let shares = load.shares(&grid);
                    assert_eq!(shares.len(), (radius / 0.1f64 - 1e-9).ceil().max(1.0) as usize, "{radius}");
                    assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn points_last_as_long_as_their_lines() {
        let duration = |points: &[[f64; 2]]| Force::Points(points.to_vec()).duration();
        assert_eq!(duration(&[[0.0, 0.0], [2.0, 30.0], [4.0, 0.0]]), 4.0);
        assert_eq!(duration(&[[0.0, 0.0], [10.0, 0.0], [12.0, 30.0], [14.0, 0.0], [90.0, 0.0]]), 4.0);
        assert_eq!(duration(&[[0.0, 5.0], [1.0, 5.0]]), 1.0);
        assert_eq!(duration(&[]), 0.0);
    }

    #[test]
    fn pulses_have_their_impulse() {
        let sum = |force: Force, end: f64| -> f64 {
            (0..10_000).map(|k| force.at((f64::from(k) + 0.5) * 1e-4 * end) * 1e-4 * end).sum()
        };
        let pulse = |form, duration| Force::Pulse { form, peak: 2.0, duration };
        // over half a period ∫sin^{3/2} = √π·Γ(5/4)/Γ(7/4)
        assert!((sum(pulse(Pulse::Hertz, 3.0), 3.0) / (6.0 * 1.748_038_369_5 / PI) - 1.0).abs() < 1e-6);
        assert!((sum(pulse(Pulse::Cosine, 3.0), 3.0) - 3.0).abs() < 1e-9);
        assert!(sum(pulse(Pulse::Ricker, 3.0), 3.0).abs() < 1e-6);
        assert!((sum(pulse(Pulse::Step, 2.0), 6.0) - 2.0 * (6.0 - 1.0)).abs() < 1e-3);
        let points = Force::Points(vec![[1.0, 1.0], [2.0, 4.0], [4.0, 1.0], [9.0, 0.0]]);
        assert!((sum(points.clone(), 9.0) - 10.0).abs() < 2e-3);
        assert_eq!(
            [0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 4.5].map(|t| points.at(t)),
            [0.0, 1.0, 2.5, 4.0, 2.5, 1.0, 0.9]
        );
        assert_eq!((points.largest(), points.duration()), (4.0, 8.0));
    }
}
