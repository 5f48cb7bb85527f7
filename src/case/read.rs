//! From a document to a case: every key, its default, its bounds, and the sizes that follow.
//!
//! Reading goes on after a problem with a stand-in value, so that one pass finds all of them; the stand-ins never
//! leave this module, because a document with problems yields no case.

use std::path::Path;

use serde::{Deserialize, Deserializer, de};

use super::{
    Body, Case, CaseErrors, HeadKind, Impact, Mesh, Record, Run, Sizes, Stop, Target,
    document::{Bounds, Document, Given, Section, Sources},
};
use crate::{
    contact::Rule,
    grid::{Geometry, MeshKind, Spacing},
    material::{Elastic, Material},
    model::{Field, ModelKind},
    recording::Compression,
    shape::Profile,
};

/// Largest dimensionless size or time. Far beyond any use, far from overflow.
const HUGE: f64 = 1e6;
/// Smallest dimensionless size, mass or velocity.
const TINY: f64 = 1e-6;
/// Largest number of steps of a run.
const MAX_STEPS: f64 = 1e8;
/// Largest number of nodes: two levels of them take 16 GiB.
const MAX_NODES: f64 = 1e9;
/// Largest number of probes or profile points.
const MAX_LIST: usize = 100_000;
/// Width of the precursor that runs ahead of a wave on a mesh with dispersion, in nodes per cube root of the number
/// of steps: beyond it the field is below 1e-16 (measured; its head is an Airy function).
const PRECURSOR: f64 = 6.0;
/// Probes of the paper's figures.
const DEFAULT_PROBES: [f64; 5] = [0.0, 0.5, 0.9, 0.95, 0.99];
const DEFAULT_CELLS: u64 = 100;
const DEFAULT_FRAMES: u64 = 200;

/// Reads and checks a case.
pub fn case(name: &str, text: &str, overrides: &[String], folder: &Path) -> Result<Case, CaseErrors> {
    let sources = Sources::new(name, text, overrides);
    let (mut document, mut root) = Document::parse(&sources);
    let doc = &mut document;

    let title = root.get::<String>(doc, "title", "a text in quotes").map(|given| given.value);
    let model = root.get(doc, "model", "rakhmatulin, elastic").map_or(ModelKind::Rakhmatulin, value);
    let geometry = root.get(doc, "geometry", "axisymmetric, plane").map_or(Geometry::Axisymmetric, value);
    let target = read_target(doc, &mut root, model);
    let velocity = read_impact(doc, &mut root);
    let indenter = read_indenter(doc, &mut root, folder, velocity.contact.as_ref());
    let impact =
        Impact { velocity: velocity.velocity, contact: velocity.contact.map_or(Rule::Unilateral, value) };
    let mesh = read_mesh(doc, &mut root);
    let (run, end_time) = read_run(doc, &mut root);
    let record = read_record(doc, &mut root);
    root.end(doc);

    // sizes are worth deriving only from a case that is sound so far
    let parts = target.zip(indenter).filter(|_| document.is_sound());
    let case = parts.and_then(|((target, thickness), indenter)| {
        let plan = Plan { model, target: &target, indenter: &indenter, impact, run, record: &record };
        let sizes = plan.sizes(&mut document, &mesh, thickness, end_time)?;
        Some(Case {
            title: title.unwrap_or_else(|| default_title(name)),
            model,
            geometry,
            target,
            indenter,
            impact,
            mesh: Mesh { kind: mesh.kind, cells: mesh.cells.value as usize },
            run,
            record,
            sizes,
            text: text.to_owned(),
        })
    });
    document.finish(case)
}

