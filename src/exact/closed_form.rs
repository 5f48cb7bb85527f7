//! The closed form for a case, evaluated step by step on the nodes and at the times of a computed run.

use std::fmt;

use rayon::prelude::*;

use super::{
    ExactError,
    elastic_wedge::ElasticWedge,
    hertz::{Hertz, Motion},
    paraboloid::Paraboloid,
    plane_punch::PlanePunch,
    spreading::{Front, Spreading},
    stack::{Stack, StackLayer},
};
use crate::{
    case::{Case, Striker},
    contact::{HALF_WIDTH, Rule},
    geometry::Geometry,
    grid::MeshKind,
    model::ModelKind,
    shape::{Head, Tip},
    units::Unit,
    view::{Interface, StressAt, View},
};

/// Why there is no closed form for a case.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("no closed form covers this case: {reason}")]
pub struct NoClosedForm {
    reason: String,
}

fn none<T>(reason: impl Into<String>) -> Result<T, NoClosedForm> {
    Err(NoClosedForm { reason: reason.into() })
}

/// Share of a spacing that may be rounding.
const SLIVER: f64 = 1e-9;

#[derive(Clone, Debug)]
enum Form {
    /// The whole surface under a spreading contact, until the wave of its edge arrives.
    Spreading(Spreading),
    /// A plane flat punch.
    PlanePunch(PlanePunch),
    /// Full theory, on the axis.
    Paraboloid(Paraboloid),
    /// Full theory, a plane wedge, until the wave of its edge arrives.
    Wedge(ElasticWedge),
    /// Full theory without waves, a ball on a half-space.
    Hertz(Hertz),
}

impl Form {
    /// The form for a case whose contact spreads like `front` out to `edge`.
    fn for_case(case: &Case, front: Front, edge: f64) -> Result<Self, NoClosedForm> {
        use ModelKind::{Elastic, Rakhmatulin};
        let is_prescribed = case.impact.contact == Rule::Prescribed;
        let (velocity, c_s) = (case.impact.velocity, case.target.material.shear_wave_speed);
        let (radius, thickness) = (case.indenter.radius, case.target.thickness);
        let (is_plane, is_simple) = (case.geometry == Geometry::Plane, case.target.is_simple());
        let form = match (case.model, front) {
            (Elastic, _) if !is_simple => Err("on layers and free backs model \"elastic\" has none"),
            (Rakhmatulin, _) if !is_simple && case.impact.contact == Rule::Unilateral => Err(
                "on layers and free backs contact = \"prescribed\" has one, and \"bilateral\" of a flat face: \
                     the pressure might fall to 0",
            ),
            (Rakhmatulin, _) if !is_simple && is_plane && front != Front::Flat => {
                Err("in the plane only the flat face has one on layers and free backs")
            }
            (Rakhmatulin, _) if !is_simple => Ok(stack(case)
                .and_then(|stack| Spreading::on_stack(front, velocity, stack).map(Self::Spreading))),
            (Elastic, Front::Paraboloid { curvature }) if !is_plane && is_prescribed && radius.is_none() => {
                Ok(Paraboloid::new(Elastic, velocity, curvature, c_s, thickness).map(Self::Paraboloid))
            }
            (model, Front::Flat) if is_plane && !is_prescribed && radius == Some(1.0) => {
                Ok(PlanePunch::new(model, velocity, c_s, thickness).map(Self::PlanePunch))
            }
            (Elastic, Front::Cone { spread_rate }) if is_plane && spread_rate > 1.0 => {
                Ok(ElasticWedge::new(velocity, spread_rate, c_s, thickness).map(Self::Wedge))
            }
            (Elastic, _) if is_plane => Err(
                "model \"elastic\" has one in the plane for the flat punch (unilateral or bilateral, indenter.radius = 1) \
                     and for the cone with V0/slope > 1",
            ),
            (Elastic, _) => Err(
                "model \"elastic\" has one for an unbounded axisymmetric paraboloid with contact = \"prescribed\", and in \
                     the plane for a flat punch and a cone",
            ),
            (Rakhmatulin, Front::Flat) if is_plane && !is_prescribed => {
                Err("the plane flat punch has one for indenter.radius = 1")
            }
            (Rakhmatulin, _) if is_plane => {
                Err("in the plane only the flat punch (unilateral or bilateral) has one")
            }
            (Rakhmatulin, _) if edge == 0.0 => {
                Err("the contact of this cone is slower than the waves: contact = \"prescribed\" has one")
            }
            (Rakhmatulin, _) => Ok(Spreading::new(front, velocity, c_s, thickness).map(Self::Spreading)),
        };
        match form {
            Ok(form) => form.map_err(|error| NoClosedForm { reason: error.to_string() }),
            Err(reason) => none(reason),
        }
    }
}

