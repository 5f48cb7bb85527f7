//! From a case back to a case file with every default and derived choice explicit.

use std::{borrow::Cow, collections::BTreeMap};

use percuss_output::text::{printable, toml_string};
use serde::Serialize;

use super::{Frames, Parameters, Stop, TargetLayer, Value, ViewChannel, quantity::si_unit};
use crate::{
    contact::Rule,
    geometry::Geometry,
    grid::{Back, Bond, MeshKind},
    model::{Field, Line, ModelKind, scheme::Order},
    recording::Compression,
    shape::Head,
    units::Dimension,
};

#[derive(Serialize)]
struct Resolved<'a> {
    title: &'a str,
    model: ModelKind,
    geometry: Geometry,
    length_unit: Option<Value>,
    target: Target,
    indenter: Indenter,
    impact: Impact,
    mesh: Mesh,
    run: Run,
    record: Record<'a>,
}

/// The target: its only layer, or a list of them.
#[derive(Serialize)]
struct Target {
    thickness: Option<Value>,
    shear_wave_speed: Option<f64>,
    material: Option<Material>,
    back: Option<Back>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    layer: Vec<Layer>,
}

#[derive(Serialize)]
struct Layer {
    thickness: Value,
    density: Option<f64>,
    wave_speed: Option<f64>,
    shear_wave_speed: Option<f64>,
    bond: Option<Bond>,
    material: Option<Material>,
}

#[derive(Serialize)]
struct Material {
    youngs_modulus: Option<String>,
    poisson_ratio: Option<f64>,
    bulk_modulus: Option<String>,
    shear_modulus: Option<String>,
    density: String,
}

/// The indenter; values that its shape does not have are left out.
#[derive(Default, Serialize)]
struct Indenter {
    shape: &'static str,
    radius: Option<Value>,
    edge_radius: Option<Value>,
    nose_radius: Option<Value>,
    slope: Option<f64>,
    points: Option<Vec<[Value; 2]>>,
    mass: Option<Value>,
    material: Option<&'static str>,
}

#[derive(Serialize)]
struct Impact {
    velocity: Value,
    contact: Rule,
}

#[derive(Serialize)]
struct Run {
    end_time: Value,
    stop: Stop,
    checkpoint_every: Option<f64>,
}

#[derive(Serialize)]
struct Mesh {
    kind: MeshKind,
    cells: usize,
    order: Option<Order>,
    damping: f64,
    outer_radius: Value,
}

#[derive(Serialize)]
struct Record<'a> {
    interface_every: u64,
    probes: Vec<Value>,
    layer_tension: Option<Value>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    points: Vec<[Value; 2]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    lines: Vec<BTreeMap<&'static str, Value>>,
    fields: &'a [Field],
    r_max: Value,
    field_every: usize,
    views: &'a [ViewChannel],
    frames: Option<usize>,
    frame_times: Option<Vec<Value>>,
    compression: Compression,
    playback_rate: f64,
}

fn resolved(case: &Parameters) -> Resolved<'_> {
    let record = &case.record;
    let list = |dimension, numbers: &[f64]| numbers.iter().map(|x| case.written(dimension, *x)).collect();
    let length = |x: f64| case.written(Dimension::Length, x);
    let line = |line: &Line| match *line {
        Line::R(r) => BTreeMap::from([("r", length(r))]),
        Line::Z(z) => BTreeMap::from([("z", length(z))]),
    };
    let (frames, frame_times) = match &record.frames {
        Frames::Spread(frames) => (Some(*frames), None),
        Frames::At(times) => (None, Some(list(Dimension::Time, times))),
    };
    Resolved {
        title: &case.title,
        model: case.model,
        geometry: case.geometry,
        length_unit: case.has_length_unit.then(|| case.written(Dimension::Length, 1.0)),
        target: target(case),
        indenter: indenter(case),
        impact: Impact {
            velocity: case.written(Dimension::Speed, case.impact.velocity),
            contact: case.impact.contact,
        },
        mesh: Mesh {
            kind: case.mesh.kind,
            cells: case.mesh.cells,
            order: case.mesh.order,
            damping: case.mesh.damping,
            outer_radius: case.written(Dimension::Length, case.sizes.outer_radius),
        },
        run: Run {
            end_time: case.written(Dimension::Time, case.run.end_time),
            stop: case.run.stop,
            checkpoint_every: case.run.checkpoint_every,
        },
        record: Record {
            interface_every: record.interface_every,
            probes: list(Dimension::Length, &record.probes),
            layer_tension: (case.sizes.layers.len() > 1)
                .then(|| case.written(Dimension::Stress, record.layer_tension)),
            points: record.points.iter().map(|point| point.map(length)).collect(),
            lines: record.lines.iter().map(line).collect(),
            fields: &record.fields,
            r_max: length(record.r_max),
            field_every: record.field_every,
            views: &record.views,
            frames,
            frame_times,
            compression: record.compression,
            playback_rate: record.playback_rate,
        },
    }
}

