//! Several bounces of a ball: impact after impact, each a run of its own with the velocity of the rebound before.
//!
//! What is between them is not computed: without drag the ball comes back as fast as it has left. Ball and target begin each impact without waves.

use std::path::Path;

use percuss_output::OutputError;

use super::{CliError, Exit, print};
use crate::{
    case::Case,
    recording::{Destination, copy::metadata},
    units::engineering,
};

/// Computes all impacts of a case, those that are not complete, into `NAME-1.mcap` and so on, and writes their table.
///
/// * `destination`: of the recordings, but for their numbers
/// * `resumes`: what is complete stays
/// * `compute`: an impact; `say`: a remark
pub(super) fn run(
    case: &Case,
    destination: &Destination,
    resumes: bool,
    compute: impl Fn(&Case, Destination) -> Result<Exit, CliError>,
    say: impl Fn(&str),
) -> Result<Exit, CliError> {
    let named = |end: &str| {
        let mut name = destination.path.file_stem().unwrap_or_default().to_owned();
        name.push(end);
        destination.path.with_file_name(name)
    };
    let (bounces, table) = (case.run.bounces, named("-bounces.csv"));
    let overwrite = destination.overwrite || resumes;
    OutputError::refuse_existing(Some(&table), overwrite)?;
    let mut rows: Vec<[f64; 4]> = Vec::new();
    let mut case = case.vary().set("run.bounces", 1).build()?;
    for number in 1..=bounces {
        let velocity = case.units().speed.of(case.impact.velocity);
        let which = format!("impact {number} of {bounces}, at {}", engineering(velocity, "m/s"));
        say(&which);
        let destination = Destination { path: named(&format!("-{number}.mcap")), ..destination.clone() };
        let path = destination.path.clone();
        let exit = compute(&case, destination)?;
        if exit != Exit::Done {
            return Ok(exit);
        }
        let Some(rest) = measured(&path) else {
            let text = format!(
                "{which}: the ball has not left by run.end_time = {}; set a longer one and begin anew with --force: slower impacts last longer",
                case.units().time.text(case.run.end_time)
            );
            return Err(CliError::Failed(text));
        };
        rows.push([velocity, rest[0], rest[1], rest[2]]);
        if number < bounces {
            case = case.vary().set("impact.velocity", format!("{} m/s", velocity * rest[2])).build()?;
        }
    }
    percuss_output::write(&table, csv(&rows).as_bytes(), overwrite)?;
    print(&text(&rows))?;
    say("the flight between impacts is jumped over: each begins with ball and target without waves");
    Ok(Exit::Done)
}

/// Peak force, contact time and restitution of a recording; none of one that ends before the ball has left.
fn measured(path: &Path) -> Option<[f64; 3]> {
    let [status, measures] = metadata(path, ["percuss.status", "percuss.summary"])?;
    if status.get("status").is_none_or(|status| status != "stopped") {
        return None;
    }
    let of = |name: &str| measures.get(name)?.parse::<f64>().ok();
    let restitution = of("restitution_mesh_corrected").or(of("restitution"))?;
    Some([of("peak_force")?, of("contact_duration")?, restitution])
}

/// A row for each impact.
fn csv(rows: &[[f64; 4]]) -> String {
    let line = |(n, row): (usize, &[f64; 4])| format!("{n},{}\n", row.map(|x| format!("{x:?}")).join(","));
    let head = "impact,velocity [m/s],peak_force [N],contact_duration [s],restitution\n";
    head.to_owned() + &(1..).zip(rows).map(line).collect::<String>()
}

/// The same for people.
fn text(rows: &[[f64; 4]]) -> String {
    let line = |n: &str, cells: [String; 4]| {
        format!("{n:<6}{}\n", cells.map(|cell| format!("  {cell:>11}")).concat())
    };
    let of = |(n, &[velocity, force, duration, restitution]): (usize, &[f64; 4])| {
        let [v, f, t] =
            [(velocity, "m/s"), (force, "N"), (duration, "s")].map(|(x, unit)| engineering(x, unit));
        line(&n.to_string(), [v, f, t, format!("{restitution:.4}")])
    };
    let head = line("impact", ["velocity", "peak force", "contact", "restitution"].map(str::to_owned));
    head + &(1..).zip(rows).map(of).collect::<String>()
}
