//! Recordings in SI: prefixes where people read, base units where scripts do, and comparison with dimensionless ones.

use std::fs;

use serde_json::Value;

use crate::{desk::Desk, si};

/// A small dimensionless recording of Fig. 5, and its twin in SI.
fn desk() -> Desk {
    let desk = Desk::new(&[]);
    let settings = ["mesh.cells=20", "run.end_time=2.5", "record.frames=10"];
    si::record("fig5", &settings, &desk.path("plain.mcap"));
    si::write_in_si(&desk.path("plain.mcap"), &desk.path("si.mcap"), |_, scale| Some(scale));
    desk
}

#[test]
fn csv_has_the_prefix_of_the_largest_number() {
    let desk = desk();
    let prefixed = desk.lines(&["trace", "si.mcap"]);
    assert_eq!(prefixed[0], "time [µs],step,force [MN],contact_radius [mm]");
    let base = desk.lines(&["trace", "si.mcap", "--units", "base"]);
    assert_eq!(base[0], "time [s],step,force [N],contact_radius [m]");
    assert_eq!(prefixed.len(), base.len());
    let numbers =
        |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect::<Vec<f64>>();
    let mut largest = [0.0_f64; 4];
    for (line, base) in prefixed.iter().zip(&base).skip(1) {
        let (line, base) = (numbers(line), numbers(base));
        for (i, factor) in [1e6, 1.0, 1e-6, 1e3].into_iter().enumerate() {
            assert!((line[i] - base[i] * factor).abs() <= 1e-15 * line[i].abs(), "{line:?} {base:?}");
            largest[i] = largest[i].max(line[i].abs());
        }
    }
    assert!([0, 2, 3].iter().all(|&i| (1.0..1000.0).contains(&largest[i])), "{largest:?}");
    // what of the rows is shown decides
    assert!(desk.lines(&["trace", "si.mcap", "--to", "3e-7"])[0].starts_with("time [ns]"));
    // the wire is left alone where scripts read
    let row: Value =
        serde_json::from_str(&desk.lines(&["trace", "si.mcap", "--format", "jsonl"])[1]).expect("an object");
    assert_eq!(row["force"], numbers(&base[2])[2]);
    // dimensionless tables have no prefixes
    let plain = desk.text(0, &["trace", "plain.mcap"]);
    assert_eq!(plain, desk.text(0, &["trace", "plain.mcap", "--units", "base"]));
}

#[test]
fn times_and_positions_take_units() {
    let desk = desk();
    let stress = ["trace", "si.mcap", "--topic", "/interface/stress"];
    for (typed, plain) in [
        (&["--to", "300ns", "--at", "r=0.1mm,200 um"], &["--to", "3e-7", "--at", "r=1e-4,2e-4"]),
        (&["--to", "0.3us", "--field", "stress@r=0.1mm"], &["--to", "3e-7", "--field", "stress@r=1e-4"]),
    ] {
        let [typed, plain] = [typed, plain].map(|more| desk.text(0, &[&stress[..], more].concat()));
        assert_eq!(typed, plain);
        assert!(typed.lines().count() > 2, "{typed}");
    }
    let export =
        |time| ["export", "si.mcap", "--topic", "/field/stress", "--force", "-o", "f.npy", "--at-time", time];
    desk.text(0, &export("0.4 us"));
    let field = desk.bytes("f.npy");
    desk.text(0, &export("4e-7"));
    assert_eq!(field, desk.bytes("f.npy"));
    for (arguments, what) in [
        (&["trace", "plain.mcap", "--to", "3us"][..], "times of `/drag` are in R/c_p"),
        (&["trace", "si.mcap", "--to", "3mm"], "`mm` is no unit of time; known are ps, ns, µs, ms, s"),
        (&["plot", "plain.mcap", "--topic", "/interface/stress", "--at-time", "3us"], "in R/c_p"),
        (&["plot", "plain.mcap", "--map", "--from", "3us"], "in R/c_p"),
        (
            &["plot", "plain.mcap", "--map", "--topic", "/field/stress", "--at", "r=1mm"],
            "positions r of `/field/stress`",
        ),
        (
            &["trace", "plain.mcap", "--topic", "/interface/stress", "--at", "r=1mm"],
            "are in R, the recording has no units",
        ),
        (
            &["export", "plain.mcap", "--topic", "/field/stress", "-o", "g.npy", "--at-time", "3us"],
            "in R/c_p",
        ),
        (&["cat", "plain.mcap", "--topic", "/drag", "--to", "3us"], "in R/c_p"),
        (&["diff", "plain.mcap", "plain.mcap", "--to", "3us"], "in R/c_p"),
        (&["replay", "plain.mcap", "--to", "3us"], "in R/c_p"),
    ] {
        let error = desk.error(2, arguments);
        assert!(error.contains(what), "{arguments:?}: {error}");
    }
}

