//! `summary` against numbers computed from what `trace` says of the same recording.

use std::{collections::BTreeMap, fs};

use clap::Parser;
use percuss::{
    case::Case,
    recording::Destination,
    session::{self, Flow, Recording, Source},
    simulation::Simulation,
    view::View,
};
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

/// The record of what a run has measured.
const MEASURES: &str = "percuss.summary";

/// A recording without that record, as programs before format 2.3 write it.
fn without_measures(bytes: &[u8]) -> Vec<u8> {
    forge::with_metadata(bytes, |name, entries| (name != MEASURES).then_some(entries))
}

/// A recording whose record says something else.
fn with_measure(bytes: &[u8], key: &str, number: Option<&str>) -> Vec<u8> {
    forge::with_metadata(bytes, |name, mut entries| {
        if name == MEASURES {
            entries.remove(key);
            entries.extend(number.map(|number| (key.to_owned(), number.to_owned())));
        }
        Some(entries)
    })
}

/// What is measured of the messages alone, as text.
fn of_messages(desk: &Desk, name: &str, status: i32) -> BTreeMap<String, String> {
    desk.put("bare.mcap", without_measures(&desk.bytes(name)));
    let document = desk.json(status, &["summary", "bare.mcap", "--format", "json"]);
    let row = document["rows"][0].as_object().expect("a row");
    let number = |(name, value): (&String, &Value)| Some((name.clone(), value.as_f64()?.to_string()));
    row.iter().filter_map(number).collect()
}

/// The record of a recording.
fn recorded(desk: &Desk, name: &str) -> BTreeMap<String, String> {
    let mut entries = forge::entries(&desk.bytes(name), MEASURES);
    entries.remove("checksum").expect("a checksum");
    entries.remove("warnings");
    entries
}

#[test]
fn a_run_records_what_its_messages_say_bit_for_bit() {
    for (name, settings, least) in [
        ("fig9-m1", &["mesh.cells=20", "record.fields=[]"][..], 14),
        ("fig9-m1", &["mesh.cells=20", "run.stop=\"separation\""], 14),
        ("fig9-m1", &["mesh.cells=20", "run.stop=\"separation\"", "record.frames=0"], 13),
        ("fig9-m1", &["mesh.cells=20", "record.frames=0"], 13),
        ("fig5-plane", &["mesh.cells=12", "indenter.mass=2.0", "record.frames=7"], 10),
        ("elastic-fig5", &["mesh.cells=20", "run.end_time=4", "record.frames=30"], 9),
        ("ball", &["mesh.cells=20", "record.frames=20"], 14),
        ("ball", &["mesh.cells=20", "record.frames=20", "record.interface_every=5", "record.probes=[]"], 14),
        ("laminate-armour", &["mesh.cells=12", "run.end_time=\"4 us\""], 17),
        ("layers", &["mesh.cells=20", "run.end_time=3.0", "target.back=\"free\""], 12),
    ] {
        let desk = Desk::new(&[]);
        forge::record(name, settings, &desk.path("a.mcap"));
        let (found, expected) = (recorded(&desk, "a.mcap"), of_messages(&desk, "a.mcap", 0));
        assert_eq!(found, expected, "{name} {settings:?}");
        assert!(found.len() >= least, "{name} {settings:?}: {found:?}");
        // all that is shown is the same, by either way
        let rows = ["a.mcap", "bare.mcap"].map(|file| {
            let document = desk.json(0, &["summary", file, "--format", "json"]).to_string();
            document.replace("bare.mcap", "a.mcap")
        });
        assert_eq!(rows[0], rows[1], "{name} {settings:?}");
        assert!(desk.text(0, &["verify", "a.mcap"]).contains("sound"));
    }
}

#[test]
fn a_run_that_was_interrupted_records_what_its_messages_say() {
    let desk = Desk::new(&[]);
    let case = Case::load("fig9-m1", &["mesh.cells=20".into(), "record.frames=30".into()]).expect("a case");
    let destination = Destination::new(desk.path("a.mcap"));
    let mut recording = Recording::create(&destination, &case, Source::Simulation).expect("a new file");
    let mut stop = |view: &View<'_>| match view.step {
        50.. => Flow::Interrupt("enough".into()),
        _ => Flow::Continue,
    };
    session::run(&mut Simulation::new(&case), &mut [&mut recording, &mut stop]).expect("room");
    let found = recorded(&desk, "a.mcap.part");
    assert_eq!(found, of_messages(&desk, "a.mcap.part", 3));
    assert!(found.contains_key("peak_force") && !found.contains_key("rebound_velocity"), "{found:?}");
    assert!(desk.text(3, &["verify", "a.mcap.part"]).contains("sound, but PARTIAL"));
    // it is not used: a run that was not finished is measured from its messages
    desk.put("b.mcap", with_measure(&desk.bytes("a.mcap.part"), "peak_force", Some("7")));
    let document = desk.json(3, &["summary", "b.mcap", "--format", "json"]);
    assert_eq!(document["rows"][0]["peak_force"].to_string(), found["peak_force"]);
}

