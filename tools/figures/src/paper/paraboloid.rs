//! Figs. 2 and 3: paraboloids.

use percuss::{exact::paraboloid::Paraboloid, model::ModelKind};

use crate::{
    Failure,
    figure::{Figure, Verdict, curve, exact, over_time, statement},
    lab::{Lab, Made, at, largest, metadata, probe, rms, series},
};

pub fn figures(lab: &Lab<'_>) -> Result<Vec<Figure>, Failure> {
    let theory = lab.exact("fig2a", "fig2a", &[])?;
    let body = lab.run("fig2b", "fig2", &["mesh.cells=400"])?;
    Ok(vec![fig2a(lab, &theory)?, fig2b(lab, &theory, body)?, fig3b(lab)?])
}

/// Nodes per unit of length.
fn cells(made: &Made) -> Result<f64, Failure> {
    Ok(metadata(made, "percuss.run", "dr")?.recip())
}

fn fig2a(lab: &Lab<'_>, theory: &Made) -> Result<Figure, Failure> {
    let axis = probe(theory, 0.0)?;
    let twin = lab.exact("fig2-prescribed-exact", "fig2-prescribed", &["mesh.cells=400"])?;
    let computed = lab.run("fig2-prescribed", "fig2-prescribed", &["mesh.cells=400", "record.fields=[]"])?;
    let coarse_twin = lab.exact("fig2-prescribed-50-exact", "fig2-prescribed", &["mesh.cells=100"])?;
    let coarse = lab.run("fig2-prescribed-50", "fig2-prescribed", &["mesh.cells=100"])?;
    let simplified = probe(&twin, 0.0)?;
    let error = rms(&probe(&computed, 0.0)?, &simplified, |_| true);
    let coarse_error = rms(&probe(&coarse, 0.0)?, &probe(&coarse_twin, 0.0)?, |_| true);

    let jumps: Vec<f64> = [2.0, 4.0]
        .iter()
        .map(|&t| {
            let near = axis.windows(2).filter(|w| (w[0].0 - t).abs() < 0.2);
            near.max_by(|a, b| (a[1].1 - a[0].1).total_cmp(&(b[1].1 - b[0].1))).map_or(f64::NAN, |w| w[0].0)
        })
        .collect();
    let start = axis[1].1;
    Ok(Figure {
        id: "2a".into(),
        title: "paraboloid on a layer, prescribed motion, stress on the axis".into(),
        text: "Closed form of the full theory, [KA] Eq. 16, with its misprints corrected; beside it the same problem in the simplified \
               theory, computed and in closed form. The error of the computed curve hardly falls with the mesh: the closed form begins with a \
               contact that is infinitely fast and infinitely small, which no mesh resolves, and the waves of these first nodes meet on the \
               axis."
            .into(),
        panels: vec![over_time(
            "r = 0, V0 = 0.1, k = 0.2, h = 1, c_s = 0.5",
            vec![
                curve("full theory, Eq. 16", axis, 0),
                curve("simplified theory, computed", probe(&computed, 0.0)?, 1),
                exact("simplified theory, closed form", simplified),
            ],
        )],
        statements: vec![
            statement("p(0+) = αV0 = 0.1", format!("{start:.4} one step later"), Verdict::of(start, 0.1, 0.02), "closed form"),
            statement(
                "fronts of reflections at t = 2mh",
                format!("steepest at t = {:.3} and {:.3}", jumps[0], jumps[1]),
                Verdict::that((jumps[0] - 2.0).abs() < 0.01 && (jumps[1] - 4.0).abs() < 0.01),
                "closed form",
            ),
            statement(
                "(not in the paper) simplified theory, computed against closed form",
                format!(
                    "rms {:.3} % at mesh.cells = {:.0}, {:.3} % at {:.0}",
                    100.0 * coarse_error,
                    cells(&coarse)?,
                    100.0 * error,
                    cells(&computed)?
                ),
                Verdict::Given,
                "all steps, t ≤ 6",
            ),
        ],
        made: vec![theory.clone(), twin, computed, coarse_twin, coarse],
        ..Figure::default()
    })
}

/// Times at which contact reaches nodes, linear between them, from the contact radius: the outer face of the last cell.
fn contact_times(made: &Made, radii: [f64; 3]) -> Result<[f64; 3], Failure> {
    let half = 0.5 * metadata(made, "percuss.run", "dr")?;
    // the first step of every node
    let mut reached = series(made, "/drag", "contact_radius")?;
    reached.dedup_by(|later, earlier| later.1 <= earlier.1);
    let nodes: Vec<(f64, f64)> = reached.iter().map(|p| (p.1 - half, p.0)).collect();
    Ok(radii.map(|r| at(&nodes, r)))
}

