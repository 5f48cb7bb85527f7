//! The page of a sweep: a ball on plates of five materials, over three decades of mass.

use std::fs;

use percuss_picture::Panel;

use crate::{
    Failure, Progress,
    figure::{Figure, curve},
    lab::Lab,
    page::{Page, code},
};

/// The case, as a user would write it.
const CASE: &str = "\
title = \"Ball on a plate\"
model = \"elastic\"
[target]
thickness = \"6 mm\"
material = \"glass\"
back = \"free\"
[indenter]
shape = \"sphere\"
nose_radius = \"10 mm\"
mass = \"1 g\"
[impact]
velocity = \"5 m/s\"
[mesh]
cells = 40
[run]
end_time = \"400 us\"
stop = \"separation\"
[record]
frames = 0
";

/// Materials of the plate.
const MATERIALS: [&str; 5] = ["pmma", "epoxy", "glass", "aluminium", "lead"];

const INTRODUCTION: &str = "\
A rigid body with a spherical head of 10 mm strikes a plate of 6 mm at 5 m/s; the back of the plate is free and its edge far away. Light bodies bounce off \
with most of their velocity; heavier ones leave it to the waves that run out through the plate, and beyond some mass they do not come back while \
it is computed. One command computes all cases, in the full theory; every number on this page was computed for it. Curves end where contact outlasts the runs.";

/// Computes the page in a temporary folder.
///
/// * `coarser`: meshes are so many times as coarse
pub fn page(progress: &Progress, coarser: usize) -> Result<Page, Failure> {
    let folder = tempfile::tempdir()?;
    let case = folder.path().join("plate.toml");
    fs::write(&case, CASE)?;
    let lab = Lab::new(folder.path().to_owned(), coarser, progress);
    let materials = format!("target.material={}", MATERIALS.join(","));
    let case = case.display().to_string();
    let swept = lab.sweep(
        "plates",
        &case,
        &["mesh.cells=40"],
        &["indenter.mass=0.1 g:100 g:19:log", &materials],
        "none",
    )?;
    let command = swept.command.replace(&case, "plate.toml");
    let panel = |title: &str, label: &str, column: &str, scale: f64, log_y: bool| {
        let curves = MATERIALS.iter().enumerate().map(|(colour, material)| {
            let points = swept.points("indenter.mass", column, Some(("target.material", material)));
            let ended = swept.points("indenter.mass", "restitution", Some(("target.material", material)));
            let is_over = |mass: f64| ended.iter().any(|(other, _)| *other == mass);
            let points = points.into_iter().filter(|(mass, _)| is_over(*mass));
            curve(*material, points.map(|(mass, y)| (1e3 * mass, scale * y)).collect(), colour)
        });
        Panel {
            title: title.into(),
            x_label: "mass [g]".into(),
            y_label: label.into(),
            curves: curves.collect(),
            log_x: true,
            log_y,
            ..Panel::default()
        }
    };
    let figure = Figure {
        id: "-plates".into(),
        title: "a ball on plates of five materials".into(),
        text: "Restitution: velocity after the impact over that before.".into(),
        panels: vec![
            panel("restitution", "restitution", "restitution", 1.0, false),
            panel("duration of contact", "contact [µs]", "contact_duration", 1e6, true),
            panel("peak force", "force [kN]", "peak_force", 1e-3, true),
        ],
        commands: vec![command],
        ..Figure::default()
    };
    Ok(Page {
        title: "A sweep: a ball on plates",
        introduction: vec![INTRODUCTION.to_owned(), "This is `plate.toml`:".to_owned(), code(CASE)],
        figures: vec![figure],
        tables: Vec::new(),
        ending: String::new(),
    })
}