fn target(case: &Parameters) -> Target {
    let mut layers: Vec<Layer> = case.target.layers.iter().map(|given| layer(case, given)).collect();
    layers[0].bond = None;
    let back = Some(case.target.back).filter(|back| *back == Back::Free);
    let target = Target { thickness: None, shear_wave_speed: None, material: None, back, layer: Vec::new() };
    if layers.len() > 1 {
        return Target { layer: layers, ..target };
    }
    let Layer { thickness, shear_wave_speed, material, .. } = layers.remove(0);
    Target { thickness: Some(thickness), shear_wave_speed, material, ..target }
}

fn layer(case: &Parameters, layer: &TargetLayer) -> Layer {
    let pascal = |modulus: f64| format!("{modulus:?} {}", si_unit(Dimension::Stress, case.geometry));
    let thickness = layer.thickness.map(|h| case.written(Dimension::Length, h));
    let plain = |x: f64| layer.si.is_none().then_some(x);
    Layer {
        thickness: thickness.unwrap_or_else(|| "half-space".into()),
        density: plain(layer.density),
        wave_speed: plain(layer.wave_speed),
        shear_wave_speed: plain(layer.waves.shear),
        bond: Some(layer.bond),
        material: layer.si.map(|si| Material {
            youngs_modulus: si.youngs_modulus.map(pascal),
            poisson_ratio: si.poisson_ratio,
            bulk_modulus: si.bulk_modulus.map(pascal),
            shear_modulus: si.shear_modulus.map(pascal),
            density: format!("{:?} {}", si.density, si_unit(Dimension::Density, case.geometry)),
        }),
    }
}

fn indenter(case: &Parameters) -> Indenter {
    let body = &case.indenter;
    let length = |x: f64| case.written(Dimension::Length, x);
    let shared = Indenter {
        // the radius of a profile is its last point, and would be the unit of length if it were written
        radius: body.radius.filter(|_| !case.has_length_unit).map(length),
        mass: Some(case.written(Dimension::Mass, body.mass)),
        material: body.material.map(|preset| preset.name),
        ..Indenter::default()
    };
    match &body.head {
        Head::Flat { edge_radius } => {
            Indenter { shape: "flat", edge_radius: Some(length(*edge_radius)), ..shared }
        }
        Head::Paraboloid { nose_radius } => {
            Indenter { shape: "paraboloid", nose_radius: Some(length(*nose_radius)), ..shared }
        }
        Head::Sphere { nose_radius } => {
            Indenter { shape: "sphere", nose_radius: Some(length(*nose_radius)), ..shared }
        }
        Head::Cone { slope } => Indenter { shape: "cone", slope: Some(*slope), ..shared },
        Head::Profile(curve) => {
            let points = curve.points().map(|point| point.map(length)).collect();
            Indenter { shape: "profile", points: Some(points), ..shared }
        }
    }
}

/// The case as TOML.
pub fn toml(case: &Parameters) -> String {
    let mut resolved = resolved(case);
    let title = std::mem::take(&mut resolved.title);
    let is_plain = matches!(printable(title), Cow::Borrowed(_));
    if is_plain {
        resolved.title = title;
    }
    let text = toml::to_string(&resolved).expect("a case is plain tables, text and numbers");
    // on one line, so that a title cannot command what shows it
    if is_plain { text } else { text.replacen("title = \"\"", &format!("title = {}", toml_string(title)), 1) }
}

/// All that the results of a case depend on, as a text: not its title, nor when its checkpoints are written.
pub fn identity(case: &Parameters) -> String {
    let mut resolved = resolved(case);
    (resolved.title, resolved.run.checkpoint_every) = ("", None);
    serde_json::to_string(&resolved).expect("a case is plain maps, text and numbers")
}

/// The case as JSON; an infinite mass becomes `null`, as JSON has no infinity.
pub fn json(case: &Parameters) -> serde_json::Value {
    // values that are not there are left out of TOML, and would be `null`
    let table = toml::Table::try_from(resolved(case)).expect("a case is plain tables, text and numbers");
    serde_json::to_value(table).expect("a case is plain maps, text and numbers")
}
