//! Figs. 6 and 7: cones, and cylinders with conical heads.

use super::kink;
use crate::{
    Failure,
    figure::{Figure, Verdict, curve, exact, over_time, statement},
    lab::{Lab, Made, at, probe, rms},
};

/// Radii of the unbounded cones: r/Δx of the paper at Δx = 0.01.
const CONE_RADII: [f64; 7] = [0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0];
/// Radii of the cylinders with conical heads.
const HEAD_RADII: [f64; 6] = [0.0, 0.25, 0.5, 0.9, 0.95, 0.99];

pub fn figures(lab: &Lab<'_>) -> Result<Vec<Figure>, Failure> {
    let (a, cone) = cone(lab, "6a", 2.0)?;
    let (b, _) = self::cone(lab, "6b", 4.0)?;
    Ok(vec![
        a,
        b,
        head(lab, "6c", "fig6c", 2.0, "half-space")?,
        head(lab, "6d", "fig6d", 4.0, "half-space")?,
        layer(lab, &cone)?,
        head(lab, "7b", "fig7b", 2.0, "layer, h = 1")?,
    ])
}

/// Curves of a cone with closed forms over all but the tip, where it is infinite.
fn cone_curves(run: &Made, closed: &Made) -> Result<Vec<percuss_picture::Curve>, Failure> {
    let mut curves = Vec::new();
    for (i, r) in CONE_RADII.into_iter().enumerate() {
        // the closed forms are black: the seventh curve is grey
        curves.push(curve(format!("r = {r}"), probe(run, r)?, if i == 6 { 7 } else { i }));
    }
    for r in &CONE_RADII[1..] {
        let name = if *r == 0.1 { "closed form" } else { "" };
        curves.push(exact(name, probe(closed, *r)?));
    }
    Ok(curves)
}

fn cone(lab: &Lab<'_>, id: &str, rate: f64) -> Result<(Figure, Made), Failure> {
    let name = format!("fig{id}");
    let sets = ["mesh.cells=200", "record.fields=[]", "record.frames=0"];
    let run = lab.run(&name, &name, &sets)?;
    let closed = lab.exact(&format!("{name}-exact"), &name, &sets)?;
    let mut errors = Vec::new();
    for cells in [50, 100] {
        let sets = [&format!("mesh.cells={cells}"), "record.fields=[]", "record.frames=0"];
        let run = lab.run(&format!("{name}-{cells}"), &name, &sets)?;
        let closed = lab.exact(&format!("{name}-{cells}-exact"), &name, &sets)?;
        errors.push(worst(&run, &closed, rate)?);
    }
    errors.push(worst(&run, &closed, rate)?);
    let order = |i: usize| (errors[i] / errors[i + 1]).log2();
    // a few steps behind the front, where the jump of the mesh is over
    let front = |r: f64| Ok::<f64, Failure>(at(&probe(&run, r)?, r / rate + 0.06));
    let theory = (1.0 - 0.25 / (rate * rate)).sqrt();
    let (r, c_s) = (0.5, 0.5);
    let points = probe(&run, r)?;
    let (just_behind, before_tip) = (at(&points, r / rate + 0.06), at(&points, r / c_s - 0.02));
    let mut panel = over_time(&format!("tan φ = {rate}, half-space, c_s = 0.5"), cone_curves(&run, &closed)?);
    panel.y_range = Some((0.0, 3.0));
    let figure = Figure {
        id: id.into(),
        title: format!("unbounded cone, tan φ = {rate}, on a half-space"),
        text: "Dashed: the semi-analytic answer, a retarded potential of the surface source, for r > 0. At the tip the stress is \
               infinite and what the mesh shows there depends on it."
            .into(),
        panels: vec![panel],
        statements: vec![
            statement(
                "amplitude 1 at the contact front",
                format!("{:.4} behind the front at r = 2", front(2.0)?),
                Verdict::of(front(2.0)?, 1.0, 0.005),
                format!("closed form √(1 − c_s²/V*²) = {theory:.4}: the front is inclined"),
            ),
            statement(
                "constant until waves from the tip arrive",
                format!("at r = 0.5 it rises from {just_behind:.3} to {before_tip:.3} before t = r/c_s = 1"),
                Verdict::of(before_tip, just_behind, 0.005),
                "closed form, dashed: a front on a circle is not plane",
            ),
            statement(
                "(not in the paper) computed against closed form, r > 0.05, behind the front",
                format!("worst probe, relative rms: {:.3}, {:.3}, {:.3} % at 50, 100, 200 cells", errors[0], errors[1], errors[2]),
                Verdict::Given,
                format!("orders {:.2}, {:.2}", order(0), order(1)),
            ),
        ],
        made: vec![run.clone(), closed],
        ..Figure::default()
    };
    Ok((figure, run))
}

/// Largest relative rms error over the probes at r > 0.05 behind the contact front \[%\].
fn worst(run: &Made, closed: &Made, rate: f64) -> Result<f64, Failure> {
    let mut most: f64 = 0.0;
    for r in [0.1, 0.25, 0.5, 1.0, 2.0, 4.0] {
        let (p, e) = (probe(run, r)?, probe(closed, r)?);
        let step = p[1].0 - p[0].0;
        most = most.max(100.0 * rms(&p, &e, |t| t > r / rate + 2.5 * step));
    }
    Ok(most)
}

