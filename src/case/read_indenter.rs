//! The `[indenter]` section: shapes, profiles from files, and contact rules that only some shapes allow.

use std::path::Path;

use serde::Deserialize;

use super::{
    Body, HeadKind,
    bounds::Bounds,
    document::{Given, Section},
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

/// The keys of the head.
struct GivenHead {
    radius: Option<Given<f64>>,
    curvature: Option<Given<f64>>,
    spread_rate: Option<Given<f64>>,
    file: Option<Given<String>>,
    points: Option<Given<Vec<[f64; 2]>>>,
}

/// Reads the section.
pub(super) fn read_indenter(
    root: &mut Section<'_>,
    folder: &Path,
    contact: Option<&Given<Rule>>,
) -> Option<Body> {
    let mut section = root.section("indenter");
    let size = Bounds::within(TINY, HUGE);
    let shape: Option<Given<ShapeName>> = section.require("shape", "flat, paraboloid, cone, profile");
    let given = GivenHead {
        radius: section.number("radius", size),
        curvature: section.number("curvature", size),
        spread_rate: section.number("spread_rate", size),
        file: section.get("file", "the path of a CSV file with columns r, f"),
        points: section.get("points", "a list [[r, f], …] that starts with [0, 0]"),
    };
    let mass = section.number("mass", Bounds::within(TINY, 1e12).or_infinite());
    let scale_radius = read_scale(&mut section);
    let shape = shape.map(value);
    check_rule(&section, contact, shape, mass.as_ref());
    let radius = given.radius.as_ref().map(|radius| radius.value);
    let head = shape.and_then(|shape| given.head(&section, shape, folder));
    section.end();
    let head = head?;
    let radius = match &head {
        HeadKind::Profile { curve, .. } => Some(radius.unwrap_or(curve.last_radius())),
        _ => radius,
    };
    Some(Body { head, radius, mass: mass.map_or(f64::INFINITY, value), scale_radius })
}

fn read_scale(section: &mut Section<'_>) -> Option<f64> {
    let scale = section.get::<ScaleTable>("scale", "{ radius = metres }")?;
    let radius = scale.value.radius;
    if radius > 0.0 && radius.is_finite() {
        return Some(radius);
    }
    let message = format!("`indenter.scale.radius` = {radius:?} is not possible");
    section.refuse("scale", scale.span, message, "a finite number of metres > 0")
}

impl GivenHead {
    /// The head of a shape, or the problems with it.
    fn head(self, section: &Section<'_>, shape: ShapeName, folder: &Path) -> Option<HeadKind> {
        let only = |key: &str, at: Option<Span>, owner: ShapeName, name: &str| {
            if let Some(span) = at.filter(|_| shape != owner) {
                let message = format!("`indenter.{key}` belongs to shape = \"{name}\"");
                section.problem(span, message, format!("remove it, or set indenter.shape = \"{name}\""));
            }
        };
        only("curvature", span_of(&self.curvature), ShapeName::Paraboloid, "paraboloid");
        only("spread_rate", span_of(&self.spread_rate), ShapeName::Cone, "cone");
        only("file", span_of(&self.file), ShapeName::Profile, "profile");
        only("points", span_of(&self.points), ShapeName::Profile, "profile");
        match shape {
            ShapeName::Flat => {
                section.need("radius", self.radius.is_some(), "a flat punch has a radius");
                self.radius.map(|_| HeadKind::Flat)
            }
            ShapeName::Paraboloid => {
                section.need("curvature", self.curvature.is_some(), "k of r*² = k·t at V0");
                self.curvature.map(|given| HeadKind::Paraboloid { curvature: given.value })
            }
            ShapeName::Cone => {
                let meaning = "V* = tan φ of r* = V*·t at V0 = 1";
                section.need("spread_rate", self.spread_rate.is_some(), meaning);
                self.spread_rate.map(|given| HeadKind::Cone { spread_rate: given.value })
            }
            ShapeName::Profile => self.profile(section, folder),
        }
    }

    fn profile(self, section: &Section<'_>, folder: &Path) -> Option<HeadKind> {
        let radius = self.radius;
        let (points, span) = match (self.file, self.points) {
            (None, Some(points)) => (Ok(points.value), points.span),
            (Some(file), None) => {
                let points = read_points(&folder.join(&file.value));
                (points.map_err(|error| format!("profile `{}`: {error}", file.value)), file.span)
            }
            (Some(file), Some(_)) => {
                section.problem(file.span, "the profile is given twice", "keep `file` or `points`");
                return None;
            }
            (None, None) => {
                section.need("file", false, "a CSV file with the points r, f of the profile");
                return None;
            }
        };
        let found = points.and_then(|points| {
            if points.len() > MAX_LIST {
                return Err(format!(
                    "the profile has {} points, at most {MAX_LIST} are allowed",
                    points.len()
                ));
            }
            let curve = Profile::new(&points).map_err(|error| format!("profile: {error}"))?;
            Ok((points, curve))
        });
        let (points, curve) = match found {
            Ok(found) => found,
            Err(message) => {
                let help = "points (r, f) from the tip outwards: r = 0, f = 0 first, r increasing, f ≥ 0; a file is CSV with columns r and f";
                section.problem(span, message, help);
                return None;
            }
        };
        if let Some(radius) = radius.filter(|radius| radius.value > curve.last_radius()) {
            let (radius, last, span) = (radius.value, curve.last_radius(), radius.span);
            let message = format!(
                "`indenter.radius` = {radius:?} is larger than the last point of the profile, r = {last:?}"
            );
            section.problem(span, message, "add points, or leave the radius out");
            return None;
        }
        Some(HeadKind::Profile { points, curve })
    }
}

/// Contact rules that only some indenters allow.
fn check_rule(
    section: &Section<'_>,
    contact: Option<&Given<Rule>>,
    shape: Option<ShapeName>,
    mass: Option<&Given<f64>>,
) {
    let Some(contact) = contact else { return };
    if contact.value == Rule::Bilateral && shape.is_some_and(|shape| shape != ShapeName::Flat) {
        let message = "contact = \"bilateral\" glues a fixed zone and needs shape = \"flat\"";
        let help = "use contact = \"unilateral\" for heads that touch gradually";
        section.problem(contact.span.clone(), message, help);
    }
    if let Some(mass) = mass.filter(|mass| mass.value.is_finite() && contact.value == Rule::Prescribed) {
        let message =
            format!("`indenter.mass` = {:?}, but contact = \"prescribed\" gives the motion", mass.value);
        section.problem(mass.span.clone(), message, "set mass = inf, or another contact rule");
    }
}

/// Reads `r,f` rows; a first row without numbers is a header, and `#` starts a comment.
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
