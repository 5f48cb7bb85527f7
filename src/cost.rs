//! Estimates of a run: memory, bytes, time.
//!
//! The case is computed without its frames on ever finer meshes, and recorded on the finest for which there is time; all of it
//! takes about a second, more only if the coarsest mesh does. The estimates are scaled by known laws:
//!
//! ```text
//! computing            steps × nodes in the light cone, and steps      1/(Δt·Δr·Δz), 1/Δt
//! number of messages   steps, or frames                                1/Δt, 1
//! array lengths        columns, shown nodes, pixels                    1/Δr, those of the section
//! ```
//!
//! The light cone is the same part of space and time on every mesh. Compression is measured in the trial, for each law of
//! length by itself. A case that takes less than a second is its own trial.

use std::time::{Duration, Instant};

use crate::{
    case::{Case, CaseErrors, Sizes},
    model::{GAUGES_UNDER_WAY, GaugePlan, ModelKind},
    session::{self, Flow, Observer, Outcome, Status},
    simulation::Simulation,
    validity::Validity,
    view::View,
    warnings::{RunWarnings, Warning},
};

mod trial;

use trial::Trial;

/// Time of all trials of a case together, and the part of it for computing without recording.
const LONGEST_TRIALS: Duration = Duration::from_secs(1);
const FOR_COMPUTING: f64 = 0.4;
/// Time of the coarsest mesh alone, at most: without it there is no estimate.
pub const PATIENCE: Duration = Duration::from_secs(10);
/// Estimated times hold within this factor, on a machine that is as busy during the run as it was during the trial.
pub const TIME_FACTOR: f64 = 1.5;
/// Estimated sizes of files hold within this part of them. Ahead of the waves of the full theory stands what hardly compresses, some
/// columns whatever the mesh: a larger part of coarse trials.
pub fn bytes_tolerance(model: ModelKind) -> f64 {
    match model {
        ModelKind::Rakhmatulin => 0.15,
        ModelKind::Elastic => 0.4,
    }
}

/// Trials have so many times fewer cells than the case.
const FRACTIONS: [usize; 6] = [32, 16, 8, 4, 2, 1];
/// Cells of a trial, at least: fewer show nothing of a case.
const FEWEST_CELLS: usize = 20;

/// Size of the messages of a step that are small, and of the picture, the scenes and the texts of a frame, at most \[bytes\].
const SMALL_MESSAGES: u64 = 2 << 10;
const LARGEST_PICTURE: u64 = 4 << 20;

/// Estimated number of frames in memory if they are computed faster than written: sampled, and in the queue of the recorder.
const FRAMES_IN_MEMORY: u64 = 9;

/// Estimate of a run.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// Memory for the field and for frames on their way to the file \[bytes\].
    pub memory: u64,
    /// Estimates scaled from trials; `None` if no trial is completed in time.
    pub run: Option<RunEstimate>,
}

/// Estimates scaled from trials.
#[derive(Clone, Copy, Debug)]
pub struct RunEstimate {
    /// Size of all messages before compression \[bytes\].
    pub messages: u64,
    /// Size of the recording, within [`bytes_tolerance`] \[bytes\].
    pub file: u64,
    /// Time of the run on all cores, within [`TIME_FACTOR`] \[s\].
    pub seconds: f64,
    /// Time of the target at which the case's stop condition ends the run \[R/c_p\].
    pub stops_at: Option<f64>,
    /// Cells of the trial.
    pub trial_cells: usize,
    /// Largest stress, strain and drag of the trial.
    validity: Validity,
}

impl RunEstimate {
    /// The warnings that follow from the results of the trial.
    pub fn warnings(&self, case: &Case) -> Vec<Warning> {
        let mut warnings = RunWarnings::new(case).of(&self.validity);
        for warning in warnings.iter_mut().filter(|_| self.trial_cells != case.mesh.cells) {
            warning.text = format!("by a trial on {} cells, {}", self.trial_cells, warning.text);
        }
        warnings
    }
}

