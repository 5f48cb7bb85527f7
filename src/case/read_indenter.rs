//! The `[indenter]` section: shapes, profiles from files, and contact rules that only some shapes allow.

use std::{f64::consts::PI, path::Path};

use serde::Deserialize;
use toml::Value;

use super::{
    Body, HeadKind,
    bounds::Bounds,
    document::{Given, Section},
    read::{HUGE, MAX_LIST, Span, TINY, span_of, value},
    read_target::read_preset,
    system::System,
};
use crate::{contact::Rule, grid::Geometry, shape::Profile, units::Dimension};

/// Name of a shape in a case file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum ShapeName {
    Flat,
    Paraboloid,
    Sphere,
    Cone,
    Profile,
}

impl ShapeName {
    /// The name.
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }
}

/// What reading an indenter needs beside its section.
pub(super) struct IndenterParts<'a> {
    /// Folder of relative paths.
    pub folder: &'a Path,
    /// Symmetry.
    pub geometry: Geometry,
    /// System of the numbers.
    pub system: &'a System,
    /// V0, if it is given \[c_p\].
    pub velocity: f64,
    /// Contact rule, if it is given.
    pub contact: Option<&'a Given<Rule>>,
}

/// The keys of the head.
struct GivenHead {
    radius: Option<Given<f64>>,
    edge_radius: Option<Given<f64>>,
    nose_radius: Option<Given<f64>>,
    slope: Option<Given<f64>>,
    half_angle: Option<Given<f64>>,
    file: Option<Given<String>>,
    points: Option<Given<Vec<[f64; 2]>>>,
}

impl GivenHead {
    fn read(section: &mut Section<'_>, system: &System) -> Self {
        let size = Bounds::within(TINY, HUGE);
        let mut length = |key, bounds| section.quantity(key, Dimension::Length, bounds, system);
        Self {
            radius: length("radius", size),
            edge_radius: length("edge_radius", Bounds::within(0.0, HUGE)),
            nose_radius: length("nose_radius", size),
            slope: section.number("slope", size),
            half_angle: section.number("half_angle", Bounds::between(0.0, 90.0)),
            file: section.get("file", "the path of a CSV file with columns r, f"),
            points: section.places("points", "points", Bounds::within(0.0, HUGE), system),
        }
    }
}

/// Reads the section.
pub(super) fn read_indenter(mut section: Section<'_>, parts: &IndenterParts<'_>) -> Option<Body> {
    let names = "flat, paraboloid, sphere, cone, profile";
    let shape: Option<Given<ShapeName>> = section.require("shape", names);
    let shape = shape.map(value);
    let given = GivenHead::read(&mut section, parts.system);
    refuse_old_keys(&mut section, parts);
    let mass =
        section.quantity("mass", Dimension::Mass, Bounds::within(TINY, 1e12).or_infinite(), parts.system);
    let density = read_density(&mut section, parts.system);
    check_rule(&section, parts.contact, shape, mass.as_ref(), given.edge_radius.as_ref());
    let radius = given.radius.clone();
    let head = shape.and_then(|shape| given.head(&mut section, shape, parts));
    let mass =
        mass.map(value).or_else(|| mass_of(&section, head.as_ref()?, radius.as_ref(), density?, parts));
    section.end();
    let head = head?;
    let radius = match &head {
        HeadKind::Profile { curve, .. } => Some(radius.map_or(curve.last_radius(), value)),
        HeadKind::Sphere { nose_radius } => Some(radius.map_or(*nose_radius, value)),
        _ => radius.map(value),
    };
    Some(Body { head, radius, mass: mass.unwrap_or(f64::INFINITY) })
}

/// Keys of format 1, which named a shape by how fast its contact spread at V0.
fn refuse_old_keys(section: &mut Section<'_>, parts: &IndenterParts<'_>) {
    let velocity = parts.velocity;
    let mut refuse = |key: &'static str, new: &dyn Fn(f64) -> (&'static str, f64)| {
        let Some(given) = section.get::<f64>(key, "a number") else { return };
        let (name, value) = new(given.value);
        let message = format!("`indenter.{key}` = {:?} is a key of format 1", given.value);
        section.mark_refused(name);
        section.problem(
            given.span,
            message,
            format!("write {name} = {value:?}, the same shape at V0 = {velocity:?}"),
        );
    };
    refuse("curvature", &|k| ("nose_radius", k / (2.0 * velocity)));
    refuse("spread_rate", &|rate| ("slope", velocity / rate));
    if section.has("scale") {
        let span = section.get::<Value>("scale", "").map_or(section.span(), |given| given.span);
        let help =
            "a case in SI units has target.material, and every quantity with its unit: radius = \"10 mm\"";
        section.problem(span, "`indenter.scale` is a key of format 1", help);
    }
}

