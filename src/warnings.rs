//! Warnings outside the range of validity.
//!
//! Some follow from the case, others only from its run. `percuss check` and `percuss run` print them; [`Warned`] adds them to the events
//! of a run, so that recordings have them.

use crate::{
    case::{Case, NOTED_CHANGE},
    contact::Rule,
    exact::hertz::Hertz,
    geometry::Geometry,
    grid::Back,
    rigidity::Rigidity,
    session::{Status, Steps},
    shape::Head,
    simulation::{Simulation, SimulationError},
    state::SaveState,
    trust::Trust,
    units::{Dimension, Unit, Units},
    validity::{STRAIN_LIMIT, Validity},
    view::{Event, View},
};

/// Share of c_p above which an impact velocity is no small one.
const FAST: f64 = 0.1;
/// Cells that a contact needs for its stress to be that of the head and not of the mesh.
const FEWEST_CELLS: f64 = 5.0;
/// Share of V0 that a body may lose in a step: its motion is resolved in so many steps, and its largest force within that.
const LARGEST_FALL: f64 = 0.05;
/// Share of the loss of energy that may be the mesh's.
const LARGEST_LOSS: f64 = 0.1;
/// Cells across the corner of an edge that show it.
const CORNER_CELLS: f64 = 2.0;

/// A warning.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Warning {
    /// Its subject in one word: `velocity`, `layers`, `edge`, `base`, `rigid`, `theory`, `mass`, `strain`, `cells`, `loss`.
    pub about: &'static str,
    /// What misleads, and what to do.
    pub text: String,
}

/// The warnings that follow from a case.
pub fn of_case(case: &Case) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |about, text| warnings.push(Warning { about, text });
    if let Some(scales) = case.scales.filter(|_| case.impact.velocity > FAST) {
        let speed = case.units().speed;
        let (velocity, c_p) = (speed.text(case.impact.velocity), scales.of(Dimension::Speed));
        warn(
            "velocity",
            format!(
                "V0 = {velocity} is more than a tenth of c_p = {c_p:.0} m/s: linear theory needs much less"
            ),
        );
    }
    if let Some(text) = changed_speeds(case) {
        warn("layers", text);
    }
    if let Some(text) = sharp_edge(case) {
        warn("edge", text);
    }
    if case.scales.is_some() && case.sizes.layer && case.target.back == Back::Rigid {
        warn(
            "base",
            "the layer lies on a rigid, smooth base, as if glued to it; a real support yields".into(),
        );
    }
    if let Some(rigidity) = Rigidity::of(case).filter(Rigidity::is_notable) {
        warn("rigid", rigidity.text());
    }
    if let Some(text) = light_body(case) {
        warn("mass", text);
    }
    match Trust::of(case) {
        Some(trust) if trust.is_notable() => warn("theory", trust.text(case)),
        Some(_) if case.scales.is_some() => {
            let text = "the simplified theory neglects displacements along the surface; model = \"elastic\" computes \
                        the full theory";
            warn("theory", text.into());
        }
        _ => {}
    }
    warnings
}

/// The warnings of a run: those of its case, then those of its results.
pub fn of_results(case: &Case, validity: &Validity) -> Vec<Warning> {
    [of_case(case), RunWarnings::new(case).of(validity)].concat()
}

/// Subjects of warnings, each once.
pub fn subjects(warnings: &[Warning]) -> Vec<&'static str> {
    let mut subjects = Vec::new();
    for Warning { about, .. } in warnings {
        if !subjects.contains(about) {
            subjects.push(*about);
        }
    }
    subjects
}

/// Layers whose wave speeds are changed notably.
fn changed_speeds(case: &Case) -> Option<String> {
    let computed = case.target.computed();
    let changes =
        computed.iter().zip(&case.sizes.layers).filter(|(_, rows)| rows.speed_change.abs() > NOTED_CHANGE);
    let changes: Vec<String> = changes
        .map(|(layer, rows)| format!("of {} by {:.3} %", layer.name, 100.0 * rows.speed_change))
        .collect();
    if changes.is_empty() {
        return None;
    }
    let remedy = match case.finer_cells() {
        Some(cells) => format!("mesh.cells = {cells} changes none by more than {} %", 100.0 * NOTED_CHANGE),
        None => "a larger mesh.cells changes it less".into(),
    };
    Some(format!(
        "the wave speed {} is changed, so that waves cross layers in whole steps; {remedy}",
        changes.join(", ")
    ))
}