impl Estimate {
    /// Estimates a run of `case`.
    pub fn new(case: &Case) -> Self {
        let memory = case.field_memory()
            + FRAMES_IN_MEMORY.min(case.frames().count()) * case.frame_size() as u64
            + gauge_memory(case);
        Self { memory, run: run_trials(case) }
    }
}

/// Number of messages of the interface stress, and of a line.
fn interface_messages(case: &Case) -> u64 {
    case.sizes.steps.div_ceil(case.record.interface_every) + 1
}

/// Size that the recording of a case certainly does not have, at a glance \[bytes\].
pub fn most_bytes(case: &Case) -> u64 {
    let Sizes { nr, steps, .. } = case.sizes;
    let gauges = GaugePlan::new(&case.gauges(), &case.grid()).size() as u64;
    let rows = (steps + 1) * (SMALL_MESSAGES + gauges) + interface_messages(case) * 8 * nr as u64;
    // fields, their levels, pictures of a bounded size, the surface
    let frame = 3 * case.frame_size() as u64 + 64 * nr as u64 + LARGEST_PICTURE;
    rows + (case.frames().count() + 1) * frame + LARGEST_PICTURE
}

/// Memory of points and lines of steps that are under way, at most \[bytes\].
fn gauge_memory(case: &Case) -> u64 {
    let gauges = case.gauges();
    if gauges.is_empty() {
        return 0;
    }
    let each = GaugePlan::new(&gauges, &case.grid()).size() as u64;
    // the bound holds for the steps that wait; one more is being computed
    (each * (case.sizes.steps + 1)).min((GAUGES_UNDER_WAY as u64).max(2 * each) + each)
}

/// Runs the trials; `None` if none is completed in time.
fn run_trials(case: &Case) -> Option<RunEstimate> {
    let start = Instant::now();
    let (deadline, patience) = (start + LONGEST_TRIALS, start + PATIENCE);
    let mut meshes: Vec<(Case, f64)> = Vec::new();
    for fraction in FRACTIONS {
        let cells = case.mesh.cells / fraction;
        if fraction > 1 && cells < FEWEST_CELLS {
            continue;
        }
        // some cases are invalid on other meshes
        let Ok(case) = on_mesh(case, cells) else { continue };
        let needed = if meshes.is_empty() { 0.0 } else { computing_seconds(computing(&meshes), &case) };
        if start.elapsed().as_secs_f64() + needed > FOR_COMPUTING * LONGEST_TRIALS.as_secs_f64() {
            break;
        }
        let until = if meshes.is_empty() { patience } else { deadline };
        let Some(seconds) = computed(&case, until) else { break };
        meshes.push((case, seconds));
    }
    let (coarsest, seconds) = meshes.first()?;
    let mut trials = vec![Trial::of(coarsest, *seconds, patience)?];
    let has_time = |(case, seconds): &&(Case, f64)| {
        // recording, and compressing once more
        let needed = seconds + 2.0 * recording(&trials, case);
        start.elapsed().as_secs_f64() + needed < LONGEST_TRIALS.as_secs_f64()
    };
    if let Some((finest, seconds)) = meshes[1..].iter().rev().find(has_time) {
        trials.extend(Trial::of(finest, *seconds, deadline));
    }
    let seconds = computing_seconds(computing(&meshes), case) + recording(&trials, case);
    trials.last()?.estimate(case, seconds).ok()
}

/// Time that frames and recording add to that of computing a case, linear in the size of its messages \[s\].
fn recording(trials: &[Trial], case: &Case) -> f64 {
    let Some(last) = trials.last() else { return 0.0 };
    let point = |trial: &Trial| [last.message_bytes(&trial.case), trial.recording];
    Line::through(&trials.iter().map(point).collect::<Vec<_>>()).at(last.message_bytes(case))
}

/// Time of computing a case without its frames, whose number is the same on every mesh \[s\]. `None` if the run fails or is not
/// done by `deadline`.
fn computed(case: &Case, deadline: Instant) -> Option<f64> {
    // the whole interior is computed for one frame as for many
    let frames = u8::from(!case.record.frames.is_none());
    let case = case.vary_frames(frames).set("record.field_every", case.record.field_every as i64);
    let case = case.build().ok()?;
    let start = Instant::now();
    run(&case, &mut [&mut until(deadline)])?;
    Some(start.elapsed().as_secs_f64())
}

