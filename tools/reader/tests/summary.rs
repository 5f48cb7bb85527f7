//! `summary` against numbers computed from what `trace` says of the same recording.

use std::fs;

use clap::Parser;
use serde_json::Value;

use crate::{cases::words, desk::Desk, forge};

const FINITE_MASS: [&str; 2] = ["mesh.cells=20", "record.fields=[]"];

/// Columns of a trace by name, empty cells left out.
fn trace(desk: &Desk, file: &str, topic: &str) -> Vec<serde_json::Map<String, Value>> {
    let lines = desk.lines(&["trace", file, "--topic", topic, "--format", "jsonl"]);
    lines.iter().map(|line| serde_json::from_str(line).expect("an object")).collect()
}

fn column(rows: &[serde_json::Map<String, Value>], name: &str) -> Vec<f64> {
    rows.iter().map(|row| row[name].as_f64().expect("a number")).collect()
}

/// The row of a recording, and the units.
fn summary(desk: &Desk, arguments: &[&str]) -> (Vec<Value>, Value) {
    let arguments = [&["summary", "--format", "json"], arguments].concat();
    let document = desk.json(0, &arguments);
    (document["rows"].as_array().expect("rows").clone(), document["units"].clone())
}

fn near(value: &Value, expected: f64) {
    let value = value.as_f64().unwrap_or_else(|| panic!("{value} is no number, expected {expected}"));
    assert!((value - expected).abs() <= 1e-13 * expected.abs(), "{value}, expected {expected}");
}

fn linear(times: &[f64], values: &[f64], at: f64) -> f64 {
    let next = times.iter().position(|time| *time >= at).expect("a later time");
    if times[next] == at {
        return values[next];
    }
    let share = (at - times[next - 1]) / (times[next] - times[next - 1]);
    values[next - 1] * (1.0 - share) + values[next] * share
}

#[test]
fn measures_of_a_rebound_are_those_of_the_messages() {
    let desk = Desk::new(&[]);
    forge::record("fig9-m1", &FINITE_MASS, &desk.path("m1.mcap"));
    let (rows, units) = summary(&desk, &["m1.mcap"]);
    let row = &rows[0];
    assert_eq!(rows.len(), 1);
    assert_eq!(row["file"], "m1.mcap");
    assert!(row.get("indenter.mass").is_none(), "nothing differs in one file");

    let drag = trace(&desk, "m1.mcap", "/drag");
    let (time, force) = (column(&drag, "time"), column(&drag, "force"));
    let radius = column(&drag, "contact_radius");
    let peak = force.iter().copied().fold(f64::MIN, f64::max);
    near(&row["peak_force"], peak);
    near(&row["peak_time"], time[force.iter().position(|force| *force == peak).expect("the peak")]);
    let impulse = (1..time.len()).map(|i| (force[i] + force[i - 1]) / 2.0 * (time[i] - time[i - 1]));
    near(&row["impulse"], impulse.sum());
    let contact: Vec<f64> =
        (0..time.len()).filter(|&i| force[i] != 0.0 || radius[i] > 0.0).map(|i| time[i]).collect();
    near(&row["contact_duration"], contact[contact.len() - 1] - contact[0]);
    assert!(contact[contact.len() - 1] < time[time.len() - 1], "the indenter leaves the target");
    near(&row["contact_radius"], radius.iter().copied().fold(0.0, f64::max));

    let motion = trace(&desk, "m1.mcap", "/velocity");
    let velocity = column(&motion, "velocity");
    near(&row["depth"], column(&motion, "displacement").into_iter().fold(f64::MIN, f64::max));
    let events = trace(&desk, "m1.mcap", "/event");
    let event = |kind: &str| events.iter().find(|event| event["kind"] == kind).expect("the event");
    near(&row["t_ext"], event("EXTENSION")["time"].as_f64().expect("a time"));
    let separation = event("SEPARATION")["since"].as_f64().expect("a time");
    let rebound = linear(&time, &velocity, separation);
    near(&row["rebound_velocity"], rebound);
    // over V0, not over the velocity that the first step has left
    near(&row["restitution"], -rebound);
    assert!(velocity[0] < 0.999, "the first step slows it down");
    // nothing touches the indenter any more
    near(&row["rebound_velocity"], velocity[velocity.len() - 1]);
    let energy = trace(&desk, "m1.mcap", "/energy");
    let target: Vec<f64> =
        column(&energy, "kinetic").iter().zip(column(&energy, "strain")).map(|(a, b)| a + b).collect();
    near(&row["energy_left"], linear(&column(&energy, "time"), &target, separation));

    let validity = forge::entries(&desk.bytes("m1.mcap"), "percuss.validity");
    for (name, key) in [("", ""), ("_r", ".r"), ("_z", ".z"), ("_time", ".time")] {
        let recorded = validity[&format!("largest_strain{key}")].parse().expect("a number");
        near(&row[format!("largest_strain{name}")], recorded);
    }
    for (name, unit) in [
        ("peak_force", "πR²γc_p²"),
        ("impulse", "πR²γc_p²·R/c_p"),
        ("depth", "R"),
        ("rebound_velocity", "c_p"),
        ("energy_left", "πR³γc_p²"),
        ("t_ext", "R/c_p"),
    ] {
        assert_eq!(units[name], unit, "{name}");
    }
}

