//! The closed form that answers a case, shown step by step as a computed run is shown.

use std::{fmt, sync::Arc};

use rayon::prelude::*;

use super::{
    elastic_paraboloid::ElasticParaboloid,
    plane_punch::PlanePunch,
    spreading::{Front, Spreading},
};
use crate::{
    case::{Case, HeadKind},
    contact::Rule,
    grid::{Geometry, MeshKind},
    model::ModelKind,
    view::{Interface, StressAt, View},
};

/// Why no closed form answers a case.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("no closed form answers this case: {reason}")]
pub struct NoAnswer {
    reason: String,
}

fn none<T>(reason: impl Into<String>) -> Result<T, NoAnswer> {
    Err(NoAnswer { reason: reason.into() })
}

/// Share of a spacing that may be rounding.
const SLIVER: f64 = 1e-9;

/// The closed forms that answer cases.
#[derive(Clone, Debug)]
enum Form {
    /// The whole surface under a spreading contact, until the wave of its edge arrives.
    Spreading(Spreading),
    /// A plane flat punch.
    PlanePunch(PlanePunch),
    /// Full theory, on the axis.
    ElasticParaboloid(ElasticParaboloid),
}

/// The answer of a closed form to a case.
#[derive(Clone, Debug)]
pub struct Answer {
    form: Form,
    /// How the contact spreads.
    front: Front,
    rule: Rule,
    velocity: f64,
    shear_wave_speed: f64,
    thickness: Option<f64>,
    /// Radius out to which the contact is that of the unbounded shape, faster than the waves if it is unilateral \[R\].
    edge: f64,
    punch_radius: f64,
    /// Nodes take means over their surroundings while they are being met.
    takes_means: bool,
    r0: f64,
    dr: f64,
    dt: f64,
    steps: u64,
    /// The step worked out.
    step: u64,
    time: f64,
    pressure: Arc<[f64]>,
    drag: f64,
}

impl Answer {
    /// Finds the closed form for `case`.
    ///
    /// # Errors
    ///
    /// There is none, and why.
    pub fn to(case: &Case) -> Result<Self, NoAnswer> {
        if case.indenter.mass.is_finite() {
            return none("it needs an indenter of infinite mass (indenter.mass = inf)");
        }
        let rule = case.impact.contact;
        let c_s = case.target.material.shear_wave_speed;
        let velocity = case.impact.velocity;
        let thickness = case.target.thickness;
        let punch_radius = case.indenter.radius.unwrap_or(f64::INFINITY);
        let unfit = |error: super::ExactError| NoAnswer { reason: error.to_string() };
        let mut edge = punch_radius;
        let front = match case.indenter.head {
            HeadKind::Flat => Front::Flat,
            HeadKind::Paraboloid { curvature } => Front::Paraboloid { curvature },
            HeadKind::Cone { spread_rate } => Front::Cone { spread_rate },
            HeadKind::Profile { .. } => return none("it needs a flat face, a paraboloid or a cone"),
        };
        let form = match (case.model, case.geometry, front) {
            (ModelKind::Elastic, Geometry::Axisymmetric, Front::Paraboloid { curvature })
                if rule == Rule::Prescribed && punch_radius.is_infinite() =>
            {
                let form = ElasticParaboloid::new(velocity, curvature, (1.0, c_s), thickness);
                Form::ElasticParaboloid(form.map_err(unfit)?)
            }
            (ModelKind::Elastic, ..) => {
                return none(
                    "model \"elastic\" has one for an unbounded axisymmetric paraboloid with contact = \"prescribed\"",
                );
            }
            (ModelKind::Rakhmatulin, Geometry::Plane, Front::Flat) if rule != Rule::Prescribed => {
                if punch_radius != 1.0 {
                    return none("the plane flat punch has one for indenter.radius = 1");
                }
                let depth = thickness.unwrap_or(f64::INFINITY);
                Form::PlanePunch(PlanePunch::new(velocity, c_s, depth).map_err(unfit)?)
            }
            (ModelKind::Rakhmatulin, Geometry::Plane, _) => {
                return none("in the plane only the flat punch (unilateral or bilateral) has one");
            }
            (ModelKind::Rakhmatulin, Geometry::Axisymmetric, front) => {
                if rule != Rule::Prescribed {
                    edge = edge.min(front.sonic_radius(c_s));
                }
                if edge == 0.0 {
                    return none(
                        "the contact of this cone is slower than the waves: contact = \"prescribed\" has one",
                    );
                }
                Form::Spreading(Spreading::new(front, velocity, c_s, thickness).map_err(unfit)?)
            }
        };
        let grid = case.grid();
        Ok(Self {
            form,
            front,
            rule,
            velocity,
            shear_wave_speed: c_s,
            thickness,
            edge,
            punch_radius,
            takes_means: case.mesh.kind == MeshKind::Matched && front != Front::Flat,
            r0: grid.r0,
            dr: grid.dr,
            dt: grid.dt(),
            steps: case.sizes.steps,
            step: 0,
            time: 0.0,
            pressure: Arc::default(),
            drag: f64::NAN,
        })
    }

