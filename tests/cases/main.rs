//! Case files at and beyond the edge of what is allowed, with what is said about each.
//!
//! The tables beside this file have the cases (`table` describes them): those of `valid.txt` are accepted, and how its complete case
//! differs from that of its base stands with each; those of the others are refused, with every problem, its place and its help.
//! `printed.txt` has the messages as the program prints them. A table that differs fails the test, and so does a list of keys in the guide;
//! `PERCUSS_BLESS=1 cargo test --test cases` writes it anew, to be read before it is committed.

mod mutations;
mod table;

use std::{env, fmt::Write, fs, path::Path};

use miette::{Diagnostic, GraphicalReportHandler, GraphicalTheme};
use percuss::case::{Case, CaseErrors, Problem, builtin, keys};

use table::Entry;

/// Tables of cases that are refused.
const BAD: [&str; 8] = [
    "indenter.txt",
    "layers.txt",
    "mesh.txt",
    "printed.txt",
    "record.txt",
    "syntax.txt",
    "target.txt",
    "units.txt",
];

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

/// A problem in short: place and text that it is about, message, help.
fn summary(problem: &Problem) -> String {
    let mut text = String::new();
    for label in problem.labels().into_iter().flatten() {
        let source = problem.source_code().expect("a label has its text");
        let place = source.read_span(label.inner(), 0, 0).expect("a label within its text");
        let about = str::from_utf8(place.data()).expect("UTF-8");
        let file =
            place.name().filter(|name| *name == "--set").map_or(String::new(), |name| format!("{name} "));
        writeln!(text, "{file}{}:{} {about}", place.line() + 1, place.column() + 1).expect("a String grows");
    }
    writeln!(text, "error: {problem}").expect("a String grows");
    if let Some(help) = problem.help() {
        writeln!(text, "help: {help}").expect("a String grows");
    }
    text
}

/// The lines, but for the title, that only one of two complete cases has.
fn difference(base: &str, case: &str) -> String {
    let only = |a: &str, b: &str, sign| -> String {
        a.lines()
            .filter(|line| !line.starts_with("title") && b.lines().all(|other| other != *line))
            .map(|line| format!("{sign} {line}\n"))
            .collect()
    };
    only(base, case, '-') + &only(case, base, '+')
}

/// Compares a table with what is said about its cases now.
fn compare(table: &str, describe: impl Fn(&Entry) -> String) {
    let entries = table::read(table);
    let now: Vec<String> = entries.iter().map(&describe).collect();
    if env::var_os("PERCUSS_BLESS").is_some() {
        let entries: Vec<String> = entries.iter().zip(&now).map(|(entry, now)| entry.with(now)).collect();
        fs::write(table::path(table), entries.join("\n")).expect("a table");
        return;
    }
    let different = entries.iter().zip(&now).filter(|(entry, now)| entry.says != **now);
    let different: String = different.map(|(entry, now)| format!("\n{}", entry.with(now))).collect();
    assert!(different.is_empty(), "{table} says otherwise about these:\n{different}");
}

#[test]
fn bad_cases_say_what_is_wrong() {
    let profiles = table::profiles();
    for table in BAD {
        compare(table, |entry| match entry.parse(profiles.path()) {
            Ok(_) => panic!("{} is accepted", entry.name()),
            Err(errors) if table == "printed.txt" => messages(&errors),
            Err(errors) => errors.problems.iter().map(summary).collect(),
        });
    }
}

#[test]
fn borderline_cases_are_accepted() {
    let profiles = table::profiles();
    let complete = |entry: &Entry| match entry.parse(profiles.path()) {
        Ok(case) => case.resolved_toml(),
        Err(errors) => panic!("{}", messages(&errors)),
    };
    let bases = table::read("valid.txt");
    compare("valid.txt", |entry| {
        let base = bases.iter().find(|base| entry.base() == Some(base.name()));
        base.map_or(complete(entry), |base| difference(&complete(base), &complete(entry)))
    });
}

#[test]
fn the_guide_has_the_table_of_keys() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/case/keys.md");
    let page = fs::read_to_string(&path).expect("a page of the guide");
    let section = |part: &str| {
        let heading = part.lines().next().unwrap_or_default().trim_matches(['`', '[', ']']);
        let table = keys::guide(if heading == "Top level" { "" } else { heading })?;
        let (text, _) = part.split_once("\n|").expect("a table below the heading");
        Some(format!("{text}\n{table}"))
    };
    let parts = page.split("\n## ").map(|part| section(part).unwrap_or_else(|| part.to_owned()));
    let now = parts.collect::<Vec<_>>().join("\n## ");
    if env::var_os("PERCUSS_BLESS").is_some() {
        fs::write(&path, now).expect("a page of the guide");
    } else {
        assert_eq!(now, page, "{} is not the table of keys", path.display());
    }
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
    assert_eq!(again.target, case.target, "{name}");
    assert_eq!(again.scales, case.scales, "{name}");
    assert_eq!(again.impact, case.impact, "{name}");
    assert_eq!(again.indenter, case.indenter, "{name}");
}

#[test]
fn complete_cases_repeat_themselves() {
    for name in builtin::names() {
        check_fixed_point(&Case::load(name, &[]).expect("a built-in case"), name);
    }
    let profiles = table::profiles();
    for entry in table::read("valid.txt") {
        check_fixed_point(&entry.parse(profiles.path()).expect("a valid case"), entry.name());
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
fn a_thousand_layers_are_one_error() {
    let layer = "[[target.layer]]\nthickness = \"half-space\"\nbond = 1\nshear_wave_speed = 0.5\n";
    let rest = "[indenter]\nshape = \"flat\"\nradius = 1.0\n[run]\nend_time = 1.0\n";
    let text = format!("{}{rest}", layer.replace("bond = 1\n", "") + &layer.repeat(999));
    let errors = Case::parse("stack", &text, &[], Path::new("")).expect_err("too many layers");
    let messages: Vec<&str> = errors.problems.iter().map(|problem| problem.message.as_str()).collect();
    assert_eq!(messages, ["`target.layer` has 1000 layers"]);
}

#[test]
fn huge_lists_are_refused() {
    let lists = [
        ("record.probes", "radii", "[0.5, ".to_owned() + &"0.5, ".repeat(100_000) + "]"),
        ("record.frame_times", "times", "[0.5, ".to_owned() + &"0.5, ".repeat(100_000) + "]"),
        ("record.points", "points", "[[0, 0], ".to_owned() + &"[0, 0], ".repeat(100_000) + "]"),
    ];
    for (key, noun, list) in lists {
        let errors = Case::load("fig5", &[format!("{key}={list}")]).expect_err("a huge list");
        let messages: Vec<&str> = errors.problems.iter().map(|problem| problem.message.as_str()).collect();
        assert_eq!(messages, [format!("`{key}` has 100001 {noun}")]);
    }
}
