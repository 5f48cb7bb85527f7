//! Findings about a case and its run: where results are outside the range of validity, and estimates of a run.
//!
//! Some findings follow from the case, others only from its run. [`Advised`] adds them to the events of a run, from where programs
//! and recordings have them; `percuss check` prints those of the case.

use percuss_table::measures::Measure;

use crate::{
    case::{Case, NOTED_CHANGE, Sizes},
    contact::Rule,
    exact::hertz::Hertz,
    grid::Back,
    measuring::Measuring,
    session::{self, RunError, Status, Steps},
    simulation::{Simulation, SimulationError},
    state::SaveState,
    units::{Dimension, Units},
    validity::{STRAIN_LIMIT, Validity},
    view::{Event, View},
};

pub mod admissible;
pub mod cost;
pub mod impact;
pub mod rigidity;
pub mod theory;

use rigidity::Rigidity;
use theory::Trust;

/// Share of c_p above which an impact velocity is no small one.
const FAST: f64 = 0.1;
/// Cells that a contact needs for its stress to be that of the head and not of the mesh.
const FEWEST_CELLS: f64 = 5.0;
/// Share of V0 that a body may lose in a step: its motion is resolved in so many steps, and its largest force within that.
const LARGEST_FALL: f64 = 0.05;
/// Share of the loss of energy that may be the mesh's.
const LARGEST_LOSS: f64 = 0.1;
/// Cells across the corner of an edge that show it.
const EDGE_CELLS: f64 = 2.0;

/// A warning about a case or its results.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Finding {
    /// Its subject in one word: `velocity`, `layers`, `edge`, `base`, `rigid`, `theory`, `far`, `radius`, `mass`, `strain`, `cells`, `near`, `loss`.
    #[serde(rename = "about")]
    pub code: &'static str,
    /// The problem, its place and the remedy.
    pub text: String,
}

/// Findings of their codes and texts, of those that there are.
fn findings<const N: usize>(found: [(&'static str, Option<String>); N]) -> Vec<Finding> {
    found.into_iter().filter_map(|(code, text)| Some(Finding { code, text: text? })).collect()
}

/// The findings that follow from a case.
pub fn of_case(case: &Case) -> Vec<Finding> {
    let near = near_edge(case).map_or(("radius", None), |(code, text)| (code, Some(text)));
    let is_physical = case.scales.is_some();
    let has_base = is_physical && case.sizes.has_back && case.target.back == Back::Rigid;
    let base = "the layer lies on a rigid, smooth base, as if glued to it; a real support yields";
    let simple = "the simplified theory neglects displacements along the surface; model = \"elastic\" computes the \
                  full theory";
    findings([
        ("velocity", large_velocity(case)),
        ("layers", changed_speeds(case)),
        ("edge", sharp_edge(case)),
        ("base", has_base.then(|| base.into())),
        ("rigid", Rigidity::of(case).filter(Rigidity::is_notable).map(|rigidity| rigidity.text())),
        ("mass", light_body(case)),
        ("far", wide_cells(case)),
        near,
        (
            "theory",
            Trust::of(case).and_then(|trust| match trust.is_notable() {
                true => Some(trust.text(case)),
                false => is_physical.then(|| simple.into()),
            }),
        ),
    ])
}

/// The findings that follow from the results of a run.
fn of_run(case: &Case, validity: &Validity) -> Vec<Finding> {
    findings([
        ("mass", slowed_body(case, validity)),
        ("strain", large_strain(case, validity)),
        ("cells", narrow_contact(case, validity)),
        ("near", wide_contact(case, validity)),
        ("loss", lost_energy(case, validity)),
    ])
}

/// Codes of findings, each once.
pub fn codes<'a>(findings: impl IntoIterator<Item = &'a Finding>) -> Vec<&'static str> {
    let mut codes = Vec::new();
    for Finding { code, .. } in findings {
        if !codes.contains(code) {
            codes.push(*code);
        }
    }
    codes
}

/// An impact velocity that is no small one.
fn large_velocity(case: &Case) -> Option<String> {
    let scales = case.scales.filter(|_| case.impact.velocity > FAST)?;
    let (velocity, c_p) = (case.units().speed.text(case.impact.velocity), scales.of(Dimension::Speed));
    Some(format!("V0 = {velocity} is more than a tenth of c_p = {c_p:.0} m/s: linear theory needs much less"))
}

