//! An indenter that gives: a second body, whose lower face is pressed as the target's surface is.
//!
//! Its displacements s are into it, upwards, and in a frame that flies on with V0, so that it begins at rest:
//!
//! ```text
//! depth of a node = V0·t − s         velocity into the target = V0 − ṡ
//! E = ½MV² + (E' − ½M(V0 − V)²)      with V of the centre of mass, and E' the energy in that frame
//! ```
//!
//! Of a half-space, whose mass is infinite, E' alone counts, and the frame does the work F·V0.

use std::io;

use crate::{
    case::Case,
    contact::{Contact, ContactState, Nose},
    grid::Grid,
    indenter::Indenter,
    model::{
        CompletedStep, Extent, Field, Frame, GaugeValues, Gauges, Instructions, Line, Model, PointState,
        Request, Sample, Sampling, StrainPeak, body::Body, reference::Reference, scheme,
        strength::RatioPeaks,
    },
    state::{StateError, StateReader, StateWriter},
    surface::Surface,
    view::StrikerMotion,
};

pub(super) struct Striker {
    pub model: Reference<(), Body, 2>,
    surface: Surface,
    /// Its mesh, z upwards.
    pub grid: Grid,
    /// The frame that flies on.
    pub flight: Indenter,
    velocity: f64,
    /// Displacement of the lower face at levels k−1 and k, for the work on it, and on the axis that of nose and rear \[R\].
    motion: [Vec<f64>; 2],
    ends: [[f64; 2]; 2],
    /// Its mass, as the mesh has it; infinite of a half-space \[πγR³; plane γR²\].
    pub mass: f64,
    /// Points and lines of the case, in their order.
    order: Order,
}

impl Striker {
    /// The striker of a case at the surface, if it has one.
    pub fn of(case: &Case, instructions: Instructions) -> Option<Self> {
        let grid = case.striker_grid()?;
        let parts = case.indenter.striker.as_ref()?;
        let materials = case.materials(&parts.body, &case.sizes.striker.as_ref()?.layers);
        let body =
            Body::new(grid.clone(), &materials, case.mesh.damping, instructions).with_weight(parts.weight);
        let body = body.with_strengths(case.strengths(&parts.body));
        let (inside, order) = inside(case);
        let mass = body.mass();
        let sampling = Sampling {
            frames: case.frame_fields(),
            gauges: inside,
            tension: Some(case.record.layer_tension),
            ..Sampling::default()
        };
        Some(Self {
            mass: if parts.body.thickness.is_some() { mass } else { f64::INFINITY },
            model: body.at_rest(sampling),
            surface: Surface::new(grid.nr()),
            motion: [vec![0.0; grid.nr()], vec![0.0; grid.nr()]],
            ends: [[0.0; 2]; 2],
            flight: Indenter::new(f64::INFINITY, case.impact.velocity, grid.dt()),
            velocity: case.impact.velocity,
            order,
            grid,
        })
    }

    /// A step of contact.
    ///
    /// * `centre`: of mass
    pub fn step(
        &mut self,
        contact: &mut Contact,
        surface: &mut Surface,
        centre: &mut Indenter,
    ) -> ContactState {
        self.model.predict(&mut self.surface);
        let flight = [self.flight.depth(), self.flight.free_depth()];
        let nose = &mut Nose { surface: &mut self.surface, area: &self.grid.area, flight };
        contact.step_elastic(surface, nose, centre)
    }

    /// Kinetic energy of the centre of mass less that of its motion in the frame that flies on, `½MV² − ½M(V0 − V)²`.
    pub fn centre_energy(&self, centre: &Indenter) -> f64 {
        if self.mass.is_infinite() {
            return 0.0;
        }
        0.5 * self.mass * self.velocity * (2.0 * centre.half_velocity() - self.velocity)
    }

    /// Work of the pressure on it during the step, in the frame that flies on.
    pub fn work(&mut self) -> f64 {
        self.surface.work(&self.grid.area, &mut self.motion)
    }

    /// Moves it to level k+1, and returns what it shows of level k, and its motion then.
    pub fn advance(&mut self, request: Request) -> (CompletedStep<()>, StrikerMotion) {
        self.model.advance(&self.surface, (), request);
        let completed = self.model.next(false).expect("the plain stepper returns a step at once");
        self.flight.advance(0.0);
        let [rear, _] = self.model.row(0, self.grid.nz);
        let next = [self.surface.displacement[0], rear[0]];
        let [before, now] = self.ends;
        let [nose, rear] =
            [0, 1].map(|end| self.velocity - scheme::velocity(before[end], next[end], self.grid.dt()));
        self.ends = [now, next];
        (completed, StrikerMotion { nose, rear })
    }

    /// Puts what a step shows of the striker to what it shows of the target: rows of the striker from its rear to its nose before those of the target, NaN
    /// beside the narrower body.
    ///
    /// * `flight`: depth of the frame that flies on at that level
    pub fn join(&self, mut target: Frame, striker: Frame, flight: f64) -> Frame {
        for (below, above) in target.samples.iter_mut().zip(striker.samples) {
            let extent =
                Extent { nr: below.extent.nr.max(above.extent.nr), nz: below.extent.nz + above.extent.nz };
            let turned = above.values.chunks_exact(above.extent.nr).rev();
            let in_target = |value: f32| turn(above.field, f64::from(value), flight, self.velocity) as f32;
            let rows = turned.map(|row| row.iter().copied().map(in_target).collect::<Vec<_>>());
            let rows = rows.chain(below.values.chunks_exact(below.extent.nr).map(<[f32]>::to_vec));
            let values = rows.flat_map(|row| {
                let beside = std::iter::repeat_n(f32::NAN, extent.nr - row.len());
                row.into_iter().chain(beside)
            });
            *below = Sample { field: below.field, extent, values: values.collect() };
        }
        target
    }

