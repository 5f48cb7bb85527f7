//! Figs. 4 and 5: a flat punch of infinite mass.

use super::values;
use crate::{
    Failure,
    closed_forms::{disc_stiffness::DiscStiffness, strip_stiffness::StripStiffness},
    figure::{Figure, Verdict, curve, exact, over_radius, over_time, statement},
    lab::{Lab, Made, at, largest, metadata, probe, section, series, slope, surface},
};

pub fn figures(lab: &Lab<'_>) -> Result<Vec<Figure>, Failure> {
    let long = ["run.end_time=40", "record.frames=0", "record.fields=[]", "record.interface_every=10"];
    let disc = lab.run("fig5-long", "fig5", &long)?;
    let strip = lab.run("fig5-plane-long", "fig5-plane", &long)?;
    Ok(vec![fig4(lab)?, fig5a(lab, &disc, &strip)?, fig5b(disc)?])
}

fn fig4(lab: &Lab<'_>) -> Result<Figure, Failure> {
    let times = [0.05, 1.0, 2.0];
    let depths = [0.05, 0.1, 1.0];
    let run = lab.run("fig4", "fig4", &["mesh.cells=400", "record.frame_times=[0.05,1.0,2.0]"])?;
    let mut panels = Vec::new();
    for time in times {
        let (t, points) = surface(&run, time)?;
        let mut curves = vec![curve("z = 0", points, 0)];
        for (i, z) in depths.into_iter().enumerate() {
            // beyond the front the target is at rest
            if z < t {
                let (_, points) = section(&run, "stress", time, z)?;
                curves.push(curve(format!("z = {z}"), points, i + 1));
            }
        }
        let mut panel = over_radius(&format!("t = {t:.3}"), curves);
        (panel.x_range, panel.y_range) = (Some((0.0, 1.5)), Some((0.0, 5.0)));
        panels.push(panel);
    }
    let (_, top) = surface(&run, 1.0)?;
    let peak = |z| section(&run, "stress", 1.0, z).map(|(_, points)| largest(&points));
    let (near, far) = (peak(0.05)?, peak(0.1)?);
    Ok(Figure {
        id: "4".into(),
        title: "flat punch on a half-space, stress over r at four depths".into(),
        text: "Depth slices from recorded field frames at the times of the paper (`record.frame_times`), the steps nearest to them. A \
               depth that the front has not reached has no curve. At the step at which a front arrives a node shows half its jump, and all of \
               it one step later: at t = 1 the curve of z = 1 is at one half where the front has just come."
            .into(),
        panels,
        statements: vec![
            statement(
                "stress at the surface is singular at the edge, and only near the surface",
                format!(
                    "largest at t = 1: {:.1} at z = 0 (last node), {:.2} at z = 0.05, {:.2} at z = 0.1",
                    largest(&top).1, near.1, far.1
                ),
                Verdict::that(largest(&top).1 > 2.0 * near.1 && near.1 > far.1),
                "at z = 0 it grows as Δr^(−½)",
            ),
            statement(
                "stress is V0 until the wave of the edge arrives",
                format!("p(0, 1) = {:.6}", at(&top, 0.1)),
                Verdict::of(at(&top, 0.1), 1.0, 1e-6),
                "closed form: plane wave",
            ),
        ],
        made: vec![run],
        ..Figure::default()
    })
}

