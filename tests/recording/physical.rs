//! Recordings of physical cases: everything in SI, pictures and layout included.

use std::{collections::BTreeMap, path::Path};

use percuss::{
    case::Case,
    message::{foxglove, percuss as message},
};

use super::{channels, check_levels, folder, layout, messages, metadata, pressed, record};

/// A steel ball that strikes a layer.
const BALL: &str = "model = \"elastic\"\n\
    [target]\nthickness = \"8 mm\"\nmaterial = \"pmma\"\n\
    [indenter]\nshape = \"sphere\"\nnose_radius = \"10 mm\"\nmaterial = \"steel\"\n\
    [impact]\nvelocity = \"5 m/s\"\n[mesh]\ncells = 40\n[run]\nend_time = \"12 us\"\n\
    [record]\nframes = 5\nfields = [\"stress\", \"velocity\", \"displacement\"]\n";

/// The recording of a case.
struct Recorded {
    bytes: Vec<u8>,
    /// Metadata of the channels by topic.
    channels: BTreeMap<String, BTreeMap<String, String>>,
    layout: serde_json::Value,
}

impl Recorded {
    fn new(text: &str, overrides: &[&str], path: &Path) -> Self {
        let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
        let case =
            Case::parse("ball", text, &overrides, "".as_ref()).unwrap_or_else(|errors| panic!("{errors:?}"));
        let bytes = record(&case, path);
        let (channels, layout) = (channels(&bytes), layout(&bytes));
        Self { bytes, channels, layout }
    }

    fn number(&self, topic: &str, key: &str) -> f64 {
        self.channels[topic][key].parse().expect("a number")
    }

    /// All messages of a topic.
    fn all<M: prost::Message + Default>(&self, topic: &str) -> Vec<M> {
        messages(&self.bytes, topic).into_iter().map(|(_, message)| message).collect()
    }

    /// The last message of a topic.
    fn last<M: prost::Message + Default>(&self, topic: &str) -> M {
        self.all(topic).pop().expect("a message")
    }

    /// Asserts that the numbers of a topic are those of a dimensionless recording times their scales, the last scale for the rest.
    fn is_twin<M: prost::Message + Default>(
        &self,
        twin: &Self,
        topic: &str,
        scales: &[f64],
        numbers: impl Fn(M) -> Vec<f64>,
    ) {
        let [own, others] = [self, twin].map(|recorded| recorded.all(topic).into_iter().map(&numbers));
        assert_eq!(own.len(), others.len(), "{topic}");
        let scale = |place: usize| *scales.get(place).unwrap_or(&scales[scales.len() - 1]);
        let mut largest = BTreeMap::new();
        let mut errors = BTreeMap::new();
        for (own, other) in own.zip(others) {
            assert_eq!(own.len(), other.len(), "{topic}");
            for (place, (x, y)) in own.iter().zip(&other).enumerate() {
                let keep = |map: &mut BTreeMap<usize, f64>, x: f64| {
                    let most = map.entry(place.min(scales.len() - 1)).or_default();
                    *most = most.max(x.abs());
                };
                keep(&mut largest, *x);
                keep(&mut errors, x - scale(place) * y);
            }
        }
        for (place, error) in errors {
            assert!(error < 1e-13 * largest[&place], "{topic} {place}: {error:e} of {:e}", largest[&place]);
        }
    }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-14 * b.abs()
}

#[test]
fn no_channel_has_a_dimensionless_unit() {
    let folder = folder();
    let units = |text: &str, overrides: &[&str], name: &str| {
        let recorded = Recorded::new(text, overrides, &folder.path().join(name));
        let mut units = BTreeMap::new();
        for (topic, metadata) in recorded.channels {
            let found = metadata.into_iter().filter(|(key, _)| key.starts_with("unit."));
            units.extend(found.map(|(key, unit)| ((topic.clone(), key), unit)));
        }
        (units, recorded.layout.to_string())
    };
    for (geometry, force, energy) in [("axisymmetric", "N", "J"), ("plane", "N/m", "J/m")] {
        let mass = if geometry == "plane" { "indenter.mass=\"2 kg/m\"" } else { "indenter.mass=\"30 g\"" };
        let overrides = [&format!("geometry={geometry}")[..], mass, "mesh.cells=10"];
        let text = BALL.replace("material = \"steel\"\n", "");
        let (units, layout) = units(&text, &overrides, geometry);
        let si = ["1", "bytes", "s", "m", "m/s", "Pa", force, energy];
        for ((topic, key), unit) in &units {
            assert!(si.contains(&unit.as_str()), "{topic}: {key} is {unit}");
        }
        for unit in &si[1..] {
            assert!(units.values().any(|known| known == unit), "nothing has the unit {unit}");
        }
        for (topic, field, unit) in [
            ("/view/field", "cell_size", "m"),
            ("/view/scene", "entities", "m"),
            ("/view/fronts", "entities", "m"),
            ("/view/tf", "transforms", "m"),
            ("/view/profile", "r", "m"),
            ("/view/profile", "stress", "Pa"),
            ("/view/profile", "time", "s"),
        ] {
            assert_eq!(units[&(topic.to_owned(), format!("unit.{field}"))], unit, "{topic}");
        }
        assert!(!["[R]", "R/c_p", "[c_p]", "γ"].iter().any(|unit| layout.contains(unit)), "{layout}");
        for label in [&format!("F [{force}]")[..], "V [m/s]", "stress [Pa]", "r [m]", "1 s = 1 µs"] {
            assert!(layout.contains(label), "{label} is not in {layout}");
        }
    }
}

