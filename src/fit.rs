//! Inverse problems: values of keys with which a case gives what was measured, by least squares.
//!
//! ```text
//! S(x) = Σ r_i²      r = (m − v)/u of a measure      r_i = (f(t_i) − y_i)/(√n·max|y|) of a curve of n points
//! ```
//!
//! The x are shares of the ranges in which keys may vary. √S is minimised by COBYLA, which is derivative-free and keeps bounds (M. J. D. Powell,
//! *A direct search optimization method that models the objective and constraint functions by linear interpolation*, 1994). The error of a value is
//! that of the curvature of S at its minimum, `cov = s²(JᵀJ)⁻¹` with the Jacobian J of the residuals by central differences, and `s² = S/(n − p)`; where
//! all numbers have errors of their own, `s = 1`.

use std::cell::RefCell;

use cobyla::{RhoBeg, StopTols};
use percuss_table::measures::Measure;
use serde::Serialize;

use crate::{
    advice::{Finding, measured},
    case::{Case, CaseErrors},
    session::RunError,
    sweep::spec::Range,
    view::View,
};

/// What a case shall give.
#[derive(Clone, Debug)]
pub enum Goal {
    /// A measure of the run, in the unit of a recording.
    Measure {
        /// Its name, as `percuss-read summary` has it.
        name: String,
        /// The number.
        value: f64,
        /// Its error, if it is known.
        error: Option<f64>,
    },
    /// A curve over time, in units of a recording.
    Curve {
        /// What it is.
        series: Series,
        /// Pairs of time and number, times increasing.
        points: Vec<[f64; 2]>,
    },
}

/// A number of every step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Series {
    /// `/drag`: force.
    Force,
    /// `/velocity`: velocity of the indenter.
    Velocity,
}

/// Why there is no fit.
#[derive(Debug, thiserror::Error)]
pub enum FitError {
    /// Values with which there is no case.
    #[error(transparent)]
    Case(#[from] CaseErrors),
    /// A run failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// No run gives what shall be compared.
    #[error("{0}")]
    Nothing(String),
}

/// A run of the fit.
#[derive(Clone, Debug, Serialize)]
pub struct Trial {
    /// Values of the keys, as they stand in a case file.
    pub values: Vec<String>,
    /// √S; infinite if the run does not give all that is compared.
    pub misfit: f64,
}

/// A value that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Found {
    /// The key.
    pub key: String,
    /// The number, in the unit of its range.
    pub value: f64,
    /// Its error, if there are more numbers than keys, or all of them have errors.
    pub error: Option<f64>,
    /// The unit.
    pub unit: String,
    /// True at an end of the range, beyond which the best value may be.
    pub at_end: bool,
}

/// The result of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// Values of the keys.
    pub found: Vec<Found>,
    /// √S there.
    pub misfit: f64,
    /// Number of runs.
    pub runs: usize,
    /// Findings of the best run.
    pub findings: Vec<Finding>,
}

/// Share of a range that values are found to.
const CLOSE: f64 = 1e-4;
/// First steps, of a range.
const FIRST: f64 = 0.25;
/// Steps of central differences, of a range.
const STEP: f64 = 0.02;
/// What stands for a run without a measure, larger than any misfit that leads anywhere.
const MISSING: f64 = 1e3;

/// Residuals of a run, if it gives all that is compared.
type Residuals = Option<Vec<f64>>;

struct Runs<'a> {
    base: &'a Case,
    ranges: &'a [(String, Range)],
    goals: &'a [Goal],
    watch: &'a mut dyn FnMut(usize, &Trial, &[Measure]),
    count: usize,
    best: Option<(f64, Vec<f64>, Vec<Finding>)>,
    failure: Option<FitError>,
}

impl Runs<'_> {
    /// Runs the case at a place in the ranges.
    ///
    /// * `x`: shares of the ranges
    fn run(&mut self, x: &[f64]) -> Result<Residuals, FitError> {
        let at = |((_, range), share): (&(String, Range), &f64)| range.text_at(share.clamp(0.0, 1.0));
        let values: Vec<String> = self.ranges.iter().zip(x).map(at).collect();
        let setting = |((key, _), value): (&(String, Range), &String)| format!("{key}={value}");
        let settings: Vec<String> = self.ranges.iter().zip(&values).map(setting).collect();
        let case = self.base.vary().overrides(&settings).build()?;
        let units = case.units();
        let mut series: Vec<Vec<[f64; 2]>> = vec![Vec::new(); self.goals.len()];
        let observe = |view: &View<'_>| {
            for (goal, seen) in self.goals.iter().zip(&mut series) {
                let Goal::Curve { series, .. } = goal else { continue };
                let value = match series {
                    Series::Force => units.force.of(view.drag),
                    Series::Velocity => units.speed.of(view.velocity),
                };
                seen.push([units.time.of(view.time), value]);
            }
        };
        let (measures, findings) = measured(&case, observe)?;
        let residuals = residuals(self.goals, &measures, &series);
        let misfit = residuals.as_deref().map_or(f64::INFINITY, norm);
        if self.best.as_ref().is_none_or(|(best, ..)| misfit < *best) {
            self.best = Some((misfit, x.to_vec(), findings));
        }
        self.count += 1;
        (self.watch)(self.count, &Trial { values, misfit }, &measures);
        Ok(residuals)
    }
}

