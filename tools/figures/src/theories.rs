//! The page that compares the simplified with the full theory.
//!
//! Both theories compute the same problems at several shear wave speeds, on meshes with as many nodes over the depth: `runs`.

use std::ops::RangeInclusive;

use percuss::{exact::paraboloid::Paraboloid, model::ModelKind};
use percuss_picture::{Curve, Image, Panel, Side};

use crate::{
    Failure, Progress,
    figure::{Figure, curve, over_time},
    lab::{Points, at, largest},
    page::{Page, Table},
};

mod runs;

use runs::{Pair, Problem, Run};

/// Shear wave speeds of the curves \[c_p\].
const CURVES: [f64; 6] = [0.2, 0.3, 0.4, 0.5, 0.6, 0.65];
/// Shear wave speeds of the maps: the first, their distance, their number.
const MAP: (f64, f64, usize) = (0.1, 0.05, 15);
/// Times of the table of errors \[R/c_p\].
const TIMES: [f64; 9] = [0.25, 0.5, 0.75, 1.0, 1.5, 1.9, 3.0, 5.0, 11.0];
/// End of the curves, before the front of a reflection \[R/c_p\].
const UNTIL: f64 = 5.95;
/// Distance of the times in the maps \[R/c_p\].
const MAP_STEP: f64 = 0.1;
/// Errors at the ends of the colours \[%\].
const MAP_COLOURS: (f64, f64) = (0.0, 100.0);

const INTRODUCTION: &str = "\
The simplified theory of the paper has one displacement, along the impact; the full theory of elasticity has two. Here both compute the same \
impacts for shear waves of c_s = β·c_p. In terms of Poisson's ratio β = 0.2, 0.3, 0.4, 0.5, 0.6, 0.65 are ν = 0.48, 0.45, \
0.40, 0.33, 0.22, 0.13. Errors are those of the simplified theory, simplified/full − 1. Thick curves are the full theory, thin ones of \
the same colour the simplified one. Every number on this page was computed for it.";

/// Computes the page.
pub fn page(progress: &Progress) -> Result<Page, Failure> {
    let (start, step, count) = MAP;
    let betas: Vec<f64> = (0..count).map(|i| ((start + i as f64 * step) * 100.0).round() / 100.0).collect();
    let layer = runs::FLAT_LAYER.run(&betas, progress)?;
    let half_space = runs::FLAT_HALF_SPACE.run(&betas, progress)?;
    let paraboloid = runs::PARABOLOID.run(&betas, progress)?;
    let cone = runs::CONE.run(&betas, progress)?;
    let mass = runs::MASS.run(&CURVES, progress)?;
    let prescribed = runs::PRESCRIBED.run(&[0.3, 0.4, 0.5, 0.6], progress)?;
    let figures = vec![
        flat(&layer, &half_space),
        headed("theories-paraboloid", &runs::PARABOLOID, &paraboloid),
        headed("theories-cone", &runs::CONE, &cone),
        of_mass(&mass),
        map("theories-map-layer", "drag of a flat punch on a layer", &layer, Pair::drag_error, 11.9),
        map(
            "theories-map-half-space",
            "drag of a flat punch on a half-space",
            &half_space,
            Pair::drag_error,
            6.0,
        ),
        map(
            "theories-map-paraboloid",
            "stress on the axis under a paraboloid on a layer",
            &paraboloid,
            Pair::axis_error,
            11.9,
        ),
    ];
    let tables = vec![
        errors("Error of the drag: flat punch on a layer", &layer, Pair::drag_error),
        errors("Error of the drag: flat punch on a half-space", &half_space, Pair::drag_error),
        errors("Error of the stress on the axis: paraboloid on a layer", &paraboloid, Pair::axis_error),
        errors("Error of the stress on the axis: conical head on a layer", &cone, Pair::axis_error),
        rebound(&mass),
        six_percent(&paraboloid, &prescribed)?,
    ];
    let ending = ending(&layer, &half_space, &paraboloid, &mass);
    Ok(Page {
        title: "The simplified theory against the full theory of elasticity",
        introduction: vec![INTRODUCTION.into()],
        figures,
        tables,
        ending,
    })
}