/// A plane punch with c_p = 4000 m/s, c_s² = 3e6 m²/s² and R = 10 mm, whose units of time and stress are 2.5 µs and 32 GPa.
const STRIP: &str = "model = \"elastic\"\ngeometry = \"plane\"\n[target]\nthickness = \"5 mm\"\n\
    material = { bulk_modulus = \"24 GPa\", shear_modulus = \"6 GPa\", density = \"2 g/cm3\" }\n\
    [indenter]\nshape = \"flat\"\nradius = \"10 mm\"\nmass = \"2 kg/m\"\n\
    [impact]\nvelocity = \"5 m/s\"\n[mesh]\ncells = 20\n[run]\nend_time = \"30 us\"\n[record]\nframes = 12\n";

#[test]
fn a_plane_body_is_whole() {
    let folder = folder();
    let strip = Recorded::new(STRIP, &[], &folder.path().join("a.mcap"));
    let drags: Vec<message::Drag> = strip.all("/drag");
    let interfaces: Vec<message::InterfaceStress> = strip.all("/interface/stress");
    let velocities: Vec<message::Velocity> = strip.all("/velocity");
    assert!(strip.channels["/drag"]["meaning.force"].contains("both halves"));

    // the force is that of the pressure on both halves of the contact
    let largest = drags.iter().map(|drag| drag.force).fold(0.0, f64::max);
    for (drag, interface) in drags.iter().zip(&interfaces) {
        let half = interface.dr * interface.stress.iter().sum::<f64>();
        assert!((drag.force - 2.0 * half).abs() < 1e-13 * largest, "{} N/m, {half} N/m", drag.force);
    }
    // and its impulse that of the mass in the case, until the indenter has rebounded
    let impulse: f64 = drags
        .windows(2)
        .map(|pair| 0.5 * (pair[1].time - pair[0].time) * (pair[0].force + pair[1].force))
        .sum();
    let [first, last] = [&velocities[0], &velocities[velocities.len() - 1]].map(|motion| motion.velocity);
    assert!(last < 0.0, "{last} m/s");
    assert!((impulse / (2.0 * (first - last)) - 1.0).abs() < 1e-12, "{impulse} N s/m, {first} to {last} m/s");
}

#[test]
fn a_plane_body_has_a_dimensionless_twin_of_the_half() {
    let folder = folder();
    let strip = Recorded::new(STRIP, &[], &folder.path().join("a.mcap"));
    // 2 kg/m are 1 kg/m of the half
    let (c_s, mass) = (3e6f64.sqrt() / 4000.0, 1.0 / (2000.0 * 0.01 * 0.01));
    let twin = format!(
        "model = \"elastic\"\ngeometry = \"plane\"\n[target]\nthickness = 0.5\nshear_wave_speed = {c_s:?}\n\
         [indenter]\nshape = \"flat\"\nradius = 1.0\nmass = {mass:?}\n[impact]\nvelocity = 0.00125\n\
         [mesh]\ncells = 20\n[run]\nend_time = 12.0\n[record]\nframes = 12\n"
    );
    let twin = Recorded::new(&twin, &[], &folder.path().join("b.mcap"));
    assert!(twin.channels["/drag"]["meaning.force"].contains("half x >= 0"));

    let (force, energy) = (2.0 * 0.01 * 32e9, 2.0 * 1e-4 * 32e9);
    let drag = |m: message::Drag| vec![m.time, m.force, m.contact_radius];
    strip.is_twin(&twin, "/drag", &[2.5e-6, force, 0.01], drag);
    let velocity = |m: message::Velocity| vec![m.velocity, m.displacement];
    strip.is_twin(&twin, "/velocity", &[4000.0, 0.01], velocity);
    strip.is_twin(&twin, "/interface/stress", &[32e9], |m: message::InterfaceStress| m.stress);
    strip.is_twin(&twin, "/probes", &[32e9], |m: message::Probes| m.stress);
    let energies = |m: message::Energy| vec![m.kinetic, m.strain, m.indenter, m.dissipated, m.damped, m.work];
    strip.is_twin(&twin, "/energy", &[energy], energies);
}

