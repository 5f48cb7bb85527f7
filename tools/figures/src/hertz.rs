//! The page of balls on half-spaces: contact forces against those of Hertz, with the energy that waves carry away.

use std::{fs, path::Path};

use percuss::{
    case::Case,
    exact::{
        hertz::Hertz,
        hertz_radiation::{Impact, on_half_space},
    },
};
use percuss_picture::Panel;

use crate::{
    Failure, Progress,
    figure::{Figure, curve, exact},
    lab::{Lab, Points},
    page::{Page, Table, code},
};

/// The case, as a user would write it.
const CASE: &str = "\
title = \"Ball on a half-space\"
model = \"elastic\"
[target]
thickness = \"half-space\"
material = \"steel\"
[indenter]
shape = \"sphere\"
nose_radius = \"5 mm\"
material = \"steel\"
[impact]
velocity = \"1 m/s\"
[run]
end_time = \"40 us\"
stop = \"separation\"
[record]
frames = 0
fields = []
probes = []
";

/// Materials of balls and targets.
const MATERIALS: [&str; 3] = ["steel", "glass", "pmma"];
/// Impact velocities \[m/s\].
const VELOCITIES: [f64; 3] = [0.1, 1.0, 3.0];
/// Columns of the sweep.
const KEYS: [&str; 4] = ["target.material", "indenter.material", "impact.velocity", "run.end_time"];
/// End of the runs, in times of contact.
const END: f64 = 1.15;

const INTRODUCTION: &str = "\
Rigid balls of 10 mm, as heavy as steel, glass and PMMA, fall on half-spaces of the three materials at 0.1, 1 and 3 m/s. Their contact is a \
ninetieth to a seventh of their radius, and lasts 120 to 1500 times as long as P waves take across it, so it is that of Hertz but for what waves carry \
away: where the force pushes the surface, that moves, beside its static depth, with a velocity in proportion to the rate of the rate of the force. \
To first order the force at the depth w is k·w^(3/2) + D·(9/4)·k²·w·ẇ, and D follows from the waves of a half-space (Miller and Pursey, Hunter). The \
ball's equation of motion with that force, solved numerically, is the closed form here; none of its numbers is fitted. Meshes are the default: graded, \
20 cells across the contact.";

/// An impact: what is struck and how, computed and in closed form, in SI.
struct Pair {
    target: &'static str,
    ball: &'static str,
    velocity: f64,
    end_time: String,
    expected: Impact,
    /// Largest force of Hertz, without waves.
    hertz: f64,
}

impl Pair {
    fn new(case: &Path, target: &'static str, ball: &'static str, velocity: f64) -> Result<Self, Failure> {
        let settings = [
            format!("target.material={target}"),
            format!("indenter.material={ball}"),
            format!("impact.velocity={velocity} m/s"),
        ];
        let case = Case::load(&case.display().to_string(), &settings)?;
        let contact = Hertz::of(&case).expect("a ball on a half-space");
        let found = on_half_space(&contact, case.target.material.shear_wave_speed)?;
        let hertz = contact.largest_force();
        let units = case.units();
        let expected = Impact {
            force: units.force.of(found.force),
            duration: units.time.of(found.duration),
            contact_radius: units.length.of(found.contact_radius),
            ..found
        };
        let end_time = format!("{:.1} us", END * 1e6 * expected.duration);
        Ok(Self { target, ball, velocity, end_time, expected, hertz: units.force.of(hertz) })
    }

    fn name(&self) -> String {
        format!("{} on {}", self.ball, self.target)
    }

    /// A row of the sweep.
    fn row(&self) -> String {
        format!("{},{},{} m/s,{}\n", self.target, self.ball, self.velocity, self.end_time)
    }
}

/// What is computed and expected of every pair.
struct Measured {
    /// Velocity by velocity of a ball on a target.
    pairs: Vec<Pair>,
    /// Number of velocities.
    velocities: usize,
    force: Vec<f64>,
    duration: Vec<f64>,
    contact_radius: Vec<f64>,
    restitution: Vec<f64>,
    /// That of a mesh without loss.
    corrected: Vec<f64>,
    command: String,
}