/// Density of the indenter \[γ\].
fn read_density(section: &mut Section<'_>, system: &System) -> Option<Given<f64>> {
    let bounds = Bounds::within(TINY, HUGE);
    let density = section.quantity("density", Dimension::Density, bounds, system);
    if !section.has("material") {
        return density;
    }
    let span = section.place("material");
    let preset = read_preset(section)?;
    if density.is_some() {
        let message = "`indenter.material` and `indenter.density` are both given";
        section.problem(span, message, "keep one of them");
        return None;
    }
    match system {
        System::Dimensionless => {
            let message = "`indenter.material` needs a physical case, and this one is dimensionless";
            section.problem(span, message, "give indenter.density in units of γ, or target.material");
            None
        }
        System::Physical { scales, .. } => {
            let value = scales.map_or(1.0, |scales| scales.reduce(Dimension::Density, preset.density));
            Some(Given { value, span })
        }
    }
}

/// Mass of a whole sphere, plane of half a cylinder, in the units of the case.
///
/// ```text
/// 4πρ³d/3 / (πγR³) = 4ρ³d/3          plane: πρ²d/2 / (γR²)
/// ```
fn mass_of(
    section: &Section<'_>,
    head: &HeadKind,
    radius: Option<&Given<f64>>,
    density: Given<f64>,
    parts: &IndenterParts<'_>,
) -> Option<f64> {
    match head {
        HeadKind::Sphere { nose_radius } if radius.is_none_or(|radius| radius.value == *nose_radius) => {
            Some(match parts.geometry {
                Geometry::Axisymmetric => 4.0 / 3.0 * nose_radius.powi(3) * density.value,
                Geometry::Plane => 0.5 * PI * nose_radius * nose_radius * density.value,
            })
        }
        _ => {
            let message =
                "the density gives a mass only to a whole sphere: the length of other bodies is not known";
            section.problem(density.span, message, "give indenter.mass");
            None
        }
    }
}

impl GivenHead {
    /// The head of a shape, or the problems with it.
    fn head(
        self,
        section: &mut Section<'_>,
        shape: ShapeName,
        parts: &IndenterParts<'_>,
    ) -> Option<HeadKind> {
        self.check_keys(section, shape);
        match shape {
            ShapeName::Flat => {
                section.need("radius", self.radius.is_some(), "a flat punch has a radius");
                let (radius, edge) = (self.radius?.value, self.edge_radius.as_ref());
                if let Some(edge) = edge.filter(|edge| edge.value > radius) {
                    let message = "`indenter.edge_radius` is larger than indenter.radius";
                    section.problem(
                        edge.span.clone(),
                        message,
                        "make it smaller; equal radii make a whole corner",
                    );
                }
                Some(HeadKind::Flat { edge_radius: self.edge_radius.map_or(0.0, value) })
            }
            ShapeName::Paraboloid => {
                let meaning = "radius of curvature ρ at the tip, f = r²/(2ρ)";
                section.need("nose_radius", self.nose_radius.is_some(), meaning);
                self.nose_radius.map(|rho| HeadKind::Paraboloid { nose_radius: rho.value })
            }
            ShapeName::Sphere => self.sphere(section),
            ShapeName::Cone => self.cone(section),
            ShapeName::Profile => self.profile(section, parts),
        }
    }

    /// Keys of other shapes.
    fn check_keys(&self, section: &Section<'_>, shape: ShapeName) {
        use ShapeName::{Cone, Flat, Paraboloid, Profile, Sphere};
        let only = |key: &str, span: Option<Span>, owners: &[ShapeName]| {
            let Some(span) = span.filter(|_| !owners.contains(&shape)) else { return };
            let names: Vec<String> = owners.iter().map(|owner| format!("\"{}\"", owner.name())).collect();
            let names = names.join(" or ");
            let message = format!("`indenter.{key}` belongs to shape = {names}");
            section.problem(span, message, format!("remove it, or set indenter.shape = {names}"));
        };
        only("edge_radius", span_of(&self.edge_radius), &[Flat]);
        only("nose_radius", span_of(&self.nose_radius), &[Paraboloid, Sphere]);
        only("slope", span_of(&self.slope), &[Cone]);
        only("half_angle", span_of(&self.half_angle), &[Cone]);
        only("file", span_of(&self.file), &[Profile]);
        only("points", span_of(&self.points), &[Profile]);
    }

    fn sphere(self, section: &Section<'_>) -> Option<HeadKind> {
        section.need("nose_radius", self.nose_radius.is_some(), "radius ρ of the sphere");
        let nose_radius = self.nose_radius?.value;
        if let Some(radius) = self.radius.filter(|radius| radius.value > nose_radius) {
            let message = "`indenter.radius` is larger than the sphere, indenter.nose_radius";
            section.problem(radius.span, message, "make it smaller, or leave it out for the whole sphere");
            return None;
        }
        Some(HeadKind::Sphere { nose_radius })
    }

