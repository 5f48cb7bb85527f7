//! Case files at and beyond the edge of what is allowed, with what is said about each.
//!
//! `tests/cases/bad/*.toml` are refused, `tests/cases/valid/*.toml` are accepted; beside each stands its snapshot: the messages as the
//! program prints them, or the complete case. Comments `# --set KEY=VALUE` in a file are its settings. A snapshot that differs fails
//! the test; `INSTA_UPDATE=always cargo test --test cases` writes them anew, to be read before they are committed.

use std::{
    collections::BTreeSet,
    fs,
    panic::{AssertUnwindSafe, catch_unwind},
    path::{Path, PathBuf},
};

use miette::{GraphicalReportHandler, GraphicalTheme};
use percuss::case::{Case, CaseErrors, builtin};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases").join(name)
}

/// Names without extension of the files in a folder that have this one.
fn names(folder: &Path, extension: &str) -> BTreeSet<String> {
    let files = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let files = files.map(|name| name.to_string_lossy().into_owned());
    files.filter_map(|name| name.strip_suffix(extension).map(str::to_owned)).collect()
}

/// Reads a case file with the settings in its comments.
fn read(folder: &Path, name: &str) -> Result<Case, CaseErrors> {
    let file = format!("{name}.toml");
    let text = fs::read_to_string(folder.join(&file)).expect("a case file");
    let settings = text.lines().filter_map(|line| line.strip_prefix("# --set "));
    let settings: Vec<String> = settings.map(str::to_owned).collect();
    Case::parse(&file, &text, &settings, folder)
}

/// The problems of a case as the program prints them to a file.
fn messages(errors: &CaseErrors) -> String {
    let handler = GraphicalReportHandler::new_themed(GraphicalTheme::none()).with_links(false);
    let handler = handler.with_width(110);
    let mut text = format!("error: {errors}\n");
    for problem in &errors.problems {
        handler.render_report(&mut text, problem).expect("a String grows");
    }
    text
}

/// The lines of a complete case that depend on how its numbers are read.
fn selected(resolved: &str) -> String {
    const LEFT_OUT: [&str; 10] = [
        "title",
        "kind",
        "cells",
        "order",
        "damping",
        "interface_every",
        "field",
        "views",
        "frames",
        "compression",
    ];
    let is_kept = |line: &&str| !LEFT_OUT.iter().any(|key| line.starts_with(key));
    resolved.lines().filter(is_kept).map(|line| format!("{line}\n")).collect()
}

/// Compares every case of a folder with its snapshot, and reports all that differ.
fn compare(folder: &Path, describe: impl Fn(&str) -> String) {
    let cases = names(folder, ".toml");
    let mut settings = insta::Settings::new();
    settings.set_snapshot_path(folder);
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    let differs = |name: &&String| {
        let compare = || settings.bind(|| insta::assert_snapshot!(name.as_str(), describe(name)));
        catch_unwind(AssertUnwindSafe(compare)).is_err()
    };
    let different: Vec<&String> = cases.iter().filter(differs).collect();
    assert!(different.is_empty(), "differ from their snapshots: {different:?}");
    assert_eq!(names(folder, ".snap"), cases, "every snapshot has its case");
}

#[test]
fn bad_cases_say_what_is_wrong() {
    let folder = folder("bad");
    assert!(names(&folder, ".toml").len() >= 60);
    compare(&folder, |name| match read(&folder, name) {
        Ok(_) => panic!("{name} is accepted"),
        Err(errors) => messages(&errors),
    });
}

#[test]
fn borderline_cases_are_accepted() {
    let folder = folder("valid");
    compare(&folder, |name| match read(&folder, name) {
        Ok(case) => selected(&case.resolved_toml()),
        Err(errors) => panic!("{}", messages(&errors)),
    });
}