/// A point or sensor where cells are too wide.
fn wide_cells(case: &Case) -> Option<String> {
    let ([r, z], width, allowed) = case.coarse_point()?;
    let [r, z, width, allowed] = [r, z, width, allowed].map(|x| case.units().length.text(x));
    Some(format!(
        "at the recorded point r = {r}, z = {z} cells are {width} wide, too wide for the pulse of the contact, which gets there broader and lower \
         than it is; set mesh.largest_cell = {allowed} or less"
    ))
}

/// An outer edge of the mesh from which waves come back before the end to the contact, or to a point or sensor that is recorded, which is another finding:
///
/// ```text
/// r_max < (r_contact + r + c·t_end)/2        r: of the contact or of the place
/// ```
fn near_edge(case: &Case) -> Option<(&'static str, String)> {
    let Sizes { outer_radius, contact_reach, steps, dt, .. } = case.sizes;
    let least = |r: f64| 0.5 * (contact_reach + r + case.wave_speed() * steps as f64 * dt);
    let points = case.record.points.iter().map(|[r, _]| *r);
    let farthest = points.chain(case.record.sensors.iter().map(|sensor| sensor.r)).fold(0.0, f64::max);
    let is_met = |r: f64| outer_radius < least(r);
    let (code, place, r) = match (is_met(contact_reach), is_met(farthest)) {
        _ if case.target.radius.is_some() => return None,
        (true, _) => ("radius", "", contact_reach),
        (false, true) => ("far", " to what is recorded", farthest),
        (false, false) => return None,
    };
    let [given, least] = [outer_radius, 1.001 * least(r)].map(|r| case.units().length.text(r));
    let text = format!(
        "waves come back{place} from the outer edge of the mesh, r = {given}, where no body ends; leave mesh.outer_radius out, or make it {least} or more"
    );
    Some((code, text))
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
    let radius = case.indenter.radius.filter(|_| case.load.is_none() && case.reaches_edge())?;
    // an edge over the rim of the target is none
    if case.target.radius.is_some_and(|rim| radius >= rim) {
        return None;
    }
    let remedy = match case.shape().corner_radius() {
        corner if corner >= EDGE_CELLS * case.sizes.dr => return None,
        0.0 if case.indenter.head.is_flat() => "; indenter.edge_radius rounds it",
        0.0 => "",
        _ => ", as its corner is smaller than two cells",
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
        Rule::Unilateral | Rule::Prescribed | Rule::Load => case.shape().face_radius(),
    };
    let radius = case.within_rims(radius);
    case.geometry.area(radius) * case.sizes.dt / case.indenter.mass
}

/// A body so light that the steps do not resolve its first instants, or by Hertz its largest force. One that gives is no such body: waves in it bring its
/// mass to bear.
fn light_body(case: &Case) -> Option<String> {
    if case.indenter.striker.is_some() {
        return None;
    }
    let of_face = first_fall(case);
    if of_face > LARGEST_FALL {
        let area = of_face * case.indenter.mass / case.sizes.dt;
        let force = case.units().force.text(area * case.impact.velocity);
        let text = unresolved_motion(of_face, case.mesh.density());
        return Some(format!("{text}; the force of the first instant, Z·A·V0, is {force}"));
    }
    let slows =
        |hertz: Hertz| hertz.largest_force() * case.sizes.dt / (case.indenter.mass * case.impact.velocity);
    let of_ball = Hertz::of(case).map(slows).filter(|fall| *fall > LARGEST_FALL)?;
    Some(unresolved_motion(of_ball, case.mesh.density()))
}

/// * `fall`: share of V0 that the body loses in a step
/// * `density`: of the mesh, [`crate::case::Mesh::density`]
fn unresolved_motion(fall: f64, (key, cells): (&str, usize)) -> String {
    let percent = 100.0 * fall.min(1.0);
    let finer = (cells as f64 * fall / LARGEST_FALL).ceil();
    format!(
        "the body is so light that it loses {percent:.0} % of V0 within a step: peak force and velocity are means over steps, not those of the \
         impact; {key} = {finer:.0} or more resolves them ({:.0} % in a step)",
        100.0 * LARGEST_FALL
    )
}

