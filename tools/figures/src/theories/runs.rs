//! Runs of both theories at several shear wave speeds, and what is read from them.

use percuss::{
    case::Case,
    session,
    simulation::Simulation,
    view::{EventKind, View},
};
use rayon::prelude::*;

use crate::{
    Failure, Progress,
    lab::{Points, at},
};

/// Half of the time over which values are averaged, so that fronts a step apart are no difference \[R/c_p\].
const HALF_MEAN: f64 = 0.05;

/// A problem that both theories answer: a built-in case with some keys set.
pub struct Problem {
    /// What it is.
    pub name: &'static str,
    /// Built-in case.
    case: &'static str,
    /// Keys that are set, the model, its mesh and the shear wave speed apart.
    sets: &'static [&'static str],
    /// Cells per unit of depth.
    cells: usize,
    /// Time at the end of the run \[R/c_p\].
    end_time: f64,
}

/// The problems of the page.
pub const FLAT_LAYER: Problem =
    Problem { name: "flat punch on a layer", case: "fig5", sets: &[], cells: 40, end_time: 12.0 };
pub const FLAT_HALF_SPACE: Problem =
    Problem { name: "flat punch on a half-space", case: "fig4", sets: &[], cells: 40, end_time: 6.1 };
pub const PARABOLOID: Problem =
    Problem { name: "paraboloid on a layer", case: "fig2", sets: &[], cells: 50, end_time: 12.0 };
pub const CONE: Problem =
    Problem { name: "conical head on a layer", case: "fig7b", sets: &[], cells: 40, end_time: 6.1 };
pub const MASS: Problem = Problem {
    name: "flat punch of mass 5 on a half-space",
    case: "fig8-m5",
    sets: &["run.stop=\"separation\""],
    cells: 24,
    end_time: 21.0,
};
pub const PRESCRIBED: Problem = Problem {
    name: "paraboloid on a layer, prescribed motion",
    case: "fig2-prescribed",
    sets: &[],
    cells: 100,
    end_time: 6.0,
};

/// What a run shows, against time.
#[derive(Clone, Default)]
pub struct Run {
    /// Drag.
    pub drag: Points,
    /// Stress on the axis.
    pub axis: Points,
    /// Velocity of the indenter.
    pub velocity: Points,
    /// Time at which the indenter turns back.
    pub rebound: Option<f64>,
    /// Time at which contact is lost.
    pub separation: Option<f64>,
}

/// A problem at one shear wave speed, in both theories.
#[derive(Clone)]
pub struct Pair {
    /// c_s/c_p
    pub beta: f64,
    /// Simplified theory.
    pub simplified: Run,
    /// Full theory.
    pub full: Run,
}

impl Pair {
    /// Simplified over full, minus 1, of the drag around a time.
    pub fn drag_error(&self, time: f64) -> f64 {
        mean(&self.simplified.drag, time) / mean(&self.full.drag, time) - 1.0
    }

    /// Simplified over full, minus 1, of the stress on the axis around a time.
    pub fn axis_error(&self, time: f64) -> f64 {
        mean(&self.simplified.axis, time) / mean(&self.full.axis, time) - 1.0
    }
}

/// Mean around a time.
fn mean(points: &Points, time: f64) -> f64 {
    const SAMPLES: u32 = 10;
    let offset = |i: u32| HALF_MEAN * (2.0 * f64::from(i) / f64::from(SAMPLES) - 1.0);
    let values = (0..=SAMPLES).map(|i| at(points, (time + offset(i)).max(0.0)));
    values.sum::<f64>() / f64::from(SAMPLES + 1)
}

impl Problem {
    /// Computes the problem at some shear wave speeds in both theories, in parallel.
    pub fn run(&self, betas: &[f64], progress: &Progress) -> Result<Vec<Pair>, Failure> {
        progress.next(&format!("both theories: {}", self.name));
        // the slowest first
        let jobs: Vec<(f64, &str)> =
            ["elastic", "rakhmatulin"].iter().flat_map(|model| betas.iter().map(|&b| (b, *model))).collect();
        let runs: Vec<Result<Run, Failure>> =
            jobs.par_iter().with_max_len(1).map(|&(beta, model)| observe(&self.load(model, beta)?)).collect();
        let mut runs = runs.into_iter().collect::<Result<Vec<Run>, Failure>>()?;
        let simplified = runs.split_off(betas.len());
        let pairs = betas.iter().zip(runs).zip(simplified);
        Ok(pairs.map(|((&beta, full), simplified)| Pair { beta, simplified, full }).collect())
    }

    /// The commands that compute it.
    pub fn commands(&self) -> [String; 2] {
        let keys = |model, cells: &str| {
            let sets = self.sets.iter().map(|set| format!(" --set {set}")).collect::<String>();
            let Self { case, end_time, .. } = self;
            format!(
                "percuss run {case} --set model={model} --set target.shear_wave_speed=BETA --set mesh.cells={cells} \
                 --set run.end_time={end_time}{sets}"
            )
        };
        let cells = self.cells;
        [keys("elastic", &cells.to_string()), keys("rakhmatulin", &format!("({cells}/BETA)"))]
    }

    /// The case in a theory. Both have as many nodes over the depth: the simplified one has Δr = c_s·Δz.
    fn load(&self, model: &str, beta: f64) -> Result<Case, Failure> {
        let cells = self.cells as f64 / if model == "elastic" { 1.0 } else { beta };
        let mut sets = vec![
            format!("model={model}"),
            format!("target.shear_wave_speed={beta}"),
            format!("mesh.cells={}", cells.round()),
            format!("run.end_time={}", self.end_time),
            "record.fields=[]".into(),
            "record.frames=0".into(),
            "record.views=[]".into(),
        ];
        sets.extend(self.sets.iter().map(|set| (*set).to_owned()));
        Ok(Case::load(self.case, &sets)?)
    }
}

fn observe(case: &Case) -> Result<Run, Failure> {
    let mut run = Run::default();
    let mut look = |view: &View<'_>| {
        run.drag.push((view.time, view.drag));
        run.axis.push((view.time, view.interface.stress_at(0.0)));
        run.velocity.push((view.time, view.velocity));
        for event in view.events.iter() {
            match event.kind {
                EventKind::Rebound => run.rebound = Some(view.time),
                EventKind::Separation => run.separation = event.since,
                _ => {}
            }
        }
    };
    session::run(&mut Simulation::new(case), &mut [&mut look])?;
    Ok(run)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_those_of_means() {
        let line = |slope: f64| (0..100).map(|k| 0.1 * f64::from(k)).map(|t| (t, slope * t)).collect();
        let run = |slope: f64| Run { drag: line(slope), axis: line(2.0 * slope), ..Run::default() };
        let pair = Pair { beta: 0.5, simplified: run(1.2), full: run(1.0) };
        assert!((pair.drag_error(3.0) - 0.2).abs() < 1e-12 && (pair.axis_error(0.02) - 0.2).abs() < 1e-12);
    }
}
