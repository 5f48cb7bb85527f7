//! From a document to a case: every key, its default and its bounds.
//!
//! Reading goes on after a problem with a stand-in value, so that one pass finds all of them; the stand-ins never
//! leave this module, because a document with problems yields no case.

use std::{fmt, path::Path};

use serde::{Deserialize, Deserializer, de, de::DeserializeOwned};

use super::{
    Case, CaseBuilder, CaseErrors, Frames, Impact, Mesh, Parameters, Record, Run, Stop, Target, ViewChannel,
    bounds::Bounds,
    document::{Document, Given, Section, Sources},
    read_indenter::read_indenter,
    sizes::Plan,
};
use crate::{
    contact::Rule,
    grid::{Geometry, MeshKind},
    material::{Elastic, Material},
    model::{Field, ModelKind},
    recording::Compression,
};

/// Largest dimensionless size or time. Far beyond any use, far from overflow.
pub(super) const HUGE: f64 = 1e6;
/// Smallest dimensionless size, mass or velocity.
pub(super) const TINY: f64 = 1e-6;
/// Largest number of probes or profile points.
pub(super) const MAX_LIST: usize = 100_000;
/// Probes of the paper's figures.
const DEFAULT_PROBES: [f64; 5] = [0.0, 0.5, 0.9, 0.95, 0.99];
const DEFAULT_CELLS: u64 = 100;
const DEFAULT_FRAMES: u64 = 200;

/// Reads and checks a case.
pub(super) fn case(given: CaseBuilder) -> Result<Case, CaseErrors> {
    let sources = Sources::new(&given);
    let (mut document, mut root) = Document::parse(&sources);
    let doc = &mut document;

    let title = root.get::<String>(doc, "title", "a text in quotes").map(|given| given.value);
    let model = root.get(doc, "model", "rakhmatulin, elastic").map_or(ModelKind::Rakhmatulin, value);
    let geometry = root.get(doc, "geometry", "axisymmetric, plane").map_or(Geometry::Axisymmetric, value);
    let target = read_target(doc, &mut root, model);
    let velocity = read_impact(doc, &mut root);
    let indenter = read_indenter(doc, &mut root, &given.folder, velocity.contact.as_ref());
    let impact =
        Impact { velocity: velocity.velocity, contact: velocity.contact.map_or(Rule::Unilateral, value) };
    let mesh = read_mesh(doc, &mut root);
    let (run, end_time) = read_run(doc, &mut root);
    let (record, field_every) = read_record(doc, &mut root, run.end_time);
    root.end(doc);

    // sizes are worth deriving only from a case that is sound so far
    let parts = target.zip(indenter).filter(|_| document.is_sound());
    let parameters = parts.and_then(|((target, thickness), indenter)| {
        let plan = Plan { model, target: &target, indenter: &indenter, impact, run, record: &record };
        let sizes = plan.sizes(&mut document, &mesh, thickness, end_time)?;
        let mut parameters = Parameters {
            title: title.unwrap_or_else(|| default_title(&given.name)),
            model,
            geometry,
            target,
            indenter,
            impact,
            mesh: Mesh { kind: mesh.kind, cells: mesh.cells.value as usize },
            run,
            record,
            sizes,
        };
        parameters.record.field_every = field_every.unwrap_or_else(|| parameters.default_field_every());
        Some(parameters)
    });
    let parameters = document.finish(parameters)?;
    Ok(Case { parameters, given })
}

pub(super) fn value<T>(given: Given<T>) -> T {
    given.value
}