fn layer(lab: &Lab<'_>, half_space: &Made) -> Result<Figure, Failure> {
    let sets = ["mesh.cells=200", "record.fields=[]", "record.frames=0"];
    let run = lab.run("fig7a", "fig7a", &sets)?;
    let closed = lab.exact("fig7a-exact", "fig7a", &sets)?;
    let mut panel = over_time("tan φ = 2, h = 1, c_s = 0.5", cone_curves(&run, &closed)?);
    panel.y_range = Some((0.0, 8.0));
    // before the first reflection, at the times of the layer's run
    let (r, rate) = (1.0, 2.0);
    let front = (1.0_f64 - 0.25 / (rate * rate)).sqrt();
    let until = r / rate + 2.0 * front;
    let space = probe(half_space, r)?;
    let same = probe(&run, r)?
        .iter()
        .filter(|p| p.0 > r / rate + 0.1 && p.0 < until - 0.1)
        .fold(0.0, |most: f64, p| most.max((p.1 - at(&space, p.0)).abs()));
    let far = |r: f64| {
        let points = probe(&run, r)?;
        let steps = [0.5, 2.6, 4.6].map(|t| at(&points, r / rate + t * front.min(1.0)));
        Ok::<f64, Failure>((steps[1] - steps[0]) / steps[0])
    };
    Ok(Figure {
        id: "7a".into(),
        title: "unbounded cone, tan φ = 2, on a layer".into(),
        text: "Dashed: the semi-analytic answer with reflections.".into(),
        panels: vec![panel],
        statements: vec![
            statement(
                "as on the half-space until the first reflection",
                format!("at r = 1 within {same:.1e} of Fig. 6a"),
                Verdict::that(same < 5e-3),
                "two runs",
            ),
            statement(
                "with growing r the steps of one dimension, 2V0 each",
                format!(
                    "first step, relative to the stress before it: {:.2} at r = 0.5, {:.2} at r = 4",
                    far(0.5)?,
                    far(4.0)?
                ),
                Verdict::that((far(4.0)? - 2.0).abs() < (far(0.5)? - 2.0).abs()),
                "closed form, dashed",
            ),
        ],
        made: vec![run, closed],
        ..Figure::default()
    })
}

fn head(lab: &Lab<'_>, id: &str, case: &str, rate: f64, target: &str) -> Result<Figure, Failure> {
    let sets = ["mesh.cells=200", "record.fields=[]", "record.frames=0"];
    let run = lab.run(case, case, &sets)?;
    let closed = lab.exact(&format!("{case}-exact"), case, &sets)?;
    let mut curves = Vec::new();
    for (i, r) in HEAD_RADII.into_iter().enumerate() {
        curves.push(curve(format!("r = {r}"), probe(&run, r)?, i));
    }
    for r in [0.25, 0.5] {
        curves.push(exact(if r == 0.25 { "closed form" } else { "" }, probe(&closed, r)?));
    }
    let mut panel = over_time(&format!("tan φ = {rate}, R = 1, {target}, c_s = 0.5"), curves);
    let layer = target.starts_with("layer");
    panel.y_range = Some((0.0, if layer { 20.0 } else { 8.0 }));
    // contact reaches the edge at t = 1/V*, its wave reaches r at (1 − r)/c_s after that
    let (r, c_s) = (0.5, 0.5);
    let arrival = 1.0 / rate + (1.0 - r) / c_s;
    let points = probe(&run, r)?;
    let seen = kink(&points, arrival - 0.3, arrival + 0.3);
    let flat_sets: &[&str] = if layer { &["mesh.cells=200"] } else { &["mesh.cells=200", "run.end_time=4"] };
    let flat = lab.run(&format!("flat-for-{id}"), if layer { "fig5" } else { "fig4" }, flat_sets)?;
    let excess =
        |t: f64| Ok::<f64, Failure>(100.0 * (at(&probe(&run, 0.9)?, t) / at(&probe(&flat, 0.9)?, t) - 1.0));
    let (early, late) = (excess(1.0)?, excess(3.9)?);
    Ok(Figure {
        id: id.into(),
        title: format!("cylinder with a conical head, tan φ = {rate}, on a {target}"),
        text: "Dashed: the semi-analytic answer, until the wave of the edge arrives. The curve of r = 1 is left out: the edge is singular, and \
               what a node shows there grows with the mesh."
            .into(),
        panels: vec![panel],
        statements: vec![
            statement(
                "waves from two singular points, the tip and the edge",
                format!("kink at r = 0.5 at t = {seen:.3}"),
                Verdict::of(seen, arrival, 0.02),
                format!("wave of the edge: 1/V* + (1 − r)/c_s = {arrival:.3}"),
            ),
            statement(
                "with time the pattern of a flat face",
                format!(
                    "stress at r = 0.9 differs from that under a flat punch by {early:+.0} % at t = 1, by {late:+.0} % at t = 3.9"
                ),
                Verdict::that(late.abs() < early.abs()),
                "run of the flat punch on the same mesh",
            ),
        ],
        made: vec![run, closed, flat],
        ..Figure::default()
    })
}