#[test]
fn arrays_are_written_over_time() {
    let desk = desk();
    let open = |name: &str| {
        ndarray_npy::NpzReader::new(fs::File::open(desk.path(name)).expect("a file")).expect("an archive")
    };
    let trace = |topic, name| ["trace", "si.mcap", "--topic", topic, "-o", name];
    desk.text(0, &trace("/field/stress", "field.npz"));
    let mut archive = open("field.npz");
    let [time, r, z] = ["time", "r", "z"]
        .map(|name| archive.by_name::<ndarray::OwnedRepr<f64>, ndarray::Ix1>(name).expect(name));
    let stress: ndarray::Array3<f32> = archive.by_name("stress").expect("a field");
    assert_eq!(stress.dim(), (time.len(), z.len(), r.len()));
    assert!(time.len() > 5 && z.len() > 5 && r.len() > 5);
    // what a single export has
    for i in [1, time.len() - 1] {
        let at = time[i].to_string();
        desk.text(
            0,
            &["export", "si.mcap", "--topic", "/field/stress", "--at-time", &at, "-o", "one.npz", "--force"],
        );
        let mut one = open("one.npz");
        let values: ndarray::Array2<f64> = one.by_name("values").expect("a matrix");
        let (radii, depths): (ndarray::Array1<f64>, ndarray::Array1<f64>) =
            (one.by_name("r").expect("radii"), one.by_name("z").expect("depths"));
        assert_eq!((radii, depths), (r.clone(), z.clone()));
        assert_eq!(stress.index_axis(ndarray::Axis(0), i).mapv(f64::from), values);
    }
    let bytes = desk.bytes("field.npz");
    let text = |text: &str| text.chars().flat_map(|c| u32::from(c).to_le_bytes()).collect::<Vec<u8>>();
    for unit in ["stress", "Pa", "m", "s"] {
        let unit = [text(unit), vec![0; 8]].concat();
        assert!(bytes.windows(unit.len()).any(|part| part == unit), "{unit:?}");
    }
    desk.text(
        0,
        &[&trace("/interface/stress", "line.npz")[..], &["--from", "100ns", "--every", "3"]].concat(),
    );
    let mut archive = open("line.npz");
    let time: ndarray::Array1<f64> = archive.by_name("time").expect("times");
    let stress: ndarray::Array2<f64> = archive.by_name("stress").expect("an array");
    let at = [
        "trace",
        "si.mcap",
        "--topic",
        "/interface/stress",
        "--from",
        "100ns",
        "--every",
        "3",
        "--units",
        "base",
    ];
    let rows = desk.lines(&at);
    assert_eq!((stress.dim().0, time.len()), (rows.len() - 1, rows.len() - 1));
    for (row, line) in rows.iter().skip(1).enumerate() {
        let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        assert_eq!(cells[0], time[row]);
        assert!(
            cells[2..]
                .iter()
                .zip(stress.row(row))
                .all(|(a, b)| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan())
        );
    }
    // a table of it would have no values
    for name in ["field.csv", "field.parquet", "field.npy"] {
        let error = desk.error(2, &trace("/field/stress", name));
        assert!(error.contains("whole it is in an .npz of trace") && !desk.path(name).exists(), "{error}");
    }
}

