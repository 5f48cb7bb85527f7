//! Recordings: their content, repeatability and end.

use std::{collections::BTreeMap, fs, path::Path, sync::mpsc};

use mcap::{MessageStream, Summary};
use percuss::{
    advice::Advised,
    case::Case,
    message::{foxglove, percuss as message},
    recording::{Destination, FORMAT_VERSION, Tap},
    session::{self, ExactSteps, Flow, Observer, Recording, RunError, Source, Status, Steps},
    simulation::Simulation,
    validity::Validity,
    view::View,
};
use percuss_output::part_of;
use prost::Message;

use crate::case;

mod physical;

/// Runs a case into a file and returns its bytes.
fn record(case: &Case, path: &Path) -> Vec<u8> {
    let mut recording =
        Recording::create(&Destination::new(path), case, Source::Simulation).expect("a new file");
    let mut steps = Advised::new(case, Simulation::new(case));
    session::run(&mut steps, &mut [&mut recording]).expect("a sound run");
    fs::read(path).expect("the recording")
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

pub(crate) fn metadata(bytes: &[u8]) -> BTreeMap<String, BTreeMap<String, String>> {
    let summary = summary(bytes);
    let read = |index| mcap::read::metadata(bytes, index).expect("a metadata record");
    summary.metadata_indexes.iter().map(read).map(|record| (record.name, record.metadata)).collect()
}

fn summary(bytes: &[u8]) -> Summary {
    Summary::read(bytes).expect("a sound file").expect("a summary")
}

/// Metadata of the channels by topic.
fn channels(bytes: &[u8]) -> BTreeMap<String, BTreeMap<String, String>> {
    let channels = summary(bytes).channels;
    channels.values().map(|channel| (channel.topic.clone(), channel.metadata.clone())).collect()
}

/// The layout that is attached.
fn layout(bytes: &[u8]) -> serde_json::Value {
    let summary = summary(bytes);
    let index = summary.attachment_indexes.iter().find(|index| index.name == "layout.json");
    let layout = mcap::read::attachment(bytes, index.expect("a layout")).expect("an attachment").data;
    serde_json::from_slice(&layout).expect("JSON")
}

/// Messages of a topic, decoded.
fn messages<M: Message + Default>(bytes: &[u8], topic: &str) -> Vec<(u64, M)> {
    let stream =
        MessageStream::new(bytes).expect("a sound file").map(|message| message.expect("a sound message"));
    let wanted = stream.filter(|message| message.channel.topic == topic);
    wanted.map(|m| (m.log_time, M::decode(m.data.as_ref()).expect("a message of its type"))).collect()
}

#[test]
fn narrower_fields_are_columns_of_whole_ones() {
    let folder = folder();
    let settings = ["mesh.cells=20", "record.frames=5", "record.field_every=2"];
    for name in ["fig5", "elastic-fig5"] {
        let recorded = ["inf", "1.6"].map(|r_max| {
            let case = case(name, &[&settings[..], &[&format!("record.r_max={r_max}")]].concat());
            record(&case, &folder.path().join(format!("{name}-{r_max}.mcap")))
        });
        let [whole, narrow] =
            recorded.each_ref().map(|bytes| messages::<message::FieldSlice>(bytes, "/field/stress"));
        assert_eq!((whole.len(), narrow.len()), (5, 5));
        for ((_, whole), (_, narrow)) in whole.iter().zip(&narrow) {
            assert_eq!(
                (whole.step, whole.r0, whole.dr, whole.nz),
                (narrow.step, narrow.r0, narrow.dr, narrow.nz)
            );
            let (nr, last) = (narrow.nr as usize, narrow.r0 + f64::from(narrow.nr - 1) * narrow.dr);
            assert!(nr < whole.nr as usize && (last - 1.6).abs() < 1.5 * narrow.dr, "{last}");
            let rows = whole.values.chunks_exact(whole.nr as usize).zip(narrow.values.chunks_exact(nr));
            assert!(
                rows.clone().count() == narrow.nz as usize
                    && rows.into_iter().all(|(whole, narrow)| whole[..nr] == *narrow)
            );
        }
        assert!(whole[4].1.values.iter().any(|value| *value != 0.0));
        // the pictures end there too
        let widths = recorded.each_ref().map(|bytes| {
            let (_, grid) = &messages::<foxglove::Grid>(bytes, "/view/field")[0];
            f64::from(grid.column_count) * grid.cell_size.expect("a size").x
        });
        assert!(widths[0] > 1.5 * widths[1] && (widths[1] / 3.2 - 1.0).abs() < 0.05, "{widths:?}");
        // and nothing else changes
        for topic in ["/drag", "/velocity", "/energy", "/interface/stress"] {
            let payloads = recorded.each_ref().map(|bytes| payloads(bytes, topic));
            assert!(!payloads[0].is_empty() && payloads[0] == payloads[1], "{name} {topic}");
        }
    }
}

/// Messages of a topic as they are.
fn payloads(bytes: &[u8], topic: &str) -> Vec<Vec<u8>> {
    let stream =
        MessageStream::new(bytes).expect("a sound file").map(|message| message.expect("a sound message"));
    stream.filter(|message| message.channel.topic == topic).map(|message| message.data.to_vec()).collect()
}

#[test]
fn downsampled_fields_are_nodes_of_whole_ones() {
    let folder = folder();
    let topics = ["/field/displacement", "/field/velocity", "/field/stress"];
    let settings =
        ["mesh.cells=20", "record.frames=5", "record.fields=[\"displacement\", \"velocity\", \"stress\"]"];
    let whole = record(&case("fig8-m5", &settings), &folder.path().join("whole.mcap"));
    let downsampled = [&settings[..], &["record.field_every=3"]].concat();
    let downsampled = record(&case("fig8-m5", &downsampled), &folder.path().join("downsampled.mcap"));
    for topic in topics {
        let whole: Vec<(u64, message::FieldSlice)> = messages(&whole, topic);
        let downsampled: Vec<(u64, message::FieldSlice)> = messages(&downsampled, topic);
        assert_eq!(whole.len(), downsampled.len());
        for ((_, whole), (_, downsampled)) in whole.iter().zip(&downsampled) {
            assert_eq!((whole.step, whole.r0, whole.z0), (downsampled.step, downsampled.r0, downsampled.z0));
            assert_eq!((3.0 * whole.dr, 3.0 * whole.dz), (downsampled.dr, downsampled.dz));
            let (nr, nz) = (downsampled.nr as usize, downsampled.nz as usize);
            assert_eq!((nr, nz), (whole.nr.div_ceil(3) as usize, whole.nz.div_ceil(3) as usize));
            assert_eq!(downsampled.values.len(), nr * nz);
            for (m, value) in downsampled.values.iter().enumerate() {
                assert_eq!(*value, whole.values[3 * (m / nr) * whole.nr as usize + 3 * (m % nr)]);
            }
        }
    }
    let forces = |bytes: &[u8]| -> Vec<(u64, message::Drag)> { messages(bytes, "/drag") };
    assert_eq!(forces(&whole), forces(&downsampled));
}

/// Value of a field at a place: linear along z, along r too, and inside the first node an even parabola.
fn between(field: &message::FieldSlice, r: f64, z: f64) -> f64 {
    let value = |j: usize, i: usize| f64::from(field.values[j * field.nr as usize + i]);
    let (x, y) = ((r - field.r0) / field.dr, z / field.dz);
    let (i, j) = (x.max(0.0) as usize, (y as usize).min(field.nz as usize - 2));
    let share = if x < 0.0 { (r * r / (field.r0 * field.r0) - 1.0) / 8.0 } else { x - i as f64 };
    let row = |j: usize| value(j, i) + share * (value(j, i + 1) - value(j, i));
    row(j) + (y - j as f64) * (row(j + 1) - row(j))
}

#[test]
fn points_and_lines_are_those_of_the_fields() {
    let folder = folder();
    let points = [[0.0, 0.0], [0.0, 0.5], [0.37, 0.21], [1.234, 0.77], [0.02, 1.0], [500.0, 0.5]];
    for model in ["rakhmatulin", "elastic"] {
        let case = case(
            "fig5",
            &[
                &format!("model={model}"),
                "mesh.cells=20",
                "indenter.mass=2.0",
                "run.end_time=3.0",
                "record.frames=12",
                // as wide as the line along r
                "record.r_max=inf",
                "record.interface_every=3",
                "record.fields=[\"displacement\", \"velocity\", \"stress\"]",
                &format!("record.points={points:?}"),
                "record.lines=[{ r = 0.37 }, { z = 0.21 }]",
            ],
        );
        let bytes = record(&case, &folder.path().join(format!("{model}.mcap")));
        let seen: Vec<(u64, message::Points)> = messages(&bytes, "/points");
        assert_eq!(seen.len() as u64, case.sizes.steps + 1);
        assert!(seen.iter().enumerate().all(|(k, (_, points))| points.step == k as u64));
        let lines = ["/line/0", "/line/1"].map(|topic| messages::<message::LineSlice>(&bytes, topic));
        assert!(lines.iter().all(|line| line.len() as u64 == case.sizes.steps.div_ceil(3) + 1));
        let mut compared = 0;
        for name in ["displacement", "velocity", "stress"] {
            let fields: Vec<(u64, message::FieldSlice)> = messages(&bytes, &format!("/field/{name}"));
            let largest =
                fields.iter().flat_map(|(_, field)| &field.values).fold(0.0f32, |a, b| a.max(b.abs()));
            let tolerance = 1e-6 * f64::from(largest);
            for (log_time, field) in &fields {
                let (time, state) = &seen[field.step as usize];
                assert_eq!((log_time, state.time), (time, field.time));
                let values = match name {
                    "displacement" => &state.displacement,
                    "velocity" => &state.velocity,
                    _ => &state.stress,
                };
                assert_eq!(values.len(), points.len());
                assert_eq!(values[5], 0.0, "beyond the mesh");
                for (value, [r, z]) in values.iter().zip(&points[..5]) {
                    let expected = between(field, *r, *z);
                    assert!((value - expected).abs() < tolerance, "{name} at ({r}, {z}): {value} {expected}");
                }
                if name != "stress" || !field.step.is_multiple_of(3) {
                    continue;
                }
                for ((_, line), is_along_z) in
                    lines.iter().map(|line| &line[field.step as usize / 3]).zip([true, false])
                {
                    let nodes = if is_along_z { field.nz } else { field.nr };
                    assert!(line.step == field.step && line.stress.len() == nodes as usize);
                    for n in 0..nodes as usize {
                        let s = line.s0 + n as f64 * line.ds;
                        let (r, z) = if is_along_z { (0.37, s) } else { (s, 0.21) };
                        if !is_along_z && n + 1 == nodes as usize {
                            continue;
                        }
                        let value = line.stress[n];
                        assert!((value - between(field, r, z)).abs() < tolerance, "line at ({r}, {z})");
                        compared += 1;
                    }
                }
            }
        }
        assert!(compared > 100, "frames among the steps of lines");
        let channels = channels(&bytes);
        assert_eq!(channels["/points"]["r"], "0,0,0.37,1.234,0.02,500");
        assert_eq!(channels["/points"]["z"], "0,0.5,0.21,0.77,1,0.5");
        assert!(!channels["/points"].contains_key("axis.stress"), "radii do not tell these points apart");
        assert_eq!(["/line/0", "/line/1"].map(|topic| &channels[topic]["line"]), ["r = 0.37", "z = 0.21"]);
        assert_eq!(channels["/line/0"]["axis.stress"], "s0,ds,s");
    }
}

#[test]
fn points_at_one_depth_have_an_axis() {
    let folder = folder();
    let case =
        case("fig8-m5", &["mesh.cells=20", "record.frames=0", "record.points=[[0.0, 0.5], [0.4, 0.5]]"]);
    let bytes = record(&case, &folder.path().join("a.mcap"));
    let channels = channels(&bytes);
    assert_eq!(channels["/points"]["axis.stress"], "0,0.4");
    assert!(!channels.keys().any(|topic| topic.starts_with("/line")));
    let seen: Vec<(u64, message::Points)> = messages(&bytes, "/points");
    assert!(seen.iter().any(|(_, points)| points.stress[1] > 0.1));
}

#[test]
fn sensors_show_what_points_of_a_free_face_do() {
    let folder = folder();
    let sensors = "record.sensor=[{ r = 0.5 }, { r = 0.5, face = \"back\", quantity = \"velocity\" }, \
                   { r = 0, aperture = 0.4, band = [0.2, 3] }]";
    let settings =
        ["mesh.cells=20", "record.frames=0", "target.back=free", "record.points=[[0.5, 0], [0.5, 1]]"];
    let case = case("fig5", &[&settings[..], &[sensors]].concat());
    let bytes = record(&case, &folder.path().join("a.mcap"));
    let points: Vec<(u64, message::Points)> = messages(&bytes, "/points");
    let [front, back, band] =
        [0, 1, 2].map(|number| messages::<message::Sensor>(&bytes, &format!("/sensor/{number}")));
    for (k, (log_time, points)) in points.iter().enumerate() {
        assert_eq!((points.displacement.len(), points.step), (2, k as u64));
        let expected = message::Sensor {
            step: points.step,
            time: points.time,
            value: points.displacement[0],
            filtered: None,
        };
        assert_eq!(front[k], (*log_time, expected));
        assert_eq!(back[k].1.value, points.velocity[1]);
        assert_eq!((band[k].0, band[k].1.step, band[k].1.time), (*log_time, points.step, points.time));
    }
    assert_eq!([&front, &back, &band].map(Vec::len), [points.len(); 3]);
    // a flat face is in contact all over the aperture
    assert!((band[20].1.value - points[20].1.displacement[0]).abs() < 1e-12 && band[20].1.filtered.is_some());
    let channels = channels(&bytes);
    let of = |number: usize, key: &str| {
        channels[&format!("/sensor/{number}")].get(key).cloned().unwrap_or_default()
    };
    assert_eq!(of(1, "face") + &of(1, "quantity") + &of(1, "unit.value"), "backvelocityc_p");
    assert!(of(2, "band") == "0.2 c_p/R, 3 c_p/R" && of(2, "filter").contains("zero phase"), "{channels:?}");
}

#[test]
fn everything_the_contract_promises_is_there() {
    let folder = folder();
    let case =
        case("fig5", &["mesh.cells=20", "record.frames=7", "record.interface_every=3", "record.fields=[]"]);
    let bytes = record(&case, &folder.path().join("a.mcap"));
    let steps = case.sizes.steps;

    let drag: Vec<(u64, message::Drag)> = messages(&bytes, "/drag");
    assert_eq!(drag.len() as u64, steps + 1);
    for (k, (log_time, drag)) in drag.iter().enumerate() {
        assert_eq!((drag.step, drag.time), (k as u64, k as f64 * case.sizes.dt));
        assert_eq!(*log_time, (1e9 * drag.time).round() as u64);
        assert_eq!(drag.contact_radius, 1.0);
    }
    assert_eq!(messages::<message::Velocity>(&bytes, "/velocity").len() as u64, steps + 1);
    assert_eq!(messages::<message::Energy>(&bytes, "/energy").len(), 7);
    assert_eq!(messages::<message::FieldSlice>(&bytes, "/field/stress").len(), 0);
    let stress: Vec<(u64, message::InterfaceStress)> = messages(&bytes, "/interface/stress");
    assert_eq!(stress.len() as u64, steps.div_ceil(3) + 1);
    assert!(stress.iter().all(|(_, stress)| stress.stress.len() == 20));
    assert!(stress.iter().all(|(_, stress)| stress.step % 3 == 0 || stress.step == steps));
    let probes: Vec<(u64, message::Probes)> = messages(&bytes, "/probes");
    assert_eq!(probes.len() as u64, steps + 1);
    let (_, interface) = &stress[2];
    let (_, probe) = &probes[6];
    // r = 0: the even parabola; the drag is the sum of pressures over full cell areas
    assert_eq!(probe.stress.len(), 6);
    assert!((probe.stress[0] - (9.0 * interface.stress[0] - interface.stress[1]) / 8.0).abs() < 1e-15);
    let r = |i: usize| interface.r0 + i as f64 * interface.dr;
    let sum: f64 = interface.stress.iter().enumerate().map(|(i, p)| 2.0 * r(i) * interface.dr * p).sum();
    assert!((sum - drag[6].1.force).abs() < 1e-13);

    let metadata = metadata(&bytes);
    assert_eq!(metadata["percuss.run"]["format_version"], FORMAT_VERSION);
    assert_eq!(metadata["percuss.run"]["title"], case.title);
    assert_eq!(metadata["percuss.run"]["steps"], steps.to_string());
    assert_eq!(metadata["percuss.status"]["status"], "completed");
    assert_eq!(metadata["percuss.status"]["last_step"], steps.to_string());
    let peak: f64 = metadata["percuss.validity"]["largest_strain"].parse().expect("a number");
    let allowed: f64 = metadata["percuss.validity"]["admissible_velocity"].parse().expect("a number");
    assert!((allowed * peak - 0.005).abs() < 1e-15);

    let summary = summary(&bytes);
    let last = summary.metadata_indexes.iter().max_by_key(|index| index.offset).expect("records");
    assert_eq!(last.name, "percuss.status", "the status is written last");
    assert!(summary.attachment_indexes.iter().all(|index| index.log_time == 0 && index.create_time == 0));
    for channel in summary.channels.values() {
        assert_eq!(channel.message_encoding, "protobuf");
        if channel.schema.as_ref().is_some_and(|schema| schema.name.starts_with("percuss.")) {
            assert!(channel.metadata.contains_key("unit.time"), "{}", channel.topic);
        }
    }
    let metadata = &channels(&bytes)["/interface/stress"];
    assert_eq!((metadata["unit.stress"].as_str(), metadata["axis.stress"].as_str()), ("γc_p²", "r0,dr,r"));
}

#[test]
fn si_scales_are_recorded_where_they_are_known() {
    let folder = folder();
    let text = "[target]\nthickness = \"5 mm\"\n\
                material = { youngs_modulus = \"210 GPa\", poisson_ratio = 0.3, density = \"7.85 g/cm3\" }\n\
                [indenter]\nshape = \"flat\"\nradius = \"10 mm\"\nmass = \"50 g\"\n\
                [impact]\nvelocity = \"5 m/s\"\n[mesh]\ncells = 10\n[run]\nend_time = \"3.3 us\"\n";
    let case = Case::parse("steel", text, &[], "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let metadata = metadata(&record(&case, &folder.path().join("a.mcap")));
    let number = |record: &str, key: &str| metadata[record][key].parse::<f64>().expect("a number");
    // c_p² = E(1−ν)/(ρ(1+ν)(1−2ν)), c_s/c_p = √((1−2ν)/(2(1−ν)))
    let c_p = (210e9f64 * 0.7 / (7850.0 * 1.3 * 0.4)).sqrt();
    assert!((number("percuss.run", "scale.speed_m_per_s") / c_p - 1.0).abs() < 1e-14);
    assert!((number("percuss.run", "scale.time_s") / (0.01 / c_p) - 1.0).abs() < 1e-14);
    assert!((number("percuss.run", "scale.stress_pa") / (7850.0 * c_p * c_p) - 1.0).abs() < 1e-14);
    assert!((case.target.material.shear_wave_speed - (0.4f64 / 1.4).sqrt()).abs() < 1e-15);
    let allowed = number("percuss.validity", "admissible_velocity_m_per_s");
    assert!((allowed / (c_p * number("percuss.validity", "admissible_velocity")) - 1.0).abs() < 1e-14);
}

/// Checks that every level of a field in a grid is the value at the nearest node; how many are not zero.
///
/// * `number`: of the field in the grid
fn check_levels(
    channels: &BTreeMap<String, BTreeMap<String, String>>,
    grid: &foxglove::Grid,
    number: usize,
    name: &str,
    field: &message::FieldSlice,
) -> usize {
    let metadata = |key: &str| channels["/view/field"][key].parse::<f64>().expect("a number");
    let corner = grid.pose.as_ref().and_then(|pose| pose.position).expect("a corner");
    let size = grid.cell_size.expect("a size");
    let step = metadata(&format!("level.step.{name}"));
    let range = 126.0 * step;
    let mut seen = 0;
    for (row, cells) in grid.data.chunks_exact(grid.row_stride as usize).enumerate() {
        for (column, cell) in cells.chunks_exact(grid.cell_stride as usize).enumerate() {
            let x = corner.x + (column as f64 + 0.5) * size.x;
            let z = -(corner.y + (row as f64 + 0.5) * size.y);
            let places = [(x.abs() - field.r0) / field.dr, z / field.dz];
            // halfway between nodes, rounding in metres and in R may differ
            if places.iter().any(|place| (place.fract().abs() - 0.5).abs() < 1e-6) {
                continue;
            }
            let [i, j] = places.map(|place| place.round().max(0.0) as usize);
            let inside = i < field.nr as usize && j < field.nz as usize;
            let value = if inside { f64::from(field.values[j * field.nr as usize + i]) } else { 0.0 };
            let shown = (f64::from(cell[number]) - metadata("level.zero")) * step;
            let error = (shown - value.clamp(-range, range)).abs();
            assert!(error <= 0.51 * step, "{name} at {x}, {z}: {shown}, {value}");
            seen += usize::from(value.abs() > step);
        }
    }
    seen
}

/// Checks that the stress of a profile is that of the interface at the nearest nodes; the elements under pressure.
fn pressed(profile: &message::SurfaceProfile, interface: &message::InterfaceStress) -> Vec<usize> {
    for (r, p) in profile.r.iter().zip(&profile.stress) {
        let place = ((f64::from(*r) - interface.r0) / interface.dr).round() as usize;
        assert_eq!(*p, interface.stress.get(place).copied().unwrap_or(0.0) as f32);
    }
    (0..profile.r.len()).filter(|i| profile.stress[*i] != 0.0).collect()
}

#[test]
fn views_agree_with_the_other_channels() {
    let folder = folder();
    let case =
        case("fig3", &["mesh.cells=25", "record.frames=9", "record.fields=[\"stress\", \"velocity\"]"]);
    let bytes = record(&case, &folder.path().join("a.mcap"));
    let channels = channels(&bytes);
    let number = |topic: &str, key: &str| channels[topic][key].parse::<f64>().expect("a number");

    assert!(channels["/view/field"].contains_key("derived") && !channels["/drag"].contains_key("derived"));
    // the grid: every level is the value of the field at the nearest node
    let grids: Vec<(u64, foxglove::Grid)> = messages(&bytes, "/view/field");
    let fields: Vec<(u64, message::FieldSlice)> = messages(&bytes, "/field/stress");
    assert_eq!((grids.len(), fields.len()), (9, 9));
    let ((log_time, grid), (_, field)) = (&grids[6], &fields[6]);
    let stamp = grid.timestamp.expect("a time");
    assert_eq!(*log_time, (stamp.seconds * 1_000_000_000 + i64::from(stamp.nanos)) as u64);
    assert_eq!((grid.row_stride, grid.cell_stride), (6 * grid.column_count, 6));
    assert_eq!(grid.data.len() % grid.row_stride as usize, 0);
    let names: Vec<&str> = grid.fields.iter().map(|field| field.name.as_str()).collect();
    assert_eq!(names, ["stress", "velocity", "red", "green", "blue", "alpha"]);
    // the colours are those of the first field, as bright as it is strong
    let green_of = |level: u8| grid.data.chunks_exact(6).find(|cell| cell[0] == level).map(|cell| cell[3]);
    assert!(grid.data.chunks_exact(6).all(|cell| cell[5] == 255));
    assert_eq!(green_of(128), Some(247));
    let green: Vec<u8> = (128..=u8::MAX).filter_map(green_of).collect();
    assert!(green.len() > 20 && green.is_sorted_by(|light, strong| light >= strong), "{green:?}");
    let corner = grid.pose.as_ref().and_then(|pose| pose.position).expect("a corner");
    assert!(check_levels(&channels, grid, 0, "stress", field) > 1000, "there is something to see");

    // the picture: a PNG for a talk, with the indenter
    let images: Vec<(u64, foxglove::CompressedImage)> = messages(&bytes, "/view/image");
    let mut image = png::Decoder::new(std::io::Cursor::new(&images[6].1.data)).read_info().expect("a PNG");
    assert!(image.info().width >= 1200 && image.info().width / grid.column_count > 1);
    let palette = image.info().palette.clone().expect("colours").into_owned();
    let mut pixels = vec![0; image.output_buffer_size().expect("a size")];
    image.next_frame(&mut pixels).expect("pixels");
    let count =
        |rgb: [u8; 3]| pixels.iter().filter(|&&pixel| palette[3 * usize::from(pixel)..][..3] == rgb).count();
    assert!(count([200, 200, 204]) > 5000, "the indenter");
    assert!(count([247; 3]) > 5000, "where nothing has moved");

    // indenter and lines lie above the plane of the field, one above the other
    let (_, scene) = &messages::<foxglove::SceneUpdate>(&bytes, "/view/scene")[6];
    let (_, fronts) = &messages::<foxglove::SceneUpdate>(&bytes, "/view/fronts")[4];
    let height =
        |pose: &Option<foxglove::Pose>| pose.as_ref().and_then(|pose| pose.position).expect("a place").z;
    let entities = scene.entities.iter().chain(&fronts.entities);
    let heights: BTreeMap<&str, Vec<f64>> = entities
        .map(|entity| {
            let triangles = entity.triangles.iter().map(|part| height(&part.pose));
            let lines = entity.lines.iter().map(|part| height(&part.pose));
            let arrows = entity.arrows.iter().map(|part| height(&part.pose));
            let texts = entity.texts.iter().map(|part| height(&part.pose));
            (entity.id.as_str(), triangles.chain(lines).chain(arrows).chain(texts).collect())
        })
        .collect();
    assert_eq!(corner.z, 0.0, "the field");
    let order =
        [&heights["fronts"][..1], &heights["backing"], &heights["indenter"], &heights["surface"]].concat();
    assert!(order[0] > 0.0 && order.windows(2).all(|pair| pair[0] < pair[1]), "{heights:?}");
    assert!(heights["contact"].iter().chain(&heights["drag"]).all(|z| z > order.last().expect("a height")));

    // the indenter is where the exaggerated displacement puts it
    let transforms: Vec<(u64, foxglove::FrameTransforms)> = messages(&bytes, "/view/tf");
    let motion: Vec<(u64, message::Velocity)> = messages(&bytes, "/velocity");
    let scale = number("/view/tf", "exaggeration");
    assert_eq!(channels["/view/scene"]["exaggeration"], channels["/view/tf"]["exaggeration"]);
    for (log_time, transform) in &transforms {
        let (_, at) = motion.iter().find(|(time, _)| time == log_time).expect("the same step");
        let translation = transform.transforms[0].translation.expect("always set");
        assert_eq!(translation.y, -scale * at.displacement);
        assert!(transform.transforms[0].rotation.is_some());
    }

    // the profile: the surface follows the indenter where it is pressed, and is not above it anywhere
    let profiles: Vec<(u64, message::SurfaceProfile)> = messages(&bytes, "/view/profile");
    let (_, profile) = &profiles[6];
    assert!(profile.r.len() <= 500 && profile.r.len() == profile.indenter.len());
    let interface: Vec<(u64, message::InterfaceStress)> = messages(&bytes, "/interface/stress");
    let (_, interface) = &interface[profile.step as usize];
    let pressed = pressed(profile, interface);
    let near_the_axis: Vec<usize> = pressed.into_iter().filter(|i| profile.r[*i] < 0.5).collect();
    assert!(near_the_axis.len() > 5);
    for i in near_the_axis {
        assert!((profile.displacement[i] - profile.indenter[i]).abs() < 1e-3, "r = {}", profile.r[i]);
    }
    assert!(profile.indenter.last().is_some_and(|face| face.is_nan()), "beside the indenter");
}

#[test]
fn colours_saturate_in_a_small_part_of_the_section() {
    let folder = folder();
    for name in ["fig2", "fig4", "fig5", "fig6a", "fig6b", "fig6c", "fig7b", "fig8-m10", "fig9-minf"] {
        let fields = "record.fields=[\"stress\", \"velocity\", \"displacement\"]";
        let case = case(name, &["mesh.cells=20", "record.frames=20", fields]);
        let bytes = record(&case, &folder.path().join(name));
        let metadata = &channels(&bytes)["/view/field"];
        for field in ["stress", "velocity", "displacement"] {
            let (low, high) = metadata[&format!("colour_range.{field}")].split_once(',').expect("two ends");
            let range: f64 = high.parse().expect("a number");
            assert_eq!(low, format!("-{high}"));
            let slices: Vec<(u64, message::FieldSlice)> = messages(&bytes, &format!("/field/{field}"));
            let values =
                slices.iter().flat_map(|(_, slice)| &slice.values).map(|value| f64::from(value.abs()));
            let moved: Vec<f64> = values.filter(|value| *value > 1e-6 * range).collect();
            let beyond = moved.iter().filter(|value| **value > range).count();
            assert!(
                beyond as f64 <= 0.02 * moved.len() as f64,
                "{name}, {field}: {beyond} of {}",
                moved.len()
            );
            // and not because their range is too wide
            let largest = moved.iter().copied().fold(0.0, f64::max);
            assert!(range <= 2.5 * largest, "{name}, {field}: {range}, {largest}");
        }
    }
}

#[test]
fn views_can_be_left_out() {
    let folder = folder();
    let views = |name: &str, overrides: &[&str]| -> Vec<String> {
        let bytes = record(&case("fig5", overrides), &folder.path().join(name));
        channels(&bytes).into_keys().filter(|topic| topic.starts_with("/view")).collect()
    };
    let small = ["mesh.cells=10", "run.end_time=1.0"];
    assert_eq!(views("a", &[&small[..], &["record.views=[]"]].concat()), [""; 0]);
    assert_eq!(views("b", &[&small[..], &["record.views=[\"tf\"]"]].concat()), ["/view/tf"]);
    // pictures of fields need fields
    let all = ["/view/fronts", "/view/profile", "/view/scene", "/view/tf"];
    assert_eq!(views("c", &[&small[..], &["record.fields=[]"]].concat()), all);
}

#[test]
fn layouts_point_at_what_is_recorded() {
    let folder = folder();
    for (name, overrides) in
        [("fig5", &[][..]), ("fig2-prescribed", &["record.fields=[]", "record.views=[]"][..])]
    {
        let case = case(name, &[&["mesh.cells=10", "run.end_time=1.0"], overrides].concat());
        let bytes = record(&case, &folder.path().join(name));
        let (layout, topics) = (layout(&bytes), channels(&bytes));
        let panels = layout["configById"].as_object().expect("panels");
        for (name, panel) in panels {
            assert!(layout["layout"].to_string().contains(name.as_str()), "{name} is shown");
            for path in panel["paths"].as_array().into_iter().flatten() {
                let topic = path["value"].as_str().and_then(|path| path.split('.').next()).expect("a path");
                assert!(topics.contains_key(topic), "{topic}");
            }
            for topic in panel["topics"].as_object().into_iter().flat_map(|topics| topics.keys()) {
                assert!(topics.contains_key(topic), "{topic}");
            }
        }
        assert_eq!(panels.contains_key("3D!section"), overrides.is_empty());
        let probes = panels["Plot!probes"]["paths"].as_array().expect("paths");
        // without the one at the sharp edge of the punch
        let within = case.record.probes.iter().filter(|r| name != "fig5" || **r < 1.0).count();
        assert_eq!((probes.len(), within < case.record.probes.len()), (within, name == "fig5"));
        assert_eq!(probes[1]["label"], format!("r = {}", case.record.probes[1]));
    }
}

#[test]
fn fields_are_recorded_as_slices() {
    let folder = folder();
    let fields = "record.fields=[\"displacement\", \"velocity\", \"stress\"]";
    let case = case("fig5", &["mesh.cells=20", "record.frames=5", fields]);
    let bytes = record(&case, &folder.path().join("a.mcap"));
    let read = |topic| messages::<message::FieldSlice>(&bytes, topic);
    let (u, v, p) = (read("/field/displacement"), read("/field/velocity"), read("/field/stress"));
    assert_eq!((u.len(), v.len(), p.len()), (5, 5, 5));
    let (_, last) = u.last().expect("frames");
    assert_eq!(last.nz as u64, case.sizes.nz as u64 + 1);
    let (nr, time) = (last.nr as usize, last.time);
    assert_eq!(last.values.len(), nr * last.nz as usize);
    // under the punch the surface moves with it: u = V0·t, v = V0; at the backing nothing moves
    let (_, velocity) = v.last().expect("frames");
    for i in 0..20 {
        assert!((f64::from(last.values[i]) - time).abs() < 1e-6 * time);
        assert!((f64::from(velocity.values[i]) - 1.0).abs() < 1e-6);
        assert_eq!(last.values[(last.nz as usize - 1) * nr + i], 0.0);
        assert_eq!(velocity.values[(last.nz as usize - 1) * nr + i], 0.0);
    }
    // stress is minus the slope of the displacement, by central differences
    let (_, stress) = p.last().expect("frames");
    for j in 1..last.nz as usize - 1 {
        let slope = f64::from(last.values[(j + 1) * nr] - last.values[(j - 1) * nr]) / (2.0 * last.dz);
        assert!((f64::from(stress.values[j * nr]) + slope).abs() < 1e-4, "row {j}");
    }
}

#[test]
fn all_slices_of_a_recording_have_one_shape() {
    let folder = folder();
    let fields = "record.fields=[\"displacement\", \"velocity\", \"stress\"]";
    // a half-space, whose active region grows along r and z
    for every in ["record.field_every=1", "record.field_every=3"] {
        let settings = ["mesh.cells=20", "record.frames=6", "run.stop=never", fields, every];
        let case = case("fig8-m5", &settings);
        let bytes = record(
            &case,
            &folder.path().join(format!("{}.mcap", every.len() + every.ends_with('3') as usize)),
        );
        let downsampled = |nodes: usize| nodes.div_ceil(case.record.field_every) as u32;
        let shape = (downsampled(case.sizes.nr), downsampled(case.sizes.nz + 1));
        for topic in ["/field/displacement", "/field/velocity", "/field/stress"] {
            let slices: Vec<(u64, message::FieldSlice)> = messages(&bytes, topic);
            assert_eq!(slices.len(), 6);
            for (_, slice) in &slices {
                assert_eq!((slice.nr, slice.nz), shape, "{topic}, step {}", slice.step);
                assert_eq!(slice.values.len(), (slice.nr * slice.nz) as usize);
                // at most two rows per step in depth, and two columns per step in radius
                let every = case.record.field_every as u64;
                for (m, value) in slice.values.iter().enumerate().filter(|(_, value)| **value != 0.0) {
                    let (j, i) = (m as u64 / u64::from(slice.nr), m as u64 % u64::from(slice.nr));
                    assert!(
                        every * j <= 2 * slice.step && every * i <= 20 + 2 * slice.step,
                        "{j} {i}: {value}"
                    );
                }
            }
        }
        let grids: Vec<(u64, foxglove::Grid)> = messages(&bytes, "/view/field");
        let shape = |grid: &foxglove::Grid| (grid.column_count, grid.row_stride, grid.data.len());
        assert!(grids.len() == 6 && grids.iter().all(|(_, grid)| shape(grid) == shape(&grids[0].1)));
    }
}

#[test]
fn plane_runs_have_units_of_their_own() {
    let folder = folder();
    let text = "geometry = \"plane\"\n[target]\nthickness = \"5 mm\"\n\
                material = { youngs_modulus = \"210 GPa\", poisson_ratio = 0.3, density = \"7850 kg/m3\" }\n\
                [indenter]\nshape = \"flat\"\nradius = \"10 mm\"\nmass = \"1.57 kg/m\"\n\
                [impact]\nvelocity = \"5 m/s\"\n[mesh]\ncells = 10\n[run]\nend_time = \"3.3 us\"\n";
    let case = Case::parse("steel", text, &[], "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
    let bytes = record(&case, &folder.path().join("a.mcap"));
    let run = &metadata(&bytes)["percuss.run"];
    let number = |key: &str| run[key].parse::<f64>().expect("a number");
    assert!((number("scale.force_n_per_m") / (0.02 * number("scale.stress_pa")) - 1.0).abs() < 1e-14);
    assert!((number("scale.mass_kg_per_m") / (0.02 * 0.01 * 7850.0) - 1.0).abs() < 1e-14);
    assert!((number("scale.energy_j_per_m") / (2e-4 * number("scale.stress_pa")) - 1.0).abs() < 1e-14);
    assert!(!run.contains_key("scale.force_n") && !run.contains_key("scale.mass_kg"));
    // the energy of both halves, per length: the loss of ½·M·V0² of the mass is in the target
    let energies: Vec<(u64, message::Energy)> = messages(&bytes, "/energy");
    for (_, energy) in &energies {
        let target = energy.kinetic + energy.strain + energy.damped;
        let sum = target + energy.indenter + energy.dissipated;
        assert!(((sum - energy.work) / (0.5 * 1.57 * 25.0) - 1.0).abs() < 1e-12, "{energy:?}");
    }
    // dimensionless, of a closed form too
    let exact = self::case("fig5-plane", &["mesh.cells=20", "run.end_time=1"]);
    let exact = record_exact(&exact, &folder.path().join("exact.mcap"));
    assert_eq!(channels(&exact)["/drag"]["unit.force"], "Rγc_p²");
}

#[test]
fn only_flat_faces_name_an_admissible_velocity() {
    let folder = folder();
    let shared = ["mesh.cells=20", "run.end_time=1", "record.frames=0", "record.probes=[0.0, 0.5, 0.9]"];
    let validity = |name: &str| {
        let bytes = record(&case(name, &shared), &folder.path().join(format!("{name}.mcap")));
        metadata(&bytes)["percuss.validity"].clone()
    };
    let flat = validity("fig5");
    let number = |key: &str| flat[key].parse::<f64>().expect("a number");
    assert!(
        (number("admissible_velocity_at_probes") * number("largest_strain_at_probes") - 0.005).abs() < 1e-15
    );
    assert!(number("admissible_velocity_at_probes") > number("admissible_velocity"));
    assert!(flat["admissible_velocity.note"].contains("flat face"));
    let shaped = validity("fig3");
    assert!(!shaped.contains_key("admissible_velocity") && shaped.contains_key("largest_strain"));
    assert!(shaped["admissible_velocity.note"].contains("--admissible"));
}

/// Where two recordings of equal length differ, apart from the host record and the checksum over all data.
fn differences(a: &[u8], b: &[u8]) -> Vec<usize> {
    assert_eq!(a.len(), b.len());
    let summary = summary(a);
    let host =
        summary.metadata_indexes.iter().find(|index| index.name == "percuss.host").expect("a host record");
    let host = host.offset as usize..(host.offset + host.length) as usize;
    let footer = mcap::read::footer(a).expect("a footer");
    let data_end = footer.summary_start as usize - 4..footer.summary_start as usize;
    let differs = |&i: &usize| a[i] != b[i] && !host.contains(&i) && !data_end.contains(&i);
    (0..a.len()).filter(differs).collect()
}

#[test]
fn the_same_case_gives_the_same_bytes_on_any_number_of_threads() {
    let folder = folder();
    // large enough that rows are shared out among threads
    let case = case("fig8-m2.5", &["mesh.cells=150", "run.end_time=3", "record.frames=10"]);
    let record_on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| record(&case, &folder.path().join(format!("{threads}.mcap"))))
    };
    let one = record_on(1);
    for threads in [2, 3] {
        assert_eq!(differences(&one, &record_on(threads)), Vec::<usize>::new(), "{threads} threads");
    }
}

#[test]
fn the_resolved_case_repeats_the_run() {
    let folder = folder();
    let cases: [(&str, &[&str]); 6] = [
        ("laminate-armour", &["mesh.cells=11", "record.frames=3"]),
        ("coating-soft", &["mesh.cells=12", "record.frames=3"]),
        ("fig3", &["mesh.cells=30"]),
        ("fig6a", &["mesh.cells=30"]),
        ("fig9-m2.5", &[]),
        ("fig5-plane", &["mesh.cells=25", "indenter.mass=3.5", "record.compression=lz4"]),
    ];
    for (name, overrides) in cases {
        let original = case(name, overrides);
        let toml = original.resolved_toml();
        let again = Case::parse(name, &toml, &[], "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
        assert_eq!(original.sizes, again.sizes, "{name}");
        assert_eq!(toml, again.resolved_toml(), "{name}: resolving is idempotent");
        // with the attachment as the case file, even the bytes repeat
        let path = |part: &str| folder.path().join(format!("{name}-{part}.mcap"));
        let (first, second) = (record(&again, &path("first")), record(&again, &path("second")));
        assert_eq!(differences(&first, &second), Vec::<usize>::new(), "{name}");
        let from_original = record(&original, &path("original"));
        let drag = |bytes: &[u8]| messages::<message::Drag>(bytes, "/drag");
        assert_eq!(drag(&first), drag(&from_original), "{name}");
    }
}

/// Fails at some step.
struct Failing(u64);

impl Observer for Failing {
    fn observe(&mut self, view: &View<'_>) -> Result<Flow, RunError> {
        if view.step == self.0 { Err(RunError::Observer("no more paper".into())) } else { Ok(Flow::Continue) }
    }

    fn end(&mut self, _: &Status, _: &Validity) -> Result<(), RunError> {
        panic!("an observer that has failed is not called again")
    }
}

#[test]
fn a_recording_ends_with_a_status_when_another_observer_fails() {
    let folder = folder();
    let case = case("fig5", &["mesh.cells=20"]);
    // before and after the recording in the order of observers
    for is_first in [true, false] {
        let path = folder.path().join(format!("{is_first}.mcap"));
        let mut recording =
            Recording::create(&Destination::new(&path), &case, Source::Simulation).expect("a new file");
        let mut failing = Failing(7);
        let mut observers: [&mut dyn Observer; 2] = [&mut recording, &mut failing];
        if is_first {
            observers.swap(0, 1);
        }
        let error = session::run(&mut Simulation::new(&case), &mut observers);
        assert!(matches!(error, Err(RunError::Observer(_))), "{error:?}");
        let bytes = fs::read(part_of(&path)).expect("the recording");
        let status = &metadata(&bytes)["percuss.status"];
        assert_eq!((status["status"].as_str(), status["message"].as_str()), ("failed", "no more paper"));
        // what was computed is recorded
        let last_step: u64 = status["last_step"].parse().expect("a number");
        assert!((7..60).contains(&last_step), "{last_step}");
        assert_eq!(messages::<message::Drag>(&bytes, "/drag").len() as u64, last_step + 1);
    }
}

/// Counts messages, and is dropped with the thread that writes.
struct Witness(mpsc::Sender<usize>);

impl Tap for Witness {
    fn message(&mut self, channel: usize, _: u64, _: &[u8]) {
        self.0.send(channel).expect("the test is there");
    }
}

#[test]
fn a_recording_given_up_has_no_end() {
    let folder = folder();
    let path = folder.path().join("a.mcap");
    let case = case("fig5", &["mesh.cells=20"]);
    let mut simulation = Simulation::new(&case);
    let mut recording =
        Recording::create(&Destination::new(&path), &case, Source::Simulation).expect("a new file");
    let (witness, seen) = mpsc::channel();
    recording.tap(Box::new(Witness(witness))).expect("room on the disk");
    for _ in 0..10 {
        let view = simulation.step().expect("finite numbers").expect("a step");
        recording.observe(&view).expect("room on the disk");
    }
    drop(recording);
    // ends with the writer thread: then the file does not change any more
    assert!(seen.iter().count() >= 10 * 4, "stress, drag, velocity and probes of every step were written");
    let bytes = fs::read(part_of(&path)).expect("the recording");
    assert!(bytes.starts_with(mcap::MAGIC) && !bytes.ends_with(mcap::MAGIC), "begun, not ended");
    assert!(Summary::read(&bytes).is_err(), "the file must not look complete");
}

/// Records the closed form of a case and returns the bytes.
fn record_exact(case: &Case, path: &Path) -> Vec<u8> {
    let mut steps = ExactSteps::new(case).expect("a closed form");
    let mut recording = Recording::create(&Destination::new(path), case, steps.source()).expect("a new file");
    session::run(&mut steps, &mut [&mut recording]).expect("room on the disk");
    fs::read(path).expect("the recording")
}

/// Numbers of a stress over steps and nodes, and the value at a place, if there is one.
struct Stresses(Vec<Vec<f64>>);

impl Stresses {
    fn get(&self, step: usize, node: usize) -> Option<f64> {
        self.0.get(step)?.get(node).copied().filter(|value| value.is_finite())
    }

    /// True if no front is near: the value is known, not zero, and changes little some steps and nodes to either side.
    fn is_smooth(&self, step: usize, node: usize, change: f64) -> bool {
        /// Steps, and nodes, over which the mesh spreads a front, and one more.
        const NEAR: usize = 3;
        let known = |step, node| self.get(step, node).filter(|value| *value != 0.0);
        let span = |a: Option<f64>, b: Option<f64>| Some((a? - b?).abs() < change);
        let in_time = step.checked_sub(NEAR).and_then(|k| span(known(k, node), known(step + NEAR, node)));
        // at the axis the stress is even
        let in_space = span(known(step, node.saturating_sub(NEAR)), known(step, node + NEAR));
        in_time == Some(true) && in_space == Some(true)
    }
}

#[test]
fn a_closed_form_is_on_the_channels_of_the_run() {
    // Largest error relative to the peak away from fronts, and the largest share of values that are near one. Measured at
    // 100 cells 3.9e-4, 4.1e-4, 4.1e-4, 1.5e-3, 8.1e-5.
    const CHANGE: f64 = 0.05;
    let folder = folder();
    for (name, bound, near) in [
        ("fig2-prescribed", 6e-4, 0.7),
        ("fig6a", 6e-4, 0.3),
        ("fig7a", 6e-4, 0.3),
        ("fig3", 2.2e-3, 0.2),
        ("fig5-plane", 2e-4, 0.2),
    ] {
        let case = case(name, &["mesh.cells=100", "record.fields=[]", "run.end_time=1.5", "record.frames=0"]);
        let run = record(&case, &folder.path().join(format!("{name}.mcap")));
        let exact = record_exact(&case, &folder.path().join(format!("{name}-exact.mcap")));
        let run_record = &metadata(&exact)["percuss.run"];
        let names_form = run_record.contains_key("closed_form");
        assert_eq!((run_record["source"].as_str(), names_form), ("exact", true));
        // the same steps, the same arrays, the same numbers away from fronts wherever the form has one
        let topic = "/interface/stress";
        let (run, exact) = (
            messages::<message::InterfaceStress>(&run, topic),
            messages::<message::InterfaceStress>(&exact, topic),
        );
        assert_eq!(run.len(), exact.len(), "{name}");
        for ((time_a, a), (time_b, b)) in run.iter().zip(&exact) {
            assert_eq!((time_a, a.step, a.r0, a.dr), (time_b, b.step, b.r0, b.dr), "{name}");
            assert_eq!(a.stress.len(), b.stress.len(), "{name} step {}", a.step);
        }
        let exact = Stresses(exact.into_iter().map(|(_, message)| message.stress).collect());
        let known = exact.0.iter().flatten().filter(|value| value.is_finite());
        let peak = known.clone().fold(0.0, |peak, value| f64::max(peak, value.abs()));
        let (mut compared, mut worst) = (0, 0.0);
        for (step, (_, message)) in run.iter().enumerate() {
            for (node, p) in message.stress.iter().enumerate() {
                if let Some(e) = exact.get(step, node)
                    && exact.is_smooth(step, node, CHANGE * peak)
                {
                    worst = f64::max(worst, (p - e).abs() / peak);
                    compared += 1;
                }
            }
        }
        assert!(worst <= bound, "{name}: {worst:e} of the peak");
        let near_fronts = 1.0 - f64::from(compared) / known.count() as f64;
        assert!(near_fronts <= near, "{name}: {near_fronts} of all values are near fronts");
    }
}

#[test]
fn frames_are_at_the_given_times() {
    let folder = folder();
    let case = case("fig4", &["mesh.cells=50", "record.frame_times=[1.0, 0.05, 2.0]"]);
    let bytes = record(&case, &folder.path().join("a.mcap"));
    let frames = messages::<message::FieldSlice>(&bytes, "/field/stress");
    let dt = case.sizes.dt;
    let expected: Vec<u64> = [0.05, 1.0, 2.0].iter().map(|time| (time / dt).round() as u64).collect();
    assert_eq!(frames.iter().map(|(_, frame)| frame.step).collect::<Vec<_>>(), expected);
    for (_, frame) in &frames {
        // every message has its own time
        assert_eq!(frame.time, frame.step as f64 * dt);
    }
}

#[test]
fn every_channel_of_steps_has_the_last_step() {
    let folder = folder();
    // to the end, and stopped between two frames
    for (name, frames, status) in [
        ("fig5", "record.frame_times=[0.4]", "completed"),
        ("fig5", "record.frames=3", "completed"),
        ("fig8-m5", "record.frame_times=[0.4]", "stopped"),
        ("fig8-m5", "record.frames=3", "stopped"),
    ] {
        let gauges = ["record.points=[[0.0, 0.5]]", "record.lines=[{ r = 0 }, { z = 0.5 }]"];
        let settings = [&gauges[..], &["mesh.cells=20", "record.interface_every=1000", frames]].concat();
        let case = case(name, &settings);
        let what = format!("{name}, {frames}");
        let path = folder.path().join(format!("{name}-{}.mcap", frames.len()));
        let bytes = record(&case, &path);
        let ending = &metadata(&bytes)["percuss.status"];
        assert_eq!(ending["status"], status, "{what}");
        let mut ends: BTreeMap<String, (u64, usize)> = BTreeMap::new();
        for message in MessageStream::new(&bytes).expect("a sound file") {
            let message = message.expect("a sound message");
            let (last, count) = ends.entry(message.channel.topic.clone()).or_default();
            (*last, *count) = (message.log_time, *count + 1);
        }
        let last_step: u64 = ending["last_step"].parse().expect("a number");
        let time = (1e9 * last_step as f64 * case.sizes.dt).round() as u64;
        ends.retain(|topic, _| !["/event", "/log"].contains(&topic.as_str()));
        assert!(ends.len() >= 14 && ends.values().all(|(last, _)| *last == time), "{what}: {time}, {ends:?}");
        for topic in ["/interface/stress", "/line/0", "/line/1"] {
            assert_eq!(ends[topic].1, 2, "{what}, {topic}");
        }
        let before = (0..last_step).filter(|&step| case.frames().contain(step)).count();
        assert_eq!(ends["/energy"].1, before + 1, "{what}");
        // both engines, and after a pause
        let shown = |simulation: &mut Simulation, pause: u64| {
            let mut seen = Vec::new();
            let mut look = |view: &View<'_>| {
                let lines = view.gauges.as_ref().map_or(0, |gauges| gauges.lines.len());
                seen.push((view.step, view.frame.is_some(), lines, view.is_last));
                if view.step == pause { Flow::Checkpoint } else { Flow::Continue }
            };
            session::run(simulation, &mut [&mut look]).expect("a sound run");
            seen
        };
        let expected = shown(&mut Simulation::reference(&case), u64::MAX);
        assert_eq!(expected.last(), Some(&(last_step, true, 2, true)), "{what}");
        assert_eq!(expected.iter().filter(|(.., is_last)| *is_last).count(), 1, "{what}");
        assert!(shown(&mut Simulation::new(&case), last_step - 1) == expected, "{what}");
    }
}

#[test]
fn steps_are_shown_in_order_with_their_frames_and_to_the_last_one_computed() {
    // a frame at every step, and few; fields that fill the memory for frames, and none
    for (frames, fields) in
        [("24", "[]"), ("25", "[\"stress\", \"velocity\"]"), ("400", "[\"displacement\"]")]
    {
        let case = case(
            "fig5",
            &["mesh.cells=66", &format!("record.frames={frames}"), &format!("record.fields={fields}")],
        );
        let at_frames = case.frames();
        let mut steps = Vec::new();
        let mut look = |view: &View<'_>| {
            assert_eq!(view.frame.is_some(), at_frames.contain(view.step), "step {}", view.step);
            assert!(
                view.frame
                    .as_ref()
                    .is_none_or(|frame| frame.energy.residual.is_none_or(|residual| residual.abs() < 1e-12))
            );
            steps.push(view.step);
            if view.step == 150 { Flow::Interrupt("enough".into()) } else { Flow::Continue }
        };
        let mut simulation = Simulation::new(&case);
        let outcome = session::run(&mut simulation, &mut [&mut look]).expect("finite numbers");
        assert!(steps.len() > 150 && steps.len() < 300, "{} steps", steps.len());
        assert!((0..).zip(&steps).all(|(expected, step)| expected == *step));
        assert_eq!(outcome.status, Status::Interrupted("enough".into()));
        assert_eq!(steps.last(), Some(&outcome.last_step));
        assert!(outcome.validity.strain.step <= outcome.last_step);
    }
}
