//! Figs. 8 and 9: flat punches of finite mass.

use percuss::study::Plan;
use percuss_picture::Panel;

use super::{convergence, in_words, kink};
use crate::{
    Failure,
    figure::{Figure, Statement, Verdict, curve, over_time, statement},
    lab::{Lab, Points, at, largest, metadata, probe, sections, series},
};

pub fn figures(lab: &Lab<'_>) -> Result<Vec<Figure>, Failure> {
    Ok(vec![fig8(lab)?, fig9(lab)?])
}

fn fig8(lab: &Lab<'_>) -> Result<Figure, Failure> {
    let stated = [("2.5", 3.03), ("5", 4.96), ("10", 9.36)];
    let (mut panels, mut made) = (Vec::new(), Vec::new());
    let mut statements: Vec<Statement> = Vec::new();
    let swept = lab.sweep("fig8", "fig8-m10", &["mesh.cells=200"], &["indenter.mass=2.5,5,10"], "all")?;
    for (number, (mass, t_ext)) in (1..).zip(stated) {
        let case = format!("fig8-m{mass}");
        let run = swept.recording(number)?;
        let mut curves = Vec::new();
        for (i, r) in [0.0, 0.5, 0.75, 0.9, 0.95].into_iter().enumerate() {
            curves.push(curve(format!("r = {r}"), probe(&run, r)?, i));
        }
        panels.push(over_time(&format!("M = {mass}: stress"), curves));
        let (drag, velocity) = (series(&run, "/drag", "force")?, series(&run, "/velocity", "velocity")?);
        let start = (drag[1].1, velocity[1].1);
        let last = drag.last().map_or(f64::NAN, |p| p.0);
        panels.push(Panel {
            title: format!("M = {mass}: drag and velocity"),
            x_label: "t [R/c_p]".into(),
            y_label: "F [πR²γc_p²], V [c_p]".into(),
            curves: vec![curve("drag F", drag, 5), curve("velocity V", velocity, 0)],
            ..Panel::default()
        });
        let cells = [50, 100, 200];
        let study = convergence(&case, &cells, &Plan::default())?;
        statements.push(statement(
            format!("M = {mass}: first tension at t_ext = {t_ext}"),
            format!("t = {last:.3}"),
            Verdict::of(last, t_ext, 0.05),
            format!(
                "{}. The indenter stops at {}",
                in_words(&study, "time of extension")?,
                in_words(&study, "time of rebound")?
            ),
        ));
        if mass == "5" {
            statements.push(statement(
                "at t = Δt: σ = V = 1, F = 1",
                format!("F = {:.4}, V = {:.4} after one step", start.0, start.1),
                Verdict::that((start.0 - 1.0).abs() < 0.02 && (start.1 - 1.0).abs() < 0.02),
                "both tend to 1 as Δt does to 0",
            ));
            let r = 0.5;
            let seen = kink(&probe(&run, r)?, 0.5, 1.5);
            statements.push(statement(
                "kinks where the wave of the edge arrives, t_r = 2(1 − r)",
                format!("at r = 0.5, t = {seen:.3}"),
                Verdict::of(seen, 1.0, 0.02),
                "(1 − r)/c_s = 1",
            ));
        }
        if number == 1 {
            made.push(run);
        }
    }
    let masses = lab.sweep(
        "fig8-masses",
        "fig8-m10",
        &["mesh.cells=100", "record.frames=0", "run.end_time=80"],
        &["indenter.mass=1:100:25:log"],
        "none",
    )?;
    let by_the_paper = stated.iter().filter_map(|(mass, t_ext)| Some((mass.parse().ok()?, *t_ext))).collect();
    panels.push(Panel {
        title: "first tension of the interface over the mass".into(),
        x_label: "M [πγR³]".into(),
        y_label: "t_ext [R/c_p]".into(),
        curves: vec![
            curve("computed", masses.points("indenter.mass", "t_ext", None), 0),
            curve("as the paper states", by_the_paper, 5),
        ],
        log_x: true,
        log_y: true,
        ..Panel::default()
    });
    Ok(Figure {
        id: "8".into(),
        title: "flat punches of mass 2.5, 5, 10 on a half-space".into(),
        text: "Runs stop at the first tension of the interface, as in the paper. Its times do not follow from its equations: they \
               differ from the computed ones, which have converged."
            .into(),
        panels,
        statements,
        made,
        commands: vec![masses.command],
        ..Figure::default()
    })
}