/// Interrupts a run at `deadline`.
fn until(deadline: Instant) -> impl FnMut(&View<'_>) -> Flow {
    move |_| if Instant::now() < deadline { Flow::Continue } else { Flow::Interrupt("out of time".into()) }
}

/// Runs a case. `None` if that fails, or is interrupted.
fn run(case: &Case, observers: &mut [&mut dyn Observer]) -> Option<Outcome> {
    let outcome = session::run(&mut Simulation::new(case), observers).ok()?;
    (!matches!(outcome.status, Status::Interrupted(_))).then_some(outcome)
}

/// A quantity that grows linearly with another, `y = start + slope·x`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Line {
    start: f64,
    slope: f64,
}

impl Line {
    /// The line through the last two of these points, at least one; it passes the last and has no negative part. Without two
    /// points in rising order it passes the origin.
    fn through(points: &[[f64; 2]]) -> Self {
        let [x, y] = points[points.len() - 1];
        let slope = match points.iter().rev().nth(1) {
            Some(&[before_x, before_y]) if before_x < x => {
                ((y - before_y) / (x - before_x)).clamp(0.0, y / x)
            }
            _ => y / x,
        };
        Self { start: y - slope * x, slope }
    }

    fn at(self, x: f64) -> f64 {
        self.start + self.slope * x
    }
}

/// Time of computing a step against the nodes per unit of section.
fn computing(meshes: &[(Case, f64)]) -> Line {
    let point = |(case, seconds): &(Case, f64)| [nodes(case), seconds / case.sizes.steps as f64];
    Line::through(&meshes.iter().map(point).collect::<Vec<_>>())
}

/// Time of computing a case by that law \[s\].
fn computing_seconds(law: Line, case: &Case) -> f64 {
    law.at(nodes(case)) * case.sizes.steps as f64
}

/// Nodes per unit of radius and depth.
fn nodes(case: &Case) -> f64 {
    1.0 / (case.sizes.dr * case.sizes.dz)
}