/// The pairs at the shear wave speeds of the curves.
fn chosen(pairs: &[Pair]) -> impl Iterator<Item = &Pair> {
    pairs.iter().filter(|pair| CURVES.contains(&pair.beta))
}

/// Curves of both theories, up to a time.
fn curves(pairs: &[Pair], until: f64, take: impl Fn(&Run) -> &Points) -> Vec<Curve> {
    let points = |run: &Run| take(run).iter().copied().filter(|p| p.0 <= until).collect::<Points>();
    let mut curves = Vec::new();
    for (i, pair) in chosen(pairs).enumerate() {
        curves.push(curve(format!("β = {}", pair.beta), points(&pair.full), i));
        curves.push(Curve { dashed: true, ..curve("", points(&pair.simplified), i) });
    }
    curves
}

fn drag_panel(title: &str, curves: Vec<Curve>) -> Panel {
    Panel { y_label: "F [πR²γc_p²]".into(), ..over_time(title, curves) }
}

fn flat(layer: &[Pair], half_space: &[Pair]) -> Figure {
    let drag = |pairs, until| curves(pairs, until, |run| &run.drag);
    Figure {
        id: "theories-flat".into(),
        title: "Flat punch: drag".into(),
        text: "The stress on the axis is singular where the waves of the edge meet, so drags are compared. Fronts arrive at the same times and \
               are as high; between them the full theory rises less, for β < 0.34 it falls at first."
            .into(),
        panels: vec![
            drag_panel("On a layer, h = 1, V0 = 1", drag(layer, UNTIL)),
            drag_panel("On a half-space, V0 = 1", drag(half_space, UNTIL)),
        ],
        commands: [runs::FLAT_LAYER.commands(), runs::FLAT_HALF_SPACE.commands()].concat(),
        ..Figure::default()
    }
}

/// Stress on the axis and drag under a head that is not flat.
fn headed(id: &str, problem: &Problem, pairs: &[Pair]) -> Figure {
    let axis = curves(pairs, UNTIL, |run| &run.axis);
    let top = chosen(pairs).map(|pair| top(&pair.simplified.axis)).fold(0.0, f64::max);
    Figure {
        id: id.into(),
        title: problem.name.replacen(&problem.name[..1], &problem.name[..1].to_uppercase(), 1),
        text: "Contact is unilateral in both theories. Early scatter on the axis at small β is mesh noise of the moving edge of contact in \
               the full theory; the drag has none."
            .into(),
        panels: vec![
            Panel { y_range: Some((0.0, top)), ..over_time("Stress on the axis, r = 0", axis) },
            drag_panel("Drag", curves(pairs, UNTIL, |run| &run.drag)),
        ],
        commands: problem.commands().to_vec(),
        ..Figure::default()
    }
}

/// Top of an axis that shows a curve.
fn top(points: &Points) -> f64 {
    let shown: Points = points.iter().copied().filter(|p| p.0 <= UNTIL).collect();
    1.05 * largest(&shown).1
}

fn of_mass(pairs: &[Pair]) -> Figure {
    let until = 21.0;
    Figure {
        id: "theories-mass".into(),
        title: "Flat punch of mass 5 on a half-space".into(),
        text: "Runs end where the punch leaves the target.".into(),
        panels: vec![
            drag_panel("Drag", curves(pairs, until, |run| &run.drag)),
            Panel {
                y_label: "V [c_p]".into(),
                ..over_time("Velocity of the punch", curves(pairs, until, |run| &run.velocity))
            },
        ],
        commands: runs::MASS.commands().to_vec(),
        ..Figure::default()
    }
}