/// The contact of Hertz, for a ball of finite mass.
fn hertz(case: &Case) -> Result<Hertz, NoClosedForm> {
    let is_half_space = case.target.is_simple() && case.target.thickness.is_none();
    let reason = "it needs an indenter of infinite mass (indenter.mass = inf) or, for the contact of Hertz, model = \
                  \"elastic\" with an axisymmetric sphere or paraboloid on a half-space, no narrower than its contact";
    Hertz::of(case).filter(|_| is_half_space).map_or_else(|| none(reason), Ok)
}

/// The layers as they are computed.
fn stack(case: &Case) -> Result<Stack, ExactError> {
    let layers = case.target.computed().into_iter().zip(&case.sizes.layers).map(|(layer, rows)| StackLayer {
        impedance: layer.waves.impedance,
        wave_speed: rows.dz / case.sizes.dt,
        shear_wave_speed: layer.waves.shear,
        thickness: layer.thickness.unwrap_or(f64::INFINITY),
    });
    Stack::new(&layers.collect::<Vec<_>>(), case.target.back)
}

/// The closed form for a case.
#[derive(Clone, Debug)]
pub struct ClosedForm {
    /// Its name.
    pub name: &'static str,
    /// What it gives, in words.
    what: &'static str,
    /// Time up to which it holds somewhere \[R/c_p\].
    pub end_time: f64,
    /// True if it has the drag as long as it has the pressure.
    pub has_drag: bool,
    form: Form,
    /// How the contact spreads.
    front: Front,
    rule: Rule,
    velocity: f64,
    /// Speed of the fastest wave along the surface \[c_p\].
    wave_speed: f64,
    /// Radius out to which the contact is that of the unbounded shape, faster than the waves if it is unilateral \[R\].
    edge: f64,
    /// True if nodes of a computed run come into contact by hat-weighted averages.
    has_partial_contact: bool,
    /// Nodes and punch; of a form that holds on the axis alone the first node is there.
    interface: Interface<'static>,
    dt: f64,
    steps: u64,
    /// Unit of times in texts.
    time_unit: Unit,
    /// Time of the step evaluated last, and the motion at it, which every node asks for.
    time: f64,
    motion: Motion,
}