#[test]
fn a_rebound_gives_back_less_than_the_impact_had() {
    let desk = Desk::new(&[]);
    forge::record("fig9-m1", &FINITE_MASS, &desk.path("m1.mcap"));
    let (rows, _) = summary(&desk, &["m1.mcap"]);
    let number = |name: &str| rows[0][name].as_f64().expect("a number");
    let (restitution, rebound) = (number("restitution"), number("rebound_velocity"));
    assert!(restitution > 0.0 && restitution < 1.0, "{restitution}");
    // M = 1 in units of πγR³ and V0 = 1: M·(V0 − V) is Σ F·Δt, of which the trapezia take half of the first
    let drag = trace(&desk, "m1.mcap", "/drag");
    let (time, force) = (column(&drag, "time"), column(&drag, "force"));
    let sum = number("impulse") + 0.5 * force[0] * (time[1] - time[0]);
    assert!((sum / (1.0 - rebound) - 1.0).abs() < 1e-9, "{sum}");
    let energy = trace(&desk, "m1.mcap", "/energy");
    let last = |name: &str| *column(&energy, name).last().expect("a frame");
    let sum = 0.5 * rebound * rebound + number("energy_left") + last("dissipated") + last("damped");
    assert!((sum / 0.5 - 1.0).abs() < 0.01, "{sum}");
}

#[test]
fn a_sweep_measures_what_its_recordings_say() {
    for sweep in [
        "fig9-m1 --vary indenter.mass=1,3 --set record.frames=20",
        "ball --vary 'impact.velocity=2 m/s,5 m/s' --set record.frames=20 --set 'run.end_time=250 us'",
        "laminate-armour --vary target.back=rigid,free --set 'run.end_time=4 us'",
    ] {
        let desk = Desk::new(&[]);
        let folder = desk.path("s").display().to_string();
        let arguments = words(&format!("percuss sweep {sweep} --set mesh.cells=20 -q -o '{folder}'"));
        percuss::cli::Arguments::parse_from(arguments).run().expect("a sweep");
        let recordings = fs::read_dir(desk.path("s/runs")).expect("recordings");
        let name =
            |entry: std::io::Result<fs::DirEntry>| entry.expect("an entry").path().display().to_string();
        let mut recordings: Vec<String> = recordings.map(name).collect();
        recordings.sort();
        let (rows, units) = summary(&desk, &recordings.iter().map(String::as_str).collect::<Vec<_>>());
        let table = String::from_utf8(desk.bytes("s/summary.csv")).expect("text");
        let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let headings = lines.next().expect("a heading");
        let first = headings.iter().position(|heading| *heading == "status").expect("a status") + 1;
        let mut known = 0;
        for (row, line) in rows.iter().zip(lines) {
            for (heading, cell) in headings.iter().zip(line).skip(first) {
                let (name, unit) = heading
                    .split_once(" [")
                    .map_or((*heading, None), |(name, unit)| (name, Some(unit.trim_end_matches(']'))));
                assert_eq!(units.get(name).and_then(Value::as_str), unit, "{heading}");
                assert_eq!(row[name].as_f64(), cell.parse::<f64>().ok(), "{sweep:?}, {heading}");
                known += usize::from(!cell.is_empty());
            }
        }
        assert!(rows.len() == 2 && known > 18, "{known} numbers in {table}");
    }
}