/// A body that the largest drag slows too much within a step, if the case itself does not say so.
fn slowed_body(case: &Case, validity: &Validity) -> Option<String> {
    let fall = validity.drag.value * (case.sizes.dt / (case.indenter.mass * case.impact.velocity));
    (fall > LARGEST_FALL && case.indenter.striker.is_none() && light_body(case).is_none())
        .then(|| unresolved_motion(fall, case.mesh.density()))
}

/// Strain above the limit. Dimensionless flat punches are exempt: their results scale with V0.
fn large_strain(case: &Case, validity: &Validity) -> Option<String> {
    let strain = validity.strain.value;
    if strain <= STRAIN_LIMIT || (case.indenter.head.is_flat() && case.scales.is_none()) {
        return None;
    }
    let times = strain / STRAIN_LIMIT;
    let Units { length, time, speed, .. } = case.units();
    let remedy = match (&case.load, validity.admissible_velocity()) {
        (Some(load), _) => {
            let force = case.units().force.text(load.force.largest() / times);
            format!("forces up to {force} keep it")
        }
        (None, Some(velocity)) => format!("V0 up to {:.4} {} keeps it", speed.of(velocity), speed.name),
        (None, None) => "under a head that is not flat it falls more slowly than V0".into(),
    };
    let [r, z] = [validity.strain.r, validity.strain.z].map(|x| length.text(x));
    let t = time.text(validity.strain.time);
    Some(format!(
        "the largest strain, {strain:.4} at r = {r}, z = {z}, t = {t}, is {times:.1} times the limit of linear theory, {STRAIN_LIMIT}; {remedy}"
    ))
}

/// A contact that the mesh does not resolve.
fn narrow_contact(case: &Case, validity: &Validity) -> Option<String> {
    let peak = validity.drag;
    let cells = peak.r / case.sizes.dr;
    let is_narrow = !case.indenter.head.is_flat() && peak.value > 0.0 && cells < FEWEST_CELLS;
    let (key, given) = case.mesh.density();
    is_narrow.then(|| {
        let remedy = match case.mesh.grading {
            Some(_) => format!("set {key} = {:.0}", (given as f64 * FEWEST_CELLS / cells).ceil()),
            None => format!("make {key} larger"),
        };
        format!(
            "at the largest force the radius of the contact is only {cells:.1} cells, fewer than {FEWEST_CELLS}: peak force, stress, contact \
             radius and restitution are those of the mesh; {remedy}"
        )
    })
}

/// A contact that has left the near zone of a graded mesh.
fn wide_contact(case: &Case, validity: &Validity) -> Option<String> {
    let [near, _] = case.mesh.grading?.near;
    let (radius, length) = (validity.drag.r, case.units().length);
    (radius > near).then(|| {
        let [radius, near, wider] = [radius, near, 1.2 * radius].map(|r| length.text(r));
        format!(
            "at the largest force the contact reaches r = {radius}, beyond the near zone of the mesh, {near}: its edge is less resolved than its middle; \
             set mesh.near_radius = {wider}"
        )
    })
}

/// A rebound whose loss of energy is the mesh's in good part.
fn lost_energy(case: &Case, validity: &Validity) -> Option<String> {
    let (squared, mesh_loss) = validity.rebound.zip(validity.mesh_loss)?;
    if mesh_loss <= LARGEST_LOSS * (1.0 - squared) {
        return None;
    }
    let [raw, corrected] = [squared, squared + mesh_loss].map(f64::sqrt);
    Some(format!(
        "{:.0} % of the energy that the indenter has lost is the mesh's, of nodes that came into contact: its restitution {raw:.4} is {corrected:.4} with \
         that returned (restitution_mesh_corrected); make {} larger",
        100.0 * mesh_loss / (1.0 - squared),
        case.mesh.density().0
    ))
}

/// A run with its findings: those of the case are events of the first step, those of the results of the last one.
pub struct Advised<'a> {
    case: &'a Case,
    simulation: Simulation,
    findings: Vec<Finding>,
}