/// A heat picture of errors over time and shear wave speed.
fn map(id: &str, what: &str, pairs: &[Pair], error: impl Fn(&Pair, f64) -> f64, until: f64) -> Figure {
    let length = (until / MAP_STEP).round() as usize;
    let columns = Side::Even { start: MAP_STEP, step: MAP_STEP, length };
    let (start, step, _) = MAP;
    let values = pairs
        .iter()
        .flat_map(|pair| (0..length).map(|i| 100.0 * error(pair, columns.at(i))).collect::<Vec<_>>())
        .collect();
    let image = Image {
        title: format!("Error of the simplified theory in %: {what}"),
        value_label: "error [%]".into(),
        row_label: "β = c_s/c_p".into(),
        column_label: "t [R/c_p]".into(),
        rows: Side::Even { start, step, length: pairs.len() },
        columns,
        values,
        ..Image::default()
    };
    Figure {
        id: id.into(),
        title: format!("Error: {what}"),
        text: format!(
            "Simplified/full − 1 in %, means over 0.1 of time; the colours end at {} %, and errors beyond have the colour of the end.",
            MAP_COLOURS.1
        ),
        image: Some((image, MAP_COLOURS)),
        ..Figure::default()
    }
}

/// A share in %; none of nothing.
fn percent(share: f64) -> String {
    if !share.is_finite() {
        return "-".into();
    }
    format!("{:+.0} %", 100.0 * share)
}

/// Errors at some times and shear wave speeds.
fn errors(title: &str, pairs: &[Pair], error: impl Fn(&Pair, f64) -> f64) -> Table {
    let end = |pair: &Pair| pair.full.drag.last().map_or(0.0, |last| last.0);
    let end = pairs.iter().map(end).fold(f64::INFINITY, f64::min);
    let times: Vec<f64> = TIMES.iter().copied().filter(|&t| t < end).collect();
    let heading = std::iter::once("β".to_owned()).chain(times.iter().map(|t| format!("t = {t}")));
    let mut rows = vec![heading.collect::<Vec<_>>()];
    for pair in pairs {
        let cells = times.iter().map(|&t| percent(error(pair, t)));
        rows.push(std::iter::once(pair.beta.to_string()).chain(cells).collect());
    }
    Table {
        title: title.into(),
        text: "Means over 0.1 of time; simplified/full − 1; - where the full theory has no contact.".into(),
        rows,
    }
}

/// Contact duration and rebound.
fn rebound(pairs: &[Pair]) -> Table {
    let heading = [
        "β",
        "punch stops at",
        "duration of contact",
        "error",
        "restitution −V/V0",
        "error",
        "energy returned",
        "largest drag",
        "error",
    ];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    let number = |value: Option<f64>, digits: usize| value.map_or("-".into(), |v| format!("{v:.digits$}"));
    for pair in pairs {
        let runs = [&pair.full, &pair.simplified];
        let both = |take: &dyn Fn(&Run) -> Option<f64>, digits| {
            let values = runs.map(take);
            let error =
                values[0].zip(values[1]).map_or("-".into(), |(full, simple)| percent(simple / full - 1.0));
            (values.map(|value| number(value, digits)).join(" | "), error)
        };
        let (stop, _) = both(&|run| run.rebound, 2);
        let (duration, duration_error) = both(&|run| run.separation, 2);
        let (speed, speed_error) = both(&restitution, 3);
        let (energy, _) = both(&|run| restitution(run).map(|e| e * e), 3);
        let (drag, drag_error) = both(&|run| Some(largest(&run.drag).1), 3);
        rows.push(vec![
            pair.beta.to_string(),
            stop,
            duration,
            duration_error,
            speed,
            speed_error,
            energy,
            drag,
            drag_error,
        ]);
    }
    Table {
        title: "Rebound of a flat punch of mass 5 from a half-space".into(),
        text: "Full | simplified. The rebound velocity in units of V0 is the coefficient of restitution."
            .into(),
        rows,
    }
}

/// Velocity of the indenter when it leaves the target, upwards, in units of V0 = 1.
fn restitution(run: &Run) -> Option<f64> {
    Some(-at(&run.velocity, run.separation?))
}