fn default_title(name: &str) -> String {
    Path::new(name).file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// Thickness in a case file: a number or "half-space".
enum Thickness {
    Layer(f64),
    HalfSpace,
}

impl<'de> Deserialize<'de> for Thickness {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Thickness;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number > 0 or \"half-space\"")
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Thickness, E> {
                Ok(Thickness::Layer(value))
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Thickness, E> {
                Ok(Thickness::Layer(value as f64))
            }
            fn visit_str<E: de::Error>(self, value: &str) -> Result<Thickness, E> {
                match value {
                    "half-space" => Ok(Thickness::HalfSpace),
                    other => Err(E::invalid_value(de::Unexpected::Str(other), &self)),
                }
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

pub(super) type Span = std::ops::Range<usize>;

fn read_target<'t>(
    doc: &mut Document<'t>,
    root: &mut Section<'t>,
    model: ModelKind,
) -> Option<(Target, Span)> {
    let mut section = root.section(doc, "target");
    let bounds = Bounds::within(TINY, HUGE);
    let allowed = format!("{bounds}, or \"half-space\"");
    let thickness: Option<Given<Thickness>> = section.require(doc, "thickness", &allowed);
    let thickness = thickness.and_then(|given| match given.value {
        Thickness::HalfSpace => Some((None, given.span)),
        Thickness::Layer(h) if bounds.contain(h) => Some((Some(h), given.span)),
        Thickness::Layer(h) => {
            let message = format!("`target.thickness` = {h:?} is not possible");
            doc.problem(given.span, message, Some(format!("allowed: {allowed}")));
            None
        }
    });

    // positive bulk modulus: c_s²/c_p² < 3/4
    let fastest = if model == ModelKind::Elastic { 0.75f64.sqrt() } else { 1.0 };
    let speed = section.get::<f64>(doc, "shear_wave_speed", "a number, c_s/c_p");
    let elastic =
        section.get::<Elastic>(doc, "material", "{ youngs_modulus, poisson_ratio, density } in SI units");
    let material = match (speed, elastic) {
        (Some(speed), None) => {
            let bounds = Bounds::between(0.0, fastest);
            if bounds.contain(speed.value) && speed.value >= TINY {
                Some(Material { shear_wave_speed: speed.value, si: None })
            } else {
                let message = format!("`target.shear_wave_speed` = {:?} is not possible", speed.value);
                doc.problem(speed.span, message, Some(format!("allowed: {bounds}, in units of c_p")));
                None
            }
        }
        (None, Some(elastic)) => match elastic.value.wave_speeds() {
            Ok((c_p, c_s)) => Some(Material { shear_wave_speed: c_s / c_p, si: Some(elastic.value) }),
            Err(error) => {
                let help = "give youngs_modulus [Pa], poisson_ratio and density [kg/m³]";
                doc.problem(elastic.span, error.to_string(), Some(help.into()));
                None
            }
        },
        (Some(speed), Some(_)) => {
            let message = "`target.shear_wave_speed` and `target.material` say the same thing twice";
            doc.problem(speed.span, message.into(), Some("keep one of them".into()));
            None
        }
        (None, None) => {
            let given = section.is_refused("material");
            section.need(doc, "shear_wave_speed", given, "c_s/c_p, or a material in SI units");
            None
        }
    };
    section.end(doc);
    let (thickness, span) = thickness?;
    Some((Target { thickness, material: material? }, span))
}

struct GivenImpact {
    velocity: f64,
    contact: Option<Given<Rule>>,
}

fn read_impact<'t>(doc: &mut Document<'t>, root: &mut Section<'t>) -> GivenImpact {
    let mut section = root.section(doc, "impact");
    let velocity = section.number(doc, "velocity", Bounds::within(TINY, HUGE)).map_or(1.0, value);
    let contact = section.get(doc, "contact", "unilateral, bilateral, prescribed");
    section.end(doc);
    GivenImpact { velocity, contact }
}

/// The `[mesh]` section.
pub(super) struct GivenMesh {
    pub kind: MeshKind,
    pub cells: Given<u64>,
    pub outer_radius: Option<Given<f64>>,
}

fn read_mesh<'t>(doc: &mut Document<'t>, root: &mut Section<'t>) -> GivenMesh {
    let mut section = root.section(doc, "mesh");
    let kind = section.get(doc, "kind", "matched, paper").map_or(MeshKind::Matched, value);
    let cells = section.count(doc, "cells", 2..=1_000_000);
    let outer_radius = section.number(doc, "outer_radius", Bounds::within(TINY, HUGE));
    let cells = cells.unwrap_or(Given { value: DEFAULT_CELLS, span: section.span() });
    section.end(doc);
    GivenMesh { kind, cells, outer_radius }
}

fn read_run<'t>(doc: &mut Document<'t>, root: &mut Section<'t>) -> (Run, Span) {
    let mut section = root.section(doc, "run");
    let end_time = section.require_number(doc, "end_time", Bounds::above(0.0, 1e12));
    let stop = section.get(doc, "stop", "never, extension, separation").map_or(Stop::Never, value);
    let span = span_of(&end_time).unwrap_or(section.span());
    section.end(doc);
    (Run { end_time: end_time.map_or(1.0, value), stop }, span)
}