fn fig9(lab: &Lab<'_>) -> Result<Figure, Failure> {
    /// Largest strain of linear theory and wave speed of the paper's estimate.
    const LIMIT: f64 = 0.005;
    const WAVE_SPEED: f64 = 5000.0;
    // mass, largest stress, admissible V0 as the paper gives them
    let stated =
        [("1", 2.5, 21.1), ("2.5", 4.0, 13.4), ("5", 5.3, 9.9), ("10", 7.5, 6.9), ("100", 15.0, 3.3)];
    let (mut curves, mut statements, mut made) = (Vec::new(), Vec::new(), Vec::new());
    let masses = "indenter.mass=1,2.5,5,10,100,inf";
    let swept =
        lab.sweep("fig9", "fig9-m1", &["record.fields=[]"], &[masses, "mesh.cells=50,100,200"], "all")?;
    for (i, (mass, peak, velocity)) in stated.into_iter().enumerate() {
        let mut peaks = Vec::new();
        let simple = simple_difference(lab, &format!("fig9-m{mass}"))?;
        for number in 3 * i + 1..=3 * i + 3 {
            let run = swept.recording(number)?;
            let edge = probe(&run, 1.0)?;
            peaks.push(largest(&edge).1);
            if peaks.len() == 1 {
                curves.push(curve(format!("M = {mass}"), edge, i));
                made.push(run);
            }
        }
        let order = |i: usize| (peaks[i + 1] / peaks[i]).log2();
        statements.push(statement(
            format!("M = {mass}: largest stress at r = 1 about {peak}"),
            format!("{simple:.2} by the simple difference (u_0 − u_1)/Δz, {:.2} by momentum balance, as recorded", peaks[0]),
            Verdict::of(simple, peak, 0.1),
            format!(
                "recorded: {:.2}, {:.2}, {:.2} at Δ = 0.02, 0.01, 0.005: grows as Δ^(−{:.2}), −{:.2}; no mesh has the value, the edge is singular",
                peaks[0], peaks[1], peaks[2], order(0), order(1)
            ),
        ));
        let from_its_strain = LIMIT * WAVE_SPEED / peak;
        let strain = metadata(&made[i], "percuss.validity", "largest_strain")?;
        statements.push(statement(
            format!("M = {mass}: linear theory holds for V0 ≤ {velocity} m/s (strain 0.005, c_p = 5000 m/s)"),
            format!("{:.1} m/s from the recorded largest strain {strain:.2}, Δ = 0.02", LIMIT * WAVE_SPEED / strain),
            Verdict::of(LIMIT * WAVE_SPEED / strain, velocity, 0.2),
            format!(
                "0.005·c_p/{peak} = {from_its_strain:.1} m/s: the paper's speed is {:.2} times what its own strain gives",
                velocity / from_its_strain
            ),
        ));
    }
    curves.push(curve("M = ∞", probe(&swept.recording(3 * stated.len() + 1)?, 1.0)?, 5));
    // all of them come of one command
    made.truncate(1);
    let many = lab.sweep(
        "fig9-masses",
        "fig9-m1",
        &["record.fields=[]", "record.frames=0", "run.end_time=30"],
        &["indenter.mass=1:100:25:log"],
        "none",
    )?;
    let limit = |(mass, strain): (f64, f64)| (mass, LIMIT * WAVE_SPEED / strain);
    let computed = many.points("indenter.mass", "largest_strain", None).into_iter().map(limit).collect();
    let by_the_paper = stated.iter().filter_map(|(mass, _, velocity)| Some((mass.parse().ok()?, *velocity)));
    let admissible = Panel {
        title: "velocity up to which linear theory holds, Δ = 0.02, c_p = 5000 m/s".into(),
        x_label: "M [πγR³]".into(),
        y_label: "V0 [m/s]".into(),
        curves: vec![curve("computed", computed, 0), curve("as the paper states", by_the_paper.collect(), 5)],
        log_x: true,
        log_y: true,
        ..Panel::default()
    };
    let mut panel = over_time("r = 1, paper's mesh, Δ = 0.02, c_s = 0.5", curves);
    panel.y_range = Some((0.0, 20.0));
    Ok(Figure {
        id: "9".into(),
        title: "stress at the edge of flat punches on a half-space".into(),
        text: "On the paper's mesh, where a node sits at r = 1. The edge is singular; every value is one of the mesh.".into(),
        panels: vec![panel, admissible],
        statements,
        made,
        commands: vec![many.command],
        ..Figure::default()
    })
}

/// Largest strain (u_0 − u_1)/Δz at r = 1, Δ = 0.02, over frames: the difference of displacements at a singular stress.
fn simple_difference(lab: &Lab<'_>, case: &str) -> Result<f64, Failure> {
    const FRAMES: usize = 100;
    let frames = format!("record.frames={FRAMES}");
    let run = lab.run(
        &format!("{case}-displacement"),
        case,
        &["record.fields=[\"displacement\"]", "record.field_every=1", &frames, "run.end_time=8"],
    )?;
    let dz = metadata(&run, "percuss.run", "dz")?;
    let times: Vec<f64> = (1..FRAMES).map(|m| 8.0 * m as f64 / (FRAMES - 1) as f64).collect();
    let frames = sections(&run, "displacement", &times, &[0.0, dz])?;
    let strain = |rows: &Vec<Points>| (at(&rows[0], 1.0) - at(&rows[1], 1.0)) / dz;
    Ok(frames.iter().map(|(_, rows)| strain(rows)).fold(0.0, f64::max))
}