#[test]
fn pictures_are_in_metres() {
    let folder = folder();
    let ball = Recorded::new(BALL, &["mesh.cells=80"], &folder.path().join("a.mcap"));
    let message::Drag { time, force: drag, .. } = ball.last("/drag");
    let motion: message::Velocity = ball.last("/velocity");

    // the profile has the numbers of the interface
    let profile: message::SurfaceProfile = ball.last("/view/profile");
    let interface: message::InterfaceStress = ball.last("/interface/stress");
    assert_eq!((profile.step, profile.time), (interface.step, time));
    assert!(pressed(&profile, &interface).iter().filter(|i| profile.stress[**i] > 1e6).count() > 5);
    let tip = f64::from(profile.indenter[0]);
    assert!((tip / motion.displacement - 1.0).abs() < 0.01, "{tip}, {}", motion.displacement);

    // the indenter is where the exaggerated displacement puts it
    let transforms: foxglove::FrameTransforms = ball.last("/view/tf");
    let translation = transforms.transforms[0].translation.expect("always set");
    let exaggerated = -ball.number("/view/tf", "exaggeration") * motion.displacement;
    assert!(near(translation.y, exaggerated), "{translation:?}");

    // the drag is an arrow of its length, and the label has units
    let scene: foxglove::SceneUpdate = ball.last("/view/scene");
    let entity = scene.entities.iter().find(|entity| entity.id == "drag").expect("the drag");
    let length = entity.arrows[0].shaft_length + entity.arrows[0].head_length;
    assert!(near(length, ball.number("/view/scene", "arrow_length_per_drag") * drag), "{length} m, {drag} N");
    let words: Vec<&str> = entity.texts[0].text.split_whitespace().collect();
    let [_, _, microseconds, "µs", _, _, force, unit] = words[..] else { panic!("{words:?}") };
    let number = |text: &str| text.parse::<f64>().expect("a number");
    assert!((number(microseconds) / (1e6 * time) - 1.0).abs() < 1e-3, "{words:?}");
    let factor = [("N", 1.0), ("kN", 1e3)].iter().find(|(name, _)| *name == unit).expect("newtons").1;
    assert!((factor * number(force) / drag - 1.0).abs() < 1e-3, "{words:?}: {drag} N");
    // the backing is 8 mm down, and fronts are in the section
    let backing = scene.entities.iter().find(|entity| entity.id == "backing").expect("the backing");
    assert!(near(backing.lines[0].points[0].y, -0.008));
    let fronts: foxglove::SceneUpdate = ball.last("/view/fronts");
    let points: Vec<f64> =
        fronts.entities[0].lines.iter().flat_map(|line| &line.points).map(|point| point.y).collect();
    assert!(points.iter().all(|y| (-0.008..=0.0).contains(y)) && points.iter().any(|y| *y < -0.001));
}

#[test]
fn faces_of_both_bodies_meet_where_they_press() {
    let folder = folder();
    let text = BALL.replace("cells = 40", "contact_cells = 20").replace("pmma", "steel");
    let set = ["indenter.body=elastic", "record.frames=20"];
    let ball = Recorded::new(&text, &set, &folder.path().join("a.mcap"));
    let (profiles, scenes) = (
        ball.all::<message::SurfaceProfile>("/view/profile"),
        ball.all::<foxglove::SceneUpdate>("/view/scene"),
    );
    // a node has the mean of the head over its cell
    let width = f64::from(profiles[0].r[1] - profiles[0].r[0]);
    let sagitta = width * width / (2.0 * 0.01);
    let mut pressed = 0;
    for (profile, scene) in profiles.iter().zip(&scenes) {
        let line = |id: &str| {
            let entity = scene.entities.iter().find(|entity| entity.id == id).expect("a line");
            assert_eq!(entity.frame_id, "world");
            entity.lines[0].points.clone()
        };
        let (face, surface) = (line("indenter"), line("surface"));
        let drawn = |points: &[foxglove::Point3], r: f64| {
            points.iter().find(|point| (point.x - r).abs() < 1e-6).map(|point| point.y)
        };
        for (i, r) in profile.r.iter().enumerate() {
            let gap = f64::from(profile.displacement[i]) - f64::from(profile.indenter[i]);
            let [face, surface] = [&face, &surface].map(|points| drawn(points, f64::from(*r)));
            // nodes near the edge are in part over the gap
            if profile.time > 0.0 && profile.stress.get(i + 2).is_some_and(|next| *next > 0.0) {
                pressed += 1;
                assert!(gap.abs() < sagitta, "{gap} m at {r} m, t = {} s", profile.time);
                if let (Some(face), Some(surface)) = (face, surface) {
                    assert!((face - surface).abs() < 1e-6, "{face}, {surface} m at {r} m");
                }
            }
        }
    }
    assert!(pressed > 50, "{pressed} nodes");
}

