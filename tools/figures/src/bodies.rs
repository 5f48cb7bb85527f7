//! The page of indenters that give: bars against rays and one-dimensional theory, and a ball against Hertz with both moduli.

use std::{f64::consts::PI, path::Path};

use percuss::{
    case::{Case, Target},
    exact::hertz::Hertz,
    session,
    simulation::Simulation,
    view::View,
};
use percuss_picture::Panel;

use crate::{
    Failure, Progress,
    closed_forms::collision::{Collision, Layer},
    figure::{Figure, curve, exact},
    lab::{Points, largest},
    page::{Page, Table, code},
};

/// A specimen between two bars, as a user would write it.
const HOPKINSON: &str = "\
title = \"PMMA between bars of steel\"
model = \"elastic\"
[target]
radius = \"10 mm\"
[[target.layer]]
thickness = \"5 mm\"
material = \"pmma\"
[[target.layer]]
thickness = \"half-space\"
material = \"steel\"
bond = \"sliding\"
[indenter]
shape = \"flat\"
radius = \"10 mm\"
[[indenter.body.layer]]
thickness = \"200 mm\"
material = \"steel\"
[impact]
velocity = \"5 m/s\"
[mesh]
cells = 8
[run]
end_time = \"200 us\"
[record]
points = [[\"0 mm\", \"105 mm\"]]
frames = 0
";

/// A ball, as a user would write it.
const BALL: &str = "\
title = \"Ball of steel on aluminium\"
model = \"elastic\"
[target]
thickness = \"half-space\"
material = \"aluminium\"
[indenter]
shape = \"sphere\"
nose_radius = \"5 mm\"
material = \"steel\"
[impact]
velocity = \"10 m/s\"
[mesh]
contact_cells = 20
[run]
end_time = \"34 us\"
stop = \"separation\"
[record]
frames = 0
";

/// End of the time axis of the bars \[µs\].
const END: f64 = 200.0;
/// Cells across the radius of a bar, and the fewest that a radius may have.
const CELLS: (usize, usize) = (8, 5);
/// The built-in case of two bars.
const BAR: &str = "bar";
/// When its pressure is averaged \[µs\]: after the front, before what comes from the rear.
const PLATEAU: (f64, f64) = (20.0, 100.0);
/// When the stress at the gauge is averaged \[µs\]: what the rear of the striker returns is not there yet.
const GAUGE_PLATEAU: (f64, f64) = (70.0, 80.0);

const INTRODUCTION: &str = "\
An indenter with a `[indenter.body]`, or `body = \"elastic\"`, has waves of its own. Bars whose rims slide in a smooth guide stay in uniaxial strain, and the sum of \
rays is exact; bars with free rims carry long waves as rods do, in uniaxial stress, and shorter ones later; a ball on a half-space is that of Hertz \
with the moduli of both. Every computed number on this page was computed for it, and every closed form from the constants of its case.";

/// What a run shows, in µs, kN and MPa.
#[derive(Default)]
struct Seen {
    drag: Points,
    /// Stress at the first point, if there is one.
    gauge: Points,
}

fn run(case: &Case) -> Result<Seen, Failure> {
    let units = case.units();
    let mut seen = Seen::default();
    let mut look = |view: &View<'_>| {
        let t = 1e6 * units.time.of(view.time);
        seen.drag.push((t, 1e-3 * units.force.of(view.drag)));
        let point = view.gauges.as_ref().and_then(|gauges| gauges.points.first());
        seen.gauge.extend(point.map(|point| (t, 1e-6 * units.stress.of(point.stress))));
    };
    session::run(&mut Simulation::new(case), &mut [&mut look])?;
    Ok(seen)
}

/// The command of a run.
fn command(case: &str, settings: &[String]) -> String {
    let set = |setting: &String| {
        let quote = if setting.contains(['"', '[']) { "'" } else { "" };
        format!(" --set {quote}{setting}{quote}")
    };
    format!("percuss run {case}{}", settings.iter().map(set).collect::<String>())
}

/// Computes the page.
///
/// * `coarser`: meshes are so many times as coarse
pub fn page(progress: &Progress, coarser: usize) -> Result<Page, Failure> {
    let mut rows = vec![["", "closed form", "computed", "difference"].map(str::to_owned).to_vec()];
    let hopkinson = hopkinson(progress, coarser, &mut rows)?;
    let command = bars(progress, coarser, &mut rows)?;
    let balls = balls(progress, coarser, &mut rows)?;
    let text = format!(
        "The stress at the gauge is averaged from {:?} to {:?} µs, the pressure of two bars from {:?} to {:?} µs. These are the built-in case `{BAR}`: `{command}`. \
         In one dimension their pressure is γc_bV/2 with c_b = √(E/γ), until waves have been to the rear of the striker and back; here short waves \
         trail behind, and the pressure falls for some microseconds. A ball that gives is computed as a cylinder with the ball's head.",
        GAUGE_PLATEAU.0, GAUGE_PLATEAU.1, PLATEAU.0, PLATEAU.1,
    );
    Ok(Page {
        title: "Indenters that give: bars and a ball",
        introduction: vec![
            INTRODUCTION.to_owned(),
            "This is `hopkinson.toml`:".to_owned(),
            code(HOPKINSON),
            "and this `ball.toml`:".to_owned(),
            code(BALL),
        ],
        figures: vec![hopkinson, balls],
        tables: vec![Table { title: "Bars and balls in numbers".into(), text, rows }],
        ending: String::new(),
    })
}

/// A row of the table.
fn row(what: &str, unit: &str, decimals: usize, expected: f64, computed: f64) -> Vec<String> {
    vec![
        what.to_owned(),
        format!("{expected:.decimals$} {unit}"),
        format!("{computed:.decimals$} {unit}"),
        format!("{:+.2} %", 100.0 * (computed / expected - 1.0)),
    ]
}

/// Mean over time of a curve that is a step function or close to a straight line between its points.
fn mean(points: &Points, (from, to): (f64, f64)) -> f64 {
    let parts = points.windows(2).map(|pair| {
        let [t0, t1] = [pair[0].0.clamp(from, to), pair[1].0.clamp(from, to)];
        0.5 * (pair[0].1 + pair[1].1) * (t1 - t0)
    });
    parts.sum::<f64>() / (to - from)
}

/// The time of the last step with more than `value`.
fn last_above(points: &Points, value: f64) -> f64 {
    points.iter().rfind(|point| point.1 > value).map_or(f64::NAN, |point| point.0)
}

/// Plane waves in a stack: how fast they run.
#[derive(Clone, Copy)]
enum Waves {
    /// In uniaxial strain, with c_p.
    Guided,
    /// In uniaxial stress, with √(E/γ).
    Rod,
}

/// The layers of a body in a physical case, for [`Collision`].
fn stack(case: &Case, body: &Target, waves: Waves) -> Vec<Layer> {
    let c_p = case.units().speed.scale;
    let layers = body.layers.iter().map(|layer| {
        let material = layer.si.as_ref().expect("a physical case");
        let speed = match waves {
            Waves::Guided => layer.wave_speed,
            Waves::Rod => (material.engineering().0[1] / material.density).sqrt() / c_p,
        };
        (layer.density * speed, layer.thickness.map_or(f64::INFINITY, |thickness| thickness / speed))
    });
    layers.collect()
}

/// The sum of rays at the gauge of a case of two layers, µs and MPa.
fn rays(case: &Case, waves: Waves) -> Points {
    let (target, units) = (&case.target, case.units());
    let striker = case.indenter.striker.as_ref().expect("a striker");
    let mut below = stack(case, target, waves);
    let (impedance, _) = below.pop().expect("the bar");
    let specimen = target.layers[0].thickness.expect("a specimen");
    let depth = case.gauges().points[0][1] - specimen;
    let speed = impedance / target.layers[1].density;
    below.extend([(impedance, depth / speed), (impedance, f64::INFINITY)]);
    let until = case.run.end_time;
    let steps = Collision::new(&stack(case, &striker.body, waves), &below, 0.0).pressure_below(2, until);
    let mut points = Points::new();
    for (time, pressure) in steps {
        let before = points.last().map_or(0.0, |last: &(f64, f64)| last.1);
        points.extend([(time, before), (time, pressure)]);
    }
    points.push((until, points.last().map_or(0.0, |last| last.1)));
    let scale = 1e-6 * units.stress.of(case.impact.velocity);
    points.into_iter().map(|(time, pressure)| (1e6 * units.time.of(time), scale * pressure)).collect()
}

/// Cells across the radius of a bar on meshes so many times as coarse.
fn cells(coarser: usize) -> usize {
    (CELLS.0 / coarser).max(CELLS.1)
}

/// A specimen between bars: guided and free rims.
fn hopkinson(progress: &Progress, coarser: usize, rows: &mut Vec<Vec<String>>) -> Result<Figure, Failure> {
    let mut figure = Figure {
        id: "-bodies-hopkinson".into(),
        title: "a specimen between a striker and a bar".into(),
        text: "Stress on the axis of a long bar of steel, 100 mm below a lubricated specimen of PMMA of 5 mm, which a bar of steel of 200 mm and the same radius, \
               10 mm, strikes at 5 m/s. Dashes are sums of rays, with free rims of rods, in which waves run \
               with √(E/γ); each of their steps is a wave that has been to and fro in the specimen. At the end the striker leaves the specimen, which rings."
            .into(),
        ..Figure::default()
    };
    let mut curves = Vec::new();
    let rims = [("guided", Waves::Guided, "rays"), ("free", Waves::Rod, "")];
    for (colour, (rim, waves, name)) in rims.into_iter().enumerate() {
        let settings = [format!("target.rim={rim}"), format!("mesh.cells={}", cells(coarser))];
        let command = command("hopkinson.toml", &settings);
        progress.next(&command);
        let case = Case::parse("hopkinson", HOPKINSON, &settings, Path::new(""))?;
        let (gauge, rays) = (run(&case)?.gauge, rays(&case, waves));
        rows.push(row(
            &format!("stress at the gauge, {rim} rims"),
            "MPa",
            2,
            mean(&rays, GAUGE_PLATEAU),
            mean(&gauge, GAUGE_PLATEAU),
        ));
        curves.extend([curve(format!("{rim} rims"), gauge, colour), exact(name, rays)]);
        figure.commands.push(command);
    }
    figure.panels = vec![Panel {
        title: "Transmitted stress".into(),
        x_label: "t [µs]".into(),
        y_label: "p = −σ_zz [MPa]".into(),
        x_range: Some((0.0, END)),
        curves,
        ..Panel::default()
    }];
    Ok(figure)
}

/// Two bars with free rims; gives the command.
fn bars(progress: &Progress, coarser: usize, rows: &mut Vec<Vec<String>>) -> Result<String, Failure> {
    let settings = [
        format!("mesh.cells={}", cells(coarser)),
        "run.end_time=\"130 us\"".into(),
        "record.frames=0".into(),
        "record.lines=[]".into(),
    ];
    let command = command(BAR, &settings);
    progress.next(&command);
    let case = Case::load(BAR, &settings)?;
    let units = case.units();
    let striker = &case.indenter.striker.as_ref().expect("a striker").body;
    let [(impedance, crossing)] = stack(&case, striker, Waves::Rod)[..] else {
        unreachable!("one layer of the striker")
    };
    let pressure = 1e-6 * units.stress.of(0.5 * impedance * case.impact.velocity);
    let duration = 1e6 * units.time.of(2.0 * crossing);
    let radius = units.length.of(case.target.radius.expect("a bar"));
    // from kN
    let per_area = 1e-3 / (PI * radius * radius);
    let seen: Points = run(&case)?.drag.into_iter().map(|(time, drag)| (time, per_area * drag)).collect();
    let computed = mean(&seen, PLATEAU);
    rows.extend([
        row("pressure between two bars", "MPa", 1, pressure, computed),
        row("time until it is half of that", "µs", 2, duration, last_above(&seen, 0.5 * computed)),
        row("contact of two bars", "µs", 2, duration, last_above(&seen, 0.0)),
    ]);
    Ok(command)
}

/// A ball, rigid and not, on a half-space.
fn balls(progress: &Progress, coarser: usize, rows: &mut Vec<Vec<String>>) -> Result<Figure, Failure> {
    let mut figure = Figure {
        id: "-bodies-ball".into(),
        title: "a rigid and an elastic ball".into(),
        text: "A ball of steel, 10 mm, on a half-space of aluminium at 10 m/s. Dashes are Hertz, of the target's modulus alone and of both; what waves carry away, \
               and vibrations of the ball, are not in them."
            .into(),
        ..Figure::default()
    };
    let mut curves = Vec::new();
    for (colour, body) in ["rigid", "elastic"].into_iter().enumerate() {
        let settings = [format!("indenter.body={body}"), format!("mesh.contact_cells={}", 20 / coarser)];
        let command = command("ball.toml", &settings);
        progress.next(&command);
        let case = Case::parse("ball", BALL, &settings, Path::new(""))?;
        let seen = run(&case)?.drag;
        let hertz = Hertz::of(&case).expect("a ball");
        let units = case.units();
        let (force, duration) = (1e-3 * units.force.of(hertz.largest_force()), hertz.duration());
        rows.extend([
            row(&format!("peak force, {body} ball"), "kN", 3, force, largest(&seen).1),
            row(
                &format!("contact, {body} ball"),
                "µs",
                2,
                1e6 * units.time.of(duration),
                last_above(&seen, 0.0),
            ),
        ]);
        /// Points of the closed form.
        const POINTS: usize = 200;
        let times = (0..=POINTS).map(|k| k as f64 / POINTS as f64 * duration * (1.0 - 1e-9));
        let motion = times.map(|time| {
            let depth = hertz.motion(time)?.depth;
            Ok((1e6 * units.time.of(time), 1e-3 * units.force.of(hertz.force(depth))))
        });
        let closed = motion.collect::<Result<Points, percuss::exact::ExactError>>()?;
        let name = if colour == 0 { "Hertz" } else { "" };
        curves.extend([curve(format!("{body} ball"), seen, colour), exact(name, closed)]);
        figure.commands.push(command);
    }
    figure.panels = vec![Panel {
        title: "Contact force".into(),
        x_label: "t [µs]".into(),
        y_label: "F [kN]".into(),
        curves,
        ..Panel::default()
    }];
    Ok(figure)
}