/// The edge of a head that contact reaches and that is sharp, or as good as sharp on the mesh.
fn sharp_edge(case: &Case) -> Option<String> {
    let radius = case.indenter.radius.filter(|_| case.reaches_edge())?;
    let remedy = match case.indenter.head {
        Head::Flat { edge_radius } if edge_radius >= CORNER_CELLS * case.sizes.dr => return None,
        Head::Flat { edge_radius: 0.0 } => "; indenter.edge_radius rounds it",
        Head::Flat { .. } => ", as its corner is smaller than two cells",
        Head::Sphere { nose_radius } if nose_radius == radius => return None,
        Head::Sphere { .. } | Head::Paraboloid { .. } | Head::Cone { .. } | Head::Profile(_) => "",
    };
    Some(format!(
        "the stress beside the sharp edge of the head grows with the mesh, as dr^(-1/2){remedy}; the drag does not"
    ))
}

/// Share of V0 that the indenter loses in the first step, known of the whole face that touches in it, of area A:
///
/// ```text
/// ΔV/V0 = Z·A·Δt/M        Z = γc_p, M in πγR³ and A in πR², in the plane in γR² and R
/// ```
fn first_fall(case: &Case) -> f64 {
    let radius = match case.impact.contact {
        Rule::Bilateral => case.shape().radius(),
        Rule::Unilateral | Rule::Prescribed => case.shape().face_radius(),
    };
    face_area(case, radius) * case.sizes.dt / case.indenter.mass
}

/// Area of a face \[πR²; plane R\].
fn face_area(case: &Case, radius: f64) -> f64 {
    match case.geometry {
        Geometry::Axisymmetric => radius * radius,
        Geometry::Plane => radius,
    }
}

/// A body so light that the steps do not resolve its first instants, or by Hertz its largest force.
fn light_body(case: &Case) -> Option<String> {
    let of_face = first_fall(case);
    if of_face > LARGEST_FALL {
        let area = of_face * case.indenter.mass / case.sizes.dt;
        let force = case.units().force.text(area * case.impact.velocity);
        let text = unresolved_motion(of_face, case.mesh.cells);
        return Some(format!("{text}; the force of the first instant, Z·A·V0, is {force}"));
    }
    let slows =
        |hertz: Hertz| hertz.largest_force() * case.sizes.dt / (case.indenter.mass * case.impact.velocity);
    let of_ball = Hertz::of(case).map(slows).filter(|fall| *fall > LARGEST_FALL)?;
    Some(unresolved_motion(of_ball, case.mesh.cells))
}

/// * `fall`: share of V0 that the body loses in a step
fn unresolved_motion(fall: f64, cells: usize) -> String {
    let percent = 100.0 * fall.min(1.0);
    let finer = (cells as f64 * fall / LARGEST_FALL).ceil();
    format!(
        "the body is so light that it loses {percent:.0} % of V0 within a step: peak force and velocity are means over steps, not those of the \
         impact; mesh.cells = {finer:.0} or more resolves them ({:.0} % in a step)",
        100.0 * LARGEST_FALL
    )
}

/// What the warnings of a run depend on beside its results.
#[derive(Clone, Copy, Debug)]
pub struct RunWarnings {
    /// Δt/(M·V0): share of V0 that a drag takes from the body in a step; 0 if the case itself warns of it.
    slowing: f64,
    cells: usize,
    units: Units,
    is_flat: bool,
    is_physical: bool,
    dr: f64,
}

impl RunWarnings {
    /// For the runs of a case.
    pub fn new(case: &Case) -> Self {
        Self {
            slowing: match light_body(case) {
                Some(_) => 0.0,
                None => case.sizes.dt / (case.indenter.mass * case.impact.velocity),
            },
            cells: case.mesh.cells,
            units: case.units(),
            is_flat: case.indenter.head.is_flat(),
            is_physical: case.scales.is_some(),
            dr: case.sizes.dr,
        }
    }