/// Computes the page in a temporary folder.
///
/// * `coarser`: meshes are so many times as coarse; if they are, without the slowest impacts, which take longest
pub fn page(progress: &Progress, coarser: usize) -> Result<Page, Failure> {
    let measured = measure(progress, coarser)?;
    Ok(Page {
        title: "Balls on half-spaces: Hertz with radiation",
        introduction: vec![
            INTRODUCTION.to_owned(),
            "This is `ball.toml`; `impacts.csv` has the first four columns of the table:".to_owned(),
            code(CASE),
        ],
        figures: vec![figure(&measured)],
        tables: vec![table(&measured)],
        ending: ending(&measured),
    })
}

fn measure(progress: &Progress, coarser: usize) -> Result<Measured, Failure> {
    let folder = tempfile::tempdir()?;
    let [case, impacts] = ["ball.toml", "impacts.csv"].map(|name| folder.path().join(name));
    fs::write(&case, CASE)?;
    let velocities = if coarser > 1 { &VELOCITIES[1..] } else { &VELOCITIES };
    let mut pairs = Vec::new();
    for target in MATERIALS {
        for ball in MATERIALS {
            for &velocity in velocities {
                pairs.push(Pair::new(&case, target, ball, velocity)?);
            }
        }
    }
    fs::write(&impacts, KEYS.join(",") + "\n" + &pairs.iter().map(Pair::row).collect::<String>())?;
    let lab = Lab::new(folder.path().to_owned(), coarser, progress);
    let [case, impacts] = [case, impacts].map(|path| path.display().to_string());
    let swept = lab.sweep("hertz", &case, &["mesh.contact_cells=20"], &[&impacts], "none")?;
    let command = swept.command.replace(&case, "ball.toml").replace(&impacts, "impacts.csv");
    let column = |name: &str| {
        let numbers = swept.numbers(name);
        let is_whole = numbers.len() == pairs.len();
        is_whole.then_some(numbers).ok_or_else(|| Failure(format!("not every ball has a {name}")))
    };
    Ok(Measured {
        force: column("peak_force")?,
        duration: column("contact_duration")?,
        contact_radius: column("contact_radius")?,
        restitution: column("restitution")?,
        corrected: column("restitution_mesh_corrected")?,
        command,
        velocities: velocities.len(),
        pairs,
    })
}