    /// Puts points and lines of the striker among those of the target.
    ///
    /// * `flight`: as in [`Striker::join`]
    pub fn join_gauges(
        &self,
        target: Option<GaugeValues>,
        striker: Option<GaugeValues>,
        flight: f64,
    ) -> GaugeValues {
        let [mut below, mut above] = [target, striker]
            .map(Option::unwrap_or_default)
            .map(|gauges| (gauges.points.into_iter(), gauges.lines.into_iter()));
        let shown = !self.order.lines.is_empty() && (below.1.len() > 0 || above.1.len() > 0);
        let point = |is_above: &bool| {
            if !is_above {
                return below.0.next().unwrap_or_default();
            }
            let PointState { displacement, velocity, stress } = above.0.next().unwrap_or_default();
            PointState { displacement: flight - displacement, velocity: self.velocity - velocity, stress }
        };
        let points = self.order.points.iter().map(point).collect();
        let line = |place: &Place| match place {
            Place::Target => below.1.next().unwrap_or_default(),
            Place::Striker => above.1.next().unwrap_or_default(),
            Place::Both => {
                let turned = above.1.next().unwrap_or_default().into_iter().rev();
                turned.chain(below.1.next().unwrap_or_default()).collect()
            }
        };
        let lines = if shown { self.order.lines.iter().map(line).collect() } else { Vec::new() };
        GaugeValues { points, lines }
    }

    /// A place where a displacement is not finite, if there is one: radius and depth.
    pub fn find_non_finite(&mut self) -> Option<(f64, f64)> {
        self.model.find_non_finite().map(|(r, z)| (r, -z))
    }

    pub fn strain_peak(&mut self) -> StrainPeak {
        let peak = self.model.strain_peak();
        StrainPeak { z: -peak.z, ..peak }
    }

    pub fn strength_peaks(&mut self) -> RatioPeaks {
        let mut peaks = self.model.strength_peaks();
        let RatioPeaks { yielding, tensile, bonds } = &mut peaks;
        let all = yielding.iter_mut().chain(tensile).chain(bonds.iter_mut().flatten());
        all.for_each(|peak| peak.z = -peak.z);
        peaks
    }

    /// Largest strain of the lower face at a level, and its column.
    pub fn nose_strain(&self) -> (f64, usize) {
        self.model.surface_strain(&self.surface.pressure[..self.surface.loaded])
    }

    pub fn save(&mut self, out: &mut StateWriter<'_>) -> io::Result<()> {
        self.flight.save(out)?;
        self.surface.save(out)?;
        out.put(&self.ends)?;
        self.motion.iter().try_for_each(|level| out.numbers(level))?;
        self.model.save(out)
    }

    pub fn load(&mut self, step: u64, from: &mut StateReader<'_>) -> Result<(), StateError> {
        self.flight.load(from)?;
        self.surface.load(from)?;
        self.ends = from.get()?;
        self.motion.iter_mut().try_for_each(|level| from.numbers(level))?;
        self.model.load(step, from)
    }
}

/// Of which body a line is.
enum Place {
    Target,
    Striker,
    Both,
}

/// Of which body points (true: of the striker) and lines are, in the order of the case.
struct Order {
    points: Vec<bool>,
    lines: Vec<Place>,
}

/// Points and lines in the striker, in its own coordinates, and which of those of the case they are.
fn inside(case: &Case) -> (Gauges, Order) {
    let Gauges { points, lines, columns } = case.gauges();
    let mut own = Gauges { columns, ..Gauges::default() };
    let point = |[r, z]: [f64; 2]| {
        if z < 0.0 {
            own.points.push([r, -z]);
        }
        z < 0.0
    };
    let of_points = points.into_iter().map(point).collect();
    let mut of_lines = Vec::new();
    for line in lines {
        let (line, place) = match line {
            Line::R(_) => (Some(line), Place::Both),
            Line::Z(z) if z < 0.0 => (Some(Line::Z(-z)), Place::Striker),
            Line::Z(_) => (None, Place::Target),
        };
        own.lines.extend(line);
        of_lines.push(place);
    }
    (own, Order { points: of_points, lines: of_lines })
}

/// Points and lines that are in the target.
pub(super) fn beside(mut gauges: Gauges) -> Gauges {
    gauges.points.retain(|[_, z]| *z >= 0.0);
    gauges.lines.retain(|line| !matches!(line, Line::Z(z) if *z < 0.0));
    gauges
}

/// A number of a field of the striker as the target has it: z turned round, and seen from it.
fn turn(field: Field, value: f64, flight: f64, velocity: f64) -> f64 {
    match field {
        Field::Displacement => flight - value,
        Field::Velocity => velocity - value,
        Field::StressRz => -value,
        Field::DisplacementR
        | Field::VelocityR
        | Field::Stress
        | Field::StressRr
        | Field::StressTt
        | Field::Pressure
        | Field::VonMises
        | Field::MaxShear
        | Field::DamageRatio => value,
    }
}
