//! The page of experiments: what others measured and computed, beside what is computed here.

use std::{path::Path, time::Instant};

use percuss::{case::Case, session, simulation::Simulation, view::View};
use percuss_picture::{Curve, Panel};

use crate::{
    Failure, Progress,
    closed_forms::{GABBRO_RAYS, pekeris},
    figure::{Figure, curve, exact},
    lab::{Lab, Made, Points, metadata, series},
    page::{Page, Table},
};

/// A ball on a target that is published.
struct Ball {
    /// The built-in case, and what turns its ball into a rigid one.
    case: &'static str,
    rigid: &'static [&'static str],
    what: &'static str,
    /// Force \[N\] and time of contact \[µs\], restitution if there is one.
    published: (f64, f64, Option<f64>),
    /// Of whom they are.
    by: &'static str,
    remark: &'static str,
}

const HERTZ: &str = "Hertz";
const ZENER: &str = "Zener";
const BALLS: [Ball; 7] = [
    Ball {
        case: "experiment-aluminium",
        rigid: &["indenter.body=rigid", "indenter.density=7800 kg/m3"],
        what: "steel, 0.66 mm, from 0.91 m on aluminium",
        published: (8.19, 2.23, None),
        by: HERTZ,
        remark: "",
    },
    Ball {
        case: "experiment-gabbro",
        rigid: &["indenter.body=rigid", "indenter.density=7758.8 kg/m3"],
        what: "steel, 2 mm, from 0.5 m on gabbro",
        published: (56.19, 6.66, None),
        by: HERTZ,
        remark: "",
    },
    Ball {
        case: "experiment-glass",
        rigid: &["indenter.body=rigid", "indenter.density=4000 kg/m3"],
        what: "alumina, 5 mm, at 3.9 m/s on glass",
        published: (293.3, 12.81, Some(0.98)),
        by: "Hertz; restitution measured",
        remark: "waves are a lower bound of the loss",
    },
    Ball {
        case: "experiment-steel",
        rigid: &["indenter.body=rigid", "indenter.density=7850 kg/m3"],
        what: "steel, 1.58 mm, from 0.1 m on steel",
        published: (16.3, 5.13, None),
        by: HERTZ,
        remark: "",
    },
    Ball {
        case: "experiment-zener",
        rigid: &["indenter.body=rigid"],
        what: "steel, 20 mm, at 1 m/s on 8 mm of steel",
        published: (1379.7, 73.0, Some(0.664)),
        by: ZENER,
        remark: "",
    },
    Ball {
        case: "experiment-zener-pmma",
        rigid: &["indenter.body=rigid"],
        what: "steel, 10 mm, at 1.4 m/s on 10 mm of PMMA",
        published: (119.2, 150.0, Some(0.692)),
        by: ZENER,
        remark: "the plate is thick for Zener: shear waves cross it only ten times to and fro during contact, and his plate has neither shear nor rotary inertia",
    },
    Ball {
        case: "experiment-zener-pmma-4mm",
        rigid: &["indenter.body=rigid"],
        what: "steel, 4 mm, at 1.4 m/s on 10 mm of PMMA",
        published: (22.6, 57.9, Some(0.942)),
        by: ZENER,
        remark: "thicker still: waves cross it four times, and part of what is lost is that of a half-space",
    },
];

/// A sensor, and what is published of it.
struct Sensor {
    /// Place \[mm\].
    r: f64,
    z: f64,
    /// Times \[µs\] and displacements \[nm\] of extremes, of generalised rays.
    extremes: &'static [(f64, f64)],
}

/// A plate under a known force.
struct Plate {
    case: &'static str,
    what: &'static str,
    sensors: &'static [Sensor],
    /// The case of the ball whose recorded force presses too.
    ball: Option<&'static str>,
    /// What makes of that case one run of ball and plate.
    whole: Option<&'static [&'static str]>,
    remark: &'static str,
}