/// Finds values of keys with which a case gives what was measured.
///
/// * `ranges`: keys, and the ranges in which their values are
/// * `most`: number of runs after which the search ends
/// * `watch`: called after every run, with its number and its measures
///
/// # Errors
///
/// A value with which there is no case, a run that fails, or none that gives what is compared.
pub fn fit(
    base: &Case,
    ranges: &[(String, Range)],
    goals: &[Goal],
    most: usize,
    watch: &mut dyn FnMut(usize, &Trial, &[Measure]),
) -> Result<Fit, FitError> {
    let runs = RefCell::new(Runs { base, ranges, goals, watch, count: 0, best: None, failure: None });
    let misfit = |x: &[f64], _: &mut ()| -> f64 {
        let mut runs = runs.borrow_mut();
        if runs.failure.is_some() {
            return MISSING;
        }
        let residuals = runs.run(x).unwrap_or_else(|error| {
            runs.failure = Some(error);
            None
        });
        residuals.as_deref().map_or(MISSING, norm)
    };
    let count = ranges.len();
    let constraints: [fn(&[f64], &mut ()) -> f64; 0] = [];
    let stop = StopTols { xtol_abs: vec![CLOSE; count], ..StopTols::default() };
    // how it ends does not matter: the best run counts
    let _ = cobyla::minimize(
        misfit,
        &vec![0.5; count],
        &vec![(0.0, 1.0); count],
        &constraints,
        (),
        most,
        RhoBeg::All(FIRST),
        Some(stop),
    );
    let mut runs = runs.into_inner();
    if let Some(error) = runs.failure.take() {
        return Err(error);
    }
    let Some((misfit, x, findings)) = runs.best.clone().filter(|(misfit, ..)| misfit.is_finite()) else {
        let text = "no run gives all that is compared: is there a separation, is the end time long enough?";
        return Err(FitError::Nothing(text.into()));
    };
    let errors = errors(&mut runs, &x, misfit)?;
    let found = ranges.iter().zip(&x).zip(errors).map(|(((key, range), share), error)| Found {
        key: key.clone(),
        value: range.at(*share),
        error: error.map(|error| error * range.slope(*share)),
        unit: range.unit.clone(),
        at_end: !(CLOSE..=1.0 - CLOSE).contains(share),
    });
    Ok(Fit { found: found.collect(), misfit, runs: runs.count, findings })
}

/// Errors of the shares at the minimum, by the curvature there; none where nothing says how large residuals are.
fn errors(runs: &mut Runs<'_>, x: &[f64], misfit: f64) -> Result<Vec<Option<f64>>, FitError> {
    let have_errors = runs.goals.iter().all(|goal| matches!(goal, Goal::Measure { error: Some(_), .. }));
    let count = |goal: &Goal| match goal {
        Goal::Measure { .. } => 1,
        Goal::Curve { points, .. } => points.len(),
    };
    let (numbers, keys) = (runs.goals.iter().map(count).sum::<usize>(), x.len());
    if !have_errors && numbers <= keys {
        return Ok(vec![None; keys]);
    }
    let variance = if have_errors { 1.0 } else { misfit * misfit / (numbers - keys) as f64 };
    let mut jacobian = Vec::new();
    for key in 0..keys {
        let ends = [-STEP, STEP].map(|step| (x[key] + step).clamp(0.0, 1.0));
        let mut at = |share: f64| {
            let mut moved = x.to_vec();
            moved[key] = share;
            runs.run(&moved)
        };
        let (Some(below), Some(above)) = (at(ends[0])?, at(ends[1])?) else { return Ok(vec![None; keys]) };
        let slope = |(below, above): (&f64, &f64)| (above - below) / (ends[1] - ends[0]);
        jacobian.push(below.iter().zip(&above).map(slope).collect::<Vec<_>>());
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let normal: Vec<Vec<f64>> =
        jacobian.iter().map(|a| jacobian.iter().map(|b| dot(a, b)).collect()).collect();
    let diagonal = inverse_diagonal(normal);
    Ok(diagonal.into_iter().map(|inverse| Some((variance * inverse?).sqrt())).collect())
}

/// Diagonal of the inverse of a symmetric positive matrix; none where it has none.
fn inverse_diagonal(matrix: Vec<Vec<f64>>) -> Vec<Option<f64>> {
    let size = matrix.len();
    let unit = |row: usize| (0..size).map(move |column| f64::from(u8::from(row == column)));
    let extended = |(row, values): (usize, Vec<f64>)| values.into_iter().chain(unit(row)).collect();
    let mut rows: Vec<Vec<f64>> = matrix.into_iter().enumerate().map(extended).collect();
    for pivot in 0..size {
        let scale = rows[pivot][pivot];
        if scale <= 0.0 {
            return vec![None; size];
        }
        rows[pivot].iter_mut().for_each(|value| *value /= scale);
        let pivots = rows[pivot].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(number, _)| *number != pivot) {
            let factor = row[pivot];
            row.iter_mut().zip(&pivots).for_each(|(value, of)| *value -= factor * of);
        }
    }
    (0..size).map(|row| Some(rows[row][size + row]).filter(|value| *value >= 0.0)).collect()
}