/// A case on a mesh of so many cells. Its fields show nodes as far apart as in the case, if the mesh is fine enough.
fn on_mesh(case: &Case, cells: usize) -> Result<Case, CaseErrors> {
    let every = (case.record.field_every as f64 * cells as f64 / case.mesh.cells as f64).round().max(1.0);
    case.vary().set("mesh.cells", cells as i64).set("record.field_every", every as i64).build()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::builtin;

    fn load(name: &str, settings: &[String]) -> Case {
        Case::load(name, settings).expect("a built-in case")
    }

    fn in_an_hour() -> Instant {
        Instant::now() + Duration::from_secs(3600)
    }

    /// A trial of a case on a mesh of so many cells.
    fn trial(name: &str, settings: &[String], cells: usize) -> Trial {
        let coarser = on_mesh(&load(name, settings), cells).expect("a mesh");
        Trial::of(&coarser, 0.0, in_an_hour()).expect("a trial")
    }

    #[test]
    fn bytes_of_a_run_are_known_from_half_its_cells() {
        for name in builtin::names() {
            let case = load(name, &[]);
            let run = Trial::of(&case, 0.0, in_an_hour()).expect("a run");
            let trial = trial(name, &[], case.mesh.cells / 2);
            let estimate = trial.estimate(&case, 0.0).expect("a sound file");
            let off = estimate.file as f64 / run.file.len() as f64 - 1.0;
            // measured: at most 0.075, in the full theory 0.17
            assert!(off.abs() < bytes_tolerance(case.model) / 1.5, "{name}: off by {off:.3}");
        }
    }

    #[test]
    fn points_and_lines_are_estimated_too() {
        let settings = [
            "record.frames=0",
            "record.points=[[0.0, 0.5], [0.5, 0.3]]",
            "record.lines=[{ r = 0.0 }, { z = 0.5 }]",
        ];
        let settings = settings.map(String::from);
        for name in ["fig5", "fig8-m5"] {
            let [with, without] = [&settings[..], &settings[..1]].map(|settings| load(name, settings));
            let run = Trial::of(&with, 0.0, in_an_hour()).expect("a run");
            let estimate =
                trial(name, &settings, with.mesh.cells / 2).estimate(&with, 0.0).expect("a sound file");
            let off = estimate.file as f64 / run.file.len() as f64 - 1.0;
            assert!(off.abs() < bytes_tolerance(with.model), "{name}: off by {off:.3}");
            assert!(gauge_memory(&with) > 0 && gauge_memory(&without) == 0);
        }
    }

    #[test]
    fn a_case_that_is_its_own_trial_is_known_exactly() {
        let settings = ["mesh.cells=20".to_owned(), "run.stop=\"extension\"".to_owned()];
        let case = load("fig8-m5", &settings);
        let run = Trial::of(&case, 0.0, in_an_hour()).expect("a run");
        let estimate = run.estimate(&case, 0.5).expect("a sound file");
        assert_eq!(estimate.file, run.file.len() as u64);
        let end = case.sizes.steps as f64 * case.sizes.dt;
        assert!(estimate.stops_at.is_some_and(|time| time < end), "{estimate:?}");
    }

    #[test]
    fn time_of_computing_grows_with_steps_and_their_nodes() {
        let mesh = |cells: usize| load("fig8-m5", &[format!("mesh.cells={cells}")]);
        let law = Line { start: 2e-6, slope: 3e-9 };
        let times = [20, 40, 80].map(|cells| (mesh(cells), computing_seconds(law, &mesh(cells))));
        for count in 2..=3 {
            let found = computing_seconds(computing(&times[..count]), &mesh(320));
            assert!((found / computing_seconds(law, &mesh(320)) - 1.0).abs() < 1e-9, "{found:?}");
        }
        // one mesh alone: four times as many steps of sixteen times as many nodes
        let found = computing_seconds(computing(&times[..1]), &mesh(80)) / times[0].1;
        assert!((found / 64.0 - 1.0).abs() < 0.04, "{found}");
    }

    #[test]
    fn a_line_has_no_negative_part() {
        assert_eq!(Line::through(&[[1.0, 3.0], [2.0, 5.0]]), Line { start: 1.0, slope: 2.0 });
        // noise: more that takes no longer, and more that takes longer than its share
        assert_eq!(Line::through(&[[1.0, 3.0], [2.0, 2.0]]), Line { start: 2.0, slope: 0.0 });
        assert_eq!(Line::through(&[[1.0, 1.0], [2.0, 5.0]]), Line { start: 0.0, slope: 2.5 });
        for points in [&[[2.0, 5.0]][..], &[[2.0, 1.0], [2.0, 5.0]], &[[3.0, 1.0], [2.0, 5.0]]] {
            assert_eq!(Line::through(points), Line { start: 0.0, slope: 2.5 });
        }
    }

    #[test]
    fn time_of_recording_grows_with_messages() {
        let settings = ["mesh.cells=200".to_owned(), "record.frames=0".to_owned()];
        let case = load("fig5", &settings);
        let mut trials = [25, 50].map(|cells| trial("fig5", &settings, cells));
        let bytes = [&trials[0].case, &trials[1].case, &case].map(|case| trials[1].message_bytes(case));
        // four times as many steps, and as many numbers of each column; the rest of a step is as long as ever
        let growth = bytes[2] / bytes[1];
        assert!(growth > 4.0 && growth < 16.0, "{growth}");
        for (trial, bytes) in trials.iter_mut().zip(bytes) {
            trial.recording = 0.1 + 1e-6 * bytes;
        }
        assert!((recording(&trials, &case) / (0.1 + 1e-6 * bytes[2]) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_trial_ends_in_time() {
        let case = load("fig5", &["mesh.cells=200".into()]);
        assert!(computed(&case, Instant::now()).is_none());
        assert!(Trial::of(&case, 0.0, Instant::now()).is_none());
    }
}