impl<'a> Advised<'a> {
    /// A run of `case` with its findings.
    pub fn new(case: &'a Case, simulation: Simulation) -> Self {
        Self { case, simulation, findings: of_case(case) }
    }

    /// Those of the case, and after the last step those of the results.
    pub fn findings(&self) -> &[Finding] {
        &self.findings
    }
}

/// Computes a case; what is measured of its run, and all findings.
///
/// * `observe`: called with every step
///
/// # Errors
///
/// A simulation that fails.
pub fn measured(
    case: &Case,
    mut observe: impl FnMut(&View<'_>),
) -> Result<(Vec<Measure>, Vec<Finding>), RunError> {
    let mut measuring = Measuring::new(case.units(), true);
    let mut look = |view: &View<'_>| {
        measuring.take(view);
        observe(view);
    };
    let mut steps = Advised::new(case, Simulation::new(case));
    let outcome = session::run(&mut steps, &mut [&mut look])?;
    Ok((measuring.measures(&outcome.validity), steps.findings))
}

impl Steps for Advised<'_> {
    fn step(&mut self) -> Result<Option<View<'_>>, SimulationError> {
        let Some(mut view) = self.simulation.step()? else { return Ok(None) };
        let event = |finding: &Finding| Event::warning(finding.code, &finding.text);
        if view.step == 0 {
            view.events = self.findings.iter().map(event).chain(view.events.iter().cloned()).collect();
        }
        if view.is_last {
            let of_run = of_run(self.case, &self.simulation.validity());
            view.events = view.events.iter().cloned().chain(of_run.iter().map(event)).collect();
            self.findings.extend(of_run);
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

    const BALL: &str = "model = \"elastic\"\n[target]\nthickness = \"20 mm\"\nmaterial = \"pmma\"\n\
        [indenter]\nshape = \"sphere\"\nnose_radius = \"10 mm\"\nmaterial = \"steel\"\n\
        [impact]\nvelocity = \"5 m/s\"\n[mesh]\ncells = 50\n[run]\nend_time = \"30 us\"\n[record]\nframes = 0\n";

    /// Codes of the findings about a case.
    fn codes_of(case: &str, settings: &[&str]) -> Vec<&'static str> {
        codes(&of_case(&Case::sound(case, settings)))
    }

    fn of_run(case: &Case) -> Vec<Finding> {
        let mut steps = Advised::new(case, Simulation::new(case));
        session::run(&mut steps, &mut []).expect("a run");
        steps.findings.split_off(of_case(case).len())
    }

    #[test]
    fn a_ball_is_warned() {
        assert_eq!(codes_of(BALL, &[]), ["base"]);
        let hard = of_case(&Case::sound(BALL, &["target.material=alumina"]));
        assert_eq!(codes(&hard), ["base", "rigid"]);
        assert!(hard[1].text.contains("about 48 % too high"), "{hard:?}");
        let graded = |largest: &str| {
            let point = "record.points=[[\"1 mm\", \"5 mm\"], [\"0.35 m\", \"5 mm\"]]";
            let settings = ["mesh.contact_cells=10", "run.end_time=160 us", point, largest];
            of_case(&Case::sound(BALL, &settings))
        };
        let far = graded("mesh.largest_cell=inf");
        assert_eq!(codes(&far), ["base", "far"]);
        assert!(far[1].text.contains("r = 350.0 mm, z = 5.000 mm cells are 17.31 mm wide"), "{far:?}");
        assert_eq!(codes(&graded("mesh.largest_cell=14 mm")), ["base"]);
        // equal cells have no such key
        let equal =
            ["target.material=steel", "target.radius=100 mm", "mesh.cells=3", "impact.velocity=1000 m/s"];
        let point = "record.points=[[\"80 mm\", \"5 mm\"]]";
        assert!(!codes_of(BALL, &[&equal[..], &[point]].concat()).contains(&"far"));
        let found = of_run(&Case::sound(BALL, &[]));
        assert_eq!(codes(&found), ["strain"]);
        assert!(found[0].text.contains("µs") && found[0].text.contains(", z = "), "{found:?}");
        let slow = Case::sound(BALL, &["impact.velocity=5 mm/s", "mesh.cells=20"]);
        assert_eq!(codes(&of_run(&slow)), ["cells"]);
        let simple = ["model=rakhmatulin", "impact.velocity=300 m/s", "target.thickness=half-space"];
        assert_eq!(codes_of(BALL, &simple), ["velocity", "theory"]);
    }

    #[test]
    fn losses_of_the_mesh_are_told_and_returned() {
        let ball = BALL.replace("[record]", "stop = \"separation\"\n[record]");
        let [coarse, fine] = ["mesh.cells=25", "mesh.cells=50"].map(|cells| {
            let case = Case::sound(&ball, &[cells, "run.end_time=200 us"]);
            let mut steps = Advised::new(&case, Simulation::new(&case));
            let outcome = session::run(&mut steps, &mut []).expect("a run");
            assert!(codes(steps.findings()).contains(&"loss"), "{cells}: {:?}", steps.findings());
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
            Case::sound("fig8-m5", &[&["run.end_time=0.5", "record.frames=0"], settings].concat())
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
            assert!(!codes(&of_run(&case)).contains(&"mass"));
        }
        assert_eq!(light_body(&punch(&["indenter.mass=0.5"])), None);
        // the cells that are asked for are enough: the force is 0.95 of that of the first instant, or more
        let fine = punch(&["indenter.mass=0.1", "mesh.cells=410", "run.end_time=0.05"]);
        assert_eq!(light_body(&fine), None);
        let outcome = session::run(&mut Simulation::new(&fine), &mut []).expect("a run");
        assert!((0.95..1.0).contains(&outcome.validity.drag.value), "{:?}", outcome.validity.drag);
        // under a tip only the run can tell
        let settings = ["indenter.mass=0.0002", "impact.contact=unilateral", "record.frames=0"];
        let tip = Case::sound("fig2", &settings);
        assert!(!codes(&of_case(&tip)).contains(&"mass"));
        assert!(codes(&of_run(&tip)).contains(&"mass"), "{:?}", of_run(&tip));
    }

    #[test]
    fn only_an_edge_that_is_reached_and_not_rounded_is_sharp() {
        for (name, settings, expected) in [
            ("elastic-fig5", &[][..], &["edge"][..]),
            ("elastic-fig5", &["indenter.edge_radius=0.1"], &[]),
            ("elastic-fig5", &["indenter.edge_radius=0.001"], &["edge"]),
            ("elastic-fig3", &[], &["edge"]),
            ("elastic-fig2", &[], &[]),
            ("fig5", &[], &["edge", "theory"]),
        ] {
            assert_eq!(codes_of(name, settings), expected, "{name} {settings:?}");
        }
    }

    #[test]
    fn layers_are_warned_of_changed_speeds_until_the_mesh_fits() {
        for (settings, expected) in [
            (&[][..], &["rigid"][..]),
            (&["mesh.cells=8"], &["layers", "rigid"]),
            (&["mesh.cells=11"], &["rigid"]),
            (&["mesh.cells=11", "target.back=rigid"], &["base", "rigid"]),
            (&["model=rakhmatulin", "mesh.cells=20"], &["rigid", "theory"]),
        ] {
            assert_eq!(codes_of("laminate-armour", settings), expected, "{settings:?}");
        }
        let text = &of_case(&Case::sound("laminate-armour", &["mesh.cells=8"]))[0].text;
        let changes = "of alumina by -0.553 %, of aluminium by 0.559 %";
        assert!(text.contains(changes) && text.contains("mesh.cells = 11 changes"), "{text}");
    }

    #[test]
    fn flat_faces_scale_with_the_velocity_unless_it_is_a_real_one() {
        assert_eq!(of_run(&Case::sound("fig5", &["mesh.cells=20", "run.end_time=1"])), []);
        let text = BALL
            .replace("sphere", "flat")
            .replace("nose_radius", "radius")
            .replace("material = \"steel\"", "");
        let found = of_run(&Case::sound(&text, &["run.end_time=5 us"]));
        assert_eq!(codes(&found), ["strain"]);
        assert!(found[0].text.contains("V0 up to") && found[0].text.contains("m/s keeps it"), "{found:?}");
    }
}