#[test]
fn a_finished_run_is_summarised_without_its_messages() {
    let desk = Desk::new(&[]);
    forge::record("fig9-m1", &["mesh.cells=20", "record.compression=none"], &desk.path("a.mcap"));
    let (rows, _) = summary(&desk, &["a.mcap"]);
    let bytes = desk.bytes("a.mcap");
    let index = mcap::Summary::read(&bytes).expect("a sound file").expect("a summary");
    let chunk = &index.chunk_indexes[0];
    let mut damaged = bytes.clone();
    damaged[(chunk.chunk_start_offset + chunk.chunk_length / 2) as usize] ^= 1;
    desk.put("damaged.mcap", &damaged);
    let (again, _) = summary(&desk, &["damaged.mcap"]);
    assert_eq!(again[0]["peak_force"], rows[0]["peak_force"]);
    // verify sees it, and says nothing of measures that cannot be compared; so does the page, which reads the messages
    let text = desk.text(1, &["verify", "damaged.mcap"]);
    assert!(text.contains("NOT SOUND") && !text.contains(MEASURES), "{text}");
    desk.text(3, &["report", "damaged.mcap", "-o", "damaged.html"]);
    // what was recovered, and what was cut out, is measured from its messages
    desk.text(3, &["recover", "damaged.mcap", "-o", "recovered.mcap"]);
    assert_ne!(recorded(&desk, "recovered.mcap"), of_messages(&desk, "recovered.mcap", 0));
    let (rows, _) = summary(&desk, &["recovered.mcap"]);
    let (bare, _) = summary(&desk, &["bare.mcap"]);
    assert_eq!(rows[0]["impulse"], bare[0]["impulse"]);
    assert!(!desk.text(1, &["verify", "recovered.mcap"]).contains(MEASURES));
}

#[test]
fn a_record_that_does_not_say_what_the_messages_say_is_not_sound() {
    let desk = Desk::new(&[]);
    forge::record("fig9-m1", &["mesh.cells=20", "record.frames=0"], &desk.path("a.mcap"));
    let (bytes, found) = (desk.bytes("a.mcap"), recorded(&desk, "a.mcap"));
    desk.put("same.mcap", with_measure(&bytes, "impulse", Some(&found["impulse"])));
    assert!(desk.text(0, &["verify", "same.mcap"]).contains("same.mcap: sound"));
    let force: f64 = found["peak_force"].parse().expect("a number");
    let (impulse, next) = (&found["impulse"], force.next_up().to_string());
    for (key, number, line) in [
        (
            "peak_force",
            Some(next.as_str()),
            format!("peak_force {next}, the messages say {}", found["peak_force"]),
        ),
        ("impulse", None, format!("impulse nothing, the messages say {impulse}")),
        ("impulse", Some("much"), format!("impulse much, the messages say {impulse}")),
        ("energy_left", Some("0.25"), "energy_left 0.25, the messages say nothing".into()),
    ] {
        desk.put("forged.mcap", with_measure(&bytes, key, number));
        let text = desk.text(1, &["verify", "forged.mcap"]);
        assert!(
            text.contains("NOT SOUND") && text.contains(&format!("`{MEASURES}` says {line}\n")),
            "{text}"
        );
        assert_eq!(text.lines().count(), 2, "{text}");
        // the page says so too
        desk.text(0, &["report", "forged.mcap", "--force", "-o", "forged.html"]);
        let page = String::from_utf8(desk.bytes("forged.html")).expect("text");
        assert!(page.contains("\"sound\":false") && page.contains(&format!("says {key} ")));
        // what it says is no difference of the runs
        let text = desk.text(0, &["diff", "a.mcap", "forged.mcap"]);
        assert!(text.contains(MEASURES), "{text}");
    }
    // the rest of a record that cannot be read is used
    desk.put("forged.mcap", with_measure(&bytes, "impulse", Some("much")));
    let (rows, _) = summary(&desk, &["forged.mcap"]);
    assert!(rows[0]["impulse"].is_null() && rows[0]["peak_force"].is_number(), "{rows:?}");
}