fn value<T>(given: Given<T>) -> T {
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
            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
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

type Span = std::ops::Range<usize>;

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

/// Name of a shape in a case file.
#[derive(Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ShapeName {
    Flat,
    Paraboloid,
    Cone,
    Profile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScaleTable {
    radius: f64,
}

fn read_indenter<'t>(
    doc: &mut Document<'t>,
    root: &mut Section<'t>,
    folder: &Path,
    contact: Option<&Given<Rule>>,
) -> Option<Body> {
    let mut section = root.section(doc, "indenter");
    let size = Bounds::within(TINY, HUGE);
    let shape: Option<Given<ShapeName>> = section.require(doc, "shape", "flat, paraboloid, cone, profile");
    let radius = section.number(doc, "radius", size);
    let curvature = section.number(doc, "curvature", size);
    let spread_rate = section.number(doc, "spread_rate", size);
    let file = section.get::<String>(doc, "file", "the path of a CSV file with columns r, f");
    let points = section.get::<Vec<[f64; 2]>>(doc, "points", "a list [[r, f], …] that starts with [0, 0]");
    let mass = section.number(doc, "mass", Bounds::within(TINY, 1e12).or_infinite());
    let scale = section.get::<ScaleTable>(doc, "scale", "{ radius = metres }");

    let name = shape.as_ref().map(|given| given.value);
    if let Some(name) = name {
        let only = |key: &str, at: Option<Span>, owner: ShapeName, text: &str, doc: &mut Document| {
            if let Some(span) = at.filter(|_| name != owner) {
                let message = format!("`indenter.{key}` belongs to shape = \"{text}\"");
                doc.problem(span, message, Some(format!("remove it, or set indenter.shape = \"{text}\"")));
            }
        };
        only("curvature", span_of(&curvature), ShapeName::Paraboloid, "paraboloid", doc);
        only("spread_rate", span_of(&spread_rate), ShapeName::Cone, "cone", doc);
        only("file", span_of(&file), ShapeName::Profile, "profile", doc);
        only("points", span_of(&points), ShapeName::Profile, "profile", doc);
    }
    let radius_value = radius.as_ref().map(|given| given.value);
    let head = match name {
        Some(ShapeName::Flat) => {
            section.need(doc, "radius", radius_value.is_some(), "a flat punch has a radius");
            radius_value.map(|_| HeadKind::Flat)
        }
        Some(ShapeName::Paraboloid) => {
            section.need(doc, "curvature", curvature.is_some(), "k of r*² = k·t at V0");
            curvature.map(|given| HeadKind::Paraboloid { curvature: given.value })
        }
        Some(ShapeName::Cone) => {
            section.need(doc, "spread_rate", spread_rate.is_some(), "V* = tan φ of r* = V*·t at V0 = 1");
            spread_rate.map(|given| HeadKind::Cone { spread_rate: given.value })
        }
        Some(ShapeName::Profile) => read_profile(doc, &section, folder, file, points, radius.as_ref()),
        None => None,
    };
    check_rule(doc, contact, name, mass.as_ref());
    let scale_radius = scale.and_then(|scale| {
        if scale.value.radius > 0.0 && scale.value.radius.is_finite() {
            return Some(scale.value.radius);
        }
        let message = format!("`indenter.scale.radius` = {:?} is not possible", scale.value.radius);
        doc.problem(scale.span, message, Some("allowed: a finite number of metres > 0".into()));
        None
    });
    section.end(doc);
    let head = head?;
    let radius = match &head {
        HeadKind::Profile { curve, .. } => Some(radius_value.unwrap_or(curve.last_radius())),
        _ => radius_value,
    };
    Some(Body { head, radius, mass: mass.map_or(f64::INFINITY, value), scale_radius })
}

fn span_of<T>(given: &Option<Given<T>>) -> Option<Span> {
    given.as_ref().map(|given| given.span.clone())
}

/// Rules that only some indenters can follow.
fn check_rule(
    doc: &mut Document,
    contact: Option<&Given<Rule>>,
    shape: Option<ShapeName>,
    mass: Option<&Given<f64>>,
) {
    let Some(contact) = contact else { return };
    if contact.value == Rule::Bilateral && shape.is_some_and(|shape| shape != ShapeName::Flat) {
        let message = "contact = \"bilateral\" glues a fixed zone and needs shape = \"flat\"";
        let help = "use contact = \"unilateral\" for heads that touch gradually";
        doc.problem(contact.span.clone(), message.into(), Some(help.into()));
    }
    if let Some(mass) = mass.filter(|mass| mass.value.is_finite() && contact.value == Rule::Prescribed) {
        let message =
            format!("`indenter.mass` = {:?}, but contact = \"prescribed\" gives the motion", mass.value);
        doc.problem(mass.span.clone(), message, Some("set mass = inf, or another contact rule".into()));
    }
}

