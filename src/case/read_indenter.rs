//! The `[indenter]` section: shapes, profiles from files, and the rules that only some shapes can follow.

use std::path::Path;

use serde::Deserialize;

use super::{
    Body, HeadKind,
    bounds::Bounds,
    document::{Document, Given, Section},
    read::{HUGE, MAX_LIST, Span, TINY, span_of, value},
};
use crate::{contact::Rule, shape::Profile};

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

/// Reads the section.
pub(super) fn read_indenter<'t>(
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
