//! A step, computed or exact, as observers see it.
//!
//! A [`View`] is read only: observers hold it by reference, and its large parts are shared and immutable. So recording
//! cannot change a number, and an observer on another thread keeps a view without a copy ([`View::share`]).

use std::sync::Arc;

pub use crate::contact::event::{Event, EventKind};
use crate::{
    grid::place,
    model::{self, GaugeValues, TargetEnergy},
};

/// One step k of a simulation or of a closed form.
#[derive(Clone, Default)]
pub struct View<'a> {
    /// Number k of the step.
    pub step: u64,
    /// Time t = kΔt \[R/c_p\].
    pub time: f64,
    /// True if the run ends with this step: all are done, or the case stops it here.
    pub is_last: bool,
    /// The interface.
    pub interface: Interface<'a>,
    /// Drag F^k \[πR²γc_p²; plane Rγc_p²\].
    pub drag: f64,
    /// Contact radius r* \[R\].
    pub contact_radius: f64,
    /// Velocity V^k of the indenter \[c_p\].
    pub velocity: f64,
    /// Displacement w^k of the indenter \[R\].
    pub depth: f64,
    /// Motion of the ends of an indenter that gives, whose centre of mass the velocity and displacement above are of.
    pub striker: Option<StrikerMotion>,
    /// Events of this step.
    pub events: Arc<[Event]>,
    /// Fields and energy, on steps that are frames.
    pub frame: Option<Frame>,
    /// Points and lines in the target, where a computed case records any.
    pub gauges: Option<Arc<GaugeValues>>,
}

/// Motion of an indenter that gives, on the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrikerMotion {
    /// Velocity of the nose into the target \[c_p\].
    pub nose: f64,
    /// Velocity of the rear \[c_p\].
    pub rear: f64,
}

/// Interface stress at the nodes of the surface.
#[derive(Clone, Debug, Default)]
pub struct Interface<'a> {
    /// Radius of node 0 \[R\].
    pub r0: f64,
    /// Distance of nodes, on a graded mesh of the first two \[R\].
    pub dr: f64,
    /// Radii of all nodes of a graded mesh \[R\].
    pub radii: Option<Arc<[f64]>>,
    /// Pressure p_i^k out to the outermost node ever in contact, shape `(reached,)` \[γc_p²\].
    pub pressure: Arc<[f64]>,
    /// Radius of the punch \[R\], infinite if unbounded.
    pub punch_radius: f64,
    /// True once the outermost node that fits on the punch has been in contact.
    pub complete: bool,
    /// A closed form, which has the stress between nodes too; `None` for a computed step.
    pub exact: Option<&'a dyn StressAt>,
}

/// Interface stress at any radius.
pub trait StressAt: std::fmt::Debug + Sync {
    /// Interface stress at radius `r` in this step \[γc_p²\]; NaN where it is not known.
    fn stress_at(&self, r: f64) -> f64;
}

/// Fields and energy of a frame.
#[derive(Clone)]
pub struct Frame {
    /// Energy ledger at level k.
    pub energy: Energy,
    /// The fields.
    pub fields: Arc<model::Frame>,
    /// Displacement into the target of the face of an indenter that gives, shape `(columns,)` \[R\].
    pub face: Option<Arc<[f64]>>,
}

/// Energy ledger: `initial + work = kinetic + strain + indenter + dissipated + damped + residual` \[πR³γc_p²; plane
/// R²γc_p²\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Energy {
    /// Kinetic energy of the target.
    pub kinetic: f64,
    /// Strain energy of the target.
    pub strain: f64,
    /// Kinetic energy of an indenter of finite mass; all of the energy of one that gives.
    pub indenter: f64,
    /// The parts of that; of a half-space they are those of its motion beside V0.
    pub striker: Option<TargetEnergy>,
    /// Energy dissipated so far by the impact of surface nodes on the indenter.
    pub dissipated: f64,
    /// Energy taken out so far by the damping of waves that the mesh does not resolve.
    pub damped: f64,
    /// Work done so far by a prescribed motion.
    pub work: f64,
    /// Rounding; none where waves are damped, as `damped` is then what is missing.
    pub residual: Option<f64>,
}

impl Energy {
    /// True if the target has more energy, kinetic alone or with strain, than was brought in, by more than a hundredth: then the numerics
    /// are unstable, even where nothing is left over.
    pub fn exceeds(&self) -> bool {
        // strain is of staggered levels: a little below 0 at times where it is small
        self.indenter + self.dissipated + self.damped + self.strain.min(0.0) < -0.01 * self.kinetic
    }
}