fn read_profile<'t>(
    doc: &mut Document<'t>,
    section: &Section<'t>,
    folder: &Path,
    file: Option<Given<String>>,
    points: Option<Given<Vec<[f64; 2]>>>,
    radius: Option<&Given<f64>>,
) -> Option<HeadKind> {
    let (points, span) = match (file, points) {
        (Some(file), None) => match read_points(&folder.join(&file.value)) {
            Ok(points) => (points, file.span),
            Err(message) => {
                let help = "a CSV file with columns r and f, the tip (0, 0) first, r increasing";
                doc.problem(file.span, format!("profile `{}`: {message}", file.value), Some(help.into()));
                return None;
            }
        },
        (None, Some(points)) => (points.value, points.span),
        (Some(file), Some(_)) => {
            let help = "keep `file` or `points`".to_owned();
            doc.problem(file.span, "the profile is given twice".into(), Some(help));
            return None;
        }
        (None, None) => {
            section.need(doc, "file", false, "a CSV file with the points r, f of the profile");
            return None;
        }
    };
    if points.len() > MAX_LIST {
        let help = format!("allowed: at most {MAX_LIST}");
        doc.problem(span, format!("the profile has {} points", points.len()), Some(help));
        return None;
    }
    let curve = match Profile::new(&points) {
        Ok(curve) => curve,
        Err(error) => {
            let help = "points (r, f) from the tip outwards: r = 0, f = 0 first, r increasing, f ≥ 0";
            doc.problem(span, format!("profile: {error}"), Some(help.into()));
            return None;
        }
    };
    if let Some(radius) = radius.filter(|radius| radius.value > curve.last_radius()) {
        let message = format!(
            "`indenter.radius` = {:?} is larger than the last point of the profile, r = {:?}",
            radius.value,
            curve.last_radius()
        );
        doc.problem(radius.span.clone(), message, Some("add points, or leave the radius out".into()));
        return None;
    }
    Some(HeadKind::Profile { points, curve })
}

/// Reads `r,f` rows; a first row that is no numbers is a header, and `#` starts a comment.
fn read_points(path: &Path) -> Result<Vec<[f64; 2]>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(|error| error.to_string())?;
    let mut points = Vec::new();
    for (index, record) in reader.records().enumerate() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != 2 {
            return Err(format!("line {line} has {} columns instead of 2", record.len()));
        }
        match (record[0].parse(), record[1].parse()) {
            (Ok(r), Ok(f)) => points.push([r, f]),
            _ if index == 0 => {}
            _ => return Err(format!("line {line}: `{},{}` are not two numbers", &record[0], &record[1])),
        }
    }
    Ok(points)
}

struct GivenMesh {
    kind: MeshKind,
    cells: Given<u64>,
    outer_radius: Option<Given<f64>>,
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

fn read_record<'t>(doc: &mut Document<'t>, root: &mut Section<'t>) -> Record {
    let mut section = root.section(doc, "record");
    let interface_every = section.count(doc, "interface_every", 1..=1_000_000_000).map_or(1, value);
    let probes = section.get::<Vec<f64>>(doc, "probes", "a list of radii ≥ 0");
    let probes = probes.map_or(DEFAULT_PROBES.to_vec(), |given| {
        let bounds = Bounds::within(0.0, HUGE);
        if let Some(bad) = given.value.iter().find(|r| !bounds.contain(**r)) {
            let message = format!("`record.probes` contains {bad:?}");
            doc.problem(given.span.clone(), message, Some(format!("allowed: {bounds}")));
        }
        if given.value.len() > MAX_LIST {
            let message = format!("`record.probes` has {} radii", given.value.len());
            doc.problem(given.span.clone(), message, Some(format!("allowed: at most {MAX_LIST}")));
        }
        given.value
    });
    let fields = section.get::<Vec<Field>>(doc, "fields", "a list of displacement, velocity, stress");
    let fields = fields.map_or(vec![Field::Stress], |given| {
        let repeated = given.value.iter().enumerate().find(|(i, field)| given.value[..*i].contains(field));
        if let Some((_, field)) = repeated {
            let message = format!("`record.fields` names {field:?} twice").to_lowercase();
            doc.problem(given.span.clone(), message, Some("name every field once".into()));
        }
        given.value
    });
    let frames = section.count(doc, "frames", 0..=1_000_000).map_or(DEFAULT_FRAMES, value) as usize;
    let compression = section.get(doc, "compression", "none, lz4, zstd").map_or(Compression::Zstd, value);
    let playback_rate = section.number(doc, "playback_rate", Bounds::within(1e-9, 1e9));
    section.end(doc);
    let playback_rate = playback_rate.map_or(1.0, value);
    Record { interface_every, probes, fields, frames, compression, playback_rate }
}

/// A sound case whose sizes are not known yet.
struct Plan<'a> {
    model: ModelKind,
    target: &'a Target,
    indenter: &'a Body,
    impact: Impact,
    run: Run,
    record: &'a Record,
}

