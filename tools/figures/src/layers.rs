//! The page of layered targets: a ball on alumina, epoxy and aluminium, in both theories.

use percuss::{case::Case, session, simulation::Simulation, units::Units, view::View};
use percuss_picture::{Curve, Image, Layer, Panel, Side};
use rayon::prelude::*;

use crate::{
    Failure, Progress,
    figure::{Figure, curve},
    lab::{Points, largest},
    page::{Page, Table},
};

/// The case of the page, the thickness of its first layer \[mm\], and of its adhesive.
const CASE: &str = "laminate-armour";
const CERAMIC: f64 = 10.0;
const ADHESIVE: f64 = 0.2;
/// The theories: name, `model`, and cells that give both about as many rows.
const THEORIES: [(&str, &str, usize); 2] =
    [("full theory", "elastic", 60), ("simplified theory", "rakhmatulin", 96)];
/// Thicknesses of the adhesive \[mm\].
const THICKNESSES: [f64; 7] = [0.1, 0.15, 0.2, 0.3, 0.5, 0.8, 1.2];
/// End of the runs.
const END: &str = "9 us";
/// Columns of a wave diagram, about.
const COLUMNS: u64 = 400;
/// Stress at the ends of the colours of a wave diagram \[MPa\]: the contact itself is far above what arrives below.
const COLOURS: (f64, f64) = (-300.0, 300.0);

const INTRODUCTION: &str = "\
A steel ball of 10 mm strikes 10 mm of alumina, glued with 0.2 mm of epoxy to 15 mm of aluminium, at 50 m/s: the built-in case \
`laminate-armour`. Stress is −σ_zz, compression is positive; layers hold together in tension. Thick curves are the full theory, dashed ones of the same \
colour the simplified one. Every number on this page was computed for it.";

/// What a run shows, in mm, µs, MPa and kN.
struct Run {
    drag: Points,
    /// Stress on the axis at the upper and the lower face of the adhesive.
    faces: [Points; 2],
    /// Velocity of the middle of the back \[m/s\].
    back: Points,
    diagram: Image,
}

/// Settings of a run.
fn settings((_, model, cells): (&str, &str, usize), adhesive: f64, back: &str) -> Vec<String> {
    let below = CERAMIC + adhesive;
    vec![
        format!("model={model}"),
        format!("mesh.cells={cells}"),
        format!("run.end_time=\"{END}\""),
        "run.stop=never".into(),
        format!("target.back={back}"),
        format!("target.layer.2.thickness=\"{adhesive:?} mm\""),
        format!(
            "record.points=[[\"0 mm\",\"{CERAMIC:?} mm\"],[\"0 mm\",\"{below:?} mm\"],[\"0 mm\",\"{:?} mm\"]]",
            below + 15.0
        ),
        "record.frames=0".into(),
        "record.fields=[]".into(),
        "record.views=[]".into(),
    ]
}

fn run(theory: (&str, &str, usize), adhesive: f64, back: &str) -> Result<Run, Failure> {
    let case = Case::load(CASE, &settings(theory, adhesive, back))?;
    let (grid, Units { length, time, speed, stress, force, .. }) = (case.grid(), case.units());
    let every = (case.sizes.steps / COLUMNS).max(1);
    let (mut drag, mut faces, mut velocity) = (Points::new(), [Points::new(), Points::new()], Points::new());
    let (mut times, mut columns) = (Vec::new(), Vec::new());
    let mut look = |view: &View<'_>| {
        let t = 1e6 * time.of(view.time);
        drag.push((t, 1e-3 * force.of(view.drag)));
        let Some(gauges) = &view.gauges else { return };
        for (face, point) in faces.iter_mut().zip(&gauges.points) {
            face.push((t, 1e-6 * stress.of(point.stress)));
        }
        velocity.extend(gauges.points.last().map(|point| (t, speed.of(point.velocity))));
        if let Some(line) = gauges.lines.first().filter(|_| view.step.is_multiple_of(every)) {
            times.push(t);
            columns.push(line.iter().map(|p| 1e-6 * stress.of(*p)).collect::<Vec<f64>>());
        }
    };
    session::run(&mut Simulation::new(&case), &mut [&mut look])?;
    let depths: Vec<f64> = (0..=grid.nz).map(|j| 1e3 * length.of(grid.z(j))).collect();
    let values = (0..depths.len()).flat_map(|j| columns.iter().map(move |column| column[j])).collect();
    let layers = case.target.layers.iter().zip(&grid.layers).map(|(layer, rows)| Layer {
        name: layer.name.clone(),
        top: 1e3 * length.of(rows.top),
        bottom: 1e3 * length.of(grid.z(rows.last())),
    });
    let diagram = Image {
        title: format!("Stress on the axis, {}, {back} back", theory.0),
        value_label: "p = −σ_zz [MPa]".into(),
        row_label: "z [mm]".into(),
        column_label: "t [µs]".into(),
        rows: Side::Listed(depths.into()),
        columns: Side::Listed(times.into()),
        values,
        layers: layers.collect(),
        ..Image::default()
    };
    Ok(Run { drag, faces, back: velocity, diagram })
}