/// What is compared relatively.
type Compared = (&'static str, fn(&Measured) -> &[f64], fn(&Impact) -> f64);

const COMPARED: [Compared; 3] = [
    ("peak force", |measured| &measured.force, |impact| impact.force),
    ("contact time", |measured| &measured.duration, |impact| impact.duration),
    ("largest contact radius", |measured| &measured.contact_radius, |impact| impact.contact_radius),
];

/// Differences from the closed form, computed/expected − 1 in %.
fn differences(measured: &Measured, (_, computed, expected): Compared) -> Vec<f64> {
    let pairs = computed(measured).iter().zip(&measured.pairs);
    pairs.map(|(value, pair)| 100.0 * (value / expected(&pair.expected) - 1.0)).collect()
}

/// The largest by magnitude.
fn largest(differences: &[f64]) -> f64 {
    differences.iter().fold(0.0, |most, difference| f64::max(most, difference.abs()))
}

fn figure(measured: &Measured) -> Figure {
    // a colour of the palette for each target, a style of lines for each ball
    const PALETTE: usize = 8;
    let number = |pair: usize| pair / MATERIALS.len() + PALETTE * (pair % MATERIALS.len());
    let over_velocity = |values: &[f64]| {
        let points: Points =
            measured.pairs.iter().zip(values).map(|(pair, value)| (pair.velocity, *value)).collect();
        points.chunks(measured.velocities).map(<[_]>::to_vec).collect::<Vec<_>>()
    };
    let curves = |values: &[f64]| {
        let curves = over_velocity(values)
            .into_iter()
            .enumerate()
            .map(|(i, points)| curve(measured.pairs[i * measured.velocities].name(), points, number(i)));
        curves.collect::<Vec<_>>()
    };
    let panel = |title: &str, label: &str| Panel {
        title: title.into(),
        x_label: "V0 [m/s]".into(),
        y_label: label.into(),
        log_x: true,
        x_range: Some((measured.pairs[0].velocity, VELOCITIES[VELOCITIES.len() - 1])),
        ..Panel::default()
    };
    let mut panels: Vec<Panel> = COMPARED
        .iter()
        .map(|compared| Panel {
            curves: curves(&differences(measured, *compared)),
            ..panel(&format!("{}: computed/closed form − 1", compared.0), "difference [%]")
        })
        .collect();
    let lost = |restitution: f64| 1.0 - restitution;
    let closed: Vec<f64> = measured.pairs.iter().map(|pair| lost(pair.expected.restitution)).collect();
    let computed: Vec<f64> = measured.corrected.iter().copied().map(lost).collect();
    let dashes = over_velocity(&closed).into_iter().enumerate();
    let dashes = dashes.map(|(i, points)| exact(if i == 0 { "closed form" } else { "" }, points));
    let solid = over_velocity(&computed).into_iter().enumerate().map(|(i, points)| {
        let (target, ball) = (i / MATERIALS.len(), i % MATERIALS.len());
        curve(if ball == 0 { format!("on {}", MATERIALS[target]) } else { String::new() }, points, target)
    });
    panels.push(Panel {
        curves: solid.chain(dashes).collect(),
        log_y: true,
        ..panel("what the ball does not get back: 1 − restitution", "1 − e")
    });
    Figure {
        id: "-hertz".into(),
        title: "balls of three materials on half-spaces of three".into(),
        text: "Colours are those of the half-space, lines those of the ball; at the bottom balls of steel, glass and PMMA are one above the other. Restitution is without what the mesh loses, `restitution_mesh_corrected`.".into(),
        panels,
        commands: vec![measured.command.clone()],
        ..Figure::default()
    }
}

fn table(measured: &Measured) -> Table {
    let heading = [
        "target",
        "ball",
        "V0",
        "end time",
        "peak force [N]",
        "Hertz alone",
        "contact [µs]",
        "largest radius [mm]",
        "restitution",
        "without loss of the mesh",
        "closed form",
    ];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    let by = COMPARED.map(|compared| differences(measured, compared));
    for (i, pair) in measured.pairs.iter().enumerate() {
        let with = |text: String, difference: f64| format!("{text} ({difference:+.2} %)");
        rows.push(vec![
            pair.target.into(),
            pair.ball.into(),
            format!("{} m/s", pair.velocity),
            pair.end_time.clone(),
            with(format!("{:.2}", measured.force[i]), by[0][i]),
            format!("{:+.2} %", 100.0 * (measured.force[i] / pair.hertz - 1.0)),
            with(format!("{:.3}", 1e6 * measured.duration[i]), by[1][i]),
            with(format!("{:.4}", 1e3 * measured.contact_radius[i]), by[2][i]),
            format!("{:.4}", measured.restitution[i]),
            format!("{:.4}", measured.corrected[i]),
            format!("{:.4}", pair.expected.restitution),
        ]);
    }
    let text = "Computed values, in brackets how far they are from the closed form; `Hertz alone` is how far the peak force is from that without waves. The \
                edge of contact is found between nodes, within a tenth of a cell; the largest contact is ten cells in radius.";
    Table { title: "Every impact".into(), text: text.into(), rows }
}

fn ending(measured: &Measured) -> String {
    let parts = COMPARED
        .map(|compared| format!("{:.2} % of the {}", largest(&differences(measured, compared)), compared.0));
    let restitutions = measured.corrected.iter().zip(&measured.pairs);
    let restitution = restitutions.map(|(value, pair)| value - pair.expected.restitution).collect::<Vec<_>>();
    format!(
        "The largest differences from the closed form are {}, and {:.5} of the restitution.",
        parts.join(", "),
        largest(&restitution)
    )
}