/// The paper's comparison of Figs. 2a and 2b.
fn six_percent(unilateral: &[Pair], prescribed: &[Pair]) -> Result<Table, Failure> {
    const VELOCITY: f64 = 0.1;
    const CURVATURE: f64 = 0.2;
    let heading = [
        "β",
        "t",
        "full, closed form (Eq. 16)",
        "full, computed",
        "simplified, closed form",
        "simplified, computed",
        "error, closed forms",
        "error, computed",
        "error, computed, unilateral",
    ];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    for pair in prescribed {
        let full = Paraboloid::new(ModelKind::Elastic, VELOCITY, CURVATURE, pair.beta, Some(1.0))?;
        let simplified = Paraboloid::new(ModelKind::Rakhmatulin, VELOCITY, CURVATURE, pair.beta, Some(1.0))?;
        let free = unilateral.iter().find(|other| other.beta == pair.beta);
        for time in [1.0, 3.0, 5.0] {
            let exact = [full.axis_pressure(0.0, time)?, simplified.axis_pressure(0.0, time)?];
            let computed = [&pair.full, &pair.simplified].map(|run| at(&run.axis, time));
            rows.push(vec![
                pair.beta.to_string(),
                time.to_string(),
                format!("{:.4}", exact[0]),
                format!("{:.4}", computed[0]),
                format!("{:.4}", exact[1]),
                format!("{:.4}", computed[1]),
                percent(exact[1] / exact[0] - 1.0),
                percent(pair.axis_error(time)),
                free.map_or("-".into(), |pair| percent(pair.axis_error(time))),
            ]);
        }
    }
    let text = "The paper finds the stress on the axis in Fig. 2b (simplified, β = 0.5) \"about 6 %\" above that of Fig. 2a (full, Eq. 16). Both \
                theories have a closed form where the motion is prescribed; they say otherwise, and so do the runs, with prescribed and with unilateral contact.";
    Ok(Table { title: "The paper's \"about 6 %\" for Fig. 2".into(), text: text.into(), rows })
}

/// The sentence at the end: when the simplified theory can be trusted.
fn ending(layer: &[Pair], half_space: &[Pair], paraboloid: &[Pair], mass: &[Pair]) -> String {
    // the last of the times up to which the drag errs by less than 5 %
    let trusted = half_space.iter().filter(|pair| (0.5..=0.65).contains(&pair.beta)).map(|pair| {
        let times = (1..40).map(|i| 0.05 * f64::from(i));
        times.take_while(|&time| pair.drag_error(time) < 0.05).last().unwrap_or_default()
    });
    let trusted = trusted.fold(f64::INFINITY, f64::min);
    let stiff = 0.5..=0.6;
    let soft = 0.3..=0.4;
    let at_five = |pairs: &[Pair], betas: &RangeInclusive<f64>, error: fn(&Pair, f64) -> f64| {
        let errors = pairs.iter().filter(|pair| betas.contains(&pair.beta)).map(|pair| error(pair, 5.0));
        span(errors)
    };
    let lasting = mass.iter().filter(|pair| pair.beta >= 0.3);
    let short =
        lasting.clone().filter_map(|pair| Some(1.0 - pair.simplified.separation? / pair.full.separation?));
    let rebound = lasting
        .filter_map(|pair| Some((restitution(&pair.simplified)? / restitution(&pair.full)? - 1.0).abs()));
    format!(
        "The simplified theory can be trusted for the arrival times and heights of plane fronts, for the rebound velocity of a flat punch (within \
         {:.0} % for β = 0.3 to 0.65), and for its drag within 5 % up to t = {trusted:.2} R/c_p (β = 0.5 to 0.65); at t = 5 and β = 0.5 to 0.6 the \
         drag is {} too high on a layer and {} on a half-space, and the stress on the axis under a paraboloid {}; at β = 0.3 to 0.4 these are {}, {} and {}; \
         contact of a punch of mass 5 ends {} too early (β = 0.3 to 0.65): for such numbers take `model = \"elastic\"`.",
        100.0 * rebound.fold(0.0, f64::max),
        at_five(layer, &stiff, Pair::drag_error),
        at_five(half_space, &stiff, Pair::drag_error),
        at_five(paraboloid, &stiff, Pair::axis_error),
        at_five(layer, &soft, Pair::drag_error),
        at_five(half_space, &soft, Pair::drag_error),
        at_five(paraboloid, &soft, Pair::axis_error),
        span(short),
    )
}

/// Smallest to largest of some shares, in %.
fn span(shares: impl Iterator<Item = f64>) -> String {
    let ends = shares.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    format!("{:.0} to {:.0} %", 100.0 * ends.0, 100.0 * ends.1)
}