#[test]
fn units_can_be_chosen() {
    let desk = desk();
    let units = ["--unit", "force=kN", "--unit", "time=ms"];
    let lines = desk.lines(&[&["trace", "si.mcap"], &units[..]].concat());
    assert_eq!(lines[0], "time [ms],step,force [kN],contact_radius [mm]");
    let base = desk.lines(&["trace", "si.mcap", "--units", "base"]);
    let force = |line: &str| line.split(',').nth(2).expect("a force").parse::<f64>().expect("a number");
    assert!((force(&lines[9]) / force(&base[9]) - 1e-3).abs() < 1e-15);
    // in other formats only what is chosen changes
    let json = desk.lines(&[&["trace", "si.mcap", "--format", "jsonl"], &units[..]].concat());
    let row: Value = serde_json::from_str(&json[8]).expect("an object");
    assert_eq!(
        (row["force"].as_f64(), row["contact_radius"].as_f64()),
        (Some(force(&lines[9])), base[9].split(',').nth(3).and_then(|cell| cell.parse().ok()))
    );
    let table = desk.text(0, &[&["summary", "si.mcap"], &units[..]].concat());
    assert!(table.contains("[kN]") && table.contains("[ms]") && !table.contains("µs"), "{table}");
    desk.text(0, &[&["plot", "si.mcap", "-o", "drag.svg"], &units[..]].concat());
    desk.text(
        0,
        &[&["plot", "si.mcap", "--map", "-o", "map.svg", "--unit", "stress=kPa"], &units[..]].concat(),
    );
    let texts = |name: &str| String::from_utf8(desk.bytes(name)).expect("text");
    assert!(texts("drag.svg").contains("force [kN]") && texts("drag.svg").contains("time [ms]"));
    assert!(texts("map.svg").contains("stress [kPa]") && texts("map.svg").contains("time [ms]"));
    let at = ["plot", "si.mcap", "--topic", "/interface/stress", "--at-time", "100ns,300ns", "-o", "at.svg"];
    desk.text(0, &[&at[..], &["--unit", "time=ps"]].concat());
    assert!(texts("at.svg").contains(" ps</title>"));
    let stress = |name: &str| {
        let file = fs::File::open(desk.path(name)).expect("a file");
        let mut archive = ndarray_npy::NpzReader::new(file).expect("an archive");
        let stress: ndarray::Array2<f64> = archive.by_name("stress").expect("an array");
        stress[[1, 0]]
    };
    let arrays = ["trace", "si.mcap", "--topic", "/interface/stress", "-o"];
    desk.text(0, &[&arrays[..], &["a.npz"]].concat());
    desk.text(0, &[&arrays[..], &["b.npz", "--unit", "stress=MPa", "--unit", "length=mm"]].concat());
    assert_eq!(stress("a.npz") / 1e6, stress("b.npz"));
    let error = desk.error(2, &["plot", "si.mcap", "--unit", "force=kPa"]);
    assert!(error.contains("`kPa` is no unit of force"), "{error}");
}

#[test]
fn columns_of_an_array_share_a_prefix() {
    let desk = desk();
    let header = desk.lines(&["trace", "si.mcap", "--topic", "/probes"]).remove(0);
    let units: Vec<&str> =
        header.split(',').filter_map(|name| name.split_once(" [")).map(|(_, unit)| unit).collect();
    let stresses = units.iter().filter(|unit| unit.ends_with("Pa]")).count();
    assert!(stresses > 3 && units.iter().filter(|unit| **unit == "TPa]").count() == stresses, "{header}");
    let stacked = desk.lines(&["trace", "si.mcap", "si.mcap", "--stack"]).remove(0);
    assert_eq!(stacked, "file,time [µs],step,force [MN],contact_radius [mm]");
}

#[test]
fn the_report_has_prefixes() {
    let desk = desk();
    desk.text(0, &["report", "si.mcap"]);
    let page = fs::read_to_string(desk.path("si.html")).expect("a page");
    for text in ["time [µs]", "force [MN]", "\"time_unit\":\"µs\"", "\"length_unit\":\"mm\""] {
        assert!(page.contains(text), "{text}");
    }
    desk.text(0, &["report", "plain.mcap"]);
    let page = fs::read_to_string(desk.path("plain.html")).expect("a page");
    assert!(page.contains("time [R/c_p]") && !page.contains("\"time_unit\""));
}

#[test]
fn the_report_is_in_words_and_engineering_units() {
    let desk = Desk::new(&[]);
    si::record("ball", &["mesh.cells=15", "run.end_time=30 us", "record.frames=5"], &desk.path("ball.mcap"));
    desk.text(0, &["report", "ball.mcap"]);
    let page = fs::read_to_string(desk.path("ball.html")).expect("a page");
    let json =
        page.split_once("id=\"data\">").and_then(|(_, rest)| rest.split_once("</script>")).expect("data").0;
    let data: Value = serde_json::from_str(json).expect("JSON");
    let row = |table: &str, name: &str| {
        let rows = data["facts"][table].as_array().expect("rows");
        let row = rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("{name}: {rows:?}"));
        row[1].as_str().expect("text").to_owned()
    };
    let recording = desk.text(0, &["info", "ball.mcap"]);
    let recorded = |key: &str| {
        let line = recording
            .lines()
            .find(|line| line.trim_start().starts_with(&format!("{key} = ")))
            .expect("a line");
        line.split_once(" = ").and_then(|(_, number)| number.parse::<f64>().ok()).expect("a number")
    };
    let pressure = row("results", "Largest pressure");
    let (number, place) = pressure.split_once(" MPa at r = ").expect("a pressure");
    let largest = 1e-6 * recorded("largest_pressure");
    assert!(
        (number.parse::<f64>().expect("a number") / largest - 1.0).abs() < 1e-3 && number.len() == 5,
        "{pressure}"
    );
    assert!(place.contains("m, z = 0 m, t = ") && place.ends_with(" µs"), "{pressure}");
    assert!(row("results", "Peak force").contains(" kN at t = "), "{}", row("results", "Peak force"));
    assert!(row("run", "Spacing").starts_with("dr = ") && row("run", "Units").contains("R/c_p = 3.731 µs"));
    assert!(row("energy", "Kinetic energy of the target").ends_with('J'));
    let probes = data["charts"]
        .as_array()
        .expect("charts")
        .iter()
        .find(|chart| chart["id"] == "probes")
        .expect("probes");
    assert_eq!(probes["curves"][1]["name"], "r = 863.0 µm");
    // the indenter and the contact at every frame, and its outline as far as the profile reaches
    let (body, times) = (&data["field"]["body"], data["field"]["times"].as_array().expect("times").len());
    let list = |key: &str| {
        body[key]
            .as_array()
            .expect("a list")
            .iter()
            .map(|x| x.as_f64().expect("a number"))
            .collect::<Vec<_>>()
    };
    assert_eq!(
        (list("depths").len(), list("radii").len(), body["is_cut"].as_bool()),
        (times, times, Some(false))
    );
    assert!(list("depths").is_sorted() && list("radii").is_sorted());
    let sphere = |r: f64| 10.0 - (100.0 - r * r).sqrt();
    let (radii, heights) = (list("r"), list("height"));
    assert!(radii.len() > 5 && radii.len() == heights.len());
    for (r, height) in radii.into_iter().zip(heights) {
        // from the first node on, which is not on the axis
        assert!((height - sphere(r)).abs() < 0.02, "{r} {height}");
    }
}