    /// The warnings that follow from the results of a run.
    pub fn of(&self, validity: &Validity) -> Vec<Warning> {
        [self.fall(validity), self.strain(validity), self.cells(validity), loss(validity)]
            .into_iter()
            .flatten()
            .collect()
    }

    /// A body that the largest drag slows too much within a step.
    fn fall(&self, validity: &Validity) -> Option<Warning> {
        let fall = validity.drag.value * self.slowing;
        (fall > LARGEST_FALL).then(|| Warning { about: "mass", text: unresolved_motion(fall, self.cells) })
    }

    /// Strain above the limit. A flat head without units is none of it: its results are those of any V0, scaled.
    fn strain(&self, validity: &Validity) -> Option<Warning> {
        let strain = validity.strain.value;
        if strain <= STRAIN_LIMIT || (self.is_flat && !self.is_physical) {
            return None;
        }
        let times = strain / STRAIN_LIMIT;
        let Unit { name, .. } = self.units.speed;
        let remedy = match validity.admissible_velocity() {
            Some(velocity) => format!("V0 up to {:.4} {name} keeps it", self.units.speed.of(velocity)),
            None => "under a head that is not flat it falls more slowly than V0".into(),
        };
        let [r, z] = [validity.strain.r, validity.strain.z].map(|x| self.units.length.text(x));
        let t = self.units.time.text(validity.strain.time);
        let text = format!(
            "the largest strain, {strain:.4} at r = {r}, z = {z}, t = {t}, is {times:.1} times the limit of linear theory, {STRAIN_LIMIT}; {remedy}"
        );
        Some(Warning { about: "strain", text })
    }

    /// A contact that the mesh does not resolve.
    fn cells(&self, validity: &Validity) -> Option<Warning> {
        let peak = validity.drag;
        let cells = peak.r / self.dr;
        if self.is_flat || peak.value <= 0.0 || cells >= FEWEST_CELLS {
            return None;
        }
        let text = format!(
            "at the largest force the radius of the contact is only {cells:.1} cells, fewer than {FEWEST_CELLS}: peak force, stress, contact \
             radius and restitution are those of the mesh; make mesh.cells larger"
        );
        Some(Warning { about: "cells", text })
    }
}

/// A rebound whose loss of energy is the mesh's in good part.
fn loss(validity: &Validity) -> Option<Warning> {
    let (squared, mesh_loss) = validity.rebound.zip(validity.mesh_loss)?;
    if mesh_loss <= LARGEST_LOSS * (1.0 - squared) {
        return None;
    }
    let [raw, corrected] = [squared, squared + mesh_loss].map(f64::sqrt);
    let text = format!(
        "{:.0} % of the energy that the indenter has lost is the mesh's, of nodes that came into contact: its restitution {raw:.4} is {corrected:.4} with \
         that returned (restitution_mesh_corrected); make mesh.cells larger",
        100.0 * mesh_loss / (1.0 - squared)
    );
    Some(Warning { about: "loss", text })
}

/// A run with its warnings: those of the case are events of the first step, those of the results of the last one.
pub struct Warned {
    simulation: Simulation,
    of_case: Vec<Warning>,
    of_run: RunWarnings,
}

impl Warned {
    /// A run of `case` with its warnings.
    pub fn new(case: &Case, simulation: Simulation) -> Self {
        Self { simulation, of_case: of_case(case), of_run: RunWarnings::new(case) }
    }
}

