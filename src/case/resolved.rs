//! From a case back to a case file with every default and derived choice explicit.

use serde::Serialize;

use super::{Frames, HeadKind, Impact, Parameters, Run, Value, ViewChannel};
use crate::{
    grid::{Geometry, MeshKind},
    material::Elastic,
    model::scheme::Order,
    model::{Field, Line, ModelKind},
    recording::Compression,
};

#[derive(Serialize)]
struct Resolved<'a> {
    title: &'a str,
    model: ModelKind,
    geometry: Geometry,
    target: Target,
    indenter: Indenter<'a>,
    impact: Impact,
    mesh: Mesh,
    run: Run,
    record: Record<'a>,
}

#[derive(Serialize)]
struct Target {
    thickness: Value,
    #[serde(skip_serializing_if = "Option::is_none")]
    shear_wave_speed: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    material: Option<Elastic>,
}

#[derive(Serialize)]
struct Indenter<'a> {
    shape: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    radius: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    curvature: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    spread_rate: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    points: Option<&'a [[f64; 2]]>,
    mass: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    scale: Option<Scale>,
}

#[derive(Serialize)]
struct Scale {
    radius: f64,
}

#[derive(Serialize)]
struct Mesh {
    kind: MeshKind,
    cells: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<Order>,
    damping: f64,
    outer_radius: f64,
}

#[derive(Serialize)]
struct Record<'a> {
    interface_every: u64,
    probes: &'a [f64],
    #[serde(skip_serializing_if = "is_empty")]
    points: &'a [[f64; 2]],
    #[serde(skip_serializing_if = "is_empty")]
    lines: &'a [Line],
    fields: &'a [Field],
    field_every: usize,
    views: &'a [ViewChannel],
    #[serde(skip_serializing_if = "Option::is_none")]
    frames: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    frame_times: Option<&'a [f64]>,
    compression: Compression,
    playback_rate: f64,
}

fn is_empty<T>(list: &&[T]) -> bool {
    list.is_empty()
}

fn resolved(case: &Parameters) -> Resolved<'_> {
    let body = &case.indenter;
    let (shape, curvature, spread_rate, points) = match &body.head {
        HeadKind::Flat => ("flat", None, None, None),
        HeadKind::Paraboloid { curvature } => ("paraboloid", Some(*curvature), None, None),
        HeadKind::Cone { spread_rate } => ("cone", None, Some(*spread_rate), None),
        HeadKind::Profile { points, .. } => ("profile", None, None, Some(points.as_slice())),
    };
    let material = case.target.material;
    let record = &case.record;
    let (frames, frame_times) = match &record.frames {
        Frames::Spread(frames) => (Some(*frames), None),
        Frames::At(times) => (None, Some(times.as_slice())),
    };
    Resolved {
        title: &case.title,
        model: case.model,
        geometry: case.geometry,
        target: Target {
            thickness: case.target.thickness.map_or("half-space".into(), Value::from),
            shear_wave_speed: material.si.is_none().then_some(material.shear_wave_speed),
            material: material.si,
        },
        indenter: Indenter {
            shape,
            radius: body.radius,
            curvature,
            spread_rate,
            points,
            mass: body.mass,
            scale: body.scale_radius.map(|radius| Scale { radius }),
        },
        impact: case.impact,
        mesh: Mesh {
            kind: case.mesh.kind,
            cells: case.mesh.cells,
            order: case.mesh.order,
            damping: case.mesh.damping,
            outer_radius: case.sizes.outer_radius,
        },
        run: case.run,
        record: Record {
            interface_every: record.interface_every,
            probes: &record.probes,
            points: &record.points,
            lines: &record.lines,
            fields: &record.fields,
            field_every: record.field_every,
            views: &record.views,
            frames,
            frame_times,
            compression: record.compression,
            playback_rate: record.playback_rate,
        },
    }
}

/// The case as TOML.
pub fn toml(case: &Parameters) -> String {
    toml::to_string(&resolved(case)).expect("a case is plain tables, text and numbers")
}

/// The case as JSON; an infinite mass becomes `null`, as JSON has no infinity.
pub fn json(case: &Parameters) -> serde_json::Value {
    serde_json::to_value(resolved(case)).expect("a case is plain maps, text and numbers")
}