/// Topics of double precision, without the words in which an event gives its numbers.
const TOPICS: &str = "/interface/stress,/drag,/velocity,/probes,/energy";

#[test]
fn recordings_in_other_units_are_converted_by_their_scales() {
    let desk = desk();
    for (names, text) in [
        (["plain.mcap", "si.mcap"], "si.mcap is converted from SI by its scales"),
        (["si.mcap", "plain.mcap"], "plain.mcap is converted to SI by the scales of si.mcap"),
    ] {
        let arguments = ["diff", names[0], names[1], "--topic", TOPICS, "--rel", "1e-12"];
        let output = desk.text(0, &arguments);
        assert!(output.contains(text), "{output}");
        let json = desk.text(0, &[&arguments[..], &["--json"]].concat());
        let json: Value = serde_json::from_str(&json).expect("JSON");
        let comparison = &json["comparisons"][0];
        assert_eq!(comparison["converted"], text);
        assert!(comparison.get("structure").is_none());
        let differing = comparison["channels"].as_array().map_or(0, Vec::len);
        assert_eq!(differing + comparison["equal"].as_object().map_or(0, serde_json::Map::len), 5);
        // single precision is rounded once more
        let arguments = ["diff", names[0], names[1], "--topic", "/field/stress", "--rel", "1e-6"];
        assert!(desk.text(0, &arguments).contains(text));
    }
    // in the same units nothing is converted
    let same = desk.text(0, &["diff", "si.mcap", "si.mcap"]);
    assert!(!same.contains("converted"), "{same}");
    let between = ["diff", "plain.mcap", "si.mcap", "--topic", "/drag", "--align", "linear", "--rel", "1e-9"];
    desk.text(0, &between);
    let window = ["diff", "plain.mcap", "si.mcap", "--topic", "/drag", "--from", "1", "--rel", "1e-12"];
    desk.text(0, &window);
    let error =
        desk.error(2, &["diff", "plain.mcap", "si.mcap", "--topic", "/drag", "--write-diff", "d.mcap"]);
    assert!(error.contains("same units"), "{error}");
}

#[test]
fn a_wrong_scale_is_a_difference() {
    let desk = desk();
    for (wrong, topic) in [
        ("scale.force_n", "/drag"),
        ("scale.length_m", "/velocity"),
        ("scale.speed_m_per_s", "/velocity"),
        ("scale.stress_pa", "/probes"),
        ("scale.energy_j", "/energy"),
        ("scale.time_s", "/drag"),
    ] {
        let off = |key: &str, scale: f64| Some(if key == wrong { scale * (1.0 + 1e-6) } else { scale });
        let name = format!("{wrong}.mcap");
        si::write_in_si(&desk.path("plain.mcap"), &desk.path(&name), off);
        desk.text(1, &["diff", "plain.mcap", &name, "--topic", topic, "--rel", "1e-12"]);
        desk.text(0, &["diff", "plain.mcap", &name, "--topic", topic, "--rel", "1e-5"]);
    }
}

#[test]
fn without_a_scale_the_units_differ() {
    let desk = desk();
    si::write_in_si(&desk.path("plain.mcap"), &desk.path("bare.mcap"), |_, _| None);
    let text = desk.text(1, &["diff", "plain.mcap", "bare.mcap", "--topic", "/drag", "--rel", "1e-12"]);
    assert!(text.contains("unit `πR²γc_p²` became `N`") && !text.contains("converted"), "{text}");
}