/// Computes the page.
pub fn page(progress: &Progress) -> Result<Page, Failure> {
    progress.next("layers: both theories, both backs");
    let pairs =
        [(THEORIES[0], "free"), (THEORIES[1], "free"), (THEORIES[0], "rigid"), (THEORIES[1], "rigid")];
    let runs = pairs.par_iter().with_max_len(1).map(|(theory, back)| run(*theory, ADHESIVE, back));
    let runs: [Run; 4] = match runs.collect::<Result<Vec<Run>, Failure>>()?.try_into() {
        Ok(runs) => runs,
        Err(_) => unreachable!("as many runs as pairs"),
    };
    progress.next("layers: thickness of the adhesive");
    let jobs: Vec<_> = THEORIES.iter().flat_map(|theory| THICKNESSES.map(|mm| (*theory, mm))).collect();
    let peaks = jobs.par_iter().with_max_len(1).map(|(theory, mm)| {
        let run = run(*theory, *mm, "free")?;
        let highest = run.faces.each_ref().map(|face| largest(face).1);
        let lowest = run.faces.each_ref().map(|face| face.iter().map(|p| p.1).fold(0.0, f64::min));
        Ok([highest, lowest])
    });
    let peaks = peaks.collect::<Result<Vec<[[f64; 2]; 2]>, Failure>>()?;
    let commands: Vec<String> =
        pairs.iter().map(|(theory, back)| command(&settings(*theory, ADHESIVE, back))).collect();
    let diagrams = ["full", "simplified"].into_iter().zip(&runs).map(|(name, run)| Figure {
        id: format!("layers-waves-{name}"),
        title: run.diagram.title.clone(),
        text: format!(
            "A row per depth, a column per step or two; interfaces are lines. The colours end at ±{} MPa, and what is beyond has the colour of the end.",
            COLOURS.1
        ),
        image: Some((run.diagram.clone(), COLOURS)),
        commands: vec![command(&settings(pairs[usize::from(name == "simplified")].0, ADHESIVE, "free"))],
        ..Figure::default()
    });
    let figures = diagrams.chain([theories(&runs, &commands), backs(&runs, &commands), adhesive(&peaks)]);
    Ok(Page {
        title: "Layered targets",
        introduction: vec![INTRODUCTION.into()],
        figures: figures.collect(),
        tables: vec![table(&peaks)],
        ending: String::new(),
    })
}

/// The command of a run.
fn command(settings: &[String]) -> String {
    let set = |setting: &String| format!(" --set '{setting}'");
    format!("percuss run {CASE}{}", settings.iter().map(set).collect::<String>())
}

/// A diagram over time.
fn panel(title: &str, y_label: &str, curves: Vec<Curve>) -> Panel {
    Panel {
        title: title.into(),
        x_label: "t [µs]".into(),
        y_label: y_label.into(),
        curves,
        ..Panel::default()
    }
}

fn dashed(curve: Curve) -> Curve {
    Curve { dashed: true, ..curve }
}