#[test]
fn the_edge_of_a_fast_ball_emits_waves_where_it_slows_down_to_c_p() {
    let folder = folder();
    let settings = ["impact.velocity=\"500 m/s\"", "run.end_time=\"1 us\"", "record.fields=[]"];
    let ball = Recorded::new(BALL, &settings, &folder.path().join("a.mcap"));
    let run = &metadata(&ball.bytes)["percuss.run"];
    let [c_p, dt] = ["scale.speed_m_per_s", "dt"].map(|key| run[key].parse::<f64>().expect("a number"));
    // a paraboloid: r*² = 2ρVt, dr*/dt = c_p at r* = ρV/c_p; the sphere lies a little above it
    let (r, time) = (0.01 * 500.0 / c_p, 0.5 * 0.01 * 500.0 / (c_p * c_p));
    let [edge_r, edge_time] = ["edge.r", "edge.time"].map(|key| ball.number("/view/fronts", key));
    assert!((edge_time - time).abs() < 2.0 * dt, "{edge_time} s, {time} s");
    assert!((edge_r - r).abs() < 2.0 * c_p * dt, "{edge_r} m, {r} m");
}

#[test]
fn levels_are_steps_of_recorded_values() {
    let folder = folder();
    let ball = Recorded::new(BALL, &[], &folder.path().join("a.mcap"));
    let grid: foxglove::Grid = ball.last("/view/field");
    let corner = grid.pose.as_ref().and_then(|pose| pose.position).expect("a corner");
    let size = grid.cell_size.expect("a size");
    let rows = grid.data.len() / grid.row_stride as usize;
    assert!(near(corner.y, -(rows as f64) * size.y) && (-0.0085..-0.008).contains(&corner.y), "{corner:?}");
    for (number, name) in ["stress", "velocity", "displacement"].iter().enumerate() {
        let field: message::FieldSlice = ball.last(&format!("/field/{name}"));
        let range = 126.0 * ball.number("/view/field", &format!("level.step.{name}"));
        let (_, high) =
            ball.channels["/view/field"][&format!("colour_range.{name}")].split_once(',').expect("two ends");
        assert!(near(range, high.parse().expect("a number")) && high.len() <= 10, "a round number: {high}");
        let seen = check_levels(&ball.channels, &grid, number, name, &field);
        assert!(seen > 100, "{name}: there is something to see");
    }
}

#[test]
fn the_camera_of_the_layout_sees_the_section() {
    let folder = folder();
    let ball = Recorded::new(BALL, &["mesh.cells=20"], &folder.path().join("a.mcap"));
    let camera = &ball.layout["configById"]["3D!section"]["cameraState"];
    let distance = camera["distance"].as_f64().expect("a distance");
    let grid: foxglove::Grid = ball.last("/view/field");
    let size = grid.cell_size.expect("a size");
    let width = f64::from(grid.column_count) * size.x;
    // a panel is three to four times as wide as it is high
    assert!(distance > width / 4.0 && distance < 4.0 * width, "{distance} m for {width} m");
    let target = camera["targetOffset"][1].as_f64().expect("a height");
    assert!((-0.008..0.008).contains(&target), "{target}");
    // numbers of different units have panels of their own, over the seconds of log time
    let panels = &ball.layout["configById"];
    for name in ["drag", "velocity", "probes", "profile", "surface"] {
        assert!(panels.get(format!("Plot!{name}")).is_some(), "{name}");
    }
    let end = panels["Plot!drag"]["maxXValue"].as_f64().expect("a time");
    let log_time = messages::<message::Drag>(&ball.bytes, "/drag").pop().expect("a message").0;
    assert_eq!(end, log_time as f64 / 1e9);
    let reach = panels["Plot!profile"]["maxXValue"].as_f64().expect("a radius");
    let profile: message::SurfaceProfile = ball.last("/view/profile");
    let last = f64::from(*profile.r.last().expect("points"));
    assert!((last / reach - 1.0).abs() < 0.05, "{last} m, {reach} m");
}