fn fig2b(lab: &Lab<'_>, theory: &Made, body: Made) -> Result<Figure, Failure> {
    let radii = [0.4, 0.6, 0.8];
    let coarser = [100, 200].map(|cells| {
        lab.run(&format!("fig2b-{cells}"), "fig2", &[&format!("mesh.cells={cells}"), "record.fields=[]"])
    });
    let [first, second] = coarser;
    let (first, second) = (first?, second?);
    let times = [contact_times(&first, radii)?, contact_times(&second, radii)?, contact_times(&body, radii)?];
    let stated = [1.13, 2.66, 4.45];
    let mut statements: Vec<_> = (0..3)
        .map(|i| {
            statement(
                format!("contact reaches r = {} at t = {}", radii[i], stated[i]),
                format!("t = {:.3}", times[2][i]),
                Verdict::of(times[2][i], stated[i], 0.025),
                format!("{:.3}, {:.3}, {:.3} at 100, 200, 400 cells", times[0][i], times[1][i], times[2][i]),
            )
        })
        .collect();
    let at_five = |made: &Made| Ok::<f64, Failure>(at(&probe(made, 0.0)?, 5.0));
    let (full, coarser, finest) = (at_five(theory)?, at_five(&second)?, at_five(&body)?);
    let twin = Paraboloid::new(ModelKind::Rakhmatulin, 0.1, 0.2, 0.5, Some(1.0))?.axis_pressure(0.0, 5.0)?;
    let percent = |p: f64| 100.0 * (p / full - 1.0);
    statements.push(statement(
        "stress on the axis higher than in Fig. 2a, by about 6 % at most, near t = 5",
        format!("p(0, 5) = {finest:.4}, {:.0} % above Fig. 2a, {full:.4}", percent(finest)),
        Verdict::that((percent(finest) - 6.0).abs() < 1.5),
        format!(
            "{coarser:.4}, {finest:.4} at 200, 400 cells; closed form of the simplified theory with prescribed motion {twin:.4}, {:.0} % \
             above. Both ends of the comparison are known in closed form: the two theories differ by more than the paper says",
            percent(twin)
        ),
    ));
    let colours = [0.0, 0.2, 0.4, 0.6, 0.8].into_iter().enumerate();
    let curves = colours.map(|(i, r)| Ok(curve(format!("r = {r}"), probe(&body, r)?, i)));
    let curves = curves.collect::<Result<Vec<_>, Failure>>()?;
    Ok(Figure {
        id: "2b".into(),
        title: "paraboloid on a layer, unilateral contact".into(),
        text: "The surface sinks ahead of the contact once that is slower than the waves, t > 0.2, and contact is late.".into(),
        panels: vec![over_time("V0 = 0.1, k = 0.2, h = 1, c_s = 0.5", curves)],
        statements,
        made: vec![body, first, second],
        ..Figure::default()
    })
}

fn fig3b(lab: &Lab<'_>) -> Result<Figure, Failure> {
    let run = lab.run("fig3b", "fig3", &["mesh.cells=200"])?;
    let closed = lab.exact("fig3b-exact", "fig3", &["mesh.cells=200"])?;
    let fine = lab.run("fig3b-fine", "fig3", &["mesh.cells=400", "record.fields=[]"])?;
    let mut curves = Vec::new();
    for (i, r) in [0.0, 0.5, 0.75, 0.9, 0.95].into_iter().enumerate() {
        curves.push(curve(format!("r = {r}"), probe(&run, r)?, i));
    }
    let edge = probe(&run, 1.0)?;
    curves.push(curve("½·p at r = 1", edge.iter().map(|p| (p.0, 0.5 * p.1)).collect(), 5));
    let known = probe(&closed, 0.0)?;
    curves.push(exact("closed form, r = 0", known));
    let at_time = |r: f64| Ok::<f64, Failure>(at(&probe(&run, r)?, 1.9));
    let flatness = (at_time(0.75)? / at_time(0.0)? - 1.0) * 100.0;
    let near_edge = (at_time(0.95)? / at_time(0.75)? - 1.0) * 100.0;
    let growth = largest(&probe(&fine, 1.0)?).1 / largest(&edge).1;
    Ok(Figure {
        id: "3b".into(),
        title: "cylinder with a paraboloid head on a layer".into(),
        text: "The closed form holds until the wave of the edge arrives at r = 0.".into(),
        panels: vec![over_time("k = 2.5, R = 1, V0 = 1, h = 1, c_s = 0.5", curves)],
        statements: vec![
            statement(
                "stress changes slightly over 0 < r < 0.75 and rapidly near the edge",
                format!(
                    "at t = 1.9: {flatness:+.0} % from r = 0 to 0.75, {near_edge:+.0} % from 0.75 to 0.95"
                ),
                Verdict::that(near_edge.abs() > flatness.abs()),
                "",
            ),
            statement(
                "the curve of r = 1 is drawn at half its height",
                format!(
                    "its maximum grows by a factor {growth:.3} from 200 to 400 cells: the edge is singular, p ~ Δr^(−½)"
                ),
                Verdict::Given,
                "√2 = 1.414",
            ),
        ],
        made: vec![run, closed, fine],
        ..Figure::default()
    })
}