const PLATES: [Plate; 3] = [
    Plate {
        case: "experiment-aluminium-plate",
        what: "Kravchinsky et al. 2025: 101.6 mm of aluminium under the force of a ball",
        sensors: &[
            Sensor { r: 0.0, z: 101.6, extremes: &[(17.25, 0.2492), (32.60, 0.098)] },
            Sensor { r: 17.91, z: 101.6, extremes: &[(17.5, 0.2346)] },
            Sensor { r: 58.66, z: 101.6, extremes: &[(19.7, 0.1584)] },
            Sensor { r: 121.08, z: 101.6, extremes: &[(26.1, 0.0682)] },
        ],
        ball: Some("experiment-aluminium"),
        whole: Some(&[
            "target.thickness=101.6 mm",
            "target.back=free",
            "mesh.contact_cells=20",
            "mesh.largest_cell=0.4 mm",
            "run.end_time=28 us",
            "run.stop=never",
            "record.frames=0",
        ]),
        remark: "The authors' finite elements give 0.245 ± 0.005 nm at the first peak opposite, low-passed at 1.31 MHz.",
    },
    Plate {
        case: "experiment-gabbro-plate",
        what: "Okubo et al. 2025: 100 mm of gabbro under a pulse of 32 N",
        sensors: &[
            Sensor { r: 50.0, z: 100.0, extremes: &GABBRO_RAYS },
            Sensor {
                r: 100.0,
                z: 0.0,
                extremes: &[
                    (30.9, -1.299),
                    (33.4, 2.481),
                    (38.7, 0.232),
                    (51.3, 0.388),
                    (53.6, 0.138),
                    (62.7, 0.296),
                ],
            },
        ],
        ball: None,
        whole: None,
        remark: "The rays are sampled every 50 ns, which is some per cent of the Rayleigh pulse at 31 to 33 µs.",
    },
    Plate {
        case: "experiment-steel-plate",
        what: "McLaskey and Glaser 2010: 50 mm of steel under the force of a ball",
        sensors: &[Sensor {
            r: 0.0,
            z: 50.0,
            extremes: &[(11.75, 0.590), (13.55, 0.445), (16.35, 0.610), (25.45, 0.028), (28.85, 0.225)],
        }],
        ball: Some("experiment-steel"),
        whole: None,
        remark: "",
    },
];

/// Peak and duration of the pulse on a half-space.
const PEAK: f64 = 0.001;
const DURATION: f64 = 1.75;
/// Time in which an extreme is looked for about that published \[µs\].
const NEAR: f64 = 0.6;

const INTRODUCTION: &str = "\
Each of these is a built-in case, and each number beside it is published, or computed by others from what is published. Balls are elastic, as cylinders with the \
ball's head and mass; beside them stand rigid ones, which most programs offer. Waves travel through the plates to the sensors from the force that is \
known, or from that of the ball's recording: a contact is a thousandth of a plate, so two runs take seconds where one of both, on a graded mesh, takes minutes; the \
first plate has that too.";

