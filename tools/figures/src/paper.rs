//! The figures of the paper, with its statements.

use percuss::{
    case::Case,
    study::{Plan, Study, on_meshes, study},
};

use crate::{
    Failure, Progress,
    figure::Figure,
    lab::{Lab, at, probe},
    page::Table,
};

mod cones;
mod flat;
mod mass;
mod paraboloid;

/// All figures, in the order of the paper.
pub fn figures(lab: &Lab<'_>) -> Result<Vec<Figure>, Failure> {
    let mut figures = paraboloid::figures(lab)?;
    figures.extend(flat::figures(lab)?);
    figures.extend(cones::figures(lab)?);
    figures.extend(mass::figures(lab)?);
    Ok(figures)
}

/// A convergence study of a built-in case.
fn convergence(case: &str, cells: &[usize], plan: &Plan) -> Result<Study, Failure> {
    Ok(study(&on_meshes(&Case::load(case, &[])?, cells)?, plan, |_| {})?)
}

/// Value, extrapolated value and error bar of a quantity in words.
fn in_words(study: &Study, name: &str) -> Result<String, Failure> {
    let found = study.quantities.iter().find(|quantity| quantity.name == name);
    let quantity = found.ok_or_else(|| Failure(format!("no quantity {name}")))?;
    let values: Vec<String> =
        quantity.values.iter().map(|v| v.map_or("-".into(), |v| format!("{v:.4}"))).collect();
    let cells: Vec<String> = study.levels.iter().map(|level| level.cells.to_string()).collect();
    let bar = quantity.error_bar.map_or(String::new(), |bar| format!(" ± {bar:.1e}"));
    let limit = quantity.extrapolated.map_or(String::new(), |v| format!("; extrapolated {v:.4}{bar}"));
    Ok(format!("{} at {} cells{limit}", values.join(", "), cells.join(", ")))
}

/// Runs against closed forms: drag and stress, errors and orders.
pub fn closed_forms(progress: &Progress) -> Result<Table, Failure> {
    // case, cells, time, radius; times that are steps of all meshes, away from fronts
    let cases = [
        ("fig2-prescribed", [100, 200, 400], 1.4, 0.2),
        ("fig3", [100, 200, 400], 0.7, 0.5),
        ("fig5-plane", [50, 100, 200], 1.6, 0.75),
        ("fig6a", [50, 100, 200], 2.4, 0.5),
        ("fig6b", [50, 100, 200], 2.4, 0.5),
        ("fig7a", [50, 100, 200], 3.2, 0.25),
    ];
    let heading = ["case", "quantity", "cells", "errors", "order", "closed form"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    for (case, cells, time, r) in cases {
        progress.next(&format!("percuss study {case} --times {time} --probes {r}"));
        let plan = Plan { times: vec![time], probes: vec![r], ..Plan::default() };
        let study = convergence(case, &cells, &plan)?;
        for quantity in &study.quantities {
            let Some(errors) = &quantity.errors else { continue };
            let errors: Vec<String> = errors.iter().map(|error| format!("{error:.1e}")).collect();
            rows.push(vec![
                format!("`{case}`"),
                quantity.name.clone(),
                cells.map(|cells| cells.to_string()).join(", "),
                errors.join(", "),
                quantity.exact_order.map_or("-".into(), |order| format!("{order:.2}")),
                format!("`{}`", study.closed_form.unwrap_or_default()),
            ]);
        }
    }
    let text = "Numbers of runs on refined meshes against closed forms, `percuss study`. Away from edges and fronts stress and drag \
                converge at second order, drag also where the motion is prescribed and the edge of the contact outruns the waves; \
                where it does not, the cell in which the contact ends counts by its fraction in contact, an error of first order. Behind the reflections of a cone's tip (Fig. 7a) waves of its singular point are left that the mesh \
                does not resolve.";
    Ok(Table { title: "Runs against closed forms".into(), text: text.into(), rows })
}

/// Time of the sharpest bend of a curve between two times: where its second difference is largest.
fn kink(points: &crate::lab::Points, from: f64, to: f64) -> f64 {
    let bends = points.windows(3).filter(|w| from <= w[1].0 && w[1].0 <= to);
    let bend = |w: &[(f64, f64)]| (w[2].1 - 2.0 * w[1].1 + w[0].1).abs();
    bends.max_by(|a, b| bend(a).total_cmp(&bend(b))).map_or(f64::NAN, |w| w[1].0)
}

/// Values of a probe at some times, in words.
fn values(made: &crate::lab::Made, r: f64, times: &[f64]) -> Result<Vec<f64>, Failure> {
    let points = probe(made, r)?;
    Ok(times.iter().map(|&t| at(&points, t)).collect())
}