impl ClosedForm {
    /// Finds the closed form for `case`.
    ///
    /// # Errors
    ///
    /// The reason why there is none.
    pub fn for_case(case: &Case) -> Result<Self, NoClosedForm> {
        let is_ball = |striker: &Striker| case.indenter.mass.is_finite() && striker.body.layers.len() == 1;
        if case.load.is_some() || !case.indenter.striker.as_ref().is_none_or(is_ball) {
            return none(
                "it needs an indenter that is rigid or, for the contact of Hertz, of finite mass and one layer",
            );
        }
        let hertz = case.indenter.mass.is_finite().then(|| hertz(case)).transpose()?;
        let rule = case.impact.contact;
        // in layers the edge is first heard of through the fastest one
        let wave_speed = case.wave_speed();
        let punch_radius = case.indenter.radius.unwrap_or(f64::INFINITY);
        let velocity = case.impact.velocity;
        // a prescribed contact spreads as the depth V0·t cuts the head: r*² = 2ρV0·t, r* = V0·t/s
        let head = &case.indenter.head;
        let front = match head.tip() {
            Tip::Face if head.is_flat() => Front::Flat,
            Tip::Point(slope) => Front::Cone { spread_rate: velocity / slope },
            // the contact of Hertz takes a sphere as one
            Tip::Round(nose_radius) if hertz.is_some() || matches!(head, Head::Paraboloid { .. }) => {
                Front::Paraboloid { curvature: 2.0 * nose_radius * velocity }
            }
            Tip::Face | Tip::Round(_) | Tip::Other => {
                return none("it needs a flat face with a sharp edge, a paraboloid or a cone");
            }
        };
        let outruns_waves =
            if rule == Rule::Prescribed { f64::INFINITY } else { front.sonic_radius(wave_speed) };
        let edge = punch_radius.min(outruns_waves);
        let form = match hertz {
            Some(form) => Form::Hertz(form),
            None => Form::for_case(case, front, edge)?,
        };
        // of the wave of the edge at the axis
        let arrival = front.arrival(edge) + edge / wave_speed;
        let (name, what, end_time, has_drag) = match &form {
            Form::Spreading(_) if front == Front::Flat => {
                ("spreading", "plane wave, until the wave of the edge arrives", arrival, false)
            }
            Form::Spreading(_) if edge.is_finite() => {
                let what = "pressure under a spreading contact, until the wave of its edge arrives";
                ("spreading", what, arrival, false)
            }
            Form::Spreading(_) => {
                ("spreading", "pressure and drag under a spreading contact", f64::INFINITY, true)
            }
            Form::PlanePunch(form) => match case.model {
                ModelKind::Rakhmatulin => {
                    ("plane_punch", "pressure and drag of a plane flat punch", form.end_time, true)
                }
                ModelKind::Elastic => {
                    let what = "pressure and drag of a plane flat punch, full theory";
                    ("elastic_plane_punch", what, form.end_time, true)
                }
            },
            Form::Paraboloid(_) => {
                let what = "[KA] Eq. 16: pressure on the axis, full theory";
                ("elastic_paraboloid", what, f64::INFINITY, false)
            }
            Form::Wedge(_) => {
                let what = match edge.is_finite() {
                    true => "pressure under a plane wedge, full theory, until the wave of its edge arrives",
                    false => "pressure and drag of a plane wedge, full theory",
                };
                // the pressure under waves reflected from the backing might fall to 0 where the form does not know it
                let echo = case.target.thickness.filter(|_| rule != Rule::Prescribed).map(|h| 2.0 * h);
                ("elastic_wedge", what, echo.unwrap_or(f64::INFINITY).min(arrival), edge.is_infinite())
            }
            Form::Hertz(form) => {
                let what =
                    "Hertz: pressure, drag and motion of a ball on a half-space, each moment as if at rest";
                ("hertz", what, form.duration(), true)
            }
        };
        let grid = case.grid();
        Ok(Self {
            name,
            what,
            end_time,
            has_drag,
            interface: Interface {
                r0: if matches!(form, Form::Paraboloid(_)) { 0.0 } else { grid.r0 },
                dr: grid.dr,
                radii: grid.radii(),
                punch_radius,
                ..Interface::default()
            },
            form,
            front,
            rule,
            velocity,
            wave_speed,
            edge,
            has_partial_contact: case.mesh.kind == MeshKind::Matched && front != Front::Flat,
            dt: grid.dt(),
            steps: case.sizes.steps,
            time_unit: case.units().time,
            time: 0.0,
            motion: Motion { depth: 0.0, velocity },
        })
    }

    /// True if the form leaves out waves, so that a computed run differs from it on the finest mesh too.
    pub fn is_approximate(&self) -> bool {
        matches!(self.form, Form::Hertz(_))
    }

    /// Number of the last step of the case at which the closed form holds.
    pub fn last_step(&self) -> u64 {
        let steps = (self.end_time / self.dt * (1.0 - 1e-12)).ceil() - 1.0;
        if steps < self.steps as f64 { steps.max(0.0) as u64 } else { self.steps }
    }