fn fig5a(lab: &Lab<'_>, disc: &Made, strip: &Made) -> Result<Figure, Failure> {
    let run = lab.run("fig5", "fig5", &["mesh.cells=200"])?;
    let mut curves = vec![curve("drag F", series(&run, "/drag", "force")?, 5)];
    for (i, r) in [0.0, 0.5, 0.9, 0.95, 0.99].into_iter().enumerate() {
        curves.push(curve(format!("r = {r}"), probe(&run, r)?, i));
    }
    let mut panel = over_time("V0 = 1, h = 1, c_s = 0.5", curves);
    (panel.y_label, panel.y_range) = ("p [γc_p²], F [πR²γc_p²]".into(), Some((0.0, 30.0)));
    let drag_slope = |made: &Made| Ok::<f64, Failure>(slope(&series(made, "/drag", "force")?, 20.0, 40.0));
    let (round, plane) = (drag_slope(disc)?, drag_slope(strip)?);
    let closed_round = DiscStiffness::new(1.0, 0.5).drag_slope();
    let closed_plane = StripStiffness::new(1.0, 0.5).drag_slope();
    let step = metadata(&run, "percuss.run", "dt")?;
    // a front shows half its jump at its step, and all of it one step later
    let jumps: Vec<f64> = [2.0, 4.0]
        .iter()
        .map(|t| {
            let v = values(&run, 0.9, &[t - step, t + step])?;
            Ok(100.0 * (v[1] / v[0] - 1.0))
        })
        .collect::<Result<_, Failure>>()?;
    Ok(Figure {
        id: "5a".into(),
        title: "flat punch on a layer, drag and stress".into(),
        text: "The curve of r = 1 is left out: it is the value of the last node at the singular edge, twice as high on a mesh four times as \
               fine."
            .into(),
        panels: vec![panel],
        statements: vec![
            statement(
                "long times: F ~ A_d·t with A_d = 1.5",
                format!("{round:.4} for 20 < t < 40"),
                Verdict::of(round, 1.5, 0.03),
                format!("closed form (static disc on a layer) {closed_round:.5}"),
            ),
            statement(
                "the plane punch: A_d ~ 1, so that a column of the layer serves as a spring",
                format!("{plane:.4} for 20 < t < 40"),
                Verdict::of(plane, 1.0, 0.1),
                format!("closed form (static strip on a layer) {closed_plane:.5}; the limit 1 is that of a thin layer, h·c_s → 0"),
            ),
            statement(
                "the steps of reflections matter less and less",
                format!("at r = 0.9 they are {:.0} % at t = 2 and {:.0} % at t = 4, from the step before to the step after", jumps[0], jumps[1]),
                Verdict::that(jumps[1] < jumps[0]),
                "",
            ),
        ],
        made: vec![run, disc.clone(), strip.clone()],
        ..Figure::default()
    })
}

fn fig5b(disc: Made) -> Result<Figure, Failure> {
    let closed = DiscStiffness::new(1.0, 0.5);
    // slope of p at every node between two times 20 apart: remaining waves have little effect on it
    let (t0, early) = surface(&disc, 20.0)?;
    let (t1, late) = surface(&disc, 40.0)?;
    let computed: Vec<(f64, f64)> =
        early.iter().zip(&late).map(|(a, b)| (a.0, (b.1 - a.1) / (t1 - t0))).collect();
    let theory: Vec<(f64, f64)> = computed.iter().map(|p| (p.0, closed.pressure_slope(p.0))).collect();
    let worst = |limit: f64| {
        let inside = computed.iter().zip(&theory).filter(|(p, _)| p.0 < limit);
        inside.fold(0.0, |most: f64, (p, e)| most.max((p.1 / e.1 - 1.0).abs())) * 100.0
    };
    let (inner, outer) = (worst(0.9), worst(0.98));
    let mut panel = over_radius(
        "slope of stress at long times, h = 1, c_s = 0.5",
        vec![curve("computed", computed, 0), exact("closed form", theory)],
    );
    (panel.y_label, panel.y_range) = ("A [γc_p³/R]".into(), Some((0.0, 8.0)));
    Ok(Figure {
        id: "5b".into(),
        title: "flat punch on a layer, factor A(r) of stress at long times".into(),
        text: "p → A(r)·t. The closed form is the pressure under a static disc on a layer, from the same integral equation as A_d.".into(),
        panels: vec![panel],
        statements: vec![statement(
            "(a curve) A(r), rising to the singular edge",
            format!("A(0) = {:.4}", closed.pressure_slope(0.0)),
            Verdict::Given,
            format!("computed within {inner:.2} % of the closed form for r < 0.9, {outer:.1} % for r < 0.98"),
        )],
        made: vec![disc],
        ..Figure::default()
    })
}