impl Plan<'_> {
    fn sizes(&self, doc: &mut Document, mesh: &GivenMesh, thickness: Span, end_time: Span) -> Option<Sizes> {
        let cells = mesh.cells.value as usize;
        let c_s = self.target.material.shear_wave_speed;
        let spacing = match mesh.kind {
            MeshKind::Matched => Spacing::matched(cells, self.indenter.radius, self.target.thickness, c_s),
            MeshKind::Paper => match Spacing::paper(cells, self.target.thickness) {
                Some(spacing) => spacing,
                None => {
                    let message = format!(
                        "the paper mesh needs a whole number of cells through the layer, but thickness·cells = {}",
                        self.target.thickness.unwrap_or_default() * cells as f64
                    );
                    doc.problem(thickness, message, Some("change target.thickness or mesh.cells".into()));
                    return None;
                }
            },
        };
        let dt = spacing.dz;
        let steps = (self.run.end_time / dt).round();
        if !(1.0..=MAX_STEPS).contains(&steps) {
            let message =
                format!("`run.end_time` = {:?} takes {steps:.4e} steps of {dt:.4e}", self.run.end_time);
            let help = format!("allowed: 1 to {MAX_STEPS:e} steps; change run.end_time or mesh.cells");
            doc.problem(end_time, message, Some(help));
            return None;
        }
        // log times are nanoseconds in 64 bits; half of that range is 292 years
        let rate = self.record.playback_rate;
        if 1e9 * rate * self.run.end_time > i64::MAX as f64 {
            let message = format!("`record.playback_rate` = {rate:?} puts the end of the run 292 years away");
            doc.problem(end_time, message, Some("make record.playback_rate or run.end_time smaller".into()));
            return None;
        }

        let contact_reach =
            self.indenter.shape(self.impact.velocity).reach(self.impact.velocity * self.run.end_time);
        let outer = self.outer_radius(doc, mesh, spacing, steps, contact_reach)?;
        let nr = (outer / spacing.dr - 1e-9).ceil().max(1.0);
        let nz = match spacing.layer_rows {
            Some(rows) => rows as f64,
            // the wave goes one row per step; if only the surface is looked at, half as deep is enough
            None if self.record.frames > 0 => steps + 2.0,
            None => (steps / 2.0).ceil() + 2.0,
        };
        if nr * nz > MAX_NODES {
            let message = format!("the mesh has {:.3e} nodes ({nr} along r, {nz} along z)", nr * nz);
            let help = format!("allowed: at most {MAX_NODES:e}; make mesh.cells or run.end_time smaller");
            doc.problem(mesh.cells.span.clone(), message, Some(help));
            return None;
        }
        Some(Sizes {
            dr: spacing.dr,
            dz: spacing.dz,
            dt,
            steps: steps as u64,
            nr: nr as usize,
            nz: nz as usize,
            outer_radius: nr * spacing.dr,
            depth: nz * spacing.dz,
            contact_reach,
            layer: spacing.layer_rows.is_some(),
        })
    }

    /// Outer radius of the mesh \[R\]: so large that nothing comes back from it to the contact, or, where fields are
    /// recorded, that nothing gets there.
    ///
    /// ```text
    /// r_max = r_contact + c·t_end/2 + margin      with fields: r_contact + c·t_end + margin
    /// ```
    ///
    /// with `c = c_s` (model `elastic`: 1) and the width of the precursor as margin.
    fn outer_radius(
        &self,
        doc: &mut Document,
        mesh: &GivenMesh,
        spacing: Spacing,
        steps: f64,
        contact_reach: f64,
    ) -> Option<f64> {
        let least = contact_reach + spacing.dr;
        if let Some(given) = &mesh.outer_radius {
            if given.value >= contact_reach {
                return Some(given.value);
            }
            let message = format!("`mesh.outer_radius` = {:?} is inside the contact", given.value);
            let help =
                format!("contact reaches r = {contact_reach:.4}; leave the key out to have it derived");
            doc.problem(given.span.clone(), message, Some(help));
            return None;
        }
        let speed = match self.model {
            ModelKind::Rakhmatulin => self.target.material.shear_wave_speed,
            ModelKind::Elastic => 1.0,
        };
        let fields = self.record.frames > 0 && !self.record.fields.is_empty();
        let run = speed * steps * spacing.dz * if fields { 1.0 } else { 0.5 };
        let margin = (PRECURSOR * steps.cbrt() + 2.0).ceil() * spacing.dr;
        Some((contact_reach + run + margin).max(least))
    }
}