/// The `[record]` section, and its `field_every`, if it is given: else it follows from the sizes.
fn read_record<'t>(doc: &mut Document<'t>, root: &mut Section<'t>, end_time: f64) -> (Record, Option<usize>) {
    let mut section = root.section(doc, "record");
    let interface_every = section.count(doc, "interface_every", 1..=1_000_000_000).map_or(1, value);
    let probes = section.get::<Vec<f64>>(doc, "probes", "a list of radii ≥ 0");
    let probes = probes.map_or(DEFAULT_PROBES.to_vec(), |given| {
        check_list(doc, &given, ("probes", "radii"), Bounds::within(0.0, HUGE), "");
        given.value
    });
    let fields = read_names(doc, &mut section, "fields", "displacement, velocity, stress");
    let field_every = section.count(doc, "field_every", 1..=1_000_000).map(|given| given.value as usize);
    let views = read_names(doc, &mut section, "views", "field, image, scene, fronts, tf, profile");
    let frames = section.count(doc, "frames", 0..=1_000_000);
    let frame_times = section.get::<Vec<f64>>(doc, "frame_times", "a list of times, 0 ≤ t ≤ run.end_time");
    let frames = match (frames, frame_times) {
        (Some(_), Some(times)) => {
            let message = "`record.frames` and `record.frame_times` are both given".to_owned();
            doc.problem(times.span, message, Some("leave one of them out".into()));
            Frames::At(Vec::new())
        }
        (None, Some(times)) => {
            // with a stand-in for the end time there is no telling
            let bounds = Bounds::within(0.0, if doc.is_sound() { end_time } else { 1e12 });
            check_list(doc, &times, ("frame_times", "times"), bounds, ", the time of the run");
            Frames::At(times.value)
        }
        (frames, None) => Frames::Spread(frames.map_or(DEFAULT_FRAMES, value) as usize),
    };
    let compression = section.get(doc, "compression", "none, lz4, zstd").map_or(Compression::Zstd, value);
    let playback_rate = section.number(doc, "playback_rate", Bounds::within(1e-9, 1e9));
    section.end(doc);
    let playback_rate = playback_rate.map_or(1.0, value);
    let record = Record {
        interface_every,
        probes,
        fields: fields.unwrap_or(vec![Field::Stress]),
        field_every: 1,
        views: views.unwrap_or(ViewChannel::ALL.to_vec()),
        frames,
        compression,
        playback_rate,
    };
    (record, field_every)
}

/// A list of names, each at most once.
///
/// * `known`: the names there are
fn read_names<'t, T: DeserializeOwned + PartialEq + fmt::Debug>(
    doc: &mut Document<'t>,
    section: &mut Section<'t>,
    key: &'static str,
    known: &str,
) -> Option<Vec<T>> {
    let given = section.get::<Vec<T>>(doc, key, &format!("a list of {known}"))?;
    let repeated = given.value.iter().enumerate().find(|(i, name)| given.value[..*i].contains(name));
    if let Some((_, name)) = repeated {
        let message = format!("`record.{key}` names {name:?} twice").to_lowercase();
        doc.problem(given.span.clone(), message, Some("name each once".into()));
    }
    Some(given.value)
}

/// Checks a list of `record`: every number, and how many there are.
///
/// * `names`: of the key, and of what it lists
/// * `remark`: what to add to the bounds
fn check_list(
    doc: &mut Document<'_>,
    given: &Given<Vec<f64>>,
    names: (&str, &str),
    bounds: Bounds,
    remark: &str,
) {
    let (key, noun) = names;
    if let Some(bad) = given.value.iter().find(|number| !bounds.contain(**number)) {
        let message = format!("`record.{key}` contains {bad:?}");
        doc.problem(given.span.clone(), message, Some(format!("allowed: {bounds}{remark}")));
    }
    if given.value.len() > MAX_LIST {
        let message = format!("`record.{key}` has {} {noun}", given.value.len());
        doc.problem(given.span.clone(), message, Some(format!("allowed: at most {MAX_LIST}")));
    }
}

/// Where a value was given.
pub(super) fn span_of<T>(given: &Option<Given<T>>) -> Option<Span> {
    given.as_ref().map(|given| given.span.clone())
}