fn theories([full, simplified, ..]: &[Run; 4], commands: &[String]) -> Figure {
    let both = |name: &str, take: fn(&Run) -> &Points, colour: usize| {
        [
            curve(name, take(full).clone(), colour),
            dashed(curve(format!("{name}, simplified"), take(simplified).clone(), colour)),
        ]
    };
    let faces =
        [both("above the adhesive", |run| &run.faces[0], 0), both("below it", |run| &run.faces[1], 1)];
    Figure {
        id: "layers-theories".into(),
        title: "The simplified against the full theory, free back".into(),
        text: format!(
            "The largest drag of the simplified theory is {} of the full theory's, the largest stress above the adhesive {}. What is left of mesh noise, \
             from the edge of contact that moves over the nodes, meets again on the axis.",
            percent(simplified, full, |run| &run.drag),
            percent(simplified, full, |run| &run.faces[0])
        ),
        panels: vec![
            panel("Drag", "F [kN]", both("drag", |run| &run.drag, 2).into()),
            panel("Stress at the faces of the adhesive, r = 0", "p = −σ_zz [MPa]", faces.concat()),
        ],
        commands: commands[..2].to_vec(),
        ..Figure::default()
    }
}

/// The largest value of a curve of a run, in % of another run's.
fn percent(run: &Run, other: &Run, take: fn(&Run) -> &Points) -> String {
    format!("{:.0} %", 100.0 * largest(take(run)).1 / largest(take(other)).1)
}

fn backs([free, simplified, rigid, simplified_rigid]: &[Run; 4], commands: &[String]) -> Figure {
    let curves = |take: fn(&Run) -> &Points| {
        vec![
            curve("free back", take(free).clone(), 0),
            dashed(curve("free back, simplified", take(simplified).clone(), 0)),
            curve("rigid back", take(rigid).clone(), 1),
            dashed(curve("rigid back, simplified", take(simplified_rigid).clone(), 1)),
        ]
    };
    Figure {
        id: "layers-backs".into(),
        title: "Free against rigid back".into(),
        text: "Until waves have come back from there both are one. A free back returns compression as tension, a rigid one as compression."
            .into(),
        panels: vec![
            panel("Drag", "F [kN]", curves(|run| &run.drag)),
            panel("Stress below the adhesive, r = 0", "p = −σ_zz [MPa]", curves(|run| &run.faces[1])),
            panel("Velocity of the back, r = 0", "v [m/s]", curves(|run| &run.back)),
        ],
        commands: commands.to_vec(),
        ..Figure::default()
    }
}

fn adhesive(peaks: &[[[f64; 2]; 2]]) -> Figure {
    let curves = |which: usize| {
        let mut curves = Vec::new();
        for (face, name) in ["above", "below"].into_iter().enumerate() {
            for (theory, peaks) in peaks.chunks(THICKNESSES.len()).enumerate() {
                let points = THICKNESSES.into_iter().zip(peaks.iter().map(|peaks| peaks[which][face]));
                let text = format!("{name}, {}", THEORIES[theory].0);
                curves.push(Curve { dashed: theory == 1, ..curve(text, points.collect(), face) });
            }
        }
        curves
    };
    let over = |title: &str, which: usize| Panel {
        x_label: "thickness of the adhesive [mm]".into(),
        ..panel(title, "p = −σ_zz [MPa]", curves(which))
    };
    Figure {
        id: "layers-adhesive".into(),
        title: "Stress at the adhesive against its thickness, free back".into(),
        text: format!("Over the first {END} of the impact, on the axis.").replace("us", "µs"),
        panels: vec![over("Largest compression", 0), over("Largest tension", 1)],
        commands: vec![command(&settings(THEORIES[0], ADHESIVE, "free")).replace("\"0.2 mm\"", "\"T mm\"")],
        ..Figure::default()
    }
}

fn table(peaks: &[[[f64; 2]; 2]]) -> Table {
    let heading =
        ["thickness [mm]", "above, full", "below, full", "below, simplified", "tension below, full"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    let (full, simplified) = peaks.split_at(THICKNESSES.len());
    for (mm, (full, simplified)) in THICKNESSES.iter().zip(full.iter().zip(simplified)) {
        let values = [full[0][0], full[0][1], simplified[0][1], full[1][1]].map(|p| format!("{p:.0}"));
        rows.push(std::iter::once(mm.to_string()).chain(values).collect());
    }
    Table {
        title: "Stress at the adhesive on the axis".into(),
        text: "Largest −σ_zz in MPa; tension is negative.".into(),
        rows,
    }
}