/// What is between a run and the goals; none if it does not give all of them.
fn residuals(goals: &[Goal], measures: &[Measure], series: &[Vec<[f64; 2]>]) -> Residuals {
    let mut residuals = Vec::new();
    for (goal, seen) in goals.iter().zip(series) {
        match goal {
            Goal::Measure { name, value, error } => {
                let found = measures.iter().find(|measure| measure.name == *name)?.value?;
                residuals.push((found - value) / error.unwrap_or(value.abs()));
            }
            Goal::Curve { points, .. } => {
                let largest = points.iter().map(|[_, y]| y.abs()).fold(0.0, f64::max);
                let scale = largest * (points.len() as f64).sqrt();
                residuals.extend(points.iter().map(|[t, y]| (at(seen, *t) - y) / scale));
            }
        }
    }
    residuals.iter().all(|residual| residual.is_finite()).then_some(residuals)
}

/// A number at a time, linear between steps, and that of the last one after it.
fn at(seen: &[[f64; 2]], time: f64) -> f64 {
    let after = seen.partition_point(|[t, _]| *t < time);
    match (after.checked_sub(1).map(|before| seen[before]), seen.get(after)) {
        (Some([t0, y0]), Some([t1, y1])) => y0 + (y1 - y0) * (time - t0) / (t1 - t0),
        (Some([_, y]), None) | (None, Some(&[_, y])) => y,
        (None, None) => f64::NAN,
    }
}

fn norm(residuals: &[f64]) -> f64 {
    residuals.iter().map(|residual| residual * residual).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverses_are_those_of_the_matrix() {
        let found = inverse_diagonal(vec![vec![4.0, 1.0], vec![1.0, 3.0]]);
        for (found, expected) in found.iter().zip([3.0 / 11.0, 4.0 / 11.0]) {
            assert!((found.expect("an inverse") - expected).abs() < 1e-15);
        }
        assert_eq!(inverse_diagonal(vec![vec![1.0, 1.0], vec![1.0, 1.0]]), [None, None]);
    }

    #[test]
    fn a_mass_is_found_from_a_measure_and_from_a_curve() {
        let case = |mass: f64| {
            Case::sound("fig8-m5", &["mesh.cells=16", "record.frames=0", &format!("indenter.mass={mass}")])
        };
        let base = case(5.0);
        let mut seen = Vec::new();
        let look = |view: &View<'_>| seen.push([view.time, view.drag]);
        let (measures, _) = measured(&case(3.0), look).expect("a run");
        let value = measures.iter().find(|measure| measure.name == "impulse").and_then(|found| found.value);
        let ranges =
            [("indenter.mass".to_owned(), Range::parse("1:9").expect("a range").expect("a sound one"))];
        let impulse =
            Goal::Measure { name: "impulse".into(), value: value.expect("an impulse"), error: Some(0.01) };
        let curve = Goal::Curve { series: Series::Force, points: seen.into_iter().step_by(7).collect() };
        for (goal, has_error) in [(impulse, true), (curve, true)] {
            let fit = fit(&base, &ranges, &[goal], 60, &mut |_, _, _| {}).expect("a fit");
            let found = &fit.found[0];
            assert!((found.value - 3.0).abs() < 0.01, "{fit:?}");
            assert!(found.error.is_some() == has_error && !found.at_end && fit.runs < 60, "{fit:?}");
        }
    }
}