/// A complete case is read as itself, however often.
fn check_fixed_point(case: &Case, name: &str) {
    let resolved = case.resolved_toml();
    let again = match Case::parse("again", &resolved, &[], Path::new("")) {
        Ok(again) => again,
        Err(errors) => panic!("{name}: {}\n{resolved}", messages(&errors)),
    };
    assert_eq!(again.resolved_toml(), resolved, "{name}");
    assert_eq!(again.sizes, case.sizes, "{name}");
    assert_eq!(again.scales, case.scales, "{name}");
    assert_eq!(again.impact, case.impact, "{name}");
    assert_eq!(again.indenter, case.indenter, "{name}");
}

#[test]
fn complete_cases_repeat_themselves() {
    for name in builtin::names() {
        check_fixed_point(&Case::load(name, &[]).expect("a built-in case"), name);
    }
    let folder = folder("valid");
    for name in names(&folder, ".toml") {
        check_fixed_point(&read(&folder, &name).expect("a valid case"), &name);
    }
}

/// Keys of the indenters of physical cases, lengths in units of the length L.
const INDENTERS: [&[(&str, &str)]; 8] = [
    &[("shape", "flat"), ("radius", "1")],
    &[("shape", "flat"), ("radius", "1"), ("edge_radius", "0.3")],
    &[("shape", "paraboloid"), ("nose_radius", "1")],
    &[("shape", "paraboloid"), ("nose_radius", "1.7"), ("radius", "1")],
    &[("shape", "sphere"), ("nose_radius", "1")],
    &[("shape", "sphere"), ("nose_radius", "1.3"), ("radius", "1")],
    &[("shape", "cone"), ("half_angle", "80")],
    &[("shape", "profile"), ("points", "")],
];

/// A physical case whose unit of length is so many metres.
fn of_size(metres: f64, indenter: &[(&str, &str)], geometry: &str) -> Case {
    let length = |x: f64| format!("{:?} m", x * metres);
    let mut case = Case::builder("scaled")
        .set("geometry", geometry)
        .set("target.thickness", length(0.7))
        .set("target.material", "pmma")
        .set("impact.velocity", "11.3 m/s")
        .set("mesh.cells", 7)
        .set("run.end_time", format!("{:?} s", metres / 2680.0))
        .set("record.probes", vec![length(0.0), length(0.1), length(0.3)]);
    for (key, value) in indenter {
        let key = format!("indenter.{key}");
        case = match (key.as_str(), value.parse::<f64>()) {
            ("indenter.half_angle", Ok(angle)) => case.set(&key, angle),
            ("indenter.points", _) => {
                let points = [[0.0, 0.0], [0.4, 0.01], [1.1, 0.07]];
                case.set(&key, points.map(|point| point.map(length).to_vec()).to_vec())
            }
            (_, Ok(number)) => case.set(&key, length(number)),
            (_, Err(_)) => case.set(&key, *value),
        };
    }
    if !indenter.iter().any(|(key, _)| key.ends_with("radius")) {
        case = case.set("length_unit", length(1.0));
    }
    match case.build() {
        Ok(case) => case,
        Err(errors) => panic!("{metres} {indenter:?}: {}", messages(&errors)),
    }
}

#[test]
fn physical_cases_of_any_scale_repeat_themselves() {
    for indenter in INDENTERS {
        for geometry in ["axisymmetric", "plane"] {
            // lengths without a short decimal form, from 3 µm to 40 m
            for i in 0..60 {
                let metres = 3.1e-6 * 1.315_f64.powi(i);
                let case = of_size(metres, indenter, geometry);
                check_fixed_point(&case, &format!("{metres} m, {geometry}, {indenter:?}"));
            }
        }
    }
}

#[test]
fn huge_lists_are_refused() {
    let lists = [
        ("record.probes", "radii", "[0.5, ".to_owned() + &"0.5, ".repeat(100_000) + "]"),
        ("record.frame_times", "times", "[0.5, ".to_owned() + &"0.5, ".repeat(100_000) + "]"),
    ];
    for (key, noun, list) in lists {
        let errors = Case::load("fig5", &[format!("{key}={list}")]).expect_err("a huge list");
        let messages: Vec<&str> = errors.problems.iter().map(|problem| problem.message.as_str()).collect();
        assert_eq!(messages, [format!("`{key}` has 100001 {noun}")]);
    }
}