/// Computes the page.
///
/// * `recordings`: folder that keeps the recordings
/// * `coarser`: meshes are so many times as coarse
pub fn page(recordings: &Path, progress: &Progress, coarser: usize) -> Result<Page, Failure> {
    let lab = Lab::new(recordings.to_owned(), coarser, progress);
    let balls = balls(&lab)?;
    let mut figures = Vec::new();
    let mut rows = vec![
        ["sensor", "t [µs]", "published [nm]", "computed [nm]", "at [µs]", "difference"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for plate in &PLATES {
        figures.push(plate_figure(&lab, plate, &mut rows)?);
    }
    figures.push(half_space(&lab)?);
    let far = Table {
        title: "Displacements of sensors".into(),
        text: "Extremes of the displacement along the blow, in nm; generalised rays in an infinite plate. Under the cases' own forces, not the recorded ones, or under the ball in one run.".into(),
        rows,
    };
    Ok(Page {
        title: "Experiments: beside what others measured and computed",
        introduction: vec![INTRODUCTION.to_owned()],
        figures,
        tables: vec![balls, far, bars(progress, coarser)?],
        ending: String::new(),
    })
}

/// A difference in per cent.
fn difference(computed: f64, published: f64) -> String {
    format!("{:+.1} %", 100.0 * (computed / published - 1.0))
}

/// Forces, times of contact and restitution of the balls.
fn balls(lab: &Lab<'_>) -> Result<Table, Failure> {
    let heading = ["ball", "", "F [N]", "", "contact [µs]", "", "restitution", "mesh", "time [s]", "remark"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    for ball in &BALLS {
        let (force, duration, restitution) = ball.published;
        let published = restitution.map_or_else(String::new, |e| e.to_string());
        let mut row = vec![
            ball.what.into(),
            ball.by.into(),
            force.to_string(),
            String::new(),
            duration.to_string(),
            String::new(),
            published,
        ];
        row.extend([String::new(), String::new(), ball.remark.into()]);
        rows.push(row);
        for (body, settings) in [("elastic", &[][..]), ("rigid", ball.rigid)] {
            let name = if body == "elastic" { ball.case.into() } else { format!("{}-{body}", ball.case) };
            let settings = [settings, &["mesh.contact_cells=20"]].concat();
            let start = Instant::now();
            let made = lab.run(&name, ball.case, &settings)?;
            let seconds = start.elapsed().as_secs_f64();
            let said = |key| metadata(&made, "percuss.summary", key);
            let (f, t) = (said("peak_force")?, 1e6 * said("contact_duration")?);
            let e = said("restitution_mesh_corrected")?;
            let mesh = |key| metadata(&made, "percuss.run", key);
            rows.push(vec![
                String::new(),
                body.into(),
                format!("{f:.4}"),
                difference(f, force),
                format!("{t:.3}"),
                difference(t, duration),
                format!("{e:.4}"),
                format!("{} × {}", mesh("nr")?, mesh("nz")?),
                format!("{seconds:.1}"),
                String::new(),
            ]);
        }
    }
    Ok(Table {
        title: "Balls".into(),
        text: "Restitution is that of a mesh without loss. Hertz is for both moduli, without what waves carry away; Zener adds an infinite thin plate.".into(),
        rows,
    })
}

/// Displacements at a sensor: µs and nm.
fn displacement(made: &Made, sensor: &Sensor) -> Result<Points, Failure> {
    let place = |mm: f64| if mm == 0.0 { "0".into() } else { format!("{mm}mm") };
    let name = format!("displacement@r={},z={}", place(sensor.r), place(sensor.z));
    let seen = series(made, "/points", &name)?;
    Ok(seen.into_iter().map(|(t, u)| (1e6 * t, 1e9 * u)).collect())
}

/// The extreme nearest in height to a published one, at most [`NEAR`] from it.
fn extreme(points: &Points, (time, height): (f64, f64)) -> Option<(f64, f64)> {
    let turns =
        points.windows(3).filter(|three| (three[1].1 - three[0].1) * (three[2].1 - three[1].1) <= 0.0);
    let near = turns.map(|three| three[1]).filter(|(t, _)| (t - time).abs() <= NEAR);
    near.min_by(|a, b| (a.1 - height).abs().total_cmp(&(b.1 - height).abs()))
}

/// A plate: curves of its sensors with what is published as points.
fn plate_figure(lab: &Lab<'_>, plate: &Plate, rows: &mut Vec<Vec<String>>) -> Result<Figure, Failure> {
    let cells = Case::load(plate.case, &[])?.mesh.cells;
    let cells = format!("mesh.cells={cells}");
    let start = Instant::now();
    let made = lab.run(plate.case, plate.case, &[&cells])?;
    let seconds = start.elapsed().as_secs_f64();
    let mut text = format!("{} It took {seconds:.1} s.", plate.remark);
    let recorded = match plate.ball {
        None => None,
        Some(ball) => {
            let force = format!("load.force.recording={}", lab.path(ball).display());
            text.push_str(" Dashes are under the force of the ball's recording, in place of the pulse.");
            let made = lab.run(&format!("{}-recorded", plate.case), plate.case, &[&cells, &force])?;
            let folder = format!("{}/", lab.path("").parent().unwrap_or(Path::new("")).display());
            Some(Made { command: made.command.replace(&folder, ""), ..made })
        }
    };
    let start = Instant::now();
    let points: Vec<_> =
        plate.sensors.iter().map(|at| format!("[\"{} mm\", \"{} mm\"]", at.r, at.z)).collect();
    let points = format!("record.points=[{}]", points.join(", "));
    let whole = plate
        .ball
        .zip(plate.whole)
        .map(|(ball, sets)| lab.run(&format!("{ball}-whole"), ball, &[sets, &[points.as_str()]].concat()));
    let whole = whole.transpose()?;
    if whole.is_some() {
        text.push_str(&format!(" One run of ball and plate took {:.0} s.", start.elapsed().as_secs_f64()));
    }
    let mut panels = Vec::new();
    for sensor in plate.sensors {
        let place = format!("r = {} mm, z = {} mm", sensor.r, sensor.z);
        let mut curves = Vec::new();
        let runs = [("computed", "", Some(&made)), ("in one run", "one run, ", whole.as_ref())];
        for (colour, (name, run, made)) in [0, 2].into_iter().zip(runs) {
            let Some(made) = made else { continue };
            let computed = displacement(made, sensor)?;
            for &published in sensor.extremes {
                // one run ends before the later ones
                if computed.last().is_none_or(|(end, _)| *end < published.0) {
                    continue;
                }
                let (t, u) = extreme(&computed, published).unwrap_or((f64::NAN, f64::NAN));
                rows.push(vec![
                    format!("{}, {run}{place}", plate.case),
                    format!("{:.2}", published.0),
                    published.1.to_string(),
                    format!("{u:.4}"),
                    format!("{t:.2}"),
                    difference(u, published.1),
                ]);
            }
            curves.push(curve(name, computed, colour));
        }
        if let Some(recorded) = &recorded {
            let points = displacement(recorded, sensor)?;
            curves.push(Curve { name: "from the recording".into(), points, dashed: true, colour: Some(1) });
        }
        // each point as a cross
        let across = 0.01 * sensor.extremes.iter().map(|(_, u)| u.abs()).fold(0.0, f64::max);
        for (number, &(t, u)) in sensor.extremes.iter().enumerate() {
            let name = if number == 0 { "published" } else { "" };
            let bars = [vec![(t - 0.3, u), (t + 0.3, u)], vec![(t, u - 3.0 * across), (t, u + 3.0 * across)]];
            let names = [name, ""];
            curves.extend(bars.into_iter().zip(names).map(|(points, name)| curve(name, points, 6)));
        }
        panels.push(Panel {
            title: place,
            x_label: "t [µs]".into(),
            y_label: "u [nm]".into(),
            curves,
            ..Panel::default()
        });
    }
    let made = [Some(made), recorded, whole].into_iter().flatten().collect();
    Ok(Figure {
        id: format!("-{}", plate.case),
        title: plate.what.into(),
        text,
        panels,
        made,
        ..Figure::default()
    })
}

/// A force on a point of a half-space, with the surface pulse of Pekeris.
fn half_space(lab: &Lab<'_>) -> Result<Figure, Failure> {
    const CASE: &str = "experiment-half-space";
    let made = lab.run(CASE, CASE, &["mesh.cells=20"])?;
    let mut curves = Vec::new();
    for (colour, r) in [1.0, 2.0, 3.0].into_iter().enumerate() {
        let computed = series(&made, "/points", &format!("displacement@r={r},z=0"))?;
        let closed: Points =
            computed.iter().map(|&(t, _)| (t, pekeris::cosine(PEAK, DURATION, r, t))).collect();
        let name = if colour == 0 { "Pekeris" } else { "" };
        curves.extend([curve(format!("r = {r}"), computed, colour), exact(name, closed)]);
    }
    let panels = vec![Panel {
        title: "Displacement of the surface".into(),
        x_label: "t [R/c_p]".into(),
        y_label: "u [R]".into(),
        curves,
        ..Panel::default()
    }];
    let text = "A pulse of twenty cells of shear waves, on a point, at distances of 20, 40 and 60 cells; dashes are the closed form.";
    let title = "Pekeris 1955: a point force on a half-space, ν = 1/4".into();
    Ok(Figure {
        id: format!("-{CASE}"),
        title,
        text: text.into(),
        panels,
        made: vec![made],
        ..Figure::default()
    })
}

/// Bars without motion along r, which are exact.
fn bars(progress: &Progress, coarser: usize) -> Result<Table, Failure> {
    let heading = ["bars", "published", "computed", "difference"];
    let mut rows = vec![heading.map(str::to_owned).to_vec()];
    // length [mm], E [GPa], ν, density, velocity [m/s]; contact [µs], pressure [MPa], and the velocity after it
    let bars = [
        ("Code_Aster SDNV100", [200.0, 200.0, 0.3, 8000.0, 100.0], [68.95, 4641.0, 100.0]),
        ("Abaqus Benchmarks 1.3.15", [2000.0, 200.0, 0.0, 7800.0, 1.5], [789.9, 59.2, 1.5]),
        (
            "ANSYS technology demonstration 17, copper",
            [32.4, 117.0, 0.35, 8930.0, 227.0],
            [f64::NAN, f64::NAN, 227.0],
        ),
    ];
    for (name, [length, modulus, nu, density, velocity], published) in bars {
        let mut settings = Vec::new();
        for layer in ["target", "indenter.body.layer.1"] {
            settings.extend([
                format!("{layer}.thickness=\"{length} mm\""),
                format!("{layer}.material.youngs_modulus=\"{modulus} GPa\""),
                format!("{layer}.material.poisson_ratio={nu:?}"),
                format!("{layer}.material.density=\"{density} kg/m3\""),
            ]);
        }
        let speed = f64::sqrt(1e9 * modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)) / density);
        let contact = 2e3 * length / speed;
        // some 400 rows, whose first contact takes little energy
        let cells = ((4000.0 / length) as usize).max(8);
        settings.extend([
            format!("impact.velocity=\"{} m/s\"", 2.0 * velocity),
            format!("run.end_time=\"{} us\"", 1.1 * contact),
            format!("mesh.cells={}", (cells / coarser).max(5)),
        ]);
        progress.next(&format!("{name}: percuss run experiment-bars"));
        let case = Case::load("experiment-bars", &settings)?;
        let units = case.units();
        let area = std::f64::consts::PI * 1e-4;
        let (mut last, mut pressure, mut rebound) = (0.0, 0.0, 0.0);
        let mut look = |view: &View<'_>| {
            if view.drag > 0.0 {
                last = 1e6 * units.time.of(view.time);
            }
            if view.step == case.sizes.steps / 2 {
                pressure = 1e-6 * units.force.of(view.drag) / area;
            }
            rebound = velocity - units.speed.of(view.velocity);
        };
        session::run(&mut Simulation::new(&case), &mut [&mut look])?;
        for (what, unit, published, computed) in [
            ("contact", "µs", published[0], last),
            ("pressure", "MPa", published[1], pressure),
            ("velocity after it", "m/s", published[2], rebound),
        ] {
            let row = || {
                vec![
                    format!("{name}: {what}"),
                    format!("{published} {unit}"),
                    format!("{computed:.3} {unit}"),
                    difference(computed, published),
                ]
            };
            rows.extend(published.is_finite().then(row));
        }
    }
    Ok(Table {
        title: "Bars".into(),
        text: "A bar strikes a rigid wall; here it strikes one like it with twice the velocity, whose middle does not move (`experiment-bars` with other constants). Common settings of a commercial \
               code gave 204 to 451 m/s for the copper bar. Abaqus' bar is in uniaxial stress: ν = 0."
            .into(),
        rows,
    })
}