    fn cone(self, section: &mut Section<'_>) -> Option<HeadKind> {
        let slope = match (self.slope, self.half_angle) {
            (Some(_), Some(angle)) => {
                let message = "`indenter.slope` and `indenter.half_angle` are both given";
                section.problem(angle.span, message, "keep one of them");
                return None;
            }
            (Some(slope), None) => slope.value,
            // s = cot of the angle between axis and flank
            (None, Some(Given { value, span })) => {
                let slope = 1.0 / libm::tan(value.to_radians());
                if !Bounds::within(TINY, HUGE).contain(slope) {
                    let message = format!("`indenter.half_angle` = {value:?} is not possible");
                    return section.refuse(
                        "half_angle",
                        span,
                        message,
                        "an angle from the axis whose slope is from 1e-6 to 1e6",
                    );
                }
                slope
            }
            (None, None) => {
                let is_refused = section.is_refused("half_angle");
                section.need("slope", is_refused, "df/dr; or half_angle, in degrees from the axis");
                return None;
            }
        };
        Some(HeadKind::Cone { slope })
    }

    fn profile(self, section: &mut Section<'_>, parts: &IndenterParts<'_>) -> Option<HeadKind> {
        let radius = self.radius;
        let (points, span) = match (self.file, self.points) {
            (None, Some(points)) => (Ok(points.value), points.span),
            (Some(file), None) => {
                let points = read_points(&parts.folder.join(&file.value), parts.system);
                (points.map_err(|error| format!("profile `{}`: {error}", file.value)), file.span)
            }
            (Some(file), Some(_)) => {
                section.problem(file.span, "the profile is given twice", "keep `file` or `points`");
                return None;
            }
            (None, None) => {
                section.need(
                    "file",
                    section.is_refused("points"),
                    "a CSV file with the points r, f of the profile",
                );
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
    edge_radius: Option<&Given<f64>>,
) {
    let Some(contact) = contact else { return };
    let has_corner = edge_radius.is_some_and(|edge| edge.value > 0.0);
    if contact.value == Rule::Bilateral && (has_corner || shape.is_some_and(|shape| shape != ShapeName::Flat))
    {
        let message =
            "contact = \"bilateral\" glues a fixed zone and needs shape = \"flat\" with a sharp edge";
        let help = "use contact = \"unilateral\" for heads that touch gradually";
        section.problem(contact.span.clone(), message, help);
    }
    if let Some(mass) = mass.filter(|mass| mass.value.is_finite() && contact.value == Rule::Prescribed) {
        let message =
            format!("`indenter.mass` = {:?}, but contact = \"prescribed\" gives the motion", mass.value);
        section.problem(mass.span.clone(), message, "set mass = inf, or another contact rule");
    }
}

/// Reads `r,f` rows; a first row without numbers is a header, which may carry units, `r [mm],f [mm]`; `#` starts a comment.
fn read_points(path: &Path, system: &System) -> Result<Vec<[f64; 2]>, String> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_path(path)
        .map_err(|error| error.to_string())?;
    let mut points = Vec::new();
    let mut units: Option<[String; 2]> = None;
    for (index, record) in reader.records().enumerate() {
        let record = record.map_err(|error| error.to_string())?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != 2 {
            return Err(format!("line {line} has {} columns instead of 2", record.len()));
        }
        let is_number = |text: &str| text.parse::<f64>().is_ok();
        if is_number(&record[0]) && is_number(&record[1]) {
            points.push([0, 1].map(|i| (record[i].to_owned(), line)));
        } else if index == 0 {
            units = unit_of(&record[0]).zip(unit_of(&record[1])).map(|(r, f)| [r, f]);
        } else {
            return Err(format!("line {line}: `{},{}` are not two numbers", &record[0], &record[1]));
        }
    }
    let point = |point: [(String, u64); 2]| -> Result<[f64; 2], String> {
        let mut numbers = [0.0; 2];
        for (i, (text, line)) in point.into_iter().enumerate() {
            let unit = units.as_ref().map(|units| units[i].as_str());
            numbers[i] = system.length(&text, unit).map_err(|error| format!("line {line}: {error}"))?;
        }
        Ok(numbers)
    };
    points.into_iter().map(point).collect()
}

/// The unit in a heading, `r [mm]`.
fn unit_of(heading: &str) -> Option<String> {
    let (_, unit) = heading.strip_suffix(']')?.split_once('[')?;
    Some(unit.trim().to_owned())
}