    /// Evaluates step `step`, with the threads of the pool it is called in.
    pub fn evaluate(&mut self, step: u64) -> View<'_> {
        let time = step as f64 * self.dt;
        (self.motion, self.time) = (self.motion(time), time);
        let Motion { depth, velocity } = self.motion;
        let pressure = |i| self.pressure_at(self.interface.r(i), time);
        let pressure: Vec<f64> = (0..self.reached()).into_par_iter().map(pressure).collect();
        View {
            step,
            time,
            is_last: step == self.last_step(),
            interface: Interface { pressure: pressure.into(), exact: Some(self), ..self.interface.clone() },
            drag: self.drag_at(time),
            contact_radius: self.contact_radius(time),
            velocity,
            depth,
            ..View::default()
        }
    }

    /// Drag at any time \[πR²γc_p²; plane Rγc_p²\]; NaN where it is not known.
    pub fn drag_at(&self, time: f64) -> f64 {
        let drag = match &self.form {
            _ if !self.has_drag => return f64::NAN,
            // as of the pressure, half of the initial jump
            Form::PlanePunch(_) if time == 0.0 => Ok(0.5 * self.velocity),
            Form::PlanePunch(form) => form.drag(time),
            Form::Wedge(form) if time < self.end_time => form.drag(time),
            Form::Spreading(form) => form.drag(time),
            Form::Wedge(_) | Form::Paraboloid(_) => return f64::NAN,
            Form::Hertz(form) => return form.force(self.motion(time).depth),
        };
        drag.unwrap_or(f64::NAN)
    }

    /// Interface stress at radius `r` at any time \[γc_p²\]; NaN where it is not known.
    pub fn pressure_at(&self, r: f64, time: f64) -> f64 {
        if r > self.interface.punch_radius || r > self.contact_radius(time) {
            // ahead of the contact, as a probe of a computed run shows
            return 0.0;
        }
        let value = match &self.form {
            _ if r > self.known_radius(time) => return f64::NAN,
            Form::PlanePunch(_) if time == 0.0 => return 0.5 * self.velocity,
            Form::PlanePunch(form) => form.pressure(r, time),
            Form::Wedge(form) if time < self.end_time => form.pressure(r, time),
            Form::Paraboloid(form) if r == 0.0 => form.axis_pressure(0.0, time),
            Form::Wedge(_) | Form::Paraboloid(_) => return f64::NAN,
            Form::Spreading(form) => form.pressure(r, 0.0, time),
            Form::Hertz(form) => return form.pressure(r, self.motion(time).depth),
        };
        value.unwrap_or(f64::NAN)
    }

    /// Depth and velocity of the indenter; NaN where they are not known.
    fn motion(&self, time: f64) -> Motion {
        match &self.form {
            _ if time == self.time => self.motion,
            Form::Hertz(form) => form.motion(time).unwrap_or(Motion { depth: f64::NAN, velocity: f64::NAN }),
            _ => Motion { depth: self.velocity * time, velocity: self.velocity },
        }
    }

    /// Contact radius, but for the contact of Hertz if the surface is at rest ahead of the contact \[R\].
    fn contact_radius(&self, t: f64) -> f64 {
        match &self.form {
            Form::Hertz(form) => form.contact_radius(self.motion(t.min(form.duration())).depth),
            _ => self.front.radius(t).min(self.interface.punch_radius),
        }
    }

    /// Largest contact radius until a time \[R\].
    fn widest(&self, t: f64) -> f64 {
        match &self.form {
            Form::Hertz(form) => self.contact_radius(t.min(0.5 * form.duration())),
            _ => self.contact_radius(t),
        }
    }

    /// Number of nodes that a computed run has had in contact after this step. Partial contact begins one step and a
    /// half and one spacing ahead of the contact.
    fn reached(&self) -> usize {
        if matches!(self.form, Form::Paraboloid(_)) {
            return 1;
        }
        let &Interface { punch_radius, dr, .. } = &self.interface;
        let full = self.nodes_within(self.widest(self.time + self.dt));
        let partial = if self.has_partial_contact {
            self.nodes_within(self.widest(self.time + (1.0 + HALF_WIDTH) * self.dt) + dr)
        } else {
            full
        };
        if self.rule == Rule::Prescribed {
            return partial;
        }
        // a node in whose support the punch ends comes into contact as a point
        let inside = self.nodes_within(punch_radius - dr + 2.0 * SLIVER * dr);
        let on_punch = self.nodes_within(punch_radius * (1.0 + SLIVER));
        partial.min(inside).max(full.min(on_punch))
    }

    /// Number of nodes inside a radius.
    fn nodes_within(&self, radius: f64) -> usize {
        // an infinite radius saturates
        let Interface { radii, r0, dr, .. } = &self.interface;
        match radii {
            Some(radii) => radii.partition_point(|node| *node < radius * (1.0 - SLIVER)),
            None => ((radius - r0) / dr - SLIVER).ceil().max(0.0) as usize,
        }
    }

    /// Radius up to which no wave of the edge has arrived \[R\].
    fn known_radius(&self, time: f64) -> f64 {
        match &self.form {
            Form::Spreading(_) | Form::Wedge(_) if self.edge.is_finite() => {
                let since = time - self.front.arrival(self.edge);
                self.edge - self.wave_speed * since.max(0.0)
            }
            _ => f64::INFINITY,
        }
    }
}

impl StressAt for ClosedForm {
    fn stress_at(&self, r: f64) -> f64 {
        self.pressure_at(r, self.time)
    }
}

impl fmt::Display for ClosedForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.what)?;
        if let Form::Hertz(form) = &self.form {
            let radius = form.largest_radius();
            // waves take 2a/c_p across the contact
            let crossings = form.duration() * self.wave_speed / (2.0 * radius);
            let curved = radius / form.nose_radius;
            write!(
                f,
                " (waves left out, which cross the contact {crossings:.0} times while it lasts; a/ρ ≤ {curved:.2})"
            )?;
        }
        match self.end_time.is_finite() {
            true => write!(f, "; t < {}", self.time_unit.text(self.end_time)),
            false => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