impl Steps for Warned {
    fn step(&mut self) -> Result<Option<View<'_>>, SimulationError> {
        let Some(mut view) = self.simulation.step()? else { return Ok(None) };
        let event = |warning: &Warning| Event::warning(warning.about, &warning.text);
        if view.step == 0 {
            view.events = self.of_case.iter().map(event).chain(view.events.iter().cloned()).collect();
        }
        if view.is_last {
            let of_run = self.of_run.of(&self.simulation.validity());
            view.events = view.events.iter().cloned().chain(of_run.iter().map(event)).collect();
        }
        Ok(Some(view))
    }

    fn interrupt(&mut self) {
        self.simulation.interrupt();
    }

    fn resume(&mut self) {
        self.simulation.resume();
    }

    fn drained(&mut self) -> Option<&mut dyn SaveState> {
        self.simulation.drained()
    }

    fn ending(&self) -> Option<Status> {
        Steps::ending(&self.simulation)
    }

    fn validity(&mut self) -> Validity {
        self.simulation.validity()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{session, simulation::Simulation};

    const BALL: &str = "model = \"elastic\"\n[target]\nthickness = \"20 mm\"\nmaterial = \"pmma\"\n\
        [indenter]\nshape = \"sphere\"\nnose_radius = \"10 mm\"\nmaterial = \"steel\"\n\
        [impact]\nvelocity = \"5 m/s\"\n[mesh]\ncells = 50\n[run]\nend_time = \"30 us\"\n[record]\nframes = 0\n";

    fn case(text: &str, settings: &[&str]) -> Case {
        let settings: Vec<String> = settings.iter().map(|&setting| setting.into()).collect();
        Case::parse("ball", text, &settings, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"))
    }

    fn abouts(warnings: &[Warning]) -> Vec<&'static str> {
        warnings.iter().map(|warning| warning.about).collect()
    }

    fn of_run(case: &Case) -> Vec<Warning> {
        let outcome = session::run(&mut Simulation::new(case), &mut []).expect("a run");
        RunWarnings::new(case).of(&outcome.validity)
    }

    #[test]
    fn a_ball_is_warned_of_what_misleads() {
        let ball = case(BALL, &[]);
        assert_eq!(abouts(&of_case(&ball)), ["base"]);
        let hard = of_case(&case(BALL, &["target.material=alumina"]));
        assert_eq!(abouts(&hard), ["base", "rigid"]);
        assert!(hard[1].text.contains("about 48 % too high"), "{hard:?}");
        let found = of_run(&ball);
        assert_eq!(abouts(&found), ["strain"]);
        assert!(found[0].text.contains("µs") && found[0].text.contains(", z = "), "{found:?}");
        let slow = case(BALL, &["impact.velocity=5 mm/s", "mesh.cells=20"]);
        assert_eq!(abouts(&of_run(&slow)), ["cells"]);
        let simple = ["model=rakhmatulin", "impact.velocity=300 m/s", "target.thickness=half-space"];
        assert_eq!(abouts(&of_case(&case(BALL, &simple))), ["velocity", "theory"]);
    }

    #[test]
    fn losses_of_the_mesh_are_told_and_returned() {
        let settings = |cells: u32| [format!("mesh.cells={cells}"), "run.end_time=200 us".into()];
        let [coarse, fine] = [25, 50].map(|cells| {
            let case = Case::parse(
                "ball",
                &BALL.replace("[record]", "stop = \"separation\"\n[record]"),
                &settings(cells),
                "".as_ref(),
            );
            let case = case.unwrap_or_else(|errors| panic!("{errors:?}"));
            let outcome = session::run(&mut Simulation::new(&case), &mut []).expect("a run");
            let warnings = RunWarnings::new(&case).of(&outcome.validity);
            assert!(abouts(&warnings).contains(&"loss"), "{cells}: {warnings:?}");
            let Validity { rebound, mesh_loss, .. } = outcome.validity;
            rebound.zip(mesh_loss).map(|(e, loss)| [e, e + loss].map(f64::sqrt)).expect("a rebound")
        });
        // 0.99828 on fine meshes
        let errors = [coarse, fine].map(|e| e.map(|e| 0.99828 - e));
        assert!(errors.iter().all(|[raw, corrected]| corrected.abs() < 0.25 * raw), "{errors:?}");
        assert!(errors[1][1].abs() < 2e-4, "{errors:?}");
    }

    #[test]
    fn bodies_that_a_step_does_not_resolve_are_told() {
        let punch = |settings: &[&str]| {
            let settings: Vec<String> = settings.iter().map(|&setting| setting.into()).collect();
            Case::load(
                "fig8-m5",
                &[&["run.end_time=0.5".into(), "record.frames=0".into()], &settings[..]].concat(),
            )
            .expect("a case")
        };
        // Z·A·Δt/M = Δt/M, and exp(−Δt/M) of Z·A·V0 after a step
        for (mass, fall, cells) in [(0.1, 20.0, 401), (0.01, 100.0, 4010), (0.001, 100.0, 40_096)] {
            let case = punch(&[&format!("indenter.mass={mass}")]);
            let text = light_body(&case).expect("a light body");
            let [lost, needed] = [format!("{fall:.0} % of V0"), format!("mesh.cells = {cells} or more")];
            assert!(
                text.contains(&lost) && text.contains(&needed) && text.contains("V0, is 1.0000"),
                "{text}"
            );
            // once
            assert!(!abouts(&of_run(&case)).contains(&"mass"));
        }
        assert_eq!(light_body(&punch(&["indenter.mass=0.5"])), None);
        // the cells that are asked for are enough: the force is 0.95 of that of the first instant, or more
        let fine = punch(&["indenter.mass=0.1", "mesh.cells=410", "run.end_time=0.05"]);
        assert_eq!(light_body(&fine), None);
        let outcome = session::run(&mut Simulation::new(&fine), &mut []).expect("a run");
        assert!((0.95..1.0).contains(&outcome.validity.drag.value), "{:?}", outcome.validity.drag);
        // under a tip only the run can tell
        let settings =
            ["indenter.mass=0.0002", "impact.contact=unilateral", "record.frames=0"].map(String::from);
        let tip = Case::load("fig2", &settings).expect("a case");
        assert!(!abouts(&of_case(&tip)).contains(&"mass"));
        assert!(abouts(&of_run(&tip)).contains(&"mass"), "{:?}", of_run(&tip));
    }

    #[test]
    fn only_an_edge_that_is_reached_and_not_rounded_is_sharp() {
        let of = |name: &str, settings: &[&str]| {
            let settings: Vec<String> = settings.iter().map(|&setting| setting.into()).collect();
            abouts(&of_case(&Case::load(name, &settings).expect("a case")))
        };
        assert_eq!(of("elastic-fig5", &[]), ["edge"]);
        assert_eq!(of("elastic-fig5", &["indenter.edge_radius=0.1"]), [""; 0]);
        assert_eq!(of("elastic-fig5", &["indenter.edge_radius=0.001"]), ["edge"]);
        assert_eq!(of("elastic-fig3", &[]), ["edge"]);
        assert_eq!(of("elastic-fig2", &[]), [""; 0]);
        assert_eq!(of("fig5", &[]), ["edge", "theory"]);
    }

    #[test]
    fn layers_are_warned_of_changed_speeds_until_the_mesh_fits() {
        let of = |settings: &[&str]| {
            let settings: Vec<String> = settings.iter().map(|&setting| setting.into()).collect();
            of_case(&Case::load("laminate-armour", &settings).expect("a case"))
        };
        assert_eq!(abouts(&of(&[])), ["rigid"]);
        let coarse = of(&["mesh.cells=8"]);
        assert_eq!(abouts(&coarse), ["layers", "rigid"]);
        let text = &coarse[0].text;
        assert!(
            text.contains("of alumina by -0.553 %, of aluminium by 0.559 %")
                && text.contains("mesh.cells = 11 changes"),
            "{text}"
        );
        assert_eq!(abouts(&of(&["mesh.cells=11"])), ["rigid"]);
        assert_eq!(abouts(&of(&["mesh.cells=11", "target.back=rigid"])), ["base", "rigid"]);
        assert_eq!(abouts(&of(&["model=rakhmatulin", "mesh.cells=20"])), ["rigid", "theory"]);
    }

    #[test]
    fn flat_faces_scale_with_the_velocity_unless_it_is_a_real_one() {
        let settings = ["mesh.cells=20".into(), "run.end_time=1".into()];
        assert_eq!(of_run(&Case::load("fig5", &settings).expect("a case")), []);
        let text = BALL
            .replace("sphere", "flat")
            .replace("nose_radius", "radius")
            .replace("material = \"steel\"", "");
        let found = of_run(&case(&text, &["run.end_time=5 us"]));
        assert_eq!(abouts(&found), ["strain"]);
        assert!(found[0].text.contains("V0 up to") && found[0].text.contains("m/s keeps it"), "{found:?}");
    }
}