impl View<'_> {
    /// Displacement into the target of the face of the indenter over a node of the surface \[R\]; of one that gives on frames, and the last one that is
    /// known beyond what frames show.
    pub fn face(&self, node: usize) -> f64 {
        let face = self.frame.as_ref().and_then(|frame| frame.face.as_ref());
        face.and_then(|face| face.get(node).or(face.last())).copied().unwrap_or(self.depth)
    }

    /// The same view for an observer that outlives the step, without the closed form.
    pub fn share(&self) -> View<'static> {
        let Interface { r0, dr, ref radii, ref pressure, punch_radius, complete, .. } = self.interface;
        View {
            step: self.step,
            time: self.time,
            is_last: self.is_last,
            interface: Interface {
                r0,
                dr,
                radii: radii.clone(),
                pressure: Arc::clone(pressure),
                punch_radius,
                complete,
                exact: None,
            },
            drag: self.drag,
            contact_radius: self.contact_radius,
            velocity: self.velocity,
            depth: self.depth,
            striker: self.striker,
            events: Arc::clone(&self.events),
            frame: self.frame.clone(),
            gauges: self.gauges.clone(),
        }
    }
}

impl Interface<'_> {
    /// Radius of node `i` \[R\].
    pub fn r(&self, i: usize) -> f64 {
        self.radii.as_ref().map_or_else(|| self.r0 + i as f64 * self.dr, |radii| radii[i])
    }

    /// Place of a radius among the nodes, in distances of them from node 0.
    pub fn place(&self, r: f64) -> f64 {
        self.radii.as_ref().map_or_else(|| (r - self.r0) / self.dr, |radii| place(radii, r))
    }

    /// Interface stress at radius `r` \[γc_p²\].
    ///
    /// Linear between nodes; inside the first node the even parabola through the first two, `(9p_0 − p_1)/8` at
    /// r = 0 on a mesh of cells; between the last node of a punch and its edge the value at that node; 0 outside
    /// the punch and where there has been no contact. A closed form is evaluated at `r`.
    pub fn stress_at(&self, r: f64) -> f64 {
        if let Some(exact) = self.exact {
            return exact.stress_at(r);
        }
        let p = &*self.pressure;
        if p.is_empty() || r > self.punch_radius * (1.0 + 1e-12) {
            return 0.0;
        }
        let last = p.len() - 1;
        let x = self.place(r);
        if x < 0.0 {
            let next = p.get(1).copied().unwrap_or(0.0);
            // p = a + b r² through (r_0, p_0), (r_1, p_1)
            let (r0, r1) = (self.r(0), self.r(1));
            return p[0] + (next - p[0]) * (r * r - r0 * r0) / (r1 * r1 - r0 * r0);
        }
        let i = x as usize;
        if i > last {
            return 0.0;
        }
        let next = match p.get(i + 1) {
            Some(&next) => next,
            None if self.complete => p[i],
            None => 0.0,
        };
        p[i] + (next - p[i]) * (x - i as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interface(pressure: &[f64], complete: bool) -> Interface<'static> {
        let pressure = pressure.into();
        Interface { r0: 0.05, dr: 0.1, radii: None, pressure, punch_radius: 0.475, complete, exact: None }
    }

    #[test]
    fn stress_is_interpolated_between_nodes() {
        let p = [1.0, 2.0, 3.0, 5.0, 9.0];
        let view = interface(&p, true);
        assert!((view.stress_at(0.0) - (9.0 * p[0] - p[1]) / 8.0).abs() < 1e-15);
        assert!((view.stress_at(0.05) - 1.0).abs() < 1e-15);
        assert!((view.stress_at(0.30) - 4.0).abs() < 1e-12);
        assert_eq!(view.stress_at(0.47), 9.0);
        assert_eq!(view.stress_at(0.48), 0.0);
    }

    #[test]
    fn energy_that_nothing_has_brought_in_is_noticed() {
        let sound = Energy { kinetic: 0.7, strain: 0.5, indenter: 0.2, damped: 0.1, ..Energy::default() };
        assert!(!sound.exceeds() && !Energy { strain: -1e-3, damped: 0.0, indenter: 0.0, ..sound }.exceeds());
        // two lattices that drift apart: kinetic energy 6929 where 1.5 came in, and a balance that closes
        assert!(Energy { kinetic: 6929.0, strain: -6927.8, residual: Some(1e-15), ..sound }.exceeds());
        assert!(Energy { damped: -0.4, ..sound }.exceeds());
    }

    #[test]
    fn a_growing_contact_ends_at_the_next_node() {
        let view = interface(&[1.0, 2.0], false);
        assert!((view.stress_at(0.20) - 1.0).abs() < 1e-12);
        assert_eq!(view.stress_at(0.26), 0.0);
        assert_eq!(interface(&[], false).stress_at(0.0), 0.0);
    }
}