    /// Name of the closed form: that of its module.
    pub fn name(&self) -> &'static str {
        match self.form {
            Form::Spreading(_) => "spreading",
            Form::PlanePunch(_) => "plane_punch",
            Form::ElasticParaboloid(_) => "elastic_paraboloid",
        }
    }

    /// Time up to which the closed form knows something, infinite if it always does \[R/c_p\].
    pub fn end_time(&self) -> f64 {
        match &self.form {
            Form::Spreading(_) => self.front.arrival(self.edge) + self.edge / self.shear_wave_speed,
            Form::PlanePunch(_) => {
                let meeting = 2.0 / self.shear_wave_speed;
                self.thickness.map_or(meeting, |h| meeting.min(2.0 * h))
            }
            Form::ElasticParaboloid(_) => f64::INFINITY,
        }
    }

    /// True if the drag is known as long as the pressure is.
    pub fn knows_drag(&self) -> bool {
        match &self.form {
            Form::Spreading(_) => self.front != Front::Flat && self.edge.is_infinite(),
            Form::PlanePunch(_) => true,
            Form::ElasticParaboloid(_) => false,
        }
    }

    /// Number of the last step of the case that the closed form can show.
    pub fn last_step(&self) -> u64 {
        let steps = (self.end_time() / self.dt * (1.0 + 1e-12)).ceil() - 1.0;
        if steps < self.steps as f64 { steps.max(0.0) as u64 } else { self.steps }
    }

    /// Works out step `step`, with the threads of the pool it is called in.
    pub fn go_to(&mut self, step: u64) {
        self.step = step;
        self.time = step as f64 * self.dt;
        let nodes = self.reached();
        let pressure: Vec<f64> = (0..nodes).into_par_iter().map(|i| self.stress_at(self.radius(i))).collect();
        self.pressure = pressure.into();
        self.drag = self.drag_at(self.time);
    }

    /// Drag at any time \[πR²γc_p²; plane Rγc_p²\]; not a number where it is not known.
    pub fn drag_at(&self, time: f64) -> f64 {
        let drag = match &self.form {
            _ if !self.knows_drag() => return f64::NAN,
            // like the pressure, half of the jump that begins the impact
            Form::PlanePunch(_) if time == 0.0 => Ok(0.5 * self.velocity),
            Form::PlanePunch(form) => form.drag(time),
            Form::Spreading(form) => form.drag(time),
            Form::ElasticParaboloid(_) => return f64::NAN,
        };
        drag.unwrap_or(f64::NAN)
    }

    /// Interface stress at radius `r` at any time \[γc_p²\]; not a number where it is not known.
    pub fn pressure_at(&self, r: f64, time: f64) -> f64 {
        if r > self.punch_radius || r > self.contact_radius(time) {
            // ahead of the contact: zero if the contact is faster than waves, and what a probe shows there anyway
            return 0.0;
        }
        let value = match &self.form {
            Form::PlanePunch(_) if time == 0.0 => return 0.5 * self.velocity,
            Form::PlanePunch(form) => form.pressure(r, time),
            Form::ElasticParaboloid(_) if r > 0.0 => return f64::NAN,
            Form::ElasticParaboloid(form) => form.axis_pressure(0.0, time),
            Form::Spreading(_) if r > self.known_radius(time) => return f64::NAN,
            Form::Spreading(form) => form.pressure(r, 0.0, time),
        };
        value.unwrap_or(f64::NAN)
    }

    /// The step last worked out.
    pub fn view(&self) -> View<'_> {
        View {
            step: self.step,
            time: self.time,
            interface: Interface {
                r0: self.r0_shown(),
                dr: self.dr,
                pressure: Arc::clone(&self.pressure),
                punch_radius: self.punch_radius,
                complete: false,
                exact: Some(self),
            },
            drag: self.drag,
            contact_radius: self.contact_radius(self.time),
            velocity: self.velocity,
            depth: self.velocity * self.time,
            events: Arc::default(),
            frame: None,
        }
    }

    /// Radius of the first node shown: the axis, if the form knows nothing else.
    fn r0_shown(&self) -> f64 {
        if matches!(self.form, Form::ElasticParaboloid(_)) { 0.0 } else { self.r0 }
    }

    fn radius(&self, i: usize) -> f64 {
        self.r0_shown() + i as f64 * self.dr
    }

    /// Contact radius if the surface does not give way ahead of the contact \[R\].
    fn contact_radius(&self, t: f64) -> f64 {
        self.front.radius(t).min(self.punch_radius)
    }

    /// Number of nodes a run has had in contact after this step. A node that takes a mean is met one step and one
    /// spacing ahead of the contact.
    fn reached(&self) -> usize {
        if matches!(self.form, Form::ElasticParaboloid(_)) {
            return 1;
        }
        let struck = self.nodes_within(self.contact_radius(self.time + self.dt));
        let met = if self.takes_means {
            self.nodes_within(self.contact_radius(self.time + 2.0 * self.dt) + self.dr)
        } else {
            struck
        };
        if self.rule == Rule::Prescribed {
            return met;
        }
        // where the punch ends in the surroundings of a node, the node counts for itself
        let wholly = self.nodes_within(self.punch_radius - self.dr + 2.0 * SLIVER * self.dr);
        let on_punch = self.nodes_within(self.punch_radius * (1.0 + SLIVER));
        met.min(wholly).max(struck.min(on_punch))
    }

    /// Number of nodes inside a radius.
    fn nodes_within(&self, radius: f64) -> usize {
        // an infinite radius saturates
        ((radius - self.r0) / self.dr - SLIVER).ceil().max(0.0) as usize
    }

    /// Radius beyond which the wave of the edge has changed the pressure \[R\].
    fn known_radius(&self, time: f64) -> f64 {
        match &self.form {
            Form::Spreading(_) if self.edge.is_finite() => {
                let since = time - self.front.arrival(self.edge);
                self.edge - self.shear_wave_speed * since.max(0.0)
            }
            _ => f64::INFINITY,
        }
    }
}

impl StressAt for Answer {
    fn stress_at(&self, r: f64) -> f64 {
        self.pressure_at(r, self.time)
    }
}

impl fmt::Display for Answer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match &self.form {
            Form::Spreading(_) if self.front == Front::Flat => {
                "plane wave, until the wave of the edge arrives"
            }
            Form::Spreading(_) if self.edge.is_finite() => {
                "pressure under a spreading contact, until the wave of its edge arrives"
            }
            Form::Spreading(_) => "pressure and drag under a spreading contact",
            Form::PlanePunch(_) => "pressure and drag of a plane flat punch",
            Form::ElasticParaboloid(_) => "[KA] Eq. 16: pressure on the axis, full theory",
        };
        write!(f, "{what}")?;
        let end = self.end_time();
        if end.is_finite() { write!(f, "; t < {end:.4}") } else { Ok(()) }
    }
}
